"""Cohesive laws: the traction for a displacement jump on an opening crack (docs/theory.md §3.1, 3.2).

A law gives the *secant* stiffnesses of its envelope, k_n = T_n/δ_n and k_t = T_t/|δ_t|, which fall as the bond opens
and slides.  A point remembers the smallest of each so far, K_n and K_t, and carries T = K_n ⟨δ_n⟩ n + K_t δ_t: it
follows the envelope wherever it is reached, unloads along the secant to the origin, and loses energy on every path.
"""

from dataclasses import dataclass, fields
from math import e
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from cutsim.base.checks import above, between, positive, require_number
from cutsim.base.functions import exp, if_less, sqrt
from cutsim.base.kinematics import Expr
from cutsim.base.signatures import checked
from cutsim.base.units import Length, Stiffness, Stress, Toughness

_AGREE = 1e-3  # relative disagreement of strength, opening and toughness that is still rounding


@runtime_checkable
class CohesiveLaw(Protocol):
    """Protocol of a cohesive law; see docs/adding_a_cohesive_law.md."""

    @property
    def strength(self) -> float:
        """Largest normal traction t_n [stress]."""

    @property
    def opening(self) -> float:
        """Characteristic normal opening ε_n [length]; the mesh has to resolve the zone it implies."""

    @property
    def toughness(self) -> float:
        """Work of separation φ_n in pure opening [force/length]."""

    @property
    def shear_toughness(self) -> float:
        """Work of separation φ_t in pure sliding [force/length]."""

    def secants(self, opening: Expr, sliding: Expr) -> tuple[Expr, Expr]:
        """Secant stiffnesses (k_n, k_t) of the envelope [stress/length], non-increasing in both arguments ≥ 0."""

    @property
    def characteristic_secants(self) -> tuple[float, float]:
        """Secant stiffnesses at the characteristic opening and sliding, from which damage counts [stress/length]."""


def strength_and_opening(
    strength: Stress | None, opening: Length | None, toughness: Toughness | None, factor: float, mode: str = ""
) -> tuple[float, float]:
    """Complete one mode of a law: toughness = factor · strength · opening.

    Args:
        strength: Largest traction [stress] or None.
        opening: Characteristic opening [length] or None.
        toughness: Work of separation [force/length] or None.
        factor: Shape factor of the law [–].
        mode: Prefix of the parameter names in messages.

    Returns:
        (strength, opening).

    Raises:
        ValueError: A value is not positive, fewer than two are given, or all three are and disagree.
    """
    given = {"strength": strength, "opening": opening, "toughness": toughness}
    for name, value in given.items():
        if value is not None:
            require_number(f"{mode}{name}", value, positive)
    if strength is not None and opening is not None:
        implied = factor * strength * opening
        if toughness is not None and abs(toughness - implied) > _AGREE * implied:
            raise ValueError(
                f"{mode}strength = {strength:g}, {mode}opening = {opening:g} and {mode}toughness = {toughness:g} "
                f"contradict each other: strength and opening imply a toughness of {implied:g} "
                f"({factor:.6g} x strength x opening); give two of the three"
            )
        return strength, opening
    if toughness is not None and strength is not None:
        return strength, toughness / (factor * strength)
    if toughness is not None and opening is not None:
        return toughness / (factor * opening), opening
    have = ", ".join(f"{mode}{name} = {value:g}" for name, value in given.items() if value is not None) or "none"
    raise ValueError(f"give two of {mode}strength, {mode}opening and {mode}toughness; got {have}")


