"""What is advanced in steps, and what is known and decided of a step: the protocols of the loop over steps."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import isfinite
from typing import Protocol

from cutsim.analysis.carriers import Carrier
from cutsim.base.checks import nonnegative, positive, require_number
from cutsim.base.kinematics import Expr
from cutsim.base.signatures import checked
from cutsim.base.terms import Term
from cutsim.fields.state import State
from cutsim.solvers.iterations import Outcome


class Audit(Protocol):
    """Protocol of an audit of a conserved quantity."""

    @property
    def scale(self) -> float:
        """The largest turnover so far, to which the closure is relative."""

    @property
    def gap(self) -> float:
        """What is missing."""

    @property
    def closure(self) -> float:
        """What is missing, relative to the largest turnover so far [–]."""

    @property
    def freed(self) -> float:
        """What is lost by now, or in motion; nothing of what is only exchanged."""


class Path(Protocol):
    """Protocol of the equilibrium path of a problem, on which time may go back.

    Attributes:
        unit: Energy that breaks a facet of mean size, by which steps are chosen.
    """

    unit: float

    @property
    def obstacle(self) -> str | None:
        """Why the path cannot be followed, in words, or None. Collective."""

    def lost(self) -> float:
        """What the trial step has lost by fracture, after it was evaluated [energy]. Collective."""

    def follow(self, size: float, span: float) -> Outcome:
        """Find equilibrium and time where the trial step has a given size, from the present ones on. Collective.

        Args:
            size: What it loses [energy].
            span: Largest change of time in an iteration [time].
        """


class Problem(Protocol):
    """Protocol of what `run` can step: `Mechanics`, `HeatTransfer`, or both as `ThermoMechanics`.

    Attributes:
        state: Displacement and time.
    """

    state: State

    @property
    def terms(self) -> Sequence[Term]:
        """Its terms."""

    @property
    def fields(self) -> Mapping[str, Expr]:
        """Fields beside the displacement for output, by name."""

    @property
    def corners(self) -> tuple[float, ...]:
        """Times that steps have to meet exactly."""

    @property
    def path(self) -> Path | None:
        """Its equilibrium path; None if there is none without time. Collective."""

    @property
    def carriers(self) -> Sequence[Carrier]:
        """What may carry a run across a jump; none if it does not jump."""

    @property
    def audit(self) -> Audit:
        """Audit of the committed state."""

    @property
    def trial_audit(self) -> Audit:
        """Audit including the trial step."""

    def refresh(self) -> None:
        """Forget what solvers have factorised. Collective."""

    def check(self) -> None:
        """Refuse, before anything is solved, what has no solution. Collective."""

    def advise(self) -> str:
        """What may be tried where no step succeeds, in words; empty if nothing is known."""

    def start(self, end: float) -> None:
        """Take over the committed state, if no step has begun yet; the first one ends at `end`. Collective."""

    def begin(self) -> None:
        """Start the trial step that the state has begun. Collective."""

    def predict(self) -> None:
        """Start the search for the trial state from where the last step leads."""

    def solve(self, line_search: str | None = None) -> Outcome:
        """Solve the trial step. Collective."""

    def evaluate(self) -> None:
        """Trial history and audit of the solved step. Collective."""

    def damage_increment(self) -> float:
        """Largest growth of damage at a point in the trial step. Collective."""

    def watch(self) -> None:
        """Say in the verdict of the state what makes the trial step, which is accepted, questionable. Collective."""

    def diagnose(self) -> str:
        """After a failed solve: what is wrong and where, in words. Collective."""

    def record(self) -> dict[str, tuple[float, str]]:
        """Columns of the history row: name → (value, kind of quantity). Collective."""


@checked
@dataclass(frozen=True)
class PathFollowing:
    """Path following by dissipation: time becomes an unknown, and a step has a given loss by fracture.

    Where the equilibrium path turns back, as a short crack in a stiff body lets it, there is no equilibrium at a later
    time near by. The path is followed through the turn, by steps in which time may go back, until time leads on again.

    Args:
        facets: Largest loss of a step along the path, in units of the energy that breaks a facet of mean size; 0 for
            never.
        onset: Largest loss of a step in time, in the same units; one that loses more is done anew along the path.
            None: there is no limit; but once the path had to be followed, as no step in time succeeded, a step in time
            that has jumped, by its energy audit, is done anew as well.

    Raises:
        ValueError: A value is outside its range.
    """

    facets: float = 1.0
    onset: float | None = None

    def __post_init__(self) -> None:
        require_number("facets", self.facets, nonnegative)
        require_number("onset", self.onset, positive.or_none)


#: With steps that lose as much as a facet, where nothing else helps.
FOLLOWING = PathFollowing()


class StepError(RuntimeError):
    """Raised when no step of the smallest allowed size succeeds; the recorded history stays readable."""


@dataclass(frozen=True)
class StepReport:
    """Report of a step that was tried.

    Attributes:
        number: Its number: steps accepted so far, this one included.
        time: Time at its end [time].
        dt: Its size, negative where a path leads back in time [time].
        outcome: What the solver did.
        damage: Largest growth of damage at a point [–].
        drift: What the energy audit misses by it, over the largest turnover so far [–].
        lost: What it loses by fracture, where an equilibrium path can be followed [energy].
        size: Its size along the path that it follows; 0 for a step in time [energy].
        refusal: Why it is not accepted, in words; None if it is.
        cuts: Attempts that were rejected since the last accepted step.
        corner: Whether it ends at a corner of a path or load, or at the end of the run.
        interrupted: Whether a signal ended the run after it.
        columns: History columns, name → (value, kind of quantity).
    """

    number: int
    time: float
    dt: float
    outcome: Outcome
    damage: float = 0.0
    drift: float = 0.0
    lost: float = 0.0
    size: float = 0.0
    refusal: str | None = None
    cuts: int = 0
    corner: bool = False
    interrupted: bool = False
    columns: dict[str, tuple[float, str]] = field(default_factory=dict)


class Control(Protocol):
    """Protocol of a step control: the sizes of the steps, and which are accepted; see docs/adding_a_step_control.md."""

    @property
    def first(self) -> float:
        """First step [time]."""

    @property
    def largest(self) -> float:
        """Size to which steps may grow [time]; where it is `first`, all of them are to be equal."""

    @property
    def smallest(self) -> float:
        """Step below which the run gives up [time]."""

    @property
    def line_searches(self) -> tuple[str, ...]:
        """Line searches tried in turn for the same step; where steps may grow, the first one for half of it before."""

    @property
    def path(self) -> PathFollowing:
        """How the equilibrium path is followed where no step in time succeeds."""

    @property
    def jumps(self) -> tuple[str, ...]:
        """What carries the run across a jump, by name and in turn, where neither step nor path leads on."""

    def accept(self, report: StepReport) -> str | None:
        """Why a step that was solved is not accepted, in words; None if it is."""

    def next(self, report: StepReport) -> float:
        """Size of the next step, after one that was accepted or not [time]."""


def grown(report: StepReport, growth: float, easy: int) -> float:
    """Size of the step after an accepted one, by its iterations; that of one that was cut first.

    Args:
        report: The step.
        growth: Factor after one that took `easy` iterations; half as many or less let it grow by the square, twice as
            many by the root. So steps do not stay short where all of them are hard.
        easy: This number of iterations.
    """
    power = 0.0 if report.cuts else easy / max(report.outcome.iterations, 0.5 * easy)
    return float(growth**power * report.dt)


def begin(problem: Problem, end: float) -> None:
    """Start a step that ends at a time. Collective."""
    problem.start(end)
    problem.state.begin(end)
    problem.begin()


def drift(problem: Problem) -> float:
    """What the energy audit misses by the trial step, over the largest turnover; nothing while there was none."""
    before, after = problem.audit, problem.trial_audit
    return abs(after.gap - before.gap) / after.scale if before.scale > 0 else 0.0


def failure(problem: Problem, outcome: Outcome) -> str | None:
    """Why a solve did not give an admissible state, in words; None if it did, and then the state is evaluated."""
    if outcome.converged:
        problem.evaluate()
        # forces can balance around an inverted element, but then its energy has no value
        if isfinite(problem.trial_audit.closure):
            return None
    why = "no admissible equilibrium" if outcome.converged else outcome.message
    where = problem.diagnose()
    return f"{why} after {outcome.iterations} iterations" + (f"; {where}" if where else "")


def reported(problem: Problem, outcome: Outcome, refusal: str | None, size: float = 0.0) -> StepReport:
    """Report of the trial step; its numbers are those of a state that was evaluated, if it is not refused."""
    state = problem.state
    tried = StepReport(state.number, state.time, state.time - state.time_old, outcome, size=size, refusal=refusal)
    if refusal is not None:
        return tried
    path = problem.path
    lost = path.lost() if path is not None else 0.0
    return replace(tried, damage=problem.damage_increment(), drift=drift(problem), lost=lost)
