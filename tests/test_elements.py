"""Bodies of revolution, pressure, and elements that do not lock (docs/elements.md)."""

import numpy as np
import pytest
from conftest import EXPONENTIAL, make_blocks
from dolfinx import fem, mesh
from mpi4py import MPI
from scipy.optimize import brentq
from test_tangents import assert_slope_two, smooth

from cutsim.conduction import HeatBody
from cutsim.contact import PenaltyContact
from cutsim.fracture import JIntegral
from cutsim.friction import Coulomb
from cutsim.heat_loads import HeatFlux, PrescribedTemperature
from cutsim.heat_transfer import HeatTransfer
from cutsim.interface import Crack
from cutsim.loads import Pressure, Support, Traction
from cutsim.materials import IsochoricNeoHookean, LinearElastic, NeoHookean
from cutsim.mechanics import Mechanics
from cutsim.points import Surface
from cutsim.solid import Solid
from cutsim.state import State
from cutsim.stepping import StepControl, run
from cutsim.temperature import Temperature
from cutsim.tool_contact import ToolContact
from cutsim.tools import Ball, Path
from cutsim.viscoelastic import Prony

E = 2.0
QUAD, TRIANGLE = mesh.CellType.quadrilateral, mesh.CellType.triangle
HALF_TURN = np.pi / 2


def rectangle(corners, n, cell=QUAD):
    partitioner = mesh.create_cell_partitioner(mesh.GhostMode.shared_facet)
    return mesh.create_rectangle(MPI.COMM_WORLD, corners, n, cell, partitioner=partitioner)


def quarter_ring(inner, outer, n, cell=QUAD):
    """Quarter of a ring, the meridian plane of half a spherical shell; positions in (r, z)."""
    domain = rectangle([(inner, 0), (outer, HALF_TURN)], n, cell)
    radius, angle = domain.geometry.x[:, 0].copy(), domain.geometry.x[:, 1].copy()
    domain.geometry.x[:, 0], domain.geometry.x[:, 1] = radius * np.sin(angle), radius * np.cos(angle)
    domain.geometry.x[np.isclose(angle, 0), 0] = 0.0
    return domain


