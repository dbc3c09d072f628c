"""Strain energies at homogeneous deformations, evaluated symbolically, and the finite-element body in closed forms."""

import numpy as np
import pytest
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI

from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.stepping import StepControl
from cutsim.base.assembly import integrate
from cutsim.base.compat import form
from cutsim.bodies.loads import Support, Traction
from cutsim.bodies.solid import Solid
from cutsim.fields.state import State
from cutsim.materials.anisotropic import FungOrthotropic, TransverselyIsotropic
from cutsim.materials.elastic import LinearElastic, NeoHookean, StVenantKirchhoff
from cutsim.materials.fibres import DispersedFibres, EllipsoidalFibres, ExponentialFibres, Reinforced
from cutsim.materials.orthotropic import Orthotropic
from cutsim.materials.rubbers import ArrudaBoyce, IsochoricOgden, MooneyRivlin, Ogden, Yeoh
from helpers.blocks import make_blocks
from helpers.examples import ANISOTROPIC, AXIS, ISOTROPIC, MATERIALS, MOONEY, ORTHOTROPIC, TWO_CONSTANTS
from helpers.laws import NU, E
from helpers.materials import (
    F0,
    assert_free_of_energy_and_stress,
    assert_hooke,
    assert_objective,
    cube_between_plates,
    energy,
    name,
    stress,
)
from helpers.runs import history

each = pytest.mark.parametrize("material", MATERIALS, ids=name)
# solids for small strains, which do not see that a body has turned
SMALL = LinearElastic | Orthotropic


# E₁, E₂, E₃, ν₁₂, ν₁₃, ν₂₃, G₁₂, G₁₃, G₂₃
NINE = (4.0, 1.0, 2.0, 0.3, 0.25, 0.2, 0.7, 0.9, 0.4)


def number(expression):
    """Value of a UFL expression without coefficients."""
    expression = ufl.as_ufl(expression)
    shape = expression.ufl_shape
    return np.array([expression((), component=i) for i in np.ndindex(*shape)]).reshape(shape)


@each
def test_reference_is_free_of_energy_and_stress(material):
    assert_free_of_energy_and_stress(material)


@pytest.mark.parametrize("material", ISOTROPIC, ids=name)
def test_small_strains_follow_hooke(material):
    assert_hooke(material)


@pytest.mark.parametrize("material", [m for m in MATERIALS if not isinstance(m, SMALL)], ids=name)
@pytest.mark.parametrize("angle", [0.3, 2.0])
def test_energy_is_objective(material, angle):
    assert_objective(material, angle, isotropic=material not in ANISOTROPIC)


@each
def test_stress_is_the_slope_of_the_energy(material):
    """Central differences of the energy along a direction; Cauchy's stress is symmetric."""
    H = np.random.default_rng(3).uniform(-1, 1, (3, 3))
    W = [energy(material, F0 + h * H) for h in (-2e-4, -1e-4, 1e-4, 2e-4)]
    slope = (8 * (W[2] - W[1]) - (W[3] - W[0])) / 12e-4
    P = stress(material, F0)
    assert slope == pytest.approx((P * H).sum(), rel=1e-9)
    if not isinstance(material, SMALL):
        np.testing.assert_allclose(P @ F0.T, F0 @ P.T, atol=1e-13 * np.abs(P).max())


@pytest.mark.parametrize("kind", [NeoHookean, StVenantKirchhoff, LinearElastic])
def test_moduli_are_those_of_young_and_poisson(kind):
    material = kind.from_moduli(shear=0.7, bulk=3.0)
    assert (material.shear, material.bulk) == (pytest.approx(0.7), pytest.approx(3.0))
    again = kind(material.young, material.poisson)
    assert again.lame == pytest.approx(3.0 - 2 * 0.7 / 3)


