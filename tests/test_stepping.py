"""Rejected steps leave no trace, failures are named, corners are met, and a signal ends a run after its step."""

import signal
from dataclasses import replace

import numpy as np
import pytest
import ufl
from mpi4py import MPI

from cutsim.analysis import stepping
from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.stepping import Interrupted, StepControl, StepError, StepReport, begin, run
from cutsim.base.terms import Energetic, Term, offering
from cutsim.bodies.loads import Support, Traction
from cutsim.bodies.solid import Solid
from cutsim.fields.points import Surface
from cutsim.interface.cohesive import Exponential
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.friction import SmoothCoulomb
from cutsim.materials.elastic import NeoHookean
from cutsim.results.output import read_history
from cutsim.results.recording import Recording
from cutsim.solvers.iterations import Outcome
from cutsim.tools.shapes import Plane, ToolPath
from cutsim.tools.tool_contact import ToolContact
from helpers.blocks import make_blocks
from helpers.examples import CONTROLS
from helpers.laws import EXPONENTIAL, NU, E
from helpers.runs import history

WEAK = Exponential(toughness=0.1, opening=0.1, shear_toughness=0.08, shear_opening=0.15)


def everything(comm=MPI.COMM_WORLD):
    """A problem with every kind of term: body, viscosity, crack with multipliers, rough tool, load, supports."""
    b = make_blocks(n=4, comm=comm)
    path = ToolPath.polyline([0, 1], [(0.5, 1.02), (0.6, 0.92)])
    left, right = b.face(0, 0.0), b.face(0, 1.0)
    crack = b.crack(WEAK, allowed_penetration=1e-4, contact=PenaltyContact(20.0))
    plate = ToolContact(
        b.state,
        Plane((0.0, -1.0)),
        path,
        [Surface.exterior(b.state, b.face(1, 1.0))],
        contact=PenaltyContact(30.0, 0.01),
        friction=SmoothCoulomb(0.3, 1e-3),
    )
    load = Traction(b.state, right, (0.02, 0.0), lambda t: t)
    solid = b.solid(NeoHookean(E, NU), viscosity=0.01)
    supports = [
        Support(b.state, b.face(1, 0.0), 0),
        Support(b.state, b.face(1, 0.0), 1, lambda t: 0.02 * t, name="base"),
        Support(b.state, left, 0),
    ]
    return Mechanics(b.state, [solid, crack, plate, load], supports)


def opening_blocks(comm=MPI.COMM_WORLD, law=WEAK):
    """Two blocks pulled apart until the crack between them has broken."""
    b = make_blocks(comm=comm)
    supports = [Support(b.state, b.face(1, 0.0), i) for i in range(2)]
    supports.append(Support(b.state, b.face(1, 1.0), 1, lambda t: t, name="top"))
    return Mechanics(b.state, [b.solid(NeoHookean(E, NU)), b.crack(law)], supports)


def snapshot(mechanics):
    """Every number that a step may change, as bytes."""
    state, (_, crack, plate, load) = mechanics.state, mechanics.terms
    arrays = [state.u.x.array, state.u_old.x.array, crack.history.secants.x.array, crack.history.multiplier.x.array]
    arrays += [plate.position.value, plate._position.committed, load._scale.value]
    arrays += [s._value.value for s in mechanics.supports]
    arrays += [crack.point_values(name) for name in ("damage", "opening", "pressure", "dissipated")]
    arrays += [plate.force(), plate.moment(), [state.time, state.time_old]]
    energies = [value for term in offering(mechanics.terms, Energetic) for value in term.energies().values()]
    record = [value for value, _ in mechanics.record().values()]
    return [np.asarray(a, dtype=float).tobytes() for a in [*arrays, energies, record]]


@pytest.mark.mpi
def test_rollback_is_bit_for_bit():
    mechanics = everything()
    run(mechanics, 0.5, StepControl.fixed(0.1))
    before = snapshot(mechanics)
    crack = mechanics.terms[1]
    assert mechanics.state.mesh.comm.allreduce(crack.history.multiplier.x.array.any(), MPI.LOR), (
        "the test needs multipliers"
    )
    begin(mechanics, 0.8)
    assert mechanics.solve().converged
    mechanics.evaluate()
    assert snapshot(mechanics) != before
    mechanics.state.rollback()
    assert snapshot(mechanics) == before


