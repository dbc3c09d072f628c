"""Least squares: parameters of a model, their confidence intervals, and the goodness of fit."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import comb

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import optimize, stats

from cutsim.base.checks import as_numbers, between, finite, require, require_number

logger = logging.getLogger(__name__)
#: Chance of the runs of the residuals below which they are taken for systematic.
_UNLIKELY = 0.01
#: Residuals, relative to the data, that are no noise but rounding and tolerances.
_ROUNDING = 1e-6
#: Values of parameters by name.
Parameters = dict[str, float]
Bounds = Mapping[str, tuple[float, float]]


@dataclass(frozen=True)
class Fit:
    """Parameters with the smallest sum of squares.

    Attributes:
        values: Parameter -> value.
        covariance: Covariance matrix of the parameters, in the same order.
        measured: What was measured, as weighted.
        residuals: Model less measurement, as weighted.
    """

    values: Parameters
    covariance: NDArray[np.float64]
    measured: NDArray[np.float64]
    residuals: NDArray[np.float64]

    @property
    def sse(self) -> float:
        """Sum of squared errors."""
        return float(self.residuals @ self.residuals)

    @property
    def rmse(self) -> float:
        """Root of the mean squared error."""
        return float(np.sqrt(self.sse / len(self.residuals)))

    @property
    def r_squared(self) -> float:
        """Coefficient of determination R² = 1 − SSE/SST, with SST about the mean of what was measured."""
        return 1 - self.sse / float(np.sum((self.measured - self.measured.mean()) ** 2))

    @property
    def adjusted_r_squared(self) -> float:
        """R² corrected for the number p of parameters, 1 − (1 − R²)(n − 1)/(n − p)."""
        return 1 - (1 - self.r_squared) * (len(self.residuals) - 1) / self._freedom

    @property
    def chance(self) -> float:
        """Probability that independent noise has no more runs of one sign than the residuals (Wald and Wolfowitz 1940).

        If it is small the residuals are systematic: the model is wrong, and the intervals are not to be believed.
        """
        above = self.residuals > 0
        n, m = int(above.sum()), int((~above).sum())
        if min(n, m) == 0:
            return 2.0 ** (1 - len(above))
        runs = 1 + int(np.count_nonzero(np.diff(above)))
        # r runs: the values above cut in k pieces and those below in as many, or one more of either
        ways = sum(
            comb(n - 1, (r - 1) // 2) * comb(m - 1, r // 2 - 1) + comb(n - 1, r // 2 - 1) * comb(m - 1, (r - 1) // 2)
            for r in range(2, runs + 1)
        )
        return ways / comb(n + m, n)

    @property
    def systematic(self) -> bool:
        """Whether the residuals are no noise: more than rounding, and of a chance below one per cent."""
        size = float(np.sqrt(np.mean(self.measured**2)))
        return self.rmse > _ROUNDING * size and self.chance < _UNLIKELY

    @property
    def _freedom(self) -> int:
        return len(self.residuals) - len(self.values)

    def intervals(self, confidence: float = 0.95) -> dict[str, tuple[float, float]]:
        """Confidence interval of each parameter by itself, from the model linearised at the fit.

        Args:
            confidence: Probability, in (0, 1).

        Raises:
            ValueError: The probability is outside its range.
        """
        require_number("confidence", confidence, between(0, 1))
        half = stats.t.ppf(0.5 + 0.5 * confidence, self._freedom) * np.sqrt(np.diag(self.covariance))
        return {n: (float(v - h), float(v + h)) for (n, v), h in zip(self.values.items(), half, strict=True)}

    def __str__(self) -> str:
        rows = [
            f"{name} = {self.values[name]:.6g}  (95 %: {low:.6g} … {high:.6g})"
            for name, (low, high) in self.intervals().items()
        ]
        quality = f"SSE {self.sse:.4g}, R² {self.r_squared:.5f}, adjusted {self.adjusted_r_squared:.5f}"
        doubt = ["the residuals are systematic: the intervals are not to be believed"] if self.systematic else []
        return "\n".join([*rows, f"{quality}, RMSE {self.rmse:.4g}", *doubt])


def fit_model(
    model: Callable[[Parameters], NDArray[np.float64]],
    guess: Parameters,
    measured: ArrayLike,
    *,
    weights: ArrayLike = 1.0,
    bounds: Bounds | None = None,
) -> Fit:
    """Fit the parameters of a smooth model by least squares (trust region, central differences).

    Args:
        model: Parameters -> what would be measured.
        guess: First guess of each parameter, none zero: it also sets the scale.
        measured: What was measured, more numbers than parameters.
        weights: Factors on the residuals, such as one over the standard deviation.
        bounds: Parameter -> lower and upper bound.

    Raises:
        ValueError: There are too few data, a guess is zero or not inside its bounds, or the data do not determine a
            parameter, which the message names.
    """
    measured, weights = np.asarray(measured, dtype=np.float64), np.asarray(weights, dtype=np.float64)
    require_problem(guess, len(measured), bounds)

    def residuals(x: NDArray[np.float64]) -> NDArray[np.float64]:
        return weights * (model(dict(zip(guess, x, strict=True))) - measured)

    x0 = np.array(list(guess.values()))
    limits = limits_of(guess, bounds)
    # tolerances near rounding: noise in a flat valley must not decide where the search ends
    found = optimize.least_squares(
        residuals, x0, jac="3-point", x_scale=np.abs(x0), bounds=limits, xtol=1e-12, ftol=1e-12, gtol=1e-12,
        max_nfev=1000,
    )  # fmt: skip
    if not found.success:
        logger.warning("the fit has not converged: %s", found.message)
    return finished(guess, found.x, found.jac, weights * measured, found.fun, limits)


def require_problem(guess: Parameters, count: int, bounds: Bounds | None) -> None:
    """Refuse a problem of least squares that makes no sense.

    Args:
        guess: First guess of each parameter.
        count: How many numbers were measured.
        bounds: Parameter -> lower and upper bound.

    Raises:
        ValueError: There are too few data, a guess is zero or not inside its bounds, or a bound is of no parameter.
    """
    require("number of measured values", count, count > len(guess) > 0, f"more than the {len(guess)} parameters, >= 1")
    for name, value in guess.items():
        low, high = (bounds or {}).get(name, (-np.inf, np.inf))
        require_number(f"guess of {name}", value, finite)
        require(f"guess of {name}", value, bool(value) and low <= value <= high, f"not zero, in [{low}, {high}]")
    for name in bounds or {}:
        require("bounds", name, name in guess, "of one of " + ", ".join(guess))


def require_pairs(first: str, x: ArrayLike, second: str, y: ArrayLike) -> None:
    """Refuse a curve that is not as many finite numbers twice.

    Args:
        first: Name of the abscissae.
        x: Abscissae.
        second: Name of the ordinates.
        y: Ordinates.

    Raises:
        ValueError: They are not one-dimensional, not of one length, or not finite.
    """
    for name, values in ((first, x), (second, y)):
        as_numbers(name, values)
    shape = np.shape(x)
    require(f"shape of {first}", shape, len(shape) == 1 and shape[0] > 0, "one-dimensional, of at least one number")
    require(f"shape of {second}", np.shape(y), np.shape(y) == shape, f"{shape}, one number for each {first}")
    for name, values in ((first, x), (second, y)):
        bad = np.flatnonzero(~np.isfinite(values))
        require(f"indices of {name} that are not finite", bad.tolist(), len(bad) == 0, "none")


def limits_of(guess: Parameters, bounds: Bounds | None) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lower and upper bounds of all parameters, in their order."""
    pairs = np.array([(bounds or {}).get(name, (-np.inf, np.inf)) for name in guess], dtype=np.float64)
    return pairs[:, 0], pairs[:, 1]


