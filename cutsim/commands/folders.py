"""What a run has left in its folder, and what a testing machine has left in a file, as curves."""

from __future__ import annotations

import csv
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np
import pint
from numpy.typing import NDArray

from cutsim.base.checks import require
from cutsim.identify.measurements import fitting_columns, read_table, titled_units
from cutsim.results.output import read_history

#: Columns that a history is drawn over, and those that are drawn: the first that there is.
_ABSCISSAE = ("depth", "displacement", "time")
_ORDINATES = ("force", "reaction")


@dataclass(frozen=True)
class Axis:
    """A column of numbers.

    Attributes:
        name: What the numbers are.
        unit: Their unit; "1" for none.
        values: The numbers.
    """

    name: str
    unit: str
    values: NDArray[np.float64]

    @property
    def label(self) -> str:
        """Name and unit, for an axis of a plot."""
        return self.name if self.unit == "1" else f"{self.name} [{self.unit}]"

    def in_unit(self, unit: str) -> NDArray[np.float64]:
        """The numbers in another unit.

        Raises:
            ValueError: It is a unit of another quantity.
        """
        if unit == self.unit:
            return self.values
        try:
            return np.asarray(pint.get_application_registry().Quantity(self.values, self.unit).to(unit).magnitude)
        except pint.PintError as error:
            raise ValueError(f"{self.name} in {self.unit} cannot be compared with {unit}: {error}") from None


@dataclass(frozen=True)
class Result:
    """Result of a run.

    Args:
        folder: Its folder.

    Raises:
        FileNotFoundError: It has no history.
    """

    folder: Path

    def __post_init__(self) -> None:
        if not self.history.exists():
            raise FileNotFoundError(f"{self.folder} is no folder of a run: it has no history.csv")

    @property
    def history(self) -> Path:
        """The table with a row for each step."""
        return self.folder / "history.csv"

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Verdict and headline numbers; empty if the run was killed or goes on."""
        path = self.folder / "summary.json"
        return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}

    @property
    def complete(self) -> bool:
        """Whether the run came to its end."""
        return bool(self.summary) and self.summary["time"] >= self.summary["until"] * (1 - 1e-9)

    @property
    def verdict(self) -> str:
        """What is to be thought of it in a word or two."""
        return self.summary["verdict"] if self.complete else "ends early"

    @cached_property
    def columns(self) -> dict[str, Axis]:
        """Its columns by name."""
        with self.history.open(encoding="utf-8", newline="") as file:
            header = next(csv.reader(file), [])
        units = [label.partition(" [")[2].rstrip("]") or "1" for label in header]
        values = read_history(self.history) if header else {}
        return {name: Axis(name, unit, values[name]) for name, unit in zip(values, units, strict=True)}

    def column(self, name: str) -> Axis:
        """A column.

        Raises:
            ValueError: There is none of this name.
        """
        require(f"column of {self.history}", name, name in self.columns, "one of " + ", ".join(self.columns))
        return self.columns[name]

    def main(self, names: tuple[str, ...], unit: str) -> Axis:
        """The column that shows the run best: the first of some names, else the first in a unit or the last one."""
        fitting = [name for name in names if name in self.columns]
        fitting += [name for name, axis in self.columns.items() if axis.unit == unit]
        return self.column([*fitting, *list(self.columns)[-1:]][0])


@dataclass(frozen=True)
class Source:
    """A curve with what is known of it.

    Attributes:
        label: What it is called in a plot: the folder, or the file.
        x: Abscissae.
        y: Ordinates.
        verdict: Verdict of a run; "measured" for a measured one.
        complete: Whether it is whole.
    """

    label: str
    x: Axis
    y: Axis
    verdict: str = "measured"
    complete: bool = True

    def called(self, label: str) -> Self:
        """The curve under another label."""
        return replace(self, label=label)


def read_source(path: Path, x: str | None = None, y: str | None = None) -> Source:
    """The curve of a run or of a measurement.

    Args:
        path: Folder of a run, or file of a testing machine.
        x: Column of the abscissae; of a file also "title:unit" where it does not give the unit itself. By default depth
            or displacement.
        y: That of the ordinates; the force by default.

    Raises:
        ValueError: There is no such column, or the file is refused.
        OSError: Folder or file cannot be read.
    """
    label = path.resolve().name
    if path.is_dir():
        result = Result(path)
        abscissa = result.column(x) if x else result.main(_ABSCISSAE, "mm")
        ordinate = result.column(y) if y else result.main(_ORDINATES, "N")
        return Source(label, abscissa, ordinate, result.verdict, result.complete)
    if not path.exists():
        raise FileNotFoundError(f"there is neither a folder nor a file {path}")
    abscissa, ordinate = read_axes(path, {"displacement": x, "force": y})
    return Source(label, abscissa, ordinate)


def read_sources(
    paths: Sequence[Path], run: tuple[str | None, str | None], file: tuple[str | None, str | None]
) -> list[Source]:
    """Curves of runs and measurements, by their paths where their names alone would not tell them apart.

    Args:
        paths: Folders and files.
        run: Columns of abscissae and ordinates in runs; see `read_source`.
        file: The same in files.
    """
    sources = [read_source(path, *(run if path.is_dir() else file)) for path in paths]
    if len({source.label for source in sources}) < len(sources):
        sources = [source.called(str(path)) for source, path in zip(sources, paths, strict=True)]
    return sources


def read_axes(path: Path, columns: dict[str, str | None]) -> list[Axis]:
    """Columns of a measured table.

    Args:
        path: The file.
        columns: Quantity → title of its column, with ":unit" where the file does not give it; None where the first
            column in a unit of this quantity is meant.

    Raises:
        ValueError: There is no such column, or the file is refused.
        OSError: The file cannot be read.
    """
    unknown = [quantity for quantity, title in columns.items() if title is None]
    chosen = fitting_columns(path, unknown) if unknown else {}
    chosen |= {quantity: _column(path, title) for quantity, title in columns.items() if title is not None}
    table = read_table(path, {quantity: chosen[quantity] for quantity in columns})
    return [Axis(quantity, _unit(quantity), table[quantity]) for quantity in columns]


def _column(path: Path, title: str) -> tuple[str, str]:
    """Title and unit of a column that the user has named."""
    units = titled_units(path)
    if title in units:
        return title, units[title]
    name, colon, unit = title.rpartition(":")
    require(
        f"column of {path}", title, bool(colon), "'title:unit', or one of " + (", ".join(units) or "none with a unit")
    )
    return name, unit


def _unit(quantity: str) -> str:
    """Unit in which a table is read."""
    return {"force": "N", "displacement": "mm", "stress": "MPa"}.get(quantity, "1")
