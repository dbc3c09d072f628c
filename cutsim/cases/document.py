"""Text of a case file: its tables, what it extends, changes from the command line, and where each value was written."""

import re
import sys
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from cutsim.cases.keys import SINGULAR, Keys, dotted, full

#: Keys that say what a table describes: with another value it is another table, not a change of the first.
_KINDS = ("model", "library", "shape", "kind", "geometry", "file", "fixed")
#: How deep tables and lists may lie in each other.
_DEEPEST = 30
_LINE = re.compile(r"(?!--set )(.+?):(\d+): ")
_PLACE = re.compile(r" \(at (?:line (\d+), column \d+|end of document)\)$")


class CaseError(ValueError):
    """Raised for a case file that cannot be run, with all that is wrong in it.

    Args:
        problems: One line each: file and line, key, value, and what is allowed.
    """

    def __init__(self, problems: list[str]) -> None:
        super().__init__("\n".join(problems))
        self.problems = problems


def by_line(problem: str) -> tuple[str, int]:
    """File and line of a problem, to sort by; those of the command line come last."""
    place = _LINE.match(problem)
    return (place[1], int(place[2])) if place else (chr(sys.maxunicode), 0)


@dataclass(frozen=True)
class File:
    """A file of a case.

    Attributes:
        path: Where it is.
        text: What is in it.
    """

    path: Path
    text: str

    @cached_property
    def _lines(self) -> dict[Keys, int]:
        """Line at which each key is given first; of the keys within a value that at which it begins."""
        found, arrays = dict[Keys, int](), dict[Keys, int]()
        table: Keys = ()
        statement, start = "", 1
        for number, line in enumerate(self.text.split("\n"), start=1):
            statement += f"{line}\n"
            try:
                given = tomllib.loads(statement)
            except ValueError:  # it goes on in the next line
                continue
            if statement.lstrip().startswith("["):
                table, given = _header(given, arrays), {}
            for keys in (*(table[:n] for n in range(len(table))), *((*table, *keys) for keys in _paths(given))):
                found.setdefault(keys, start)
            statement, start = "", number + 1
        return found

    @property
    def folder(self) -> Path:
        """Where other files are looked for."""
        return self.path.parent

    def place(self, keys: Keys) -> str:
        """File and line of a key, or of the table that should have it."""
        while keys and keys not in self._lines:
            keys = keys[:-1]
        return f"{self.path}:{self._lines.get(keys, 1)}"


@dataclass(frozen=True)
class Setting:
    """A change from the command line.

    Attributes:
        text: As it was given, such as "tool.friction=0.3".
    """

    text: str

    @property
    def folder(self) -> Path:
        """Where other files are looked for."""
        return Path()

    def place(self, keys: Keys) -> str:
        """The option."""
        return f"--set {self.text}"


@dataclass(frozen=True)
class Document:
    """Document: the tables of a case, and where they were written.

    Attributes:
        tables: The tables, each in its full form: ``[tool]`` is ``[tools.tool]``.
        origins: For each key its file or setting, and the keys as they were written there.
    """

    tables: dict[str, Any] = field(default_factory=dict)
    origins: Mapping[Keys, tuple[File | Setting, Keys]] = field(default_factory=dict)

    def origin(self, keys: Keys) -> tuple[str, str]:
        """File and line of a key, and the key as it was written there; or of the table that should have it."""
        known = keys = self._as_given(keys)
        while known and known not in self.origins:
            known = known[:-1]
        if not self.origins:
            return "", dotted(keys)
        source, written = self.origins[known]
        written += keys[len(known) :]
        return source.place(written), dotted(written)

    def at(self, keys: Keys) -> Any:
        """What stands at a key; None if nothing does."""
        node: Any = self.tables
        for key in self._as_given(keys):
            node = _entry(node, key)
        return node

    def _as_given(self, keys: Keys) -> Keys:
        """A key without the number of an entry where one stands without a list."""
        node, found = self.tables, list[str | int]()
        for key in keys:
            if isinstance(key, int) and isinstance(node, Mapping):
                continue
            found.append(key)
            node = _entry(node, key)
        return tuple(found)

    def problem(self, keys: Keys, words: str, value: Any = None) -> str:
        """One line on what is wrong with a value."""
        place, key = self.origin(keys)
        line = ": ".join(filter(None, [place, key, "" if value is None else _short(value), words]))
        return " ".join(line.splitlines())

    def hurried(self) -> "Document":
        """This document with its tables in ``[quick]``, which win."""
        tables = dict(self.tables)
        quick = tables.pop("quick", {})
        if not isinstance(quick, Mapping):
            return self
        start = ("quick",)
        origins = {full(keys[1:]): origin for keys, origin in self.origins.items() if keys[:1] == start != keys}
        return Document(tables, self.origins).changed(Document(_unfold(quick), origins))

    def changed(self, other: "Document") -> "Document":
        """This document with the tables of another one, which wins."""
        tables = _merged(self.tables, other.tables)
        left = set(_paths(tables))
        return Document(tables, {k: origin for k, origin in {**self.origins, **other.origins}.items() if k in left})


def _header(given: Mapping[str, Any], arrays: dict[Keys, int]) -> Keys:
    """Keys of the table that a header begins.

    Args:
        given: The header as a document of its own.
        arrays: Number of the last entry of each list of tables; that which the header begins is counted.
    """
    keys: Keys = ()
    node: Any = given
    while node:
        key, node = next(iter(node.items()))
        keys = (*keys, key)
        if isinstance(node, list):
            arrays[keys], node = arrays.get(keys, -1) + 1, node[0]
        keys += (arrays[keys],) if keys in arrays else ()
    return keys


