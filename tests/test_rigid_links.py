"""Rigid parts of test rigs: plates that turn, pins, levers; forces by statics, work, and the tangent."""

import numpy as np
import pytest
from dolfinx import fem, mesh
from mpi4py import MPI

from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.stepping import StepControl
from cutsim.base.rotations import rotation_matrix
from cutsim.bodies.loads import Support
from cutsim.bodies.machine import Machine
from cutsim.bodies.rigid_link import Attachment, RigidLink
from cutsim.bodies.solid import Solid
from cutsim.fields.state import State
from cutsim.materials.elastic import LinearElastic, StVenantKirchhoff
from helpers.borders import bordered_slopes
from helpers.fields import smooth
from helpers.meshes import HEXAHEDRON, box, rectangle
from helpers.runs import history

COMM = MPI.COMM_WORLD
YOUNG, LENGTH, HEIGHT = 100.0, 10.0, 1.0
INERTIA = HEIGHT**3 / 12


class Beam:
    """A plane beam of degree 2, without lateral contraction."""

    def __init__(self, material=StVenantKirchhoff, nx=12):
        domain = rectangle([(0, -HEIGHT / 2), (LENGTH, HEIGHT / 2)], (nx, 2))
        self.state = State(fem.functionspace(domain, ("Lagrange", 2, (2,))))
        self.solid = Solid(self.state, material(YOUNG, 0.0))

    def end(self, at):
        return Attachment(mesh.locate_entities_boundary(self.state.mesh, 1, lambda x: np.isclose(x[0], at)))

    def point(self, x, y, along=None, name=None):
        vertices = mesh.locate_entities(self.state.mesh, 0, lambda p: np.isclose(p[0], x) & np.isclose(p[1], y))
        return Attachment(vertices, along, dim=0, name=name)

    def plate(self, at, name, motion=None, **options):
        return RigidLink(self.state, [self.end(at)], (at, 0.0), motion=motion or {}, name=name, **options)

    def run(self, *links, until=1.0, steps=1, supports=()):
        mechanics = Mechanics(self.state, [self.solid, *links], supports)
        return history(mechanics, until, StepControl.fixed(until / steps))


@pytest.mark.mpi
def test_beam_on_pins():
    """A moment at one of two pinned ends turns it by ML/3EI, the other one by half as much; shear by Timoshenko."""
    beam = Beam(LinearElastic)
    turn = 1e-3
    left = beam.plate(0.0, "left", {"x": 0.0, "y": 0.0})
    right = beam.plate(LENGTH, "right", {"y": 0.0, "rz": lambda t: turn * t})
    row = {name: values[-1] for name, values in beam.run(left, right).items()}
    shear = 1 / (5 / 6 * YOUNG / 2 * HEIGHT * LENGTH)
    own, other = LENGTH / (3 * YOUNG * INERTIA) + shear, LENGTH / (6 * YOUNG * INERTIA) - shear
    assert row["right_rz_moment"] == pytest.approx(turn / own, rel=2e-3)
    assert row["left_rz"] / turn == pytest.approx(-other / own, rel=2e-3)
    assert abs(row["left_rz_moment"]) < 1e-8 * row["right_rz_moment"]
    assert row["left_y_force"] * (LENGTH + row["right_x"]) == pytest.approx(row["right_rz_moment"], rel=1e-5)
    assert row["work_external"] == pytest.approx(0.5 * row["right_rz_moment"] * turn, rel=1e-6)
    assert abs(row["energy_closure"]) < 1e-5


