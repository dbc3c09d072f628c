"""Two blocks glued by a crack."""

from dataclasses import dataclass, replace

import numpy as np
from dolfinx import mesh
from mpi4py import MPI

from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.stepping import StepControl
from cutsim.base.compat import cell_partitioner
from cutsim.bodies.loads import Support
from cutsim.bodies.solid import Solid
from cutsim.fields.space import cracked_space
from cutsim.fields.state import State
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.crack import Crack
from helpers.fields import jump_part, smooth
from helpers.laws import ELASTIC, EXPONENTIAL, E
from helpers.runs import history


@dataclass(frozen=True)
class Blocks:
    """The unit square or cube, cracked in the plane half way up: the last axis is normal to the crack."""

    state: State
    facets: np.ndarray
    lower: np.ndarray
    upper: np.ndarray

    @property
    def gdim(self):
        return self.state.mesh.geometry.dim

    def crack(self, law=EXPONENTIAL, **options):
        return Crack(self.state, self.facets, self.lower, law, **{"young": E, **options})

    def solid(self, material=ELASTIC, **options):
        return Solid(self.state, material, **options)

    def drive(self, cells, path, name=None):
        """Move every node of some cells along a path: a function of time, or zero, for each component."""
        tdim = self.state.mesh.topology.dim
        return [
            Support(self.state, cells, i, value, dim=tdim, name=name and f"{name}_{'xyz'[i]}")
            for i, value in enumerate(path)
        ]

    def face(self, axis, at):
        """Exterior facets where a coordinate has a value."""
        return mesh.locate_entities_boundary(
            self.state.mesh, self.state.mesh.topology.dim - 1, lambda x: np.isclose(x[axis], at)
        )

    def move(self, lower, upper):
        """Set the displacement: a function of the positions (3, n) → (gdim, n) for each block."""
        for cells, motion in ((self.lower, lower), (self.upper, upper)):
            self.state.u.interpolate(lambda x, motion=motion: motion(x)[: self.gdim], cells)
        self.state.u.x.scatter_forward()


def make_blocks(gdim=2, n=2, comm=MPI.COMM_WORLD, cell=None):
    """Two glued blocks of n × n/2 (× n) cells."""
    partitioner = cell_partitioner()
    quads = (mesh.CellType.quadrilateral, mesh.CellType.hexahedron)
    create = (mesh.create_unit_square, mesh.create_unit_cube)[gdim - 2]
    domain = create(comm, *(n,) * gdim, cell or quads[gdim - 2], partitioner=partitioner)
    up = gdim - 1
    facets = mesh.locate_entities(domain, gdim - 1, lambda x: np.isclose(x[up], 0.5))
    lower = mesh.locate_entities(domain, gdim, lambda x: x[up] < 0.5 + 1e-9)
    upper = mesh.locate_entities(domain, gdim, lambda x: x[up] > 0.5 - 1e-9)
    return Blocks(State(cracked_space(domain, ("Lagrange", 1, (gdim,)), facets)), facets, lower, upper)


def remember(crack, opening, sliding=0.0):
    """Let the bond of a crack have been open and slid so far at all points."""
    secants = np.minimum(crack.law.secants(0.0, 0.0), crack.law.secants(opening, sliding))
    known = crack.history._known
    known.set(replace(known.committed, secants=np.broadcast_to(secants, known.committed.secants.shape)))


# mean jump over the characteristic opening (sliding, opening), and how far it has been open over it
JUMPS = {
    "opening": (0.0, 0.8, 0.0),
    "sliding": (0.9, 0.02, 0.0),
    "mixed": (0.7, 0.8, 0.0),
    "softening": (1.5, 1.8, 0.0),
    "unloading": (0.7, 0.6, 2.0),
    "compression": (0.8, -0.3, 0.0),
    "compression of the damaged bond": (0.8, -0.3, 3.0),
}


def separated(b, sliding, opening, wobble):
    """A deformed state whose jump is nearly the same all over the crack."""
    gdim = b.gdim
    base = smooth(b.state.V, 4, 0.15)
    b.move(lambda x: 0 * x, lambda x: np.array([0 * x[0] + sliding, *([0 * x[0]] * (gdim - 2)), 0 * x[0] + opening]))
    return base + b.state.u.x.array + jump_part(b.state, 5, wobble)


PENALTY = PenaltyContact(500.0)


def drag(law, waypoints, steps=150, gdim=2, **options):
    """Move the upper block through the waypoints of the jump at equal times; history over `steps` steps."""
    b = make_blocks(gdim)
    legs = np.arange(len(waypoints))
    between = [0.0] * (gdim - 2)
    path = [lambda t: np.interp(t, legs, waypoints[:, 0]), *between, lambda t: np.interp(t, legs, waypoints[:, 1])]
    supports = b.drive(b.lower, [0.0] * gdim) + b.drive(b.upper, path, "upper")
    options = {"contact": PENALTY, **options}
    crack = b.crack(law, **options)
    mechanics = Mechanics(b.state, [crack], supports)
    return history(mechanics, legs[-1], StepControl.fixed(legs[-1] / steps)), crack
