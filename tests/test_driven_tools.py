"""Driven tools: a machine of finite stiffness, a given force, a weight, a falling tool, and one that may turn."""

import numpy as np
import pytest
from dolfinx import fem, mesh
from mpi4py import MPI

from cutsim.analysis.checkpoint import load, save
from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.stepping import StepControl, begin, run
from cutsim.bodies.loads import Support
from cutsim.bodies.machine import Machine
from cutsim.bodies.rigid_link import Attachment, RigidLink
from cutsim.bodies.schemes import GeneralisedAlpha
from cutsim.bodies.solid import Solid
from cutsim.fields.points import Surface
from cutsim.fields.state import State
from cutsim.interface.contact import PenaltyContact
from cutsim.materials.elastic import NeoHookean
from cutsim.tools.shapes import Ball, FlatPunch, ToolPath
from cutsim.tools.tool_contact import ToolContact
from cutsim.tools.triangulated_tool import TriangulatedTool
from cutsim.tools.triangulation import Triangulation
from helpers.blocks import make_blocks
from helpers.borders import bordered_slopes
from helpers.examples import TOOLS
from helpers.fields import smooth
from helpers.meshes import rectangle
from helpers.runs import history
from helpers.tangents import STEPS
from helpers.tools import CONTACT, FRICTION

COMM = MPI.COMM_WORLD
RADIUS = 0.3
#: Centre of the ball where it touches the block.
TOUCHING = np.array([0.5, 1.0 + RADIUS])


class Block:
    """A block on a plate, and a tool above it."""

    def __init__(self, path, machines=(), *, shape=None, density=None, friction=None):
        domain = rectangle([(0, 0), (1, 1)], (8, 8))
        self.state = State(fem.functionspace(domain, ("Lagrange", 1, (2,))))
        self.solid = Solid(self.state, NeoHookean(1.0, 0.3), density=density)
        top, bottom = (
            mesh.locate_entities_boundary(domain, 1, lambda x, at=at: np.isclose(x[1], at)) for at in (1.0, 0.0)
        )
        path = path if isinstance(path, ToolPath) else ToolPath(path)
        options = {"contact": PenaltyContact(20.0, blend=0.02), "friction": friction, "machines": machines}
        if isinstance(shape, Triangulation):
            self.tool = TriangulatedTool(self.state, top, shape, path, **options)
        else:
            touched = [Surface.exterior(self.state, top)]
            self.tool = ToolContact(self.state, shape or Ball(RADIUS), path, touched, **options)
        self.supports = [Support(self.state, bottom, i, name=f"plate_{'xy'[i]}") for i in range(2)]

    def mechanics(self, **options):
        return Mechanics(self.state, [self.solid, self.tool], self.supports, **options)

    def run(self, until=1.0, steps=10, **options):
        return history(self.mechanics(**options), until, StepControl.fixed(until / steps))


def down(depth):
    return lambda t: TOUCHING - np.array([0.0, depth * t])


def following(times, heights, **options):
    """The block under a ball whose height is prescribed."""
    points = [(TOUCHING[0], float(y)) for y in heights]
    return Block(ToolPath.polyline([0.0, *times], [tuple(TOUCHING), *points]), **options).run(times[-1], len(times))


def polygon(sides=40):
    """The ball as a polygon."""
    i, angle = np.arange(sides), 2 * np.pi * (np.arange(sides) + 0.3) / sides
    return Triangulation(
        RADIUS * np.column_stack([np.cos(angle), np.sin(angle)]), np.column_stack([i, (i + 1) % sides])
    )


