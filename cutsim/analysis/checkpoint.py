"""Checkpoints: the committed state of a problem, from which another process can continue."""

from cutsim.analysis.steps import Problem
from cutsim.base.memory import Snapshot
from cutsim.base.signatures import checked


def save(problem: Problem) -> Snapshot:
    """The committed state on this rank, of problem, loop over steps and recorders. Collective.

    Solvers forget what they have factorised: the run goes on as one that starts from the snapshot does.
    """
    problem.refresh()
    return problem.state.memory.save()


@checked
def load(problem: Problem, snapshot: Snapshot) -> None:
    """Bring a problem, which was built as the one that was saved, to a saved state. Collective.

    Raises:
        ValueError: The snapshot is that of another problem.
    """
    problem.state.memory.load(snapshot)
    problem.refresh()
