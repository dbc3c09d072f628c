"""Write the reference in docs/case_files.md from the schema: python docs/make_case_files.py (or make api).

What stands above the mark in that file is written by hand.
"""

import json
import re
from pathlib import Path

from cutsim.base.units import Units
from cutsim.cases.json_schema import case_schema, kinds_in
from cutsim.cases.keys import SINGULAR

PAGE = Path(__file__).parent / "case_files.md"
MARK = "<!-- What follows is written by docs/make_case_files.py from the schema. -->\n"
SCHEMA = case_schema()
TABLES = SCHEMA["definitions"]
SHORT = {plural: single for single, plural in SINGULAR.items()}
#: Keys that say which of several tables one is.
KINDS = ("model", "shape", "kind")


def references(entry):
    """Names of the tables to which a part of the schema refers, in their order."""
    if isinstance(entry, list):
        return [name for part in entry for name in references(part)]
    if not isinstance(entry, dict):
        return []
    own = [entry["$ref"].rpartition("/")[2]] if "$ref" in entry else []
    return own + [name for key, part in entry.items() if key != "discriminator" for name in references(part)]


def kind(name):
    """What a table says it is, such as ``model = "ogden"``; empty if it need not."""
    keys = TABLES[name]["properties"]
    return next((f'{key} = "{keys[key]["enum"][0]}"' for key in KINDS if single(keys.get(key, {}))), "")


def single(entry):
    """Whether a key may have one value only."""
    return len(entry.get("enum", ())) == 1


def anchor(name):
    """Name of a place of the page."""
    return f"case-{name.lower()}"


def allowed(entry):
    """What a key may have, in words."""
    if "enum" in entry:
        return ", ".join(f"`{json.dumps(value)}`" for value in entry["enum"])
    units = [Units().of(kind) for kind in dict.fromkeys(kinds_in(entry)) if kind != "one"]
    names = alternatives(entry)
    for key, other in SCHEMA["properties"].items():
        if len(names) > 2 and names == alternatives(other):
            return f"as [`[{key}]`](#{anchor(key)})"
    return ", ".join([*units, *(f"[{words}](#{anchor(name)})" for name, words in names.items())])


def alternatives(entry):
    """Tables that a key may have, and what each is called."""
    return {name: f"`{kind(name)}`" if kind(name) else "a table" for name in dict.fromkeys(references(entry))}


def default(entry, required):
    """What happens without a key, in words."""
    if required:
        return "**needed**"
    value = entry.get("default")
    plain = value not in (None, "", [], {}) and not isinstance(value, dict)
    return f"`{json.dumps(value, ensure_ascii=False)}` by default" if plain else ""


def text(entry):
    """What a key means; the unit stands behind it."""
    return re.sub(r" \[[^\]`]*\](?=[.;,]|$)", "", entry.get("description", "").split(" Unit: ")[0].replace("``", "`"))


def shared(names):
    """Keys that several tables have in common."""
    first, *others = (TABLES[name]["properties"] for name in names)
    return {key for key, entry in first.items() if others and all(other.get(key) == entry for other in others)}


def rows(name, keys=None, without=()):
    """A line for each key of a table, those that are needed first."""
    table = TABLES[name]
    needed = table.get("required", ())
    for key, entry in sorted(table.get("properties", {}).items(), key=lambda item: item[0] not in needed):
        short = any(key == single and plural in table["properties"] for plural, single in SHORT.items())
        if short or (key in KINDS and single(entry)) or key in without or (keys is not None and key not in keys):
            continue
        facts = "; ".join(filter(None, [allowed(entry), default(entry, key in needed)]))
        yield f"- `{key}`: {text(entry)}{f' ({facts})' if facts else ''}"


def section(name, level, heading, without=()):
    """A table with its keys."""
    summary = [text(TABLES[name]), ""] if text(TABLES[name]) else []
    return [f"({anchor(name)})=", f"{'#' * level} {heading}", "", *summary, *rows(name, without=without), ""]


def heading(key, entry):
    """How a table is written in a file."""
    if entry.get("type") == "array":
        return f"`[[{key}]]`"
    if key in SHORT:
        return f"`[{SHORT[key]}]` or `[{key}.NAME]`"
    named = "patternProperties" in entry
    return f"`[{key}.NAME]`" if named else f"`[{key}]`"


def called(name):
    """What tells a table from others."""
    return f"`{kind(name) or next(iter(TABLES[name]['properties']))}`"


def top(key, entry):
    """Section of a table at the top of a file."""
    names = list(alternatives(entry))
    if len(names) == 1:
        return section(names[0], 3, heading(key, entry))
    common = shared(names)
    lines = [f"({anchor(key)})=", f"### {heading(key, entry)}", "", text(entry), "", *rows(names[0], common), ""]
    return [*lines, *(line for name in names for line in section(name, 4, called(name), common))]


def inner(names):
    """Tables within tables, and theirs, each with the key under which it is found first."""
    found = {n: key for name in names for key, entry in TABLES[name]["properties"].items() for n in references(entry)}
    new = {name: key for name, key in found.items() if name not in names}
    return new | inner([*names, *new]) if new else {}


def reference():
    """Text of the reference: the tables of a file in their order, then those within them."""
    keys = {key: entry for key, entry in SCHEMA["properties"].items() if key not in SINGULAR}
    plain = [f"- `{key}`: {text(entry)}" for key, entry in keys.items() if not alternatives(entry)]
    tables = [line for key, entry in keys.items() if alternatives(entry) for line in top(key, entry)]
    names = list(dict.fromkeys(name for entry in keys.values() for name in alternatives(entry)))
    within = []
    for name, key in inner(names).items():
        within += section(name, 4, f"`{key}`" + (f" with `{kind(name)}`" if kind(name) else ""))
    head = ["## All keys", "", "At the top of a file, before any table:", "", *plain, ""]
    return "\n".join([*head, *tables, "### Tables within tables", "", *within])


def page():
    """Text of docs/case_files.md."""
    return PAGE.read_text(encoding="utf-8").split(MARK)[0] + MARK + "\n" + reference()


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
