"""``cutsim plot``: columns of the histories of runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cutsim.commands.options import console

EXAMPLES = (
    "cutsim plot results/blade --list",
    "cutsim plot results/blade -x depth -y force -y tip_force",
    "cutsim plot results/fine results/coarse -y energy_fracture -o energy.pdf",
)


def command(
    folders: Annotated[list[Path], typer.Argument(metavar="DIR…", help="Folders of runs.")],
    x: Annotated[str | None, typer.Option("-x", "--x", help="Column of the abscissae; depth or displacement.")] = None,
    y: Annotated[
        list[str] | None, typer.Option("-y", "--y", help="Column of the ordinates, more than once; the force.")
    ] = None,
    output: Annotated[Path, typer.Option("-o", "--output", help="Plot: png, svg or pdf.")] = Path("plot.png"),
    list_columns: Annotated[
        bool, typer.Option("--list", help="List the columns with their last values, and end.")
    ] = False,
) -> None:
    """Plot columns of the histories of one or more runs."""
    from cutsim.commands.folders import overlaid, read_source, run_files

    screen = console()
    if list_columns:
        for column in run_files(folders[0]).history.values():
            unit = f" [{column.unit}]" if column.unit else ""
            screen.print(f"{column.name}{unit}", *(f"{value:.6g}" for value in column.values[-1:]), markup=False)
        return
    ordinates: list[str | None] = [*y] if y else [None]
    sources = [read_source(folder, x, name) for folder in folders for name in ordinates]
    if len(ordinates) > 1:
        sources = [s.called(s.y.name if len(folders) == 1 else f"{s.label}, {s.y.name}") for s in sources]
    overlaid(sources).plot(output)
    screen.print(f"written: {output}", markup=False)
