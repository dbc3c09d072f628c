"""Mesh of a case, with the groups that the case names."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from dolfinx import fem
from dolfinx.mesh import compute_midpoints, locate_entities
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.base.assembly import box
from cutsim.cases.document import Document
from cutsim.cases.geometries import LAMINATE, outline
from cutsim.cases.keys import Keys, nearest
from cutsim.cases.refusals import refused, refusing
from cutsim.cases.schema import CaseTables
from cutsim.cases.schema_mesh import ALONG, RULE, SIZES, Selection
from cutsim.fields.laminate import laminate
from cutsim.fields.meshing import TaggedMesh, geometry, read_geo, read_mesh
from cutsim.fields.refinement import Refinement
from cutsim.fields.sizes import incidence
from cutsim.fields.space import cracked_space, marks
from cutsim.fields.state import State
from cutsim.studies.mesh_rule import MeshRule

Entities = NDArray[np.int32]
# what entities of a codimension are called
_KINDS = {0: "cells", 1: "facets"}
# parameters of `laminate` that are whole numbers
_COUNTS = ("least", "rows", "half")
# of coordinates, over the size of the mesh
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Domain:
    """Mesh of a case, and its entities by the names that the case gives them.

    Attributes:
        tables: The tables of the case.
        document: Their text.
        tagged: The mesh with its groups.
    """

    tables: CaseTables
    document: Document
    tagged: TaggedMesh

    @classmethod
    def of(cls, tables: CaseTables, document: Document, comm: MPI.Comm) -> "Domain":
        """Mesh a case. Collective.

        Raises:
            CaseError: On all ranks, if the file is no mesh or the geometry refuses a parameter.
        """
        with refusing(document, "mesh"):
            tagged = _meshed(tables, document, comm)
        for name, selection in tables.groups.items():
            tagged = cls(tables, document, tagged)._with(name, selection)
        return cls(tables, document, tagged)

    def cells(self, key: Keys, names: Sequence[str]) -> Entities:
        """Local cells, ghosts included, of some groups.

        Args:
            key: Key of the case that names them, for messages.
            names: The groups.

        Raises:
            CaseError: The mesh has no such group of cells.
        """
        return self._entities(key, names, self.tagged.mesh.topology.dim)

    def facets(self, key: Keys, names: Sequence[str]) -> Entities:
        """Local facets, ghosts included, of some groups; as `cells`."""
        return self._entities(key, names, self.tagged.mesh.topology.dim - 1)

    def _entities(self, key: Keys, names: Sequence[str], dim: int) -> Entities:
        known = [name for of, name in self.tagged.groups if of == dim]
        for name in names:
            if name not in known:
                kind = _KINDS.get(self.tagged.mesh.topology.dim - dim, "vertices")
                words = f"{name!r} is no group of {kind} of the mesh{nearest(name, known)}"
                raise refused(self.document, key, f"{words}; it has {', '.join(known) or 'none'}")
        parts = [self.tagged.groups[dim, name] for name in names]
        return np.unique(np.concatenate([np.empty(0, np.int32), *parts])).astype(np.int32)

    def _with(self, name: str, selection: Selection) -> TaggedMesh:
        """The mesh with one more group. Collective."""
        key, mesh = ("groups", name), self.tagged.mesh
        dim, entities = self._selected(key, selection)
        middles = compute_midpoints(mesh, dim, entities) if len(entities) else np.zeros((0, 3))
        low, high = box(mesh.comm, mesh.geometry.x)
        slack = _ROUNDING * float(np.max(high - low))
        for axis, span in enumerate((selection.x, selection.y, selection.z)):
            if span is not None:
                inside = (span[0] - slack <= middles[:, axis]) & (middles[:, axis] <= span[1] + slack)
                entities, middles = entities[inside], middles[inside]
        if not mesh.comm.allreduce(len(entities)):
            raise refused(self.document, key, "no facet, cell or vertex has its middle there")
        with refusing(self.document, "groups"):
            return self.tagged.with_group(name, dim, entities)

    def _selected(self, key: Keys, selection: Selection) -> tuple[int, Entities]:
        """Dimension and local entities among which a group is chosen by coordinates. Collective."""
        tdim = self.tagged.mesh.topology.dim
        if selection.points:
            return 0, self.nearest((*key, "points"), selection.points)
        if selection.vertices:
            return 0, self._vertices_of((*key, "vertices"), selection.vertices)
        if selection.facets:
            return tdim - 1, self.facets((*key, "facets"), selection.facets)
        return tdim, self.cells((*key, "cells"), selection.cells)

    def _vertices_of(self, key: Keys, names: Sequence[str]) -> Entities:
        """Local vertices of some groups, of vertices, facets or cells, whichever there is. Collective."""
        mesh, found = self.tagged.mesh, [np.empty(0, dtype=np.int32)]
        for name in names:
            dims = [dim for dim in range(mesh.topology.dim + 1) if (dim, name) in self.tagged.groups]
            if not dims:
                known = self.tagged.names
                raise refused(self.document, key, f"{name!r} is no group of the mesh{nearest(name, known)}")
            entities = self.tagged.groups[dims[0], name]
            found.append(incidence(mesh, dims[0], 0)[entities].ravel() if dims[0] else entities)
        # a rank may have a vertex, but none of the facets of a group that meet there
        marked = marks(mesh.comm, mesh.topology.index_map(0), np.concatenate(found), "vertices")
        return np.flatnonzero(marked).astype(np.int32)

    def vertices(self, key: Keys, names: Sequence[str]) -> Entities:
        """Local vertices, ghosts included, of some groups; as `cells`."""
        return self._entities(key, names, 0)

    def nearest(self, key: Keys, points: Sequence[Sequence[float]]) -> Entities:
        """Local vertices nearest to some points. Collective.

        Raises:
            CaseError: A point has not as many coordinates as the mesh, or lies farther from all vertices than they from
                each other.
        """
        found = [self._vertex((*key, i), point) for i, point in enumerate(points)]
        return np.unique(np.concatenate(found)).astype(np.int32)

    def _vertex(self, key: Keys, point: Sequence[float]) -> Entities:
        mesh = self.tagged.mesh
        gdim, comm = mesh.geometry.dim, mesh.comm
        if len(point) != gdim:
            raise refused(self.document, key, f"must have {gdim} coordinates, as the mesh has")
        place = np.pad(np.asarray(point, dtype=float), (0, 3 - gdim))
        away = np.linalg.norm(mesh.geometry.x - place, axis=1)
        nearest_here = (away.min(initial=np.inf), mesh.geometry.x[away.argmin()] if len(away) else place)
        distance, vertex = min(comm.allgather(nearest_here), key=lambda found: found[0])
        cells = np.arange(mesh.topology.index_map(mesh.topology.dim).size_local, dtype=np.int32)
        size = comm.allreduce(mesh.h(mesh.topology.dim, cells).max(initial=0.0), MPI.MAX)
        if distance > size:
            where = ", ".join(f"{x:g}" for x in vertex[:gdim])
            raise refused(self.document, key, f"no vertex of the mesh is near; the nearest is ({where})")
        return locate_entities(mesh, 0, lambda x: np.linalg.norm(x - vertex[:, None], axis=0) < 1e-9 * size)

    def state(self) -> State:
        """Displacement that may jump across cracks and what is open. Collective."""
        mesh, about = self.tagged.mesh, self.tables.mesh
        element = ("Lagrange", about.degree, (mesh.geometry.dim,))
        space = cracked_space(mesh, element, self.split) if self.split else fem.functionspace(mesh, element)
        with refusing(self.document, "mesh"):
            return State(space, axisymmetric=about.axisymmetric)

    @property
    def split(self) -> list[Entities]:
        """Facets across which displacement and temperature may jump."""
        tables = self.tables
        cracks = [(name, crack) for name, crack in tables.cracks.items() if crack.plus is not None]
        found = [self.facets(("cracks", name, "facets"), crack.facets) for name, crack in cracks]
        return found + ([self.facets(("mesh", "open"), tables.mesh.open)] if tables.mesh.open else [])


def _meshed(tables: CaseTables, document: Document, comm: MPI.Comm) -> TaggedMesh:
    mesh = tables.mesh
    given = _parameters(tables, document)
    if mesh.geometry == LAMINATE:
        sizes: dict[str, Any] = {name: int(size) if name in _COUNTS else size for name, size in given.items()}
        return laminate(comm, {layer.name: layer.thickness for layer in tables.layers}, **sizes)
    if mesh.dim is None:
        raise refused(document, ("mesh", "dim"), "missing, must be given: 2 or 3, the dimension of mesh and space")
    if mesh.file is not None:
        refine = _refinement(tables, document)
        only, merge = mesh.only or None, mesh.merge
        return read_mesh(mesh.file, comm, mesh.dim, scale=mesh.scale, only=only, merge=merge, refine=refine)
    assert mesh.geometry is not None
    own = {"dim": float(mesh.dim)} if "dim" in outline(mesh.geometry).parameters else {}
    return read_geo(geometry(mesh.geometry), comm, {**own, **given}, gdim=mesh.dim)


def _parameters(tables: CaseTables, document: Document) -> dict[str, float]:
    """Parameters of the geometry, with the sizes that follow from the rule."""
    mesh, insertion = tables.mesh, tables.insertion
    given: dict[str, float | str] = dict(mesh.set)
    if insertion is not None and mesh.geometry is not None:
        known = ("size",) if mesh.geometry == LAMINATE else outline(mesh.geometry).parameters
        by_rule = SIZES if insertion.notch == 0 else ALONG
        given = {**{name: RULE for name in by_rule if name in known}, **given}
    return {name: _by_rule(tables, document, ("mesh", "set", name), value) for name, value in given.items()}


def _refinement(tables: CaseTables, document: Document) -> Refinement | None:
    refine = tables.mesh.refine
    if refine is None:
        return None
    size = _by_rule(tables, document, ("mesh", "refine", "size"), refine.size)
    return Refinement(refine.groups, size, refine.growth)


def _by_rule(tables: CaseTables, document: Document, key: Keys, value: float | str) -> float:
    """A size, which may follow from the tools and the laws of the case."""
    if not isinstance(value, str):
        return value
    tools = [shape for tool in tables.tools.values() if (shape := getattr(tool, "made", None)) is not None]
    cut = [*(tables.law_of(crack) for crack in tables.cracks.values()), *map(tables.law_of, tables.layers)]
    laws = [law for law in (tables.law, *cut) if law is not None]
    if not tools or not laws:
        raise refused(document, key, f"must be a number: {RULE!r} needs a tool with a shape and a cohesive law")
    rule = MeshRule.of(tools, laws)
    return rule.size if key[-1] in ALONG else rule.mouth
