"""View of the cut body that can be turned in a page, without a network (plotly)."""

import json
from collections.abc import Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go
from matplotlib import colormaps
from matplotlib.colors import Colormap, to_hex

from cutsim.base.arrays import Array
from cutsim.results.pictures import Look, polydata
from cutsim.results.scene import ASIDE, DAMAGE, LINE, STRESS, corners, sharp_edges
from cutsim.results.stages import Skin, Stage, spread
from cutsim.results.web_plots import LAYOUT, in_page

#: Stages that can be chosen.
VIEWED = 5
# triangles of the body in all stages; fewer stages are shown where there would be more
_TRIANGLES = 250_000
_PLANE = {"ambient": 1.0, "diffuse": 0.0, "specular": 0.0}
_SPACE = {"ambient": 0.75, "diffuse": 0.4, "specular": 0.02, "roughness": 0.9}
_TOOL = "#8d99a6"
# distance of the eye, over the largest extent of the scene: all of it is before the eye
_FAR = 2.0
# least thickness of the scene, over its largest extent
_THIN = 0.02


def view_json(stages: Sequence[Stage]) -> str | None:
    """The body at some stages: the traces of each, and one layout; None without stages.

    Args:
        stages: Stages of one run, as `Stage.whole` gives them.
    """
    if not stages:
        return None
    look, number = Look.of(stages), max(1, min(VIEWED, _TRIANGLES // max(1, len(stages[-1].body.cells))))
    shown = [
        {"label": f"time {stage.time:.4g} {stage.units.time}", **_plain(go.Figure(_traces(stage, look)))}
        for stage in spread(stages, number)
    ]
    layout = _plain(go.Figure(layout=LAYOUT | {"scene": _scene(look), "margin": {"l": 0, "r": 0, "t": 70, "b": 0}}))[
        "layout"
    ]
    views, first = _views(stages[-1], look), "front" if stages[-1].flat else "aside"
    return in_page({"stages": shown, "layout": layout | {"uirevision": "kept"}, "views": views, "first": first})


def _plain(figure: go.Figure) -> dict[str, Any]:
    return dict(json.loads(figure.to_json()))


def _traces(stage: Stage, look: Look) -> list[Any]:
    label, stress = stage.units.label("von Mises stress", "stress"), stage.body.values["stress"]
    bar = {
        "title": {"text": label, "side": "top"}, "orientation": "h", "thickness": 12, "len": 0.6, "y": 1.0,
        "yanchor": "bottom", "nticks": 5,
    }  # fmt: skip
    low, high = look.limits
    light = _PLANE if stage.flat else _SPACE
    traces = [
        _mesh(
            stage.body, intensity=stress, cmin=low, cmax=high, colorscale=_scale(STRESS), name="body", colorbar=bar,
            lighting=light, hovertemplate="%{intensity:.3g}<extra></extra>",
        ),
        _lines(stage),
    ]  # fmt: skip
    if len(stage.cracks.cells):
        traces.append(_crack(stage))
    if len(stage.tools.cells):
        traces.append(_mesh(stage.tools, color=_TOOL, opacity=0.5, name="tool", hoverinfo="name", lighting=light))
    return traces


def _mesh(skin: Skin, **options: Any) -> Any:
    """Triangles as they are deformed."""
    x, y, z = skin.deformed.T
    i, j, k = skin.cells.T
    return go.Mesh3d(x=x, y=y, z=z, i=i, j=j, k=k, flatshading=True, **options)


def _crack(stage: Stage) -> Any:
    """Faces of the cracks in the colours of their damage; in the plane they are lines."""
    cracks, damage = stage.cracks, stage.cracks.values["damage"]
    options: dict[str, Any] = {"name": "damage of the crack", "hovertemplate": "damage %{text}<extra></extra>"}
    if not stage.flat:
        return _mesh(
            cracks, intensity=damage, intensitymode="cell", cmin=0, cmax=1, colorscale=_scale(DAMAGE), showscale=False,
            lighting=_PLANE, name="damage of the crack", hovertemplate="damage %{intensity:.2f}<extra></extra>",
        )  # fmt: skip
    colours = np.repeat(damage, 3)
    line = {"color": colours, "cmin": 0, "cmax": 1, "colorscale": _scale(DAMAGE), "width": 5}
    text = [f"{value:.2f}" for value in colours]
    return go.Scatter3d(**_segments(cracks.deformed, cracks.cells, 2.0), line=line, text=text, **options)


def _lines(stage: Stage) -> Any:
    """Sharp and outer edges of the body."""
    edges = sharp_edges(polydata(stage.body))
    cells = edges.lines.reshape(-1, 3)[:, 1:] if edges.n_cells else np.zeros((0, 2), int)
    line = {"color": LINE, "width": 2}
    return go.Scatter3d(**_segments(edges.points, cells, float(stage.flat)), line=line, hoverinfo="skip")


def _segments(points: Any, cells: Any, lift: float) -> dict[str, Any]:
    """Lines between pairs of points, lifted a little in front of what lies in their plane."""
    size = float(np.ptp(points, axis=0).max()) if len(points) else 0.0
    ends = np.full((len(cells), 3, 3), np.nan, np.float32)
    ends[:, :2] = points[cells]
    ends[..., 2] += 1e-3 * lift * size
    x, y, z = ends.reshape(-1, 3).T
    return {"x": x, "y": y, "z": z, "mode": "lines", "connectgaps": False, "showlegend": False}


def _scene(look: Look) -> dict[str, Any]:
    """Frame of all stages, without axes."""
    middle, extent = look.shown.mean(axis=0), _extent(look)
    axes = {
        f"{name}axis": {"visible": False, "range": [float(m - e / 2), float(m + e / 2)]}
        for name, m, e in zip("xyz", middle, extent, strict=True)
    }
    return axes | {"aspectmode": "manual", "aspectratio": _xyz(extent / extent.max()), "dragmode": "orbit"}


def _extent(look: Look) -> Array:
    """Extent of the box that is seen, nowhere zero [length]."""
    extent = np.ptp(look.shown, axis=0)
    return np.maximum(extent, _THIN * extent.max())


def _views(stage: Stage, look: Look) -> dict[str, dict[str, Any]]:
    """Cameras without perspective by the direction from which they look, each with the size of what it sees."""
    right, up = np.asarray(stage.right), np.asarray(stage.up)
    back, box = np.cross(right, up), corners(np.outer(_extent(look) / _extent(look).max(), (-0.5, 0.5)))
    places = {"aside": (ASIDE @ np.stack([right, up, back]), up), "front": (back, up), "side": (right, up)}
    found = {}
    for name, (eye, top) in {**places, "top": (up, -back)}.items():
        eye = eye / np.linalg.norm(eye)
        across = np.cross(top, eye) / np.linalg.norm(np.cross(top, eye))
        size = [float(np.ptp(box @ axis)) for axis in (across, np.cross(eye, across))]
        camera = {"eye": _xyz(_FAR * eye), "up": _xyz(top), "projection": {"type": "orthographic"}}
        found[name] = {"camera": camera, "size": size}
    return found


def _xyz(vector: Array) -> dict[str, float]:
    return {name: float(value) for name, value in zip("xyz", vector, strict=True)}


def _scale(colours: str | Colormap) -> list[tuple[float, str]]:
    colormap = colormaps[colours] if isinstance(colours, str) else colours
    return [(float(x), to_hex(colormap(float(x)))) for x in np.linspace(0.0, 1.0, 16)]
