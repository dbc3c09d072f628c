"""Tangent matrix and its assembly."""

from collections.abc import Sequence

import numpy as np
from dolfinx import fem, la
from dolfinx.fem import petsc
from numpy.typing import NDArray
from petsc4py import PETSc

from cutsim.base import compat
from cutsim.base.assembly import empty_matrix
from cutsim.base.lifetime import petsc_comm
from cutsim.base.terms import Assembler
from cutsim.solvers.directions import Directions
from cutsim.solvers.preconditioners import rigid_body_modes


class Tangent:
    """PETSc matrix of bilinear forms on one space with itself. Every method is collective.

    On one rank PETSc works on the arrays of a dolfinx matrix, into which the cells are inserted in half the time; on
    several ranks dolfinx inserts into PETSc's own matrix.  Terms that assemble themselves have a matrix of their own,
    with a pattern of its own; the sum of both is a third one.

    Args:
        a: The compiled forms, whose sum counts.
        V: Their space; displacements give the matrix their rigid-body modes as near-nullspace.
        symmetric: Whether it is symmetric.
        assemblers: Forces that are no form.
        directions: Axes of the nodes, along which the matrix has its rows and columns.

    Attributes:
        A: The matrix.
        drag: Stiffness that is added to the diagonal of the free rows, owned entries, alike along all axes of a node
            that has its own; None for none [force/length].
    """

    def __init__(
        self,
        a: Sequence[fem.Form],
        V: fem.FunctionSpace,
        symmetric: bool,
        assemblers: Sequence[Assembler] = (),
        directions: Directions | None = None,
    ) -> None:
        self._a, self._V, self._symmetric, self._assemblers = tuple(a), V, symmetric, tuple(assemblers)
        self._directions = directions or Directions(V)
        self.drag: NDArray[np.float64] | None = None
        if V.mesh.comm.size == 1:
            self._csr = la.matrix_csr(compat.sparsity_pattern(self._a), block_mode=la.BlockMode.expanded)
            n = len(self._csr.indptr) - 1
            arrays = self._csr.indptr.astype(PETSc.IntType), self._csr.indices, self._csr.data
            self._forms = PETSc.Mat().createAIJWithArrays((n, n), arrays, comm=petsc_comm(V.mesh.comm))
            self._forms.setBlockSize(V.dofmap.index_map_bs)
        else:
            self._csr = None
            self._forms = empty_matrix(self._a)
        self._added: PETSc.Mat | None = None
        self.A = self._sum = self._forms
        self._axes = self._directions.matrix() if self._directions else None
        self._diagonal = self.A.createVecRight()
        self.renew()

    @property
    def outdated(self) -> bool:
        """Whether a pattern has changed: `renew` before the next `assemble`."""
        return self._patterns != tuple(assembler.pattern for assembler in self._assemblers)

    def renew(self) -> None:
        """Make the matrix anew for the present patterns."""
        self._patterns = tuple(assembler.pattern for assembler in self._assemblers)
        if self._assemblers:
            self._destroy_sum()
            self._added = PETSc.Mat().create(self._forms.comm)
            self._added.setSizes(self._forms.getSizes())
            self._added.setBlockSize(self._V.dofmap.index_map_bs)
            self._added.setType(PETSc.Mat.Type.AIJ)
            self._added.setUp()
            for assembler in self._assemblers:
                assembler.add_pattern(self._added)
            self._added.assemble()
            # a matrix in which nothing was inserted would lose its pattern
            self._assemble_forms(())
            self._sum = self._forms.copy()
            self._sum.axpy(1.0, self._added, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
        self.A = self._sum if self._axes is None else self._turned()
        self.A.setOption(PETSc.Mat.Option.SYMMETRIC, self._symmetric)
        if self._V.dofmap.index_map_bs == self._V.mesh.geometry.dim > 1:
            self.A.setNearNullSpace(rigid_body_modes(self._V, self._directions.turn))

    def _turned(self) -> PETSc.Mat:
        """The matrix along the axes of the nodes, with values: one in which nothing was inserted has no pattern."""
        if not self._assemblers:
            self._assemble_forms(())
        return self._sum.ptap(self._axes)

    def assemble(self, bcs: Sequence[fem.DirichletBC], *, held: bool = True) -> None:
        """Fill the matrix at the present state; constrained rows and columns are those of the identity.

        Args:
            bcs: Dirichlet conditions on components.
            held: Whether what is prescribed along other directions constrains as well.
        """
        self._assemble_forms(bcs)
        if self._added is not None:
            self._add(self._added, bcs)
        if self._axes is not None:
            self._sum.ptap(self._axes, result=self.A)
            rows = self._directions.held if held else self._directions.held[:0]
            self.A.zeroRowsColumns(rows + self.A.getOwnershipRange()[0])
        if self.drag is not None:
            self._add_drag(bcs, self.drag)
        self.A.getDiagonal(self._diagonal)

    def _add_drag(self, bcs: Sequence[fem.DirichletBC], drag: NDArray[np.float64]) -> None:
        self._mark_free(bcs)
        self._diagonal.array[self._directions.held] = 0.0
        self._diagonal.array[:] *= drag
        self.A.setDiagonal(self._diagonal, PETSc.InsertMode.ADD_VALUES)

    def _assemble_forms(self, bcs: Sequence[fem.DirichletBC]) -> None:
        if self._csr is None:
            self._forms.zeroEntries()
            for a in self._a:
                petsc.assemble_matrix(self._forms, a, bcs)
                self._forms.assemble(PETSc.Mat.AssemblyType.FLUSH)
        else:
            self._csr.set_value(0.0)
            for a in self._a:
                fem.assemble_matrix(self._csr, a, bcs)
        self._forms.assemble()

    def _add(self, added: PETSc.Mat, bcs: Sequence[fem.DirichletBC]) -> None:
        added.zeroEntries()
        for assembler in self._assemblers:
            assembler.add_tangent(added)
        added.assemble()
        self._mark_free(bcs)
        added.diagonalScale(self._diagonal, self._diagonal)
        self._sum.zeroEntries()
        for part in (self._forms, added):
            self._sum.axpy(1.0, part, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)

    def _mark_free(self, bcs: Sequence[fem.DirichletBC]) -> None:
        """For the time being the vector of the diagonal is 1 in the free rows, else 0."""
        self._diagonal.set(1.0)
        for bc in bcs:
            dofs = bc.dof_indices()[0]
            self._diagonal.array[dofs[dofs < self._diagonal.local_size]] = 0.0

    @property
    def diagonal(self) -> NDArray[np.float64]:
        """Owned part of the diagonal; zero before the first assembly."""
        return self._diagonal.array_r

    @property
    def finite(self) -> bool:
        """Whether there is neither NaN nor infinity on the diagonal."""
        return bool(np.isfinite(self._diagonal.sum()))

    def _destroy_sum(self) -> None:
        if self._added is not None:
            self._added.destroy()
            self._sum.destroy()
        if self._axes is not None and self.A is not self._forms:
            self.A.destroy()

    def destroy(self) -> None:
        """Free the PETSc objects."""
        self._destroy_sum()
        if self._axes is not None:
            self._axes.destroy()
        self._forms.destroy()
        self._diagonal.destroy()
