"""Picture of an insertion: the cut body with the tool in it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cutsim.base.assembly import box
from cutsim.base.signatures import checked
from cutsim.results.pictures import draw_stress
from cutsim.results.tool_surfaces import ToolSurfaces, prism, revolved
from cutsim.studies.insertion import Insertion
from cutsim.tools.pointed import Pointed

if TYPE_CHECKING:
    import pyvista

#: How far the tool is seen above the surface, as a part of the height of the body.
_ABOVE = 0.25


@checked
def draw_insertion(path: Path | str, cut: Insertion, **view: Any) -> None:
    """Draw the deformed body coloured by stress, the first part of its crack by damage, and the tool. Collective.

    Args:
        path: The PNG, 1600 × 1000; folders are made.
        cut: The insertion in its present state.
        view: Further arguments of `cutsim.results.pictures.draw_body`, such as a ``window``, or ``mirror=("z",)`` to
            show the whole of a body that is modelled by half.
    """
    draw_stress(path, cut.body.solids, cut.body.cracks[0], **{"tool": tool_surface(cut), **view})


def tool_surface(cut: Insertion) -> pyvista.PolyData | None:
    """Surface of the whole tool where it is now, for `cutsim.results.pictures.draw_body`. Collective.

    Args:
        cut: The insertion.

    Returns:
        The surface, None where pyvista is missing.
    """
    frame, depth = cut.frame, cut.depth
    if not isinstance(cut.tool, Pointed):
        corners = box(cut.state.mesh.comm, cut.state.mesh.geometry.x)
        return ToolSurfaces(cut.contacts)(tuple(np.transpose(corners).ravel()))
    outline = cut.tool.outline(max(depth, 0.0) + _ABOVE * frame.height)
    tip, axes, edge = frame.point(depth), (frame.normal, -frame.push), frame.edge
    if edge is None:
        return prism(outline, tip, axes)
    if cut.tool.round:
        return revolved(outline, tip, axes)
    low, high = frame.span(cut.state.mesh, cut.body.slit, edge)
    if cut.edge_factor == 2:  # the origin lies in the plane of symmetry
        low, high = np.array([-1, 1]) * max(-low, high)
    return prism(outline, tip + low * edge, axes, (high - low) * edge)
