"""Anisotropic solids: transversely isotropic, and orthotropic of Fung's type."""

from dataclasses import dataclass

import numpy as np
import ufl

from cutsim.base.checks import between, finite, positive, require, require_number, require_numbers
from cutsim.base.kinematics import Expr
from cutsim.base.signatures import checked
from cutsim.base.units import Stress
from cutsim.materials.directions import Direction, normalised, require_axes, require_direction, stretches_in
from cutsim.materials.elastic import WithoutPlaneStress, engineering_constants

_AXES: tuple[Direction, Direction] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))


@checked
@dataclass(frozen=True)
class TransverselyIsotropic(WithoutPlaneStress):
    """Neo-Hookean solid with one stiffer or softer direction a (Bonet and Burton 1998, with five constants).

    W = G/2 (I₁−3) − G ln J + λ/2 (ln J)² + [α + β ln J + γ (I₄−1)] (I₄−1) − α/2 (I₅−1), I₄ = a·Ca, I₅ = a·C²a.
    The small-strain limit is Hooke's law with the five constants below.  Unlike fibres, a resists compression like
    tension.  Stable at small strain for the constants allowed; when compressed much along a it can lose ellipticity.

    Args:
        direction: Direction a; see `cutsim.materials.directions`.
        young: Young's modulus E > 0 across a [stress].
        poisson: Poisson's ratio in the plane across a, −1 < ν < 1 [–].
        axial_young: Young's modulus E_a > 0 along a [stress].
        axial_poisson: Contraction across a over extension along it, ν_a; 1 − ν − 2 ν_a² E/E_a > 0 [–].
        axial_shear: Shear modulus G_a > 0 between a and its plane [stress].

    Raises:
        ValueError: A constant is outside its range.
    """

    direction: Direction
    young: Stress
    poisson: float
    axial_young: Stress
    axial_poisson: float
    axial_shear: Stress

    def __post_init__(self) -> None:
        require_direction("direction", self.direction)
        for name in ("young", "axial_young", "axial_shear"):
            require_number(name, getattr(self, name), positive)
        require_number("poisson", self.poisson, between(-1, 1))
        require_number("axial_poisson", self.axial_poisson, finite)
        require("axial_poisson", self.axial_poisson, self._definite > 0, "such that 1 - nu - 2 nu_a^2 E/E_a > 0")

    @property
    def _definite(self) -> float:
        return 1 - self.poisson - 2 * self.axial_poisson**2 * self.young / self.axial_young

    def energy(self, F: Expr) -> tuple[Expr, Expr]:
        """Strain energy per reference volume, (fully integrated part, volumetric part)."""
        shear = self.young / (2 * (1 + self.poisson))
        ratio = self.axial_poisson**2 * self.young / self.axial_young
        # entries of the stiffness of the small-strain limit, a being the first axis
        lame = self.young * (self.poisson + ratio) / ((1 + self.poisson) * self._definite)
        coupling = self.young * self.axial_poisson / self._definite
        axial = self.axial_young * (1 - self.poisson) / self._definite
        alpha, beta = shear - self.axial_shear, 0.5 * (coupling - lame)
        gamma = (axial + lame - 2 * coupling + 2 * shear - 4 * self.axial_shear) / 8
        a = normalised(self.direction)
        Ca = F.T * (F * a)
        I4, I5, log_J = ufl.dot(a, Ca) - 1, ufl.dot(Ca, Ca) - 1, ufl.ln(ufl.det(F))
        matrix = 0.5 * shear * (ufl.inner(F, F) - 3) - shear * log_J
        return matrix + (alpha + beta * log_J + gamma * I4) * I4 - 0.5 * alpha * I5, 0.5 * lame * log_J**2


@checked
@dataclass(frozen=True)
class FungOrthotropic(WithoutPlaneStress):
    """Nearly incompressible exponential solid with three axes, W = c/2 (e^Q − 1) + K/2 (ln J)² (Fung 1979).

    Q = b₁₁E₁₁² + b₂₂E₂₂² + b₃₃E₃₃² + 2b₁₂E₁₁E₂₂ + 2b₂₃E₂₂E₃₃ + 2b₃₁E₃₃E₁₁ + 4b₄E₁₂² + 4b₅E₂₃² + 4b₆E₃₁², with the
    isochoric Green–Lagrange strain in the axes.  Convex in this strain if Q is positive definite, which is required.

    Args:
        modulus: c > 0 [stress].
        normal: b₁₁, b₂₂, b₃₃ > 0 [–].
        coupling: b₁₂, b₂₃, b₃₁ [–].
        shear: b₄, b₅, b₆ > 0, for the planes 12, 23 and 31 [–].
        bulk: Bulk modulus K > 0 [stress].
        axes: Directions of the first and second axis, at right angles; see `cutsim.materials.directions`.

    Raises:
        ValueError: A constant is outside its range, or Q is not positive definite.
    """

    modulus: Stress
    normal: tuple[float, float, float]
    coupling: tuple[float, float, float]
    shear: tuple[float, float, float]
    bulk: Stress
    axes: tuple[Direction, Direction] = _AXES

    def __post_init__(self) -> None:
        require_number("modulus", self.modulus, positive)
        require_number("bulk", self.bulk, positive)
        require_numbers("normal", self.normal, positive, 3)
        require_numbers("coupling", self.coupling, length=3)
        require_numbers("shear", self.shear, positive, 3)
        definite = np.linalg.eigvalsh(self._normal_matrix).min() > 0
        require("normal, coupling", (self.normal, self.coupling), definite, "a positive definite Q")
        require_axes(self.axes)

    @property
    def _normal_matrix(self) -> np.ndarray:
        (b11, b22, b33), (b12, b23, b31) = self.normal, self.coupling
        return np.array([[b11, b12, b31], [b12, b22, b23], [b31, b23, b33]])

    @property
    def _mean_shear(self) -> float:
        """Mean of the shear modulus over all directions (Voigt)."""
        B = self._normal_matrix
        return self.modulus * float((np.trace(B) - B.sum() / 3) / 10 + sum(self.shear) / 5)

    @property
    def young(self) -> float:
        """Young's modulus of the small-strain limit, averaged over directions by Voigt [stress]."""
        return engineering_constants(self._mean_shear, self.bulk)[0]

    @property
    def poisson(self) -> float:
        """Poisson's ratio of the small-strain limit, averaged over directions by Voigt [–]."""
        return engineering_constants(self._mean_shear, self.bulk)[1]

    def energy(self, F: Expr) -> tuple[Expr, Expr]:
        """Strain energy per reference volume, (fully integrated part, volumetric part)."""
        J, C = ufl.det(F), stretches_in(F, self.axes)
        E = [[0.5 * (J ** (-2 / 3) * C[i][j] - (i == j)) for j in range(3)] for i in range(3)]
        pairs = ((0, 1), (1, 2), (2, 0))
        exponent = sum(b * E[i][i] ** 2 for i, b in enumerate(self.normal))
        exponent += sum(2 * b * E[i][i] * E[j][j] for b, (i, j) in zip(self.coupling, pairs, strict=True))
        exponent += sum(4 * b * E[i][j] ** 2 for b, (i, j) in zip(self.shear, pairs, strict=True))
        return 0.5 * self.modulus * (ufl.exp(exponent) - 1), 0.5 * self.bulk * ufl.ln(J) ** 2
