"""Boxes with meshes of their own: what two bodies in contact are made of."""

from dataclasses import dataclass

import basix.ufl
import numpy as np
from dolfinx import fem, mesh
from mpi4py import MPI

from cutsim.base.compat import create_mesh, geometry_nodes
from cutsim.bodies.loads import Support
from cutsim.fields.space import cracked_space
from cutsim.fields.state import State
from cutsim.pairs.surface_pair import SurfacePair
from helpers.laws import E

KINDS = {
    2: (mesh.create_rectangle, mesh.CellType.quadrilateral, mesh.CellType.triangle),
    3: (mesh.create_box, mesh.CellType.hexahedron, mesh.CellType.tetrahedron),
}


@dataclass(frozen=True)
class Stack:
    """Boxes that do not share a node."""

    state: State
    boxes: tuple

    @property
    def gdim(self):
        return self.state.mesh.geometry.dim

    def cells(self, box):
        """Cells of a box, ghosts included."""
        low, high = self.boxes[box][:2]
        count = self.state.mesh.topology.index_map(self.gdim)
        cells = np.arange(count.size_local + count.num_ghosts, dtype=np.int32)
        x = mesh.compute_midpoints(self.state.mesh, self.gdim, cells)[:, : self.gdim]
        return cells[np.all((x > low) & (x < high), axis=1)]

    def face(self, box, axis, end):
        """Exterior facets of a box where a coordinate is at its low (0) or high (1) end."""
        domain, at = self.state.mesh, self.boxes[box][end][axis]
        facets = mesh.locate_entities_boundary(domain, self.gdim - 1, lambda x: np.isclose(x[axis], at))
        domain.topology.create_connectivity(self.gdim - 1, self.gdim)
        owner = domain.topology.connectivity(self.gdim - 1, self.gdim)
        own = set(self.cells(box))
        return np.array([f for f in facets if owner.links(f)[0] in own], dtype=np.int32)

    def pair(self, slave=1, master=0, **options):
        """The bottom of one box against the top of another."""
        up = self.gdim - 1
        return SurfacePair(self.state, self.face(slave, up, 0), self.face(master, up, 1), **{"young": E, **options})

    def move(self, motion, box=None):
        """Set the displacement: a function of the positions (3, n) → (gdim, n), of one box or of all."""
        cells = self.cells(box) if box is not None else None
        self.state.u.interpolate(lambda x: motion(x)[: self.gdim], cells)
        self.state.u.x.scatter_forward()

    def drive(self, box, end, path, name=None):
        """Move the face of a box at an end of the last axis."""
        facets = self.face(box, self.gdim - 1, end)
        return [
            Support(self.state, facets, i, value, name=name and f"{name}_{'xyz'[i]}")
            for i, value in enumerate(path)
            if value is not None
        ]


def stack(*boxes, simplices=False, degree=1, comm=MPI.COMM_WORLD, cracked=None):
    """A mesh of boxes (low corner, high corner, numbers of cells), cracked where positions fulfil a condition."""
    gdim = len(boxes[0][0])
    create, *kinds = KINDS[gdim]
    kind = kinds[simplices]
    cells, x, count = [], [], 0
    for low, high, n in boxes if comm.rank == 0 else ():
        part = create(MPI.COMM_SELF, [np.array(low, float), np.array(high, float)], n, kind)
        cells.append(geometry_nodes(part) + count)
        x.append(part.geometry.x[:, :gdim])
        count += len(x[-1])
    corners = 2**gdim if not simplices else gdim + 1
    cells = np.concatenate(cells) if cells else np.empty((0, corners), dtype=np.int64)
    x = np.concatenate(x) if x else np.empty((0, gdim))
    element = basix.ufl.element("Lagrange", kind.name, 1, shape=(gdim,))
    domain = create_mesh(comm, cells.astype(np.int64), x, element)
    element = ("Lagrange", degree, (gdim,))
    if cracked is None:
        return Stack(State(fem.functionspace(domain, element)), boxes)
    return Stack(State(cracked_space(domain, element, mesh.locate_entities(domain, gdim - 1, cracked))), boxes)


def two(gdim, n=(2, 3), overhang=0.0, **options):
    """An upper box of unit width on a lower one, n cells each along the interface."""
    low, high = [-overhang] * (gdim - 1) + [-1.0], [1.0 + overhang] * (gdim - 1) + [0.0]
    lower = (low, high, [n[0]] * (gdim - 1) + [2])
    upper = ([0.0] * gdim, [1.0] * gdim, [n[1]] * (gdim - 1) + [2])
    return stack(lower, upper, **options)
