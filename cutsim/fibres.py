"""Fibres that reinforce a solid: strain energies per reference volume of one family each (docs/materials.md).

`Reinforced` adds families to any other material.  Fibres carry tension only: their energy starts with zero slope where
they begin to stretch, so that the stress has no jump there.

A direction is a vector of the reference configuration of any length: a tuple of two or three numbers, or, where it
changes from place to place, a UFL vector such as a `dolfinx.fem.Function`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.mesh import Mesh
from numpy.typing import NDArray
from scipy.integrate import lebedev_rule

from cutsim.checks import require
from cutsim.kinematics import Expr
from cutsim.materials import Material, WithoutPlaneStress, isochoric_invariant

Direction = tuple[float, ...] | Expr


class FibreLaw(Protocol):
    """What `Reinforced` needs of a family of fibres."""

    def energy(self, F: Expr) -> Expr:
        """Strain energy per reference volume."""


@dataclass(frozen=True)
class Reinforced(WithoutPlaneStress):
    """A material with families of fibres; their energies add up, the volumetric part is that of the matrix.

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
    modulus: float
    exponential: float
    power: float = 2.0

    def __post_init__(self) -> None:
        require_direction("direction", self.direction)
        require("modulus", self.modulus, self.modulus > 0, "> 0")
        require("exponential", self.exponential, self.exponential > 0, "> 0")
        require("power", self.power, self.power >= 2, ">= 2")

    def energy(self, F: Expr) -> Expr:
        """Strain energy per reference volume."""
        stretched = tension(squared_stretch(F, self.direction) - 1)
        exponent = self.exponential * stretched**self.power
        return self.modulus / (self.exponential * self.power) * (ufl.exp(exponent) - 1)


