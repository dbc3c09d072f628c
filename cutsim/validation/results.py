"""What a validation has found, kept as data from which the page is made."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from math import isfinite, log
from pathlib import Path
from typing import Any, Self

import numpy as np

from cutsim.base.files import replace_file
from cutsim.results.folder import SUMMARY
from cutsim.results.run_files import RunFiles
from cutsim.validation.readings import ReadingError, read_value
from cutsim.validation.rows import Row, Run

# part of a reference that is no error
_ROUNDING = 1e-8
#: Part of a tolerance below which errors are of what else is neglected, and say nothing of the mesh.
NEGLECTED = 0.1


@dataclass(frozen=True)
class Level:
    """A run of a study, after it has ended.

    Attributes:
        files: What it has left.
        status: How it has ended: 0 if a case was trusted, or the checks of a program have held.
        seconds: Its processor time, on all ranks [s].
    """

    files: RunFiles
    status: int
    seconds: float

    @property
    def unknowns(self) -> int | None:
        """Unknowns of the largest problem that it has solved; None if it does not say."""
        found = (RunFiles.read(path.parent).summary.get("unknowns") for path in self.files.folder.rglob(SUMMARY))
        return max((number for number in found if isinstance(number, int) and number), default=None)


@dataclass(frozen=True)
class Result:
    """What was found for a row.

    Attributes:
        key: Name of the run and name of the row, with a slash between.
        values: The value for each level of the study, the one that counts last; None where it could not be read.
        expected: The reference.
        error: Relative error of the last value, or the absolute one where zero is expected; None without a value.
        tolerance: What is allowed of it.
        order: `observed_order` of the values; None without a study, or where it shows none.
        reason: Why it is outside its tolerance or missing, in words; empty if it is inside.
        trusted: Whether the level that counts was trusted by its own verdict, or its program's checks have held.
        seconds: Processor time of the run, all levels together [s].
        unknowns: Unknowns of the largest problem; None if it is not known.
        made: Versions, date and machine that it was made with.
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
    made: str

    @property
    def inside(self) -> bool:
        """Whether the error is within the tolerance."""
        return self.error is not None and abs(self.error) <= self.tolerance


def judge(run: Run, row: Row, levels: Sequence[Level], made: str, *, quick: bool) -> Result:
    """Compare what runs have left with the reference of a row.

    Args:
        run: The run.
        row: The row.
        levels: Its levels, the one that counts last.
        made: Versions, date and machine.
        quick: Whether the tolerance of a quick validation holds.
    """
    other = row.quick if quick else None
    expected = row.expected if other is None or other.expected is None else other.expected
    tolerance = row.tolerance if other is None else other.tolerance
    values, reason = _values(row.value if other is None or other.value is None else other.value, levels)
    if quick and any(value is not None for value in values):
        values = [value for value in values if value is not None]  # those of finer meshes are not made
    error = None if values[-1] is None else (values[-1] - expected) / abs(expected or 1.0)
    if error is not None:
        share = f"{error:+.2%} off, {tolerance:.2%} allowed" if expected else f"{error:.3g}, {tolerance:.3g} allowed"
        reason = share if abs(error) > tolerance else ""
    return Result(
        key=f"{run.name}/{row.name}", values=tuple(values), expected=expected, error=error, tolerance=tolerance,
        order=observed_order(values, expected, row.refinement, NEGLECTED * tolerance), reason=reason,
        trusted=levels[-1].status == 0, seconds=round(sum(level.seconds for level in levels), 2),
        unknowns=levels[-1].unknowns, made=made,
    )  # fmt: skip


def _values(value: str | list[str], levels: Sequence[Level]) -> tuple[list[float | None], str]:
    """The value of each level, or each value of a program, and why the last one could not be read."""
    values, reason = list[float | None](), ""
    several = [(one, levels[-1]) for one in value] if isinstance(value, list) else [(value, level) for level in levels]
    for expression, level in several:
        try:
            values.append(read_value(expression, level.files))
            reason = ""
        except ReadingError as unreadable:
            values.append(None)
            reason = str(unreadable)
    return values, reason


def observed_order(values: Sequence[float | None], expected: float, ratio: float, least: float) -> float | None:
    """Observed order in the size of mesh or step.

    Of three levels or more it is that of the differences of the last three, which do not know the reference; of two,
    that of their errors.

    Args:
        values: The values, from coarse to fine; None where one is missing.
        expected: The reference.
        ratio: Ratio of the sizes of neighbours.
        least: Error, relative where the reference is not zero, below which two of them show no order.

    Returns:
        The order; None where differences or errors do not fall, change their sign, or are too small.
    """
    known = [value for value in values[-3:] if value is not None]
    if len(known) < max(2, min(len(values), 3)):
        return None
    falling, floor = (np.diff(known), _ROUNDING) if len(known) == 3 else (np.array(known) - expected, least)
    before, last = (float(part) for part in falling / abs(expected or 1.0))
    converges = before * last > 0 and abs(before) > abs(last) > max(floor, _ROUNDING)
    return log(before / last) / log(ratio) if converges else None


@dataclass(frozen=True)
class Findings:
    """Results of a validation.

    Attributes:
        results: The results by their keys.
    """

    results: Mapping[str, Result]

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read a file that `write` has written; nothing is found yet if there is none."""
        if not path.exists():
            return cls({})
        entries = json.loads(path.read_text(encoding="utf-8"))
        results = (Result(**{**entry, "values": tuple(entry["values"])}) for entry in entries)
        return cls({result.key: result for result in results})

    def write(self, path: Path) -> None:
        """Write the file in one go."""
        entries = [_rounded(asdict(result)) for result in self.results.values()]
        replace_file(path, (json.dumps(entries, indent=1, ensure_ascii=False) + "\n").encode())

    def with_results(self, results: Iterable[Result], order: Sequence[str]) -> Self:
        """The same with some results replaced, those of rows that are gone left out, in the order of some keys."""
        known = {**self.results, **{result.key: result for result in results}}
        return type(self)({key: known[key] for key in order if key in known})


def _rounded(value: Any) -> Any:
    """Numbers to eight digits, so that rounding of another machine is no difference."""
    if isinstance(value, float) and isfinite(value):
        return float(f"{value:.8g}")
    if isinstance(value, dict):
        return {key: _rounded(entry) for key, entry in value.items()}
    return [_rounded(entry) for entry in value] if isinstance(value, list | tuple) else value
