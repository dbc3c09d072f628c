"""The figure of the page on validation: how far rows are inside their tolerances, and how their errors fall."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cutsim.base.arrays import Array
from cutsim.validation.page import keyed
from cutsim.validation.results import NEGLECTED, Findings, Result
from cutsim.validation.rows import Group

# parts of a tolerance and errors that are drawn as zero
_LEAST = 1e-6


def draw(path: Path, groups: Sequence[Group], found: Findings) -> None:
    """Draw the error of each row over what is allowed, and how errors fall on finer and finer meshes.

    Args:
        path: The picture.
        groups: The rows.
        found: What was found for them.
    """
    figure = Figure(figsize=(11, 4.5), layout="constrained")
    left, right = figure.subplots(1, 2)
    colours = colormaps["tab20"].colors  # one for each group
    for number, group in enumerate(groups):
        results = [found.results[key] for key, _ in keyed([group]) if key in found.results]
        ratios = {key: row.refinement for key, row in keyed([group])}
        colour = colours[number % len(colours)]
        _shares(left, number, results, colour)
        for sizes, errors in _studies(results, ratios):
            right.loglog(sizes, errors / errors[0], "o-", color=colour, markersize=3, linewidth=0.8, alpha=0.7)
    left.axvline(1.0, color="#c00")
    left.set_xscale("log")
    left.set_yticks(range(len(groups)), [group.title for group in groups])
    left.invert_yaxis()
    left.set_xlabel(f"error over what is allowed; {_LEAST:g} stands for less, too")
    right.set_xlabel("size of elements or steps over that of the coarsest")
    right.set_ylabel("error over that of the coarsest")
    right.set_ylim(2e-3, 3.0)
    sizes = np.array([0.125, 1.0])
    for order, style in ((1, ":"), (2, "--")):
        right.loglog(sizes, sizes**order, style, color="black", linewidth=2, label=f"order {order}")
    right.set_xticks([1.0, 0.5, 0.25, 0.125], ["1", "1/2", "1/4", "1/8"], minor=False)
    right.set_xticks([], minor=True)
    right.legend()
    figure.savefig(path, dpi=120)


def _shares(axes: Axes, place: int, results: Sequence[Result], colour: tuple[float, ...]) -> None:
    """A mark for each row, at the part of its tolerance that it takes."""
    shares = [max(abs(r.error) / r.tolerance, _LEAST) for r in results if r.error is not None]
    aside = place + 0.5 * (np.arange(len(shares)) / max(len(shares), 1) - 0.5)
    axes.plot(shares, aside, "o", color=colour, markersize=4)


def _studies(results: Sequence[Result], ratios: Mapping[str, float]) -> Iterator[tuple[Array, Array]]:
    """Sizes and errors of each study that has any to speak of, with the ratio of neighbouring sizes of each row."""
    for result in results:
        if len(result.values) > 1 and None not in result.values:
            values = np.array(result.values, dtype=float)
            errors: Array = np.abs(values - result.expected) / abs(result.expected or 1.0)
            if errors.min() > _LEAST and errors[0] > NEGLECTED * result.tolerance:
                yield ratios[result.key] ** -np.arange(len(errors), dtype=float), errors
