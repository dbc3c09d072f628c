"""Opening and slide between two surfaces whose meshes do not match, and their derivatives (docs/theory.md §3.5).

The jump at a slave point has components in a frame (ν, a₁, a₂) that turns with the slave surface: ν is its outward
normal, a₁ follows the first reference direction of the facet.  Everything depends on the nodes through four vectors
only, the *primitives*: the point, the tangents of its facet, and the place on the master facet.
"""

from dataclasses import dataclass
from typing import Self

import basix
import numpy as np

from cutsim.outer_surface import OuterSurface, SharedSurface, normals
from cutsim.pairing import Array, Hits, Indices, inverse, near_facets, project
from cutsim.points import DEGREE

#: Distance both surfaces may move before partners are looked for anew, as a fraction of the mean slave facet's size.
MARGIN = 0.25
#: Gap that is taken for none, as a fraction of that size.
TOUCH = 1e-12


@dataclass(frozen=True)
class Points:
    """Points on the slave surface in a configuration, flattened over its facets.

    Attributes:
        x: Positions, shape (points, dimension) [length].
        tangents: Tangents of the facet, shape (points, directions, dimension).
        normals: Outward normals, not of unit length.
        frames: Frames (ν, a₁, …) as rows.
    """

    x: Array
    tangents: Array
    normals: Array
    frames: Array

    @classmethod
    def on(cls, nodes: Array, sides: Array, tables: tuple[Array, Array]) -> Self:
        """Points of each facet, with its nodes and the shape functions and derivatives at its points."""
        dim = nodes.shape[-1]
        x = np.einsum("qa,fai->fqi", tables[0], nodes).reshape(-1, dim)
        tangents = np.einsum("qka,fai->fqki", tables[1], nodes).reshape(-1, dim - 1, dim)
        outward = np.repeat(sides, len(tables[0]))[:, None] * normals(tangents)
        nu = _unit(outward)
        first = np.stack([-nu[:, 1], nu[:, 0]], axis=-1) if dim == 2 else _unit(tangents[:, 0])
        rest = [] if dim == 2 else [np.cross(nu, first)]
        return cls(x, tangents, outward, np.stack([nu, first, *rest], axis=1))

    def turning(self, rows: Indices) -> Array:
        """Derivative of the frames of some points with respect to the tangents.

        Returns:
            Shape (rows, axes, dimension, directions, dimension).
        """
        dim = self.x.shape[-1]
        t, outward, frames = self.tangents[rows], self.normals[rows], self.frames[rows]
        size = np.linalg.norm(outward, axis=-1)[:, None, None, None]
        side = np.sign(np.einsum("ni,ni->n", normals(t), outward))
        of_normal = side[:, None, None, None] * _normal_derivative(t) / size
        nu, first = frames[:, 0], frames[:, 1]
        d_nu = of_normal - np.einsum("ni,nj,njkl->nikl", nu, nu, of_normal)
        if dim == 2:
            return np.stack([d_nu, np.stack([-d_nu[:, 1], d_nu[:, 0]], axis=1)], axis=1)
        d_first = np.zeros_like(d_nu)
        d_first[:, :, 0] = np.eye(3) - np.einsum("ni,nj->nij", first, first)
        d_first /= np.linalg.norm(t[:, 0], axis=-1)[:, None, None, None]
        d_second = np.einsum("nij,njkl->nikl", _skew(nu), d_first) - np.einsum("nij,njkl->nikl", _skew(first), d_nu)
        return np.stack([d_nu, d_first, d_second], axis=1)


