"""Mesh of a block of flat layers with one crack plane: structured, graded, with named regions."""

import math
from collections.abc import Mapping
from itertools import pairwise

import numpy as np
from dolfinx.mesh import CellType, GhostMode, Mesh, create_box, create_rectangle
from mpi4py import MPI

from cutsim.base.arrays import Array
from cutsim.base.checks import between, count, positive, require, require_number
from cutsim.base.signatures import checked
from cutsim.fields.meshing import Marker, TaggedMesh, tag_mesh

#: Sides of the block; names that no layer may have.
SIDES = ("notch", "top_left", "top_right", "bottom", "far_left", "far_right", "front", "back")
#: The two sides of the crack of a body of revolution, which no layer may have as a name either.
HALVES = ("left", "right")

_GROWTH = 1.3  # ratio of neighbouring sizes beside the band
_NEAR = 0.2  # growth of the sizes per distance from the mouth


@checked
def laminate(
    comm: MPI.Comm,
    layers: Mapping[str, float],
    *,
    length: float,
    size: float,
    band: float,
    notch: float = 0.0,
    entry: float = 0.0,
    least: int = 2,
    width: float | None = None,
    rows: int = 4,
    thread: float | None = None,
    half: int = 0,
) -> TaggedMesh:
    """Mesh a block of layers, quadrilaterals or hexahedra. Collective.

    The top is y = 0, the layers follow each other downwards, and the plane of the crack is x = 0 (the frame of
    meshes/block.geo).  Groups of cells are the layers; groups of facets are "crack_<layer>" for each layer that the
    notch does not cut through, and `SIDES`, "front" and "back" in 3-D and "notch" with a notch only.

    With a `thread` it is the meridian plane of a body of revolution about x = 0 (the frame of meshes/thread.geo): the
    crack is at x = `thread`, and there are the groups of cells "left", the thread, and "right", all else, but no
    facets "far_left".

    Args:
        comm: Communicator over which the mesh is distributed.
        layers: Name → thickness from the top downwards [length].
        length: Length of each of the two halves, or from the crack to the rim of a body of revolution [length].
        size: Largest element along the crack plane and across it within the band [length].
        band: Half width of the zone of uniform size about the crack plane, beside which elements grow [length].
        notch: Depth of the notch from the top, less than that of the block [length].
        entry: Elements at the mouth of the crack, where a tool that starts above the surface indents it; they grow to
            `size` from there. 0 for elements as along the crack [length].
        least: Elements through a layer, at least; thin layers have no more.
        width: Width along z of a block in 3-D, from z = 0 on; None for the plane [length].
        rows: Elements across the width.
        thread: Radius of the thread about the axis of a body of revolution, which has no width; None for a block.
        half: 1 for the right half of a block that is alike on both sides of the crack, whose facets then are on the
            outer boundary; there are no facets "top_left" and "far_left". 0 for both halves.

    Raises:
        ValueError: On all ranks, if a number is outside its range or a layer has no name of its own.
    """
    height = sum(layers.values())
    require("layers", dict(layers), len(layers) > 0 and min(layers.values()) > 0, "at least one, of thickness > 0")
    require(
        "layers", list(layers), not set(layers) & {*SIDES, *HALVES}, f"names other than {', '.join(SIDES + HALVES)}"
    )
    require_number("size", size, positive)
    require_number("length", length, positive)
    require_number("band", band, between(0, length, "(]", name="length"))
    require_number("notch", notch, between(0, height, "[)", name="height"))
    require_number("entry", entry, between(0, size, "[]", name="size"))
    require_number("least", least, count(1))
    require_number("width", width, positive.or_none)
    require_number("rows", rows, count(1))
    require_number("thread", thread, positive.or_none)
    require("width", width, width is None or thread is None, "None for a body of revolution")
    require("half", half, half == 0 or (half == 1 and thread is None), "0 or 1, and 0 for a body of revolution")
    right = _graded(length, size, band, entry)
    bounds = -np.concatenate([[0.0], np.cumsum(list(layers.values()))])
    left = right[:0] if half else -right[:0:-1]
    across = np.concatenate([left, right]) if thread is None else np.append(0.0, thread + right)
    lines = [across, _down(bounds, size, notch, least, entry)[::-1]]
    if width is not None:
        lines.append(np.linspace(0.0, width, rows + 1))
    cells, facets = _markers(layers, bounds, across, thread or 0.0, notch, width)
    return tag_mesh(_grid(comm, lines), cells, facets)


