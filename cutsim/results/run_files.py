"""What a run has left in its folder, read as far as it is there."""

import json
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np

from cutsim.base.arrays import Array
from cutsim.base.terms import ENTRIES
from cutsim.base.verdict import INTERRUPTED
from cutsim.results.folder import CASE, HISTORY, SUMMARY
from cutsim.results.output import labelled_columns

# abscissae and ordinates of the main curve, the first that there are
_ABSCISSAE = ("depth", "way", "opening", "deflection", "time")
_ORDINATES = ("force", "load")
# columns of the energy audit that it adds up
_AUDIT = tuple(f"energy_{entry}" for entry in ENTRIES)
# types of the entries of a summary that are looked at
_TYPES: Mapping[str, Any] = {
    "verdict": str, "reasons": list, "kinds": list, "time": int | float, "until": int | float,
    "wall_time": int | float, "ranks": int,
    "curve": list, "mesh": dict, "versions": dict,
}  # fmt: skip
# part of the time of a run by which it may miss its end
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Column:
    """Column of a history.

    Attributes:
        name: Its name.
        unit: Symbol of its unit; empty if it has none.
        values: One number for each step.
    """

    name: str
    unit: str
    values: Array

    @property
    def words(self) -> str:
        """Its name in words."""
        return self.name.replace("_", " ")

    @property
    def label(self) -> str:
        """Its name in words, with the unit in brackets."""
        return f"{self.words} [{self.unit}]" if self.unit else self.words


@dataclass(frozen=True)
class Judgement:
    """What is to be thought of a run.

    Attributes:
        grade: "trusted", "questionable", "failed", "interrupted" or "unknown".
        sentence: The same in a sentence.
        reasons: What speaks against the result.
    """

    grade: str
    sentence: str
    reasons: tuple[str, ...] = ()


@dataclass(frozen=True)
class RunFiles:
    """Files of a run. Nothing is raised for what is missing or damaged; it is empty, and named in `missing`.

    Attributes:
        folder: The folder.
        summary: Entries of ``summary.json``.
        history: Columns of ``history.csv`` by name.
        case: Text of ``case.toml``.
        missing: What is not there, in words.
    """

    folder: Path
    summary: Mapping[str, Any]
    history: Mapping[str, Column]
    case: str
    missing: tuple[str, ...]

    @classmethod
    def read(cls, folder: Path | str) -> Self:
        """Read the files of a run.

        Args:
            folder: The folder.
        """
        missing: list[str] = []
        summary = _or_else({}, _summary, Path(folder) / SUMMARY, missing)
        history = _or_else({}, _history, Path(folder) / HISTORY, missing)
        case = _or_else("", lambda path: path.read_text(encoding="utf-8"), Path(folder) / CASE, missing)
        return cls(Path(folder), summary, history, case, tuple(missing))

    @property
    def title(self) -> str:
        """Title of the case, or the name of the folder."""
        return str(self.tables.get("title") or self.folder.resolve().name)

    @cached_property
    def tables(self) -> Mapping[str, Any]:
        """The case as tables; empty if it cannot be read."""
        try:
            return tomllib.loads(self.case)
        except tomllib.TOMLDecodeError:
            return {}

    @property
    def units(self) -> Mapping[str, Any]:
        """Table of the case with its units."""
        units = self.tables.get("units")
        return units if isinstance(units, Mapping) else {}

    @property
    def steps(self) -> int:
        """Steps in the history."""
        return len(next(iter(self.history.values())).values) if self.history else 0

    @property
    def complete(self) -> bool:
        """Whether the run has come to its end, as far as is known."""
        time, until = self.summary.get("time"), self.summary.get("until")
        return time is not None and until is not None and time >= until * (1 - _ROUNDING)

    @property
    def judgement(self) -> Judgement:
        """The verdict on the run."""
        if "verdict" not in self.summary:
            return Judgement("unknown", "There is no verdict: the run has not ended, or was ended from outside.")
        reasons = tuple(map(str, self.summary.get("reasons", ())))
        if not self.complete:
            interrupted = INTERRUPTED in self.summary.get("kinds", ())
            return Judgement("interrupted" if interrupted else "failed", f"{self._end}.", reasons)
        if self.summary["verdict"] == "trusted":
            return Judgement("trusted", "The run is complete, and nothing speaks against its result.")
        count = "one reason speaks" if len(reasons) == 1 else f"{len(reasons)} reasons speak"
        return Judgement("questionable", f"The run is complete, but {count} against its result.", reasons)

    @property
    def _end(self) -> str:
        time, until = self.summary.get("time"), self.summary.get("until")
        if time is None or until is None:
            return "The run has not come to its end"
        unit = self.history["time"].unit if "time" in self.history else ""
        share = f"{time / until:.0%}" if until else "nothing"
        return (
            f"The run has not come to its end: it ended at time {time:.4g} of {until:.4g} {unit}".rstrip()
            + f", {share}"
        )

    @property
    def curve(self) -> tuple[str, str] | None:
        """Columns of the main curve; None if there are none or they are empty.

        Abscissa and ordinate under ``"curve"`` in the summary win, if there are such columns.
        """
        if not self.steps:
            return None
        given = [str(name) for name in self.summary.get("curve", ())] + ["", ""]
        x = next((name for name in (given[0], *_ABSCISSAE) if name in self.history), None)
        forces = [name for name in self.history if name.endswith(("_force", "_reaction")) or "_force_" in name]
        y = next((name for name in (given[1], *_ORDINATES, *forces) if name in self.history), None)
        return (x, y) if x and y else None

    @property
    def missed_energy(self) -> float | None:
        """What the energy audit missed at the worst, over the largest turnover of the run [–]; None without one."""
        entries = [column.values for name, column in self.history.items() if name in _AUDIT]
        if not entries or not self.steps or not {"work_external", "energy_closure"} <= set(self.history):
            return None
        closure, work = (self.history[name].values for name in ("energy_closure", "work_external"))
        turnover = np.maximum.accumulate(np.maximum(np.abs(work), np.abs(entries).sum(axis=0)))
        return float(np.abs(closure * turnover).max() / turnover[-1]) if turnover[-1] else 0.0

    def case_rows(self) -> Iterator[tuple[str, list[tuple[str, str]]]]:
        """Tables of the case by their names, each with its keys and values, those without a table first."""
        yield from _tables("", self.tables)


