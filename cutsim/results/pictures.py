"""Pictures of a run: the deformed and cut body with the tool (pyvista, off screen).

Pictures are extras: where pyvista is missing or cannot draw, that is logged as a warning and the run goes on.
"""

from __future__ import annotations

import ctypes
import logging
import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import basix
import numpy as np
import ufl
from dolfinx import fem, plot
from dolfinx.mesh import Mesh
from mpi4py import MPI
from numpy.typing import ArrayLike, NDArray

from cutsim.base.checks import require
from cutsim.base.compat import nodal_expression
from cutsim.bodies.solid import Solid
from cutsim.interface.crack import Crack

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
    """Both faces of a crack with their damage on the first rank. Collective.

    Args:
        u: Displacement on the cracked space, ghosts up to date. Faces of degree 2 are drawn straight.
        facets: Local facets of the crack; ghosts may be among them and are left out.
        damage: Damage of each of these facets, in [0, 1].

    Returns:
        The reference grid, each facet twice, with ``damage`` and the ``middle`` of the cell behind it per
        facet and the displacement ``u`` per point on the first rank; None on the others, and where pyvista is
        missing.

    Raises:
        ValueError: If facets and damage differ in length.
    """
    space = u.function_space
    mesh = space.mesh
    _require_rows(mesh.comm, "damage", len(damage), len(facets))
    owned = np.asarray(facets) < mesh.topology.index_map(mesh.topology.dim - 1).size_local
    dofs, cells = _faces(space, np.asarray(facets)[owned])
    nodes = space.tabulate_dof_coordinates()
    values = u.x.array.reshape(-1, space.dofmap.bs)[dofs.ravel()]
    kind = {1: 1, 2: 3, 3: 5, 4: 9}[dofs.shape[1]]  # VTK: vertex, line, triangle, quadrilateral
    first = mesh.comm.exscan(dofs.size) or 0
    table = first + np.arange(dofs.size).reshape(dofs.shape)
    middle = nodes[space.dofmap.list[cells]].mean(axis=1)
    data = {"damage": np.tile(np.asarray(damage)[owned], 2), "middle": middle}
    return _assemble(mesh.comm, table, np.full(len(table), kind), nodes[dofs.ravel()], {"u": values}, data)


def prism(
    outline: NDArray[np.float64],
    origin: ArrayLike,
    axes: tuple[ArrayLike, ArrayLike],
    edge: ArrayLike | None = None,
) -> pyvista.PolyData | None:
    """A tool of constant cross-section, for `draw_body`.

    Args:
        outline: Cross-section, rows of two coordinates along the axes.
        origin: Where the outline has its origin; two or three coordinates.
        axes: Directions of the two coordinates.
        edge: From one end of the tool to the other; None for a flat picture.

    Returns:
        The surface, None where pyvista is missing.
    """
    pyvista = _library("no tool is drawn")
    if pyvista is None:
        return None
    vectors = (np.asarray(v, dtype=float) for v in (*axes, origin))
    first, second, start = (np.pad(v, (0, 3 - len(v))) for v in vectors)
    points = start + outline[:, :1] * first + outline[:, 1:] * second
    face = pyvista.PolyData(points, faces=[len(points), *range(len(points))])
    return face if edge is None else face.extrude(np.asarray(edge, dtype=float), capping=True)


def revolved(
    outline: NDArray[np.float64],
    origin: ArrayLike,
    axes: tuple[ArrayLike, ArrayLike],
    points: int = 48,
) -> pyvista.PolyData | None:
    """A tool of revolution in space, for `draw_body`.

    Args:
        outline: Its section through the axis, rows of two coordinates; the second is along the axis of revolution.
        origin: Where the outline has its origin; three coordinates.
        axes: Directions of the two coordinates, orthogonal unit vectors.
        points: Points on a circle.

    Returns:
        The surface, None where pyvista is missing.
    """
    pyvista = _library("no tool is drawn")
    if pyvista is None:
        return None
    across, along = outline[outline[:, 0] >= 0].T
    first, axis = (np.asarray(v, dtype=float) for v in axes)
    turn = np.linspace(0.0, 2 * np.pi, points)[:, None]
    directions = np.cos(turn) * first + np.sin(turn) * np.cross(axis, first)
    x = np.asarray(origin) + across[:, None, None] * directions + along[:, None, None] * axis
    return pyvista.StructuredGrid(*np.moveaxis(x, -1, 0)[..., None]).extract_surface(algorithm="dataset_surface")


