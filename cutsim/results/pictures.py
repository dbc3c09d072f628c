"""Pictures of a run: the deformed and cut body with the tool (pyvista, off screen).

Pictures are extras: where pyvista is missing or cannot draw, that is logged as a warning and the run goes on.
"""

from __future__ import annotations

import ctypes
import logging
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cutsim.base.checks import require
from cutsim.bodies.solid import Solid
from cutsim.interface.crack import Crack
from cutsim.results.grids import VonMises, gather_facets, gather_grid

if TYPE_CHECKING:
    import pyvista

logger = logging.getLogger(__name__)


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
    grid = gather_grid(u, {"stress": VonMises(solids)()})
    draw_body(path, grid, "stress", crack=faces, **{"label": "von Mises stress [MPa]", **view})


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