class Failing:
    """Makes chosen solves of a problem fail, leaving rubbish in the unknown."""

    def __init__(self, mechanics, fail):
        self.mechanics, self.fail, self.calls, self.searches = mechanics, fail, 0, []
        self._solve, mechanics.solve = mechanics.solve, self

    def __call__(self, line_search=None):
        from dataclasses import replace

        outcome = self._solve(line_search)
        self.calls += 1
        self.searches.append(line_search)
        if self.fail(self.calls):
            self.mechanics.state.u.x.array[:] = np.nan
            return replace(outcome, converged=False, message="made to fail")
        return outcome


@pytest.mark.mpi
def test_run_goes_on_after_failures():
    """The third step fails and is halved, fails by both line searches and is cut by more.

    The end is that of a run with the same times.
    """
    control = StepControl(0.05, 0.1, growth=1.1, line_searches=("basic", "bt"))
    failing = everything()
    watch = Failing(failing, lambda call: call in (3, 4, 5))
    reports = []
    run(failing, 1.0, control, reports.append)
    assert watch.searches[2:6] == ["basic", "basic", "bt", "basic"]
    assert [r.cuts for r in reports[:4]] == [0, 0, 2, 0]
    assert reports[2].dt == pytest.approx(control.next(reports[1]) / 2 / 4)
    assert reports[-1].time == 1.0
    again = everything()
    for report in reports:
        begin(again, report.time)
        assert again.solve("basic").converged
        again.evaluate()
        again.state.commit()
    # what is kept of a factorisation differs, so the iterates do, within the tolerance of the solver
    scale = max(abs(v) for v, _ in again.record().values())
    for name, (value, _) in again.record().items():
        assert failing.record()[name][0] == pytest.approx(value, abs=1e-6 * scale), name


def test_another_line_search_saves_the_step():
    mechanics = opening_blocks()
    watch = Failing(mechanics, lambda call: call == 1)
    report = run(mechanics, 0.1, StepControl.fixed(0.1))
    assert report.cuts == 0
    assert watch.searches == ["bt", "l2"]


@pytest.mark.parametrize(("problem", "doubted"), [(everything, True), (opening_blocks, False)])
def test_the_smallest_step_is_doubted_where_nothing_carries_on(problem, doubted):
    mechanics = problem()
    assert all(carrier.obstacle for carrier in mechanics.carriers) == doubted
    Failing(mechanics, lambda call: call <= 2)
    report = run(mechanics, 0.2, StepControl(0.1, 0.1, smallest=0.05), stop=lambda report: True)
    assert report.cuts == 1 and report.dt == pytest.approx(0.05)
    assert ("smallest step" in mechanics.state.verdict.doubts) == doubted


def test_smallest_step_is_named_and_history_is_kept(tmp_path):
    """A block pressed through itself: no step gets through, and the error says when, where and why."""
    b = make_blocks()
    supports = [Support(b.state, b.face(1, 0.0), i) for i in range(2)]
    supports.append(Support(b.state, b.face(1, 1.0), 1, lambda t: -t if t < 0.35 else -2.0, name="top"))
    mechanics = Mechanics(b.state, [b.solid(NeoHookean(E, NU), name="gel"), b.crack(WEAK)], supports)
    with pytest.raises(StepError) as error, Recording(tmp_path, mechanics, 1.0) as record:
        run(mechanics, 1.0, StepControl(0.1, 0.1, smallest=0.02), record)
    message = str(error.value)
    for word in ("from time 0.3", "smallest = 0.02", "iterations", "crack: largest opening"):
        assert word in message
    rows = read_history(tmp_path / "history.csv")
    assert rows["time"][-1] == pytest.approx(mechanics.state.time_old)
    assert (tmp_path / "displacement.bp").exists()
    assert rows["top_force"][-1] == pytest.approx(record.history["top_force"][-1])
    assert mechanics.state.time == mechanics.state.time_old == pytest.approx(0.34, abs=0.02)
    assert mechanics.terms[0].diagnose() is None, "the state is the last good one"