@pytest.mark.mpi
@pytest.mark.parametrize("shape", [Ball(RADIUS), polygon()], ids=["ball", "polygon"])
def test_stiffness_of_the_machine_is_in_series(shape):
    """The ball lags the machine by F/k, and carries what a prescribed ball carries where it is."""
    k = 0.5
    soft = Block(down(0.2), [Machine("-y", stiffness=k)], shape=shape).run(steps=5)
    lag = 0.2 * soft["time"] - soft["tool_drive_y"]
    assert lag[-1] > 0.05
    assert lag == pytest.approx(soft["tool_force_y"] / k, rel=1e-6)
    assert soft["tool_drive_y_machine_force"] == pytest.approx(soft["plate_y_force"], rel=1e-6)
    hard = following(soft["time"], soft["tool_y"], shape=shape)
    assert soft["tool_force_y"] == pytest.approx(hard["tool_force_y"], rel=1e-6)
    # the machine has done the work on the ball, and that which its spring keeps
    spring = 0.5 * k * lag[-1] ** 2
    assert soft["work_external"][-1] == pytest.approx(hard["work_external"][-1] + spring, rel=1e-6)
    assert soft["energy_strain"][-1] == pytest.approx(hard["energy_strain"][-1] + spring, rel=1e-6)


@pytest.mark.mpi
@pytest.mark.parametrize("kind", ["force", "weight on a dashpot"])
def test_ball_under_a_force_rests_where_the_curve_has_that_force(kind):
    load = 0.05
    if kind == "force":  # it begins in contact, by a hair
        start, machine = 0.01, Machine("-y", force=lambda t: load * t)
    else:  # it creeps down, and comes to rest
        start, machine = -0.02, Machine("-y", damping=0.05, weight=load)
    until = 1.0 if kind == "force" else 40.0
    block = Block(lambda t: TOUCHING - np.array([0.0, start]), [machine])
    rows = history(block.mechanics(), until, StepControl(until / 20, until / 5))
    assert rows["tool_force_y"][-1] == pytest.approx(load, rel=1e-4 if kind != "force" else 1e-7)
    assert rows["plate_y_force"][-1] == pytest.approx(rows["tool_force_y"][-1], rel=1e-6)
    depth = TOUCHING[1] - rows["tool_y"][-1]
    curve = following(np.linspace(0.2, 1, 5), TOUCHING[1] - depth * np.linspace(0.2, 1, 5))
    assert rows["tool_force_y"][-1] == pytest.approx(curve["tool_force_y"][-1], rel=1e-6)


def falling(speed=0.5, mass=0.05, gravity=0.3, **options):
    return Block(
        lambda t: TOUCHING + np.array([0.0, 0.03]),
        [Machine("-y", mass=mass, weight=mass * gravity, velocity=speed)],
        **options,
    )


def test_falling_ball_comes_back():
    """On a massless elastic block it rises as fast as it has come; its energy goes to and fro."""
    mass, gravity, speed = 0.05, 0.3, 0.5
    rows = falling(speed, mass, gravity).run(until=1.2, steps=80)
    down, rate, force = rows["tool_drive_y"], rows["tool_drive_y_rate"], rows["tool_force_y"]
    # the work of the recorded forces along the recorded way, beside that of gravity
    work = np.concatenate([[0.0], np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(down))])
    kinetic = 0.5 * mass * rate**2
    lost = kinetic[0] - kinetic + mass * gravity * (down - down[0])
    assert lost == pytest.approx(work, abs=5e-3 * kinetic[0])
    assert work.max() > 0.9 * kinetic[0]
    assert force[-1] == 0 and rate[-1] < 0
    assert rate[-1] ** 2 == pytest.approx(speed**2 + 2 * gravity * down[-1], rel=5e-3)
    assert np.abs(rows["energy_closure"]).max() < 5e-3