def _summary(path: Path) -> Mapping[str, Any]:
    """Entries of a summary; those of another type than they are written with are left out."""
    entries = json.loads(path.read_text(encoding="utf-8"))
    if not isinstance(entries, dict):
        raise ValueError("it is no table of names and values")
    return {name: value for name, value in entries.items() if isinstance(value, _TYPES.get(name, object))}


def _history(path: Path) -> Mapping[str, Column]:
    return {name: Column(name, unit, values) for name, unit, values in labelled_columns(path)}


def _or_else(otherwise: Any, read: Any, path: Path, missing: list[str]) -> Any:
    """What a function reads from a file, or something else if that fails, which is noted."""
    try:
        return read(path)
    except FileNotFoundError:
        missing.append(f"{path.name} is not there")
    except (OSError, ValueError) as error:
        missing.append(f"{path.name} cannot be read: {error}")
    return otherwise


def _tables(name: str, table: Mapping[str, Any]) -> Iterator[tuple[str, list[tuple[str, str]]]]:
    inner = {key: value for key, value in table.items() if isinstance(value, Mapping)}
    for key, value in table.items():
        if isinstance(value, list) and value and all(isinstance(entry, Mapping) for entry in value):
            inner |= {f"{key} {number}": entry for number, entry in enumerate(value, start=1)}
    rows = [(key, _shown(value)) for key, value in table.items() if key not in inner and f"{key} 1" not in inner]
    if rows:
        yield name, rows
    for key, value in inner.items():
        yield from _tables(f"{name}.{key}".lstrip("."), value)


def _shown(value: Any) -> str:
    if isinstance(value, list):
        return "[" + ", ".join(map(_shown, value)) + "]"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key} = {_shown(entry)}" for key, entry in value.items()) + "}"
    return {True: "true", False: "false"}[value] if isinstance(value, bool) else str(value)
