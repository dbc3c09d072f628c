"""Tools made of triangles or segments: against closed forms and against tools with a signed distance."""

import meshio
import numpy as np
import pytest
import pyvista
from dolfinx import fem
from mpi4py import MPI

from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.stepping import StepControl, begin
from cutsim.base.assembly import moment
from cutsim.bodies.loads import Support
from cutsim.bodies.solid import Solid
from cutsim.fields.points import Surface
from cutsim.fields.state import State
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.friction import Coulomb
from cutsim.materials.elastic import NeoHookean
from cutsim.solvers.convergence import Tolerances
from cutsim.tools.pointed import Blade
from cutsim.tools.shapes import Ball, ToolPath
from cutsim.tools.tool_contact import ToolContact
from cutsim.tools.triangulated_tool import TriangulatedTool
from cutsim.tools.triangulation import Triangulation
from helpers.blocks import make_blocks
from helpers.fields import wavy
from helpers.laws import NU, E
from helpers.runs import LINE_SEARCHES, history
from helpers.tangents import STEPS, Assembled, slopes

R, MU = 0.35, 0.3
CONTACT, FRICTION = PenaltyContact(60.0), Coulomb(MU)


def ball(gdim, level):
    """A circle of 8·2^level segments, or an icosahedron divided as often: facets half as large each time."""
    if gdim == 2:
        n = 8 * 2**level
        angle, i = 2 * np.pi * np.arange(n) / n, np.arange(n)
        return Triangulation(R * np.column_stack([np.cos(angle), np.sin(angle)]), np.column_stack([i, (i + 1) % n]))
    surface = pyvista.Icosphere(radius=R, nsub=level)
    return Triangulation(surface.points.astype(float), surface.faces.reshape(-1, 4)[:, 1:])


def polygon(points):
    """A closed polygon."""
    i = np.arange(len(points))
    return Triangulation(points, np.column_stack([i, (i + 1) % len(i)]))


def drawn(gdim, depth, length=0.1, radius=R):
    """A tool that comes down on the top of the unit block, off its middle, and is drawn along it."""
    down, along = np.eye(gdim)[-1], np.eye(gdim)[0]
    start = np.full(gdim, 0.45) + (1 + radius - 0.45) * down
    return ToolPath.polyline([0, 1, 2], [start, start - depth * down, start - depth * down + length * along])


def indented(gdim, shape, path, n, degree=1, friction=FRICTION, comm=MPI.COMM_WORLD, **options):
    """A block on a fixed base under a tool, of triangles or with a signed distance."""
    b = make_blocks(gdim, n=n, comm=comm)
    state = State(fem.functionspace(b.state.mesh, ("Lagrange", degree, (gdim,))))
    top, options = b.face(gdim - 1, 1.0), {"contact": CONTACT, "friction": friction, **options}
    if isinstance(shape, Triangulation):
        tool = TriangulatedTool(state, top, shape, path, **options)
    else:
        tool = ToolContact(state, shape, path, [Surface.exterior(state, top)], **options)
    supports = [Support(state, b.face(gdim - 1, 0.0), i, name=f"base_{'xyz'[i]}") for i in range(gdim)]
    return Mechanics(state, [Solid(state, NeoHookean(E, NU)), tool], supports, tolerances=Tolerances(rtol=1e-11)), tool


def forces(rows, gdim, name="tool_force_{}"):
    return np.array([rows[name.format(a)] for a in "xyz"[:gdim]])


