"""Search for the partners of the slave points on a master surface (docs/theory.md §3.5)."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from cutsim.base.assembly import box
from cutsim.base.memory import Memory
from cutsim.pairs.configuration import Points
from cutsim.pairs.outer_surface import Master, SlaveSurface, normals
from cutsim.pairs.pairing import Array, Hits, Indices, near_facets, nearest, project

#: Distance both surfaces may move before partners are looked for anew, as a fraction of the mean slave facet's size.
MARGIN = 0.5
#: Cosine between the normals of a point and of the facet nearest to it from which one does not stand across the other.
FACING = 0.5
#: Multiple of the margin beyond which, or if not finite, a displacement is no state to look for partners in.
WILD = 1e9


@dataclass(frozen=True)
class _Known:
    """Data of the points at the end of a step.

    Attributes:
        met: Which of them have a partner.
        deep: How deep the deepest is [length].
    """

    met: NDArray[np.bool_]
    deep: float = 0.0


@dataclass(frozen=True)
class Found:
    """Last search for facets that are near each other.

    Attributes:
        facets: Slave and master facets.
        nodes: Nodes of slave and master facets at the time.
        reach: How far it reached [length].
        version: Its number.
    """

    facets: tuple[Indices, Indices]
    nodes: tuple[Array, Array]
    reach: float
    version: int


class PartnerSearch:
    """Finds where the rays of slave points meet a master surface. Every method is collective.

    Only facets that are near each other are looked at. They are searched anew when something has moved by more than a
    margin since.

    Args:
        memory: Memory of the run.
        name: Name of the slave surface.
        slave: The slave surface.
        master: The master surface.
        points: Points of the slave in the reference configuration.
        search: Largest distance of a partner [length]. Points that were in the body of the master from the start, or
            come into it during a step, find theirs at any depth.
        size: Mean size of the slave facets [length].
    """

    def __init__(
        self,
        memory: Memory,
        name: str,
        slave: SlaveSurface,
        master: Master,
        points: Points,
        *,
        search: float,
        size: float,
    ) -> None:
        self._slave, self._master, self._search, self._margin = slave, master, search, MARGIN * size
        nodes = slave.reference, master.reference
        self._start = points, nodes
        known = _Known(np.zeros(len(points.x), dtype=bool))
        self._known = memory.value(f"{name}: partners", known, places=slave.places)
        first = self._look_around(points, nodes, search, 0)
        self._found = memory.cache(first, lambda found: replace(first, version=found.version + 1))

    @property
    def facets(self) -> tuple[Indices, Indices]:
        """Slave and master facets that are near each other."""
        return self._found.value.facets

    @property
    def version(self) -> int:
        """Number that grows when other facets have come near each other."""
        return self._found.value.version

    def begin(self, points: Points, nodes: tuple[Array, Array]) -> Hits:
        """Take a configuration for the start of a step; where its rays meet the master."""
        self._start = points, nodes
        return self.hits(points, nodes)

    def note(self, hits: Hits) -> None:
        """Which points have a partner how deep, at the end of a step."""
        self._known.trial = self._known_of(hits)

    def dig_out(self) -> Hits:
        """Find partners from the start, also of points that are in the other body, deeper than the search.

        Raises:
            ValueError: On all ranks, if there are none for some of them.
        """
        (points, nodes), hits = self._start, self.hits(*self._start)
        inside = self._master.holds(points.x, self._slave)
        depth = self._buried(hits, inside)
        while (deepest := self._slave.maximum(depth.max(initial=0.0))) > 0:
            deep = self._known.committed.deep
            if deep > self._largest:
                raise buried_for_ever(self._slave.total(int(np.count_nonzero(depth))), deepest)
            # a ray may be longer than the way to the nearest facet
            self._known.set(replace(self._known.committed, met=inside, deep=2 * max(deepest, deep)))
            hits = self.hits(points, nodes)
            depth = self._buried(hits, inside)
        self._known.set(self._known_of(hits))
        return hits

    def hits(self, points: Points, nodes: tuple[Array, Array]) -> Hits:
        """Where the rays of the points first meet the master."""
        hits = self._met(points, nodes, self._reach(nodes))
        return self._slave.completed(nearest(hits.some(self._entered(hits))))

    def _met(self, points: Points, nodes: tuple[Array, Array], reach: float) -> Hits:
        """All places where the rays of the points meet the master."""
        if self._moved(nodes, reach):
            # what has come near is no part of the step: it stays known if the step is given up
            self._found.value = self._look_around(points, nodes, reach, self.version)
        slaves, masters = self.facets
        of_facet = (slaves[:, None] * self._slave.count + np.arange(self._slave.count)).ravel()
        weighted = self._slave.weighted[of_facet]
        pairs = of_facet[weighted], np.repeat(masters, self._slave.count)[weighted]
        return project(points.x, points.frames, pairs, nodes[1], self._master.sides, self._master.shape, reach)

    @property
    def _largest(self) -> float:
        """Size of both surfaces at the start of the step. Collective."""
        x = np.concatenate([n.reshape(-1, n.shape[-1]) for n in self._start[1]])
        low, high = box(self._slave.V.mesh.comm, x)
        return float(np.linalg.norm(high - low))

    def _known_of(self, hits: Hits) -> _Known:
        met = np.zeros(len(self._start[0].x), dtype=bool)
        met[hits.points] = True
        return _Known(met, max(self._slave.maximum(float(-hits.gap.min(initial=0.0))), 0.0))

    def _buried(self, hits: Hits, inside: NDArray[np.bool_]) -> Array:
        """Distance to the nearest facet of the master of points that are inside and have no partner; else 0.

        Points beside which that facet stands across belong to a side of the body that faces nothing.
        """
        points, nodes = self._start
        depth = np.zeros(len(points.x))
        lost = inside.copy()
        lost[hits.points] = False
        rows = np.flatnonzero(lost & self._slave.weighted & np.repeat(self._slave.owned, self._slave.count))
        if len(rows) and len(nodes[1]):
            distance, closest = cKDTree(nodes[1].mean(axis=1)).query(points.x[rows])
            facing = np.einsum("ni,ni->n", self._outward(nodes[1])[closest], points.frames[rows, 0])
            depth[rows] = np.where(np.abs(facing) > FACING, distance, 0.0)
        return depth

    def _outward(self, nodes: Array) -> Array:
        """Outward unit normals in the middle of the facets of the master."""
        derivatives = self._master.shape.values(self._master.shape.centre[None])[1][0]
        outward = self._master.sides[:, None] * normals(np.einsum("kb,nbi->nki", derivatives, nodes))
        return np.asarray(outward / np.linalg.norm(outward, axis=1, keepdims=True))

    def _reach(self, nodes: tuple[Array, Array]) -> float:
        """How far partners are looked for: points are as deep as they were, and as the bodies have moved since."""
        moved = sum(
            np.linalg.norm(now - then, axis=-1).max(initial=0.0)
            for now, then in zip(nodes, self._start[1], strict=True)
        )
        moved = self._slave.maximum(float(np.nan_to_num(moved, nan=np.inf)))
        return self._search + self._known.committed.deep + (moved if moved < WILD * self._margin else 0.0)

    def _entered(self, hits: Hits) -> NDArray[np.bool_]:
        """Which partners are in front of their points, near them, or behind because the points have come into the body.

        What a ray meets far behind its point may else be the far side of a thin body.
        """
        keep = np.ones(len(hits.points), dtype=bool)
        rows = np.flatnonzero((hits.gap < -self._search) & ~self._known.committed.met[hits.points])
        keep[rows] = self._gap(self._start, hits.some(rows)) >= -self._search
        return keep

    def _gap(self, at: tuple[Points, tuple[Array, Array]], hits: Hits) -> Array:
        """Distance of partners from their points along the normals of these, in a configuration."""
        points, nodes = at
        values = self._master.shape.values(hits.xi)[0]
        before = np.einsum("nb,nbi->ni", values, nodes[1][hits.facets]) - points.x[hits.points]
        return np.asarray(np.einsum("ni,ni->n", before, points.frames[hits.points, 0]))

    def _moved(self, nodes: tuple[Array, Array], reach: float) -> bool:
        """Whether rays may have come nearer to other facets than the margin since these were last searched."""
        found = self._found.value
        slave, master = (np.abs(now - then).max(initial=0.0) for now, then in zip(nodes, found.nodes, strict=True))
        farther = max(reach - found.reach, 0.0)
        total = self._slave.maximum(float(np.nan_to_num(slave + master + farther, nan=np.inf)))
        return self._margin < total < WILD * self._margin

    def _look_around(self, points: Points, nodes: tuple[Array, Array], reach: float, version: int) -> Found:
        """Find the facets that are near each other."""
        ray = reach * points.frames[:, 0]
        shape = len(nodes[0]), self._slave.count, points.x.shape[-1]
        rays = np.concatenate([(points.x + ray).reshape(shape), (points.x - ray).reshape(shape)], axis=1)
        return Found(near_facets(rays, nodes[1], self._margin), nodes, reach, version + 1)


def buried_for_ever(points: int, depth: float) -> ValueError:
    """What is raised if points lie in a body and nothing says where they are to leave it."""
    return ValueError(
        f"slave_facets: {points} points lie in the body of master_facets from the start, about {depth:.3g} deep, and "
        "their normals do not meet its surface: let the bodies overlap less, or give all facets that face each other"
    )
