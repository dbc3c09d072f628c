"""Forces of tools against what balances them, and the work of friction in closed form."""

import numpy as np
import pytest
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI

from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.stepping import StepControl, begin
from cutsim.base.assembly import moment
from cutsim.bodies.loads import Support
from cutsim.bodies.solid import Solid
from cutsim.fields.points import Surface
from cutsim.fields.state import State
from cutsim.interface.contact import HardeningContact, PenaltyContact, SoftenedContact
from cutsim.interface.friction import SmoothCoulomb
from cutsim.materials.elastic import NeoHookean
from cutsim.solvers.convergence import Tolerances
from cutsim.tools.pointed import Blade
from cutsim.tools.shapes import Ball, Plane, ToolPath
from cutsim.tools.tool_contact import ToolContact
from helpers.blocks import make_blocks
from helpers.laws import EXPONENTIAL, NU, E
from helpers.runs import history

CONTACT = PenaltyContact(60.0, blend=0.01)
FRICTION = SmoothCoulomb(0.3, 1e-3)


def indented(gdim, friction=FRICTION):
    """A block on a fixed base, indented by a ball that then drags along its top."""
    b = make_blocks(gdim, n=4)
    state = State(fem.functionspace(b.state.mesh, ("Lagrange", 1, (gdim,))))
    down, along = np.eye(gdim)[-1], np.eye(gdim)[0]
    start = 0.45 * np.ones(gdim) + (1.35 - 0.45) * down
    path = ToolPath.polyline([0, 1, 2], [start, start - 0.2 * down, start - 0.2 * down + 0.1 * along])
    top = Surface.exterior(state, b.face(gdim - 1, 1.0))
    ball = ToolContact(state, Ball(0.35), path, [top], contact=CONTACT, friction=friction)
    supports = [Support(state, b.face(gdim - 1, 0.0), i, name=f"base_{'xyz'[i]}") for i in range(gdim)]
    return Mechanics(state, [Solid(state, NeoHookean(E, NU)), ball], supports, tolerances=Tolerances(rtol=1e-11)), ball


@pytest.mark.parametrize("gdim", [2, 3])
def test_tool_balances_the_supports(gdim):
    """The force on the tool is that of the supports on the body, and so is the moment about the tool."""
    mechanics, ball = indented(gdim)
    rows = history(mechanics, 2.0, StepControl.fixed(0.2))
    force = np.array([rows[f"tool_force_{a}"] for a in "xyz"[:gdim]])
    support = np.array([rows[f"base_{a}_force"] for a in "xyz"[:gdim]])
    np.testing.assert_allclose(force, support, atol=1e-6 * np.abs(force).max())
    assert force[-1].min() >= 0, "the body pushes the tool up"
    assert force[0, -1] < 0, "friction holds the tool back"
    state = mechanics.state
    begin(mechanics, 2.1)
    assert mechanics.solve().converged
    mechanics.evaluate()
    residual = mechanics.problem.residual()
    places = state.V.tabulate_dof_coordinates()
    base = np.repeat(np.isclose(places[:, gdim - 1], 0), gdim)
    arms = places.copy()
    arms[:, :gdim] += state.u.x.array.reshape(-1, gdim) - ball.position.value
    couple = moment(state.mesh.comm, np.where(base, residual.array, 0.0), arms, gdim)
    residual.destroy()
    np.testing.assert_allclose(ball.moment(), couple, atol=1e-6 * np.abs(force).max())
    assert np.abs(couple).max() > 1e-2 * np.abs(force).max()


def test_frictionless_contact_force_is_the_derivative_of_its_energy():
    mechanics, ball = indented(2, friction=None)
    history(mechanics, 1.0, StepControl.fixed(0.5))
    h, place = 1e-6, ball.position.value.copy()
    for i, force in enumerate(ball.force()):
        energies = []
        for step in (h, -h):
            ball.position.value[i] = place[i] + step
            energies.append(ball.energies()["contact"])
        ball.position.value[:] = place
        assert force == pytest.approx(-(energies[0] - energies[1]) / (2 * h), abs=1e-7)


