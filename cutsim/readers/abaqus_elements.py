"""Elements of Abaqus and CalculiX: their shapes and their faces."""

import re
from collections.abc import Iterator, Sequence

import numpy as np

from cutsim.readers import shapes
from cutsim.readers.mesh_data import Block, Indices

_SOLIDS = {
    "4": "tetra", "5": "pyramid", "6": "wedge", "8": "hexahedron", "10": "tetra10", "13": "pyramid13",
    "15": "wedge15", "20": "hexahedron20",
}  # fmt: skip
_FLAT = {"3": "triangle", "4": "quad", "6": "triangle6", "65": "triangle6", "8": "quad8", "9": "quad9"}
_CURVES = {"2": "line", "3": "line3"}
# families of solids, of plane solids with shells, membranes and rigid surfaces, and of trusses with rigid curves by the
# start of their names, and their shapes by the number that follows
_FAMILIES = (
    (re.compile(r"(?:(?:[AD]?C|F|Q)3D|SC|CSS)(\d+)"), _SOLIDS),
    (re.compile(r"(?:CG?PEG?|CPS|CG?AX|[AD]C2D|[AD]CAX|D?S|M3D|SFM3D|R3D|STRI)(\d+)"), _FLAT),
    (re.compile(r"(?:T[23]D|R2D|RAX)(\d)"), _CURVES),
)
# corners of the faces S1, S2 … of each shape
_FACES: dict[str, list[list[int]]] = {
    "tetra": [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]],
    "hexahedron": [[0, 1, 2, 3], [4, 7, 6, 5], [0, 4, 5, 1], [1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 4, 0]],
    "wedge": [[0, 1, 2], [3, 5, 4], [0, 3, 4, 1], [1, 4, 5, 2], [2, 5, 3, 0]],
    "triangle": [[0, 1], [1, 2], [2, 0]],
    "quad": [[0, 1], [1, 2], [2, 3], [3, 0]],
}
# the two sides of a shell
_SIDES = ("SPOS", "SNEG")


def shape(kind: str) -> str | None:
    """Shape of a type of elements as meshio calls it, None if it is no volume, face or curve.

    Raises:
        ValueError: It is one, with a number of nodes that is not known.
    """
    for pattern, known in _FAMILIES:
        if match := pattern.match(kind):
            if match[1] not in known:
                raise ValueError(f"elements of type {kind} are not read")
            return known[match[1]]
    return None


class Elements:
    """Elements of a model, counted through all its blocks.

    Attributes:
        blocks: The elements.
    """

    def __init__(self) -> None:
        self.blocks: list[Block] = []

    def __len__(self) -> int:
        return sum(len(block.numbers) for block in self.blocks)

    def faces(self, elements: Indices, label: str) -> list[Indices]:
        """Corners of one face of some elements, an array for each block.

        Args:
            elements: Positions of the elements.
            label: The face: S1, S2 …; SPOS or SNEG for that of a shell; nothing for those of no other element.

        Raises:
            ValueError: An element has no such face.
        """
        found = []
        for block, rows in self._by_block(elements):
            if label in _SIDES and shapes.dimension(block.shape) == 2:
                found.append(shapes.corners(block.shape, block.nodes[rows]))
                continue
            known = _FACES.get(shapes.plain(block.shape), [])
            numbers = range(len(known)) if not label else [int(label[1:]) - 1] if label[1:].isdecimal() else []
            if known and not (label[:1] in ("", "S") and numbers and 0 <= numbers[0] < len(known)):
                raise ValueError(f"elements of type {block.kind} have no face {label!r}")
            for number in numbers if known else []:
                found.append(block.nodes[rows][:, known[number]])
        return found if label else self._free(found)

    def nodes(self, elements: Indices) -> Indices:
        """Nodes of some elements."""
        parts = [block.nodes[rows].ravel() for block, rows in self._by_block(elements)]
        return np.unique(np.concatenate([np.empty(0, dtype=np.int64), *parts]))

    def _by_block(self, elements: Indices) -> Iterator[tuple[Block, Indices]]:
        start = 0
        for block in self.blocks:
            own = elements[(start <= elements) & (elements < start + len(block.numbers))] - start
            start += len(block.numbers)
            if len(own):
                yield block, own

    def _free(self, faces: Sequence[Indices]) -> list[Indices]:
        """Those of some faces that belong to one element of the model only."""
        everything = [
            block.nodes[:, corners] for block in self.blocks for corners in _FACES.get(shapes.plain(block.shape), [])
        ]
        # faces are the same if the sums of random numbers of their nodes are
        nodes = 1 + max((int(rows.max(initial=0)) for rows in everything), default=0)
        random = np.random.default_rng(2).integers(0, 2**62, nodes, dtype=np.uint64)
        keys, count = np.unique(np.concatenate([random[rows].sum(axis=1) for rows in everything]), return_counts=True)
        return [rows[count[np.searchsorted(keys, random[rows].sum(axis=1))] == 1] for rows in faces]