@dataclass(frozen=True)
class Pairs:
    """Points and their partners in a configuration.

    Attributes:
        slave: The slave points.
        hits: Their partners.
        values: Shape functions of the master facets at the partners, shape (hits, nodes).
        derivatives: Their derivatives, shape (hits, directions, nodes).
        jump: Opening and slide of every point, shape (points, dimension) [length].
        slide_rate: Derivative of the jump by the reference coordinates at fixed frame, shape (hits, dimension,
            directions); for pairs that do not move on, None.
        distance: From each point to its partner, x_m − x_s, shape (hits, dimension) [length].
        tangents: Current tangents of the master facets at the partners, shape (hits, directions, dimension).
    """

    slave: Points
    hits: Hits
    values: Array
    derivatives: Array
    jump: Array
    slide_rate: Array | None
    distance: Array
    tangents: Array

    def linearise(self, rows: Indices) -> tuple[Array, Array, Array]:
        """Derivatives of some pairs with respect to the primitives.

        Args:
            rows: Pairs, by their place in `hits`.

        Returns:
            Derivatives of the jump, of the frame and of the reference coordinates; the last two indices are
            primitive and component.
        """
        points = self.hits.points[rows]
        n, dim = len(points), self.slave.x.shape[-1]
        frames = self.slave.frames[points]
        d_frame = np.zeros((n, dim, dim, dim + 1, dim))
        d_frame[:, :, :, 1:dim] = self.slave.turning(points)
        apart = np.zeros((n, dim, dim + 1, dim))
        apart[:, :, dim], apart[:, :, 0] = np.eye(dim), -np.eye(dim)
        d_xi = np.zeros((n, dim - 1, dim + 1, dim))
        if self.slide_rate is None:
            d_jump = np.einsum("nai,nipj->napj", frames, apart)
            d_jump += np.einsum("ni,naipj->napj", self.distance[rows], d_frame)
            return d_jump, d_frame, d_xi
        tangents = self.tangents[rows]
        missing = self.hits.gap[rows, None, None, None] * d_frame[:, 0] - apart
        lateral = inverse(np.einsum("nai,nki->nak", frames[:, 1:], tangents))
        d_xi = np.einsum("nka,nai,nipj->nkpj", lateral, frames[:, 1:], missing)
        d_jump = np.einsum("nak,nkpj->napj", self.slide_rate[rows], d_xi)
        d_jump[:, 0] = np.einsum("ni,nipj->npj", frames[:, 0], np.einsum("nki,nkpj->nipj", tangents, d_xi) + apart)
        return d_jump, d_frame, d_xi

    def increment(self, slave: Array, master: Array) -> Array:
        """Increment of the distance of all points and the material points they meet now.

        Args:
            slave: Increments of the points, shape (points, dimension) [length].
            master: Increments of the nodes of the master facets [length].

        Returns:
            Shape (points, dimension), zero without partner.
        """
        change = np.zeros_like(slave)
        points, facets = self.hits.points, self.hits.facets
        change[points] = np.einsum("nb,nbi->ni", self.values, master[facets]) - slave[points]
        return change


