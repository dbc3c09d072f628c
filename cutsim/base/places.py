"""Places of the entries of an array, by numbers that do not depend on the number of ranks.

Degrees of freedom are numbered along the cells, and the cells in the order of the nodes that they had when the mesh was
made.  Both are the same on any number of ranks, also where a space is split along cracks.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from dolfinx import cpp, fem
from dolfinx.mesh import Mesh
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.base.compat import geometry_nodes

# distance over the size of a facet up to which two of its points have the same coordinate
_SAME = 1e-6
#: Attribute of a space: number of each local dof.
_NUMBERS = "numbers_of_dofs"

#: Local cells of a mesh, ghosts included, and the dofs of each in an order that does not depend on the ranks.
Cells = Callable[[], tuple[NDArray[np.int32], NDArray[np.int32]]]


@dataclass(frozen=True, eq=False)
class Places:
    """Places of the entries of an array: dofs of a function space.

    Attributes:
        space: The space.
        dofs: Local dof of each entry, components counted; its shape is that of some axes of the array.
        axis: The first of these axes.
        cells: Cells with dofs of the space and these dofs; by default all cells, as they are.
    """

    space: fem.FunctionSpace
    dofs: NDArray[np.integer[Any]]
    axis: int = 0
    cells: Cells | None = None

    @classmethod
    def of(cls, space: fem.FunctionSpace, cells: Cells | None = None) -> Self:
        """Places of the values of a function: all local dofs."""
        index_map = space.dofmap.index_map
        size = (index_map.size_local + index_map.num_ghosts) * space.dofmap.index_map_bs
        return cls(space, np.arange(size), cells=cells)

    @classmethod
    def owned(cls, space: fem.FunctionSpace) -> Self:
        """Places of forces: owned dofs."""
        return cls(space, np.arange(space.dofmap.index_map.size_local * space.dofmap.index_map_bs))

    def gather(self, values: NDArray[Any]) -> NDArray[Any] | None:
        """All values on the first rank in the order of their numbers, None on others. Collective.

        Each comes from the rank that owns its dof.
        """
        dofs, owned = self.dofs.ravel(), self.space.dofmap.index_map.size_local * self.space.dofmap.index_map_bs
        mine, rows = dofs < owned, self._rows(values)
        parts = self._comm.gather((self._numbers()[mine], rows[mine]))
        if parts is None:
            return None
        numbers, found = (np.concatenate(part) for part in zip(*parts, strict=True))
        _, order = np.unique(numbers, return_index=True)
        assert len(order) == len(numbers), "a place is owned twice"
        return np.asarray(found[order])

    def scatter(self, values: NDArray[Any] | None) -> NDArray[Any]:
        """The values of this rank, ghosts included, from those that `gather` has given to the first rank. Collective.

        Raises:
            ValueError: There are not as many values as there are places, on all ranks.
        """
        wanted, parts, sizes = self._comm.gather(self._numbers()), None, None
        if wanted is not None and values is not None:
            known = np.unique(np.concatenate(wanted))
            sizes = len(values), len(known)
            parts = [values[np.searchsorted(known, some)] for some in wanted] if sizes[0] == sizes[1] else None
        given, needed = self._comm.bcast(sizes)
        if given != needed:
            raise ValueError(f"{given} values in place of {needed}")
        rows = self._comm.scatter(parts)
        shaped = rows.reshape(*self.dofs.shape, *rows.shape[1:])
        return np.ascontiguousarray(np.moveaxis(shaped, self._axes[0], self._axes[1]))

    def _rows(self, values: NDArray[Any]) -> NDArray[Any]:
        """The array with one row for each place."""
        moved = np.moveaxis(values, self._axes[1], self._axes[0])
        assert moved.shape[: self.dofs.ndim] == self.dofs.shape, f"{moved.shape} in place of {self.dofs.shape}"
        return moved.reshape(self.dofs.size, *moved.shape[self.dofs.ndim :])

    @property
    def _axes(self) -> tuple[range, range]:
        """The first axes, and those that the places have in the array."""
        count = self.dofs.ndim
        return range(count), range(self.axis, self.axis + count)

    @property
    def _comm(self) -> MPI.Comm:
        comm: MPI.Comm = self.space.mesh.comm
        return comm

    def _numbers(self) -> NDArray[np.int64]:
        """Number of each place. Collective."""
        if _NUMBERS not in vars(self.space):
            vars(self.space)[_NUMBERS] = _numbered(self.space, self.cells or self._all_cells)
        numbers: NDArray[np.int64] = vars(self.space)[_NUMBERS]
        size, dofs = self.space.dofmap.index_map_bs, self.dofs.ravel()
        return np.asarray(numbers[dofs // size] * size + dofs % size)

    def _all_cells(self) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        dofs = self.space.dofmap.list
        return np.arange(len(dofs), dtype=np.int32), dofs


def _numbered(space: fem.FunctionSpace, cells_with_dofs: Cells) -> NDArray[np.int64]:
    """Number of each local dof (block): the place at which it first appears along the cells. Collective."""
    mesh, index_map = space.mesh, space.dofmap.index_map
    comm: MPI.Comm = mesh.comm
    cells, dofs = cells_with_dofs()
    owned = cells < mesh.topology.index_map(mesh.topology.dim).size_local
    table = index_map.local_to_global(dofs[owned].ravel().astype(np.int32)).reshape(-1, dofs.shape[1])
    parts = comm.gather((corners(mesh, cells[owned])[0], table))
    size = index_map.size_local + index_map.num_ghosts
    wanted = comm.gather(index_map.local_to_global(np.arange(size, dtype=np.int32)))
    if parts is None or wanted is None:
        return np.asarray(comm.scatter(None))
    keys, tables = (np.concatenate(part) for part in zip(*parts, strict=True))
    seen, first = np.unique(tables[np.lexsort(keys.T)].ravel(), return_index=True)
    numbers = np.full(index_map.size_global, -1, dtype=np.int64)
    numbers[seen[np.argsort(first)]] = np.arange(len(seen))
    return np.asarray(comm.scatter([numbers[some] for some in wanted]))


def corners(mesh: Mesh, cells: NDArray[np.int32]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Numbers that the corners of cells had when the mesh was made, ascending, and their positions.

    Returns:
        Shapes (cells, corners) and (cells, corners, dimension).
    """
    count = cpp.mesh.cell_num_entities(mesh.topology.cell_type, 0)
    nodes = geometry_nodes(mesh)[cells, :count]
    numbers = mesh.geometry.input_global_indices[nodes].reshape(-1, count)
    order = np.argsort(numbers, axis=1)
    ascending = np.take_along_axis(nodes, order, axis=1)
    return np.take_along_axis(numbers, order, axis=1), mesh.geometry.x[ascending, : mesh.geometry.dim]


