"""Tools that turn: closed forms for moment and work, and nothing that depends on the frame."""

import numpy as np
import pytest
import ufl

from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.stepping import StepControl
from cutsim.base.rotations import rotation_matrix, rotation_vector
from cutsim.fields.points import Surface
from cutsim.fields.state import State
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.friction import Coulomb
from cutsim.tools.pointed import Blade
from cutsim.tools.shapes import Ball, FlatPunch, Plane, ToolPath
from cutsim.tools.tool_contact import ToolContact
from cutsim.tools.triangulated_tool import TriangulatedTool
from cutsim.tools.triangulation import Triangulation
from helpers.blocks import make_blocks
from helpers.fields import wavy
from helpers.runs import history

CONTACT, MU = PenaltyContact(60.0), 0.3
# stiff enough that what sticks is a small part of a turn
FRICTION = Coulomb(MU, 6000.0)


def rigid(gdim, n, shape, path, friction=FRICTION):
    """A block that does not move at all, under a tool; the tool meets the points where its path takes it."""
    b = make_blocks(gdim, n=n)
    top = Surface.exterior(b.state, b.face(gdim - 1, 1.0))
    tool = ToolContact(b.state, shape, path, [top], contact=CONTACT, friction=friction)
    cells = np.union1d(b.lower, b.upper)
    return Mechanics(b.state, [tool], b.drive(cells, [0.0] * gdim, "base")), tool


@pytest.mark.mpi
@pytest.mark.parametrize("gdim", [2, 3])
def test_a_ball_that_spins_in_place(gdim):
    """Friction μ p at each point on the arm from the axis: so large is the moment, and moment times turn its work."""
    radius, depth, angle = 0.35, 0.05, 0.5
    place = np.full(gdim, 0.5) + (0.5 + radius - depth) * np.eye(gdim)[-1]
    # in space about an axis that is inclined, so that arms and slip are not all of one kind
    axis = np.array([1.0]) if gdim == 2 else np.array([0.6, 0.0, 0.8])
    down = depth * np.eye(gdim)[-1]
    path = ToolPath(lambda t: place + max(1 - t, 0) * down, (1.0,), lambda t: angle * max(t - 1, 0) * axis)
    mechanics, tool = rigid(gdim, 16, Ball(radius), path)
    rows = history(mechanics, 2.0, StepControl.fixed(1 / 16))
    points = tool.patches[0].surface.points
    arms = points.evaluator({"x": ufl.SpatialCoordinate(tool.state.mesh)})()["x"] - place
    p = CONTACT.stiffness * np.maximum(radius - np.linalg.norm(arms, axis=-1), 0)
    # the surface of a sphere that spins about its middle moves along itself
    speed = np.linalg.norm(arms if gdim == 2 else np.cross(axis, arms), axis=-1)
    expected = points.integral(MU * p * speed)
    moment = tool.moment() @ axis
    assert moment == pytest.approx(-expected, rel=2e-3)
    for name in ("energy_friction", "work_external"):
        done = rows[name][-1] - rows[name][15]
        # at each point friction turns within the first of sixteen steps
        assert done == pytest.approx(expected * angle, rel=1 / 16), name
        assert rows[name][-1] - rows[name][16] == pytest.approx(15 / 16 * expected * angle, rel=2e-3), name
    assert rows[f"tool_rotation_{'z' if gdim == 2 else 'x'}"][-1] == pytest.approx(angle * axis[0])


@pytest.mark.parametrize("gdim", [2, 3])
def test_moment_is_the_derivative_of_the_energy(gdim):
    """A plate that rocks on a block, without friction: moment and force by differences, and the work of the path."""
    normal = -np.eye(gdim)[-1]
    swing = np.array([0.1]) if gdim == 2 else np.array([0.1, 0.05, 0.2])
    middle = np.full(gdim, 0.4) + 0.6 * np.eye(gdim)[-1]
    path = ToolPath(lambda t: middle + 0.02 * t * normal, (), lambda t: swing * np.sin(2 * t))
    mechanics, tool = rigid(gdim, 8, Plane(tuple(normal)), path, None)
    rows = history(mechanics, 1.0, StepControl.fixed(0.05))
    assert abs(rows["energy_closure"][-1]) < 2e-3 and rows["energy_contact"][-1] > 1e-4
    h, rotation = 1e-5, tool.rotation.value.copy()
    for axis, moment in enumerate(tool.moment()):
        energies = []
        for step in (h, -h):
            turn = rotation_matrix(step * np.eye(len(swing))[axis])
            tool.rotation.value[:] = turn @ rotation
            energies.append(tool.energies()["contact"])
        tool.rotation.value[:] = rotation
        assert moment == pytest.approx(-(energies[0] - energies[1]) / (2 * h), abs=1e-8)


SQUARE = Triangulation(
    np.array([[-0.3, 0.0], [0.3, 0.0], [0.3, 0.5], [-0.3, 0.5]]), np.array([[0, 1], [1, 2], [2, 3], [3, 0]])
)