class PairKinematics:
    """The points of a slave surface and their partners on a master surface. Every method is collective.

    Sliding pairs: a point's partner is where the ray along ν meets the current master surface, and the opening is the
    distance along the ray.  The slide grows by −a_α·(x_m − x_s) at the *start* of the step, between the point and the
    material point that it meets now: it needs no facet-wise memory, and a rigid rotation adds nothing to it.

    Fixed pairs: partners are those of the reference configuration, and the jump is x_m − x_s in the frame, less what it
    is in the reference configuration.

    Args:
        slave: The slave surface.
        master: The master surface.
        fixed: Whether pairs are fixed.
        search: Largest distance of a partner [length].
        size: Mean size of the slave facets [length].

    Attributes:
        tables: Shape functions and derivatives at the points of a slave facet.
        version: Grows when other facets have come near each other.
        near: Slave and master facets that are near each other.
    """

    def __init__(self, slave: OuterSurface, master: SharedSurface, *, fixed: bool, search: float, size: float) -> None:
        self.slave, self.master, self.fixed, self._search = slave, master, fixed, search
        places = basix.make_quadrature(slave.shape.element.cell_type, DEGREE)[0]
        self.tables = slave.shape.values(places)
        self._size, self._margin = size, MARGIN * size
        self.version = 0
        nodes = slave.reference, master.reference
        points = self._points(nodes[0])
        self._look_around(points, nodes)
        self._old, self._old_nodes, self._old_hits = points, nodes, self._hits(points, nodes)
        self._slid: Array = np.zeros((len(points.x), points.x.shape[-1] - 1))
        self._offset = np.zeros_like(points.x)
        if fixed:
            self._offset = self.pairs(nodes).jump

    def nodes(self, u: Array) -> tuple[Array, Array]:
        """Current nodes of slave and master facets, from a displacement of the local dofs."""
        return self.slave.reference + self.slave.gather(u), self.master.reference + self.master.gather(u)

    def interpolate(self, nodes: Array) -> Array:
        """Values at the points of a field on the nodes of the slave facets."""
        return np.einsum("qa,fai->fqi", self.tables[0], nodes).reshape(-1, nodes.shape[-1])

    def at_stencil(self, field: Array, pairs: "Pairs", rows: Indices) -> Array:
        """Values of a field over the local dofs at the nodes on which some pairs act, slave facet first."""
        slave = self.slave.gather(field)[pairs.hits.points[rows] // len(self.tables[0])]
        return np.concatenate([slave, self.master.gather(field)[pairs.hits.facets[rows]]], axis=1)

    def near_nodes(self) -> Indices:
        """Global nodes on which pairs of near facets act, those of the slave facet first; slave facets of this rank."""
        slave, master = (facets[self.slave.owned[self.near[0]]] for facets in self.near)
        return np.hstack([self.slave.global_nodes[slave], self.master.global_nodes[master]])

    def begin(self, nodes: tuple[Array, Array]) -> None:
        """Take a configuration for the start of a step."""
        self._old, self._old_nodes = self._points(nodes[0]), nodes
        if not self.fixed:
            self._old_hits = self._hits(self._old, nodes)

    def commit(self, pairs: "Pairs") -> None:
        """Keep the slide at the end of a step."""
        self._slid = pairs.jump[:, 1:]

    def pairs(self, nodes: tuple[Array, Array]) -> Pairs:
        """Points and partners for nodes of slave and master facets."""
        points = self._points(nodes[0])
        hits = self._old_hits if self.fixed else self._hits(points, nodes)
        values, derivatives = self.master.shape.values(hits.xi)
        y = nodes[1][hits.facets]
        distance = np.einsum("nb,nbi->ni", values, y) - points.x[hits.points]
        tangents = np.einsum("nkb,nbi->nki", derivatives, y)
        if self.fixed:
            jump, rate = self._fixed_jump(points, hits, distance), None
        else:
            jump, rate = self._sliding_jump(hits, values, derivatives)
            self._slide_of_lost(points, hits, nodes[1], jump)
        return Pairs(points, hits, values, derivatives, jump, rate, distance, tangents)

    def _fixed_jump(self, points: Points, hits: Hits, distance: Array) -> Array:
        jump = np.zeros_like(points.x)
        jump[:, 0] = self._search
        jump[hits.points] = np.einsum("nai,ni->na", points.frames[hits.points], distance) - self._offset[hits.points]
        return jump

    def _sliding_jump(self, hits: Hits, values: Array, derivatives: Array) -> tuple[Array, Array]:
        """The jump, and its rate with the place on the master facet."""
        frames, y = self._old.frames[hits.points, 1:], self._old_nodes[1][hits.facets]
        before = np.einsum("nb,nbi->ni", values, y) - self._old.x[hits.points]
        jump = np.column_stack([np.full(len(self._slid), self._search), self._slid])
        # surfaces that just touch count as pressed: rounding would decide which points feel the other one
        touch = TOUCH * self._size
        jump[hits.points, 0] = np.where(np.abs(hits.gap) <= touch, -touch, hits.gap)
        jump[hits.points, 1:] -= np.einsum("nai,ni->na", frames, before)
        rate = np.zeros((len(before), jump.shape[1], jump.shape[1] - 1))
        rate[:, 1:] = -np.einsum("nai,nkb,nbi->nak", frames, derivatives, y)
        return jump, rate

    def _slide_of_lost(self, points: Points, hits: Hits, master: Array, jump: Array) -> None:
        """Slide of points that have lost their partner in this step, against the one they had: friction did work."""
        lost = ~np.isin(self._old_hits.points, hits.points)
        rows, facets = self._old_hits.points[lost], self._old_hits.facets[lost]
        values = self.master.shape.values(self._old_hits.xi[lost])[0]
        for sign, at, y in ((1, points, master), (-1, self._old, self._old_nodes[1])):
            distance = np.einsum("nb,nbi->ni", values, y[facets]) - at.x[rows]
            jump[rows, 1:] += sign * np.einsum("nai,ni->na", at.frames[rows, 1:], distance)

    def _points(self, nodes: Array) -> Points:
        return Points.on(nodes, self.slave.sides, self.tables)

    def _hits(self, points: Points, nodes: tuple[Array, Array]) -> Hits:
        if self._moved(nodes):
            self._look_around(points, nodes)
        count = len(self.tables[0])
        slaves, masters = self.near
        of_facet = slaves[:, None] * count + np.arange(count)
        pairs = of_facet.ravel(), np.repeat(masters, count)
        return project(points.x, points.frames, pairs, nodes[1], self.master.sides, self.master.shape, self._search)

    def _moved(self, nodes: tuple[Array, Array]) -> bool:
        """Whether the surfaces may have come nearer than the margin since they were last searched."""
        moves = [np.abs(now - then).max(initial=0.0) for now, then in zip(nodes, self._seen, strict=True)]
        return bool(self.slave.maximum(moves[0]) + moves[1] > self._margin)

    def _look_around(self, points: Points, nodes: tuple[Array, Array]) -> None:
        """Find the facets that are near each other."""
        count, ray = len(self.tables[0]), self._search * points.frames[:, 0]
        shape = len(nodes[0]), count, points.x.shape[-1]
        rays = np.concatenate([(points.x + ray).reshape(shape), (points.x - ray).reshape(shape)], axis=1)
        self.near = near_facets(rays, nodes[1], self._margin)
        self._seen = nodes
        self.version += 1


def _unit(v: Array) -> Array:
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))


def _skew(v: Array) -> Array:
    """Matrices of the cross products v × ·."""
    zero = np.zeros(len(v))
    rows = [zero, -v[:, 2], v[:, 1], v[:, 2], zero, -v[:, 0], -v[:, 1], v[:, 0], zero]
    return np.stack(rows, axis=-1).reshape(-1, 3, 3)


def _normal_derivative(tangents: Array) -> Array:
    """Derivative of `normals`, shape (points, dimension, directions, dimension)."""
    if tangents.shape[-1] == 2:
        return np.broadcast_to(np.array([[[0.0, 1.0]], [[-1.0, 0.0]]]), (len(tangents), 2, 1, 2))
    return np.stack([-_skew(tangents[:, 1]), _skew(tangents[:, 0])], axis=2)
