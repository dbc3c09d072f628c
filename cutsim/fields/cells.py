"""Checks of cells: without volume, folded, lying over each other, or belonging to two bodies."""

from collections.abc import Sequence
from itertools import combinations
from typing import Protocol

import numpy as np
from dolfinx.mesh import Mesh, compute_midpoints, entities_to_geometry
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.base.arrays import Array
from cutsim.base.checks import place
from cutsim.base.compat import geometry_nodes

# determinant of the Jacobian over the product of the lengths of its columns that counts as none
_NOTHING = 1e-10


class Filling(Protocol):
    """Protocol of a body that fills cells.

    Attributes:
        name: Its name.
        cells: Local cells (ghosts allowed); None for all.
    """

    name: str
    cells: NDArray[np.int32] | None


def check_cells(mesh: Mesh) -> None:
    """Refuse a mesh with cells that have no volume, are folded, or overlap their neighbours. Collective.

    Raises:
        ValueError: On all ranks, with the number of these cells and the place of the first.
    """
    tdim = mesh.topology.dim
    if tdim != mesh.geometry.dim:
        return
    owned = mesh.topology.index_map(tdim).size_local
    x = mesh.geometry.x[geometry_nodes(mesh)[:owned]][..., :tdim]
    finite = np.isfinite(x).all(axis=(1, 2))
    with np.errstate(divide="ignore", invalid="ignore"):
        volume = _volumes(mesh, x)
    places = x.mean(axis=1)
    _refuse(mesh.comm, places[~finite], "cells have coordinates that are not finite")
    empty = np.abs(volume).max(axis=1, initial=0.0) <= _NOTHING
    _refuse(mesh.comm, places[empty], "cells have no volume")
    folded = (volume.min(axis=1, initial=np.inf) < -_NOTHING) & (volume.max(axis=1, initial=-np.inf) > _NOTHING)
    _refuse(mesh.comm, places[folded], "cells are folded (their Jacobian changes its sign)")
    _refuse(mesh.comm, _overlapping(mesh), "facets have both their cells on the same side: cells lie over each other")


def check_disjoint(mesh: Mesh, bodies: Sequence[Filling]) -> None:
    """Refuse bodies that share cells, since their stiffnesses, masses and capacities would add up. Collective.

    Args:
        mesh: The mesh.
        bodies: The bodies.

    Raises:
        ValueError: On all ranks, with the names of the first two and the number of cells that they share.
    """
    owned = np.arange(mesh.topology.index_map(mesh.topology.dim).size_local)
    parts = [owned if body.cells is None else np.intersect1d(body.cells, owned) for body in bodies]
    for i, j in combinations(range(len(bodies)), 2):
        shared = mesh.comm.allreduce(len(np.intersect1d(parts[i], parts[j])))
        if shared:
            raise ValueError(
                f"bodies {bodies[i].name!r} and {bodies[j].name!r} share {shared} cells: each cell belongs to one body "
                "(without cells a body has all of them)"
            )


def _refuse(comm: MPI.Comm, places: Array, what: str) -> None:
    told = comm.allgather((len(places), places[:1].tolist()))
    count = sum(n for n, _ in told)
    if count:
        first = next(p[0] for n, p in told if n)
        raise ValueError(f"mesh: {count} {what}, the first at {place(first)}")


def _volumes(mesh: Mesh, x: Array) -> Array:
    """Determinants of the Jacobian over the lengths of its columns, shape (cells, nodes of a cell)."""
    element = mesh.ufl_domain().ufl_coordinate_element().basix_element
    slopes = element.tabulate(1, element.points)[1:, :, :, 0]
    columns = np.einsum("kqa,cai->cqik", slopes, x)
    volumes: Array = np.linalg.det(columns) / np.linalg.norm(columns, axis=2).prod(axis=-1)
    return np.nan_to_num(volumes)


def _overlapping(mesh: Mesh) -> Array:
    """Places of the owned facets both cells of which lie on the same side."""
    tdim, fdim = mesh.topology.dim, mesh.topology.dim - 1
    mesh.topology.create_connectivity(fdim, tdim)
    mesh.topology.create_connectivity(tdim, fdim)
    table = mesh.topology.connectivity(fdim, tdim)
    owned = mesh.topology.index_map(fdim).size_local
    inner = np.flatnonzero(np.diff(table.offsets[: owned + 1]) == 2).astype(np.int32)
    if not len(inner):
        return np.empty((0, tdim))
    corners = mesh.geometry.x[entities_to_geometry(mesh, fdim, inner)]
    middle = corners.mean(axis=1)
    across = corners[:, 2] - corners[:, 0] if tdim == 3 else np.array([0.0, 0.0, 1.0])
    normal = np.cross(corners[:, 1] - corners[:, 0], across)
    cells = table.array[table.offsets[inner][:, None] + np.arange(2)]
    towards = compute_midpoints(mesh, tdim, cells.ravel()).reshape(-1, 2, 3) - middle[:, None]
    sizes = np.linalg.norm(normal, axis=1)[:, None] * np.linalg.norm(towards, axis=2)
    sides = np.einsum("fi,fsi->fs", normal, towards) / np.where(sizes > 0, sizes, 1.0)
    return np.asarray(middle[(np.abs(sides) > _NOTHING).all(axis=1) & (sides.prod(axis=1) > 0), :tdim])
