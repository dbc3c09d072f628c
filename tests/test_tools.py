"""Signed distances of tools against distances to points sampled on their outlines, and paths."""

from itertools import pairwise

import numpy as np
import pytest
import ufl
from scipy.optimize import minimize

from cutsim.base.rotations import rotation_matrix
from cutsim.tools.needle_tips import BevelNeedle, HollowNeedle
from cutsim.tools.pointed import Blade, Needle
from cutsim.tools.shapes import Ball, FlatPunch, Plane, ToolPath
from helpers.blocks import make_blocks
from helpers.examples import TOOLS
from helpers.tools import FRICTION, touch, values

HALF, R, SHANK = 0.4, 0.3, 0.9  # half angle, tip radius, half thickness of the blade
BLADE = Blade(HALF, R, SHANK)


@pytest.mark.parametrize("dim", [2, 3])
def test_another_blade_needs_no_other_kernel(dim):
    """Angle, radius, thickness and half are given to kernels, and both faces of a crack have one."""

    def signature(sign, half_angle, side):
        b = make_blocks(dim)
        push, lateral = np.eye(dim)[0], np.eye(dim)[1]
        blade = Blade(half_angle, half_angle / 4, half_angle, tuple(push), tuple(lateral), side=side)
        tool = touch(b, blade, [0.5] * dim, [b.crack(None).surface(sign)], FRICTION)
        return tool.residual(ufl.TestFunction(b.state.V)).signature()

    assert signature("+", 0.2, -1) == signature("-", 0.4, 1)


def dense(corners, n=4000):
    """Points on a polygonal chain."""
    return np.concatenate([np.linspace(a, b, n) for a, b in pairwise(np.asarray(corners, dtype=float))])


def arc(centre, radius, start, end, n=4000):
    t = np.linspace(start, end, n)
    return np.asarray(centre) + radius * np.stack([np.cos(t), np.sin(t)], axis=1)


def right_outline(half=HALF):
    """Right half of the blade's outline, foremost point at the origin, cutting downwards."""
    centre, joint = np.array([0, R]), np.array([SHANK - R, R + (SHANK - R) / np.tan(half)])
    normal = R * np.array([np.cos(half), -np.sin(half)])
    return np.concatenate(
        [
            arc(centre, R, -np.pi / 2, -half),
            dense([centre + normal, joint + normal]),
            arc(joint, R, -half, 0),
            dense([joint + np.array([R, 0]), joint + np.array([R, 20])]),
        ]
    )


def blade_outlines():
    right = right_outline()
    left = (right * [-1, 1])[::-1]
    beyond = dense([(-20, 0), (0, 0)])  # a half blade goes on without end on the other side
    return {
        0: np.concatenate([left, right]),
        1: np.concatenate([beyond, right]),
        -1: np.concatenate([left, -beyond[::-1]]),
    }


def ground_outline():
    """A blade that is ground on its right only."""
    left = np.concatenate([arc((0, R), R, -np.pi / 2, -np.pi), dense([(-R, R), (-R, 20)])])
    return np.concatenate([left[::-1], right_outline()])


def tube_outline():
    """Section of a tube with a rounded end; what is left of the axis is the other wall."""
    wall = [arc((0.5, 0.2), 0.2, -np.pi, -np.pi / 2), dense([(0.5, 0), (0.8, 0)]), arc((0.8, 0.2), 0.2, -np.pi / 2, 0)]
    return np.concatenate([dense([(0.3, 20), (0.3, 0.2)]), *wall, dense([(1.0, 0.2), (1.0, 20)])])


def punch_outline():
    right = [dense([(0, 0), (0.5, 0)]), arc((0.5, 0.2), 0.2, -np.pi / 2, 0), dense([(0.7, 0.2), (0.7, 20)])]
    right = np.concatenate(right)
    return np.concatenate([(right * [-1, 1])[::-1], right])


