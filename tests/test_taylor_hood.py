"""Elements of Taylor and Hood: a continuous pressure beside the displacement (docs/elements.md)."""

from dataclasses import replace

import numpy as np
import pytest
import ufl
from dolfinx import fem, mesh
from dolfinx.fem.petsc import assemble_matrix
from mpi4py import MPI
from petsc4py import PETSc
from scipy.linalg import eigvalsh

import cutsim.solvers.preconditioners as preconditioners
from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.stepping import begin
from cutsim.base.assembly import integrate
from cutsim.base.compat import evaluate, expression, form, nodal_expression
from cutsim.base.terms import Term
from cutsim.bodies.loads import Support
from cutsim.bodies.solid import Solid
from cutsim.fields.points import Surface
from cutsim.fields.space import cracked_space, vertex_space
from cutsim.fields.state import State
from cutsim.fields.temperature import Temperature
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.crack import Crack
from cutsim.interface.friction import Coulomb
from cutsim.materials.elastic import IsochoricNeoHookean, LinearElastic, NeoHookean
from cutsim.materials.rubbers import MooneyRivlin, Ogden
from cutsim.materials.thermoelastic import ThermoElastic
from cutsim.materials.viscoelastic import Prony
from cutsim.solvers.convergence import Tolerances
from cutsim.studies.fracture import JIntegral
from cutsim.tools.pointed import Blade
from cutsim.tools.shapes import Ball, ToolPath
from cutsim.tools.tool_contact import ToolContact
from helpers.blocks import make_blocks
from helpers.bodies import COOK, Body, at, cook, inflated, shell_error, shell_pressure
from helpers.boxes import two
from helpers.fields import jump_part, smooth
from helpers.laws import EXPONENTIAL, E
from helpers.meshes import CELLS, CRACKS, HEXAHEDRON, QUADRILATERAL, TETRAHEDRON, TRIANGLE, box, facets_of, rectangle
from helpers.runs import final
from helpers.tangents import slopes

#: Poisson's ratio of a body that is incompressible to twelve digits.
INCOMPRESSIBLE = 0.5 - 1e-12


def pressure(solid):
    """The unknown pressure of a body."""
    return solid.multipliers[0].value


# -- the space of the pressure ----------------------------------------------------------------------------------------


@pytest.mark.mpi
@pytest.mark.parametrize("crack", CRACKS)
@pytest.mark.parametrize("cell", CELLS)
def test_pressure_is_split_as_the_displacement_is(cell, crack):
    """As many unknowns as in a cracked space of degree 1, and the same matrix but for their order."""
    domain = box(cell)
    facets = facets_of(domain, CRACKS[crack][0])
    V = cracked_space(domain, ("Lagrange", 2, (domain.geometry.dim,)), facets)
    spaces = vertex_space(V), cracked_space(domain, ("Lagrange", 1), facets)
    norms = []
    for Q in spaces:
        A = assemble_matrix(form(ufl.inner(ufl.grad(ufl.TrialFunction(Q)), ufl.grad(ufl.TestFunction(Q))) * ufl.dx))
        A.assemble()
        norms.append([A.size[0], A.norm(), A.getDiagonal().norm(), A.getDiagonal().sum()])
        A.destroy()
    np.testing.assert_allclose(*norms, rtol=1e-12)


@pytest.mark.mpi
def test_bodies_have_pressures_of_their_own():
    """A pressure lives on the nodes of its body only; two bodies that touch do not share any."""
    domain = rectangle([(0, 0), (1, 1)], (4, 4))
    V = fem.functionspace(domain, ("Lagrange", 2, (2,)))
    cells = [mesh.locate_entities(domain, 2, lambda x, s=s: s * (x[0] - 0.5) < 1e-9) for s in (1, -1)]
    for part in cells:
        Q = vertex_space(V, part)
        assert Q.dofmap.index_map.size_global == 3 * 5
        area = form(fem.Function(Q) * ufl.dx)
        assert integrate(area) == 0.0


# -- tangent ----------------------------------------------------------------------------------------------------------

