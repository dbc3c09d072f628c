"""Needle and blade driven in: closed forms of the force and its parts, two insertions, planar crack in space."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

from cutsim import Blade, Drive, Exponential, Insertion, Needle, NeoHookean, StepControl, cracked_block, read_geo, run
from cutsim.analysis.stepping import begin
from cutsim.studies.drive import Motion
from cutsim.studies.insertion_work import TwoInsertions, audited_toughness, force_parts
from cutsim.tools.tool_parts import PARTS

MESHES = Path(__file__).parents[1] / "meshes"
YOUNG, POISSON, TOUGHNESS, FRICTION = 0.777, 0.48, 0.1, 0.1
THREAD, RADIUS, OUTER = 0.2, 0.5, 4.0
ROUND = {"r0": THREAD, "R": OUTER, "H": 4.0, "notch": 0.5, "deep": 2.5, "lc": 0.075}
BLOCK = {"L": 3.0, "B": 3.0, "H": 3.2, "notch": 1.0, "slit": 0.7, "deep": 2.4, "band": 0.35, "lc": 0.35, "growth": 2.0}
SPLIT = {"dim": 2, "Lx": 3.0, "H": 4.0, "lc": 0.1, "band": 0.3, "growth": 1.6, "notch": 0.5}


def thread(comm=MPI.COMM_WORLD, *, friction=0.0, turn=None, **sizes):
    """A needle on the axis of a body of revolution."""
    domain = read_geo(MESHES / "thread.geo", comm, ROUND | sizes, gdim=2)
    needle = Needle(np.radians(30), 0.15, RADIUS)
    law = Exponential(strength=1.0, toughness=TOUGHNESS)
    body = cracked_block(domain, NeoHookean(YOUNG, POISSON), law, viscosity=0.002, axisymmetric=True)
    return Insertion.build(body, needle, Drive(1.0, 1.0, turn), notch=0.5, friction=friction)


def planar(comm=MPI.COMM_WORLD, **sizes):
    """A needle that splits a block."""
    domain = read_geo(MESHES / "needle.geo", comm, BLOCK | sizes, gdim=3)
    needle = Needle(np.radians(25), 0.4, 1.0, (0.0, -1.0, 0.0), (1.0, 0.0, 0.0))
    law = Exponential(strength=0.3, toughness=0.15)
    body = cracked_block(domain, NeoHookean(YOUNG, 0.45), law, viscosity=0.002)
    return Insertion.build(body, needle, Drive(1.0, 1.0), notch=1.0)


def split(*, friction=0.0, turn=None):
    """A blade in plane strain."""
    domain = read_geo(MESHES / "block.geo", MPI.COMM_WORLD, SPLIT, gdim=2)
    law = Exponential(strength=0.6, toughness=0.2)
    blade = Blade(np.radians(20), 0.1, 0.6)
    body = cracked_block(domain, NeoHookean(YOUNG, 0.45), law, viscosity=5e-4)
    return Insertion.build(body, blade, Drive(1.0, 1.0, turn), notch=0.5, friction=friction)


def drive(cut, until, control):
    """Run to a time and return the columns, with an entry for each step."""
    rows = []
    run(
        cut.mechanics, until, control,
        lambda r: rows.append({"time": (r.time, ""), **r.columns, **cut.columns(r.columns)}),
    )  # fmt: skip
    return {name: np.array([row[name][0] for row in rows]) for name in rows[0]}


@cache
def needle_twice(friction):
    cut = thread(friction=friction, turn=1.7)
    return cut, drive(cut, cut.time_of(1.7, 2), StepControl(first=0.02, largest=0.05))


@cache
def blade_twice(friction):
    cut = split(friction=friction, turn=2.0)
    return cut, drive(cut, cut.time_of(2.0, 2), StepControl(first=0.02, largest=0.1))


@cache
def in_space():
    cut = planar()
    return cut, drive(cut, cut.time_of(1.8), StepControl(first=0.1, largest=0.2))


def widening(hole):
    """Pressure in the hole of a thick incompressible cylinder, and the work per length to widen it that far."""
    radius = np.linspace(THREAD, hole, 2001)
    outer = np.sqrt(OUTER**2 + radius**2 - THREAD**2)
    inner, outer = radius / THREAD, outer / OUTER
    pressure = YOUNG / (2 * (1 + POISSON)) * (np.log(inner / outer) - 0.5 * (inner**-2 - outer**-2))
    return pressure[-1], np.trapezoid(pressure * 2 * np.pi * radius, radius)


def at_the_end(history, *columns):
    """Slopes of columns over the last quarter of a millimetre of the first push."""
    first = slice(0, int(np.argmax(history["depth"])) + 1)
    depth = history["depth"][first]
    end = depth > depth[-1] - 0.25
    return [np.polyfit(depth[end], history[name][first][end], 1)[0] for name in columns]


def test_the_steady_force_is_that_of_the_thread_and_of_the_hole():
    """Tearing 2πr₀G_c off and widening the hole like a thick cylinder's: each takes its part of the force."""
    cut, history = needle_twice(0.0)
    strain, contact, fracture, work = at_the_end(
        history, "energy_strain", "energy_contact", "energy_fracture", "work_external"
    )
    _, widened = widening(THREAD + history["crack_opening"].max())
    torn = 2 * np.pi * THREAD * TOUGHNESS
    assert strain == pytest.approx(widened, rel=0.02)
    assert fracture == pytest.approx(torn, rel=0.05)
    assert work == pytest.approx(torn + widened + contact, rel=0.05)
    # its contact hardly gives way, and the thread lies in the needle that destroys it
    assert not any("give way" in reason or "unresisted" in reason for reason in cut.state.verdict.reasons)


