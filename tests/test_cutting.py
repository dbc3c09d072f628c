"""The blade cut: steady force against toughness, friction's share, balance with the support, rank independence."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from ffcx.codegeneration import jit
from mpi4py import MPI
from ufl import SpatialCoordinate

from cutsim import Blade, Drive, Exponential, Insertion, NeoHookean, StepControl, cracked_block, read_geo, run
from cutsim.interface.cohesive import separation_curve
from cutsim.studies.insertion_work import SteadyCut, TwoInsertions, audited_toughness, steady_force

MESH = Path(__file__).parents[1] / "meshes" / "block.geo"
TOUGHNESS = 0.1


def build(comm=MPI.COMM_WORLD, *, friction=0.0, viscosity=0.002, young=0.777, toughness=0.2, **parameters):
    block = {"dim": 2, "Lx": 4.0, "H": 13.0, "lc": 0.05, "band": 0.3, "growth": 1.4, "notch": 0.5} | parameters
    law = Exponential(strength=0.6, toughness=toughness)
    blade = Blade(np.radians(12), block["lc"], 0.855)
    domain = read_geo(MESH, comm, block, gdim=2)
    body = cracked_block(domain, NeoHookean(young, 0.45), law, viscosity=viscosity)
    return Insertion.build(body, blade, Drive(1.0, 1.0), notch=0.5, friction=friction)


def push(cut, depth, control, number=1):
    rows = []

    def record(report):
        rows.append({"time": (report.time, "time")} | report.columns | cut.columns(report.columns))

    run(cut.mechanics, cut.time_of(depth, number), control, record)
    return {name: np.array([row[name][0] for row in rows]) for name in rows[0]}


def strip(size, dim=2, until=3.6, friction=0.0, turn=None):
    """Split a strip on a smooth plate, its sides free, with hardly any viscosity: problem and history.

    With a turn, draw the blade back from there and push it once more.
    """
    sizes = {"dim": dim, "Lx": 1.0, "H": 6.0, "lc": size, "band": 0.3, "growth": 1.6, "notch": 0.5}
    sizes |= {"B": WIDTH, "sym": 1, "nz": 1} if dim == 3 else {}
    forward, lateral = (0.0, -1.0, 0.0)[:dim], (1.0, 0.0, 0.0)[:dim]
    blade = Blade(np.radians(20), max(0.1, size), 0.5, forward, lateral)
    law = Exponential(strength=0.3, toughness=TOUGHNESS)
    domain, silicone = read_geo(MESH, MPI.COMM_WORLD, sizes, gdim=dim), NeoHookean(0.777, 0.45)
    body = cracked_block(domain, silicone, law, viscosity=2e-4)
    cut = Insertion.build(body, blade, Drive(1.0, 1.0, turn), notch=0.5, friction=friction)
    rows = push(cut, turn or until, StepControl(first=0.02, largest=0.05))
    if turn is not None:
        again = push(cut, turn, StepControl(first=0.05, largest=0.2), 2)
        rows = {name: np.append(column, again[name]) for name, column in rows.items()}
    return cut, rows


steady = cache(strip)
WIDTH = 1.0  # of the strip in space, where its sides are free to contract
STIFFNESS = {2: 2 * 0.777 / (1 - 0.45**2), 3: 2 * 0.777}


@pytest.mark.parametrize(("size", "dim", "tolerance"), [(0.2, 2, 0.015), (0.1, 2, 0.005), (0.2, 3, 0.015)])
def test_force_and_front_of_a_steady_cut_are_those_of_the_toughness(size, dim, tolerance):
    """What the law's books say does not enter: mean force, area swept by the front, force × way over that area."""
    _, history = steady(size, dim)
    stretch, stiffness = SteadyCut.of(history, 2.0, 3.6), STIFFNESS[dim]
    expected, jumps = steady_force(TOUGHNESS, WIDTH, stiffness), 0.25 * size / 1.6  # the front goes from node to node
    assert stretch.force == pytest.approx(expected, rel=tolerance)
    assert abs(stretch.drift) < tolerance
    assert stretch.swept == pytest.approx(stretch.way * (1 + expected / stiffness), rel=jumps)
    assert stretch.toughness(stiffness) == pytest.approx(TOUGHNESS, rel=jumps)


