"""Responses at large strain against closed forms, and the accuracy of the principal stretches."""

import numpy as np
import pytest
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI

from cutsim.analysis.stepping import StepControl, run
from cutsim.base.assembly import integrate
from cutsim.base.compat import evaluate, expression, form
from cutsim.base.parameters import with_constants
from cutsim.materials.anisotropic import FungOrthotropic, TransverselyIsotropic
from cutsim.materials.directions import piecewise_direction
from cutsim.materials.elastic import IsochoricNeoHookean, LinearElastic, NeoHookean
from cutsim.materials.fibres import DispersedFibres, EllipsoidalFibres, ExponentialFibres, Reinforced
from cutsim.materials.orthotropic import Orthotropic
from cutsim.materials.rubbers import IsochoricOgden, Ogden
from cutsim.materials.stretches import stretch_power_sums
from helpers.blocks import make_blocks
from helpers.examples import AXIS, INVARIANTS, MATERIALS
from helpers.fields import rotation, smooth
from helpers.laws import NU, E
from helpers.materials import F0, PATHS, cube_between_plates, energy, incompressible, name, nominal, response, stress
from helpers.tangents import assert_slope_two

STRETCHES = [0.5, 0.9, 1.0, 1.001, 1.4, 2.5]
OGDEN = Ogden((0.5, 0.3, 0.02), (1.3, -2.0, 9.0), 3.0)
ISOCHORIC = IsochoricOgden(OGDEN.moduli, OGDEN.exponents, 3.0)


@pytest.mark.parametrize("stretch", STRETCHES)
@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize("material", INVARIANTS, ids=name)
def test_invariant_models(material, path, stretch):
    """P₁ = 2 (λ₁ − λ₃²/λ₁) (∂W/∂I₁ + λ₂² ∂W/∂I₂) at constant volume (Rivlin)."""
    a, b, c = incompressible(path, stretch)
    slope, second = INVARIANTS[material]
    exact = 2 * (a - c**2 / a) * (slope(a**2 + b**2 + c**2) + second * b**2)
    assert nominal(material, (a, b, c)) == pytest.approx(exact, rel=1e-10, abs=1e-12)


def test_neo_hookean_forms():
    """G (λ − λ⁻²) uniaxial, G (λ − λ⁻⁵) equibiaxial, G γ in simple shear."""
    material = IsochoricNeoHookean.from_moduli(shear=0.7, bulk=9.0)
    for stretch in STRETCHES:
        for path, power in (("uniaxial", -2), ("equibiaxial", -5)):
            exact = 0.7 * (stretch - stretch**power)
            assert nominal(material, incompressible(path, stretch)) == pytest.approx(exact, rel=1e-10, abs=1e-12)
    assert stress(material, np.eye(3) + 1.3 * np.eye(3, k=1))[0, 1] == pytest.approx(0.7 * 1.3, rel=1e-12)


@pytest.mark.parametrize("stretch", STRETCHES)
@pytest.mark.parametrize("path", PATHS)
def test_ogden(path, stretch):
    """P₁ = Σ μ/m (λ₁ᵐ − λ₃ᵐ)/λ₁ at constant volume; two stretches coincide in two of the paths, all three at 1."""
    a, b, c = incompressible(path, stretch)
    exact = sum(mu / m * (a**m - c**m) / a for mu, m in zip(OGDEN.moduli, OGDEN.exponents, strict=True))
    for material in (OGDEN, ISOCHORIC):
        assert nominal(material, (a, b, c)) == pytest.approx(exact, rel=1e-10, abs=1e-12)


@pytest.mark.parametrize("stretches", [(2.0, 0.7, 0.7), (1.3, 1.3, 1.3), (1.3, 1.1, 0.8), (1.1, 1.1, 1.1 + 1e-7)])
def test_ogden_with_volume_change_in_any_frame(stretches):
    """P = Q diag(Σ μ/m (λᵐ − 1)/λ + c (J − 1) J/λ) Rᵀ."""
    a = np.array(stretches)
    Q, R = rotation(3, 0.8), rotation(3, 2.1)
    principal = sum(mu / m * (a**m - 1) / a for mu, m in zip(OGDEN.moduli, OGDEN.exponents, strict=True))
    principal += OGDEN.volumetric * (a.prod() - 1) * a.prod() / a
    P = stress(OGDEN, Q @ np.diag(a) @ R.T)
    np.testing.assert_allclose(P, Q @ np.diag(principal) @ R.T, atol=1e-10 * np.abs(principal).max())