def made(kind, b, path):
    """A tool on the top of a block."""
    top = b.face(b.gdim - 1, 1.0)
    options = {"contact": CONTACT, "friction": Coulomb(MU, 60.0)}
    if kind == "segments":
        return TriangulatedTool(b.state, top, SQUARE, path, search=0.5, **options)
    shapes = {"blade": Blade(0.4, 0.3, 0.6), "punch": FlatPunch(0.5, 0.2, (0.0, 0.0, -1.0))}
    return ToolContact(b.state, shapes[kind], path, [Surface.exterior(b.state, top)], **options)


def rubbed(kind, gdim, turn):
    """Forces and dissipation at the end of two steps, in the second of which everything is turned about the origin."""
    b = make_blocks(gdim, n=4)
    state = b.state
    n = 1 if gdim == 2 else 3
    Q = rotation_matrix(turn)
    place, own = np.full(gdim, 0.5) + 0.45 * np.eye(gdim)[-1], 0.1 * np.ones(n)
    along = 0.04 * np.eye(gdim)[0]

    def position(t):
        before = place + min(t, 1.0) * along
        return before if t <= 1 else Q @ (place + t * along)

    def rotation(t):
        matrix = rotation_matrix(own * t)
        return rotation_vector(matrix if t <= 1 else Q @ matrix)

    tool = made(kind, b, ToolPath(position, (), rotation))
    x = state.V.tabulate_dof_coordinates()[:, :gdim]
    for time, seed, q in ((1.0, 1, np.eye(gdim)), (2.0, 2, Q)):
        state.begin(time)
        tool.begin()
        u = wavy(state.V, seed, 0.01).reshape(-1, gdim)
        state.u.x.array[:] = ((x + u) @ q.T - x).ravel()
        tool.evaluate()
        if time < 2:
            state.memory.commit()
    work = tool.energies()
    return tool.force(), tool.moment(), np.array([work["friction"], work["contact"]]), tool.slips[0].values("advance")


@pytest.mark.mpi
@pytest.mark.parametrize("kind", ["blade", "punch", "segments"])
def test_everything_turned_gives_the_same(kind):
    """Slip is relative to the tool that moves and turns, and what sticks elastically turns with the two."""
    gdim = 3 if kind == "punch" else 2
    turn = np.array([0.7, -0.4, 0.5]) if gdim == 3 else np.array([0.9])
    plain, turned = rubbed(kind, gdim, 0 * turn), rubbed(kind, gdim, turn)
    Q = rotation_matrix(turn)
    assert np.linalg.norm(plain[0]) > 0.1 and plain[2][0] > 1e-5
    np.testing.assert_allclose(turned[0], Q @ plain[0], atol=1e-12)
    np.testing.assert_allclose(turned[1], Q @ plain[1] if gdim == 3 else plain[1], atol=1e-12)
    np.testing.assert_allclose(turned[2], plain[2], atol=1e-13)
    np.testing.assert_allclose(turned[3], plain[3], atol=1e-13)


def test_a_turned_shape_is_a_shape_with_other_directions():
    """A blade that its path has turned, and one that was made so."""
    angle, place = 0.3, np.array([0.4, 0.9])
    Q = rotation_matrix(angle)
    forces = []
    for shape, turn in (
        (Blade(0.4, 0.3, 0.6), angle),
        (Blade(0.4, 0.3, 0.6, tuple(Q @ (0, -1)), tuple(Q @ (1, 0))), 0.0),
    ):
        b = make_blocks(n=4)
        path = ToolPath(lambda t: place, (), lambda t, turn=turn: turn)
        tool = ToolContact(b.state, shape, path, [Surface.exterior(b.state, b.face(1, 1.0))], contact=CONTACT)
        tool.evaluate()
        forces.append([*tool.force(), *tool.moment(), tool.penetration()])
    np.testing.assert_allclose(forces[0], forces[1], rtol=1e-12)
    assert abs(forces[0][2]) > 1e-3


def test_refuses_a_rotation_that_cannot_be():
    b = make_blocks()
    surface = [Surface.exterior(b.state, b.face(1, 1.0))]
    path = ToolPath(lambda t: np.array([0.5, 2.0]), (), lambda t: np.zeros(3))
    with pytest.raises(ValueError, match=r"path.rotation\(0\) = .* an angle"):
        ToolContact(b.state, Ball(0.3), path, surface, contact=CONTACT)
    round_body = State(b.state.V, axisymmetric=True)
    path = ToolPath(lambda t: np.array([0.5, 2.0]), (), lambda t: 0.1 * t)
    with pytest.raises(ValueError, match=r"path.rotation = .* None for a body of revolution"):
        ToolContact(round_body, Ball(0.3), path, surface, contact=CONTACT)


@pytest.mark.parametrize("turn", [(0.3,), (-3.0,), (0.4, -0.2, 1.1), (0.0, 0.0, 0.0)])
def test_rotation_vectors_and_matrices(turn):
    matrix = rotation_matrix(turn)
    np.testing.assert_allclose(matrix @ matrix.T, np.eye(len(matrix)), atol=1e-15)
    np.testing.assert_allclose(rotation_vector(matrix), turn, atol=1e-14)
    assert np.linalg.det(matrix) == pytest.approx(1)
