"""Surfaces of rigid tools, for pictures (pyvista)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import ufl
from dolfinx import default_scalar_type, fem, plot
from dolfinx.mesh import CellType, create_unit_cube, create_unit_square
from mpi4py import MPI
from numpy.typing import ArrayLike, NDArray

from cutsim.base.arrays import Array
from cutsim.base.compat import nodal_expression
from cutsim.results.grids import library
from cutsim.tools.insertable import Insertable
from cutsim.tools.pointed import Pointed
from cutsim.tools.rigid_tool import RigidTool
from cutsim.tools.tool_contact import ToolContact
from cutsim.tools.triangulated_tool import TriangulatedTool

if TYPE_CHECKING:
    import pyvista

# how far a tool is seen beyond the body: a part of the largest extent of the body; for a blade or needle, of the extent
# along its push, and of that along its edge
_BEYOND, _ABOVE, _BESIDE = 0.15, 0.3, 0.05
# cells along an edge of the grid on which a signed distance is sampled, by dimension
_SAMPLES = {2: 240, 3: 56}
# part of the grid by which a node on its outside may be off
_SLIVER = 1e-9


def prism(
    outline: NDArray[np.float64],
    origin: ArrayLike,
    axes: tuple[ArrayLike, ArrayLike],
    edge: ArrayLike | None = None,
) -> pyvista.PolyData | None:
    """A tool of constant cross-section, for `cutsim.results.pictures.draw_body`.

    Args:
        outline: Cross-section, rows of two coordinates along the axes.
        origin: Where the outline has its origin; two or three coordinates.
        axes: Directions of the two coordinates.
        edge: From one end of the tool to the other; None for a flat picture.

    Returns:
        The surface, None where pyvista is missing.
    """
    pyvista = library("no tool is drawn")
    if pyvista is None:
        return None
    first, second, start = map(_padded, (*axes, origin))
    points = start + outline[:, :1] * first + outline[:, 1:] * second
    face = pyvista.PolyData(points, faces=[len(points), *range(len(points))])
    return face if edge is None else face.extrude(np.asarray(edge, dtype=float), capping=True)


def revolved(
    outline: NDArray[np.float64],
    origin: ArrayLike,
    axes: tuple[ArrayLike, ArrayLike],
    points: int = 48,
    turn: tuple[float, float] = (0.0, 2 * np.pi),
) -> pyvista.PolyData | None:
    """A tool of revolution in space, for `cutsim.results.pictures.draw_body`.

    Args:
        outline: Its section through the axis, rows of two coordinates; the second is along the axis of revolution.
        origin: Where the outline has its origin; three coordinates.
        axes: Directions of the two coordinates, orthogonal unit vectors.
        points: Points on a circle.
        turn: Angles about the axis between which the tool lies, from the first of the directions on [rad].

    Returns:
        The surface, None where pyvista is missing.
    """
    pyvista = library("no tool is drawn")
    if pyvista is None:
        return None
    across, along = outline[outline[:, 0] >= 0].T
    first, axis = (np.asarray(v, dtype=float) for v in axes)
    angles = np.linspace(*turn, points)[:, None]
    directions = np.cos(angles) * first + np.sin(angles) * np.cross(axis, first)
    x = np.asarray(origin) + across[:, None, None] * directions + along[:, None, None] * axis
    return pyvista.StructuredGrid(*np.moveaxis(x, -1, 0)[..., None]).extract_surface(algorithm="dataset_surface")


@dataclass(frozen=True)
class Pose:
    """Where a tool is, in three dimensions.

    Attributes:
        position: Position of its reference point [length].
        rotation: Rotation from its frame, a matrix.
    """

    position: Array
    rotation: Array

    @classmethod
    def of(cls, tool: RigidTool) -> Pose:
        """Present pose of a tool."""
        rotation, gdim = np.eye(3), len(tool.position.value)
        rotation[:gdim, :gdim] = tool.rotation.value
        return cls(_padded(tool.position.value), rotation)

    def within(self, points: Array) -> Array:
        """Points in the frame of the tool."""
        return np.asarray((points - self.position) @ self.rotation)

    def placed(self, surface: pyvista.PolyData) -> pyvista.PolyData:
        """A surface that is given in the frame of the tool."""
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = self.rotation, self.position
        return surface.transform(matrix, inplace=False)


class ToolSurfaces:
    """Surfaces of the rigid tools of a problem where they are at the time, as far as they are near the body.

    Blades and conical needles are drawn from their outline, triangulations as they are, and every other shape from its
    signed distance.

    Args:
        terms: Terms of the problem; those that are no tools are left out.
    """

    def __init__(self, terms: Iterable[Any]) -> None:
        self._pointed: list[tuple[Pointed, RigidTool]] = []
        self._others: list[Callable[[Array], Any]] = []
        for tool in terms:
            if isinstance(tool, TriangulatedTool):
                self._others.append(_Triangulated(tool))
            elif isinstance(tool, ToolContact) and isinstance(tool.shape, Pointed):
                self._pointed.append((tool.shape, tool))
            elif isinstance(tool, ToolContact) and getattr(tool.shape, "side", 0) >= 0:  # two halves are drawn as one
                self._others.append(_Level(tool))

    def __call__(self, bounds: Sequence[float]) -> pyvista.PolyData | None:
        """The tools in triangles; None if there are none.

        Args:
            bounds: Box around the deformed body, (xmin, xmax, ymin, ymax, zmin, zmax) [length].
        """
        box = np.reshape(bounds, (3, 2)).T
        parts = [_pointed(shape, pose, box) for shape, pose in self._together()]
        parts += [surface(box) for surface in self._others]
        parts = [part.triangulate() for part in parts if part.n_cells]
        return parts[0].append_polydata(*parts[1:]) if parts else None

    def _together(self) -> Iterable[tuple[Pointed, Pose]]:
        """Blades and needles by their pose; what meets several parts of a crack is one, and so are two halves."""
        found: dict[bytes, tuple[Pointed, Pose]] = {}
        for shape, tool in self._pointed:
            pose = Pose.of(tool)
            place = pose.position.tobytes() + pose.rotation.tobytes()
            other, _ = found.setdefault(place, (shape, pose))
            if other.side != shape.side:
                found[place] = replace(shape, side=0), pose  # type: ignore[type-var]
        return found.values()


def _pointed(shape: Pointed, pose: Pose, box: Array) -> Any:
    """A blade or needle, or half of it, from its tip to above the lowest and highest corner of a box."""
    push, flat = _padded(shape.push), len(shape.push) == 2
    across = np.eye(3)[2 if flat else int(np.abs(push).argmin())]
    lateral = np.cross(across, push) if shape.lateral is None else _padded(shape.lateral)
    lateral = lateral / np.linalg.norm(lateral)
    edge = np.cross(push, lateral)
    arms = pose.within(np.stack(np.meshgrid(*box.T), axis=-1).reshape(-1, 3))
    (foot, top), (low, high) = ((np.min(arms @ e), np.max(arms @ e)) for e in (-push, edge))
    outline = shape.outline(max(top + _ABOVE * (top - foot), shape.tip_radius))
    if shape.round and not flat:
        turn = (-np.pi / 2, np.pi / 2) if shape.side else (0.0, 2 * np.pi)
        return pose.placed(revolved(outline, np.zeros(3), ((shape.side or 1) * lateral, -push), turn=turn))
    if shape.side:
        half, top = outline[shape.side * outline[:, 0] >= 0], outline[:, 1].max()  # it goes from the tip to the right
        outline = np.insert(half, len(half) if shape.side > 0 else 1, [0.0, top], axis=0)
    if flat:
        return pose.placed(prism(outline, np.zeros(3), (lateral, -push)))
    beside, given = _BESIDE * (high - low), getattr(shape, "edge_length", None)
    ends = (low - beside, high + beside) if given is None else (-0.5 * given, 0.5 * given)
    return pose.placed(prism(outline, ends[0] * edge, (lateral, -push), (ends[1] - ends[0]) * edge))


class _Level:
    """A tool of any shape within a box, from the signed distance at the nodes of a regular grid."""

    def __init__(self, tool: ToolContact) -> None:
        self._tool, gdim = tool, len(tool.position.value)
        n, comm = _SAMPLES[gdim], MPI.COMM_SELF
        domain = (
            create_unit_square(comm, n, n, CellType.quadrilateral)
            if gdim == 2
            else create_unit_cube(comm, n, n, n, CellType.hexahedron)
        )
        self._corner, self._size = (fem.Constant(domain, np.zeros(gdim, default_scalar_type)) for _ in range(2))
        self._rotation = fem.Constant(domain, np.eye(gdim, dtype=default_scalar_type))
        x = ufl.SpatialCoordinate(domain)
        place = ufl.transpose(self._rotation) * ufl.as_vector(
            [self._corner[i] + self._size[i] * x[i] for i in range(gdim)]
        )
        self._distance = fem.Function(fem.functionspace(domain, ("Lagrange", 1)))
        shape = replace(tool.shape, side=0) if isinstance(tool.shape, Insertable) else tool.shape  # type: ignore[type-var]
        self._expression = nodal_expression(shape.distance(place), self._distance.function_space)

    def __call__(self, box: Array) -> Any:
        pyvista, position = library("no tool is drawn"), self._tool.position.value
        gdim = len(position)
        box = box + _BEYOND * np.ptp(box, axis=0).max() * np.array([[-1.0], [1.0]])
        size = np.ptp(box, axis=0)
        self._corner.value[:], self._size.value[:] = box[0, :gdim] - position, size[:gdim]
        self._rotation.value[:] = self._tool.rotation.value
        self._distance.interpolate(self._expression)
        cells, kinds, points = plot.vtk_mesh(self._distance.function_space)
        flat = np.arange(3) >= gdim
        grid = pyvista.UnstructuredGrid(cells, kinds, np.where(flat, 0.0, box[0]) + points * np.where(flat, 0.0, size))
        if gdim == 2:
            grid["distance"] = self._distance.x.array
            return grid.clip_scalar(scalars="distance", value=0.0).extract_surface(algorithm="dataset_surface")
        # a clip leaves cells without volume, at which VTK crashes; a level does not, and here it is closed at the box
        outer = np.any((points < _SLIVER) | (points > 1 - _SLIVER), axis=1)
        grid["distance"] = np.where(outer, np.maximum(self._distance.x.array, size.max()), self._distance.x.array)
        return grid.contour([0.0], scalars="distance")


class _Triangulated:
    """A tool of triangles, or in the plane of segments, which are filled."""

    def __init__(self, tool: TriangulatedTool) -> None:
        self._tool, surface = tool, tool.surface
        pyvista = library("no tool is drawn")
        facets = np.insert(surface.facets, 0, surface.facets.shape[1], axis=1).ravel()
        points = np.pad(surface.points, ((0, 0), (0, 3 - surface.points.shape[1])))
        if surface.points.shape[1] == 3:
            self._mesh = pyvista.PolyData(points, faces=facets)
        else:
            loops = pyvista.PolyData(points, lines=facets).strip()
            self._mesh = pyvista.PolyData(loops.points, faces=_closed(loops.lines))

    def __call__(self, box: Array) -> Any:
        return Pose.of(self._tool).placed(self._mesh)


def front(terms: Iterable[Any]) -> dict[str, tuple[float, ...]]:
    """Directions that point to the right and up where a body in space is looked at from the front.

    A tool that is pushed comes from above; its flanks and the crack between them are seen from the side.

    Args:
        terms: Terms of the problem.

    Returns:
        "right" and "up"; nothing if no tool tells.
    """
    for tool in terms:
        push = getattr(tool.shape, "push", None) if isinstance(tool, ToolContact) else None
        if push is not None:
            right = getattr(tool.shape, "normal", None) or np.cross(push, np.eye(3)[int(np.abs(push).argmin())])
            right, push = (tool.rotation.value @ np.asarray(v) for v in (right, push))
            return {"right": tuple(map(float, right)), "up": tuple(-float(p) for p in push)}
    return {}


def _closed(lines: NDArray[np.int64]) -> list[int]:
    """Polygons, without repeated point, from closed lines in VTK's form."""
    faces, start = list[int](), 0
    while start < len(lines):
        count = int(lines[start])
        faces += [count - 1, *map(int, lines[start + 1 : start + count])]
        start += count + 1
    return faces


def _padded(vector: ArrayLike) -> Array:
    values = np.asarray(vector, dtype=float)
    return np.pad(values, (0, 3 - len(values)))
