"""``cutsim validate``: run what compares results with references, and make the page of it."""

from __future__ import annotations

import resource
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cutsim.commands.endings import Ending
from cutsim.commands.jobs import Job, Runner
from cutsim.commands.options import console, table
from cutsim.commands.sweep_runs import described

if TYPE_CHECKING:
    from rich.console import Console

    from cutsim.validation.results import Result
    from cutsim.validation.rows import Group, Run

_FULL, _QUICK = (Path("results/validation") / name for name in ("full", "quick"))
EXAMPLES = (
    "cutsim validate --quick -j 2",
    "cutsim validate --only dcb --only hertz",
    "cutsim validate --page",
)


def command(
    only: Annotated[list[str] | None, typer.Option(metavar="RUN", help="Run only these; repeat.")] = None,
    folder: Annotated[Path, typer.Option(help="Folder of the programs, with the files of rows in rows/.")] = Path(
        "tests/validation"
    ),
    docs: Annotated[Path, typer.Option(help="Folder of the page and of the results that it is made of.")] = Path(
        "docs"
    ),
    jobs: Annotated[int, typer.Option("-j", "--jobs", min=1, help="Runs at once.")] = 1,
    *,
    quick: Annotated[bool, typer.Option("--quick", help="Reduced runs; the page is left as it is.")] = False,
    page: Annotated[bool, typer.Option("--page", help="Make the page of the results that there are.")] = False,
) -> None:
    """Run cases and programs whose results have a reference, compare them, and make the page on validation.

    It belongs to a copy of the sources, whose rows it reads. A row outside its tolerance makes the exit code 1. Runs
    leave their files in results/validation.
    """
    from cutsim.validation.rows import read_rows

    groups = read_rows(folder / "rows")
    chosen = _chosen(groups, only or [], quick=quick) if not page else []
    screen = console()
    found = _results(chosen, folder, jobs, quick=quick, screen=screen)
    if not quick:
        _copy_figures(chosen, docs, screen)
        _write(read_rows(folder / "rows"), found, folder, docs)  # anew: a run takes minutes, in which rows may be added
    outside = [result for result in found if not result.inside]
    if found:
        rows = [[r.key, _short(r.values[-1]), _short(r.expected), "" if r.inside else r.reason] for r in found]
        screen.print(table(["row", "computed", "expected", ""], rows))
        screen.print(f"{len(found) - len(outside)} of {len(found)} rows are within their tolerance", markup=False)
    raise typer.Exit(Ending.QUESTIONABLE if outside else Ending.TRUSTED)


@dataclass(frozen=True)
class _TimedJob(Job):
    """A job that notes its processor time."""

    def run(self) -> int:
        """As that of a job."""
        before = _processor_time()
        status = super().run()
        self._note.write_text(f"{_processor_time() - before:.2f}", encoding="utf-8")
        return status

    @property
    def _note(self) -> Path:
        return self.folder / "seconds.txt"

    @property
    def seconds(self) -> float:
        """Processor time of its processes [s]; nan if it has not ended."""
        return float(self._note.read_text(encoding="utf-8")) if self._note.exists() else float("nan")


