"""Sums of powers of the principal stretches, smooth where stretches coincide, in pure UFL.

Closed formulas for eigenvalues have no derivative where two of them coincide, as in the reference state and in uniaxial
tension, and lose all digits nearby.  A sum over all three is smooth.  Here it is written so that its derivatives are:
as a series in the invariants of the deviator where all three are close, and otherwise from the eigenvalue that stands
apart, of which the other two are an even function of their half difference.
"""

import ufl

from cutsim.kinematics import Expr, right_cauchy_green

#: The series are taken where exponent² × (relative distance of the eigenvalues)² is below this.
NEAR = 3e-6


def stretch_power_sum(F: Expr, exponent: Expr) -> Expr:
    """Σᵢ λᵢᵐ of the principal stretches λᵢ, the singular values of F.

    Value, first and second derivative are accurate to about 10⁻¹¹ of their size for any stretches, coinciding or not
    (measured in `tests/test_stretches.py` for |m| ≤ 30).

    Args:
        F: Deformation gradient, 3 × 3.
        exponent: Any real m, a number or a constant.
    """
    C = right_cauchy_green(F)
    mean = ufl.tr(C) / 3
    B = C - mean * ufl.Identity(3)
    J2, J3 = 0.5 * ufl.inner(B, B), ufl.det(B)
    p = 0.5 * exponent
    close = ufl.lt((1 + p**2) * J2, NEAR * mean**2)
    return ufl.conditional(close, _close(mean, J2, J3, p), _apart(mean, J2, J3, p))


def _close(q: Expr, J2: Expr, J3: Expr, p: Expr) -> Expr:
    """Σ (q + βᵢ)ᵖ as a binomial series to the fifth power, its Σ βᵢᵏ by Newton's identities."""
    a, b = J2 / q**2, J3 / q**3
    c2, c3, c4, c5 = (_binomial(p, k) for k in (2, 3, 4, 5))
    return q**p * (3 + a * (2 * c2 + 2 * c4 * a) + b * (3 * c3 + 5 * c5 * a))


def _apart(q: Expr, J2: Expr, J3: Expr, p: Expr) -> Expr:
    """The eigenvalue farthest from the mean, β = 2 a s t, apart from the other two."""
    a = ufl.sqrt(J2 / 3)
    side = ufl.conditional(ufl.gt(J3, 0), 1.0, -1.0)
    t = _third_of_angle(side * J3 / (2 * a**3))
    single = 2 * side * a * t
    return (q + single) ** p + _pair(q - 0.5 * single, J2 * (1 - t**2), p)


def _third_of_angle(y: Expr) -> Expr:
    """cos(⅓ arccos y) for 0 ≤ y ≤ 1, smooth at 1: the root of 4t³ − 3t = y next to 1.

    One step of Halley's method from a polynomial that is right to 5·10⁻⁶; its error is below rounding.
    """
    t = 0.86603043 + y * (0.16641172 + y * (-0.04592193 + y * (0.01751219 - y * 0.0040354)))
    value, slope = t * (4 * t**2 - 3) - y, 12 * t**2 - 3
    return t - value * slope / (slope**2 - 12 * t * value)


def _pair(centre: Expr, square: Expr, p: Expr) -> Expr:
    """(c + √d)ᵖ + (c − √d)ᵖ, also where d vanishes."""
    ratio, root = square / centre**2, ufl.sqrt(square)
    series = 2 * centre**p * (1 + ratio * (_binomial(p, 2) + _binomial(p, 4) * ratio))
    near = ufl.lt((1 + p**2) * ratio, NEAR)
    return ufl.conditional(near, series, (centre + root) ** p + (centre - root) ** p)


def _binomial(p: Expr, k: int) -> Expr:
    """Binomial coefficient of a real number over an integer."""
    return p * _binomial(p - 1, k - 1) / k if k else 1.0
