"""Fibre families that reinforce a solid: their strain energies per reference volume (docs/materials.md).

`Reinforced` adds families to any other material.  Fibres carry tension only: their energy starts with zero slope where
they begin to stretch, so that the stress has no jump there.  For directions see `cutsim.materials.directions`.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import ufl
from numpy.typing import NDArray
from scipy.integrate import lebedev_rule

from cutsim.base.checks import at_least, between, positive, require, require_number, require_numbers
from cutsim.base.functions import positive_part
from cutsim.base.kinematics import Expr
from cutsim.base.signatures import checked
from cutsim.base.units import Stress
from cutsim.materials.directions import Direction, require_axes, require_direction, squared_stretch, stretches_in
from cutsim.materials.elastic import Material, WithoutPlaneStress, isochoric_invariant


class FibreLaw(Protocol):
    """Protocol of a family of fibres, as `Reinforced` uses it."""

    def energy(self, F: Expr) -> Expr:
        """Strain energy per reference volume."""


@checked
@dataclass(frozen=True)
class Reinforced(WithoutPlaneStress):
    """Matrix material with families of fibres; their energies add up, the volumetric part is that of the matrix.

    Args:
        matrix: The material between the fibres.
        fibres: One law for each family.

    Raises:
        ValueError: There are no fibres.
    """

    matrix: Material
    fibres: tuple[FibreLaw, ...]

    def __post_init__(self) -> None:
        require("fibres", self.fibres, len(self.fibres) > 0, "at least one family")

    @property
    def young(self) -> float:
        """Young's modulus of the matrix at small strain [stress]."""
        return self.matrix.young

    @property
    def poisson(self) -> float:
        """Poisson's ratio of the matrix at small strain [–]."""
        return self.matrix.poisson

    def energy(self, F: Expr) -> tuple[Expr, Expr]:
        """Strain energy per reference volume, (fully integrated part, volumetric part)."""
        part, volumetric = self.matrix.energy(F)
        return part + sum(family.energy(F) for family in self.fibres), volumetric


@checked
@dataclass(frozen=True)
class ExponentialFibres:
    """Exponential-power fibres, W = ξ/(αβ) (exp(α ⟨I₄−1⟩^β) − 1), with I₄ the squared stretch (FEBio fiber-exp-pow).

    Convex in the fibre stretch.  For β = 2 the stiffness jumps when the fibres tighten, for β > 2 it starts from zero.

    Args:
        direction: Direction of the fibres.
        modulus: ξ > 0 [stress].
        exponential: α > 0 [–].
        power: β ≥ 2 [–].

    Raises:
        ValueError: A number is outside its range.
    """

    direction: Direction
    modulus: Stress
    exponential: float
    power: float = 2.0

    def __post_init__(self) -> None:
        require_direction("direction", self.direction)
        require_number("modulus", self.modulus, positive)
        require_number("exponential", self.exponential, positive)
        require_number("power", self.power, at_least(2))

    def energy(self, F: Expr) -> Expr:
        """Strain energy per reference volume."""
        stretched = positive_part(squared_stretch(F, self.direction) - 1)
        exponent = self.exponential * stretched**self.power
        return self.modulus / (self.exponential * self.power) * (ufl.exp(exponent) - 1)


@checked
@dataclass(frozen=True)
class DispersedFibres:
    """Fibres dispersed about a direction, W = k₁/(2k₂) (exp(k₂ ⟨E⟩²) − 1) (Gasser, Ogden and Holzapfel 2006).

    E = κ (Ī₁ − 3) + (1 − 3κ) (Ī₄ − 1), with the invariants of the isochoric part of F.  κ = 0 are parallel fibres, the
    model of Holzapfel, Gasser and Ogden (2000); κ = ⅓ is isotropic.  Polyconvex together with the matrix for
    0 ≤ κ ≤ ⅓ near incompressibility; well away from it barred invariants misjudge the stretch of the fibres.

    Args:
        direction: Mean direction of the fibres.
        k1: Modulus k₁ > 0 [stress].
        k2: Stiffening k₂ > 0 [–].
        dispersion: κ, between 0 and ⅓ [–].

    Raises:
        ValueError: A number is outside its range.
    """

    direction: Direction
    k1: Stress
    k2: float
    dispersion: float = 0.0

    def __post_init__(self) -> None:
        require_direction("direction", self.direction)
        require_number("k1", self.k1, positive)
        require_number("k2", self.k2, positive)
        require_number("dispersion", self.dispersion, between(0, 1 / 3, "[]"))

    def energy(self, F: Expr) -> Expr:
        """Strain energy per reference volume."""
        I4 = ufl.det(F) ** (-2 / 3) * squared_stretch(F, self.direction)
        kappa = self.dispersion
        strain = positive_part(kappa * (isochoric_invariant(F) - 3) + (1 - 3 * kappa) * (I4 - 1))
        return self.k1 / (2 * self.k2) * (ufl.exp(self.k2 * strain**2) - 1)


#: Half of Lebedev's rule of degree 11 with 50 points: one direction of each pair, weights for the whole sphere.
_POINTS, _WEIGHTS = lebedev_rule(11)
_HALF = np.lexsort(np.round(_POINTS, 12))[25:]
DIRECTIONS, WEIGHTS = _POINTS[:, _HALF].T, 2 * _WEIGHTS[_HALF]


@checked
@dataclass(frozen=True)
class EllipsoidalFibres:
    """Fibres in all directions, with moduli on an ellipsoid, W = ∫ ξ(n) ⟨I(n)−1⟩^β dA over the unit sphere.

    I(n) = n·Cn and ξ(n) = (Σ nᵢ²/ξᵢ²)^(−½) in the axes of the ellipsoid (Ateshian et al. 2009).
    The integral is a sum over 25 directions (Lebedev's rule of degree 11).  It is exact where all fibres are in
    tension, ξ is the same everywhere and β is a whole number up to 5.  In uniaxial tension, where many are slack, the
    stress is right to 1.5 % (stretches up to 1.6, moduli 1 : 2 : 3, β = 2 and 3).

    Args:
        moduli: Semi-axes ξ₁, ξ₂, ξ₃ > 0 [stress].
        power: β ≥ 2 [–].
        axes: Directions of the first and second semi-axis, at right angles.

    Raises:
        ValueError: A number is outside its range.
    """

    moduli: tuple[Stress, Stress, Stress]
    power: float = 2.0
    axes: tuple[Direction, Direction] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))

    def __post_init__(self) -> None:
        require_numbers("moduli", self.moduli, positive, 3)
        require_number("power", self.power, at_least(2))
        require_axes(self.axes)

    def energy(self, F: Expr) -> Expr:
        """Strain energy per reference volume."""
        C = stretches_in(F, self.axes)
        return sum(w * self._modulus(n) * self._of_stretch(C, n) for n, w in zip(DIRECTIONS, WEIGHTS, strict=True))

    def _modulus(self, n: NDArray[np.float64]) -> Expr:
        return 1 / ufl.sqrt(sum((float(c) / m) ** 2 for c, m in zip(n, self.moduli, strict=True)))

    def _of_stretch(self, C: list[list[Expr]], n: NDArray[np.float64]) -> Expr:
        squared = sum(float(n[i] * n[j]) * C[i][j] for i in range(3) for j in range(3) if n[i] * n[j])
        return positive_part(squared - 1) ** self.power
