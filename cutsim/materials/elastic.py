"""Elastic materials: strain energies per reference volume (docs/theory.md §2).

A material is a frozen dataclass of parameters that returns its strain energy in two parts: the part to be
integrated fully and the volumetric part, which may be integrated with fewer points so that low-order elements
do not lock.  P = ∂W/∂F and the tangent are derived by UFL.
"""

from dataclasses import dataclass
from math import isfinite
from typing import Protocol, Self, runtime_checkable

import numpy as np
import ufl
from numpy.typing import NDArray

from cutsim.base.checks import between, positive, require_number
from cutsim.base.kinematics import Expr, green_lagrange, small_strain
from cutsim.base.signatures import checked
from cutsim.base.units import Stress


@runtime_checkable
class Material(Protocol):
    """Protocol of a material; see docs/adding_a_material.md."""

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


def isochoric_invariant(F: Expr) -> Expr:
    """First invariant Ī₁ = J^(−2/3) tr C of the isochoric part of F."""
    return ufl.det(F) ** (-2 / 3) * ufl.inner(F, F)


def engineering_constants(shear: float, bulk: float) -> tuple[float, float]:
    """Young's modulus [stress] and Poisson's ratio [–] of shear and bulk modulus."""
    return 9 * bulk * shear / (3 * bulk + shear), (3 * bulk - 2 * shear) / (2 * (3 * bulk + shear))


def volumetric_energy(material: Material, F: NDArray[np.float64]) -> float:
    """Volumetric part of the strain energy of a deformation gradient, 3 × 3 numbers [energy/length³]."""
    return float(material.energy(ufl.as_matrix(F.tolist()))[1](()))


def inside_out(material: Material) -> bool:
    """Whether a strain energy has a value for what is turned inside out, as one of small strain has."""
    try:
        return isfinite(sum(part(()) for part in material.energy(ufl.as_matrix(np.diag([-0.5, 1.0, 1.0]).tolist()))))
    except (ValueError, TypeError):  # the logarithm, or a power, of a negative number
        return False


class WithoutPlaneStress:
    """Base of materials that are not available in plane stress."""

    def plane_stress_stretch(self, F: Expr) -> Expr:
        """Not available.

        Raises:
            ValueError: Always.
        """
        name = type(self).__name__
        raise ValueError(f"plane = 'stress' is not available for {name}; use plane = 'strain' or a 3-D mesh")


@dataclass(frozen=True)
class _Isotropic:
    """Base of isotropic materials with two elastic constants.

    Args:
        young: Young's modulus E > 0 [stress].
        poisson: Poisson's ratio, −1 < ν < ½ [–].

    Raises:
        ValueError: A constant is outside its range.
    """

    young: Stress
    poisson: float

    def __post_init__(self) -> None:
        require_number("young", self.young, positive)
        require_number("poisson", self.poisson, between(-1, 0.5))

    @classmethod
    def from_moduli(cls, shear: float, bulk: float) -> Self:
        """Make the material from shear modulus G > 0 and bulk modulus K > 0 [stress]."""
        require_number("shear", shear, positive)
        require_number("bulk", bulk, positive)
        return cls(*engineering_constants(shear, bulk))

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


@checked
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


@checked
@dataclass(frozen=True)
class IsochoricNeoHookean(WithoutPlaneStress, _Isotropic):
    """Nearly incompressible neo-Hookean solid, W = G/2 (Ī₁−3) + K/2 (ln J)² (thesis 2.6); polyconvex for J < e."""

    def energy(self, F: Expr) -> tuple[Expr, Expr]:
        """Strain energy per reference volume, (fully integrated part, volumetric part)."""
        return 0.5 * self.shear * (isochoric_invariant(F) - 3), 0.5 * self.bulk * ufl.ln(ufl.det(F)) ** 2


@checked
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


@checked
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
