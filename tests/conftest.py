"""What the theory tests share: two blocks glued by a crack, their rigid motion, and slopes of remainders."""

import gc
from dataclasses import dataclass, replace

import mpi4py.MPI  # noqa: F401  # before dolfinx, as in cutsim
import numpy as np
import pytest
from dolfinx import mesh
from mpi4py import MPI

from cutsim.analysis.stepping import run
from cutsim.base.compat import cell_partitioner
from cutsim.bodies.loads import Support
from cutsim.bodies.solid import Solid
from cutsim.fields.space import cracked_space
from cutsim.fields.state import State
from cutsim.interface.cohesive import Bilinear, Exponential
from cutsim.interface.crack import Crack
from cutsim.interface.ppr import ParkPaulinoRoesler
from cutsim.materials.elastic import LinearElastic

E, NU = 2.0, 0.3
ELASTIC = LinearElastic(E, NU)
# φ_n = 1 and φ_t = ½, the set of the path values in the theory
EXPONENTIAL = Exponential(toughness=1.0, opening=0.1, shear_toughness=0.5, shear_opening=0.2)
BILINEAR = Bilinear(penalty=200.0, strength=2.0, toughness=0.2, shear_strength=3.0, shear_toughness=0.5, eta=1.7)
PROPORTIONAL = Bilinear.proportional(
    penalty=200.0, strength=2.0, toughness=0.2, shear_strength=3.0, shear_toughness=0.5, eta=1.7
)
PPR = ParkPaulinoRoesler(
    strength=2.0, toughness=0.2, shear_strength=3.0, shear_toughness=0.5, alpha=3.0, beta=2.2, peak=0.15, shear_peak=0.2
)


def pytest_collection_finish():
    """What is imported stays: collections during the run need not look at it again."""
    gc.collect()
    gc.freeze()


@pytest.fixture(autouse=True)
def _nothing_is_left():
    """What a test has dropped is freed before the next one: MPICH has some two thousand communicators a process."""
    yield
    gc.collect()


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


def rotation(gdim, angle):
    """Rotation matrix, in 3-D about a skew axis (Rodrigues' formula)."""
    if gdim == 2:
        return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    a = np.array([1.0, -2.0, 0.5]) / np.linalg.norm([1.0, -2.0, 0.5])
    W = np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
    return np.eye(3) + np.sin(angle) * W + (1 - np.cos(angle)) * W @ W


def history(mechanics, until, control):
    """Run and return the columns of all accepted steps."""
    rows = []
    run(mechanics, until, control, lambda r: rows.append({"time": r.time} | {k: v for k, (v, _) in r.columns.items()}))
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def slopes(steps, remainders):
    """Slopes of a remainder between successive step sizes, in double logarithm."""
    return np.diff(np.log(remainders)) / np.diff(np.log(steps))
