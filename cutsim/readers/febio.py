"""Meshes of FEBio: .feb files of versions 2.0 to 4.0."""

import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cutsim.readers.mesh_data import Block, Floats, Indices, MeshData, Numbering, add_set, block_sets, free_name
from cutsim.readers.xml_tree import LinedElement, read_xml

VERSIONS = ("2.0", "2.5", "3.0", "4.0")

# elements by their name in meshio, and those of other names that have the same nodes
_SHAPES = {
    "tet4": "tetra", "tet10": "tetra10", "hex8": "hexahedron", "hex20": "hexahedron20", "hex27": "hexahedron27",
    "penta6": "wedge", "penta15": "wedge15", "pyra5": "pyramid", "pyra13": "pyramid13",
    "tri3": "triangle", "tri6": "triangle6", "quad4": "quad", "quad8": "quad8", "quad9": "quad9",
    "line2": "line", "line3": "line3", "truss2": "line",
    "ut4": "tetra", "tri3s": "triangle", "q4eas": "quad", "q4ans": "quad", "q4s": "quad",
}  # fmt: skip
# the faces of a hex27 in the order of VTK
_FACES_OF_VTK = [*range(20), 23, 21, 20, 22, 24, 25, 26]
# corners of facets by the start of their name
_CORNERS = {"tri": 3, "quad": 4}
_LINES = {"line2": 2, "line3": 3, "delem": 2}
#: What older files call the surfaces of a pair, and what newer ones call them.
SIDES = {"slave": "primary", "master": "secondary"}
_LARGEST = 2**62


def read_febio(path: Path | str) -> MeshData:
    """Read the mesh of an FEBio model.

    Parts (``Elements``) without a name are called ``part1``, ``part2`` … in the order of the file. Sets of edges and of
    discrete elements become sets of their nodes, lists of parts become sets of elements.

    Args:
        path: The .feb file; files that it includes are looked for beside it.

    Raises:
        ValueError: It is no such file, or its mesh is not as it should be, with the line.
        OSError: A file cannot be read.
    """
    root = read_model(path)
    sections = [child for child in _lined(root) if child.tag in ("Mesh", "Geometry")]
    if not sections:
        raise ValueError("the file has no <Mesh> (before version 3.0: <Geometry>)")
    reader = _Reader()
    reader.read(sections)
    return reader.data()


def read_model(path: Path | str) -> LinedElement:
    """Read an FEBio model as XML, in which sections that it takes from other files are put in their place.

    Raises:
        ValueError: It is no such file or of a version that is not known, with the line.
        OSError: A file cannot be read.
    """
    root = read_xml(path)
    version = root.get("version", "").strip()
    if root.tag != "febio_spec":
        raise ValueError(f"{root.place}: <{root.tag}> is no model of FEBio, which starts with <febio_spec>")
    if version not in VERSIONS:
        raise ValueError(
            f"{root.place}: version {version!r} of FEBio's format is not known; known are {', '.join(VERSIONS)}. "
            "FEBio Studio converts a file when it opens and saves it"
        )
    root[:] = list(_included(root, Path(path).parent, depth=8))
    return root


def _included(root: LinedElement, folder: Path, depth: int) -> Iterator[LinedElement]:
    """Sections of a model, with those of other files in place of what refers to these."""
    for section in _lined(root):
        name = _text(section) if section.tag == "Include" else section.get("from", "")
        if not name:
            yield section
            continue
        if not depth or not (folder / name).is_file():
            why = "there is no such file" if depth else "files include each other in a circle"
            raise ValueError(f"{section.place}: <{section.tag}> takes {name!r}: {why}")
        inner = _included(read_xml(folder / name, name), folder, depth - 1)
        yield from (each for each in inner if section.tag in ("Include", each.tag))


def _lined(element: LinedElement) -> Iterator[LinedElement]:
    """Children of an element; all of a file that is read here know their lines."""
    for child in element:
        assert isinstance(child, LinedElement)
        yield child


def _text(element: LinedElement) -> str:
    return (element.text or "").strip()


def _name(element: LinedElement) -> str:
    """The name that an element must have."""
    name = element.get("name", "").strip()
    if not name:
        raise ValueError(f"{element.place}: <{element.tag}> has no name")
    return name


def _numbers(elements: Sequence[LinedElement], width: int, kind: type) -> NDArray[Any]:
    """Rows of numbers, one for each element."""
    texts = [element.text or "" for element in elements]
    if all(text.count(",") == width - 1 for text in texts):
        try:
            # in one go, since meshes are large
            numbers = list(map(int if kind is np.int64 else float, ",".join(texts).split(","))) if texts else []
            return np.array(numbers, dtype=kind).reshape(-1, width)
        except (ValueError, OverflowError):
            pass
    for element in elements:
        _check_row(element, width, kind)
    return np.empty((0, width), dtype=kind)


