"""Values that are read from the files of a run by expressions such as ``"max(force)"``; no Python is run for them."""

from collections.abc import Callable, Mapping
from functools import partial
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray
from simpleeval import SimpleEval

from cutsim.base.arrays import Array
from cutsim.results.run_files import RunFiles


class ReadingError(ValueError):
    """Raised where a value cannot be read from a run."""


def read_value(expression: str, files: RunFiles) -> float:
    """Value of an expression of a run.

    Its names are columns of the history, with one number for each step, and numbers of the summary.  Beside the usual
    operators it may use:

    - ``summary('a', 'b', 0)``: a number that is deeper in the summary;
    - ``max(y)``, ``min(y)``, ``first(y)``, ``last(y)``, ``sum(y)``;
    - ``at(x, a, y)``: y where x first reaches a;
    - ``mean(x, a, b, y)``: mean of y while x goes from a to b;
    - ``slope(x, a, b, y)``: of the straight line that fits y best there;
    - ``work(x, y)``: ∫ y dx over the whole run;
    - ``sqrt``, ``abs``, ``log``, ``exp``, ``sin``, ``cos``, ``tan`` and ``pi``.

    Args:
        expression: The expression.
        files: Files of the run.

    Raises:
        ReadingError: It is no expression, names what the run has not, or its value is no finite number.
    """
    numbers = {name: float(value) for name, value in files.summary.items() if _is_number(value)}
    names = {"pi": np.pi, **numbers, **{name: column.values for name, column in files.history.items()}}
    functions = {**FUNCTIONS, "summary": partial(_entry, files.summary)}
    try:
        value = SimpleEval(functions=functions, names=names).eval(expression)
    except Exception as error:  # functions of numpy raise what they like
        raise ReadingError(f"{expression!r} cannot be evaluated: {error}") from None
    if np.ndim(value):
        raise ReadingError(f"{expression!r} is a number for each step, and not one")
    if not isfinite(value):
        raise ReadingError(f"{expression!r} is {value}, and not finite")
    return float(value)


def _entry(summary: Any, *keys: str | float) -> float:
    """A number of the summary, by the names of tables and the places in lists that lead to it."""
    for key in keys:
        summary = summary[int(key) if isinstance(summary, list) else str(key)]
    if not _is_number(summary):
        raise ValueError(f"summary{keys} is no number")
    return float(summary)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _at(x: Array, a: float, y: Array) -> float:
    """The value of y where x first reaches a, between steps along a straight line."""
    beyond = np.flatnonzero((x[:-1] - a) * (x[1:] - a) <= 0)
    if not len(beyond):
        raise ValueError(f"{a:g} is never reached: values go from {x.min():g} to {x.max():g}")
    i = beyond[0]
    share = 0.0 if x[i + 1] == x[i] else (a - x[i]) / (x[i + 1] - x[i])
    return float(y[i] + share * (y[i + 1] - y[i]))


def _within(x: Array, a: float, b: float) -> NDArray[np.bool_]:
    """Steps at which x lies between a and b."""
    inside = (x >= min(a, b)) & (x <= max(a, b))
    if np.count_nonzero(inside) < 2:
        raise ValueError(f"fewer than two steps lie between {a:g} and {b:g}")
    return inside


def _mean(x: Array, a: float, b: float, y: Array) -> float:
    i = _within(x, a, b)
    return float(np.trapezoid(y[i], x[i]) / (x[i][-1] - x[i][0]))


def _slope(x: Array, a: float, b: float, y: Array) -> float:
    i = _within(x, a, b)
    return float(np.polyfit(x[i], y[i], 1)[0])


#: Functions of an expression.
FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    "max": np.max, "min": np.min, "sum": np.sum, "first": lambda y: y[0], "last": lambda y: y[-1],
    "at": _at, "mean": _mean, "slope": _slope, "work": lambda x, y: np.trapezoid(y, x),
    "sqrt": np.sqrt, "abs": np.abs, "log": np.log, "exp": np.exp, "sin": np.sin, "cos": np.cos, "tan": np.tan,
}  # fmt: skip