@dataclass(frozen=True)
class DispersedFibres:
    """Fibres that scatter about a direction, W = k₁/(2k₂) (exp(k₂ ⟨E⟩²) − 1) (Gasser, Ogden and Holzapfel 2006).

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
    k1: float
    k2: float
    dispersion: float = 0.0

    def __post_init__(self) -> None:
        require_direction("direction", self.direction)
        require("k1", self.k1, self.k1 > 0, "> 0")
        require("k2", self.k2, self.k2 > 0, "> 0")
        require("dispersion", self.dispersion, 0 <= self.dispersion <= 1 / 3, "in [0, 1/3]")

    def energy(self, F: Expr) -> Expr:
        """Strain energy per reference volume."""
        I4 = ufl.det(F) ** (-2 / 3) * squared_stretch(F, self.direction)
        kappa = self.dispersion
        strain = tension(kappa * (isochoric_invariant(F) - 3) + (1 - 3 * kappa) * (I4 - 1))
        return self.k1 / (2 * self.k2) * (ufl.exp(self.k2 * strain**2) - 1)


#: Half of Lebedev's rule of degree 11 with 50 points: one direction of each pair, weights for the whole sphere.
_POINTS, _WEIGHTS = lebedev_rule(11)
_HALF = np.lexsort(np.round(_POINTS, 12))[25:]
DIRECTIONS, WEIGHTS = _POINTS[:, _HALF].T, 2 * _WEIGHTS[_HALF]


@dataclass(frozen=True)
class EllipsoidalFibres:
    """Fibres in all directions, with moduli on an ellipsoid, W = ∫ ξ(n) ⟨I(n)−1⟩^β dA over the unit sphere.

    I(n) = n·Cn and ξ(n) = (Σ nᵢ²/ξᵢ²)^(−½) in the axes of the ellipsoid (Ateshian et al. 2009).
    The integral is summed over 25 directions (Lebedev's rule of degree 11): exact where all fibres are in tension,
    ξ is the same in all directions and β is 2 to 5; in uniaxial tension, where some are slack, the stress is right to
    the accuracy in `tests/test_fibres.py`.

    Args:
        moduli: Semi-axes ξ₁, ξ₂, ξ₃ > 0 [stress].
        power: β ≥ 2 [–].
        axes: Directions of the first and second semi-axis, at right angles.

    Raises:
        ValueError: A number is outside its range.
    """

    moduli: tuple[float, float, float]
    power: float = 2.0
    axes: tuple[Direction, Direction] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))

    def __post_init__(self) -> None:
        require("moduli", self.moduli, len(self.moduli) == 3 and min(self.moduli) > 0, "three numbers > 0")
        require("power", self.power, self.power >= 2, ">= 2")
        require_axes(self.axes)

    def energy(self, F: Expr) -> Expr:
        """Strain energy per reference volume."""
        Q = frame(self.axes)
        C = Q * F.T * F * Q.T
        return sum(w * self._modulus(n) * self._of_stretch(C, n) for n, w in zip(DIRECTIONS, WEIGHTS, strict=True))

    def _modulus(self, n: NDArray[np.float64]) -> Expr:
        return 1 / ufl.sqrt(sum((float(c) / m) ** 2 for c, m in zip(n, self.moduli, strict=True)))

    def _of_stretch(self, C: Expr, n: NDArray[np.float64]) -> Expr:
        squared = sum(float(n[i] * n[j]) * C[i, j] for i in range(3) for j in range(3) if n[i] * n[j])
        return tension(squared - 1) ** self.power


def piecewise_direction(mesh: Mesh, regions: Mapping[tuple[float, ...], NDArray[np.int32]]) -> fem.Function:
    """A direction for each region of cells, as a function that is constant in every cell.

    Args:
        mesh: The mesh.
        regions: Local cells (ghosts included) by direction, a tuple of three numbers.

    Raises:
        ValueError: A direction is not three numbers, or zero.
    """
    field = fem.Function(fem.functionspace(mesh, ("Discontinuous Lagrange", 0, (3,))))
    values = field.x.array.reshape(-1, 3)
    for direction, cells in regions.items():
        require_direction("direction", direction)
        values[cells] = direction
    return field


def squared_stretch(F: Expr, direction: Direction) -> Expr:
    """Squared stretch I₄ = a·Ca/a·a along a direction a of the reference configuration."""
    a = vector(direction)
    return ufl.dot(F * a, F * a) / ufl.dot(a, a)


def tension(x: Expr) -> Expr:
    """Positive part ⟨x⟩."""
    return ufl.conditional(ufl.gt(x, 0), x, 0.0)


def vector(direction: Direction) -> Expr:
    """A direction as a UFL vector of three components."""
    components = list(direction) if isinstance(direction, tuple) else [direction[i] for i in range(len(direction))]
    return ufl.as_vector(components + [0.0] * (3 - len(components)))


def frame(axes: tuple[Direction, Direction]) -> Expr:
    """Rotation whose rows are unit vectors along two directions at right angles and their vector product."""
    first, second = (vector(a) / ufl.sqrt(ufl.dot(vector(a), vector(a))) for a in axes)
    third = ufl.cross(first, second)
    return ufl.as_matrix([[e[i] for i in range(3)] for e in (first, second, third)])


def require_direction(name: str, direction: Any) -> None:
    """Refuse what is not a direction.

    Raises:
        ValueError: A tuple of other than two or three numbers, or zero; or an expression of another shape.
    """
    constant = isinstance(direction, tuple)
    shape = (len(direction),) if constant else getattr(direction, "ufl_shape", None)
    valid = shape in ((2,), (3,)) and (not constant or any(direction))
    require(name, direction, valid, "two or three numbers, not all zero, or a UFL vector of that size")


def require_axes(axes: tuple[Direction, Direction]) -> None:
    """Refuse what are not two directions at right angles.

    Raises:
        ValueError: One is not a direction, or both are constant and not at right angles.
    """
    for axis in axes:
        require_direction("axes", axis)
    if all(isinstance(a, tuple) for a in axes):
        first, second = (np.array([*a, 0.0][:3]) / np.linalg.norm(a) for a in axes)
        require("axes", axes, abs(first @ second) < 1e-9, "at right angles")
