"""Pictures of a run: the deformed and cut body with its tools (pyvista, off screen, framed by matplotlib).

Pictures are extras: where pyvista is missing or cannot draw, that is logged as a warning and the run goes on. A path
that ends in ``.pdf`` or ``.svg`` gets text and bars as vectors and the body as an image of double resolution. With
matplotlib's ``savefig.transparent`` the ground is transparent.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from numpy.typing import NDArray

from cutsim.base.checks import require
from cutsim.base.signatures import checked
from cutsim.bodies.solid import Solid
from cutsim.interface.crack import Crack
from cutsim.results.grids import VonMises, gather_facets, gather_grid
from cutsim.results.scene import DAMAGE, STRESS, Scene, View, corners, sharp_edges
from cutsim.results.sheet import SCENE, SIZE, Bar, Entry, compose
from cutsim.results.stages import Skin, Stage

if TYPE_CHECKING:
    import pyvista

logger = logging.getLogger(__name__)

#: Colours of the parts of a body; more of them are told apart by a ramp.
PARTS = ("#9ecae1", "#fdd0a2", "#c7e9c0", "#dadaeb", "#f7c6c7", "#e2d3b5", "#c2e5e5", "#e6e6a8")

# damage below which a crack counts as intact
_INTACT = 1e-3
# pixels per inch
_FINE = 200


@dataclass(frozen=True)
class _Content:
    """What a picture shows, all of it deformed."""

    body: pyvista.PolyData
    scalars: str
    bar: Bar
    lines: pyvista.DataSet
    crack: pyvista.DataSet | None
    tool: pyvista.PolyData | None
    flat: bool
    edges: bool = False
    names: Sequence[str] = ()

    def figure(self, view: View, *, title: str, length: str, dpi: int) -> Figure:
        """The picture."""
        width, height = (round(dpi * inch) for inch in SIZE)
        bars = [] if self.names else [self.bar]
        with Scene((width, round(SCENE * height)), flat=self.flat) as scene:
            scene.add_body(self.body, self.scalars, self.bar.colours, self.bar.limits, edges=self.edges)
            scene.add_lines(self.lines)
            if self.crack is not None and self.crack.n_cells:
                scene.add_crack(self.crack)
                if not self.names and self.crack["damage"].max() > _INTACT:
                    bars.append(Bar("damage of the crack", DAMAGE, (0.0, 1.0)))
            if self.tool is not None:
                scene.add_tool(self.tool)
            pixels, seen = scene.shot(view)
        return compose(pixels, seen, bars, part_entries(self.names), title=title, length=length)


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
    names: Sequence[str] = (),
    length: str = "mm",
) -> None:
    """Draw the deformed body coloured by a field. Call it on all ranks with what `gather_grid` gave them.

    There is no perspective, so that the scale holds all over the picture; a flat grid is seen from the front. The bar
    of damage is left out where nothing is damaged.

    Args:
        path: The PNG of 1600 × 1000 pixels, PDF or SVG; folders are made.
        grid: The body; where it is None nothing is drawn.
        scalars: Name of the cell field that colours the body; it is averaged to the nodes.
        label: Text at the colour bar, with the unit; mathematics of TeX is set.
        title: Text above the picture.
        tool: Rigid tool at its current place.
        crack: Crack facets from `gather_facets`, coloured by damage.
        mirror: Planes of symmetry through the origin, by the axis normal to them ("x", "y", "z"): body and crack are
            shown whole.
        clip: Normal and a point of a plane; cells whose middle lies beyond it before deformation are left out.
        view: Direction from the body to the eye.
        up: Direction that points up in the picture.
        window: Box (xmin, xmax, ymin, ymax, zmin, zmax) that is to fill the picture; the body by default.
        limits: Range of the colours; by default the field without its most extreme percent at either end.
        names: Names of the values 0, 1, … of a field that has these only, such as the number of a layer: they are told
            apart by a legend in place of a bar.
        length: Symbol of the unit of length, for the scale.

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
        surface, linear = _surface(body, averaged=not names), bool(body.celltypes.max() < 15)  # VTK's first order
        bar = Bar(label, STRESS, limits or _range(body.cell_data[scalars]))
        if names:
            bar = Bar("", ListedColormap(part_colours(len(names))), (-0.5, len(names) - 0.5))
        content = _Content(
            surface, scalars, bar, sharp_edges(surface, mirror),
            None if crack is None else _deformed(crack, mirror, clip), tool, flat, edges=linear, names=names,
        )  # fmt: skip
        shown = corners(window) if window else np.vstack([mesh.points for mesh in (body, tool) if mesh])
        fine = pixels_per_inch(path)
        figure = content.figure(
            View(shown, (0.0, 0.0, 1.0) if flat else view, up), title=title, length=length, dpi=fine
        )
        save(figure, path)
    except Exception as error:  # a picture is never worth a run
        logger.warning("%s was not drawn: %s", path, error)