def test_a_step_without_convergence_says_after_how_many_iterations():
    b = make_blocks()
    supports = [Support(b.state, b.face(1, 0.0), i) for i in range(2)]
    supports.append(Support(b.state, b.face(1, 1.0), 1, lambda t: t))
    terms = [b.solid(NeoHookean(E, NU)), b.crack(WEAK)]
    mechanics = Mechanics(b.state, terms, supports, petsc_options={"snes_max_it": 1})
    with pytest.raises(StepError, match=r"succeeds \(smallest = 0.1\): no convergence after 1 iterations"):
        run(mechanics, 0.1, StepControl(0.1, 0.1, smallest=0.1))


def test_limit_on_damage_makes_steps_smaller():
    free, limited = [], []
    run(opening_blocks(), 0.6, StepControl.fixed(0.05), free.append)
    mechanics = opening_blocks()
    growth = []
    crack = mechanics.terms[1]
    commit = mechanics.state.commit
    mechanics.state.commit = lambda: (growth.append(crack.damage_increment()), commit())
    run(mechanics, 0.6, StepControl(0.05, 0.05, damage=0.05), limited.append)
    assert 0.02 < max(growth) <= 0.05
    assert sum(r.cuts for r in limited) > 0 == sum(r.cuts for r in free)
    assert crack.record()["crack_broken"][0] > 0.9


def test_limit_on_closure_makes_steps_smaller():
    reports = []
    run(opening_blocks(), 0.6, StepControl(0.05, 0.05, closure=2e-4), reports.append)
    closures = np.array([0.0, *[r.columns["energy_closure"][0] for r in reports]])
    assert np.abs(np.diff(closures)).max() <= 2e-4
    assert sum(r.cuts for r in reports) > 0


class Stubborn(StepControl):
    """A control that tries the same step for ever."""

    def accept(self, report):
        return "never"

    def next(self, report):
        return report.dt


def test_a_control_has_to_shorten_a_rejected_step():
    with pytest.raises(ValueError, match=r"control.next\(report\) = 0.1 is not allowed.*less than 0.1"):
        run(opening_blocks(), 0.6, Stubborn(0.1, 0.1))


def test_every_corner_is_met():
    """Corners of a support, of a load and of a path, though no multiple of the step; none is passed by rounding."""
    b = make_blocks()
    supports = [Support(b.state, b.face(1, 0.0), i, corners=(0.123,)) for i in range(2)]
    load = Traction(b.state, b.face(1, 1.0), (0.0, -1e-3), lambda t: t, corners=(0.3, 0.7))
    plate = ToolContact(
        b.state,
        Plane((0.0, -1.0)),
        ToolPath.polyline([0.1 * 3, 0.5], [(0, 2), (0, 3)]),
        [Surface.exterior(b.state, b.face(1, 1.0))],
        contact=PenaltyContact(1.0),
    )
    mechanics = Mechanics(b.state, [b.solid(), b.crack(EXPONENTIAL), load, plate], supports)
    rows = history(mechanics, 1.0, StepControl(0.04, 0.2, growth=2.0))
    assert {0.123, 0.3, 0.5, 0.7, 1.0} <= set(rows["time"])
    steps = np.diff([0.0, *rows["time"]])
    assert steps.min() > 1e-3, "corners that differ by rounding are one"
    assert steps.max() <= 0.2 * 1.1


def test_a_start_that_strays_is_given_up_but_not_the_size_of_the_step(monkeypatch):
    """The step is solved anew from the last state, by the other line search, and none is cut."""
    mechanics, control, reports = everything(), StepControl(0.05, 0.1, growth=1.1), []
    watch = Failing(mechanics, lambda call: False)
    monkeypatch.setattr(stepping, "drift", lambda problem: 1.0 if watch.calls == 2 else 0.0)
    run(mechanics, 0.3, control, reports.append)
    assert watch.searches[:4] == ["bt", "bt", "l2", "bt"]
    assert not any(r.cuts for r in reports)
    assert reports[1].dt == pytest.approx(control.next(reports[0]))


