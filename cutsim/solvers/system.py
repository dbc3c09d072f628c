"""Nonlinear equations in terms of vectors: unknowns, residual, tangent."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from cutsim.base import compat
from cutsim.base.borders import Border
from cutsim.base.terms import Assembler, Multiplier
from cutsim.solvers.borders import Borders
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
        borders: A few unknowns more, with their equations, to which displacements may be tied.
        interface_dofs: Owned (blocked) dofs on both faces of all cracks; selects the solver for cracks.
        directions: What is prescribed along directions that are no components.
        bounds: Each tells whether the present displacement is possible; the residual of one that is not is no number,
            which makes a line search go back.
    """

    symmetric: bool = False
    assemblers: Sequence[Assembler] = ()
    multipliers: Sequence[Multiplier] = ()
    borders: Sequence[Border] = ()
    interface_dofs: NDArray[np.int32] | None = None
    directions: Directions | None = None
    bounds: Sequence[Callable[[], bool]] = ()


#: Nothing is known.
STRUCTURE = Structure()


class System:
    """Forces on the displacement, equations of multipliers and borders. Every method is collective.

    The vector of unknowns is that of PETSc's iterations and not that of u, which line searches would spoil as their own
    start: the displacement comes first, along the axes of the nodes, then the multipliers, then borders.

    Args:
        F: Parts of the residual, linear in a test function of the space of u. Each is compiled by itself, and only once
            for all problems in which it stands.
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
        held: Owned unknowns that are prescribed.
        reaction: Forces of the supports, and those that drive rigid bodies, at the last residual, owned entries.
    """

    def __init__(
        self,
        F: Sequence[ufl.Form],
        u: fem.Function,
        bcs: Sequence[fem.DirichletBC],
        entity_maps: compat.EntityMaps | None,
        structure: Structure,
    ) -> None:
        self._u, self._bcs, self.structure = u, list(bcs), structure
        du = ufl.TrialFunction(u.function_space)
        tangents = [ufl.derivative(part, u, du) for part in F if u in part.coefficients()]
        L, a = (compat.forms(parts, entity_maps=entity_maps) for parts in (F, tangents))
        self.directions = structure.directions or Directions(u.function_space)
        self.forces = Residual(L, a, u, bcs, structure.assemblers, self.directions)
        self.tangent = Tangent(a, u.function_space, structure.symmetric, structure.assemblers, self.directions)
        self._multipliers = Multipliers(structure.multipliers, u, bcs, self.directions)
        self._borders = Borders(structure.borders, self.comm, self.forces.fixed)
        if structure.multipliers and self.comm.allreduce(len(self._borders.tied)):
            raise ValueError("a rigid link cannot move a body with volumetric = 'taylor-hood'; use 'mixed'")
        self._start = self.forces.n + len(self._multipliers.values)
        self.size = int(self.comm.allreduce(len(self.unknowns)))
        self.held = np.concatenate([self.forces.held, self._start + self._borders.held])
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
    def drag(self) -> NDArray[np.float64] | None:
        """Stiffness against the displacement of each owned dof, or None [force/length]."""
        return self.forces.drag

    @drag.setter
    def drag(self, drag: NDArray[np.float64] | None) -> None:
        self.forces.drag = self.tangent.drag = drag

    @property
    def unknowns(self) -> NDArray[np.float64]:
        """A copy of the owned unknowns."""
        u = self.directions.turn(self._u.x.array[: self.forces.n])
        return np.concatenate([u, self._multipliers.values, self._borders.values])

    def assign(self, x: NDArray[np.float64]) -> None:
        """Set the unknowns, ghosts included."""
        n = self.forces.n
        self._u.x.array[:n] = self.directions.back(x[:n])
        self._borders.assign(x[self._start :], self._u.x.array[:n])
        self._u.x.scatter_forward()
        self._multipliers.assign(x[n : self._start])

    def violation(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Unknowns minus prescribed values, of those that are `held`."""
        return np.concatenate([self.forces.violation(x), self._borders.violation(x[self._start :])])

    def matrix(self) -> PETSc.Mat:
        """The matrix that `assemble_tangent` fills, which belongs to the system."""
        K, symmetric = self.tangent.A, self.structure.symmetric
        return self._borders.around(self._multipliers.around(K, symmetric=symmetric), K, symmetric=symmetric)

    def residual(self, x: NDArray[np.float64], tolerance: float) -> NDArray[np.float64]:
        """Owned forces and equations at x; the prescribed values' violation in the constrained rows.

        Args:
            x: Owned unknowns.
            tolerance: Violation up to which a prescribed value holds, so that nothing is lifted [length].
        """
        self.assign(x)
        lift = self.forces.violated(tolerance)
        forces = self.forces.assemble(lift=lift)
        equations = self._borders.residual(forces, self.forces.increment if lift else None)
        b = np.concatenate([forces, self._multipliers.residual(), equations])
        # While prescribed values do not hold, these rows carry lifting too; but then u is no solution either.
        self.reaction = np.concatenate([b[self.forces.held], self._borders.loads])
        b[self.held] = self.violation(x)
        b[self._borders.tied] = 0.0
        # all of them take part: a list, because all() would stop at the first
        if not all([possible() for possible in self.structure.bounds]):
            b[:] = np.nan
        return b

    def assemble_tangent(self, x: NDArray[np.float64]) -> None:
        """Fill the matrix at x."""
        self.assign(x)
        self._prepare()
        self.tangent.assemble(self._bcs)
        self._multipliers.assemble()
        self._borders.assemble(self.tangent.A, self.directions.turn)

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

    def carried(self, v: NDArray[np.float64]) -> NDArray[np.float64]:
        """The part of owned nodal vectors, one a row, that supports or rigid bodies carry."""
        carried = self.supported(v)
        carried[..., self._borders.tied] = v[..., self._borders.tied]
        return carried

    @property
    def guided(self) -> NDArray[np.bool_]:
        """Which owned dofs supports or rigid bodies move; of a node with axes of its own all of them."""
        guided = self.forces.fixed.copy()
        guided[self._borders.tied] = True
        nodes, rows = self.directions.nodes, guided.reshape(-1, self.V.dofmap.index_map_bs)
        rows[nodes[nodes < len(rows)]] = True
        return guided

    def restrained(self, motions: NDArray[np.float64]) -> NDArray[np.float64]:
        """The part of owned motions, one a row, that supports or rigid bodies hold."""
        return self.supported(motions) + self._borders.restrained(motions)

    def free(self) -> str | None:
        """A motion of a rigid body that nothing resists at the committed state, in words, or None."""
        return self._borders.free()

    def cell_size(self) -> float:
        """Size of the largest cell [length]."""
        mesh = self.V.mesh
        tdim = mesh.topology.dim
        cells = np.arange(mesh.topology.index_map(tdim).size_local, dtype=np.int32)
        return float(self.comm.allreduce(np.max(mesh.h(tdim, cells), initial=0.0), MPI.MAX))

    def destroy(self) -> None:
        """Free the PETSc objects."""
        for thing in (self._borders, self._multipliers, self.tangent, self.forces):
            thing.destroy()
