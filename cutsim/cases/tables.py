"""Tables of a case file, and the numbers in them."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    GetJsonSchemaHandler,
    Strict,
    ValidationInfo,
    WithJsonSchema,
    model_validator,
)
from pydantic.functional_validators import PlainValidator
from pydantic_core import CoreSchema, core_schema

from cutsim.base.checks import Interval, Refused, nonnegative, positive
from cutsim.base.units import Kind
from cutsim.cases.docstrings import arguments_of
from cutsim.cases.keys import nearest

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


class Varying:
    """Annotation of a number that may be a function of time, as a quantity, an expression in t or a table of points.

    Args:
        kind: What it is, one of `cutsim.base.units.KINDS`; None for anything.
    """

    def __init__(self, kind: str | None) -> None:
        self.kind = None if kind is None else Kind(kind)

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> CoreSchema:
        """How it is read."""
        return core_schema.with_info_plain_validator_function(
            lambda value, info: info.context.function(value, self.kind)
        )

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> dict[str, Any]:
        """What may be written."""
        numbers = {"type": "array", "items": _NUMBER}
        table = {"type": "object", "properties": {"times": numbers, "values": numbers}, "required": ["times", "values"]}
        return {"anyOf": [*_NUMBER["anyOf"], table]} | ({} if self.kind is None else {"x-kind": self.kind.name})


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


def within(interval: Interval) -> AfterValidator:
    """Check that a number, if it is one, is in an interval."""

    def check(value: Any) -> Any:
        if isinstance(value, int | float) and value not in interval:
            raise ValueError(f"must be {interval}")
        return value

    return AfterValidator(check)


POSITIVE, NONNEGATIVE = within(positive), within(nonnegative)
#: True or false.
Flag = Annotated[bool, Strict()]


def _form(value: Any) -> str:
    return "<table>" if isinstance(value, Mapping) else "<list>" if isinstance(value, list) else "<single>"


#: Tells the alternatives of a value by their form: ``Tag("<single>")``, ``Tag("<list>")`` or ``Tag("<table>")``.
FORM = Discriminator(_form)


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
