"""Facets of the cells of a mesh, and which cells have them in common."""

from collections.abc import Sequence

import basix
import numpy as np
from numpy.typing import NDArray

from cutsim.base.checks import place
from cutsim.readers.mesh_data import Floats, Indices


class FacetTable:
    """All facets of cells that are given by their corners.

    Args:
        cell: Type of the cells as dolfinx calls it.
        corners: Numbers of their corners, shape (cells, corners).

    Attributes:
        corners: Corners of the facets of each cell, one cell after the other, each row sorted.
        cells: Cell of each facet.
        number: Number of each facet; those with the same corners have the same.
    """

    def __init__(self, cell: str, corners: Indices) -> None:
        kind = getattr(basix.CellType, cell)
        local = np.asarray(basix.topology(kind)[-2])
        self.corners: Indices = np.sort(corners[:, local].reshape(-1, local.shape[1]), axis=1)
        self.cells: Indices = np.repeat(np.arange(len(corners), dtype=np.int64), len(local))
        # facets are the same if the sums of random numbers of their nodes are
        random = np.random.default_rng(0).integers(0, 2**62, corners.max(initial=0) + 1, dtype=np.uint64)
        keys = random[self.corners].sum(axis=1)
        _, self._first, number, self._count = np.unique(
            keys, return_index=True, return_inverse=True, return_counts=True
        )
        self.number: Indices = number.ravel()

    @property
    def distinct(self) -> Indices:
        """Corners of the facets, each once."""
        return self.corners[self._first]

    @property
    def exterior(self) -> Indices:
        """Positions of the facets that belong to one cell."""
        return self._first[self._count == 1]

    @property
    def shared(self) -> Indices:
        """Positions of the facets that belong to two cells, in pairs; shape (facets, 2)."""
        order = np.argsort(self.number, kind="stable")
        return order[self._count[self.number[order]] == 2].reshape(-1, 2)

    def crowded(self) -> Indices:
        """Corners of the facets that belong to more than two cells."""
        return self.corners[self._first[self._count > 2]]

    def within(self, nodes: NDArray[np.bool_]) -> Indices:
        """Corners of the facets with all their corners among some nodes, but for those inside of cells that have them.

        These are the facets of a set of nodes: the facets of a surface, or the boundary of a region.
        """
        inside = nodes[self.corners].all(axis=1)
        per_cell = len(self.number) // max(self.cells[-1] + 1, 1) if len(self.cells) else 1
        full = inside.reshape(-1, per_cell).all(axis=1)[self.cells]
        outer = np.zeros(len(self._first), dtype=bool)
        outer[self.number[~full]] = True
        outer |= self._count == 1
        return self.corners[self._first[outer & inside[self._first]]]


