"""Stages of a run: light snapshots of the deformed body, from which pictures, animation and views are drawn later."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from cutsim.base.files import replace_file
from cutsim.base.units import Units
from cutsim.results.folder import STAGES

if TYPE_CHECKING:
    import pyvista

Floats = NDArray[np.float32]

# distance from a plane of symmetry that is none, over the size of the body
_FLAT = 1e-6
# part of the width of a tool that is little, such as the clearance of half a blade
_LITTLE = 0.1
# what a stage consists of
_SKINS = ("body", "cracks", "tools")
_ABOUT = ("time", "parts", "flat", "right", "up", "mirror")


@dataclass(frozen=True)
class Skin:
    """Part of a stage: a surface in space, or what fills a plane, or lines.

    Attributes:
        points: Its nodes before deformation, shape (nodes, 3) [length].
        displacement: Their displacements, of the same shape [length].
        cells: Nodes of each triangle or line, shape (cells, 3 or 2).
        values: Name → one value per node or per cell.
    """

    points: Floats
    displacement: Floats
    cells: NDArray[np.int32]
    values: Mapping[str, Floats] = field(default_factory=dict)

    @property
    def deformed(self) -> Floats:
        """Present positions of the nodes [length]."""
        return self.points + self.displacement

    @classmethod
    def of(cls, mesh: pyvista.PolyData, at_nodes: Iterable[str] = (), in_cells: Iterable[str] = ()) -> Self:
        """Triangles, or lines, of a mesh, with its displacement ``u`` and the values that are named."""
        mesh = mesh if mesh.n_lines else mesh.triangulate()
        cells = mesh.lines.reshape(-1, 3)[:, 1:] if mesh.n_lines else mesh.regular_faces
        u = mesh.point_data.get("u", np.zeros_like(mesh.points))
        values = {name: _floats(mesh.point_data[name]) for name in at_nodes}
        values |= {name: _floats(mesh.cell_data[name]) for name in in_cells}
        return cls(_floats(mesh.points), _floats(u), np.asarray(cells, np.int32), values)

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """Parts as one; without any, one that is empty."""
        if not parts:
            none = np.zeros((0, 3), np.float32)
            return cls(none, none, np.zeros((0, 3), np.int32))
        starts = np.cumsum([0, *(len(part.points) for part in parts[:-1])])
        return cls(
            np.concatenate([part.points for part in parts]),
            np.concatenate([part.displacement for part in parts]),
            np.concatenate([part.cells + start for part, start in zip(parts, starts, strict=True)]).astype(np.int32),
            {name: np.concatenate([part.values[name] for part in parts]) for name in parts[0].values},
        )

    def mirrored(self, plane: str) -> Self:
        """The part joined with its image in a plane through the origin, given by the axis normal to it.

        Triangles in the plane, which are inside the whole, are left out, but for those of a crack that is open there.
        """
        axis, count = "xyz".index(plane), len(self.points)
        off = np.abs([self.points[:, axis], self.displacement[:, axis]]).max(axis=0)
        seam = off <= _FLAT * np.abs(self.points).max(initial=0.0)
        images = np.where(seam, np.arange(count), count - 1 + np.cumsum(~seam))
        inside = seam[self.cells].all(axis=1) & (self.cells.shape[1] == 3)
        cells = self.cells[~inside]
        sign = np.where(np.arange(3) == axis, -1, 1).astype(np.float32)
        values = {name: self._doubled(array, ~seam, ~inside) for name, array in self.values.items()}
        return replace(
            self,
            points=np.vstack([self.points, sign * self.points[~seam]]),
            displacement=np.vstack([self.displacement, sign * self.displacement[~seam]]),
            cells=np.vstack([cells, images[cells][:, ::-1]]).astype(np.int32),
            values=values,
        )

    def beside(self, plane: str) -> bool:
        """Whether the part lies on one side of a plane through the origin, but for a little of it."""
        places = self.deformed[:, "xyz".index(plane)]
        low, high = -places.min(initial=0.0), places.max(initial=0.0)
        return bool(min(low, high) <= _LITTLE * (low + high))

    def _doubled(self, array: Floats, nodes: NDArray[np.bool_], cells: NDArray[np.bool_]) -> Floats:
        """Values of a part and its image, which has some of the nodes; both have some of the cells."""
        return np.r_[array, array[nodes]] if len(array) == len(self.points) else np.tile(array[cells], 2)


@dataclass(frozen=True)
class Stage:
    """State of a run at one time, as it is drawn.

    Attributes:
        time: The time [time].
        body: The outer surface with the faces of cracks, or in a plane all of the body. At its nodes it has "stress",
            that of von Mises; its cells have the number of their "part".
        cracks: Both faces of the cracks that have a law, with the "damage" of their cells.
        tools: Rigid tools.
        parts: Names of the parts of the body.
        units: Units of all numbers.
        flat: Whether the problem is a plane one.
        right: Direction that points to the right where it is looked at from the front.
        up: Direction that points up there.
        mirror: Planes of symmetry through the origin in which body and cracks have their image, by the axes normal to
            them.
    """

    time: float
    body: Skin
    cracks: Skin
    tools: Skin
    parts: tuple[str, ...]
    units: Units
    flat: bool
    right: tuple[float, ...] = (1.0, 0.0, 0.0)
    up: tuple[float, ...] = (0.0, 1.0, 0.0)
    mirror: tuple[str, ...] = ()

    def whole(self) -> Self:
        """The stage with the images of body and cracks in the planes of symmetry, and of tools on one side of them."""
        stage = replace(self, mirror=())
        for plane in self.mirror:
            tools = stage.tools.mirrored(plane) if stage.tools.beside(plane) else stage.tools
            stage = replace(stage, body=stage.body.mirrored(plane), cracks=stage.cracks.mirrored(plane), tools=tools)
        return stage

    def write(self, path: Path) -> None:
        """Write the stage as arrays of numpy, in one go."""
        about = {name: getattr(self, name) for name in _ABOUT} | {"units": asdict(self.units)}
        arrays: dict[str, Any] = {"about": json.dumps(about)}
        for name in _SKINS:
            skin: Skin = getattr(self, name)
            arrays |= {f"{name}.points": skin.points, f"{name}.displacement": skin.displacement}
            arrays |= {f"{name}.cells": skin.cells}
            arrays |= {f"{name}.values.{key}": values for key, values in skin.values.items()}
        data = BytesIO()
        np.savez_compressed(data, **arrays)
        replace_file(path, data.getvalue())

    @classmethod
    def read(cls, path: Path | str) -> Self:
        """Read a stage.

        Raises:
            ValueError: The file is not that of a stage.
        """
        try:
            with np.load(path, allow_pickle=False) as file:
                arrays = dict(file)
            about = json.loads(str(arrays.pop("about")))
            about = {name: tuple(value) if isinstance(value, list) else value for name, value in about.items()}
            about |= {name: _skin(arrays, name) for name in _SKINS} | {"units": Units(**about["units"])}
            return cls(**about)
        except Exception as error:  # whatever numpy finds wrong with a file
            raise ValueError(f"{path} is not a stage of a run: {error}") from error


def _skin(arrays: Mapping[str, NDArray[Any]], name: str) -> Skin:
    start = f"{name}.values."
    values = {key.removeprefix(start): array for key, array in arrays.items() if key.startswith(start)}
    return Skin(arrays[f"{name}.points"], arrays[f"{name}.displacement"], arrays[f"{name}.cells"], values)


def _floats(values: Any) -> Floats:
    return np.asarray(values, np.float32)


def read_stages(folder: Path | str) -> list[Stage]:
    """Stages of a run in the order of their times; files that cannot be read are left out.

    Args:
        folder: Folder of the run.
    """
    found = {}
    for path in sorted((Path(folder) / STAGES).glob("*.npz")):
        try:
            stage = Stage.read(path)
        except ValueError:
            continue
        found[stage.time] = stage
    return [found[time] for time in sorted(found)]


def spread(stages: Sequence[Stage], number: int) -> list[Stage]:
    """Some stages whose times are evenly spread, the last one among them, in the order of time.

    Args:
        stages: All stages, in this order.
        number: How many there are at most.
    """
    if not stages:
        return []
    times = np.array([stage.time for stage in stages])
    wanted = times[-1] * np.arange(1, number + 1) / number
    return [stages[i] for i in sorted({int(np.abs(times - time).argmin()) for time in wanted})]
