"""Output files of a run: history rows and a summary."""

from __future__ import annotations

import csv
import json
import math
import os
import shutil
from collections.abc import Callable, Mapping
from numbers import Integral
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TextIO

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.base.checks import require
from cutsim.base.files import replace_file
from cutsim.base.signatures import checked
from cutsim.base.units import Units
from cutsim.results.folder import HISTORY, SUMMARY


class Closing:
    """Base of context managers that close themselves at the end."""

    def close(self) -> None:
        """Close; a second call does nothing."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class HistoryWriter(Closing):
    """Writer of a CSV table with one row for each accepted step.

    Every row is flushed as it is written, so the file is complete and readable at any moment, also after a
    crash. Use it as a context manager; its methods are collective.

    Args:
        path: The file; folders are made, an older file is replaced.
        columns: Name of each column -> kind of quantity (see `cutsim.base.units.KINDS`), in the order of the file.
        units: Units for the header.
        comm: Communicator of the run; its first rank writes.
        rows: Rows of an older file of the same columns that are kept; those beyond are removed.

    Raises:
        ValueError: If there are no columns, a kind is unknown, a name has a comma, bracket, quote or line break, or an
            older file that is gone on with has other columns or fewer rows.
        OSError: If the file cannot be opened, on all ranks.
    """

    def __init__(
        self, path: Path | str, columns: Mapping[str, str], units: Units, comm: MPI.Comm, rows: int = 0
    ) -> None:
        require("columns", dict(columns), len(columns) > 0, "at least one column")
        for name in columns:
            plain = bool(name.strip()) and not set(name) & set(',[]"\r\n')
            require("columns", name, plain, "a name without comma, bracket, quote or line break")
        self._comm, self._names = comm, tuple(columns)
        self._file: TextIO | None = None
        header = [units.label(name, kind) for name, kind in columns.items()]
        on_root(comm, lambda: self._open(Path(path), header, rows))

    def append(self, row: Mapping[str, float]) -> None:
        """Write one row. Collective.

        Args:
            row: Column name -> number; the same names as `columns`, in any order, equal on all ranks.

        Raises:
            ValueError: If a column is missing, unknown, or not a number.
            OSError: If the row cannot be written, on all ranks.
        """
        missing, extra = set(self._names) - set(row), set(row) - set(self._names)
        if missing or extra:
            raise ValueError(f"row lacks {sorted(missing)} and has {sorted(extra)} besides {self._names}")
        cells = [_cell(name, row[name]) for name in self._names]
        on_root(self._comm, lambda: self._write(cells))

    def close(self) -> None:
        """Close the file; a second call does nothing."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def sync(self) -> None:
        """Make sure that the rows so far survive a loss of power. Collective."""
        on_root(self._comm, lambda: os.fsync(self._file.fileno()) if self._file is not None else None)

    def _open(self, path: Path, header: list[str], rows: int) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        if rows:
            replace_file(path, _kept_rows(path, header, rows).encode())
        self._file = path.open("a" if rows else "w", encoding="utf-8", newline="")
        if not rows:
            self._write(header)

    def _write(self, cells: list[str]) -> None:
        if self._file is None:
            raise ValueError("the history is closed, no row can be written")
        csv.writer(self._file, lineterminator="\n").writerow(cells)
        self._file.flush()


def first_rows(path: Path, rows: int, comm: MPI.Comm) -> dict[str, list[float]]:
    """The first rows of a history. Collective.

    Args:
        path: The file.
        rows: Number of rows.
        comm: Communicator of the run.

    Returns:
        Column name without its unit -> values, on all ranks.

    Raises:
        ValueError: There are fewer rows.
        OSError: It cannot be read, on all ranks.
    """
    table: dict[str, list[float]] = {}

    def read() -> None:
        columns = read_history(path)
        found = min(len(values) for values in columns.values())
        if found < rows:
            raise ValueError(f"{path} has {found} rows, fewer than the {rows} that were written before the checkpoint")
        table.update({name: values[:rows].tolist() for name, values in columns.items()})

    on_root(comm, read)
    return dict(comm.bcast(table))