def test_a_step_that_jumps_from_the_last_state_is_cut(monkeypatch):
    """The start from the last step's rate misses some energy, that from the last state more: the step is too long."""
    mechanics, control, reports = everything(), StepControl(0.05, 0.1, growth=1.1), []
    watch = Failing(mechanics, lambda call: False)
    monkeypatch.setattr(stepping, "drift", lambda problem: {2: 0.1, 3: 0.2}.get(watch.calls, 0.0))
    run(mechanics, 0.3, control, reports.append)
    assert watch.searches[:4] == ["bt", "bt", "l2", "bt"]
    assert [r.cuts for r in reports[:2]] == [0, 1]


def test_equal_steps_are_kept_by_another_line_search():
    mechanics = everything()
    watch = Failing(mechanics, lambda call: call == 2)
    reports = []
    run(mechanics, 0.6, StepControl.fixed(0.2), reports.append)
    assert watch.searches == ["bt", "bt", "l2", "bt"] and [r.time for r in reports] == pytest.approx([0.2, 0.4, 0.6])


@pytest.mark.parametrize(("iterations", "power"), [(1, 2), (3, 2), (4, 1.5), (6, 1), (12, 0.5), (24, 0.25)])
def test_steps_grow_the_less_the_more_iterations_they_take(iterations, power):
    control, solved = StepControl(1e-3, 1.0, growth=1.5, easy=6), Outcome(True, 2, "converged", iterations, 0, ())
    report = StepReport(1, 1.0, 4e-3, solved)
    assert control.next(report) == pytest.approx(1.5**power * 4e-3)
    assert control.next(replace(report, dt=1.0)) == 1.0
    assert control.next(replace(report, cuts=1)) == 4e-3 and control.next(replace(report, corner=True)) == 1e-3


def test_a_solve_that_fails_again_is_cut_by_more():
    """A refusal of a step that was solved is not: its error falls with its size."""
    control, failed = StepControl(1e-2, 1.0, cut=0.5), Outcome(False, -1, "no convergence", 25, 0, ())
    report = StepReport(1, 1.0, 1.0, failed, refusal="no convergence")
    assert [control.next(replace(report, cuts=cuts)) for cuts in range(3)] == [0.5, 0.25, 0.125]
    solved = replace(report, outcome=replace(failed, converged=True))
    assert [control.next(replace(solved, cuts=cuts)) for cuts in range(3)] == [0.5, 0.5, 0.5]


def test_steps_grow_to_the_largest():
    rows = history(opening_blocks(law=EXPONENTIAL), 0.02, StepControl(1e-3, 4e-3, growth=1.5))
    steps = np.diff([0.0, *rows["time"]])
    assert steps[0] == 1e-3 and 2e-3 < steps[1] < steps[2]
    assert steps.max() <= 4e-3 * 1.1


def test_a_column_to_show_that_does_not_exist_is_named(tmp_path):
    mechanics, misspelt = opening_blocks(), {"force": "top_forc"}
    with (
        pytest.raises(ValueError, match=r"^show = 'top_forc' .* must be one of the columns .*top_force"),
        Recording(tmp_path, mechanics, 0.1, show=misspelt, quiet=True) as record,
    ):
        run(mechanics, 0.1, StepControl.fixed(0.1), record)


def test_stop_ends_the_run():
    report = run(opening_blocks(), 1.0, StepControl.fixed(0.05), stop=lambda r: r.number == 3)
    assert (report.number, report.time) == (3, pytest.approx(0.15))


