"""Curves of runs and of measurements: what runs have left in their folders, and machines in their files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

import numpy as np
import pint
from numpy.typing import NDArray

from cutsim.base.checks import require
from cutsim.base.units import Units
from cutsim.identify.measurements import fitting_columns, read_table, titled_units
from cutsim.results.overlay import Overlay
from cutsim.results.plots import Curve
from cutsim.results.run_files import Column, RunFiles

#: How measured curves and those of runs are drawn; all others are dashed.
_STYLES = {"measured": ":", "trusted": "-"}
#: Kinds of quantities, for the units in which a measured table is read.
_KINDS = {"displacement": "length"}


@dataclass(frozen=True)
class Source:
    """A curve with what is known of it.

    Attributes:
        label: What it is called in a plot: the folder, or the file.
        x: Abscissae.
        y: Ordinates.
        grade: What is to be thought of a run, in a word; "measured" for a measurement.
        complete: Whether it is whole.
    """

    label: str
    x: Column
    y: Column
    grade: str = "measured"
    complete: bool = True

    def called(self, label: str) -> Self:
        """The curve under another label."""
        return replace(self, label=label)

    def within(self, x: str, y: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The curve in other units.

        Raises:
            ValueError: They are units of other quantities.
        """
        return in_unit(self.x, x), in_unit(self.y, y)


def in_unit(column: Column, unit: str) -> NDArray[np.float64]:
    """Numbers of a column in another unit.

    Raises:
        ValueError: It is a unit of another quantity.
    """
    if unit == column.unit:
        return column.values
    try:
        quantity = pint.get_application_registry().Quantity(column.values, column.unit or "1")
        return np.asarray(quantity.to(unit or "1").magnitude)
    except pint.PintError as error:
        hint = "; --width gives the force per width of a plane case" if "/" in unit + column.unit else ""
        raise ValueError(f"{column.label} cannot be compared with [{unit or 1}]: {error}{hint}") from None


def overlaid(sources: Sequence[Source]) -> Overlay:
    """Curves in one frame, in the units of the first; runs that are not to be trusted are dashed, measurements dotted.

    Raises:
        ValueError: The units of a curve are those of other quantities.
    """
    first = sources[0]
    curves = []
    for source in sources:
        x, y = source.within(first.x.unit, first.y.unit)
        label = f"{source.label}, {source.grade}" if source.grade == "questionable" else source.label
        curves.append(Curve(x, y, label, _STYLES.get(source.grade, "--"), partial=not source.complete))
    return Overlay(tuple(curves), first.x.label, first.y.label)


def run_files(folder: Path) -> RunFiles:
    """Files of a run.

    Raises:
        FileNotFoundError: There is no such folder, or it has no history.
    """
    if not folder.exists():
        raise FileNotFoundError(f"{folder} is not there: neither a folder of a run nor a file of measurements")
    run = RunFiles.read(folder)
    if not run.history:
        raise FileNotFoundError(f"{folder} is no folder of a run: {'; '.join(run.missing) or 'its history is empty'}")
    return run


def run_column(run: RunFiles, name: str) -> Column:
    """A column of a history.

    Raises:
        ValueError: There is none of this name.
    """
    require(f"column of {run.folder}", name, name in run.history, "one of " + ", ".join(run.history))
    return run.history[name]


def read_source(path: Path, x: str | None = None, y: str | None = None, width: float | None = None) -> Source:
    """The curve of a run or of a measurement.

    Args:
        path: Folder of a run, or file of a testing machine.
        x: Column of the abscissae; of a file also "title:unit" where it does not give the unit itself. By default that
            of the main curve, or a displacement.
        y: That of the ordinates; by default that of the main curve, or the force.
        width: Width of a specimen that was measured, for its force per width [mm].

    Raises:
        ValueError: There is no such column, or the file is refused.
        OSError: Folder or file cannot be read.
    """
    label = path.resolve().name
    if path.is_file():
        abscissae, ordinates = read_columns(path, {"displacement": x, "force": y})
        return Source(label, abscissae, ordinates if width is None else per_width(ordinates, width))
    run = run_files(path)
    main = run.curve or (next(iter(run.history)), list(run.history)[-1])
    abscissae, ordinates = run_column(run, x or main[0]), run_column(run, y or main[1])
    return Source(label, abscissae, ordinates, run.judgement.grade, run.complete)


def per_width(force: Column, width: float) -> Column:
    """A force per width, as that of plane problems.

    Args:
        force: The force.
        width: The width [mm].
    """
    return replace(force, unit=f"{force.unit}/mm", values=force.values / width)


def read_sources(
    paths: Sequence[Path],
    run: tuple[str | None, str | None],
    file: tuple[str | None, str | None],
    width: float | None = None,
) -> list[Source]:
    """Curves of runs and measurements, by their paths where their names alone would not tell them apart.

    Args:
        paths: Folders and files.
        run: Columns of abscissae and ordinates in runs; see `read_source`.
        file: The same in files.
        width: Width of a specimen that was measured, for its force per width [mm].
    """
    sources = [read_source(path, *(file if path.is_file() else run), width) for path in paths]
    if len({source.label for source in sources}) < len(sources):
        sources = [source.called(str(path)) for source, path in zip(sources, paths, strict=True)]
    return sources


def read_columns(path: Path, columns: Mapping[str, str | None], units: Units | None = None) -> list[Column]:
    """Columns of a measured table.

    Args:
        path: The file.
        columns: Quantity → title of its column, with ":unit" where the file does not give it; None where the first
            column in a unit of this quantity is meant.
        units: Units of the result; mm, N, s, K by default.

    Raises:
        ValueError: There is no such column, or the file is refused.
        OSError: The file cannot be read.
    """
    units = units or Units()
    unknown = [quantity for quantity, title in columns.items() if title is None]
    chosen = fitting_columns(path, unknown) if unknown else {}
    chosen |= {quantity: _column(path, title) for quantity, title in columns.items() if title is not None}
    table = read_table(path, {quantity: chosen[quantity] for quantity in columns}, units=units)
    return [Column(quantity, _unit(quantity, units), values) for quantity, values in table.items()]


def _column(path: Path, title: str) -> tuple[str, str]:
    """Title and unit of a column that the user has named."""
    units = titled_units(path)
    if title in units:
        return title, units[title]
    name, colon, unit = title.rpartition(":")
    known = ", ".join(units) or "none with a unit"
    require(f"column of {path}", title, bool(colon), f"'title:unit', or one of {known}")
    return name, unit


def _unit(quantity: str, units: Units) -> str:
    """Unit in which a table is read."""
    kind = _KINDS.get(quantity, quantity)
    return "" if kind in ("strain", "stretch") else units.of(kind)
