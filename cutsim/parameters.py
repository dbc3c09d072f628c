"""Numbers of laws and loads as form constants, so that another value needs no other kernel."""

from collections.abc import Callable
from copy import copy
from dataclasses import fields, is_dataclass
from typing import Any, TypeVar

from dolfinx import default_scalar_type, fem
from dolfinx.mesh import Mesh

Law = TypeVar("Law")
History = Callable[[float], float]


def with_constants(mesh: Mesh, law: Law) -> Law:
    """The law with each of its numbers replaced by a `dolfinx.fem.Constant` of the same value.

    Kernels are then compiled for the law, not for the values of its parameters.  The copy is for writing forms only.

    Args:
        mesh: Mesh of the forms.
        law: A dataclass of parameters, which may hold tuples and other such dataclasses.  What is not a number is kept,
            and so is zero, which switches a part of a law off and thus changes its kernel.
    """
    symbolic: Any = copy(law)
    for field in fields(law):  # type: ignore[arg-type]
        # the dataclasses are frozen, and their checks are for numbers
        object.__setattr__(symbolic, field.name, _symbolic(mesh, getattr(law, field.name)))
    return symbolic


def _symbolic(mesh: Mesh, value: Any) -> Any:
    if isinstance(value, tuple):
        return tuple(_symbolic(mesh, item) for item in value)
    if is_dataclass(value):
        return with_constants(mesh, value)
    number = isinstance(value, int | float) and not isinstance(value, bool) and value != 0
    return fem.Constant(mesh, default_scalar_type(value)) if number else value


class Schedule:
    """A form constant that is a function of time.

    Args:
        mesh: Mesh of the forms.
        value: A number, or a function of time.

    Attributes:
        constant: The constant, at first with the value at time 0.
    """

    def __init__(self, mesh: Mesh, value: float | History) -> None:
        self._history: History = value if callable(value) else lambda _: float(value)
        self.constant = fem.Constant(mesh, default_scalar_type(self._history(0.0)))

    @property
    def value(self) -> float:
        """The present value."""
        return float(self.constant.value)

    def begin(self, time: float) -> None:
        """Set the constant to its value at a time."""
        self.constant.value = self._history(time)

    def rates(self, start: float, end: float) -> tuple[float, float]:
        """First and second derivative at a time, from the values there, in the middle and at a later time."""
        half = 0.5 * (end - start)
        first, second, third = (self._history(t) for t in (start, start + half, end))
        return (4 * second - 3 * first - third) / (2 * half), (first - 2 * second + third) / half**2
