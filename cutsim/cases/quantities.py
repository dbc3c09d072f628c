"""Quantities with a unit, such as ``"0.8 N/mm"``, in a consistent set of units."""

import re
from functools import cached_property, lru_cache
from typing import Any

import pint

from cutsim.base.checks import require
from cutsim.base.units import Kind, Units
from cutsim.cases.keys import nearest

_QUANTITY = re.compile(
    r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?+)\s*((?:1\s*/\s*)?[^\W\d_][^+\[\]{}'\"]*|[°%].*)"
)
#: Powers of powers and long numbers, which would take for ever.
_HARMFUL = re.compile(r"(\^|\*\*)[^/·]*(\^|\*\*)|\d{3}")
_EXAMPLES = {"length": "mm", "force": "N", "time": "s"}
_BASE = ("[length]", "[mass]", "[time]", "[temperature]")


@lru_cache(maxsize=1)
def _registry() -> pint.UnitRegistry:
    registry: pint.UnitRegistry = pint.UnitRegistry(autoconvert_offset_to_baseunit=True)
    return registry


def split(text: str) -> tuple[float, str] | None:
    """Number and unit of a quantity; None if the text does not look like one."""
    match = _QUANTITY.fullmatch(text.strip())
    return None if match is None else (float(match[1]), match[2].strip())


# symbols whose capitals are easily mistaken
_USUAL = (
    "m", "cm", "mm", "um", "N", "mN", "kN", "Pa", "kPa", "MPa", "GPa", "N/m", "N/mm", "J/m^2", "kJ/m^2", "mJ/mm^2",
    "MPa s", "kPa s", "s", "ms", "min", "mm/s", "mm/min", "m/s", "K", "degC", "deg", "rad", "kg/m^3", "g/cm^3", "1/K",
)  # fmt: skip


@lru_cache(maxsize=512)
def unit(symbol: str) -> Any:
    """Unit of a symbol, as pint knows it.

    Raises:
        ValueError: There is none.
    """
    try:
        if len(symbol) > 60 or _HARMFUL.search(symbol):
            raise ValueError
        return _registry().parse_units(symbol)
    except Exception:  # what the parser of pint makes of an arbitrary text
        raise ValueError(f"{symbol!r} is no unit{nearest(symbol, _USUAL)}") from None


def consistent(units: Units) -> Units:
    """Units, if each symbol is a unit of what it stands for.

    Raises:
        ValueError: One is not.
    """
    for kind, example in _EXAMPLES.items():
        symbol = getattr(units, kind)
        try:
            fits = unit(symbol).is_compatible_with(unit(example))
        except ValueError:
            fits = False
        require(kind, symbol, fits, f"a unit of {kind} such as {example!r}")
    require("temperature", units.temperature, units.temperature in ("K", "degC"), "'K' or 'degC'")
    return units


class Converter:
    """Converter of quantities to a consistent set of units.

    Args:
        units: The set.

    Raises:
        ValueError: A symbol of the set is no unit of what it stands for.
    """

    def __init__(self, units: Units) -> None:
        self.units = units

    @cached_property
    def _base(self) -> tuple[Any, ...]:
        """Units of length, mass, time and temperature differences."""
        length, force, time = (unit(symbol) for symbol in (self.units.length, self.units.force, self.units.time))
        return length, force * time**2 / length, time, unit("K")

    def factor(self, given: Units, kind: Kind) -> float:
        """What a number of a kind in another set of units is multiplied by."""
        one = Converter(given)._base
        length, force, time, temperature = kind.dimension
        powers = (length + force, force, time - 2 * force, temperature)
        ratios = (a / b for a, b in zip(one, self._base, strict=True))
        factor = 1.0
        for ratio, power in zip(ratios, powers, strict=True):
            factor *= float((1.0 * ratio).to_base_units().magnitude) ** power
        return factor

    def number(self, value: float, symbol: str, kind: Kind | None = None) -> float:
        """Number of a quantity in the set.

        Args:
            value: Its number.
            symbol: Its unit.
            kind: What it must be; None for anything.

        Raises:
            ValueError: The unit is unknown or of another kind.
        """
        given = _registry().Quantity(value, unit(symbol))
        if given.dimensionality == {"[temperature]": 1} and (kind is None or kind.name == "temperature"):
            return float(given.to(unit(self.units.temperature)).magnitude)
        if kind is not None and not _is(given, kind):
            raise ValueError(f"{symbol!r} is no unit of {words(kind)}")
        if not set(given.dimensionality) <= set(_BASE):
            raise ValueError(f"{symbol!r} is no unit of length, force, time and temperature")
        if kind is not None and kind.name == "temperature difference" and given.units == unit("degC"):
            return value
        if _angular(given):
            return float(given.to("radian").magnitude)
        target = unit("dimensionless")
        for dimension, base in zip(_BASE, self._base, strict=True):
            target = target * base ** given.dimensionality[dimension]
        return float(given.to(target).magnitude)


def _angular(quantity: Any) -> bool:
    return quantity.dimensionless and "radian" in dict(quantity.to_root_units().unit_items())


def _is(quantity: Any, kind: Kind) -> bool:
    """Whether a quantity is of a kind."""
    length, force, time, temperature = kind.dimension
    wanted = (length + force, force, time - 2 * force, temperature)
    if any(quantity.dimensionality[dimension] != power for dimension, power in zip(_BASE, wanted, strict=True)):
        return False
    return set(quantity.dimensionality) <= set(_BASE) and _angular(quantity) == (kind.name == "angle")


def words(kind: Kind) -> str:
    """A kind of quantity with its article."""
    name = {"one": "number without unit", "expansion": "quantity per temperature"}.get(kind.name, kind.name)
    return f"a{'n' if name[0] in 'aeiou' else ''} {name}"
