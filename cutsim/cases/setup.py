"""Picture of a set-up: the meshed bodies, cracks, tools where they begin, and what is held."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import numpy as np
from dolfinx import fem
from matplotlib.colors import ListedColormap

from cutsim.analysis.mechanics import Mechanics
from cutsim.base.arrays import Array
from cutsim.base.terms import Bonded, offering
from cutsim.base.units import Units
from cutsim.bodies.loads import Support
from cutsim.bodies.solid import Solid
from cutsim.results.grids import gather_facets, gather_grid
from cutsim.results.pictures import ASIDE, part_colours
from cutsim.results.scene import Scene, View, sharp_edges
from cutsim.results.sheet import SCENE, SIZE, Bar, compose
from cutsim.results.tool_surfaces import ToolSurfaces

logger = logging.getLogger(__name__)

_PIXELS_PER_INCH = 200
# colours of cracks and of what is held, those with different names told apart as far as there are enough
_CRACKS = ("#c4302b", "#7a0177")
_HELD = ("#08519c", "#238b45", "#d95f0e", "#6a51a3", "#525252")


def draw_setup(path: Path | str, mechanics: Mechanics, units: Units) -> None:
    """Draw a problem as it begins: bodies with their meshes, cracks, tools, and the nodes that are held. Collective.

    A picture is an extra: what prevents it is logged as a warning.

    Args:
        path: The PNG, PDF or SVG; folders are made.
        mechanics: The problem.
        units: Units of lengths.
    """
    state, solids = mechanics.state, offering(mechanics.terms, Solid)
    part = fem.Function(fem.functionspace(state.mesh, ("DG", 0)))
    for number, solid in enumerate(solids):
        cells = slice(None) if solid.cells is None else solid.cells
        part.x.array[part.function_space.dofmap.list[cells, 0]] = number
    # first order: its cells are drawn with their edges
    place = fem.Function(fem.functionspace(state.mesh, ("Lagrange", 1, (state.mesh.geometry.dim,))))
    grid = gather_grid(place, {"part": part})
    cracks = {
        crack.name: gather_facets(state.u, crack.interior, np.zeros(len(crack.interior)))
        for crack in offering(mechanics.terms, Bonded)
    }
    held = {name: _gathered(support) for name, support in _by_name(mechanics).items()}
    if grid is None:
        return
    try:
        names = [solid.name for solid in solids]
        _draw(path, grid, names, cracks, held, ToolSurfaces(mechanics.terms), units.length)
    except Exception as error:  # a picture is never worth a run
        logger.warning("%s was not drawn: %s", path, error)


def _by_name(mechanics: Mechanics) -> dict[str, list[Support]]:
    """Supports, those of one name with their components together."""
    found: dict[str, list[Support]] = {}
    for support in mechanics.supports:
        name = (support.name or "").removesuffix("_x").removesuffix("_y").removesuffix("_z")
        found.setdefault(name, []).append(support)
    return found


def _gathered(supports: list[Support]) -> Array:
    """Nodes that are held, on the first rank; none elsewhere. Collective."""
    state = supports[0].state
    nodes = np.unique(np.concatenate([support.nodes for support in supports]))
    owned = nodes[nodes < state.V.dofmap.index_map.size_local]
    parts = state.mesh.comm.gather(state.V.tabulate_dof_coordinates()[owned])
    return np.zeros((0, 3)) if parts is None else np.concatenate(parts)


def _draw(
    path: Path | str,
    grid: Any,
    names: list[str],
    cracks: dict[str, Any],
    held: dict[str, Array],
    surfaces: ToolSurfaces,
    length: str,
) -> None:
    flat = not np.ptp(grid.points[:, 2])
    surface = grid.extract_surface(algorithm="dataset_surface")
    legend = {name: part_colours(len(names))(i) for i, name in enumerate(names)}
    tool = surfaces(grid.bounds)
    with Scene((round(SIZE[0] * _PIXELS_PER_INCH), round(SCENE * SIZE[1] * _PIXELS_PER_INCH)), flat=flat) as scene:
        scene.add_body(surface, "part", part_colours(len(names)), (-0.5, len(names) - 0.5), edges=True)
        scene.add_lines(sharp_edges(surface))
        for i, (name, faces) in enumerate(cracks.items()):
            legend[name] = _CRACKS[i % len(_CRACKS)]
            scene.add_faces(faces, _CRACKS[i % len(_CRACKS)])
        for i, (name, points) in enumerate(held.items()):
            legend[f"held: {name}" if name else "held"] = _HELD[i % len(_HELD)]
            scene.add_marks(points, _HELD[i % len(_HELD)])
        if tool is not None:
            scene.add_tool(tool)
        shown = np.vstack([grid.points, *([] if tool is None else [tool.points])])
        pixels, width = scene.shot(View(shown, (0.0, 0.0, 1.0) if flat else ASIDE, (0.0, 1.0, 0.0)))
    bar = Bar("", ListedColormap(list(legend.values())), (-0.5, len(legend) - 0.5), list(legend))
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    compose(pixels, width, [bar], title="", length=length).savefig(path)
