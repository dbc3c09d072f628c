"""Triangulations of real tools: closed surfaces of triangles or segments, from files or arrays (docs/theory.md §4)."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from cutsim.base.checks import positive, require, require_number
from cutsim.base.log import collective_logger
from cutsim.base.signatures import checked
from cutsim.readers.meshio_files import open_mesh

logger = collective_logger(__name__)

#: Distance below which two nodes are one, as a fraction of the size of the surface: formats repeat rounded nodes.
SAME = 1e-7
# cells of a file that are facets, by dimension
_KINDS = {3: "triangle", 2: "line"}


@checked
@dataclass(frozen=True, eq=False)
class Triangulation:
    """Closed surface of a rigid body: triangles in 3-D, segments in 2-D.

    Nodes that coincide become one, facets without extent are left out, and a surface that is inside out is turned, so
    that normals point outwards: segments run counterclockwise, triangles do so as seen from outside.

    Args:
        points: Nodes relative to the tool's reference point, shape (nodes, dimension) [length].
        facets: Nodes of each facet, shape (facets, dimension).

    Raises:
        ValueError: An array has another shape or is not finite, the surface is not closed, or neighbours do not agree
            on what is outside.
    """

    points: NDArray[np.float64]
    facets: NDArray[np.int64]

    def __post_init__(self) -> None:
        points, facets = np.asarray(self.points, dtype=float), np.asarray(self.facets, dtype=np.int64)
        shaped = points.ndim == 2 and points.shape[1] in _KINDS and len(points) > 0
        require("points", points.shape, shaped, "an array of shape (nodes, 2 or 3)")
        require("points", "not finite", bool(np.isfinite(points).all()), "finite")
        dim = points.shape[1]
        require("facets", facets.shape, facets.shape == (len(facets), dim), f"an array of shape (facets, {dim})")
        known = bool(((facets >= 0) & (facets < len(points))).all())
        require("facets", "numbers of nodes", known, f"in 0 … {len(points) - 1}")
        points, facets = _merged(points, facets)
        _check_closed(facets)
        volume = np.linalg.det(points[facets] - points.mean(axis=0)).sum()
        if volume < 0:
            logger.info("the surface of the tool is inside out: its %d facets are turned", len(facets))
            facets = facets[:, ::-1]
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "facets", facets)

    @classmethod
    @checked
    def read(cls, file: Path | str, scale: float = 1.0, *, comm: MPI.Comm = MPI.COMM_WORLD) -> "Triangulation":
        """Read a surface on the first rank: STL, OBJ, PLY and whatever else meshio reads. Collective.

        Args:
            file: The file. Of triangles it takes these, in 3-D; otherwise segments, in the plane of x and y.
            scale: Length in the units of the simulation of one unit of the file, > 0.
            comm: Ranks that get the surface.

        Raises:
            ValueError: The scale is not positive, the file cannot be read, or its surface is refused.
        """
        require_number("scale", scale, positive)
        surface, problem = None, ""
        if comm.rank == 0:
            try:
                points, facets = _load(file)
                surface = cls(scale * points, facets)
            except ValueError as error:
                problem = str(error)
        surface, problem = comm.bcast((surface, problem))
        if surface is None:
            raise ValueError(f"file = {file}: {problem}")
        return surface

    @property
    def corners(self) -> NDArray[np.float64]:
        """Nodes of each facet, shape (facets, nodes, dimension) [length]."""
        return np.asarray(self.points[self.facets])


def _load(file: Path | str) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Nodes and facets of a file."""
    mesh = open_mesh(file)
    kinds = sorted(mesh.cells_dict)
    dim = 3 if _KINDS[3] in kinds else 2
    require("cells", kinds, _KINDS[dim] in kinds and "quad" not in kinds, "triangles, or segments in 2-D")
    return np.asarray(mesh.points, dtype=float)[:, :dim], mesh.cells_dict[_KINDS[dim]].astype(np.int64)


def _merged(points: NDArray[np.float64], facets: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """The surface with one node at a place, and without facets that have shrunk to less than a facet."""
    size = float(np.ptp(points, axis=0).max())
    i, j = cKDTree(points).query_pairs(SAME * size, output_type="ndarray").T
    same = coo_matrix((np.ones(len(i)), (i, j)), shape=(len(points), len(points)))
    places = connected_components(same, directed=False)[1]
    used, facets = np.unique(places[facets], return_inverse=True)
    facets = facets.reshape(-1, points.shape[1])
    distinct = np.diff(np.sort(facets, axis=1), axis=1).all(axis=1)
    return points[np.unique(places, return_index=True)[1][used]], facets[distinct]


def _check_closed(facets: NDArray[np.int64]) -> None:
    """Refuse a surface with an edge that does not join two facets, or joins two that disagree on the outside."""
    dim = facets.shape[1]
    # edges of a triangle, ends of a segment: as its boundary passes through them
    ridges = np.concatenate([np.roll(facets, -k, axis=1)[:, : dim - 1] for k in range(dim)])
    if dim == 3:
        signs = np.sign(ridges[:, 1] - ridges[:, 0])
    else:
        signs = np.repeat([-1, 1], len(facets))
    places, counts = np.unique(np.sort(ridges, axis=1), axis=0, return_inverse=True, return_counts=True)[1:]
    single = int((counts != 2).sum())
    require("facets", f"{single} edges of other than two facets", len(facets) > 0 and single == 0, "a closed surface")
    turned = int(np.count_nonzero(np.bincount(places.ravel(), weights=signs)))
    require("facets", f"{turned} edges between facets of opposite sense", turned == 0, "of the same sense everywhere")