@pytest.mark.parametrize("scheme", ["trapezoidal", pytest.param("generalised alpha", marks=pytest.mark.mpi)])
def test_falling_ball_shakes_the_block(scheme):
    """With the block's inertia, energy and momentum of both together are balanced."""
    mass, density, dt = 0.05, 0.05, 0.01
    options = {} if scheme == "trapezoidal" else {"scheme": GeneralisedAlpha(0.8)}
    block = falling(0.5, mass, 0.0, density=density)
    mechanics = block.mechanics(analysis="dynamic", **options)
    momentum, rows = [], []

    def note(report):
        rows.append({"time": report.time} | {k: v for k, (v, _) in report.columns.items()})
        momentum.append(mechanics.inertia.momentum()[1] - mass * rows[-1]["tool_drive_y_rate"])

    run(mechanics, 0.9, StepControl.fixed(dt), note)
    closure, lost = ([row[name] for row in rows] for name in ("energy_closure", "energy_numerical"))
    turnover = 0.5 * mass * 0.25
    assert np.abs(closure).max() < 5e-3
    assert (lost[-1] > 1e-7 * turnover) == (scheme != "trapezoidal")
    force = np.array([0.0, *(row["plate_y_force"] for row in rows)])
    impulse, change = np.cumsum(0.5 * dt * (force[1:] + force[:-1])), np.array(momentum) + mass * 0.5
    assert change[-1] > 0.5 * mass
    assert change == pytest.approx(impulse, abs=0.01 * mass * 0.5)


@pytest.mark.mpi
def test_punch_that_may_turn_bears_no_moment():
    """Pressed beside the middle of a block of finite width, a punch on a hinge tilts until its moment vanishes."""
    place = np.array([0.75, 1.0])
    path = ToolPath(lambda t: place - np.array([0.0, 0.01 + 0.05 * t]))
    rows = Block(path, [Machine("rz")], shape=FlatPunch(0.2, 0.05, (0.0, -1.0))).run(steps=4)
    stiff = Block(path, shape=FlatPunch(0.2, 0.05, (0.0, -1.0))).run(steps=4)
    assert abs(stiff["tool_moment_z"][-1]) > 1e-4
    assert np.abs(rows["tool_moment_z"]).max() < 1e-6 * abs(stiff["tool_moment_z"][-1])
    assert abs(rows["tool_rotation_z"][-1]) > 1e-3
    assert rows["tool_rotation_z"] == pytest.approx(rows["tool_drive_rz"])
    assert rows["tool_force_y"][-1] < stiff["tool_force_y"][-1]


@pytest.mark.mpi
@pytest.mark.parametrize(("tool", "friction"), [("cylinder", FRICTION), ("sphere", None)])
def test_tangent_of_driven_tools(tool, friction):
    """Taylor slope 2 of all equations, with all coordinates of the tool as unknowns."""
    shape, place = TOOLS[tool]
    gdim = len(place)
    b = make_blocks(gdim)
    before = np.array(place) + np.eye(gdim)[0] * 0.05
    axes = ("x", "-y", "rz") if gdim == 2 else ("x", "y", "z", "rx", "ry", "rz")
    contact = ToolContact(
        b.state,
        shape,
        ToolPath.polyline([0.0, 1.0], [before, place]),
        [Surface.exterior(b.state, b.face(gdim - 1, 1.0))],
        contact=CONTACT,
        friction=friction,
        machines=[Machine(axis, 0.1, damping=0.1, mass=0.2) for axis in axes],
    )
    mechanics = Mechanics(b.state, [b.solid(), contact])
    b.state.begin(1.0)
    mechanics.begin()
    x, n, random = mechanics.problem._system.unknowns, len(b.state.increment), np.random.default_rng(3)
    w = np.zeros_like(x)
    x[:n], w[:n] = smooth(b.state.V, 4, 0.03)[:n], smooth(b.state.V, 7, 0.02)[:n]
    x[n:] += 0.02 * random.standard_normal(len(x) - n)
    w[n:] = 0.05 * random.standard_normal(len(x) - n)
    assert bordered_slopes(mechanics.problem, x, w).min() > 1.95