TOUCH = PenaltyContact(40.0, blend=0.02)
KINDS = {
    "P2/P1": (TRIANGLE, False),
    "axisymmetric": (QUADRILATERAL, True),
    "P2/P1 in 3-D": (TETRAHEDRON, False),
}


def torn_and_pressed(cell, axisymmetric):
    """Two nearly incompressible blocks, a cohesive crack between them and a ball upon them, at some state."""
    gdim = 2 if cell in (QUADRILATERAL, TRIANGLE) else 3
    b = make_blocks(gdim, 2, cell=cell)
    state = State(cracked_space(b.state.mesh, ("Lagrange", 2, (gdim,)), b.facets), axisymmetric=axisymmetric)
    solid = Solid(state, MooneyRivlin(0.3, 0.1, 4000.0), volumetric="taylor-hood")
    crack = Crack(state, b.facets, b.lower, EXPONENTIAL, young=E)
    place = np.append(np.full(gdim - 1, 0.4), 1.7)
    path = ToolPath.polyline([0, 1], [place, place])
    ball = ToolContact(state, Ball(0.8), path, [Surface.exterior(state, b.face(gdim - 1, 1.0))], contact=TOUCH)
    mechanics = Mechanics(state, [solid, crack, ball])
    begin(mechanics, 1.0)
    state.u.x.array[:] = off_axis(state, smooth(state.V, 1, 0.05) + jump_part(state, 2, 0.05))
    return mechanics, solid


def off_axis(state, w):
    """The displacement without its radial part on the axis of revolution."""
    if state.axisymmetric:
        w[::2][np.isclose(state.V.tabulate_dof_coordinates()[:, 0], 0)] = 0.0
    return w


class Joint:
    """Forces and tangent of all unknowns, as the solver has them."""

    def __init__(self, mechanics):
        self.snes = mechanics.problem.snes
        self.A = self.snes.getJacobian()[0]

    def vector(self, values):
        return PETSc.Vec().createWithArray(values.copy(), comm=self.A.comm)

    def forces(self, x):
        f = self.vector(x)
        self.snes.computeFunction(self.vector(x), f)
        return f.array.copy()

    def times(self, x, *directions):
        """The tangent at x times some directions."""
        self.snes.computeJacobian(self.vector(x), self.A)
        results = [self.vector(x) for _ in directions]
        for w, result in zip(directions, results, strict=True):
            self.A.mult(self.vector(w), result)
        return [result.array.copy() for result in results]


@pytest.mark.parametrize("kind", KINDS)
def test_joint_tangent(kind):
    """Taylor slope 2 of displacement and pressure together, with crack and tool; all of it symmetric."""
    mechanics, solid = torn_and_pressed(*KINDS[kind])
    state, joint, rng = mechanics.state, Joint(mechanics), np.random.default_rng(4)
    n = len(pressure(solid).x.array)
    x = np.concatenate([state.u.x.array, 0.2 * rng.uniform(-1, 1, n)])
    directions = [
        np.concatenate([off_axis(state, smooth(state.V, seed, 1.0)), rng.uniform(-1, 1, n)]) for seed in (7, 8)
    ]
    f, (slope, other) = joint.forces(x), joint.times(x, *directions)
    w, z = directions
    assert z @ slope == pytest.approx(w @ other, rel=1e-12)
    steps = np.array([1e-3, 5e-4, 2.5e-4])
    remainders = [np.linalg.norm(joint.forces(x + h * w) - f - h * slope) for h in steps]
    assert slopes(steps, remainders).min() > 1.95, remainders


EXACT = {"ksp_type": "preonly", "pc_type": "lu", "pc_factor_mat_solver_type": "mumps"}


def test_newton_is_quadratic():
    _, m = inflated((2, 4), 2, "taylor-hood", pressure=shell_pressure(1.2))
    m = Mechanics(m.state, m.terms, m.supports, tolerances=Tolerances(rtol=1e-14), petsc_options=EXACT)
    begin(m, 0.8)
    outcome = m.solve("basic")
    r = np.array([r for r in outcome.residuals if r > 1e-13])
    assert outcome.converged
    assert np.log(r[-1] / r[-2]) / np.log(r[-2] / r[-3]) > 1.9, r


