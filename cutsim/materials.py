"""Bulk materials: strain energies per reference volume (docs/theory.md §2).

A material is a frozen dataclass of parameters that returns its strain energy in two parts: the part to be
integrated fully and the volumetric part, which may be integrated with fewer points so that low-order elements
do not lock.  P = ∂W/∂F and the tangent are derived by UFL.
"""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import ufl

from cutsim.checks import require
from cutsim.kinematics import Expr, green_lagrange, right_cauchy_green, small_strain


@runtime_checkable
class Material(Protocol):
    """What the bulk needs of a material; see docs/adding_a_material.md."""

    @property
    def young(self) -> float:
        """Young's modulus of the small-strain limit [stress]."""

    @property
    def poisson(self) -> float:
        """Poisson's ratio of the small-strain limit [–]."""

    def energy(self, F: Expr) -> tuple[Expr, Expr]:
        """Strain energy per reference volume, (fully integrated part, volumetric part)."""

    def plane_stress_stretch(self, F: Expr) -> Expr:
        """Out-of-plane stretch λ₃ that makes the out-of-plane stress vanish, from the in-plane part of F."""


@dataclass(frozen=True)
class _Isotropic:
    """Two elastic constants of the small-strain limit.

    Args:
        young: Young's modulus E > 0 [stress].
        poisson: Poisson's ratio, −1 < ν < ½ [–].

    Raises:
        ValueError: A constant is outside its range.
    """

    young: float
    poisson: float

    def __post_init__(self) -> None:
        require("young", self.young, self.young > 0, "> 0")
        require("poisson", self.poisson, -1 < self.poisson < 0.5, "in (-1, 0.5)")

    @classmethod
    def from_moduli(cls, shear: float, bulk: float) -> "_Isotropic":
        """Make the material from shear modulus G > 0 and bulk modulus K > 0 [stress]."""
        require("shear", shear, shear > 0, "> 0")
        require("bulk", bulk, bulk > 0, "> 0")
        young = 9 * bulk * shear / (3 * bulk + shear)
        return cls(young, (3 * bulk - 2 * shear) / (2 * (3 * bulk + shear)))

    @property
    def shear(self) -> float:
        """Shear modulus G [stress]."""
        return self.young / (2 * (1 + self.poisson))

    @property
    def bulk(self) -> float:
        """Bulk modulus K [stress]."""
        return self.young / (3 * (1 - 2 * self.poisson))

    @property
    def lame(self) -> float:
        """First Lamé constant λ = K − 2G/3 [stress]."""
        return self.bulk - 2 * self.shear / 3


@dataclass(frozen=True)
class NeoHookean(_Isotropic):
    """Compressible neo-Hookean solid, W = G/2 (I₁−3) − G ln J + λ/2 (ln J)² (thesis 2.7).

    The thesis prints K for λ; here λ = K − 2G/3, so that the small-strain limit is Hooke's law.
    """

    def energy(self, F: Expr) -> tuple[Expr, Expr]:
        """Strain energy per reference volume, (fully integrated part, volumetric part)."""
        log_J = ufl.ln(ufl.det(F))
        shear = 0.5 * self.shear * (ufl.inner(F, F) - 3) - self.shear * log_J
        return shear, 0.5 * self.lame * log_J**2

    def plane_stress_stretch(self, F: Expr) -> Expr:
        """Root λ₃ of G (λ₃² − 1) + λ ln(J₂ λ₃) = 0.

        Newton's method on y = ln λ₃, unrolled: the function is convex and increasing, so that every start converges,
        and six iterations from the small-strain root are exact to rounding for 0.3 < J₂ < 3.
        """
        log_area = ufl.ln(F[0, 0] * F[1, 1] - F[0, 1] * F[1, 0])
        y = -self.lame / (self.lame + 2 * self.shear) * log_area
        for _ in range(6):
            square = ufl.exp(2 * y)
            residual = self.shear * (square - 1) + self.lame * (log_area + y)
            y = y - residual / (2 * self.shear * square + self.lame)
        return ufl.exp(y)


