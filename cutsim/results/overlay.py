"""Main curves of several runs in one frame."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from cutsim.results.plots import Curve, plot_curves
from cutsim.results.run_files import RunFiles


@dataclass(frozen=True)
class Overlay:
    """Curves of one quantity over another.

    Attributes:
        curves: The curves; those of runs that have not come to their end say so.
        xlabel: Text at the abscissa, with the unit.
        ylabel: Text at the ordinate, with the unit.
    """

    curves: tuple[Curve, ...]
    xlabel: str
    ylabel: str

    @classmethod
    def of(cls, runs: Sequence[RunFiles], labels: Sequence[str]) -> Self | None:
        """Lay the main curves of runs over each other; None if there are none.

        Args:
            runs: The runs; those that have not the columns of the main curve of the first one are left out.
            labels: Text of each in the legend.
        """
        main = next((run.curve for run in runs if run.curve), None)
        if main is None:
            return None
        x, y = main
        shown = [(run, label) for run, label in zip(runs, labels, strict=True) if {x, y} <= set(run.history)]
        first = shown[0][0].history
        curves = [
            Curve(run.history[x].values, run.history[y].values, label, partial=not run.complete) for run, label in shown
        ]
        return cls(tuple(curves), first[x].label, first[y].label)

    def plot(self, path: Path | str, title: str = "") -> None:
        """Plot the curves. Call it on one rank.

        Args:
            path: The file; its suffix tells the format.
            title: Text above the plot.
        """
        plot_curves(path, self.curves, xlabel=self.xlabel, ylabel=self.ylabel, title=title)
