"""Indentation with a flat punch, and Poisson's ratio from pairs of lines (docs/identification.md)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cutsim.base.checks import between, positive, require, require_number
from cutsim.identify.fitting import Fit, fit_model, require_pairs

#: Points on the radius, points of the transform, and where its integrand has decayed to rounding.
_NODES, _POINTS, _END = 48, 400, 30.0


def poisson_ratio(pairs: Sequence[tuple[ArrayLike, ArrayLike]]) -> tuple[float, float]:
    """Poisson's ratio of a bar in tension from strains between pairs of lines on its surface (thesis 3.1).

    The mean over the pairs of the slope −dε_x/dε_y.  The thesis takes the mean of the ratios of increments; here each
    slope is that of the regression line, since a ratio of small increments is mostly noise.

    Args:
        pairs: For each pair of lines the engineering strains along the bar, ε_y, and across it, ε_x.

    Returns:
        The ratio and the standard error of the mean over the pairs (zero for one pair).

    Raises:
        ValueError: There is no pair, or the strains of a pair are not as many, or the strain along the bar is constant.
    """
    require("pairs", len(pairs), len(pairs) > 0, "at least one pair of lines")
    slopes = []
    for along, across in pairs:
        y, x = np.asarray(along, dtype=np.float64), np.asarray(across, dtype=np.float64)
        require_pairs("strain along", y, "strain across", x)
        require("range of strain along", np.ptp(y), bool(np.ptp(y) > 0), "> 0")
        slopes.append(-np.polyfit(y, x, 1)[0])
    spread = np.std(slopes, ddof=1) / np.sqrt(len(slopes)) if len(slopes) > 1 else 0.0
    return float(np.mean(slopes)), float(spread)


def punch_force(
    depth: ArrayLike, shear: float, radius: float, poisson: float, thickness: float = np.inf, *, bonded: bool = True
) -> NDArray[np.float64]:
    """Force on a flat-ended, frictionless, rigid cylinder, P = 4 G a d κ/(1−ν) (Sneddon 1965, thesis 3.2).

    κ is the factor of a layer on a rigid base (`layer_factor`).

    Args:
        depth: Depth d of indentation [length].
        shear: Shear modulus G [stress].
        radius: Radius a of the punch > 0 [length].
        poisson: Poisson's ratio, −1 < ν ≤ ½ [–].
        thickness: Thickness h > 0 of the layer [length]; a half space by default.
        bonded: Whether the layer is bonded to its base; else it slides on it without friction.

    Raises:
        ValueError: A number is outside its range.
    """
    require_number("radius", radius, positive)
    require_number("thickness", thickness, positive.or_inf)
    factor = layer_factor(radius / thickness, poisson, bonded=bonded)
    return 4 * shear * radius * factor / (1 - poisson) * np.asarray(depth)


def fit_shear_modulus(
    depth: ArrayLike,
    force: ArrayLike,
    radius: float,
    poisson: float,
    thickness: float = np.inf,
    *,
    bonded: bool = True,
) -> Fit:
    """Shear modulus from the force on a flat-ended cylinder against its depth.

    A straight line is fitted; its intercept is where the punch first touched, which a testing machine does not know.

    Args:
        depth: Depth of indentation, from any origin [length].
        force: Force on the punch [force].
        radius: Radius a of the punch > 0 [length].
        poisson: Poisson's ratio, −1 < ν ≤ ½ [–].
        thickness: Thickness h > 0 of the layer [length]; a half space by default.
        bonded: Whether the layer is bonded to its base; else it slides on it without friction.

    Returns:
        Fit of ``shear`` [stress] and ``offset``, the force at depth zero [force].

    Raises:
        ValueError: A number is outside its range, or there are fewer than three data.
    """
    d, P = np.asarray(depth, dtype=np.float64), np.asarray(force, dtype=np.float64)
    require_pairs("depth", d, "force", P)
    unit = punch_force(d, 1.0, radius, poisson, thickness, bonded=bonded)
    guess = {"shear": float(np.ptp(P) / np.ptp(unit)), "offset": float(np.abs(P).max())}
    return fit_model(lambda values: values["shear"] * unit + values["offset"], guess, P)


def layer_factor(aspect: float, poisson: float, *, bonded: bool = True) -> float:
    """Factor κ by which a layer on a rigid base is stiffer than a half space, under a flat-ended cylinder.

    κ = ∫₀¹ φ dx, where φ solves Fredholm's equation of the second kind (Hayes, Keer, Herrmann and Mockros 1972;
    Lebedev and Ufliand 1958), here by Gauss's quadrature,

    φ(x) − (a/h)/π ∫₀¹ φ(y) [K(x+y) + K(x−y)] dy = 1,  K(u) = ∫₀^∞ M(ξ) cos(ξ u a/h) dξ,
    M = 1 − [2k sinh 2ξ − 4ξ]/[2k cosh 2ξ + 4ξ² + 1 + k²],  k = 3 − 4ν,  of a layer bonded to the base,
    M = 1 − [cosh 2ξ − 1]/[sinh 2ξ + 2ξ],  whatever ν,  of one that slides on it without friction.

    Args:
        aspect: Radius of the punch over thickness of the layer, a/h, in [0, 10].
        poisson: Poisson's ratio, −1 < ν ≤ ½.
        bonded: Whether the layer is bonded to its base; else it slides on it without friction.

    Raises:
        ValueError: A number is outside its range.
    """
    require_number("aspect", aspect, between(0, 10, "[]"))
    require_number("poisson", poisson, between(-1, 0.5, "(]"))
    return _layer_factor(aspect, poisson if bonded else None, *_gauss(_NODES, 1.0))


def _layer_factor(aspect: float, poisson: float | None, x: NDArray[np.float64], weights: NDArray[np.float64]) -> float:
    """The factor with a quadrature rule on [0, 1]; without Poisson's ratio, of a layer that slides on its base."""
    xi, measure = _gauss(_POINTS, _END)
    if poisson is None:
        M = 1 - (np.cosh(2 * xi) - 1) / (np.sinh(2 * xi) + 2 * xi)
    else:
        k = 3 - 4 * poisson
        M = 1 - (2 * k * np.sinh(2 * xi) - 4 * xi) / (2 * k * np.cosh(2 * xi) + 4 * xi**2 + 1 + k**2)
    # cos(x+y) + cos(x−y) = 2 cos x cos y
    waves = np.cos(aspect * np.outer(x, xi))
    kernel = 2 * aspect / np.pi * (waves * (M * measure)) @ waves.T
    return float(weights @ np.linalg.solve(np.eye(len(x)) - kernel * weights, np.ones(len(x))))


def _gauss(count: int, end: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points and weights of Gauss's rule on [0, end]."""
    points, weights = np.polynomial.legendre.leggauss(count)
    return 0.5 * end * (points + 1), 0.5 * end * weights
