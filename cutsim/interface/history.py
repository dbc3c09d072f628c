"""What the points of an interface remember: damage, multiplier, work along the path (docs/theory.md §3.2)."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cutsim.fields.points import FacetPoints, Values


@dataclass(frozen=True)
class PathRule:
    """Where on the straight path of the displacement over a step interface work is evaluated.

    Args:
        places: Fractions of the step.
        weights: Their weights.
    """

    places: tuple[float, ...]
    weights: tuple[float, ...]


#: Five Gauss points, for a law that softens within a step.
GAUSS = PathRule(*(tuple(0.5 * (a + b)) for a, b in zip(np.polynomial.legendre.leggauss(5), (1.0, 0.0), strict=True)))
#: The ends, as for the work of the supports: for points that meet or lose their partner within a step.
TRAPEZOID = PathRule((0.0, 1.0), (0.5, 0.5))

_COLUMNS = (
    "demand", "cohesive_power", "contact_power", "stored", "damage", "opening", "sliding", "pressure",
)  # fmt: skip

#: Values at the points for the fraction s of the step's displacement increment: "demand", "cohesive_power" and
#: "contact_power" (tractions times increment of the jump), "stored", "damage", "opening", "sliding", "pressure".
Along = Callable[[float], dict[str, Values]]


class InterfaceHistory:
    """History, work and contact multiplier at the points of an interface, trial and committed.

    Args:
        points: Integration points.
        rule: Where work is evaluated.
        also: Names of further values that are told of the points.

    Attributes:
        kappa: Largest demand before this step, a function of the points.
        multiplier: Contact multiplier λ_N, a function of the points [stress].
        trial: Values at the end of the trial step, by name.
    """

    def __init__(self, points: FacetPoints, rule: PathRule = GAUSS, also: tuple[str, ...] = ()) -> None:
        self._points, self._rule = points, rule
        self.kappa, self.multiplier = points.function(), points.function()
        self._multiplier_old = self.multiplier.x.array.copy()
        zero = np.zeros_like(points.weights)
        self.trial = self._trial_old = dict.fromkeys((*_COLUMNS, *also), zero)
        self._work = self._work_old = {"cohesive": zero, "contact": zero}

    def evaluate(self, along: Along) -> None:
        """Trial values, and the work of the step integrated along the path of the displacement. Collective."""
        self._work = {name: work.copy() for name, work in self._work_old.items()}
        for s, weight in zip(self._rule.places, self._rule.weights, strict=True):
            values = along(s)
            for name in self._work:
                self._work[name] += weight * values[f"{name}_power"]
        self.trial = along(1.0)

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
        self.trial, self._work = self._trial_old, self._work_old

    def commit(self) -> None:
        """Adopt history, work and multiplier of the step."""
        self._points.set(self.kappa, np.maximum(self._points.get(self.kappa), self.trial["demand"]))
        self._multiplier_old[:] = self.multiplier.x.array
        self._work_old = self._work
        self._trial_old = self.trial

    def energies(self) -> dict[str, float]:
        """Recoverable and dissipated part of the cohesive work, and the energy of the contact penalty. Collective."""
        stored = self._points.integral(self.trial["stored"])
        return {
            "cohesive_stored": stored,
            "fracture": self._points.integral(self._work["cohesive"]) - stored,
            "contact": self._points.integral(self._work["contact"]),
        }

    def damage_increment(self) -> float:
        """Largest growth of damage at a point in the trial step. Collective."""
        return self._points.maximum(self.trial["damage"] - self._trial_old["damage"])

    def dissipated(self) -> Values:
        """Fracture dissipation so far at the points [energy per reference area]."""
        return self._work["cohesive"] - self.trial["stored"]

    def dissipation(self) -> Values:
        """Fracture dissipation of the trial step at the points [energy per reference area]."""
        return self.dissipated() - (self._work_old["cohesive"] - self._trial_old["stored"])
