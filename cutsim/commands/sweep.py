"""``cutsim sweep``: a case with all combinations of some values."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cutsim.commands.case_files import CaseArgument, Changes, Quick, case_path, settings
from cutsim.commands.endings import Ending
from cutsim.commands.jobs import Job, Runner
from cutsim.commands.options import Overwrite, Ranks, console, table
from cutsim.commands.sweep_runs import Statuses, SweepRun, described, write_table
from cutsim.commands.variation import Variant, Variation, variants

if TYPE_CHECKING:
    from rich.console import Console

EXAMPLES = (
    "cutsim sweep blade --quick --vary tool.friction=0:0.3:4 -j 2",
    "cutsim sweep mine.toml --vary tool.friction=0.1:0.8:8 --vary law.toughness=0.5,0.8 -j 4",
    "cutsim sweep mine.toml --vary law.toughness=0.1:10:5:log --cluster slurm --cluster-option slurm_partition=main",
)


def command(
    case: CaseArgument,
    *,
    vary: Annotated[
        list[str],
        typer.Option(metavar="KEY=VALUES", help="first:last:number, first:last:number:log, or values v,v,…; repeat."),
    ],
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Folder; results/CASE-sweep.")] = None,
    set_: Changes = None,
    jobs: Annotated[int, typer.Option("-j", "--jobs", min=1, help="Runs at once.")] = 1,
    ranks: Ranks = 1,
    quick: Quick = False,
    overwrite: Overwrite = False,
    cluster: Annotated[str, typer.Option(help="Where they run: local, or slurm.")] = "local",
    cluster_option: Annotated[
        list[str] | None, typer.Option(metavar="KEY=VALUE", help="An option of submitit, such as slurm_time=60.")
    ] = None,
) -> None:
    """Run a case with all combinations of some values, each in a folder named by them.

    The same command goes on where it was interrupted: runs that have ended are not repeated. The folder has a table
    and a plot of all of them; runs that cannot be trusted, or did not come to their end, are marked in both.
    """
    path = case_path(case)
    folder = output or Path("results") / f"{path.stem}-sweep"
    found = variants([Variation.of(text) for text in vary])
    runs, statuses = [SweepRun(variant, folder) for variant in found], Statuses(folder / "statuses.json")
    texts = _texts(path, found, settings(set_ or []), quick=quick)
    ahead = _prepared(runs, texts, statuses, overwrite=overwrite)
    screen = console()
    screen.print(f"{len(runs)} runs in {folder}, {len(runs) - len(ahead)} of which have ended before", markup=False)
    runner = Runner(folder / "jobs", jobs, cluster, dict(map(_option, cluster_option or [])))
    _run(runner, [run.job(ranks) for run in ahead], statuses, screen)
    _report(folder, runs, statuses, screen)
    raise typer.Exit(statuses.worst(runs))


def _texts(path: Path, found: Sequence[Variant], changes: dict[str, str], *, quick: bool) -> list[str]:
    """Complete case files of the variants; all that is wrong in any of them is said before anything runs."""
    from cutsim.cases import CaseError, read_case

    texts, problems = list[str](), list[str]()
    for variant in found:
        try:
            texts.append(read_case(path, changes | variant.values, quick=quick).text)
        except CaseError as error:
            problems += error.problems
    if problems:
        raise CaseError(list(dict.fromkeys(problems)))
    return texts


def _option(text: str) -> tuple[str, Any]:
    """An option of submitit, as a number if it is one."""
    ((key, value),) = settings([text], "--cluster-option").items()
    return key, int(value) if value.isdecimal() else value


def _prepared(runs: Sequence[SweepRun], texts: Sequence[str], statuses: Statuses, *, overwrite: bool) -> list[SweepRun]:
    """The runs that are ahead, with their case files written.

    Raises:
        FileExistsError: A folder has a run of another case, which is not to be overwritten.
    """
    pairs = list(zip(runs, texts, strict=True))
    strangers = [run.folder for run, text in pairs if run.begun and not run.is_of(text)]
    if strangers and not overwrite:
        raise FileExistsError(f"{strangers[0]} is of another case: name another folder by -o, or use --overwrite")
    ahead = [(run, text) for run, text in pairs if overwrite or not statuses.ended(run)]
    for run, text in ahead:
        run.prepare(text, anew=overwrite or not (run.begun and run.is_of(text)))
    return [run for run, _ in ahead]


def _run(runner: Runner, jobs: Sequence[Job], statuses: Statuses, screen: Console) -> None:
    """Run jobs, and say how each has ended."""
    from rich.progress import Progress

    with Progress(console=screen, disable=not screen.is_terminal) as progress:
        task = progress.add_task("sweep", total=len(jobs))

        def done(job: Job, status: int) -> None:
            statuses.note(job.folder.name, status)
            progress.advance(task)
            hint = "" if status in (Ending.TRUSTED, Ending.QUESTIONABLE) else f", see {job.log}"
            screen.print(f"{job.folder.name}: {described(status)}{hint}", markup=False)

        runner.run(jobs, done)


def _report(folder: Path, runs: Sequence[SweepRun], statuses: Statuses, screen: Console) -> None:
    """Show the table of all runs, and write it with a plot and a page."""
    from cutsim.commands.folders import overlaid, read_source
    from cutsim.results.report import write_sweep_report

    rows = write_table(folder / "sweep.csv", runs, statuses)
    largest = dict.fromkeys(name for row in rows for name in row if name.startswith("largest_"))
    shown = [*runs[0].variant.values, "ended", *largest]
    screen.print(table(shown, [[row.get(name, "") for name in shown] for row in rows]))
    written = [folder / "sweep.csv"]
    if sources := [read_source(run.folder) for run in runs if run.begun]:
        overlaid(sources).plot(folder / "sweep.png")
        written.append(folder / "sweep.png")
    written.append(write_sweep_report(folder, {run.folder: run.variant.values for run in runs}))
    screen.print(*(f"written: {path}" for path in written), sep="\n", markup=False)
