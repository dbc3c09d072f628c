"""A machine pushes the blade of an insertion: its halves share one motion; so do other tools on one carriage."""

from pathlib import Path

import numpy as np
import pytest
from dolfinx import fem, mesh
from mpi4py import MPI

from cutsim import (
    Ball,
    Blade,
    Carriage,
    Drive,
    Exponential,
    Insertion,
    Machine,
    Mechanics,
    NeoHookean,
    Solid,
    State,
    StepControl,
    Support,
    Surface,
    ToolContact,
    ToolPath,
    TriangulatedTool,
    Triangulation,
    cracked_block,
    read_geo,
    run,
)
from cutsim.cases import CaseError, built_in_cases, read_case
from helpers.blocks import make_blocks
from helpers.borders import bordered_slopes
from helpers.examples import TOOLS
from helpers.fields import smooth
from helpers.meshes import rectangle
from helpers.runs import history
from helpers.tangents import STEPS
from helpers.tools import CONTACT, FRICTION

MESHES = Path(__file__).parents[1] / "meshes"
COMM = MPI.COMM_WORLD
NOTCH = 0.4
#: Time at which the push begins, at a speed of 1.
ENTRY = 0.8 * NOTCH


def pushed(machine=None, *, comm=COMM, drive=None):
    """An elastic strip whose bond a blade breaks."""
    size = {"dim": 2, "Lx": 0.8, "H": 2.0, "lc": 0.1, "band": 0.3, "growth": 1.6, "notch": NOTCH}
    bond, rubber = Exponential(strength=0.3, toughness=0.1), NeoHookean(0.777, 0.45)
    body = cracked_block(read_geo(MESHES / "block.geo", comm, size, gdim=2), rubber, bond)
    return Insertion.build(body, Blade(0.35, 0.1, 0.3), drive or Drive(1.0), notch=NOTCH, machine=machine)


def rows_of(cut, until, step):
    """Columns of a run, with an entry for each step."""
    rows = []
    run(
        cut.mechanics, until, StepControl.fixed(step),
        lambda r: rows.append({"time": (r.time, "")} | r.columns | cut.columns(r.columns)),
    )  # fmt: skip
    return {name: np.array([row[name][0] for row in rows]) for name in rows[0]}


@pytest.mark.mpi
def test_stiffness_of_the_machine_shifts_the_curve():
    """At the same depth the force is that of a prescribed blade, and the machine is ahead by F/k."""
    k = 2.0
    soft = rows_of(pushed(Machine("-y", stiffness=k)), ENTRY + 0.28, 0.08)
    depth, force, ahead = (soft[name] for name in ("depth", "force", "blade_drive_y_machine"))
    lag = ahead - soft["blade_drive_y"]
    assert lag[-1] > 0.02
    assert lag == pytest.approx(force / k, rel=1e-6)
    assert depth == pytest.approx(ENTRY + soft["blade_drive_y"], rel=1e-12)
    hard = pushed()
    assert hard.carriage is None
    stiff = rows_of(hard, hard.time_of(depth[-1]), 0.08)
    assert stiff["force"][-1] == pytest.approx(force[-1], rel=1e-6)
    spring = 0.5 * k * lag[-1] ** 2
    assert soft["energy_strain"][-1] == pytest.approx(stiff["energy_strain"][-1] + spring, rel=1e-6)
    if COMM.size > 1:
        alone = rows_of(pushed(Machine("-y", stiffness=k), comm=MPI.COMM_SELF), ENTRY + 0.28, 0.08)
        assert alone["force"] == pytest.approx(force, rel=1e-7)
        assert alone["blade_drive_y"] == pytest.approx(soft["blade_drive_y"], abs=1e-8)


