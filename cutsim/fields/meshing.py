"""Meshes with named regions, read from gmsh or tagged by markers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import basix.ufl
import gmsh
import numpy as np
from dolfinx.mesh import Mesh, MeshTags, entities_to_geometry, locate_entities, meshtags
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.base.assembly import box
from cutsim.base.checks import require
from cutsim.base.compat import create_mesh
from cutsim.base.signatures import checked
from cutsim.fields import gmsh_model
from cutsim.fields.cells import check_cells

# The geometries that come with cutsim: inside the installed package, beside it in a checkout.
_PACKAGE = Path(__file__).parents[1]
_GEOMETRIES = next((path for path in (_PACKAGE / "meshes", _PACKAGE.parent / "meshes") if path.is_dir()), _PACKAGE)

# the tag of an entity in no group; gmsh has none below one
_NONE = -1

Marker = Callable[[NDArray[np.float64]], NDArray[np.bool_]]
#: Dimension and tag of a group.
Group = tuple[int, int]


@checked
@dataclass(frozen=True)
class TaggedMesh:
    """Mesh with named groups of cells and facets.

    Attributes:
        mesh: The mesh; from the readers below always with shared-facet ghosts, without which a crack along
            the border of two ranks would not know both its sides.
        cell_tags: Tags of the cells. A cell in several groups has the tag of the last of them.
        facet_tags: Tags of the facets, exterior and interior, likewise.
        names: Name of each group -> (dimension, tag).
        groups: Local entities, ghosts included, of each group by (dimension, tag): all of them, also where groups
            overlap.
    """

    mesh: Mesh
    cell_tags: MeshTags
    facet_tags: MeshTags
    names: Mapping[str, Group]
    groups: Mapping[Group, NDArray[np.int32]]

    def cells(self, name: str) -> NDArray[np.int32]:
        """Local indices, ghosts included, of the cells of a group.

        Raises:
            ValueError: If no group of cells has this name.
        """
        return self._find(name, self.mesh.topology.dim)

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
        return self._find(name, self.mesh.topology.dim - 1)

    def with_group(self, name: str, dim: int, entities: NDArray[np.int32]) -> TaggedMesh:
        """This mesh with one more group, which its tags do not show.

        Args:
            name: Name of the group.
            dim: Dimension of its entities.
            entities: The local ones, ghosts included.

        Raises:
            ValueError: There is a group of this name.
        """
        require("name", name, name not in self.names, "other than that of a group")
        tag = 1 + max((tag for _, tag in self.names.values()), default=0)
        return replace(self, names={**self.names, name: (dim, tag)}, groups={**self.groups, (dim, tag): entities})

    def _find(self, name: str, dim: int) -> NDArray[np.int32]:
        known = [key for key, (d, _) in self.names.items() if d == dim]
        if name not in known:
            kind = "cells" if dim == self.mesh.topology.dim else "facets"
            raise ValueError(f"name = {name!r} is no group of {kind}; known: {', '.join(known) or 'none'}")
        return self.groups[self.names[name]]


@checked
def geometry(name: str) -> Path:
    """Find a parametrised gmsh geometry that comes with cutsim, for ``read_geo``.

    Args:
        name: Its name, such as ``"block"``; the file says at its head what is drawn and which parameters it has.

    Raises:
        ValueError: If there is none of this name.
    """
    known = geometries()
    if name not in known:
        raise ValueError(f"name = {name!r} is no geometry of cutsim; known: {', '.join(known) or 'none'}")
    return known[name]


def geometries() -> dict[str, Path]:
    """The parametrised gmsh geometries that come with cutsim, by name."""
    return {path.stem: path for path in sorted(_GEOMETRIES.glob("*.geo")) if path.stem != "common"}  # macros


@checked
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
        ValueError: On all ranks, if a parameter is unknown, gmsh fails, or the groups are refused as by `read_msh`.
    """
    return _read(path, comm, gdim, lambda: gmsh_model.generate(path, parameters or {}, gdim))


@checked
def read_msh(path: Path | str, comm: MPI.Comm, gdim: int = 3) -> TaggedMesh:
    """Read a mesh with groups: .msh of any version, .med, .unv or .cgns. Collective.

    Node numbers may have gaps, and groups may overlap. Of a flat mesh in the plane of x and z or of y and z these two
    are the coordinates.

    Args:
        path: The file; its physical groups name the cells and facets, cells in no group are left out.
        comm: Communicator over which the mesh is distributed.
        gdim: Dimension of the mesh and of its space, 2 or 3.

    Raises:
        ValueError: On all ranks, if gmsh cannot read the file, the cells are not of one type that can be used, are
            folded or have no volume, a flat mesh is not in a plane of two axes, or facets of a group are none of the
            mesh.
    """
    return _read(path, comm, gdim, lambda: gmsh_model.open_mesh(path))


