"""Keys of case files: their full form, and their spelling."""

import difflib
from collections.abc import Iterable

#: Keys from the top of a file to a value; numbers count the entries of a list.
Keys = tuple[str | int, ...]
#: Tables that may be written in the singular: ``[tool]`` is ``[tools.tool]``.
SINGULAR = {
    "body": "bodies",
    "crack": "cracks",
    "pair": "pairs",
    "tool": "tools",
    "carriage": "carriages",
    "support": "supports",
    "link": "links",
    "load": "loads",
    "boundary": "boundaries",
}


def full(keys: Keys) -> Keys:
    """Keys with a table in the singular in its full form."""
    if keys[:1] == ("heat",):
        return ("heat", *full(keys[1:]))
    plural = SINGULAR.get(str(keys[0])) if keys else None
    return keys if plural is None else (plural, *keys)


def dotted(keys: Keys) -> str:
    """Keys as one key with dots."""
    return "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys).removeprefix(".")


def nearest(word: str, known: Iterable[str]) -> str:
    """The nearest spelling among known words as a question, empty if none is near."""
    spellings = {name.lower(): name for name in known}
    found = difflib.get_close_matches(word.lower(), spellings, n=1, cutoff=0.6)
    return f"; did you mean {spellings[found[0]]!r}?" if found else ""
