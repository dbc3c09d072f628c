"""Two boxes that are pressed on each other, and their stress."""

from dolfinx import fem

from cutsim.analysis.mechanics import Mechanics
from cutsim.base.compat import nodal_expression
from cutsim.bodies.solid import Solid
from cutsim.materials.elastic import LinearElastic
from helpers.laws import E


def pressed(b, pair, strain=0.01, material=None):
    """Press the upper box onto the lower one; sides free, poisson's ratio zero: the stress is uniform."""
    up = b.gdim - 1
    path = [0.0 if i < up else (lambda t: -strain * t) for i in range(b.gdim)]
    supports = b.drive(0, 0, [0.0] * b.gdim, "bottom") + b.drive(1, 1, path, "top")
    return Mechanics(b.state, [Solid(b.state, material or LinearElastic(E, 0.0)), pair], supports)


def stresses(b):
    """Normal stress in every cell."""
    up = b.gdim - 1
    space = fem.functionspace(b.state.mesh, ("DG", 0))
    values = fem.Function(space)
    values.interpolate(nodal_expression(E * b.state.u[up].dx(up), space))
    return values.x.array[: space.dofmap.index_map.size_local]
