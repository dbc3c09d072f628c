"""Division of intervals and convex polygons along the edges of others."""

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise

#: A place on a line or in a plane.
Place = Sequence[float]
#: Ends of an interval, or corners of a convex polygon, one after the other.
Polygon = Sequence[Place]
_Edge = tuple[float, float, float]


def divided_interval(length: float, ends: Iterable[float], same: float) -> list[Polygon]:
    """Parts of an interval from 0, of a length, between ends of other ones.

    Args:
        length: The length.
        ends: These ends.
        same: Distance up to which two ends are one.
    """
    places = [0.0]
    for end in sorted(ends):
        if places[-1] + same < end < length - same:
            places.append(end)
    return [[(a,), (b,)] for a, b in pairwise([*places, length])]


def divided_polygon(own: Polygon, others: Iterable[Polygon], same: float) -> list[Polygon]:
    """Parts of a convex polygon, each of which lies within one of some others or outside of all.

    The parts cover the polygon exactly, also where others overlap or leave gaps.

    Args:
        own: The polygon, counter-clockwise.
        others: Other convex polygons, either way round; what lies in several of them belongs to the first.
        same: Distance up to which a corner lies on an edge.
    """
    inside: list[Polygon] = []
    left = [own]
    for other in others:
        edges = _edges(other, same)
        rest: list[Polygon] = []
        for part in left:
            within, without = _cut(part, edges, same)
            inside += within
            rest += without
        left = rest
    return inside + left


def simple_parts(polygon: Polygon) -> list[Polygon]:
    """Quadrilaterals, and a triangle if a corner is left over, that make up a convex polygon; an interval is one."""
    first, rest = polygon[0], polygon[1:]
    return [[first, *rest[i : i + 3]] for i in range(0, max(len(rest) - 1, 1), 2)]


def _edges(polygon: Polygon, same: float) -> list[_Edge]:
    """Edges (a, b, c), where a x + b y + c is the distance inwards; none if the polygon has no area."""
    sides = list(pairwise([*polygon, polygon[0]]))
    area = 0.5 * sum(x * v - u * y for (x, y), (u, v) in sides)
    edges = []
    for (x, y), (u, v) in sides:
        a, b, length = y - v, u - x, math.copysign(math.hypot(u - x, v - y), area)
        if abs(length) > same:
            edges.append((a / length, b / length, -(a * x + b * y) / length))
    return edges if abs(area) > same**2 else []


def _cut(
    part: Polygon, edges: Sequence[tuple[float, float, float]], same: float
) -> tuple[list[Polygon], list[Polygon]]:
    """What of a polygon is within all edges, and the parts of it that are not."""
    within, without = part, list[Polygon]()
    for a, b, c in edges:
        distances = [a * x + b * y + c for x, y in within]
        distances = [0.0 if abs(d) <= same else d for d in distances]
        if max(distances) <= 0:
            return [], [part]
        if min(distances) < 0:
            left, right = list[Place](), list[Place]()
            last, before = within[-1], distances[-1]
            for place, d in zip(within, distances, strict=True):
                if d * before < 0:
                    t = before / (before - d)
                    crossing = (last[0] + t * (place[0] - last[0]), last[1] + t * (place[1] - last[1]))
                    left.append(crossing)
                    right.append(crossing)
                if d >= 0:
                    left.append(place)
                if d <= 0:
                    right.append(place)
                last, before = place, d
            within = left
            without.append(right)
    return ([within], without) if edges else ([], [part])
