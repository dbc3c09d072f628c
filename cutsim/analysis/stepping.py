"""Loop over steps: each step is tried, accepted or rejected, and committed here and nowhere else.

One step: begin → move tools and loads → solve → (failure: roll back, another line search, a smaller step, a step along
the equilibrium path, a step with what carries it across a jump) → trial history → accept or reject → commit, record.
"""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from types import FrameType
from typing import Literal

from mpi4py import MPI

from cutsim.analysis.carriers import JUMPS, Carrier
from cutsim.analysis.following import follow, followable, pace_after, unfollowed
from cutsim.analysis.steps import (
    FOLLOWING,
    Control,
    PathFollowing,
    Problem,
    StepError,
    StepReport,
    begin,
    drift,
    failure,
    grown,
    reported,
)
from cutsim.base.checks import above, at_least, between, count, positive, require, require_number
from cutsim.base.log import collective_logger
from cutsim.base.signatures import checked
from cutsim.base.units import Time
from cutsim.base.verdict import INTERRUPTED
from cutsim.fields.state import Pace
from cutsim.solvers.iterations import LINE_SEARCHES

logger = collective_logger(__name__)

# a step that would leave less than this fraction of itself before a corner is stretched to meet it
_SLIVER = 0.1
# change of the audit's relative closure at which a predicted step is thought to have strayed to another equilibrium
_STRAYED = 1e-3
# ratio of two such changes within which they are those of one equilibrium
_SAME = 1.01
# part of its loss that a step may miss in the energy audit, beyond which it has jumped
_JUMPED = 0.02
# part of what a step across a jump sets free that it may miss, beyond which it has left the motion for another one; and
# part of the turnover that is too little to tell
_LEAPT, _TOO_LITTLE = 0.1, 1e-5
# corners that differ by less than this fraction of the smallest step are one
_ROUNDING = 1e-6
# iterations of an easy step across a jump, and the growth after it
_EASY, _RELEASE = 10, 2.0
# what the verdict says of a run that has not come to its end, until it goes on
_ENDS = (INTERRUPTED, "ended")