@pytest.mark.mpi
def test_tangent_of_a_driven_polygon():
    """Its columns and rows are products of the contact's own tangent, with friction."""
    block = Block(
        ToolPath.polyline([0.0, 1.0], [(0.45, 1.26), (0.5, 1.2)]),
        [Machine("x", 0.1), Machine("-y", 0.1, mass=0.2)],
        shape=polygon(8),
        friction=FRICTION,
    )
    mechanics = block.mechanics()
    block.state.begin(1.0)
    mechanics.begin()
    x, n, random = mechanics.problem._system.unknowns, len(block.state.increment), np.random.default_rng(3)
    w, free = np.zeros_like(x), ~mechanics.problem.fixed
    x[:n][free], w[:n][free] = (smooth(block.state.V, seed, 0.01)[:n][free] for seed in (4, 7))
    w[n:] = 0.01 * random.standard_normal(len(x) - n)
    assert bordered_slopes(mechanics.problem, x, w, 0.1 * STEPS).min() > 1.9


def test_driven_tool_goes_on_from_a_checkpoint():
    """Bit for bit, in the middle of a fall."""
    first = falling().mechanics()
    run(first, 0.2, StepControl.fixed(0.02))
    again = falling().mechanics()
    load(again, save(first))
    for problem in (first, again):
        run(problem, 0.3, StepControl.fixed(0.02))
    assert save(first) == save(again)


def test_rejected_step_leaves_no_trace():
    """After a step that was solved and given up all is as it was, bit for bit."""
    problem = falling(0.5, 0.05, 0.3).mechanics()
    run(problem, 0.1, StepControl.fixed(0.05))
    tool = problem.terms[1]
    before, place = save(problem), tool.position.value.copy()
    begin(problem, 0.2)
    assert problem.solve().converged
    problem.evaluate()
    assert np.abs(tool.position.value - place).max() > 0.01
    problem.state.rollback()
    after = save(problem)
    for snapshot in (before, after):
        del snapshot.values["mechanics: solver"]  # the scale of forces, which a rejected step may pass on
    assert after == before
    assert np.array_equal(tool.position.value, place)


def test_incompressible_block_under_a_driven_ball():
    """The pressure of Taylor–Hood elements stands between displacement and tool in the matrix."""
    load = 0.02
    block = Block(lambda t: TOUCHING - np.array([0.0, 0.01]), [Machine("-y", force=lambda t: load * t)])
    block.state = State(fem.functionspace(block.state.mesh, ("Lagrange", 2, (2,))))
    solid = Solid(block.state, NeoHookean(1.0, 0.4999), volumetric="taylor-hood")
    top, bottom = (
        mesh.locate_entities_boundary(block.state.mesh, 1, lambda x, at=at: np.isclose(x[1], at)) for at in (1.0, 0.0)
    )
    tool = ToolContact(
        block.state, Ball(RADIUS), block.tool.path, [Surface.exterior(block.state, top)],
        contact=block.tool.contact, machines=[Machine("-y", force=lambda t: load * t)],
    )  # fmt: skip
    supports = [Support(block.state, bottom, i, name=f"plate_{'xy'[i]}") for i in range(2)]
    rows = history(Mechanics(block.state, [solid, tool], supports), 1.0, StepControl.fixed(0.5))
    assert rows["tool_force_y"][-1] == pytest.approx(load, rel=1e-6)
    assert rows["plate_y_force"][-1] == pytest.approx(load, rel=1e-6)
    with pytest.raises(ValueError, match="cannot move a body with volumetric = 'taylor-hood'"):
        Mechanics(block.state, [solid, RigidLink(block.state, [Attachment(top)], (0.5, 1.0))], supports)


def test_tool_that_nothing_holds_is_refused():
    with pytest.raises(ValueError, match=r"tool_drive is free along '-y'.*Give its machine a stiffness"):
        Block(down(0.1), [Machine("-y", weight=1.0)]).run()
    with pytest.raises(ValueError, match=r"machines\[1\].axis"):
        Block(down(0.1), [Machine("-y", 1.0), Machine((1.0, 1.0), 1.0)])
    with pytest.raises(ValueError, match=r"machines\[0\].axis = 'rz'.*a translation"):
        Block(down(0.1), [Machine("rz", 1.0)], shape=polygon())
    with pytest.raises(ValueError, match="axis = 'rx'"):
        Block(down(0.1), [Machine("rx", 1.0)])