@pytest.mark.parametrize("friction", [0.0, FRICTION])
def test_tip_and_shaft_are_the_whole_tool(friction):
    _, history = needle_twice(friction)
    scale = history["force"].max()
    np.testing.assert_allclose(history["tip_force"] + history["shaft_force"], history["force"], atol=1e-10 * scale)
    work = history["tip_friction_work"] + history["shaft_friction_work"]
    np.testing.assert_allclose(work, history["energy_friction"], atol=1e-10 * history["work_external"].max())
    # nothing but friction holds a shaft
    np.testing.assert_allclose(history["shaft_force"], history["shaft_friction"], atol=1e-10 * scale)


def test_the_parts_of_the_force_are_those_of_the_audit():
    """They add up to it in every window; friction on the shaft grows while cutting becomes steady."""
    _, history = needle_twice(FRICTION)
    parts = force_parts(history, 1.0, 0.2)
    names = ("deformation", "cutting", "tip friction", "shaft friction", "viscosity")
    late = parts["depth"] > 0.9
    np.testing.assert_allclose(sum(parts[n] for n in names)[late], parts["force"][late], rtol=0.01)
    assert np.diff(parts["shaft friction"][late]).min() > 0, "more and more of the shaft is in the body"
    # steady from there on; the body is drawn out by the tool, and more than the way is cut
    last, swept = history["depth"].max() - 0.4, history["front"][: np.argmax(history["depth"]) + 1]
    swept = swept[-1] - np.interp(last, history["depth"][: len(swept)], swept)
    assert 2 * np.pi * THREAD < swept / 0.4 < 1.1 * 2 * np.pi * THREAD
    assert parts["cutting"][-2:].mean() == pytest.approx(TOUGHNESS * swept / 0.4, rel=0.02)
    assert not parts["shaft friction"][parts["depth"] < 0.6].any(), "the shaft begins higher up"
    for rounding in (-1e-15, 1e-15):  # of the last depth, which the second push reaches again
        twice = history | {"depth": np.append(history["depth"][:-1], history["depth"].max() + rounding)}
        np.testing.assert_allclose(force_parts(twice, 1.0, 0.2)["tip friction"], parts["tip friction"], rtol=1e-9)
    _, history = blade_twice(0.0)
    parts = force_parts(history, 1.0, 0.2)
    whole = np.sum([parts[n] for n in names], axis=0)
    # from the first window on: what spreads the halves apart before the push is no part of its force
    np.testing.assert_allclose(whole, parts["force"], atol=0.04 * parts["force"].max())
    with pytest.raises(ValueError, match=r"window = 2\.0 is not allowed"):
        force_parts(history, 1.0, 2.0)


def test_the_shaft_rubs_with_the_pressure_of_the_widened_hole():
    """Depth adds μ × pressure × circumference to the force on the shaft: an estimate, as the body is short."""
    _, history = needle_twice(FRICTION)
    hole = THREAD + history["crack_opening"].max()
    (slope,) = at_the_end(history, "shaft_force")
    assert slope == pytest.approx(FRICTION * widening(hole)[0] * 2 * np.pi * hole, rel=0.2)