# -- closed forms -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("gdim", [2, 3])
def test_ball_in_a_rigid_block(gdim):
    """Penalty times what the ball displaces, in the mean of many places; the error falls with the facets squared."""
    depth, errors = 0.05, []
    volume = np.pi * depth**2 * (3 * R - depth) / 3
    if gdim == 2:
        volume = R**2 * np.arccos(1 - depth / R) - (R - depth) * np.sqrt(2 * R * depth - depth**2)
    for level in (2, 4):
        b = make_blocks(gdim, n=12)
        state = State(fem.functionspace(b.state.mesh, ("Lagrange", 1, (gdim,))))
        top = b.face(gdim - 1, 1.0)
        path = drawn(gdim, depth, 0.4)
        tool = TriangulatedTool(state, top, ball(gdim, level), path, contact=CONTACT, friction=FRICTION)
        cells = np.arange(state.mesh.topology.index_map(gdim).size_local, dtype=np.int32)
        supports = [Support(state, cells, i, dim=gdim) for i in range(gdim)]
        terms = [Solid(state, NeoHookean(E, NU)), tool]
        mechanics = Mechanics(state, terms, supports)
        history(mechanics, 1.0, StepControl.fixed(1.0))
        force = forces(history(mechanics, 2.0, StepControl.fixed(0.05)), gdim)
        np.testing.assert_allclose(force[0, -1], -MU * force[-1, -1], rtol=1e-6)
        errors.append(abs(force[-1].mean() / (CONTACT.stiffness * volume) - 1))
    assert errors[1] < 0.012 and errors[0] > 10 * errors[1], errors


# -- against tools with a signed distance -----------------------------------------------------------------------------


@pytest.mark.parametrize(("gdim", "n", "levels"), [(2, 32, (2, 3, 4)), (3, 6, (1, 2, 3))])
def test_same_as_the_ball(gdim, n, levels):
    """Without the error of the facets the forces are within 1 %: gap and normal are taken on the body, not the tool."""
    path, control = drawn(gdim, 0.1), StepControl.fixed(0.25)
    smooth = forces(history(indented(gdim, Ball(R), path, n)[0], 2.0, control), gdim)
    faceted = [forces(history(indented(gdim, ball(gdim, k), path, n)[0], 2.0, control), gdim) for k in levels]
    ends = np.array([f[:, -1] for f in faceted])
    changes = np.linalg.norm(np.diff(ends, axis=0), axis=1)
    assert changes[0] > 3 * changes[1], changes
    limit = ends[-1] + np.diff(ends, axis=0)[-1] / 3
    np.testing.assert_allclose(limit[-1], smooth[-1, -1], rtol=0.01)
    np.testing.assert_allclose(limit[0], smooth[0, -1], rtol=0.03)


def test_same_as_the_blade():
    blade, path = Blade(0.6, 0.1, 0.2), drawn(2, 0.08, 0.0, radius=0.0)
    outline = polygon(blade.outline(0.6, points=40))
    control = StepControl(first=0.125, largest=0.125, line_searches=LINE_SEARCHES)
    ends = [
        forces(history(indented(2, shape, path, 32, friction=None)[0], 1.0, control), 2)[:, -1]
        for shape in (blade, outline)
    ]
    np.testing.assert_allclose(ends[1][1], ends[0][1], rtol=0.01)


@pytest.mark.mpi
@pytest.mark.parametrize("side", ["+", "-"])
def test_face_of_a_crack(side):
    """Between two faces that have parted, each is pressed to its own side: the penalty times what the ball covers."""
    b, depth = make_blocks(2, n=16), 0.05
    crack, sign = b.crack(None), {"+": -1, "-": 1}[side]  # '+' is the lower block
    b.move(lambda x: 0 * x, lambda x: np.array([0 * x[0], 0 * x[0] + 0.5]))
    middle = {"+": 0.5, "-": 1.0}[side] - sign * (R - depth)
    path = ToolPath.polyline([0, 1], [(0.45, middle), (0.48, middle)])
    tool = TriangulatedTool(b.state, crack.face(side), ball(2, 5), path, contact=CONTACT, friction=FRICTION)
    b.state.memory.commit()
    b.state.begin(1.0)
    tool.begin()
    tool.evaluate()
    area = R**2 * np.arccos(1 - depth / R) - (R - depth) * np.sqrt(2 * R * depth - depth**2)
    assert tool.force()[1] == pytest.approx(-sign * CONTACT.stiffness * area, rel=0.01), "the face pushes back"
    assert tool.force()[0] == pytest.approx(-MU * CONTACT.stiffness * area, rel=0.02), "friction holds back"


