"""Plots for a page that is read without a network (plotly)."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go

from cutsim.results.plots import ENERGIES, Curve, distinct
from cutsim.results.run_files import Column

# digits of the numbers in a page
_DIGITS = 6

#: Layout of all plots.
LAYOUT: dict[str, Any] = {
    "template": "none",
    "margin": {"l": 64, "r": 14, "t": 30, "b": 52},
    "font": {"family": "system-ui, sans-serif", "size": 13, "color": "#1c2127"},
    "legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom", "x": 0},
    "hovermode": "closest",
}


def in_page(value: Any) -> str:
    """A value as JSON for a script in a page.

    Args:
        value: What JSON knows, or the JSON itself.
    """
    text = value if isinstance(value, str) else json.dumps(value)
    return text.replace("<", "\\u003c")  # no value ends the script


def columns_json(history: Mapping[str, Column]) -> str:
    """Columns of a history for a script in a page: name → label and values.

    Args:
        history: The columns.
    """
    rows = {
        name: {"label": column.label, "values": [float(f"{value:.{_DIGITS}g}") for value in column.values]}
        for name, column in history.items()
        if np.isfinite(column.values).all()
    }
    return in_page(rows)


def energy_json(history: Mapping[str, Column]) -> str | None:
    """Energy audit: what is stored and dissipated, stacked, beside the work.

    Args:
        history: The columns.

    Returns:
        The plot; None if the history has no audit or no rows.
    """
    if not {"time", "work_external", "energy_closure"} <= set(history):
        return None
    time, work = history["time"], history["work_external"]
    if not len(time.values):
        return None
    figure = go.Figure(layout=LAYOUT)
    for name, (label, colour) in ENERGIES.items():
        if name in history and np.any(history[name].values):
            figure.add_scatter(
                x=time.values, y=history[name].values, name=label, stackgroup="energies", fillcolor=colour,
                line={"color": colour, "width": 0.5},
            )  # fmt: skip
    figure.add_scatter(x=time.values, y=work.values, name="external work", line={"color": "black", "width": 2})
    figure.add_scatter(
        x=time.values, y=100 * history["energy_closure"].values, name="closure", yaxis="y2", showlegend=False,
        line={"color": "#555555", "width": 1.5},
    )  # fmt: skip
    figure.update_layout(
        xaxis={"title": {"text": time.label}, "anchor": "y2"},
        yaxis={"title": {"text": f"energy [{work.unit}]"}, "domain": [0.28, 1]},
        yaxis2={"title": {"text": "closure [%]"}, "domain": [0, 0.2], "nticks": 4, "automargin": True},
        hovermode="x unified",
    )
    return in_page(figure.to_json())


def curves_json(curves: Sequence[Curve], *, xlabel: str, ylabel: str) -> str:
    """Curves in one frame, each in a colour of its own; those that end early say so.

    Args:
        curves: What to plot.
        xlabel: Text at the abscissa, with the unit.
        ylabel: Text at the ordinate, with the unit.
    """
    figure = go.Figure(layout=LAYOUT)
    for curve, colour in zip(curves, distinct(len(curves)), strict=True):
        points = curve.style.startswith("o")
        figure.add_scatter(
            x=np.asarray(curve.x), y=np.asarray(curve.y), name=curve.text, mode="markers" if points else "lines",
            line={"color": colour, "width": 2}, marker={"color": colour, "size": 5},
        )  # fmt: skip
        if curve.partial and len(np.asarray(curve.x)):
            figure.add_scatter(
                x=np.asarray(curve.x)[-1:], y=np.asarray(curve.y)[-1:], mode="markers", showlegend=False,
                hoverinfo="skip", marker={"color": colour, "size": 10, "symbol": "x"},
            )  # fmt: skip
    figure.update_layout(xaxis={"title": {"text": xlabel}}, yaxis={"title": {"text": ylabel}})
    return in_page(figure.to_json())