def rows_in(rows: NDArray[np.integer], among: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Which rows are also among others."""
    both = np.concatenate([among.reshape(-1, rows.shape[1]), rows])
    number = np.unique(both, axis=0, return_inverse=True)[1].ravel()
    return np.isin(number[len(among) :], number[: len(among)])


def check_corners(corners: Indices, points: Floats) -> None:
    """Refuse cells that name a node twice.

    Raises:
        ValueError: There are such cells.
    """
    bad = np.flatnonzero((np.diff(np.sort(corners, axis=1), axis=1) == 0).any(axis=1))
    if len(bad):
        first = place(points[corners[bad[0]]].mean(axis=0))
        raise ValueError(
            f"{len(bad)} cells have a node twice, the first at {first}; cells with fewer corners than their type, such "
            "as wedges among hexahedra, cannot be used"
        )


def check_nodes(cell: str, degree: int, cells: Indices, points: Floats) -> None:
    """Refuse cells of higher order that do not have the nodes on their common edges and faces in common.

    Args:
        cell: Type of the cells as dolfinx calls it.
        degree: Degree of their shape.
        cells: Their nodes, shape (cells, nodes).
        points: Positions of the nodes.

    Raises:
        ValueError: An edge or face has other nodes in another cell, or a node belongs to two of them.
    """
    element = basix.create_element(
        basix.ElementFamily.P, getattr(basix.CellType, cell), degree, basix.LagrangeVariant.equispaced
    )
    topology = basix.topology(element.cell_type)
    random = np.random.default_rng(1).integers(0, 2**62, cells.max(initial=0) + 1, dtype=np.uint64)
    count = 0
    for corners, inner in zip(topology, element.entity_dofs, strict=True):
        if not inner[0]:
            continue
        # the same if the sums of random numbers of their nodes are
        keys, values = (random[cells[:, np.array(part)]].sum(axis=2).ravel() for part in (corners, inner))
        _, first, which = np.unique(keys, return_index=True, return_inverse=True)
        bad = np.flatnonzero(values != values[first][which.ravel()])
        if len(bad):
            number, local = divmod(int(bad[0]), len(inner))
            where = place(points[cells[number, corners[local]]].mean(axis=0))
            raise ValueError(f"{len(bad)} edges or faces have other nodes in other cells, the first at {where}")
        count += len(first) * len(inner[0])
    if count != len(np.unique(cells)):
        raise ValueError("a node of the mesh is a corner of one cell and lies on an edge or face of another one")


def check_neighbours(table: FacetTable, points: Floats) -> None:
    """Refuse what is no mesh: facets of more than two cells, and cells that have more than one facet in common.

    Raises:
        ValueError: There are such facets.
    """
    crowded, shared = table.crowded(), table.shared
    pairs = np.sort(table.cells[shared], axis=1)
    _, first, count = np.unique(pairs, axis=0, return_index=True, return_counts=True)
    twice = table.corners[shared[first[count > 1], 0]]
    for bad, what in ((crowded, "facets belong to more than two cells"), (twice, "pairs of cells share two facets")):
        if len(bad):
            first_place = place(points[bad[0]].mean(axis=0))
            raise ValueError(f"{len(bad)} {what}, the first at {first_place}: cells are folded or lie over each other")


def facets_among(rows: Indices, facets: Indices) -> NDArray[np.bool_]:
    """Which facets, given by their corners, negative where a mesh has no such node, are facets of this mesh."""
    known = (rows >= 0).all(axis=1)
    if rows.shape[1] != facets.shape[1]:
        return np.zeros(len(rows), dtype=bool)
    near = np.zeros(facets.max(initial=0) + 1, dtype=bool)
    near[rows[known]] = True
    return known & rows_in(np.sort(rows, axis=1), facets[near[facets].all(axis=1)])


def check_members(
    name: str, number: Indices, sets: Sequence[Indices], points: Floats, facets: Indices, advice: str
) -> Indices:
    """Refuse a group of facets some of which are none of the mesh.

    Args:
        name: Name of the group.
        number: Number of each node of the file in the mesh, negative if it has none.
        sets: Corners of its facets as nodes of the file, an array for each number of corners.
        points: Positions of the nodes of the file.
        facets: Corners of all facets of the mesh, each row sorted.
        advice: What to do about it.

    Returns:
        Corners of the facets in the numbers of the mesh.

    Raises:
        ValueError: The group is empty or has such facets.
    """
    known = [facets_among(number[rows], facets) for rows in sets]
    if sets and all(some.all() for some in known):
        return np.concatenate([number[rows] for rows in sets])
    count, total = sum(int(some.sum()) for some in known), sum(map(len, sets))
    lost = [points[rows[~some]].mean(axis=1) for rows, some in zip(sets, known, strict=True)]
    places = np.concatenate(lost) if lost else np.empty((0, 3))
    ends = " to ".join(place(x) for x in (places if len(places) < 3 else places[[0, -1]]))
    raise ValueError(
        f"group {name!r}: {count} of {total} facets are facets of the mesh"
        + (f"; the others lie near {ends}" if ends else "")
        + advice
    )
