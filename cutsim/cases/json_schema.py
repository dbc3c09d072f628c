"""JSON schema of case files, by which editors complete keys and say what they mean."""

from collections.abc import Iterator, Mapping
from typing import Any

from pydantic.json_schema import GenerateJsonSchema, JsonSchemaWarningKind

from cutsim.base.units import Units
from cutsim.cases.keys import SINGULAR
from cutsim.cases.schema import CaseTables

_NULL = {"type": "null"}
#: What newer drafts call otherwise; and what tells alternatives apart need not be in a schema: "rule" is a text, too.
_DRAFT_4 = {"$defs": "definitions", "prefixItems": "items", "oneOf": "anyOf"}


class _Generator(GenerateJsonSchema):
    def emit_warning(self, kind: JsonSchemaWarningKind, detail: str) -> None:
        """Nothing: defaults that are objects of cutsim, and checks without a form in JSON, are left out."""

    def field_title_should_be_set(self, schema: Any) -> bool:
        """Keys have no titles beside their descriptions."""
        return False


def case_schema() -> dict[str, Any]:
    """JSON schema (draft 4) of case files, with the meaning of each key and its unit."""
    raw = CaseTables.model_json_schema(schema_generator=_Generator, ref_template="#/definitions/{model}")
    schema: dict[str, Any] = _in_draft_4(raw)
    for table in (schema, *schema["definitions"].values()):
        for entry in table.get("properties", {}).values():
            _describe(entry)
    for table in (schema, schema["definitions"]["Heat"]):
        _add_short_forms(table["properties"])
    head = {"$schema": "http://json-schema.org/draft-04/schema#", "title": "Case file of cutsim"}
    # a file that extends another one need not give all tables
    whole = {"anyOf": [{"required": ["extends"]}, {"required": schema["required"]}]}
    return head | {key: value for key, value in schema.items() if key not in ("title", "required")} | whole


def _in_draft_4(entry: Any) -> Any:
    """A schema in the words that editors of TOML know, without null, which TOML does not have."""
    if isinstance(entry, list):
        return [_in_draft_4(part) for part in entry if part != _NULL]
    if not isinstance(entry, Mapping):
        return entry
    parts = {
        _DRAFT_4.get(key, key): _in_draft_4(part) for key, part in entry.items() if key != "default" or part is not None
    }
    if isinstance(entry.get("const"), str):
        parts["enum"] = [parts.pop("const")]
    if len(parts.get("anyOf", ())) == 1:
        (only,) = parts.pop("anyOf")
        parts = {**only, **parts}
    return parts


def kinds_in(entry: Any) -> Iterator[str]:
    """Kinds of the numbers that a schema allows, those of tables that it refers to apart."""
    parts = entry.values() if isinstance(entry, Mapping) else entry if isinstance(entry, list) else ()
    if isinstance(entry, Mapping) and "x-kind" in entry:
        yield entry["x-kind"]
    for part in parts:
        yield from kinds_in(part)


def _describe(entry: dict[str, Any]) -> None:
    """Say in which unit a number is, and None as it is in a file."""
    if "description" in entry:
        entry["description"] = entry["description"].replace("None", "left out").replace("``", "`")
    units = [Units().of(kind) for kind in dict.fromkeys(kinds_in(entry)) if kind != "one"]
    if units:
        entry["description"] = f"{entry.get('description', '')} Unit: {', '.join(units)} unless [units] says otherwise."


def _add_short_forms(properties: dict[str, Any]) -> None:
    for short, key in SINGULAR.items():
        if key in properties:
            entries = properties[key].get("patternProperties") or {"": properties[key]["additionalProperties"]}
            properties[short] = {**next(iter(entries.values())), "description": f"Short for [{key}.{short}]."}
