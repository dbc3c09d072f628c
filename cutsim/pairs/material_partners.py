"""Kinematics of a bond: partners that are material points of the master (docs/theory.md §3.5)."""

import numpy as np

from cutsim.base.memory import Memory
from cutsim.pairs.configuration import Pairs, Points
from cutsim.pairs.outer_surface import Master, SlaveSurface, normals
from cutsim.pairs.pairing import Array, Indices
from cutsim.pairs.partners import PairKinematics
from cutsim.pairs.search import PartnerSearch

# normal half way between two faces over that of one of them below which they are turned against each other
_TURNED = 1e-6


class MaterialPartners(PairKinematics):
    """Partners of the reference configuration, for bonds and for small sliding. Every method is collective.

    The jump is x_m − x_s, less its reference value, in a frame along the surface half way between both, as on a crack:
    its tangents are the means of those of the slave and of the same material lines on the master.  The frame of one
    surface alone would show an opening δ²/2R after a slide δ over a surface with radius R.

    Points without partner do not open or slide.

    Args:
        memory: Memory of the run.
        name: Name of the slave surface.
        slave: The slave surface.
        master: The master surface.
        search: Largest distance of a partner in the reference configuration [length].
        size: Mean size of the slave facets [length].
    """

    def __init__(
        self, memory: Memory, name: str, slave: SlaveSurface, master: Master, *, search: float, size: float
    ) -> None:
        super().__init__(slave, master)
        nodes = slave.reference, master.reference
        points = self._points(nodes[0])
        found = PartnerSearch(memory, name, slave, master, points, search=search, size=size)
        self._hits = hits = found.begin(points, nodes)
        self._values, derivatives = master.shape.values(hits.xi)
        # the lines of the slave's reference coordinates, in those of the master
        master_tangents = np.einsum("nkb,nbi->nki", derivatives, nodes[1][hits.facets])
        lines = points.tangents[hits.points] @ np.linalg.pinv(master_tangents)
        self._midway = 0.5 * np.einsum("nkl,nlb->nkb", lines, derivatives)
        self._offset = np.zeros((len(hits.points), points.x.shape[-1]))
        self._offset = self.pairs(nodes).jump[hits.points]

    @property
    def facets(self) -> tuple[Indices, Indices]:
        """Slave and master facets that are bonded."""
        both = np.stack([self.slave.facets_of(self._hits.points), self._hits.facets], axis=1)
        slave, master = np.unique(both, axis=0).T
        return slave, master

    @np.errstate(divide="ignore", invalid="ignore", over="ignore")
    def pairs(self, nodes: tuple[Array, Array]) -> Pairs:
        """Points and partners for nodes of slave and master facets."""
        own, hits = self._points(nodes[0]), self._hits
        y, tangents = nodes[1][hits.facets], own.tangents.copy()
        tangents[hits.points] = 0.5 * tangents[hits.points] + np.einsum("nkb,nbi->nki", self._midway, y)
        # faces that have turned against each other, long after the bond has broken, have no surface half way
        turned = np.linalg.norm(normals(tangents), axis=1) < _TURNED * np.linalg.norm(own.normals, axis=1)
        tangents[turned] = own.tangents[turned]
        points = Points.framed(own.x, tangents, self._sides)
        distance = np.einsum("nb,nbi->ni", self._values, y) - own.x[hits.points]
        jump = np.zeros_like(own.x)
        jump[hits.points] = np.einsum("nai,ni->na", points.frames[hits.points], distance) - self._offset
        return Pairs(points, hits, self._values, jump, distance, midway=self._midway)