def facet_order(x: NDArray[np.float64], corners: NDArray[np.float64]) -> NDArray[np.intp]:
    """Order of the points of each facet by their place between its corners.

    Args:
        x: Points, shape (facets, points, dimension).
        corners: Corners of the facets in an order that does not depend on the ranks, shape (facets, corners,
            dimension).

    Returns:
        Shape (facets, points).
    """
    edges = corners[:, 1 : x.shape[-1]] - corners[:, :1]
    across = np.einsum("fqi,fki->fqk", x - corners[:, :1], edges)
    places = np.einsum("fkl,fql->kfq", np.linalg.inv(np.einsum("fki,fli->fkl", edges, edges)), across)
    key = np.zeros(x.shape[:2], dtype=np.int64)
    for coordinate in places:
        key = key * x.shape[1] + _ranks(coordinate)
    return np.argsort(key, axis=1)


def _ranks(values: NDArray[np.float64]) -> NDArray[np.int64]:
    """Rank of each value in its row; those that differ by rounding have the same."""
    order = np.argsort(values, axis=1)
    steps = np.diff(np.take_along_axis(values, order, axis=1), axis=1, prepend=-np.inf) > _SAME
    ranks = np.empty(values.shape, dtype=np.int64)
    np.put_along_axis(ranks, order, np.cumsum(steps, axis=1) - 1, axis=1)
    return ranks
