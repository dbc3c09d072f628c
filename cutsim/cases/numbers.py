"""Numbers of a case file: plain ones, quantities, expressions, and functions of time."""

import sys
from collections.abc import Iterator, Mapping
from functools import cached_property
from itertools import pairwise
from typing import Any

from cutsim.base.units import Kind, Units
from cutsim.cases.expressions import (
    FUNCTIONS,
    TIME,
    RowExpression,
    TimeExpression,
    TimeTable,
    TimeValue,
    evaluate,
    names_in,
)
from cutsim.cases.keys import full, nearest
from cutsim.cases.quantities import Converter, split

_ONE, _TIME = Kind("one"), Kind("time")


class Numbers:
    """Numbers that the values of a case file stand for, in its units.

    Args:
        tables: The tables of the file in their full form.
        units: The units of plain numbers.
    """

    def __init__(self, tables: Mapping[str, Any], units: Units) -> None:
        self._tables, self.units, self._converter = tables, units, Converter(units)
        self._known: dict[str, TimeValue] = {}
        self._open: list[str] = []

    def number(self, value: Any, kind: Kind | None = _ONE) -> float:
        """The number that a value stands for.

        Args:
            value: A number, a quantity or an expression.
            kind: What it is; None for anything.

        Raises:
            ValueError: It is none of these, has another kind, or depends on time.
        """
        found = self.function(value, kind, varying=False)
        assert isinstance(found, float)
        return found

    def function(self, value: Any, kind: Kind | None = _ONE, *, varying: bool = True) -> TimeValue:
        """The number or function of time that a value stands for.

        Args:
            value: A number, a quantity, an expression that may have t in it, or a table of times and values.
            kind: What it is at each time; None for anything.
            varying: Whether it may depend on time.

        Raises:
            ValueError: It is none of these, or of another kind.
        """
        try:
            return self._found(value, kind, varying)
        except ValueError as error:
            reason = f": {error}" if str(error) else ""
            raise ValueError(f"must be {self._allowed(kind, varying)}{reason}") from None

    def formula(self, text: Any) -> RowExpression:
        """The function of columns that an expression stands for; its other names are numbers of the file.

        Args:
            text: The expression.

        Raises:
            ValueError: It is no expression, or depends on time by itself.
        """
        if not isinstance(text, str):
            raise ValueError("must be an expression in columns of the history")
        names = [name for name in sorted(names_in(text)) if self._find(name) is not None]
        values = {name: self._value(name) for name in names}
        if moving := [name for name, value in values.items() if callable(value)]:
            raise ValueError(f"must not have {moving[0]!r}, which depends on time, but columns of the history")
        return RowExpression(text, tuple(values.items()))  # type: ignore[arg-type]

    def _allowed(self, kind: Kind | None, varying: bool) -> str:
        """What is allowed, in words."""
        number = "a number, a quantity"
        if kind is not None:
            symbol = self.units.of(kind.name)
            number = "a number" if kind.name == "one" else f"a number [{symbol}], a quantity such as '1 {symbol}'"
        return f"{number} or an expression" + " in t, or {times = [...], values = [...]}" * varying

    def _found(self, value: Any, kind: Kind | None, varying: bool) -> TimeValue:
        if isinstance(value, str):
            return self._text(value, kind, varying)
        if isinstance(value, Mapping) and varying:
            return self._table(value, kind)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise ValueError
        if not abs(value) <= sys.float_info.max:
            raise ValueError("it is not finite")
        return float(value)

    def _table(self, value: Mapping[str, Any], kind: Kind | None) -> TimeValue:
        columns = [value.get(key) for key in ("times", "values")]
        if len(value) != 2 or not all(isinstance(column, list) for column in columns):
            raise ValueError
        times = tuple(self.number(t, _TIME) for t in value["times"])
        values = tuple(self.number(v, kind) for v in value["values"])
        if len(times) != len(values) or not times or any(b <= a for a, b in pairwise(times)):
            raise ValueError("there must be as many values as times, at least one, and the times must increase")
        return TimeTable(times, values)

    def _text(self, text: str, kind: Kind | None, varying: bool) -> TimeValue:
        quantity = split(text)
        if quantity is not None:
            return self._converter.number(*quantity, kind)
        names = names_in(text)
        values = {name: self._value(name) for name in sorted(names - {TIME})}
        if TIME not in names and not any(callable(value) for value in values.values()):
            return evaluate(text, values)  # type: ignore[arg-type]
        if not varying:
            raise ValueError("it cannot depend on the time t")
        function = TimeExpression(text, tuple(values.items()))
        function(0.0)
        return function

    def _value(self, name: str) -> TimeValue:
        """Value of a parameter, or of another key of the file."""
        if name in self._open:
            raise ValueError(f"it refers to itself, {' -> '.join([*self._open[self._open.index(name) :], name])}")
        if name not in self._known:
            self._open.append(name)
            try:
                self._known[name] = self._resolved(name)
            finally:
                self._open.pop()
        return self._known[name]

    def _resolved(self, name: str) -> TimeValue:
        raw = self._find(name)
        if raw is None:
            raise ValueError(f"{name!r} is neither a parameter nor a number of this file{nearest(name, self._names)}")
        try:
            return self._found(raw, None, True)
        except ValueError as error:
            cause = str(error) or "it is no number"
            raise ValueError(cause if "refers to itself" in cause else f"in {name!r}, {cause}") from None

    def _find(self, name: str) -> Any:
        parameters = self._tables.get("parameters")
        if isinstance(parameters, Mapping) and name in parameters:
            return parameters[name]
        node: Any = self._tables
        for key in full(tuple(name.split("."))):
            node = node.get(key) if isinstance(node, Mapping) else None
        return node

    @cached_property
    def _names(self) -> list[str]:
        """Names that expressions may have."""
        parameters = self._tables.get("parameters")
        return [*(parameters if isinstance(parameters, Mapping) else ()), *FUNCTIONS, *_scalars(self._tables)]


def _scalars(tables: Mapping[str, Any], prefix: str = "") -> Iterator[str]:
    for key, value in tables.items():
        if isinstance(value, Mapping):
            yield from _scalars(value, f"{prefix}{key}.")
        elif isinstance(value, int | float | str):
            yield prefix + key
