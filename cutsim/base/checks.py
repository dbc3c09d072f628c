"""Checks of input: an error names the parameter, its value and what is allowed.

What is allowed of a number is an object that knows its own words, so that a number is compared only once it is known to
be one: `require_number("young", young, positive)`.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import inf, isfinite
from numbers import Integral, Real
from typing import Any

import numpy as np
from numpy.typing import NDArray


class Refused(ValueError):
    """Raised for a parameter that is not allowed.

    Args:
        name: Name of the parameter as the user wrote it.
        value: Its value.
        allowed: What is admissible, in words that complete "must be …".
    """

    def __init__(self, name: str, value: Any, allowed: str) -> None:
        super().__init__(f"{name} = {value!r} is not allowed: it must be {allowed}")
        self.name, self.value, self.allowed = name, value, allowed

    def __reduce__(self) -> tuple[type["Refused"], tuple[str, Any, str]]:
        return type(self), (self.name, self.value, self.allowed)


def require(name: str, value: Any, valid: bool, allowed: str) -> None:
    """Refuse a parameter.

    Args:
        name: Name of the parameter as the user wrote it.
        value: Its value.
        valid: Whether the value is admissible; the same on all ranks.
        allowed: What is admissible, in words that complete "must be …".

    Raises:
        Refused: A ValueError; ``valid`` is false.
    """
    if not valid:
        raise Refused(name, value, allowed)


def place(x: Iterable[float]) -> str:
    """A position in words."""
    return "({})".format(", ".join(f"{round(float(c), 12) + 0.0:.4g}" for c in x))


@dataclass(frozen=True)
class Interval:
    """Interval of allowed numbers, which are finite unless the interval says otherwise.

    Args:
        words: What they are, in words that complete "a finite number …".
        low: Lower end.
        high: Upper end.
        ends: Which ends belong to it, such as ``"[)"``.
        whole: Whether only whole numbers do.
        infinite: Whether infinity does, as "without limit".
        optional: Whether None does.
    """

    words: str
    low: float = -inf
    high: float = inf
    ends: str = "()"
    whole: bool = False
    infinite: bool = False
    optional: bool = False

    @property
    def or_none(self) -> "Interval":
        """The same, or None."""
        return replace(self, optional=True)

    @property
    def or_inf(self) -> "Interval":
        """The same, or positive infinity."""
        return replace(self, infinite=True)

    def __contains__(self, value: Any) -> bool:
        if value is None:
            return self.optional
        if isinstance(value, bool) or not isinstance(value, Integral if self.whole else Real):
            return False
        number = float(value)
        if not isfinite(number):
            return self.infinite and number == inf
        above = number > self.low or (self.ends[0] == "[" and number == self.low)
        return above and (number < self.high or (self.ends[1] == "]" and number == self.high))

    def __str__(self) -> str:
        kind = "a whole number" if self.whole else "a number" if self.infinite else "a finite number"
        return " ".join(filter(None, [kind, self.words])) + " or inf" * self.infinite + " or None" * self.optional


finite = Interval("")
positive = Interval("> 0", 0)
nonnegative = Interval(">= 0", 0, ends="[)")


def above(low: float, name: str = "") -> Interval:
    """Numbers above one, which may be another parameter."""
    return Interval(f"> {_named(low, name)}", low)


def at_least(low: float, name: str = "") -> Interval:
    """A number, which may be another parameter, and those above it."""
    return Interval(f">= {_named(low, name)}", low, ends="[)")


def between(low: float, high: float, ends: str = "()", *, name: str = "") -> Interval:
    """Numbers between two.

    Args:
        low: Lower end.
        high: Upper end.
        ends: Which ends belong to them, such as ``"(]"``.
        name: What the upper end is, if it is another parameter.
    """
    return Interval(f"in {ends[0]}{low:.6g}, {_named(high, name)}{ends[1]}", low, high, ends)


def count(least: int = 0) -> Interval:
    """Whole numbers from one on."""
    return Interval(f">= {least}", least, ends="[)", whole=True)


def _named(value: float, name: str) -> str:
    return f"{name} = {value:.6g}" if name else f"{value:.6g}"


def require_number(name: str, value: Any, allowed: Interval) -> None:
    """Refuse what is not a number of an interval.

    Args:
        name: Name of the parameter as the user wrote it.
        value: Its value, the same on all ranks.
        allowed: Numbers that are allowed.

    Raises:
        ValueError: It is no number, not finite, or outside the interval.
    """
    require(name, value, value in allowed, str(allowed))


def require_numbers(
    name: str, values: Any, allowed: Interval = finite, length: int | None = None, *, least: int = 1
) -> None:
    """Refuse what is not a sequence of numbers of an interval.

    Args:
        name: Name of the parameter as the user wrote it.
        values: The sequence, the same on all ranks.
        allowed: Numbers that are allowed.
        length: How many there must be; None for at least `least`.
        least: How many there must be if no length is given.

    Raises:
        ValueError: It is no sequence, of another length, or one is no number of the interval.
    """
    sequence = isinstance(values, tuple | list) or (isinstance(values, np.ndarray) and values.ndim == 1)
    fits = sequence and (len(values) >= least if length is None else len(values) == length)
    many = {None: "at least one number" if least else "a sequence", 1: "one number"}.get(length, f"{length} numbers")
    require(name, values, fits and all(value in allowed for value in values), f"{many}, each {allowed}")


def as_numbers(name: str, values: Any) -> NDArray[np.float64]:
    """Numbers, which need not be finite, as an array; for arguments and Raises see `as_array`."""
    try:
        array = np.asarray(values)
        numbers = array.dtype.kind in "iuf"
    except ValueError:
        numbers = False
    require(name, values, numbers, "an array of numbers")
    return array.astype(np.float64)


def as_array(name: str, values: Any) -> NDArray[np.float64]:
    """Finite numbers as an array.

    Args:
        name: Name of the parameter as the user wrote it.
        values: A number, an array or nested sequences, the same on all ranks.

    Raises:
        ValueError: They are no numbers, not finite, or rows have different lengths.
    """
    array = as_numbers(name, values)
    require(name, values, bool(np.isfinite(array).all()), "an array of finite numbers")
    return array
