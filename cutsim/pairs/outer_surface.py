"""Facets on the outer boundary and their nodes, distributed or gathered on every rank."""

from typing import Protocol

import basix
import numpy as np
from dolfinx import fem
from dolfinx.mesh import Mesh
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.base.checks import require
from cutsim.fields.points import FacetPoints
from cutsim.fields.sizes import incidence
from cutsim.pairs.overlap import inside_body
from cutsim.pairs.pairing import Array, FacetShape, Indices


class OuterSurface:
    """Facets of the outer boundary and the nodes of the displacement on them.

    Args:
        V: Space of a scalar or a vector, of degree 1 or 2.
        facets: Local exterior facets, ghosts included.

    Attributes:
        facets: The facets.
        shape: Reference shape of the facets.
        cells: Cell of each facet.
        local: Number of the facet within its cell.
        owned: Which facets belong to a cell of this rank.
        nodes: Local nodes (blocked dofs) of each facet, in the order of `shape`.
        sides: For each facet ±1: whether its outward normal is that of its reference coordinates.
        reference: Positions of the nodes of each facet in the reference configuration [length].
    """

    def __init__(self, V: fem.FunctionSpace, facets: NDArray[np.int32]) -> None:
        mesh = V.mesh
        self.V, self.facets, gdim = V, facets, mesh.geometry.dim
        self.cells, self.local = _cells_of(mesh, facets)
        self.owned = self.cells < mesh.topology.index_map(mesh.topology.dim).size_local
        self.shape, orders = _facet_orders(V)
        dofs = V.dofmap.list
        self.nodes: NDArray[np.int32] = dofs[self.cells[:, None], orders[self.local]]
        x = V.tabulate_dof_coordinates()[:, :gdim]
        self.reference = x[self.nodes]
        inside = x[dofs[self.cells]].mean(axis=1)
        tangents = np.einsum("ab,fbi->fai", self.shape.values(self.shape.centre[None])[1][0], self.reference)
        outward = self.reference.mean(axis=1) - inside
        self.sides = np.sign(np.einsum("fi,fi->f", normals(tangents), outward))

    @property
    def global_nodes(self) -> Indices:
        """Global nodes of each facet."""
        numbers = self.V.dofmap.index_map.local_to_global(self.nodes.ravel().astype(np.int32))
        return np.asarray(numbers, dtype=np.int64).reshape(self.nodes.shape)

    def gather(self, values: Array) -> Array:
        """Values on the facets, shape (facets, nodes, components), of an array over the local dofs."""
        return values.reshape(-1, self.V.dofmap.index_map_bs)[self.nodes]

    def maximum(self, value: float) -> float:
        """Largest of one value a rank. Collective."""
        return float(self.V.mesh.comm.allreduce(value, op=MPI.MAX))

    def total(self, count: int) -> int:
        """Sum of one number a rank. Collective."""
        return int(self.V.mesh.comm.allreduce(count, op=MPI.SUM))


class SlaveSurface(OuterSurface):
    """Outer surface with integration points, whose partners on a master surface are looked for.

    Args:
        V: As of `OuterSurface`.
        points: Integration points of the facets.

    Attributes:
        places: Places of the points, flattened over the facets.
    """

    def __init__(self, V: fem.FunctionSpace, points: FacetPoints) -> None:
        super().__init__(V, points.facets)
        self.places = points.flat_places


class Master(Protocol):
    """Protocol of a master surface, of which every rank knows all facets. Every method is collective.

    Attributes:
        shape, sides, reference: As of `OuterSurface`, for the facets of all ranks.
        global_nodes: Global nodes of each facet; −1, which PETSc passes over, for one that has no unknowns.
    """

    shape: FacetShape
    sides: Array
    reference: Array
    global_nodes: Indices

    def nodes(self, u: Array, *, start: bool) -> Array:
        """Current nodes of the facets, from a displacement of the local dofs, be it that at the start of the step."""

    def gather(self, values: Array) -> Array:
        """Values on the facets, shape (facets, nodes, components), of an array over the local dofs of each rank."""

    def holds(self, points: Array, slave: OuterSurface) -> NDArray[np.bool_]:
        """Which points, on the facets of another surface, are in its body in the reference configuration."""


