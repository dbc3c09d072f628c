"""Planes of symmetry of a mesh, in which what is meshed has its image."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from dolfinx.mesh import compute_midpoints
from mpi4py import MPI

from cutsim.base.arrays import Array
from cutsim.fields.faces import Face, mean_size
from cutsim.fields.sizes import normal_size
from cutsim.fields.state import State
from cutsim.fields.twins import facet_nodes

# distance from a plane that is none, over the size of the facets together
_FLAT = 1e-6


@dataclass(frozen=True)
class SymmetryPlane:
    """Plane of symmetry.

    Attributes:
        point: A point of it [length].
        normal: Unit normal, out of what is meshed.
        size: Mean size of the elements beside it, normal to it [length].
    """

    point: Array
    normal: Array
    size: float

    @classmethod
    def of(cls, state: State, face: Face) -> Self | None:
        """The plane in which facets of the outer boundary lie; None if it is none of symmetry. Collective.

        The body is on one side of it. The plane of a body of revolution is normal to its axis.
        """
        mesh, comm = state.mesh, state.mesh.comm
        gdim = mesh.geometry.dim
        x = mesh.geometry.x[facet_nodes(mesh, face.facets), :gdim]
        point = comm.allreduce(x.sum(axis=0)) / comm.allreduce(len(x))
        x = x - point
        normal = np.linalg.eigh(comm.allreduce(x.T @ x))[1][:, 0]
        extent, off = (comm.allreduce(np.abs(y).max(initial=0.0), MPI.MAX) for y in (x, x @ normal))
        cells, facets = (
            compute_midpoints(mesh, mesh.topology.dim - i, entities).reshape(-1, 3)[:, :gdim]
            for i, entities in enumerate((face.cells, face.facets))
        )
        behind, there = comm.allreduce(np.array([((cells - facets) @ normal < 0).sum(), len(cells)]))
        upright = not state.axisymmetric or abs(normal[0]) <= _FLAT
        if off > _FLAT * extent or behind not in (0, there) or not upright:
            return None
        return cls(point, normal if behind else -normal, mean_size(mesh, [face], normal_size))

    def beyond(self, x: Array) -> Array:
        """How far points lie beyond the plane, in elements [–]."""
        return np.asarray((x - self.point) @ self.normal / self.size)
