"""Double cantilever beam: beam theory, energy spent on broken area, unloading, ranks, and steps that fail."""

from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI

from cutsim.analysis.stepping import run
from validation.dcb import ISOTROPIC, QUICK, THESIS, Beam, control, growth, secants

SMALL = replace(THESIS, length=70.0, openings=(0.0, 0.14, 0.02, 0.18), step=0.02, size=2.0, fine=30.0)


def pull(beam, specimen, step_control=None):
    """Run through all openings; columns of all accepted steps."""
    rows = []

    def record(report):
        columns = report.columns | beam.columns(report.columns)
        rows.append({"time": report.time, "cuts": report.cuts} | {name: v for name, (v, _) in columns.items()})

    run(beam.mechanics, specimen.turns[-1], step_control or control(specimen), record)
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


@pytest.fixture(scope="module")
def opened():
    """The isotropic specimen, opened until the crack has grown by some arm heights."""
    specimen = QUICK["isotropic"]
    return specimen, pull(Beam.build(specimen, comm=MPI.COMM_SELF), specimen)


@pytest.fixture(scope="module")
def cycled():
    """The thesis specimen, loaded, unloaded and loaded again."""
    specimen = QUICK["thesis"]
    return specimen, pull(Beam.build(specimen, comm=MPI.COMM_SELF), specimen)


def test_beam_theory_of_the_isotropic_set():
    force, opening = ISOTROPIC.beams().propagation(ISOTROPIC.toughness, ISOTROPIC.crack)
    assert force == pytest.approx(4.245, abs=1e-3)
    assert opening == pytest.approx(1.363, abs=1e-3)
    assert ISOTROPIC.beam_curve(np.array([opening]))[0] == pytest.approx(force)


def test_force_follows_beam_theory(opened):
    specimen, history = opened
    result = growth(specimen, history, width=1.0)
    assert result["peak_force"] == pytest.approx(4.245, rel=0.05)
    assert result["distance_from_beam"] < 0.015


def test_the_front_is_where_beam_theory_has_it(opened):
    specimen, history = opened
    grown = history["front"] > specimen.crack + 2 * specimen.height
    beams = specimen.beams()
    load = np.array([beams.propagation(specimen.toughness, a)[0] for a in history["front"][grown]])
    assert grown.sum() > 30
    np.testing.assert_allclose(history["force"][grown], load, rtol=0.03)


def test_broken_area_costs_the_toughness(opened):
    specimen, history = opened
    result = growth(specimen, history, width=1.0)
    assert result["toughness_by_damage"] == pytest.approx(0.28, rel=0.01)
    assert result["toughness_by_front"] == pytest.approx(0.28, rel=0.01)


@pytest.mark.parametrize("case", ["opened", "cycled"])
def test_energies_close_and_fracture_never_heals(case, request):
    _, history = request.getfixturevalue(case)
    assert np.abs(history["energy_closure"]).max() < 0.01
    scale = history["energy_fracture"].max()
    assert scale > 0
    assert np.diff(history["energy_fracture"]).min() > -1e-9 * scale
    assert np.diff(history["crack_broken"]).min() > -1e-9 * history["crack_broken"].max()


def test_opposite_forces_balance(opened):
    _, history = opened
    np.testing.assert_allclose(history["upper_force"], -history["lower_force"], rtol=1e-6)


def test_unloading_is_the_secant_and_reloading_retraces_it(cycled):
    specimen, history = cycled
    result = secants(specimen, history)
    assert result["unloading_off_secant"] < 1e-6
    assert result["reloading_off_unloading"] < 1e-6
    assert result["force_left_at_zero"] < 1e-8


def test_the_cycle_goes_along_a_damaged_secant(cycled):
    specimen, history = cycled
    stiffness = history["force"] / np.where(history["opening"] > 0, history["opening"], np.nan)
    down = (history["time"] > specimen.turns[1]) & (history["time"] < specimen.turns[2])
    assert np.nanmax(stiffness[down]) < 0.7 * stiffness[0]


@pytest.mark.mpi
@pytest.mark.skipif(MPI.COMM_WORLD.size == 1, reason="compares several ranks with one")
def test_ranks_agree_with_one():
    alone = pull(Beam.build(SMALL, comm=MPI.COMM_SELF), SMALL)
    together = pull(Beam.build(SMALL), SMALL)
    np.testing.assert_array_equal(together["time"], alone["time"])
    for name in ("force", "energy_fracture", "energy_strain", "crack_broken", "front", "crack_opening"):
        np.testing.assert_allclose(together[name], alone[name], rtol=0, atol=1e-7 * np.abs(alone[name]).max())


@pytest.mark.mpi
def test_failed_steps_are_cut_and_leave_no_trace(monkeypatch):
    beam = Beam.build(SMALL)
    mechanics, state, crack = beam.mechanics, beam.state, beam.crack
    solve, rollback = mechanics.solve, state.rollback
    committed = []

    def failing(line_search=None):
        outcome = solve(line_search)
        if state.time - state.time_old < 0.6 * SMALL.step or not 0.1 < state.time < 0.15:
            return outcome
        committed.append(
            [a.copy() for a in (state.u_old.x.array, crack.history.secants.x.array, mechanics._residual.committed)]
        )
        state.u.x.array[:] = np.nan
        return replace(outcome, converged=False, message="made to fail")

    def rolling_back():
        rollback()
        now = [state.u.x.array, crack.history.secants.x.array, mechanics._residual.committed]
        if committed:
            assert all(np.array_equal(a, b) for a, b in zip(now, committed.pop(), strict=True))
            committed.clear()

    monkeypatch.setattr(mechanics, "solve", failing)
    monkeypatch.setattr(state, "rollback", rolling_back)
    history = pull(beam, SMALL)
    assert history["cuts"].sum() >= 2
    undisturbed = pull(Beam.build(SMALL), SMALL)
    assert history["time"][-1] == undisturbed["time"][-1]
    assert history["force"][-1] == pytest.approx(undisturbed["force"][-1], rel=1e-3)
    assert np.abs(history["energy_closure"]).max() < 0.01