# -- closed forms -----------------------------------------------------------------------------------------------------


def stretched(cell, *, axisymmetric=False, material=None, stretch=1.5, n=3, volumetric="taylor-hood"):
    """A bar on an irregular mesh, in plane strain, of revolution or in space, with smooth sides and a free one."""
    gdim = 2 if cell in (QUADRILATERAL, TRIANGLE) else 3
    domain = box(cell, n=n)
    x = domain.geometry.x
    x[:, gdim - 1] += 0.05 * np.sin(2 * np.pi * x[:, gdim - 1]) * np.cos(2 * x[:, 0])
    state = State(fem.functionspace(domain, ("Lagrange", 2, (gdim,))), axisymmetric=axisymmetric)
    faces = [mesh.locate_entities_boundary(domain, gdim - 1, at(i, 0.0)) for i in range(gdim)]
    top = mesh.locate_entities_boundary(domain, gdim - 1, at(gdim - 1, 1.0))
    supports = [Support(state, face, i) for i, face in enumerate(faces)]
    supports.append(Support(state, top, gdim - 1, lambda t: (stretch - 1) * t, name="pull"))
    solid = Solid(state, material or IsochoricNeoHookean(E, INCOMPRESSIBLE), volumetric=volumetric)
    return Mechanics(state, [solid], supports, tolerances=Tolerances(rtol=1e-12)), solid


@pytest.mark.mpi
@pytest.mark.parametrize(
    ("cell", "axisymmetric"), [(TETRAHEDRON, False), (HEXAHEDRON, False), (QUADRILATERAL, True), (TRIANGLE, True)]
)
def test_incompressible_bar(cell, axisymmetric):
    """P = G (λ − λ⁻²) on every mesh, and a uniform pressure p = σ_z/3 of the Kirchhoff stress."""
    m, solid = stretched(cell, axisymmetric=axisymmetric)
    last, shear, stretch = final(m), E / 3, 1.5
    section = np.pi if axisymmetric else 1.0
    assert last["pull_force"] == pytest.approx(section * shear * (stretch - stretch**-2), rel=1e-9)
    shown = fem.Function(fem.functionspace(m.state.mesh, ("DG", 0)))
    shown.interpolate(nodal_expression(solid.fields["body_pressure"], shown.function_space))
    np.testing.assert_allclose(shown.x.array, shear * (stretch**2 - 1 / stretch) / 3, rtol=1e-8)


MATERIALS = {
    "logarithm": NeoHookean(E, 0.4),
    "linear in J": Ogden((0.7, 0.2), (2.0, -1.5), 3.0),
    "small strain": LinearElastic(E, 0.4),
}


@pytest.mark.parametrize("name", MATERIALS)
def test_patch_of_a_compressible_bar(name):
    """Uniform states are those of the plain element, whatever the volumetric energy: forces and energies."""
    rows = [
        final(stretched(TRIANGLE, material=MATERIALS[name], stretch=1.2, volumetric=volumetric)[0])
        for volumetric in ("full", "taylor-hood")
    ]
    assert abs(rows[0]["pull_force"]) > 0.1
    for column in ("pull_force", "energy_strain", "work_external"):
        assert rows[1][column] == pytest.approx(rows[0][column], rel=1e-9)


@pytest.mark.parametrize(("cell", "n"), [(QUADRILATERAL, 8), (TRIANGLE, 32)])
def test_cooks_membrane(cell, n):
    """Within 1 % where plain Q1 is 40 % off and more."""
    assert cook(cell, 2, "taylor-hood", n) == pytest.approx(COOK, rel=0.01)


@pytest.mark.parametrize("cell", [QUADRILATERAL, TRIANGLE])
def test_inflated_shell(cell):
    """Within 0.1 % of Lamé where plain Q1 is 76 % off."""
    assert shell_error(cell, 2, "taylor-hood", 16) < 1e-3


