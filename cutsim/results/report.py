"""Reports: a run or a sweep as one page that needs nothing else, no network and no other file.

They are made from what runs have left in their folders. What is missing is named; nothing is raised for that.
"""

import base64
import logging
import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from plotly.offline import get_plotlyjs

from cutsim.base.files import replace_file
from cutsim.results.folder import GIF, MP4, REPORT, SETUP, STAGES, has_checkpoint
from cutsim.results.iteration_table import hardest_step
from cutsim.results.overlay import Overlay
from cutsim.results.run_files import RunFiles
from cutsim.results.stages import read_stages
from cutsim.results.turnable import view_json
from cutsim.results.web_plots import columns_json, curves_json, energy_json, heat_json

logger = logging.getLogger(__name__)

_TYPES = {".png": "image/png", ".gif": "image/gif", ".mp4": "video/mp4"}
# entries of a summary that have a place of their own in a report
_PLACED = {
    "verdict", "reasons", "time", "until", "versions", "ranks", "wall_time", "unknowns", "mesh", "curve", "command",
    "title",
}  # fmt: skip

T = TypeVar("T")


def write_report(folder: Path | str) -> Path:
    """Write ``report.html`` from the files of a run. Call it on one rank.

    Args:
        folder: Folder of the run; it may be that of a run which failed, was interrupted or is still under way.

    Returns:
        The page.

    Raises:
        OSError: The page cannot be written.
    """
    run = RunFiles.read(folder)
    missing = list(run.missing)
    stages = _attempt("stages", lambda: [stage.whole() for stage in read_stages(folder)], missing) or []
    pictures = sorted((run.folder / STAGES).glob("[0-9][0-9].png"))
    content = {
        "columns": columns_json(run.history) if run.curve else None,
        "energy": _attempt("energy audit", lambda: energy_json(run.history), missing),
        "view": _attempt("view that can be turned", lambda: view_json(stages), missing),
        "setup": _embedded(_first(run.folder, SETUP)),
        "animation": _embedded(_first(run.folder, MP4, GIF)),
        "pictures": [_embedded(path) for path in pictures],
    }
    resumable = not run.complete and has_checkpoint(run.folder)
    missing += [words for name, words in _MISSED.items() if not content[name]]
    numbers = {name: _number(value) for name, value in run.summary.items() if name not in _PLACED}
    hardest = _attempt("Newton iterations", lambda: hardest_step(folder), missing)
    content["heat"] = _attempt("audit of heat", lambda: heat_json(run.history), missing)
    page = _page(
        "run.html", run=run, tiles=tiles(run), sizes=dict(_sizes(run)), numbers=numbers, missing=missing,
        resumable=resumable, hardest=hardest, **content,
    )  # fmt: skip
    return _written(run.folder / REPORT, page)


#: What a report without some of its content says.
_MISSED = {
    "columns": "there is no curve: the history has no rows",
    "energy": "there is no energy audit",
    "view": "there is no view that can be turned: no stage was recorded",
    "setup": "there is no picture of the set-up",
    "animation": "there is no animation",
    "pictures": "there are no pictures of stages",
}


def write_sweep_report(folder: Path | str, runs: Mapping[Path, Mapping[str, Any]]) -> Path:
    """Write ``report.html`` of a sweep: its runs in a table, their curves in one frame. Call it on one rank.

    Args:
        folder: Folder of the sweep.
        runs: Folder of each run → what it varies, name → value. Runs that failed or have not begun may be among them.

    Returns:
        The page.

    Raises:
        OSError: The page cannot be written.
    """
    read = [(RunFiles.read(path), varied) for path, varied in runs.items()]
    names = list(dict.fromkeys(name for _, varied in read for name in varied))
    varying = [name for name in names if len({str(varied.get(name)) for _, varied in read}) > 1] or names
    labels = [", ".join(f"{name} = {varied.get(name)}" for name in varying) for _, varied in read]
    rows = [
        {"run": run, "values": [varied.get(name, "") for name in names], "link": _link(run.folder, folder)}
        for run, varied in read
    ]
    page = _page(
        "sweep.html",
        title=Path(folder).resolve().name,
        names=names,
        rows=rows,
        overlay=_overlaid(Overlay.of([run for run, _ in read], labels)),
    )
    return _written(Path(folder) / REPORT, page)


def tiles(run: RunFiles) -> dict[str, str]:
    """The numbers by which a run is known: name → number with its unit.

    Args:
        run: The run.
    """
    return dict(_tiles(run))


def _tiles(run: RunFiles) -> Iterator[tuple[str, str]]:
    history = run.history
    if run.curve and run.steps:
        x, y = (history[name] for name in run.curve)
        peak = int(np.abs(y.values).argmax())
        yield f"largest {y.words}", _quantity(y.values[peak], y.unit)
        yield f"at {x.words}", _quantity(x.values[peak], x.unit)
        yield f"last {y.words}", _quantity(y.values[-1], y.unit)
    if run.missed_energy is not None:
        yield "energy missing", f"{100 * run.missed_energy:.2g} %"
    if run.steps:
        yield "steps", str(run.steps)
    if isinstance(wall := run.summary.get("wall_time"), int | float):
        yield "computing time", _duration(wall)


def _sizes(run: RunFiles) -> Iterator[tuple[str, str]]:
    """Sizes of the problem and of the computation."""
    mesh = run.summary.get("mesh")
    yield from {name: _number(size) for name, size in mesh.items()}.items() if isinstance(mesh, Mapping) else ()
    yield from {name: str(run.summary[name]) for name in ("unknowns", "ranks") if name in run.summary}.items()
    yield "steps", str(run.steps)
    if isinstance(wall := run.summary.get("wall_time"), int | float):
        yield "computing time", _duration(wall)


def _quantity(value: float, unit: str) -> str:
    return f"{value:.4g} {unit}".rstrip()


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours} h {minutes} min"
    return f"{minutes} min {rest} s" if minutes else f"{seconds:.3g} s"


def _number(value: Any) -> str:
    """An entry of a summary in words."""
    if isinstance(value, float):
        return f"{value:.5g}"
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {_number(entry)}" for name, entry in value.items())
    return ", ".join(map(_number, value)) if isinstance(value, list) else str(value)


def _attempt(name: str, make: Callable[[], T], missing: list[str]) -> T | None:
    """What can be made; None if it cannot, which is noted."""
    try:
        return make()
    except Exception as error:  # a report shows what there is
        logger.warning("the report is without its %s: %s", name, error)
        missing.append(f"the {name} cannot be shown: {error}")
        return None


def _first(folder: Path, *names: str) -> Path | None:
    return next((folder / name for name in names if (folder / name).is_file()), None)


def _embedded(path: Path | None) -> str | None:
    """A picture or a film as text that stands for its address."""
    if path is None:
        return None
    return f"data:{_TYPES[path.suffix]};base64,{base64.b64encode(path.read_bytes()).decode()}"


def _overlaid(overlay: Overlay | None) -> str | None:
    return None if overlay is None else curves_json(overlay.curves, xlabel=overlay.xlabel, ylabel=overlay.ylabel)


def _link(run: Path, folder: Path | str) -> str:
    return Path(os.path.relpath(run / REPORT, folder)).as_posix()


def _page(template: str, **content: Any) -> str:
    environment = Environment(
        loader=PackageLoader("cutsim.results"), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    environment.filters["tiles"] = tiles
    return environment.get_template(template).render(plotly=get_plotlyjs(), **content)


def _written(path: Path, page: str) -> Path:
    replace_file(path, page.encode())
    return path
