"""Assembly of compiled forms to reduced numbers and owned arrays. Every function is collective."""

from collections.abc import Sequence

import numpy as np
from dolfinx import fem, la
from dolfinx.common import IndexMap
from dolfinx.cpp.la.petsc import create_matrix
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from cutsim.base.arrays import Array
from cutsim.base.compat import sparsity_pattern
from cutsim.base.lifetime import petsc_comm


def integrate(form: fem.Form) -> float:
    """Value of a scalar form, summed over ranks."""
    return float(form.mesh.comm.allreduce(fem.assemble_scalar(form), op=MPI.SUM))


def nodal_forces(form: fem.Form) -> Array:
    """Vector of a linear form: the owned entries, contributions of other ranks added."""
    b = fem.assemble_vector(form)
    b.scatter_reverse(la.InsertMode.add)
    return b.array[: b.index_map.size_local * b.block_size].copy()


def owned_vector(index_map: IndexMap, bs: int) -> PETSc.Vec:
    """PETSc vector of the owned dofs of a map, all zero; the caller destroys it."""
    vector = PETSc.Vec().create(petsc_comm(index_map.comm))
    vector.setSizes((index_map.size_local * bs, index_map.size_global * bs), bsize=bs)
    vector.setUp()
    return vector


def empty_matrix(forms: Sequence[fem.Form]) -> PETSc.Mat:
    """PETSc matrix with the pattern of the sum of bilinear forms on the same spaces, all zero. Collective."""
    return create_matrix(petsc_comm(forms[0].mesh.comm), sparsity_pattern(forms))


def global_dot(comm: MPI.Comm, a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """Scalar product of two distributed arrays of owned entries."""
    return float(comm.allreduce(float(a @ b), op=MPI.SUM))


def resultant(comm: MPI.Comm, forces: NDArray[np.float64], gdim: int) -> Array:
    """Sum of nodal forces (owned entries, blocked by component): a force vector."""
    return np.asarray(comm.allreduce(forces.reshape(-1, gdim).sum(axis=0), op=MPI.SUM))


def summed(comm: MPI.Comm, parts: NDArray[np.float64]) -> Array:
    """Sum of the arrays of all ranks, of one shape. Collective."""
    total = np.array(parts, dtype=float)
    comm.Allreduce(MPI.IN_PLACE, total, op=MPI.SUM)
    return total


def box(comm: MPI.Comm, points: Array) -> tuple[Array, Array]:
    """Lowest and highest corner of the box around the points of all ranks, one a row [length]."""
    low, high = (np.array(pick(points, axis=0, initial=far)) for pick, far in ((np.min, np.inf), (np.max, -np.inf)))
    comm.Allreduce(MPI.IN_PLACE, low, op=MPI.MIN)
    comm.Allreduce(MPI.IN_PLACE, high, op=MPI.MAX)
    return low, high


def add_blocks(A: PETSc.Mat, dofs: NDArray[np.int64], blocks: Array, columns: NDArray[np.int64] | None = None) -> None:
    """Add dense blocks to a matrix, on rows of any rank. The caller assembles it.

    Args:
        A: The matrix.
        dofs: Global dofs of the rows of each block, shape (blocks, n).
        blocks: Shape (blocks, n, m).
        columns: Global dofs of the columns, shape (blocks, m); None for those of the rows.
    """
    columns = dofs if columns is None else columns
    n, m = dofs.shape[1], columns.shape[1]
    rows, columns = dofs.astype(PETSc.IntType).ravel(), np.repeat(columns, n, axis=0).astype(PETSc.IntType)
    # every row of a block is a row of a matrix in compressed rows, in which rows may repeat
    starts = np.arange(0, columns.size + 1, m, dtype=PETSc.IntType)
    A.setValuesIJV(starts, columns.ravel(), blocks.ravel(), addv=PETSc.InsertMode.ADD, rowmap=rows)


def moment(comm: MPI.Comm, forces: NDArray[np.float64], arms: NDArray[np.float64], gdim: int) -> Array:
    """Moment Σ arm × force of nodal forces: three components in 3-D, the one about the normal in 2-D.

    Args:
        comm: Communicator of the distributed arrays.
        forces: Owned nodal forces, blocked by component.
        arms: Positions relative to the reference point, shape (owned nodes, 3) [length].
        gdim: Geometric dimension.
    """
    padded = np.zeros((len(forces) // gdim, 3))
    padded[:, :gdim] = forces.reshape(-1, gdim)
    local = np.cross(arms, padded).sum(axis=0)
    total = np.asarray(comm.allreduce(local, op=MPI.SUM))
    return total if gdim == 3 else total[2:]
