"""Preconditioners for cracks: what changes from tangent to tangent lies along them, and is solved there exactly."""

from typing import Any

import numpy as np
from dolfinx import fem, la
from numpy.typing import NDArray
from petsc4py import PETSc

from cutsim.solvers.preconditioners import LaggedPC, Preset, create_pc

#: What an operation of a solve with a factor costs in those of its factorisation: it waits for the memory (measured).
SLOWNESS = 8.0
#: Price of a factorisation in solves where the package does not count operations.
USUAL_PRICE = 30.0
# errors by which MUMPS says that memory is short: of the limit, of the estimate, of the machine
_SHORT = (-9, -13, -19)


def strip_dofs(V: fem.FunctionSpace, interface_dofs: NDArray[np.int32], layers: int = 1) -> NDArray[np.int32]:
    """Unknowns of the crack faces and of some layers of cells beside each. Collective.

    Args:
        V: The displacement space.
        interface_dofs: Owned (blocked) dofs on both faces of the cracks.
        layers: Layers of cells on either side.

    Returns:
        Owned unrolled dofs, ascending.
    """
    index_map, bs = V.dofmap.index_map, V.dofmap.index_map_bs
    mark = la.vector(index_map, 1)
    mark.array[interface_dofs] = 1.0
    mark.scatter_forward()
    cells = V.dofmap.list
    for _ in range(layers):
        # a cell may touch the crack with a node that another rank owns, and mark nodes of that rank: back, then forward
        layer = cells[np.any(mark.array[cells] > 0.0, axis=1)]
        mark.array[layer.ravel()] = 1.0
        mark.scatter_reverse(la.InsertMode.add)
        mark.scatter_forward()
    nodes = np.flatnonzero(mark.array[: index_map.size_local] > 0.0)
    return (nodes[:, None] * bs + np.arange(bs)).ravel().astype(np.int32)