def finished(
    guess: Parameters,
    x: NDArray[np.float64],
    jacobian: NDArray[np.float64],
    measured: NDArray[np.float64],
    residuals: NDArray[np.float64],
    limits: tuple[NDArray[np.float64], NDArray[np.float64]],
) -> Fit:
    """The fit with its covariance s² (JᵀJ)⁻¹, s² = SSE/(n − p).

    Args:
        guess: Parameters, by whose size the columns of the Jacobian are scaled.
        x: Their fitted values.
        jacobian: Derivatives of the residuals.
        measured: What was measured, as weighted.
        residuals: Residuals at the fit.
        limits: Lower and upper bounds; a parameter that meets one is reported.

    Raises:
        ValueError: The data do not determine a parameter, which the message names.
    """
    names, scale = list(guess), np.abs(np.array(list(guess.values())))
    _, singular, rows = np.linalg.svd(jacobian * scale, full_matrices=False)
    blind = names[int(np.abs(rows[-1]).argmax())]
    known = singular[-1] > 1e-9 * singular[0]
    require("parameter", blind, bool(known), "such that the data depend on it, and not only together with others")
    for name, value, size, low, high in zip(names, x, scale, *limits, strict=True):
        if min(value - low, high - value) < 1e-3 * size:
            logger.warning("%s = %g has met its bound: no interval is right", name, value)
    variance = residuals @ residuals / (len(residuals) - len(names))
    half = (rows.T / singular) * scale[:, None]
    values = {name: float(value) for name, value in zip(names, x, strict=True)}
    fit = Fit(values, variance * half @ half.T, measured, residuals)
    if fit.systematic:
        logger.warning(
            "residuals are systematic (by chance once in %.0f times): the model or a zero of the data is wrong, and no "
            "interval is to be believed",
            1 / fit.chance,
        )
    return fit