def test_two_insertions_differ_by_the_new_surface():
    """By the force alone: the work of the second is missing G_c × width × depth, between two depths of steady cut."""
    area = 10 * 0.1 * WIDTH  # ten elements, so that the front stands between two nodes in the same way both times
    deeper = 2.0 + area / (1 + steady_force(TOUGHNESS, WIDTH, STIFFNESS[2]) / STIFFNESS[2])
    both = [TwoInsertions.of(history, cut) for cut, history in (strip(0.1, turn=depth) for depth in (2.0, deeper))]
    added = both[1].beyond(both[0])
    assert (added.first - added.second) / area == pytest.approx(TOUGHNESS, rel=0.01)
    assert added.area == pytest.approx(area, rel=0.01)
    assert added.apparent == pytest.approx(TOUGHNESS, rel=0.01)


def test_the_compressed_block_counts():
    """Half a strip is twice as compressed: more of it is cut per way, and the closed form of the force knows it."""
    assert steady_force(0.2, 3.0) == pytest.approx(0.6)
    force = steady_force(0.2, 1.0, 4.0)
    assert force * (1 + force / 8) == pytest.approx(0.2 * (1 + force / 4))
    _, history = steady(0.1, 2)
    stretch = SteadyCut.of(history, 2.0, 3.6)
    assert stretch.swept / stretch.way - 1 == pytest.approx(stretch.force / STIFFNESS[2], rel=0.1)
    for depths in ((3.6, 2.0), (2.0, 9.0)):
        with pytest.raises(ValueError, match="depths = "):
            SteadyCut.of(history, *depths)
    with pytest.raises(ValueError, match="such that the front moves"):
        SteadyCut.of(history | {"front": 0 * history["front"]}, 2.0, 3.6)


def test_the_books_give_back_what_was_put_in():
    """Of any stretch, steady or not: a check of the audit, not of the cut."""
    cut, history = steady(0.1, 2)
    for start, end in ((1.0, 1.5), (2.0, 3.6)):
        assert audited_toughness(history, start, end, cut.symmetry_factor) == pytest.approx(TOUGHNESS, rel=0.01)
    with pytest.raises(ValueError, match=r"depths = .* such that the cut grows"):
        audited_toughness(history, 3.0, 3.0, cut.symmetry_factor)


def test_the_front_is_placed_within_the_facets():
    """The area where a linear function is above a level, in the plane and on rectangles in space, and of a jump."""
    for dim in (2, 3):
        points = steady(0.2, dim)[0].body.cracks[0].points
        y = points.evaluator({"y": SpatialCoordinate(steady(0.2, dim)[0].state.mesh)[1]})()["y"]
        for level in np.linspace(-4.0, -2.0, 7):
            assert points.area_above(y, level) == pytest.approx((-0.5 - level) * (1.0 if dim == 2 else 0.5), abs=0.01)
        assert points.area_above(np.sign(y + 2.1), 0.0) == pytest.approx(1.6 * (1.0 if dim == 2 else 0.5), abs=0.15)


def test_every_row_balances():
    _, history = steady(0.1, 2)
    assert np.abs(history["energy_closure"]).max() < 0.01
    assert history["imbalance"].max() < 1e-6
    assert np.abs(history["blade_right_force_x"] + history["blade_left_force_x"]).max() < 1e-3 * history["force"].max()


def test_dissipation_never_decreases():
    _, history = steady(0.1, 2)
    for name in ("fracture", "viscous"):
        assert np.diff(history[f"energy_{name}"]).min() > -1e-9 * history["work_external"].max()


def test_friction_raises_the_force_by_its_own_work():
    _, smooth = steady(0.1, 2)
    _, rough = strip(0.1, until=2.2, friction=0.1)
    assert np.abs(rough["energy_closure"]).max() < 0.01
    assert np.diff(rough["energy_friction"]).min() > -1e-12
    work, without = (np.interp(2.2, rows["depth"], rows["work_external"]) for rows in (rough, smooth))
    # the force of friction also presses the flanks harder: most of the extra work, not all of it, is friction
    assert 0.6 * (work - without) < rough["energy_friction"][-1] < work - without


@pytest.mark.mpi
def test_every_number_of_ranks_gives_the_same_history():
    coarse = {"lc": 0.1, "H": 3.0, "Lx": 3.0}
    together = push(build(friction=0.1, **coarse), 0.7, StepControl.fixed(0.1))
    alone = push(build(MPI.COMM_SELF, friction=0.1, **coarse), 0.7, StepControl.fixed(0.1))
    for name in ("force", "crack_opening", "cut", "front", "energy_strain", "energy_friction", "work_external"):
        scale = np.abs(alone[name]).max()
        assert np.abs(together[name] - alone[name]).max() <= 1e-7 * scale, name


def test_separation_of_the_exponential_law_is_its_closed_form():
    law = Exponential(strength=0.6, toughness=0.8)
    opening, fraction = separation_curve(law)
    x = opening / law.opening
    np.testing.assert_allclose(fraction, 1 - (1 + x) * np.exp(-x), atol=1e-4)
    assert fraction[-1] == pytest.approx(1.0, abs=1e-6)