@pytest.mark.mpi
def test_lever_of_mixed_mode_bending_splits_the_load_by_statics():
    """Reeder's lever presses the middle with P (c + L)/L and pulls the end with P c/L, wherever the beam moves.

    It is loaded at a distance c beyond the middle, hinged at the end of the beam, and rests on a roller in its middle.
    """
    beam, c, load = Beam(), 3.0, 0.04
    half = LENGTH / 2
    loaded = np.array([half - c, 2.0])
    lever = RigidLink(
        beam.state,
        [beam.point(half, HEIGHT / 2, "y", "middle"), beam.point(LENGTH, 0.0, name="end")],
        tuple(loaded),
        machines=[Machine("y", force=lambda t: -load * t)],
        name="lever",
    )
    pin, roller = (beam.point(at, -HEIGHT / 2).entities for at in (0.0, LENGTH))
    supports = [Support(beam.state, pin, i, dim=0, name=f"pin_{'xy'[i]}") for i in range(2)]
    supports.append(Support(beam.state, roller, 1, dim=0, name="roller"))
    row = {name: values[-1] for name, values in beam.run(lever, supports=supports, steps=2).items()}
    assert abs(row["lever_rz"]) > 1e-3
    turn = rotation_matrix(np.array([0, 0, row["lever_rz"]]))[:2, :2]
    middle, end = (turn @ (np.array(place) - loaded) for place in ((half, HEIGHT / 2), (LENGTH, 0.0)))
    pressed, pulled = row["lever_middle_force_y"], row["lever_end_force_y"]
    assert pressed + pulled == pytest.approx(-load, rel=1e-7)
    assert pressed * middle[0] == pytest.approx(-pulled * end[0], rel=1e-7)
    assert pressed == pytest.approx(-load * (half + c) / half, rel=0.01)
    assert row["pin_y_force"] + row["roller_force"] == pytest.approx(load, rel=1e-7)
    assert abs(row["lever_end_force_x"]) < 1e-7 * load
    assert abs(row["energy_closure"]) < 2e-3


