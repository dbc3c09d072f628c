"""What mesh files have in common: nodes, elements, and named sets of nodes, elements and facets."""

from collections.abc import Iterable, Mapping, MutableMapping
from dataclasses import dataclass, field
from itertools import chain, count
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Block:
    """Elements of one type that a file lists together.

    Attributes:
        name: Name of the set of these elements.
        kind: Their type as the file calls it, such as ``"C3D10M"`` or ``"tet10"``.
        shape: The same as meshio calls it, such as ``"tetra10"``; the type of the file if it has no name there.
        numbers: Numbers of the elements in the file, shape (elements,).
        nodes: Rows of their nodes in the points, in the order of VTK, corners first; shape (elements, nodes).
        line: Where the file lists them; 0 if it has no lines.
    """

    name: str
    kind: str
    shape: str
    numbers: Indices
    nodes: Indices
    line: int = 0


@dataclass(frozen=True)
class MeshData:
    """What a mesh file says about geometry and groups, before any check that this makes one mesh.

    Names are those of the file without blanks at their ends. Of two different sets of one kind with the same name the
    later one has ``_2`` added.

    Attributes:
        points: Positions of all nodes in the unit of the file, shape (nodes, 3).
        numbers: Numbers of the nodes in the file, shape (nodes,).
        blocks: The elements.
        node_sets: Name → rows of the nodes in the points.
        cell_sets: Name → positions of the elements, counted through all blocks. Those with the name of a block, which
            come first, are the parts of the mesh.
        facet_sets: Name → corners of the facets as rows of the points, an array for each number of corners.
        pairs: Name → names of the two sets of facets of a pair of surfaces, slave (primary) first.
        advice: What to do where facets of a set are none of the mesh, for messages.
    """

    points: Floats
    numbers: Indices
    blocks: tuple[Block, ...]
    node_sets: Mapping[str, Indices] = field(default_factory=dict)
    cell_sets: Mapping[str, Indices] = field(default_factory=dict)
    facet_sets: Mapping[str, tuple[Indices, ...]] = field(default_factory=dict)
    pairs: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    advice: str = ""


class Numbering:
    """Numbers that a file gives to nodes or elements, and where they are in its arrays.

    Args:
        numbers: The numbers in the order of the file; of one that is there twice the first counts.
        what: What they are, for messages.
    """

    def __init__(self, numbers: Indices, what: str) -> None:
        self._sorted, self._first = np.unique(numbers, return_index=True)
        self._what = what

    def __len__(self) -> int:
        return len(self._sorted)

    def has(self, wanted: Indices) -> NDArray[np.bool_]:
        """Which numbers are there."""
        return np.isin(wanted, self._sorted)

    def within(self, numbers: range) -> Indices:
        """Where those are that are in a range."""
        inside = (self._sorted >= numbers.start) & (self._sorted < numbers.stop)
        return self._first[inside & ((self._sorted - numbers.start) % numbers.step == 0)]

    def rows(self, wanted: Indices) -> Indices:
        """Where some numbers are.

        Raises:
            ValueError: One is not there.
        """
        lost = wanted[~self.has(wanted)]
        if len(lost):
            raise ValueError(f"there is no {self._what} {lost[0]}")
        return np.asarray(self._first[np.searchsorted(self._sorted, wanted)], dtype=np.int64)


def block_sets(blocks: Iterable[Block]) -> dict[str, Indices]:
    """The elements of each name of a block, counted through all blocks."""
    sets: dict[str, Indices] = {}
    start = 0
    for block in blocks:
        own = np.arange(start, start + len(block.nodes), dtype=np.int64)
        sets[block.name] = np.concatenate([sets.get(block.name, own[:0]), own])
        start += len(own)
    return sets


def free_name(sets: Mapping[str, Any], name: str) -> str:
    """The name, or with a number added if a set is called so."""
    names = chain([name], (f"{name}_{number}" for number in count(2)))
    return next(free for free in names if free not in sets)


def add_set(sets: MutableMapping[str, Indices], name: str, members: Indices) -> None:
    """Add a set under its name, or with a number added if another one is called so."""
    members = np.unique(members)
    if name not in sets or not np.array_equal(sets[name], members):
        sets[free_name(sets, name)] = members