@pytest.mark.parametrize("friction", [0.0, FRICTION])
@pytest.mark.parametrize(
    ("twice", "toughness"), [(needle_twice, TOUGHNESS), (blade_twice, 0.2)], ids=["needle", "blade"]
)
def test_two_insertions_differ_by_the_new_surface(twice, toughness, friction):
    cut, history = twice(friction)
    both = TwoInsertions.of(history, cut)
    assert both.toughness == pytest.approx(toughness, rel=0.03)
    assert np.abs(history["energy_closure"]).max() < 0.015
    assert np.diff(history["energy_friction"]).min() >= 0
    assert np.diff(history["cut"]).min() >= -1e-12 * history["cut"].max(), "a cut that closes again is not healed"
    turned = np.interp(cut.time_of(cut.motion.turning_depth), history["time"], history["cut"])
    assert history["cut"][-1] == pytest.approx(turned, rel=0.02) and turned > 0.5 * (
        cut.motion.turning_depth - cut.motion.start_depth
    )
    broken = np.interp(cut.time_of(cut.motion.turning_depth), history["time"], history["energy_fracture"])
    assert history["energy_fracture"][-1] == pytest.approx(broken, rel=0.02), "the second time hardly anything breaks"


def test_friction_of_the_tip_adds_to_the_apparent_toughness():
    """What parts the faces presses on the flanks: (1 + μ/tan α) G_c, if friction is taken to be the same both times."""
    apparent = [TwoInsertions.of(history, cut).apparent for cut, history in map(blade_twice, (0.0, FRICTION))]
    assert apparent[0] == pytest.approx(0.2, rel=0.03)
    assert apparent[1] / apparent[0] == pytest.approx(1 + FRICTION / np.tan(np.radians(20)), rel=0.15)


def test_a_planar_crack_keeps_its_books():
    cut, history = in_space()
    pushed = history["depth"] > cut.motion.start_depth
    assert audited_toughness(history, 1.2, 1.8, cut.symmetry_factor) == pytest.approx(0.15, rel=0.05)
    sides = history["needle_right_force_x"] + history["needle_left_force_x"]
    assert np.abs(sides).max() < 1e-4 * history["force"].max()
    assert np.abs(history["energy_closure"][pushed]).max() < 0.01
    assert history["imbalance"][pushed].max() < 1e-6


@pytest.mark.parametrize("turn", [None, 1.0])
def test_the_tool_is_where_it_should_be(turn):
    cut = thread(turn=turn, lc=0.15, H=3.0)
    path = cut.contacts[0].path.position
    assert path(0.0)[1] == 0 and path(cut.motion.entry_time)[1] == pytest.approx(-cut.motion.start_depth)
    assert path(cut.time_of(0.9))[1] == pytest.approx(-0.9)
    with pytest.raises(ValueError, match=r"depth = 0\.1 is not allowed"):
        cut.time_of(0.1)
    if turn is None:
        with pytest.raises(ValueError, match=r"push = 2 is not allowed"):
            cut.time_of(0.9, 2)
    else:
        assert path(cut.time_of(1.4, 2))[1] == pytest.approx(-1.4)
        with pytest.raises(ValueError, match=r"depth = 1\.4 is not allowed"):
            cut.time_of(1.4)


def test_groups_of_the_meshes_have_their_areas():
    cut, whole = thread(lc=0.2), planar(lc=0.45)
    areas = [c.points.integral(np.ones_like(c.points.weights)) for c in (*cut.body.cracks, *whole.body.cracks)]
    assert areas[0] == pytest.approx(2 * np.pi * THREAD * (ROUND["H"] - ROUND["notch"]))
    assert areas[1] == pytest.approx(BLOCK["H"] * BLOCK["B"] - BLOCK["notch"] * BLOCK["slit"])
    mouth = cut.contacts[0].patches[2].surface.points
    cone = np.pi * (2 * THREAD + 0.1) * np.hypot(0.1, ROUND["notch"])
    assert mouth.integral(np.ones_like(mouth.weights)) == pytest.approx(cone)
    for name, sizes, wrong in (("thread", ROUND, "notch"), ("thread", ROUND, "r0"), ("needle", BLOCK, "slit")):
        with pytest.raises(ValueError, match=f"{wrong} = 9"):
            read_geo(MESHES / f"{name}.geo", MPI.COMM_WORLD, sizes | {wrong: 9.0}, gdim=2)


def test_halves_start_beside_the_plane_of_symmetry():
    for half, side in zip(split().contacts, (1, -1), strict=True):
        start = half.path.position(0.0)
        assert side * start[0] < 0 and start[1] == pytest.approx(-0.4)
        assert half.shape.side == side


