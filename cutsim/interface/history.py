"""History variables of an interface: secants, contact multiplier, dissipation, contact work (docs/theory.md §3.2)."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cutsim.fields.points import FacetPoints, Values
from cutsim.interface.cohesive import CohesiveLaw
from cutsim.interface.dissipation import Way, losses


@dataclass(frozen=True)
class PathRule:
    """Quadrature rule for the work of contact along the straight path of the displacement over a step.

    Args:
        places: Fractions of the step.
        weights: Their weights.
    """

    places: tuple[float, ...]
    weights: tuple[float, ...]


#: Five Gauss points, for a contact that closes within a step.
GAUSS = PathRule(*(tuple(0.5 * (a + b)) for a, b in zip(np.polynomial.legendre.leggauss(5), (1.0, 0.0), strict=True)))
#: The ends, as for the work of the supports: for points that meet or lose their partner within a step.
TRAPEZOID = PathRule((0.0, 1.0), (0.5, 0.5))

_COLUMNS = ("contact_power", "stored", "damage", "opening", "sliding", "pressure")

#: Values at the points for the fraction s of the step's displacement increment: "secants" (a vector), "jump" (opening
#: and slide in components that turn with the interface), "contact_power" (contact traction times increment of the
#: jump), "stored", "damage", "opening", "sliding", "pressure".
Along = Callable[[float], dict[str, Values]]


class InterfaceHistory:
    """Secants, dissipation and contact multiplier at the points of an interface, trial and committed.

    Args:
        points: Integration points.
        law: Cohesive law, None for a broken interface.
        rule: Where work of contact is evaluated.
        also: Names of further values that are told of the points.

    Attributes:
        secants: Smallest secant stiffnesses before this step, a vector at the points [stress/length].
        multiplier: Contact multiplier λ_N, a function of the points [stress].
        trial: Values at the end of the trial step, by name.
    """

    def __init__(
        self, points: FacetPoints, law: CohesiveLaw | None, rule: PathRule = GAUSS, also: tuple[str, ...] = ()
    ) -> None:
        self._points, self._law, self._rule = points, law, rule
        self.secants, self.multiplier = points.function(2), points.function()
        if law is not None:
            zero = np.zeros_like(points.weights)
            points.set(self.secants, np.stack(law.secants(zero, zero), axis=-1))
        self._multiplier_old = self.multiplier.x.array.copy()
        zero = np.zeros_like(points.weights)
        self.trial = self._trial_old = dict.fromkeys((*_COLUMNS, *also), zero)
        self._contact = self._contact_old = self._lost = self._lost_old = zero

    def evaluate(self, along: Along) -> None:
        """Trial values, losses and the work of contact over the step. Collective."""
        at = {s: along(s) for s in sorted({0.0, 1.0, *self._rule.places})}
        powers = (w * at[s]["contact_power"] for s, w in zip(self._rule.places, self._rule.weights, strict=True))
        self._contact = sum(powers, start=self._contact_old)
        self.trial = at[1.0]
        if self._law is not None:
            way = Way(*(at[s]["jump"].reshape(-1, at[s]["jump"].shape[-1]) for s in (0.0, 1.0)))
            lost = losses(self._law, way, self._points.get(self.secants).reshape(-1, 2))
            self._lost = self._lost_old + lost.reshape(self._points.weights.shape)

    def augment(self, pressure: Values, tolerance: float) -> bool:
        """Uzawa step λ ← p (thesis 4.33) if a closed point is off by more than is allowed. Collective.

        p − λ is the penalty times the penetration; where the faces have parted again, it is what λ still pushes.

        Args:
            pressure: Present contact pressure at the points [stress].
            tolerance: Largest change of the multiplier that is none [stress].

        Returns:
            Whether the multiplier has changed.
        """
        change = np.abs(pressure - self._points.get(self.multiplier))
        if self._points.maximum(change) <= tolerance:
            return False
        self._points.set(self.multiplier, pressure)
        return True

    def rollback(self) -> None:
        """Restore the contact multiplier, and what is known at the points, of the committed state."""
        self.multiplier.x.array[:] = self._multiplier_old
        self.trial, self._lost, self._contact = self._trial_old, self._lost_old, self._contact_old

    def commit(self) -> None:
        """Adopt memory, losses, work and multiplier of the step."""
        if self._law is not None:
            self._points.set(self.secants, np.minimum(self._points.get(self.secants), self.trial["secants"]))
        self._multiplier_old[:] = self.multiplier.x.array
        self._trial_old, self._lost_old, self._contact_old = self.trial, self._lost, self._contact

    def energies(self) -> dict[str, float]:
        """Recoverable and lost part of the cohesive work, and the energy of the contact penalty. Collective."""
        return {
            "cohesive_stored": self._points.integral(self.trial["stored"]),
            "fracture": self._points.integral(self._lost),
            "contact": self._points.integral(self._contact),
        }

    def damage_increment(self) -> float:
        """Largest growth of damage at a point in the trial step. Collective."""
        return self._points.maximum(self.trial["damage"] - self._trial_old["damage"])

    def dissipated(self) -> Values:
        """Fracture dissipation so far at the points [energy per reference area]."""
        return self._lost

    def dissipation(self) -> Values:
        """Fracture dissipation of the trial step at the points [energy per reference area]."""
        return self._lost - self._lost_old
