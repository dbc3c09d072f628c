"""Contact laws: the normal pressure for a penetration (docs/theory.md §3, 4)."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import ufl
from numpy.typing import NDArray

from cutsim.base.checks import nonnegative, positive, require_number
from cutsim.base.functions import positive_part
from cutsim.base.kinematics import Expr
from cutsim.base.signatures import checked
from cutsim.base.units import Length, Stiffness


@checked
@dataclass(frozen=True)
class PenaltyContact:
    """Penalty contact p = ε_N ⟨penetration⟩, quadratic over the first part of the penetration.

    A pressure with a kink makes Newton's method cycle between two states when one integration point toggles; the
    quadratic start over a penetration of 2c removes the kink: p = ε s²/(4c) for 0 < s < 2c, ε (s − c) beyond.

    Args:
        stiffness: Penalty ε_N > 0 [stress/length].
        blend: Half the width of the quadratic start, c ≥ 0 [length]; 0 gives the plain law.

    Raises:
        ValueError: A value is outside its range.
    """

    stiffness: Stiffness
    blend: Length = 0.0
    clearance: ClassVar[Length] = 0.0

    def __post_init__(self) -> None:
        require_number("stiffness", self.stiffness, positive)
        require_number("blend", self.blend, nonnegative)

    @classmethod
    @checked
    def automatic(cls, young: float, h: float, factor: float = 10.0, blend: float = 0.0) -> "PenaltyContact":
        """Penalty ε_N = factor · E/h from the neighbouring cells' Young's modulus and size."""
        require_number("young", young, positive)
        require_number("h", h, positive)
        require_number("factor", factor, positive)
        return cls(factor * young / h, blend)

    def pressure(self, penetration: Expr) -> Expr:
        """Contact pressure p ≥ 0 [stress] at a penetration (positive inside) [length]."""
        s, c = penetration, self.blend
        if c == 0:
            return self.stiffness * positive_part(s)
        quadratic = self.stiffness * s**2 / (4 * c)
        return ufl.conditional(
            ufl.lt(s, 0), 0.0, ufl.conditional(ufl.lt(s, 2 * c), quadratic, self.stiffness * (s - c))
        )

    def penetration(self, pressure: NDArray[np.float64]) -> NDArray[np.float64]:
        """Least penetration with a pressure ≥ 0, the inverse of `pressure` [length]."""
        quadratic = np.sqrt(4 * self.blend * pressure / self.stiffness)
        linear = pressure / self.stiffness + self.blend
        return np.where(pressure < self.stiffness * self.blend, quadratic, np.where(pressure > 0, linear, 0.0))

    def energy(self, penetration: Expr) -> Expr:
        """Energy ∫ p dδ stored by the penalty [force/length]."""
        s, c = penetration, self.blend
        if c == 0:
            return 0.5 * self.stiffness * positive_part(s) ** 2
        quadratic = self.stiffness * s**3 / (12 * c)
        linear = self.stiffness * (0.5 * (s - c) ** 2 + c**2 / 6)
        return ufl.conditional(ufl.lt(s, 0), 0.0, ufl.conditional(ufl.lt(s, 2 * c), quadratic, linear))


@checked
@dataclass(frozen=True)
class SoftenedContact(PenaltyContact):
    """Penalty contact that begins before the surfaces touch, at a clearance, so that it gives way less on the whole.

    The pressure at a penetration δ is that of the penalty contact at δ + clearance.  Commercial codes call this a
    softened contact.  It is for a rigid tool that would feel as if it were thinner.

    Args:
        stiffness: Penalty ε_N > 0 [stress/length].
        blend: Half the width of the quadratic start, c ≥ 0 [length].
        clearance: Distance of the surfaces at which the pressure begins, ≥ 0 [length].

    Raises:
        ValueError: A value is outside its range.
    """

    clearance: Length = 0.0  # type: ignore[misc]  # of each law its own

    def __post_init__(self) -> None:
        super().__post_init__()
        require_number("clearance", self.clearance, nonnegative)

    def pressure(self, penetration: Expr) -> Expr:
        """Contact pressure p ≥ 0 [stress] at a penetration (positive inside) [length]."""
        return super().pressure(penetration + self.clearance)

    def penetration(self, pressure: NDArray[np.float64]) -> NDArray[np.float64]:
        """Least penetration with a pressure ≥ 0, the inverse of `pressure` [length]."""
        return super().penetration(pressure) - self.clearance

    def energy(self, penetration: Expr) -> Expr:
        """Energy ∫ p dδ stored since the pressure began [force/length]."""
        return super().energy(penetration + self.clearance)


@checked
@dataclass(frozen=True)
class HardeningContact(SoftenedContact):
    """Softened contact whose pressure grows with the third power: p = ε s³/(3c²) with s = δ + clearance.

    At the pressures of a cut it is so soft that an edge does not catch on the nodes, and at those of an indentation,
    which may be thirty times as large, it gives way little more.

    Args:
        stiffness: Its slope ε > 0 at s = c [stress/length].
        blend: This length, c > 0 [length].
        clearance: Distance of the surfaces at which the pressure begins, ≥ 0 [length].

    Raises:
        ValueError: A value is outside its range.
    """

    def __post_init__(self) -> None:
        super().__post_init__()
        require_number("blend", self.blend, positive)

    @property
    def _factor(self) -> float:
        return self.stiffness / (3 * self.blend**2)

    def pressure(self, penetration: Expr) -> Expr:
        """Contact pressure p ≥ 0 [stress] at a penetration (positive inside) [length]."""
        return self._factor * positive_part(penetration + self.clearance) ** 3

    def penetration(self, pressure: NDArray[np.float64]) -> NDArray[np.float64]:
        """Least penetration with a pressure ≥ 0, the inverse of `pressure` [length]."""
        return np.cbrt(pressure / self._factor) - self.clearance

    def energy(self, penetration: Expr) -> Expr:
        """Energy ∫ p dδ stored since the pressure began [force/length]."""
        return 0.25 * self._factor * positive_part(penetration + self.clearance) ** 4
