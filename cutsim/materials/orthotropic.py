"""Orthotropic solid of small strains: wood, bone, plies of a composite."""

from dataclasses import dataclass
from math import sqrt

import numpy as np
import ufl

from cutsim.base.checks import between, positive, require, require_number
from cutsim.base.kinematics import Expr, small_strain
from cutsim.base.signatures import checked
from cutsim.base.units import Stress
from cutsim.materials.directions import Direction, normalised, require_axes
from cutsim.materials.elastic import engineering_constants

_AXES: tuple[Direction, Direction] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))


@checked
@dataclass(frozen=True)
class Orthotropic:
    """Small-strain solid with three planes of symmetry and nine constants, W = ½ ε : ℂ : ε.

    In the axes ε₁₁ = σ₁₁/E₁ − ν₁₂ σ₂₂/E₁ − ν₁₃ σ₃₃/E₁, ε₂₂ = −ν₁₂ σ₁₁/E₁ + σ₂₂/E₂ − ν₂₃ σ₃₃/E₂ and so on, and
    2 ε₁₂ = σ₁₂/G₁₂: ν₁₂ is the contraction along 2 over the extension along 1, where 1 is pulled, and
    ν₂₁ = ν₁₂ E₂/E₁.

    Args:
        E1: Young's modulus along the first axis > 0 [stress].
        E2: The same along the second.
        E3: The same along the third.
        nu12: Poisson's ratio ν₁₂, |ν₁₂| < √(E₁/E₂) [–].
        nu13: ν₁₃, |ν₁₃| < √(E₁/E₃).
        nu23: ν₂₃, |ν₂₃| < √(E₂/E₃), and such that the energy is positive definite.
        G12: Shear modulus G₁₂ > 0 [stress].
        G13: G₁₃ > 0.
        G23: G₂₃ > 0.
        axes: Directions of the first and second axis, at right angles; see `cutsim.materials.directions`. In plane
            stress one axis is normal to the plane.

    Raises:
        ValueError: A constant is outside its range, or the axes are not at right angles.
    """

    E1: Stress
    E2: Stress
    E3: Stress
    nu12: float
    nu13: float
    nu23: float
    G12: Stress
    G13: Stress
    G23: Stress
    axes: tuple[Direction, Direction] = _AXES

    def __post_init__(self) -> None:
        for name in ("E1", "E2", "E3", "G12", "G13", "G23"):
            require_number(name, getattr(self, name), positive)
        for name in ("nu12", "nu13", "nu23"):
            first, second = (getattr(self, f"E{i}") for i in name[2:])
            bound = sqrt(first / second)
            require_number(name, getattr(self, name), between(-bound, bound, name=f"sqrt(E{name[2]}/E{name[3]})"))
        definite = bool(np.linalg.eigvalsh(np.array(self._compliance)).min() > 0)
        ratios = (self.nu12, self.nu13, self.nu23)
        require("nu12, nu13, nu23", ratios, definite, "such that the energy is positive definite")
        require_axes(self.axes)

    @property
    def young(self) -> float:
        """Least of the three moduli [stress]: what penalties and mesh checks take for the stiffness of the body.

        That of a layered body across its fibres, where a crack between layers is pressed and opened.
        """
        return min(self.E1, self.E2, self.E3)

    @property
    def poisson(self) -> float:
        """Poisson's ratio of the isotropic solid with the same moduli in the mean (Reuss): whether volume locks [–]."""
        S: np.ndarray = np.array(self._compliance)
        direct, coupled = np.trace(S), S[0, 1] + S[1, 2] + S[2, 0]
        shear = 15 / (4 * (direct - coupled) + 3 * (1 / self.G12 + 1 / self.G13 + 1 / self.G23))
        return engineering_constants(shear, 1 / (direct + 2 * coupled))[1]

    @property
    def _compliance(self) -> list[list[Expr]]:
        """Extensions over normal stresses."""
        s12, s13, s23 = -self.nu12 / self.E1, -self.nu13 / self.E1, -self.nu23 / self.E2
        return [[1 / self.E1, s12, s13], [s12, 1 / self.E2, s23], [s13, s23, 1 / self.E3]]

    @property
    def _stiffness(self) -> list[list[Expr]]:
        """Normal stresses over extensions, the inverse."""
        S = ufl.as_matrix(self._compliance)
        inverse = ufl.inv(S)
        return [[inverse[i, j] for j in range(3)] for i in range(3)]

    def energy(self, F: Expr) -> tuple[Expr, Expr]:
        """Strain energy per reference volume, (fully integrated part, volumetric part K/2 (tr ε)²).

        K is the bulk modulus under a uniform pressure, so that both parts are never negative.
        """
        strain = small_strain(F)
        bulk = 1 / sum(sum(row) for row in self._compliance)
        volumetric = 0.5 * bulk * ufl.tr(strain) ** 2
        return 0.5 * ufl.inner(self._stress(strain), strain) - volumetric, volumetric

    def plane_stress_stretch(self, F: Expr) -> Expr:
        """λ₃ = 1 + ε₃₃ from σ₃₃ = 0.

        Raises:
            ValueError: No axis is normal to the plane.
        """
        for axis in self.axes:
            parts = [axis[i] if i < len(axis) else 0.0 for i in range(3)]
            plane, out = any(p != 0 for p in parts[:2]), parts[2] != 0
            require("axes", "axes", plane != out, "in the plane or normal to it in plane stress")
        strain = small_strain(F)
        flat = ufl.as_matrix([[strain[i, j] if max(i, j) < 2 else 0.0 for j in range(3)] for i in range(3)])
        out = ufl.as_matrix([[1.0 if i == j == 2 else 0.0 for j in range(3)] for i in range(3)])
        return 1 - self._stress(flat)[2, 2] / self._stress(out)[2, 2]

    def _stress(self, strain: Expr) -> Expr:
        """Stress of a strain."""
        first, second = (normalised(a) for a in self.axes)
        axes = (first, second, ufl.cross(first, second))
        E = [[ufl.dot(a, strain * b) for b in axes] for a in axes]
        C, shears = self._stiffness, {(0, 1): self.G12, (0, 2): self.G13, (1, 2): self.G23}
        stress = sum(sum(C[i][j] * E[j][j] for j in range(3)) * ufl.outer(axes[i], axes[i]) for i in range(3))
        for (i, j), modulus in shears.items():
            stress += 2 * modulus * E[i][j] * (ufl.outer(axes[i], axes[j]) + ufl.outer(axes[j], axes[i]))
        return stress