@pytest.mark.parametrize("kind", [SoftenedContact, HardeningContact])
def test_a_softened_contact_is_the_derivative_of_its_energy_and_has_an_inverse(kind):
    """From the clearance on, where the pressure begins with no slope; the hardening one has the slope ε at s = c."""
    law, depth, h = kind(stiffness=3.0, blend=0.4, clearance=0.2), np.linspace(-0.5, 2.0, 101), 1e-5

    def of(value, at):
        return np.array([float(value(ufl.as_ufl(float(x)))) for x in at])

    pressure = of(law.pressure, depth)
    np.testing.assert_allclose(
        (of(law.energy, depth + h) - of(law.energy, depth - h)) / (2 * h), pressure, atol=1e-8, rtol=1e-8
    )
    touched = depth > -law.clearance
    assert not pressure[~touched].any() and (pressure[touched] > 0).all()
    np.testing.assert_allclose(law.penetration(pressure[touched]), depth[touched], atol=1e-9)
    if kind is HardeningContact:
        at = law.blend - law.clearance
        ahead, behind = of(law.pressure, [at + h, at - h])
        assert (ahead - behind) / (2 * h) == pytest.approx(law.stiffness, rel=1e-6)
        with pytest.raises(ValueError, match="blend"):
            HardeningContact(1.0, 0.0, 0.1)


def rigid_block_under_plate(path, friction):
    """A block that does not move at all under a moving plate: the penetration is that of the path."""
    b = make_blocks()
    top = Surface.exterior(b.state, b.face(1, 1.0))
    plate = ToolContact(b.state, Plane((0.0, -1.0)), path, [top], contact=PenaltyContact(50.0), friction=friction)
    cells = np.union1d(b.lower, b.upper)
    return Mechanics(b.state, [plate], b.drive(cells, [0.0, 0.0], "base"))


def test_friction_dissipates_mu_p_times_the_slip():
    """A plate 0.02 deep slides 0.5 to and fro: p = ε d, D = μ p A s, never falling; the base carries μ p A."""
    path = ToolPath.polyline([0, 1, 2, 4], [(0, 1), (0, 0.98), (0.5, 0.98), (-0.5, 0.98)])
    rows = history(rigid_block_under_plate(path, FRICTION), 4.0, StepControl.fixed(0.01))
    pressure = 50 * 0.02
    slid = rows["time"] > 1.011
    np.testing.assert_allclose(np.abs(rows["base_x_force"][slid]), 0.3 * pressure, rtol=0.03)
    assert np.sign(rows["tool_force_x"][150]) == -1, "friction on the tool opposes its motion"
    dissipated = rows["energy_friction"]
    assert dissipated[-1] == pytest.approx(0.3 * pressure * 1.5, rel=0.03)
    assert (np.diff(dissipated) > -1e-12).all()
    # where slip begins or turns the force jumps within a step, which the trapezoidal rule of the work does not see
    assert abs(rows["energy_closure"][-1]) < 1e-2
    assert rows["work_external"][-1] - rows["energy_contact"][-1] > 0.9 * dissipated[-1], (
        "nothing else takes up the work"
    )


def test_tool_without_contact_does_nothing():
    path = ToolPath.polyline([0, 1], [(0, 1.5), (0.5, 1.1)])
    rows = history(rigid_block_under_plate(path, FRICTION), 1.0, StepControl.fixed(0.5))
    for name in ("tool_force_x", "tool_force_y", "tool_moment_z", "energy_contact", "energy_friction"):
        assert not rows[name].any()


def test_corners_of_the_path_are_those_of_the_tool():
    path = ToolPath.polyline([0, 0.3, 1], [(0, 1.5), (0.5, 1.5), (0, 1.5)])
    rows = history(rigid_block_under_plate(path, None), 1.0, StepControl.fixed(0.2))
    assert 0.3 in rows["time"]


