"""Expressions in case files, such as ``"2*edge"`` or, in time, ``"min(t, 3)/2"``; no Python is run for them."""

import ast
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import Any

from simpleeval import SimpleEval

#: Functions that expressions may use.
FUNCTIONS: Mapping[str, Callable[..., Any]] = MappingProxyType(
    {
        name: getattr(math, name)
        for name in (
            "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "exp", "log", "log10", "sqrt",
            "hypot", "floor", "ceil", "degrees", "radians",
        )
    }
    | {"abs": abs, "min": min, "max": max}
)  # fmt: skip
#: Names with a fixed meaning: that of the circle's constant, and that of time.
CONSTANTS, TIME = MappingProxyType({"pi": math.pi}), "t"
#: Names that parameters may not have.
RESERVED = frozenset({*FUNCTIONS, *CONSTANTS, TIME})


class _Evaluator(SimpleEval):
    """simpleeval, with names that may have dots."""

    def __init__(self, names: Mapping[str, Any]) -> None:
        super().__init__(functions=dict(FUNCTIONS), names=dict(names))
        self.nodes[ast.Attribute] = lambda node: self.names[_dotted(node)]
        self.nodes[ast.Constant] = _constant


def _constant(node: ast.Constant) -> float:
    """A number; whole ones would grow without end."""
    if isinstance(node.value, bool) or not isinstance(node.value, int | float):
        raise ValueError(f"{node.value!r} is no number")
    return float(node.value)


def _dotted(node: ast.expr) -> str:
    """Name of an attribute of an attribute … of a name; empty for anything else."""
    if isinstance(node, ast.Name):
        return node.id
    inner = _dotted(node.value) if isinstance(node, ast.Attribute) else ""
    return f"{inner}.{node.attr}" if inner else ""  # type: ignore[attr-defined]


@lru_cache(maxsize=1024)
def _parsed(text: str) -> ast.expr:
    return SimpleEval.parse(text)


def names_in(text: str) -> frozenset[str]:
    """Names, with their dots, of the values that an expression depends on.

    Raises:
        ValueError: It is no expression.
    """
    try:
        tree = _parsed(text)
    except Exception as error:  # what a parser makes of an arbitrary text
        raise ValueError(f"no expression ({_reason(error)})") from None
    found: set[str] = set()
    _collect(tree, found)
    return frozenset(found - {"", *FUNCTIONS, *CONSTANTS})


def _collect(node: ast.AST, found: set[str]) -> None:
    if isinstance(node, ast.Name | ast.Attribute):
        found.add(_dotted(node))
        return
    for child in ast.iter_child_nodes(node):
        _collect(child, found)


def _reason(error: Exception) -> str:
    return str(error).split("\n")[0].split(" (<", 1)[0] or type(error).__name__


def evaluate(text: str, names: Mapping[str, float]) -> float:
    """Value of an expression.

    Args:
        text: The expression.
        names: Values of the names in it, beside functions and constants.

    Raises:
        ValueError: It is no expression, uses what is not allowed, or its value is no finite number.
    """
    try:
        value = _Evaluator({**CONSTANTS, **names}).eval(text, previously_parsed=_parsed(text))
    except Exception as error:  # functions of math raise what they like
        raise ValueError(f"cannot be evaluated ({_reason(error)})") from None
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError(f"evaluates to {value!r}, which is no finite number")
    return float(value)


@dataclass(frozen=True)
class TimeExpression:
    """Function of time that an expression gives.

    Args:
        text: The expression, in which t is the time.
        names: Values of the other names in it: numbers, or functions of time themselves.
    """

    text: str
    names: tuple[tuple[str, "float | TimeExpression | TimeTable"], ...] = ()

    def __call__(self, time: float) -> float:
        """Value at a time.

        Raises:
            ValueError: It is no finite number.
        """
        names = {name: value(time) if callable(value) else value for name, value in self.names}
        try:
            return evaluate(self.text, names | {TIME: float(time)})
        except ValueError as error:
            raise ValueError(f"{self.text!r} {error} at t = {time:g}") from None


@dataclass(frozen=True)
class RowExpression:
    """Function of the columns of a step that an expression gives.

    Args:
        text: The expression, in which names are those of columns.
        names: Values of the other names in it.
    """

    text: str
    names: tuple[tuple[str, float], ...] = ()

    def __call__(self, row: Mapping[str, float]) -> float:
        """Value in a step; nan where it is no finite number, such as a ratio of zeros.

        Args:
            row: Columns of the step.

        Raises:
            ValueError: It has a name that is no column.
        """
        known = {**row, **dict(self.names)}
        for name in sorted(names_in(self.text)):
            if name not in known:
                columns = ", ".join(row)
                raise ValueError(f"{name!r} is neither a number of this file nor one of the columns {columns}")
        try:
            return evaluate(self.text, known)
        except ValueError:
            return math.nan


@dataclass(frozen=True)
class TimeTable:
    """Function of time that a table gives: straight between its points, constant before the first and after the last.

    Args:
        times: Increasing times [time].
        values: The value at each.
    """

    times: tuple[float, ...]
    values: tuple[float, ...]

    def __call__(self, time: float) -> float:
        """Value at a time."""
        if time <= self.times[0]:
            return self.values[0]
        for (a, start), (b, end) in zip(self._points, self._points[1:], strict=False):
            if time <= b:
                return start + (end - start) * (time - a) / (b - a)
        return self.values[-1]

    @property
    def _points(self) -> tuple[tuple[float, float], ...]:
        return tuple(zip(self.times, self.values, strict=True))


#: What varies in time in a case file.
TimeValue = float | TimeExpression | TimeTable


def corners_of(value: TimeValue) -> tuple[float, ...]:
    """Times at which a value may jump or have a kink, as far as it is known: those of its tables."""
    if isinstance(value, TimeTable):
        return value.times
    names = value.names if isinstance(value, TimeExpression) else ()
    return tuple(sorted({corner for _, part in names for corner in corners_of(part)}))
