"""Recording of a run in a folder: history, fields, progress."""

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from dolfinx import fem
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.analysis.steps import Problem, StepReport
from cutsim.base.checks import above, count, require, require_number
from cutsim.base.kinematics import Expr
from cutsim.base.signatures import checked
from cutsim.base.terms import Columns, FacetShowing, offering
from cutsim.base.units import Units
from cutsim.results.checkpoints import Checkpoints, ended_together
from cutsim.results.field_files import FieldWriter, Format
from cutsim.results.folder import HISTORY, SUMMARY
from cutsim.results.output import HistoryWriter, claim_folder, first_rows, write_summary
from cutsim.results.progress import Progress


@dataclass(frozen=True)
class _Written:
    """Rows of the history so far, and the time of a step whose fields are not written yet."""

    rows: int = 0
    pending: float | None = None


class Recording:
    """Recorder of a run: pass it to `cutsim.analysis.stepping.run`. Use it as a context manager; collective.

    Writes ``history.csv`` row by row and, every few steps and after the last, also if the run fails or is stopped,
    files of fields (``displacement``, ``fields`` and one for each crack), and shows progress. It ends with one line
    that says whether the run is to be trusted, and with the same in ``summary.json``.

    Args:
        folder: Where the files go.
        problem: The problem.
        until: Time at which the run ends.
        title: What is running, in a word or two, for the progress bar.
        units: Units of the history's header; in a plane problem forces and energies are per width.
        show: Label → column, for the progress bar.
        extra: Further columns, computed from those of the step on all ranks.
        derived: Name → UFL expression of fields such as stress.
        every: Fields are written every so many steps, ≥ 1; 0 for no fields.
        overwrite: Whether the results of an older run in the folder are replaced.
        checkpoints: Writes checkpoints during the run and at its end. A problem that was resumed from one goes on in
            its folder: rows of the history after the checkpoint are removed, and fields go to files of their own
            (``displacement_2.bp`` and so on).
        quiet: Whether no progress is shown.
        format: Format of the fields; see `cutsim.results.field_files.FieldWriter`.

    Attributes:
        history: Column → list of values so far, the same on all ranks.

    Raises:
        FileExistsError: The folder has the history of an older run, which is not to be overwritten.
        ValueError: The run ends before it begins, `every` is no count, a column to show does not exist (at the first
            step), or the history of a resumed run has fewer rows than were written before the checkpoint.
    """

    @checked
    def __init__(
        self,
        folder: Path | str,
        problem: Problem,
        until: float,
        *,
        title: str = "run",
        units: Units | None = None,
        show: Mapping[str, str] | None = None,
        extra: Callable[[Columns], Columns] = lambda _: {},
        derived: Mapping[str, Expr] | None = None,
        every: int = 5,
        overwrite: bool = False,
        checkpoints: Checkpoints | None = None,
        quiet: bool = False,
        format: Format | None = None,
    ) -> None:
        require_number("every", every, count())
        require_number("until", until, above(problem.state.time_old, "the time of the state"))
        self.folder, self.problem, self._units = Path(folder), problem, history_units(problem, units)
        self._title, self._until, self._values = title, until, dict[str, Any]()
        self._show, self._extra = dict(show or {}), extra
        self._checkpoints, self._stack = checkpoints, ExitStack()
        resumed = self._claim(overwrite=overwrite)
        self.history = self._older() if resumed else dict[str, list[float]]()
        self._table: HistoryWriter | None = None
        comm, start = problem.state.mesh.comm, problem.state.time_old
        self._progress = self._stack.enter_context(Progress(until, comm, title, start=start, quiet=quiet))
        self._fields: _FieldFiles | None = None
        if every:
            options = {"anew": not resumed, "format": format}
            self._fields = _FieldFiles(self.folder, problem, derived or {}, every, self._stack, options)

    def _claim(self, *, overwrite: bool) -> bool:
        """Make sure that the folder is that of this run; whether a resumed run goes on there. Collective."""
        memory, comm, name = self.problem.state.memory, self.problem.state.mesh.comm, f"recording: {self._title}"
        resumed: bool = name in memory.awaited and comm.bcast((self.folder / HISTORY).exists())
        if not resumed:
            claim_folder(self.folder, comm, overwrite=overwrite, subfolders=False)
        self._written = memory.value(name, _Written())
        if not resumed:
            # the rows in another folder count from there
            self._written.set(_Written())
        if not resumed and self._checkpoints is not None:
            self._checkpoints.begin()
        return resumed

    def _older(self) -> dict[str, list[float]]:
        """The history up to the checkpoint."""
        rows, path = self._written.committed.rows, self.folder / HISTORY
        return first_rows(path, rows, self.problem.state.mesh.comm) if rows else {}

    def __call__(self, report: StepReport) -> None:
        """Record an accepted step. Collective."""
        path = self.problem.state.path
        columns: Columns = {"step": (float(report.number), "one"), "time": (report.time, "time")}
        columns["path"] = (path, "time")
        columns |= report.columns | self._extra(report.columns)
        columns["newton"] = (float(report.outcome.iterations), "one")
        columns["krylov"] = (float(report.outcome.linear_iterations), "one")
        columns["cuts"] = (float(report.cuts), "one")
        comm = self.problem.state.mesh.comm
        if self._table is None:
            kinds = {name: kind for name, (_, kind) in columns.items()}
            rows = self._written.committed.rows
            table = HistoryWriter(self.folder / HISTORY, kinds, self._units, comm, rows)
            self._table = self._stack.enter_context(table)
        row = {name: value for name, (value, _) in columns.items()}
        for name, value in row.items():
            self.history.setdefault(name, []).append(value)
        self._table.append(row)
        for column in self._show.values():
            require("show", column, column in row, f"one of the columns {', '.join(row)}")
        shown = {label: row[column] for label, column in self._show.items()}
        self._progress.update(report.time, step=report.number, **shown, iterations=report.outcome.iterations)
        written = self._written.committed
        self._written.set(replace(written, rows=written.rows + 1, pending=path))
        if self._fields is not None and report.number % self._fields.every == 0:
            self.write_fields(path)
        if self._checkpoints is not None and self._checkpoints.due():
            self._save(self._checkpoints)

    def write_fields(self, time: float) -> None:
        """Write the fields of the present state. Collective."""
        self._written.set(replace(self._written.committed, pending=None))
        if self._fields is not None:
            self._fields.write(time)

    def _save(self, checkpoints: Checkpoints) -> None:
        """Write a checkpoint; the rows that it counts come to the disk before it."""
        if self._table is not None:
            self._table.sync()
        checkpoints.save()

    def summary(self, values: Mapping[str, Any] | None = None) -> None:
        """Write ``summary.json``: verdict and reasons, how far the run came, and headline numbers. Collective.

        Args:
            values: Headline numbers, beside those given before; see `cutsim.results.output.write_summary`.
        """
        self._values |= values or {}
        write_summary(self.folder / SUMMARY, self._summary(), self.problem.state.mesh.comm)

    def _summary(self) -> dict[str, Any]:
        state = self.problem.state
        facts = {"time": state.time_old, "until": self._until, "unknowns": state.unknowns}
        return {**state.verdict.record(), **facts, **self._values}

    @property
    def complete(self) -> bool:
        """Whether the run has come to its end."""
        return self.problem.state.time_old >= self._until

    def column(self, name: str) -> NDArray[np.float64]:
        """A column of the history so far.

        Raises:
            ValueError: There is no such column.
        """
        require("column", name, name in self.history, f"one of {', '.join(self.history)}")
        return np.asarray(self.history[name])

    def columns(self) -> dict[str, NDArray[np.float64]]:
        """All columns of the history so far."""
        return {name: np.asarray(values) for name, values in self.history.items()}

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        state = self.problem.state
        together = ended_together(kind)
        with self._stack:
            if together and (pending := self._written.committed.pending) is not None:
                self.write_fields(pending)
            if together and self._checkpoints is not None:
                self._save(self._checkpoints)
            if not together:
                state.verdict.doubt("failed", f"ended at time {state.time_old:.6g} of {self._until:.6g} by {error!r}")
        summary = MPI.COMM_SELF if not together else state.mesh.comm
        if together or state.mesh.comm.rank == 0:
            write_summary(self.folder / SUMMARY, self._summary(), summary)
        self._progress.say(f"{self._title}: {state.verdict}")