@checked
@dataclass(frozen=True, init=False)
class Exponential:
    """Exponential law of the thesis (4.20), after van den Bosch, Schreurs and Geers.

    T_n = t_n (δ_n/ε_n) exp(1 − δ_n/ε_n) exp(−δ_t²/ε_t²),
    T_t = 2√(e/2) t_t (δ_t/ε_t) (1 + δ_n/ε_n) exp(−δ_n/ε_n) exp(−δ_t²/ε_t²).
    T_n peaks at δ_n = ε_n with t_n, T_t at |δ_t| = ε_t/√2 with t_t.  For φ_n ≠ φ_t the work of a mixed path
    depends on the path (there is no potential).

    In each mode two of strength, opening and toughness are given; without any shear value the shear mode has the
    strength and the toughness of the opening mode.

    Args:
        strength: Normal strength t_n [stress].
        opening: Characteristic normal opening ε_n [length].
        shear_strength: Shear strength t_t [stress].
        shear_opening: Characteristic sliding ε_t [length].
        toughness: Work of separation φ_n = e t_n ε_n in opening [force/length].
        shear_toughness: Work of separation φ_t = √(e/2) t_t ε_t in sliding [force/length].

    Raises:
        ValueError: Values are missing, not positive, or contradict each other.
    """

    strength: Stress
    opening: Length
    shear_strength: Stress
    shear_opening: Length

    def __init__(
        self,
        strength: Stress | None = None,
        opening: Length | None = None,
        shear_strength: Stress | None = None,
        shear_opening: Length | None = None,
        *,
        toughness: Toughness | None = None,
        shear_toughness: Toughness | None = None,
    ) -> None:
        normal = strength_and_opening(strength, opening, toughness, e)
        if shear_strength is None and shear_opening is None and shear_toughness is None:
            shear_strength, shear_toughness = normal[0], e * normal[0] * normal[1]
        shear = strength_and_opening(shear_strength, shear_opening, shear_toughness, sqrt(e / 2), "shear_")
        for field, value in zip(fields(self), (*normal, *shear), strict=True):
            object.__setattr__(self, field.name, value)

    @property
    def toughness(self) -> float:
        """Work of separation φ_n in opening [force/length]."""
        return e * self.strength * self.opening

    @property
    def shear_toughness(self) -> float:
        """Work of separation φ_t in sliding [force/length]."""
        return sqrt(e / 2) * self.shear_strength * self.shear_opening

    def secants(self, opening: Expr, sliding: Expr) -> tuple[Expr, Expr]:
        """Secant stiffnesses of the envelope (thesis 4.20)."""
        normal = opening / self.opening
        decay = exp(-normal - (sliding / self.shear_opening) ** 2)
        k_n = e * self.strength / self.opening * decay
        k_t = sqrt(2 * e) * self.shear_strength / self.shear_opening * (1 + normal) * decay
        return k_n, k_t

    @property
    def characteristic_secants(self) -> tuple[float, float]:
        """t_n/ε_n at the opening ε_n, and √(2/e) t_t/ε_t at the sliding ε_t, which is beyond the peak."""
        return self.strength / self.opening, sqrt(2 / e) * self.shear_strength / self.shear_opening


class ByToughness:
    """Base of laws whose parameters are a strength and a toughness in each mode."""

    strength: Stress
    toughness: Toughness

    @property
    def opening(self) -> float:
        """Normal opening G_I/(e t_n) of the exponential law with the same strength and toughness [length]."""
        return self.toughness / (e * self.strength)


