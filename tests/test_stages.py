"""Stages show the body as it is, are spread over the run, and do not depend on ranks or on how a run ends."""

import numpy as np
import pytest
from mpi4py import MPI

from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.stepping import StepControl, StepError, run
from cutsim.base.rotations import rotation_matrix
from cutsim.fields.points import Surface
from cutsim.interface.contact import PenaltyContact
from cutsim.results.animation import animate, draw_stages
from cutsim.results.pictures import polydata
from cutsim.results.scene import sharp_edges
from cutsim.results.stage_recorder import Stages
from cutsim.results.stages import Skin, Stage, read_stages, spread
from cutsim.results.tool_surfaces import Pose, ToolSurfaces, _pointed
from cutsim.tools.pointed import Blade, Needle
from cutsim.tools.shapes import Ball, ToolPath
from cutsim.tools.tool_contact import ToolContact
from helpers.blocks import make_blocks
from helpers.stages import skin, stage


def torn(comm=MPI.COMM_WORLD):
    """Two blocks whose upper one is moved up by the time, and a ball above them that stays."""
    b = make_blocks(comm=comm)
    surface = Surface.exterior(b.state, b.face(1, 1.0))
    path = ToolPath.polyline([0.0], [(0.5, 2.6)])
    ball = ToolContact(b.state, Ball(0.5), path, [surface], contact=PenaltyContact(1.0))
    drives = [*b.drive(b.lower, (0, 0)), *b.drive(b.upper, (0, lambda t: t))]
    return Mechanics(b.state, [b.solid(), b.crack(), ball], drives)


def rows(points):
    """Points in an order that does not depend on the partition."""
    points = np.round(points, 5) + 0.0
    return points[np.lexsort(points.T)]


@pytest.mark.mpi
def test_stages_are_the_same_on_any_number_of_ranks(folder):
    """A run that fails between two stages still leaves the last state; one that goes on finds its place."""
    problem = torn()

    def fail(report):
        if report.time > 0.6:
            raise StepError("as it were")

    with pytest.raises(StepError), Stages(folder, problem, 1.0, number=4) as stages:
        run(problem, 1.0, StepControl.fixed(0.1), lambda report: (stages(report), fail(report)))
    MPI.COMM_WORLD.barrier()
    found = read_stages(folder)
    assert [s.time for s in found] == pytest.approx([0.0, 0.3, 0.5, 0.7])
    with Stages(folder, problem, 1.0, number=4) as stages:
        run(problem, 1.0, StepControl.fixed(0.1), stages)
    MPI.COMM_WORLD.barrier()
    found = read_stages(folder)
    assert [s.time for s in found] == pytest.approx([0.0, 0.3, 0.5, 0.7, 0.8, 1.0])
    alone = torn(MPI.COMM_SELF)
    with Stages(folder / f"alone {MPI.COMM_WORLD.rank}", alone, 1.0, number=1) as stages:
        run(alone, 1.0, StepControl.fixed(0.5), stages)
    (last,) = [s for s in read_stages(folder / f"alone {MPI.COMM_WORLD.rank}") if s.time == 1.0]
    for part in ("body", "cracks", "tools"):
        one, several = getattr(last, part), getattr(found[-1], part)
        np.testing.assert_array_equal(rows(one.deformed), rows(several.deformed))
        assert one.cells.shape == several.cells.shape
    assert found[-1].parts == ("body",) and found[-1].flat


def area(part):
    """Area of triangles."""
    a, b, c = np.moveaxis(part.deformed[part.cells], 1, 0)
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()


def test_stage_shows_body_crack_and_tool_in_their_places(tmp_path):
    problem = torn(MPI.COMM_SELF)
    with Stages(tmp_path, problem, 1.0, number=1) as stages:
        run(problem, 1.0, StepControl.fixed(0.5), stages)
    last = Stage.read(tmp_path / "stages" / "001.npz")
    assert area(last.body) == pytest.approx(1.0) and np.ptp(last.body.deformed, axis=0)[1] == pytest.approx(2.0)
    heights = last.cracks.deformed[last.cracks.cells].mean(axis=1)[:, 1]
    assert sorted(np.round(heights, 1)) == [0.5, 0.5, 1.5, 1.5] and last.cracks.values["damage"].min() > 0.99
    # the ball reaches out of the box that is drawn, which ends 0.3 above the body
    below = 0.25 * np.arccos(1 - 0.2 / 0.5) - 0.3 * np.sqrt(0.25 - 0.09)
    assert area(last.tools) == pytest.approx(below, rel=0.01)
    (tmp_path / "stages" / "002.npz").write_bytes(b"half a file")
    assert [s.time for s in read_stages(tmp_path)] == [0.0, 1.0]
    with pytest.raises(ValueError, match=r"002\.npz is not a stage"):
        Stage.read(tmp_path / "stages" / "002.npz")
    with pytest.raises(ValueError, match="mirror = 'w'"):
        Stages(tmp_path, problem, 1.0, mirror=("w",))
    assert Stages(tmp_path, torn(MPI.COMM_SELF), 1.0)._scene.shown  # a new run leaves no stage of the older one
    assert [s.time for s in read_stages(tmp_path)] == [0.0]


