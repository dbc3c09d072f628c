"""Table of the Newton iterations of a run: residual, displacement and energy of each, as in Table 4.7 of the thesis."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

import numpy as np

from cutsim.analysis.stepping import Problem, StepReport
from cutsim.base.signatures import checked
from cutsim.base.units import Units
from cutsim.results.checkpoint_file import RECORDERS
from cutsim.results.folder import ITERATIONS
from cutsim.results.output import Closing, HistoryWriter, labelled_columns
from cutsim.results.recording import history_units
from cutsim.solvers.convergence import Iteration

#: What is judged, and its kind of quantity.
NORMS = {"residual": "force", "displacement": "length", "energy": "energy"}
# the start of the solve, the present iterate, what is required
_OF = ("_initial", "", "_required")
_COLUMNS = {"step": "one", "time": "time", "iteration": "one"} | {
    f"{name}{of}": kind for name, kind in NORMS.items() for of in _OF
}


class IterationTable(Closing):
    """Recorder that writes ``iterations.csv``, a row for each Newton iteration of each step. Collective.

    Each of `cutsim.solvers.convergence.Norms` has its value at the start of the solve, the present one, and
    the one that is required, infinite where it is no criterion. Norms are plain ones; the thesis and FEBio print the
    squares of residual and displacement. Use it as a context manager, and beside a `Recording` in the same folder.

    Args:
        folder: Where the file goes.
        problem: The problem. If it was resumed from a checkpoint, rows written after the checkpoint are removed.
        units: Units of the header; in a plane problem forces and energies are per width.

    Raises:
        OSError: The file cannot be written, on all ranks.
        ValueError: The file of a resumed run has fewer rows than were written before the checkpoint.
    """

    @checked
    def __init__(self, folder: Path | str, problem: Problem, units: Units | None = None) -> None:
        state = problem.state
        comm, path, name = state.mesh.comm, Path(folder) / ITERATIONS, f"{RECORDERS}table of iterations"
        resumed: bool = name in state.memory.awaited and comm.bcast(path.exists())
        self._rows = state.memory.value(name, 0)
        if not resumed:
            self._rows.set(0)
        self._table = HistoryWriter(path, _COLUMNS, history_units(problem, units), comm, self._rows.committed)

    def __call__(self, report: StepReport) -> None:
        """Write the iterations of an accepted step. Collective."""
        for number, iteration in enumerate(report.outcome.history, 1):
            row = {"step": report.number, "time": report.time, "iteration": number}
            self._table.append(row | dict(_norms(iteration)))
        self._rows.set(self._rows.committed + len(report.outcome.history))

    def close(self) -> None:
        """Close the file; a second call does nothing."""
        self._table.close()


@dataclass(frozen=True)
class HardestStep:
    """Accepted step of a run that took most iterations, in words for a table.

    Attributes:
        step: Its number.
        time: Time at its end with its unit.
        titles: Titles of the columns of `rows`.
        rows: A row for each norm of each iteration.
    """

    step: int
    time: str
    titles: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def hardest_step(folder: Path | str) -> HardestStep | None:
    """The step of a run that took most iterations; None if no step was iterated, or there is no table of them.

    Args:
        folder: Folder of the run.

    Raises:
        OSError: The table cannot be read.
        ValueError: It is no such table.
    """
    if not (Path(folder) / ITERATIONS).exists():
        return None
    columns = {name: (unit, values) for name, unit, values in labelled_columns(Path(folder) / ITERATIONS)}
    if missing := set(_COLUMNS) - set(columns):
        raise ValueError(f"it has no {', '.join(sorted(missing))}")
    iteration = columns["iteration"][1]
    if not len(iteration):
        return None
    last = int(np.argmax(iteration))
    first = last - int(iteration[last]) + 1
    rows = [
        (f"{iteration[i]:.0f}", f"{name} [{columns[name][0]}]", *(_number(columns[f"{name}{of}"][1][i]) for of in _OF))
        for i in range(first, last + 1)
        for name in reversed(NORMS)
    ]
    unit, times = columns["time"]
    titles = ("iteration", "norm", "initial", "current", "required")
    return HardestStep(int(columns["step"][1][last]), f"{times[last]:.4g} {unit}", titles, tuple(rows))


def _number(value: float) -> str:
    return f"{value:.6e}" if isfinite(value) else "–"


def _norms(iteration: Iteration) -> Iterator[tuple[str, float]]:
    for name in NORMS:
        for of, norms in zip(_OF, (iteration.initial, iteration.current, iteration.required), strict=True):
            yield f"{name}{of}", getattr(norms, name)
