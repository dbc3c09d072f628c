"""Draw the figures of the pages: python docs/figures/make_figures.py."""

from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("svg")
import matplotlib.pyplot as plt
from matplotlib.patches import FancyBboxPatch

HERE = Path(__file__).parent
BLUE, GREEN, RED, GREY = "#dbe9f6", "#dff0df", "#f9dfdc", "#eeeeee"


def box(ax, x, y, title, text, colour, width=4.0, height=0.86):
    """A rounded box centred on a point: a title and what happens."""
    corner = x - width / 2, y - height / 2
    ax.add_patch(FancyBboxPatch(corner, width, height, "round,pad=0.02,rounding_size=0.1", fc=colour, ec="#555555"))
    ax.text(x, y + 0.17, title, ha="center", va="center", weight="bold", size=10.5)
    ax.text(x, y - 0.18, text, ha="center", va="center", size=8.5)


def arrow(ax, start, end, label="", shift=(0.0, 0.0), bend=0.0, align="left"):
    """An arrow with a label beside its middle."""
    style = {"arrowstyle": "-|>", "color": "#333333", "lw": 1.3, "connectionstyle": f"arc3,rad={bend}"}
    ax.annotate("", end, start, arrowprops=style)
    x, y = (start[0] + end[0]) / 2 + shift[0], (start[1] + end[1]) / 2 + shift[1]
    ax.text(x, y, label, ha=align, va="center", size=8.5, style="italic")


def step(path):
    """Data flow of one step."""
    fig, ax = plt.subplots(figsize=(9.6, 7.4))
    ax.set(xlim=(-2.9, 9.2), ylim=(-0.7, 8.6))
    ax.set_aspect("equal")
    ax.axis("off")
    column = [
        ("begin", "clock: time and step size", BLUE),
        ("move", "tools, loads, supports: constants", BLUE),
        ("solve", "Newton's method, augmentation", BLUE),
        ("evaluate", "trial history, work, energy audit", BLUE),
        ("accept?", "step control: damage, energy closure", GREY),
        ("commit", "memory: trial → committed", GREEN),
        ("record", "history row, fields, progress", GREEN),
    ]
    y = [8.0 - 1.35 * i for i in range(len(column))]
    for height, (title, text, colour) in zip(y, column, strict=True):
        box(ax, 0, height, title, text, colour)
    labels = ["", "", "converged", "", "yes", ""]
    for above, below, label in zip(y, y[1:], labels, strict=False):
        arrow(ax, (0, above - 0.47), (0, below + 0.47), label, shift=(0.12, 0.0))
    x = 6.6
    box(ax, x, y[2], "roll back", "memory: committed\nvalues, bit for bit", RED, 3.8, 1.15)
    ax.texts[-2].set_y(y[2] + 0.34)
    box(ax, x, y[1] + 0.25, "next line search", "same step again", RED, 3.8)
    box(ax, x, y[4], "smaller step", "dt × cut", RED, 3.8)
    box(ax, x, y[6], "StepError", "when, why, where; history complete", GREY, 3.8)
    arrow(ax, (2.05, y[2]), (x - 1.95, y[2]), "failed", shift=(-0.25, 0.17))
    arrow(ax, (x, y[2] + 0.62), (x, y[1] - 0.22), "one is left", shift=(0.1, 0.0))
    arrow(ax, (x - 1.95, y[1] + 0.35), (2.05, y[0] - 0.1))
    arrow(ax, (x, y[2] - 0.62), (x, y[4] + 0.47), "none is left", shift=(0.1, 0.0))
    arrow(ax, (2.05, y[4]), (x - 1.95, y[4]), "no: roll back", shift=(-0.6, 0.17))
    arrow(ax, (x, y[4] - 0.47), (x, y[6] + 0.47), "below the smallest", shift=(0.1, 0.0))
    ax.plot([x + 1.95, 9.0, 9.0, 2.6], [y[4], y[4], y[0] + 0.15, y[0] + 0.15], color="#333333", lw=1.3)
    arrow(ax, (2.6, y[0] + 0.15), (2.05, y[0] + 0.15))
    ax.plot([-2.05, -2.4, -2.4], [y[6], y[6], y[0]], color="#333333", lw=1.3)
    arrow(ax, (-2.4, y[0]), (-2.05, y[0]))
    ax.text(-2.62, y[3], "next step", rotation=90, va="center", ha="center", size=8.5, style="italic")
    fig.savefig(path, bbox_inches="tight", metadata={"Date": None})
    plt.close(fig)


def law(path):
    """Traction between the faces of a crack against their opening: contact on the left, cohesion on the right."""
    fig, ax = plt.subplots(figsize=(6.4, 3.4))
    opening, closed = np.linspace(0, 6, 200), np.linspace(-0.22, 0, 2)
    traction = opening * np.exp(1 - opening)
    ax.fill_between(opening, traction, color="#dff0df")
    ax.plot(opening, traction, color="#2a7f3a", lw=2.2)
    ax.plot(closed, 4 * closed, color="#b3261e", lw=2.2)
    ax.plot([0, 2.2], [0, 2.2 * np.exp(-1.2)], color="#555555", lw=1.3, ls="--")
    ax.axhline(0, color="black", lw=0.8)
    ax.axvline(0, color="black", lw=0.8)
    ax.set(xlim=(-1.1, 6), ylim=(-1.0, 1.25), xticks=[], yticks=[])
    ax.text(0.12, 1.14, "traction", size=9)
    ax.text(5.95, -0.14, "opening", size=9, ha="right")
    ax.text(1.25, 1.05, "opening: cohesion, up to the strength", size=9.5, color="#2a7f3a")
    ax.text(1.45, 0.12, "area: fracture energy", size=9)
    ax.text(0.55, -0.42, "dashed: a damaged bond, unloaded and loaded again", size=9, color="#555555")
    ax.text(-0.32, -0.75, "closed:\ncontact", size=9.5, color="#b3261e", ha="right")
    for side in ax.spines.values():
        side.set_visible(False)
    fig.savefig(path, bbox_inches="tight", metadata={"Date": None})
    plt.close(fig)


if __name__ == "__main__":
    matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "cutsim", "font.family": "sans-serif"})
    step(HERE / "step.svg")
    law(HERE / "law.svg")
