"""Connected pieces of a cracked space: parts of the body that share no node with each other."""

import numpy as np
from dolfinx import fem, la
from dolfinx.common import IndexMap
from dolfinx.mesh import Mesh
from mpi4py import MPI
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from cutsim.base.compat import geometry_nodes


def connected_pieces(V: fem.FunctionSpace) -> tuple[int, NDArray[np.int32]]:
    """Pieces of a space whose cells hang together by shared dofs. Collective.

    Args:
        V: The space, cracked or not.

    Returns:
        The number of pieces, the same on all ranks, and the piece of each local (blocked) dof, ghosts included.
    """
    return _pieces(V.mesh.comm, V.dofmap.index_map, V.dofmap.list)


def mesh_pieces(mesh: Mesh) -> tuple[int, NDArray[np.int32]]:
    """Pieces of a mesh whose cells hang together by shared nodes, and the piece of each local node. Collective."""
    return _pieces(mesh.comm, mesh.geometry.index_map(), geometry_nodes(mesh))


def _pieces(comm: MPI.Comm, index_map: IndexMap, cells: NDArray[np.int32]) -> tuple[int, NDArray[np.int32]]:
    """Pieces of the indices of cells, a row of them for each local cell."""
    dofs = index_map.size_local + index_map.num_ghosts
    # every dof of a cell hangs together with its first one
    first = np.repeat(cells[:, :1], cells.shape[1], axis=1)
    count, local = _components(dofs, first.ravel(), cells.ravel())
    counts = comm.allgather(count)
    number = la.vector(index_map, dtype=np.int64)
    number.array[:] = sum(counts[: comm.rank]) + local
    mine = number.array[index_map.size_local :].copy()
    number.scatter_forward()
    theirs = number.array[index_map.size_local :]
    here, there = (np.concatenate(comm.allgather(ends)) for ends in (mine, theirs))
    total, labels = _components(sum(counts), here, there)
    return total, labels[sum(counts[: comm.rank]) + local].astype(np.int32)


def _components(size: int, first: NDArray[np.integer], second: NDArray[np.integer]) -> tuple[int, NDArray[np.int32]]:
    graph = coo_array((np.ones(len(first), dtype=bool), (first, second)), shape=(size, size))
    count, labels = connected_components(graph, directed=False)
    return int(count), labels
