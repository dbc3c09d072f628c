"""Refinement of a mesh along some of its facets, such as those of a crack, before it is distributed."""

from dataclasses import dataclass, replace

import basix
import basix.ufl
import numpy as np
from dolfinx.mesh import Mesh, RefinementOption, entities_to_geometry, refine
from mpi4py import MPI
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from cutsim.base.checks import above, positive, require, require_number
from cutsim.base.compat import cell_partitioner, create_mesh, geometry_nodes
from cutsim.base.signatures import checked
from cutsim.base.units import Length
from cutsim.readers.facets import rows_in
from cutsim.readers.mesh_data import Floats, Indices
from cutsim.readers.model import Model

# relative excess of a length that is still rounding
_ROUNDING = 1e-9
# edges are halved this often at most: a factor of a thousand
_PASSES = 10


@checked
@dataclass(frozen=True)
class Refinement:
    """Refinement of triangles or tetrahedra along groups of facets: edges that are too long are halved.

    Edges on the facets become no longer than the size; away from them sizes grow by a ratio from element to element.
    All groups are carried over.

    Args:
        groups: Names of the groups of facets.
        size: Longest edge on them, > 0 [length]; for a cut see `MeshRule`.
        growth: Ratio of the sizes of neighbouring elements, > 1.

    Raises:
        ValueError: A value is outside its range.
    """

    groups: tuple[str, ...]
    size: Length
    growth: float = 1.5

    def __post_init__(self) -> None:
        require("groups", self.groups, len(self.groups) > 0, "at least one group of facets")
        require_number("size", self.size, positive)
        require_number("growth", self.growth, above(1))

    def longest(self, distance: Floats) -> Floats:
        """Longest edge at a distance from the facets [length]: sizes that grow by a ratio add up to it."""
        return self.size + (1 - 1 / self.growth) * distance


def refined(model: Model, refinement: Refinement) -> Model:
    """A model with halved edges, on one rank.

    Raises:
        ValueError: The cells are no straight triangles or tetrahedra, or a group is missing.
    """
    straight = model.cell in ("triangle", "tetrahedron") and model.degree == 1
    kind = model.cell if model.degree == 1 else f"curved {model.cell}"
    require(
        "refine", refinement, straight, f"None for cells of the kind {kind!r}: triangles and tetrahedra can be halved"
    )
    facet = model.points.shape[1] - 1
    known = [name for dim, name in model.groups if dim == facet]
    require("refine.groups", refinement.groups, set(refinement.groups) <= set(known), f"of {', '.join(known)}")
    for _ in range(_PASSES):
        model, more = _pass(model, refinement)
        if not more:
            break
    return model


def _pass(model: Model, refinement: Refinement) -> tuple[Model, bool]:
    """Halve once what is too long; whether anything was."""
    gdim = model.points.shape[1]
    mesh = create_mesh(
        MPI.COMM_SELF, model.cells, model.points, basix.ufl.element("Lagrange", model.cell, 1, shape=(gdim,))
    )
    edges = _too_long(mesh, model, refinement)
    if not len(edges):
        return model, False
    finer, cells, facets = refine(mesh, edges, cell_partitioner(), RefinementOption.parent_cell_and_facet)
    points, nodes = finer.geometry.x[:, :gdim].copy(), geometry_nodes(finer).astype(np.int64)
    order = np.asarray(finer.topology.original_cell_index)
    parents = _Parents(mesh, np.asarray(cells)[order], np.asarray(facets).reshape(nodes.shape)[order])
    groups = {}
    for (dim, name), rows in model.groups.items():
        if dim == gdim:
            groups[dim, name] = np.flatnonzero(np.isin(parents.cells, rows))
        elif dim == 0:
            groups[dim, name] = cKDTree(points).query(model.points[rows])[1].astype(np.int64)
        else:
            groups[dim, name] = parents.facets_within(rows, nodes)
    return replace(model, points=points, cells=nodes, groups=groups), True


class _Parents:
    """Where the cells and facets of a finer mesh come from, in the numbers of the model.

    Args:
        mesh: The coarser mesh.
        cells: Its cell for each cell of the finer one.
        facets: Facet of that cell for each facet of each cell of the finer one, < 0 within it.
    """

    def __init__(self, mesh: Mesh, cells: Indices, facets: Indices) -> None:
        self.cells = np.asarray(mesh.topology.original_cell_index)[cells]
        self._inner = facets < 0
        self._local = np.asarray(basix.topology(mesh.basix_cell())[-2])
        nodes = np.asarray(mesh.geometry.input_global_indices)[geometry_nodes(mesh)][cells]
        self._corners = np.sort(nodes[np.arange(len(cells))[:, None, None], self._local[facets]], axis=2)

    def facets_within(self, rows: Indices, nodes: Indices) -> Indices:
        """Corners of the finer facets that are parts of coarser ones.

        Args:
            rows: Corners of the coarser ones.
            nodes: Corners of the finer cells.
        """
        wide = rows.shape[1]
        found = rows_in(self._corners.reshape(-1, wide), np.sort(rows, axis=1)) & ~self._inner.ravel()
        return np.unique(np.sort(nodes[:, self._local].reshape(-1, wide)[found], axis=1), axis=0)


def _too_long(mesh: Mesh, model: Model, refinement: Refinement) -> NDArray[np.int32]:
    """Edges that are longer than allowed where they are."""
    gdim = model.points.shape[1]
    along = np.unique(np.concatenate([model.groups[gdim - 1, name].ravel() for name in refinement.groups]))
    mesh.topology.create_connectivity(1, gdim)
    edges = np.arange(mesh.topology.index_map(1).size_local, dtype=np.int32)
    ends = mesh.geometry.x[entities_to_geometry(mesh, 1, edges)][..., :gdim]
    # from the nearer end, so that an edge from the facets into the body is as short as one on them
    distance = cKDTree(model.points[along]).query(ends.reshape(-1, gdim))[0].reshape(-1, 2).min(axis=1)
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    return edges[length > (1 + _ROUNDING) * refinement.longest(distance)]
