"""Tables of a case file for the classes of cutsim: their keys are the parameters of the constructors.

A class that cutsim exports is known to case files without a word about it: its parameters, their kinds and defaults are
those of its signature, their descriptions those of its docstring, and its checks are those of its constructor.
"""

import inspect
from collections.abc import Sequence
from dataclasses import is_dataclass
from functools import cache, reduce
from operator import or_
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from pydantic import AfterValidator, Field, PrivateAttr, Tag, create_model, model_validator
from pydantic_core import CoreSchema

from cutsim.base.units import Number
from cutsim.cases.classes import FAMILIES, classes
from cutsim.cases.docstrings import arguments_of, summary
from cutsim.cases.tables import FORM, Flag, Table, Whole, chosen_by


class Constructed(Table):
    """Table of the parameters of a class of cutsim, which makes an object of it."""

    _made: Any = PrivateAttr(default=None)

    @property
    def made(self) -> Any:
        """The object."""
        return self._made


class FromTable:
    """Annotation of what a table in a case file describes: one of the classes of a protocol, or a single class."""

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> CoreSchema:
        """How it is read."""
        schema: CoreSchema = handler.generate_schema(field_type(source))
        return schema


class With:
    """Annotation of a table whose further keys are the parameters of a class, or of those of a protocol.

    Args:
        kind: The class or the protocol.
    """

    def __init__(self, kind: type) -> None:
        self.kind = kind

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> CoreSchema:
        """How it is read."""
        table = choice(self.kind, source) if self.kind in FAMILIES else table_of(self.kind, source)
        schema: CoreSchema = handler.generate_schema(table)
        return schema


def field_type(hint: Any, of: type | None = None) -> Any:
    """Type by which a value in a file is validated for a parameter with an annotation.

    Args:
        hint: The annotation.
        of: The class that has the parameter: a material that is made of another one is not made of its own kind.
    """
    origin, parts = get_origin(hint), get_args(hint)
    if hint is float:
        return Number
    if hint is int:
        return Whole
    if hint is bool:
        return Flag
    if origin in (Union, UnionType):
        return _union([part for part in parts if part is not Any], of)
    if origin is tuple:
        return tuple[tuple(part if part is Ellipsis else field_type(part, of) for part in parts)]  # type: ignore[misc]
    if hint in FAMILIES:
        return family(hint, of)
    if isinstance(hint, type) and is_dataclass(hint):
        return made(table_of(hint))
    return hint


def _union(parts: Sequence[Any], of: type | None) -> Any:
    """Type of one of several; a number and a law are told by whether it is a table."""
    some = [part for part in parts if part is not NoneType]
    types = [field_type(part, of) for part in some]
    if len(some) > 1:
        tagged = [annotated(kind, Tag(_tag(part))) for kind, part in zip(types, some, strict=True)]
        types = [annotated(reduce(or_, tagged), FORM)]
    return types[0] if len(some) == len(parts) else types[0] | None


def _tag(part: Any) -> str:
    if part in FAMILIES or (isinstance(part, type) and is_dataclass(part)):
        return "<table>"
    return "<list>" if get_origin(part) is tuple else "<single>"


def annotated(kind: Any, *metadata: Any) -> Any:
    """A type with metadata."""
    return Annotated[kind, *metadata]


def made(table: Any) -> Any:
    """Type whose value is what a table makes."""
    return Annotated[table, AfterValidator(lambda value: value.made)]


@cache
def family(protocol: type, without: type | None = None) -> Any:
    """Type of a table that describes one of the classes of a protocol, which it makes an object of.

    Args:
        protocol: The protocol.
        without: A class that is left out.
    """
    return made(choice(protocol, without=without))


def choice(protocol: type, base: type[Table] = Constructed, *, without: type | None = None) -> Any:
    """Type of a table that describes one of the classes of a protocol.

    Args:
        protocol: The protocol.
        base: Table whose keys it has beside those of the class.
        without: A class that is left out.
    """
    key, chosen = FAMILIES[protocol], {n: kind for n, kind in classes(protocol).items() if kind is not without}
    tables = tuple(table_of(kind, base, key, name) for name, kind in chosen.items())
    return one_of(key, tables, list(chosen))


def one_of(key: str, tables: Sequence[type[Table]], names: Sequence[str]) -> Any:
    """Type of one of several tables.

    Args:
        key: Key that says which.
        tables: The tables.
        names: What each is called.
    """
    several = annotated(reduce(or_, tables), Field(discriminator=key)) if len(tables) > 1 else tables[0]
    return annotated(several, chosen_by(key, names))


@cache
def table_of(kind: type, base: type[Table] = Constructed, key: str = "", name: str = "") -> type[Any]:
    """Table of the parameters of a class.

    Args:
        kind: The class.
        base: Table whose keys it has as well.
        key: Key that has the name of the class, none if it is the only one possible.
        name: Name of the class in case files.
    """
    hints = get_type_hints(kind.__init__, include_extras=True)  # type: ignore[misc]
    docs = arguments_of(kind)
    fields: dict[str, Any] = {key: (Literal[name], Field(description=summary(kind)))} if key else {}
    for parameter in inspect.signature(kind).parameters.values():
        default = ... if parameter.default is parameter.empty else parameter.default
        description = docs.get(parameter.name)
        fields[parameter.name] = (field_type(hints[parameter.name], kind), Field(default, description=description))
    parameters = frozenset(fields) - {key}

    def make(self: Any) -> Any:
        given = {name: getattr(self, name) for name in parameters & self.model_fields_set}
        try:
            self._made = kind(**given)
        except (ArithmeticError, TypeError) as error:
            raise ValueError(f"cannot be computed with ({error})") from None
        return self

    return create_model(
        _title(kind, base, key),
        __base__=base,
        __doc__=summary(kind if key or base is Constructed else base),
        __validators__={"make": model_validator(mode="after")(make)},  # type: ignore[dict-item]
        **fields,
    )


def _title(kind: type, base: type[Table], key: str) -> str:
    """Name of a table: that of its class, if it says so by a key or not, and of what it has beside the class."""
    if base is not Constructed:
        return f"{kind.__name__}{base.__name__}" if key else base.__name__
    return kind.__name__ if key else f"{kind.__name__}Parameters"
