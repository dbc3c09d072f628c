"""One level of an Abaqus model: a part instance with its nodes, elements and sets, or all that is outside of these."""

from __future__ import annotations

import logging
from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from cutsim.readers.abaqus_cards import Card, real, whole
from cutsim.readers.abaqus_elements import Elements, shape
from cutsim.readers.mesh_data import Block, Floats, Indices, Numbering
from cutsim.readers.shapes import count_of

logger = logging.getLogger(__name__)

_NONE = np.empty(0, dtype=np.int64)


class Sets:
    """Nodes or elements of a level and sets of them.

    Args:
        what: What they are.
        numbers: Their numbers.
        start: Position of the first of them among those of all levels.
        prefix: What comes before the names of sets.

    Attributes:
        named: Name, with the prefix → positions among those of all levels.
    """

    def __init__(self, what: str, numbers: Indices, start: int, prefix: str) -> None:
        self._what, self._numbering, self._start, self._prefix = what, Numbering(numbers, what), start, prefix
        self._names: dict[str, str] = {}
        self.named: dict[str, Indices] = {}

    def add(self, name: str, members: Indices) -> None:
        """Add members to a set."""
        full = self._names.setdefault(name.upper(), self._prefix + name)
        self.named[full] = np.unique(np.concatenate([self.named.get(full, _NONE), members]))

    def rows(self, numbers: Indices) -> Indices:
        """Positions of some numbers.

        Raises:
            ValueError: There is no such node or element.
        """
        return self._start + self._numbering.rows(numbers)

    def between(self, numbers: range) -> Indices:
        """Positions of those whose numbers are in a range."""
        return self._start + self._numbering.within(numbers)

    def find(self, name: str) -> Indices:
        """Members of a set.

        Raises:
            ValueError: There is no such set.
        """
        if name.upper() not in self._names:
            raise ValueError(f"there is no set of {self._what}s called {name!r} before")
        return self.named[self._names[name.upper()]]


class Level:
    """Nodes, elements and sets of a part instance, or of all that is outside of instances.

    Args:
        name: Name of the instance; empty outside.
        cards: Its keywords.
        before: Levels before this one, to which its sets may refer.
        elements: Elements of these, to which its own are added.

    Attributes:
        name: As given.
        numbers: Numbers of the nodes.
        points: Their positions.
        nodes: Sets of nodes.
        cells: Sets of elements.
        surfaces: Name → corners of facets.

    Raises:
        ValueError: With the line, if a number or name is not known, or something is not read.
    """

    def __init__(self, name: str, cards: Sequence[Card], before: Sequence[Level], elements: Elements) -> None:
        self.name, self._before, self._elements, self._prefix = name, before, elements, f"{name}." if name else ""
        self.numbers, self.points = _nodes(cards)
        start, rows = len(elements), sum(len(level.numbers) for level in before)
        self.nodes = Sets("node", self.numbers, rows, self._prefix)
        own = [self._block(card) for card in cards if card.keyword == "ELEMENT"]
        self.cells = Sets("element", np.concatenate([_NONE, *(block.numbers for block in own)]), start, self._prefix)
        if name and own:
            self.cells.named[name] = np.arange(start, len(elements))
        self.surfaces: dict[str, tuple[Indices, ...]] = {}
        for card, block in zip((card for card in cards if card.keyword == "ELEMENT"), own, strict=True):
            if card.get("ELSET"):
                self.cells.add(card.get("ELSET"), self.cells.rows(block.numbers))
        for card in cards:
            if card.keyword == "NODE" and card.get("NSET"):
                self.nodes.add(card.get("NSET"), self.nodes.rows(_numbers_of_nodes(card)))
            elif card.keyword == "NSET":
                self.nodes.add(card.needed("NSET"), self._members(card, "nodes"))
            elif card.keyword == "ELSET":
                self.cells.add(card.needed("ELSET"), self._members(card, "cells"))
        for card in cards:
            if card.keyword == "SURFACE":
                self._read_surface(card)

    def _block(self, card: Card) -> Block:
        """Add the elements of a keyword."""
        kind = card.needed("TYPE").upper()
        with card.at():
            found = shape(kind)
        lines, table = _element_table(card, 0 if found is None else count_of(found))
        nodes = np.empty((len(table), 0), dtype=np.int64)
        if found is not None:
            try:
                nodes = self.nodes.rows(table[:, 1:])
            except ValueError:
                for line, row in zip(lines, table, strict=True):
                    with card.at(line):
                        self.nodes.rows(row[1:])
        elset = card.get("ELSET") and self._prefix + card.get("ELSET")
        name = elset or self.name or f"part{len(self._elements.blocks) + 1}"
        block = Block(name, kind, found or kind, table[:, 0], nodes, card.line)
        self._elements.blocks.append(block)
        return block

    def _members(self, card: Card, kind: str) -> Indices:
        """Members of a set of nodes or elements."""
        known = {level.name.upper(): level for level in self._before}
        instance = card.get("INSTANCE").upper()
        with card.at():
            # CalculiX has no instances and takes no notice of their names
            if instance and known and instance not in known:
                raise ValueError(f"there is no *INSTANCE {card.get('INSTANCE')!r} before")
        level = known.get(instance, self)
        sets: Sets = getattr(level, kind)
        if kind == "nodes" and card.get("ELSET"):
            with card.at():
                return self._elements.nodes(level._find("cells", card.get("ELSET")))
        found = [_NONE]
        for line, entries in card.rows():
            with card.at(line):
                if "GENERATE" in card.parameters:
                    found.append(sets.between(_range(entries)))
                else:
                    found += [level._entry(kind, entry) for entry in entries]
        return np.concatenate(found)

    def _entry(self, kind: str, entry: str) -> Indices:
        """Members that a number or the name of a set stands for."""
        if entry.lstrip("+-").isdecimal():
            sets: Sets = getattr(self, kind)
            return sets.rows(np.array([whole(entry)]))
        return self._find(kind, entry)

    def _find(self, kind: str, name: str) -> Indices:
        """Members of a set of this level, or of ``Instance.Set``."""
        name = name.strip('"')
        for level in self._before:
            if name.upper().startswith(f"{level.name.upper()}."):
                return level._find(kind, name[len(level.name) + 1 :])
        sets: Sets = getattr(self, kind)
        return sets.find(name)

    def _read_surface(self, card: Card) -> None:
        name, kind = self._prefix + card.needed("NAME"), card.get("TYPE").upper() or "ELEMENT"
        if kind == "NODE":
            for line, entries in card.rows():
                with card.at(line):
                    self.nodes.add(card.needed("NAME"), self._entry("nodes", entries[0]))
            return
        if kind != "ELEMENT" or "COMBINE" in card.parameters:
            logger.warning("surface %r in line %d is left out: it is not made of faces of elements", name, card.line)
            return
        widths: dict[int, list[Indices]] = {}
        for line, entries in card.rows():
            with card.at(line):
                elements = self._entry("cells", entries[0])
                for faces in self._elements.faces(elements, entries[1].upper() if len(entries) > 1 else ""):
                    widths.setdefault(faces.shape[1], []).append(faces)
        self.surfaces[name] = tuple(np.concatenate(faces) for faces in widths.values())


