"""Energy-release rates against closed forms: the K-field, clamped strips, beams."""

import numpy as np
import pytest
from dolfinx import mesh
from dolfinx.mesh import CellType
from mpi4py import MPI

from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.stepping import StepControl, run
from cutsim.base.assembly import integrate
from cutsim.base.compat import cell_partitioner, form
from cutsim.bodies.loads import Support
from cutsim.bodies.solid import Solid
from cutsim.fields.space import cracked_space
from cutsim.fields.state import State
from cutsim.materials.elastic import LinearElastic, NeoHookean
from cutsim.studies.fracture import (
    BentBeam,
    CantileverBeams,
    JIntegral,
    crack_length_correction,
    energy_release_from_compliance,
    energy_release_from_energy,
    plane_modulus,
    stress_intensity,
)

PARTITIONER = cell_partitioner()


def rectangle(length, half_height, nx, ny):
    corners = [(0.0, -half_height), (length, half_height)]
    return mesh.create_rectangle(MPI.COMM_WORLD, corners, (nx, ny), CellType.quadrilateral, partitioner=PARTITIONER)


def cracked_state(domain, tip, degree):
    """A crack in the plane y = 0 for x < tip."""
    gdim = domain.geometry.dim
    facets = mesh.locate_entities(domain, gdim - 1, lambda x: np.isclose(x[1], 0) & (x[0] < tip + 1e-9))
    return State(cracked_space(domain, ("Lagrange", degree, (gdim,)), facets))


# --- the K-field, without solving anything ---


def k_field(x, tip, material, plane):
    """Displacement of a crack tip under K_I = 1 (Williams)."""
    r = np.hypot(x[0] - tip, x[1])
    # the upper face is at +π, the lower one at −π: rounding of x[1] = 0 decides nothing, the cells do
    theta = np.arctan2(x[1], x[0] - tip)
    kappa = 3 - 4 * material.poisson if plane == "strain" else (3 - material.poisson) / (1 + material.poisson)
    scale = np.sqrt(r / (2 * np.pi)) / (2 * material.shear) * (kappa - np.cos(theta))
    return np.stack((scale * np.cos(theta / 2), scale * np.sin(theta / 2), 0 * r))


def put_k_field(state, tip, material, plane="strain"):
    gdim = state.mesh.geometry.dim
    for side in (-1, 1):
        cells = mesh.locate_entities(state.mesh, gdim, lambda x, side=side: side * x[1] > -1e-9)

        def value(x, side=side):
            y = side * np.maximum(side * x[1], 1e-15)
            return k_field(np.stack((x[0], y)), tip, material, plane)[:gdim]

        state.u.interpolate(value, cells)
    state.u.x.scatter_forward()


@pytest.mark.mpi
@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_j_of_the_k_field(plane):
    material = LinearElastic(2.0, 0.3)
    state = cracked_state(rectangle(2.0, 1.0, 40, 40), 1.0, 2)
    solid = Solid(state, material, plane=plane)
    put_k_field(state, 1.0, material, plane)
    J = JIntegral(solid, (1.0, 0.0), (1.0, 0.0), 0.3, 0.9)()
    assert stress_intensity(J, plane_modulus(2.0, 0.3, plane)) == pytest.approx(1.0, rel=1e-3)


@pytest.mark.mpi
def test_j_does_not_depend_on_the_domain_and_has_the_sign_of_the_direction():
    material = LinearElastic(2.0, 0.3)
    state = cracked_state(rectangle(2.0, 1.0, 40, 40), 1.0, 2)
    solid = Solid(state, material)
    put_k_field(state, 1.0, material)
    domains = [JIntegral(solid, (1.0, 0.0), (3.0, 0.0), r, R)() for r, R in ((0.2, 0.6), (0.3, 0.9), (0.5, 0.8))]
    assert np.ptp(domains) < 2e-3 * domains[0]
    assert JIntegral(solid, (1.0, 0.0), (-1.0, 0.0), 0.3, 0.9)() == pytest.approx(-domains[1], rel=1e-12)
    # around a point that is no tip, nothing is released
    assert abs(JIntegral(solid, (1.5, 0.0), (1.0, 0.0), 0.1, 0.4)()) < 2e-3 * domains[0]


