"""Reading of case files: all that is wrong is found before anything is meshed or compiled."""

from collections.abc import Mapping
from pathlib import Path

from cutsim.cases.case import Case
from cutsim.cases.document import Document, load, setting
from cutsim.cases.validation import validated


def read_case(path: Path | str, changes: Mapping[str, str] | None = None, *, quick: bool = False) -> Case:
    """Read a case file.

    Args:
        path: The file.
        changes: New values by key, with dots, as the option ``--set`` of the command gives them:
            ``{"tool.friction": "0.3"}``. They win over the file, and it over those that it extends.
        quick: Whether the tables in ``[quick]`` win over those of the file.

    Returns:
        The case, complete and checked as far as that is possible without a mesh.

    Raises:
        CaseError: With one line for each thing that is wrong: file and line, key, value, and what is allowed.
    """
    document = load(Path(path))
    document = document.hurried() if quick else document
    for key, text in (changes or {}).items():
        document = document.changed(setting(key, text))
    return _case(document)


def _case(document: Document) -> Case:
    case = validated(Case, document)
    case._document = document
    return case