def draw_body(
    path: Path | str,
    grid: pyvista.UnstructuredGrid | None,
    scalars: str,
    *,
    label: str,
    title: str = "",
    tool: pyvista.PolyData | None = None,
    crack: pyvista.DataSet | None = None,
    mirror: Sequence[str] = (),
    clip: tuple[Sequence[float], Sequence[float]] | None = None,
    view: Sequence[float] = (1.0, 0.7, 1.6),
    up: Sequence[float] = (0.0, 1.0, 0.0),
    window: Sequence[float] | None = None,
    limits: tuple[float, float] | None = None,
) -> None:
    """Draw the deformed body coloured by a field. Call it on all ranks with what `gather_grid` gave them.

    A flat grid is seen from the front without perspective.

    Args:
        path: The PNG, 1600 × 1000; folders are made.
        grid: The body; where it is None nothing is drawn.
        scalars: Name of the cell field that colours the body; it is averaged to the nodes.
        label: Text at the colour bar, with the unit.
        title: Text above the picture.
        tool: Rigid tool at its current place.
        crack: Crack facets from `gather_facets`, coloured by damage.
        mirror: Planes of symmetry through the origin, by the axis normal to them ("x", "y", "z"): body and
            crack are shown whole.
        clip: Normal and a point of a plane; cells whose middle lies beyond it before deformation are left
            out.
        view: Direction from the body to the eye.
        up: Direction that points up in the picture.
        window: Box (xmin, xmax, ymin, ymax, zmin, zmax) that is to fill the picture; the body by default.
        limits: Range of the colours; by default the field without its most extreme percent at either end.

    Raises:
        ValueError: If a plane of symmetry is unknown.
    """
    for plane in mirror:
        require("mirror", plane, plane in ("x", "y", "z"), "x, y or z")
    if grid is None:
        return
    try:
        require("scalars", scalars, scalars in grid.cell_data, f"one of {grid.cell_data.keys()}")
        flat = not np.ptp(grid.points[:, 2])
        body = _deformed(grid, mirror, clip)
        plotter = _stage(title)
        _add_body(plotter, body, scalars, label, limits or _range(body.cell_data[scalars]), flat)
        _add_outline(plotter, body, mirror)
        if crack is not None and crack.n_cells:
            _add_crack(plotter, _deformed(crack, mirror, clip), flat)
        if tool is not None:
            _add_tool(plotter, tool)
        shown = _corners(window) if window else np.vstack([mesh.points for mesh in (body, tool) if mesh])
        _aim(plotter, shown, (0.0, 0.0, 1.0) if flat else view, up, flat)
        Path(path).parent.mkdir(parents=True, exist_ok=True)
        plotter.screenshot(path)
        plotter.close()
    except Exception as error:  # a picture is never worth a run
        logger.warning("%s was not drawn: %s", path, error)


def von_mises(solids: Sequence[Solid]) -> fem.Function:
    """Von Mises' stress of some solids in the middle of their cells, zero elsewhere [stress]. Collective.

    Args:
        solids: The solids, one or more, of one mesh.
    """
    state = solids[0].state
    stress = fem.Function(fem.functionspace(state.mesh, ("DG", 0)))
    for solid in solids:
        deviator = ufl.dev(solid.cauchy_stress(state.u))
        size = nodal_expression(ufl.sqrt(1.5 * ufl.inner(deviator, deviator)), stress.function_space)
        stress.interpolate(size, solid.cells)
    stress.x.scatter_forward()
    return stress


