"""An input file of Abaqus or CalculiX, with a record of what has been read of it."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from cutsim.cases.importing.draft import Draft, MalformedFile, Untranslatable
from cutsim.readers.abaqus import read_abaqus
from cutsim.readers.abaqus_cards import Card, read_cards, real
from cutsim.readers.mesh_data import MeshData


@dataclass(frozen=True)
class Located:
    """A keyword and where it stands.

    Attributes:
        card: The keyword.
        part: Name of the part in which it is, empty outside of parts.
        step: Number of the step in which it is, 0 before the first one.
    """

    card: Card
    part: str
    step: int


class AbaqusFile:
    """An input file.

    Args:
        path: The file.

    Attributes:
        path: As above.
        draft: The case that is made of it.
        cards: Its keywords with their places.
        mesh: Nodes, elements and sets.
        end: Time at the end of the run, set by the translation of the steps [time].
        large: Whether displacements are large (NLGEOM), set likewise.

    Raises:
        MalformedFile: It is no such file, with the line.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.draft, self.end, self.large = path, Draft(path), 1.0, False
        with self.naming():
            self.mesh: MeshData = read_abaqus(path)
            self.cards = list(_located(read_cards(path)))
        self._read: set[int] = set()

    @contextmanager
    def naming(self) -> Iterator[None]:
        """Name the file in errors of this context."""
        try:
            yield
        except MalformedFile:
            raise
        except ValueError as error:
            raise MalformedFile(f"{self.path.name}: {error}") from None

    def take(self, *keywords: str) -> Iterator[Located]:
        """The keywords of some names, which are then read."""
        for located in self.cards:
            if located.card.keyword in keywords:
                self._read.add(id(located.card))
                yield located

    def read(self, card: Card) -> None:
        """Take note that a keyword is read."""
        self._read.add(id(card))

    def leftovers(self) -> Iterator[Card]:
        """Keywords that have not been read."""
        return (located.card for located in self.cards if id(located.card) not in self._read)

    @contextmanager
    def attempt(self, card: Card) -> Iterator[None]:
        """Note that a keyword has no counterpart if it turns out so in this context."""
        try:
            yield
        except Untranslatable as problem:
            self.draft.untranslated(problem.line, f"*{card.keyword}: {problem}")

    def numbers(self, card: Card, least: int = 0) -> list[float]:
        """All numbers of the data of a keyword.

        Raises:
            ValueError: There are fewer than `least`.
        """
        found = []
        for line, entries in card.rows():
            with card.at(line):
                found += [real(entry) for entry in entries]
        if len(found) < least:
            with card.at():
                raise ValueError(f"must have {least} numbers or more, found {len(found)}")
        return found

    def find(self, names: Iterable[str], wanted: str, part: str = "") -> list[str]:
        """Names of sets as the mesh has them, without regard to capitals, in all instances of a part.

        Args:
            names: The names that the mesh has.
            wanted: The name as the file refers to it.
            part: Name of the part in which it does so.
        """
        plain = wanted.strip().strip('"').upper()
        prefixes = [f"{name}." for name in self.instances(part)] if part else [""]
        sought = {(prefix + plain).upper() for prefix in prefixes}
        return [name for name in names if name.upper() in sought]

    def instances(self, part: str) -> list[str]:
        """Names of the instances of a part; the part itself if it has none."""
        found = [
            located.card.get("NAME")
            for located in self.cards
            if located.card.keyword == "INSTANCE" and located.card.get("PART").upper() == part.upper()
        ]
        return found or [part]


def entry(entries: list[str], i: int) -> str:
    """An entry of a line of data.

    Raises:
        ValueError: The line is shorter.
    """
    if i >= len(entries):
        raise ValueError(f"must have {i + 1} entries or more, found {', '.join(entries)[:60]!r}")
    return entries[i]


def _located(cards: Iterable[Card]) -> Iterator[Located]:
    part, step = "", 0
    for card in cards:
        if card.keyword == "PART":
            part = card.get("NAME")
        elif card.keyword == "STEP":
            step += 1
        yield Located(card, part, step)
        if card.keyword == "END PART":
            part = ""
