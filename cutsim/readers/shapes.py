"""Types of cells by their names in meshio, with their nodes in the order of VTK."""

import numpy as np
from dolfinx import cpp
from dolfinx.mesh import CellType
from numpy.typing import NDArray

from cutsim.readers.mesh_data import Floats, Indices

#: Cells that can be used: cell of dolfinx, degree of its shape, number of nodes.
USABLE = {
    "triangle": ("triangle", 1, 3), "triangle6": ("triangle", 2, 6), "triangle10": ("triangle", 3, 10),
    "quad": ("quadrilateral", 1, 4), "quad9": ("quadrilateral", 2, 9), "quad16": ("quadrilateral", 3, 16),
    "tetra": ("tetrahedron", 1, 4), "tetra10": ("tetrahedron", 2, 10), "tetra20": ("tetrahedron", 3, 20),
    "hexahedron": ("hexahedron", 1, 8), "hexahedron27": ("hexahedron", 2, 27), "hexahedron64": ("hexahedron", 3, 64),
}  # fmt: skip
# Cells without nodes inside of their faces, those that have them, and the corners of these faces. The shape functions
# of the former (serendipity) are among those of the latter: with nodes where the former put them the shape is the same.
_INCOMPLETE: dict[str, tuple[str, list[list[int]]]] = {
    "quad8": ("quad9", [[0, 1, 2, 3]]),
    "hexahedron20": (
        "hexahedron27",
        [[0, 3, 7, 4], [1, 2, 6, 5], [0, 1, 5, 4], [3, 2, 6, 7], [0, 1, 2, 3], [4, 5, 6, 7], list(range(8))],
    ),
}
_EDGES = {
    "quad8": [(0, 1), (1, 2), (2, 3), (3, 0)],
    "hexahedron20": [
        (0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7),
    ],
}  # fmt: skip
_DIMENSIONS = {"line": 1, "triangle": 2, "quad": 2, "tetra": 3, "hexahedron": 3, "wedge": 3, "pyramid": 3}
_OF_FEBIO = {"tri": 2, "tet": 3, "pyra": 3}
_CORNERS = {
    "line": 2, "tri": 3, "triangle": 3, "quad": 4, "tetra": 4, "tet": 4, "pyramid": 5, "pyra": 5, "wedge": 6,
    "hexahedron": 8,
}  # fmt: skip


def count_of(shape: str) -> int:
    """Number of nodes of a cell or facet."""
    return _CORNERS.get(shape) or int(shape.lstrip("abcdefghijklmnopqrstuvwxyz"))


def dimension(shape: str) -> int:
    """Dimension of a cell; 0 of what is no curve, face or volume."""
    return _DIMENSIONS.get(plain(shape), _OF_FEBIO.get(plain(shape), 0))


def plain(shape: str) -> str:
    """Type of a cell or facet whatever its number of nodes."""
    return shape.rstrip("0123456789")


def quadratic(shape: str) -> bool:
    """Whether a curve, face or volume has nodes between its corners."""
    return dimension(shape) > 0 and count_of(shape) > _CORNERS[plain(shape)]


def usable(shape: str) -> bool:
    """Whether a mesh can be made of cells of a type."""
    return shape in USABLE or shape in _INCOMPLETE


def instead(shape: str) -> str:
    """What to use in place of cells of which no mesh can be made."""
    if shape.startswith(("wedge", "pyramid")):
        return (
            "use tetrahedra, or hexahedra; in gmsh without Recombine, or extruded from a surface that is recombined "
            "into quadrilaterals"
        )
    return "use tetrahedra, hexahedra, triangles or quadrilaterals of first or second order"


def corners(shape: str, nodes: Indices) -> Indices:
    """The corners among the nodes of cells or facets, shape (cells, corners)."""
    return nodes[:, : _CORNERS[plain(shape)]]


def completed(shape: str, nodes: Indices, points: Floats) -> tuple[str, Indices, Floats]:
    """Cells with nodes inside of their faces; of cells that lack them the same in shape that have them.

    Args:
        shape: Type of the cells.
        nodes: Their nodes, shape (cells, nodes of a cell).
        points: Positions of all nodes.

    Returns:
        Type, nodes, and positions of all nodes, new ones at the end.
    """
    if shape not in _INCOMPLETE:
        return shape, nodes, points
    full, faces = _INCOMPLETE[shape]
    first = nodes.shape[1] - len(_EDGES[shape])
    for size in sorted({len(face) for face in faces}):
        keys, places = [], []
        for face in (face for face in faces if len(face) == size):
            mids = [first + i for i, ends in enumerate(_EDGES[shape]) if set(ends) <= set(face)]
            share = size / 4
            keys.append(np.sort(nodes[:, face], axis=1))
            places.append(
                (1 + share) * points[nodes[:, mids]].mean(axis=1) - share * points[nodes[:, face]].mean(axis=1)
            )
        # neighbours have the node of their face in common
        _, one, which = np.unique(np.concatenate(keys), axis=0, return_index=True, return_inverse=True)
        nodes = np.column_stack([nodes, len(points) + which.reshape(len(keys), -1).T])
        points = np.concatenate([points, np.concatenate(places)[one]])
    return full, nodes, points


def in_order_of_dolfinx(shape: str, nodes: Indices) -> Indices:
    """Nodes of cells that can be used, from the order of VTK."""
    cell, _, count = USABLE[shape]
    return nodes[:, cpp.io.perm_vtk(getattr(CellType, cell), count)]


def in_order_of_vtk(cell: str, nodes: NDArray[np.integer]) -> tuple[str, Indices]:
    """Type, as meshio calls it, and nodes in the order of VTK of cells of dolfinx.

    Args:
        cell: Cell as dolfinx calls it; of an interval the type is a line.
        nodes: Nodes of the cells, corners first; of more than degree 2 the corners are taken.
    """
    known = {count: shape for shape, (name, degree, count) in USABLE.items() if name == cell and degree < 3}
    if cell == "interval":
        return "line", nodes[:, :2].astype(np.int64)
    count = nodes.shape[1] if nodes.shape[1] in known else min(known)
    order = np.argsort(cpp.io.perm_vtk(getattr(CellType, cell), count))
    return known[count], nodes[:, :count][:, order].astype(np.int64)


def from_gmsh(shape: str, nodes: Indices) -> Indices:
    """Nodes of cells in the order of VTK, from that of gmsh."""
    full = _INCOMPLETE[shape][0] if shape in _INCOMPLETE else shape
    if full not in USABLE:
        return nodes
    cell, _, count = USABLE[full]
    kind = getattr(CellType, cell)
    order = np.asarray(cpp.io.perm_gmsh(kind, count))[np.argsort(cpp.io.perm_vtk(kind, count))]
    return nodes[:, order[: nodes.shape[1]]]
