"""Sheets: a drawn scene with its title, bars of colours and scale, as a figure of matplotlib."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Colormap, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

#: Part of the height that is left to the scene; above it is the title, below it are bars and scale.
SCENE = 0.81
#: Size of a picture [inch].
SIZE = (8.0, 5.0)

_BOTTOM, _TITLE = 0.13, 0.955
# where the bars are: left end and width
_PLACES = ((0.06, 0.34), (0.47, 0.26))
# entries of a legend below each other
_LINES = 4
_SCALE_END, _SCALE_LARGEST = 0.95, 0.17


@dataclass(frozen=True)
class Bar:
    """Legend of a field.

    Attributes:
        label: What it is, with the unit; mathematics of TeX is set.
        colours: Its colours.
        limits: Its range.
    """

    label: str
    colours: str | Colormap
    limits: tuple[float, float]


@dataclass(frozen=True)
class Entry:
    """Entry of a legend.

    Attributes:
        label: What it is.
        colour: Its colour.
        mark: "area", "line" or "point".
    """

    label: str
    colour: Any
    mark: str = "area"

    @property
    def handle(self) -> Any:
        """What stands for it in a legend of matplotlib."""
        if self.mark == "area":
            return Patch(facecolor=self.colour, edgecolor="0.4", linewidth=0.4, label=self.label)
        if self.mark == "line":
            return Line2D([], [], color=self.colour, linewidth=2.5, label=self.label)
        return Line2D([], [], color=self.colour, linestyle="", marker="o", markersize=5, label=self.label)


def compose(
    pixels: NDArray[np.uint8],
    width: float,
    bars: Sequence[Bar],
    entries: Sequence[Entry] = (),
    *,
    title: str,
    length: str,
) -> Figure:
    """Put a scene on a sheet.

    Args:
        pixels: The scene, shape (height, width, 4).
        width: Its width [length].
        bars: Its fields, two at most; none beside a legend.
        entries: Entries of its legend.
        title: Text above it.
        length: Symbol of the unit of length.

    Returns:
        The figure; it is white unless matplotlib's ``savefig.transparent`` says otherwise.
    """
    figure = Figure(figsize=SIZE, dpi=pixels.shape[1] / SIZE[0])
    scene = figure.add_axes((0.0, _BOTTOM, 1.0, SCENE))
    scene.imshow(pixels, aspect="auto", interpolation="none" if pixels.shape[1] >= 1600 else "antialiased")
    scene.axis("off")
    if title:
        figure.text(0.5, _TITLE, title, ha="center", fontsize=11)
    for bar, place in zip(bars, _PLACES, strict=False):
        _add_bar(figure, bar, *place)
    if entries:
        _add_legend(figure, entries)
    _add_scale(figure, width, length)
    return figure


def _add_bar(figure: Figure, bar: Bar, left: float, width: float) -> None:
    axes = figure.add_axes((left, 0.065, width, 0.022))
    shown = ScalarMappable(Normalize(*bar.limits), bar.colours)
    ticks = MaxNLocator(nbins=5, steps=[1, 2, 2.5, 5, 10])
    colour_bar = figure.colorbar(shown, cax=axes, orientation="horizontal", ticks=ticks)
    colour_bar.outline.set_linewidth(0.5)
    colour_bar.ax.tick_params(labelsize=8, width=0.5, length=2.5)
    axes.set_title(bar.label, fontsize=9, pad=4)


def _add_legend(figure: Figure, entries: Sequence[Entry]) -> None:
    figure.legend(
        handles=[entry.handle for entry in entries], loc="lower left", bbox_to_anchor=(0.01, -0.01), fontsize=7.5,
        ncols=-(-len(entries) // _LINES), frameon=False, handlelength=1.3, handleheight=0.9, labelspacing=0.2,
        columnspacing=1.4,
    )  # fmt: skip


def _add_scale(figure: Figure, width: float, length: str) -> None:
    """A bar whose length is a round number, in the corner below the scene."""
    largest = _SCALE_LARGEST * width
    decade = 10.0 ** np.floor(np.log10(largest))
    size = max(round_ * decade for round_ in (1.0, 2.0, 5.0) if round_ * decade <= largest * (1 + 1e-9))
    ends = (_SCALE_END - size / width, _SCALE_END)
    figure.add_artist(Line2D(ends, (0.076, 0.076), color="black", linewidth=2.0, solid_capstyle="butt"))
    figure.text(sum(ends) / 2, 0.035, f"{size:g} {length}", ha="center", fontsize=9)
