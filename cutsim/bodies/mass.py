"""Mass of bodies, as a form and as the matrix that turns accelerations into forces."""

from collections.abc import Sequence
from typing import Literal

import numpy as np
import ufl
from dolfinx import default_scalar_type, fem
from petsc4py import PETSc

from cutsim.base import compat
from cutsim.base.assembly import Array, global_dot, nodal_forces, resultant
from cutsim.base.checks import require
from cutsim.base.kinematics import Expr
from cutsim.base.terms import Body
from cutsim.fields.state import State
from cutsim.solvers.directions import Directions
from cutsim.solvers.tangent import Tangent


class Mass:
    """Mass of bodies.

    Args:
        state: Displacement and time.
        solids: The bodies; each needs a density.
        mass: "consistent", or "lumped" by a quadrature in the nodes.

    Raises:
        ValueError: A body has no density, or the mass cannot be lumped.
    """

    def __init__(self, state: State, solids: Sequence[Body], mass: Literal["consistent", "lumped"]) -> None:
        for solid in solids:
            require(f"density of {solid.name}", solid.density, solid.density is not None, "> 0 in a dynamic analysis")
        # a node on the axis would have no mass
        whole = mass == "consistent" or not state.axisymmetric
        require("mass", mass, whole, "'consistent' in an axisymmetric problem")
        self._state = state
        rule = _quadrature(state.V.ufl_element(), mass)
        self._bodies = [
            (fem.Constant(state.mesh, default_scalar_type(s.density)), state.measures.cells(s.cells)(metadata=rule))
            for s in solids
        ]
        self._field = fem.Function(state.V)
        self._product = compat.form(self.form(self._field, ufl.TestFunction(state.V)))

    def form(self, w: Expr, v: Expr) -> ufl.Form:
        """∫ ρ w·v."""
        return sum((density * ufl.inner(w, v) * dx for density, dx in self._bodies), start=ufl.Form([]))

    def times(self, field: Array) -> Array:
        """Mass matrix times a field (local entries, ghosts included): owned entries. Collective."""
        self._field.x.array[:] = field
        return nodal_forces(self._product)

    def divide(self, forces: Array, bcs: Sequence[fem.DirichletBC], directions: Directions) -> Array:
        """The field whose product with the matrix, prescribed rows aside, are owned forces. Collective.

        Args:
            forces: The forces along the axes of the nodes, and in prescribed rows the values of the field.
            bcs: Dirichlet conditions on components.
            directions: What is prescribed along other directions.

        Returns:
            The owned field along the axes of the nodes.
        """
        mass = self._matrix(bcs, directions)
        x, b = mass.A.createVecs()
        b.array[:] = forces
        ksp = PETSc.KSP().create(mass.A.comm)
        ksp.setOperators(mass.A)
        ksp.setType("cg")
        ksp.getPC().setType("jacobi")  # conditions a mass matrix independently of the mesh
        ksp.setTolerances(rtol=1e-13)
        ksp.setErrorIfNotConverged(True)
        ksp.solve(b, x)
        solution = x.array_r.copy()
        for thing in (ksp, mass, x, b):
            thing.destroy()
        return solution

    def lumped(self) -> Array:
        """Mass of each owned dof, from the diagonal of the matrix so that the total is kept [mass]. Collective.

        All are positive for any element (Hinton, Rock and Zienkiewicz, Earthquake Eng. Struct. Dyn. 4, 1976, 245–249).
        """
        comm, gdim = self._state.mesh.comm, self._state.mesh.geometry.dim
        mass = self._matrix((), None)
        diagonal: Array = mass.diagonal.copy()
        mass.destroy()
        along = np.tile(np.eye(gdim)[0], len(self._field.x.array) // gdim)
        return gdim * diagonal * resultant(comm, self.times(along), gdim)[0] / comm.allreduce(float(diagonal.sum()))

    def _matrix(self, bcs: Sequence[fem.DirichletBC], directions: Directions | None) -> Tangent:
        """The matrix, which the caller destroys. Collective."""
        V = self._state.V
        form = compat.form(self.form(ufl.TrialFunction(V), ufl.TestFunction(V)))
        mass = Tangent([form], V, symmetric=True, directions=directions)
        mass.assemble(bcs)
        return mass

    def kinetic(self, velocity: Array) -> float:
        """Kinetic energy ½ v·M v of a velocity (local entries, ghosts included). Collective."""
        owned = velocity[: len(self._state.increment)]
        return 0.5 * global_dot(self._state.mesh.comm, owned, self.times(velocity))

    def momentum(self, velocity: Array) -> Array:
        """Linear momentum, one number a component. Collective."""
        mesh = self._state.mesh
        return resultant(mesh.comm, self.times(velocity), mesh.geometry.dim)


def _quadrature(element: ufl.finiteelement.AbstractFiniteElement, mass: str) -> dict[str, int | str]:
    """Quadrature of the mass: full, or with its points in the nodes."""
    require("mass", mass, mass in ("consistent", "lumped"), "'consistent' or 'lumped'")
    degree, cell = element.degree, element.cell_type.name
    if mass == "consistent":
        return {"quadrature_degree": 2 * degree}
    simplex = cell in ("triangle", "tetrahedron")
    require("mass", mass, degree == 1 or not simplex, f"'consistent' on a {cell} of degree {degree}")
    # Gauss-Lobatto points of a line are the nodes of degree 2, too
    return {"quadrature_rule": "vertex" if degree == 1 else "GLL", "quadrature_degree": 2 * degree - 1}