def test_ogden_contains_neo_hookean_and_its_own_notation():
    """One term with m = 2 is the compressible neo-Hookean distortion; ν gives the volumetric coefficient."""
    ogden, neo = Ogden((2 * 0.7,), (2.0,), 1.0), NeoHookean.from_moduli(0.7, 1.0)
    part = stress(ogden, F0) - stress(neo, F0)
    J, T = np.linalg.det(F0), np.linalg.inv(F0).T
    np.testing.assert_allclose(part, ((J - 1) * J - neo.lame * np.log(J)) * T, atol=1e-13)
    assert Ogden.from_poisson((1.0, 0.4), (2.0, 5.0), 0.47).poisson == pytest.approx(0.47)
    np.testing.assert_allclose(
        stress(IsochoricOgden((2 * 0.7,), (2.0,), 1.0), F0),
        stress(IsochoricNeoHookean.from_moduli(0.7, 1.0), F0),
        atol=1e-13,
    )


# -- principal stretches ----------------------------------------------------------------------------------------------


CLUSTERS = [
    (1.0, 1.0, 1.0),
    (1.0, 1.0, 1.0 + 1e-9),
    (1.0, 1.0 + 1e-5, 1.0 - 2e-5),
    (1.0, 1.0, 1.0007),
    (1.0, 1.0, 1.0008),
    (1.0, 1.0, 1.01),
    (2.0, 0.7, 0.7),
    (2.0, 0.7, 0.7 + 1e-8),
    (2.0, 0.7, 0.7004),
    (2.0, 0.7, 0.7012),
    (0.5, 1.5, 1.5),
    (1.2, 1.0, 0.8),
    (3.0, 1.0, 1 / 3),
]


class PowerSum:
    """Σ λᵐ with first and second derivative along H, for any m and F."""

    def __init__(self):
        self._mesh = mesh.create_unit_interval(MPI.COMM_SELF, 1)
        self._F, self._H = (fem.Constant(self._mesh, np.eye(3)) for _ in range(2))
        self._m = fem.Constant(self._mesh, 1.0)
        along = ufl.variable(fem.Constant(self._mesh, 0.0))
        value = stretch_power_sums(self._F + along * self._H, [self._m])[0]
        first = ufl.diff(value, along)
        second = ufl.diff(first, along)
        self._values = expression(ufl.as_vector([value, first, second]), np.array([[0.5]]), self._mesh)

    def __call__(self, F, H, m):
        self._F.value[:], self._H.value[:], self._m.value = F, H, m
        return evaluate(self._values, self._mesh, np.zeros(1, dtype=np.int32))[0]


@pytest.fixture(scope="module")
def power_sum():
    return PowerSum()


def exact_power_sum(stretches, m, H):
    """Perturbation of eigenvalues: the divided differences of f(c) = c^(m/2), with their limits."""
    c, p = np.array(stretches) ** 2, m / 2
    F = np.diag(stretches)
    D, DD = F.T @ H + H.T @ F, 2 * H.T @ H
    slope = p * c ** (p - 1)
    mean = 0.5 * (c[:, None] + c[None, :])
    apart = np.abs(c[:, None] - c[None, :]) / mean
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = (slope[:, None] - slope[None, :]) / (c[:, None] - c[None, :])
    # the mean value of f'' over the gap: Taylor's series in the gap where the quotient cancels
    gap = (c[:, None] - c[None, :]) / 2
    series = p * (p - 1) * mean ** (p - 2) * (1 + (p - 2) * (p - 3) / 6 * (gap / mean) ** 2)
    quotient = np.where(apart < 2e-3, series, ratio)
    return (c**p).sum(), (slope * np.diag(D)).sum(), (slope * np.diag(DD)).sum() + (quotient * D**2).sum()


