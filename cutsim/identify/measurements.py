"""Tables of a testing machine: columns by name, in the units of the run; errors name file, line and cell."""

from __future__ import annotations

import codecs
import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import takewhile
from pathlib import Path
from tokenize import TokenError
from typing import Literal

import numpy as np
import pint
from numpy.typing import ArrayLike, NDArray

from cutsim.base.checks import as_numbers, count, require, require_number
from cutsim.base.signatures import checked
from cutsim.base.units import Units

#: What a unit is made of, and how it is composed of length, force, time and temperature.
_POWERS = {
    "[length]": (1, 0, 0, 0),
    "[mass]": (-1, 1, 2, 0),
    "[time]": (0, 0, 1, 0),
    "[temperature]": (0, 0, 0, 1),
}
_ALLOWED = "a unit such as mm, kN, MPa, min, degC, % or 1"
#: Dimension of the quantities whose name says what they are.
_DIMENSIONS = {
    "force": "[force]", "load": "[force]", "stress": "[pressure]", "time": "[time]", "temperature": "[temperature]",
    "energy": "[energy]", "work": "[energy]", "toughness": "[force]/[length]", "area": "[area]",
    "velocity": "[velocity]", "strain": "[]", "stretch": "[]", "angle": "[]", "length": "[length]",
    "displacement": "[length]", "extension": "[length]", "travel": "[length]", "depth": "[length]",
    "opening": "[length]",
}  # fmt: skip
#: Marks at the start of a file that say how it is encoded.
_MARKS = {codecs.BOM_UTF8: "utf-8-sig", codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16"}
_DELIMITERS = (";", "\t", ",", " ")
#: What may stand between thousands whatever the decimal sign: spaces, narrow and unbreakable ones too, apostrophes.
_BETWEEN = " \u00a0\u202f\u2009'\u2019"
_NO_UNIT = ("", "-", "–", "1")
Line = tuple[int, list[str]]


@dataclass(frozen=True)
class _Column:
    """Cells of a column as they are written, and their place for error messages."""

    path: Path | str
    title: str
    lines: Sequence[int]
    cells: Sequence[str]

    def require(self, i: int, valid: bool, allowed: str) -> None:
        """Refuse a cell."""
        require(f"{self.path}, line {self.lines[i]}, column {self.title!r}", self.cells[i], bool(valid), allowed)


@checked
def read_table(
    path: Path | str,
    columns: Mapping[str, tuple[str, str]],
    *,
    units: Units | None = None,
    increasing: str | None = None,
    delimiter: str | None = None,
    decimal: Literal[".", ","] | None = None,
    skip: int = 0,
) -> dict[str, NDArray[np.float64]]:
    """Read columns of a text file in UTF-8, UTF-16 with a byte-order mark, or Windows-1252. Every rank reads the file.

    The header is the first line that has all the columns; what is above it does not count.  A line of units may follow
    it, and has to agree with those given.  Thousands may be separated: "1.234,5" with a decimal comma is 1234.5, and so
    is "1,234.5" with a point.

    Args:
        path: The file; empty lines in it do not count.
        columns: Name of each quantity -> text in the header and unit of the numbers, such as
            ``{"force": ("Standard force", "kN"), "strain": ("Strain", "%")}``.  Where the name says what the quantity
            is (force, stress, strain, time, travel, …) the unit has to be one of that.
        units: Units of the result; mm, N, s, K by default.
        increasing: Quantity that must grow from line to line, such as the depth of a cut.
        delimiter: What separates cells, a space standing for any number of them; by default the semicolon, tab, comma
            or space with which the columns are found.
        decimal: Decimal point, or comma; by default what the numbers show.
        skip: Lines above the header that are not looked at.

    Returns:
        Quantity -> values, one per line.

    Raises:
        ValueError: A column is missing, a unit is unknown or of another quantity, a cell is not a finite number, the
            numbers do not show their decimal sign, the quantity does not grow, there are fewer than two lines, or the
            file is no text; the message names the file, the line, the column and the cell as written.
        OSError: The file cannot be read.
    """
    require_number("skip", skip, count())
    require("increasing", increasing, increasing is None or increasing in columns, f"one of {', '.join(columns)}")
    for quantity, (title, unit) in columns.items():
        _check_unit(f"{path}, unit of column {title!r}", quantity, unit)
    found, delimiter = _columns(path, [title for title, _ in columns.values()], delimiter, skip)
    found = _without_units(found, [unit for _, unit in columns.values()])
    sign = decimal or _decimal(found, delimiter)
    table: dict[str, NDArray[np.float64]] = {}
    for column, (quantity, (_, unit)) in zip(found, columns.items(), strict=True):
        values = np.array([_number(cell, sign) for cell in column.cells])
        for i in np.flatnonzero(np.isnan(values)).tolist():
            column.require(i, False, f"a finite number with a decimal {'comma' if sign == ',' else 'point'}")
        if quantity == increasing:
            for i in (np.flatnonzero(np.diff(values) <= 0) + 1).tolist():
                column.require(i, False, "greater than in the line before")
        table[quantity] = converted(values, unit, units or Units(), f"{path}, unit of column {column.title!r}")
    return table


@checked
def titled_units(path: Path | str) -> dict[str, str]:
    """Columns of a text file whose unit it gives itself: in brackets, after "in", or in a line below the titles.

    Args:
        path: The file, in one of the forms that `read_table` reads.

    Returns:
        Title -> unit, such as ``{"Standard force [kN]": "kN"}``; "1" for a strain or a stretch without a unit.

    Raises:
        ValueError: The file is no text.
        OSError: The file cannot be read.
    """
    text, found = _text(path), dict[str, str]()
    for choice in _DELIMITERS:
        lines = [cells for _, cells in _cut(text, choice, 0)]
        head = list(takewhile(lambda cells: not all(map(_is_number, filter(None, cells))), lines))
        for titles, below in zip(head, [*head[1:], []], strict=True):
            units = _units_in(titles) | _units_below(titles, below)
            found = max(found, units, key=len)
    return found


def fitting_columns(path: Path | str, quantities: Sequence[str]) -> dict[str, tuple[str, str]]:
    """The columns of a text file that can be meant by some quantities, in the form in which `read_table` takes them.

    Args:
        path: The file, which has to give the units (see `titled_units`).
        quantities: Names of quantities: of each, the first column that fits is taken. A strain or a stretch must be
            called so, or a strain be in per cent.

    Raises:
        ValueError: There is no such column; the message says what there is.
    """
    known = titled_units(path)
    found = {}
    for quantity in quantities:
        fitting = [title for title, unit in known.items() if _fits(quantity, title, unit)]
        columns = ", ".join(known) or "none with a unit"
        require(f"columns of {path}", columns, bool(fitting), f"such that one of them is a {quantity}, with its unit")
        found[quantity] = fitting[0], known[fitting[0]]
    return found


def _fits(quantity: str, title: str, unit: str) -> bool:
    one, dimension = _quantity(np.ones(1), unit), _DIMENSIONS[quantity]
    named = dimension != "[]" or quantity in title.lower() or (quantity == "strain" and unit == "%")
    return one is not None and bool(one.check(dimension)) and named


def _units_in(titles: Sequence[str]) -> dict[str, str]:
    """Titles that give their unit, or need none."""
    found = {}
    for title in titles:
        written = re.search(r"[\[(]([^\[(]+)[\])]$|\sin\s(\S+)$", title)
        unit = next(filter(None, written.groups())) if written else ""
        if unit and _is_unit(unit):
            found[title] = unit
        elif any(name in title.lower() for name in ("strain", "stretch")):
            found[title] = "1"
    return found


def _units_below(titles: Sequence[str], below: Sequence[str]) -> dict[str, str]:
    """Titles whose units are in the line below them."""
    pairs = zip(titles, map(_bare, below), strict=False)
    return {title: unit for title, unit in pairs if title and unit not in _NO_UNIT and _is_unit(unit)}


def _is_number(cell: str) -> bool:
    return re.match(r"[+\-−]?[.,]?\d", cell) is not None


@checked
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
    quantity = _quantity(as_numbers("values", values), unit)
    require(name, unit, quantity is not None, _ALLOWED)
    assert quantity is not None
    exponents = sum((np.array(_POWERS[d]) * p for d, p in quantity.dimensionality.items()), np.zeros(4))
    base = (units.length, units.force, units.time, units.temperature)
    target = "*".join(f"{symbol}**{float(p)}" for symbol, p in zip(base, exponents, strict=True) if p)
    return np.asarray(quantity.to(target).magnitude)


def _quantity(values: NDArray[np.float64], unit: str) -> pint.Quantity | None:
    """Numbers with a unit; None if that is unknown, or not made of length, force, time and temperature."""
    try:
        quantity = pint.get_application_registry().Quantity(values, unit)
        return quantity if set(quantity.dimensionality) <= set(_POWERS) else None
    except (pint.PintError, TokenError, AttributeError, TypeError, ValueError):
        return None


def _check_unit(name: str, quantity: str, unit: str) -> None:
    """Refuse a unit that is none of the quantity it is given for."""
    one = _quantity(np.ones(1), unit)
    require(name, unit, one is not None, _ALLOWED)
    assert one is not None
    require(name, unit, not one.check("[mass]"), "no mass; forces are in N, gf, kgf or lbf")
    dimension = _DIMENSIONS.get(quantity)
    require(name, unit, dimension is None or one.check(dimension), f"a unit of {quantity}")


def _text(path: Path | str) -> str:
    """The text of a file, by its mark; without one it is UTF-8, or else Windows-1252."""
    data = Path(path).read_bytes()
    marked = [encoding for mark, encoding in _MARKS.items() if data.startswith(mark)]
    for encoding in marked or ["utf-8", "cp1252"]:
        try:
            text = data.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\0" not in text:
            return text
    raise ValueError(f"{path} is not allowed: it must be text in UTF-8, UTF-16 with a byte-order mark or Windows-1252")


def _columns(path: Path | str, titles: Sequence[str], delimiter: str | None, skip: int) -> tuple[list[_Column], str]:
    """The columns below the first line that has all titles, and the delimiter with which there is one."""
    text = _text(path)
    found: tuple[int, str, list[Line]] = (-1, ",", [])
    for choice in _DELIMITERS if delimiter is None else (delimiter,):
        lines = _cut(text, choice, skip)
        known = [sum(title in cells for title in titles) for _, cells in lines]
        if lines and max(known) > found[0]:
            found = max(known), choice, lines[known.index(max(known)) :]
    _, delimiter, lines = found
    header = lines[0][1] if lines else []
    for title in titles:
        require(f"columns of {path}", header, header.count(title) == 1, f"such that one of them is {title!r}")
    numbers, rows = [line for line, _ in lines[1:]], [cells for _, cells in lines[1:]]
    at = [header.index(title) for title in titles]
    cells = [[row[place] if place < len(row) else "" for row in rows] for place in at]
    return [_Column(path, title, numbers, column) for title, column in zip(titles, cells, strict=True)], delimiter


def _cut(text: str, delimiter: str, skip: int) -> list[Line]:
    """Numbered lines with something in them, in cells."""
    spaced = delimiter == " "
    lines = (line.strip() if spaced else line for line in text.splitlines()[skip:])
    reader = csv.reader(lines, delimiter=delimiter, skipinitialspace=spaced)
    cut = [(reader.line_num + skip, [cell.strip() for cell in cells]) for cells in reader]
    return [(line, cells) for line, cells in cut if any(cells)]


def _without_units(columns: list[_Column], units: Sequence[str]) -> list[_Column]:
    """Columns without a line of units, which has to agree with those given; at least two lines of numbers are left."""
    lines = 1 + len(columns[0].cells)
    written = [_bare(column.cells[0]) for column in columns] if lines > 1 else []
    if any(unit not in _NO_UNIT for unit in written) and all(unit in _NO_UNIT or _is_unit(unit) for unit in written):
        for column, unit, given in zip(columns, written, units, strict=True):
            column.require(0, unit in _NO_UNIT or _same(unit, given), f"{given}, the unit that is given for it")
        columns = [replace(column, lines=column.lines[1:], cells=column.cells[1:]) for column in columns]
        lines -= 1
    require(f"number of lines in {columns[0].path}", lines, lines >= 3, "a header and at least two lines of numbers")
    return columns


def _bare(cell: str) -> str:
    return cell.strip("[]() ")


def _is_unit(text: str) -> bool:
    number = re.match(r"[+\-−]?[.,]?\d|nan|[+\-−]?inf", text.lower())
    return number is None and _quantity(np.ones(1), text) is not None


def _same(first: str, second: str) -> bool:
    """Whether two units are the same, with their zero."""
    a, b = (_quantity(np.arange(1.0, 3.0), unit) for unit in (first, second))
    if a is None or b is None or a.dimensionality != b.dimensionality:
        return False
    return bool(np.allclose(a.to_base_units().magnitude, b.to_base_units().magnitude, rtol=1e-9, atol=0))


def _decimal(columns: list[_Column], delimiter: str) -> str:
    """The decimal sign that the numbers show, the same in all of them."""
    if delimiter == ",":
        return "."
    shown: dict[str, int] = {}  # and the line that shows it
    open_to_doubt = None
    for column in columns:
        for i, cell in enumerate(column.cells):
            sign = _sign(cell)
            if sign == "?":
                open_to_doubt = open_to_doubt or (column, i)
            elif sign:
                shown.setdefault(sign, column.lines[i])
                column.require(i, len(shown) == 1, f"of the decimal sign of line {next(iter(shown.values()))}")
    if not shown and open_to_doubt:
        column, i = open_to_doubt
        column.require(i, False, "a number that can be read in one way only; say which by decimal='.' or decimal=','")
    return next(iter(shown), ".")


def _sign(cell: str) -> str:
    """Decimal sign of a number as written: a sign, nothing if it has none, "?" if it may be one of thousands."""
    signs = [sign for sign in cell if sign in ".,"]
    if not signs:
        return ""
    if len(set(signs)) == 2:
        return signs[-1]
    if len(signs) > 1:
        return "," if signs[0] == "." else "."
    return "?" if re.fullmatch(r"[+-]?[1-9]\d{0,2}[.,]\d{3}", cell) else signs[0]


def _number(cell: str, decimal: str) -> float:
    """A number as written, nan if it is none."""
    thousands = re.escape(_BETWEEN + (",." if decimal == "." else ".,").replace(decimal, ""))
    whole = rf"(?:\d+|[1-9]\d{{0,2}}(?:([{thousands}])\d{{3}})(?:\1\d{{3}})*)"
    pattern = rf"[+-]?(?:{whole}(?:{re.escape(decimal)}\d*)?|{re.escape(decimal)}\d+)(?:[eE][+-]?\d+)?"
    cell = cell.replace("−", "-")
    if not re.fullmatch(pattern, cell):
        return float("nan")
    plain = re.sub(f"[{thousands}]", "", cell).replace(decimal, ".")
    value = float(plain)
    return value if np.isfinite(value) else float("nan")
