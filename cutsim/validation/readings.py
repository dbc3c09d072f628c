"""Values that are read from the files of a run by expressions such as ``"max(force)"``; no Python is run for them."""

import re
from collections.abc import Callable, Iterator, Mapping
from math import isfinite
from typing import Any

import numpy as np
from simpleeval import SimpleEval

from cutsim.base.arrays import Array
from cutsim.results.run_files import RunFiles


class ReadingError(ValueError):
    """Raised where a value cannot be read from a run."""


def read_value(expression: str, files: RunFiles) -> float:
    """Value of an expression of a run.

    Its names are columns of the history, with one number for each step, and numbers of the summary: that of a table
    within is ``table_name``, where all but letters and digits are underscores, that in a list ``list_0``.  Beside the
    usual operators it may use:

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
    names = dict(_numbers("", files.summary)) | {name: column.values for name, column in files.history.items()}
    try:
        value = SimpleEval(functions=dict(FUNCTIONS), names={"pi": np.pi, **names}).eval(expression)
    except Exception as error:  # functions of numpy raise what they like
        raise ReadingError(f"{expression!r} cannot be evaluated: {error}") from None
    if np.ndim(value) or not isfinite(value):
        raise ReadingError(f"{expression!r} is {value!r}, and not one finite number")
    return float(value)


def _numbers(name: str, entry: Any) -> Iterator[tuple[str, float]]:
    """Numbers of a summary, with the names of the tables and the places in the lists that they are in before them."""
    if isinstance(entry, Mapping):
        for key, inner in entry.items():
            own = re.sub(r"\W", "_", key)
            yield from _numbers(f"{name}_{own}" if name else own, inner)
    elif isinstance(entry, list):
        for place, inner in enumerate(entry):
            yield from _numbers(f"{name}_{place}", inner)
    elif isinstance(entry, int | float) and not isinstance(entry, bool):
        yield name, float(entry)


def _at(x: Array, a: float, y: Array) -> float:
    """The value of y where x first reaches a, between steps along a straight line."""
    beyond = np.flatnonzero((x[:-1] - a) * (x[1:] - a) <= 0)
    if not len(beyond):
        raise ValueError(f"{a:g} is never reached: values go from {x.min():g} to {x.max():g}")
    i = beyond[0]
    share = 0.0 if x[i + 1] == x[i] else (a - x[i]) / (x[i + 1] - x[i])
    return float(y[i] + share * (y[i + 1] - y[i]))


def _within(x: Array, a: float, b: float) -> Array:
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
