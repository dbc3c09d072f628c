"""``cutsim import``: a model of another program as a case file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cutsim.commands.case_files import free_path
from cutsim.commands.endings import Ending
from cutsim.commands.options import Overwrite, console

EXAMPLES = ("cutsim import model.feb", "cutsim import model.inp -o case.toml")


def command(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="A file of FEBio (.feb) or Abaqus (.inp).")],
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Case file; MODEL.toml by default.")] = None,
    overwrite: Overwrite = False,
) -> None:
    """Translate a model of FEBio or Abaqus to a case file: mesh, materials, supports, loads, tools and contacts.

    What has no counterpart is listed with its line, here and at the head of the case file; then the exit code is 1.
    """
    from cutsim.cases.importing.model_files import import_model

    path = output or Path(f"{model.stem}.toml")
    imported = import_model(model, path.parent)  # first, since a case that is taken for a model has the same name
    imported.write(free_path(path, overwrite=overwrite))
    screen = console()
    for words, lines in {"not translated": imported.untranslated, "not exactly": imported.differences}.items():
        for line in lines:
            screen.print(f"{words}: {line}", markup=False)
    screen.print(f"written: {path}", f"next: cutsim check {path}, then cutsim run {path}", sep="\n", markup=False)
    if imported.untranslated:
        raise typer.Exit(Ending.QUESTIONABLE)
