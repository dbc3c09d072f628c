"""Surfaces of parts of a mesh, as tools need them."""

from collections import Counter
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from cutsim.base.arrays import Array
from cutsim.readers.mesh_data import MeshData

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


def outer_triangles(mesh: MeshData, parts: Iterable[str]) -> NDArray[np.int64] | None:
    """Triangles of the outer surface of some parts, or None if it is not closed.

    Args:
        mesh: The mesh.
        parts: Names of the parts.

    Returns:
        Rows of their corners in the points of the mesh, shape (triangles, 3).
    """
    wanted, facets = set(parts), []
    for block in mesh.blocks:
        kind = "".join(c for c in block.shape if not c.isdigit())
        if block.name in wanted and kind in _FACETS:
            facets += [
                facet for nodes in block.nodes for facet in (tuple(nodes[list(f)].tolist()) for f in _FACETS[kind])
            ]
    keys = [tuple(sorted(facet)) for facet in facets]
    count = Counter(keys)
    outer = [facet for facet, key in zip(facets, keys, strict=True) if count[key] == 1]
    triangles = np.array([t for f in outer for t in ([f] if len(f) == 3 else [f[:3], (f[0], *f[2:])])], dtype=np.int64)
    return triangles if _closed(triangles) else None


def _closed(triangles: NDArray[np.int64]) -> bool:
    """Whether each edge belongs to two triangles."""
    if not len(triangles):
        return False
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    return bool((np.unique(edges, axis=0, return_counts=True)[1] == 2).all())


def obj_text(points: Array, triangles: NDArray[np.int64]) -> str:
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


def area_over_volume(mesh: MeshData, surface: str) -> float:
    """Mean over the facets of a set of their area over the volume of their cells [1/length]; 0 if it has no cells.

    It is the inverse of the height of bricks on them.
    """
    found = [ratio for facets in mesh.facet_sets[surface] for ratio in _ratios(mesh, facets)]
    return float(np.mean(found)) if found else 0.0


def _ratios(mesh: MeshData, facets: NDArray[np.int64]) -> list[float]:
    middles = {tuple(sorted(facet)): mesh.points[facet].mean(axis=0) for facet in facets.tolist()}
    nodes, ratios = np.unique(facets), []
    for block in mesh.blocks:
        kind = "".join(c for c in block.shape if not c.isdigit())
        near = np.isin(block.nodes, nodes).sum(axis=1) >= facets.shape[1]
        for cell in block.nodes[near] if kind in _FACETS and kind not in ("triangle", "quad") else ():
            own = [middles.get(tuple(sorted(cell[list(f)].tolist()))) for f in _FACETS[kind]]
            centre = mesh.points[cell].mean(axis=0)
            ratios += [
                1 / (_FILL.get(kind, _PRISM) * float(np.linalg.norm(middle - centre)))
                for middle in own
                if middle is not None
            ]
    return ratios
