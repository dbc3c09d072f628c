"""A block that slides on a slab: its hot spot against closed forms, and the balance of heat."""

from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI

from cutsim.analysis.stepping import run
from cutsim.fields.meshing import read_geo
from validation.sliding_block_heat import (
    BLOCK,
    HEIGHT,
    INSULATOR,
    MESH,
    SLAB,
    START,
    STEEL,
    THESIS,
    Rubbing,
    balance,
    faces,
    jaeger,
    profile,
    rise,
    theory,
)

ROUGH = dict(steps=20, elements=(9, 40), layer=1.0)
MIDDLE = START + BLOCK / 2
RESTING = replace(STEEL, speed=1e-12)
HEAT = STEEL.density * STEEL.capacity  # ρ c


def slide(case, comm=MPI.COMM_WORLD):
    """A run with its history."""
    rubbing, rows = Rubbing.build(case, comm), []
    problem = rubbing.problem

    def record(report):
        columns = report.columns | rubbing.columns(report.columns)
        rows.append(
            {"time": report.time, "step": report.number} | {name: value for name, (value, _) in columns.items()}
        )

    with problem.mechanics.problem, problem.heat.problem:
        run(problem, case.until, case.control, record)
    return rubbing, {name: np.array([row[name] for row in rows]) for name in rows[0]}


# -- closed forms -----------------------------------------------------------------------------------------------------


def test_soon_after_the_start_both_are_half_spaces():
    time = 0.02
    slab, block = rise(RESTING, np.array([MIDDLE]), time, np.linspace(0.0, time, 5))
    half_space = 2 * np.sqrt(STEEL.diffusivity * time / np.pi) / STEEL.conductivity
    assert slab.sum() == pytest.approx(half_space, rel=1e-9)
    assert block.sum() == pytest.approx(half_space, rel=1e-9)


def test_long_after_the_start_all_is_warmed_alike():
    last = 500.0
    ends = 4000.0 - np.concatenate([np.arange(4000.0, 0.0, -last), last * 0.2 ** np.arange(1, 7), [0.0]])
    slab, block = rise(RESTING, np.array([0.0, MIDDLE, SLAB]), 4000.0, ends)
    steady = last / (HEAT * HEIGHT)
    np.testing.assert_allclose(slab[0], steady * BLOCK / SLAB, rtol=1e-6)
    assert block[0] == pytest.approx(steady, rel=1e-6)
    assert block.sum() == pytest.approx(8 * steady + HEIGHT / (3 * STEEL.conductivity), rel=1e-7)


def test_moving_band_tends_to_jaegers_profile():
    """The heat of three seconds has met the bottom of the slab, but far behind the band."""
    time = STEEL.step + 3.0
    x = MIDDLE + STEEL.position(time) + np.linspace(-BLOCK / 2, 0.8 * BLOCK, 14)
    found = rise(STEEL, x, time, np.linspace(STEEL.step, time, 31))[0].sum(axis=0)
    np.testing.assert_allclose(found, jaeger(STEEL, x - x[0] - BLOCK / 2), atol=0.005 * found.max())
    assert found[0] < found.max() > found[-1]


@pytest.mark.parametrize("case", [THESIS, STEEL], ids=["thesis", "steel"])
def test_theory_keeps_the_dissipation(case):
    """The fluxes, and what the interface holds, are what friction gives."""
    time = case.step * np.arange(1, 10)
    work = case.friction.mu * case.pressure * BLOCK * case.speed * time
    expected = theory(case, {"time": time, "energy_friction": work, "load": np.full(9, case.pressure * BLOCK)})
    held = case.contact.capacity * np.diff(expected.interface, prepend=0.0) / case.step
    generated = case.friction.mu * case.pressure * case.speed
    np.testing.assert_allclose(expected.fluxes.sum(axis=1) + held, generated, rtol=1e-9)
    through = case.contact.gamma_plus * case.pressure * (expected.interface - expected.block_face)
    np.testing.assert_allclose(through, expected.fluxes[:, 0], rtol=1e-6)


# -- slides -----------------------------------------------------------------------------------------------------------


@pytest.mark.mpi
@pytest.mark.parametrize("name", ["thesis", "insulator", "steel"])
def test_slide(name, tmp_path):
    case = replace({"thesis": THESIS, "insulator": INSULATOR, "steel": STEEL}[name], **ROUGH)
    rubbing, history = slide(case)
    result = balance(case, history | {"step": history["step"]})
    assert result["heat_kept_over_friction"] == pytest.approx(1.0, abs=1e-9)
    assert result["heat_closure"] < 1e-9 and result["energy_closure"] < 0.02
    assert result["least_contact_dissipation"] > -1e-12
    assert (np.diff(history["interface_entropy"]) > -1e-12).all()
    if case.uniform:
        assert result["friction"] == pytest.approx(case.work, rel=1e-3)
        assert result["mean_rise"] == pytest.approx(result["mean_rise_of_theory"], rel=1e-3)
    expected = theory(case, history)
    errors = faces(history, expected)
    largest = max(errors[f"{face}_error"] for face in ("block_face", "slab_face", "interface"))
    assert largest < {"thesis": 1e-3, "insulator": 0.04, "steel": 0.06}[name], errors
    if name == "insulator":
        along = profile(rubbing, history, expected, tmp_path / "profile.png")
        assert along["profile_error"] < 0.06
        assert along["peak_of_theory"] == pytest.approx(along["peak_of_jaeger"], rel=0.02)
        assert 0 < along["peak_behind_the_middle"] < BLOCK / 2, "the hot spot is in the rear half of the contact"


def test_spot_sharpens_with_mesh_and_step(tmp_path):
    errors = []
    for refined in (ROUGH, dict(steps=40, elements=(19, 80), layer=0.5)):
        case = replace(INSULATOR, **refined)
        rubbing, history = slide(case)
        errors.append(profile(rubbing, history, theory(case, history), tmp_path / "profile.png")["profile_error"])
    assert errors[1] < 0.65 * errors[0], errors


@pytest.mark.mpi
@pytest.mark.skipif(MPI.COMM_WORLD.size == 1, reason="compares several ranks with one")
def test_ranks_agree_with_one():
    case = replace(STEEL, **(ROUGH | {"steps": 30}))
    alone, together = (slide(case, comm)[1] for comm in (MPI.COMM_SELF, MPI.COMM_WORLD))
    for name in ("load", "energy_friction", "slab_face", "block_face", "interface", "slab_temperature"):
        np.testing.assert_allclose(together[name], alone[name], rtol=0, atol=1e-6 * np.abs(alone[name]).max())


@pytest.mark.mpi
@pytest.mark.parametrize("parameters", [{"B": 0}, {"X": 95}, {"ly": 0}, {"nl": 0}, {"growth": 0.5}])
def test_bad_geometry_is_refused(parameters):
    with pytest.raises(ValueError, match=f"{next(iter(parameters))} = "):
        read_geo(MESH, MPI.COMM_WORLD, parameters, gdim=2)