class Body:
    """A body in the plane or of revolution."""

    def __init__(self, domain, degree=1, *, axisymmetric=True):
        self.state = State(fem.functionspace(domain, ("Lagrange", degree, (2,))), axisymmetric=axisymmetric)

    def where(self, condition):
        return mesh.locate_entities_boundary(self.state.mesh, 1, condition)

    def hold(self, condition, component, value=0.0, name=None):
        return Support(self.state, self.where(condition), component, value, name=name)

    def at(self, *point):
        """Displacement of the node at a point, the same on all ranks."""
        x = self.state.V.tabulate_dof_coordinates()[: len(self.state.increment) // 2, :2]
        near = np.linalg.norm(x - point, axis=1) < 1e-9
        values = self.state.u.x.array[: 2 * len(x)].reshape(-1, 2)[near]
        return next(v for part in MPI.COMM_WORLD.allgather(values) for v in part)


def at(axis, value):
    return lambda x: np.isclose(x[axis], value)


def on_sphere(radius):
    """Facets whose vertices are on a sphere around the origin."""
    return lambda x: np.isclose(np.hypot(x[0], x[1]), radius)


def final(mechanics, until=1.0, step=0.25):
    """Columns of the last row."""
    rows = []
    run(mechanics, until, StepControl.fixed(step), lambda r: rows.append(r.columns))
    return {name: value for name, (value, _) in rows[-1].items()}


# -- bodies of revolution ---------------------------------------------------------------------------------------------


def uniaxial_stress(material, stretch):
    """Nominal stress of neo-Hookean bar, lateral stretch from vanishing lateral stress."""
    G, lame = material.shear, material.lame
    lateral = brentq(lambda a: G * (a**2 - 1) + lame * np.log(a**2 * stretch), 0.3, 2.0, xtol=1e-15)
    return (G * (stretch**2 - 1) + lame * np.log(lateral**2 * stretch)) / stretch, lateral


@pytest.mark.mpi
@pytest.mark.parametrize(("cell", "degree"), [(QUAD, 1), (QUAD, 2), (TRIANGLE, 1), (TRIANGLE, 2)])
def test_patch_of_a_stretched_cylinder(cell, degree):
    """Uniform stretch on an irregular mesh: force on the whole cross-section and lateral stretch are exact."""
    domain = rectangle([(0, 0), (1.5, 2)], (3, 4), cell)
    x = domain.geometry.x
    x[:, 1] += 0.1 * np.sin(np.pi * x[:, 1] / 2) * np.cos(2 * x[:, 0])
    b, material = Body(domain, degree), NeoHookean(E, 0.3)
    supports = [b.hold(at(0, 0), 0), b.hold(at(1, 0), 1), b.hold(at(1, 2), 1, lambda t: t, "pull")]
    last = final(Mechanics(b.state, [Solid(b.state, material)], supports, rtol=1e-12))
    stress, lateral = uniaxial_stress(material, 1.5)
    assert last["pull_force"] == pytest.approx(np.pi * 1.5**2 * stress, rel=1e-9)
    np.testing.assert_allclose(b.at(1.5, 2), [1.5 * (lateral - 1), 1.0], rtol=1e-9)


def test_cylinder_under_pressure():
    """Lamé: thick cylinder in plane strain, opening and total axial force; quadratic elements, small strain."""
    p, inner, outer, nu = 1e-6, 1.0, 2.0, 0.3
    b = Body(rectangle([(inner, 0), (outer, 1.0)], (8, 2)), 2)
    supports = [b.hold(at(1, 0), 1), b.hold(at(1, 1), 1, name="end")]
    load = Pressure(b.state, b.where(at(0, inner)), lambda t: p * t)
    last = final(Mechanics(b.state, [Solid(b.state, LinearElastic(E, nu)), load], supports), step=1.0)
    opening = p * inner * (1 + nu) / E * ((1 - 2 * nu) * inner**2 + outer**2) / (outer**2 - inner**2)
    assert b.at(inner, 0.5)[0] == pytest.approx(opening, rel=1e-4)
    # σ_z = ν (σ_r + σ_θ) is constant
    assert last["end_force"] == pytest.approx(2 * nu * p * inner**2 * np.pi, rel=1e-4)


def inflated(n, degree, volumetric, opening, nu=0.4999, cell=QUAD, inner=1.0, outer=2.0, p=None):
    """Half a spherical shell under inner pressure, rolling on its equator, at a fraction of a pressure."""
    b = Body(quarter_ring(inner, outer, n, cell), degree)
    material = IsochoricNeoHookean(E, nu)
    supports = [b.hold(lambda x: np.isclose(x[1], 0), 1, name="equator"), b.hold(at(0, 0), 0)]
    load = Pressure(b.state, b.where(on_sphere(inner)), lambda t: p * t)
    m = Mechanics(b.state, [Solid(b.state, material, volumetric=volumetric), load], supports)
    return b, m


def shell_pressure(stretch, inner=1.0, outer=2.0):
    """Pressure in an incompressible neo-Hookean shell, from the hoop stretch of its inner surface."""
    far = (1 + (stretch**3 - 1) * (inner / outer) ** 3) ** (1 / 3)
    return E / 3 * (2 / far + 0.5 / far**4 - 2 / stretch - 0.5 / stretch**4)


def test_inflated_shell_at_large_strain():
    """Closed form of the incompressible shell; its inner surface is stretched by 20 %."""
    b, m = inflated((4, 16), 2, "reduced", 0, p=shell_pressure(1.2))
    last = final(m)
    np.testing.assert_allclose(b.at(1, 0)[0], 0.2, rtol=5e-3)
    np.testing.assert_allclose(b.at(0, 1)[1], 0.2, rtol=5e-3)
    # the supports bear the pressure on the projected opening
    expected = -shell_pressure(1.2) * np.pi * 1.2**2
    assert last["equator_force"] == pytest.approx(expected, rel=5e-3)
    assert abs(last["energy_closure"]) < 2e-3


def test_flat_punch_on_a_half_space():
    """Sneddon: P = 4 G a d/(1 − ν) for a rigid frictionless punch, on a graded block of a hundred radii."""
    domain = rectangle([(0, 0), (2, 1)], (24, 16))
    x = domain.geometry.x
    # the edge of the punch is at 1; cells shrink to it from both sides
    x[:, 0] = np.where(x[:, 0] <= 1, 1 - (1 - x[:, 0]) ** 2, 1 + (np.exp(4.6 * (x[:, 0] - 1) ** 2) - 1))
    x[:, 1] = -(np.exp(4.6 * x[:, 1] ** 1.5) - 1)
    depth, nu = 1e-3, 0.3
    b = Body(domain, 2)
    far = x[:, 1].min()
    punch = b.hold(lambda x: np.isclose(x[1], 0) & (x[0] <= 1 + 1e-9), 1, lambda t: -depth * t, "punch")
    supports = [b.hold(at(0, 0), 0), b.hold(at(1, far), 1), punch]
    last = final(Mechanics(b.state, [Solid(b.state, LinearElastic(E, nu))], supports), step=1.0)
    shear = E / (2 * (1 + nu))
    assert -last["punch_force"] == pytest.approx(4 * shear * depth / (1 - nu), rel=0.02)


RHEOLOGIES = {
    "elastic": {},
    "viscous": {"viscosity": 0.7},
    "relaxing": {"relaxation": Prony((0.5, 0.8), (0.3, 2.0))},
}


@pytest.mark.parametrize("rheology", RHEOLOGIES)
def test_cylinder_is_the_three_dimensional_body(rheology):
    """A stretched cylinder against a cube of the same stretch: forces by area, energies by volume, in every step."""
    options, rows = RHEOLOGIES[rheology], []
    cube = State(
        fem.functionspace(
            mesh.create_unit_cube(MPI.COMM_WORLD, 1, 1, 1, mesh.CellType.hexahedron), ("Lagrange", 1, (3,))
        )
    )
    cylinder = State(fem.functionspace(rectangle([(0, 0), (1, 1)], (2, 2)), ("Lagrange", 1, (2,))), axisymmetric=True)
    for state in (cube, cylinder):
        dim = state.mesh.geometry.dim
        faces = [mesh.locate_entities_boundary(state.mesh, dim - 1, at(i, 0.0)) for i in range(dim)]
        top = mesh.locate_entities_boundary(state.mesh, dim - 1, at(dim - 1, 1.0))
        supports = [Support(state, face, i) for i, face in enumerate(faces)]
        supports.append(Support(state, top, dim - 1, lambda t: 0.4 * t, name="pull"))
        m = Mechanics(state, [Solid(state, NeoHookean(E, 0.3), **options)], supports, rtol=1e-12)
        rows.append(final(m, step=0.5))
    for name in ("pull_force", "energy_strain", "energy_viscous", "work_external"):
        assert rows[1][name] == pytest.approx(np.pi * rows[0][name], rel=1e-8, abs=1e-12)


def test_areas_and_volumes_are_those_of_the_ring():
    """Load, mass, crack and pressed surface of a cylinder of radius 1 around the axis."""
    b = make_blocks(2, 4)
    state = State(b.state.V, axisymmetric=True)
    load = Traction(state, b.face(1, 1.0), (0.0, 3.0), lambda t: t)
    side = Surface.exterior(state, b.face(0, 1.0))
    crack = Crack(state, b.facets, b.lower, EXPONENTIAL, young=E)
    m = Mechanics(state, [Solid(state, NeoHookean(E, 0.3), density=0.5), load], analysis="dynamic")
    last = final(m, step=0.5)
    assert last["load_force_y"] == pytest.approx(3 * np.pi)
    assert m.inertia.momentum()[1] == pytest.approx(1.5 * np.pi, rel=1e-6)  # ∫ 3π t dt over the step of the scheme
    assert side.points.integral(np.ones_like(side.points.weights)) == pytest.approx(2 * np.pi)
    assert crack.points.integral(np.ones_like(crack.points.weights)) == pytest.approx(np.pi)


@pytest.mark.mpi
def test_torn_cylinder_dissipates_toughness_times_area():
    """Two rigid halves: the supports pull with the traction of the law on the whole area."""
    b = make_blocks(2, 4)
    state = State(b.state.V, axisymmetric=True)
    crack = Crack(state, b.facets, b.lower, EXPONENTIAL, young=E)
    supports = [
        Support(state, cells, i, value, dim=2, name=name)
        for cells, i, value, name in (
            (b.lower, 0, 0.0, None),
            (b.upper, 0, 0.0, None),
            (b.lower, 1, 0.0, None),
            (b.upper, 1, lambda t: t, "pull"),
        )
    ]
    mechanics, peak = Mechanics(state, [Solid(state, NeoHookean(E, 0.3)), crack], supports), 0.1
    assert final(mechanics, peak, 0.02)["pull_force"] == pytest.approx(np.pi * EXPONENTIAL.t_n, rel=1e-9)
    last = final(mechanics, 1.5, 0.02)
    assert last["energy_fracture"] == pytest.approx(np.pi * EXPONENTIAL.toughness[0], rel=1e-3)
    assert last["crack_broken"] == pytest.approx(np.pi, rel=1e-3)
    assert abs(last["energy_closure"]) < 5e-3


@pytest.mark.mpi
def test_ball_pressed_into_a_cylinder_balances_the_support():
    """Contact with friction: forces of tool and support cancel, the audit closes with the square of the step."""
    errors = []
    for step in (0.2, 0.1):
        b = Body(rectangle([(0, 0), (1, 1)], (8, 8)))
        path = Path.polyline([0, 1], [(0.0, 1.5), (0.0, 1.35)])
        surface = Surface.exterior(b.state, b.where(at(1, 1)))
        contact = PenaltyContact(60.0, 0.05)
        ball = ToolContact(b.state, Ball(0.5), path, [surface], contact=contact, friction=Coulomb(0.3), name="ball")
        supports = [b.hold(at(0, 0), 0), b.hold(at(1, 0), 1, name="plate")]
        last = final(Mechanics(b.state, [Solid(b.state, NeoHookean(E, 0.3)), ball], supports, rtol=1e-11), step=step)
        assert last["ball_force_y"] == pytest.approx(last["plate_force"], rel=1e-8)
        assert last["ball_force_y"] > 0.05
        errors.append(abs(last["energy_closure"]))
    assert errors[1] < 0.4 * errors[0] and errors[1] < 2e-2


def ring(inner, outer, height, flux=None):
    """Hollow cylinder that conducts heat between its sides, or that a flux through its outer side warms."""
    b = Body(rectangle([(inner, 0), (outer, height)], (24, 1)))
    T = Temperature(b.state, fem.functionspace(b.state.mesh, ("Lagrange", 1)), 0.0)
    body = HeatBody(T, capacity=2.0, conductivity=0.7, density=0.5)
    sides = [b.where(at(0, r)) for r in (inner, outer)]
    if flux is not None:
        return T, body, HeatTransfer(T, [body, HeatFlux(T, sides[1], flux)])
    held = [PrescribedTemperature(T, side, value, name=name) for side, value, name in zip(sides, (1, 0), "io", strict=True)]
    return T, body, HeatTransfer(T, [body], held)


def test_heat_through_a_ring():
    """Steady conduction through a hollow cylinder: 2πk ΔT/ln(b/a) per height."""
    _, _, heat = ring(1.0, 3.0, 0.5)
    last = final(heat, 1e6, 2.5e5)
    for flow in (last["i_heat_flow"], -last["o_heat_flow"]):
        assert flow == pytest.approx(2 * np.pi * 0.7 * 0.5 / np.log(3), rel=1e-3)


def test_heat_into_a_cylinder():
    """A flux on the side warms the whole body, axis included."""
    _, body, heat = ring(0.0, 2.0, 0.5, flux=3.0)
    assert body.content == pytest.approx(2.0 * 0.5 * np.pi * 4 * 0.5)
    last = final(heat)
    assert last["body_temperature"] * body.content == pytest.approx(3.0 * 2 * np.pi * 2 * 0.5)


@pytest.mark.parametrize("kind", ["ring", "pressure", "overstress"])
def test_taylor_slope(kind):
    """Hoop stretch, pressure on rings, and overstress have exact tangents."""
    state = State(make_blocks(2, 2).state.V, axisymmetric=True)
    top = mesh.locate_entities_boundary(state.mesh, 1, at(1, 1.0))
    relaxation = Prony((0.5,), (0.3,)) if kind == "overstress" else None
    term = (
        Pressure(state, top, lambda t: 2.0)
        if kind == "pressure"
        else Solid(state, NeoHookean(E, 0.3), relaxation=relaxation)
    )
    state.begin(0.1)
    term.begin(0.1)
    u = smooth(state.V, 1, 0.1)
    u[::2] = np.where(np.isclose(state.V.tabulate_dof_coordinates()[:, 0], 0), 0.0, u[::2])
    assert_slope_two(term, state, u, 0.3)


@pytest.mark.mpi
@pytest.mark.parametrize(
    "domain", [rectangle([(-1, 0), (1, 1)], (2, 2)), make_blocks(3).state.mesh], ids=["r < 0", "3-D"]
)
def test_refuses_what_is_no_meridian_plane(domain):
    V = fem.functionspace(domain, ("Lagrange", 1, (domain.geometry.dim,)))
    with pytest.raises(ValueError, match="axisymmetric = True is not allowed"):
        State(V, axisymmetric=True)


REFUSED = {
    "plane": lambda b: Solid(b.state, NeoHookean(E, 0.3), plane="stress"),
    "mass": lambda b: Mechanics(
        b.state, [Solid(b.state, NeoHookean(E, 0.3), density=1.0)], analysis="dynamic", mass="lumped"
    ),
    "solid": lambda b: JIntegral(Solid(b.state, NeoHookean(E, 0.3)), (0.5, 0.5), (1.0, 0.0), 0.1, 0.2),
    "facets": lambda b: Surface.exterior(b.state, b.where(at(0, 0))),
}


@pytest.mark.mpi
@pytest.mark.parametrize("name", REFUSED)
def test_refuses_what_a_body_of_revolution_has_not(name):
    """Plane stress, lumped mass (a node on the axis has none), a J-integral per length, a surface on the axis."""
    with pytest.raises(ValueError, match=f"{name} = .* is not allowed"):
        REFUSED[name](Body(rectangle([(0, 0), (1, 1)], (2, 2))))
