"""Loop over steps, the only place that commits.

One step: begin → move tools and loads → solve → (failure: roll back, another line search, then a smaller step) → trial
history → accept or reject → commit, record.
"""

import signal
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from math import isfinite
from types import FrameType
from typing import Literal, Protocol

from mpi4py import MPI

from cutsim.base.checks import above, at_least, between, count, positive, require, require_number
from cutsim.base.kinematics import Expr
from cutsim.base.log import collective_logger
from cutsim.base.signatures import checked
from cutsim.base.terms import Term
from cutsim.fields.state import State
from cutsim.solvers.iterations import LINE_SEARCHES, Outcome

logger = collective_logger(__name__)

# a step that would leave less than this fraction of itself before a corner is stretched to meet it
_SLIVER = 0.1
# change of the audit's relative closure at which a predicted step is thought to have strayed to another equilibrium
_STRAYED = 1e-3
# corners that differ by less than this fraction of the smallest step are one
_ROUNDING = 1e-6


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

    def check(self) -> None:
        """Refuse, before anything is solved, what has no solution. Collective."""

    def advise(self) -> str:
        """What may be tried where no step succeeds, in words; empty if nothing is known."""

    def begin(self, time: float) -> None:
        """Start a trial step that ends at `time`."""

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

    def rollback(self) -> None:
        """Give the trial step up, bit for bit."""

    def commit(self) -> None:
        """Adopt the trial step."""


class StepError(RuntimeError):
    """Raised when no step of the smallest allowed size succeeds; the recorded history stays readable."""


@checked
@dataclass(frozen=True)
class StepControl:
    """Step control: sizes of the steps, and limits on them.

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

    first: float
    largest: float
    smallest: float = 0.0
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


@dataclass
class StepReport:
    """Report of an accepted step, for recorders.

    Attributes:
        number: Steps accepted so far.
        time: Time at its end [time].
        dt: Its size [time].
        outcome: What the solver did.
        cuts: Rejected attempts since the previous accepted step.
        interrupted: Whether a signal ended the run after this step.
        columns: History columns, name → (value, kind of quantity).
    """

    number: int
    time: float
    dt: float
    outcome: Outcome
    cuts: int
    interrupted: bool = False
    columns: dict[str, tuple[float, str]] = field(default_factory=dict)


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
    control: StepControl,
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
    corners = [c for c in (*problem.corners, until) if c <= until]
    dt, report, number = control.first, None, 0
    smooth = False  # whether the last step tells where the next one leads
    with _interruptible(state.mesh.comm) as interrupted:
        while ahead := [c for c in corners if c > state.time_old + _ROUNDING * control.smallest]:
            corner = min(ahead)
            report = _advance(problem, control, dt, corner, predict=smooth)
            number += 1
            report.number = number
            report.interrupted = interrupted()
            record(report)
            if report.interrupted:
                words = f"interrupted at time {report.time:.6g} of {until:.6g}"
                if report.time < until:
                    state.verdict.doubt("interrupted", words)
                if interrupt == "raise":
                    raise Interrupted(words, report)
                break
            if stop(report):
                break
            at_corner = state.time_old == corner
            dt = _next_step(control, report, dt, at_corner=at_corner)
            smooth = not at_corner and not report.cuts
    logger.info("the run to time %.6g is %s", state.time_old, state.verdict)
    return report


def _advance(problem: Problem, control: StepControl, dt: float, corner: float, *, predict: bool) -> StepReport:
    """One accepted step of at most dt that does not pass the corner; its first try may be predicted."""
    state, cuts = problem.state, 0
    while True:
        start = state.time_old
        end = corner if start + (1 + _SLIVER) * dt >= corner else start + dt
        outcome, refusal = _attempt(problem, control, end, predict=predict and not cuts)
        if refusal is None:
            size = end - start
            if cuts and control.cut * size < control.smallest:
                state.verdict.doubt("smallest step", f"a step at time {start:.6g} needed the smallest size allowed")
            problem.watch()
            problem.commit()
            return StepReport(0, end, size, outcome, cuts, columns=problem.record())
        problem.rollback()
        cuts += 1
        dt = control.cut * (end - start)
        logger.info("step to %.6g rejected (%s); next try %.3g", end, refusal, dt)
        if dt < control.smallest:
            problem.state.verdict.doubt("ended", f"no step succeeds from time {start:.6g} on")
            raise StepError(
                f"no step from time {start:.6g} of {dt / control.cut:.3g} or more succeeds "
                f"(smallest = {control.smallest:.3g}): {refusal}"
                + (f". {advice}" if (advice := problem.advise()) else "")
            )


def _attempt(problem: Problem, control: StepControl, end: float, *, predict: bool) -> tuple[Outcome, str | None]:
    """Solve the step to `end`; the outcome, and why it is refused, None if it is accepted."""
    for retry, line_search in enumerate(control.line_searches):
        problem.rollback()
        problem.begin(end)
        predicted = predict and not retry
        if predicted:
            problem.predict()
        outcome = problem.solve(line_search)
        failure = _failure(problem, outcome)
        if predicted and failure is None and _drift(problem) > _STRAYED:
            failure = "the start from the last step's rate leads to another equilibrium"
        if failure is None:
            break
    else:
        return outcome, failure
    growth = problem.damage_increment()
    if control.damage is not None and growth > control.damage:
        return outcome, f"damage grows by {growth:.3g}, more than {control.damage:g}"
    drift = _drift(problem)
    if control.closure is not None and drift > control.closure:
        return outcome, f"energy closure changes by {drift:.2g}, more than {control.closure:g}"
    return outcome, None


def _drift(problem: Problem) -> float:
    """What the books miss by the trial step, over the largest turnover; nothing while there was none."""
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


def _next_step(control: StepControl, report: StepReport, dt: float, *, at_corner: bool) -> float:
    """Grow after an easy step, keep the size of a cut one, start anew at a corner."""
    if at_corner:
        return control.first
    size = min(dt, report.dt) if report.cuts else dt
    if not report.cuts and report.outcome.iterations <= control.easy:
        size *= control.growth
    return min(size, control.largest)


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
