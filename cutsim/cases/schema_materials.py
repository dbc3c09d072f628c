"""Schema of case files: materials, by their parameters or by a name of the library, and laws."""

from dataclasses import fields, is_dataclass, replace
from typing import Annotated, Any, Literal, get_args, get_type_hints

from pydantic import BeforeValidator, Discriminator, PrivateAttr, Tag, ValidationInfo, model_validator
from pydantic_core import CoreSchema

from cutsim.base.units import Kind, Units
from cutsim.cases.constructed import Constructed, FromTable, annotated, choice, made
from cutsim.cases.quantities import Converter
from cutsim.interface.cohesive import CohesiveLaw
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.friction import FrictionLaw
from cutsim.materials.elastic import Material
from cutsim.materials.library import LIBRARY
from cutsim.materials.library import material as named

#: The units of the library.
_LIBRARY_UNITS = Units()


class LibraryMaterial(Constructed):
    """A rubber or tissue of the library.

    Args:
        library: Its name; the page on materials lists them with their sources.
    """

    library: str
    _units: Units = PrivateAttr()

    @model_validator(mode="after")
    def _look_up(self, info: ValidationInfo) -> "LibraryMaterial":
        assert info.context is not None
        if self.library not in LIBRARY:
            raise ValueError(info.context.unknown("library", self.library, LIBRARY))
        self._made = in_units(named(self.library).material, _LIBRARY_UNITS, info.context.units)
        return self


def in_units(item: Any, given: Units, wanted: Units) -> Any:
    """A dataclass of parameters in other units.

    Args:
        item: The dataclass, which may hold tuples and others; parameters without a kind are dimensionless.
        given: Its units.
        wanted: The others.
    """
    if given == wanted:
        return item
    converter = Converter(wanted)

    def converted(value: Any, hint: Any) -> Any:
        if is_dataclass(value) and not isinstance(value, type):
            hints = get_type_hints(type(value), include_extras=True)
            parts = {f.name: converted(getattr(value, f.name), hints[f.name]) for f in fields(value)}
            return replace(value, **parts)
        if isinstance(value, tuple):
            inner = get_args(hint) or (Any,)
            return tuple(converted(entry, inner[0]) for entry in value)
        kinds = [part for part in getattr(hint, "__metadata__", ()) if isinstance(part, Kind)]
        return converter.factor(given, kinds[0]) * value if kinds else value

    return converted(item, type(item))


class _AnyMaterial:
    """Annotation of a material: one of the classes, or a name of the library."""

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> CoreSchema:
        by_name, by_model = made(LibraryMaterial), made(choice(Material))
        either = annotated(by_name, Tag("<library>")) | annotated(by_model, Tag("<model>"))
        schema: CoreSchema = handler.generate_schema(annotated(either, Discriminator(_kind)))
        return schema


def _kind(value: Any) -> str:
    return "<library>" if isinstance(value, dict) and "library" in value else "<model>"


def _none(value: Any) -> Any:
    return None if value == "none" else value


AnyMaterial = Annotated[Material, _AnyMaterial()]
Law = Annotated[CohesiveLaw, FromTable()]
#: A law, or "none" for a crack that is already broken: contact only.
LawOrNone = Annotated[Law | None, BeforeValidator(_none, json_schema_input_type=Law | Literal["none"])]
Friction = Annotated[FrictionLaw | float, FromTable()]
Contact = Annotated[PenaltyContact, FromTable()]