def test_a_rejected_step_leaves_the_books_as_they_were():
    cut = thread(friction=FRICTION, lc=0.15, H=3.0, deep=2.0)
    run(cut.mechanics, cut.time_of(0.6), StepControl.fixed(0.1))

    parts = cut.parts

    def books():
        return [quantity(part) for part in PARTS for quantity in (parts.force, parts.friction, parts.friction_work)]

    before = books()
    assert min(before[:3]) > 0 and parts.friction("tip") < parts.force("tip")
    begin(cut.mechanics, cut.time_of(0.7))
    assert cut.mechanics.solve().converged
    cut.mechanics.evaluate()
    assert np.all(np.array(books()[:3]) > before[:3])
    cut.mechanics.state.rollback()
    assert books() == before


@pytest.mark.mpi
@pytest.mark.parametrize("build", [thread, planar], ids=["thread", "planar"])
def test_every_number_of_ranks_gives_the_same_history(build):
    flat = build is thread
    coarse = {"lc": 0.15, "H": 2.5, "deep": 1.5} if flat else {"lc": 0.45, "H": 2.5, "deep": 1.6, "growth": 3.0}
    options = {"friction": FRICTION} if flat else {}
    runs = [build(comm, **options, **coarse) for comm in (MPI.COMM_WORLD, MPI.COMM_SELF)]
    together, alone = (drive(cut, cut.time_of(1.0), StepControl.fixed(0.1 if flat else 0.2)) for cut in runs)
    for name in (
        "force",
        "tip_force",
        "shaft_force",
        "tip_friction_work",
        "cut",
        "front",
        "energy_strain",
        "work_external",
    ):
        scale = max(np.abs(alone[name]).max(), 1e-6)
        assert np.abs(together[name] - alone[name]).max() <= 1e-7 * scale, name


def test_a_tool_rests_before_it_turns():
    drive = Drive(2.0, entry_time=1.0, turning_depth=1.4, dwell=0.5)
    motion = Motion.of(drive, Needle(0.5, 0.15, RADIUS), 0.5, 5.0)  # the push begins at 0.4
    np.testing.assert_allclose(motion.corners, [1.0, 1.5, 2.0, 2.5])
    times = [1.0, 1.25, 1.5, 1.75, 2.0, 2.25, 2.5, 3.0, 3.5]
    np.testing.assert_allclose([motion.depth(t) for t in times], [0.4, 0.9, 1.4, 1.4, 1.4, 0.9, 0.4, 1.4, 2.4])
    assert motion.time_of(2.4, 2) == pytest.approx(3.5)
    with pytest.raises(ValueError, match=r"dwell = 0\.5 is not allowed"):
        Drive(2.0, dwell=0.5)


def test_parameters_are_refused_by_name():
    domain = read_geo(MESHES / "thread.geo", MPI.COMM_WORLD, ROUND | {"lc": 0.25}, gdim=2)
    law, needle, drive = Exponential(strength=0.6, toughness=0.2), Needle(0.5, 0.15, RADIUS), Drive(1.0)
    body = cracked_block(domain, NeoHookean(YOUNG, POISSON), law, axisymmetric=True)
    for wrong in ({"notch": 0.1}, {"notch": 0.5, "friction": -0.1}):
        with pytest.raises(ValueError, match="{} = {}".format(*list(wrong.items())[-1])):
            Insertion.build(body, needle, drive, **wrong)
    for wrong in ({"speed": 0.0}, {"entry_time": 0.0}, {"turning_depth": 0.3}):
        with pytest.raises(ValueError, match="{} = {}".format(*next(iter(wrong.items())))):
            Insertion.build(body, needle, Drive(**{"speed": 1.0} | wrong), notch=0.5)
    for wrong_tool, name in (
        (Needle(0.5, 0.15, RADIUS, (1.0, 0.0)), "tool.push"),
        (Needle(0.5, 0.15, RADIUS, (0.0, 1.0)), "tool.push"),
        (Needle(0.5, 0.15, RADIUS, lateral=(1.0, 0.0), side=1), "tool.side"),
        # a ring, whose crack would have to be a cylinder; that of a thread is a cone
        (Blade(0.5, 0.1, 0.5), r"tool.lateral = .* must be normal to the crack"),
    ):
        with pytest.raises(ValueError, match=name):
            Insertion.build(body, wrong_tool, drive, notch=0.5)
    with pytest.raises(ValueError, match="turning_depth = None is not allowed"):
        TwoInsertions.of({}, thread(lc=0.25))
    cut, history = blade_twice(0.0)
    half = {name: column[:-5] for name, column in history.items()}
    with pytest.raises(ValueError, match=r"time = .* when the second push ends"):
        TwoInsertions.of(half, cut)
