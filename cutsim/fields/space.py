"""Cracked function space: each side of a crack gets its own dofs, here and nowhere else.

A crack is a set of interior facets of a conforming mesh. It is opened in the function space, not in the mesh:
each dof on the crack is copied once for every part into which the crack divides the cells around it. So
``u('+') - u('-')`` is the jump on the crack, and the mesh, its tags and its output stay as they are.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import basix
import numpy as np
from dolfinx import cpp, fem, la
from dolfinx.common import IndexMap, timed
from dolfinx.mesh import Mesh, compute_midpoints, exterior_facet_indices
from mpi4py import MPI
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from cutsim.base import compat
from cutsim.base.checks import require_numbers
from cutsim.base.signatures import checked
from cutsim.fields.sizes import incidence
from cutsim.fields.twins import MERGE, split_along

Facets = NDArray[np.int32] | Sequence[NDArray[np.int32]]

#: Attribute of a cracked space: which local facets, ghosts included, it is cracked along.
CRACKED = "cracked_facets"
_TANGENT = 1e-3  # |n·e| below which the side of a facet cannot be told from the direction e


@timed("~cutsim: cracked space")
@checked
def cracked_space(mesh: Mesh, element: Any, facets: Facets) -> fem.FunctionSpace:
    """Lagrange space of degree 1 or 2, discontinuous across a crack and continuous elsewhere. Collective.

    Two cells share their dof at a point of the crack if one can walk from one to the other around that point
    through facets that contain it and are not cracked. This alone separates bodies, keeps the dofs of a front
    that ends inside a body shared, and makes three copies where cracks meet in a T, four where they cross.

    Everything of dolfinx that goes through cells sees both sides. What goes through a facet of the crack does
    not: ``locate_dofs_topological`` on crack facets finds the dofs of one side, and not always of the same.
    On facets of the outer boundary it finds all, also where the crack meets it; on vertices and edges there it
    does not. `locate_dofs` finds the dofs of every side on any entity.

    Args:
        mesh: The mesh; on several ranks with ghost mode ``shared_facet``.
        element: What ``dolfinx.fem.functionspace`` takes: ``("Lagrange", degree)``,
            ``("Lagrange", degree, shape)`` or a basix.ufl element; scalar or blocked.
        facets: Facets of the crack, or one array for each of several cracks: local indices, owned or ghosts.
            A facet may be given on any of the ranks that know it.

    Returns:
        The space on ``mesh``. Its owned dofs are those away from the crack, in the order of the uncracked
        space, then the copies on the crack.

    Raises:
        ValueError: On all ranks, if the element is not continuous Lagrange of degree 1 or 2, a facet index is
            out of range, there are no facets, some lie on the outer boundary, or ghost cells are missing.
    """
    cracked = _crack_marks(mesh, facets)
    parent = fem.functionspace(mesh, element)
    _check_element(parent.ufl_element())
    incidence = _incidence(mesh, parent, cracked)
    dofs, owners = _split_dofs(parent, incidence, _copies(mesh.comm, incidence))
    space = _with_dofs(parent, dofs, owners)
    vars(space)[CRACKED] = cracked
    return space


def vertex_space(V: fem.FunctionSpace, cells: NDArray[np.int32] | None = None) -> fem.FunctionSpace:
    """Scalar Lagrange space of degree 1 on one body, split across cracks as another space is. Collective.

    Args:
        V: Lagrange space of any degree, cracked or not, whose dofs in vertices are those of the new space.
        cells: Local cells of the body, all by default. The space has no dofs elsewhere: values in other cells have
            no meaning.

    Returns:
        The space on the mesh of V.
    """
    mesh, dofmap, index_map = V.mesh, V.dofmap, V.dofmap.index_map
    comm, n = mesh.comm, index_map.size_local
    parent = fem.functionspace(mesh, ("Lagrange", 1))
    places = [dofmap.dof_layout.entity_dofs(0, i)[0] for i in range(parent.dofmap.dof_layout.num_dofs)]
    cell_dofs = np.ascontiguousarray(dofmap.list[:, places])
    owned = np.arange(mesh.topology.index_map(mesh.topology.dim).size_local)
    body = cell_dofs[owned if cells is None else np.intersect1d(cells, owned)]
    used = np.zeros(n + index_map.num_ghosts, dtype=np.int32)
    used[body] = 1
    kept = np.flatnonzero(sum_over_ranks(index_map, used)[:n])
    counts = comm.allgather(kept.size)
    number = la.vector(index_map, dtype=np.int64)
    number.array[:] = -1
    number.array[kept] = sum(counts[: comm.rank]) + np.arange(kept.size)
    number.scatter_forward()
    # a cell of another body has to point somewhere
    owner = np.where(number.array < 0, np.argmax(counts), [*([comm.rank] * n), *index_map.owners])
    start = sum(counts[: np.argmax(counts)])
    number.array[number.array < 0] = start
    return _with_dofs(parent, number.array[cell_dofs], owner[cell_dofs].astype(np.int32))


def crack_measure_entities(mesh: Mesh, facets: Facets, plus: NDArray[np.int32] | Sequence[float]) -> NDArray[np.int32]:
    """Integration data of the crack with a fixed '+' side. Collective.

    The sides that dolfinx gives interior facets follow the cell numbers and so change with the partition. Use
    ``ufl.Measure("dS", domain=mesh, subdomain_data=[(tag, entities)])`` to have '+' where you want it.

    Args:
        mesh: The mesh; on several ranks with ghost mode ``shared_facet``.
        facets: Facets of the crack, as for `cracked_space`.
        plus: The '+' side: an integer array of the local cells (owned or ghosts) of the region on that side,
            or a direction e of gdim floats such that the normal n out of the '+' cell has n·e > 0.

    Returns:
        Rows (cell '+', its local facet, cell '-', its local facet), flattened, one for each facet owned by
        this rank.

    Raises:
        ValueError: On all ranks, if the facets are refused as in `cracked_space`, if both cells of a facet or
            neither are in the '+' region, or if the direction is not a vector or is tangent to a facet.
    """
    cracked = np.flatnonzero(_crack_marks(mesh, facets)[: _facet_map(mesh).size_local])
    cells, local_facets = _cells_of(mesh, cracked)
    if isinstance(plus, np.ndarray) and np.issubdtype(plus.dtype, np.integer):
        first = _in_region(mesh, cracked, cells, plus)
    else:
        require_numbers("plus", plus, length=mesh.geometry.dim)
        first = _along(mesh, cracked, cells, np.asarray(plus, dtype=np.float64))
    rows = np.stack([cells, local_facets], axis=2)
    return np.where(first[:, None, None], rows, rows[:, ::-1]).ravel()


def on_boundary(mesh: Mesh, facets: NDArray[np.int32]) -> bool:
    """Whether facets lie on the outer boundary, all of them, and are not twins of others on it. Collective."""
    facets = np.asarray(facets, dtype=np.int32)
    inner = mesh.comm.allreduce(int(np.count_nonzero(~outer_marks(mesh)[facets])))
    return inner == 0 and not split_along(mesh, facets)


def outer_marks(mesh: Mesh) -> NDArray[np.bool_]:
    """Whether each local facet, ghosts included, lies on the outer boundary. Collective."""
    facet_map, fdim = _facet_map(mesh), mesh.topology.dim - 1
    mesh.topology.create_connectivity(fdim, fdim + 1)
    outer = np.zeros(facet_map.size_local + facet_map.num_ghosts, dtype=np.int32)
    outer[exterior_facet_indices(mesh.topology)] = 1
    return sum_over_ranks(facet_map, outer) > 0


def locate_dofs(V: fem.FunctionSpace, dim: int, entities: NDArray[np.int32]) -> NDArray[np.int32]:
    """Dofs on mesh entities, on every side of the cracks that meet there. Collective.

    A vertex or edge at the mouth of a crack belongs to cells on both sides, of which ``locate_dofs_topological``
    looks at one, and not the same one on any number of ranks.

    Args:
        V: The space, cracked or not.
        dim: Dimension of the entities.
        entities: Local entities, owned or ghosts. One may be given on any of the ranks that know it.

    Returns:
        Local dofs (blocks), ghosts included, ascending.

    Raises:
        ValueError: On all ranks, if an entity is out of range.
    """
    topology, dofmap = V.mesh.topology, V.dofmap
    topology.create_entities(dim)
    cell_entities = incidence(V.mesh, topology.dim, dim)
    named = marks(V.mesh.comm, topology.index_map(dim), np.asarray(entities, dtype=np.int32), "entities")
    cells, local = np.nonzero(named[cell_entities])
    closure = np.array([dofmap.dof_layout.entity_closure_dofs(dim, i) for i in range(cell_entities.shape[1])])
    found = np.zeros(dofmap.index_map.size_local + dofmap.index_map.num_ghosts, dtype=np.int32)
    found[dofmap.list[cells[:, None], closure[local]]] = 1
    return np.flatnonzero(sum_over_ranks(dofmap.index_map, found)).astype(np.int32)


def locate_face_dofs(V: fem.FunctionSpace, entities: NDArray[np.int32]) -> NDArray[np.int32]:
    """Dofs on facets as the cells on one side see them: those of one face of a crack. Collective.

    Args:
        V: The space, cracked or not.
        entities: Rows (cell, local facet), each on one rank (`cutsim.fields.points.Surface.entities`).

    Returns:
        Local dofs (blocks), ghosts included, ascending.
    """
    dofmap, fdim = V.dofmap, V.mesh.topology.dim - 1
    facets = cpp.mesh.cell_num_entities(V.mesh.topology.cell_type, fdim)
    closure = np.array([dofmap.dof_layout.entity_closure_dofs(fdim, i) for i in range(facets)])
    found = np.zeros(dofmap.index_map.size_local + dofmap.index_map.num_ghosts, dtype=np.int32)
    found[dofmap.list[entities[:, :1], closure[entities[:, 1]]]] = 1
    return np.flatnonzero(sum_over_ranks(dofmap.index_map, found)).astype(np.int32)


# --- the crack in the mesh ---


def refuse(comm: MPI.Comm, message: str | None) -> None:
    """Raise the message of the lowest rank that has one, on all ranks."""
    if told := [m for m in comm.allgather(message) if m]:
        raise ValueError(told[0])


def sum_over_ranks(index_map: IndexMap, values: NDArray[Any]) -> NDArray[np.int32]:
    """Sum of the values that the ranks hold for each index, returned to all of them."""
    total = la.vector(index_map, dtype=np.int32)
    total.array[:] = values
    total.scatter_reverse(la.InsertMode.add)
    total.scatter_forward()
    return total.array.copy()


def _facet_map(mesh: Mesh) -> IndexMap:
    mesh.topology.create_entities(mesh.topology.dim - 1)
    return mesh.topology.index_map(mesh.topology.dim - 1)


def _cell_facets(mesh: Mesh) -> NDArray[np.int32]:
    """Facets of every local cell, shape (cells, facets of a cell)."""
    tdim = mesh.topology.dim
    mesh.topology.create_connectivity(tdim - 1, tdim)  # for the midpoints and normals of facets
    return incidence(mesh, tdim, tdim - 1)


def marks(comm: MPI.Comm, index_map: IndexMap, indices: NDArray[np.int32], name: str) -> NDArray[np.bool_]:
    """Whether any rank names the index, for all local indices. Collective.

    Raises:
        ValueError: On all ranks, if an index is out of range; the message begins with the name.
    """
    size = index_map.size_local + index_map.num_ghosts
    bad = indices[(indices < 0) | (indices >= size)]
    text = f"{name}: {bad.size} indices out of range, e.g. {bad[:1]}; allowed are 0 to {size - 1}"
    refuse(comm, text if bad.size else None)
    named = np.zeros(size, dtype=np.int32)
    named[indices] = 1
    return sum_over_ranks(index_map, named) > 0


def _crack_marks(mesh: Mesh, facets: Facets) -> NDArray[np.bool_]:
    """Whether each local facet is cracked, after all checks of the facets and the ghost mode."""
    comm, index_map = mesh.comm, _facet_map(mesh)
    parts = [facets] if isinstance(facets, np.ndarray) else list(facets)
    given = np.concatenate([np.empty(0, np.int32), *(np.asarray(p, dtype=np.int32).ravel() for p in parts)])
    cracked = marks(comm, index_map, given, "facets")
    if comm.allreduce(int(cracked.sum())) == 0:
        raise ValueError("facets: 0 on all ranks; allowed is at least 1 interior facet")

    cell_facets = _cell_facets(mesh)
    owned = cell_facets[: mesh.topology.index_map(mesh.topology.dim).size_local]
    cells_here = np.bincount(cell_facets.ravel(), minlength=cracked.size)
    cells_everywhere = sum_over_ranks(index_map, np.bincount(owned.ravel(), minlength=cracked.size))
    hidden = int(np.sum(cells_here[np.unique(owned)] < cells_everywhere[np.unique(owned)]))
    if total := comm.allreduce(hidden):
        raise ValueError(
            f"mesh: {total} facets between ranks lack a ghost cell; on {comm.size} ranks make the mesh with "
            "partitioner=dolfinx.mesh.create_cell_partitioner(dolfinx.mesh.GhostMode.shared_facet)"
        )
    outer = np.flatnonzero(cracked & (cells_everywhere == 1)).astype(np.int32)
    text = "facets: {} lie on the outer boundary, e.g. at {}; allowed are interior facets"
    if comm.allreduce(len(outer)) and split_along(mesh, outer):
        text += f". The mesh is split along them, their nodes are there twice: cracks are opened here, {MERGE}"
    _refuse_facets(mesh, outer, text)
    return cracked


def _refuse_facets(mesh: Mesh, bad: NDArray[np.int32], text: str) -> None:
    """Refuse the facets, if any, with their number over all ranks and the midpoint of one of them."""
    count = mesh.comm.allreduce(int(np.sum(bad < _facet_map(mesh).size_local)))
    where = compute_midpoints(mesh, mesh.topology.dim - 1, bad[:1]).reshape(-1, 3).round(6).tolist()
    refuse(mesh.comm, text.format(count, where[0]) if bad.size else None)


# --- the sides of the crack ---


def _cells_of(mesh: Mesh, facets: NDArray[Any]) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """The two cells of each of the ascending facets, and its number in them, both of shape (facets, 2)."""
    cell_facets = _cell_facets(mesh)
    cells, local = np.nonzero(np.isin(cell_facets, facets))
    order = np.argsort(cell_facets[cells, local], kind="stable")
    pairs = np.stack([cells[order], local[order]], dtype=np.int32).reshape(2, -1, 2)
    return pairs[0], pairs[1]


def _in_region(mesh: Mesh, facets: NDArray[Any], cells: NDArray[Any], plus: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Whether the first cell of each facet is the one in the region."""
    inside = marks(mesh.comm, mesh.topology.index_map(mesh.topology.dim), plus.ravel(), "plus")[cells]
    wrong = facets[inside[:, 0] == inside[:, 1]].astype(np.int32)
    text = "plus: {} facets have both cells or neither in the '+' region, e.g. at {}; allowed is exactly one"
    _refuse_facets(mesh, wrong, text)
    return inside[:, 0]