OUTLINES = {
    "blade": (BLADE, blade_outlines()[0], (0.0, 2.0)),
    "right half": (Blade(HALF, R, SHANK, side=1), blade_outlines()[1], (0.0, 2.0)),
    "left half": (Blade(HALF, R, SHANK, side=-1), blade_outlines()[-1], (0.0, 2.0)),
    "ground on one side": (Blade(HALF, R, SHANK, back_angle=0.0), ground_outline(), (0.0, 2.0)),
    "asymmetric": (
        Blade(HALF, R, SHANK, back_angle=0.7),
        np.concatenate([(right_outline(0.7) * [-1, 1])[::-1], right_outline()]),
        (0.0, 2.0),
    ),
    "tube": (HollowNeedle(1.0, 0.3, 0.2), tube_outline(), (0.6, 2.0)),
    "needle": (Needle(HALF, R, SHANK), blade_outlines()[0], (0.0, 2.0)),
    "cylinder": (Ball(0.8), arc((0, 0), 0.8, 0, 2 * np.pi), (0.0, 0.0)),
    "punch": (FlatPunch(0.7, 0.2), punch_outline(), (0.0, 2.0)),
}
each = pytest.mark.parametrize("name", OUTLINES)


def distance_to_chain(chain, p):
    """Distance of a point to a chain of segments."""
    a, d = chain[:-1], np.diff(chain, axis=0)
    t = np.clip(((p - a) * d).sum(axis=1) / np.maximum((d**2).sum(axis=1), 1e-300), 0, 1)
    return np.linalg.norm(a + t[:, None] * d - p, axis=1).min()


def near(outline, seed=0, n=60):
    """Points up to 0.25 from the outline on either side, clear of its ends."""
    rng = np.random.default_rng(seed)
    on = outline[(np.abs(outline) < 4).all(axis=1)]
    return on[rng.integers(len(on), size=n)] + rng.uniform(-0.25, 0.25, (n, 2)) / np.sqrt(2)


@each
def test_distance_is_that_to_the_nearest_point_of_the_surface(name):
    shape, outline, inside = OUTLINES[name]
    points = near(outline)
    brute = [distance_to_chain(outline, p) for p in points]
    distance, gradient = values(shape, points)
    # inside, the distance is exact where a contact may come: less than the smallest radius deep
    np.testing.assert_allclose(np.abs(distance), brute, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(gradient, axis=1), 1, atol=1e-10)
    assert values(shape, [inside])[0] < 0
    assert (distance < 0).any() and (distance > 0).any()


@each
def test_distance_and_gradient_are_continuous(name):
    """Across the borders of tip, flank, joint and shank: nowhere a jump on a fine walk along the surface."""
    shape, outline, _ = OUTLINES[name]
    walk = outline[(np.abs(outline) < 3).all(axis=1)]
    for shift in (0.0, 0.05):
        points = walk[::100] + np.array([0, shift])
        distance, gradient = values(shape, points)
        step = np.linalg.norm(np.diff(points, axis=0), axis=1)
        together = step < 0.5
        assert (np.abs(np.diff(distance)) <= step + 1e-9)[together].all()
        turn = np.linalg.norm(np.diff(gradient, axis=0), axis=1)
        assert (turn <= step / (0.2 * 0.5) + 1e-6)[together].all()


