"""Bodies whose surface passes through itself, where no contact resists."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import basix
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from cutsim.base.arrays import Array
from cutsim.base.checks import place
from cutsim.base.compat import geometry_nodes
from cutsim.fields.faces import Face
from cutsim.fields.pieces import mesh_pieces
from cutsim.fields.state import State
from cutsim.fields.symmetry import SymmetryPlane
from cutsim.interface.doubts import DEEP
from cutsim.pairs.contact_surfaces import all_faces
from cutsim.pairs.outer_surface import OuterSurface, SharedSurface
from cutsim.pairs.pairing import Indices

# simplices of which a cell of dolfinx consists, by their vertices
_SIMPLICES = {
    basix.CellType.triangle: [[0, 1, 2]],
    basix.CellType.quadrilateral: [[0, 1, 3], [0, 2, 3]],
    basix.CellType.tetrahedron: [[0, 1, 2, 3]],
    basix.CellType.hexahedron: [[0, a, b, 7] for a, b in ((1, 3), (1, 5), (2, 3), (2, 6), (4, 5), (4, 6))],
}
# rounding in barycentric coordinates, and a volume over the power of its longest edge that is none
_ROUNDING, _NOTHING = 1e-9, 1e-12


@dataclass(frozen=True)
class _Nodes:
    """Nodes of the surface, on every rank the same.

    Attributes:
        rows: Where each of them is among the nodes of the facets of a `SharedSurface`, flattened.
        numbers: Their global numbers, ascending.
        pieces: Connected piece of the mesh to which each belongs.
    """

    rows: Indices
    numbers: Indices
    pieces: Indices


@dataclass(frozen=True)
class _Cells:
    """Owned cells.

    Attributes:
        nodes: Local nodes of their vertices.
        reference: Where these were in the beginning [length].
        numbers: Global numbers of all their nodes.
        pieces: Connected piece of the mesh to which each belongs.
        depth: How many elements below the surface each of their vertices was in the beginning [–].
    """

    nodes: NDArray[np.int32]
    reference: Array
    numbers: Indices
    pieces: Indices
    depth: Array


@dataclass(frozen=True)
class Intersection:
    """Where a surface lies in its own body.

    Attributes:
        depth: Of the deepest node, in elements [–].
        place: Where this node is now [length].
        cells: Of each owned cell, whether such a node is in it or belongs to it.
    """

    depth: float
    place: list[float]
    cells: NDArray[np.bool_]

    @property
    def words(self) -> str:
        """What to say of it, with a place for the ``{share}`` of the work that it may change."""
        return (
            f"the surface passes through itself by {self.depth:.2g} of an element at {place(self.place)}, which may "
            "change {share}: see what smaller ones change there, or a contact of all surfaces ('automatic')"
        )


class SelfIntersection:
    """Finds nodes of the surface, outer or of cracks, that have come into the body to which they belong.

    A node that is in an element is as deep as the material there was in the beginning. So surfaces that only touch or
    slide do not count, however they are pressed, and what is as thin as one element has no inside. Edges are taken as
    straight.

    Args:
        state: Displacement and time.
        planes: Planes of symmetry, beyond which the body meets its image.
    """

    def __init__(self, state: State, planes: Sequence[SymmetryPlane] = ()) -> None:
        self._state, self._planes = state, planes

    def found(self) -> Intersection | None:
        """Where the surface lies in its own body by more than a part of an element now; None if nowhere. Collective."""
        mesh, degree = self._state.mesh, self._state.V.ufl_element().degree
        if not 1 < mesh.topology.dim == mesh.geometry.dim or degree > 2:
            return None
        V, u, cells = self._state.V, self._state.u.x.array, self._cells
        gdim = mesh.geometry.dim
        points = self._surface.nodes(u, start=False).reshape(-1, gdim)[self._nodes.rows]
        corners = cells.reference + u.reshape(-1, gdim)[cells.nodes]
        rows, inside = self._candidates(corners, points)
        within = np.zeros(len(rows))
        for simplex in _SIMPLICES[V.element.basix_element.cell_type]:
            x, depth = corners[rows][:, simplex], cells.depth[rows][:, simplex]
            edges = x[:, 1:] - x[:, :1]
            volume = np.abs(np.linalg.det(edges))
            some = volume > _NOTHING * np.abs(edges).max(axis=(1, 2), initial=0.0) ** gdim
            away = points[inside[some]] - x[some, 0]
            shares = np.linalg.solve(np.swapaxes(edges[some], 1, 2), away[..., None])[..., 0]
            shares = np.column_stack([1 - shares.sum(axis=1), shares])
            here = np.where(shares.min(axis=1) >= -_ROUNDING, (shares * depth[some]).sum(axis=1), 0.0)
            within[some] = np.maximum(within[some], here)
        deepest = int(within.argmax()) if len(within) else None
        mine = (0.0, []) if deepest is None else (-float(within[deepest]), points[inside[deepest]].tolist())
        beyond = np.max([np.zeros(len(points)), *(plane.beyond(points) for plane in self._planes)], axis=0)
        crossing = int(beyond.argmax())
        depth, where = min(*mesh.comm.allgather(mine), (-float(beyond[crossing]), points[crossing].tolist()))
        if -depth <= DEEP:
            return None
        deep = within > DEEP
        found = [self._nodes.numbers[beyond > DEEP], *mesh.comm.allgather(self._nodes.numbers[inside[deep]])]
        nodes = np.unique(np.concatenate(found))
        taken = np.isin(cells.numbers, nodes).any(axis=1)
        taken[rows[deep]] = True
        return Intersection(-depth, where, taken)

    def _candidates(self, corners: Array, points: Array) -> tuple[Indices, Indices]:
        """Cells and nodes of the surface in their boxes that belong to the same body, and not to the cell."""
        low, high = corners.min(axis=1), corners.max(axis=1)
        tree = cKDTree(points)
        near = tree.query_ball_point(0.5 * (low + high), 0.5 * (high - low).max(axis=1), p=np.inf)
        rows = np.repeat(np.arange(len(corners)), [len(n) for n in near])
        found = np.fromiter((i for n in near for i in n), dtype=np.int64, count=len(rows))
        cells, nodes = self._cells, self._nodes
        keep = ((low[rows] <= points[found]) & (points[found] <= high[rows])).all(axis=1)
        keep &= cells.pieces[rows] == nodes.pieces[found]
        keep &= (cells.numbers[rows] != nodes.numbers[found, None]).all(axis=1)
        return rows[keep], found[keep]

    @cached_property
    def _surface(self) -> SharedSurface:
        """All of the surface. Collective."""
        return SharedSurface(OuterSurface(self._state.V, Face.joined(all_faces(self._state))))

    @cached_property
    def _nodes(self) -> _Nodes:
        """Nodes of the surface. Collective."""
        numbers, rows = np.unique(self._surface.global_nodes, return_index=True)
        of_nodes = np.repeat(self._surface.pieces, self._surface.global_nodes.shape[1])
        return _Nodes(rows, numbers, of_nodes[rows])

    @cached_property
    def _cells(self) -> _Cells:
        """Cells of this rank. Collective."""
        V, mesh = self._state.V, self._state.mesh
        owned = mesh.topology.index_map(mesh.topology.dim).size_local
        layout, dofs = V.dofmap.dof_layout, V.dofmap.list[:owned]
        corners = range(len(basix.topology(V.element.basix_element.cell_type)[0]))
        nodes = dofs[:, [layout.entity_dofs(0, corner)[0] for corner in corners]]
        numbers = V.dofmap.index_map.local_to_global(dofs.ravel().astype(np.int32)).reshape(dofs.shape)
        pieces = mesh_pieces(mesh)[1][geometry_nodes(mesh)[:owned, 0]].astype(np.int64)
        reference = V.tabulate_dof_coordinates()[:, : mesh.geometry.dim]
        return _Cells(nodes, reference[nodes], numbers, pieces, self._depths(nodes, reference))

    def _depths(self, nodes: NDArray[np.int32], reference: Array) -> Array:
        """Distances of the vertices of cells from the surface, over those of the first layer below it. Collective."""
        V, surface = self._state.V, self._nodes
        x = self._surface.reference.reshape(-1, reference.shape[1])[surface.rows]
        distance, nearest = cKDTree(x).query(reference)
        numbers = V.dofmap.index_map.local_to_global(nodes.ravel().astype(np.int32)).reshape(nodes.shape)
        here = np.minimum(np.searchsorted(surface.numbers, numbers), len(surface.numbers) - 1)
        on_surface = surface.numbers[here] == numbers
        layer = np.zeros(len(surface.numbers))
        within = np.broadcast_to(distance[nodes].max(axis=1, keepdims=True), nodes.shape)
        np.maximum.at(layer, here[on_surface], within[on_surface])
        layer = np.max(V.mesh.comm.allgather(layer), axis=0)[nearest]
        return np.divide(distance, layer, out=np.zeros_like(distance), where=layer > 0)[nodes]
