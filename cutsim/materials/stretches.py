"""Sums of powers of the principal stretches in pure UFL, smooth where stretches coincide.

Closed formulas for eigenvalues have no derivative where two of them coincide, as in the reference state and in uniaxial
tension, and lose all digits nearby.  A sum over all three is smooth.  Here it is written so that its derivatives are:
as a series in the invariants of the deviator where all three are close, and otherwise from the eigenvalue that stands
apart, of which the other two are an even function of their half difference.
"""

from collections.abc import Sequence

import ufl

from cutsim.base.kinematics import Expr, right_cauchy_green

#: The series are taken where exponent² × (relative distance of the eigenvalues)² is below this.
NEAR = 3e-6


def stretch_power_sums(F: Expr, exponents: Sequence[Expr]) -> list[Expr]:
    """Sums λ₁ᵐ + λ₂ᵐ + λ₃ᵐ of the principal stretches λᵢ, the singular values of F.

    Values and first derivatives are accurate to 10⁻¹¹, second derivatives to 10⁻⁹ of their size for any stretches,
    coinciding or not (held to that by `tests/test_materials_closed_forms.py` for −6 ≤ m ≤ 26).

    Args:
        F: Deformation gradient, 3 × 3.
        exponents: Real numbers or constants m, one for each sum.
    """
    C = right_cauchy_green(F)
    mean = ufl.tr(C) / 3
    B = C - mean * ufl.Identity(3)
    J2, J3 = 0.5 * ufl.inner(B, B), ufl.det(B)
    a, b = J2 / mean**2, J3 / mean**3
    # the eigenvalue that stands apart, mean + 2 s r t, and the square of the half difference of the other two
    r = ufl.sqrt(J2 / 3)
    side = ufl.conditional(ufl.gt(J3, 0), 1.0, -1.0)
    t = _third_of_angle(side * J3 / (2 * r**3))
    apart, square = side * r * t, J2 * (1 - t**2)
    single, centre = mean + 2 * apart, mean - apart
    ratio, root = square / centre**2, ufl.sqrt(square)

    def power_sum(m: Expr) -> Expr:
        p = 0.5 * m
        limit = NEAR / (1 + p**2)
        near = 2 * centre**p * (1 + ratio * (_binomial(p, 2) + _binomial(p, 4) * ratio))
        pair = ufl.conditional(ufl.lt(ratio, limit), near, (centre + root) ** p + (centre - root) ** p)
        return ufl.conditional(ufl.lt(a, limit), mean**p * _series(a, b, p), single**p + pair)

    return [power_sum(m) for m in exponents]


def _series(a: Expr, b: Expr, p: Expr) -> Expr:
    """Σ (1 + βᵢ)ᵖ for roots of β³ − aβ − b = 0 to the fifth power; Σ βᵢᵏ by Newton's identities."""
    c2, c3, c4, c5 = (_binomial(p, k) for k in (2, 3, 4, 5))
    return 3 + a * (2 * c2 + 2 * c4 * a) + b * (3 * c3 + 5 * c5 * a)


def _third_of_angle(y: Expr) -> Expr:
    """cos(⅓ arccos y) for 0 ≤ y ≤ 1, smooth at 1: the root of 4t³ − 3t = y next to 1.

    One step of Halley's method from a polynomial that is right to 5·10⁻⁶; its error is below rounding.
    """
    t = 0.86603043 + y * (0.16641172 + y * (-0.04592193 + y * (0.01751219 - y * 0.0040354)))
    value, slope = t * (4 * t**2 - 3) - y, 12 * t**2 - 3
    return t - value * slope / (slope**2 - 12 * t * value)


def _binomial(p: Expr, k: int) -> Expr:
    """Binomial coefficient of a real number over an integer."""
    return p * _binomial(p - 1, k - 1) / k if k else 1.0