def test_halves_of_a_blade_are_one_where_they_are_together():
    b = make_blocks(comm=MPI.COMM_SELF)
    surface, halves = Surface.exterior(b.state, b.face(1, 1.0)), []
    for side in (1, -1):
        path = ToolPath.polyline([0.0, 1.0], [(0.5 + 0.1 * side, 0.8), (0.5, 0.8)])
        blade = Blade(0.3, 0.05, half_thickness=0.15, side=side)
        halves.append(ToolContact(b.state, blade, path, [surface], contact=PenaltyContact(1.0), name=f"half {side}"))
    surfaces, bounds = ToolSurfaces(halves), (0, 1, 0, 1, 0, 0)
    assert surfaces(bounds).bounds == pytest.approx((0.25, 0.75, 0.8, 1.3, 0, 0))
    b.state.begin(1.0)
    for half in halves:
        half.begin()
    assert surfaces(bounds).bounds == pytest.approx((0.35, 0.65, 0.8, 1.3, 0, 0))


@pytest.mark.parametrize("side", [-1, 0, 1])
def test_tools_in_space_reach_beyond_the_body(side):
    options = {"push": (0.0, 0.0, -1.0), "lateral": (1.0, 0.0, 0.0), "side": side}
    box, tip = np.array([(0.0, 0.0, 0.0), (1.0, 1.0, 1.0)]), Pose(np.array([0.5, 0.5, 0.8]), np.eye(3))
    ends = 0.5 + 0.15 * np.array([min(side, 0) - (not side), max(side, 0) + (not side)])
    blade = _pointed(Blade(0.3, 0.05, half_thickness=0.15, **options), tip, box)
    assert blade.bounds == pytest.approx((*ends, -0.05, 1.05, 0.8, 1.3)) and blade.n_open_edges == 0
    needle = _pointed(Needle(0.3, 0.05, radius=0.15, **options), tip, box)
    assert needle.bounds == pytest.approx((*ends, 0.35, 0.65, 0.8, 1.3), abs=1e-3)
    lying = Pose(tip.position, rotation_matrix((0.0, np.pi / 2, 0.0)))  # the tip points to −x
    blade = _pointed(Blade(0.3, 0.05, half_thickness=0.15, **options), lying, box)
    ends = 0.8 + 0.15 * np.array([min(-side, 0) - (not side), max(-side, 0) + (not side)])
    assert blade.bounds == pytest.approx((0.5, 1.3, -0.05, 1.05, *ends))


def test_image_of_a_part_has_no_seam():
    part = skin([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 1)], [(0, 1, 2), (0, 2, 3)], stress=[0, 1, 2, 3], part=[5, 6])
    whole = part.mirrored("x")
    assert len(whole.points) == 6 and whole.cells.tolist()[2:] == [[5, 4, 0], [3, 5, 0]]
    assert whole.values["stress"].tolist() == [0, 1, 2, 3, 1, 2] and whole.values["part"].tolist() == [5, 6, 5, 6]
    inside = skin([(0, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 0)], [(0, 1, 2), (0, 1, 3)], part=[1, 2]).mirrored("x")
    assert inside.values["part"].tolist() == [2, 2]  # a triangle in the plane is within the whole
    assert len(Skin.joined([part, whole]).cells) == 6 and not len(Skin.joined([]).cells)


def test_edges_are_those_of_the_body_and_not_of_its_cells():
    """Also where the triangles of a plane body are turned either way."""
    square = skin([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2), (0, 3, 2)])
    assert sharp_edges(polydata(square)).n_cells == 4


def test_stages_are_drawn_and_animated(tmp_path):
    assert draw_stages(tmp_path) == [] == animate(tmp_path)
    for i, time in enumerate((0.0, 0.4, 0.5, 1.0)):
        stage(time, flat=False, mirror=("z",)).write(tmp_path / "stages" / f"{i}.npz")
    stages = read_stages(tmp_path)
    assert [s.time for s in spread(stages, 2)] == [0.5, 1.0] and spread([], 2) == []
    assert [path.name for path in draw_stages(tmp_path, 2)] == ["00.png", "01.png"]
    films = animate(tmp_path)
    assert [path.name for path in films] == ["animation.gif", "animation.mp4"]
    import imageio.v3 as imageio

    for film in films:
        frames = imageio.imread(film)
        assert frames.shape == (len(stages) + 8 if film.suffix == ".mp4" else len(frames), 550, 880, 3)
        assert np.abs(frames[0].astype(int) - frames[-1]).max() > 100