def test_blade_under_a_force_rests_where_the_curve_has_that_force():
    """It is held until the push begins; then the force grows slowly from what the notch bears, and stays."""
    before = rows_of(pushed(), ENTRY, 0.08)["force"][-1]
    load, ramp = 0.06, 0.3

    def force(t):
        return before + (load - before) * min(max(t - ENTRY, 0.0) / ramp, 1.0)

    rows = rows_of(pushed(Machine("-y", force=force, corners=(ENTRY + ramp,))), ENTRY + ramp + 0.2, 0.08)
    held = rows["time"] <= ENTRY
    assert rows["blade_drive_y"][held] == pytest.approx(0.0, abs=1e-15)
    assert rows["force"][~held] == pytest.approx([force(t) for t in rows["time"][~held]], rel=1e-7)
    assert rows["force"][-1] == pytest.approx(load, rel=1e-7)
    assert rows["depth"][-1] == rows["depth"][-2] > 0.5, "it rests"
    cut = pushed()
    curve = rows_of(cut, cut.time_of(rows["depth"][-1]), 0.08)
    assert curve["force"][-1] == pytest.approx(load, rel=1e-6)


def test_falling_blade_spends_its_energy():
    """What the blade has lost is the work of the recorded force along the recorded way; the audit closes."""
    mass, speed, gravity = 0.01, 2.0, 0.5
    rows = rows_of(pushed(Machine("-y", mass=mass, velocity=speed, weight=mass * gravity)), ENTRY + 0.3, 0.02)
    first = int(np.searchsorted(rows["time"], ENTRY - 1e-9))
    way, force, rate = (rows[name][first:] for name in ("blade_drive_y", "force", "blade_drive_y_rate"))
    assert rate[0] == 0, "it is held"
    work = np.concatenate([[0.0], np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(way))])
    start = 0.5 * mass * speed**2
    kinetic = np.concatenate([[start], 0.5 * mass * rate[1:] ** 2])
    assert start - kinetic + mass * gravity * way == pytest.approx(work, abs=5e-3 * start)
    assert work[-1] > 0.9 * start, "it has nearly come to rest"
    assert np.diff(rate[1:]).max() < 0 and rows["front"][-1] > 0.1
    assert np.abs(rows["energy_closure"]).max() < 5e-3


def test_machine_that_does_not_fit_the_push_is_refused():
    with pytest.raises(ValueError, match=r"machine.axis = 'x'.*the direction of the push"):
        pushed(Machine("x", 1.0))
    with pytest.raises(ValueError, match=r"machine.axis = 'rz'"):
        pushed(Machine("rz", 1.0))
    with pytest.raises(ValueError, match=r"machine.velocity = 1.0.*0 with a stiffness"):
        pushed(Machine("-y", 1.0, mass=1.0, velocity=1.0))
    with pytest.raises(ValueError, match=r"machine.stiffness = 0.*turning_depth"):
        pushed(Machine("-y", mass=1.0), drive=Drive(1.0, turning_depth=0.6))


# -- case files -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('axis = "-y"', 'axis = "-z"', "insertion.machine.axis.*the mesh is flat"),
        ('axis = "-y"', 'axis = "rz"', "insertion.machine.axis"),
        ("[insertion]", "[insertion]\ndepth = 2", "insertion.depth.*machine without stiffness"),
    ],
)
def test_machine_of_a_case_is_refused_by_name(tmp_path, old, new, words):
    text = built_in_cases()["dropped-blade"][1].read_text(encoding="utf-8")
    assert text.count(old) == 1
    path = tmp_path / "case.toml"
    path.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(CaseError, match=words):
        read_case(path)


# -- tools on one carriage --------------------------------------------------------------------------------------------


