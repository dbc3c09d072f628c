"""Values that a sweep gives to keys of a case, and the runs that follow."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import typer

from cutsim.commands.case_files import file_name, short_names

_ALLOWED = "key=first:last:number, key=first:last:number:log or key=value,value,…"


@dataclass(frozen=True)
class Variation:
    """Values of a key.

    Attributes:
        key: The key, with dots.
        values: Its values as they are written in a case file.
    """

    key: str
    values: tuple[str, ...]

    @classmethod
    def of(cls, text: str) -> Variation:
        """Read ``tool.friction=0.1:0.8:8``, with ":log" for equal ratios, or ``law.toughness=0.5,0.8``.

        Raises:
            typer.BadParameter: It is of neither form.
        """
        key, equals, values = text.partition("=")
        parts = values.split(":")
        try:
            found = _spread(parts) if len(parts) > 1 else [value.strip() for value in values.split(",")]
        except ValueError:
            found = []
        if not (key.strip() and equals and found and all(found)):
            raise typer.BadParameter(f"{text!r} must be of the form {_ALLOWED}", param_hint="--vary")
        return cls(key.strip(), tuple(dict.fromkeys(found)))


def _spread(parts: Sequence[str]) -> list[str]:
    """Numbers from the first to the last, at equal distances or ratios."""
    logarithmic = parts[3:] == ["log"]
    first, last, number = parts[:-1] if logarithmic else parts
    return _between(float(first), float(last), int(number), logarithmic=logarithmic)


def _between(first: float, last: float, number: int, *, logarithmic: bool) -> list[str]:
    if number < 2 or (logarithmic and first * last <= 0):
        raise ValueError
    shares = [i / (number - 1) for i in range(number)]
    values = [first * (last / first) ** s if logarithmic else first + s * (last - first) for s in shares]
    return [f"{value:.10g}" for value in values]


@dataclass(frozen=True)
class Variant:
    """One run of a sweep.

    Attributes:
        values: Key → value.
        name: Its name, from the values: that of its folder.
    """

    values: dict[str, str]
    name: str


def variants(variations: Sequence[Variation]) -> list[Variant]:
    """All combinations of the values.

    Raises:
        typer.BadParameter: A key is varied twice.
    """
    keys = [variation.key for variation in variations]
    if len(set(keys)) < len(keys):
        raise typer.BadParameter("each key can be varied once", param_hint="--vary")
    short = short_names(keys)
    found = []
    for values in itertools.product(*(variation.values for variation in variations)):
        name = "_".join(f"{short[key]}={file_name(value)}" for key, value in zip(keys, values, strict=True))
        found.append(Variant(dict(zip(keys, values, strict=True)), name))
    return found
