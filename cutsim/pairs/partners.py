"""Kinematics of a pair: partners of the slave points, opening and slide (docs/theory.md §3.5)."""

import numpy as np

from cutsim.base.memory import Memory
from cutsim.fields.points import DEGREE
from cutsim.pairs.configuration import OnRay, Pairs, Points
from cutsim.pairs.folding import FoldingSearch
from cutsim.pairs.outer_surface import Master, SlaveSurface
from cutsim.pairs.pairing import TOUCH, Array, Hits, Indices
from cutsim.pairs.search import PartnerSearch

#: Degree of the quadrature on a slave surface, by that of the displacement: master facets end within a slave facet.
DEGREES = {1: DEGREE, 2: 8}


class PairKinematics:
    """Slave points and their partners on a master surface. Every method is collective.

    Args:
        slave: The slave surface.
        master: The master surface.

    """

    def __init__(self, slave: SlaveSurface, master: Master) -> None:
        self.slave, self.master = slave, master
        self._sides = np.repeat(slave.sides, slave.count)

    @property
    def facets(self) -> tuple[Indices, Indices]:
        """Slave and master facets between which forces may act."""
        raise NotImplementedError

    @property
    def version(self) -> int:
        """Number that grows when these facets are others."""
        return 0

    def nodes(self, u: Array, *, start: bool = False) -> tuple[Array, Array]:
        """Current nodes of slave and master facets, from a displacement of the local dofs.

        Args:
            u: The displacement.
            start: Whether it is that at the start of the step.
        """
        return self.slave.reference + self.slave.gather(u), self.master.nodes(u, start=start)

    def between(self, slave: Indices, master: Indices) -> Indices:
        """Global nodes of some slave facets and of as many master facets, side by side."""
        return np.hstack([self.slave.global_nodes[slave], self.master.global_nodes[master]])

    def at_stencil(self, field: Array, pairs: Pairs, rows: Indices) -> Array:
        """Values of a field over the local dofs at the nodes on which some pairs act, slave facet first."""
        slave = self.slave.gather(field)[self.slave.facets_of(pairs.hits.points[rows])]
        return np.concatenate([slave, self.master.gather(field)[pairs.hits.facets[rows]]], axis=1)

    def begin(self, nodes: tuple[Array, Array]) -> None:
        """Take a configuration for the start of a step."""

    def note(self, pairs: Pairs) -> None:
        """Take note of the pairs at the end of a step."""

    def pairs(self, nodes: tuple[Array, Array]) -> Pairs:
        """Points and partners for nodes of slave and master facets."""
        raise NotImplementedError

    def _points(self, nodes: Array) -> Points:
        return Points.framed(self.slave.at_points(nodes), self.slave.tangents(nodes), self._sides)


class CurrentPartners(PairKinematics):
    """Partners of the current configuration, for contact, friction and heat. Every method is collective.

    A point's partner is where the ray along ν meets the current master surface, and the opening is the distance along
    the ray.  The slide grows by −a_α·(x_m − x_s) at the *start* of the step, between the point and the material point
    that it meets now: it needs no facet-wise memory, and a rigid rotation adds nothing to it.

    Args:
        memory: Memory of the run.
        name: Name of the slave surface.
        slave: The slave surface.
        master: The master surface.
        search: Largest distance of a partner [length]. Points that were in the body of the master from the start, or
            come into it during a step, find theirs at any depth.
        size: Mean size of the slave facets [length].
        folding: Whether the slave surface is a part of the master, which meets itself.

    Attributes:
        partners: Search for facets that are near each other, and for partners on them.
    """

    def __init__(
        self,
        memory: Memory,
        name: str,
        slave: SlaveSurface,
        master: Master,
        *,
        search: float,
        size: float,
        folding: bool = False,
    ) -> None:
        super().__init__(slave, master)
        self._search, self._size = search, size
        nodes = slave.reference, master.reference
        points = self._points(nodes[0])
        self._old, self._old_nodes = points, nodes
        rest = np.zeros((len(points.x), points.x.shape[-1] - 1))
        self._slid = memory.value(f"{name}: slide", rest, places=slave.places)
        kind = FoldingSearch if folding else PartnerSearch
        self.partners = kind(memory, name, slave, master, points, search=search, size=size)
        self._old_hits = self.partners.dig_out()

    @property
    def facets(self) -> tuple[Indices, Indices]:
        """Slave and master facets that are near each other."""
        return self.partners.facets

    @property
    def version(self) -> int:
        """Number that grows when other facets have come near each other."""
        return self.partners.version

    def begin(self, nodes: tuple[Array, Array]) -> None:
        """Take a configuration for the start of a step."""
        self._old, self._old_nodes = self._points(nodes[0]), nodes
        self._old_hits = self.partners.begin(self._old, nodes)

    def note(self, pairs: Pairs) -> None:
        """Trial slide, and which points have a partner how deep, at the end of a step."""
        self._slid.trial = pairs.jump[:, 1:]
        self.partners.note(pairs.hits)

    @np.errstate(divide="ignore", invalid="ignore", over="ignore")
    def pairs(self, nodes: tuple[Array, Array]) -> Pairs:
        """Points and partners for nodes of slave and master facets."""
        points = self._points(nodes[0])
        hits = self.partners.hits(points, nodes)
        values, derivatives = self.master.shape.values(hits.xi)
        y = nodes[1][hits.facets]
        distance = np.einsum("nb,nbi->ni", values, y) - points.x[hits.points]
        tangents = np.einsum("nkb,nbi->nki", derivatives, y)
        jump, rate = self._jump(hits, values, derivatives)
        self._slide_of_lost(points, hits, nodes[1], jump)
        return Pairs(points, hits, values, jump, distance, OnRay(derivatives, tangents, rate))

    def _jump(self, hits: Hits, values: Array, derivatives: Array) -> tuple[Array, Array]:
        """The jump, and its rate with the place on the master facet."""
        # the point and the material point that it meets now, both where they were at the start of the step: a rigid
        # motion of the two bodies together within the step is no slide
        frames, y = self._old.frames[hits.points, 1:], self._old_nodes[1][hits.facets]
        before = np.einsum("nb,nbi->ni", values, y) - self._old.x[hits.points]
        slid = self._slid.committed
        # without partner a point is open, farther than any contact reaches
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