class Strip:
    """Exact solver on the unknowns along the cracks, the others held. Every method is collective.

    Args:
        prefix: Options prefix of the solver.
        dofs: Owned unrolled dofs of the strip, see `strip_dofs`.
        symmetric: Whether the tangent is symmetric.
    """

    def __init__(self, prefix: str, dofs: NDArray[np.int32], symmetric: bool) -> None:
        self._prefix, self._dofs, self._symmetric = prefix, dofs, symmetric
        self._pc: Any = None

    def factorise(self, A: PETSc.Mat) -> int:
        """Factorise its part of a matrix, whose pattern is that of the last one.

        Returns:
            PETSc's reason of a failure, 0 if there is none.
        """
        if self._pc is None:
            self._is = PETSc.IS().createGeneral(self._dofs + A.getOwnershipRange()[0], comm=A.comm)
            self._B = A.createSubMatrix(self._is, self._is)
            # a sub-matrix does not inherit this from the matrix
            self._B.setOption(PETSc.Mat.Option.SYMMETRIC, self._symmetric)
            self._pc = create_pc(self._prefix, self._B, self._B)
            self._b, self._c = self._B.createVecs()
            self._r = A.createVecLeft()
        else:
            A.createSubMatrix(self._is, self._is, self._B)
            self._pc.setOperators(self._B, self._B)
        self._pc.setUp()
        return int(self._pc.getFailedReason())

    def residual(self, A: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> PETSc.Vec:
        """What y leaves of the right side x, in a vector of the strip."""
        A.mult(y, self._r)
        self._r.aypx(-1.0, x)
        return self._r

    def correct(self, r: PETSc.Vec, y: PETSc.Vec) -> None:
        """Add to y the solution on the strip for a residual r."""
        self._b.array[:] = r.array_r[self._dofs]
        self._pc.apply(self._b, self._c)
        y.array[self._dofs] += self._c.array_r

    def free(self) -> None:
        """Free the PETSc objects, for a matrix of another pattern."""
        if self._pc is not None:
            for thing in (self._pc, self._is, self._B, self._b, self._c, self._r):
                thing.destroy()
            self._pc = None


class StripCycle(LaggedPC):
    """Multiplicative cycle strip, kept preconditioner, strip; for cracks of any stiffness.

    Multigrid built in the elastic state is kept while the crack stiffens, softens and opens: what changes is
    confined to the strip along the crack, and that is factorised anew for every tangent.

    Args:
        prefix: Options prefix of the kept preconditioner.
        patience: As for `LaggedPC`.
        strip: The strip.
    """

    def __init__(self, prefix: str, patience: int, strip: Strip) -> None:
        super().__init__(prefix, patience)
        self._strip = strip
        self._z: Any = None

    def setUp(self, pc: PETSc.PC) -> None:
        """Called by PETSc when the tangent has changed."""
        super().setUp(pc)
        A = pc.getOperators()[1]
        if self._z is None:
            self._z = A.createVecRight()
        if failure := self._strip.factorise(A):
            pc.setFailedReason(failure)

    def apply(self, pc: PETSc.PC, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Called by PETSc: one cycle from y = 0."""
        # each part sees the residual that the one before it leaves; added up, they would correct the strip twice
        A, strip = pc.getOperators()[0], self._strip
        y.set(0.0)
        strip.correct(x, y)
        self._inner.apply(strip.residual(A, x, y), self._z)
        y.axpy(1.0, self._z)
        strip.correct(strip.residual(A, x, y), y)

    def _free(self) -> None:
        super()._free()
        self._strip.free()
        if self._z is not None:
            self._z.destroy()
            self._z = None


class KeptFactor(LaggedPC):
    """Kept factor of the symmetric part of an earlier tangent, then the strip; for cracks in 3-D.

    Cholesky's factor of ½(A + Aᵀ) costs half of an LU factor to make, to store and to apply. Friction, contact and
    damage, which make the tangent unsymmetric and change it, do so within the strip, which is factorised anew for every
    tangent. Beyond it the body deforms, and slowly the kept factor takes more iterations than the least since it was
    made. It is made anew once these add up to what a factorisation costs. Operations are counted and not seconds, so
    that all ranks and all runs decide alike.

    Args:
        prefix: Options prefix of the factor.
        strip: The strip.

    Attributes:
        price: Cost of a factorisation in solves.
    """

    def __init__(self, prefix: str, strip: Strip) -> None:
        super().__init__(prefix, patience=0)
        self._strip = strip
        self._matrix: Any = None
        self.price = USUAL_PRICE

    def observe(self, iterations: int) -> None:
        """Take note of a linear solve that met its tolerance.

        Args:
            iterations: Krylov iterations it took.
        """
        if self.fresh:
            self._least, self._excess = iterations, 0
        self._least = min(self._least, iterations)
        self._excess += iterations - self._least
        self._stale = self._excess > self.price

    def setUp(self, pc: PETSc.PC) -> None:
        """Called by PETSc when the tangent has changed."""
        super().setUp(pc)
        if not pc.getFailedReason():
            pc.setFailedReason(self._strip.factorise(pc.getOperators()[1]))

    def apply(self, pc: PETSc.PC, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Called by PETSc: the factor, then the strip for what it leaves."""
        self._inner.apply(x, y)
        self._strip.correct(self._strip.residual(pc.getOperators()[0], x, y), y)

    def _build(self, A: PETSc.Mat, P: PETSc.Mat) -> None:
        """Factorise the symmetric part of the tangent."""
        self._symmetrise(P)
        super()._build(self._matrix, self._matrix)
        factor = self._counted()
        if factor is not None and factor.getMumpsInfog(1) not in _SHORT and self._indefinite(factor):
            # what MUMPS makes of such a matrix without pivots is worthless, and it does not say so
            self._expect(definite=False)
            self._inner.destroy()
            self._inner = None
            super()._build(self._matrix, self._matrix)
            factor = self._counted()
        if factor is not None:
            self._note(factor)

    def _symmetrise(self, A: PETSc.Mat) -> None:
        transposed = A.transpose(PETSc.Mat())
        if self._matrix is None:
            self._matrix = A.copy()
            # the union of both patterns, which later tangents have as well
            self._matrix.axpy(1.0, transposed, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
            self._expect(definite=True)
        self._matrix.zeroEntries()
        for part in (A, transposed):
            self._matrix.axpy(0.5, part, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
        transposed.destroy()

    def _counted(self) -> PETSc.Mat | None:
        """The factor, if it is one of MUMPS, which counts its operations."""
        return self._inner.getFactorMatrix() if self._inner.getFactorSolverType() == "mumps" else None

    def _indefinite(self, factor: PETSc.Mat) -> bool:
        return self._definite and (factor.getMumpsInfog(1) < 0 or factor.getMumpsInfog(12) > 0)

    def _expect(self, *, definite: bool) -> None:
        self._definite = definite
        self._matrix.setOption(PETSc.Mat.Option.SPD, definite)

    def _note(self, factor: PETSc.Mat) -> None:
        """Take from MUMPS what the factor costs: expected memory, operations, entries."""
        self.memory = float(factor.getMumpsInfog(16))
        if factor.getMumpsInfog(1) in _SHORT:
            self.trouble = f"its factor would need about {self.memory:.0f} MB on a rank"
        whole, kept = (_number(factor.getMumpsInfog(i)) for i in (29, 35))
        if kept:
            # forward and backward substitution, a multiplication and an addition each; where blocks of low rank leave a
            # part of the entries, they leave about its square of the operations, which are not counted (measured)
            self.price = factor.getMumpsRinfog(3) * (kept / whole) ** 2 / (SLOWNESS * 4 * kept)

    def _free(self) -> None:
        super()._free()
        self._strip.free()
        if self._matrix is not None:
            self._matrix.destroy()
            self._matrix = None


def _number(told: int) -> int:
    """A number as MUMPS tells it: one that is too large, in millions and negative."""
    return -1_000_000 * told if told < 0 else told


def create_lagged(
    preset: Preset,
    prefix: str,
    V: fem.FunctionSpace,
    interface_dofs: NDArray[np.int32] | None,
    symmetric: bool,
) -> LaggedPC:
    """The preconditioner of a preset, to be made the context of a PETSc python preconditioner. Collective.

    Args:
        preset: The preset.
        prefix: Options prefix of the problem; the kept preconditioner adds the name of the preset.
        V: The displacement space.
        interface_dofs: Owned (blocked) dofs on both faces of the cracks, if the preset has a strip.
        symmetric: Whether the tangent is symmetric.
    """
    kept = f"{prefix}{preset.name}_"
    if not preset.strip or interface_dofs is None:
        return LaggedPC(kept, preset.patience)
    layers = 2 if preset.name == "factor" else 1
    strip = Strip(prefix + "strip_", strip_dofs(V, interface_dofs, layers), symmetric)
    return KeptFactor(kept, strip) if preset.name == "factor" else StripCycle(kept, preset.patience, strip)
