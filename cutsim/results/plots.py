"""Plots of a run: force and energy audit (matplotlib). Call these functions on one rank."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from cycler import cycler
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from cutsim.base.checks import as_numbers, require
from cutsim.base.signatures import checked

# Okabe and Ito's colours, which the colour-blind can tell apart.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")

# History column -> label and colour, from the bottom of the stack upwards: what is kept, then what is lost.
ENERGIES = {
    "energy_strain": ("strain", "#56B4E9"),
    "energy_kinetic": ("kinetic", "#009E73"),
    "energy_thermoelastic": ("thermoelastic", "#F0E442"),
    "energy_cohesive_stored": ("cohesive, stored", "#0072B2"),
    "energy_contact": ("contact", "#CC79A7"),
    "energy_fracture": ("fracture", "#D55E00"),
    "energy_friction": ("friction", "#E69F00"),
    "energy_viscous": ("viscous", "#999999"),
    "energy_cohesive_viscous": ("viscosity of the bond", "#66a61e"),
    "energy_braked": ("brake where the run jumped", "#a6761d"),
    "energy_damped": ("damped motion where the run jumped", "#7570b3"),
    "energy_numerical": ("numerical", "#000000"),
}


@checked
@dataclass(frozen=True)
class Curve:
    """A curve of a plot.

    Args:
        x: Abscissae.
        y: Ordinates, as many.
        label: Text in the legend; an empty one leaves the curve out of it.
        style: Line and marker in matplotlib's short form, such as ``"-"``, ``"--"`` or ``"o"``.
        partial: Whether it ends early, as that of an interrupted run: a cross at its end and the legend then say so.

    Raises:
        ValueError: Abscissae or ordinates are no numbers, or not as many of one as of the other.
    """

    x: ArrayLike
    y: ArrayLike
    label: str = ""
    style: str = "-"
    partial: bool = False

    def __post_init__(self) -> None:
        _require_alike("x", self.x, "y", self.y)

    @property
    def text(self) -> str:
        """Text in the legend."""
        return f"{self.label} (ends early)".lstrip() if self.partial else self.label


def distinct(count: int) -> list[str]:
    """Colours for some curves, none of which comes twice; many follow a ramp in their order.

    Args:
        count: Number of curves.
    """
    if count <= len(COLOURS):
        return list(COLOURS[:count])
    return [to_hex(colour) for colour in matplotlib.colormaps["viridis"](np.linspace(0.0, 0.92, count))]


@checked
def plot_curves(
    path: Path | str,
    curves: Sequence[Curve],
    *,
    xlabel: str,
    ylabel: str,
    title: str = "",
    references: Mapping[str, float] | None = None,
) -> None:
    """Plot curves in one frame. Call it on one rank.

    Args:
        path: The file; its suffix tells the format. Folders are made.
        curves: What to plot.
        xlabel: Text at the abscissa, with the unit.
        ylabel: Text at the ordinate, with the unit.
        title: Text above the plot.
        references: Label -> ordinate of a horizontal line, such as a closed form.
    """
    with matplotlib.rc_context(_style()):
        figure = Figure()
        axes = figure.add_subplot(xlabel=xlabel, ylabel=ylabel, title=title)
        axes.set_prop_cycle(color=distinct(len(curves)))
        for curve in curves:
            (line,) = axes.plot(curve.x, curve.y, curve.style, label=curve.text or None)
            if curve.partial:
                axes.plot(line.get_xdata()[-1:], line.get_ydata()[-1:], "x", color=line.get_color(), markersize=9)
        for label, level in (references or {}).items():
            axes.axhline(level, color="0.35", linewidth=1.2, linestyle="--", zorder=1)
            axes.annotate(
                label, (1.01, level), xycoords=("axes fraction", "data"), va="center", color="0.25", fontsize=9,
            )  # fmt: skip
        if axes.get_legend_handles_labels()[0]:
            axes.legend()
        _save(figure, path)


@checked
def plot_energy(
    path: Path | str,
    history: Mapping[str, NDArray[np.float64]],
    *,
    x: str = "time",
    xlabel: str = "time [s]",
    unit: str = "mJ",
) -> None:
    """Plot the energy audit: stored and dissipated energies, and the closure. Call it on one rank.

    Args:
        path: The file; its suffix tells the format. Folders are made.
        history: Columns of a history: ``work_external``, ``energy_closure`` (relative) and what there is of
            `ENERGIES`.
        x: Column of the abscissa.
        xlabel: Text at the abscissa, with the unit.
        unit: Unit of energy.

    Raises:
        ValueError: If a column is missing.
    """
    for name in (x, "work_external", "energy_closure"):
        require("history", sorted(history), name in history, f"a mapping with the column {name}")
    parts = [name for name in ENERGIES if name in history and np.any(history[name])]
    labels, colours = zip(*(ENERGIES[name] for name in parts), strict=True) if parts else ((), ())
    with matplotlib.rc_context(_style()):
        figure = Figure(figsize=(7.0, 5.4))
        main, small = figure.subplots(2, sharex=True, height_ratios=(4, 1))
        stack = [history[name] for name in parts]
        main.stackplot(history[x], *stack, labels=labels, colors=colours, alpha=0.85)
        main.plot(history[x], history["work_external"], color="black", label="external work")
        main.set(ylabel=f"energy [{unit}]", title="Energy audit")
        handles, texts = main.get_legend_handles_labels()
        main.legend(handles[::-1], texts[::-1], loc="upper left")
        small.plot(history[x], 100.0 * np.asarray(history["energy_closure"]), color="0.25")
        small.axhline(0.0, color="0.6", linewidth=0.8)
        small.set(xlabel=xlabel, ylabel="closure [%]")
        _save(figure, path)


@checked
def plot_parts(
    path: Path | str,
    x: ArrayLike,
    parts: Mapping[str, ArrayLike],
    total: ArrayLike,
    *,
    xlabel: str,
    ylabel: str,
    title: str = "",
) -> None:
    """Plot a quantity as the stack of its parts. Call it on one rank.

    Args:
        path: The file; its suffix tells the format. Folders are made.
        x: Abscissae.
        parts: Label -> ordinates of a part >= 0, seven at most, from the bottom upwards; what vanishes is left out.
        total: The quantity itself, drawn as a line.
        xlabel: Text at the abscissa, with the unit.
        ylabel: Text at the ordinate and in the legend, with the unit.
        title: Text above the plot.
    """
    for name, values in (("total", total), *parts.items()):
        _require_alike("x", x, name, values)
    colours = dict(zip(parts, COLOURS, strict=False))
    shown = [label for label, part in parts.items() if np.any(part)]
    with matplotlib.rc_context(_style()):
        figure = Figure()
        axes = figure.add_subplot(xlabel=xlabel, ylabel=ylabel, title=title)
        stack = [parts[label] for label in shown]
        axes.stackplot(x, *stack, labels=shown, colors=[colours[label] for label in shown], alpha=0.85)
        axes.plot(x, total, color="black", label="in all")
        handles, texts = axes.get_legend_handles_labels()
        axes.legend(handles[::-1], texts[::-1], loc="upper left")
        _save(figure, path)


def _require_alike(first: str, x: ArrayLike, second: str, y: ArrayLike) -> None:
    """Refuse two rows of numbers that are not as long as each other; the shorter one is named."""
    one, other = as_numbers(first, x), as_numbers(second, y)
    name, shape, asked = (first, one.shape, other.shape) if one.size < other.size else (second, other.shape, one.shape)
    require(f"shape of {name}", shape, shape == asked and len(shape) == 1, f"{asked}, one-dimensional")


def _style() -> dict[str, Any]:
    return {
        "figure.figsize": (7.0, 4.4), "figure.constrained_layout.use": True, "savefig.dpi": 150,
        "font.size": 11, "axes.titlesize": 12, "axes.titleweight": "bold", "legend.fontsize": 9,
        "axes.prop_cycle": cycler(color=COLOURS), "lines.linewidth": 1.9, "lines.markersize": 4,
        "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True, "grid.alpha": 0.3,
        "axes.axisbelow": True, "legend.frameon": False,
    }  # fmt: skip


def _save(figure: Figure, path: Path | str) -> None:
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path)
