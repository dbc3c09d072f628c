"""What a validation has found, kept as data from which the page is made."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from math import isfinite, log
from pathlib import Path
from typing import Any, Self

from cutsim.base.files import replace_file
from cutsim.results.run_files import RunFiles
from cutsim.validation.readings import ReadingError, read_value
from cutsim.validation.rows import Row, Run


@dataclass(frozen=True)
class Result:
    """What was found for a row.

    Attributes:
        key: Name of the run and name of the row, with a slash between.
        values: The value for each level of the study, the one that counts last; None where it could not be read.
        expected: The reference.
        error: Relative error of the last value, or the absolute one where zero is expected; None without a value.
        tolerance: What is allowed of it.
        order: Observed order in the size of mesh or step; None without a study.
        reason: Why it is outside its tolerance or missing, in words; empty if it is inside.
        trusted: Whether the run was trusted by its own verdict.
        seconds: Time of the run on all ranks, all levels together [s].
        unknowns: Unknowns of the last level; None if it is not known.
        command: Command that runs it alone.
    """

    key: str
    values: tuple[float | None, ...]
    expected: float
    error: float | None
    tolerance: float
    order: float | None
    reason: str
    trusted: bool
    seconds: float
    unknowns: int | None
    command: str

    @property
    def inside(self) -> bool:
        """Whether the error is within the tolerance."""
        return self.error is not None and abs(self.error) <= self.tolerance


def judge(run: Run, row: Row, levels: Sequence[RunFiles], *, quick: bool) -> Result:
    """Compare what runs have left with the reference of a row.

    Args:
        run: The run.
        row: The row.
        levels: Files of each level, the one that counts last.
        quick: Whether the tolerance of a quick validation holds.
    """
    other = row.quick if quick else None
    expected = row.expected if other is None or other.expected is None else other.expected
    tolerance = row.tolerance if other is None else other.tolerance
    values, reason = list[float | None](), ""
    for files in levels:
        try:
            values.append(read_value(row.value, files))
        except ReadingError as unreadable:
            values.append(None)
            reason = str(unreadable)
    last = values[-1] if values else None
    error = None if last is None else (last - expected) / abs(expected or 1.0)
    if error is not None and abs(error) > tolerance:
        reason = f"{error:+.2%} off, {tolerance:.2%} allowed" if expected else f"{error:.3g}, {tolerance:.3g} allowed"
    elif error is None and not reason:
        reason = "the run has left nothing"
    summary: Mapping[str, Any] = levels[-1].summary if levels else {}
    return Result(
        key=f"{run.name}/{row.name}", values=tuple(values), expected=expected, error=error, tolerance=tolerance,
        order=_order(values, expected, run.refinement), reason=reason, trusted=summary.get("verdict") == "trusted",
        seconds=round(sum(map(_seconds, levels)), 1), unknowns=_unknowns(summary),
        command=f"cutsim validate --only {run.name}",
    )  # fmt: skip


def _order(values: Sequence[float | None], expected: float, ratio: float) -> float | None:
    """Observed order of the last two levels against the reference; None where either meets it or is missing."""
    if len(values) < 2:
        return None
    before, last = values[-2:]
    if before is None or last is None or before == expected or last == expected:
        return None
    return log(abs(before - expected) / abs(last - expected)) / log(ratio)


def _seconds(files: RunFiles) -> float:
    return float(files.summary.get("wall_time", 0.0) * files.summary.get("ranks", 1))


def _unknowns(summary: Mapping[str, Any]) -> int | None:
    mesh = summary.get("mesh")
    found = summary.get("unknowns", mesh.get("unknowns") if isinstance(mesh, Mapping) else None)
    return found if isinstance(found, int) else None


@dataclass(frozen=True)
class Findings:
    """Results of a validation, with what it was made with.

    Attributes:
        results: The results by their keys.
        made: Versions, date, machine and whether it was quick: what a reader needs to make it again.
    """

    results: Mapping[str, Result]
    made: Mapping[str, str]

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read a file that `write` has written; nothing is found yet if there is none."""
        if not path.exists():
            return cls({}, {})
        data = json.loads(path.read_text(encoding="utf-8"))
        results = (Result(**{**entry, "values": tuple(entry["values"])}) for entry in data["results"])
        return cls({result.key: result for result in results}, data["made"])

    def write(self, path: Path) -> None:
        """Write the file in one go."""
        data = {"made": dict(self.made), "results": [_rounded(asdict(result)) for result in self.results.values()]}
        replace_file(path, (json.dumps(data, indent=1, ensure_ascii=False) + "\n").encode())

    def with_results(self, results: Iterable[Result], made: Mapping[str, str], order: Sequence[str]) -> Self:
        """The same with some results replaced, those of rows that are gone left out, in the order of some keys."""
        known = {**self.results, **{result.key: result for result in results}}
        return type(self)({key: known[key] for key in order if key in known}, made)


def _rounded(value: Any) -> Any:
    """Numbers to eight digits, so that rounding of another machine is no difference."""
    if isinstance(value, float) and isfinite(value):
        return float(f"{value:.8g}")
    if isinstance(value, dict):
        return {key: _rounded(entry) for key, entry in value.items()}
    return [_rounded(entry) for entry in value] if isinstance(value, list | tuple) else value
