"""Tables of a case file for the classes of cutsim: their keys are the parameters of the constructors.

A class that cutsim exports is known to case files without a word about it: its parameters, their kinds and defaults are
those of its signature, their descriptions those of its docstring, and its checks are those of its constructor.
"""

import inspect
import re
from collections.abc import Mapping, Sequence
from dataclasses import is_dataclass
from functools import cache, reduce
from operator import or_
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    GetJsonSchemaHandler,
    PrivateAttr,
    Strict,
    Tag,
    ValidationInfo,
    WithJsonSchema,
    create_model,
    model_validator,
)
from pydantic.functional_validators import PlainValidator
from pydantic_core import CoreSchema, core_schema

import cutsim
from cutsim.base.checks import Refused
from cutsim.base.units import Kind, Number
from cutsim.bodies.schemes import Scheme
from cutsim.cases.keys import nearest
from cutsim.heat.contact_heat import HeatLaw
from cutsim.interface.cohesive import CohesiveLaw
from cutsim.interface.friction import FrictionLaw
from cutsim.materials.elastic import Material
from cutsim.materials.fibres import FibreLaw
from cutsim.tools.shapes import Shape

#: What a table of a case file may describe by the name of a class, and the key that has this name.
FAMILIES: Mapping[type, str] = {
    Material: "model",
    FibreLaw: "model",
    CohesiveLaw: "model",
    FrictionLaw: "model",
    HeatLaw: "model",
    Scheme: "model",
    Shape: "shape",
}
_NUMBER: dict[str, Any] = {"anyOf": [{"type": "number"}, {"type": "string"}]}


class Table(BaseModel):
    """Table of a case file."""

    model_config = ConfigDict(extra="forbid", frozen=True, arbitrary_types_allowed=True)

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Schema with what the docstring says of each key."""
        json = handler(schema)
        table = handler.resolve_ref_schema(json)
        described = arguments_of(cls)
        for name, entry in table.get("properties", {}).items():
            if name in described:
                entry.setdefault("description", described[name])
        table["description"] = table.get("description", "").split("\n")[0]
        return json

    @model_validator(mode="before")
    @classmethod
    def _remember(cls, value: Any, info: ValidationInfo) -> Any:
        """Keep in mind which keys a table may have, for messages."""
        if info.context is not None:
            info.context.known[id(value)] = cls
        return value


class Constructed(Table):
    """Table of the parameters of a class of cutsim, which makes an object of it.

    Attributes:
        made: The object.
    """

    _made: Any = PrivateAttr(default=None)

    @property
    def made(self) -> Any:
        """The object."""
        return self._made


# ---- numbers


class Varying:
    """Annotation of a number that may be a function of time, as a quantity, an expression in t or a table of points.

    Args:
        kind: What it is, one of `cutsim.base.units.KINDS`.
    """

    def __init__(self, kind: str) -> None:
        self.kind = Kind(kind)

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> CoreSchema:
        """How it is read."""
        return core_schema.with_info_plain_validator_function(
            lambda value, info: info.context.function(value, self.kind)
        )

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> dict[str, Any]:
        """What may be written."""
        numbers = {"type": "array", "items": _NUMBER}
        table = {"type": "object", "properties": {"times": numbers, "values": numbers}, "required": ["times", "values"]}
        return {"anyOf": [*_NUMBER["anyOf"], table], "x-kind": self.kind.name}


def _whole(value: Any, info: ValidationInfo) -> int:
    found = float(info.context.number(value))  # type: ignore[union-attr]
    if not found.is_integer():
        raise ValueError("must be a whole number")
    return int(found)


def _free(value: Any, info: ValidationInfo) -> float:
    return float(info.context.number(value, None))  # type: ignore[union-attr]


#: A number of any kind.
Free = Annotated[float, PlainValidator(_free), WithJsonSchema(_NUMBER)]
#: A whole number.
Whole = Annotated[int, PlainValidator(_whole), WithJsonSchema({"anyOf": [{"type": "integer"}, {"type": "string"}]})]


#: True or false.
Flag = Annotated[bool, Strict()]


class FromTable:
    """Annotation of what a table in a case file describes: one of the classes of a protocol, or a single class."""

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> CoreSchema:
        """How it is read."""
        schema: CoreSchema = handler.generate_schema(field_type(source))
        return schema


def _form(value: Any) -> str:
    return "<table>" if isinstance(value, Mapping) else "<list>" if isinstance(value, list) else "<single>"


#: Tells the alternatives of a value by their form: ``Tag("<single>")``, ``Tag("<list>")`` or ``Tag("<table>")``.
FORM = Discriminator(_form)


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


# ---- types of parameters


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
    types = [field_type(part, of) for part in parts if part is not type(None)]
    if len(types) > 1:
        types = [annotated(reduce(or_, [annotated(t, Tag(_tag(p))) for t, p in zip(types, parts, strict=False)]), FORM)]
    return reduce(or_, types + [None] * (type(None) in parts))


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


# ---- classes


def kebab(name: str) -> str:
    """A class name in kebab-case."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "-", name).lower()


def members(protocol: type) -> set[str]:
    """Names of what a protocol asks for."""
    return {name for name in vars(protocol) if not name.startswith("_")}


def _has(kind: type, names: set[str]) -> bool:
    return all(hasattr(kind, name) or name in getattr(kind, "__dataclass_fields__", {}) for name in names)


def _package(kind: type) -> str:
    return kind.__module__.rpartition(".")[0]


@cache
def classes(protocol: type) -> dict[str, type]:
    """The classes that cutsim exports for a protocol, by their names in case files."""
    exported = [getattr(cutsim, name) for name in dir(cutsim)]
    found = {}
    for kind in (thing for thing in exported if isinstance(thing, type) and is_dataclass(thing)):
        fitting = [known for known in FAMILIES if _package(known) == _package(kind) and _has(kind, members(known))]
        if fitting and max(fitting, key=lambda known: len(members(known))) is protocol:
            found[kebab(kind.__name__)] = kind
    return found


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


def chosen_by(key: str, names: Sequence[str]) -> BeforeValidator:
    """Check that a table says by a key which of several it is.

    Args:
        key: The key.
        names: What it may be.
    """

    def check(value: Any) -> Any:
        if not isinstance(value, Mapping):
            raise ValueError("must be a table")
        if value.get(key) not in names:
            near = nearest(str(value.get(key)), names)
            raise Refused(key, value.get(key), f"one of {', '.join(map(repr, names))}{near}")
        return value

    return BeforeValidator(check)


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
    for parameter in list(inspect.signature(kind).parameters.values()):
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


# ---- docstrings


def summary(kind: Any) -> str:
    """First line of a docstring."""
    return (inspect.getdoc(kind) or "").split("\n")[0]


@cache
def arguments_of(kind: Any) -> dict[str, str]:
    """What the docstring of a class says of each argument, in its own section or in those of its bases."""
    found: dict[str, str] = {}
    for base in reversed(kind.__mro__ if isinstance(kind, type) else [kind]):
        doc = base.__dict__.get("__doc__") if isinstance(base, type) else base.__doc__
        section = re.search(r"^(?:Args|Attributes):\n((?:(?:    .*)?\n?)*)", inspect.cleandoc(doc or ""), re.MULTILINE)
        for name, text in re.findall(r"^    (\w+): ((?:.*\n?)(?:     .*\n?)*)", section[1] if section else "", re.M):
            found[name] = " ".join(text.split())
    return found