def _processor_time() -> float:
    """That of all processes which this one has started and which have ended [s]."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def _short(value: float | None) -> str:
    return "" if value is None else f"{value:.6g}"


def _chosen(groups: Sequence[Group], only: Sequence[str], *, quick: bool) -> list[Run]:
    """The runs that are asked for; quick ones with those of their rows that have a quick tolerance.

    Raises:
        ValueError: There is no run of a name that is asked for.
    """
    runs = {run.name: run for group in groups for run in group.run}
    for name in only:
        if name not in runs:
            raise ValueError(f"--only {name}: there is no such run; there are {', '.join(runs)}")
    found = [run for name, run in runs.items() if not only or name in only]
    if not quick:
        return found
    reduced = (run.model_copy(update={"row": [row for row in run.row if row.quick]}) for run in found)
    return [run for run in reduced if run.row]


def _results(runs: Sequence[Run], folder: Path, jobs: int, *, quick: bool, screen: Console) -> list[Result]:
    """Run everything that was chosen, and judge what was not interrupted."""
    from cutsim.results.run_files import RunFiles
    from cutsim.validation.results import Level, judge

    base = _QUICK if quick else _FULL
    levels = {run.name: _jobs(run, folder, base, quick=quick) for run in runs}
    statuses = dict[Path, int]()

    def done(job: Job, status: int) -> None:
        statuses[job.folder] = status
        screen.print(f"{job.folder.relative_to(base)}: {described(status)}", markup=False)

    ahead = [job for found in levels.values() for job in found]
    for job in ahead:
        shutil.rmtree(job.folder, ignore_errors=True)
    if ahead:
        Runner(base / "jobs", jobs, "local", {}).run(ahead, done)
    found, made = list["Result"](), _made() if runs else ""
    for run in runs:
        jobs_of = levels[run.name]
        if all(statuses[job.folder] != Ending.INTERRUPTED for job in jobs_of):
            ended = [Level(RunFiles.read(job.folder), statuses[job.folder], job.seconds) for job in jobs_of]
            found += [judge(run, row, ended, made, quick=quick) for row in run.row]
    return found


def _jobs(run: Run, folder: Path, base: Path, *, quick: bool) -> list[_TimedJob]:
    """The commands of a run, one for each level of its study; in a quick validation only one."""
    return [
        _TimedJob(target, _command(run, changes, folder, target, quick=quick))
        for changes, target in _levels(run, base, quick=quick)
    ]


def _levels(run: Run, base: Path, *, quick: bool) -> list[tuple[dict[str, Any], Path]]:
    """Changes of each level, and its folder; of the coarsest only if quick, where a program has a mesh of its own."""
    if quick:
        return [({} if run.program else run.levels[0], base / run.name)]
    several = len(run.levels) > 1
    return [
        (changes, base / (f"{run.name}-{number}" if several else run.name))
        for number, changes in enumerate(run.levels, start=1)
    ]


def _command(run: Run, changes: dict[str, Any], folder: Path, target: Path, *, quick: bool) -> tuple[str, ...]:
    reduced = ["--quick"] if quick else []
    if run.program:
        options = [part for key, value in changes.items() for part in (f"--{key}", str(value))]
        return (str(folder / f"{run.program}.py"), *run.arguments, *options, *reduced, "--out", str(target))
    sets = [part for key, value in changes.items() for part in ("--set", f"{key}={value}")]
    return ("-m", "cutsim", "run", run.case, *sets, *reduced, "-o", str(target), "--overwrite")


def _copy_figures(runs: Sequence[Run], docs: Path, screen: Console) -> None:
    """Copy the pictures of runs that are figures of the pages, and name those that are missing."""
    (docs / "figures").mkdir(exist_ok=True)
    for run in runs:
        for name, picture in run.figures.items():
            source = _levels(run, _FULL, quick=False)[-1][1] / picture
            if source.exists():
                shutil.copyfile(source, docs / "figures" / f"{name}{source.suffix}")
            else:
                screen.print(f"figure {name}: {run.name} has left no {picture}", markup=False)


def _write(groups: Sequence[Group], found: Sequence[Result], folder: Path, docs: Path) -> None:
    """Keep results, and make the page and the tables of other pages of all that there are."""
    from cutsim.base.files import replace_file
    from cutsim.validation.figure import draw
    from cutsim.validation.page import FIGURE, keyed, page, with_excerpts
    from cutsim.validation.peers import Comparisons
    from cutsim.validation.results import Findings

    data = docs / "validation" / "results.json"
    known = Findings.read(data)
    if found:
        known = known.with_results(found, [key for key, _ in keyed(groups)])
        known.write(data)
    if not (docs / FIGURE).exists() or found:
        (docs / FIGURE).parent.mkdir(exist_ok=True)
        draw(docs / FIGURE, groups, known)
    peers = Comparisons.read(folder / "peers" / "problems.toml", folder / "peers.json")
    target, readme = docs / "validation.md", docs.parent / "README.md"
    replace_file(target, page(target.read_text(encoding="utf-8"), groups, known, peers).encode())
    replace_file(readme, with_excerpts(readme.read_text(encoding="utf-8"), groups, known).encode())


def _made() -> str:
    """Versions, date and machine."""
    from datetime import UTC, datetime
    from os import cpu_count

    import dolfinx

    import cutsim
    from cutsim.base.versions import petsc_version

    today = datetime.now(UTC).date().isoformat()
    versions = {"cutsim": cutsim.__version__, "dolfinx": dolfinx.__version__, "PETSc": petsc_version()}
    return ", ".join([today, *(f"{name} {version}" for name, version in versions.items()), f"{cpu_count()} cores"])
