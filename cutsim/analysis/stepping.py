"""Loop over steps: each step is tried, accepted or rejected, and committed here and nowhere else.

One step: begin → move tools and loads → solve → (failure: roll back, another line search, then a smaller step) → trial
history → accept or reject → commit, record.
"""

import signal
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from math import isfinite
from types import FrameType
from typing import Literal, Protocol

from mpi4py import MPI

from cutsim.base.checks import above, at_least, between, count, positive, require, require_number
from cutsim.base.kinematics import Expr
from cutsim.base.log import collective_logger
from cutsim.base.signatures import checked
from cutsim.base.terms import Term
from cutsim.base.units import Time
from cutsim.base.verdict import INTERRUPTED
from cutsim.fields.state import Pace, State
from cutsim.solvers.iterations import LINE_SEARCHES, Outcome

logger = collective_logger(__name__)

# a step that would leave less than this fraction of itself before a corner is stretched to meet it
_SLIVER = 0.1
# change of the audit's relative closure at which a predicted step is thought to have strayed to another equilibrium
_STRAYED = 1e-3
# corners that differ by less than this fraction of the smallest step are one
_ROUNDING = 1e-6
# what the verdict says of a run that has not come to its end, until it goes on
_ENDS = (INTERRUPTED, "ended")


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


class StepError(RuntimeError):
    """Raised when no step of the smallest allowed size succeeds; the recorded history stays readable."""


