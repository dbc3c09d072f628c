"""End-notched flexure: closed forms and their energy balance, growth in shear, and what friction takes."""

from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI

from cutsim.analysis.stepping import run
from cutsim.fields.meshing import read_geo
from cutsim.studies.fracture import EndNotchedBeam, crack_profile
from validation.enf import MESH, QUICK, Beam, before_growth, control, growth

MU = 0.5
SIMPLE = EndNotchedBeam(height=3.0, thickness=2.0, half_span=60.0, modulus=200e3)
ROUGH = replace(SIMPLE, shear=77e3, correction=0.2, friction=MU)


def bend(beam, specimen):
    """Run to the end; columns of all accepted steps."""
    rows = []
    with beam.mechanics.problem:
        run(beam.mechanics, specimen.until, control(), lambda r: rows.append(r.columns | beam.columns(r.columns)))
    return {name: np.array([row[name][0] for row in rows]) for name in rows[0]}


@pytest.fixture(scope="module", params=[0.0, MU], ids=["smooth", "rough"])
def bent(request):
    """A beam bent until its crack has grown, and its history."""
    beam = Beam.build(QUICK, request.param, comm=MPI.COMM_SELF)
    return request.param, beam, bend(beam, QUICK)


# -- closed forms -----------------------------------------------------------------------------------------------------


def test_simple_beam():
    P, a, E, b, h, L = 70.0, 45.0, 200e3, 2.0, 3.0, 60.0
    assert SIMPLE.release(P, a) == pytest.approx(9 * P**2 * a**2 / (16 * E * b**2 * h**3))
    assert SIMPLE.compliance(a) == pytest.approx((3 * a**3 + 2 * L**3) / (8 * E * b * h**3))
    load, deflection = SIMPLE.propagation(0.7, a)
    assert SIMPLE.release(load, a) == pytest.approx(0.7)
    assert deflection == pytest.approx(load * SIMPLE.compliance(a))


def test_beam_without_a_crack_bends_like_timoshenkos():
    beam = replace(SIMPLE, shear=77e3)
    inertia, area = 2.0 * 6.0**3 / 12, 2.0 * 6.0
    timoshenko = 120.0**3 / (48 * 200e3 * inertia) + 120.0 / (4 * 5 / 6 * 77e3 * area)
    assert beam.compliance(1e-6) == pytest.approx(timoshenko)


@pytest.mark.parametrize("beam", [SIMPLE, ROUGH], ids=["simple", "rough"])
@pytest.mark.parametrize("toughness", [0.3, 2.0])
def test_growth_by_beam_theory_closes_the_energy_balance(beam, toughness):
    """P dw = G_c b da + F ds + dU with the energy 2U = P w − F s of linear arms under load and friction."""
    a = np.linspace(42.0, 55.0, 4001)
    P, w = np.transpose([beam.propagation(toughness, x) for x in a])
    s = np.array([beam.slip(*pair) for pair in zip(P, a, strict=True)])
    F = beam.friction * P / 4
    work, rubbed = (np.sum(0.5 * (f[1:] + f[:-1]) * np.diff(x)) for f, x in ((P, w), (F, s)))
    stored = 0.5 * (P * w - F * s)
    assert work - rubbed - (stored[-1] - stored[0]) == pytest.approx(toughness * 2.0 * (a[-1] - a[0]), rel=1e-6)


def test_growth_is_stable_from_069_of_half_the_span_on():
    a = np.linspace(30.0, 59.0, 3001)
    deflection = [SIMPLE.propagation(1.0, x)[1] for x in a]
    assert a[np.argmin(deflection)] / 60.0 == pytest.approx(3 ** (-1 / 3), abs=1e-3)


@pytest.mark.parametrize("name", ["height", "thickness", "half_span", "modulus", "shear", "correction", "friction"])
def test_bad_beam_is_refused(name):
    with pytest.raises(ValueError, match=f"{name} = -1"):
        replace(SIMPLE, **{name: -1.0})


def test_bad_crack_and_toughness_are_refused():
    for length in (0.0, 60.0):
        with pytest.raises(ValueError, match=rf"length = {length}.*half_span = 60"):
            SIMPLE.release(1.0, length)
    with pytest.raises(ValueError, match="toughness = 0"):
        SIMPLE.propagation(0.0, 45.0)


