"""Meshes of gmsh: files that it reads, and geometries that it meshes. Runs on one rank."""

import logging
import math
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import gmsh
import numpy as np

from cutsim.readers.mesh_data import Block, Indices, MeshData, Numbering, add_set, free_name
from cutsim.readers.shapes import corners, from_gmsh

logger = logging.getLogger(__name__)

#: Endings of the formats in which gmsh reads the names of groups; of others it reads none, or nothing at all.
FORMATS = (".msh", ".med", ".unv", ".cgns")

# elements as gmsh and as meshio calls them, the linear ones without their number of nodes
_WORDS = {
    "Point": "vertex", "Line": "line", "Triangle": "triangle", "Quadrilateral": "quad", "Tetrahedron": "tetra",
    "Hexahedron": "hexahedron", "Prism": "wedge", "Pyramid": "pyramid",
}  # fmt: skip
_LINEAR = ("line2", "triangle3", "quad4", "tetra4", "hexahedron8", "wedge6", "pyramid5")
_ADVICE = (
    ". A curve or surface that is drawn in a body has to be part of it: embed it (Curve{…} In Surface{…};, "
    "Surface{…} In Volume{…};) or cut the body with it (BooleanFragments, occ.fragment) before meshing"
)


@contextmanager
def session() -> Iterator[None]:
    """A quiet gmsh that reads no user configuration and leaves Ctrl-C alone; its warnings go to the log.

    Raises:
        ValueError: There is an open session, which this would end.
    """
    if gmsh.isInitialized():
        raise ValueError("a gmsh session is already open, end it by gmsh.finalize() first")
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.logger.start()
    try:
        yield
        for message in gmsh.logger.get():
            if message.startswith("Warning"):
                logger.warning("gmsh: %s", message)
    finally:
        gmsh.logger.stop()
        gmsh.finalize()


def open_mesh(path: Path | str) -> None:
    """Open a file with a mesh."""
    gmsh.open(str(path))


def generate(path: Path | str, parameters: Mapping[str, float], gdim: int) -> None:
    """Open a geometry, first as it is to learn what it declares, then with the parameters, and mesh it.

    Raises:
        ValueError: A parameter is unknown or not finite.
    """
    gmsh.open(str(path))
    if parameters:
        known = {name for name in gmsh.onelab.getNames() if not name.startswith(("Gmsh/", "ONELAB/"))}
        for name, value in parameters.items():
            if name not in known:
                raise ValueError(f"unknown parameter {name!r} (= {value}); known: {', '.join(sorted(known))}")
            if not math.isfinite(value):
                raise ValueError(f"parameter {name!r} = {value} must be finite")
            gmsh.onelab.setNumber(name, [float(value)])
        gmsh.parser.clear()
        gmsh.open(str(path))
    gmsh.model.mesh.generate(gdim)


def extract(gdim: int) -> MeshData:
    """The mesh of the open model: elements and facets in physical groups, which have their number if they have no name.

    Args:
        gdim: Dimension of the mesh.

    Raises:
        ValueError: There is no physical group, or the highest dimension of one is another.
    """
    top = max((dim for dim, _ in gmsh.model.getPhysicalGroups()), default=None)
    if top is None:
        raise ValueError(
            "there is no physical group: name the bodies, and the facets that are to be found again, such as "
            'Physical Surface("body") = {1}; and end the last line of the file'
        )
    if top != gdim:
        raise ValueError(
            f"gdim = {gdim}, but the highest dimension of a physical group is {top}; in a case file gdim is dim"
        )
    tags, x, _ = gmsh.model.mesh.getNodes()
    numbers, first = np.unique(tags.astype(np.int64), return_index=True)
    nodes = Numbering(numbers, "node")
    members = {name: _elements(gdim, tag) for name, tag in _groups(gdim)}
    blocks = _blocks(members.values(), nodes)
    elements = Numbering(np.concatenate([block.numbers for block in blocks] or [numbers[:0]]), "element")
    cell_sets = {
        name: np.concatenate([elements.rows(own) for _, own, _ in found] or [numbers[:0]])
        for name, found in members.items()
    }
    facet_sets = {
        name: tuple(corners(_shape(kind), nodes.rows(own)) for kind, _, own in _elements(gdim - 1, tag))
        for name, tag in _groups(gdim - 1)
    }
    node_sets: dict[str, Indices] = {}
    for dim in range(gdim - 1):
        for name, tag in _groups(dim):
            own = gmsh.model.mesh.getNodesForPhysicalGroup(dim, tag)[0]
            add_set(node_sets, name, nodes.rows(own.astype(np.int64)))
    points = x.reshape(-1, 3)[first]
    return MeshData(points, numbers, blocks, node_sets, cell_sets, facet_sets, advice=_ADVICE)


def _groups(dim: int) -> list[tuple[str, int]]:
    """Names and tags of the physical groups of a dimension."""
    named: dict[str, int] = {}
    for _, tag in gmsh.model.getPhysicalGroups(dim):
        # some formats fill names up with blanks
        name = gmsh.model.getPhysicalName(dim, tag).strip() or str(tag)
        named[free_name(named, name)] = tag
    return list(named.items())


def _elements(dim: int, tag: int) -> list[tuple[int, Indices, Indices]]:
    """Types, tags and nodes of the elements of a group."""
    return [
        (kind, own.astype(np.int64), nodes.astype(np.int64).reshape(len(own), -1))
        for entity in gmsh.model.getEntitiesForPhysicalGroup(dim, tag)
        for kind, own, nodes in zip(*gmsh.model.mesh.getElements(dim, entity), strict=True)
    ]


def _blocks(members: Iterable[list[tuple[int, Indices, Indices]]], nodes: Numbering) -> tuple[Block, ...]:
    """The elements of groups, each once, by their type."""
    kinds: dict[int, list[tuple[Indices, Indices]]] = {}
    for found in members:
        for kind, tags, own in found:
            kinds.setdefault(kind, []).append((tags, own))
    blocks = []
    for kind, parts in kinds.items():
        tags, first = np.unique(np.concatenate([tags for tags, _ in parts]), return_index=True)
        rows = nodes.rows(np.concatenate([own for _, own in parts])[first])
        name = gmsh.model.mesh.getElementProperties(kind)[0]
        blocks.append(Block("", name, _shape(kind), tags, from_gmsh(_shape(kind), rows)))
    return tuple(blocks)


def _shape(kind: int) -> str:
    """Type of an element as meshio calls it."""
    word, _, count = gmsh.model.mesh.getElementProperties(kind)[0].partition(" ")
    plain = _WORDS.get(word, word.lower())
    return plain if plain + count in _LINEAR else plain + count