@pytest.mark.parametrize("cell", [QUADRILATERAL, TRIANGLE])
def test_inflated_shell_at_large_strain(cell):
    b, m = inflated((4, 16), 2, "taylor-hood", cell, pressure=shell_pressure(1.2), nu=INCOMPRESSIBLE)
    last = final(m)
    np.testing.assert_allclose([b.at(1, 0)[0], b.at(0, 1)[1]], 0.2, rtol=5e-3)
    assert last["equator_force"] == pytest.approx(-shell_pressure(1.2) * np.pi * 1.2**2, rel=5e-3)
    assert abs(last["energy_closure"]) < 1e-3


# -- convergence and stability ----------------------------------------------------------------------------------------


class Manufactured(Term):
    """Forces that hold an incompressible flow-like displacement with a given pressure in equilibrium."""

    name = "manufactured"

    def __init__(self, state, shear):
        x, y = ufl.SpatialCoordinate(state.mesh)
        # divergence of a rotated gradient is zero; no displacement on the left side
        stream = x**2 * ufl.sin(2 * x + y)
        self.u = ufl.as_vector([stream.dx(1), -stream.dx(0)])
        self.p = ufl.cos(2 * x) * ufl.sin(3 * y)
        self._stress = 2 * shear * ufl.sym(ufl.grad(self.u)) + self.p * ufl.Identity(2)
        self._dx = state.measures.cells()(metadata={"quadrature_degree": 8})

    def residual(self, v):
        return -ufl.inner(self._stress, ufl.grad(v)) * self._dx


def errors(cell, n):
    """L2 errors of displacement and pressure."""
    domain = rectangle([(0, 0), (1, 1)], (n, n), cell)
    state = State(fem.functionspace(domain, ("Lagrange", 2, (2,))))
    material = LinearElastic(E, 0.5 - 1e-10)
    solid, forces = Solid(state, material, volumetric="taylor-hood"), Manufactured(state, material.shear)
    left = mesh.locate_entities_boundary(domain, 1, at(0, 0.0))
    m = Mechanics(
        state, [solid, forces], [Support(state, left, i) for i in range(2)], tolerances=Tolerances(rtol=1e-12)
    )
    final(m, step=1.0)
    differences = state.u - forces.u, solid.fields["body_pressure"] - forces.p
    return [np.sqrt(integrate(form(ufl.inner(d, d) * forces._dx))) for d in differences]


@pytest.mark.parametrize("cell", [QUADRILATERAL, TRIANGLE])
def test_rates_of_an_incompressible_body(cell):
    """Third order of the displacement, second of the pressure, in L2."""
    meshes = np.array([8, 16, 32])
    measured = np.array([errors(cell, n) for n in meshes])
    rates = -np.diff(np.log(measured), axis=0) / np.log(2)
    assert rates[-1, 0] > 2.9 and rates[-1, 1] > 1.9, (rates, measured)


@pytest.mark.parametrize("cell", [QUADRILATERAL, TRIANGLE])
def test_inf_sup_constant_does_not_shrink(cell):
    """Smallest eigenvalue of B K⁻¹ Bᵀ against the mass of the pressure in a clamped square, but for the constant."""
    constants = []
    for n in (3, 6, 12):
        domain = rectangle([(0, 0), (1, 1)], (n, n), cell)
        state = State(fem.functionspace(domain, ("Lagrange", 2, (2,))))
        solid = Solid(state, LinearElastic(E, INCOMPRESSIBLE), volumetric="taylor-hood")
        rim = mesh.locate_entities_boundary(domain, 1, lambda x: np.full(x.shape[1], True))
        m = Mechanics(state, [solid], [Support(state, rim, i) for i in range(2)])
        joint = Joint(m)
        joint.times(np.zeros(joint.A.size[0]))
        K, B = (joint.A.getNestSubMatrix(i, 0).convert("dense").getDenseArray() for i in range(2))
        q = ufl.TestFunction(pressure(solid).function_space), ufl.TrialFunction(pressure(solid).function_space)
        mass = assemble_matrix(form(q[0] * q[1] * ufl.dx))
        mass.assemble()
        values = eigvalsh(B @ np.linalg.solve(K, B.T), mass.convert("dense").getDenseArray())
        assert abs(values[0]) < 1e-8 * values[-1]
        constants.append(np.sqrt(values[1] / values[-1]))
    assert constants[-1] > 0.9 * constants[0] > 0.1, constants


