"""Validation of the tables of a case: all that is wrong is said at once."""

from collections.abc import Collection
from typing import Annotated, TypeVar

from pydantic import TypeAdapter, ValidationError

from cutsim.base.units import Units
from cutsim.cases.constructed import FromTable
from cutsim.cases.contradictions import contradictions
from cutsim.cases.document import CaseError, Document, by_line
from cutsim.cases.messages import problems
from cutsim.cases.quantities import consistent
from cutsim.cases.schema import CaseTables
from cutsim.cases.scope import Scope

Tables = TypeVar("Tables", bound=CaseTables)
_UNITS: TypeAdapter[Units] = TypeAdapter(Annotated[Units, FromTable()])


def validated(kind: type[Tables], document: Document, groups: Collection[str] | None = None) -> Tables:
    """The tables of a document; what is wrong in its tables for a first try is said as well.

    Args:
        kind: Class of the tables.
        document: The document.
        groups: Names of all groups of the mesh, if it has been read.

    Raises:
        CaseError: With one line for each thing that is wrong.
    """
    tables, found = _validated(kind, document, groups)
    if "quick" in document.tables and groups is None:  # its mesh may be another one
        found += _validated(kind, document.hurried(), groups)[1]
    if found or tables is None:
        raise CaseError(sorted(dict.fromkeys(found), key=by_line))
    return tables


def _validated(
    kind: type[Tables], document: Document, groups: Collection[str] | None
) -> tuple[Tables | None, list[str]]:
    """The tables of a document, None if they are not valid, and all that is wrong."""
    scope = _scope(document, groups)
    tables, found = None, list[str]()
    try:
        tables = kind.model_validate(document.tables, context=scope)
    except ValidationError as error:
        found += problems(error, document, scope)
    fields = kind.model_fields.items()
    absent = {k: f for k, f in fields if k not in document.tables and not f.is_required()}
    valid = {k: f.get_default(call_default_factory=True) for k, f in absent.items()} | scope.valid
    return tables, found + [document.problem(keys, words, value) for keys, words, value in contradictions(valid)]


def _scope(document: Document, groups: Collection[str] | None) -> Scope:
    """Scope of the values of a document; with the usual units if its own are not valid, which is found later."""
    try:
        units = consistent(_UNITS.validate_python(document.tables.get("units", {}), context=Scope({}, Units())))
    except ValueError:
        units = Units()
    return Scope(document.tables, units, groups)