def test_refuses_what_cannot_touch():
    b = make_blocks()
    path = ToolPath(lambda t: np.zeros(2))
    surface = Surface.exterior(b.state, b.face(1, 1.0))
    with pytest.raises(ValueError, match="surfaces = 0 is not allowed"):
        ToolContact(b.state, Ball(1.0), path, [], contact=CONTACT)
    with pytest.raises(ValueError, match=r"path\(0\) = .* 2 components"):
        ToolContact(b.state, Ball(1.0), ToolPath(lambda t: np.zeros(3)), [surface], contact=CONTACT)
    with pytest.raises(ValueError, match=r"shape.push = \(0.0, -1.0, 0.0\) .* of 2 components"):
        flat = Blade(0.3, 0.1, 0.2, (0.0, -1.0, 0.0), (1.0, 0.0, 0.0))
        ToolContact(b.state, flat, path, [surface], contact=CONTACT)
    with pytest.raises(ValueError, match=r"lateral = \(1.0, 0.0\) .* of 3 components, as push has"):
        Blade(0.3, 0.1, 0.2, (0.0, -1.0, 0.0))
    with pytest.raises(ValueError, match="mu = -1 is not allowed"):
        SmoothCoulomb(-1, 0.1)
    with pytest.raises(ValueError, match="slip = 0 is not allowed"):
        SmoothCoulomb(0.1, 0)
    with pytest.raises(ValueError, match="stiffness = 0 is not allowed"):
        PenaltyContact(0)
    with pytest.raises(ValueError, match="blend = -1 is not allowed"):
        PenaltyContact(1.0, -1)


def pressed_sheet(step):
    """A clamped sheet pressed down by a ball that begins above it: force at the end."""
    domain = mesh.create_rectangle(
        MPI.COMM_WORLD, [(0, 0), (4, 0.2)], (20, 2), mesh.CellType.quadrilateral, ghost_mode=mesh.GhostMode.shared_facet
    )
    state = State(fem.functionspace(domain, ("Lagrange", 1, (2,))))
    ends = mesh.locate_entities_boundary(domain, 1, lambda x: np.isclose(np.abs(x[0] - 2), 2))
    faces = mesh.locate_entities_boundary(domain, 1, lambda x: np.isclose(np.abs(x[1] - 0.1), 0.1))
    path = ToolPath.polyline([0, 1], [(2, 0.9), (2, -4.1)])
    ball = ToolContact(state, Ball(0.5), path, [Surface.exterior(state, faces)], contact=PenaltyContact(20.0))
    mechanics = Mechanics(state, [Solid(state, NeoHookean(E, NU)), ball], [Support(state, ends, i) for i in (0, 1)])
    return history(mechanics, 0.3, StepControl(step, step, smallest=1e-3))


@pytest.mark.mpi
def test_no_step_carries_a_tool_through_a_sheet(caplog):
    """A step of 1.5 would pass the sheet of 0.2: it is cut, and ends as small ones do."""
    caplog.set_level("INFO")
    large, small = pressed_sheet(0.3), pressed_sheet(0.025)
    assert MPI.COMM_WORLD.rank or "tool has passed through the surface of the body at" in caplog.text
    assert len(large["time"]) < len(small["time"])
    assert large["tool_force_y"][-1] > 0.05
    assert large["tool_force_y"][-1] == pytest.approx(small["tool_force_y"][-1], rel=1e-6)


def small_ball(step):
    """A ball smaller than half a facet of the body's top, which goes in between two points of it: forces."""
    domain = mesh.create_rectangle(
        MPI.COMM_WORLD, [(0, -1), (2, 0)], (8, 4), mesh.CellType.quadrilateral, ghost_mode=mesh.GhostMode.shared_facet
    )
    state = State(fem.functionspace(domain, ("Lagrange", 1, (2,))))
    top, base = (mesh.locate_entities_boundary(domain, 1, lambda x, y=y: np.isclose(x[1], y)) for y in (0, -1))
    path = ToolPath.polyline([0, 1], [(1, 0.11), (1, -0.4)])
    ball = ToolContact(state, Ball(0.1), path, [Surface.exterior(state, top)], contact=PenaltyContact(40 * E))
    mechanics = Mechanics(state, [Solid(state, NeoHookean(E, NU)), ball], [Support(state, base, i) for i in (0, 1)])
    return history(mechanics, 0.5, StepControl(step, step, smallest=1e-3))["tool_force_y"]


