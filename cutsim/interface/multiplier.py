"""Multiplier of a contact, one value a facet, improved by Uzawa's method (docs/theory.md §3; thesis 4.33)."""

import numpy as np

from cutsim.base.kinematics import Expr
from cutsim.base.memory import Memory
from cutsim.fields.points import FacetPoints, Values
from cutsim.interface.contact import PenaltyContact


class ContactMultiplier:
    """Multiplier λ of a contact, as the penetration at which the contact law alone would have this pressure.

    With it the law sees the penetration δ + s, where s belongs to λ.  Where equilibrium has been found, s grows by the
    mean penetration of each facet that is pressed as a whole; elsewhere, at the edge of the contact, λ becomes the mean
    pressure.  This goes on until no s changes by more than is allowed.  One value a facet, because at every point it
    would hold a facet in more places than it has nodes.

    Args:
        memory: Memory of the run.
        name: Name of the surface.
        points: Integration points.
        contact: Contact law.
        allowed_penetration: Largest mean penetration of a facet [length].
    """

    def __init__(
        self, memory: Memory, name: str, points: FacetPoints, contact: PenaltyContact, allowed_penetration: float
    ) -> None:
        self._points, self._contact, self._allowed = points, contact, allowed_penetration
        self._shift = points.function()
        memory.array(f"{name}: multiplier", self._shift, places=points.function_places)

    @property
    def shift(self) -> Expr:
        """Penetration s that belongs to the multiplier, at the points in a form [length]."""
        return self._points.at(self._shift)

    def augment(self, pressure: Values, penetration: Values) -> bool:
        """Improve the multiplier; True if that of a facet was off by more than is allowed. Collective.

        Args:
            pressure: Present pressure at the points [stress].
            penetration: Present penetration δ at the points, negative while open [length].
        """
        old, mean = self._points.get(self._shift), self._points.facet_mean
        whole = (pressure > 0).all(axis=1)
        new = np.where(whole, old[:, 0] + mean(penetration), self._contact.penetration(mean(pressure)))
        shift = np.broadcast_to(np.maximum(new, -self._contact.clearance)[:, None], old.shape)
        if self._points.maximum(np.abs(shift - old)) <= self._allowed:
            return False
        self._points.set(self._shift, shift)
        return True
