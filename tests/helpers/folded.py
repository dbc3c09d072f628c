"""A body in the shape of a C, whose slot closes."""

from dataclasses import dataclass

import basix.ufl
import numpy as np
from dolfinx import fem, mesh
from mpi4py import MPI

from cutsim.base.compat import create_mesh
from cutsim.fields.state import State

#: Lower and upper face of the slot.
SLOT = (0.4, 0.5)


@dataclass(frozen=True)
class Clamp:
    """A C of 2 × 0.9 with a slot of 0.1 between two arms, open to the right."""

    state: State

    def boundary(self, where=lambda x: x[0] == x[0]):
        """Exterior facets whose corners fulfil a condition."""
        return mesh.locate_entities_boundary(self.state.mesh, 1, where)

    def slot(self, i):
        """The lower or upper face of the slot."""
        return self.boundary(lambda x: np.isclose(x[1], SLOT[i]) & (x[0] > 0.3))


def clamp(n=10, arms=2, comm=MPI.COMM_WORLD):
    """A clamp with so many cells along it and across an arm."""
    heights = [*np.linspace(0, SLOT[0], arms + 1), *np.linspace(SLOT[1], 0.9, arms + 1)]
    xs = np.linspace(0, 2, n + 1)
    x = np.array([(a, b) for b in heights for a in xs])
    rows = [(i, j) for j in range(2 * arms + 1) for i in range(n) if j != arms or xs[i + 1] < 0.4 + 1e-9]
    cells = np.array([[j * (n + 1) + i + k for k in (0, 1, n + 1, n + 2)] for i, j in rows], dtype=np.int64)
    if comm.rank:
        cells, x = cells[:0], x[:0]
    element = basix.ufl.element("Lagrange", "quadrilateral", 1, shape=(2,))
    return Clamp(State(fem.functionspace(create_mesh(comm, cells, x, element), ("Lagrange", 1, (2,)))))
