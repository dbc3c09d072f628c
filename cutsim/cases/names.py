"""Names in case files that refer to groups of the mesh and to other tables, each checked with its nearest spelling."""

from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator
from pydantic_core import CoreSchema, core_schema

from cutsim.cases import geometries


class Known:
    """Annotation of a name that has to be known.

    Args:
        kind: What it names, as `cutsim.cases.scope.Scope.names` knows it.
    """

    def __init__(self, kind: str) -> None:
        self.kind = kind

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> CoreSchema:
        """How it is read."""
        return core_schema.with_info_after_validator_function(self._check, core_schema.str_schema(strict=True))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: Any) -> dict[str, Any]:
        """What may be written: a text, one of those that are the same in all files."""
        return {"type": "string"} | ({"enum": geometries.names()} if self.kind == "geometries" else {})

    def _check(self, name: str, info: Any) -> str:
        known = info.context.names(self.kind)
        if known is not None and name not in known:
            raise ValueError(info.context.unknown(self.kind, name, known))
        return name


def _several(value: Any) -> Any:
    return [value] if isinstance(value, str) else value


_SEVERAL = BeforeValidator(_several, json_schema_input_type=str | list[str])

#: A built-in geometry, and a parameter of it.
Geometry = Annotated[str, Known("geometries")]
GeometryParameter = Annotated[str, Known("parameters of the geometry")]
#: A group of cells or facets of the mesh.
Group = Annotated[str, Known("groups")]
#: One group or several.
Groups = Annotated[tuple[Group, ...], _SEVERAL]
#: Groups of outer facets, and faces of cracks: the name of a crack with + or −, such as "glue+".
Surfaces = Annotated[tuple[Annotated[str, Known("surfaces")], ...], _SEVERAL]
BodyName = Annotated[str, Known("bodies")]
BodyNames = Annotated[tuple[BodyName, ...], _SEVERAL]
CrackName = Annotated[str, Known("cracks")]
PairName = Annotated[str, Known("pairs")]
ToolName = Annotated[str, Known("tools")]
CarriageName = Annotated[str, Known("carriages")]


def _existing(path: Path) -> Path:
    if not path.is_file():
        raise ValueError("must be a file: there is none of this name")
    return path


#: A file, relative to the case file that names it.
ExistingFile = Annotated[Path, AfterValidator(_existing)]
