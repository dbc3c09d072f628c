"""``cutsim run``: a case from its file to its results."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from cutsim.commands.case_files import CaseArgument, Changes, Quick, case_path, settings
from cutsim.commands.endings import Ending, ending_of_run, first_rank, say
from cutsim.commands.options import Overwrite, Ranks, console, on_ranks, quiet

if TYPE_CHECKING:
    from cutsim.cases import RunOutcome

EXAMPLES = (
    "cutsim run blade --quick",
    "cutsim run mine.toml -o results/friction --set tool.friction=0.3",
    "cutsim run mine.toml -n 2 --overwrite",
)

_ADVICE = 'What may be the cause, and what helps, is on the page "When a run does not converge" of the documentation.'


def command(
    case: CaseArgument,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Folder; results/CASE by default.")] = None,
    set_: Changes = None,
    ranks: Ranks = 1,
    quick: Quick = False,
    overwrite: Overwrite = False,
) -> None:
    """Run a case, and leave history, pictures, fields and a report in a folder.

    Ctrl-C or SIGTERM ends the run after its step; what it has computed is kept, and `cutsim resume` goes on from there.
    The exit code says whether the result can be trusted.
    """
    on_ranks(ranks)
    from mpi4py import MPI

    from cutsim.cases import read_case, run_case

    path = case_path(case)
    checked = read_case(path, settings(set_ or []), quick=quick)
    folder = output or Path("results") / path.stem
    end(run_case(checked, folder, MPI.COMM_WORLD, overwrite=overwrite, quiet=quiet()))


def end(outcome: RunOutcome) -> NoReturn:
    """End the command as a run has ended, and say where its results are.

    Raises:
        typer.Exit: With the exit code of the run.
    """
    ending = ending_of_run(outcome)
    if outcome.error is not None and ending is not Ending.INTERRUPTED:  # which the run itself says
        say(str(outcome.error))
    if ending is Ending.NO_EQUILIBRIUM:
        say(_ADVICE)
    elif quiet():  # otherwise they have been warned of, and the progress ends with them
        for reason in outcome.reasons:
            say(f"questionable: {reason}")
    if not quiet() and first_rank():
        hint = f"; cutsim resume {outcome.folder} goes on" if ending is Ending.INTERRUPTED else ""
        console().print(f"results: {outcome.folder}{hint}", markup=False)
    raise typer.Exit(ending)