@pytest.mark.parametrize("name", TOOLS)
def test_distance_leads_to_the_surface(name):
    """A point moved back by its distance along the gradient lies on the surface, no more curved than it says."""
    shape, place = TOOLS[name]
    rng, axes = np.random.default_rng(2), len(place)
    body = rng.uniform([0] * (axes - 1) + [0.6], 1, (80, axes))
    distance, gradient = values(shape, body - place)
    assert (distance < 0).any() and (distance > 0).any(), "the tool dips into the body from above"
    assert (values(shape, body[:5] * ([1] * (axes - 1) + [0]) - place)[0] > 0).all(), "and does not reach its base"
    near = distance > -0.5 * shape.resolution
    points, distance, gradient = (body - place)[near], distance[near], gradient[near]
    np.testing.assert_allclose(np.linalg.norm(gradient, axis=1), 1, atol=1e-10)
    level, normal = values(shape, points - distance[:, None] * gradient)
    np.testing.assert_allclose(level, 0, atol=1e-6)
    np.testing.assert_allclose(normal, gradient, atol=1e-5)
    step = 1e-3 * rng.uniform(-1, 1, points.shape)
    beside, turned = values(shape, points + step)
    size = np.linalg.norm(step, axis=1)
    assert (np.abs(beside - distance) <= size + 1e-9).all()
    assert (np.linalg.norm(turned - gradient, axis=1) <= 2.1 * size / shape.resolution + 1e-6).all()


@pytest.mark.parametrize(
    ("shape", "exact"),
    [
        (Ball(0.8), lambda x: np.linalg.norm(x) - 0.8),
        (Ball(0.8, (0, 2.0, 0)), lambda x: np.hypot(x[0], x[2]) - 0.8),
        (Plane((0, 0, -2.0)), lambda x: -x[2]),
    ],
    ids=["sphere", "cylinder", "plane"],
)
def test_shapes_in_three_dimensions(shape, exact):
    points = np.random.default_rng(1).uniform(-1.5, 1.5, (50, 3))
    distance, gradient = values(shape, points)
    np.testing.assert_allclose(distance, [exact(p) for p in points], atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(gradient, axis=1), 1, atol=1e-12)


def nearest_in(constraints, point, start):
    """Distance of a point to a convex body, given by what is not negative in it."""
    rules = [{"type": "ineq", "fun": rule} for rule in constraints]
    size = lambda y: ((y - point) ** 2).sum()  # noqa: E731
    found = minimize(size, start, constraints=rules, method="SLSQP", options={"ftol": 1e-13})
    return np.sqrt(found.fun)


def test_bevel_needle_is_an_oblique_cylinder_with_a_rounded_edge():
    angle, radius, r = 0.45, 0.8, 0.12
    core = radius - r
    inside = [
        lambda y: core**2 - y[0] ** 2 - y[1] ** 2,
        lambda y: (y[2] - r) * np.sin(angle) - (y[0] + core) * np.cos(angle),
    ]
    rng = np.random.default_rng(4)
    points = rng.uniform((-1, -1, -0.2), (1, 1, 4), (150, 3))
    distance, gradient = values(BevelNeedle(angle, radius, r), points)
    near = (distance > -0.9 * r) & (distance < 0.3)
    brute = [nearest_in(inside, p, np.array([0.0, 0.0, 6.0])) - r for p in points[near]]
    assert near.sum() > 20
    np.testing.assert_allclose(distance[near], brute, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(gradient[near], axis=1), 1, atol=1e-8)


def test_half_a_bevel_needle_goes_on_without_end():
    whole, half = (BevelNeedle(0.45, 0.8, 0.12, side=side) for side in (0, 1))
    normal = np.array(half.normal)
    assert normal == pytest.approx((0, -1, 0))
    points = np.random.default_rng(6).uniform((-1, -1, -0.2), (1, 1, 4), (80, 3))
    ahead = points + np.maximum(0, -points @ normal)[:, None] * normal
    np.testing.assert_allclose(values(half, points)[0], values(whole, ahead)[0], atol=1e-9)
    assert (points @ normal < -0.1).sum() > 20


def test_half_the_width_of_a_bevel_needle_is_that_of_its_section():
    needle = BevelNeedle(0.45, 0.8, 0.12)
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(-0.8, 0.8, 81), np.linspace(0, 0.8, 81)))
    # that of a needle with a sharp edge, which is wider near the tip and never narrower
    for height, rounded in ((0.3, 0.2), (1.0, 0.1), (2.0, 0.021), (needle.shaft_height, 0.021), (4.0, 0.021)):
        inside = values(needle, np.column_stack([u, v, 0 * u + height]))[0] < 0
        widest = v[inside].max()
        assert widest - 1e-9 <= needle.half_width(height) <= widest + rounded
    assert needle.half_width(needle.shaft_height) == pytest.approx(0.8)