@pytest.mark.parametrize("m", [-6.0, -3.0, -2.0, 0.7, 2.0, 5.0, 9.0, 26.0])
@pytest.mark.parametrize("stretches", CLUSTERS, ids=str)
def test_power_sum_and_its_derivatives(power_sum, stretches, m):
    """Where stretches coincide, nearly coincide, and on both sides of the change between the formulas."""
    H = np.random.default_rng(0).uniform(-1, 1, (3, 3))
    Q, R = rotation(3, 0.8), rotation(3, 2.1)
    values = power_sum(Q @ np.diag(stretches) @ R.T, Q @ H @ R.T, m)
    exact = exact_power_sum(stretches, m, H)
    size = max(np.array(stretches) ** m)
    assert values[0] == pytest.approx(exact[0], abs=1e-11 * size)
    assert values[1] == pytest.approx(exact[1], abs=1e-11 * abs(m) * max(np.array(stretches) ** (m - 1)))
    assert values[2] == pytest.approx(exact[2], abs=1e-9 * m**2 * max(np.array(stretches) ** (m - 2)))


# -- fibres -----------------------------------------------------------------------------------------------------------


def alone(law, F):
    """Stress of a family of fibres without its matrix."""
    matrix = NeoHookean(E, NU)
    return stress(Reinforced(matrix, (law,)), F) - stress(matrix, F)


UNIT = np.array([0.6, 0.8, 0.0])


@pytest.mark.parametrize("factor", [0.7, 1.0, 1.2])
def test_exponential_fibres(factor):
    """P = 2 ξ x^(β−1) exp(α x^β) F a ⊗ a, x = I₄ − 1; nothing when shortened. The length of a does not matter."""
    law = ExponentialFibres((3.0, 4.0), 0.8, 0.5, 2.5)
    F = factor * F0
    x = max((F @ UNIT) @ (F @ UNIT) - 1, 0)
    exact = 2 * 0.8 * x**1.5 * np.exp(0.5 * x**2.5) * np.outer(F @ UNIT, UNIT)
    np.testing.assert_allclose(alone(law, F), exact, atol=1e-13)
    assert (x == 0) == (factor < 1)


@pytest.mark.parametrize("stretch", [0.8, 1.1, 1.4])
def test_parallel_fibres_under_uniaxial_tension(stretch):
    """Holzapfel, Gasser and Ogden: P = P_matrix + 2 k₁ x exp(k₂ x²) λ, x = λ² − 1, in tension only."""
    material = Reinforced(IsochoricNeoHookean.from_moduli(0.7, 9.0), (DispersedFibres((1.0, 0.0, 0.0), 0.8, 0.5),))
    x = max(stretch**2 - 1, 0)
    a = stretch, stretch**-0.5, stretch**-0.5
    exact = 0.7 * (stretch - stretch**-2) + 2 * 0.8 * x * np.exp(0.5 * x**2) * stretch
    assert nominal(material, a) == pytest.approx(exact, rel=1e-10)


@pytest.mark.parametrize("kappa", [0.0, 0.1, 1 / 3])
def test_dispersed_fibres_in_two_families(kappa):
    """Biaxial tension, families at ±φ: σ₁ − σ₃ = G(λ₁² − λ₃²) + 4 Σ W' (κ(λ₁²−λ₃²) + (1−3κ) λ₁² cos²φ)."""
    angle, k1, k2 = 0.6, 0.8, 0.5
    families = [(np.cos(angle), sign * np.sin(angle), 0.0) for sign in (1, -1)]
    material = Reinforced(
        IsochoricNeoHookean.from_moduli(0.7, 9.0), tuple(DispersedFibres(a, k1, k2, kappa) for a in families)
    )
    a, b = 1.3, 1.1
    c = 1 / (a * b)
    I1, I4 = a**2 + b**2 + c**2, a**2 * np.cos(angle) ** 2 + b**2 * np.sin(angle) ** 2
    x = kappa * (I1 - 3) + (1 - 3 * kappa) * (I4 - 1)
    slope = k1 * x * np.exp(k2 * x**2)
    kirchhoff = 0.7 * (a**2 - c**2)
    kirchhoff += 4 * slope * (kappa * (a**2 - c**2) + (1 - 3 * kappa) * a**2 * np.cos(angle) ** 2)
    assert nominal(material, (a, b, c)) == pytest.approx(kirchhoff / a, rel=1e-10)
    if kappa == 1 / 3:
        turned = Reinforced(material.matrix, tuple(DispersedFibres(AXIS, k1, k2, kappa) for _ in families))
        assert nominal(turned, (a, b, c)) == pytest.approx(kirchhoff / a, rel=1e-10)


