"""Which elements of a mesh file are the cells of the mesh."""

from collections import Counter
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cutsim.base.checks import require
from cutsim.readers import shapes
from cutsim.readers.mesh_data import Indices, MeshData
from cutsim.readers.twins import Parts


class Selection:
    """Elements of a file that are the cells of a mesh.

    Args:
        data: What the file says.
        gdim: Dimension of the cells.
        only: Names of the groups that make the mesh; all cells if None.

    Attributes:
        shape: Type of the cells.
        nodes: Their nodes as rows of the points of the file.
        parts: Groups of cells.

    Raises:
        ValueError: There are none of this dimension or no group of a name, or they are not of one type that can be
            used.
    """

    def __init__(self, data: MeshData, gdim: int, only: Sequence[str] | None) -> None:
        self._data, self._gdim = data, gdim
        sizes = [len(block.nodes) for block in data.blocks]
        self._block: Indices = np.repeat(np.arange(len(sizes)), sizes)
        self._starts = np.cumsum([0, *sizes])
        self._dims = np.array([shapes.dimension(block.shape) for block in data.blocks], dtype=np.int64)[self._block]
        self._chosen = self._wanted(only)
        self._check_types()
        self.shape = data.blocks[self._block[self._chosen][0]].shape
        self.nodes: Indices = np.concatenate([
            block.nodes[self._chosen[start : start + len(block.nodes)]]
            for block, start in zip(data.blocks, self._starts, strict=False)
            if self._chosen[start : start + len(block.nodes)].any()
        ])  # fmt: skip
        number = np.where(self._chosen, np.cumsum(self._chosen) - 1, -1)
        groups = {name: number[members][number[members] >= 0] for name, members in data.cell_sets.items()}
        self.parts = Parts({name: cells for name, cells in groups.items() if len(cells)}, len(self.nodes))

    @property
    def left(self) -> NDArray[np.bool_]:
        """Nodes of the file that elements have which are no cells."""
        left = np.zeros(len(self._data.points), dtype=bool)
        for block, start in zip(self._data.blocks, self._starts, strict=False):
            left[block.nodes[~self._chosen[start : start + len(block.nodes)]]] = True
        return left

    def faces(self, members: Indices) -> list[Indices]:
        """Corners of elements one dimension lower than the cells among some elements of the file, as rows of points."""
        lower = members[self._dims[members] == self._gdim - 1]
        found = []
        for number in np.unique(self._block[lower]):
            block = self._data.blocks[number]
            own = lower[self._block[lower] == number] - self._starts[number]
            found.append(shapes.corners(block.shape, block.nodes[own]))
        return found

    def lower(self) -> str:
        """How many elements of which type are too low in dimension to be facets, in words."""
        return self._words(self._dims < self._gdim - 1)

    def _wanted(self, only: Sequence[str] | None) -> NDArray[np.bool_]:
        """Which elements are cells."""
        cells = self._dims == self._gdim
        if only is None:
            return cells
        groups = {name: members for name, members in self._data.cell_sets.items() if cells[members].any()}
        wanted = np.zeros(len(cells), dtype=bool)
        for name in only:
            require("only", name, name in groups, f"a group of cells: {', '.join(groups) or 'there are none'}")
            wanted[groups[name]] = True
        return cells & wanted

    def _check_types(self) -> None:
        """Refuse elements of a type that cannot be used, or of several types."""
        if not self._chosen.any():
            found = self._words(np.ones(len(self._dims), dtype=bool))
            raise ValueError(
                f"gdim = {self._gdim}, but the file has no cells of this dimension, it has {found or 'none'}"
            )
        used = {self._data.blocks[number].shape for number in np.unique(self._block[self._chosen])}
        for shape in used:
            if not shapes.usable(shape):
                of = np.array([block.shape == shape for block in self._data.blocks])[self._block] & self._chosen
                total = np.count_nonzero(self._chosen)
                raise ValueError(f"{self._words(of)} of {total} cells cannot be used: {shapes.instead(shape)}")
        if len(used) > 1:
            raise ValueError(
                f"the cells must be of one type, found {self._words(self._chosen)}: "
                "read the groups of one type (only=[…]), or mesh all with one type"
            )

    def _words(self, which: NDArray[np.bool_]) -> str:
        """How many elements of which type are among some, and in which groups they are."""
        kinds: dict[str, Counter[str]] = {}
        for number in np.unique(self._block[which]):
            block = self._data.blocks[number]
            kinds.setdefault(block.kind, Counter())[block.name] += int(
                np.count_nonzero(which & (self._block == number))
            )
        return ", ".join(
            f"{sum(names.values())} {kind!r}" + (f" (in {_listed(list(names))})" if any(names) else "")
            for kind, names in kinds.items()
        )


def _listed(names: Sequence[str]) -> str:
    return ", ".join(repr(name) for name in names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")