@checked
def tag_mesh(mesh: Mesh, cells: Mapping[str, Marker], facets: Mapping[str, Marker]) -> TaggedMesh:
    """Name regions of an existing mesh. Collective.

    Args:
        mesh: The mesh.
        cells: Name -> marker of points, from coordinates (3, n) to n booleans; a cell belongs to the group
            when all its vertices do. Groups may overlap.
        facets: The same for facets, exterior or interior.

    Raises:
        ValueError: On all ranks, if a group is empty, a name is used twice, or cells are folded or have no volume.
    """
    check_cells(mesh)
    tdim = mesh.topology.dim
    names: dict[str, Group] = {}
    groups: dict[Group, NDArray[np.int32]] = {}
    for dim, markers in ((tdim, cells), (tdim - 1, facets)):
        if twice := names.keys() & markers.keys():
            raise ValueError(f"names of cells and facets must differ, both have {sorted(twice)}")
        mesh.topology.create_entities(dim)
        mesh.topology.create_connectivity(dim, tdim)
        for tag, (name, marker) in enumerate(markers.items(), start=1):
            names[name] = dim, tag
            groups[dim, tag] = locate_entities(mesh, dim, marker)
            if mesh.comm.allreduce(len(groups[dim, tag])) == 0:
                raise ValueError(f"the marker of {name!r} finds no entity of dimension {dim}, at least one is needed")
    return _tagged(mesh, names, groups)


def _tagged(mesh: Mesh, names: Mapping[str, Group], groups: Mapping[Group, NDArray[np.int32]]) -> TaggedMesh:
    """A mesh with groups, and tags made of them."""
    tags = []
    for dim in (mesh.topology.dim, mesh.topology.dim - 1):
        index_map = mesh.topology.index_map(dim)
        values = np.full(index_map.size_local + index_map.num_ghosts, _NONE, dtype=np.int32)
        for (of, tag), entities in groups.items():
            if of == dim:
                values[entities] = tag
        tagged = np.flatnonzero(values != _NONE).astype(np.int32)
        tags.append(meshtags(mesh, dim, tagged, values[tagged]))
    return TaggedMesh(mesh, tags[0], tags[1], names, groups)


def _read(path: Path | str, comm: MPI.Comm, gdim: int, load: Callable[[], None]) -> TaggedMesh:
    """Load a gmsh model on rank 0 and distribute it."""
    require("gdim", gdim, gdim in (2, 3), "2 or 3")
    if comm.bcast(gmsh.isInitialized()):
        raise ValueError(f"path = {path}: a gmsh session is already open, end it by gmsh.finalize() first")
    model, problem = None, None
    if comm.rank == 0:
        try:
            with gmsh_model.session():
                load()
                model = gmsh_model.extract(gdim)
        except Exception as error:  # gmsh raises nothing narrower
            problem = str(error) or type(error).__name__
    problem = comm.bcast(problem)
    try:
        if problem is not None:
            raise ValueError(problem)
        return _distributed(model, comm)
    except ValueError as error:
        raise ValueError(f"path = {path}: {error}") from None


def _distributed(model: gmsh_model.Model | None, comm: MPI.Comm) -> TaggedMesh:
    """The mesh that rank 0 has, and its groups, on all ranks."""
    shape = None if model is None else (model.cell, model.degree, model.points.shape[1], model.cells.shape[1])
    cell, degree, gdim, nodes = comm.bcast(shape)
    names, groups = comm.bcast(None if model is None else (model.names, model.groups))
    element = basix.ufl.element("Lagrange", cell, degree, basix.LagrangeVariant.equispaced, shape=(gdim,))
    cells = np.empty((0, nodes), dtype=np.int64) if model is None else model.cells
    mesh = create_mesh(comm, cells, np.empty((0, gdim)) if model is None else model.points, element)
    check_cells(mesh)
    tdim, original = mesh.topology.dim, mesh.topology.original_cell_index
    mesh.topology.create_entities(tdim - 1)
    local = {
        (dim, tag): np.flatnonzero(np.isin(original, rows)).astype(np.int32) if dim == tdim else _facets(mesh, rows)
        for (dim, tag), rows in groups.items()
    }
    return _tagged(mesh, names, local)


def _facets(mesh: Mesh, corners: NDArray[np.int64]) -> NDArray[np.int32]:
    """Local facets with these corners, given in the numbers of the nodes as they were read."""
    tdim = mesh.topology.dim
    mesh.topology.create_connectivity(tdim - 1, tdim)
    index_map = mesh.topology.index_map(tdim - 1)
    facets = np.arange(index_map.size_local + index_map.num_ghosts, dtype=np.int32)
    if not len(facets):  # entities_to_geometry of dolfinx 0.9 divides by their number
        return facets
    # of curved facets the corners come before the other nodes
    nodes = entities_to_geometry(mesh, tdim - 1, facets)[:, : corners.shape[1]]
    here = mesh.geometry.input_global_indices[nodes]
    # rows are compared where all corners are among those wanted: few
    near = np.isin(here, corners).all(axis=1)
    return facets[near][gmsh_model.rows_in(np.sort(here[near], axis=1), np.sort(corners, axis=1))]
