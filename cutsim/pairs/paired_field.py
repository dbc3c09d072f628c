"""Scalar field at the points of a slave surface and where they meet the master (docs/theory.md §3.4, §3.5)."""

from typing import Self

import numpy as np
from dolfinx import fem

from cutsim.base.kinematics import Expr
from cutsim.fields.faces import Face
from cutsim.fields.points import FacetPoints
from cutsim.fields.temperature import Temperature
from cutsim.interface.rubbing import Friction, hotter
from cutsim.pairs.outer_surface import OuterSurface, SharedSurface
from cutsim.pairs.pairing import Array, Hits, Indices
from cutsim.pairs.partners import PairKinematics


class PairedField:
    """Scalar field on both faces of slave points. Every method is collective.

    A point without a partner, or before a rigid body, faces itself.

    Args:
        space: Space of the field, of degree 1 or 2.
        points: The points.
        slave: Their surface.
        master: Surface that they meet, None for that of a rigid body.

    Attributes:
        slave: Nodes of the slave surface in the space.
        master: Nodes of the master surface in the space, or None.
        nodes: Global nodes on which each point acts: of its own facet, then of that which it faces.
        shares: Their shares, shape (points, faces, nodes).
    """

    def __init__(self, space: fem.FunctionSpace, points: FacetPoints, slave: Face, master: Face | None) -> None:
        self.slave = OuterSurface(space, slave)
        self.master = None if master is None else SharedSurface(OuterSurface(space, master))
        xi = points.xi
        self._own = self.slave.shape.values(xi.reshape(-1, xi.shape[-1]))[0]
        self._facets: Indices = np.repeat(np.arange(len(xi)), xi.shape[1])

    def pair(self, hits: Hits) -> None:
        """Take over the partners of the points."""
        own = self.slave.global_nodes[self._facets]
        faced, values = own.copy(), self._own.copy()
        if self.master is not None:
            faced[hits.points] = self.master.global_nodes[hits.facets]
            values[hits.points] = self.master.shape.values(hits.xi)[0]
        none = np.zeros_like(values)
        self._hits, self.nodes = hits, np.hstack([own, faced])
        self.shares = np.stack([np.hstack([self._own, none]), np.hstack([none, values])], axis=1)

    def values(self, field: Array) -> Array:
        """Values on both faces of a field over the local dofs, shape (points, 2)."""
        own = self.slave.gather(field)[self._facets, :, 0]
        faced = own.copy()
        if self.master is not None:
            faced[self._hits.points] = self.master.gather(field)[self._hits.facets, :, 0]
        return np.asarray(np.einsum("nfa,na->nf", self.shares, np.hstack([own, faced])))


class HotterSide:
    """Temperature of the hotter side of slave points, as friction feels it in a step. Every method is collective.

    Args:
        temperature: Temperature of the bodies.
        points: The points.
        slave: Their surface.
        master: Surface that they meet, None for that of a rigid tool.
        tool: Temperature of the rigid tool.

    Attributes:
        value: The temperature, as it enters a form over the points.
    """

    def __init__(
        self, temperature: Temperature, points: FacetPoints, slave: Face, master: Face | None, tool: Expr | None
    ) -> None:
        self._temperature, self._points = temperature, points
        self._field = PairedField(temperature.space, points, slave, master)
        self._felt = points.function()
        felt = points.at(self._felt)
        self.value: Expr = felt if tool is None else hotter(felt, tool)

    @classmethod
    def of(
        cls, friction: Friction | None, points: FacetPoints, kinematics: PairKinematics, tool: Expr | None
    ) -> Self | None:
        """What friction feels of a temperature, None if of none.

        Args:
            friction: The friction.
            points: The points.
            kinematics: What finds their partners.
            tool: Temperature of a rigid tool.
        """
        if friction is None or friction.temperature is None:
            return None
        master = kinematics.master
        met = master.face if isinstance(master, SharedSurface) else None
        return cls(friction.temperature, points, kinematics.slave.face, met, tool)

    def feel(self, hits: Hits) -> None:
        """Bring the present temperature to the points, with these partners."""
        self._field.pair(hits)
        warm = self._field.values(self._temperature.value.x.array).max(axis=1)
        self._points.set(self._felt, warm.reshape(self._points.weights.shape))
