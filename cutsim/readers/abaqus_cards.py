"""Keywords of Abaqus and CalculiX with their parameters and lines of data."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

# files that include each other in a circle are noticed at this depth
_DEEPEST = 16
# numbers of nodes and elements are below this
_LARGEST = 2**62


@dataclass(frozen=True)
class Card:
    """A keyword with its data.

    Attributes:
        keyword: Its name in capitals without the star, such as ``"SOLID SECTION"``.
        parameters: Its parameters, names in capitals; those without a value have an empty one.
        data: Lines of data with their number.
        line: Number of its line.
        file: The file, if it is not the one that was asked for.
    """

    keyword: str
    parameters: Mapping[str, str]
    data: tuple[tuple[int, str], ...]
    line: int
    file: str = ""

    @contextmanager
    def at(self, line: int | None = None) -> Iterator[None]:
        """Say of errors in this context that they are in a line; in that of the keyword if none is given."""
        try:
            yield
        except ValueError as error:
            place = f"line {self.line if line is None else line}"
            raise ValueError(f"{self.file + ': ' * bool(self.file)}{place}: *{self.keyword}: {error}") from None

    def get(self, parameter: str) -> str:
        """Value of a parameter; empty if it is not given."""
        return self.parameters.get(parameter, "")

    def needed(self, parameter: str) -> str:
        """Value of a parameter.

        Raises:
            ValueError: It is not given.
        """
        if not self.get(parameter):
            with self.at():
                raise ValueError(f"there is no {parameter}=…")
        return self.get(parameter)

    def table(self, columns: int) -> NDArray[np.int64] | None:
        """Its data, if they are a table of whole numbers with so many columns; in one go, since meshes are large."""
        if any(text.count(",") != columns - 1 for _, text in self.data):
            return None
        try:
            numbers = np.array(list(map(int, ",".join(text for _, text in self.data).split(","))), dtype=np.int64)
        except (ValueError, OverflowError):
            return None
        return numbers.reshape(-1, columns)

    def rows(self) -> Iterator[tuple[int, list[str]]]:
        """Entries of each line of data with the number of the line."""
        for line, text in self.data:
            entries = [entry.strip() for entry in text.split(",")]
            yield line, entries[:-1] if entries[-1] == "" and len(entries) > 1 else entries


def whole(text: str) -> int:
    """A whole number.

    Raises:
        ValueError: The text is none, or too large.
    """
    try:
        value = int(text)
    except ValueError:
        value = _LARGEST
    if abs(value) >= _LARGEST:
        raise ValueError(f"{text!r} is no whole number that can be used")
    return value


def real(text: str) -> float:
    """A number; nothing is zero.

    Raises:
        ValueError: The text is none.
    """
    try:
        return float(text.upper().replace("D", "E") or 0)
    except ValueError:
        raise ValueError(f"{text!r} is no number") from None


def read_cards(path: Path | str) -> list[Card]:
    """Read the keywords of an input file in their order, those of included files in place of ``*INCLUDE``.

    Raises:
        ValueError: A file is not there, is no text of this kind, or files include each other in a circle.
        OSError: A file cannot be read.
    """
    return list(_cards(Path(path), "", Path(path).parent))


def _cards(path: Path, file: str, folder: Path, depth: int = 0) -> Iterator[Card]:
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    head: tuple[int, str] | None = None
    data: list[tuple[int, str]] = []
    for number, line in enumerate(lines, start=1):
        text = line.strip()
        if text.startswith("**") or not text:
            continue
        if head is not None and not data and head[1].endswith(","):
            head = head[0], head[1] + text
        elif text.startswith("*"):
            if head is not None:
                yield from _complete(_card(head, data, file), folder, depth)
            head, data = (number, text), []
        elif head is not None:  # what comes before the first keyword is no data
            data.append((number, text))
    if head is not None:
        yield from _complete(_card(head, data, file), folder, depth)


def _card(head: tuple[int, str], data: list[tuple[int, str]], file: str) -> Card:
    keyword, *options = head[1][1:].split(",")
    parameters = {}
    for option in options:
        name, _, value = option.partition("=")
        if name.strip():
            parameters[" ".join(name.upper().split())] = value.strip().strip('"').strip()
    return Card(" ".join(keyword.upper().split()), parameters, tuple(data), head[0], file)


def _complete(card: Card, folder: Path, depth: int) -> Iterator[Card]:
    """A card with the data that it takes from a file, or those of an included file."""
    if not card.get("INPUT") or card.keyword not in ("INCLUDE", "NODE", "ELEMENT"):
        yield card
        return
    name = card.get("INPUT")
    if not (folder / name).is_file() or depth == _DEEPEST:
        why = "files include each other in a circle" if depth == _DEEPEST else "there is no such file"
        with card.at():
            raise ValueError(f"{name!r}: {why}")
    if card.keyword == "INCLUDE":
        yield from _cards(folder / name, name, folder, depth + 1)
    else:
        text = (folder / name).read_text(encoding="utf-8", errors="replace").splitlines()
        data = [(i, line.strip()) for i, line in enumerate(text, start=1) if line.strip() and not line.startswith("*")]
        yield Card(card.keyword, card.parameters, tuple(data), card.line, name)