@dataclass(frozen=True)
class StepReport:
    """Report of a step that was tried.

    Attributes:
        number: Its number: steps accepted so far, this one included.
        time: Time at its end [time].
        dt: Its size [time].
        outcome: What the solver did.
        damage: Largest growth of damage at a point [–].
        drift: What the energy audit misses by it, over the largest turnover so far [–].
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
    def smallest(self) -> float:
        """Step below which the run gives up [time]."""

    @property
    def line_searches(self) -> tuple[str, ...]:
        """Line searches tried in turn for the same step."""

    def accept(self, report: StepReport) -> str | None:
        """Why a step that was solved is not accepted, in words; None if it is."""

    def next(self, report: StepReport) -> float:
        """Size of the next step, after one that was accepted or not [time]."""


@checked
@dataclass(frozen=True)
class StepControl:
    """Step control: steps that grow while they are easy, and are cut where they fail.

    Args:
        first: First step, and the first one after each corner of a path [time].
        largest: Largest step [time].
        smallest: Step below which the run gives up [time]; a thousandth of `first` by default.
        growth: Factor after an easy step, > 1.
        cut: Factor after a rejected step, in (0, 1).
        easy: Newton iterations up to which a step counts as easy.
        damage: Largest growth of damage at a point in a step, in (0, 1]; None for no limit.
        closure: Largest part of the turnover that the energy audit may miss by a step; None for no limit.
        line_searches: Line searches tried in turn for the same step. For tools the default is best; for cracks in
            stiff, slender bodies ("basic", "l2", "bt").

    Raises:
        ValueError: A value is outside its range.
    """

    first: Time
    largest: Time
    smallest: Time = 0.0
    growth: float = 1.4
    cut: float = 0.5
    easy: int = 6
    damage: float | None = None
    closure: float | None = None
    line_searches: tuple[str, ...] = ("bt", "l2")

    def __post_init__(self) -> None:
        require_number("first", self.first, positive)
        require_number("largest", self.largest, at_least(self.first, "first"))
        if self.smallest == 0:
            object.__setattr__(self, "smallest", 1e-3 * self.first)
        require_number("smallest", self.smallest, between(0, self.first, "(]", name="first"))
        require_number("growth", self.growth, above(1))
        require_number("cut", self.cut, between(0, 1))
        require_number("easy", self.easy, count(1))
        require_number("damage", self.damage, between(0, 1, "(]").or_none)
        require_number("closure", self.closure, positive.or_none)
        known = len(self.line_searches) > 0 and set(self.line_searches) <= set(LINE_SEARCHES)
        require("line_searches", self.line_searches, known, f"at least one of {', '.join(LINE_SEARCHES)}")

    @classmethod
    @checked
    def fixed(cls, step: float) -> "StepControl":
        """Equal steps as long as they converge; a step that fails is cut, and later ones grow back."""
        require_number("step", step, positive)
        return cls(first=step, largest=step)

    def accept(self, report: StepReport) -> str | None:
        """Refuse a step in which damage grows too much, or the energy audit does not close."""
        if self.damage is not None and report.damage > self.damage:
            return f"damage grows by {report.damage:.3g}, more than {self.damage:g}"
        if self.closure is not None and report.drift > self.closure:
            return f"energy closure changes by {report.drift:.2g}, more than {self.closure:g}"
        return None

    def next(self, report: StepReport) -> float:
        """Grow after an easy step, cut one that failed and keep its size, start anew at a corner."""
        if report.refusal is not None:
            return self.cut * report.dt
        if report.corner:
            return self.first
        easy = not report.cuts and report.outcome.iterations <= self.easy
        return min(report.dt * self.growth if easy else report.dt, self.largest)


class Interrupted(KeyboardInterrupt):
    """Raised on all ranks when a signal has ended a run after a step; the recorded history stays readable.

    As for any Ctrl-C, ``except Exception`` lets it pass: a script does not go on as if the run were finished.

    Attributes:
        report: The last step.
    """

    def __init__(self, words: str, report: "StepReport") -> None:
        super().__init__(words)
        self.report = report


Recorder = Callable[[StepReport], None]


@checked
def run(
    problem: Problem,
    until: float,
    control: Control,
    record: Recorder = lambda _: None,
    stop: Callable[[StepReport], bool] = lambda _: False,
    *,
    interrupt: Literal["raise", "return"] = "raise",
) -> StepReport | None:
    """Advance to a time. Collective.

    Ctrl-C and SIGTERM end the run cleanly after the current step. What makes the result questionable is found in
    `state.verdict` afterwards.

    Args:
        problem: The problem; it goes on from its committed state.
        until: Time to reach [time].
        control: Step sizes.
        record: Called on all ranks after each accepted step.
        stop: Asked on all ranks after each accepted step with reduced numbers; True ends the run.
        interrupt: Whether a signal raises `Interrupted`, or the report of the last step is returned all the same.

    Returns:
        The last report, None if no step was needed.

    Raises:
        Interrupted: A signal has ended the run.
        StepError: The smallest step was reached; says when, where and why.
        ValueError: `until` is not later than the committed time, or a body is free to move.
    """
    state = problem.state
    require_number("until", until, above(state.time_old, "the present time").or_inf)
    problem.check()
    corners, report = [c for c in (*problem.corners, until) if c <= until], None
    if state.pace.committed.control != repr(control):
        state.pace.set(Pace(repr(control), control.first))
    for end in _ENDS:
        state.verdict.withdraw(end)
    with _interruptible(state.mesh.comm) as interrupted:
        while ahead := [c for c in corners if c > state.time_old + _ROUNDING * control.smallest]:
            report = _advance(problem, control, min(ahead))
            report = replace(report, interrupted=interrupted())
            record(report)
            if report.interrupted:
                words = f"interrupted at time {report.time:.6g} of {until:.6g}"
                if report.time < until:
                    state.verdict.suppose(INTERRUPTED, words, aloud=True)
                if interrupt == "raise":
                    raise Interrupted(words, report)
                break
            if stop(report):
                break
    logger.info("the run to time %.6g is %s", state.time_old, state.verdict)
    return report


def _advance(problem: Problem, control: Control, corner: float) -> StepReport:
    """One accepted step that does not pass the corner; its first try may be predicted."""
    state, cuts = problem.state, 0
    pace = state.pace.committed
    size = pace.size
    while True:
        start = state.time_old
        end = corner if start + (1 + _SLIVER) * size >= corner else start + size
        report = replace(_attempt(problem, control, end, predict=pace.smooth and not cuts), cuts=cuts)
        if report.refusal is None:
            return _accept(problem, control, replace(report, corner=end == corner), size)
        state.rollback()
        size, cuts = control.next(report), cuts + 1
        require("control.next(report)", size, size < report.dt, f"less than {report.dt:.6g} after a rejected step")
        logger.info("step to %.6g rejected (%s); next try %.3g", end, report.refusal, size)
        if size < control.smallest:
            raise _no_step(problem, control, report)


def _accept(problem: Problem, control: Control, report: StepReport, size: float) -> StepReport:
    """Commit a step; the next one follows the size that was asked for, not what was left before a corner."""
    state, start = problem.state, report.time - report.dt
    if report.cuts and control.next(replace(report, refusal="")) < control.smallest:
        state.verdict.doubt("smallest step", f"a step at time {start:.6g} needed the smallest size allowed")
    problem.watch()
    following = control.next(replace(report, dt=size))
    state.pace.trial = Pace(repr(control), following, smooth=not report.corner and not report.cuts)
    state.commit()
    return replace(report, columns=problem.record())


def _no_step(problem: Problem, control: Control, report: StepReport) -> StepError:
    """The end of a run in which no step succeeds."""
    start, advice = problem.state.time_old, problem.advise()
    problem.state.verdict.suppose("ended", f"no step succeeds from time {start:.6g} on", aloud=True)
    return StepError(
        f"no step from time {start:.6g} of {report.dt:.3g} or more succeeds "
        f"(smallest = {control.smallest:.3g}): {report.refusal}" + (f". {advice}" if advice else "")
    )


def _attempt(problem: Problem, control: Control, end: float, *, predict: bool) -> StepReport:
    """Solve the step to `end`."""
    state = problem.state
    for retry, line_search in enumerate(control.line_searches):
        state.rollback()
        begin(problem, end)
        predicted = predict and not retry
        if predicted:
            problem.predict()
        outcome = problem.solve(line_search)
        failure = _failure(problem, outcome)
        if predicted and failure is None and _drift(problem) > _STRAYED:
            failure = "the start from the last step's rate leads to another equilibrium"
        if failure is None:
            break
    report = StepReport(state.number, end, end - state.time_old, outcome, refusal=failure)
    if failure is not None:
        return report
    report = replace(report, damage=problem.damage_increment(), drift=_drift(problem))
    return replace(report, refusal=control.accept(report))


def begin(problem: Problem, end: float) -> None:
    """Start a trial step that ends at a time: the only place where the clock is moved. Collective."""
    problem.start(end)
    problem.state.begin(end)
    problem.begin()


def _drift(problem: Problem) -> float:
    """What the energy audit misses by the trial step, over the largest turnover; nothing while there was none."""
    before, after = problem.audit, problem.trial_audit
    return abs(after.gap - before.gap) / after.scale if before.scale > 0 else 0.0


def _failure(problem: Problem, outcome: Outcome) -> str | None:
    """Why a solve did not give an admissible state, in words; None if it did, and then the state is evaluated."""
    if outcome.converged:
        problem.evaluate()
        # forces can balance around an inverted element, but then its energy has no value
        if isfinite(problem.trial_audit.closure):
            return None
    why = "no admissible equilibrium" if outcome.converged else outcome.message
    where = problem.diagnose()
    return f"{why} after {outcome.iterations} iterations" + (f"; {where}" if where else "")


@contextmanager
def _interruptible(comm: MPI.Comm) -> Iterator[Callable[[], bool]]:
    """Turn the first SIGINT or SIGTERM into a question answered alike on all ranks."""
    asked = False

    def note(number: int, frame: FrameType | None) -> None:
        nonlocal asked
        if asked and number == signal.SIGINT:
            raise KeyboardInterrupt
        asked = True
        logger.warning("signal %s: the run ends after the current step", signal.Signals(number).name)

    previous = {number: signal.signal(number, note) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield lambda: bool(comm.allreduce(asked, op=MPI.LOR))
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)
