"""Recording of the stages of a run."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

import numpy as np

from cutsim.analysis.steps import Problem, StepReport
from cutsim.base.checks import count, finite, require, require_number
from cutsim.base.signatures import checked
from cutsim.base.terms import Bonded, FacetShowing, offering
from cutsim.base.units import Units
from cutsim.bodies.solid import Solid
from cutsim.results.checkpoints import ended_together
from cutsim.results.folder import STAGES
from cutsim.results.grids import VonMises, gather_facets, gather_grid, library, part_numbers
from cutsim.results.output import Closing, on_root
from cutsim.results.stages import Skin, Stage
from cutsim.results.tool_surfaces import ToolSurfaces, front

if TYPE_CHECKING:
    import pyvista

logger = logging.getLogger(__name__)

#: Stages of a run by default.
NUMBER = 24
# share of the way to the middle of the cell behind by which the face of a crack is shown in front of that of the body
_NUDGE = 0.02


class Stages(Closing):
    """Recorder of stages: call it after each accepted step, as a recording. Use it as a context manager; collective.

    Writes ``stages/000.npz`` and so on at times that are evenly spread as far as steps allow, and ``stages/last.npz``
    at the end, also if the run fails or is stopped. A run that is resumed goes on with them. They are extras: without
    pyvista there are none, which is said in a warning.

    Args:
        folder: Folder of the run.
        problem: The problem.
        until: Time at which the run ends [time].
        number: About how many stages are written, ≥ 1.
        units: Units of the numbers.
        mirror: Planes of symmetry through the origin in which the body is shown whole, by the axes normal to them; a
            body of revolution is shown with both halves of its section in any case.

    Raises:
        ValueError: A plane of symmetry is unknown.
    """

    @checked
    def __init__(
        self,
        folder: Path | str,
        problem: Problem,
        until: float,
        *,
        number: int = NUMBER,
        units: Units | None = None,
        mirror: Sequence[str] = (),
    ) -> None:
        require_number("number", number, count(1))
        require_number("until", until, finite)
        for plane in mirror:
            require("mirror", plane, plane in ("x", "y", "z"), "x, y or z")
        self._folder, self._until, self._number = Path(folder) / STAGES, until, number
        self._state = problem.state
        self._scene = _Scene(problem, units or Units(), mirror)
        self._written, self._mark = problem.state.time_old, self._marks(problem.state.time_old)
        if not problem.state.number:
            on_root(problem.state.mesh.comm, self._clear)
            self._write("000")

    def __call__(self, report: StepReport) -> None:
        """Write a stage if the step has come to the next time for one. Collective."""
        mark = self._marks(report.time)
        if mark > self._mark:
            self._mark = mark
            self._write(f"{mark:03d}")

    def close(self) -> None:
        """Write the last stage, if it is not written yet. Collective."""
        if self._written != self._state.time_old:
            self._write("last")

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if ended_together(kind):
            self.close()

    def _marks(self, time: float) -> int:
        """Times for a stage that have passed."""
        return int(self._number * time / self._until * (1 + 1e-12))

    def _clear(self) -> None:
        for path in self._folder.glob("*.npz"):
            path.unlink()

    def _write(self, name: str) -> None:
        """Write the present state. Collective."""
        self._written, stage = self._state.time_old, self._scene.stage()
        if self._scene.shown:
            on_root(self._state.mesh.comm, lambda: None if stage is None else stage.write(self._folder / f"{name}.npz"))


class _Scene:
    """What is seen of a problem: its solids, cracks and tools. Collective.

    Attributes:
        shown: Whether there is anything to see, the same on all ranks.
    """

    def __init__(self, problem: Problem, units: Units, mirror: Sequence[str]) -> None:
        state, terms = problem.state, problem.terms
        self._state, self._units, solids = state, units, offering(terms, Solid)
        self._mirror = tuple(dict.fromkeys([*(["x"] if state.axisymmetric else []), *mirror]))
        able = state.mesh.comm.rank > 0 or library("there will be no stages of the run") is not None
        self.shown = bool(solids) and bool(state.mesh.comm.bcast(able))
        if not self.shown:
            return
        self._stress, self._parts = VonMises(solids), tuple(solid.name for solid in solids)
        self._part = part_numbers(state, solids)
        self._cracks = [
            t for t in offering(terms, FacetShowing) if isinstance(t, Bonded) and "damage" in t.facet_fields
        ]
        self._tools = ToolSurfaces(terms) if state.mesh.comm.rank == 0 else None
        self._front = front(terms) if state.mesh.geometry.dim == 3 else {}

    def stage(self) -> Stage | None:
        """The present state, on the first rank; None on the others, and where it cannot be drawn."""
        if not self.shown:
            return None
        u = self._state.u
        grid = gather_grid(u, {"stress": self._stress(), "part": self._part})
        faces = [gather_facets(u, crack.facets, crack.facet_mean("damage")) for crack in self._cracks]
        if grid is None:
            return None
        try:
            return self._drawn(grid, faces)
        except Exception as error:  # a picture is never worth a run
            logger.warning("no stage was written at time %.6g: %s", self._state.time_old, error)
            return None

    def _drawn(self, grid: pyvista.UnstructuredGrid, faces: Sequence[pyvista.UnstructuredGrid]) -> Stage:
        body = grid.cell_data_to_point_data(pass_cell_data=True)
        body = body.extract_surface(algorithm="dataset_surface", nonlinear_subdivision=1)
        assert self._tools is not None
        tools = self._tools(self._bounds(grid))
        cracks = [
            Skin.of(_nudged(face).extract_surface(algorithm=None), in_cells=["damage"])
            for face in faces
            if face.n_cells
        ]
        return Stage(
            self._state.time_old,
            Skin.of(body, ["stress"], ["part"]),
            Skin.joined(cracks),
            Skin.joined([] if tools is None else [Skin.of(tools)]),
            self._parts,
            self._units,
            flat=self._state.mesh.geometry.dim == 2,
            **self._front,
            mirror=self._mirror,
        )

    def _bounds(self, grid: pyvista.UnstructuredGrid) -> list[float]:
        """Box around the whole deformed body."""
        box = np.reshape(grid.warp_by_vector("u").bounds, (3, 2))
        for axis in ("xyz".index(plane) for plane in self._mirror):
            box[axis] = np.abs(box[axis]).max() * np.array([-1.0, 1.0])
        return [float(end) for end in box.ravel()]


def _nudged(faces: pyvista.UnstructuredGrid) -> pyvista.UnstructuredGrid:
    """Faces of a crack, each a little in front of the face of the body that is in the same place."""
    corners = faces.cells.reshape(faces.n_cells, -1)[:, 1:]
    ahead = faces.points[corners].mean(axis=1) - faces.cell_data["middle"]
    faces = faces.copy()
    faces.points[corners.ravel()] += _NUDGE * np.repeat(ahead, corners.shape[1], axis=0)
    return faces
