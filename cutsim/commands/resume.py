"""``cutsim resume``: a run that was interrupted goes on."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cutsim.commands.endings import say
from cutsim.commands.options import Ranks, on_ranks, quiet
from cutsim.commands.run import end

EXAMPLES = ("cutsim resume results/blade", "cutsim resume results/blade -n 2")

FolderArgument = Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a run.", exists=True, file_okay=False)]


def command(folder: FolderArgument, ranks: Ranks = 1) -> None:
    """Go on with a run from its last checkpoint, on the same or another number of ranks.

    Its history goes on without a seam. A run that was killed loses what it did after the checkpoint, no more.
    """
    on_ranks(ranks)
    from mpi4py import MPI

    from cutsim.cases import read_case, run_case
    from cutsim.results.folder import CASE, has_checkpoint

    case = read_case(folder / CASE)
    if not has_checkpoint(folder):
        say(f"{folder} has no checkpoint: the run begins anew")
    end(run_case(case, folder, MPI.COMM_WORLD, resume=True, overwrite=True, quiet=quiet()))
