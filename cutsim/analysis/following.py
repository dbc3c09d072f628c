"""Steps along an equilibrium path on which time may go back (docs/theory.md §5)."""

from dataclasses import replace

from cutsim.analysis.steps import Control, Path, PathFollowing, Problem, StepReport, failure, reported
from cutsim.base.log import collective_logger
from cutsim.fields.state import Pace
from cutsim.solvers.iterations import Outcome

logger = collective_logger(__name__)

# iterations after which the next step may be longer, its growth, and the cut of one that failed
_EASY, _GROWTH, _CUT = 5, 1.4, 0.5
# smallest step over the largest one: less than a quadrature point of a facet loses
_SMALLEST = 2.0**-9
# first step over the largest one, where the path turns
_FIRST = 0.5
# tries to meet a corner, and the distance over the step from which on it is met at its own time
_TRIES, _NEAR = 12, 1e-3
# error of the size of a step at which the state at a corner is no longer that of the path
_OFF = 0.5


def followable(problem: Problem, control: Control) -> tuple[Path, PathFollowing] | None:
    """Path of a problem and how to follow it; None if it cannot or shall not be followed. Collective."""
    path = problem.path
    return None if path is None or control.path.facets == 0 or path.obstacle else (path, control.path)


def unfollowed(problem: Problem, control: Control) -> str:
    """Where no step succeeds: why the path does not help, in words; empty if nothing can break. Collective."""
    path = problem.path
    if path is None or path.unit == 0 or control.path.facets == 0:
        return ""
    return f"The path of equilibria is not followed: {why}" if (why := path.obstacle) else "Nor does one along the path"


def follow(problem: Problem, control: Control, corner: float) -> StepReport | None:
    """A trial step along the path that does not pass the corner; None if all fail, the shortest too. Collective."""
    found = followable(problem, control)
    if found is None:
        return None
    path, following = found
    largest, pace = following.facets * path.unit, problem.state.pace.committed
    size, cuts = min(pace.path or _FIRST * largest, largest), 0
    while size >= _SMALLEST * largest:
        problem.state.rollback()
        tried = replace(_attempt(problem, control, corner, path, size), cuts=cuts)
        if tried.refusal is None:
            return tried
        logger.info("step along the path of %.3g rejected (%s)", size, tried.refusal)
        size, cuts = _CUT ** (1 + cuts) * size, cuts + 1
    problem.state.rollback()
    return None


def pace_after(problem: Problem, control: Control, tried: StepReport) -> Pace:
    """How a run goes on after a step along the path: in time again if this leads on as far as steps in time went."""
    path, pace = problem.path, problem.state.pace.committed
    assert path is not None
    if tried.corner:  # the path after it may be another one
        return Pace(repr(control), control.first, turned=True)
    if tried.dt >= pace.size:
        return Pace(repr(control), pace.size, turned=True)
    easy = not tried.cuts and tried.outcome.iterations <= _EASY
    size = min(tried.size * (_GROWTH if easy else 1.0), control.path.facets * path.unit)
    return Pace(repr(control), pace.size, path=size, turned=True)


def _attempt(problem: Problem, control: Control, corner: float, path: Path, size: float) -> StepReport:
    """Solve a step of a given size, or the shorter one that ends at the corner."""
    state, span = problem.state, problem.state.pace.committed.size
    problem.start(state.time_old + span)
    state.begin(state.time_old)
    problem.begin()
    outcome = path.follow(size, span)
    meets = outcome.converged and state.time >= corner
    if meets:
        size, outcome = _meet(problem, corner, path, (size, span), outcome)
    refusal = failure(problem, outcome)
    tried = reported(problem, outcome, refusal, size)
    if refusal is None and meets and abs(path.lost() - size) > _OFF * size:
        tried = replace(tried, refusal="the equilibrium at the corner is not that of the path")
    elif refusal is None:
        tried = replace(tried, refusal=control.accept(tried))
    return replace(tried, corner=meets)


def _meet(
    problem: Problem, corner: float, path: Path, step: tuple[float, float], outcome: Outcome
) -> tuple[float, Outcome]:
    """Go back on the path to a corner by the secant rule, and solve there in time; size of the step, and outcome."""
    state, (size, span) = problem.state, step
    before, beyond = (0.0, state.time_old), (size, state.time)
    for _ in range(_TRIES):
        if abs(state.time - corner) <= _NEAR * abs(state.time - state.time_old):
            state.begin(corner)
            problem.begin()
            return size, problem.solve("basic").after(outcome)
        slope = (beyond[0] - before[0]) / (beyond[1] - before[1]) if beyond[1] != before[1] else 0.0
        size = beyond[0] + (corner - beyond[1]) * slope
        if not 0 < size <= 2 * step[0]:
            break
        outcome = path.follow(size, span).after(outcome)
        if not outcome.converged:
            return size, outcome
        before, beyond = beyond, (size, state.time)
    return size, replace(outcome, converged=False, message="the path does not meet the corner")
