"""``cutsim fit``: values of a case from a measured curve."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cutsim.commands.case_files import CaseArgument, Changes, Quick, case_path, settings
from cutsim.commands.endings import Ending, ending_of_run, say
from cutsim.commands.options import Ranks, Width, console, on_ranks

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from cutsim.analysis.steps import StepReport
    from cutsim.cases import Case
    from cutsim.commands.folders import Source
    from cutsim.identify import Fit

    Vector = NDArray[np.float64]

logger = logging.getLogger(__name__)

EXAMPLES = (
    "cutsim fit mine.toml measured.csv --free law.toughness --free tool.friction=0.1 -j 2",
    'cutsim fit mine.toml machine.txt --free law.toughness=0.5:0.1:2 --csv-x "Travel:mm" --csv-y "Load:kN"',
)

# simulated curves of a fit
_SIMULATIONS = "simulations.jsonl"


def command(
    case: CaseArgument,
    data: Annotated[Path, typer.Argument(metavar="CURVE", help="Measured force over displacement.")],
    *,
    free: Annotated[
        list[str], typer.Option(metavar="KEY", help="What is fitted: KEY, KEY=guess or KEY=guess:low:high; repeat.")
    ],
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Folder; results/CASE-fit.")] = None,
    set_: Changes = None,
    jobs: Annotated[int, typer.Option("-j", "--jobs", min=1, help="Simulations at once.")] = 1,
    ranks: Ranks = 1,
    quick: Quick = False,
    csv_x: Annotated[str | None, typer.Option(help="Column of the abscissae: 'title' or 'title:unit'.")] = None,
    csv_y: Annotated[str | None, typer.Option(help="Column of the ordinates: 'title' or 'title:unit'.")] = None,
    width: Width = None,
) -> None:
    """Fit values of a case, such as toughness and friction, to a measured curve by many simulations.

    Prints the values with their 95 % intervals, and leaves the fitted case, its run and a plot over the measurement in
    the folder. Every simulation is kept: the same command goes on where it was interrupted.
    """
    on_ranks(ranks)
    from mpi4py import MPI

    from cutsim.cases import run_case
    from cutsim.commands.folders import read_source
    from cutsim.identify import converted

    path = case_path(case)
    folder = output or Path("results") / f"{path.stem}-fit"
    wanted = [_Free.of(text) for text in free]
    forward = Forward(path, tuple(settings(set_ or []).items()), quick, per_width=width is not None)
    start = forward.case({})
    _keep(folder, start)
    x, y = _measured(data, (csv_x, csv_y), start)
    y = y if width is None else y / converted(width, "mm", start.units)
    fit = _fitted(forward, {f.key: f.first(start) for f in wanted}, (x, y), wanted, folder / _SIMULATIONS, jobs)
    best = forward.case(fit.values)
    outcome = run_case(best, folder / "fitted", MPI.COMM_WORLD, overwrite=True, quiet=True)
    if MPI.COMM_WORLD.rank == 0:
        (folder / "fitted.toml").write_text(best.text, encoding="utf-8")
        _show(fit, read_source(data, csv_x, csv_y, width), folder)
        for reason in outcome.reasons:
            say(f"against the fitted run: {reason}")
    raise typer.Exit(ending_of_run(outcome) or (Ending.QUESTIONABLE if fit.systematic else Ending.TRUSTED))


@dataclass(frozen=True)
class Forward:
    """A case as a function of some of its values; a process of its own can call it.

    Args:
        path: The case file.
        changes: Other values of the case.
        quick: Whether it is reduced.
        per_width: Whether forces are to be those per width of a plane case.
    """

    path: Path
    changes: tuple[tuple[str, str], ...]
    quick: bool
    per_width: bool

    def case(self, values: Mapping[str, float]) -> Case:
        """The case with some values, in its units.

        Raises:
            CaseError: Something is wrong in it.
        """
        from cutsim.cases import read_case

        written = {key: f"{value:.10g}" for key, value in values.items()}
        return read_case(self.path, {**dict(self.changes), **written}, quick=self.quick)

    def __call__(self, values: Mapping[str, float]) -> tuple[Vector, Vector]:
        """The main curve of the case with some values. Collective.

        Raises:
            StepError: There is no equilibrium.
        """
        import numpy as np
        from mpi4py import MPI

        from cutsim.base.checks import require

        with _unsaid():
            simulation = self.case(values).build(MPI.COMM_WORLD)
        state = simulation.problem.state
        plane = state.mesh.geometry.dim == 2 and not state.axisymmetric
        require("width", self.per_width, self.per_width == plane, "given for plane cases, and only for those")
        rows: list[tuple[float, ...]] = []

        def record(report: StepReport) -> None:
            columns = {"time": (report.time, "time"), **report.columns, **simulation.columns(report.columns)}
            found = [columns[name] for name in simulation.curve]
            for name, (_, kind), wanted in zip(simulation.curve, found, ("length", "force"), strict=True):
                require("output.curve", name, kind == wanted, f"a column of a {wanted}, as it was measured")
            rows.append(tuple(value for value, _ in found))

        with _unsaid():
            simulation.run(record)
        where = ", ".join(f"{key} = {value:.5g}" for key, value in values.items())
        for reason in state.verdict.reasons:
            logger.info("at %s: %s", where, reason)
        x, y = np.array(rows).T
        return x, y


@contextmanager
def _unsaid() -> Iterator[None]:
    """Leave doubts to the fitted run, unless more is to be said: each simulation of a fit has the same."""
    package = logging.getLogger("cutsim")
    level = package.level
    if level in (logging.NOTSET, logging.WARNING):  # in a process of its own nothing is set
        package.setLevel(logging.ERROR)
    try:
        yield
    finally:
        package.setLevel(level)


@dataclass(frozen=True)
class _Free:
    """A value that is fitted.

    Attributes:
        key: Its key in the case.
        guess: First guess; None to take that of the case.
        bounds: Lower and upper bound, if any.
    """

    key: str
    guess: float | None = None
    bounds: tuple[float, float] | None = None

    @classmethod
    def of(cls, text: str) -> _Free:
        """Read ``law.toughness``, ``law.toughness=0.5`` or ``law.toughness=0.5:0.1:2``, guess and bounds.

        Raises:
            typer.BadParameter: It has none of these forms.
        """
        key, equals, numbers = text.partition("=")
        try:
            guess, *bounds = [float(number) for number in numbers.split(":")] if equals else [None]
            low, high = bounds or (None, None)
        except ValueError:
            wanted = "KEY, KEY=guess or KEY=guess:lowest:largest"
            raise typer.BadParameter(f"{text!r} must be of the form {wanted}", param_hint="--free") from None
        return cls(key, guess, None if low is None or high is None else (low, high))

    def first(self, case: Case) -> float:
        """The first guess, in the units of the case.

        Raises:
            typer.BadParameter: There is none, and the case has no number for the key.
        """
        from cutsim.cases.numbers import Numbers

        if self.guess is not None:
            return self.guess
        try:
            return Numbers(case.document.tables, case.units).number(self.key, None)
        except ValueError:
            words = f"the case has no number {self.key}; give a first guess: --free {self.key}=0.1"
            raise typer.BadParameter(words, param_hint="--free") from None


def _keep(folder: Path, case: Case) -> None:
    """Keep the simulations of an older fit if they are of the same case, else remove them. Collective."""
    from mpi4py import MPI

    from cutsim.base.files import replace_file
    from cutsim.results.folder import CASE
    from cutsim.results.output import on_root

    def keep() -> None:
        known = folder / CASE
        if not known.exists() or known.read_text(encoding="utf-8") != case.text:
            (folder / _SIMULATIONS).unlink(missing_ok=True)
            folder.mkdir(parents=True, exist_ok=True)
            replace_file(known, case.text.encode())

    on_root(MPI.COMM_WORLD, keep)


def _measured(data: Path, titles: tuple[str | None, str | None], case: Case) -> tuple[Vector, Vector]:
    """The measured curve in the units of the case."""
    from cutsim.commands.folders import read_columns

    x, y = read_columns(data, {"displacement": titles[0], "force": titles[1]}, case.units)
    return x.values, y.values


def _fitted(
    forward: Forward,
    guess: dict[str, float],
    curve: tuple[Vector, Vector],
    wanted: Sequence[_Free],
    store: Path,
    jobs: int,
) -> Fit:
    """The fit, whose simulations are kept as long as the case stays the same."""
    from cutsim.identify import fit_simulation

    bounds = {free.key: free.bounds for free in wanted if free.bounds}
    return fit_simulation(forward, guess, *curve, bounds=bounds, workers=jobs, store=store)


def _show(fit: Fit, measured: Source, folder: Path) -> None:
    """Print the values, and plot the fitted curve over the measured one."""
    from cutsim.commands.folders import overlaid, read_source

    overlaid([read_source(folder / "fitted"), measured]).plot(folder / "fit.png")
    names = ("fitted.toml", "fit.png", "fitted")
    console().print(str(fit), *(f"written: {folder / name}" for name in names), sep="\n", markup=False)