@pytest.mark.mpi
def test_no_step_carries_a_small_ball_between_the_points_of_the_surface(caplog):
    """A large step is cut until the ball presses on the points beside it; that the mesh is too coarse is doubted."""
    caplog.set_level("INFO")
    force = small_ball(0.5)[-1]
    assert MPI.COMM_WORLD.rank or "tool has passed through the surface of the body between its points" in caplog.text
    assert MPI.COMM_WORLD.rank or "facets of 0.25 do not resolve the tool's radius 0.1" in caplog.text
    assert force > 0.2


def ball_in(b, depth):
    """A ball of radius 0.3 that begins so deep in the top of a block, and moves on by 0.05."""
    path = ToolPath.polyline([0, 1], [(0.5, 1.3 - depth), (0.5, 1.25 - depth)])
    top = Surface.exterior(b.state, b.face(1, 1.0))
    return ToolContact(b.state, Ball(0.3), path, [top], contact=PenaltyContact(20.0), name="ball")


def test_a_tool_that_begins_in_the_body_pushes_inwards():
    """The deeper, the more, as long as its middle is above the surface; no step takes it to the far side."""
    force = []
    for depth in (0.1, 0.25):
        b = make_blocks(n=8)
        base = [Support(b.state, b.face(1, 0.0), i) for i in (0, 1)]
        mechanics = Mechanics(
            b.state, [Solid(b.state, NeoHookean(E, NU)), b.crack(EXPONENTIAL), ball_in(b, depth)], base
        )
        force.append(history(mechanics, 1.0, StepControl(1.0, 1.0))["ball_force_y"][-1])
    assert force[1] > 2 * force[0] > 0.2


@pytest.mark.mpi
def test_a_tool_may_not_begin_behind_the_surface():
    """Where its middle is below the surface it is refused; where it is all in the body, the run is doubted."""
    for depth in (0.35, 0.45):
        with pytest.raises(ValueError, match=r"path of 'ball': at its start .* behind the middle of the tool, up to 0"):
            ball_in(make_blocks(n=8), depth)
    b = make_blocks(n=8)
    ball_in(b, 0.65)
    assert any("ball begins 0.05" in reason and "inside the body" in reason for reason in b.state.verdict.reasons)


@pytest.mark.mpi
@pytest.mark.parametrize("sides", ["", "+", "+-"])
def test_a_tool_in_faces_of_a_crack_that_it_cannot_touch_is_doubted(sides):
    """A ball drives in along the crack of a block from its side; a face that another tool touches does not count."""
    b = make_blocks(n=8)
    crack, path = b.crack(EXPONENTIAL), ToolPath.polyline([0, 1], [(1.3, 0.5), (0.9, 0.5)])
    surfaces = [Surface.exterior(b.state, b.face(0, 1.0)), *(Surface.of(b.state, crack.face(side)) for side in sides)]
    balls = [
        ToolContact(b.state, Ball(0.2), path, touched, contact=PenaltyContact(20.0), name=f"ball{i}")
        for i, touched in enumerate((surfaces[:1], surfaces))
    ]
    Mechanics(b.state, [b.solid(), crack, *balls], [Support(b.state, b.face(0, 0.0), i) for i in (0, 1)])
    b.state.begin(1.0)
    for ball in balls:
        ball.begin()
        ball.watch()
    # the point nearest to the middle of the ball is 0.19 deep
    words = "faces of cracks are in the tool by 1.5 of the mesh size, unresisted"
    assert (words in " ".join(b.state.verdict.reasons)) == (sides != "+-")


@pytest.mark.mpi
def test_coarse_mesh_is_named_with_numbers(caplog):
    b = make_blocks(n=8)
    top = Surface.exterior(b.state, b.face(1, 1.0))
    for name, radius in (("round", 0.125), ("sharp", 0.05)):
        path = ToolPath(lambda t: np.array([0.5, 1.1 - t]))
        ToolContact(b.state, Blade(0.2, radius, 0.5), path, [top], contact=PenaltyContact(1.0), name=name)
    words = "sharp: facets of 0.125 do not resolve the tool's radius 0.05"
    assert words in str(b.state.verdict) and "round: facets" not in str(b.state.verdict)
    assert MPI.COMM_WORLD.rank or words in caplog.text
