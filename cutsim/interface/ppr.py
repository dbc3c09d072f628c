"""Cohesive law of Park, Paulino and Roesler (2009), with any shape, strength and toughness in both modes."""

from dataclasses import dataclass

from cutsim.base.checks import above, between, positive, require_number
from cutsim.base.functions import if_less, larger, positive_part
from cutsim.base.kinematics import Expr
from cutsim.base.signatures import checked
from cutsim.base.units import Stress, Toughness
from cutsim.interface.cohesive import ByToughness


@checked
@dataclass(frozen=True)
class ParkPaulinoRoesler(ByToughness):
    """Cohesive law with the potential Ψ of Park, Paulino and Roesler (J. Mech. Phys. Solids 57, 2009), known as PPR.

    With x = δ_n/δ_nc, y = δ_t/δ_tc, f(x) = (1−x)^α (1 + αx/m)^m, g(y) = (1−y)^β (1 + βy/n)^n and Φ = max(φ_n, φ_t),
    T_n = −f'(x)/δ_nc ⟨Φ g(y) − ⟨φ_t−φ_n⟩⟩ and T_t = −g'(y)/δ_tc ⟨Φ f(x) − ⟨φ_n−φ_t⟩⟩, each zero from its final
    opening on.  m and n follow from the openings of the peaks, δ_nc and δ_tc from the strengths.  On the envelope the
    work of separation depends on the path only as the potential says; unloading goes along the secant to the origin.

    Args:
        strength: Normal strength t_n > 0 [stress].
        toughness: Toughness φ_n in opening > 0 [force/length].
        shear_strength: Shear strength t_t > 0 [stress].
        shear_toughness: Toughness φ_t in sliding > 0 [force/length].
        alpha: Shape α > 1 of softening in opening: 2 is about linear, more is concave, less convex [–].
        beta: Shape β > 1 of softening in sliding [–].
        peak: Opening of the peak over the final one, 0 < λ_n ≤ 1/√(2α − 1) [–].
        shear_peak: Sliding of the peak over the final one, 0 < λ_t ≤ 1/√(2β − 1) [–].

    Raises:
        ValueError: A number is outside its range.
    """

    strength: Stress
    toughness: Toughness
    shear_strength: Stress
    shear_toughness: Toughness
    alpha: float = 3.0
    beta: float = 3.0
    peak: float = 0.1
    shear_peak: float = 0.1

    def __post_init__(self) -> None:
        for name in ("strength", "toughness", "shear_strength", "shear_toughness"):
            require_number(name, getattr(self, name), positive)
        for name, peak in (("alpha", "peak"), ("beta", "shear_peak")):
            shape, place = getattr(self, name), getattr(self, peak)
            require_number(name, shape, above(1))
            # beyond this the secant would first rise
            limit = (2 * shape - 1) ** -0.5
            require_number(peak, place, between(0, limit, "(]", name=f"1/sqrt(2 {name} - 1)"))

    @property
    def final(self) -> tuple[float, float]:
        """Opening δ_nc and sliding δ_tc at which the bond is broken in each pure mode [length]."""
        normal = _slope(self.peak, self.alpha, self.peak) * self.toughness / self.strength
        return normal, _slope(self.shear_peak, self.beta, self.shear_peak) * self.shear_toughness / self.shear_strength

    def secants(self, opening: Expr, sliding: Expr) -> tuple[Expr, Expr]:
        """Secant stiffnesses of the envelope."""
        normal, tangential = self.final
        x, y = opening / normal, sliding / tangential
        energy = larger(self.toughness, self.shear_toughness)
        across = positive_part(
            energy * _shape(y, self.beta, self.shear_peak) - positive_part(self.shear_toughness - self.toughness)
        )
        along = positive_part(
            energy * _shape(x, self.alpha, self.peak) - positive_part(self.toughness - self.shear_toughness)
        )
        k_n = _secant(x, self.alpha, self.peak) / normal**2 * across
        k_t = _secant(y, self.beta, self.shear_peak) / tangential**2 * along
        return k_n, k_t

    @property
    def characteristic_secants(self) -> tuple[float, float]:
        """Strength over jump at the peak of each mode."""
        normal, tangential = self.final
        return self.strength / (self.peak * normal), self.shear_strength / (self.shear_peak * tangential)


def _exponent(shape: Expr, peak: Expr) -> Expr:
    """Exponent m that places the peak."""
    return shape * (shape - 1) * peak**2 / (1 - shape * peak**2)


def _shape(x: Expr, shape: Expr, peak: Expr) -> Expr:
    """Potential f of one mode over its toughness, from 1 to 0."""
    m = _exponent(shape, peak)
    return if_less(x, 1.0, positive_part(1 - x) ** shape * (1 + shape * x / m) ** m, 0.0)


def _slope(x: Expr, shape: Expr, peak: Expr) -> Expr:
    """−f' before the final opening."""
    m = _exponent(shape, peak)
    return shape * (shape / m + 1) * x * (1 - x) ** (shape - 1) * (1 + shape * x / m) ** (m - 1)


def _secant(x: Expr, shape: Expr, peak: Expr) -> Expr:
    """−f'/x, zero from the final opening on."""
    m = _exponent(shape, peak)
    secant = shape * (shape / m + 1) * positive_part(1 - x) ** (shape - 1) * (1 + shape * x / m) ** (m - 1)
    return if_less(x, 1.0, secant, 0.0)