@pytest.mark.mpi
def test_two_wires_on_a_rocker_are_in_balance():
    """A rocker on a pivot that goes down turns until the moments of both wires about the pivot cancel."""
    domain = rectangle([(0, 0), (1, 1)], (8, 8))
    state = State(fem.functionspace(domain, ("Lagrange", 1, (2,))))
    top, bottom = (mesh.locate_entities_boundary(domain, 1, lambda x, at=at: np.isclose(x[1], at)) for at in (1.0, 0.0))
    pivot, radius = np.array([0.45, 1.4]), 0.2
    down = np.array([0.0, -0.05])
    places = [np.array([0.2, 1.195]), np.array([0.9, 1.195])]
    carriage = Carriage(state, ToolPath(lambda t: pivot + t * down), [Machine("rz")], name="rocker")
    wires = [
        ToolContact(
            state,
            Ball(radius),
            ToolPath(lambda t, place=place: place + t * down),
            [Surface.exterior(state, top)],
            contact=CONTACT,
            name=name,
            machines=carriage,
        )
        for name, place in zip("ab", places, strict=True)
    ]
    supports = [Support(state, bottom, i) for i in range(2)]
    mechanics = Mechanics(state, [Solid(state, NeoHookean(1.0, 0.3)), *wires], supports)
    assert sum(isinstance(term, Carriage) for term in mechanics.terms) == 1
    rows = history(mechanics, 1.0, StepControl.fixed(0.25))
    moments, sizes = [], []
    for name in "ab":
        arm = np.array([rows[f"{name}_x"] - pivot[0], rows[f"{name}_y"] - pivot[1] - down[1] * rows["time"]])
        fx, fy = rows[f"{name}_force_x"], rows[f"{name}_force_y"]
        moments.append(arm[0] * fy - arm[1] * fx + rows[f"{name}_moment_z"])
        sizes.append(np.linalg.norm(arm, axis=0))
    assert np.abs(moments[0]).min() > 1e-4
    assert moments[0] == pytest.approx(-moments[1], rel=1e-6)
    for size, place in zip(sizes, places, strict=True):
        assert size == pytest.approx(np.linalg.norm(place - pivot), rel=1e-12), "the rocker is rigid"
    assert abs(rows["rocker_rz"][-1]) > 1e-3
    assert rows["a_rotation_z"] == pytest.approx(rows["rocker_rz"])
    assert abs(rows["energy_closure"][-1]) < 5e-3


@pytest.mark.mpi
@pytest.mark.parametrize("kind", ["turning", "triangles beside"])
def test_tangent_of_tools_on_one_carriage(kind):
    """Taylor slope 2 of all equations."""
    b = make_blocks(2)
    shape, place = TOOLS["cylinder"]
    place = np.array(place)
    axes = ("x", "-y", "rz") if kind == "turning" else ("x", "-y")
    machines = [Machine(axis, 0.1, damping=0.1, mass=0.2) for axis in axes]
    path = ToolPath.polyline([0.0, 1.0], [(0.38, 1.52), (0.3, 1.5)])
    carriage = Carriage(b.state, path, machines)

    def moving(shift):
        end = place + np.array([shift, 0.0])
        return ToolPath.polyline([0.0, 1.0], [end + np.array([0.05, 0.0]), end])

    options = {"contact": CONTACT, "friction": FRICTION, "machines": carriage}
    touched = [Surface.exterior(b.state, b.face(1, 1.0))]
    tools = [ToolContact(b.state, shape, moving(0.0), touched, name="first", **options)]
    if kind == "turning":
        tools.append(ToolContact(b.state, shape, moving(0.3), touched, name="second", **options))
    else:
        i, angle = np.arange(12), 2 * np.pi * (np.arange(12) + 0.3) / 12
        polygon = Triangulation(
            0.8 * np.column_stack([np.cos(angle), np.sin(angle)]), np.column_stack([i, (i + 1) % 12])
        )
        tools.append(TriangulatedTool(b.state, b.face(1, 1.0), polygon, moving(0.3), name="second", **options))
    mechanics = Mechanics(b.state, [b.solid(), *tools])
    b.state.begin(1.0)
    mechanics.begin()
    x, n, random = mechanics.problem._system.unknowns, len(b.state.increment), np.random.default_rng(3)
    w = np.zeros_like(x)
    scale = 1.0 if kind == "turning" else 0.3
    x[:n], w[:n] = smooth(b.state.V, 4, 0.03 * scale)[:n], smooth(b.state.V, 7, 0.02 * scale)[:n]
    x[n:] += 0.02 * scale * random.standard_normal(len(x) - n)
    w[n:] = 0.05 * scale * random.standard_normal(len(x) - n)
    assert bordered_slopes(mechanics.problem, x, w, STEPS if kind == "turning" else 0.1 * STEPS).min() > 1.9