# -- cracks, tools and several bodies ---------------------------------------------------------------------------------


@pytest.mark.mpi
def test_pressure_jumps_across_a_crack():
    """Of two unbonded blocks the lower one is stretched: it has its pressure, the upper one has none."""
    b = make_blocks(2, 4)
    state = State(cracked_space(b.state.mesh, ("Lagrange", 2, (2,)), b.facets))
    solid, stretch, shear = Solid(state, IsochoricNeoHookean(E, 0.4999), volumetric="taylor-hood"), 1.2, E / 2.9998
    sides = [
        mesh.locate_entities_boundary(state.mesh, 1, lambda x, s=s: np.isclose(x[0], s) & (x[1] < 0.5 + 1e-9))
        for s in (0, 1)
    ]
    supports = [Support(state, b.upper, i, dim=2) for i in range(2)]
    supports += [Support(state, sides[0], 0), Support(state, b.face(1, 0.0), 1)]
    supports.append(Support(state, sides[1], 0, lambda t: (stretch - 1) * t))
    final(Mechanics(state, [solid], supports, tolerances=Tolerances(rtol=1e-11)), step=0.5)
    values = fem.Function(fem.functionspace(state.mesh, ("DG", 0)))
    values.interpolate(fem.Expression(solid.fields["body_pressure"], np.array([[0.5, 0.5]])))
    expected = shear * ((stretch**2 + 1 + stretch**-2) / 3 - stretch**-2)
    np.testing.assert_allclose(values.x.array[b.lower], expected, rtol=1e-3)
    np.testing.assert_allclose(values.x.array[b.upper], 0, atol=1e-9)


@pytest.mark.parametrize("cell", [QUADRILATERAL, TRIANGLE])
def test_double_cantilever_of_a_rubber(cell):
    """P = 3 E' I δ/(a + χ h)³ of two arms of which one is bent up and the other down, and J of its front.

    χ = 0.673 follows from K = √12 P (a/h + 0.673)/√h (Foote and Buchwald 1985) for every ν, on which the stresses of
    plane strain do not depend.
    """
    a, h, opening, chi = 10.0, 1.0, 0.01, 0.673
    domain = rectangle([(0, -h), (16, h)], (64, 8), cell)
    faces = mesh.locate_entities(domain, 1, lambda x: np.isclose(x[1], 0) & (x[0] < a + 1e-9))
    state = State(cracked_space(domain, ("Lagrange", 2, (2,)), faces))
    solid = Solid(state, IsochoricNeoHookean(E, 0.4999), volumetric="taylor-hood")
    ends = [
        mesh.locate_entities_boundary(domain, 1, lambda x, s=s: np.isclose(x[0], 0) & (s * x[1] > -1e-9))
        for s in (1, -1)
    ]
    supports = [
        Support(state, end, 1, lambda t, s=s: s * opening * t, name=name)
        for end, s, name in zip(ends, (1, -1), ("up", "down"), strict=True)
    ]
    supports.append(Support(state, mesh.locate_entities_boundary(domain, 1, at(0, 16.0)), 0))
    last = final(Mechanics(state, [solid], supports), step=1.0)
    stiffness = 3 * E / 0.75 / 12 * h**3 / (a + chi * h) ** 3
    assert last["up_force"] == pytest.approx(stiffness * opening, rel=0.005)
    assert last["down_force"] == pytest.approx(-last["up_force"], rel=1e-6)
    J = JIntegral(solid, (a, 0.0), (1.0, 0.0), 0.3, 0.9)
    assert J() == pytest.approx(3 * stiffness * opening**2 / (a + chi * h), rel=0.01)


