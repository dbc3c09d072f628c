"""Runs of a sweep in its folder: their case files, how each has ended, and their table."""

from __future__ import annotations

import csv
import json
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from cutsim.commands.endings import Ending
from cutsim.commands.jobs import Job
from cutsim.commands.variation import Variant

if TYPE_CHECKING:
    from cutsim.results.run_files import RunFiles

#: Endings of runs that are not repeated.
_ENDED = (Ending.TRUSTED, Ending.QUESTIONABLE, Ending.NO_EQUILIBRIUM)


@dataclass(frozen=True)
class SweepRun:
    """A run of a sweep.

    Attributes:
        variant: Its values.
        sweep: Folder of the sweep.
    """

    variant: Variant
    sweep: Path

    @property
    def folder(self) -> Path:
        """Folder of the run."""
        return self.sweep / self.variant.name

    @property
    def case(self) -> Path:
        """Its case file, complete."""
        return self.sweep / "cases" / f"{self.variant.name}.toml"

    @property
    def begun(self) -> bool:
        """Whether it has left a history."""
        from cutsim.results.folder import HISTORY

        return (self.folder / HISTORY).exists()

    @property
    def files(self) -> RunFiles:
        """What it has left."""
        from cutsim.results.run_files import RunFiles

        return RunFiles.read(self.folder)

    def is_of(self, text: str) -> bool:
        """Whether the folder is that of a case file."""
        return self.case.exists() and self.case.read_text(encoding="utf-8") == text

    def prepare(self, text: str, *, anew: bool) -> None:
        """Write the case file.

        Args:
            text: The file.
            anew: Whether what an older run has left is removed.
        """
        if anew:
            shutil.rmtree(self.folder, ignore_errors=True)
        self.case.parent.mkdir(parents=True, exist_ok=True)
        self.case.write_text(text, encoding="utf-8")

    def job(self, ranks: int) -> Job:
        """The command that runs it, or goes on with it where it was interrupted."""
        from cutsim.results.folder import has_checkpoint

        arguments = ["run", str(self.case), "-o", str(self.folder), "--overwrite"]
        if has_checkpoint(self.folder):
            arguments = ["resume", str(self.folder)]
        return Job(self.folder, ("-m", "cutsim", *arguments, "-n", str(ranks)))


class Statuses:
    """Exit statuses of the runs of a sweep, kept in a file of its folder.

    Args:
        path: The file.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._known: dict[str, int] = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}

    def ended(self, run: SweepRun) -> bool:
        """Whether a run has come to an end that another try would not change."""
        return run.begun and self._known.get(run.variant.name) in _ENDED

    def note(self, name: str, status: int) -> None:
        """Keep the exit status of a run."""
        from cutsim.base.files import replace_file

        self._known[name] = status
        replace_file(self._path, (json.dumps(self._known, indent=2) + "\n").encode())

    def words(self, run: SweepRun) -> str:
        """How a run has ended, in words."""
        return described(self._known.get(run.variant.name, Ending.INTERRUPTED))

    def worst(self, runs: Sequence[SweepRun]) -> int:
        """The worst exit status of some runs."""
        return max((self._known.get(run.variant.name, Ending.INTERRUPTED) for run in runs), key=_severity)


def described(status: int) -> str:
    """An exit status in words."""
    return Ending(status).words if status in set(Ending) else f"exit status {status}"


def _severity(status: int) -> int:
    """Place of an exit status among all, the best first."""
    order = (*_ENDED, Ending.INTERRUPTED, Ending.BAD_INPUT, Ending.CANNOT_WRITE)
    return order.index(Ending(status)) if status in order else len(order)


def write_table(path: Path, runs: Sequence[SweepRun], statuses: Statuses) -> list[dict[str, str]]:
    """Write a row for each run: its values, how it has ended, and the numbers of its summary.

    Args:
        path: The file.
        runs: The runs.
        statuses: How they have ended.

    Returns:
        The rows.
    """
    rows = [
        {**run.variant.values, "run": run.variant.name, "ended": statuses.words(run), **_numbers(run.files)}
        for run in runs
    ]
    names = list(dict.fromkeys(name for row in rows for name in row))
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, names, restval="", lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    return rows


def _numbers(files: RunFiles) -> dict[str, str]:
    found = {name: value for name, value in files.summary.items() if isinstance(value, int | float)}
    return {name: f"{value:.7g}" for name, value in found.items()}
