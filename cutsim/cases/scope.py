"""What the values of a case file may refer to: its units, its other values, and the names of its parts."""

import difflib
import math
from collections.abc import Collection, Iterable, Mapping
from functools import cached_property
from itertools import pairwise
from typing import Any

from cutsim.base.units import Kind, Units
from cutsim.cases.expressions import TIME, TimeExpression, TimeTable, TimeValue, evaluate, names_in
from cutsim.cases.geometries import LAMINATE, Outline, laminate_outline, names, outline
from cutsim.cases.quantities import Converter, split

#: Keys from the top of a file to a value; numbers count the entries of a list.
Keys = tuple[str | int, ...]
#: Tables that may be written in the singular if there is one entry: ``[tool]`` for ``[tools.tool]``.
SINGULAR = {
    "body": "bodies",
    "crack": "cracks",
    "pair": "pairs",
    "tool": "tools",
    "support": "supports",
    "load": "loads",
    "boundary": "boundaries",
}
_ONE = Kind("one")
_TIME = Kind("time")


def nearest(word: str, known: Iterable[str]) -> str:
    """The nearest spelling among known words as a question, empty if none is near."""
    found = difflib.get_close_matches(word, list(known), n=1, cutoff=0.6)
    return f"; did you mean {found[0]!r}?" if found else ""


class Scope:
    """Scope of the values of a case file.

    Args:
        data: The tables of the file, with every table in its full form (`cutsim.cases.reading`).
        units: The units in which plain numbers are given.
    """

    def __init__(self, data: Mapping[str, Any], units: Units) -> None:
        self._data, self.units, self._converter = data, units, Converter(units)
        self.valid: dict[str, Any] = {}
        self.tables: dict[int, Any] = {}
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
        if isinstance(value, bool) or not isinstance(value, int | float | str | Mapping):
            raise ValueError(f"must be {self._allowed(kind, varying)}")
        if isinstance(value, Mapping):
            return self._table(value, kind, varying)
        if isinstance(value, str):
            return self._text(value, kind, varying)
        if not math.isfinite(value):
            raise ValueError(f"must be {self._allowed(kind, varying)}, and finite")
        return float(value)

    def _allowed(self, kind: Kind | None, varying: bool) -> str:
        number = "a number, a quantity"
        if kind is not None:
            symbol = self.units.of(kind.name)
            number = "a number" if kind.name == "one" else f"a number [{symbol}], a quantity such as '1 {symbol}'"
        table = ", or a table {times = [...], values = [...]}" if varying else ""
        return f"{number} or an expression{' in t' if varying else ''}{table}"

    def _table(self, value: Mapping[str, Any], kind: Kind | None, varying: bool) -> TimeValue:
        columns = [value.get(key) for key in ("times", "values")]
        if not varying or set(value) != {"times", "values"} or not all(isinstance(c, list) for c in columns):
            raise ValueError(f"must be {self._allowed(kind, varying)}")
        times = tuple(self.number(t, _TIME) for t in value["times"])
        values = tuple(self.number(v, kind) for v in value["values"])
        if len(times) != len(values) or not times or any(b <= a for a, b in pairwise(times)):
            raise ValueError("must have as many values as times, at least one, and increasing times")
        return TimeTable(times, values)

    def _text(self, text: str, kind: Kind | None, varying: bool) -> TimeValue:
        quantity = split(text)
        if quantity is None:
            return self._expression(text, kind, varying)
        try:
            return self._converter.number(*quantity, kind)
        except ValueError as error:
            raise ValueError(f"must be {self._allowed(kind, varying)}: {error}") from None

    def _expression(self, text: str, kind: Kind | None, varying: bool) -> TimeValue:
        try:
            names = names_in(text)
        except ValueError:
            raise ValueError(f"must be {self._allowed(kind, varying)}") from None
        values = {name: self._value(name) for name in sorted(names - {TIME})}
        if TIME not in names and not any(callable(value) for value in values.values()):
            return evaluate(text, {name: value for name, value in values.items() if isinstance(value, float)})
        if not varying:
            raise ValueError(f"must be {self._allowed(kind, varying)}: it cannot depend on the time t")
        function = TimeExpression(text, tuple(values.items()))
        function(0.0)
        return function

    def _value(self, name: str) -> TimeValue:
        """Value of a parameter, or of another key of the file."""
        if name in self._open:
            raise ValueError(f"refers to itself: {' -> '.join([*self._open[self._open.index(name) :], name])}")
        if name not in self._known:
            self._open.append(name)
            try:
                self._known[name] = self._resolved(name)
            finally:
                self._open.pop()
        return self._known[name]

    def _resolved(self, name: str) -> TimeValue:
        raw = self._find(name)
        if isinstance(raw, bool) or not isinstance(raw, int | float | str):
            raise ValueError(f"{name!r} is neither a parameter nor a number of this file{nearest(name, self._names)}")
        if isinstance(raw, str) and (quantity := split(raw)) is not None:
            return self._converter.number(*quantity)
        return self.function(raw, None)

    def _find(self, name: str) -> Any:
        parameters = self._data.get("parameters")
        if isinstance(parameters, Mapping) and name in parameters:
            return parameters[name]
        node: Any = self._data
        for key in full(tuple(name.split("."))):
            node = node.get(key) if isinstance(node, Mapping) else None
        return node

    @cached_property
    def _names(self) -> list[str]:
        parameters = self._data.get("parameters")
        return [*(parameters if isinstance(parameters, Mapping) else ()), *_numbers(self._data)]

    def names(self, kind: str) -> Collection[str] | None:
        """Names that are known.

        Args:
            kind: What they name: "groups" of the mesh, "surfaces" that a tool may touch, or a table such as "cracks".

        Returns:
            The names; None if they are known only once the mesh is read.
        """
        if kind == "groups":
            return None if self.outline is None else self.outline.groups
        if kind == "surfaces":
            groups = self.names("groups")
            return (
                None if groups is None else [*groups, *(f"{c}{side}" for c in self._entries("cracks") for side in "+-")]
            )
        return self._entries(kind)

    def _entries(self, table: str) -> list[str]:
        entries = self._data.get(table)
        return list(entries) if isinstance(entries, Mapping) else []

    @cached_property
    def outline(self) -> Outline | None:
        """What is known of the mesh before it is made; None if it comes from a file."""
        mesh = self._data.get("mesh")
        name = mesh.get("geometry") if isinstance(mesh, Mapping) else None
        if name == LAMINATE:
            layers = self._data.get("layers")
            entries = layers if isinstance(layers, list) else []
            return laminate_outline(
                tuple(str(entry["name"]) for entry in entries if isinstance(entry, Mapping) and "name" in entry)
            )
        return outline(name) if isinstance(name, str) and name in names() else None

    def unknown(self, kind: str, name: str, known: Iterable[str]) -> str:
        """What to say of a name that is not known."""
        return f"must be one of {', '.join(known) or 'none'} ({kind} that are known){nearest(name, known)}"


def full(keys: Keys) -> Keys:
    """Keys with a table in the singular in its full form."""
    if keys[:1] == ("heat",):
        return ("heat", *full(keys[1:]))
    plural = SINGULAR.get(str(keys[0])) if keys else None
    return keys if plural is None else (plural, *keys)


def _numbers(data: Mapping[str, Any], prefix: str = "") -> Iterable[str]:
    for key, value in data.items():
        if isinstance(value, Mapping):
            yield from _numbers(value, f"{prefix}{key}.")
        elif isinstance(value, int | float | str):
            yield prefix + key
