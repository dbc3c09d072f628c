"""What docstrings say of classes and their arguments, for messages and for the pages on case files."""

import inspect
import re
from functools import cache
from typing import Any


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
