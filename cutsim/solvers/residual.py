"""Residual vector and its assembly."""

from collections.abc import Sequence

import numpy as np
from dolfinx import fem, la
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from cutsim.base.assembly import Array, owned_vector
from cutsim.base.terms import Assembler
from cutsim.solvers.directions import Directions


class Residual:
    """Internal minus external forces on the displacement, and its prescribed values. Every method is collective.

    Args:
        L: Compiled forces, whose sum counts.
        a: Their compiled tangents, through which prescribed increments are lifted.
        u: The displacement.
        bcs: Dirichlet conditions on components.
        assemblers: Forces that are no form.
        directions: What is prescribed along other directions.

    Attributes:
        n: Number of owned dofs.
        known: Owned forces that are added to those of the form.
        drag: Stiffness against the displacement of each owned dof, whose forces are added, too; None for none
            [force/length].
        fixed: Which owned unknowns have a Dirichlet condition ...
        held: ... and their indices.
    """

    def __init__(
        self,
        L: Sequence[fem.Form],
        a: Sequence[fem.Form],
        u: fem.Function,
        bcs: Sequence[fem.DirichletBC],
        assemblers: Sequence[Assembler],
        directions: Directions,
    ) -> None:
        self._L, self._a, self._u = tuple(L), tuple(a), u
        self._bcs, self._assemblers = list(bcs), tuple(assemblers)
        self._directions = directions
        V = u.function_space
        layout = V.dofmap.index_map, V.dofmap.index_map_bs
        self.n = layout[0].size_local * layout[1]
        self._r, self._g, self._lifted = (la.vector(*layout) for _ in range(3))
        self._added = owned_vector(*layout)
        self.known: Array = np.zeros(self.n)
        self.drag: Array | None = None
        self.fixed: NDArray[np.bool_] = np.zeros(self.n, dtype=bool)
        for bc in self._bcs:
            dofs = bc.dof_indices()[0]
            self.fixed[dofs[dofs < self.n]] = True
        self.fixed[directions.held] = True
        self.held = np.flatnonzero(self.fixed)

    def prescribe(self) -> None:
        """Take the present values of the Dirichlet conditions."""
        for bc in self._bcs:
            bc.set(self._g.array, None, 1.0)
        self._directions.prescribe(self._g.array)

    def violation(self, u: Array) -> Array:
        """Displacement minus prescribed value on the constrained dofs.

        Args:
            u: Owned displacements along the axes of the nodes; more unknowns may follow.
        """
        return u[self.held] - self._g.array[self.held]

    def _present_violation(self) -> Array:
        return self.violation(self._directions.turn(self._u.x.array[: self.n]))

    def violated(self, tolerance: float) -> bool:
        """Whether a prescribed value is missed by more than a tolerance [length]."""
        worst = float(np.abs(self._present_violation()).max(initial=0.0))
        return bool(self._u.function_space.mesh.comm.allreduce(worst, MPI.MAX) > tolerance)

    def assemble(self, *, lift: bool) -> Array:
        """Owned forces at the present u, along the axes of the nodes.

        Args:
            lift: Whether to add what the increments to the prescribed values bring through the tangent, which costs as
                much as the forces.
        """
        return self._directions.turn(self._assemble(lift=lift))

    def _assemble(self, *, lift: bool) -> Array:
        for assembler in self._assemblers:
            assembler.prepare()
        r = self._r.array
        r[:] = 0.0
        for L in self._L:
            fem.assemble_vector(r, L)
        if lift:
            bcs = [*self._directions.lifting(self._u.x.array), *self._bcs]
            for a in self._a:
                fem.apply_lifting(r, [a], [bcs], [self._u.x.array], -1.0)
        self._r.scatter_reverse(la.InsertMode.add)
        r[: self.n] += self.known
        if self.drag is not None:
            r[: self.n] += self.drag * self._u.x.array[: self.n]
        if self._assemblers:
            self._add_assembled(lift)
        return r[: self.n]

    def increment(self) -> Array:
        """Owned increments to the prescribed values, components of space."""
        jump = np.zeros(self.n)
        jump[self.held] = -self._present_violation()
        return self._directions.back(jump)

    def _add_assembled(self, lift: bool) -> None:
        """Add the forces of terms that assemble themselves, and the lifting of prescribed increments."""
        jump = None
        if lift:
            jump = self._lifted.array
            jump[: self.n] = self.increment()
            self._lifted.scatter_forward()
        self._added.set(0.0)
        for assembler in self._assemblers:
            assembler.add_forces(self._added, jump)
        self._added.assemble()
        self._r.array[: self.n] += self._added.array_r

    def vector(self) -> PETSc.Vec:
        """The forces without lifting, components of space, as a new vector, which the caller owns."""
        b = self._added.duplicate()
        b.array[:] = self._assemble(lift=False)
        return b

    def destroy(self) -> None:
        """Free the PETSc objects."""
        self._added.destroy()