def test_blade_with_ends_is_a_rounded_prism():
    blade = Blade(HALF, R, SHANK, (0.0, 0.0, -1.0), (1.0, 0.0, 0.0), edge_length=1.4)
    s, c = np.sin(HALF), np.cos(HALF)
    inside = [
        *(lambda y, side=side: (y[2] - R) * s - side * y[0] * c for side in (1, -1)),
        *(lambda y, side=side: SHANK - R - side * y[0] for side in (1, -1)),
        *(lambda y, side=side: 0.7 - R - side * y[1] for side in (1, -1)),
    ]
    points = np.random.default_rng(5).uniform((-1.2, -1.1, -0.2), (1.2, 1.1, 2.5), (60, 3))
    distance = values(blade, points)[0]
    near = (distance > -0.9 * R) & (distance < 0.3)
    brute = [nearest_in(inside, p, np.array([0.0, 0.0, 3.0])) - R for p in points[near]]
    assert near.sum() > 20
    np.testing.assert_allclose(distance[near], brute, atol=1e-6)


@pytest.mark.parametrize("kind", ["blade", "punch", "needle"])
def test_three_dimensional_shape_is_the_plane_one_swept(kind):
    """A blade is the same all along its edge, punch and needle all round their axis; all in any orientation."""
    rng = np.random.default_rng(3)
    push, lateral = np.array([0.0, 0.6, -0.8]), np.array([1.0, 0.0, 0.0])
    third = np.cross(push, lateral)
    flat = rng.uniform(-1, 1.5, (60, 2))
    along = rng.uniform(-1, 1, 60)
    if kind == "blade":
        solid, plane = Blade(HALF, R, SHANK, tuple(push), tuple(lateral)), BLADE
        points = flat[:, :1] * lateral - flat[:, 1:] * push + along[:, None] * third
    else:
        kind, sizes = {"punch": (FlatPunch, (0.7, 0.2)), "needle": (Needle, (HALF, R, SHANK))}[kind]
        solid, plane = kind(*sizes, tuple(push)), kind(*sizes)
        radial = np.cos(along)[:, None] * lateral + np.sin(along)[:, None] * third
        points = flat[:, :1] * radial - flat[:, 1:] * push
    np.testing.assert_allclose(values(solid, points)[0], values(plane, flat)[0], atol=1e-9)


@pytest.mark.parametrize("side", [1, -1])
def test_half_needle_is_convex_and_has_the_surface_of_its_side(side):
    """On its side the distance is that of the whole needle; beyond the plane it goes on as it is in the plane."""
    push, lateral = (0.0, -1.0, 0.0), (1.0, 0.0, 0.0)
    half, whole = Needle(HALF, R, SHANK, push, lateral, side), Needle(HALF, R, SHANK, push)
    a, b = np.random.default_rng(2).uniform((-1.5, -1, -1.5), (1.5, 3, 1.5), (2, 60, 3))
    mine = side * a[:, 0] > 0
    distance, gradient = values(half, a)
    np.testing.assert_allclose(distance[mine], values(whole, a[mine])[0], atol=1e-12)
    np.testing.assert_allclose(distance[~mine], values(whole, a[~mine] * (0, 1, 1))[0], atol=1e-12)
    assert (distance[~mine] < 0).any() and (distance[mine] < 0).any()
    assert (side * gradient[mine, 0] > 0).all(), "each face is pushed to its own side"
    # a distance to a convex set is a convex function outside of it
    middle = values(half, 0.5 * (a + b))[0]
    assert (middle <= 0.5 * (np.maximum(distance, 0) + np.maximum(values(half, b)[0], 0)) + 1e-12).all()


