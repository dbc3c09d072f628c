"""What a run may have lost by elements without shape, and by surfaces that pass through themselves."""

from collections.abc import Sequence

from cutsim.analysis.doubts import doubt_distortions
from cutsim.base.terms import Bonded, Distorted, Term, offering
from cutsim.fields.state import State
from cutsim.pairs.self_intersection import SelfIntersection

#: Kind of doubt → energy that is at stake, and words with a place for its ``{share}`` of the work that is done.
Found = dict[str, tuple[float, str]]


class Distortions:
    """The worst distortions of a run so far, each with the energy that is at stake.

    Args:
        state: Displacement and time.
        terms: The terms of the problem.
    """

    def __init__(self, state: State, terms: Sequence[Term]) -> None:
        self._state, self._bodies = state, offering(terms, Distorted)
        self._worst = state.memory.value("mechanics: worst distortions", Found())
        planes = [crack.plane for crack in offering(terms, Bonded) if crack.plane is not None]
        self._intersection = SelfIntersection(state, planes)

    def watch(self, scale: float) -> None:
        """Doubt what may change more of the work than may be missing in the audit. Collective.

        What happens on the way of a jump does not count, if it is over when the body rests.

        Args:
            scale: Work that is done: the largest turnover of the audit [energy].
        """
        worst = self._worst.committed
        if not self._state.jumping:
            for kind, found in self._now().items():
                worst = worst | {kind: max(worst.get(kind, (0.0, "")), found)}
        self._worst.trial = worst
        doubt_distortions(self._state.verdict, worst, scale)

    def _now(self) -> Found:
        """Distortions of the trial state. Collective."""
        found: Found = {}
        for body in self._bodies:
            found |= body.distortions()
        through = self._intersection.found()
        if through is not None:
            # to get out of each other's way they are strained by their depth in elements, hardly by more than one
            strain = min(through.depth, 1.0)
            energy = sum((body.at_stake(through.cells, strain) for body in self._bodies), start=0.0)
            found["surface"] = energy, through.words
        return found
