"""Meshes of Abaqus and CalculiX: .inp files."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from cutsim.readers.abaqus_cards import Card, read_cards
from cutsim.readers.abaqus_elements import Elements
from cutsim.readers.abaqus_level import Level
from cutsim.readers.mesh_data import Indices, MeshData, block_sets

# keywords that make nodes and elements of others
_GENERATORS = ("NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "SYSTEM")


def read_abaqus(path: Path | str) -> MeshData:
    """Read the mesh of an input file of Abaqus or CalculiX.

    Sets of a part instance are called ``Instance.Set``, and all its elements ``Instance``. Elements without a set are
    called by their instance, or ``part1``, ``part2`` … in the order of the file. Names are compared without regard to
    capitals, and keep those of the file. Elements that are no volume, face or curve have no nodes here.

    Args:
        path: The file; files that it includes are looked for beside it.

    Raises:
        ValueError: It is no such file, or its mesh is not as it should be, with the line.
        OSError: A file cannot be read.
    """
    own, instances = _sorted(read_cards(path))
    levels, elements = list[Level](), Elements()
    for name, cards in [*instances, ("", own)]:
        levels.append(Level(name, cards, tuple(levels), elements))
    points = np.concatenate([level.points for level in levels])
    if not len(points) or not len(elements):
        raise ValueError(f"the file has no *{'ELEMENT' if len(points) else 'NODE'}")
    cell_sets = block_sets(elements.blocks)
    node_sets: dict[str, Indices] = {}
    facet_sets: dict[str, tuple[Indices, ...]] = {}
    for level in levels:
        node_sets |= level.nodes.named
        cell_sets |= level.cells.named
        facet_sets |= level.surfaces
    numbers = np.concatenate([level.numbers for level in levels])
    return MeshData(points, numbers, tuple(elements.blocks), node_sets, cell_sets, facet_sets)


def _sorted(cards: Iterable[Card]) -> tuple[list[Card], list[tuple[str, list[Card]]]]:
    """Keywords outside of instances, and those of each instance after those of its part; the first one is its own."""
    parts: dict[str, list[Card]] = {}
    instances: list[tuple[str, list[Card]]] = []
    outside: list[Card] = []
    current = outside
    for card in cards:
        if card.keyword in _GENERATORS:
            with card.at():
                raise ValueError("this is not read; let Abaqus write out nodes and elements")
        if card.keyword == "PART":
            current = parts[card.needed("NAME").upper()] = [card]
        elif card.keyword == "INSTANCE":
            part = card.needed("PART").upper()
            if part not in parts:
                with card.at():
                    raise ValueError(f"there is no *PART {card.get('PART')!r} before")
            current = [card, *parts[part][1:]]
            instances.append((card.needed("NAME"), current))
        elif card.keyword in ("END PART", "END INSTANCE"):
            current = outside
        else:
            current.append(card)
    if parts and not instances:
        instances = [(part[0].get("NAME"), part) for part in parts.values()]
    return outside, instances