def draw_stress(path: Path | str, solids: Solid | Sequence[Solid], crack: Crack | None = None, **view: Any) -> None:
    """Draw the deformed body coloured by von Mises' stress, and a crack by its damage. Collective.

    Args:
        path: The PNG, 1600 × 1000; folders are made.
        solids: The body, in one part or several.
        crack: A crack of it with a cohesive law.
        view: Further arguments of `draw_body`; the label is that of stresses in MPa by default.
    """
    solids = [solids] if isinstance(solids, Solid) else solids
    u = solids[0].state.u
    faces = None if crack is None else gather_facets(u, crack.points.facets, crack.facet_mean("damage"))
    grid = gather_grid(u, {"stress": von_mises(solids)})
    draw_body(path, grid, "stress", crack=faces, **{"label": "von Mises stress [MPa]", **view})


def _library(otherwise: str) -> Any:
    """pyvista; None, with a warning of what that means, where it is missing."""
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


def _faces(space: fem.FunctionSpace, facets: NDArray[np.int32]) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Vertex dofs of interior facets, in VTK's order, and the cells behind: one side, then the other."""
    topology, layout = space.mesh.topology, space.dofmap.dof_layout
    tdim = topology.dim
    topology.create_connectivity(tdim - 1, tdim)
    topology.create_connectivity(tdim, tdim - 1)
    to_cells, to_facets = topology.connectivity(tdim - 1, tdim), topology.connectivity(tdim, tdim - 1)
    vertices = np.array(basix.topology(space.mesh.basix_cell())[tdim - 1])
    if vertices.shape[1] == 4:
        vertices = vertices[:, [0, 1, 3, 2]]
    corners = np.array([layout.entity_dofs(0, v)[0] for v in range(vertices.max() + 1)])[vertices]
    starts = to_cells.offsets[facets]
    cells = np.concatenate((to_cells.array[starts], to_cells.array[starts + 1]))
    numbers = to_facets.array.reshape(-1, len(vertices))[cells]
    local = np.argmax(numbers == np.tile(facets, 2)[:, None], axis=1)
    return space.dofmap.list[cells[:, None], corners[local]], cells


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
    pyvista = _library("there will be no pictures of the body")
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


def _deformed(
    grid: pyvista.DataSet, mirror: Sequence[str], clip: tuple[Sequence[float], Sequence[float]] | None
) -> pyvista.DataSet:
    if clip is not None:
        normal, point = (np.asarray(entry, dtype=float) for entry in clip)
        middle = grid.cell_data["middle"] if "middle" in grid.cell_data else grid.cell_centers().points
        grid = grid.extract_cells((middle - point) @ normal <= 0.0)
    grid = grid.warp_by_vector("u")
    for plane in mirror:
        grid = grid.merge(grid.reflect(np.eye(3)["xyz".index(plane)], point=(0, 0, 0)), merge_points=False)
    return grid


def _stage(title: str) -> pyvista.Plotter:
    """A white stage with a strip for the colour bars below it."""
    import pyvista

    # Without a display VTK would try X first and complain; without libEGL it would then end the process.
    if sys.platform == "linux" and not any(map(os.environ.get, ("DISPLAY", "VTK_DEFAULT_OPENGL_WINDOW"))):
        ctypes.CDLL("libEGL.so.1")
        os.environ["VTK_DEFAULT_OPENGL_WINDOW"] = "vtkEGLRenderWindow"
    plotter = pyvista.Plotter(
        off_screen=True, window_size=(1600, 1000), shape=(2, 1), row_weights=(0.87, 0.13), border=False,
        lighting="light kit",
    )  # fmt: skip
    plotter.set_background("white")
    plotter.subplot(0, 0)
    plotter.enable_anti_aliasing("ssaa")
    if title:
        plotter.add_text(title, position="upper_edge", font_size=12, color="black")
    return plotter


def _surface(body: pyvista.DataSet) -> pyvista.PolyData:
    return body.cell_data_to_point_data().extract_surface(algorithm="dataset_surface", nonlinear_subdivision=2)