def _along(mesh: Mesh, facets: NDArray[Any], cells: NDArray[Any], direction: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether the normal out of the first cell of each facet points along the direction."""
    tdim, gdim, facets = mesh.topology.dim, mesh.geometry.dim, facets.astype(np.int32)
    refuse(mesh.comm, None if np.any(direction) else f"plus: {direction} is no direction; allowed is one not all zero")
    normals = cpp.mesh.cell_normals(mesh._cpp_object, tdim - 1, facets).reshape(-1, 3)
    first = np.ascontiguousarray(cells[:, 0], dtype=np.int32)
    outward = compute_midpoints(mesh, tdim - 1, facets) - compute_midpoints(mesh, tdim, first)
    normals *= np.sign(np.sum(normals * outward.reshape(-1, 3), axis=1, keepdims=True))
    cosine = normals[:, :gdim] @ (direction / np.linalg.norm(direction))
    text = f"plus: {direction} is tangent to {{}} facets, e.g. at {{}}; allowed is |n·e| > {_TANGENT}"
    _refuse_facets(mesh, facets[np.abs(cosine) <= _TANGENT], text)
    return cosine > 0


# --- dofs ---


@dataclass(frozen=True)
class _Incidence:
    """Cells that meet in the dofs on the crack, on this rank. A key is one number for a (dof, cell) pair."""

    cells: NDArray[np.int64]  # local cell of each node ...
    places: NDArray[np.int64]  # ... place of the dof in that cell ...
    keys: NDArray[np.int64]  # ... and key
    owned: NDArray[np.bool_]  # whether this rank owns the cell of the node
    links: NDArray[np.int64]  # pairs of keys joined by an uncracked facet, shape (links, 2)
    marked: NDArray[np.bool_]  # whether each local dof of the parent space is on the crack


@dataclass(frozen=True)
class _Copies:
    """Copies of the dofs on the crack, the same on all ranks."""

    keys: NDArray[np.int64]  # all (dof, cell) keys, sorted ...
    labels: NDArray[np.int64]  # ... and the copy that each belongs to
    owners: NDArray[np.int32]  # rank that owns each copy, ascending


def _check_element(element: Any) -> None:
    lagrange = element.element_family == basix.ElementFamily.P and not element.discontinuous
    if not (lagrange and element.degree in (1, 2)):
        raise ValueError(f"element: {element}; allowed is continuous Lagrange of degree 1 or 2")


def _incidence(mesh: Mesh, parent: fem.FunctionSpace, cracked: NDArray[np.bool_]) -> _Incidence:
    tdim, dofmap, index_map = mesh.topology.dim, parent.dofmap, parent.dofmap.index_map
    cell_dofs, cell_facets = dofmap.list, _cell_facets(mesh)
    closure = np.array([dofmap.dof_layout.entity_closure_dofs(tdim - 1, i) for i in range(cell_facets.shape[1])])
    cells, local = np.nonzero(cracked[cell_facets])
    on_crack = np.zeros(index_map.size_local + index_map.num_ghosts, dtype=np.int32)
    on_crack[cell_dofs[cells[:, None], closure[local]]] = 1
    marked = sum_over_ranks(index_map, on_crack) > 0

    cell_map = mesh.topology.index_map(tdim)
    dof_number = index_map.local_to_global(np.arange(marked.size, dtype=np.int32))
    cell_number = cell_map.local_to_global(np.arange(len(cell_dofs), dtype=np.int32))

    def key(dofs: NDArray[Any], of: NDArray[Any]) -> NDArray[np.int64]:
        return dof_number[dofs] * cell_map.size_global + cell_number[of]

    cells, places = np.nonzero(marked[cell_dofs])
    joints = np.unique(cell_facets[cells])
    joints = joints[~cracked[joints] & (np.bincount(cell_facets.ravel())[joints] == 2)]
    pairs, local_facets = _cells_of(mesh, joints)
    shared = cell_dofs[pairs[:, :1], closure[local_facets[:, 0]]]
    row, column = np.nonzero(marked[shared])
    links = np.stack([key(shared[row, column], pairs[row, side]) for side in (0, 1)], axis=1)
    return _Incidence(cells, places, key(cell_dofs[cells, places], cells), cells < cell_map.size_local, links, marked)


def _copies(comm: MPI.Comm, incidence: _Incidence) -> _Copies:
    """Gather the crack on every rank and number the connected parts around each dof."""
    owned_keys = comm.allgather(incidence.keys[incidence.owned])
    ranks = np.repeat(np.arange(comm.size, dtype=np.int32), [k.size for k in owned_keys])
    order = np.argsort(np.concatenate(owned_keys))
    keys, ranks = np.concatenate(owned_keys)[order], ranks[order]
    first, second = np.searchsorted(keys, np.concatenate(comm.allgather(incidence.links))).T
    adjacency = coo_array((np.ones(first.size), (first, second)), shape=(keys.size, keys.size))
    count, labels = connected_components(adjacency, directed=False)
    owners = np.full(count, comm.size, dtype=np.int32)
    np.minimum.at(owners, labels, ranks)
    by_owner = np.argsort(owners, kind="stable")
    return _Copies(keys, np.argsort(by_owner)[labels], owners[by_owner])


def _split_dofs(
    parent: fem.FunctionSpace, incidence: _Incidence, copies: _Copies
) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Global number and owner of the dofs of every local cell, each of shape (cells, dofs of a cell)."""
    comm, index_map, cell_dofs = parent.mesh.comm, parent.dofmap.index_map, parent.dofmap.list
    kept = np.flatnonzero(~incidence.marked[: index_map.size_local])
    kept_before = np.cumsum([0, *comm.allgather(kept.size)])
    copies_before = np.searchsorted(copies.owners, comm.rank)
    number = la.vector(index_map, dtype=np.int64)
    number.array[kept] = kept_before[comm.rank] + copies_before + np.arange(kept.size)
    number.scatter_forward()
    owner = np.concatenate([np.full(index_map.size_local, comm.rank), index_map.owners])
    dofs, owners = number.array[cell_dofs], owner[cell_dofs]

    copy = copies.labels[np.searchsorted(copies.keys, incidence.keys)]
    on_crack = incidence.cells, incidence.places
    owners[on_crack] = copies.owners[copy]
    dofs[on_crack] = kept_before[copies.owners[copy] + 1] + copy  # after the kept dofs of its owner
    return dofs, owners.astype(np.int32)


def _with_dofs(parent: fem.FunctionSpace, dofs: NDArray[np.int64], owners: NDArray[np.int32]) -> fem.FunctionSpace:
    """The space with other dofs: global number and owner of those of every local cell, each (cells, dofs of a cell)."""
    index_map, local = _renumber(parent.mesh.comm, dofs, owners)
    return compat.with_dofs(parent, index_map, local)


def _renumber(comm: MPI.Comm, dofs: NDArray[np.int64], owners: NDArray[np.int32]) -> tuple[IndexMap, NDArray[np.int32]]:
    """Index map with the dofs that other ranks own as ghosts, and the dofs in local numbers."""
    here = owners == comm.rank
    start, end = (dofs[here].min(), dofs[here].max() + 1) if here.any() else (0, 0)
    ghosts, first, position = np.unique(dofs[~here], return_index=True, return_inverse=True)
    index_map = compat.index_map(comm, int(end - start), ghosts, owners[~here][first])
    local = dofs - start
    local[~here] = end - start + position
    return index_map, local.astype(np.int32)
