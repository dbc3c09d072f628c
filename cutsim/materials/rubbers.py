"""Rubbers and isotropic tissues: energies in invariants and in principal stretches (docs/materials.md).

The volumetric part of the invariant models is K/2 (ln J)², which is convex in J up to J = e; the barred invariants are
those of J^(−1/3) F.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import ufl

from cutsim.base.checks import (
    at_least,
    between,
    finite,
    nonnegative,
    positive,
    require,
    require_number,
    require_numbers,
)
from cutsim.base.kinematics import Expr, right_cauchy_green
from cutsim.base.signatures import checked
from cutsim.base.units import Stress
from cutsim.materials.elastic import WithoutPlaneStress, engineering_constants, isochoric_invariant
from cutsim.materials.stretches import stretch_power_sums


class _WithModuli(WithoutPlaneStress, ABC):
    """Base of materials with a shear and a bulk modulus in the small-strain limit."""

    @property
    @abstractmethod
    def shear(self) -> float:
        """Shear modulus G of the small-strain limit [stress]."""

    @abstractmethod
    def _bulk(self) -> float:
        """Bulk modulus K of the small-strain limit [stress]."""

    @property
    def young(self) -> float:
        """Young's modulus of the small-strain limit [stress]."""
        return engineering_constants(self.shear, self._bulk())[0]

    @property
    def poisson(self) -> float:
        """Poisson's ratio of the small-strain limit [–]."""
        return engineering_constants(self.shear, self._bulk())[1]


class _NearlyIncompressible(_WithModuli):
    """Base of nearly incompressible materials, with the volumetric energy K/2 (ln J)²."""

    bulk: Stress

    def _bulk(self) -> float:
        return self.bulk

    def energy(self, F: Expr) -> tuple[Expr, Expr]:
        """Strain energy per reference volume, (fully integrated part, volumetric part)."""
        return self._distortion(F), 0.5 * self.bulk * ufl.ln(ufl.det(F)) ** 2

    @abstractmethod
    def _distortion(self, F: Expr) -> Expr:
        """Energy of the isochoric part of F."""


@checked
@dataclass(frozen=True)
class MooneyRivlin(_NearlyIncompressible):
    """Nearly incompressible Mooney–Rivlin solid, W = C₁(Ī₁−3) + C₂(Ī₂−3) + K/2 (ln J)² (thesis 2.9).

    The Ī₁ term is polyconvex; the Ī₂ term is not, but the solid is stable near incompressibility for C₂ ≥ 0.

    Args:
        c1: First constant C₁ > 0 [stress].
        c2: Second constant C₂ ≥ 0 [stress].
        bulk: Bulk modulus K > 0 [stress].

    Raises:
        ValueError: A constant is outside its range.
    """

    c1: Stress
    c2: Stress
    bulk: Stress

    def __post_init__(self) -> None:
        require_number("c1", self.c1, positive)
        require_number("c2", self.c2, nonnegative)
        require_number("bulk", self.bulk, positive)

    @property
    def shear(self) -> float:
        """Shear modulus G = 2 (C₁ + C₂) [stress]."""
        return 2 * (self.c1 + self.c2)

    def _distortion(self, F: Expr) -> Expr:
        C = right_cauchy_green(F)
        J = ufl.det(F)
        I1 = ufl.tr(C)
        I2 = 0.5 * (I1**2 - ufl.inner(C, C))
        return self.c1 * (J ** (-2 / 3) * I1 - 3) + self.c2 * (J ** (-4 / 3) * I2 - 3)


@checked
@dataclass(frozen=True)
class Yeoh(_NearlyIncompressible):
    """Nearly incompressible Yeoh solid, W = Σ Cᵢ (Ī₁−3)ⁱ + K/2 (ln J)², i = 1, 2, 3 (thesis 2.10).

    Shear never meets a stress of the wrong sign as long as C₁ + 2 C₂ x + 3 C₃ x² > 0 for x = Ī₁ − 3 ≥ 0: always if
    C₂ ≥ 0, else if C₂² < 3 C₁ C₃ (then C₂ < 0 softens before C₃ stiffens).  Polyconvex for C₂ ≥ 0 and J < e.

    Args:
        c1: First constant C₁ > 0 [stress].
        c2: Second constant C₂ > −√(3 C₁ C₃), or ≥ 0 [stress].
        c3: Third constant C₃ ≥ 0 [stress].
        bulk: Bulk modulus K > 0 [stress].

    Raises:
        ValueError: A constant is outside its range.
    """

    c1: Stress
    c2: Stress
    c3: Stress
    bulk: Stress

    def __post_init__(self) -> None:
        require_number("c1", self.c1, positive)
        require_number("c2", self.c2, finite)
        require_number("c3", self.c3, nonnegative)
        stable = self.c2 >= 0 or self.c2**2 < 3 * self.c1 * self.c3
        require("c2", self.c2, stable, "> -sqrt(3 c1 c3), or >= 0")
        require_number("bulk", self.bulk, positive)

    @property
    def shear(self) -> float:
        """Shear modulus G = 2 C₁ [stress]."""
        return 2 * self.c1

    def _distortion(self, F: Expr) -> Expr:
        x = isochoric_invariant(F) - 3
        return x * (self.c1 + x * (self.c2 + x * self.c3))


#: Coefficients of the inverse Langevin function in the energy, for Ī₁ᵏ/Nᵏ⁻¹.
LANGEVIN = (1 / 2, 1 / 20, 11 / 1050, 19 / 7000, 519 / 673750)


