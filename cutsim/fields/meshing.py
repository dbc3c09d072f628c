"""Meshes with named regions, read from files or tagged by markers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import basix
import basix.ufl
import numpy as np
from dolfinx.mesh import Mesh, MeshTags, entities_to_geometry, locate_entities, meshtags
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.base.assembly import box
from cutsim.base.checks import positive, require, require_number
from cutsim.base.compat import create_mesh
from cutsim.base.signatures import checked
from cutsim.fields.areas import area
from cutsim.fields.cells import check_cells
from cutsim.fields.refinement import Refinement, refined
from cutsim.readers import formats, gmsh_model
from cutsim.readers.facets import rows_in
from cutsim.readers.mesh_data import MeshData
from cutsim.readers.model import Choice, Model, make_model
from cutsim.readers.twins import Merge

# The geometries that come with cutsim: inside the installed package, beside it in a checkout.
_PACKAGE = Path(__file__).parents[1]
_GEOMETRIES = next((path for path in (_PACKAGE / "meshes", _PACKAGE.parent / "meshes") if path.is_dir()), _PACKAGE)

# the tag of an entity in no group
_NONE = -1

Marker = Callable[[NDArray[np.float64]], NDArray[np.bool_]]
#: Dimension and name of a group.
Group = tuple[int, str]


@checked
@dataclass(frozen=True)
class TaggedMesh:
    """Mesh with named groups of cells and facets.

    Attributes:
        mesh: The mesh; from the readers below always with shared-facet ghosts, without which a crack along
            the border of two ranks would not know both its sides.
        cell_tags: Tags of the cells. A cell in several groups has the tag of the first of them.
        facet_tags: Tags of the facets, exterior and interior, likewise.
        tags: (dimension, name) of each group of cells or facets -> its tag.
        groups: Local entities, ghosts included, of each group by (dimension, name): all of them, also where groups
            overlap.
    """

    mesh: Mesh
    cell_tags: MeshTags
    facet_tags: MeshTags
    tags: Mapping[Group, int]
    groups: Mapping[Group, NDArray[np.int32]]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all groups; groups of cells, facets and vertices may have the same name."""
        return tuple(dict.fromkeys(name for _, name in self.groups))

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

    def area(self, name: str, *, axisymmetric: bool = False) -> float:
        """Length in the plane, or area in space, of a group of facets [length or area]. Collective.

        Args:
            name: The group; its facets may be outer or inner ones.
            axisymmetric: Whether the mesh is a meridian plane: the area is then that of the surface of revolution.

        Raises:
            ValueError: If no group of facets has this name.
        """
        return area(self.mesh, self.facets(name), axisymmetric=axisymmetric)

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
        return replace(self, groups={**self.groups, (dim, name): entities})

    def vertices(self, name: str) -> NDArray[np.int32]:
        """Local indices, ghosts included, of the vertices of a set of nodes, such as a single point.

        Raises:
            ValueError: If no group of vertices has this name.
        """
        return self._find(name, 0)

    def _find(self, name: str, dim: int) -> NDArray[np.int32]:
        if (dim, name) not in self.groups:
            kind = {0: "vertices", self.mesh.topology.dim: "cells"}.get(dim, "facets")
            known = ", ".join(known for of, known in self.groups if of == dim)
            raise ValueError(f"name = {name!r} is no group of {kind}; known: {known or 'none'}")
        return self.groups[dim, name]


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
        ValueError: On all ranks, if a parameter is unknown, gmsh fails, or the groups are refused as by `read_mesh`.
    """

    def load() -> MeshData:
        with gmsh_model.session():
            gmsh_model.generate(path, parameters or {}, gdim)
            return gmsh_model.extract(gdim)

    return _read(path, comm, Choice(gdim), load)


@checked
def read_mesh(
    path: Path | str,
    comm: MPI.Comm,
    gdim: int = 3,
    *,
    scale: float = 1.0,
    only: Sequence[str] | None = None,
    merge: Merge = False,
    tolerance: float | None = None,
    refine: Refinement | None = None,
) -> TaggedMesh:
    """Read a mesh with groups from a file of gmsh, Abaqus, FEBio, VTK or of another format by its ending. Collective.

    - *gmsh* (.msh of any version, .med, .unv, .cgns): physical groups; cells in none are left out.
    - *Abaqus* and CalculiX (.inp): sets of elements are groups of cells, surfaces are groups of facets. Those of a part
      instance are called ``Instance.Set``, all its elements ``Instance``.
    - *FEBio* (.feb, versions 2.0 to 4.0): parts, lists of parts and sets of elements; surfaces.
    - Whatever else meshio reads (.vtu, .vtk, .xdmf, .med, .exo, .bdf …): sets of cells and points, and integers on
      cells, each value a group.

    A set of nodes is a group of vertices and, unless a set of facets is called so, of the facets that have all their
    corners in it, inner ones too: the nodes of a surface in a body give the facets of a crack. Facets between two parts
    A and B of a mesh are a group ``A|B``; a cell belongs to the part of the first of its groups. Cells with nodes on
    their edges only (Abaqus C3D20, FEBio hex20) become those of 27 or 9 nodes that have exactly their shape. Of a flat
    mesh in the plane of x and z or of y and z these two are the coordinates.

    Args:
        path: The file.
        comm: Communicator over which the mesh is distributed.
        gdim: Dimension of the mesh and of its space, 2 or 3.
        scale: Factor of all coordinates, such as 1000 for a file in metres and a run in millimetres.
        only: Names of the groups of cells that make the mesh; all if None. What only other elements have is left out.
        merge: Which nodes that lie on each other become one: all (True), none (False), or those between pairs of groups
            of cells. ``A|B`` are the facets where they were merged. Where they are not, ``A|B`` are those of A that
            lie on B, and ``B|A`` those of B, such as for a `SurfacePair`.
        tolerance: Distance below which nodes lie on each other [length]; a thousandth of the shortest edge if None.
        refine: Refinement of triangles or tetrahedra along some groups of facets; None for none.

    Raises:
        ValueError: On all ranks, with the line where the file has lines, if the file cannot be read, the cells are not
            of one type that can be used, are folded or have no volume, a flat mesh is not in a plane of two axes, there
            is no group of a name, or facets of a group are none of the mesh.
    """
    require_number("scale", scale, positive)
    require_number("tolerance", tolerance, positive.or_none)
    require("only", only, only is None or (len(only) > 0 and not isinstance(only, str)), "names of groups, or None")
    pairs = isinstance(merge, bool) or all(len(pair) == 2 and not isinstance(pair, str) for pair in merge)
    require("merge", merge, pairs, "True, False, or pairs of names of groups")
    return _read(path, comm, Choice(gdim, scale, only, merge, tolerance), lambda: formats.load(path, gdim), refine)


@checked
def tag_mesh(mesh: Mesh, cells: Mapping[str, Marker], facets: Mapping[str, Marker]) -> TaggedMesh:
    """Name regions of an existing mesh. Collective.

    Args:
        mesh: The mesh.
        cells: Name -> marker of points, from coordinates (3, n) to n booleans; a cell belongs to the group
            when all its vertices do. Groups may overlap.
        facets: The same for facets, exterior or interior.

    Raises:
        ValueError: On all ranks, if a group is empty, or cells are folded or have no volume.
    """
    check_cells(mesh)
    tdim = mesh.topology.dim
    groups: dict[Group, NDArray[np.int32]] = {}
    for dim, markers in ((tdim, cells), (tdim - 1, facets)):
        mesh.topology.create_entities(dim)
        mesh.topology.create_connectivity(dim, tdim)
        for name, marker in markers.items():
            groups[dim, name] = locate_entities(mesh, dim, marker)
            if mesh.comm.allreduce(len(groups[dim, name])) == 0:
                raise ValueError(f"the marker of {name!r} finds no entity of dimension {dim}, at least one is needed")
    return _tagged(mesh, groups)


def _tagged(mesh: Mesh, groups: Mapping[Group, NDArray[np.int32]]) -> TaggedMesh:
    """A mesh with groups, and tags made of them."""
    found, numbers = [], dict[Group, int]()
    for dim in (mesh.topology.dim, mesh.topology.dim - 1):
        index_map = mesh.topology.index_map(dim)
        values = np.full(index_map.size_local + index_map.num_ghosts, _NONE, dtype=np.int32)
        own = [group for group in groups if group[0] == dim]
        numbers |= {group: tag for tag, group in enumerate(own, start=1)}
        for group in reversed(own):
            values[groups[group]] = numbers[group]
        tagged = np.flatnonzero(values != _NONE).astype(np.int32)
        found.append(meshtags(mesh, dim, tagged, values[tagged]))
    return TaggedMesh(mesh, found[0], found[1], numbers, groups)


def _read(
    path: Path | str,
    comm: MPI.Comm,
    choice: Choice,
    load: Callable[[], MeshData],
    refine: Refinement | None = None,
) -> TaggedMesh:
    """Load a file on rank 0, refine its mesh and distribute it."""
    require("gdim", choice.gdim, choice.gdim in (2, 3), "2 or 3")
    model, problem = None, None
    if comm.rank == 0:
        try:
            if not Path(path).is_file():
                raise ValueError("no such file")
            model = make_model(load(), choice)
            model = model if refine is None else refined(model, refine)
        except Exception as error:  # readers raise nothing narrower
            problem = str(error) or type(error).__name__
    problem = comm.bcast(problem)
    try:
        if problem is not None:
            raise ValueError(problem)
        return _distributed(model, comm)
    except ValueError as error:
        raise ValueError(f"path = {path}: {error}") from None


def _distributed(model: Model | None, comm: MPI.Comm) -> TaggedMesh:
    """The mesh that rank 0 has, and its groups, on all ranks."""
    shape = None if model is None else (model.cell, model.degree, model.points.shape[1], model.cells.shape[1])
    cell, degree, gdim, nodes = comm.bcast(shape)
    groups = comm.bcast(None if model is None else model.groups)
    element = basix.ufl.element("Lagrange", cell, degree, basix.LagrangeVariant.equispaced, shape=(gdim,))
    cells = np.empty((0, nodes), dtype=np.int64) if model is None else model.cells
    mesh = create_mesh(comm, cells, np.empty((0, gdim)) if model is None else model.points, element)
    check_cells(mesh)
    tdim = mesh.topology.dim
    numbers = {dim: _corners(mesh, dim) for dim in (0, tdim - 1)} | {tdim: mesh.topology.original_cell_index[:, None]}
    return _tagged(mesh, {(dim, name): _entities(numbers[dim], rows) for (dim, name), rows in groups.items()})


def _corners(mesh: Mesh, dim: int) -> NDArray[np.int64]:
    """Corners of all local vertices or facets, in the numbers of the nodes as they were read."""
    mesh.topology.create_entities(dim)
    mesh.topology.create_connectivity(dim, mesh.topology.dim)
    index_map = mesh.topology.index_map(dim)
    entities = np.arange(index_map.size_local + index_map.num_ghosts, dtype=np.int32)
    corners = len(basix.topology(mesh.basix_cell())[dim][0])
    if not len(entities):  # entities_to_geometry of dolfinx 0.9 divides by their number
        return np.empty((0, corners), dtype=np.int64)
    # of curved facets the corners come before the other nodes
    return mesh.geometry.input_global_indices[entities_to_geometry(mesh, dim, entities)[:, :corners]]


def _entities(here: NDArray[np.int64], wanted: NDArray[np.int64]) -> NDArray[np.int32]:
    """Which of the local entities, by their numbers or those of their corners, are wanted."""
    wanted = wanted.reshape(-1, here.shape[1])
    among = np.zeros(1 + max(here.max(initial=0), wanted.max(initial=0)), dtype=bool)
    among[wanted] = True
    near = np.flatnonzero(among[here].all(axis=1)).astype(np.int32)
    # rows are compared where all corners are among those wanted: few
    return near[rows_in(np.sort(here[near], axis=1), np.sort(wanted, axis=1))] if here.shape[1] > 1 else near