def sphere(F, law, n=400):
    """Stress of an ellipsoidal distribution by a fine product rule on the sphere."""
    z, w = np.polynomial.legendre.leggauss(n)
    angle = 2 * np.pi * (np.arange(2 * n) + 0.5) / (2 * n)
    r = np.sqrt(1 - z**2)
    N = np.stack([np.outer(r, np.cos(angle)), np.outer(r, np.sin(angle)), np.outer(z, np.ones(2 * n))], -1)
    weight = np.outer(w, np.full(2 * n, np.pi / n))
    image = N @ F.T
    x = np.maximum((image**2).sum(-1) - 1, 0)
    modulus = ((N / law.moduli) ** 2).sum(-1) ** -0.5
    scale = weight * modulus * 2 * law.power * x ** (law.power - 1)
    return np.einsum("ab,abi,abj->ij", scale, image, N)


def test_ellipsoidal_fibres_all_stretched():
    """Isotropic moduli and β = 2: W = 4πξ [(2 tr C² + tr² C)/15 − ⅔ tr C + 1]."""
    law = EllipsoidalFibres((0.3, 0.3, 0.3))
    matrix = NeoHookean(E, NU)
    material = Reinforced(matrix, (law,))
    for F in (1.3 * np.eye(3), 1.4 * F0):
        C = F.T @ F
        t = np.trace(C)
        exact = 4 * np.pi * 0.3 * ((2 * np.trace(C @ C) + t**2) / 15 - 2 * t / 3 + 1)
        assert energy(material, F) - energy(matrix, F) == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("power", [2.0, 3.0])
def test_ellipsoidal_fibres_partly_slack(power):
    """The accuracy that the class states: in uniaxial tension at constant volume many directions shorten."""
    law = EllipsoidalFibres((0.1, 0.2, 0.3), power)
    errors = []
    for stretch in (1.1, 1.3, 1.6):
        for axis in range(3):
            F = np.diag(np.roll([stretch, stretch**-0.5, stretch**-0.5], axis))
            exact = sphere(F, law)
            errors.append(np.abs(alone(law, F) - exact).max() / np.abs(exact).max())
    print(f"beta = {power}: largest error of the stress {max(errors):.2e}")
    assert max(errors) < 0.015


def test_directions_by_region_and_as_a_field():
    """Two blocks with fibres along x and along y: the energy is the sum of that of each."""
    b = make_blocks(3)
    along_x, along_y = (1.0, 0.0, 0.0), (0.0, 2.0, 0.0)
    regions = piecewise_direction(b.state.mesh, {along_x: b.lower, along_y: b.upper})
    law = ExponentialFibres(along_x, 0.8, 0.5)
    matrix = NeoHookean(E, NU)
    b.move(*[lambda x: (F0 - np.eye(3)) @ x] * 2)

    def total(direction):
        material = Reinforced(matrix, (ExponentialFibres(direction, 0.8, 0.5),))
        return b.solid(material).energies()["strain"]

    halves = [0.5 * energy(Reinforced(matrix, (ExponentialFibres(a, 0.8, 0.5),)), F0) for a in (along_x, along_y)]
    assert total(regions) == pytest.approx(sum(halves), rel=1e-12)
    assert total(ufl.as_vector([1.0, 0.0, 0.0])) == pytest.approx(total(law.direction), rel=1e-12)
    x = ufl.SpatialCoordinate(b.state.mesh)
    assert total(ufl.conditional(ufl.lt(x[2], 0.5), ufl.as_vector(along_x), ufl.as_vector(along_y))) == pytest.approx(
        sum(halves), rel=1e-12
    )
    assert integrate(form(regions[1] * ufl.dx)) == pytest.approx(1.0)