@pytest.mark.parametrize(
    ("kind", "values", "name"),
    [
        (NeoHookean, (0.0, 0.3), "young"),
        (NeoHookean, (1.0, 0.5), "poisson"),
        (StVenantKirchhoff, (1.0, -1.0), "poisson"),
        (MooneyRivlin, (0.0, 0.1, 1.0), "c1"),
        (MooneyRivlin, (0.1, -0.1, 1.0), "c2"),
        (MooneyRivlin, (0.1, 0.1, 0.0), "bulk"),
        (Yeoh, (0.0, 0.1, 0.1, 1.0), "c1"),
        (Yeoh, (0.1, -0.2, 0.1, 1.0), "c2"),
        (Yeoh, (0.1, 0.1, -0.1, 1.0), "c3"),
        (ArrudaBoyce, (0.0, 8.0, 1.0), "modulus"),
        (ArrudaBoyce, (1.0, 0.5, 1.0), "links"),
        (Ogden, ((), (), 1.0), "moduli"),
        (Ogden, ((1.0, -1.0), (2.0, 1.0), 1.0), "moduli"),
        (Ogden, ((1.0,), (2.0, 1.0), 1.0), "exponents"),
        (Ogden, ((1.0,), (0.0,), 1.0), "exponents"),
        (Ogden, ((1.0,), (2.0,), 0.0), "volumetric"),
        (IsochoricOgden, ((1.0, -1.0), (2.0, 1.0), 1.0), "moduli"),
        (IsochoricOgden, ((1.0,), (2.0,), 0.0), "bulk"),
        (Ogden.from_poisson, ((1.0,), (2.0,), 0.5), "poisson"),
        (Reinforced, (MOONEY, ()), "fibres"),
        (ExponentialFibres, ((0.0, 0.0), 1.0, 1.0), "direction"),
        (ExponentialFibres, ((1.0,), 1.0, 1.0), "direction"),
        (ExponentialFibres, (AXIS, 0.0, 1.0), "modulus"),
        (ExponentialFibres, (AXIS, 1.0, 0.0), "exponential"),
        (ExponentialFibres, (AXIS, 1.0, 1.0, 1.5), "power"),
        (DispersedFibres, (AXIS, 0.0, 1.0), "k1"),
        (DispersedFibres, (AXIS, 1.0, 0.0), "k2"),
        (DispersedFibres, (AXIS, 1.0, 1.0, 0.4), "dispersion"),
        (EllipsoidalFibres, ((1.0, 1.0, 0.0),), "moduli"),
        (EllipsoidalFibres, ((1.0, 1.0, 1.0), 1.0), "power"),
        (EllipsoidalFibres, ((1.0, 1.0, 1.0), 2.0, (AXIS, (1.0, 0.0, 0.0))), "axes"),
        (TransverselyIsotropic, (AXIS, 1.0, 0.3, 0.0, 0.2, 0.7), "axial_young"),
        (TransverselyIsotropic, (AXIS, 1.0, 1.0, 1.0, 0.2, 0.7), "poisson"),
        (TransverselyIsotropic, (AXIS, 1.0, 0.3, 1.0, 0.6, 0.7), "axial_poisson"),
        (Orthotropic, (*NINE[:2], 0.0, *NINE[3:]), "E3"),
        (Orthotropic, (*NINE[:3], 2.1, *NINE[4:]), "nu12"),
        (Orthotropic, (*NINE[:3], 1.5, 1.2, 0.5, *NINE[6:]), "nu12, nu13, nu23"),
        (Orthotropic, (*NINE[:8], -0.4), "G23"),
        (Orthotropic, (*NINE, (AXIS, (1.0, 0.0, 0.0))), "axes"),
        (FungOrthotropic, (0.0, (1.0,) * 3, (0.0,) * 3, (1.0,) * 3, 1.0), "modulus"),
        (FungOrthotropic, (1.0, (1.0,) * 3, (2.0,) * 3, (1.0,) * 3, 1.0), "normal, coupling"),
        (FungOrthotropic, (1.0, (1.0,) * 3, (0.0,) * 3, (1.0, 1.0, 0.0), 1.0), "shear"),
        (NeoHookean.from_moduli, (0.0, 1.0), "shear"),
        (NeoHookean.from_moduli, (1.0, -1.0), "bulk"),
    ],
)
def test_refuses_what_has_no_meaning(kind, values, name):
    with pytest.raises(ValueError, match=f"{name} = .* is not allowed"):
        kind(*values)


@pytest.mark.parametrize("material", [*TWO_CONSTANTS, ORTHOTROPIC], ids=name)
@pytest.mark.parametrize("plane", [[[1.3, 0.2], [0.1, 0.8]], [[0.8, 0.0], [0.0, 0.7]], [[1.5, 0.0], [0.3, 1.4]]])
def test_plane_stress_is_free_of_stress_out_of_plane(material, plane):
    F = np.eye(3)
    F[:2, :2] = plane
    F[2, 2] = number(material.plane_stress_stretch(ufl.as_matrix(F.tolist())))
    assert abs(stress(material, F)[2, 2]) < 1e-12 * E


@pytest.mark.parametrize("material", [m for m in MATERIALS[3:] if m is not ORTHOTROPIC], ids=name)
def test_plane_stress_of_others_is_refused(material):
    with pytest.raises(ValueError, match=f"plane = 'stress' is not available for {type(material).__name__}"):
        material.plane_stress_stretch(ufl.Identity(3))
    if material is MOONEY:
        with pytest.raises(ValueError, match="plane = 'stress'"):
            make_blocks().solid(MOONEY, plane="stress")


