"""Kinematics of a pair: partners of the slave points, opening and slide (docs/theory.md §3.5)."""

from dataclasses import dataclass, replace

import basix
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from cutsim.base.assembly import box
from cutsim.base.memory import Memory
from cutsim.fields.points import DEGREE
from cutsim.pairs.configuration import Pairs, Points
from cutsim.pairs.outer_surface import Master, OuterSurface, normals
from cutsim.pairs.pairing import Array, Hits, Indices, near_facets, project

#: Degree of the quadrature on a slave surface, by that of the displacement: master facets end within a slave facet.
DEGREES = {1: DEGREE, 2: 8}
#: Distance both surfaces may move before partners are looked for anew, as a fraction of the mean slave facet's size.
MARGIN = 0.25
#: Gap that is taken for none, as a fraction of that size.
TOUCH = 1e-12
#: Cosine between the normals of a point and of the facet nearest to it from which one does not stand across the other.
FACING = 0.5
#: Multiple of the margin beyond which, or if not finite, a displacement is no state to look for partners in.
WILD = 1e9


@dataclass(frozen=True)
class _Known:
    """Data of the points at the end of a step.

    Attributes:
        slid: Slide so far [length].
        met: Which of them have a partner.
        deep: How deep the deepest is [length].
    """

    slid: Array
    met: NDArray[np.bool_]
    deep: float = 0.0


@dataclass(frozen=True)
class _Search:
    """Last search for facets that are near each other.

    Attributes:
        near: Slave and master facets.
        nodes: Nodes of slave and master facets at the time.
        reach: How far it reached [length].
        version: Its number.
    """

    near: tuple[Indices, Indices]
    nodes: tuple[Array, Array]
    reach: float
    version: int