# -- balance ----------------------------------------------------------------------------------------------------------


@pytest.mark.mpi
@pytest.mark.parametrize("gdim", [2, 3])
def test_tool_balances_the_supports(gdim):
    """So do force and, but for the gap between the two that friction acts on, moment about the tool."""
    mechanics, tool = indented(gdim, ball(gdim, 3), drawn(gdim, 0.1), 4)
    rows = history(mechanics, 2.0, StepControl.fixed(0.25))
    force, support = forces(rows, gdim), forces(rows, gdim, "base_{}_force")
    np.testing.assert_allclose(force, support, atol=1e-7 * np.abs(force).max())
    assert force[-1, -1] > 0, "the body pushes the tool up"
    assert force[0, -1] < 0, "friction holds the tool back"
    state, residual = mechanics.state, mechanics.problem.residual()
    owned = len(residual.array) // gdim
    arms = state.V.tabulate_dof_coordinates()[:owned].copy()
    base = np.repeat(np.isclose(arms[:, gdim - 1], 0), gdim)
    arms[:, :gdim] += state.u.x.array[: gdim * owned].reshape(-1, gdim) - tool.position.value
    couple = moment(state.mesh.comm, np.where(base, residual.array, 0.0), arms, gdim)
    residual.destroy()
    apart = MU * force[-1, -1] * tool.touch.points.maximum(-tool.touch.history.trial["opening"])
    np.testing.assert_allclose(tool.moment(), couple, atol=apart)
    assert np.abs(couple).max() > 5 * apart


def test_energy_closes_with_the_steps():
    errors = []
    for step in (0.25, 0.125):
        mechanics = indented(2, ball(2, 5), drawn(2, 0.1, 0.2), 8, friction=None)[0]
        rows = history(mechanics, 2.0, StepControl.fixed(step))
        errors.append([abs(rows[f"energy_{name}"][-1]) for name in ("closure", "numerical")])
    (closure, numerical), (finer_closure, finer_numerical) = errors
    assert closure > 3.5 * finer_closure and finer_closure < 2e-4, errors
    assert numerical > 2 * finer_numerical, errors


def test_energy_of_friction_closes_with_the_penalty():
    """Friction acts at the surface of the body, a penetration away from that of the tool, which is curved."""
    closures = []
    for stiffness in (60.0, 3840.0):
        mechanics = indented(2, ball(2, 5), drawn(2, 0.1, 0.2), 8, contact=PenaltyContact(stiffness))[0]
        rows = history(mechanics, 2.0, StepControl.fixed(1 / 32))
        closures.append(abs(rows["energy_closure"][-1]))
        assert (np.diff(rows["energy_friction"]) > -1e-12).all() and rows["energy_friction"][-1] > 3e-3
    assert closures[0] > 10 * closures[1] and closures[1] < 1e-3, closures


@pytest.mark.parametrize(("gdim", "n"), [(2, 12), (3, 8)])
def test_tool_that_moves_farther_in_a_step_than_a_facet(gdim, n):
    """The body is deep in the tool when the step begins; it is found nevertheless."""
    path = ToolPath.polyline([0, 1], [drawn(gdim, 0.0).position(0.0), drawn(gdim, 0.15).position(1.0)])
    ends = []
    for step in (0.25, 1.0):
        control = StepControl(first=step, largest=step, line_searches=LINE_SEARCHES)
        ends.append(forces(history(indented(gdim, ball(gdim, 2), path, n, friction=None)[0], 1.0, control), gdim))
    np.testing.assert_allclose(ends[1][:, -1], ends[0][:, -1], atol=1e-7)


# -- tangent, state ---------------------------------------------------------------------------------------------------


