"""Picture of a problem before it is run: bodies, cracks, tools, supports and loads by their names."""

from __future__ import annotations

import logging
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from dolfinx import fem
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from numpy.typing import NDArray

from cutsim.analysis.steps import Problem
from cutsim.base.arrays import Array
from cutsim.base.signatures import checked
from cutsim.base.terms import Bonded, Joining, offering
from cutsim.base.units import Units
from cutsim.bodies.loads import Support, SurfaceLoad
from cutsim.bodies.nodal_loads import NodalLoad
from cutsim.bodies.rigid_link import RigidLink
from cutsim.bodies.solid import Solid
from cutsim.fields.space import locate_dofs
from cutsim.fields.state import State
from cutsim.results.grids import gather_facets, gather_grid, part_numbers
from cutsim.results.pictures import part_colours, part_entries, pixels_per_inch, save
from cutsim.results.plots import distinct
from cutsim.results.scene import TOOL, Scene, View, sharp_edges
from cutsim.results.sheet import SCENE, SIZE, Entry, compose
from cutsim.results.tool_surfaces import ToolSurfaces, front

if TYPE_CHECKING:
    import pyvista

logger = logging.getLogger(__name__)

# diameter of the largest mark of a node [pixels]; where several are on one node, later ones are smaller
_MARK, _SMALLER = 15.0, 3.0


@checked
def draw_setup(
    path: Path | str, problem: Problem, supports: Sequence[Support], units: Units | None = None, title: str = ""
) -> None:
    """Draw a problem before deformation: mesh and bodies, cracks, tools, and where it is held and loaded. Collective.

    Args:
        path: The PNG of 1600 × 1000 pixels, PDF or SVG; folders are made.
        problem: The problem.
        supports: What holds it.
        units: Units of the numbers.
        title: Text above the picture.
    """
    state, solids = problem.state, offering(problem.terms, Solid)
    # of first order: its cells are drawn with their edges
    place = fem.Function(fem.functionspace(state.mesh, ("Lagrange", 1, (state.mesh.geometry.dim,))))
    grid = gather_grid(place, {"part": part_numbers(state, solids)})
    cracks = {
        crack.name: gather_facets(state.u, crack.facets, np.zeros(len(crack.facets)))
        for crack in offering(problem.terms, Bonded)
    }
    marks = {name: _gathered(state, nodes) for name, nodes in _marked(problem, supports).items()}
    if grid is None:
        return
    try:
        tools = ToolSurfaces(problem.terms)(grid.bounds)
        directions = front(problem.terms) if state.mesh.geometry.dim == 3 else {}
        setup = _Setup(grid, [solid.name for solid in solids], cracks, marks, tools)
        save(setup.figure(directions, units or Units(), title, pixels_per_inch(path)), path)
    except Exception as error:  # a picture is never worth a run
        logger.warning("%s was not drawn: %s", path, error)


@dataclass(frozen=True)
class _Setup:
    """What a picture of a problem shows, all of it on one rank."""

    grid: pyvista.UnstructuredGrid
    parts: Sequence[str]
    cracks: dict[str, pyvista.UnstructuredGrid]
    marks: dict[str, Array]
    tools: pyvista.PolyData | None

    def figure(self, directions: dict[str, tuple[float, ...]], units: Units, title: str, dpi: int) -> Figure:
        """The picture."""
        width, height = (round(dpi * inch) for inch in SIZE)
        flat = not np.ptp(self.grid.points[:, 2])
        entries = part_entries(self.parts)
        with Scene((width, round(SCENE * height)), flat=flat) as scene:
            self._add_body(scene, flat)
            colours = iter(distinct(len(self.cracks) + len(self.marks) + 1)[1:])  # the first is near that of the body
            for (name, faces), colour in zip(self.cracks.items(), colours, strict=False):
                scene.add_faces(faces, colour)
                entries.append(Entry(name, colour, "line" if flat else "area"))
            for index, ((name, nodes), colour) in enumerate(zip(self.marks.items(), colours, strict=True)):
                scene.add_nodes(nodes, colour, max(_MARK - _SMALLER * index, _SMALLER))
                entries.append(Entry(name, colour, "point"))
            if self.tools is not None:
                scene.add_tool(self.tools)
                entries.append(Entry("tool", TOOL))
            pixels, seen = scene.shot(self._view(directions, flat))
        return compose(pixels, seen, [], entries, title=title, length=units.length)

    def _add_body(self, scene: Scene, flat: bool) -> None:
        surface = self.grid.extract_surface(algorithm="dataset_surface")
        colours, count = ListedColormap(part_colours(len(self.parts))), len(self.parts)
        hides = bool(self.cracks) and not flat  # cracks are inside
        scene.add_body(surface, "part", colours, (-0.5, count - 0.5), edges=True, opacity=0.45 if hides else 1.0)
        scene.add_lines(sharp_edges(surface))

    def _view(self, directions: dict[str, tuple[float, ...]], flat: bool) -> View:
        shown = np.vstack([mesh.points for mesh in (self.grid, self.tools) if mesh is not None])
        return View.of(shown, directions.get("right", (1, 0, 0)), directions.get("up", (0, 1, 0)), flat=flat)


def _marked(problem: Problem, supports: Sequence[Support]) -> dict[str, NDArray[np.int32]]:
    """Local nodes by what is done to them, in words; the same names on all ranks."""
    found: dict[str, NDArray[np.int32]] = {}
    for name, nodes in (*_held(supports), *_loaded(problem)):
        found[name] = np.union1d(found.get(name, nodes), nodes).astype(np.int32)
    return found


def _held(supports: Iterable[Support]) -> Iterator[tuple[str, NDArray[np.int32]]]:
    """Nodes of supports; those of one name for each component are together."""
    found: dict[str, list[Support]] = {}
    for support in supports:
        found.setdefault(re.sub("_[xyz]$", "", support.name or f"held: {_symbol(support)}"), []).append(support)
    for name, alike in found.items():
        symbols = ", ".join(_symbol(support) for support in alike)
        nodes = np.concatenate([support.nodes for support in alike])
        yield f"{name}: {symbols}" if alike[0].name else name, nodes


def _symbol(support: Support) -> str:
    return support.symbol if support.component is None else f"${support.symbol}$"


def _loaded(problem: Problem) -> Iterator[tuple[str, NDArray[np.int32]]]:
    V = problem.state.V
    for term in problem.terms:
        if isinstance(term, SurfaceLoad | NodalLoad):
            yield term.name, term.nodes
        elif isinstance(term, RigidLink):
            yield f"{term.name}: rigid", term.nodes
        elif isinstance(term, Joining):
            for facets, side in zip(term.facets, ("slave", "master"), strict=False):
                yield f"{term.name}: {side}", locate_dofs(V, problem.state.mesh.topology.dim - 1, facets)


def _gathered(state: State, nodes: NDArray[np.int32]) -> Array:
    """Positions of the owned ones of some local nodes on the first rank. Collective."""
    places = state.V.tabulate_dof_coordinates()[nodes[nodes < state.V.dofmap.index_map.size_local]]
    return np.concatenate(state.mesh.comm.gather(places) or [places])