def test_j_of_the_k_field_in_space_is_the_mean_over_the_front():
    material, depth = LinearElastic(2.0, 0.3), 0.7
    box = mesh.create_box(
        MPI.COMM_WORLD, [(0, -1, 0), (2, 1, depth)], (20, 20, 2), CellType.hexahedron, partitioner=PARTITIONER
    )
    state = cracked_state(box, 1.0, 1)
    put_k_field(state, 1.0, material)
    solid = Solid(state, material)
    flat = cracked_state(rectangle(2.0, 1.0, 20, 20), 1.0, 1)
    put_k_field(flat, 1.0, material)
    expected = JIntegral(Solid(flat, material), (1.0, 0.0), (1.0, 0.0), 0.3, 0.9)()
    J = JIntegral(solid, (1.0, 0.0, 0.3), (1.0, 0.0, 0.0), 0.3, 0.9, front=(0.0, 0.0, -2.0), length=depth)()
    assert J == pytest.approx(expected, rel=1e-6)


# --- a clamped strip with a long crack: J = W(λ) · 2h at any stretch (Rivlin and Thomas' pure shear specimen) ---

STRIP = {"length": 6.0, "half_height": 0.5, "nx": 48, "ny": 8}
TIP = 3.0


def stretched_strip(material, stretch, tip=TIP, volumetric="full"):
    """The strip is stretched between rigid grips; far ahead of the tip F = diag(1, λ, 1)."""
    domain = rectangle(**STRIP)
    state = cracked_state(domain, tip, 1)
    solid = Solid(state, material, volumetric=volumetric)
    h = STRIP["half_height"]

    def edge(axis, at):
        return mesh.locate_entities_boundary(domain, 1, lambda x: np.isclose(x[axis], at))

    supports = [Support(state, edge(0, STRIP["length"]), 0)]
    for y in (-h, h):
        supports += [Support(state, edge(1, y), 0), Support(state, edge(1, y), 1, lambda t, y=y: (stretch - 1) * y * t)]
    mechanics = Mechanics(state, [solid], supports)
    with mechanics.problem:
        run(mechanics, 1.0, StepControl.fixed(0.2))
    return solid, mechanics.audit.entries["strain"]


def uniform_energy(material, stretch):
    """W at F = diag(1, λ, 1) of the two materials, written out."""
    if isinstance(material, NeoHookean):
        J = stretch
        return material.shear / 2 * (stretch**2 - 1) - material.shear * np.log(J) + material.lame / 2 * np.log(J) ** 2
    return (material.shear + material.lame / 2) * (stretch - 1) ** 2


@pytest.mark.mpi
@pytest.mark.parametrize(
    ("material", "stretch", "volumetric"),
    [
        (LinearElastic(1.0, 0.3), 1.01, "full"),
        (NeoHookean(1.0, 0.3), 1.6, "full"),
        (NeoHookean(1.0, 0.3), 1.6, "reduced"),
    ],
)
def test_j_of_a_clamped_strip_is_exact_where_the_domain_reaches_uniform_stretch(material, stretch, volumetric):
    solid, _ = stretched_strip(material, stretch, volumetric=volumetric)
    exact = uniform_energy(material, stretch) * 2 * STRIP["half_height"]
    # the whole height takes part and the grips hold u: only what leaves ahead counts, whatever the mesh
    J = JIntegral(solid, (TIP, 0.0), (1.0, 0.0), 2.0, 2.9)()
    assert J == pytest.approx(exact, rel=2e-4)
    near = JIntegral(solid, (TIP, 0.0), (1.0, 0.0), 0.15, 0.45)()
    assert near == pytest.approx(exact, rel=0.03)


def test_j_is_the_strain_energy_that_a_longer_crack_releases():
    material, stretch, step = NeoHookean(1.0, 0.3), 1.5, STRIP["length"] / STRIP["nx"]
    lengths = [TIP - step, TIP, TIP + step]
    strips = [stretched_strip(material, stretch, tip) for tip in lengths]
    G = energy_release_from_energy([energy for _, energy in strips], lengths, 1.0)[1]
    J = JIntegral(strips[1][0], (TIP, 0.0), (1.0, 0.0), 2.0, 2.9)()
    assert G == pytest.approx(J, rel=1e-3) and G > 0