@dataclass(frozen=True)
class StVenantKirchhoff(_Isotropic):
    """St Venant–Kirchhoff solid, W = G E:E + λ/2 (tr E)²: large rotations, small strains."""

    def energy(self, F: Expr) -> tuple[Expr, Expr]:
        """Strain energy per reference volume, (fully integrated part, volumetric part)."""
        E = green_lagrange(F)
        return self.shear * ufl.inner(E, E), 0.5 * self.lame * ufl.tr(E) ** 2

    def plane_stress_stretch(self, F: Expr) -> Expr:
        """λ₃ from E₃₃ = −λ/(λ+2G) (E₁₁ + E₂₂)."""
        E = green_lagrange(F)
        return ufl.sqrt(1 - 2 * self.lame / (self.lame + 2 * self.shear) * (E[0, 0] + E[1, 1]))


@dataclass(frozen=True)
class LinearElastic(_Isotropic):
    """Small-strain isotropic solid, W = G ε:ε + λ/2 (tr ε)²."""

    def energy(self, F: Expr) -> tuple[Expr, Expr]:
        """Strain energy per reference volume, (fully integrated part, volumetric part)."""
        strain = small_strain(F)
        return self.shear * ufl.inner(strain, strain), 0.5 * self.lame * ufl.tr(strain) ** 2

    def plane_stress_stretch(self, F: Expr) -> Expr:
        """λ₃ = 1 + ε₃₃ with ε₃₃ = −λ/(λ+2G) (ε₁₁ + ε₂₂)."""
        strain = small_strain(F)
        return 1 - self.lame / (self.lame + 2 * self.shear) * (strain[0, 0] + strain[1, 1])


@dataclass(frozen=True)
class MooneyRivlin:
    """Nearly incompressible Mooney–Rivlin solid, W = C₁(Ī₁−3) + C₂(Ī₂−3) + K/2 (ln J)² (thesis 2.9).

    Args:
        c1: First constant C₁ > 0 [stress].
        c2: Second constant C₂ ≥ 0 [stress].
        bulk: Bulk modulus K > 0 [stress].

    Raises:
        ValueError: A constant is outside its range.
    """

    c1: float
    c2: float
    bulk: float

    def __post_init__(self) -> None:
        require("c1", self.c1, self.c1 > 0, "> 0")
        require("c2", self.c2, self.c2 >= 0, ">= 0")
        require("bulk", self.bulk, self.bulk > 0, "> 0")

    @property
    def shear(self) -> float:
        """Shear modulus G = 2 (C₁ + C₂) [stress]."""
        return 2 * (self.c1 + self.c2)

    @property
    def young(self) -> float:
        """Young's modulus of the small-strain limit [stress]."""
        return 9 * self.bulk * self.shear / (3 * self.bulk + self.shear)

    @property
    def poisson(self) -> float:
        """Poisson's ratio of the small-strain limit [–]."""
        return (3 * self.bulk - 2 * self.shear) / (2 * (3 * self.bulk + self.shear))

    def energy(self, F: Expr) -> tuple[Expr, Expr]:
        """Strain energy per reference volume, (fully integrated part, volumetric part)."""
        C = right_cauchy_green(F)
        J = ufl.det(F)
        I1 = ufl.tr(C)
        I2 = 0.5 * (I1**2 - ufl.inner(C, C))
        distortion = self.c1 * (J ** (-2 / 3) * I1 - 3) + self.c2 * (J ** (-4 / 3) * I2 - 3)
        return distortion, 0.5 * self.bulk * ufl.ln(J) ** 2

    def plane_stress_stretch(self, F: Expr) -> Expr:
        """Not available: in plane stress a nearly incompressible solid needs no volumetric stiffness.

        Raises:
            ValueError: Always.
        """
        raise ValueError("plane = 'stress' is not available for MooneyRivlin; use plane = 'strain' or a 3-D mesh")
