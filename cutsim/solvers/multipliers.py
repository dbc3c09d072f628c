"""Multipliers: unknowns beside the displacement, each with a constraint, which make the tangent a saddle point.

With K the tangent of the displacement's own balance R, Newton's method solves

    [K  Bᵀ] [Δu]     [R]
    [B  C ] [Δp] = − [g],    B = ∂g/∂u,  C = ∂g/∂p.

Forces and equation derive from one energy: the multipliers enter R by Bᵀ, and the matrix is symmetric if K is.
"""

from collections.abc import Sequence

import numpy as np
import ufl
from dolfinx import fem, la
from dolfinx.fem import petsc
from petsc4py import PETSc

from cutsim.base.assembly import Array, empty_matrix
from cutsim.base.compat import form
from cutsim.base.terms import Multiplier
from cutsim.solvers.directions import Directions


class Multipliers:
    """All multipliers of a problem, none or several. Every method is collective.

    Args:
        multipliers: Unknowns and equations.
        u: The displacement.
        bcs: Dirichlet conditions on components of the displacement.
        directions: What is prescribed along other directions.
    """

    def __init__(
        self,
        multipliers: Sequence[Multiplier],
        u: fem.Function,
        bcs: Sequence[fem.DirichletBC],
        directions: Directions,
    ) -> None:
        self._rows = [_Row(m, u, bcs, directions) for m in multipliers]
        # B and C in parts, whole, and with K
        self._parts: list[PETSc.Mat] = []
        self._blocks: list[PETSc.Mat] = []
        self._joint: list[PETSc.Mat] = []

    @property
    def values(self) -> Array:
        """Owned unknowns, one multiplier after the other."""
        return _joined([row.value.x.array[: row.n] for row in self._rows])

    def assign(self, values: Array) -> None:
        """Set the unknowns, in the order of `values`."""
        parts = np.split(values, np.cumsum([row.n for row in self._rows]))
        for row, part in zip(self._rows, parts, strict=False):
            row.value.x.array[: row.n] = part
            row.value.x.scatter_forward()

    def residual(self) -> Array:
        """Left-hand sides of the equations, with prescribed displacements lifted through B; owned entries."""
        return _joined([row.residual() for row in self._rows])

    def around(self, K: PETSc.Mat, *, symmetric: bool) -> PETSc.Mat:
        """Matrix of all unknowns around that of the displacement: K itself if there are no multipliers.

        It belongs to this object, which replaces an older one.
        """
        _destroy(self._joint)
        if not self._rows:
            return K
        if not self._blocks:
            self._create_blocks()
        B, C = self._blocks
        transposed = PETSc.Mat().createTranspose(B)
        A = PETSc.Mat().createNest([[K, transposed], [B, C]], comm=K.comm)
        A.setOption(PETSc.Mat.Option.SYMMETRIC, symmetric)
        self._joint = [A, transposed]
        return A

    def _create_blocks(self) -> None:
        """B and C of all multipliers as plain matrices: PETSc multiplies no nests."""
        n = len(self._rows)
        diagonal = [[row.C if i == j else None for j in range(n)] for i, row in enumerate(self._rows)]
        for row in self._rows:
            row.assemble()  # a matrix in which nothing was inserted would lose its pattern
        for parts in ([[row.B] for row in self._rows], diagonal):
            nest = PETSc.Mat().createNest(parts, comm=self._rows[0].B.comm)
            nest.assemble()
            self._parts.append(nest)
            self._blocks.append(nest.convert(PETSc.Mat.Type.AIJ, out=PETSc.Mat()))

    def assemble(self) -> None:
        """Fill B and C, after K."""
        for row in self._rows:
            row.assemble()
        for parts, block in zip(self._parts, self._blocks, strict=True):
            parts.assemble()
            parts.convert(PETSc.Mat.Type.AIJ, out=block)
        for matrix in self._joint[:1]:
            matrix.assemble()

    def destroy(self) -> None:
        """Free the PETSc objects."""
        for matrices in (self._joint, self._blocks, self._parts):
            _destroy(matrices)
        for row in self._rows:
            row.destroy()


class _Row:
    """One multiplier: its equation and the two blocks of its row."""

    def __init__(
        self, multiplier: Multiplier, u: fem.Function, bcs: Sequence[fem.DirichletBC], directions: Directions
    ) -> None:
        self.value, self._u, self._bcs, self._directions = multiplier.value, u, list(bcs), directions
        Q, V = self.value.function_space, u.function_space
        self.n = Q.dofmap.index_map.size_local
        self._g = form(multiplier.equation)
        self._by_u = form(ufl.derivative(multiplier.equation, u, ufl.TrialFunction(V)))
        self._by_value = form(ufl.derivative(multiplier.equation, self.value, ufl.TrialFunction(Q)))
        self.B, self.C = empty_matrix([self._by_u]), empty_matrix([self._by_value])
        self._components: PETSc.Mat | None = None
        if directions:
            self._turn()
        self._r = la.vector(Q.dofmap.index_map)

    def _turn(self) -> None:
        """Give B its columns along the axes of the nodes."""
        self._components, self._axes = self.B, self._directions.matrix()
        petsc.assemble_matrix(self._components, self._by_u, self._bcs)
        self._components.assemble()
        self.B = self._components.matMult(self._axes)
        self._free = self.B.createVecRight()
        self._free.set(1.0)
        self._free.array[self._directions.held] = 0.0

    def residual(self) -> Array:
        self._r.array[:] = 0.0
        fem.assemble_vector(self._r.array, self._g)
        bcs = [*self._directions.lifting(self._u.x.array), *self._bcs]
        fem.apply_lifting(self._r.array, [self._by_u], [bcs], [self._u.x.array], -1.0)
        self._r.scatter_reverse(la.InsertMode.add)
        return self._r.array[: self.n]

    def assemble(self) -> None:
        for matrix, a in ((self._components or self.B, self._by_u), (self.C, self._by_value)):
            matrix.zeroEntries()
            petsc.assemble_matrix(matrix, a, self._bcs)
            matrix.assemble()
        if self._components is not None:
            self._components.matMult(self._axes, result=self.B)
            self.B.diagonalScale(None, self._free)

    def destroy(self) -> None:
        own = [] if self._components is None else [self._components, self._axes, self._free]
        _destroy([self.B, self.C, *own])


def _joined(parts: Sequence[Array]) -> Array:
    return np.concatenate([np.empty(0), *parts])


def _destroy(things: Sequence[PETSc.Object]) -> None:
    for thing in things:
        thing.destroy()
