"""One mesh of what a file says: cells of one type, numbered without gaps, with groups of cells, facets and vertices."""

import logging
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cutsim.base.checks import place
from cutsim.readers import shapes
from cutsim.readers.facets import FacetTable, check_corners, check_members, check_neighbours, check_nodes, facets_among
from cutsim.readers.mesh_data import Floats, Indices, MeshData
from cutsim.readers.selection import Selection
from cutsim.readers.twins import Merge, interfaces, same_nodes

logger = logging.getLogger(__name__)

# a mesh is flat if it extends along an axis by no more than this fraction of its size
_FLAT = 1e-9
_AXES = "xyz"


@dataclass(frozen=True)
class Choice:
    """How a mesh is made of a file.

    Attributes:
        gdim: Dimension of the mesh and of its space.
        scale: Factor of all coordinates.
        only: Names of the groups of cells that make the mesh; all cells if None.
        merge: Which coincident nodes become one.
        tolerance: Distance below which nodes coincide [length]; a thousandth of the shortest edge if None.
    """

    gdim: int
    scale: float = 1.0
    only: Sequence[str] | None = None
    merge: Merge = False
    tolerance: float | None = None


@dataclass(frozen=True)
class Model:
    """Mesh with groups, numbered without gaps.

    Attributes:
        cell: Name of the cell.
        degree: Degree of its shape.
        points: Positions of the nodes, shape (nodes, gdim) [length].
        cells: Nodes of each cell in the order of dolfinx, its corners first.
        groups: (dimension, name) of each group → numbers of its cells, corners of its facets, or its vertices.
    """

    cell: str
    degree: int
    points: Floats
    cells: Indices
    groups: dict[tuple[int, str], Indices]


def make_model(data: MeshData, choice: Choice) -> Model:
    """The mesh of a file, after a check that it is one.

    Raises:
        ValueError: The cells are not of one type that can be used, name a node twice or lie over each other, a flat
            mesh is not in a plane of two axes, there is no group of a chosen name, or facets of a set are none of the
            mesh.
    """
    selection = Selection(data, choice.gdim, choice.only)
    if lower := selection.lower():
        logger.warning("left out: %s, which are neither cells nor facets", lower)
    shape, nodes, points = shapes.completed(selection.shape, selection.nodes, choice.scale * data.points)
    cell, degree, _ = shapes.USABLE[shape]
    nodes = shapes.in_order_of_dolfinx(shape, nodes)
    _check_finite(points[np.unique(nodes)])
    corners = shapes.corners(shape, nodes)
    check_corners(corners, points)
    roots, twins = same_nodes(points, nodes, corners, selection.parts, choice.merge, choice.tolerance)
    used, cells = np.unique(roots[nodes], return_inverse=True)
    cells = cells.reshape(nodes.shape)
    number = np.full(len(points), -1, dtype=np.int64)
    number[used] = np.arange(len(used))
    table = FacetTable(cell, shapes.corners(shape, cells))
    check_neighbours(table, points[used])
    check_nodes(cell, degree, cells, points[used])
    sets = _Sets(data, selection, points, number[roots], table)
    facets = sets.facets()
    between = interfaces(selection.parts, table, FacetTable(cell, corners), twins[used])
    added = {name: rows for name, rows in between.items() if name not in facets}
    groups = {(choice.gdim, name): rows for name, rows in selection.parts.groups.items()}
    groups |= {(choice.gdim - 1, name): rows for name, rows in (facets | added).items()}
    groups |= {(0, name): rows for name, rows in sets.vertices().items()}
    return Model(cell, degree, _plane(points[used], choice.gdim), cells, groups)


class _Sets:
    """Sets of facets and nodes of a file in the numbers of the mesh.

    Args:
        data: The file.
        selection: Which of its elements are the cells.
        points: Positions of its nodes.
        number: Number of each node in the mesh; −1 if it has none.
        table: Facets of the mesh.
    """

    def __init__(
        self, data: MeshData, selection: Selection, points: Floats, number: Indices, table: FacetTable
    ) -> None:
        self._data, self._selection, self._points, self._number, self._table = data, selection, points, number, table

    def facets(self) -> dict[str, Indices]:
        """Corners of the facets of each set: of facets, of elements that are facets, and of nodes."""
        distinct, left, found = self._table.distinct, self._selection.left, dict[str, Indices]()
        for name, arrays in self._data.facet_sets.items():
            # facets of elements that are no cells are not missed
            kept = [rows[facets_among(self._number[rows], distinct) | ~left[rows].all(axis=1)] for rows in arrays]
            kept = [rows for rows in kept if len(rows)]
            if kept:
                found[name] = check_members(name, self._number, kept, self._points, distinct, self._data.advice)
            else:
                logger.warning("group %r is left out: it has no facets of cells of the mesh", name)
        for name, members in self._data.cell_sets.items():
            faces = [self._number[rows] for rows in self._selection.faces(members)]
            known = sum(int(facets_among(rows, distinct).sum()) for rows in faces)
            if known < (total := sum(map(len, faces))):
                logger.warning("group %r is left out: %d of %d elements are facets of cells", name, known, total)
            elif known and name not in found:
                found[name] = np.concatenate(faces)
        for name, nodes in self._data.node_sets.items():
            if name not in found and len(rows := self._table.within(self._among(nodes))):
                found[name] = rows
        return found

    def vertices(self) -> dict[str, Indices]:
        """Corners of cells in each set of nodes."""
        corners = np.unique(self._table.corners)
        sets = {name: corners[self._among(nodes)[corners]] for name, nodes in self._data.node_sets.items()}
        return {name: vertices for name, vertices in sets.items() if len(vertices)}

    def _among(self, nodes: Indices) -> NDArray[np.bool_]:
        """Which nodes of the mesh are among some of the file."""
        among = np.zeros(self._number.max() + 1, dtype=bool)
        among[self._number[nodes][self._number[nodes] >= 0]] = True
        return among


def _check_finite(points: Floats) -> None:
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if len(bad):
        raise ValueError(f"{len(bad)} nodes have coordinates that are not finite, the first {place(points[bad[0]])}")


def _plane(x: Floats, gdim: int) -> Floats:
    """Coordinates in the plane of a flat mesh, which may be that of any two axes."""
    if gdim == 3:
        return x
    extent = np.ptp(x, axis=0)
    flat = [i for i in (2, 1, 0) if extent[i] <= _FLAT * extent.max()]
    if not flat:
        low, high = x.min(axis=0)[2], x.max(axis=0)[2]
        raise ValueError(
            f"gdim = 2, but the mesh is not flat: z goes from {low:.4g} to {high:.4g}. Allowed is a mesh in a plane of "
            "two axes; a surface in space is no body"
        )
    axes = [i for i in range(3) if i != flat[0]]
    level = x[:, flat[0]].mean()
    if flat[0] != 2:
        logger.warning(
            "the mesh lies in the plane %s = %.4g: its coordinates %s and %s are x[0] and x[1] here",
            _AXES[flat[0]], level, *(_AXES[i] for i in axes),
        )  # fmt: skip
    return np.ascontiguousarray(x[:, axes])