@pytest.mark.mpi
@pytest.mark.parametrize("material", [LinearElastic(1.0, 0.48), NeoHookean(1.0, 0.48)])
def test_the_two_rules_of_the_strain_energy_do_not_disturb_each_other(material):
    domain = rectangle(1.0, 0.5, 5, 4)
    domain.geometry.x[:, 0] *= 1 + 0.2 * domain.geometry.x[:, 1] ** 2
    solid = Solid(cracked_state(domain, 0.4, 1), material)
    solid.state.u.interpolate(lambda x: np.stack((0.1 * x[0] * x[1], 0.05 * x[0] ** 2)))
    F = solid.deformation_gradient(solid.state.u)
    parts = [W * dx for W, dx in zip(material.energy(F), solid.measures, strict=True)]
    assert integrate(form(parts[0] + parts[1])) == pytest.approx(
        sum(integrate(form(part)) for part in parts), rel=1e-12
    )


@pytest.mark.mpi
def test_bad_domains_are_refused_on_all_ranks():
    solid = Solid(cracked_state(rectangle(2.0, 1.0, 4, 4), 1.0, 1), LinearElastic(1.0, 0.3))
    for arguments, options, name in (
        (((1.0,), (1.0, 0.0), 0.1, 0.2), {}, "tip"),
        (((1.0, 0.0), (0.0, 0.0), 0.1, 0.2), {}, "direction"),
        (((1.0, 0.0), (1.0, 0.0), 0.2, 0.2), {}, "inner"),
        (((1.0, 0.0), (1.0, 0.0), 0.1, 0.2), {"length": 0.0}, "length"),
        (((1.0, 0.0), (1.0, 0.0), 0.1, 0.2), {"front": (0.0, 0.0, 1.0)}, "front"),
    ):
        with pytest.raises(ValueError, match=f"^{name} = "):
            JIntegral(solid, *arguments, **options)


# --- closed forms ---


def test_bent_beam_formula():
    beam = BentBeam(height=20.0, thickness=10.0)
    assert beam.shape(9.0) == pytest.approx(2.2855, abs=5e-5)
    assert beam.stress_intensity(100.0, 9.0) == pytest.approx(100 * 80 / (10 * 20**1.5) * 2.2855, rel=1e-4)
    # a short notch is an edge crack in pure bending: K → 1.12 σ √(πa) with σ = 3PS/(2BW²), within the formula's 0.5 %
    # and the few per cent that the stress gradient and the load's own field take off
    short = 1e-6 * 20
    assert beam.shape(short) / (1.5 * np.sqrt(np.pi * 1e-6)) == pytest.approx(1.12, rel=0.01)
    P = beam.critical_load(0.0068, 9.0, 65e3)
    assert beam.stress_intensity(P, 9.0) ** 2 / 65e3 == pytest.approx(0.0068, rel=1e-12)
    for notch in (0.0, 20.0, -1.0):
        with pytest.raises(ValueError, match=r"notch = .* \(0, height = 20\)"):
            beam.shape(notch)


def test_cantilever_beams():
    modulus = plane_modulus(200e3, 0.3)
    assert crack_length_correction(2.6, 1.0) == pytest.approx(0.663, abs=1e-3)
    simple = CantileverBeams(1.5, 1.0, modulus)
    corrected = CantileverBeams(1.5, 1.0, modulus, 0.663)
    assert simple.propagation(0.28, 30.0) == pytest.approx((4.385, 1.277), abs=1e-3)
    assert corrected.propagation(0.28, 30.0) == pytest.approx((4.245, 1.363), abs=1e-3)
    load, opening = corrected.propagation(0.28, 30.0)
    assert corrected.load(opening, 30.0) == pytest.approx(load, rel=1e-12)


def test_energy_release_from_compliance_and_from_energy_agree_on_beams():
    beams, opening = CantileverBeams(1.5, 2.0, 200e3), 1.0
    lengths = 30.0 + np.array([-0.1, 0.0, 0.1])
    loads = np.array([beams.load(opening, a) for a in lengths])
    exact = (loads[1] * 30.0) ** 2 / (beams.thickness * beams.rigidity)
    assert energy_release_from_compliance(loads, opening + 0 * loads, lengths, 2.0)[1] == pytest.approx(exact, rel=1e-4)
    assert energy_release_from_energy(0.5 * loads * opening, lengths, 2.0)[1] == pytest.approx(exact, rel=1e-4)
    with pytest.raises(ValueError, match="lengths = "):
        energy_release_from_energy(loads, lengths[::-1], 2.0)
    with pytest.raises(ValueError, match="thickness = "):
        energy_release_from_compliance(loads, loads, lengths, 0.0)