def test_a_second_problem_compiles_nothing_whatever_its_parameters(monkeypatch):
    size = {"lc": 0.25, "H": 3.0, "Lx": 3.0}
    build(**size)
    compiled = []
    compile_objects = jit._compile_objects
    monkeypatch.setattr(jit, "_compile_objects", lambda *a, **k: compiled.append(a) or compile_objects(*a, **k))
    build(**size, viscosity=0.005, young=0.5, toughness=0.3)
    assert not compiled


def test_parameters_are_refused_by_name():
    law = Exponential(strength=0.6, toughness=0.2)
    domain = read_geo(MESH, MPI.COMM_WORLD, {"dim": 2, "lc": 0.5}, gdim=2)
    blade = Blade(0.2, 0.05, 0.855)
    body = cracked_block(domain, NeoHookean(0.777, 0.45), law)
    for wrong in ({"notch": 0.01}, {"notch": 0.5, "friction": -0.1}):
        with pytest.raises(ValueError, match=f"{list(wrong)[-1]} = "):
            Insertion.build(body, blade, Drive(1.0), **wrong)
    cut = build(lc=0.25, H=3.0)
    with pytest.raises(ValueError, match=r"depth = 0\.1"):
        cut.time_of(0.1)


@pytest.mark.parametrize(
    ("block", "tool", "options", "message"),
    [
        ({}, {}, {"notch": 1.5}, r"notch = 1.5 .* 0.5, the depth of the notch in the mesh"),
        ({}, {"half_angle": 1.5}, {}, r"tool.half_angle = 1.5 .* in radians"),
        ({"H": 2.0}, {}, {"depth": 2.5}, r"depth = 2.5 .*the height of the body = 2"),
        ({}, {"push": (0.0, -1.0, 0.0), "lateral": (1.0, 0.0, 0.0)}, {}, r"tool.push = .* of 2 components"),
    ],
    ids=["another notch", "degrees", "deeper than the block", "of another dimension"],
)
def test_what_does_not_fit_is_refused(block, tool, options, message):
    block = {"dim": 2, "Lx": 2.0, "H": 3.0, "lc": 0.1, "band": 0.3, "growth": 1.4, "notch": 0.5} | block
    tool = Blade(**{"half_angle": 0.2, "tip_radius": 0.1, "half_thickness": 0.3} | tool)
    law = Exponential(strength=0.6, toughness=TOUGHNESS)
    domain = read_geo(MESH, MPI.COMM_SELF, block, gdim=2)
    with pytest.raises(ValueError, match=message):
        body = cracked_block(domain, NeoHookean(0.8, 0.45), law)
        cut = Insertion.build(body, tool, Drive(1.0), notch=options.get("notch", 0.5))
        cut.time_of(options.get("depth", 1.0))


UNITS = {"mm and MPa": (1.0, 1.0), "SI": (1e-3, 1e6), "µm and MPa": (1e3, 1.0)}


@cache
def cut_in(units):
    """Depth and force of a viscous cut with a turn, both in mm and N/mm, in other units of length and stress."""
    length, stress = UNITS[units]
    scales = {"Lx": length, "H": length, "lc": length, "band": length, "notch": length}
    block = {"dim": 2, "Lx": 2, "H": 3, "lc": 0.1, "band": 0.3, "growth": 1.4, "notch": 0.5}
    scaled = {name: value * scales.get(name, 1) for name, value in block.items()}
    domain = read_geo(MESH, MPI.COMM_SELF, scaled, gdim=2)
    law = Exponential(strength=0.6 * stress, toughness=0.2 * stress * length)
    body = cracked_block(domain, NeoHookean(0.777 * stress, 0.45), law, viscosity=2e-3 * stress)
    tool, drive = Blade(0.2, 0.1 * length, 0.3 * length), Drive(speed=2.0 * length, turning_depth=0.6 * length)
    cut = Insertion.build(body, tool, drive, notch=0.5 * length)
    assert cut.motion.entry_time == pytest.approx(0.2)
    rows = push(cut, 0.5 * length, StepControl(0.025, 0.025), 2)
    return rows["time"], rows["depth"] / length, rows["force"] / (stress * length)


@pytest.mark.parametrize("units", ["SI", "µm and MPa"])
def test_a_cut_is_the_same_in_all_units(units):
    """One value changes for each quantity, time none: nothing has a size of its own."""
    for found, expected in zip(cut_in(units), cut_in("mm and MPa"), strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
    assert cut_in("mm and MPa")[1][-1] == pytest.approx(0.5)
