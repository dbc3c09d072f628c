"""``cutsim check``: what a case will be, before it runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cutsim.commands.case_files import CaseArgument, Changes, Quick, case_path, settings
from cutsim.commands.endings import Ending
from cutsim.commands.options import console, table

EXAMPLES = ("cutsim check blade --quick", "cutsim check mine.toml --set parameters.edge=0.1 -o setup.png")


def command(
    case: CaseArgument,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Picture; CASE-setup.png by default.")] = None,
    set_: Changes = None,
    quick: Quick = False,
) -> None:
    """Read and mesh a case, and show what it will be: sizes, penalties, unknowns, cost, groups, and a picture.

    Nothing but the picture is written. The exit code is 1 if something speaks against running it.
    """
    from mpi4py import MPI

    from cutsim.cases import read_case
    from cutsim.cases.checking import check

    path = case_path(case)
    simulation = read_case(path, settings(set_ or []), quick=quick).build(MPI.COMM_SELF)
    found = check(simulation)
    screen = console()
    screen.print(table(("about", "what", "found"), [(row.topic, row.what, row.value) for row in found.rows]))
    for doubt in found.doubts:
        screen.print(f"against it: {doubt}", markup=False)
    picture = output or Path(f"{path.stem}-setup.png")
    simulation.draw(picture)
    screen.print(f"written: {picture}", markup=False)
    if found.doubts:
        raise typer.Exit(Ending.QUESTIONABLE)
