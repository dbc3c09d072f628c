"""All that is shown of a run when it has ended: plots, pictures, animation and report."""

import logging
from pathlib import Path

from cutsim.base.signatures import checked
from cutsim.results.animation import animate, draw_stages
from cutsim.results.overlay import Overlay
from cutsim.results.plots import plot_energy
from cutsim.results.report import write_report
from cutsim.results.run_files import RunFiles

logger = logging.getLogger(__name__)


@checked
def present(folder: Path | str, *, animation: bool = True) -> Path:
    """Draw what a run has left in its folder, and write its report. Call it on one rank.

    Writes ``force.png`` and ``energy.png`` (and both as PDF, for a paper), pictures of four stages, the animation, and
    ``report.html``, as far as the run has come. What cannot be drawn is logged as a warning and named in the report.

    Args:
        folder: Folder of the run; it may be that of a run which failed or was interrupted.
        animation: Whether there is one.

    Returns:
        The report.

    Raises:
        OSError: The report cannot be written.
    """
    run = RunFiles.read(folder)
    try:
        plot_run(run)
    except Exception as error:  # a plot is never worth a run
        logger.warning("the plots of %s were not drawn: %s", folder, error)
    draw_stages(folder)
    if animation:
        animate(folder)
    return write_report(folder)


def plot_run(run: RunFiles) -> list[Path]:
    """Plot the main curve of a run and its energy audit, each as PNG and as PDF. Call it on one rank.

    Args:
        run: Files of the run.

    Returns:
        The plots: ``force.png`` and so on; none where the history has no such columns or no rows.
    """
    made: list[Path] = []
    overlay = Overlay.of([run], [""]) if run.steps else None
    history = {name: column.values for name, column in run.history.items()}
    audit = run.steps and {"time", "work_external", "energy_closure"} <= set(history)
    for suffix in ("png", "pdf"):
        if overlay is not None:
            overlay.plot(run.folder / f"force.{suffix}", run.title)
            made.append(run.folder / f"force.{suffix}")
        if audit:
            time, unit = run.history["time"], run.history["work_external"].unit
            plot_energy(run.folder / f"energy.{suffix}", history, xlabel=time.label, unit=unit)
            made.append(run.folder / f"energy.{suffix}")
    return made