@checked
@dataclass(frozen=True)
class StepControl:
    """Step control: steps that grow while they are easy, and are cut where they fail.

    Args:
        first: First step, and the first one after each corner of a path [time].
        largest: Largest step [time].
        smallest: Step below which the run gives up [time]; a thousandth of `first` by default.
        growth: Factor after a step that took `easy` iterations, > 1.
        cut: Factor after a rejected step, in (0, 1); where a solve fails again its square, its cube, and so on.
        easy: Newton iterations after which a step grows by `growth`: half as many let it grow by the square, twice as
            many by the root.
        damage: Largest growth of damage at a point in a step, in (0, 1]; None for no limit.
        closure: Largest part of the turnover that the energy audit may miss by a step; None for no limit.
        line_searches: Line searches tried in turn for the same step; where steps may grow, the first one for half of
            it before. For tools the default is best; for cracks in stiff, slender bodies ("basic", "l2", "bt").
        path: How the equilibrium path is followed where no step in time succeeds.
        jumps: What carries the run across a jump where neither step nor path leads on, tried in turn: "brake", a drag
            on all nodes, which may not act under given loads; "dynamics", inertia, for which bodies need a density.

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
    path: PathFollowing = FOLLOWING
    jumps: tuple[str, ...] = JUMPS

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
        once = set(self.jumps) <= set(JUMPS) and len(set(self.jumps)) == len(self.jumps)
        require("jumps", self.jumps, once, f"some of {', '.join(JUMPS)}, each once, or none")

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
        """Grow by the iterations of a step, cut one that failed and keep its size, start anew at a corner.

        A solve that fails again is cut by more each time: where a body snaps, a step some orders smaller is needed, and
        all those in between would fail as well.
        """
        if report.refusal is not None:
            return self.cut ** (1 if report.outcome.converged else 1 + report.cuts) * report.dt
        if report.corner:
            return self.first
        return min(grown(report, self.growth, self.easy), self.largest)


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
    if not state.pace.committed.carrier:  # which holds what is free to move for a while
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
    """One accepted step that does not pass the corner: in time, or along the path where that fails."""
    state = problem.state
    pace = state.pace.committed
    followed = bool(pace.path)
    if followed and (along := follow(problem, control, corner)) is not None:
        return _accept(problem, along, pace_after(problem, control, along))
    size, cuts, carrier = pace.size, 0, _carrier(problem, pace.carrier)
    while True:
        start = state.time_old
        end = corner if start + (1 + _SLIVER) * size >= corner else start + size
        # where the last step tells where the next one leads, a smaller one is the better help; but not in a jump
        predict = pace.smooth and not (carrier and cuts)
        once = predict and not cuts and control.first < control.largest
        tried = replace(_attempt(problem, control, end, once=once, predict=predict, carrier=carrier), cuts=cuts)
        if tried.refusal is None:
            return _accept_in_time(problem, control, replace(tried, corner=end == corner), size, carrier)
        state.rollback()
        size, cuts = control.next(tried), cuts + 1
        require("control.next(report)", size, size < tried.dt, f"less than {tried.dt:.6g} after a rejected step")
        logger.info("step to %.6g rejected (%s); next try %.3g", end, tried.refusal, size)
        # a step that fails is halved before, but not one that has jumped
        early = tried.outcome.converged or control.path.onset is not None or cuts > 1
        if not (followed or carrier) and (size < control.smallest or (early and _eager(problem, control))):
            followed = True
            if (along := follow(problem, control, corner)) is not None:
                logger.info("from time %.6g the equilibrium path is followed", start)
                return _accept(problem, replace(along, cuts=cuts + along.cuts), pace_after(problem, control, along))
        if size < (carrier.shortest if carrier else control.smallest):
            carrier = _next_carrier(problem, control, carrier)
            if carrier is None:
                raise _no_step(problem, control, tried)
            size = carrier.start(control.smallest, control.first)
            logger.info("from time %.6g: %s, across a jump", start, carrier.name)


def _carrier(problem: Problem, name: str) -> Carrier | None:
    """What carries a problem across a jump, by its name; None if there is none of this name."""
    return next((carrier for carrier in problem.carriers if carrier.name == name), None)


def _next_carrier(problem: Problem, control: Control, last: Carrier | None) -> Carrier | None:
    """The first one that may be used of those that the control names after the last one; None if there is none."""
    names = control.jumps[control.jumps.index(last.name) + 1 :] if last else control.jumps
    found = (_carrier(problem, name) for name in names)
    return next((carrier for carrier in found if carrier and not carrier.obstacle), None)


def _accept_in_time(
    problem: Problem, control: Control, report: StepReport, size: float, carrier: Carrier | None
) -> StepReport:
    """Commit a step in time; the next one follows the size that was asked for, not what was left before a corner."""
    state, start = problem.state, report.time - report.dt
    if carrier:
        return _accept(problem, report, _pace_carried(problem, control, report, size, carrier))
    # carried across a jump the run would have gone on below it
    at_end = _next_carrier(problem, control, None) is None
    if report.cuts and control.next(replace(report, refusal="")) < control.smallest and at_end:
        state.verdict.doubt("smallest step", f"a step at time {start:.6g} needed the smallest size allowed")
    following = control.next(replace(report, dt=size))
    smooth, turned = not report.corner, state.pace.committed.turned
    return _accept(problem, report, Pace(repr(control), following, smooth=smooth, turned=turned))


def _pace_carried(problem: Problem, control: Control, report: StepReport, size: float, carrier: Carrier) -> Pace:
    """How a run goes on after a step across a jump: by longer ones, and as before when they are long and it rests."""
    turned, name = problem.state.pace.committed.turned, carrier.name
    size = grown(replace(report, dt=size), _RELEASE, _EASY)
    verdict, rests = problem.state.verdict, carrier.rests()
    verdict.withdraw("motion")
    if not rests:
        verdict.suppose("motion", f"the body has not come to rest at time {report.time:.6g}, after a jump")
    elif size >= control.first:
        logger.info("from time %.6g: no more %s, the body rests", report.time, name)
        name = ""
    return Pace(repr(control), min(size, control.first), smooth=not report.cuts, turned=turned, carrier=name)


def _accept(problem: Problem, report: StepReport, pace: Pace) -> StepReport:
    """Commit a step."""
    state = problem.state
    state.pace.trial = pace
    problem.watch()
    state.commit()
    return replace(report, columns=problem.record())


def _no_step(problem: Problem, control: Control, report: StepReport) -> StepError:
    """The end of a run in which no step succeeds."""
    start, obstacles = problem.state.time_old, {carrier.name: carrier.obstacle for carrier in problem.carriers}
    unused = [f"No {name} carries the run on: {why}" for name in control.jumps if (why := obstacles.get(name))]
    found = [unfollowed(problem, control), *unused, problem.advise()]
    advice = [words[0].upper() + words[1:] for words in found if words]
    problem.state.verdict.suppose("ended", f"no step succeeds from time {start:.6g} on", aloud=True)
    return StepError(
        f"no step from time {start:.6g} of {report.dt:.3g} or more succeeds "
        f"(smallest = {control.smallest:.3g}): {report.refusal}" + "".join(f". {words}" for words in advice)
    )


def _attempt(
    problem: Problem, control: Control, end: float, *, once: bool, predict: bool, carrier: Carrier | None
) -> StepReport:
    """Solve the step to `end` by the first line search that does; the first one may start where the last step leads.

    Once: a step whose first solve fails is not tried again, and after a start which has strayed it must miss no more
    than that did.
    """
    state, allowed = problem.state, _STRAYED
    for retry, line_search in enumerate(control.line_searches):
        state.rollback()
        begin(problem, end)
        if carrier:
            carrier.hold()
        predicted = predict and not retry
        if predicted:
            problem.predict()
        outcome = problem.solve(line_search)
        refusal = failure(problem, outcome)
        # what misses as much from both starts is the same equilibrium, by a long step
        strayed = refusal is None and (predicted or once) and (missed := drift(problem)) > allowed
        if strayed:
            start, allowed = "the last step's rate" if predicted else "the last state", _SAME * missed
            refusal = f"the start from {start} leads to another equilibrium"
        if refusal is None or (once and not (predicted and strayed)):
            break
    tried = reported(problem, outcome, refusal)
    if refusal is None:
        leap = _leap(problem) if carrier else _jump(problem, control, tried)
        tried = replace(tried, refusal=control.accept(tried) or leap)
    return tried


def _eager(problem: Problem, control: Control) -> bool:
    """Whether the path is followed as soon as a step in time fails, and not after smaller ones only. Collective."""
    wanted = control.path.onset is not None or problem.state.pace.committed.turned
    return wanted and followable(problem, control) is not None


def _jump(problem: Problem, control: Control, tried: StepReport) -> str | None:
    """Why a step in time that was solved may have jumped over a turn of the path, in words, or None. Collective."""
    if not _eager(problem, control) or problem.path is None:
        return None
    unit, following = problem.path.unit, control.path
    if following.onset is not None:
        limit = following.onset * unit
        return f"it loses {tried.lost:.3g}, more than {limit:.3g}" if tried.lost > limit else None
    missed = abs(problem.trial_audit.gap - problem.audit.gap)
    if tried.lost > following.facets * unit and missed > _JUMPED * tried.lost:
        return f"{missed / tried.lost:.1%} of what it loses is missing in the energy audit: it has jumped"
    return None


def _leap(problem: Problem) -> str | None:
    """Why a step across a jump that was solved does not resolve it, in words, or None. Collective.

    What the body sets free in such a step is small beside the turnover, and so is what it misses where it has come to
    another equilibrium than the one to which the motion leads.
    """
    before, after = problem.audit, problem.trial_audit
    missed, freed = abs(after.gap - before.gap), abs(after.freed - before.freed)
    if missed <= max(_LEAPT * freed, _TOO_LITTLE * after.scale):
        return None
    return f"{missed:.3g} is missing in the energy audit, beside {freed:.3g} that is set free: it has left the motion"


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
