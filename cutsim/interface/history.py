"""History variables of an interface: secants, contact multiplier, dissipation, contact work (docs/theory.md §3.2)."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from cutsim.base.checks import require
from cutsim.base.memory import Memory
from cutsim.fields.points import FacetPoints, Values
from cutsim.interface.cohesive import CohesiveLaw
from cutsim.interface.damage import spent, strength_loss
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

# how far a bond is broken in both modes, from its smallest secants, besides its damage
_MEASURES = {"strength_loss": strength_loss, "spent": spent}
_COLUMNS = ("contact_power", "stored", "damage", "opening", "sliding", "pressure")

#: Values at the points for the fraction s of the step's displacement increment: "secants" (a vector), "jump" (opening
#: and slide in components that turn with the interface), "contact_power" (contact traction times increment of the
#: jump), "stored", "damage", "opening", "sliding", "pressure".
Along = Callable[[float], dict[str, Values]]


@dataclass(frozen=True)
class _Known:
    """Data of the points at the end of a step.

    Attributes:
        values: Values by name, see `Along`.
        secants: Smallest secant stiffnesses so far, a vector [stress/length].
        lost: Fracture dissipation so far [energy per reference area].
        contact: Work of the contact traction so far [energy per reference area].
    """

    values: Mapping[str, Values]
    secants: Values
    lost: Values
    contact: Values


class InterfaceHistory:
    """Secants, dissipation and contact multiplier at the points of an interface.

    Args:
        memory: Memory of the run.
        name: Name of the interface.
        points: Integration points.
        law: Cohesive law, None for a broken interface.
        rule: Where work of contact is evaluated.
        also: Names of further values that are told of the points.

    Attributes:
        secants: Smallest secant stiffnesses before this step, a vector at the points [stress/length].
        multiplier: Contact multiplier λ_N, a function of the points [stress].
    """

    def __init__(
        self,
        memory: Memory,
        name: str,
        points: FacetPoints,
        law: CohesiveLaw | None,
        rule: PathRule = GAUSS,
        also: tuple[str, ...] = (),
    ) -> None:
        self._points, self._law, self._rule = points, law, rule
        self.secants, self.multiplier = points.function(2), points.function()
        zero = np.zeros_like(points.weights)
        secants = np.zeros((*zero.shape, 2)) if law is None else np.stack(law.secants(zero, zero), axis=-1)
        start = _Known(dict.fromkeys((*_COLUMNS, *also), zero), secants, lost=zero, contact=zero)
        self._known = memory.value(f"{name}: points", start, self._show, places=points.places)
        memory.array(f"{name}: multiplier", self.multiplier, places=points.function_places)
        self._show(start)

    def _show(self, committed: _Known) -> None:
        self._points.set(self.secants, committed.secants)

    @property
    def trial(self) -> Mapping[str, Values]:
        """Values at the end of the trial step, by name."""
        return self._known.trial.values

    def point_values(self, name: str) -> Values:
        """Trial values at the points by name: those of `Along`, "strength_loss", "spent" and "dissipated".

        Raises:
            ValueError: The name is unknown.
        """
        if name == "dissipated":
            return self._known.trial.lost
        if name in _MEASURES:
            none = np.ones_like(self._points.weights)
            return none if self._law is None else _MEASURES[name](self._law, self._known.trial.secants).max(axis=-1)
        names = (*self.trial, *_MEASURES, "dissipated")
        require("name", name, name in self.trial, f"one of {names}")
        return self.trial[name]

    @property
    def jump(self) -> Values | None:
        """Opening and slide at the start of the step, see `Along`; None before the first one [length]."""
        return self._known.committed.values.get("jump")

    def evaluate(self, along: Along) -> None:
        """Trial values, losses and the work of contact over the step. Collective."""
        at = {s: along(s) for s in sorted({0.0, 1.0, *self._rule.places})}
        powers = (w * at[s]["contact_power"] for s, w in zip(self._rule.places, self._rule.weights, strict=True))
        old, secants, lost = self._known.committed, self._known.committed.secants, self._known.committed.lost
        if self._law is not None:
            way = Way(*(at[s]["jump"].reshape(-1, at[s]["jump"].shape[-1]) for s in (0.0, 1.0)))
            lost = lost + losses(self._law, way, secants.reshape(-1, 2)).reshape(lost.shape)
            secants = np.minimum(secants, at[1.0]["secants"])
        self._known.trial = _Known(at[1.0], secants, lost, sum(powers, start=old.contact))

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

    def energies(self) -> dict[str, float]:
        """Recoverable and lost part of the cohesive work, and the energy of the contact penalty. Collective."""
        return {
            "cohesive_stored": self._points.integral(self.trial["stored"]),
            "fracture": self._points.integral(self._known.trial.lost),
            "contact": self._points.integral(self._known.trial.contact),
        }

    def damage_increment(self) -> float:
        """Largest growth of damage at a point in the trial step. Collective."""
        return self._points.maximum(self.trial["damage"] - self._known.committed.values["damage"])

    def dissipation(self) -> Values:
        """Fracture dissipation of the trial step at the points [energy per reference area]."""
        return self._known.trial.lost - self._known.committed.lost