# -- anisotropic solids -----------------------------------------------------------------------------------------------


def test_transversely_isotropic_small_strain():
    """Compliance in the axes: 1/E_a along a, −ν_a/E_a, 1/E across, −ν/E, and both shear moduli."""
    young, nu, axial, nu_a, shear = 1.0, 0.3, 4.0, 0.2, 0.7
    material = TransverselyIsotropic((1.0, 0.0, 0.0), young, nu, axial, nu_a, shear)
    h = 1e-6

    def response_to(i, j):
        strain = np.zeros((3, 3))
        strain[i, j] = strain[j, i] = h / (1 if i == j else 2)
        return (stress(material, np.eye(3) + strain) - stress(material, np.eye(3) - strain)) / (2 * h)

    normal = np.array([np.diag(response_to(i, i)) for i in range(3)])
    compliance = [
        [1 / axial, -nu_a / axial, -nu_a / axial],
        [-nu_a / axial, 1 / young, -nu / young],
        [-nu_a / axial, -nu / young, 1 / young],
    ]
    np.testing.assert_allclose(np.linalg.inv(normal), compliance, atol=1e-8)
    assert response_to(0, 1)[0, 1] == pytest.approx(shear, rel=1e-8)
    assert response_to(1, 2)[1, 2] == pytest.approx(young / (2 * (1 + nu)), rel=1e-8)


def test_transversely_isotropic_with_isotropic_constants_is_neo_hookean():
    material = TransverselyIsotropic(AXIS, E, NU, E, NU, E / (2 * (1 + NU)))
    np.testing.assert_allclose(stress(material, F0), stress(NeoHookean(E, NU), F0), atol=1e-13)


@pytest.mark.parametrize("stretch", [0.8, 1.3])
def test_transversely_isotropic_stretched_along_the_axis(stretch):
    """P₁ = G(λ − 1/λ) + Λ ln λ/λ + β (x/λ + 2λ ln λ) + 4γ x λ − 2α x λ, x = λ² − 1, no lateral strain."""
    material = TransverselyIsotropic((1.0, 0.0, 0.0), 1.0, 0.3, 4.0, 0.2, 0.7)
    G, m = 1 / 2.6, 1 - 0.3 - 2 * 0.04 / 4
    lame = (0.3 + 0.04 / 4) / (1.3 * m)
    alpha, beta = G - 0.7, (0.2 / m - lame) / 2
    gamma = (4 * 0.7 / m + lame - 2 * 0.2 / m + 2 * G - 4 * 0.7) / 8
    x, log = stretch**2 - 1, np.log(stretch)
    exact = G * (stretch - 1 / stretch) + lame * log / stretch + beta * (x / stretch + 2 * stretch * log)
    exact += (4 * gamma - 2 * alpha) * x * stretch
    assert stress(material, np.diag([stretch, 1, 1]))[0, 0] == pytest.approx(exact, rel=1e-10)


def test_fung_orthotropic():
    """S = c e^Q b E for an isochoric stretch in the axes, up to the pressure: σ₁ − σ₂ and σ₂ − σ₃."""
    c, normal, coupling = 0.2, (3.0, 2.0, 1.5), (0.5, 0.4, 0.3)
    turn = rotation(3, 0.9)
    axes = tuple(map(tuple, turn.T[:2]))
    material = FungOrthotropic(c, normal, coupling, (1.0, 0.8, 0.9), 4.0, axes)
    stretches = np.array([1.3, 1.1, 1 / 1.43])
    B = np.array([[3.0, 0.5, 0.3], [0.5, 2.0, 0.4], [0.3, 0.4, 1.5]])
    strain = 0.5 * (stretches**2 - 1)
    sigma = stretches**2 * c * np.exp(strain @ B @ strain) * (B @ strain)
    P = stress(material, turn @ np.diag(stretches) @ turn.T)
    cauchy = np.diag(turn.T @ P @ turn) * stretches
    np.testing.assert_allclose(np.diff(cauchy), np.diff(sigma), rtol=1e-10)