RHEOLOGIES = {"viscous": {"viscosity": 0.7}, "relaxing": {"relaxation": Prony((0.5,), (0.3,))}}


@pytest.mark.mpi
@pytest.mark.parametrize("rheology", RHEOLOGIES)
def test_halves_of_a_crack_are_torn_like_others(rheology):
    """Uniform stretch of both halves, up to softening: every element gives the same, with the audit closed."""
    rows = {}
    for volumetric in ("full", "taylor-hood"):
        b = make_blocks(2, 2)
        state = State(cracked_space(b.state.mesh, ("Lagrange", 2, (2,)), b.facets))
        supports = [Support(state, b.face(i, 0.0), i) for i in range(2)]
        supports.append(Support(state, b.face(1, 1.0), 1, lambda t: 0.4 * t, name="pull"))
        solid = Solid(state, NeoHookean(20.0, 0.4), volumetric=volumetric, **RHEOLOGIES[rheology])
        crack = Crack(state, b.facets, b.lower, EXPONENTIAL, young=20.0)
        rows[volumetric] = final(
            Mechanics(state, [solid, crack], supports, tolerances=Tolerances(rtol=1e-11)), step=0.05
        )
    assert rows["taylor-hood"]["energy_fracture"] > 0.1
    for name in ("pull_force", "energy_strain", "energy_fracture", "energy_viscous", "energy_closure"):
        assert rows["taylor-hood"][name] == pytest.approx(rows["full"][name], rel=1e-6, abs=1e-9)


@pytest.mark.mpi
def test_ball_pressed_into_rubber():
    """Contact with friction: forces of tool and support cancel, and are those of Q2/P1 on the same mesh."""
    forces = []
    for volumetric in ("mixed", "taylor-hood"):
        b = Body(rectangle([(0, 0), (1, 1)], (8, 8)), 2)
        path = ToolPath.polyline([0, 1], [(0.0, 1.5), (0.0, 1.4)])
        surface = Surface.exterior(b.state, b.where(at(1, 1)))
        contact = PenaltyContact(60.0, 0.05)
        ball = ToolContact(b.state, Ball(0.5), path, [surface], contact=contact, friction=Coulomb(0.3), name="ball")
        supports = [b.hold(at(0, 0), 0), b.hold(at(1, 0), 1, name="plate")]
        solid = Solid(b.state, IsochoricNeoHookean(E, 0.4999), volumetric=volumetric)
        last = final(Mechanics(b.state, [solid, ball], supports, tolerances=Tolerances(rtol=1e-11)), step=0.25)
        assert last["ball_force_y"] == pytest.approx(last["plate_force"], rel=1e-7)
        forces.append(last["ball_force_y"])
    assert forces[1] == pytest.approx(forces[0], rel=5e-3)


@pytest.mark.mpi
def test_blade_between_crack_faces():
    """Two half blades wedge a notch open: forces are those of Q2/P1 on the same mesh, and the audit closes."""
    rows = []
    for volumetric in ("mixed", "taylor-hood"):
        domain = rectangle([(-1, -2), (1, 0)], (12, 12))
        notch = mesh.locate_entities(domain, 1, lambda x: np.isclose(x[0], 0) & (x[1] > -1 - 1e-9))
        state = State(cracked_space(domain, ("Lagrange", 2, (2,)), notch))
        right = mesh.locate_entities(domain, 2, lambda x: x[0] > -1e-9)
        faces = Crack(state, notch, right, None, young=E, name="notch")
        blade, start = Blade(0.2, 0.1, 1.0), -0.5
        halves = [
            ToolContact(
                state,
                replace(blade, side=side),
                ToolPath.polyline([0, 1], [(-0.25 * side, start), (0.0, start)]),
                [faces.surface(face)],
                contact=PenaltyContact(200.0, 0.04),
                name=name,
            )
            for side, face, name in ((1, "+", "right"), (-1, "-", "left"))
        ]
        bottom = mesh.locate_entities_boundary(domain, 1, at(1, -2.0))
        supports = [Support(state, bottom, i) for i in range(2)]
        solid = Solid(state, IsochoricNeoHookean(E, 0.4999), volumetric=volumetric)
        rows.append(
            final(Mechanics(state, [solid, faces, *halves], supports, tolerances=Tolerances(rtol=1e-11)), step=0.125)
        )
    assert rows[1]["right_force_x"] == pytest.approx(-rows[1]["left_force_x"], rel=1e-6)
    assert abs(rows[1]["right_force_x"]) > 0.02
    assert rows[1]["right_force_x"] == pytest.approx(rows[0]["right_force_x"], rel=1e-3)
    assert abs(rows[1]["energy_closure"]) < 0.02


