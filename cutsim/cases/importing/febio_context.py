"""What the translations of the parts of a FEBio file share."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from cutsim.base.arrays import Array
from cutsim.cases.importing.draft import Draft, MalformedFile, Untranslatable
from cutsim.cases.importing.febio_file import FebioFile
from cutsim.readers.mesh_data import MeshData, Numbering
from cutsim.readers.xml_tree import LinedElement

AXES = "xyz"


@dataclass(frozen=True)
class Context:
    """A FEBio file, its mesh, and the case that is made of it.

    Attributes:
        file: The file.
        draft: The case.
        mesh: Nodes, elements and sets of the file.
        rigid_parts: Names of the parts that are rigid bodies, by the name of each such body.
        quadratic: Whether the displacement is of degree 2.
    """

    file: FebioFile
    draft: Draft
    mesh: MeshData
    rigid_parts: dict[str, list[str]] = field(default_factory=dict)
    quadratic: bool = False

    def attempt(self, element: LinedElement, translate: Callable[[LinedElement], None]) -> None:
        """Translate an element, or note that it has no counterpart."""
        self.file.read(element)
        try:
            translate(element)
        except Untranslatable as problem:
            self.draft.untranslated(problem.line, f"{describe(element)}: {problem}")
            self.file.read_all(element)

    def rows(self, numbers: Iterable[int], element: LinedElement) -> NDArray[np.int64]:
        """Rows of nodes in the points of the mesh by their numbers.

        Raises:
            MalformedFile: There is no such node.
        """
        try:
            return Numbering(self.mesh.numbers, "node").rows(np.array(list(numbers), dtype=np.int64))
        except ValueError as error:
            raise MalformedFile(f"{self.file.place(element)}: <{element.tag}>: {error}") from None

    def nodes_of(self, parts: Iterable[str]) -> NDArray[np.int64]:
        """Rows of the nodes of some parts."""
        wanted = set(parts)
        nodes = [block.nodes.ravel() for block in self.mesh.blocks if block.name in wanted]
        return np.unique(np.concatenate(nodes)) if nodes else np.empty(0, dtype=np.int64)

    @property
    def deformable_nodes(self) -> NDArray[np.int64]:
        """Rows of the nodes of all parts that are no rigid bodies."""
        rigid = {part for parts in self.rigid_parts.values() for part in parts}
        return self.nodes_of({block.name for block in self.mesh.blocks} - rigid)

    def places(self, rows: NDArray[np.int64]) -> list[list[float]]:
        """Positions of some nodes."""
        positions: Array = self.mesh.points[rows]
        return [[float(c) for c in point] for point in positions]


def describe(element: LinedElement) -> str:
    """An element of a FEBio file in words."""
    kind = element.get("type") or element.get("id") or element.get("bc") or element.get("var")
    words = [f"<{element.tag}>", *(repr(word) for word in (element.get("name"), kind) if word)]
    return " ".join(words)
