"""Scenes: bodies, cracks and tools seen from a direction without perspective (pyvista, off screen)."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from matplotlib.colors import Colormap, LinearSegmentedColormap
from numpy.typing import ArrayLike, NDArray

from cutsim.base.arrays import Array

if TYPE_CHECKING:
    import pyvista

#: Colours of damage, from an intact bond to a broken one; apart from those of stress on either end.
DAMAGE = LinearSegmentedColormap.from_list("damage", ["#f4ece6", "#f2a98a", "#c4302b", "#5a0012"])
#: From where a body in space is looked at: to the right, up, in front.
ASIDE = np.array([1.0, 0.7, 1.6])
#: Colours of stress.
STRESS = "viridis"

#: Colours of edges and of rigid tools.
LINE, TOOL = "#20242a", "#a3adb8"

# part of the picture that the body takes, in the direction in which it is larger
_FILLED = 0.92
# light on a body: in a plane problem its colours are exactly those of the bar
_FLAT = {"ambient": 0.0, "diffuse": 1.0, "specular": 0.0}
_LIT = {"ambient": 0.35, "diffuse": 0.75, "specular": 0.1}
# distance of marks from the body over the diameter of the largest: half the tangent of the steepest view of a face
_AHEAD = 1.5
# width of a picture for which lines and marks are given [pixels]
_WIDTH = 1600
# sharp edges are drawn: those at which the surface turns by more than this angle [°]
_SHARP = 40.0


@dataclass(frozen=True)
class View:
    """Direction and frame of a view.

    Attributes:
        shown: Points that are to be seen, shape (points, 3) [length].
        towards: Direction from the body to the eye.
        up: Direction that points up.
    """

    shown: Array
    towards: ArrayLike
    up: ArrayLike

    @classmethod
    def of(cls, shown: Array, right: Sequence[float], up: Sequence[float], *, flat: bool) -> Self:
        """View of what is flat from the front, of all else from aside.

        Args:
            shown: Points that are to be seen, shape (points, 3) [length].
            right: Direction to the right where it is seen from the front.
            up: Direction that points up.
            flat: Whether it is flat.
        """
        back = np.cross(right, up)
        return cls(shown, back if flat else ASIDE @ np.stack([right, up, back]), up)

    @property
    def back(self) -> Array:
        """Unit vector from the body to the eye."""
        towards = np.asarray(self.towards, dtype=float)
        return towards / np.linalg.norm(towards)

    def aim(self, camera: Any, aspect: float) -> float:
        """Aim a camera so that the points fill the picture; returns the height that is seen [length].

        Args:
            camera: The camera of pyvista.
            aspect: Width of the picture over its height.
        """
        back = self.back
        right = np.cross(np.asarray(self.up, dtype=float), back)
        right /= np.linalg.norm(right)
        axes = np.stack([right, np.cross(back, right), back])
        seen = self.shown @ axes.T
        low, high = seen.min(axis=0), seen.max(axis=0)
        width, height, depth = high - low
        scene = max(width / aspect, height) / _FILLED
        camera.focal_point = (low + high) / 2 @ axes
        camera.position = camera.focal_point + (depth + scene) * back
        camera.up = axes[1]
        camera.parallel_projection = True
        camera.parallel_scale = scene / 2
        return float(scene)


class Scene:
    """Scene that is drawn off screen. Use it as a context manager.

    Args:
        size: Width and height of the picture [pixels].
        flat: Whether it is that of a plane problem, seen without light and shadow.
    """

    def __init__(self, size: tuple[int, int], *, flat: bool) -> None:
        import pyvista

        # Without a display VTK would try X first and complain; without libEGL it would then end the process.
        if sys.platform == "linux" and not any(map(os.environ.get, ("DISPLAY", "VTK_DEFAULT_OPENGL_WINDOW"))):
            ctypes.CDLL("libEGL.so.1")
            os.environ["VTK_DEFAULT_OPENGL_WINDOW"] = "vtkEGLRenderWindow"
        self._size, self._flat, self._width = size, flat, size[0] / _WIDTH
        self._plotter = pyvista.Plotter(off_screen=True, window_size=size, lighting="light kit")
        self._plotter.enable_anti_aliasing("ssaa")
        self._marks: list[tuple[Array, Any, float]] = []

    def add_body(
        self,
        surface: pyvista.PolyData,
        scalars: str,
        colours: str | Colormap,
        limits: tuple[float, float],
        *,
        edges: bool = False,
        opacity: float = 1.0,
    ) -> None:
        """Add a body coloured by a field, with or without the edges of its cells."""
        self._plotter.add_mesh(
            surface, scalars=scalars, cmap=colours, clim=limits, show_edges=edges, edge_color=LINE, edge_opacity=0.25,
            line_width=self._width, lighting=not self._flat, **_FLAT if self._flat else _LIT,
            smooth_shading=not self._flat, split_sharp_edges=not self._flat, show_scalar_bar=False, opacity=opacity,
        )  # fmt: skip

    def add_lines(self, lines: pyvista.DataSet) -> None:
        """Add edges of a body."""
        if lines.n_cells:
            self._plotter.add_mesh(lines, color=LINE, line_width=2 * self._width, lighting=False)

    def add_crack(self, faces: pyvista.DataSet) -> None:
        """Add faces of a crack, coloured by their ``damage``."""
        actor = self._plotter.add_mesh(
            faces, scalars="damage", cmap=DAMAGE, clim=(0.0, 1.0), line_width=4 * self._width, lighting=False,
            show_scalar_bar=False,
        )  # fmt: skip
        _bring_forward(actor)

    def add_faces(self, faces: pyvista.DataSet, colour: Any) -> None:
        """Add faces of a crack in one colour."""
        if faces.n_cells:
            _bring_forward(self._plotter.add_mesh(faces, color=colour, line_width=5 * self._width, lighting=False))

    def add_nodes(self, points: Array, colour: Any, diameter: float) -> None:
        """Mark some nodes by dots of a diameter [pixels in a picture 1600 wide]; later ones lie on earlier ones."""
        if len(points):
            self._marks.append((points, colour, diameter * self._width))

    def add_tool(self, tool: pyvista.PolyData) -> None:
        """Add rigid tools."""
        self._plotter.add_mesh(
            tool, color=TOOL, opacity=0.45, specular=1.0, specular_power=15, smooth_shading=not self._flat,
            split_sharp_edges=not self._flat, lighting=not self._flat,
        )  # fmt: skip

    def shot(self, view: View) -> tuple[NDArray[np.uint8], float]:
        """Draw the scene.

        Returns:
            Pixels on a transparent ground, shape (height, width, 4), and the width of the picture [length].
        """
        width, height = self._size
        seen = view.aim(self._plotter.camera, width / height)
        self._add_marks(view.back, seen / height)
        self._plotter.reset_camera_clipping_range()
        pixels = self._plotter.screenshot(transparent_background=True, return_img=True)
        return np.asarray(pixels), seen * width / height

    def _add_marks(self, back: Array, pixel: float) -> None:
        """Draw the dots as discs that face the eye, so far in front of the body that it hides no part of them."""
        import pyvista

        for number, (points, colour, diameter) in enumerate(self._marks):
            disc = pyvista.Disc(inner=0.0, outer=0.5 * diameter * pixel, normal=back, c_res=24)
            front = points + (_AHEAD * self._marks[0][2] + number) * pixel * back
            dots = pyvista.PolyData(front).glyph(orient=False, scale=False, geom=disc)
            self._plotter.add_mesh(dots, color=colour, lighting=False, reset_camera=False)

    def __enter__(self) -> Scene:
        return self

    def __exit__(self, *_: object) -> None:
        self._plotter.close()


def _bring_forward(actor: Any) -> None:
    """Show an actor before the face of the body that is in the same place."""
    mapper = actor.mapper
    mapper.SetResolveCoincidentTopologyToPolygonOffset()
    mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(-4.0, -4.0)
    mapper.SetRelativeCoincidentTopologyLineOffsetParameters(-4.0, -4.0)


def sharp_edges(surface: pyvista.PolyData, seams: Sequence[str] = ()) -> pyvista.DataSet:
    """Sharp and outer edges of a surface, without those in planes of symmetry through the origin.

    Args:
        surface: The surface.
        seams: The planes, by the axes normal to them.
    """
    # the cells of a plane surface may be turned either way, which is no edge
    sharp = bool(np.ptp(surface.points[:, 2]))
    edges = surface.extract_feature_edges(_SHARP, feature_edges=sharp, manifold_edges=False)
    if not seams or not edges.n_cells:
        return edges
    seam = [np.isclose(edges.cell_centers().points[:, "xyz".index(plane)], 0.0) for plane in seams]
    return edges.extract_cells(~np.any(seam, axis=0))


def corners(box: ArrayLike) -> Array:
    """Corners of a box (xmin, xmax, ymin, ymax, zmin, zmax)."""
    return np.stack(np.meshgrid(*np.reshape(box, (3, 2))), axis=-1).reshape(-1, 3)