def _check_row(element: LinedElement, width: int, kind: type) -> None:
    """Refuse an element that does not list as many numbers as it should."""
    try:
        complete = np.array((element.text or "").split(",")).astype(kind).shape == (width,)
    except (ValueError, OverflowError):
        complete = False
    if not complete:
        what = "whole numbers" if kind is np.int64 else "numbers"
        raise ValueError(f"{element.place}: <{element.tag}> must have {width} {what}, found {_text(element)[:60]!r}")


def _whole(element: LinedElement, text: str | None) -> int:
    """A whole number of an element."""
    try:
        value = int(text or "")
    except ValueError:
        value = _LARGEST
    if abs(value) >= _LARGEST:
        raise ValueError(f"{element.place}: <{element.tag}>: {text!r} is no whole number that can be used")
    return value


def _identifiers(elements: Sequence[LinedElement]) -> Indices:
    try:
        return np.array([int(element.attrib["id"]) for element in elements], dtype=np.int64)
    except (KeyError, ValueError, OverflowError):
        return np.array([_whole(element, element.get("id")) for element in elements], dtype=np.int64)


def _listed(element: LinedElement, numbering: Numbering) -> Indices:
    """Rows of what an element lists: numbers, ranges ``first:last`` or ``first:last:step``, or children with an id."""
    children = [child for child in _lined(element) if child.get("id") is not None]
    found = [_rows(numbering, children, _identifiers(children))]
    for text in [element.text, *(child.text for child in element if child.tag == "node_list")]:
        for entry in (text or "").replace(",", " ").split():
            ends = [_whole(element, part) for part in entry.split(":")]
            if len(ends) > 3 or ends[2:] == [0]:
                raise ValueError(f"{element.place}: <{element.tag}>: {entry!r} is no range first:last:step")
            span = range(ends[0], ends[-1 if len(ends) == 1 else 1] + 1, *ends[2:])
            # more numbers than there are include one that is not there
            found.append(_rows(numbering, [element], np.array(span[: len(numbering) + 1], dtype=np.int64)[None])[0])
    return np.concatenate(found)


def _rows(numbering: Numbering, elements: Sequence[LinedElement], wanted: Indices) -> Indices:
    """Rows of nodes or elements that some XML elements name, each in a row of numbers."""
    try:
        return numbering.rows(wanted)
    except ValueError as error:
        for element, some in zip(elements, wanted, strict=True):
            if not numbering.has(some).all():
                raise ValueError(f"{element.place}: <{element.tag}>: {error}") from None
        raise


