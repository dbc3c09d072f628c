"""Orthotropic solid against Hooke's law written anew: in its axes, turned, in plane states, and as arms of beams."""

import numpy as np
import pytest
from dolfinx import fem, mesh
from mpi4py import MPI

from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.stepping import StepControl
from cutsim.bodies.loads import Support, Traction
from cutsim.bodies.solid import Solid
from cutsim.fields.state import State
from cutsim.interface.contact import PenaltyContact
from cutsim.materials.elastic import LinearElastic
from cutsim.materials.orthotropic import Orthotropic
from cutsim.studies.fracture import CantileverBeams, crack_length_correction
from helpers.blocks import make_blocks
from helpers.fields import rotation
from helpers.laws import NU, E
from helpers.materials import stress
from helpers.runs import history

# E₁, E₂, E₃, ν₁₂, ν₁₃, ν₂₃, G₁₂, G₁₃, G₂₃
NINE = (4.0, 1.0, 2.0, 0.3, 0.25, 0.2, 0.7, 0.9, 0.4)
# normal strains for normal stresses, as Lekhnitskii prints it
COMPLIANCE = np.array([[1 / 4, -0.3 / 4, -0.25 / 4], [-0.3 / 4, 1 / 1, -0.2 / 1], [-0.25 / 4, -0.2 / 1, 1 / 2]])
PLANES = {(0, 1): 0.7, (0, 2): 0.9, (1, 2): 0.4}


def strain_of(sigma):
    """Strain in the axes for a stress in the axes."""
    strain = np.diag(COMPLIANCE @ np.diag(sigma))
    for (i, j), modulus in PLANES.items():
        strain[i, j] = strain[j, i] = sigma[i, j] / (2 * modulus)
    return strain


@pytest.mark.parametrize("angle", [0.0, 0.9])
def test_a_stress_strains_it_by_the_compliance(angle):
    """Each normal stress and each shear by itself, in axes that are turned about a skew one."""
    turn = rotation(3, angle)
    material = Orthotropic(*NINE, tuple(map(tuple, turn.T[:2])))
    for i in range(3):
        for j in range(i, 3):
            sigma = np.zeros((3, 3))
            sigma[i, j] = sigma[j, i] = 1e-2
            strain = turn @ strain_of(sigma) @ turn.T
            np.testing.assert_allclose(stress(material, np.eye(3) + strain), turn @ sigma @ turn.T, atol=1e-15)


def test_with_isotropic_constants_it_is_linear_elastic():
    G = E / (2 * (1 + NU))
    material = Orthotropic(E, E, E, NU, NU, NU, G, G, G, ((0.6, 0.8, 0.0), (0.0, 0.0, 1.0)))
    F = np.eye(3) + np.random.default_rng(0).uniform(-0.1, 0.1, (3, 3))
    np.testing.assert_allclose(stress(material, F), stress(LinearElastic(E, NU), F), atol=1e-14)
    assert material.poisson == pytest.approx(NU) and material.young == E


def test_young_is_that_of_the_softest_axis_and_sets_penalties():
    material = Orthotropic(*NINE)
    assert material.young == 1.0
    b = make_blocks()
    crack = b.crack(None, young=material.young)
    assert crack.contact == PenaltyContact(10 * 1.0 / crack.normal_size)


