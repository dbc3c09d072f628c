"""Bodies in the plane or of revolution, and the two on which elements lock: Cook's membrane and a shell."""

import numpy as np
from dolfinx import fem, mesh
from mpi4py import MPI

from cutsim.analysis.mechanics import Mechanics
from cutsim.bodies.loads import Pressure, Support, Traction
from cutsim.bodies.solid import Solid
from cutsim.fields.state import State
from cutsim.materials.elastic import IsochoricNeoHookean
from helpers.laws import E
from helpers.meshes import QUADRILATERAL, quarter_ring, rectangle
from helpers.runs import final


class Body:
    """A body in the plane or of revolution."""

    def __init__(self, domain, degree=1, *, axisymmetric=True):
        self.state = State(fem.functionspace(domain, ("Lagrange", degree, (2,))), axisymmetric=axisymmetric)

    def where(self, condition):
        return mesh.locate_entities_boundary(self.state.mesh, 1, condition)

    def hold(self, condition, component, value=0.0, name=None):
        return Support(self.state, self.where(condition), component, value, name=name)

    def at(self, *point):
        """Displacement of the node at a point, the same on all ranks."""
        x = self.state.V.tabulate_dof_coordinates()[: len(self.state.increment) // 2, :2]
        near = np.linalg.norm(x - point, axis=1) < 1e-9
        values = self.state.u.x.array[: 2 * len(x)].reshape(-1, 2)[near]
        return next(v for part in self.state.mesh.comm.allgather(values) for v in part)


def at(axis, value):
    return lambda x: np.isclose(x[axis], value)


def on_sphere(radius):
    """Facets whose vertices are on a sphere around the origin."""
    return lambda x: np.isclose(np.hypot(x[0], x[1]), radius)


def inflated(n, degree, volumetric, cell=QUADRILATERAL, *, pressure, nu=0.4999, inner=1.0, outer=2.0):
    """Half a spherical shell under inner pressure, which grows from 0 to 1 times a value, on a smooth equator."""
    b = Body(quarter_ring(inner, outer, n, cell), degree)
    supports = [b.hold(at(1, 0), 1, name="equator"), b.hold(at(0, 0), 0)]
    load = Pressure(b.state, b.where(on_sphere(inner)), lambda t: pressure * t)
    solid = Solid(b.state, IsochoricNeoHookean(E, nu), volumetric=volumetric)
    return b, Mechanics(b.state, [solid, load], supports)


def shell_pressure(stretch, inner=1.0, outer=2.0):
    """Pressure in an incompressible neo-Hookean shell, from the hoop stretch of its inner surface."""
    far = (1 + (stretch**3 - 1) * (inner / outer) ** 3) ** (1 / 3)
    return E / 3 * (2 / far + 0.5 / far**4 - 2 / stretch - 0.5 / stretch**4)


def shell_error(cell, degree, volumetric, n):
    """Opening of a thick shell at equator and pole over that of Lamé, minus 1."""
    p, nu = 1e-4, 0.4999
    b, m = inflated((n, 2 * n), degree, volumetric, cell, pressure=p)
    final(m, step=1.0)
    exact = p / (7 * E) * ((1 - 2 * nu) + 4 * (1 + nu))
    return np.abs(np.array([b.at(1, 0)[0], b.at(0, 1)[1]]) / exact - 1).max()


#: Deflection of Cook's membrane over load/E at ν = 0.4999: limit of quadratic elements, which reach it from both sides.
COOK = 19.43


def cook(cell, degree, volumetric, n, comm=MPI.COMM_WORLD):
    """Deflection of the upper corner of Cook's membrane in plane strain, over load/E, at small load."""
    domain = rectangle([(0, 0), (1, 1)], (n, n), cell, comm)
    x = domain.geometry.x
    s, t = x[:, 0].copy(), x[:, 1].copy()
    x[:, 0], x[:, 1] = 48 * s, 44 * s + t * (44 - 28 * s)
    b, load = Body(domain, degree, axisymmetric=False), 1e-3
    shear = Traction(b.state, b.where(at(0, 48)), (0.0, load / 16), lambda t: t)
    solid = Solid(b.state, IsochoricNeoHookean(1.0, 0.4999), volumetric=volumetric)
    final(Mechanics(b.state, [solid, shear], [b.hold(at(0, 0), i) for i in range(2)]), step=1.0)
    return b.at(48, 60)[1] / load