def _add_body(
    plotter: pyvista.Plotter,
    body: pyvista.DataSet,
    scalars: str,
    label: str,
    limits: tuple[float, float],
    flat: bool,
) -> None:
    linear = bool(body.celltypes.max() < 15)  # VTK's first-order cells; others are drawn in parts
    actor = plotter.add_mesh(
        _surface(body), scalars=scalars, cmap="viridis", clim=limits, show_edges=linear, edge_color="#20242a",
        edge_opacity=0.25, line_width=1, lighting=not flat, ambient=0.35, diffuse=0.75, specular=0.1,
        smooth_shading=not flat, split_sharp_edges=not flat, show_scalar_bar=False,
    )  # fmt: skip
    _add_bar(plotter, actor, label, 0.08)


def _add_outline(plotter: pyvista.Plotter, body: pyvista.DataSet, mirror: Sequence[str]) -> None:
    """Sharp and outer edges, without the seams where the body is mirrored."""
    edges = _surface(body).extract_feature_edges(40.0)
    seam = [np.isclose(edges.cell_centers().points[:, "xyz".index(plane)], 0.0) for plane in mirror]
    edges = edges.extract_cells(~np.any(seam, axis=0)) if mirror else edges
    if edges.n_cells:
        plotter.add_mesh(edges, color="#20242a", line_width=2, lighting=False)


def _range(values: NDArray[np.float64]) -> tuple[float, float]:
    """Range of the colours: without the peaks at sharp edges, and from zero if the field begins near it."""
    low, high = np.percentile(values, (1.0, 99.0))
    return float(0.0 if 0.0 <= low < 0.1 * high else low), float(high)


def _add_crack(plotter: pyvista.Plotter, crack: pyvista.DataSet, flat: bool) -> None:
    actor = plotter.add_mesh(
        crack, scalars="damage", cmap="magma", clim=(0.0, 1.0), line_width=7 if flat else 1, lighting=False,
        show_scalar_bar=False,
    )  # fmt: skip
    mapper = actor.mapper  # shown before the face of the body that is in the same place
    mapper.SetResolveCoincidentTopologyToPolygonOffset()
    mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(-4.0, -4.0)
    mapper.SetRelativeCoincidentTopologyLineOffsetParameters(-4.0, -4.0)
    _add_bar(plotter, actor, "damage of the crack", 0.56)


def _add_bar(plotter: pyvista.Plotter, actor: pyvista.Actor, label: str, left: float) -> None:
    plotter.subplot(1, 0)
    plotter.add_scalar_bar(
        title=label + "\n", mapper=actor.mapper, vertical=False, position_x=left, position_y=0.05, width=0.36,
        height=0.85, title_font_size=24, label_font_size=20, n_labels=5, fmt="%.2g", color="black",
    )  # fmt: skip
    plotter.subplot(0, 0)


def _add_tool(plotter: pyvista.Plotter, tool: pyvista.PolyData) -> None:
    plotter.add_mesh(
        tool, color="#a3adb8", opacity=0.45, specular=1.0, specular_power=15, smooth_shading=True,
        split_sharp_edges=True,
    )  # fmt: skip


def _aim(
    plotter: pyvista.Plotter,
    points: NDArray[np.float64],
    view: Sequence[float],
    up: Sequence[float],
    flat: bool,
) -> None:
    """Turn the camera so that the points fill the stage."""
    import pyvista

    if flat:
        plotter.enable_parallel_projection()
    plotter.view_vector(view, viewup=up)
    camera, aspect = plotter.camera, plotter.renderer.GetTiledAspectRatio()
    projection = pyvista.array_from_vtkmatrix(camera.GetCompositeProjectionTransformMatrix(aspect, -1.0, 1.0))
    projected = np.c_[points, np.ones(len(points))] @ projection.T
    seen = projected[:, :2] / projected[:, 3:]  # the stage is the square from -1 to 1
    zoom = 1.8 / np.ptp(seen, axis=0).max()
    camera.zoom(zoom)
    camera.SetWindowCenter(*(zoom * (seen.min(axis=0) + seen.max(axis=0)) / 2.0))


def _corners(box: Sequence[float]) -> NDArray[np.float64]:
    return np.stack(np.meshgrid(*np.reshape(box, (3, 2))), axis=-1).reshape(-1, 3)
