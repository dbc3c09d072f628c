"""Contact against closed forms: balls and cylinders, stick and slip, a wedge on a slope, a bond of unlike meshes."""

from dataclasses import replace

import numpy as np
import pytest
from dolfinx.mesh import compute_midpoints
from mpi4py import MPI

from cutsim.analysis.mechanics import Mechanics
from cutsim.bodies.loads import Support
from cutsim.bodies.solid import Solid
from cutsim.interface.contact import PenaltyContact
from cutsim.materials.elastic import LinearElastic
from cutsim.pairs.surface_pair import SurfacePair
from helpers.boxes import stack
from helpers.runs import history
from validation.contact import SLOPE, WEIGHT, climb
from validation.dcb import ISOTROPIC, control
from validation.hertz import CYLINDER, FULL, MINDLIN, QUICK, Indentation, LineContact, indent

# -- balls ------------------------------------------------------------------------------------------------------------


def test_numbers_of_hertz():
    depth = np.array([0.2])
    assert FULL.force(depth, elastic=False)[0] == pytest.approx(0.5861, abs=1e-4)
    assert FULL.force(depth, elastic=True)[0] == pytest.approx(0.5861 / 2, abs=1e-4)
    assert FULL.contact_radius(depth)[0] == pytest.approx(2.0)


@pytest.fixture(scope="module")
def rigid():
    """A rigid ball on meshes with two and three cells along the core."""
    specimen = replace(QUICK, depth=0.2, steps=2)
    problems = [Indentation.rigid(specimen, cells, MPI.COMM_SELF) for cells in (2, 3)]
    return [p.result(indent(p)) for p in problems]


def test_rigid_ball(rigid):
    assert rigid[-1]["force_off"] < 0.02
    assert rigid[-1]["radius_off"] < 0.01


def test_finer_meshes_are_closer_to_hertz(rigid):
    assert rigid[1]["force_off"] < 0.8 * rigid[0]["force_off"]
    assert rigid[1]["radius_off"] < 0.5 * rigid[0]["radius_off"]


@pytest.mark.parametrize("nu", [0.1, 0.3])
def test_body_drawn_inwards_exceeds_hertz(nu):
    """On the same circle of contact the excess over Hertz is that of the first order, against a ball almost flat."""
    stiff = replace(QUICK, material=LinearElastic(1.0, nu), stiffness=100.0, steps=1)
    balls = [replace(stiff, radius=R, depth=10 / R) for R in (200.0, 1e5)]
    small, flat = (p.result(indent(p)) for p in (Indentation.rigid(b, 3, MPI.COMM_SELF) for b in balls))
    excess = small["force_over_hertz_last"] / flat["force_over_hertz_last"] - 1
    assert excess == pytest.approx(balls[0].excess(np.array([0.05]))[0], rel=0.06)


def test_elastic_ball():
    """The modulus halves, and equal bodies draw inwards alike: no excess."""
    specimen = replace(QUICK, depth=0.4, steps=2, size=300.0, growth=2.5)
    problem = Indentation.bodies(specimen, 2, MPI.COMM_SELF)
    result = problem.result(indent(problem))
    assert result["force_off"] < 0.02
    assert result["radius_over_hertz_last"] == pytest.approx(1.0, abs=0.04)


# -- cylinders --------------------------------------------------------------------------------------------------------


def test_numbers_of_cattaneo_and_mindlin():
    assert MINDLIN.half_width(10.0) == pytest.approx(0.6808, abs=1e-4)
    assert MINDLIN.peak(10.0) == pytest.approx(9.351, abs=1e-3)
    assert MINDLIN.stick(10.0, 0.936) == pytest.approx(0.5647, abs=1e-4)
    pressure, shear = MINDLIN.tractions(np.linspace(-0.7, 0.7, 200_001), 10.0, 0.936)
    assert pressure.max() == pytest.approx(9.351, abs=1e-3)
    assert shear.max() == pytest.approx(1.567, abs=1e-3)


@pytest.fixture(scope="module")
def mindlin():
    contact = LineContact.build(replace(MINDLIN, size=0.04, steps=(8, 4)), MPI.COMM_SELF)
    last = contact.run()
    return contact, last, contact.result(last)


def test_cattaneo_and_mindlin(mindlin):
    result = mindlin[2]
    assert result["load"] == pytest.approx(10.0, rel=0.01)
    assert result["tangential_load"] == pytest.approx(0.936, rel=0.01)
    assert result["half_width"] == pytest.approx(result["half_width_of_theory"], rel=0.005)
    assert result["peak_pressure"] == pytest.approx(result["peak_pressure_of_theory"], rel=0.03)
    assert result["stick"] == pytest.approx(result["stick_of_theory"], rel=0.05)
    assert result["peak_shear"] == pytest.approx(result["peak_shear_of_theory"], rel=0.03)