class PairKinematics:
    """Slave points and their partners on a master surface. Every method is collective.

    Sliding pairs: a point's partner is where the ray along ν meets the current master surface, and the opening is the
    distance along the ray.  The slide grows by −a_α·(x_m − x_s) at the *start* of the step, between the point and the
    material point that it meets now: it needs no facet-wise memory, and a rigid rotation adds nothing to it.

    Fixed pairs: partners are those of the reference configuration, and the jump is x_m − x_s in the frame, less what it
    is in the reference configuration.

    Args:
        memory: Memory of the run.
        name: Name of the slave surface.
        slave: The slave surface.
        master: The master surface.
        small_sliding: Whether pairs are those of the reference configuration.
        search: Largest distance of a partner [length]. Points that were in the body of the master from the start, or
            come into it during a step, find theirs at any depth.
        size: Mean size of the slave facets [length].

    Attributes:
        tables: FacetShape functions and derivatives at the points of a slave facet.
    """

    def __init__(
        self,
        memory: Memory,
        name: str,
        slave: OuterSurface,
        master: Master,
        *,
        small_sliding: bool,
        search: float,
        size: float,
    ) -> None:
        self.slave, self.master, self.small_sliding, self._search = slave, master, small_sliding, search
        shape = slave.shape.element
        places = basix.make_quadrature(shape.cell_type, DEGREES[shape.degree])[0]
        self.tables = slave.shape.values(places)
        self._size, self._margin = size, MARGIN * size
        nodes = slave.reference, master.reference
        points = self._points(nodes[0])
        self._old, self._old_nodes = points, nodes
        slid = np.zeros((len(points.x), points.x.shape[-1] - 1))
        self._known = memory.value(f"{name}: partners", _Known(slid, np.zeros(len(points.x), dtype=bool)))
        self._found = memory.value(f"{name}: search", self._look_around(points, nodes, search, 0))
        self._old_hits = self._hits(points, nodes)
        if not small_sliding:
            self._dig_out(points, nodes)
        self._offset = np.zeros_like(points.x)
        if small_sliding:
            self._offset = self.pairs(nodes).jump

    def nodes(self, u: Array, *, start: bool = False) -> tuple[Array, Array]:
        """Current nodes of slave and master facets, from a displacement of the local dofs.

        Args:
            u: The displacement.
            start: Whether it is that at the start of the step.
        """
        return self.slave.reference + self.slave.gather(u), self.master.nodes(u, start=start)

    def interpolate(self, nodes: Array) -> Array:
        """Values at the points of a field on the nodes of the slave facets."""
        return np.einsum("qa,fai->fqi", self.tables[0], nodes).reshape(-1, nodes.shape[-1])

    def at_stencil(self, field: Array, pairs: Pairs, rows: Indices) -> Array:
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
        if not self.small_sliding:
            self._old_hits = self._hits(self._old, nodes)

    def note(self, pairs: Pairs) -> None:
        """Trial slide, and which points have a partner how deep, at the end of a step."""
        self._known.trial = self._known_of(pairs.jump[:, 1:], pairs.hits)

    @property
    def near(self) -> tuple[Indices, Indices]:
        """Slave and master facets that are near each other."""
        return self._found.trial.near

    @property
    def version(self) -> int:
        """Number that grows when other facets have come near each other."""
        return self._found.trial.version

    @np.errstate(divide="ignore", invalid="ignore", over="ignore")
    def pairs(self, nodes: tuple[Array, Array]) -> Pairs:
        """Points and partners for nodes of slave and master facets."""
        points = self._points(nodes[0])
        hits = self._old_hits if self.small_sliding else self._hits(points, nodes)
        values, derivatives = self.master.shape.values(hits.xi)
        y = nodes[1][hits.facets]
        distance = np.einsum("nb,nbi->ni", values, y) - points.x[hits.points]
        tangents = np.einsum("nkb,nbi->nki", derivatives, y)
        if self.small_sliding:
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
        slid = self._known.committed.slid
        jump = np.column_stack([np.full(len(slid), self._search), slid])
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

    def _known_of(self, slid: Array, hits: Hits) -> _Known:
        met = np.zeros(len(slid), dtype=bool)
        met[hits.points] = True
        return _Known(slid, met, max(self.slave.maximum(float(-hits.gap.min(initial=0.0))), 0.0))

    def _dig_out(self, points: Points, nodes: tuple[Array, Array]) -> None:
        """Find partners of points that are in the other body, deeper than the search, from the start.

        Raises:
            ValueError: On all ranks, if there are none for some of them.
        """
        inside = self.master.holds(points.x, self.slave)
        low, high = box(self.slave.V.mesh.comm, np.concatenate([n.reshape(-1, n.shape[-1]) for n in nodes]))
        depth = self._buried(points, nodes, inside)
        while (deepest := self.slave.maximum(depth.max(initial=0.0))) > 0:
            lost = self.slave.total(int(np.count_nonzero(depth)))
            deep = self._known.committed.deep
            if deep > np.linalg.norm(high - low):
                raise ValueError(
                    f"slave_facets: {lost} points lie in the body of master_facets from the start, about {deepest:.3g} "
                    "deep, and their normals do not meet its surface: let the bodies overlap less, or give all facets "
                    "that face each other"
                )
            # a ray may be longer than the way to the nearest facet
            self._known.set(replace(self._known.committed, met=inside, deep=2 * max(deepest, deep)))
            self._old_hits = self._hits(points, nodes)
            depth = self._buried(points, nodes, inside)
        self._known.set(self._known_of(self._known.committed.slid, self._old_hits))

    def _buried(self, points: Points, nodes: tuple[Array, Array], inside: NDArray[np.bool_]) -> Array:
        """Distance to the nearest facet of the master of points that are inside and have no partner; else 0.

        Points beside which that facet stands across belong to a side of the body that faces nothing.
        """
        depth = np.zeros(len(points.x))
        lost = inside.copy()
        lost[self._old_hits.points] = False
        rows = np.flatnonzero(lost & np.repeat(self.slave.owned, len(self.tables[0])))
        if len(rows) and len(nodes[1]):
            distance, nearest = cKDTree(nodes[1].mean(axis=1)).query(points.x[rows])
            derivatives = self.master.shape.values(self.master.shape.centre[None])[1][0]
            outward = self.master.sides[nearest, None] * normals(
                np.einsum("kb,nbi->nki", derivatives, nodes[1][nearest])
            )
            facing = np.einsum("ni,ni->n", outward, points.frames[rows, 0]) / np.linalg.norm(outward, axis=1)
            depth[rows] = np.where(np.abs(facing) > FACING, distance, 0.0)
        return depth

    def _hits(self, points: Points, nodes: tuple[Array, Array]) -> Hits:
        reach = self._reach(nodes)
        if self._moved(nodes, reach):
            # what has come near is no part of the step: it stays known if the step is given up
            self._found.set(self._look_around(points, nodes, reach, self.version))
        count = len(self.tables[0])
        slaves, masters = self.near
        of_facet = slaves[:, None] * count + np.arange(count)
        pairs = of_facet.ravel(), np.repeat(masters, count)
        hits = project(points.x, points.frames, pairs, nodes[1], self.master.sides, self.master.shape, reach)
        return hits.some(self._entered(hits))

    def _reach(self, nodes: tuple[Array, Array]) -> float:
        """How far partners are looked for: points are as deep as they were, and as the bodies have moved since."""
        moved = sum(
            np.linalg.norm(now - then, axis=-1).max(initial=0.0)
            for now, then in zip(nodes, self._old_nodes, strict=True)
        )
        moved = self.slave.maximum(float(np.nan_to_num(moved, nan=np.inf)))
        return self._search + self._known.committed.deep + (moved if moved < WILD * self._margin else 0.0)

    def _entered(self, hits: Hits) -> NDArray[np.bool_]:
        """Which partners are in front of their points, near them, or behind because the points have come into the body.

        What a ray meets far behind its point may else be the far side of a thin body.
        """
        far = hits.gap < -self._search
        rows = np.flatnonzero(far & ~self._known.committed.met[hits.points])
        values = self.master.shape.values(hits.xi[rows])[0]
        before = np.einsum("nb,nbi->ni", values, self._old_nodes[1][hits.facets[rows]]) - self._old.x[hits.points[rows]]
        gap = np.einsum("ni,ni->n", before, self._old.frames[hits.points[rows], 0])
        keep = np.ones(len(far), dtype=bool)
        keep[rows] = gap >= -self._search
        return keep

    def _moved(self, nodes: tuple[Array, Array], reach: float) -> bool:
        """Whether rays may have come nearer to other facets than the margin since these were last searched."""
        found = self._found.trial
        slave, master = (np.abs(now - then).max(initial=0.0) for now, then in zip(nodes, found.nodes, strict=True))
        farther = max(reach - found.reach, 0.0)
        total = self.slave.maximum(float(np.nan_to_num(slave + master + farther, nan=np.inf)))
        return self._margin < total < WILD * self._margin

    def _look_around(self, points: Points, nodes: tuple[Array, Array], reach: float, version: int) -> _Search:
        """Find the facets that are near each other."""
        count, ray = len(self.tables[0]), reach * points.frames[:, 0]
        shape = len(nodes[0]), count, points.x.shape[-1]
        rays = np.concatenate([(points.x + ray).reshape(shape), (points.x - ray).reshape(shape)], axis=1)
        return _Search(near_facets(rays, nodes[1], self._margin), nodes, reach, version + 1)