def _graded(length: float, size: float, band: float, entry: float) -> Array:
    """Lines from the crack plane to the end of a half."""
    inner = _lines(0.0, band, size, entry)
    rest, last = length - band, min(size, entry + _NEAR * band) if entry else size
    # the sum of a geometric series reaches the rest
    n = math.ceil(math.log1p(rest / last * (_GROWTH - 1) / _GROWTH) / math.log(_GROWTH) - 1e-9)
    outer = np.cumsum(_GROWTH ** np.arange(n))
    return np.append(inner, band + rest * outer / outer[-1:])


def _down(bounds: Array, size: float, notch: float, least: int, entry: float) -> Array:
    """Lines from the top to the bottom, among them the bounds of the layers and the end of the notch."""
    lines = [bounds[:1]]
    for top, bottom in pairwise(bounds):
        stops = [top, -notch, bottom] if bottom < -notch < top else [top, bottom]
        for a, b in pairwise(stops):
            lines.append(-_lines(-a, -b, min(size, (top - bottom) / least), entry)[1:])
    return np.concatenate(lines)


def _lines(start: float, end: float, size: float, entry: float) -> Array:
    """Lines between two distances from the mouth, of a size that begins there with `entry`."""
    if not entry or entry + _NEAR * start >= size:
        return np.linspace(start, end, math.ceil((end - start) / size - 1e-9) + 1)
    places = [start]
    while places[-1] < end * (1 - 1e-9):
        places.append(places[-1] + min(size, entry + _NEAR * places[-1]))
    return start + (np.array(places) - start) * (end - start) / (places[-1] - start)


def _grid(comm: MPI.Comm, lines: list[Array]) -> Mesh:
    """Mesh of all cells between lines along each coordinate."""
    counts, corners = [len(line) - 1 for line in lines], ([0.0] * len(lines), [len(line) - 1.0 for line in lines])
    if len(lines) == 2:
        mesh = create_rectangle(comm, corners, counts, CellType.quadrilateral, ghost_mode=GhostMode.shared_facet)
    else:
        mesh = create_box(comm, corners, counts, CellType.hexahedron, ghost_mode=GhostMode.shared_facet)
    for i, line in enumerate(lines):
        mesh.geometry.x[:, i] = line[np.rint(mesh.geometry.x[:, i]).astype(int)]
    return mesh


def _markers(
    layers: Mapping[str, float], bounds: Array, across: Array, crack: float, notch: float, width: float | None
) -> tuple[dict[str, Marker], dict[str, Marker]]:
    """Markers of the groups of cells and of facets of a block between the ends of `across`, with the crack at x."""
    bottom, near, far = bounds[-1], across[0], across[-1]
    slack = 1e-9 * max(far, -bottom)

    def between(axis: int, low: float, high: float) -> Marker:
        return lambda x: (x[axis] > low - slack) & (x[axis] < high + slack)

    def both(first: Marker, second: Marker) -> Marker:
        return lambda x: first(x) & second(x)

    middle = between(0, crack, crack)
    cells, facets = {}, {}
    for name, (top, low) in zip(layers, pairwise(bounds), strict=True):
        cells[name] = between(1, low, top)
        if low < -notch - slack:
            facets[f"crack_{name}"] = both(middle, between(1, low, min(top, -notch)))
    if notch:
        facets["notch"] = both(middle, between(1, -notch, 0.0))
    if near < crack:
        facets["top_left"] = both(between(1, 0.0, 0.0), between(0, near, crack))
    facets["top_right"] = both(between(1, 0.0, 0.0), between(0, crack, far))
    facets["bottom"], facets["far_right"] = between(1, bottom, bottom), between(0, far, far)
    if near < 0:
        facets["far_left"] = between(0, near, near)
    elif crack > 0:
        cells["left"], cells["right"] = between(0, near, crack), between(0, crack, far)
    if width is not None:
        facets["front"], facets["back"] = between(2, 0.0, 0.0), between(2, width, width)
    return cells, facets
