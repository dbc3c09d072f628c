"""Facets on the boundary of a body, outer or at a cut, and their nodes, distributed or gathered on every rank."""

from dataclasses import replace
from functools import cached_property
from typing import Protocol

import basix
import numpy as np
from dolfinx import fem
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.base.checks import require
from cutsim.base.compat import geometry_nodes
from cutsim.fields.faces import Face
from cutsim.fields.pieces import mesh_pieces
from cutsim.fields.points import FacetPoints
from cutsim.pairs.overlap import inside_body
from cutsim.pairs.pairing import Array, FacetShape, Hits, Indices


class OuterSurface:
    """Facets of the boundary, outer or at a cut, and the nodes of the displacement on them.

    Args:
        V: Space of a scalar or a vector, of degree 1 or 2; it is cracked along the facets of a cut.
        face: The facets, each with the cell to which it belongs.

    Attributes:
        face: The facets.
        shape: Reference shape of the facets.
        owned: Which facets belong to a cell of this rank.
        nodes: Local nodes (blocked dofs) of each facet, in the order of `shape`.
        sides: For each facet ±1: whether its outward normal is that of its reference coordinates.
        reference: Positions of the nodes of each facet in the reference configuration [length].
    """

    def __init__(self, V: fem.FunctionSpace, face: Face) -> None:
        mesh = V.mesh
        self.V, self.face, gdim = V, face, mesh.geometry.dim
        self.owned = face.cells < mesh.topology.index_map(mesh.topology.dim).size_local
        self.shape, orders = _facet_orders(V)
        dofs = V.dofmap.list
        self.nodes: NDArray[np.int32] = dofs[face.cells[:, None], orders[face.local]]
        x = V.tabulate_dof_coordinates()[:, :gdim]
        self.reference = x[self.nodes]
        inside = x[dofs[face.cells]].mean(axis=1)
        tangents = np.einsum("ab,fbi->fai", self.shape.values(self.shape.centre[None])[1][0], self.reference)
        outward = self.reference.mean(axis=1) - inside
        self.sides = np.sign(np.einsum("fi,fi->f", normals(tangents), outward))

    @cached_property
    def pieces(self) -> Indices:
        """Connected piece of the mesh to which each facet belongs. Collective."""
        mesh = self.V.mesh
        return np.asarray(mesh_pieces(mesh)[1][geometry_nodes(mesh)[self.face.cells, 0]], dtype=np.int64)

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
    """Surface with integration points, whose partners on a master surface are looked for.

    Args:
        V: As of `OuterSurface`.
        face: As of `OuterSurface`.
        points: Integration points of the facets.

    Attributes:
        count: Number of points on a facet.
        values: Shape functions at the points, shape (points, nodes), flattened over the facets.
        derivatives: Their derivatives, shape (points, directions, nodes).
        weighted: Which points have a weight; others are where the first point of their facet is.
        places: Places of arrays of point values, flattened over the facets.
    """

    def __init__(self, V: fem.FunctionSpace, face: Face, points: FacetPoints) -> None:
        super().__init__(V, face.in_order_of(points.facets))
        self.places, self.weighted, xi = points.flat_places, points.weights.ravel() > 0, points.xi
        self.count = xi.shape[1]
        self.values, self.derivatives = self.shape.values(xi.reshape(-1, xi.shape[-1]))

    def facets_of(self, points: Indices) -> Indices:
        """Facets of some points."""
        return points // self.count

    def completed(self, hits: Hits) -> Hits:
        """Partners also of the points without weight, from those of the others."""
        spare = np.flatnonzero(~self.weighted)
        if not len(spare):
            return hits
        row = np.full(len(self.weighted), -1)
        row[hits.points] = np.arange(len(hits.points))
        row[spare] = row[self.facets_of(spare) * self.count]
        points = np.flatnonzero(row >= 0)
        return replace(hits.some(row[points]), points=points)

    def at_points(self, nodes: Array) -> Array:
        """Values at the points of a field on the nodes of the facets, shape (facets, nodes, components)."""
        values = np.einsum("fqa,fai->fqi", self.values.reshape(-1, self.count, nodes.shape[1]), nodes)
        return values.reshape(-1, nodes.shape[-1])

    def tangents(self, nodes: Array) -> Array:
        """Tangents of the facets at the points, shape (points, directions, dimension)."""
        shaped = self.derivatives.reshape(-1, self.count, *self.derivatives.shape[1:])
        return np.einsum("fqka,fai->fqki", shaped, nodes).reshape(-1, shaped.shape[2], nodes.shape[-1])


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

    @property
    def pieces(self) -> Indices:
        """Connected piece of the mesh to which each facet belongs; −1 for one that belongs to none."""

    @property
    def cuts(self) -> Indices:
        """Number of the cut that closes elsewhere to which each facet belongs, as of `Face`."""

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
        shape, sides, reference: As of `OuterSurface`, for the facets of all ranks.
        global_nodes: Global nodes of each facet.
    """

    def __init__(self, surface: OuterSurface) -> None:
        V = surface.V
        self._comm: MPI.Comm = V.mesh.comm
        self._surface, self.shape, self._components = surface, surface.shape, V.dofmap.index_map_bs
        own, face = surface.owned, surface.face
        # the order of the facets does not depend on the ranks, so that rays through an edge meet the same of its facets
        labels = np.column_stack([V.mesh.topology.original_cell_index[face.cells], face.local])
        mine = (labels[own], surface.global_nodes[own], surface.sides[own], surface.reference[own])
        every, *parts = (np.concatenate(part) for part in zip(*self._comm.allgather(mine), strict=True))
        self._order = np.lexsort(every.T)
        self.global_nodes, self.sides, self.reference = (part[self._order] for part in parts)
        # a rank owns consecutive nodes: what the ranks send one after the other is in ascending order
        numbers, places = np.unique(self.global_nodes, return_inverse=True)
        self._places: NDArray[np.intp] = places.reshape(self.global_nodes.shape)
        first, last = V.dofmap.index_map.local_range
        self._own = numbers[(numbers >= first) & (numbers < last)] - first
        self._counts = np.array(self._comm.allgather(len(self._own) * self._components))

    @cached_property
    def pieces(self) -> Indices:
        """Connected piece of the mesh to which each facet belongs. Collective."""
        return self._shared(self._surface.pieces)

    @cached_property
    def cuts(self) -> Indices:
        """Number of the cut that closes elsewhere to which each facet belongs, as of `Face`. Collective."""
        return self._shared(self._surface.face.cuts)

    def _shared(self, numbers: Indices) -> Indices:
        """Numbers of the facets of all ranks, from those of this one. Collective."""
        return np.concatenate(self._comm.allgather(numbers[self._surface.owned]))[self._order]

    @property
    def face(self) -> Face:
        """The facets of this rank."""
        return self._surface.face

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
        cells = slave.face.cells
        cells = np.repeat(cells, len(points) // max(len(cells), 1))
        return inside_body(self._surface.V.mesh, points, cells, self._surface.face.cells)


def normals(tangents: Array) -> Array:
    """Normals t^⊥ = (t_y, −t_x) or t₁ × t₂, not of unit length, of tangents with shape (…, directions, dimension)."""
    if tangents.shape[-1] == 2:
        return np.stack([tangents[..., 0, 1], -tangents[..., 0, 0]], axis=-1)
    return np.asarray(np.cross(tangents[..., 0, :], tangents[..., 1, :]))


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
