"""Plots for a page that is read without a network (plotly)."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go

from cutsim.heat.audit import GAINED, SPENT
from cutsim.results.plots import COLOURS, ENERGIES, Curve, distinct
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
    return _audit(history, ENERGIES, ("external work", history["work_external"].values), "energy")


def heat_json(history: Mapping[str, Column]) -> str | None:
    """Audit of heat: what is stored and has left, stacked, beside what was gained; arguments as `energy_json`."""
    if not {"time", "heat_closure"} <= set(history):
        return None
    spent = dict(zip((f"heat_{name}" for name in SPENT), zip(SPENT, COLOURS, strict=False), strict=False))
    gained = np.sum([history[f"heat_{name}"].values for name in GAINED if f"heat_{name}" in history], axis=0)
    return _audit(history, spent, ("gained", gained), "heat")


def _audit(
    history: Mapping[str, Column], parts: Mapping[str, tuple[str, str]], total: tuple[str, Any], name: str
) -> str | None:
    """Parts of a quantity, column → label and colour, as a stack beside what they add up to, with the closure."""
    time, shown = history["time"], [column for column in parts if column in history]
    if not len(time.values) or not shown:
        return None
    figure = go.Figure(layout=LAYOUT)
    for column in shown:
        label, colour = parts[column]
        if np.any(history[column].values):
            figure.add_scatter(
                x=time.values, y=history[column].values, name=label, stackgroup="parts", fillcolor=colour,
                line={"color": colour, "width": 0.5},
            )  # fmt: skip
    figure.add_scatter(x=time.values, y=total[1], name=total[0], line={"color": "black", "width": 2})
    figure.add_scatter(
        x=time.values, y=100 * history[f"{name}_closure"].values, name="closure", yaxis="y2", showlegend=False,
        line={"color": "#555555", "width": 1.5},
    )  # fmt: skip
    figure.update_layout(
        xaxis={"title": {"text": time.label}, "anchor": "y2"},
        yaxis={"title": {"text": f"{name} [{history[shown[0]].unit}]"}, "domain": [0.28, 1]},
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
