"""Parameters of laws and loads as form constants, so that a new value needs no new kernel."""

from collections.abc import Callable, Mapping
from copy import copy
from dataclasses import fields, is_dataclass, replace
from typing import Any, TypeVar

import numpy as np
from dolfinx import default_scalar_type, fem
from dolfinx.mesh import Mesh

from cutsim.base.checks import finite, require, require_number
from cutsim.base.memory import Memory

Law = TypeVar("Law")
TimeFunction = Callable[[float], float]


def with_constants(mesh: Mesh, law: Law) -> Law:
    """The law with each of its numbers replaced by a `dolfinx.fem.Constant` of the same value.

    Kernels are then compiled for the law, not for the values of its parameters.  The copy is for writing forms only.

    Args:
        mesh: Mesh of the forms.
        law: A dataclass of parameters, which may hold tuples and other such dataclasses.  What is not a number is kept,
            and so is zero, which switches a part of a law off and thus changes its kernel.
    """
    return substituted(law, form_constants(mesh, law))


def form_constants(mesh: Mesh, law: Any) -> dict[str, fem.Constant]:
    """A form constant for each number of a law but zeros, by its name."""
    return {name: fem.Constant(mesh, default_scalar_type(value)) for name, value in numbers(law).items() if value != 0}


def numbers(law: Any) -> dict[str, float]:
    """The numbers of a law by name, such as ``young``, ``moduli[0]`` or ``matrix.c1``.

    Args:
        law: A dataclass of parameters, which may hold tuples and other such dataclasses.
    """
    found: dict[str, float] = {}

    def note(name: str, value: float) -> float:
        found[name] = value
        return value

    _changed(law, note, "", _unchecked)
    return found


def substituted(law: Law, values: Mapping[str, Any]) -> Law:
    """The law with some of its numbers replaced by anything, such as symbols; nothing is checked.

    Args:
        law: A dataclass of parameters.
        values: Replacements by name (`numbers`).
    """
    return _changed(law, lambda name, value: values.get(name, value), "", _unchecked)


def with_numbers(law: Law, values: Mapping[str, float]) -> Law:
    """The law with other numbers.

    Args:
        law: A dataclass of parameters.
        values: New numbers by name (`numbers`).

    Raises:
        ValueError: A name is unknown, or the law refuses a number.
    """
    known = numbers(law)
    for name in values:
        require("parameter", name, name in known, "one of " + ", ".join(known))
    return _changed(law, lambda name, value: values.get(name, value), "", replace)


def _changed(item: Any, change: Callable[[str, float], Any], name: str, build: Callable[..., Any]) -> Any:
    if isinstance(item, tuple):
        return tuple(_changed(entry, change, f"{name}[{i}]", build) for i, entry in enumerate(item))
    if is_dataclass(item):
        prefix = f"{name}." if name else ""
        parts = {f.name: _changed(getattr(item, f.name), change, prefix + f.name, build) for f in fields(item)}
        return build(item, **parts)
    number = isinstance(item, int | float) and not isinstance(item, bool)
    return change(name, item) if number else item


def _unchecked(law: Any, /, **parts: Any) -> Any:
    changed = copy(law)
    for name, part in parts.items():
        # the dataclasses are frozen, and their checks are for numbers
        object.__setattr__(changed, name, part)
    return changed


class Schedule:
    """Form constant that is a function of time.

    Args:
        mesh: Mesh of the forms.
        memory: Memory of the run.
        value: A number, or a function of time.
        name: Name of the parameter as the user wrote it.
        owner: Name of what it belongs to.

    Attributes:
        constant: The constant, at first with the value at time 0.

    Raises:
        ValueError: The value, or that of the function at a time, is not a finite number.
    """

    def __init__(self, mesh: Mesh, memory: Memory, value: float | TimeFunction, name: str, owner: str) -> None:
        self._value, self._name = value, name
        self.constant = fem.Constant(mesh, default_scalar_type(self._at(0.0)))
        memory.array(f"{owner}: {name}", self.constant)

    @property
    def value(self) -> float:
        """The present value."""
        return float(self.constant.value)

    def begin(self, time: float) -> None:
        """Set the constant to its value at a time."""
        self.constant.value = self._at(time)

    def rates(self, start: float, end: float) -> tuple[float, float]:
        """First and second derivative at a time, from the values there, in the middle and at a later time."""
        half = 0.5 * (end - start)
        first, second, third = (self._at(t) for t in (start, start + half, end))
        return (4 * second - 3 * first - third) / (2 * half), (first - 2 * second + third) / half**2

    def _at(self, time: float) -> float:
        if not callable(self._value):
            require_number(self._name, self._value, finite)
            return float(self._value)
        value = self._value(time)
        if isinstance(value, np.ndarray) and value.size == 1:
            value = value.item()
        require_number(f"{self._name}({time:.6g})", value, finite)
        return float(value)