def _short(value: Any) -> str:
    if isinstance(value, Mapping):
        text = f"{{{', '.join(map(str, value))}}}"
    else:
        text = str(value).lower() if isinstance(value, bool) else repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _entry(value: Any, key: str | int) -> Any:
    """Entry of a table or a list; None if there is none."""
    return next((entry for name, entry in _entries(value) if name == key), None)


def places(value: Any, keys: Keys = ()) -> Iterator[tuple[Keys, Any]]:
    """A value and all values in it, with their keys."""
    yield keys, value
    for key, entry in _entries(value):
        yield from places(entry, (*keys, key))


def _entries(value: Any) -> Iterable[tuple[str | int, Any]]:
    return value.items() if isinstance(value, Mapping) else enumerate(value) if isinstance(value, list) else ()


def _too_deep(tables: Any) -> bool:
    """Whether tables and lists lie deeper in each other than any case needs, and than programs follow."""
    level = [tables]
    for _ in range(_DEEPEST):
        level = [entry for value in level for _, entry in _entries(value)]
    return bool(level)


def _paths(value: Any) -> Iterator[Keys]:
    return (keys for keys, _ in places(value))


def _merged(first: Any, second: Any) -> Any:
    """Two tables as one, in which the second wins; a table of another kind replaces the first.

    A table with numbers for keys changes entries of a list.
    """
    if isinstance(first, list) and isinstance(second, Mapping) and second.keys() <= set(range(len(first))):
        return [_merged(entry, second[i]) if i in second else entry for i, entry in enumerate(first)]
    if not isinstance(first, Mapping) or not isinstance(second, Mapping):
        return _named(second)
    if any(key in second and first.get(key) != second[key] for key in _KINDS):
        return _named(second)
    return {**first, **{str(key): _merged(first.get(str(key)), value) for key, value in second.items()}}


def _named(value: Any) -> Any:
    """A value in which keys of tables are texts, also those that could be numbers of entries."""
    return {str(key): _named(entry) for key, entry in value.items()} if isinstance(value, Mapping) else value


def unfolded(tables: Mapping[str, Any], source: File | Setting) -> Document:
    """Tables in their full form, with paths of files that are relative to the source made absolute.

    Raises:
        CaseError: A table is given in both its forms.
    """
    origins: dict[Keys, tuple[File | Setting, Keys]] = {}
    problems = []
    for written in _paths(tables):
        keys = full(written)
        if keys in origins:
            words = f"given twice, as {dotted(origins[keys][1])} and as {dotted(written)}"
            problems.append(f"{source.place(written)}: {dotted(written)}: {words}")
        origins.setdefault(keys, (source, written))
    if problems:
        raise CaseError(problems[:1])
    return Document(_unfold(_located(tables, source.folder)), origins)


def _unfold(tables: Mapping[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, value in tables.items():
        inner = _unfold(value) if key == "heat" and isinstance(value, Mapping) else value
        name, entry = (SINGULAR[key], {key: inner}) if key in SINGULAR else (key, inner)
        found[name] = _merged(found[name], entry) if name in found else entry
    return found


def _located(value: Any, folder: Path) -> Any:
    """Tables in which every ``file`` is an absolute path."""
    if isinstance(value, list):
        return [_located(entry, folder) for entry in value]
    if not isinstance(value, Mapping):
        return value
    located = {key: _located(entry, folder) for key, entry in value.items()}
    if isinstance(file := located.get("file"), str):
        located["file"] = str(folder.resolve() / file)
    return located


def load(path: Path, within: tuple[Path, ...] = ()) -> Document:
    """A case file with what it extends.

    Args:
        path: The file.
        within: The files that extend it.

    Raises:
        CaseError: A file cannot be read, is no TOML, or extends itself.
    """
    file = _file(path)
    try:
        tables = tomllib.loads(file.text)
    except (ValueError, RecursionError) as error:
        raise CaseError([_syntax(file, error)]) from None
    if _too_deep(tables):
        raise CaseError([f"{file.path}:1: must have tables and lists in each other no deeper than {_DEEPEST}"])
    document = unfolded(tables, file)
    base = tables.get("extends")
    if not isinstance(base, str):
        return document
    target = (path.parent / base).resolve()
    chain = (*within, path.resolve())
    if target in chain:
        raise CaseError([document.problem(("extends",), "must be another file than those that extend it", base)])
    if not target.is_file():
        raise CaseError([document.problem(("extends",), "must be a case file, relative to this one", base)])
    del document.tables["extends"]
    return load(path.parent / base, chain).changed(document)


def _file(path: Path) -> File:
    try:
        data = path.read_bytes()
    except OSError as error:
        raise CaseError([f"{path}: cannot be read ({error.strerror})"]) from None
    try:
        return File(path, data.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise CaseError([f"{path}:{line}: must be a text in UTF-8: byte {error.start + 1} is none"]) from None


def _syntax(file: File, error: Exception) -> str:
    words = str(error).split("\n")[0] or type(error).__name__
    place = _PLACE.search(words)
    lines = file.text.split("\n")
    number = int(place[1]) if place and place[1] else len(lines)
    text = lines[number - 1].strip() if number <= len(lines) else ""
    return f"{file.path}:{number}: {_short(text)}: must be TOML: {_PLACE.sub('', words)}"


def setting(key: str, text: str) -> Document:
    """A change from the command line as a document.

    Args:
        key: The key, with dots; a number picks an entry of a list.
        text: Its new value: a TOML value, or a text without quotes.
    """
    value: Any = text
    with suppress(ValueError):
        tables = tomllib.loads(f"value = {text}")
        value = tables["value"] if len(tables) == 1 else text
    for part in reversed(key.split(".")):
        value = {int(part) if part.isdecimal() else part: value}
    return unfolded(value, Setting(f"{key}={text}"))
