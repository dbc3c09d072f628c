"""Meshes with named regions, read from gmsh or tagged by markers, and the element sizes the numerics need."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path

import gmsh
import numpy as np
from dolfinx.mesh import (
    Mesh,
    MeshTags,
    entities_to_geometry,
    locate_entities,
    meshtags,
)
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.base.assembly import box
from cutsim.base.compat import model_to_mesh

logger = logging.getLogger(__name__)

# The geometries that come with cutsim: inside the installed package, beside it in a checkout.
_PACKAGE = Path(__file__).parents[1]
_GEOMETRIES = next((path for path in (_PACKAGE / "meshes", _PACKAGE.parent / "meshes") if path.is_dir()), _PACKAGE)

Marker = Callable[[NDArray[np.float64]], NDArray[np.bool_]]


@dataclass(frozen=True)
class TaggedMesh:
    """A mesh and the names of its regions.

    Attributes:
        mesh: The mesh; from the readers below always with shared-facet ghosts, without which a crack along
            the border of two ranks would not know both its sides.
        cell_tags: Tags of the cells.
        facet_tags: Tags of the facets, exterior and interior.
        names: Name of each group -> (dimension, tag).
    """

    mesh: Mesh
    cell_tags: MeshTags
    facet_tags: MeshTags
    names: Mapping[str, tuple[int, int]]

    def cells(self, name: str) -> NDArray[np.int32]:
        """Local indices, ghosts included, of the cells of a group.

        Raises:
            ValueError: If no group of cells has this name.
        """
        return self._find(name, self.cell_tags)

    def extent(self, name: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lowest and highest corner of the box around a group of facets [length]. Collective."""
        facets, nodes = self.facets(name), np.empty(0, dtype=np.int32)
        if len(facets):  # entities_to_geometry of dolfinx 0.9 divides by their number
            nodes = entities_to_geometry(self.mesh, self.mesh.topology.dim - 1, facets).ravel()
        return box(self.mesh.comm, self.mesh.geometry.x[nodes])

    def facets(self, name: str) -> NDArray[np.int32]:
        """Local indices, ghosts included, of the facets of a group.

        Raises:
            ValueError: If no group of facets has this name.
        """
        return self._find(name, self.facet_tags)

    def _find(self, name: str, tags: MeshTags) -> NDArray[np.int32]:
        known = {key: tag for key, (dim, tag) in self.names.items() if dim == tags.dim}
        if name not in known:
            kind = "cells" if tags.dim == self.mesh.topology.dim else "facets"
            raise ValueError(f"name = {name!r} is no group of {kind}; known: {', '.join(known) or 'none'}")
        return tags.find(known[name])


def geometry(name: str) -> Path:
    """Find a parametrised gmsh geometry that comes with cutsim, for ``read_geo``.

    Args:
        name: Its name, such as ``"block"``; the file says at its head what is drawn and which parameters it has.

    Raises:
        ValueError: If there is none of this name.
    """
    known = {path.stem: path for path in sorted(_GEOMETRIES.glob("*.geo")) if path.stem != "common"}  # macros
    if name not in known:
        raise ValueError(f"name = {name!r} is no geometry of cutsim; known: {', '.join(known) or 'none'}")
    return known[name]


def read_geo(
    path: Path | str, comm: MPI.Comm, parameters: Mapping[str, float] | None = None, gdim: int = 3
) -> TaggedMesh:
    """Mesh a parametrised gmsh geometry. Collective.

    Args:
        path: The .geo file; its physical groups name the cells and facets, cells in no group are left out.
        comm: Communicator over which the mesh is distributed; gmsh runs on its rank 0.
        parameters: New values of parameters that the file declares as ``DefineConstant[x = {1, Name "x"}]``.
        gdim: Dimension of the mesh and of its space, 2 or 3.

    Raises:
        ValueError: On all ranks, if a parameter is unknown, gmsh fails, or the groups make no mesh of one
            cell type.
    """
    return _read(path, comm, gdim, lambda: _generate(path, parameters or {}, gdim))


def read_msh(path: Path | str, comm: MPI.Comm, gdim: int = 3) -> TaggedMesh:
    """Read a mesh that gmsh can open (.msh of any version, .med, .inp, …). Collective.

    Args:
        path: The file; its physical groups name the cells and facets, cells in no group are left out.
        comm: Communicator over which the mesh is distributed.
        gdim: Dimension of the mesh and of its space, 2 or 3.

    Raises:
        ValueError: On all ranks, if gmsh cannot read the file or the groups make no mesh of one cell type.
    """
    return _read(path, comm, gdim, lambda: _open(path))


