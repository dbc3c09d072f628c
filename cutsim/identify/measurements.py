"""Tables of a testing machine: columns by name, in the units of the run, refused with line and column."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from math import isfinite
from pathlib import Path

import numpy as np
import pint
from numpy.typing import ArrayLike, NDArray

from cutsim.base.checks import require
from cutsim.base.units import Units

#: What a unit is made of, and how it is composed of length, force, time and temperature.
_POWERS = {
    "[length]": (1, 0, 0, 0),
    "[mass]": (-1, 1, 2, 0),
    "[time]": (0, 0, 1, 0),
    "[temperature]": (0, 0, 0, 1),
}
Line = tuple[int, list[str]]


def read_table(
    path: Path | str,
    columns: Mapping[str, tuple[str, str]],
    *,
    units: Units | None = None,
    increasing: str | None = None,
    delimiter: str = ",",
    decimal: str = ".",
    skip: int = 0,
) -> dict[str, NDArray[np.float64]]:
    """Read columns of a text file with one header line. Every rank reads the file.

    Args:
        path: The file; empty lines in it do not count.
        columns: Name of each quantity -> text in the header and unit of the numbers, such as
            ``{"force": ("Standard force", "kN"), "strain": ("Strain", "%")}``.
        units: Units of the result; mm, N, s, K by default.
        increasing: Quantity that must grow from line to line, such as the depth of a cut.
        delimiter: What separates cells.
        decimal: Decimal point, or comma.
        skip: Lines before the header.

    Returns:
        Quantity -> values, one per line.

    Raises:
        ValueError: A column is missing, a unit is unknown, a cell is not a finite number, the quantity does not grow,
            or there are fewer than two lines; the message names file, line and column.
        OSError: The file cannot be read.
    """
    require("increasing", increasing, increasing is None or increasing in columns, f"one of {', '.join(columns)}")
    header, rows = _lines(Path(path), delimiter, skip)
    table: dict[str, NDArray[np.float64]] = {}
    for quantity, (title, unit) in columns.items():
        require(f"columns of {path}", header, header.count(title) == 1, f"such that one of them is {title!r}")
        place = header.index(title)
        cells = [(line, cells[place].strip() if place < len(cells) else "") for line, cells in rows]
        values = [_number(path, line, title, cell.replace(decimal, ".")) for line, cell in cells]
        if quantity == increasing:
            for (line, cell), falls in zip(cells[1:], np.diff(values) <= 0, strict=True):
                require(f"{path}, line {line}, column {title!r}", cell, not falls, "greater than in the line before")
        table[quantity] = converted(values, unit, units or Units(), f"unit of column {title!r}")
    return table


def converted(values: ArrayLike, unit: str, units: Units, name: str = "unit") -> NDArray[np.float64]:
    """Numbers of any unit in the consistent units of a run.

    Args:
        values: The numbers.
        unit: Their unit, such as ``"kN/mm^2"``, ``"psi"``, ``"%"``, ``"degC"``.
        units: The units of the run.
        name: What the unit is called if it is refused.

    Raises:
        ValueError: The unit is unknown, or not made of length, force, time and temperature.
    """
    registry = pint.get_application_registry()
    allowed = "a unit such as mm, kN, MPa, min, degC, % or 1"
    try:
        quantity = registry.Quantity(np.asarray(values, dtype=np.float64), unit)
        dimensions = dict(quantity.dimensionality)
    except (pint.PintError, AttributeError, TypeError, ValueError):
        require(name, unit, False, allowed)
    require(name, unit, set(dimensions) <= set(_POWERS), allowed)
    exponents = sum((np.array(_POWERS[d]) * p for d, p in dimensions.items()), np.zeros(4))
    base = (units.length, units.force, units.time, units.temperature)
    target = "*".join(f"{symbol}**{float(p)}" for symbol, p in zip(base, exponents, strict=True) if p)
    return np.asarray(quantity.to(target).magnitude)


def _lines(path: Path, delimiter: str, skip: int) -> tuple[list[str], Sequence[Line]]:
    """Header and numbered lines with something in them."""
    with path.open(encoding="utf-8-sig", newline="") as file:
        for _ in range(skip):
            next(file, None)
        reader = csv.reader(file, delimiter=delimiter)
        lines = [(reader.line_num + skip, cells) for cells in reader if any(cell.strip() for cell in cells)]
    require(f"number of lines in {path}", len(lines), len(lines) >= 3, "a header and at least two lines of numbers")
    return [title.strip() for title in lines[0][1]], lines[1:]


def _number(path: Path | str, line: int, title: str, cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = float("nan")
    require(f"{path}, line {line}, column {title!r}", cell, isfinite(value), "a finite number")
    return value
