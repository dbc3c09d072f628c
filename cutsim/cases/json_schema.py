"""JSON schema of case files, by which editors complete keys and show what they mean."""

from collections.abc import Iterator, Mapping
from typing import Any

from pydantic.json_schema import GenerateJsonSchema

from cutsim.base.units import Units
from cutsim.cases.keys import SINGULAR
from cutsim.cases.schema import CaseTables


class _Generator(GenerateJsonSchema):
    # defaults that are objects of cutsim, and checks without a form in JSON
    ignored_warning_kinds = frozenset({"non-serializable-default", "skipped-choice"})


def case_schema() -> dict[str, Any]:
    """JSON schema of case files, with descriptions and the usual units."""
    schema = CaseTables.model_json_schema(schema_generator=_Generator)
    schema["$schema"], schema["title"] = "https://json-schema.org/draft/2020-12/schema", "Case file of cutsim"
    tables = [schema, *schema["$defs"].values()]
    for table in tables:
        for entry in table.get("properties", {}).values():
            _describe(entry)
    for table in (schema, schema["$defs"]["Heat"]):
        _add_short_forms(table["properties"])
    return schema


def kinds_in(entry: Any) -> Iterator[str]:
    """Kinds of the numbers that a schema allows."""
    if isinstance(entry, Mapping):
        if "x-kind" in entry:
            yield entry["x-kind"]
        for part in entry.values():
            yield from kinds_in(part)
    if isinstance(entry, list):
        for part in entry:
            yield from kinds_in(part)


def _describe(entry: dict[str, Any]) -> None:
    """Add the usual unit to what is said of a key."""
    units = [Units().of(kind) for kind in dict.fromkeys(kinds_in(entry)) if kind != "one"]
    if units:
        entry["description"] = f"{entry.get('description', '')} Unit: {', '.join(units)} by default.".strip()


def _add_short_forms(properties: dict[str, Any]) -> None:
    for short, key in SINGULAR.items():
        if key in properties:
            (entry,) = (properties[key].get("patternProperties") or {"": properties[key]["additionalProperties"]}).values()
            properties[short] = {**entry, "description": f"The only one of {key}, or one of them with this name."}
