"""Coincident nodes of a mesh, merged or kept apart, and the facets between its parts."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from cutsim.base.checks import require
from cutsim.readers.facets import FacetTable
from cutsim.readers.mesh_data import Floats, Indices

#: Which coincident nodes become one: all, none, or those between pairs of groups of cells.
Merge = bool | Sequence[tuple[str, str]]

# nodes coincide if they are nearer than this fraction of the shortest edge
_NEAR = 1e-3


class Parts:
    """Parts of a mesh: every cell belongs to the first of its groups.

    Args:
        groups: Name of each group of cells → its cells, by number.
        count: Number of cells.

    Attributes:
        groups: As given.
        of_cells: For each cell the position of its first group; −1 without one.
    """

    def __init__(self, groups: Mapping[str, Indices], count: int) -> None:
        self.groups = groups
        self.of_cells: Indices = np.full(count, -1, dtype=np.int64)
        for position, cells in reversed(list(enumerate(groups.values()))):
            self.of_cells[cells] = position

    def find(self, parameter: str, name: str) -> Indices:
        """The cells of a group.

        Raises:
            ValueError: A parameter names a group that is not there.
        """
        require(parameter, name, name in self.groups, f"a group of cells: {', '.join(self.groups) or 'there are none'}")
        return self.groups[name]


def same_nodes(
    points: Floats, nodes: Indices, corners: Indices, parts: Parts, merge: Merge, tolerance: float | None
) -> tuple[Indices, Indices]:
    """Find out which nodes coincide.

    Args:
        points: Positions of all nodes [length].
        nodes: Nodes of the cells.
        corners: Corners of the cells.
        parts: Parts of the mesh.
        merge: Which coincident nodes become one.
        tolerance: Distance below which nodes coincide [length]; a thousandth of the shortest edge if None.

    Returns:
        For each node the one that stands for all that are merged with it, and the one for all that coincide with it.

    Raises:
        ValueError: The tolerance is not below the shortest edge, or there is no group of a name.
    """
    edge = min(_shortest(points, corners[:, list(ends)]) for ends in combinations(range(corners.shape[1]), 2))
    near = _NEAR * edge if tolerance is None else tolerance
    require("tolerance", tolerance, near < edge, f"less than the shortest edge, which is {edge:.4g} long")
    used = np.unique(nodes)
    pairs = used[cKDTree(points[used]).query_pairs(near, output_type="ndarray")].reshape(-1, 2)
    merged = np.full(len(pairs), merge is True)
    for one, other in [] if isinstance(merge, bool) else merge:
        ours, theirs = (np.isin(pairs, nodes[parts.find("merge", name)]) for name in (one, other))
        merged |= (ours & theirs[:, ::-1]).any(axis=1)
    return _first_of_each(pairs[merged], len(points)), _first_of_each(pairs, len(points))


def _shortest(points: Floats, ends: Indices) -> float:
    """Length of the shortest of some edges that has a length."""
    lengths = np.linalg.norm(points[ends[:, 0]] - points[ends[:, 1]], axis=1)
    return float(lengths[lengths > 0].min(initial=np.inf))


def _first_of_each(pairs: Indices, count: int) -> Indices:
    """For each of so many nodes the first of those with which pairs connect it."""
    if not len(pairs):
        return np.arange(count, dtype=np.int64)
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    _, label = connected_components(graph, directed=False)
    return np.asarray(np.unique(label, return_index=True)[1][label], dtype=np.int64)


def interfaces(parts: Parts, table: FacetTable, before: FacetTable, twins: Indices) -> dict[str, Indices]:
    """Facets between two parts A and B of a mesh.

    Those that cells of both have in common are called ``A|B``, the part that the file has first first. Where nodes
    coincide and are kept apart, the facets of A are called ``A|B`` and those of B ``B|A``. Facets that were merged
    within one part A are called ``A|A``.

    Args:
        parts: The parts.
        table: Facets of the cells.
        before: The same before nodes were merged.
        twins: For each node the one that stands for all that coincide with it.

    Returns:
        Name → corners of the facets.
    """
    inner = table.shared
    of = np.sort(parts.of_cells[table.cells[inner]], axis=1)
    merged = before.number[inner[:, 0]] != before.number[inner[:, 1]]
    between = (of[:, 0] != of[:, 1]) | merged
    found = dict(_named(parts, of[between], table.corners[inner[between, 0]]))
    outer = table.exterior[_paired(twins[table.corners[table.exterior]])]
    of = parts.of_cells[table.cells[outer]]
    apart = of[:, 0] != of[:, 1]
    for side in (0, 1):
        ends = of[apart][:, [side, 1 - side]]
        for name, rows in _named(parts, ends, table.corners[outer[apart, side]]):
            found[name] = np.concatenate([found.get(name, rows[:0]), rows])
    return found


def _paired(rows: Indices) -> Indices:
    """Positions of rows of the same numbers, of which there are two; shape (pairs, 2)."""
    _, which, count = np.unique(np.sort(rows, axis=1), axis=0, return_inverse=True, return_counts=True)
    which = which.ravel()
    order = np.argsort(which, kind="stable")
    return order[count[which[order]] == 2].reshape(-1, 2)


def _named(parts: Parts, of: Indices, rows: Indices) -> Iterator[tuple[str, Indices]]:
    """Rows of each pair of parts, under the names of both."""
    names = list(parts.groups)
    pairs, which, count = np.unique(of, axis=0, return_inverse=True, return_counts=True)
    order = np.split(np.argsort(which.ravel(), kind="stable"), np.cumsum(count)[:-1])
    for (one, other), own in zip(pairs, order, strict=False):
        if one >= 0 and other >= 0:
            yield f"{names[one]}|{names[other]}", rows[own]
