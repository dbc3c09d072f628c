"""Surfaces of parts of a mesh, as tools need them."""

from collections.abc import Iterable

import numpy as np

from cutsim.base.arrays import Array
from cutsim.readers.facets import rows_in
from cutsim.readers.mesh_data import Block, Indices, MeshData
from cutsim.readers.shapes import dimension, plain

# outward facets by the corners of a cell, as meshio calls it
_FACETS: dict[str, tuple[tuple[int, ...], ...]] = {
    "tetra": ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)),
    "hexahedron": ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
    "wedge": ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    "pyramid": ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
    "triangle": ((0, 1, 2),),
    "quad": ((0, 1, 2, 3),),
}
# volume of a cell over its facet times the distance of their middles
_FILL = {"tetra": 4 / 3, "pyramid": 4 / 3}
_PRISM = 2.0
_SPACE = 3
_NONE: Indices = np.empty((0, 4), dtype=np.int64)


def outer_triangles(mesh: MeshData, parts: Iterable[str]) -> Indices | None:
    """Triangles of the outer surface of some parts, or None if it is not closed.

    Args:
        mesh: The mesh.
        parts: Names of the parts.

    Returns:
        Rows of their corners in the points of the mesh, shape (triangles, 3).
    """
    wanted = set(parts)
    facets = np.concatenate([_NONE, *(_facets(block) for block in mesh.blocks if block.name in wanted)])
    _, first, count = np.unique(np.sort(facets, axis=1), axis=0, return_index=True, return_counts=True)
    outer = facets[np.sort(first[count == 1])]
    triangles = np.concatenate([outer[:, :3], outer[outer[:, 3] >= 0][:, [0, 2, 3]]])
    return triangles if _closed(triangles) else None


def _facets(block: Block) -> Indices:
    """Corners of the facets of each element, shape (facets, 4); of a triangle the last one is −1."""
    rows = [block.nodes[:, list(facet)] for facet in _FACETS.get(plain(block.shape), ())]
    return np.concatenate([_NONE, *(np.pad(row, ((0, 0), (0, 4 - row.shape[1])), constant_values=-1) for row in rows)])


def _closed(triangles: Indices) -> bool:
    """Whether each edge belongs to two triangles."""
    if not len(triangles):
        return False
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    return bool((np.unique(edges, axis=0, return_counts=True)[1] == 2).all())


def obj_text(points: Array, triangles: Indices) -> str:
    """A surface as text of an OBJ file."""
    used, numbers = np.unique(triangles, return_inverse=True)
    lines = [f"v {x:.12g} {y:.12g} {z:.12g}" for x, y, z in points[used]]
    lines += [f"f {a} {b} {c}" for a, b, c in numbers.reshape(-1, 3) + 1]
    return "\n".join(lines) + "\n"


def mean_size(mesh: MeshData, surface: str) -> float:
    """Mean length of the edges of the facets of a set [length]."""
    lengths = [
        np.linalg.norm(mesh.points[facets] - mesh.points[np.roll(facets, 1, axis=1)], axis=2).ravel()
        for facets in mesh.facet_sets[surface]
    ]
    return float(np.concatenate(lengths).mean()) if lengths else 1.0


def height_behind(mesh: MeshData, surface: str) -> float:
    """Height of the elements behind the facets of a set, as if they were bricks [length].

    It is the volume of an element over the area of its facet, the inverse of which is averaged; that of facets without
    elements is their size.
    """
    found = np.concatenate([np.empty(0), *(_ratios(mesh, facets) for facets in mesh.facet_sets[surface])])
    return float(1 / found.mean()) if len(found) else mean_size(mesh, surface)


def _ratios(mesh: MeshData, facets: Indices) -> Array:
    """Area over volume of the elements on some facets [1/length]."""
    wanted, nodes, found = np.sort(facets, axis=1), np.unique(facets), [np.empty(0)]
    for block in (block for block in mesh.blocks if dimension(block.shape) == _SPACE):
        kind = plain(block.shape)
        near = block.nodes[np.isin(block.nodes, nodes).sum(axis=1) >= facets.shape[1]]
        for local in (list(facet) for facet in _FACETS.get(kind, ()) if len(facet) == facets.shape[1]):
            behind = near[rows_in(np.sort(near[:, local], axis=1), wanted)]
            across = mesh.points[behind[:, local]].mean(axis=1) - mesh.points[behind].mean(axis=1)
            found.append(1 / (_FILL.get(kind, _PRISM) * np.linalg.norm(across, axis=1)))
    return np.concatenate(found)