def tag_mesh(mesh: Mesh, cells: Mapping[str, Marker], facets: Mapping[str, Marker]) -> TaggedMesh:
    """Name regions of an existing mesh. Collective.

    Args:
        mesh: The mesh.
        cells: Name -> marker of points, from coordinates (3, n) to n booleans; a cell belongs to the group
            when all its vertices do.
        facets: The same for facets, exterior or interior.

    Raises:
        ValueError: On all ranks, if a group is empty, two groups overlap or a name is used twice.
    """
    tdim = mesh.topology.dim
    names: dict[str, tuple[int, int]] = {}
    tags = []
    for dim, markers in ((tdim, cells), (tdim - 1, facets)):
        tags.append(_tag(mesh, dim, markers))
        if twice := names.keys() & markers.keys():
            raise ValueError(f"names of cells and facets must differ, both have {sorted(twice)}")
        names |= {name: (dim, tag) for tag, name in enumerate(markers, start=1)}
    return TaggedMesh(mesh, tags[0], tags[1], names)


def _tag(mesh: Mesh, dim: int, markers: Mapping[str, Marker]) -> MeshTags:
    """Tags 1, 2, … for the entities found by the markers, in their order."""
    mesh.topology.create_entities(dim)
    mesh.topology.create_connectivity(dim, mesh.topology.dim)
    index_map = mesh.topology.index_map(dim)
    values = np.zeros(index_map.size_local + index_map.num_ghosts, np.int32)
    for tag, (name, marker) in enumerate(markers.items(), start=1):
        entities = locate_entities(mesh, dim, marker)
        if mesh.comm.allreduce(len(entities)) == 0:
            raise ValueError(f"the marker of {name!r} finds no entity of dimension {dim}, at least one is needed")
        if mesh.comm.allreduce(int(values[entities].any())):
            raise ValueError(f"the marker of {name!r} finds entities of another group, which must not overlap")
        values[entities] = tag
    tagged = np.flatnonzero(values).astype(np.int32)
    return meshtags(mesh, dim, tagged, values[tagged])


@contextmanager
def _gmsh_session() -> Iterator[None]:
    """A quiet gmsh that reads no user configuration and leaves Ctrl-C alone; its warnings go to the log."""
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


def _read(path: Path | str, comm: MPI.Comm, gdim: int, load: Callable[[], None]) -> TaggedMesh:
    """Load a gmsh model on rank 0 and distribute it."""
    if comm.bcast(gmsh.isInitialized()):
        raise ValueError(f"path = {path}: a gmsh session is already open, end it by gmsh.finalize() first")
    names, problem = None, None
    with _gmsh_session() if comm.rank == 0 else nullcontext():
        if comm.rank == 0:
            try:
                load()
                names = _group_names(gdim)
            except Exception as error:  # gmsh raises nothing narrower
                problem = str(error)
        names, problem = comm.bcast((names, problem))
        if problem is not None:
            raise ValueError(f"path = {path}: {problem}")
        mesh, cell_tags, facet_tags = model_to_mesh(gmsh.model, comm, gdim)
    return TaggedMesh(mesh, cell_tags, facet_tags, names)


def _open(path: Path | str) -> None:
    if not Path(path).is_file():
        raise ValueError("no such file")
    gmsh.open(str(path))


def _generate(path: Path | str, parameters: Mapping[str, float], gdim: int) -> None:
    """Open a geometry, first as it is to learn what it declares, then with the parameters, and mesh it."""
    _open(path)
    if parameters:
        known = {name for name in gmsh.onelab.getNames() if not name.startswith(("Gmsh/", "ONELAB/"))}
        for name, value in parameters.items():
            if name not in known:
                raise ValueError(f"unknown parameter {name!r} (= {value}); known: {', '.join(sorted(known))}")
            if not math.isfinite(value):
                raise ValueError(f"parameter {name!r} = {value} must be finite")
            gmsh.onelab.setNumber(name, [float(value)])
        gmsh.parser.clear()
        _open(path)
    gmsh.model.mesh.generate(gdim)


def _group_names(gdim: int) -> dict[str, tuple[int, int]]:
    """Names of the groups of cells and facets, after a check that they make one mesh with unique tags."""
    groups = gmsh.model.getPhysicalGroups()
    top = max((dim for dim, _ in groups), default=None)
    if top != gdim:
        raise ValueError(f"gdim = {gdim}, but the highest dimension of a physical group is {top}")
    names: dict[str, tuple[int, int]] = {}
    tagged: set[tuple[int, int]] = set()
    cell_types: set[int] = set()
    for dim, tag in groups:
        if dim < gdim - 1:
            continue
        name = gmsh.model.getPhysicalName(dim, tag)
        if name in names:
            raise ValueError(f"two physical groups are called {name!r}")
        if name:
            names[name] = (dim, tag)
        for entity in gmsh.model.getEntitiesForPhysicalGroup(dim, tag):
            if (dim, entity) in tagged:
                raise ValueError(f"{name!r} (dimension {dim}, tag {tag}) overlaps another physical group")
            tagged.add((dim, entity))
            if dim == gdim:
                cell_types.update(gmsh.model.mesh.getElementTypes(dim, entity))
    if len(cell_types) != 1:
        kinds = [gmsh.model.mesh.getElementProperties(kind)[0] for kind in sorted(cell_types)]
        raise ValueError(f"the cells must be of one type, found {kinds or 'none'}")
    return names