class SharedSurface:
    """Outer surface of a body as a master, gathered on every rank. Every method is collective.

    Args:
        surface: The facets of this rank.

    Attributes:
        surface: The facets of this rank.
        shape, sides, reference: As of `OuterSurface`, for the facets of all ranks.
        global_nodes: Global nodes of each facet.
    """

    def __init__(self, surface: OuterSurface) -> None:
        V = surface.V
        self._comm: MPI.Comm = V.mesh.comm
        self.surface, self.shape, self._components = surface, surface.shape, V.dofmap.index_map_bs
        own = surface.owned
        parts = self._comm.allgather((surface.global_nodes[own], surface.sides[own], surface.reference[own]))
        self.global_nodes, self.sides, self.reference = (np.concatenate(part) for part in zip(*parts, strict=True))
        # a rank owns consecutive nodes: what the ranks send one after the other is in ascending order
        numbers, places = np.unique(self.global_nodes, return_inverse=True)
        self._places: NDArray[np.intp] = places.reshape(self.global_nodes.shape)
        first, last = V.dofmap.index_map.local_range
        self._own = numbers[(numbers >= first) & (numbers < last)] - first
        self._counts = np.array(self._comm.allgather(len(self._own) * self._components))

    def nodes(self, u: Array, *, start: bool) -> Array:
        """Current nodes of the facets, from a displacement of the local dofs, be it that at the start of the step."""
        return self.reference + self.gather(u)

    def gather(self, values: Array) -> Array:
        """Values on the facets, shape (facets, nodes, components), of an array over the local dofs of each rank."""
        mine = np.ascontiguousarray(values.reshape(-1, self._components)[self._own])
        everything: Array = np.empty(int(self._counts.sum()))
        self._comm.Allgatherv(mine, [everything, self._counts])
        return everything.reshape(-1, self._components)[self._places]

    def holds(self, points: Array, slave: OuterSurface) -> NDArray[np.bool_]:
        """Which points, on the facets of another surface, are in its body in the reference configuration."""
        cells = np.repeat(slave.cells, len(points) // max(len(slave.cells), 1))
        return inside_body(self.surface.V.mesh, points, cells, self.surface.cells)


def normals(tangents: Array) -> Array:
    """Normals t^⊥ = (t_y, −t_x) or t₁ × t₂, not of unit length, of tangents with shape (…, directions, dimension)."""
    if tangents.shape[-1] == 2:
        return np.stack([tangents[..., 0, 1], -tangents[..., 0, 0]], axis=-1)
    return np.asarray(np.cross(tangents[..., 0, :], tangents[..., 1, :]))


def _cells_of(mesh: Mesh, facets: NDArray[np.int32]) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """The cell of each exterior facet, and its number therein."""
    tdim = mesh.topology.dim
    mesh.topology.create_connectivity(tdim - 1, tdim)
    to_cells = mesh.topology.connectivity(tdim - 1, tdim)
    cells = to_cells.array[to_cells.offsets[facets]]
    per_cell = incidence(mesh, tdim, tdim - 1)[cells]
    return cells, np.argmax(per_cell == np.asarray(facets)[:, None], axis=1).astype(np.int32)


def _facet_orders(V: fem.FunctionSpace) -> tuple[FacetShape, NDArray[np.int32]]:
    """Reference shape of the facets, and for each facet of a cell its nodes in the order of that shape."""
    cell = V.element.basix_element
    require("degree", cell.degree, cell.degree in (1, 2), "1 or 2: fields on the surfaces of a pair")
    tdim = V.mesh.topology.dim
    kind = basix.cell.subentity_types(cell.cell_type)[tdim - 1][0]
    element = basix.create_element(basix.ElementFamily.P, kind, cell.degree, cell.lagrange_variant)
    corners, orders = basix.geometry(cell.cell_type), []
    for facet, vertices in enumerate(basix.topology(cell.cell_type)[tdim - 1]):
        dofs = np.array(V.dofmap.dof_layout.entity_closure_dofs(tdim - 1, facet))
        x = corners[vertices]
        edges = x[1:tdim] - x[0]
        places = x[0] + element.points @ edges
        distances = np.linalg.norm(places[:, None] - cell.points[dofs][None], axis=-1)
        orders.append(dofs[distances.argmin(axis=1)])
    return FacetShape(element), np.array(orders, dtype=np.int32)
