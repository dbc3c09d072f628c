"""Mesh sizes along and across facets, for penalties and for warnings about coarse meshes."""

import math

import numpy as np
from dolfinx import la
from dolfinx.mesh import Mesh, entities_to_geometry
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.base.assembly import box
from cutsim.base.compat import geometry_nodes


def incidence(mesh: Mesh, dim: int, sub: int) -> NDArray[np.int32]:
    """Entities of a lower dimension on each local entity, shape (entities, number on each); all are of one type."""
    mesh.topology.create_connectivity(dim, sub)
    table = mesh.topology.connectivity(dim, sub)
    # a rank may have none at all
    return table.array.reshape(table.num_nodes, int(table.offsets[1]) if table.num_nodes else 1)


def facet_size(mesh: Mesh, facets: NDArray[np.int32]) -> NDArray[np.float64]:
    """Shortest edge of each of the given local facets: the mesh size for a front that crosses them. Collective."""
    return _shortest_edge(mesh, mesh.topology.dim - 1, facets)


def normal_size(mesh: Mesh, facets: NDArray[np.int32]) -> NDArray[np.float64]:
    """Size normal to a crack or surface, the h of a penalty E/h. Collective.

    For each of the given local facets, taken as plane, the extent of its cells normal to it; of two cells the
    smaller extent. A facet that one rank gives must be given by all ranks that hold it, as tags do.
    """
    tdim = mesh.topology.dim
    mesh.topology.create_connectivity(tdim - 1, tdim)
    sizes = la.vector(mesh.topology.index_map(tdim - 1))
    if len(facets) > 0:  # entities_to_geometry of dolfinx 0.9 divides by their number
        sizes.array[facets] = _normal_extent(mesh, facets)
    sizes.scatter_forward()  # of a ghost facet this rank may hold one cell only, its owner holds both
    return sizes.array[facets]


def global_range(comm: MPI.Comm, values: NDArray[np.float64]) -> tuple[float, float]:
    """Smallest and largest of the values of all ranks. Collective.

    Raises:
        ValueError: On all ranks, if no rank has a value.
    """
    low = comm.allreduce(values.min(initial=math.inf), MPI.MIN)
    high = comm.allreduce(values.max(initial=-math.inf), MPI.MAX)
    if low > high:
        raise ValueError("values is empty on every rank, at least one value is needed")
    return float(low), float(high)


def largest_extent(mesh: Mesh) -> float:
    """Largest extent of a mesh along an axis [length]. Collective."""
    low, high = box(mesh.comm, mesh.geometry.x)
    return float((high - low).max())


def _shortest_edge(mesh: Mesh, dim: int, entities: NDArray[np.int32]) -> NDArray[np.float64]:
    topology = mesh.topology
    topology.create_entities(1)
    topology.create_connectivity(1, topology.dim)
    if dim == 1:
        return mesh.h(1, entities)
    per_entity = incidence(mesh, dim, 1)[entities]
    return mesh.h(1, per_entity.ravel()).reshape(per_entity.shape).min(axis=1)


def _normal_extent(mesh: Mesh, facets: NDArray[np.int32]) -> NDArray[np.float64]:
    """Smallest extent normal to each facet among those of its cells that this rank holds."""
    tdim = mesh.topology.dim
    neighbours = [mesh.topology.connectivity(tdim - 1, tdim).links(facet) for facet in facets]
    rows = np.repeat(np.arange(len(facets)), [len(cells) for cells in neighbours])
    x = mesh.geometry.x
    corners = x[entities_to_geometry(mesh, tdim - 1, facets)]
    along = corners[:, 1] - corners[:, 0]
    across = corners[:, 2] - corners[:, 0] if tdim == 3 else np.array([0.0, 0.0, 1.0])
    normals = np.cross(along, across)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    from_facet = x[geometry_nodes(mesh)[np.concatenate(neighbours)]] - corners[rows, :1]
    heights = np.abs(np.einsum("nvi,ni->nv", from_facet, normals[rows])).max(axis=1)
    extents = np.full(len(facets), np.inf)
    np.minimum.at(extents, rows, heights)
    return extents