def test_half_width_is_the_outline():
    """On the flank, and on the shank above the rounded joint."""
    for height in (0.5, 1.0, 3.0):
        assert abs(values(BLADE, [(BLADE.half_width(height), height)])[0][0]) < 1e-12


@pytest.mark.parametrize(
    ("kind", "arguments", "name"),
    [
        (Blade, (0.0, 0.1, 1.0), "half_angle"),
        (Blade, (np.pi / 2, 0.1, 1.0), "half_angle"),
        (Blade, (0.2, 0.0, 1.0), "tip_radius"),
        (Blade, (0.2, 0.1, 0.1), "half_thickness"),
        (Blade, (0.2, 0.1, 1.0, (0, -1), (0, 1)), "lateral"),
        (Blade, (0.2, 0.1, 1.0, (0, 0), (0, 1)), "push"),
        (Blade, (0.2, 0.1, 1.0, (0, -1), (1, 0), 2), "side"),
        (Blade, (0.2, 0.1, 1.0, (0, -1), (1, 0), 0, -0.1), "back_angle"),
        (Blade, (0.2, 0.1, 1.0, (0, -1), (1, 0), 0, None, 3.0), "edge_length"),
        (Blade, (0.2, 0.1, 1.0, (0, 0, -1), (1, 0, 0), 0, None, 0.2), "edge_length"),
        (HollowNeedle, (0.5, 0.4, 0.05), "outer_radius"),
        (HollowNeedle, (0.5, 0.0, 0.05), "inner_radius"),
        (BevelNeedle, (0.2, 0.5, 0.05), "bevel_angle"),
        (BevelNeedle, (0.5, 0.5, 0.2), "edge_radius"),
        (BevelNeedle, (0.5, 0.5, 0.05, (0, -1)), "push"),
        (BevelNeedle, (0.5, 0.5, 0.05, (0, 0, -1), (1, 0, 1)), "lateral"),
        (Ball, (0.0,), "radius"),
        (Ball, (1.0, (0, 0, 0)), "axis"),
        (FlatPunch, (0.1, 0.1), "radius"),
        (FlatPunch, (1.0, 0.0), "edge_radius"),
        (Needle, (0.0, 0.1, 1.0), "half_angle"),
        (Needle, (0.2, 0.0, 1.0), "tip_radius"),
        (Needle, (0.2, 0.1, 0.1), "radius"),
        (Needle, (0.2, 0.1, 1.0, (0, 0)), "push"),
        (Needle, (0.2, 0.1, 1.0, (0, -1), (1, 1)), "lateral"),
        (Needle, (0.2, 0.1, 1.0, (0, -1), None, 1), "lateral"),
        (Needle, (0.2, 0.1, 1.0, (0, -1), (1, 0), 2), "side"),
        (Plane, ((0, 0),), "normal"),
    ],
)
def test_refuses_what_is_no_tool(kind, arguments, name):
    with pytest.raises(ValueError, match=f"{name} = .* is not allowed"):
        kind(*arguments)


# -- paths ------------------------------------------------------------------------------------------------------------


def test_polyline_goes_straight_and_rests_at_its_ends():
    path = ToolPath.polyline([1, 2, 4], [(0, 0), (1, 0), (1, -4)])
    assert path.corners == (1, 2, 4)
    for time, place in ((0, (0, 0)), (1.5, (0.5, 0)), (3, (1, -2)), (9, (1, -4))):
        np.testing.assert_allclose(path.position(time), place)


def test_saw_goes_to_and_fro_by_its_stroke():
    path = ToolPath.saw((0, 0, 1), (0, 0, -2), (4, 0, 0), period=0.5)
    places = np.array([path.position(t) for t in np.linspace(0, 0.5, 401)])
    assert np.ptp(places[:, 0]) == pytest.approx(4)
    np.testing.assert_allclose(places[-1], (0, 0, 0), atol=1e-12)


