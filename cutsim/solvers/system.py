"""Nonlinear equations in terms of vectors: unknowns, residual, tangent."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from cutsim.base import compat
from cutsim.base.terms import Assembler, Multiplier
from cutsim.solvers.directions import Directions
from cutsim.solvers.multipliers import Multipliers
from cutsim.solvers.residual import Residual
from cutsim.solvers.tangent import Tangent


@dataclass(frozen=True, eq=False)
class Structure:
    """Structure of the equations beside their form.

    Args:
        symmetric: Whether the tangent is symmetric.
        assemblers: Forces that are not in the form.
        multipliers: Further unknowns, on which the form depends, with their equations.
        interface_dofs: Owned (blocked) dofs on both faces of all cracks; selects the solver for cracks.
        directions: What is prescribed along directions that are no components.
    """

    symmetric: bool = False
    assemblers: Sequence[Assembler] = ()
    multipliers: Sequence[Multiplier] = ()
    interface_dofs: NDArray[np.int32] | None = None
    directions: Directions | None = None


#: Nothing is known.
STRUCTURE = Structure()


class System:
    """Forces on the displacement and equations of multipliers. Every method is collective.

    The vector of unknowns is that of PETSc's iterations and not that of u, which line searches would spoil as their own
    start: the displacement comes first, along the axes of the nodes, then the multipliers.

    Args:
        F: Residual, linear in a test function of the space of u.
        u: The displacement.
        bcs: Dirichlet conditions.
        entity_maps: Entity maps of the forms.
        structure: What else is known of the equations.

    Attributes:
        forces: The forces on the displacement.
        tangent: Their derivative.
        directions: Axes of nodes.
        structure: As above.
        size: Global number of unknowns.
        reaction: Forces of the supports at the last residual, owned entries.
    """

    def __init__(
        self,
        F: ufl.Form,
        u: fem.Function,
        bcs: Sequence[fem.DirichletBC],
        entity_maps: compat.EntityMaps | None,
        structure: Structure,
    ) -> None:
        self._u, self._bcs, self.structure = u, list(bcs), structure
        J = ufl.derivative(F, u, ufl.TrialFunction(u.function_space))
        L, a = (compat.form(form, entity_maps=entity_maps) for form in (F, J))
        self.directions = structure.directions or Directions(u.function_space)
        self.forces = Residual(L, a, u, bcs, structure.assemblers, self.directions)
        self.tangent = Tangent(a, u.function_space, structure.symmetric, structure.assemblers, self.directions)
        self._multipliers = Multipliers(structure.multipliers, u, bcs, self.directions)
        self.size = int(self.comm.allreduce(len(self.unknowns)))
        self.reaction: NDArray[np.float64] = np.zeros(len(self.forces.held))

    @property
    def V(self) -> fem.FunctionSpace:
        """Space of the displacement."""
        return self._u.function_space

    @property
    def comm(self) -> MPI.Comm:
        """Communicator of the mesh."""
        comm: MPI.Comm = self.V.mesh.comm
        return comm

    @property
    def unknowns(self) -> NDArray[np.float64]:
        """A copy of the owned unknowns."""
        return np.concatenate([self.directions.turn(self._u.x.array[: self.forces.n]), self._multipliers.values])

    def assign(self, x: NDArray[np.float64]) -> None:
        """Set the unknowns, ghosts included."""
        n = self.forces.n
        self._u.x.array[:n] = self.directions.back(x[:n])
        self._u.x.scatter_forward()
        self._multipliers.assign(x[n:])

    def matrix(self) -> PETSc.Mat:
        """The matrix that `assemble_tangent` fills, which belongs to the system."""
        return self._multipliers.around(self.tangent.A, symmetric=self.structure.symmetric)

    def residual(self, x: NDArray[np.float64], tolerance: float) -> NDArray[np.float64]:
        """Owned forces and equations at x; the prescribed values' violation in the constrained rows.

        Args:
            x: Owned unknowns.
            tolerance: Violation up to which a prescribed value holds, so that nothing is lifted [length].
        """
        self.assign(x)
        lift = self.forces.violated(tolerance)
        b = np.concatenate([self.forces.assemble(lift=lift), self._multipliers.residual()])
        # While prescribed values do not hold, these rows carry lifting too; but then u is no solution either.
        self.reaction = b[self.forces.held]
        b[self.forces.held] = self.forces.violation(x)
        return b

    def assemble_tangent(self, x: NDArray[np.float64]) -> None:
        """Fill the matrix at x."""
        self.assign(x)
        self._prepare()
        self.tangent.assemble(self._bcs)
        self._multipliers.assemble()

    def _prepare(self) -> None:
        for assembler in self.structure.assemblers:
            assembler.prepare()

    def resistance(self, motions: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
        """Forces against motions at the present u; see `NonlinearProblem.resistance`."""
        self._prepare()
        self.tangent.assemble((), held=False)
        x, y = self.tangent.A.createVecs()
        forces = np.empty_like(motions)
        for motion, force in zip(self.directions.turn(motions), forces, strict=True):
            x.array[:] = motion
            self.tangent.A.mult(x, y)
            force[:] = y.array_r
        x.destroy()
        y.destroy()
        diagonal = self.tangent.diagonal
        total, size = self.comm.allreduce(np.array([np.abs(diagonal).sum(), diagonal.size]))
        return self.directions.back(forces), float(total / size)

    def supported(self, v: NDArray[np.float64]) -> NDArray[np.float64]:
        """The part of owned nodal vectors along what is prescribed, one a row."""
        return self.directions.back(np.where(self.forces.fixed, self.directions.turn(v), 0.0))

    def cell_size(self) -> float:
        """Size of the largest cell [length]."""
        mesh = self.V.mesh
        tdim = mesh.topology.dim
        cells = np.arange(mesh.topology.index_map(tdim).size_local, dtype=np.int32)
        return float(self.comm.allreduce(np.max(mesh.h(tdim, cells), initial=0.0), MPI.MAX))

    def destroy(self) -> None:
        """Free the PETSc objects."""
        for thing in (self._multipliers, self.tangent, self.forces):
            thing.destroy()