@pytest.mark.mpi
@pytest.mark.parametrize("depth", [0.1, 0.3, 0.45])
def test_tool_that_begins_in_the_body(depth):
    """It pushes inwards, the more the deeper, also where its middle is below the surface; alike on all meshes."""
    start = np.array([0.45, 1 + R - depth])
    path = ToolPath.polyline([0, 1], [start, start - (0.0, 0.01)])
    force = []
    for n, level in ((4, 1), (8, 2)):
        options = {"friction": None, "contact": PenaltyContact(20.0)}
        rows = history(indented(2, ball(2, level), path, n, **options)[0], 1.0, StepControl.fixed(1.0))
        force.append(rows["tool_force_y"][-1])
    assert force[0] == pytest.approx(force[1], rel=0.08)
    assert force[1] == pytest.approx({0.1: 0.12, 0.3: 0.46, 0.45: 0.77}[depth], rel=0.08)


@pytest.mark.parametrize("friction", [None, Coulomb(50.0, 7.0), Coulomb(0.4, 1e3)], ids=["smooth", "stick", "slip"])
@pytest.mark.parametrize(("gdim", "degree"), [(2, 1), (2, 2), (3, 1)])
def test_tangent(gdim, degree, friction):
    path = ToolPath(lambda t: drawn(gdim, 0.1).position(1.0) + 0.03 * t * np.eye(gdim)[0])
    mechanics, tool = indented(gdim, ball(gdim, 1), path, 4, degree, friction, MPI.COMM_SELF, search=0.5)
    state = mechanics.state
    state.u_old.x.array[:] = wavy(state.V, 1, 0.01)
    state.begin(1.0)
    tool.begin()
    u, w = wavy(state.V, 1, 0.01) + wavy(state.V, 2, 0.01), wavy(state.V, 3, 0.02)
    problem = Assembled(tool, state)
    f, slope = problem.forces(u), problem.matrix(u) @ w
    remainders = np.array([np.linalg.norm(problem.forces(u + h * w) - f - h * slope) for h in STEPS])
    remainders /= np.linalg.norm(slope)
    assert remainders[0] > 1e-8
    assert slopes(STEPS, remainders).min() > 1.95, remainders
    np.testing.assert_allclose(problem.forces(u, w), f + slope, atol=1e-12 * np.linalg.norm(slope))


def test_rollback():
    """A step that is given up leaves no trace, bit for bit."""
    mechanics, tool = indented(2, ball(2, 3), drawn(2, 0.1), 8)
    history(mechanics, 1.5, StepControl.fixed(0.25))

    def memory():
        arrays = [mechanics.state.u.x.array, tool.position.value, tool.force(), tool.moment(), tool.displacement]
        arrays += [
            *tool.touch.history.trial.values(),
            list(tool.energies().values()),
            tool.touch.kinematics._slid.trial,
        ]
        arrays += [tool.touch.slip.values(name) for name in ("slip", "traction", "dissipated")]
        return [np.array(a) for a in arrays]

    before = memory()
    ends = []
    for end in (1.7, 1.6, 1.7):
        begin(mechanics, end)
        assert mechanics.solve("bt").converged
        mechanics.evaluate()
        ends.append(tool.force())
        mechanics.state.rollback()
        for one, other in zip(before, memory(), strict=True):
            np.testing.assert_array_equal(one, other)
    np.testing.assert_allclose(ends[0], ends[2], rtol=1e-9)
    assert abs(ends[1] - ends[0]).max() > 1e-4


@pytest.mark.mpi
@pytest.mark.skipif(MPI.COMM_WORLD.size == 1, reason="compares several ranks with one")
def test_same_on_any_number_of_ranks():
    one, all_of_them = (
        history(indented(3, ball(3, 2), drawn(3, 0.1), 4, comm=comm)[0], 2.0, StepControl.fixed(0.25))
        for comm in (MPI.COMM_SELF, MPI.COMM_WORLD)
    )
    for name in one:
        if name.startswith("tool"):
            np.testing.assert_allclose(all_of_them[name], one[name], rtol=1e-7, atol=1e-9, err_msg=name)


