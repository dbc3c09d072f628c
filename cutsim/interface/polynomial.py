"""Polynomial cohesive law of Needleman and Tvergaard (thesis, Table 4.1)."""

from dataclasses import dataclass, fields

from cutsim.base.checks import positive, require_number
from cutsim.base.functions import positive_part, sqrt
from cutsim.base.kinematics import Expr
from cutsim.base.signatures import checked
from cutsim.base.units import Stress, Toughness

# smallest λ, far below any jump that matters: a root has no derivative at zero
_REST = 1e-8


@checked
@dataclass(frozen=True, init=False)
class Polynomial:
    """Polynomial law T = (27/4) t x (1 − x)², x = δ/δ_c, in each mode (Needleman 1987; mixed mode by Tvergaard 1990).

    T_n = (27/4) t_n (δ_n/δ_nc) (1 − λ)² and T_t = (27/4) t_t (δ_t/δ_tc) (1 − λ)² with λ² = (δ_n/δ_nc)² + (δ_t/δ_tc)²,
    zero from λ = 1 on: both modes break together, and their secants keep their ratio.  Each peaks at a third of its
    final jump with its strength; the works of separation are φ = (9/16) t δ_c.  (J. Appl. Mech. 54, 525–531; Materials
    Science and Engineering A 125, 203–213.)

    Args:
        strength: Normal strength t_n > 0 [stress].
        toughness: Work of separation φ_n in opening > 0 [force/length].
        shear_strength: Shear strength t_t > 0 [stress]; None for that in opening.
        shear_toughness: Work of separation φ_t in sliding > 0 [force/length]; None for that in opening.

    Raises:
        ValueError: A number is not positive.
    """

    strength: Stress
    toughness: Toughness
    shear_strength: Stress
    shear_toughness: Toughness

    def __init__(
        self,
        strength: Stress,
        toughness: Toughness,
        shear_strength: Stress | None = None,
        shear_toughness: Toughness | None = None,
    ) -> None:
        given = (strength, toughness, shear_strength, shear_toughness)
        for field, value, other in zip(fields(self), given, (None, None, strength, toughness), strict=True):
            require_number(field.name, value, positive if other is None else positive.or_none)
            object.__setattr__(self, field.name, other if value is None else value)

    @property
    def final(self) -> tuple[float, float]:
        """Opening δ_nc and sliding δ_tc at which the bond is broken in each pure mode [length]."""
        return 16 / 9 * self.toughness / self.strength, 16 / 9 * self.shear_toughness / self.shear_strength

    @property
    def opening(self) -> float:
        """Opening of the peak, δ_nc/3 [length]."""
        return self.final[0] / 3

    def secants(self, opening: Expr, sliding: Expr) -> tuple[Expr, Expr]:
        """Secant stiffnesses (27/4) (t/δ_c) (1 − λ)² of the envelope."""
        normal, tangential = self.final
        reached = sqrt((opening / normal) ** 2 + (sliding / tangential) ** 2 + _REST**2)
        left = 27 / 4 * positive_part(1 - reached) ** 2
        return self.strength / normal * left, self.shear_strength / tangential * left

    @property
    def characteristic_secants(self) -> tuple[float, float]:
        """3 t/δ_c at the peak of each mode."""
        normal, tangential = self.final
        return 3 * self.strength / normal, 3 * self.shear_strength / tangential