@checked
@dataclass(frozen=True)
class Bilinear(ByToughness):
    """Bilinear mixed-mode law with the Benzeggagh–Kenane criterion (Camanho, Turon et al. 2006).

    T_n = (1 − d) K δ_n and T_t = (1 − d) K_t δ_t with d the largest value so far of λ_f (λ − λ_0) / (λ (λ_f − λ_0)).
    There λ² = δ_n² + (K_t/K) δ_t², B = (K_t/K) δ_t²/λ² is the share of sliding in the work,
    K² λ_0² = t_n² + (t_t² K/K_t − t_n²) B^η and λ_f = 2 (G_I + (G_II − G_I) B^η) / (K λ_0).

    With K_t = K (Camanho et al.) the onset of damage and the toughness depend on B in different ways as soon as
    (t_t/t_n)² is not G_II/G_I: where the mode changes while a point breaks, as at the tip of a bending specimen, the
    work spent then depends on the strengths.  With the stiffnesses of `proportional` it depends on the toughnesses.

    Args:
        penalty: Stiffness K of the intact bond, in opening [stress/length].
        strength: Normal strength t_n [stress].
        toughness: Toughness G_I in opening [force/length].
        shear_strength: Shear strength t_t [stress].
        shear_toughness: Toughness G_II in sliding [force/length].
        eta: Exponent η of the Benzeggagh–Kenane criterion [–].
        shear_penalty: Stiffness K_t of the intact bond in sliding [stress/length]; None for that in opening.

    Raises:
        ValueError: A value is not positive, or a stiffness so small that the bond would be broken before its peak.
    """

    penalty: Stiffness
    strength: Stress
    toughness: Toughness
    shear_strength: Stress
    shear_toughness: Toughness
    eta: float = 2.0
    shear_penalty: Stiffness | None = None

    def __post_init__(self) -> None:
        for name in ("penalty", "strength", "toughness", "shear_strength", "shear_toughness", "eta"):
            require_number(name, getattr(self, name), positive)
        opening, sliding = self.strength**2 / (2 * self.toughness), self.shear_strength**2 / (2 * self.shear_toughness)
        least = opening if self.shear_penalty is not None else max(opening, sliding)
        require_number("penalty", self.penalty, above(least, "strength²/(2 toughness)"))
        require_number(
            "shear_penalty", self.shear_penalty, above(sliding, "shear_strength²/(2 shear_toughness)").or_none
        )

    @classmethod
    @checked
    def proportional(
        cls,
        penalty: Stiffness,
        strength: Stress,
        toughness: Toughness,
        shear_strength: Stress,
        shear_toughness: Toughness,
        eta: float = 2.0,
    ) -> "Bilinear":
        """Make the law whose modes rise and soften in proportion, K_t = K (G_I/G_II) (t_t/t_n)² (Turon et al. 2010).

        Then λ_0 and λ_f are in the same proportion at any mode ratio, and the onset follows the Benzeggagh–Kenane
        criterion like the toughness.  (Turon, Camanho, Costa and Renart, Composite Structures 92, 1857–1864.)

        Args:
            penalty: Stiffness K of the intact bond, in opening [stress/length].
            strength: Normal strength t_n [stress].
            toughness: Toughness G_I in opening [force/length].
            shear_strength: Shear strength t_t [stress].
            shear_toughness: Toughness G_II in sliding [force/length].
            eta: Exponent η of the Benzeggagh–Kenane criterion [–].
        """
        _check_positive(penalty=penalty, strength=strength, toughness=toughness)
        _check_positive(shear_strength=shear_strength, shear_toughness=shear_toughness)
        shear_penalty = penalty * toughness / shear_toughness * (shear_strength / strength) ** 2
        return cls(penalty, strength, toughness, shear_strength, shear_toughness, eta, shear_penalty)

    @classmethod
    @checked
    def rigid(
        cls,
        strength: Stress,
        toughness: Toughness,
        shear_strength: Stress,
        shear_toughness: Toughness,
        eta: float = 2.0,
        rise: float = 0.01,
    ) -> "Bilinear":
        """Make the initially rigid, linear law T = t (1 − δ/δ_c): the intact bond is so stiff that it hardly opens.

        Args:
            strength: Normal strength t_n [stress].
            toughness: Toughness G_I in opening [force/length].
            shear_strength: Shear strength t_t [stress].
            shear_toughness: Toughness G_II in sliding [force/length].
            eta: Exponent η of the Benzeggagh–Kenane criterion [–].
            rise: Largest part of the final jump that the rise to the peak takes, in either mode, in (0, 1) [–].
        """
        _check_positive(strength=strength, toughness=toughness)
        _check_positive(shear_strength=shear_strength, shear_toughness=shear_toughness)
        require_number("rise", rise, between(0, 1))
        least = max(strength**2 / (2 * toughness), shear_strength**2 / (2 * shear_toughness))
        return cls(least / rise, strength, toughness, shear_strength, shear_toughness, eta)

    def secants(self, opening: Expr, sliding: Expr) -> tuple[Expr, Expr]:
        """Secant stiffnesses (1 − d) K and (1 − d) K_t of the envelope."""
        # the floor keeps the direction of an unloaded jump defined; it is far below any opening that matters
        floor = (1e-8 * self.strength / self.penalty) ** 2
        # with sliding measured so that both modes are as stiff; work is the same
        stiffer = 1.0 if self.shear_penalty is None else self.shear_penalty / self.penalty
        slid = stiffer * sliding**2 + floor
        square = opening**2 + slid
        jump = sqrt(square)
        mix = (slid / square) ** self.eta
        onset = sqrt((self.strength**2 + (self.shear_strength**2 / stiffer - self.strength**2) * mix) / self.penalty**2)
        final = 2 * (self.toughness + (self.shear_toughness - self.toughness) * mix) / (self.penalty * onset)
        intact = onset * (final - jump) / (jump * (final - onset))
        left = if_less(jump, onset, 1.0, if_less(jump, final, intact, 0.0))
        return self.penalty * left, self._shear_penalty * left

    @property
    def characteristic_secants(self) -> tuple[float, float]:
        """K and K_t: damage is d."""
        return self.penalty, self._shear_penalty

    @property
    def _shear_penalty(self) -> float:
        return self.penalty if self.shear_penalty is None else self.shear_penalty


def _check_positive(**values: float) -> None:
    for name, value in values.items():
        require_number(name, value, positive)


def process_zone_element(law: CohesiveLaw, young: float) -> float:
    """Largest element size that resolves the process zone of a law in a body [length].

    0.4 ε in soft solids, whose strength is of the order of Young's modulus (measured on blade cuts); a twentieth of
    Irwin's length E G/t² in stiff ones, where the zone is far longer than the opening.
    """
    return max(0.4 * law.opening, 0.05 * young * law.toughness / law.strength**2)


def separation_curve(law: CohesiveLaw, points: int = 400) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Fraction of the toughness spent against the opening, in pure opening.

    Args:
        law: The law.
        points: Points of the table.

    Returns:
        Openings from 0 to 40 ε_n [length], and the work of separation up to each over φ_n [–].
    """
    openings = 40 * law.opening * np.linspace(0, 1, points) ** 2
    tractions = law.secants(openings, np.zeros(points))[0] * openings
    work = np.concatenate([[0.0], np.cumsum(0.5 * (tractions[1:] + tractions[:-1]) * np.diff(openings))])
    return openings, work / law.toughness