def test_polyline_turns_between_its_points():
    path = ToolPath.polyline([0, 2], [(0, 0), (1, 0)], [0.0, 0.5])
    np.testing.assert_allclose([path.rotation(t) for t in (-1, 0.5, 3)], [[0], [0.125], [0.5]])
    path = ToolPath.polyline([0, 2], [(0, 0, 0), (1, 0, 0)], [(0, 0, 0), (0, 0.4, 1)])
    np.testing.assert_allclose(path.rotation(1), (0, 0.2, 0.5))
    assert ToolPath.polyline([0, 2], [(0, 0), (1, 0)]).rotation is None


def test_slice_and_push_have_the_ratio_of_their_speeds():
    path = ToolPath.slice_push((1, 0, 5), (0, 0, -2), (0, 3, 0), ratio=1.5)
    np.testing.assert_allclose(path.position(2.0), (1, 6, 1))
    assert path.rotation is None


@pytest.mark.parametrize("dim", [2, 3])
def test_rocking_keeps_the_pivot_on_its_way(dim):
    """The pivot moves straight, whatever the angle; the tool turns by it to either side."""
    start, v, pivot = np.ones(dim), np.arange(1.0, 1 + dim), np.array([2.0, -1.0, 0.5])[:dim]
    axis = None if dim == 2 else (0, 0, 2)
    path = ToolPath.rock(tuple(start), tuple(v), 0.4, 2.0, tuple(pivot), axis)
    for t in (0.0, 0.3, 0.5, 1.5):
        turn = path.rotation(t)
        assert turn[-1] == pytest.approx(0.4 * np.sin(np.pi * t)) and len(turn) == (1 if dim == 2 else 3)
        moved = path.position(t) + rotation_matrix(turn) @ pivot
        np.testing.assert_allclose(moved, start + pivot + t * v, atol=1e-14)


@pytest.mark.parametrize(
    ("make", "name"),
    [
        (lambda: ToolPath.polyline([0, 0], [(0, 0), (1, 1)]), "times"),
        (lambda: ToolPath.polyline([0, 1], [(0, 0)]), "points"),
        (lambda: ToolPath.polyline([0, 1], [(0, 0), (1, 0)], [0.0]), "turns"),
        (lambda: ToolPath.polyline([0, 1], [(0, 0), (1, 0)], [(0.0, 0.0)] * 2), "turns"),
        (lambda: ToolPath.saw((0,), (0,), (0,), 0.0), "period"),
        (lambda: ToolPath.slice_push((0, 0), (0, -1), (1, 0), -1.0), "ratio"),
        (lambda: ToolPath.slice_push((0, 0), (0, -1), (0, 0), 1.0), "draw"),
        (lambda: ToolPath.slice_push((0, 0), (0, -1, 0), (1, 0), 1.0), "velocity"),
        (lambda: ToolPath.slice_push((0, 0), (0, -1), (0, 2), 1.0), "velocity"),
        (lambda: ToolPath.slice_push((0, 0), (0, 0), (1, 0), 1.0), "velocity"),
        (lambda: ToolPath.rock((0, 0), (0, -1), 4.0, 1.0), "angle"),
        (lambda: ToolPath.rock((0, 0), (0, -1), 0.1, 0.0), "period"),
        (lambda: ToolPath.rock((0, 0), (0, -1), 0.1, 1.0, (1, 2, 3)), "pivot"),
        (lambda: ToolPath.rock((0, 0), (0, -1), 0.1, 1.0, axis=(0, 0, 1)), "axis"),
        (lambda: ToolPath.rock((0, 0, 0), (0, -1, 0), 0.1, 1.0), "axis"),
    ],
)
def test_refuses_what_is_no_path(make, name):
    with pytest.raises(ValueError, match=f"{name} = .* is not allowed"):
        make()