# -- the finite-element body ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("stretch", [0.6, 1.5, 2.0])
@pytest.mark.parametrize(("lateral", "power"), [(False, -2), (True, -5)], ids=["uniaxial", "equibiaxial"])
def test_nearly_incompressible_neo_hookean(stretch, lateral, power):
    """P = G (λ − λ⁻²) and G (λ − λ⁻⁵), up to the compressibility of order G/K."""
    material = NeoHookean.from_moduli(shear=0.5, bulk=2.5e5)
    rows = history(cube_between_plates(material, stretch, lateral), 1.0, StepControl.fixed(0.1))
    assert rows["top_force"][-1] == pytest.approx(0.5 * (stretch - stretch**power), rel=1e-4)


@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_plane_stiffness_is_that_of_hooke(plane):
    """A strip under dead traction: E for plane stress, E/(1 − ν²) for plane strain, W = ½ P u."""
    b = make_blocks()
    whole = State(fem.functionspace(b.state.mesh, ("Lagrange", 1, (2,))))
    supports = [Support(whole, b.face(i, 0.0), i) for i in range(2)]
    load = Traction(whole, b.face(1, 1.0), (0.0, 1e-3), lambda t: t)
    rows = history(
        Mechanics(whole, [Solid(whole, LinearElastic(E, NU), plane=plane), load], supports), 1.0, StepControl.fixed(1.0)
    )
    modulus = E if plane == "stress" else E / (1 - NU**2)
    assert whole.u.x.array[1::2].max() == pytest.approx(1e-3 / modulus, rel=1e-9)
    assert rows["energy_strain"][-1] == pytest.approx(0.5e-6 / modulus, rel=1e-9)
    assert rows["load_force_y"][-1] == pytest.approx(1e-3)


def bending_deflection(volumetric, poisson):
    """Tip deflection of a short cantilever of quadrilaterals under an end shear."""
    domain = mesh.create_rectangle(MPI.COMM_WORLD, [(0.0, 0.0), (4.0, 1.0)], (16, 4), mesh.CellType.quadrilateral)
    state = State(fem.functionspace(domain, ("Lagrange", 1, (2,))))
    ends = [mesh.locate_entities_boundary(domain, 1, lambda x, at=at: np.isclose(x[0], at)) for at in (0.0, 4.0)]
    solid = Solid(state, LinearElastic(1.0, poisson), volumetric=volumetric)
    load = Traction(state, ends[1], (0.0, 1e-4), lambda t: t)
    mechanics = Mechanics(state, [solid, load], [Support(state, ends[0], i) for i in range(2)])
    history(mechanics, 1.0, StepControl.fixed(1.0))
    return state.u.x.array[1::2].max()


def test_reduced_integration_relieves_locking():
    """Timoshenko's beam in plane strain; with full integration the tip hardly moves as ν → ½."""
    poisson, P, L = 0.4999, 1e-4, 4.0
    beam = 4 * P * L**3 * (1 - poisson**2) + P * L * 2 * (1 + poisson) * 6 / 5
    assert bending_deflection("reduced", poisson) == pytest.approx(beam, rel=0.05)
    assert bending_deflection("auto", poisson) == bending_deflection("reduced", poisson)
    assert bending_deflection("full", poisson) < 0.5 * beam


def test_stress_and_energy_density_of_a_homogeneous_body():
    b = make_blocks(3)
    material = NeoHookean(E, NU)
    solid = b.solid(material)
    b.move(*[lambda x: (F0 - np.eye(3)) @ x] * 2)
    P, J = stress(material, F0), np.linalg.det(F0)
    sigma = solid.cauchy_stress(b.state.u)
    values = [[integrate(form(sigma[i, j] * ufl.dx)) for j in range(3)] for i in range(3)]
    np.testing.assert_allclose(values, P @ F0.T / J, rtol=1e-10)
    assert integrate(form(solid.strain_energy_density(b.state.u) * ufl.dx)) == pytest.approx(
        float(energy(material, F0))
    )
    assert solid.energies()["strain"] == pytest.approx(float(energy(material, F0)))
    assert solid.smallest_jacobian() == pytest.approx(J)


def test_an_inverted_element_is_named():
    b = make_blocks()
    solid = b.solid(NeoHookean(E, NU), name="gel")
    assert solid.diagnose() is None
    b.move(lambda x: 0 * x, lambda x: np.array([-2.5 * x[0], 0 * x[0]]))
    assert "gel: element inverted, smallest J = -1.5" in solid.diagnose()


@pytest.mark.parametrize(
    ("options", "name"),
    [({"plane": "stress"}, "plane"), ({"volumetric": "none"}, "volumetric"), ({"viscosity": -1.0}, "viscosity")],
)
def test_body_refuses_bad_parameters(options, name):
    with pytest.raises(ValueError, match=f"{name} = .* is not allowed"):
        make_blocks(3).solid(**options)
