"""``cutsim report``: the page on a run, anew."""

from __future__ import annotations

from cutsim.commands.options import console
from cutsim.commands.resume import FolderArgument

EXAMPLES = ("cutsim report results/blade",)


def command(folder: FolderArgument) -> None:
    """Write the plots, the pictures and the report of a run anew from what it has left; also while it runs."""
    from cutsim.commands.folders import run_files
    from cutsim.results.presentation import present

    run_files(folder)
    console().print(f"written: {present(folder)}", markup=False)