@pytest.mark.parametrize("plane", ["strain", "stress"])
@pytest.mark.parametrize("angle", [0.0, 0.6])
def test_plane_body_off_its_axes(plane, angle):
    """A strip under tension along y, its first axis turned by an angle: 1/E_y and the shear that couples to it."""
    c, s = np.cos(angle), np.sin(angle)
    material = Orthotropic(*NINE, ((c, s, 0.0), (-s, c, 0.0)))
    S = COMPLIANCE.copy()
    if plane == "strain":
        S = S - np.outer(S[:, 2], S[2]) / S[2, 2]
    # the stress t along y, in the axes
    t = 1e-3
    along = np.array([s, c])
    sigma = t * np.outer(along, along)
    strain = np.diag(S[:2, :2] @ np.diag(sigma))
    strain[0, 1] = strain[1, 0] = sigma[0, 1] / (2 * 0.7)
    turn = np.array([[c, -s], [s, c]])
    expected = turn @ strain @ turn.T
    square = mesh.create_unit_square(MPI.COMM_WORLD, 2, 2, mesh.CellType.quadrilateral)
    state = State(fem.functionspace(square, ("Lagrange", 1, (2,))))
    ends = {y: mesh.locate_entities_boundary(square, 1, lambda x, y=y: np.isclose(x[1], y)) for y in (0.0, 1.0)}
    corner = mesh.locate_entities_boundary(square, 0, lambda x: np.isclose(x[0] + x[1], 0.0))
    held = [Support(state, ends[0.0], 1), Support(state, corner, 0, dim=0)]
    pull = Traction(state, ends[1.0], (0.0, t), lambda time: time)
    rows = history(Mechanics(state, [Solid(state, material, plane=plane), pull], held), 1.0, StepControl.fixed(1.0))
    x, u = state.V.tabulate_dof_coordinates(), state.u.x.array.reshape(-1, 2)
    np.testing.assert_allclose(u[:, 1], expected[1, 1] * x[:, 1], atol=1e-12)
    np.testing.assert_allclose(u[:, 0], expected[0, 0] * x[:, 0] + 2 * expected[0, 1] * x[:, 1], atol=1e-12)
    assert rows["energy_strain"][-1] == pytest.approx(0.5 * t * expected[1, 1], rel=1e-9)


def test_axes_out_of_the_plane_are_refused_in_plane_stress():
    material = Orthotropic(*NINE, ((1.0, 0.0, 1.0), (0.0, 1.0, 0.0)))
    with pytest.raises(ValueError, match=r"axes = .* in plane stress"):
        make_blocks().solid(material, plane="stress")


# -- beams ------------------------------------------------------------------------------------------------------------

# Alfano and Crisfield (2001), GPa and mm: carbon fibres along the arms
PLY = {"E1": 135.3, "E2": 9.0, "E3": 9.0, "nu12": 0.24, "nu13": 0.24, "nu23": 0.46, "G12": 5.2, "G13": 5.2, "G23": 3.08}


def test_correction_of_isotropic_arms_is_a_special_case():
    isotropic = crack_length_correction(200.0, 200.0 / 2.6)
    assert isotropic == pytest.approx(0.663, abs=5e-4)
    assert crack_length_correction(200.0, 200.0 / 2.6, across=200.0) == isotropic


def test_peak_of_the_orthotropic_specimen():
    """Alfano and Crisfield: 61.5 to 63.2 N at 1.94 to 2.0 mm, b = 20 mm, a₀ = 30 mm, G_c = 0.28 N/mm."""
    chi = crack_length_correction(135.3e3, 5.2e3, across=9e3)
    load, opening = CantileverBeams(1.5, 20.0, 135.3e3, chi).propagation(0.28, 30.0)
    assert chi == pytest.approx(1.835, abs=1e-3)
    assert 61.5 < load < 63.2 and 1.85 < opening < 2.0


@pytest.mark.parametrize("length", [20.0, 30.0])
def test_arm_of_finite_elements_is_as_stiff_as_the_corrected_beam(length):
    """Half of a specimen, held along the ligament: within 1 %; the beam without correction is 15 % off and more."""
    h = 1.5
    arm = mesh.create_rectangle(MPI.COMM_WORLD, [(0.0, 0.0), (60.0, h)], (120, 3), mesh.CellType.quadrilateral)
    state = State(fem.functionspace(arm, ("Lagrange", 2, (2,))))
    ligament = mesh.locate_entities_boundary(arm, 1, lambda x: np.isclose(x[1], 0.0) & (x[0] > length - 1e-9))
    tip = mesh.locate_entities_boundary(arm, 1, lambda x: np.isclose(x[0], 0.0))
    end = mesh.locate_entities_boundary(arm, 1, lambda x: np.isclose(x[0], 60.0))
    held = [Support(state, ligament, 1), Support(state, end, 0)]
    held.append(Support(state, tip, 1, lambda t: 1e-3 * t, name="tip"))
    solid = Solid(state, Orthotropic(**PLY), plane="stress")
    load = history(Mechanics(state, [solid], held), 1.0, StepControl.fixed(1.0))["tip_force"][-1]
    chi = crack_length_correction(PLY["E1"], PLY["G12"], across=PLY["E2"])
    beam, plain = (CantileverBeams(h, 1.0, PLY["E1"], c).load(2e-3, length) for c in (chi, 0.0))
    assert load == pytest.approx(beam, rel=0.01)
    assert abs(plain / load - 1) > 0.15
