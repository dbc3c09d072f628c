"""Import of a model by the name of its file."""

import os
from pathlib import Path

from cutsim.base.checks import require
from cutsim.cases.importing.abaqus import import_abaqus
from cutsim.cases.importing.draft import Imported
from cutsim.cases.importing.febio import import_febio


def import_model(path: Path | str, folder: Path | str | None = None) -> Imported:
    """Translate a model of FEBio (.feb) or Abaqus (.inp) to a case file.

    What has no counterpart is listed in `Imported.untranslated`, by file and line, and at the head of the case file.

    Args:
        path: The file.
        folder: Where the case file will be; that of the model by default.

    Raises:
        ValueError: The name of the file says no format, or it is not what its format says, with the line.
        OSError: It cannot be read.
    """
    path = Path(path)
    readers = {".feb": import_febio, ".inp": import_abaqus}
    require("path", str(path), path.suffix.lower() in readers, "a file of FEBio (.feb) or Abaqus (.inp)")
    mesh_file = path.name if folder is None else os.path.relpath(path, folder)
    return readers[path.suffix.lower()](path, mesh_file)