# -- surfaces ---------------------------------------------------------------------------------------------------------


@pytest.mark.mpi
@pytest.mark.parametrize("suffix", ["stl", "obj"])
def test_read(suffix, tmp_path):
    """A file in centimetres, inside out and, as STL has it, with the corners of each triangle by themselves."""
    surface = ball(3, 2)
    apart = meshio.Mesh(surface.corners[:, ::-1].reshape(-1, 3), {"triangle": np.arange(960).reshape(-1, 3)})
    meshio.write(tmp_path / f"ball.{suffix}", apart)
    read = Triangulation.read(tmp_path / f"ball.{suffix}", scale=10.0)
    assert len(read.points) == 162 and len(read.facets) == 320
    volumes = [np.linalg.det(s.corners).sum() / 6 for s in (read, surface)]
    assert volumes[1] > 0.9 * 4 / 3 * np.pi * R**3
    np.testing.assert_allclose(volumes[0], 1000 * volumes[1], rtol=1e-5)


def test_facets_without_extent_are_left_out():
    square = np.array([[0, 0], [1, 0], [1, 1], [1, 1], [0, 1]], dtype=float)
    assert polygon(square).facets.tolist() == polygon(square[[0, 1, 2, 4]]).facets.tolist()


TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
CORNERS = np.vstack([np.zeros(3), np.eye(3)])


@pytest.mark.parametrize(
    ("points", "facets", "words"),
    [
        (CORNERS, TETRAHEDRON[1:], "3 edges of other than two facets"),
        (CORNERS, np.vstack([TETRAHEDRON[:1, ::-1], TETRAHEDRON[1:]]), "3 edges between facets of opposite sense"),
        (CORNERS, TETRAHEDRON + 1, "facets = .* in 0 … 3"),
        (CORNERS, TETRAHEDRON[:, :2], "facets = "),
        (CORNERS[:, :1], TETRAHEDRON, "points = "),
        (np.where(CORNERS == 1, np.nan, 0), TETRAHEDRON, "finite"),
        (CORNERS[:, :2], np.array([[0, 1], [1, 2]]), "2 edges of other than two facets"),
        (CORNERS[:, :2], np.array([[0, 1], [2, 1], [2, 0]]), "2 edges between facets of opposite sense"),
    ],
)
def test_refusal_of_a_surface(points, facets, words):
    assert Triangulation(CORNERS, TETRAHEDRON).facets.tolist() == TETRAHEDRON.tolist()
    with pytest.raises(ValueError, match=words):
        Triangulation(points, facets)


@pytest.mark.mpi
def test_refusal_of_a_file(tmp_path):
    """By name, on all ranks."""
    (tmp_path / "words.stl").write_text("rubbish")
    (tmp_path / "words.txt").write_text("")
    meshio.write(tmp_path / "open.obj", meshio.Mesh(CORNERS, {"triangle": TETRAHEDRON[1:]}))
    meshio.write(tmp_path / "quads.obj", meshio.Mesh(CORNERS, {"quad": [[0, 1, 2, 3]]}))
    for name in ("none.stl", "words.stl", "words.txt", "open.obj", "quads.obj"):
        with pytest.raises(ValueError, match=name):
            Triangulation.read(tmp_path / name)
    with pytest.raises(ValueError, match="scale = 0"):
        Triangulation.read(tmp_path / "open.obj", scale=0)


@pytest.mark.mpi
def test_refusal_of_a_tool():
    for options, name in (({"search": 0.0}, "search"), ({"path": drawn(3, 0.1)}, r"path\(0\)")):
        with pytest.raises(ValueError, match=f"{name} = "):
            indented(2, ball(2, 1), **{"path": drawn(2, 0.1), "n": 2, **options})
    with pytest.raises(ValueError, match=r"surface = .* 2 components"):
        indented(2, ball(3, 1), drawn(2, 0.1), 2)
