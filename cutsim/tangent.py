"""The tangent matrix and how it is filled."""

from collections.abc import Sequence

import numpy as np
from dolfinx import fem, la
from dolfinx.fem import petsc
from numpy.typing import NDArray
from petsc4py import PETSc

from cutsim.preconditioners import rigid_body_modes


class Tangent:
    """PETSc matrix of a bilinear form on one space with itself. Every method is collective.

    On one rank PETSc works on the arrays of a dolfinx matrix, into which the cells are inserted in half the time; on
    several ranks dolfinx inserts into PETSc's own matrix.

    Args:
        a: The compiled form.
        V: Its space; displacements give the matrix their rigid-body modes as near-nullspace.
        symmetric: Whether it is symmetric.

    Attributes:
        A: The matrix.
    """

    def __init__(self, a: fem.Form, V: fem.FunctionSpace, symmetric: bool) -> None:
        self._a = a
        bs = V.dofmap.index_map_bs
        if V.mesh.comm.size == 1:
            self._csr = fem.create_matrix(a, block_mode=la.BlockMode.expanded)
            n = len(self._csr.indptr) - 1
            arrays = self._csr.indptr.astype(PETSc.IntType), self._csr.indices, self._csr.data
            self.A = PETSc.Mat().createAIJWithArrays((n, n), arrays, comm=V.mesh.comm)
            self.A.setBlockSize(bs)
        else:
            self._csr = None
            self.A = petsc.create_matrix(a)
        self.A.setOption(PETSc.Mat.Option.SYMMETRIC, symmetric)
        if bs == V.mesh.geometry.dim > 1:
            self.A.setNearNullSpace(rigid_body_modes(V))
        self._diagonal = self.A.createVecRight()

    def assemble(self, bcs: Sequence[fem.DirichletBC]) -> None:
        """Fill the matrix at the present state; constrained rows and columns are those of the identity."""
        if self._csr is None:
            self.A.zeroEntries()
            petsc.assemble_matrix(self.A, self._a, bcs)
        else:
            self._csr.set_value(0.0)
            fem.assemble_matrix(self._csr, self._a, bcs)
        self.A.assemble()
        self.A.getDiagonal(self._diagonal)

    @property
    def diagonal(self) -> NDArray[np.float64]:
        """Owned part of the diagonal; zero before the first assembly."""
        return self._diagonal.array_r

    @property
    def finite(self) -> bool:
        """Whether there is neither NaN nor infinity on the diagonal."""
        return bool(np.isfinite(self._diagonal.sum()))

    def destroy(self) -> None:
        """Free the PETSc objects."""
        self.A.destroy()
        self._diagonal.destroy()