def test_tractions_along_the_contact(mindlin):
    """They balance the loads, and their second moments are those of the closed form."""
    contact, last, result = mindlin
    load, tangential = -last["down_force"], last["side_force"]
    first = contact.pair.passes[0]
    np.testing.assert_allclose(first.force, (-tangential, load), rtol=1e-6)
    x, pressure, shear = contact.at_points()
    a, c, limit = result["half_width_of_theory"], result["stick_of_theory"], contact.lines.friction * load
    assert first.points.integral(pressure * x**2) == pytest.approx(load * a**2 / 4, rel=0.01)
    expected = limit / 4 * (a**2 - c**4 / a**2)
    assert abs(first.points.integral(shear * x**2)) == pytest.approx(expected, rel=0.02)


def test_cylinder_on_a_block():
    """NAFEMS CGS-1."""
    contact = LineContact.build(replace(CYLINDER, size=0.4, steps=(4, 0)), MPI.COMM_SELF)
    result = contact.result(contact.run())
    assert contact.lines.half_width(35e3) == pytest.approx(6.215, abs=1e-3)
    assert contact.lines.peak(35e3) == pytest.approx(3585, abs=1)
    assert result["load"] == pytest.approx(35e3, rel=0.005)
    assert result["half_width"] == pytest.approx(result["half_width_of_theory"], rel=0.01)
    assert result["peak_pressure"] == pytest.approx(result["peak_pressure_of_theory"], rel=0.03)


# -- wedge ------------------------------------------------------------------------------------------------------------


@pytest.mark.mpi
@pytest.mark.parametrize("two_pass", [False, True], ids=["one pass", "two passes"])
@pytest.mark.parametrize("mu", [0.0, 0.1, 0.2, 0.3])
def test_wedge(mu, two_pass):
    """NAFEMS CGS-4: F/G = (tan α + μ)/(1 − μ tan α) all the way."""
    rows = climb(mu, two_pass=two_pass)
    expected = (SLOPE + mu) / (1 - mu * SLOPE)
    np.testing.assert_allclose(rows["push_force"] / WEIGHT, expected, rtol=2e-3)


# -- bond between unlike meshes ---------------------------------------------------------------------------------------

BEAM = replace(ISOTROPIC, length=48.0, openings=(0.0, 2.0), step=0.04)


def split(ratio):
    """Two bonded arms, the upper one with elements longer by a ratio, opened until the crack has grown; history."""
    h, columns = BEAM.height, BEAM.length / BEAM.size
    lower = ((0.0, -h), (BEAM.length, 0.0), (round(columns), 2))
    upper = ((0.0, 0.0), (BEAM.length, h), (round(columns / ratio), 2))
    b = stack(lower, upper, degree=2, comm=MPI.COMM_SELF)
    face, young = b.face(0, 1, 1), BEAM.material.young
    bonded = face[compute_midpoints(b.state.mesh, 1, face)[:, 0] > BEAM.crack]
    contact = PenaltyContact.automatic(young, BEAM.size, factor=1.0)
    bond = SurfacePair(
        b.state, bonded, b.face(1, 1, 0), BEAM.law, young=young, contact=contact, small_sliding=True, name="bond"
    )
    ends = ((1, "upper", 0.5), (0, "lower", -0.5))
    supports = [
        Support(b.state, b.face(box, 0, 0), 1, lambda t, share=share: share * BEAM.opening(t), name=name)
        for box, name, share in ends
    ]
    supports += [Support(b.state, b.face(box, 0, 1), i) for box in range(2) for i in range(2)]
    mechanics = Mechanics(b.state, [Solid(b.state, BEAM.material), bond], supports)
    return history(mechanics, BEAM.turns[-1], control(BEAM))


@pytest.fixture(scope="module")
def beams():
    return {ratio: split(ratio) for ratio in (1.0, 1.4)}


def test_meshes_of_the_arms_need_not_match(beams):
    matching, unlike = (beams[ratio]["upper_force"] for ratio in (1.0, 1.4))
    assert unlike.max() == pytest.approx(matching.max(), rel=0.02)
    np.testing.assert_allclose(unlike, matching, rtol=0.02)


@pytest.mark.parametrize("ratio", [1.0, 1.4])
def test_growth_follows_beam_theory(beams, ratio):
    rows = beams[ratio]
    opening = 2 * rows["upper_displacement"]
    steady = opening > 1.6
    assert steady.sum() > 5
    np.testing.assert_allclose(rows["upper_force"][steady], BEAM.beam_curve(opening[steady]), rtol=0.01)
    spent, broken = (np.ptp(rows[name][steady]) for name in ("energy_fracture", "bond_broken"))
    assert spent / broken == pytest.approx(BEAM.toughness, rel=0.01)
    assert np.abs(rows["energy_closure"]).max() < 0.01
