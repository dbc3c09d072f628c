"""Friction laws: the traction for a slip under a pressure (docs/theory.md §3.3).

A law sees the slip since the point at which its traction would vanish, the *anchor*, and resists it.  After a step the
anchor follows: what the law does not hold elastically has slipped for good.
"""

from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

import ufl

from cutsim.base.checks import above, finite, nonnegative, positive, require, require_number
from cutsim.base.functions import positive_part
from cutsim.base.kinematics import Expr
from cutsim.base.signatures import checked
from cutsim.base.units import InterfaceViscosity, Length, Stiffness, TemperatureValue

# far below any slip, so that directions are differentiable at rest [length]
_REST = 1e-20
# relative excess over Coulomb's limit at which a point slips: at the limit itself rounding would decide
_AT_LIMIT = 1e-12


@runtime_checkable
class FrictionLaw(Protocol):
    """Protocol of a friction law."""

    @property
    def compliance(self) -> float:
        """Elastic slip per traction [length/stress]; 0 if nothing is held elastically."""

    def on_penalty(self, stiffness: float) -> "FrictionLaw":
        """The law on a contact with a normal penalty [stress/length], which may replace a tangential one not given."""

    def limit(self, pressure: Expr, temperature: Expr | None) -> Expr:
        """Largest traction without viscosity, μ p [stress]."""

    def traction(self, slip: Expr, pressure: Expr, dt: Expr, temperature: Expr | None) -> Expr:
        """Traction along the slip since the anchor [stress]; the sliding body feels its opposite."""


@checked
@dataclass(frozen=True)
class Coulomb:
    """Coulomb friction by return mapping (thesis 4.50–4.55).

    Trial traction t* = ε_T s with the slip s since the anchor; stick if |t*| ≤ μ p, else t = μ p t*/|t*|.  With a
    viscosity η the traction exceeds the limit by η times the rate of slip (viscoplastic regularisation, thesis B.20).
    With two temperatures the coefficient falls as μ(T) = μ (T_d − T)²/(T_d − T_ref)² up to T_d, where it vanishes
    (B.21), T being that of the hotter side.

    Args:
        mu: Friction coefficient μ ≥ 0 at the reference temperature [–].
        stiffness: Tangential penalty ε_T > 0 [stress/length]; None for that of the normal contact.
        viscosity: η ≥ 0 [stress·time/length].
        T_ref: Reference temperature, None if the coefficient is constant.
        T_damage: Temperature T_d > T_ref at which friction vanishes, None if the coefficient is constant.

    Raises:
        ValueError: A value is outside its range, or only one temperature is given.
    """

    mu: float
    stiffness: Stiffness | None = None
    viscosity: InterfaceViscosity = 0.0
    T_ref: TemperatureValue | None = None
    T_damage: TemperatureValue | None = None

    def __post_init__(self) -> None:
        require_number("mu", self.mu, nonnegative)
        require_number("stiffness", self.stiffness, positive.or_none)
        require_number("viscosity", self.viscosity, nonnegative)
        require_number("T_ref", self.T_ref, finite.or_none)
        require_number("T_damage", self.T_damage, finite.or_none)
        both = (self.T_ref is None) == (self.T_damage is None)
        require("T_damage", self.T_damage, both, "given together with T_ref, or neither")
        if self.T_ref is not None and self.T_damage is not None:
            require_number("T_damage", self.T_damage, above(self.T_ref, "T_ref"))

    @property
    def compliance(self) -> float:
        """Elastic slip per traction 1/ε_T [length/stress]."""
        assert self.stiffness is not None
        return 1 / self.stiffness

    def on_penalty(self, stiffness: float) -> "Coulomb":
        """The law with its own tangential penalty, or that of the normal contact [stress/length]."""
        return self if self.stiffness is not None else replace(self, stiffness=stiffness)

    def limit(self, pressure: Expr, temperature: Expr | None) -> Expr:
        """Largest traction without viscosity, μ(T) p [stress]."""
        if self.T_ref is None or self.T_damage is None:
            return self.mu * pressure
        require("temperature", temperature, temperature is not None, "a temperature: the coefficient depends on it")
        left: Expr = self.T_damage - temperature  # type: ignore[operator]
        share = positive_part(left) / (self.T_damage - self.T_ref)
        return self.mu * share**2 * pressure

    def traction(self, slip: Expr, pressure: Expr, dt: Expr, temperature: Expr | None) -> Expr:
        """Traction along the slip since the anchor [stress]."""
        size = ufl.sqrt(ufl.dot(slip, slip) + _REST**2)
        trial, limit = self.stiffness * size, self.limit(pressure, temperature)
        rate = ufl.conditional(ufl.gt(pressure, 0), self.viscosity / dt, 0.0)
        sliding = limit + rate / (self.stiffness + rate) * (trial - limit)
        stick = ufl.le(trial, (1 + _AT_LIMIT) * limit)
        return ufl.conditional(stick, self.stiffness, sliding / size) * slip


@checked
@dataclass(frozen=True)
class SmoothCoulomb:
    """Coulomb friction without stick, t = μ p s/√(|s|² + s₀²) with the slip s of the step.

    Args:
        mu: Friction coefficient μ ≥ 0 [–].
        slip: Slip s₀ > 0 in one step below which the traction is proportional to the slip [length].

    Raises:
        ValueError: A value is outside its range.
    """

    mu: float
    slip: Length

    def __post_init__(self) -> None:
        require_number("mu", self.mu, nonnegative)
        require_number("slip", self.slip, positive)

    @property
    def compliance(self) -> float:
        """Zero: nothing is held elastically."""
        return 0.0

    def on_penalty(self, stiffness: float) -> "SmoothCoulomb":
        """The law itself, which has no tangential penalty."""
        return self

    def limit(self, pressure: Expr, temperature: Expr | None) -> Expr:
        """Largest traction μ p [stress]."""
        return self.mu * pressure

    def traction(self, slip: Expr, pressure: Expr, dt: Expr, temperature: Expr | None) -> Expr:
        """Traction along the slip of the step [stress]."""
        return self.mu * pressure * slip / ufl.sqrt(ufl.dot(slip, slip) + self.slip**2)
