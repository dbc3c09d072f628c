"""Reading of case files: all that is wrong is found before anything is meshed or compiled."""

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Annotated

from pydantic import TypeAdapter, ValidationError

from cutsim.base.units import Units
from cutsim.cases.case import Case
from cutsim.cases.constructed import FromTable
from cutsim.cases.contradictions import contradictions
from cutsim.cases.document import CaseError, Document, load, setting
from cutsim.cases.messages import problems
from cutsim.cases.quantities import consistent
from cutsim.cases.scope import Scope


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
    return _checked(document)


def check_groups(case: Case, groups: Collection[str]) -> None:
    """Refuse a case whose mesh has other groups than it names.

    Args:
        case: The case.
        groups: Names of all groups of its mesh, which has been read.

    Raises:
        CaseError: As `read_case`, with the nearest spelling for each group that the mesh does not have.
    """
    _checked(case.document, groups)


def _checked(document: Document, groups: Collection[str] | None = None) -> Case:
    """The case of a document; what is wrong in its tables for a first try is said as well."""
    case, found = _validated(document, groups)
    if "quick" in document.tables:
        found += _validated(document.hurried(), groups)[1]
    if found or case is None:
        raise CaseError(list(dict.fromkeys(found)))
    case._document = document
    return case


def _validated(document: Document, groups: Collection[str] | None) -> tuple[Case | None, list[str]]:
    """The case of a document, None if that is not valid, and all that is wrong."""
    scope = _scope(document, groups)
    case, found = None, list[str]()
    try:
        case = Case.model_validate(document.tables, context=scope)
    except ValidationError as error:
        found += problems(error, document, scope)
    fields = Case.model_fields.items()
    absent = {k: f for k, f in fields if k not in document.tables and not f.is_required()}
    valid = {k: f.get_default(call_default_factory=True) for k, f in absent.items()} | scope.valid
    return case, found + [document.problem(keys, words, value) for keys, words, value in contradictions(valid)]


_UNITS: TypeAdapter[Units] = TypeAdapter(Annotated[Units, FromTable()])


def _scope(document: Document, groups: Collection[str] | None) -> Scope:
    """Scope of the values of a document; with the usual units if its own are not valid, which is found later."""
    try:
        units = consistent(_UNITS.validate_python(document.tables.get("units", {}), context=Scope({}, Units())))
    except ValueError:
        units = Units()
    return Scope(document.tables, units, groups)
