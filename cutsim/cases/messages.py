"""What is wrong with a case file, in plain words, from what pydantic finds."""

import re
from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from cutsim.base.checks import Refused
from cutsim.cases.docstrings import arguments_of
from cutsim.cases.document import Document, places
from cutsim.cases.keys import SINGULAR, Keys, nearest
from cutsim.cases.scope import Scope

_KINDS = ("model", "shape", "kind")
_FORMS = {"<single>": "a text or a number", "<list>": "a list in brackets", "<table>": "a table"}
_WORDS = {
    "int_parsing_size": "must be a smaller number",
    "path_type": "must be a text in quotes",
    "string_type": "must be a text in quotes",
    "bool_type": "must be true or false",
    "tuple_type": "must be a list in brackets",
    "dict_type": "must be a table",
    "model_type": "must be a table",
    "model_attributes_type": "must be a table",
    "string_pattern_mismatch": "must be a name of letters, digits, _, - and spaces",
}


def problems(error: ValidationError, document: Document, scope: Scope) -> list[str]:
    """One line for each thing that is wrong.

    Args:
        error: What pydantic finds.
        document: What was validated.
        scope: With what it was validated.
    """
    found = error.errors(include_url=False)
    return list(dict.fromkeys(_line(details, document, scope) for details in found))


def _line(details: ErrorDetails, document: Document, scope: Scope) -> str:
    keys, node = _keys(details["loc"], document.tables)
    cause = details.get("ctx", {}).get("error")
    if isinstance(cause, Refused):
        return refusal(cause, keys, node, document)
    if details["type"] in ("missing", "extra_forbidden"):
        return document.problem(keys, _about_key(keys, document, scope))
    return document.problem(keys, _about(details), details["input"])


def _keys(location: tuple[int | str, ...], tables: Any) -> tuple[Keys, Any]:
    """Keys of a place that pydantic names, without what it adds, and what is there."""
    keys: Keys = ()
    node: Any = tables
    chosen = False
    for part in location:
        if isinstance(part, str) and (part[:1] + part[-1:] in ("<>", "[]")):
            continue
        if isinstance(node, Mapping) and not chosen and part in [node.get(kind) for kind in _KINDS]:
            chosen = True
            continue
        if isinstance(part, int) and not isinstance(node, list):  # one where several are allowed
            continue
        keys, chosen = (*keys, part), False
        inside = isinstance(node, Mapping) or (isinstance(node, list) and isinstance(part, int) and part < len(node))
        node = (node.get(part) if isinstance(node, Mapping) else node[part]) if inside else None
    return keys, node


def refusal(refused: Refused, keys: Keys, node: Any, document: Document) -> str:
    """What a constructor refuses, at the key that has the name of the parameter."""
    name, value = refused.name, refused.value
    if name.replace(".", "").isidentifier():
        keys = (*keys, *name.split("."))
        hint = ""
        if isinstance(node, Mapping):
            value = node.get(name, value)
            hint = (
                next(filter(None, (_named((*keys[:-1], inner), node) for inner in node)), "") if value is None else ""
            )
        return document.problem(keys, f"must be {_as_in_file(refused.allowed)}{hint}", value)
    return document.problem(keys, f"{name} = {value!r} must be {_as_in_file(refused.allowed)}")


def _as_in_file(allowed: str) -> str:
    """What a constructor allows, in the words of a file, which has no None and writes true and false."""
    words = re.sub(r"^None\b", "left out", allowed.removesuffix(" or None").removesuffix(", or None"))
    return re.sub(r"\b(True|False)\b", lambda found: found[0].lower(), words)


def _about_key(keys: Keys, document: Document, scope: Scope) -> str:
    """A key that is unknown, or missing."""
    parent: Any = document.tables
    for key in keys[:-1]:
        parent = parent[key]
    table, name = scope.known.get(id(parent)), str(keys[-1])
    if table is None:
        return f"must have {len(parent) + 1} entries or more" if isinstance(parent, list) else "is not allowed here"
    if name in table.model_fields:
        described = arguments_of(table).get(name) or table.model_fields[name].description or ""
        return f"missing, must be given{': ' * bool(described)}{described}"
    hint = _named(keys, parent) or _owner(name, document, scope) or nearest(name, table.model_fields)
    return f"unknown key, must be one of {', '.join(table.model_fields)}{hint}"


def _named(keys: Keys, parent: Any) -> str:
    """The full form of a table whose name was put behind the short form; empty if it is none."""
    tables, short, name = keys[-3:] if len(keys) > 2 else ("", "", "")
    misplaced = SINGULAR.get(str(short)) == tables and isinstance(parent.get(name), Mapping)
    return f"; did you mean [{tables}.{name}]?" if misplaced else ""


def _owner(name: str, document: Document, scope: Scope) -> str:
    """The table of the file that may have a key, in words; empty if none or several may."""
    having = [
        document.origin(keys)[1]
        for keys, node in places(document.tables)
        if id(node) in scope.known and name in scope.known[id(node)].model_fields
    ]
    return f"; it is a key of [{having[0]}]" if len(having) == 1 and having[0] else ""


def _about(details: ErrorDetails) -> str:
    kind, context = details["type"], details.get("ctx", {})
    if kind == "value_error":
        return str(context["error"])
    if kind == "literal_error":
        known = [word.strip("' ") for word in context["expected"].replace(" or ", ", ").split(",")]
        return f"must be {context['expected']}{nearest(str(details['input']), known)}"
    if kind in ("too_short", "too_long"):
        low, high = context.get("min_length"), context.get("max_length")
        return f"must have {f'at least {low}' if low is not None else f'at most {high}'} entries"
    if kind == "union_tag_invalid":
        forms = [words for form, words in _FORMS.items() if form in context["expected_tags"]]
        return f"must be {' or '.join(forms)}"
    return _WORDS.get(kind, details["msg"].lower())