def _nodes(cards: Sequence[Card]) -> tuple[Indices, Floats]:
    """Numbers of all nodes and their positions, where an instance has moved them; of two with a number the last."""
    numbers, points = list[int](), list[list[float]]()
    for card in cards:
        if card.keyword != "NODE":
            continue
        with card.at():
            if card.get("SYSTEM").upper() not in ("", "R"):
                raise ValueError("nodes in cylindrical or spherical coordinates are not read (SYSTEM=…)")
        for line, entries in card.rows():
            with card.at(line):
                numbers.append(whole(entries[0]))
                points.append([*map(real, entries[1:4]), 0.0, 0.0, 0.0][:3])
    places = dict(zip(numbers, points, strict=True))
    ids = np.array(list(places), dtype=np.int64)
    return ids, _moved(np.array(list(places.values()), dtype=np.float64).reshape(-1, 3), cards)


def _numbers_of_nodes(card: Card) -> Indices:
    return np.array([whole(entries[0]) for _, entries in card.rows()], dtype=np.int64)


def _moved(points: Floats, cards: Sequence[Card]) -> Floats:
    """Nodes of an instance where its translation, and then its rotation about an axis, bring them."""
    if not cards or cards[0].keyword != "INSTANCE":
        return points
    rows = [(line, entries) for line, entries in cards[0].rows()][:2]
    for (line, entries), count in zip(rows, (3, 7), strict=False):
        with cards[0].at(line):
            if len(entries) != count:
                raise ValueError(f"must have {count} numbers, found {len(entries)}")
            numbers = np.array(list(map(real, entries)))
            if count == 3:
                points = points + numbers
                continue
            axis = numbers[3:6] - numbers[:3]
            turn = Rotation.from_rotvec(np.radians(numbers[6]) * axis / (np.linalg.norm(axis) or 1.0))
            points = numbers[:3] + turn.apply(points - numbers[:3]) if len(points) else points
    return points


def _element_table(card: Card, count: int) -> tuple[list[int], Indices]:
    """Numbers of elements and of so many nodes of each, and their lines; only the numbers of elements if it is 0.

    The nodes of an element may go on in further lines.
    """
    if count and (whole_table := card.table(count + 1)) is not None:
        return [line for line, _ in card.data], whole_table
    lines, table, row, goes_on = list[int](), list[list[int]](), list[int](), False
    for line, entries in card.rows():
        with card.at(line):
            if count == 0:
                if not goes_on:
                    lines.append(line)
                    table.append([whole(entries[0])])
                goes_on = dict(card.data)[line].endswith(",")
                continue
            if not row:
                lines.append(line)
            row += map(whole, entries)
            if len(row) > count + 1:
                raise ValueError(f"an element must have {count} nodes, found {len(row) - 1}")
            if len(row) == count + 1:
                table.append(row)
                row = []
    if row:
        with card.at(lines[-1]):
            raise ValueError(f"an element must have {count} nodes, found {len(row) - 1}")
    return lines, np.array(table, dtype=np.int64).reshape(-1, count + 1)


def _range(entries: Sequence[str]) -> range:
    """Numbers from a first to a last one in steps."""
    numbers = [whole(entry) for entry in entries if entry]
    if len(numbers) not in (2, 3) or numbers[2:] == [0]:
        raise ValueError(f"must be first, last, step, found {', '.join(entries)[:60]!r}")
    return range(numbers[0], numbers[1] + 1, *numbers[2:])