class _Reader:
    """What is known of a mesh so far; nodes and elements come before the sets that refer to them."""

    def __init__(self) -> None:
        self._numbers: list[Indices] = []
        self._points: list[Floats] = []
        self._blocks: list[Block] = []
        self._nodes = self._elements = Numbering(np.empty(0, np.int64), "node")
        self._node_sets: dict[str, Indices] = {}
        self._cell_sets: dict[str, Indices] = {}
        self._facet_sets: dict[str, tuple[Indices, ...]] = {}
        self._pairs: dict[str, tuple[str, str]] = {}

    def data(self) -> MeshData:
        """The mesh."""
        if not self._points or not self._blocks:
            raise ValueError(f"the mesh has no <{'Elements' if self._points else 'Nodes'}>")
        return MeshData(
            np.concatenate(self._points), np.concatenate(self._numbers), tuple(self._blocks),
            self._node_sets, self._cell_sets, self._facet_sets, self._pairs,
        )  # fmt: skip

    def read(self, sections: Sequence[LinedElement]) -> None:
        """Read all <Mesh> or <Geometry> of a file."""
        children = [child for section in sections for child in _lined(section)]
        self._each(children, Nodes=self._read_nodes)
        self._nodes = Numbering(np.concatenate(self._numbers), "node") if self._numbers else self._nodes
        for child in children:
            if child.tag in ("Part", "Instance"):
                raise ValueError(
                    f"{child.place}: <{child.tag}>: a geometry of parts and instances is not read; FEBio Studio writes "
                    "one without them when it opens and saves the file"
                )
        self._each(children, Elements=self._read_elements)
        if self._blocks:
            self._elements = Numbering(np.concatenate([block.numbers for block in self._blocks]), "element")
        self._cell_sets |= block_sets(self._blocks)
        lines = dict.fromkeys(("Edge", "DiscreteSet"), self._read_lines)
        self._each(children, NodeSet=self._read_node_set, ElementSet=self._read_cell_set, **lines)
        self._each(children, PartList=self._read_parts, Surface=self._read_surface)
        self._each(children, SurfacePair=self._read_pair)

    @staticmethod
    def _each(children: Sequence[LinedElement], **readers: Callable[[LinedElement], None]) -> None:
        for child in children:
            if child.tag in readers:
                readers[child.tag](child)

    def _read_nodes(self, element: LinedElement) -> None:
        nodes = list(_lined(element))
        self._numbers.append(_identifiers(nodes))
        self._points.append(_numbers(nodes, 3, np.float64))
        if name := element.get("name", element.get("set", "")).strip():
            start = sum(map(len, self._numbers)) - len(nodes)
            add_set(self._node_sets, name, np.arange(start, start + len(nodes)))

    def _read_elements(self, element: LinedElement) -> None:
        cells, kind = list(_lined(element)), element.get("type", "").strip()
        name = element.get("name", element.get("elset", "")).strip() or f"part{len(self._blocks) + 1}"
        # types such as HEX20G8 name the quadrature too
        plain = re.sub(r"(?<=\d)G\w*$", "", kind).lower()
        width = int(match[1]) if (match := re.search(r"(\d+)$", plain)) else 0
        if not cells or not width:
            raise ValueError(
                f"{element.place}: <Elements> has no elements"
                if width
                else f"{element.place}: <Elements>: {kind!r} is no type of elements"
            )
        nodes = _rows(self._nodes, cells, _numbers(cells, width, np.int64))
        if plain == "hex27":
            nodes = nodes[:, _FACES_OF_VTK]
        shape = _SHAPES.get(plain, plain)
        self._blocks.append(Block(name, kind, shape, _identifiers(cells), nodes, element.line))

    def _read_node_set(self, element: LinedElement) -> None:
        found = [_listed(element, self._nodes)]
        for child in _lined(element):
            if child.tag == "NodeSet":
                other = child.get("node_set", child.get("set", "")).strip()
                if other not in self._node_sets:
                    raise ValueError(f"{child.place}: there is no <NodeSet> called {other!r} before")
                found.append(self._node_sets[other])
        add_set(self._node_sets, _name(element), np.concatenate(found))

    def _read_cell_set(self, element: LinedElement) -> None:
        add_set(self._cell_sets, _name(element), _listed(element, self._elements))

    def _read_parts(self, element: LinedElement) -> None:
        parts = [name.strip() for name in _text(element).split(",")]
        for part in parts:
            if part not in self._cell_sets:
                raise ValueError(f"{element.place}: <PartList>: there is no part called {part!r}")
        add_set(self._cell_sets, _name(element), np.concatenate([self._cell_sets[part] for part in parts]))

    def _read_lines(self, element: LinedElement) -> None:
        lines = [child for child in _lined(element) if child.tag in _LINES]
        rows = [_rows(self._nodes, [line], _numbers([line], _LINES[line.tag], np.int64)).ravel() for line in lines]
        add_set(self._node_sets, _name(element), np.concatenate([np.empty(0, np.int64), *rows]))

    def _read_surface(self, element: LinedElement) -> None:
        kinds: dict[str, list[LinedElement]] = {}
        for facet in _lined(element):
            kinds.setdefault(facet.tag, []).append(facet)
        found: dict[int, list[Indices]] = {}
        for kind, facets in kinds.items():
            match = re.fullmatch(r"(tri|quad)(\d+)", kind)
            if not match:
                raise ValueError(f"{facets[0].place}: <{kind}> is no facet of a <Surface>")
            rows = _rows(self._nodes, facets, _numbers(facets, int(match[2]), np.int64))
            found.setdefault(_CORNERS[match[1]], []).append(rows[:, : _CORNERS[match[1]]])
        name = free_name(self._facet_sets, _name(element))
        self._facet_sets[name] = tuple(np.concatenate(rows) for rows in found.values())

    def _read_pair(self, element: LinedElement) -> None:
        sides = {SIDES.get(side.tag, side.tag): side.get("surface", _text(side)).strip() for side in _lined(element)}
        for side in ("primary", "secondary"):
            if sides.get(side) not in self._facet_sets:
                raise ValueError(f"{element.place}: <SurfacePair>: there is no <Surface> {sides.get(side)!r} ({side})")
        self._pairs[_name(element)] = sides["primary"], sides["secondary"]
