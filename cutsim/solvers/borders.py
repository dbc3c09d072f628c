"""Borders: a few unknowns beside the displacement, such as the motion of a rigid body, with their rows and columns.

With K the tangent of the displacement's balance R, q the unknowns and g their equations, Newton's method solves

    [K      ∂R/∂q] [Δu]     [R]
    [∂g/∂u  ∂g/∂q] [Δq] = − [g].

A displacement that is tied to q has no equation of its own: its row and column are those of the identity, and what
they held is in the border.  The unknowns belong to the first rank.
"""

from collections.abc import Callable, Sequence

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from cutsim.base.assembly import Array
from cutsim.base.borders import Border


class Borders:
    """All borders of a problem, none or several. Every method is collective.

    Args:
        borders: Their unknowns and equations.
        comm: Communicator of the mesh.
        fixed: Which owned unknowns of the displacement have a Dirichlet condition.

    Attributes:
        held: Unknowns that are prescribed, as indices among those of this rank.
        tied: Owned dofs of the displacement that are tied to unknowns.
        loads: Forces in the equations at the last residual, those of this rank.

    Raises:
        ValueError: On all ranks, if a displacement is tied twice, or tied and prescribed.
    """

    def __init__(self, borders: Sequence[Border], comm: MPI.Comm, fixed: NDArray[np.bool_]) -> None:
        self._borders, self._comm = tuple(borders), comm
        self._here = comm.rank == 0
        self._free = ~fixed
        held = np.concatenate([np.empty(0, dtype=bool), *(b.held for b in borders)])
        self._held = held
        self.held = np.flatnonzero(held) if self._here else np.empty(0, dtype=np.intp)
        self.tied = np.concatenate([np.empty(0, dtype=np.int32), *(b.tied for b in borders)])
        self.loads: Array = np.empty(0)
        self._joint: PETSc.Mat | None = None
        self._blocks: list[PETSc.Mat] = []
        self._reach: NDArray[np.int32] | None = None
        self._check(fixed)
        self._free[self.tied] = False

    def __bool__(self) -> bool:
        """Whether there are any, the same on all ranks."""
        return bool(self._borders)

    def _check(self, fixed: NDArray[np.bool_]) -> None:
        twice = len(self.tied) - len(np.unique(self.tied))
        both = int(np.count_nonzero(fixed[self.tied]))
        twice, both = self._comm.allreduce(np.array([twice, both]))
        if twice or both:
            other = "a support holds as well" if both else "another one moves as well"
            raise ValueError(f"a rigid part moves {max(twice, both)} displacements that {other}: leave them out of one")

    @property
    def values(self) -> Array:
        """Owned unknowns, one border after the other: all on the first rank."""
        values = np.concatenate([np.empty(0), *(b.values for b in self._borders)])
        return values if self._here else values[:0]

    def violation(self, values: Array) -> Array:
        """Prescribed unknowns of this rank minus what is prescribed."""
        targets = np.concatenate([np.empty(0), *(b.target for b in self._borders)])
        return values[self.held] - (targets if self._here else targets[:0])

    def assign(self, values: Array, u: Array) -> None:
        """Set the unknowns, in the order of `values`, and what is tied to them in an owned displacement."""
        if not self._borders:
            return
        everywhere = np.array(values if self._here else np.empty(len(self._held)))
        self._comm.Bcast(everywhere)
        parts = np.split(everywhere, np.cumsum([len(b.held) for b in self._borders]))
        for border, part in zip(self._borders, parts, strict=False):
            border.assign(part, u)

    def residual(self, forces: Array, jump: Callable[[], Array] | None) -> Array:
        """Left-hand sides of the equations, those of this rank.

        Args:
            forces: Owned forces on the displacement.
            jump: Gives the owned increments to prescribed displacements; None where they hold.
        """
        if not self._borders:
            return np.empty(0)
        increments = None if jump is None else jump()
        equations = np.concatenate([b.residual(forces, increments) for b in self._borders])
        loads = np.concatenate([b.loads for b in self._borders])
        self.loads = loads if self._here else loads[:0]
        return equations if self._here else equations[:0]

    def around(self, inner: PETSc.Mat, K: PETSc.Mat, *, symmetric: bool) -> PETSc.Mat:
        """Matrix of all unknowns around that of the displacement and multipliers: this itself without borders.

        It belongs to this object, which replaces an older one.

        Args:
            inner: Matrix of displacement and multipliers.
            K: Tangent of the displacement, a block of it or the same.
            symmetric: Whether all is symmetric.
        """
        self.destroy()
        if not self._borders:
            return inner
        mine, m = len(self._held) if self._here else 0, len(self._held)
        displacements, unknowns = K.getSizes()[0], (mine, m)
        shapes = [(displacements, unknowns), (unknowns, displacements), (unknowns, unknowns)]
        self._blocks = [_empty(K.comm, shape) for shape in shapes]
        self._reach = None
        size = 1 if inner is K else 2
        parts = [[K]] if inner is K else [[inner.getNestSubMatrix(i, j) for j in range(2)] for i in range(2)]
        columns, rows, corner = self._blocks
        blocks = [[*part, columns if i == 0 else None] for i, part in enumerate(parts)]
        self._joint = PETSc.Mat().createNest([*blocks, [rows, *[None] * (size - 1), corner]], comm=K.comm)
        self._joint.setOption(PETSc.Mat.Option.SYMMETRIC, symmetric)
        return self._joint

    def assemble(self, K: PETSc.Mat, turn: Callable[[Array], Array]) -> None:
        """Fill the blocks from the tangent of the displacement, and take what is tied out of that.

        Args:
            K: The tangent, assembled.
            turn: Gives the components along the axes of the nodes of owned vectors, one a row.
        """
        if not self._borders:
            return
        if self._reach is None:
            self._reach = self._reached(K)
        found = [b.blocks(K) for b in self._borders]
        start = 0
        for matrix in self._blocks:
            matrix.zeroEntries()
        for border, blocks in zip(self._borders, found, strict=True):
            self._insert(start, border.held, turn(blocks.columns), turn(blocks.rows), blocks.corner)
            start += len(border.held)
        for matrix in self._blocks:
            matrix.assemble()
        if self._comm.allreduce(len(self.tied)):
            K.zeroRowsColumns(self.tied + K.getOwnershipRange()[0])
        if self._joint is not None:
            self._joint.assemble()

    def _insert(self, start: int, held: NDArray[np.bool_], columns: Array, rows: Array, corner: Array) -> None:
        """Insert the blocks of one border; the equations of prescribed unknowns are those of the identity."""
        assert self._reach is not None
        D, R, S = self._blocks
        mine = self._reach[self._free[self._reach]]
        here, there = (self._reach + D.getOwnershipRange()[0]).astype(PETSc.IntType), range(start, start + len(held))
        reached = np.zeros((len(self._reach), len(held)))
        reached[self._free[self._reach]] = columns[:, mine].T
        D.setValues(here, list(there), reached)
        reached[self._free[self._reach]] = np.where(held[:, None], 0.0, rows[:, mine]).T
        R.setValues(list(there), here, np.ascontiguousarray(reached.T))
        if self._here:
            S.setValues(list(there), list(there), np.where(held[:, None], np.eye(len(held)), corner))

    def _reached(self, K: PETSc.Mat) -> NDArray[np.int32]:
        """Owned dofs on which the unknowns or equations of a border may depend."""
        first, last = K.getOwnershipRange()
        starts, columns, _ = K.getValuesCSR()
        coupled = [columns[starts[dof] : starts[dof + 1]] for dof in self.tied]
        everywhere = self._comm.allgather(np.unique(np.concatenate([np.empty(0, dtype=columns.dtype), *coupled])))
        indices = np.unique(np.concatenate(everywhere))
        own = (indices[(first <= indices) & (indices < last)] - first).astype(np.int32)
        return np.unique(np.concatenate([own, *(b.touched for b in self._borders)])).astype(np.int32)

    def restrained(self, motions: Array) -> Array:
        """The part of owned motions, one a row, that borders hold as supports do."""
        held = np.zeros_like(motions)
        for border in self._borders:
            held += border.restrained(motions)
        return held

    def free(self) -> str | None:
        """A motion of a border that nothing resists at the committed state, in words, or None."""
        return next((words for words in [border.free() for border in self._borders] if words), None)

    def destroy(self) -> None:
        """Free the PETSc objects."""
        for matrix in ([] if self._joint is None else [self._joint]) + self._blocks:
            matrix.destroy()
        self._joint, self._blocks = None, []


def _empty(comm: MPI.Comm, shape: tuple[tuple[int, int], tuple[int, int]]) -> PETSc.Mat:
    matrix = PETSc.Mat().createAIJ(shape, comm=comm)
    matrix.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, False)
    matrix.setUp()
    return matrix
