"""Search for the partners of a surface that folds and meets itself (docs/theory.md §3.5)."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cutsim.base.memory import Memory
from cutsim.pairs.configuration import Points
from cutsim.pairs.outer_surface import Master, SlaveSurface
from cutsim.pairs.pairing import Array, Hits, nearest
from cutsim.pairs.search import Found, PartnerSearch, buried_for_ever

#: Distance behind a point that is none, as a fraction of the mean slave facet's size.
BEHIND = 1e-6
#: Cosine between the normals of two facets from which they cannot meet before partners are looked for anew.
ALIKE = 0.9


class FoldingSearch(PartnerSearch):
    """Finds where a surface meets itself: the slave is a part of the master. Every method is collective.

    The ray of a point also runs backwards through its own body, and its own back is never a partner.

    Args:
        memory, name, slave, master, points, search, size: As of `PartnerSearch`.
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
        self._touch, self._reference = BEHIND * size, (points, (slave.reference, master.reference))
        super().__init__(memory, name, slave, master, points, search=search, size=size)

    def dig_out(self) -> Hits:
        """Find partners from the start, also of points in another body: they meet its outside before their own back.

        Raises:
            ValueError: On all ranks, if points meet neither.
        """
        (points, nodes), reach, lost = self._start, self._search, 1
        inside, largest = self._master.holds(points.x, self._slave), self._largest
        while lost:
            hits = self._met(points, nodes, reach)
            hits = hits.some(inside[hits.points] & (hits.gap < -self._touch))
            # backs that lie in one plane are those of two bodies side by side
            hits = nearest(replace(hits, gap=hits.gap + self._touch * self._own(hits)))
            left = inside & np.repeat(self._slave.owned, self._slave.count)
            left[hits.points] = False
            lost = self._slave.total(int(np.count_nonzero(left)))
            if lost and reach > largest:
                raise buried_for_ever(lost, reach)
            reach *= 2
        self._known.set(self._known_of(hits.some(~self._own(hits))))
        hits = self.hits(points, nodes)
        self._known.set(self._known_of(hits))
        return hits

    def hits(self, points: Points, nodes: tuple[Array, Array]) -> Hits:
        """Where the rays of the points first meet the master; what has been passed hides what lies ahead."""
        hits = self._met(points, nodes, self._reach(nodes))
        hits = hits.some(self._entered(hits))
        return nearest(hits, hits.gap >= -self._touch)

    def _look_around(self, points: Points, nodes: tuple[Array, Array], reach: float, version: int) -> Found:
        """Find the facets that are near each other, without those that look the same way, as neighbours do.

        Nor do the faces of a cut look for each other that press on each other elsewhere.
        """
        found = super()._look_around(points, nodes, reach, version)
        slaves, masters = found.facets
        ways = points.frames[:: self._slave.count, 0][slaves], self._outward(nodes[1])[masters]
        sides = self._slave.face.cuts[slaves], self._master.cuts[masters]
        closing = (sides[0] != 0) & (sides[0] == -sides[1])
        facing = (np.einsum("ni,ni->n", *ways) < ALIKE) & ~closing
        return replace(found, facets=(slaves[facing], masters[facing]))

    def _own(self, hits: Hits) -> NDArray[np.bool_]:
        """Which partners are on the body of their points."""
        return np.asarray(self._slave.pieces[hits.points // self._slave.count] == self._master.pieces[hits.facets])

    def _entered(self, hits: Hits) -> NDArray[np.bool_]:
        """Which partners are in front of their points, or behind because the points have come into the body.

        They have been in front in the reference configuration, or at the start of the step, or are known to be as deep.
        """
        known = self._known.committed
        rows = np.flatnonzero(hits.gap < -self._touch)
        behind = hits.some(rows)
        own = self._slave.global_nodes[behind.points // self._slave.count]
        beside = (own[:, :, None] == self._master.global_nodes[behind.facets][:, None]).any(axis=(1, 2))
        pressed = known.met[behind.points] | ~self._own(behind)
        deep = self._touch + np.where(pressed, 2 * known.deep, 0.0)
        # next to a sharp edge the back is nearer than any depth
        entered = (self._gap(self._start, behind) >= -deep) & ~beside
        keep = np.ones(len(hits.points), dtype=bool)
        keep[rows] = entered | (self._gap(self._reference, behind) >= -self._touch)
        return keep