@pytest.mark.mpi
def test_rubber_slides_far_on_rubber():
    """Surfaces that find each other, whose pattern changes on the way: forces balance, and are near those of Q2/P1.

    The elements differ by 2.6 % on a mesh of 2 and 3 cells along the surfaces, by 1.0 % on this one.
    """
    forces = []
    for volumetric in ("mixed", "taylor-hood"):
        b = two(2, (4, 6), overhang=0.6, degree=2)
        pair = b.pair(contact=PenaltyContact(100.0, 0.005), friction=Coulomb(0.2))
        bodies = [
            Solid(b.state, IsochoricNeoHookean(young, 0.499), b.cells(box), volumetric=volumetric, name=f"box_{box}")
            for box, young in enumerate((4.0, 1.0))
        ]
        path = (lambda t: 0.5 * max(t - 0.25, 0), lambda t: -0.05 * min(4 * t, 1))
        supports = [*b.drive(0, 0, (0.0, 0.0), "base"), *b.drive(1, 1, path, "top")]
        mechanics = Mechanics(b.state, [*bodies, pair], supports, tolerances=Tolerances(rtol=1e-10))
        last = final(mechanics, step=0.125)
        assert pair.passes[0].pattern > 2, "the surfaces have met other facets"
        assert last["base_y_force"] == pytest.approx(-last["top_y_force"], rel=1e-7)
        forces.append([last["top_x_force"], last["top_y_force"]])
    np.testing.assert_allclose(*forces, rtol=0.015)


def layered(comm=MPI.COMM_WORLD, **options):
    """A soft layer upon a stiff one, both clamped at their ends and sheared; each with its own pressure."""
    domain = box(TETRAHEDRON, comm=comm, n=2)
    state = State(fem.functionspace(domain, ("Lagrange", 2, (3,))))
    layers = [
        Solid(
            state,
            IsochoricNeoHookean(young, 0.4999),
            mesh.locate_entities(domain, 3, lambda x, s=s: s * (x[2] - 0.5) < 1e-9),
            volumetric="taylor-hood",
            name=name,
        )
        for young, s, name in ((5.0, 1, "stiff"), (1.0, -1, "soft"))
    ]
    ends = [mesh.locate_entities_boundary(domain, 2, at(0, v)) for v in (0.0, 1.0)]
    supports = [Support(state, ends[0], i) for i in range(3)]
    supports += [
        Support(state, ends[1], i, value, name=f"end_{i}") for i, value in enumerate((lambda t: 0.2 * t, 0.0, 0.0))
    ]
    return Mechanics(state, layers, supports, tolerances=Tolerances(rtol=1e-10), **options)


@pytest.mark.parametrize(
    ("n_dofs", "crack", "gdim", "name"),
    [
        (60_000, False, 3, "direct"),
        (60_001, False, 3, "saddle"),
        (200_000, True, 3, "direct"),
        (10**6, True, 2, "saddle"),
    ],
)
def test_linear_solver_by_size(n_dofs, crack, gdim, name):
    preset = preconditioners.preset_for(n_dofs, True, 1, crack, gdim, saddle_point=True)
    assert preset.name == name
    assert preset.kept["pc_type"] == ("cholesky" if name == "direct" else "fieldsplit")


