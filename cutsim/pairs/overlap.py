"""Initial overlap: points of a surface that are inside another body from the start (docs/theory.md §3.5)."""

import numpy as np
from dolfinx import geometry
from dolfinx.mesh import Mesh
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.base.compat import geometry_nodes
from cutsim.fields.pieces import mesh_pieces
from cutsim.pairs.pairing import Array


def inside_body(mesh: Mesh, points: Array, cells: NDArray[np.int32], others: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Which points of a body lie in other bodies in the reference configuration. Collective.

    A body is a connected piece of the mesh: no point of it is in itself.

    Args:
        mesh: The mesh.
        points: Points of this rank, shape (points, dimension).
        cells: Local cell to which each of them belongs.
        others: Local cells of the other bodies, some of each on any rank.
    """
    tdim, comm = mesh.topology.dim, mesh.comm
    of_cells = mesh_pieces(mesh)[1][geometry_nodes(mesh)[:, 0]]
    own, wanted = of_cells[cells], np.concatenate(comm.allgather(np.unique(of_cells[others])))
    counts = comm.allgather(len(points))
    x, pieces = (np.concatenate(comm.allgather(part)) for part in (points, own))
    x3 = np.zeros((len(x), 3))
    x3[:, : x.shape[1]] = x
    bodies = np.flatnonzero(np.isin(of_cells[: mesh.topology.index_map(tdim).size_local], wanted)).astype(np.int32)
    inside = np.zeros(len(x), dtype=np.int32)
    if len(bodies):
        tree = geometry.bb_tree(mesh, tdim, entities=bodies)
        found = geometry.compute_colliding_cells(mesh, geometry.compute_collisions_points(tree, x3), x3)
        rows = np.repeat(np.arange(len(x)), np.diff(found.offsets))
        inside[rows[of_cells[found.array] != pieces[rows]]] = 1
    comm.Allreduce(MPI.IN_PLACE, inside, op=MPI.MAX)
    start = sum(counts[: comm.rank])
    return inside[start : start + len(points)] > 0


def inside_surface(points: Array, facets: Array) -> NDArray[np.bool_]:
    """Which points lie in a closed surface of segments or triangles with outward normals, by its winding number.

    Args:
        points: FacetShape (points, dimension).
        facets: Nodes of the facets, shape (facets, nodes, dimension).
    """
    inside = [np.empty(0, dtype=bool)]
    # the angles of all facets at all points are held in memory, some points at a time
    for some in np.array_split(points, 1 + len(points) * len(facets) // 1_000_000):
        r = facets[None] - some[:, None, None]
        if points.shape[1] == 2:
            a, b = r[:, :, 0], r[:, :, 1]
            angles = np.arctan2(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0], np.einsum("pfi,pfi->pf", a, b))
            inside.append(angles.sum(axis=1) > np.pi)
        else:
            d = np.linalg.norm(r, axis=-1)
            a, b, c = (r[:, :, i] for i in range(3))
            triple = np.einsum("pfi,pfi->pf", a, np.cross(b, c))
            rest = d.prod(axis=2)
            for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
                rest += np.einsum("pfi,pfi->pf", r[:, :, i], r[:, :, j]) * d[:, :, k]
            inside.append(2 * np.arctan2(triple, rest).sum(axis=1) > 2 * np.pi)
    return np.concatenate(inside)