def _kept_rows(path: Path, header: list[str], rows: int) -> str:
    """The header and the first rows of a history that is gone on with."""
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    older = next(csv.reader(lines[:1]))
    if older != header:
        raise ValueError(f"{path} has other columns: {sorted(set(older) ^ set(header))} are in one of both only")
    return "".join(lines[: 1 + rows])


@checked
def read_history(path: Path | str) -> dict[str, NDArray[np.float64]]:
    """Read a history written by `HistoryWriter`, also one that is still growing.

    Args:
        path: The file.

    Returns:
        Column name without its unit -> values, one per complete row.
    """
    return {name: values for name, _, values in labelled_columns(path)}


def labelled_columns(path: Path | str) -> list[tuple[str, str, NDArray[np.float64]]]:
    """Name, unit and values of each column of a history, also one that is still growing.

    Args:
        path: The file.

    Raises:
        ValueError: It is empty, or has something else than numbers.
        OSError: It cannot be read.
    """
    text = Path(path).read_text(encoding="utf-8")
    lines = text[: text.rfind("\n") + 1].splitlines()  # a run that was killed may leave half a row
    if not lines:
        raise ValueError("it is empty")
    header, *rows = csv.reader(lines)
    columns = np.array(rows, dtype=np.float64).reshape(-1, len(header)).T
    named = [(*label.removesuffix("]").split(" ["), "")[:2] for label in header]
    return [(name, unit, values) for (name, unit), values in zip(named, columns, strict=True)]


def write_summary(path: Path | str, values: Mapping[str, Any], comm: MPI.Comm) -> None:
    """Write the headline numbers of a run as JSON. Collective.

    The file is replaced in one go: a reader sees the old or the new one, never half of it. Numbers keep full
    precision, numpy types become plain ones, and a number that is not finite becomes null.

    Args:
        path: The file; folders are made.
        values: What to write; mappings and sequences may be nested.
        comm: Communicator of the run; its first rank writes.

    Raises:
        OSError: If the file cannot be written, on all ranks.
        TypeError: If a value has no JSON form, on all ranks.
    """

    def write() -> None:
        text = json.dumps(_plain(values), indent=2, ensure_ascii=False, allow_nan=False)
        replace_file(path, (text + "\n").encode())

    on_root(comm, write)


def claim_folder(folder: Path | str, comm: MPI.Comm, *, overwrite: bool = False, subfolders: bool = True) -> None:
    """Make sure that a folder has no results of an older run. Collective.

    Args:
        folder: The folder; it need not exist.
        comm: Communicator of the run.
        overwrite: Whether older histories, summaries and fields are removed; else they are refused.
        subfolders: Whether the same holds for its subfolders.

    Raises:
        FileExistsError: There is an older history, which is not to be overwritten, on all ranks.
    """

    def claim() -> None:
        older = sorted(Path(folder).glob(f"**/{HISTORY}" if subfolders else HISTORY))
        if older and not overwrite:
            raise FileExistsError(
                f"{older[0]} is of an older run: choose another folder, or have it overwritten (overwrite=True, "
                "--overwrite)"
            )
        for history in older:
            history.unlink()
            history.with_name(SUMMARY).unlink(missing_ok=True)
            for fields in history.parent.glob("*.bp"):
                shutil.rmtree(fields)

    on_root(comm, claim)


def on_root(comm: MPI.Comm, action: Callable[[], object]) -> None:
    """Run an action on the first rank; what it raises is raised on every rank. Collective.

    Args:
        comm: Communicator of the run.
        action: What to do.
    """
    error = None
    if comm.rank == 0:
        try:
            action()
        except Exception as raised:
            error = raised
    error = comm.bcast(error, root=0)
    if error is not None:
        raise error


def _cell(name: str, value: float) -> str:
    """A number as CSV text that reads back to the same bits."""
    try:
        return str(int(value)) if isinstance(value, Integral) else repr(float(value))
    except (TypeError, ValueError):
        raise ValueError(f"row has {name} = {value!r}, a number is needed") from None


def _plain(value: Any) -> Any:
    """A value in the types JSON knows."""
    if isinstance(value, Mapping):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return str(value) if isinstance(value, Path) else value