@pytest.mark.mpi
@pytest.mark.parametrize("parameters", [{"a0": 60}, {"back": 50}, {"lc": 2}, {"growth": 0.5}, {"over": 0}])
def test_bad_geometry_is_refused(parameters):
    with pytest.raises(ValueError, match=f"{next(iter(parameters))} = "):
        read_geo(MESH, MPI.COMM_WORLD, parameters, gdim=2)


# -- before growth ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("friction", [0.0, MU])
def test_beam_that_cannot_break_follows_theory(friction):
    result = before_growth(QUICK, friction)
    assert len(result) == 3 + (friction == 0)
    for name, ratio in result.items():
        assert ratio == pytest.approx(1.0, abs=0.01), name


# -- growth -----------------------------------------------------------------------------------------------------------


def test_growth_follows_theory_and_costs_the_toughness(bent):
    friction, _, history = bent
    result = growth(QUICK, history, friction)
    assert result["growth"] > 2 * QUICK.height
    assert result["distance_from_theory"] < 0.005
    assert result["G_by_load_and_front"] == pytest.approx(QUICK.toughness, rel=0.01)
    assert result["toughness_by_damage"] == pytest.approx(QUICK.toughness, rel=0.01)
    assert result["toughness_by_front"] == pytest.approx(QUICK.toughness, rel=0.02)


def test_pins_share_the_load_and_friction_raises_it(bent):
    friction, _, history = bent
    np.testing.assert_allclose(history["left_force"], 0.5 * history["load"], rtol=1e-6)
    np.testing.assert_allclose(history["right_force"], 0.5 * history["load"], rtol=1e-6)
    smooth = QUICK.theory().propagation(QUICK.toughness, history["front"][-1])[0]
    raised = history["load"][-1] / smooth - 1
    a = history["front"][-1] + QUICK.theory().correction * QUICK.height
    assert raised == pytest.approx(2 * friction * QUICK.height / (3 * a), abs=0.004)


def test_arms_press_on_each_other_with_a_quarter_of_the_load(bent):
    _, beam, history = bent
    x, pressure = crack_profile(beam.faces, "pressure")
    assert np.average(x, weights=pressure) == pytest.approx(0.0, abs=QUICK.height)
    total = beam.faces.points.integral(beam.faces.point_values("pressure"))
    assert total == pytest.approx(0.25 * history["load"][-1], rel=0.02)


def test_friction_entry_is_what_the_audit_leaves_for_it(bent):
    friction, _, history = bent
    result = growth(QUICK, history, friction)
    assert result["energy_closure"] < 5e-4
    if friction:
        assert result["friction"] == pytest.approx(result["work_left_for_friction"], rel=0.02)
        assert result["friction"] == pytest.approx(result["friction_of_theory"], rel=0.03)
    else:
        assert result["friction"] == 0.0
    for name in ("energy_fracture", "energy_friction", "bond_broken"):
        assert np.diff(history[name]).min() >= -1e-9 * (1 + history[name].max()), name


@pytest.mark.mpi
@pytest.mark.skipif(MPI.COMM_WORLD.size == 1, reason="compares several ranks with one")
def test_ranks_agree_with_one():
    short = replace(QUICK, deflections=(1.0, 1.1), steps=(3, 8))
    alone = bend(Beam.build(short, MU, comm=MPI.COMM_SELF), short)
    together = bend(Beam.build(short, MU), short)
    assert alone["front"][-1] > QUICK.crack + 1.0
    for name in ("load", "front", "slip", "energy_fracture", "energy_friction", "energy_strain", "bond_broken"):
        np.testing.assert_allclose(together[name], alone[name], rtol=0, atol=1e-6 * np.abs(alone[name]).max())


@pytest.mark.mpi
def test_bad_axis_of_a_profile_is_refused():
    beam = Beam.build(QUICK)
    with beam.mechanics.problem, pytest.raises(ValueError, match="axis = 2"):
        crack_profile(beam.faces, "sliding", axis=2)