@pytest.mark.mpi
def test_layers_do_not_depend_on_ranks_or_on_the_linear_solver(monkeypatch):
    """One rank and all, factorised and by block elimination with multigrid, give the same."""
    columns = [final(layered(MPI.COMM_SELF), step=0.5), final(layered(), step=0.5)]
    monkeypatch.setitem(preconditioners.DIRECT_LIMIT_CRACK, 3, 0)
    m = layered()
    columns.append(final(m, step=0.5))
    assert m.problem.snes.getKSP().getIterationNumber() > 5, "a multigrid, no factorisation"
    for other in columns[1:]:
        for name in ("end_0_force", "end_2_force", "energy_strain"):
            assert other[name] == pytest.approx(columns[0][name], rel=1e-7)
    fields = m.fields
    assert set(fields) == {"stiff_pressure", "soft_pressure"}
    for name, solid in zip(fields, m.terms, strict=True):
        outside = np.setdiff1d(np.arange(m.state.mesh.topology.index_map(3).size_local), solid.cells)
        points = np.full((1, 3), 0.25)
        compiled = expression(fields[name], points, m.state.mesh)
        assert not evaluate(compiled, m.state.mesh, outside.astype(np.int32)).any()


# -- steps ------------------------------------------------------------------------------------------------------------


def test_rollback_restores_the_pressure_bit_for_bit():
    _, m = inflated((2, 4), 2, "taylor-hood", pressure=0.1)
    final(m, until=0.5)
    p = pressure(m.terms[0]).x.array
    u, start, books, results = m.state.u.x.array.copy(), p.copy(), m.record(), []
    for time in (1.0, 0.75, 0.75):
        begin(m, time)
        assert m.solve().converged
        m.evaluate()
        results.append(p.copy())
        m.state.rollback()
        np.testing.assert_array_equal(m.state.u.x.array, u)
        np.testing.assert_array_equal(p, start)
        assert m.record() == books
    np.testing.assert_allclose(results[1], results[2], rtol=1e-9)
    assert np.abs(results[0] - results[1]).max() > 1e-3


def test_oscillation_keeps_its_energy():
    """A nearly incompressible block that rings: the audit of the trapezoidal rule closes as the steps shrink."""
    closures = []
    for step in (0.1, 0.05):
        b = Body(rectangle([(0, 0), (1, 1)], (2, 2)), 2, axisymmetric=False)
        solid = Solid(b.state, IsochoricNeoHookean(E, 0.4999), volumetric="taylor-hood", density=1.0)
        supports = [b.hold(at(1, 0), i) for i in range(2)]
        m = Mechanics(b.state, [solid], supports, analysis="dynamic", tolerances=Tolerances(rtol=1e-10))
        m.inertia.set_velocity(lambda x: np.array([0.3 * x[1], 0 * x[0]]))
        last = final(m, step=step)
        assert 0.01 < last["energy_strain"]
        closures.append(abs(last["energy_closure"]))
    assert closures[1] < 0.6 * closures[0] < 1e-5, closures


# -- refusals ---------------------------------------------------------------------------------------------------------


def heated(state):
    return {
        "thermoelastic": ThermoElastic(1e-4, 300.0),
        "temperature": Temperature(state, fem.functionspace(state.mesh, ("Lagrange", 1)), 300.0),
    }


REFUSED = {
    "degree 1": (1, NeoHookean(E, 0.4), lambda state: {}),
    "plane stress": (2, NeoHookean(E, 0.4), lambda state: {"plane": "stress"}),
    "thermal expansion": (2, NeoHookean(E, 0.4), heated),
    "no volumetric part": (2, NeoHookean(E, 0.0), lambda state: {}),
}


@pytest.mark.mpi
@pytest.mark.parametrize("name", REFUSED)
def test_refuses_what_has_no_continuous_pressure(name):
    degree, material, options = REFUSED[name]
    state = State(fem.functionspace(rectangle([(0, 0), (1, 1)], (2, 2)), ("Lagrange", degree, (2,))))
    with pytest.raises(ValueError, match="volumetric = 'taylor-hood' is not allowed"):
        Solid(state, material, volumetric="taylor-hood", **options(state))
