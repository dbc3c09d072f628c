"""The case that is made of a model, and what could not be translated."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.items import InlineTable, Table

from cutsim.readers.mesh_data import free_name

#: Length of a line of a comment.
_WIDTH = 120
#: Keys that have a table of their own even if it is short.
_SECTIONS = (
    "units",
    "mesh",
    "materials",
    "bodies",
    "groups",
    "supports",
    "loads",
    "pairs",
    "tools",
    "analysis",
    "steps",
)


class MalformedFile(ValueError):
    """The file is not what its format says."""


class Untranslatable(Exception):
    """What a part of a model says has no counterpart.

    Args:
        reason: Why, in words that follow the name of the part.
        line: Where the file says it.
    """

    def __init__(self, reason: str, line: int) -> None:
        super().__init__(reason)
        self.line = line


@dataclass(frozen=True)
class Imported:
    """A model of another program as a case.

    Attributes:
        case_text: Text of the case file.
        untranslated: What has no counterpart, ``file:line: what: why`` each.
        differences: What is translated, but not exactly, likewise.
        files: Further files that the case needs beside it, text by name.
    """

    case_text: str
    untranslated: tuple[str, ...] = ()
    differences: tuple[str, ...] = ()
    files: Mapping[str, str] = field(default_factory=dict)

    def write(self, path: Path | str) -> None:
        """Write the case file, and beside it the other files.

        Raises:
            OSError: One cannot be written.
        """
        for name, text in self.files.items():
            Path(path).with_name(name).write_text(text, encoding="utf-8")
        Path(path).write_text(self.case_text, encoding="utf-8")


class Draft:
    """Case file in the making.

    Args:
        source: The file that is translated.

    Attributes:
        tables: Sections of the case file, an entry by name in those that have several.
        files: Further files, text by name.
    """

    def __init__(self, source: Path) -> None:
        self.tables: dict[str, Any] = {}
        self.files: dict[str, str] = {}
        self._source = source
        self._untranslated: list[tuple[int, str]] = []
        self._differences: list[tuple[int, str]] = []
        self._comments: dict[tuple[str, ...], list[str]] = {}

    def untranslated(self, line: int, what: str) -> None:
        """Note what has no counterpart."""
        self._untranslated.append((line, what))

    def difference(self, line: int, what: str) -> None:
        """Note what is translated, but not exactly."""
        self._differences.append((line, what))

    def set(self, section: str, values: Mapping[str, Any], comment: str = "") -> None:
        """Set values of a section that has no entries."""
        self.tables.setdefault(section, {}).update(values)
        self._remark((section,), comment)

    def add(self, section: str, name: str, values: Mapping[str, Any], comment: str = "") -> str:
        """Add an entry to a section.

        Returns:
            The name that it gets: the given one without what bare keys may not have, and numbered if it is taken.
        """
        entries = self.tables.setdefault(section, {})
        free = free_name(entries, re.sub(r"\W+", "_", name).strip("_") or section.rstrip("s"))
        entries[free] = dict(values)
        self._remark((section, free), comment)
        return free

    def finished(self) -> Imported:
        """The case."""
        untranslated, differences = (self._lines(notes) for notes in (self._untranslated, self._differences))
        return Imported(self._text(untranslated, differences), untranslated, differences, self.files)

    def _remark(self, key: tuple[str, ...], comment: str) -> None:
        if comment:
            self._comments.setdefault(key, []).append(comment)

    def _lines(self, notes: Iterable[tuple[int, str]]) -> tuple[str, ...]:
        return tuple(dict.fromkeys(f"{self._source.name}:{line}: {what}" for line, what in sorted(notes)))

    def _text(self, untranslated: Iterable[str], differences: Iterable[str]) -> str:
        document = tomlkit.document()
        for line in self._head(tuple(untranslated), tuple(differences)):
            document.add(tomlkit.comment(line))
        for key, value in sorted(self.tables.items(), key=_rank):
            if not isinstance(value, dict):
                document.add(key, value)
            else:
                document.add(tomlkit.nl())
                document.add(key, self._table((key,), value))
        return tomlkit.dumps(document)

    def _head(self, untranslated: tuple[str, ...], differences: tuple[str, ...]) -> list[str]:
        lines = [f"Imported from {self._source.name}."]
        if differences:
            lines += ["Translated, but not exactly:", *(f"  {line}" for line in differences)]
        if untranslated:
            lines += ["NOT TRANSLATED:", *(f"  {line}" for line in untranslated)]
        return lines

    def _table(self, key: tuple[str, ...], values: Mapping[str, Any]) -> Table:
        entries = len(key) == 1 and values and all(isinstance(value, dict) for value in values.values())
        table = tomlkit.table(is_super_table=bool(entries))
        for remark in self._comments.get(key, ()):
            table.add(tomlkit.comment(remark))
        for name, value in values.items():
            table.add(name, self._table((*key, name), value) if entries else _inline(value))
        return table


def _rank(item: tuple[str, Any]) -> tuple[int, int]:
    """Place of a key in the file: what is no table comes first, then the sections in their order."""
    key, value = item
    return isinstance(value, dict), _SECTIONS.index(key) if key in _SECTIONS else len(_SECTIONS)


def _inline(value: Any) -> Any:
    """A value as tomlkit writes it, tables in one line."""
    if not isinstance(value, Mapping):
        return list(value) if isinstance(value, tuple) else value
    table: InlineTable = tomlkit.inline_table()
    for key, inner in value.items():
        table.add(key, _inline(inner))
    return table