def test_rigid_turn_of_a_body_is_free():
    """A body that one plate turns by two radians about a point outside moves as a whole, without force or energy."""
    beam = Beam()
    plate = beam.plate(0.0, "plate", {"x": 0.0, "y": 0.0, "rz": lambda t: 2 * t})
    history = beam.run(plate, steps=8)
    x = beam.state.V.tabulate_dof_coordinates()[: len(beam.state.increment) // 2, :2]
    u = beam.state.u.x.array[: x.size].reshape(-1, 2)
    turn = rotation_matrix(np.array([0.0, 0.0, 2.0]))[:2, :2]
    assert COMM.allreduce(np.abs(x + u - x @ turn.T).max(initial=0.0), MPI.MAX) < 1e-7
    assert np.abs(history["plate_rz_moment"]).max() < 1e-6 * YOUNG * INERTIA / LENGTH


def test_stiff_beam_is_bent_to_an_arc():
    """Pure bending of a slender strip: the moment is that of the curvature, M = EI θ/L, and the end lies on the arc."""
    beam = Beam(nx=24)
    fixed = beam.plate(0.0, "fixed", {"x": 0.0, "y": 0.0, "rz": 0.0})
    angle = 1.5
    turning = beam.plate(LENGTH, "turning", {"rz": lambda t: angle * t})
    row = {name: values[-1] for name, values in beam.run(fixed, turning, steps=6).items()}
    moment = YOUNG * INERTIA * angle / LENGTH
    assert row["turning_rz_moment"] == pytest.approx(moment, rel=0.02)
    assert row["turning_x"] + LENGTH == pytest.approx(LENGTH / angle * np.sin(angle), rel=5e-3)
    assert row["turning_y"] == pytest.approx(LENGTH / angle * (1 - np.cos(angle)), rel=5e-3)
    assert abs(row["turning_y_force"]) < 1e-6
    assert row["work_external"] == pytest.approx(0.5 * moment * angle, rel=0.02)


@pytest.mark.mpi
def test_machine_in_series_with_a_beam():
    """A plate that is moved through a spring carries what stiffnesses in series give; the spring stores a part."""
    beam, k = Beam(LinearElastic), 2.0
    fixed = beam.plate(0.0, "fixed", {"x": 0.0, "y": 0.0, "rz": 0.0})
    pull = beam.plate(
        LENGTH, "pull", {"x": lambda t: 0.1 * t, "y": 0.0, "rz": 0.0}, machines=[Machine("x", stiffness=k)]
    )
    row = {name: values[-1] for name, values in beam.run(fixed, pull).items()}
    bar = YOUNG * HEIGHT / LENGTH
    force = 0.1 / (1 / k + 1 / bar)
    assert row["pull_x_force"] == pytest.approx(force, rel=1e-9)
    assert row["pull_x_machine_force"] == pytest.approx(force, rel=1e-9)
    assert row["pull_x"] == pytest.approx(0.1 - force / k, rel=1e-9)
    assert row["work_external"] == pytest.approx(0.05 * force, rel=1e-9)
    assert row["energy_strain"] == pytest.approx(0.05 * force, rel=1e-9)


@pytest.mark.mpi
@pytest.mark.parametrize("gdim", [2, 3])
def test_tangent_of_links(gdim):
    """Taylor slope 2 of all equations about large rotations, of a plate and of a lever with machines."""
    if gdim == 2:
        state = Beam(nx=4).state
        cut = LENGTH
    else:
        state = State(fem.functionspace(box(HEXAHEDRON, n=2), ("Lagrange", 1, (3,))))
        cut = 1.0
    solid = Solid(state, StVenantKirchhoff(YOUNG, 0.3))
    faces = [
        mesh.locate_entities_boundary(state.mesh, gdim - 1, lambda x, at=at: np.isclose(x[0], at)) for at in (0.0, cut)
    ]
    plate = RigidLink(state, [Attachment(faces[0])], (0.1,) * gdim, motion={"x": 0.1, "rz": 0.2}, name="plate")
    machine = Machine("rz" if gdim == 2 else "rx", 3.0, mass=1.0)
    lever = RigidLink(state, [Attachment(faces[1])], (0.3,) * gdim, machines=[machine], name="lever")
    mechanics = Mechanics(state, [solid, plate, lever])
    state.begin(0.5)
    mechanics.begin()
    system = mechanics.problem._system
    x = system.unknowns
    n = len(state.increment)
    x[:n], w = smooth(state.V, 3, 0.1)[:n], np.zeros_like(x)
    w[:n] = smooth(state.V, 4, 0.3)[:n]
    random = np.random.default_rng(5)
    x[n:], w[n:] = 0.7 * random.standard_normal(len(x) - n), random.standard_normal(len(x) - n)
    assert bordered_slopes(mechanics.problem, x, w).min() > 1.95


def test_links_that_make_no_sense_are_refused():
    beam = Beam(nx=4)
    hinge = [beam.point(0.0, HEIGHT / 2)]
    with pytest.raises(ValueError, match="can move along 'rz' while no attached node does"):
        RigidLink(beam.state, hinge, (0.0, HEIGHT / 2), motion={"x": 0.0, "y": 0.0})
    with pytest.raises(ValueError, match=r"dim = 5 .*0 … 2"):
        RigidLink(beam.state, [Attachment(np.array([0], dtype=np.int32), dim=5)], (0.0, 1.0))
    with pytest.raises(ValueError, match="motion = 'z'"):
        RigidLink(beam.state, hinge, (0.0, 1.0), motion={"z": 0.0})
    with pytest.raises(ValueError, match="stiffness = 0"):
        RigidLink(beam.state, hinge, (0.0, 1.0), motion={"y": 0.0}, machines=[Machine("y", force=1.0)])
    plate = beam.plate(0.0, "plate", {"x": 0.0, "y": 0.0, "rz": 0.0})
    held = Support(beam.state, beam.end(0.0).entities, 0)
    with pytest.raises(ValueError, match="a support holds as well"):
        Mechanics(beam.state, [beam.solid, plate], [held])
    with pytest.raises(ValueError, match="can slide along x"):
        beam.run(beam.plate(0.0, "loose", {"y": 0.0, "rz": 0.0}))