@pytest.mark.mpi
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signal_ends_the_run_after_its_step(number, tmp_path):
    """Sent to one rank only, in the middle of a step: all ranks stop after it, with all they have on disk."""
    comm = MPI.COMM_WORLD
    folder = comm.bcast(tmp_path)
    mechanics = opening_blocks()
    solve = mechanics.solve

    def solve_interrupted(line_search=None):
        if mechanics.state.time > 0.12 and comm.rank == 0 and not interrupted:
            interrupted.append(True)
            signal.raise_signal(number)
        return solve(line_search)

    interrupted, before = [], signal.getsignal(number)
    mechanics.solve = solve_interrupted
    with (
        pytest.raises(Interrupted, match=r"interrupted at time 0\.15 of 1") as end,
        Recording(folder, mechanics, 1.0) as record,
    ):
        run(mechanics, 1.0, StepControl.fixed(0.05), record)
    report = end.value.report
    assert report.interrupted and report.time == pytest.approx(0.15)
    assert not isinstance(end.value, Exception), "a loop that goes on after any Exception ends"
    assert signal.getsignal(number) == before
    comm.barrier()
    rows = read_history(folder / "history.csv")
    np.testing.assert_allclose(rows["time"], [0.05, 0.1, 0.15])
    np.testing.assert_allclose(rows["top_force"], record.history["top_force"], rtol=1e-6)
    mechanics.solve = solve
    assert run(mechanics, 0.2, StepControl.fixed(0.05)).time == 0.2, "and the run can go on"


@pytest.mark.parametrize("control", CONTROLS.values(), ids=CONTROLS)
def test_a_control_shortens_rejected_steps(control):
    """From reports made by hand: a smaller step after every rejection, and a positive one after what it accepts."""
    solved = Outcome(True, 2, "converged", 5, 5, (1.0, 1e-9))
    for dt in np.geomspace(control.smallest, control.first, 9):
        tried = StepReport(1, 1.0, float(dt), solved)
        assert control.accept(tried) is None, "nothing speaks against it"
        assert control.next(tried) > 0
        for refusal in ("", "too large"):
            assert 0 < control.next(replace(tried, refusal=refusal)) < dt


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        ({"first": 0}, "first"),
        ({"largest": 0.05}, "largest"),
        ({"smallest": 0.2}, "smallest"),
        ({"growth": 1.0}, "growth"),
        ({"cut": 1.0}, "cut"),
        ({"damage": 0.0}, "damage"),
        ({"closure": 0.0}, "closure"),
        ({"line_searches": ()}, "line_searches"),
    ],
)
def test_refuses_what_cannot_step(arguments, name):
    with pytest.raises(ValueError, match=f"{name} = .* is not allowed"):
        StepControl(**{"first": 0.1, "largest": 0.1, **arguments})


def test_refuses_a_time_in_the_past():
    mechanics = opening_blocks()
    run(mechanics, 0.1, StepControl.fixed(0.1))
    with pytest.raises(ValueError, match=r"until = 0.1 is not allowed"):
        run(mechanics, 0.1, StepControl.fixed(0.1))


def test_refuses_ambiguous_names():
    b = make_blocks()
    with pytest.raises(ValueError, match=r"names = .* is not allowed"):
        Mechanics(b.state, [b.solid(cells=b.lower), b.solid(cells=b.upper)])
    with pytest.raises(ValueError, match="terms = 0 is not allowed"):
        Mechanics(b.state, [])
    assert isinstance(b.solid().residual(ufl.TestFunction(b.state.V)), ufl.Form)


class Unwritten(Term):
    name = "unwritten"

    def residual(self, v):
        """Forgets to return what it has written."""
        ufl.inner(v, v)


@pytest.mark.mpi
def test_what_is_no_term_is_refused_by_its_place_and_what_writes_no_form_by_name():
    b = make_blocks()
    with pytest.raises(ValueError, match=r"^terms\[1\] = None is not allowed: it must be a Term$"):
        Mechanics(b.state, [b.solid(), None])
    with pytest.raises(ValueError, match=r"^terms\[0\] = <class .*Solid'> is not allowed: it must be a Term$"):
        Mechanics(b.state, (Solid,))
    with pytest.raises(ValueError, match=r"^supports\[0\] = .* is not allowed: it must be a Support$"):
        Mechanics(b.state, [b.solid()], [b.solid()])
    with pytest.raises(ValueError, match=r"^residual of 'unwritten' = None is not allowed: it must be a ufl.Form"):
        Mechanics(b.state, [b.solid(), Unwritten()])


@pytest.mark.parametrize("step", [float("inf"), float("nan"), 0.0, -1.0])
def test_a_step_is_positive_and_finite(step):
    with pytest.raises(ValueError, match=f"step = {step} is not allowed: it must be .*> 0"):
        StepControl.fixed(step)