@dataclass(frozen=True)
class Look:
    """How the stages of one run are drawn: all of them in one frame and with one range of colours.

    Attributes:
        shown: Points that are to be seen in all pictures [length].
        limits: Range of the stress [stress].
    """

    shown: NDArray[np.float64]
    limits: tuple[float, float]

    @classmethod
    def of(cls, stages: Sequence[Stage]) -> Self:
        """The look of some stages, one or more, as `Stage.whole` gives them."""
        boxes = [skin.deformed for stage in stages for skin in (stage.body, stage.tools) if len(skin.points)]
        ends = np.array([(points.min(axis=0), points.max(axis=0)) for points in boxes])
        box = np.stack([ends[:, 0].min(axis=0), ends[:, 1].max(axis=0)], axis=1)
        largest = max(_range(stage.body.values["stress"])[1] for stage in stages)
        return cls(corners(box), (0.0, largest or 1.0))

    def figure(self, stage: Stage, *, title: str = "", dpi: int = _FINE) -> Figure:
        """Picture of a stage, coloured by von Mises' stress and the damage of its cracks.

        Args:
            stage: The stage, as `Stage.whole` gives it.
            title: Text above the picture; by default the time.
            dpi: Pixels per inch; the picture has 8 by 5 inches.
        """
        body = polydata(stage.body)
        tool, crack = (polydata(skin) if len(skin.cells) else None for skin in (stage.tools, stage.cracks))
        bar = Bar(stage.units.label("von Mises stress", "stress"), STRESS, self.limits)
        content = _Content(body, "stress", bar, sharp_edges(body), crack, tool, stage.flat)
        title = title or f"time {stage.time:.4g} {stage.units.time}"
        return content.figure(self._view(stage), title=title, length=stage.units.length, dpi=dpi)

    def _view(self, stage: Stage) -> View:
        return View.of(self.shown, stage.right, stage.up, flat=stage.flat)


def polydata(skin: Skin) -> pyvista.PolyData:
    """A part of a stage as it is deformed.

    Args:
        skin: The part.
    """
    import pyvista

    corners_ = skin.cells.shape[1]
    cells = np.insert(skin.cells, 0, corners_, axis=1).ravel()
    mesh = pyvista.PolyData(skin.deformed, **{"faces" if corners_ == 3 else "lines": cells})
    for name, values in skin.values.items():
        (mesh.cell_data if len(values) == len(skin.cells) and name != "stress" else mesh.point_data)[name] = values
    return mesh


@checked
def draw_stress(path: Path | str, solids: Solid | Sequence[Solid], crack: Crack | None = None, **view: Any) -> None:
    """Draw the deformed body coloured by von Mises' stress, and a crack by its damage. Collective.

    Args:
        path: The PNG of 1600 × 1000 pixels, PDF or SVG; folders are made.
        solids: The body, in one part or several.
        crack: A crack of it with a cohesive law.
        view: Further arguments of `draw_body`; the label is that of stresses in MPa by default.
    """
    solids = [solids] if isinstance(solids, Solid) else solids
    u = solids[0].state.u
    faces = None if crack is None else gather_facets(u, crack.points.facets, crack.facet_mean("damage"))
    grid = gather_grid(u, {"stress": VonMises(solids)()})
    draw_body(path, grid, "stress", crack=faces, **{"label": "von Mises stress [MPa]", **view})


def part_colours(count: int) -> list[Any]:
    """Colours of the parts of a body.

    Args:
        count: Number of parts.
    """
    return list(PARTS[:count]) if count <= len(PARTS) else list(colormaps["YlGnBu"](np.linspace(0.05, 0.95, count)))


def part_entries(names: Sequence[str]) -> list[Entry]:
    """Legend of the parts of a body.

    Args:
        names: Their names.
    """
    return [Entry(name, colour) for name, colour in zip(names, part_colours(len(names)), strict=True)]


def pixels_per_inch(path: Path | str) -> int:
    """Resolution of the body in a picture.

    Args:
        path: The picture.
    """
    return _FINE if Path(path).suffix == ".png" else 2 * _FINE


def save(figure: Figure, path: Path | str) -> None:
    """Save a picture.

    Args:
        figure: The picture.
        path: The file; folders are made.
    """
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path)


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


def _surface(body: pyvista.DataSet, *, averaged: bool) -> pyvista.PolyData:
    """Surface with the cell data at its nodes, or as they are."""
    grid = body.cell_data_to_point_data() if averaged else body
    return grid.extract_surface(algorithm="dataset_surface", nonlinear_subdivision=2)


def _range(values: NDArray[Any]) -> tuple[float, float]:
    """Range of the colours: without the peaks at sharp edges, and from zero if the field begins near it."""
    low, high = np.percentile(values, (1.0, 99.0))
    return float(0.0 if 0.0 <= low < 0.1 * high else low), float(high)