@checked
@dataclass(frozen=True)
class ArrudaBoyce(_NearlyIncompressible):
    """Nearly incompressible eight-chain solid of Arruda and Boyce (1993), five terms (thesis 2.11).

    W = C [½(Ī₁−3) + (Ī₁²−9)/(20 N) + 11 (Ī₁³−27)/(1050 N²) + 19 (Ī₁⁴−81)/(7000 N³) + 519 (Ī₁⁵−243)/(673750 N⁴)]
    + K/2 (ln J)².  Polyconvex for J < e.

    Args:
        modulus: Rubbery modulus C > 0 [stress].
        links: Links N ≥ 1 of a chain; its limiting stretch is √N [–].
        bulk: Bulk modulus K > 0 [stress].

    Raises:
        ValueError: A constant is outside its range.
    """

    modulus: Stress
    links: float
    bulk: Stress

    def __post_init__(self) -> None:
        require_number("modulus", self.modulus, positive)
        require_number("links", self.links, at_least(1))
        require_number("bulk", self.bulk, positive)

    @property
    def shear(self) -> float:
        """Shear modulus G = C (1 + 3/(5N) + 99/(175N²) + 513/(875N³) + 42039/(67375N⁴)) [stress]."""
        return 2 * self.modulus * sum(c * k * (3 / self.links) ** (k - 1) for k, c in enumerate(LANGEVIN, 1))

    def _distortion(self, F: Expr) -> Expr:
        I1 = isochoric_invariant(F)
        series = sum(c * (I1**k - 3**k) / self.links ** (k - 1) for k, c in enumerate(LANGEVIN, 1))
        return self.modulus * series


@checked
@dataclass(frozen=True)
class Ogden(_WithModuli):
    """Ogden solid, W = Σ μᵢ/mᵢ² (λ₁ᵐ + λ₂ᵐ + λ₃ᵐ − 3 − mᵢ ln J) + c/2 (J−1)² (thesis 2.8).

    In the notation W = Σ μₚ/αₚ (λ₁ᵅ + λ₂ᵅ + λ₃ᵅ − 3) of Ogden, m = α and μ = μₚ αₚ.  With all μ > 0 each term has a
    stress that grows with the stretch, whatever the sign of m.

    Args:
        moduli: μᵢ > 0, one for each term [stress].
        exponents: mᵢ ≠ 0 [–].
        volumetric: Coefficient c > 0 of the volumetric part, λ of the small-strain limit [stress].

    Raises:
        ValueError: A constant is outside its range, or there are not as many moduli as exponents.
    """

    moduli: tuple[Stress, ...]
    exponents: tuple[float, ...]
    volumetric: Stress

    def __post_init__(self) -> None:
        _require_terms(self.moduli, self.exponents)
        require_number("volumetric", self.volumetric, positive)

    @classmethod
    @checked
    def from_poisson(cls, moduli: tuple[float, ...], exponents: tuple[float, ...], poisson: float) -> "Ogden":
        """Make the material with a Poisson's ratio, 0 < ν < ½, of the small-strain limit."""
        require_numbers("moduli", moduli, positive)
        require_number("poisson", poisson, between(0, 0.5))
        return cls(moduli, exponents, sum(moduli) * poisson / (1 - 2 * poisson))

    @property
    def shear(self) -> float:
        """Shear modulus G = ½ Σ μᵢ [stress]."""
        return 0.5 * sum(self.moduli)

    def _bulk(self) -> float:
        return self.volumetric + 2 * self.shear / 3

    def energy(self, F: Expr) -> tuple[Expr, Expr]:
        """Strain energy per reference volume, (fully integrated part, volumetric part)."""
        J, sums = ufl.det(F), stretch_power_sums(F, self.exponents)
        terms = [
            modulus / m**2 * (power_sum - 3 - m * ufl.ln(J))
            for modulus, m, power_sum in zip(self.moduli, self.exponents, sums, strict=True)
        ]
        return sum(terms), 0.5 * self.volumetric * (J - 1) ** 2


@checked
@dataclass(frozen=True)
class IsochoricOgden(_NearlyIncompressible):
    """Nearly incompressible Ogden solid, W = Σ μᵢ/mᵢ² (λ̄₁ᵐ + λ̄₂ᵐ + λ̄₃ᵐ − 3) + K/2 (ln J)², λ̄ᵢ = J^(−1/3) λᵢ.

    In the notation W = Σ μₚ/αₚ (λ̄₁ᵅ + λ̄₂ᵅ + λ̄₃ᵅ − 3) of Ogden, m = α and μ = μₚ αₚ.  Energy and stress at constant
    volume are those of `Ogden`.

    Args:
        moduli: μᵢ > 0, one for each term [stress].
        exponents: mᵢ ≠ 0 [–].
        bulk: Bulk modulus K > 0 [stress].

    Raises:
        ValueError: A constant is outside its range, or there are not as many moduli as exponents.
    """

    moduli: tuple[Stress, ...]
    exponents: tuple[float, ...]
    bulk: Stress

    def __post_init__(self) -> None:
        _require_terms(self.moduli, self.exponents)
        require_number("bulk", self.bulk, positive)

    @property
    def shear(self) -> float:
        """Shear modulus G = ½ Σ μᵢ [stress]."""
        return 0.5 * sum(self.moduli)

    def _distortion(self, F: Expr) -> Expr:
        J, sums = ufl.det(F), stretch_power_sums(F, self.exponents)
        terms = zip(self.moduli, self.exponents, sums, strict=True)
        return sum(modulus / m**2 * (J ** (-m / 3) * power_sum - 3) for modulus, m, power_sum in terms)


def _require_terms(moduli: tuple[float, ...], exponents: tuple[float, ...]) -> None:
    """Refuse what are no terms of an Ogden solid."""
    require_numbers("moduli", moduli, positive)
    require_numbers("exponents", exponents, length=len(moduli))
    require("exponents", exponents, 0 not in exponents, "as many as moduli, none zero")
