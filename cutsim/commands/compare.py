"""``cutsim compare``: curves of runs and of measurements over each other."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cutsim.commands.options import Width, console, table

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
    from rich.table import Table

    from cutsim.commands.folders import Source

    Numbers = NDArray[np.float64]

EXAMPLES = (
    "cutsim compare results/blade measured.csv",
    "cutsim compare results/dcb measured.csv -x upper_displacement --width 25",
    "cutsim compare results/fine results/coarse -o compared.pdf",
    'cutsim compare results/blade machine.txt --csv-x "Standard travel:mm" --csv-y "Standard force:kN"',
)


def command(
    sources: Annotated[list[Path], typer.Argument(metavar="A B…", help="Folders of runs, and files of measurements.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="Plot: png, svg or pdf.")] = Path("compared.png"),
    x: Annotated[str | None, typer.Option("-x", "--x", help="Column of runs: abscissae.")] = None,
    y: Annotated[str | None, typer.Option("-y", "--y", help="Column of runs: ordinates.")] = None,
    csv_x: Annotated[
        str | None, typer.Option(help="Column of the abscissae in files: 'title' or 'title:unit'.")
    ] = None,
    csv_y: Annotated[
        str | None, typer.Option(help="Column of the ordinates in files: 'title' or 'title:unit'.")
    ] = None,
    width: Width = None,
) -> None:
    """Overlay force over displacement of runs and measurements, and list by how much they differ from the first.

    Measured files give their units in the header, such as "force [kN]", or in a line below it. Peak, work and
    difference are those of the range that all curves have in common.
    """
    from cutsim.commands.folders import overlaid, read_sources

    found = read_sources(sources, (x, y), (csv_x, csv_y), width)
    x_range, differences = _differences(found)
    overlaid(found).plot(output)
    screen = console()
    screen.print(differences)
    screen.print(f"{x_range}; each beside the first", f"written: {output}", sep="\n", markup=False)


def _differences(sources: list[Source]) -> tuple[str, Table]:
    """The range that all curves have in common, in words, and peak, work and difference of each over it."""
    import numpy as np

    first = sources[0]
    x, curves = _sampled(sources)
    unit = first.y.unit or "1"
    work = "·".join(f"({u})" if "/" in u else u for u in (first.y.unit, first.x.unit) if u) or "1"
    rows = []
    for source, y in zip(sources, curves, strict=True):
        off = y - curves[0]  # linear between the abscissae
        squares = (off[1:] ** 2 + off[1:] * off[:-1] + off[:-1] ** 2) / 3
        rms = np.sqrt(squares @ np.diff(x) / (x[-1] - x[0]))
        cells = [source.label, source.grade]
        for value, base in ((y.max(), curves[0].max()), (np.trapezoid(y, x), np.trapezoid(curves[0], x))):
            cells += [f"{value:.5g}", f"{value / base - 1:+.2%}" if base and source is not first else ""]
        rows.append([*cells, *([f"{rms:.3g}", f"{rms / curves[0].max():.2%}"] if source is not first else ["", ""])])
    header = ("curve", "verdict", f"peak [{unit}]", "", f"work [{work}]", "", f"rms [{unit}]", "")
    return f"{first.x.label} from {x[0]:.4g} to {x[-1]:.4g}", table(header, rows)


def _sampled(sources: list[Source]) -> tuple[Numbers, list[Numbers]]:
    """Abscissae of all curves in the range that they have in common, and the ordinates of each there.

    Of a curve that goes to and fro it is the first way.
    """
    import numpy as np

    from cutsim.base.checks import require

    curves = []
    for source in sources:
        x, y = source.within(sources[0].x.unit, sources[0].y.unit)
        further = np.flatnonzero(np.diff(np.maximum.accumulate(x), prepend=-np.inf) > 0)
        curves.append((x[further], y[further]))
    low, high = max(x[0] for x, _ in curves), min(x[-1] for x, _ in curves)
    require(f"common range of {sources[0].x.name}", (low, high), bool(low < high), "of some length")
    everywhere = np.unique(np.concatenate([x for x, _ in curves]))
    grid = everywhere[(everywhere >= low) & (everywhere <= high)]
    return grid, [np.interp(grid, x, y) for x, y in curves]
