"""Taylor's theorem: the remainder of linearised forces falls with the square of the step."""

import numpy as np
import ufl
from dolfinx import fem, la
from dolfinx.fem.petsc import assemble_matrix
from petsc4py import PETSc

from cutsim.base.compat import form
from helpers.fields import jump_part, smooth

STEPS = np.array([1e-2, 5e-3, 2.5e-3])


def slopes(steps, remainders):
    """Slopes of a remainder between successive step sizes, in double logarithm."""
    return np.diff(np.log(remainders)) / np.diff(np.log(steps))


class Linearised:
    """Nodal forces of a term and their tangent."""

    def __init__(self, term, state):
        self.u = state.u
        residual = term.residual(ufl.TestFunction(state.V))
        tangent = ufl.derivative(residual, state.u, ufl.TrialFunction(state.V))
        self._forces, self._tangent = (form(f, entity_maps=term.entity_maps) for f in (residual, tangent))

    def forces(self, u):
        self.u.x.array[:] = u
        b = fem.assemble_vector(self._forces)
        b.scatter_reverse(la.InsertMode.add)
        return b.array.copy()

    def matrix(self, u):
        self.u.x.array[:] = u
        A = assemble_matrix(self._tangent)
        A.assemble()
        dense = A[:, :]
        A.destroy()
        return dense

    def remainders(self, u, w, steps=STEPS):
        """|f(u + h w) − f(u) − h K w| / |K w| for each step h."""
        f, slope = self.forces(u), self.matrix(u) @ w
        return np.array([np.linalg.norm(self.forces(u + h * w) - f - h * slope) for h in steps]) / np.linalg.norm(slope)


class Assembled:
    """Nodal forces of a term that assembles itself, and their tangent."""

    def __init__(self, term, state):
        self.term, self.state = term, state
        V = state.V
        self.n = V.dofmap.index_map.size_local * V.dofmap.index_map_bs

    def forces(self, u, along=None):
        self.state.u.x.array[:] = u
        b = PETSc.Vec().createMPI((self.n, None), comm=self.state.mesh.comm)
        for assembler in self.term.assemblers:
            assembler.add_forces(b, along)
        b.assemble()
        return b.array.copy()

    def matrix(self, u):
        self.state.u.x.array[:] = u
        A = PETSc.Mat().createDense(((self.n, None), (self.n, None)), comm=self.state.mesh.comm)
        A.setUp()
        for assembler in self.term.assemblers:
            assembler.add_tangent(A)
        A.assemble()
        return A.getDenseArray().copy()


def assert_slope_two(term, state, u, size, *, linear=False):
    """Taylor slope 2 in a direction of a size in which forces change markedly but meet no kink.

    A term that may be linear there has this slope, or no remainder at all.
    """
    problem = Linearised(term, state)
    w = smooth(state.V, 7, size) + jump_part(state, 8, size)
    remainders = problem.remainders(u, w)
    exact = remainders[0] < 1e-9
    assert linear or not exact, "a linear term: the slope says nothing"
    assert exact or slopes(STEPS, remainders).min() > 1.95, remainders
    matrix = problem.matrix(u)
    asymmetry = np.linalg.norm(matrix - matrix.T) / np.linalg.norm(matrix)
    assert not term.symmetric or asymmetry < 1e-12
    return asymmetry
