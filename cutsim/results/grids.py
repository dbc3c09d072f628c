"""Grids of the whole body on the first rank, for pictures and files (pyvista). Collective.

They are extras: where pyvista is missing, that is logged as a warning and the run goes on.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import basix
import numpy as np
import ufl
from dolfinx import fem, plot
from dolfinx.mesh import Mesh
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.base.checks import require
from cutsim.base.compat import nodal_expression
from cutsim.bodies.solid import Solid
from cutsim.fields.state import State

if TYPE_CHECKING:
    import pyvista

logger = logging.getLogger(__name__)


def gather_grid(
    u: fem.Function, cell_data: Mapping[str, NDArray[np.float64] | fem.Function] | None = None
) -> pyvista.UnstructuredGrid | None:
    """The whole body with its displacement on the first rank. Collective.

    Args:
        u: Displacement, Lagrange of degree 1 or 2, on an ordinary or a cracked space; the faces of a crack
            come apart.
        cell_data: Name -> one value or row per cell: a DG 0 function, or an array over the owned cells.

    Returns:
        The reference grid with the displacement ``u`` (padded to three components) and the cell data on the
        first rank; None on the others, and where pyvista is missing.

    Raises:
        ValueError: If an array does not have a row per owned cell.
    """
    space = u.function_space
    mesh, nodes = space.mesh, space.dofmap.index_map
    cells, kinds, points = plot.vtk_mesh(space)
    local = cells.reshape(-1, space.dofmap.dof_layout.num_dofs + 1)[:, 1:]
    table = nodes.local_to_global(local.ravel()).reshape(local.shape)
    owned = nodes.size_local
    values = u.x.array.reshape(-1, space.dofmap.bs)[:owned]
    data = {name: _cell_rows(mesh, name, entry) for name, entry in (cell_data or {}).items()}
    return _assemble(mesh.comm, table, kinds, points[:owned], {"u": values}, data)


def gather_facets(
    u: fem.Function, facets: NDArray[np.int32], damage: NDArray[np.float64]
) -> pyvista.UnstructuredGrid | None:
    """The faces of a crack that are meshed, with their damage on the first rank. Collective.

    Args:
        u: Displacement on the cracked space, ghosts up to date. Faces of degree 2 are drawn straight.
        facets: Local facets of the crack; ghosts may be among them and are left out.
        damage: Damage of each of these facets, in [0, 1].

    Returns:
        The reference grid, each facet for each of its cells, with ``damage`` and the ``middle`` of the cell behind it
        per facet and the displacement ``u`` per point on the first rank; None on the others, and where pyvista is
        missing.

    Raises:
        ValueError: If facets and damage differ in length.
    """
    space = u.function_space
    mesh = space.mesh
    _require_rows(mesh.comm, "damage", len(damage), len(facets))
    owned = np.asarray(facets) < mesh.topology.index_map(mesh.topology.dim - 1).size_local
    dofs, cells, rows = _faces(space, np.asarray(facets)[owned])
    nodes = space.tabulate_dof_coordinates()
    values = u.x.array.reshape(-1, space.dofmap.bs)[dofs.ravel()]
    kind = {1: 1, 2: 3, 3: 5, 4: 9}[dofs.shape[1]]  # VTK: vertex, line, triangle, quadrilateral
    first = mesh.comm.exscan(dofs.size) or 0
    table = first + np.arange(dofs.size).reshape(dofs.shape)
    middle = nodes[space.dofmap.list[cells]].mean(axis=1)
    data = {"damage": np.asarray(damage)[owned][rows], "middle": middle}
    return _assemble(mesh.comm, table, np.full(len(table), kind), nodes[dofs.ravel()], {"u": values}, data)


def part_numbers(state: State, solids: Sequence[Solid]) -> fem.Function:
    """Number of the solid that each cell belongs to.

    Args:
        state: Displacement and time.
        solids: The solids.
    """
    number = fem.Function(fem.functionspace(state.mesh, ("DG", 0)))
    for index, solid in enumerate(solids):
        cells = slice(None) if solid.cells is None else solid.cells
        number.x.array[number.function_space.dofmap.list[cells, 0]] = index
    return number


class VonMises:
    """Von Mises' stress of some solids in the middle of their cells, zero elsewhere. Collective.

    Args:
        solids: The solids, one or more, of one mesh.
    """

    def __init__(self, solids: Sequence[Solid]) -> None:
        u = solids[0].state.u
        self._stress = fem.Function(fem.functionspace(solids[0].state.mesh, ("DG", 0)), name="stress")
        self._sizes = []
        for solid in solids:
            deviator = ufl.dev(solid.cauchy_stress(u))
            size = nodal_expression(ufl.sqrt(1.5 * ufl.inner(deviator, deviator)), self._stress.function_space)
            self._sizes.append((size, solid.cells))

    def __call__(self) -> fem.Function:
        """The stress in the present state [stress]; one function, whose values change. Collective."""
        for size, cells in self._sizes:
            self._stress.interpolate(size, cells)
        self._stress.x.scatter_forward()
        return self._stress


def library(otherwise: str) -> Any:
    """The library pyvista; None, with a warning of what that means, where it is missing.

    Args:
        otherwise: What there will not be without it, in words.
    """
    try:
        import pyvista
    except ImportError as error:
        logger.warning("%s: %s", otherwise, error)
        return None
    return pyvista


def _cell_rows(mesh: Mesh, name: str, entry: NDArray[np.float64] | fem.Function) -> NDArray[np.float64]:
    """Rows of the owned cells."""
    owned = mesh.topology.index_map(mesh.topology.dim).size_local
    if isinstance(entry, fem.Function):
        dofmap = entry.function_space.dofmap
        constant = dofmap.dof_layout.num_dofs == 1
        require("cell_data", name, constant, "the name of a DG 0 function or of an array")
        rows = entry.x.array.reshape(-1, dofmap.bs)[dofmap.list[:owned, 0]]
        return rows[:, 0] if dofmap.bs == 1 else rows
    _require_rows(mesh.comm, name, len(entry), owned)
    return np.asarray(entry)


def _require_rows(comm: MPI.Comm, name: str, rows: int, expected: int) -> None:
    wrong = comm.allreduce(int(rows != expected))
    require(f"length of {name}", rows, not wrong, f"{expected}, on {wrong} ranks it is not")


def _faces(
    space: fem.FunctionSpace, facets: NDArray[np.int32]
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int64]]:
    """Vertex dofs of facets in VTK's order, the cells behind, and the places of the facets, for each of their cells."""
    topology, layout = space.mesh.topology, space.dofmap.dof_layout
    tdim = topology.dim
    topology.create_connectivity(tdim - 1, tdim)
    topology.create_connectivity(tdim, tdim - 1)
    to_cells, to_facets = topology.connectivity(tdim - 1, tdim), topology.connectivity(tdim, tdim - 1)
    vertices = np.array(basix.topology(space.mesh.basix_cell())[tdim - 1])
    if vertices.shape[1] == 4:
        vertices = vertices[:, [0, 1, 3, 2]]
    corners = np.array([layout.entity_dofs(0, v)[0] for v in range(vertices.max() + 1)])[vertices]
    starts, ends = to_cells.offsets[facets], to_cells.offsets[facets + 1]
    second = np.flatnonzero(ends - starts == 2)
    rows = np.concatenate((np.arange(len(facets)), second))
    cells = np.concatenate((to_cells.array[starts], to_cells.array[starts[second] + 1]))
    numbers = to_facets.array.reshape(-1, len(vertices))[cells]
    local = np.argmax(numbers == facets[rows, None], axis=1)
    return space.dofmap.list[cells[:, None], corners[local]], cells, rows


def _assemble(
    comm: MPI.Comm,
    table: NDArray[np.int64],
    kinds: NDArray[Any],
    points: NDArray[np.float64],
    point_data: Mapping[str, NDArray[np.float64]],
    cell_data: Mapping[str, NDArray[np.float64]],
) -> pyvista.UnstructuredGrid | None:
    """One grid from the owned cells (rows of global point numbers) and the owned points of all ranks."""
    parts = comm.gather((table, kinds, points, dict(point_data), dict(cell_data)))
    if parts is None:
        return None
    pyvista = library("there will be no pictures of the body")
    if pyvista is None:
        return None
    table, kinds, points = (np.concatenate([part[i] for part in parts]) for i in range(3))
    cells = np.insert(table, 0, table.shape[1], axis=1).ravel()
    grid = pyvista.UnstructuredGrid(cells, kinds, points)
    for name in point_data:
        values = np.concatenate([part[3][name] for part in parts])
        grid.point_data[name] = np.pad(values, ((0, 0), (0, 3 - values.shape[1])))
    for name in cell_data:
        grid.cell_data[name] = np.concatenate([part[4][name] for part in parts])
    return grid