def history_units(problem: Problem, units: Units | None) -> Units:
    """Units of the history of a problem: in a plane one, forces and energies are per width."""
    units, state = units or Units(), problem.state
    return units.per_width() if state.mesh.geometry.dim == 2 and not state.axisymmetric else units


class _FieldFiles:
    """Files with the fields of a problem every so many steps, those of its facets among them; collective."""

    def __init__(
        self,
        folder: Path,
        problem: Problem,
        derived: Mapping[str, Expr],
        every: int,
        stack: ExitStack,
        options: Mapping[str, Any],
    ) -> None:
        self.every = every
        self._facets = [_FacetFields(t) for t in offering(problem.terms, FacetShowing) if t.facet_fields]
        surfaces = {facets.term.name: facets.functions for facets in self._facets}
        writer = FieldWriter(folder, problem.state.u, {**problem.fields, **derived}, surfaces, **options)
        self._writer = stack.enter_context(writer)

    def write(self, time: float) -> None:
        """Write the present state."""
        for facets in self._facets:
            facets.update()
        self._writer.write(time)


class _FacetFields:
    """Facet means of a term as functions on the mesh of its facets."""

    def __init__(self, term: FacetShowing) -> None:
        self.term = term
        space = fem.functionspace(term.submesh, ("DG", 0))
        self._dofs = space.dofmap.list[:, 0]
        self.functions = [fem.Function(space, name=name) for name in term.facet_fields]

    def update(self) -> None:
        """Copy the present facet means."""
        for function in self.functions:
            function.x.array[self._dofs] = self.term.facet_mean(function.name)