def test_fung_in_shear():
    """Small shear in each plane has the modulus c b; a solid with isotropic numbers reports its own constants."""
    material = FungOrthotropic(0.2, (3.0, 2.0, 1.5), (0.5, 0.4, 0.3), (1.0, 0.8, 0.9), 4.0)
    for b, (i, j) in zip(material.shear, ((0, 1), (1, 2), (2, 0)), strict=True):
        F = np.eye(3)
        F[i, j] += 1e-6
        assert stress(material, F)[i, j] == pytest.approx(0.2 * b * 1e-6, rel=1e-5)
    alike = FungOrthotropic(0.5, (3.0,) * 3, (1.0,) * 3, (1.0,) * 3, 4.0)
    assert alike.young == pytest.approx(IsochoricNeoHookean.from_moduli(0.5, 4.0).young)


# -- finite elements --------------------------------------------------------------------------------------------------


# in the plane all three stretches are there as well, but no fibre leaves it; a rubber in space is in test_tangents
SPATIAL = [m for m in MATERIALS if isinstance(m, TransverselyIsotropic | Orthotropic | Reinforced)]


@pytest.mark.parametrize(
    ("material", "gdim"),
    [*((m, 2) for m in MATERIALS), *((m, 3) for m in SPATIAL)],
    ids=lambda v: v if isinstance(v, int) else name(v),
)
def test_tangent(material, gdim):
    """Taylor slope 2 about a stretched state, in which fibres are either in tension or slack throughout the steps."""
    b = make_blocks(gdim)
    u = smooth(b.state.V, 1, 0.1)
    b.state.u.interpolate(lambda x: 0.3 * x[:gdim])
    u += b.state.u.x.array
    assert_slope_two(b.solid(material), b.state, u, 0.3, linear=isinstance(material, LinearElastic | Orthotropic))


@pytest.mark.parametrize("stretch", [0.6, 2.0])
def test_newton_from_the_reference_through_coinciding_stretches(stretch):
    """A cube pulled and pressed from C = I, two stretches coinciding all the way.

    The closed form of the incompressible solid is met up to G/K, the iterations are those of a neo-Hookean solid.
    """
    reports = {poisson: [] for poisson in (0.4995, 0.499999)}
    for poisson, record in reports.items():
        ogden = Ogden.from_poisson((0.5, 0.3), (1.3, -2.0), poisson)
        run(cube_between_plates(ogden, stretch, False), 1.0, StepControl.fixed(0.1), record.append)
        exact = sum(mu / m * (stretch ** (m - 1) - stretch ** (-m / 2 - 1)) for mu, m in ((0.5, 1.3), (0.3, -2.0)))
        compressibility = ogden.shear / ogden.volumetric
        assert record[-1].columns["top_force"][0] == pytest.approx(exact, rel=5 * compressibility)
    assert max(r.outcome.iterations for r in reports[0.4995]) <= 6


def test_other_values_need_no_other_kernel():
    """Numbers inside tuples and inside the laws of fibres are form constants too."""
    domain = mesh.create_unit_interval(MPI.COMM_SELF, 1)

    def signature(material):
        W = sum(with_constants(domain, material).energy(ufl.Identity(3) * fem.Constant(domain, 1.1)))
        return (W * ufl.dx(domain)).signature()

    assert signature(OGDEN) == signature(Ogden((0.1, 0.2, 0.3), (2.0, 5.0, -1.0), 9.0))
    families = [Reinforced(NeoHookean(e, 0.3), (DispersedFibres((e, 0.0, 0.1), e, e, 0.1),)) for e in (1.0, 2.0)]
    assert signature(families[0]) == signature(families[1])
    assert response(OGDEN) is response(OGDEN)
