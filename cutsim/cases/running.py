"""Run of a case in a folder, in which all that belongs to it is found afterwards."""

from __future__ import annotations

import json
import logging
import platform
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import Any

import dolfinx
import numpy as np
from mpi4py import MPI

import cutsim
from cutsim.analysis.stepping import Interrupted
from cutsim.analysis.steps import StepError, StepReport
from cutsim.base.files import replace_file
from cutsim.base.versions import mpi_version, petsc_version
from cutsim.cases.building import Simulation
from cutsim.cases.case import Case
from cutsim.cases.document import places
from cutsim.cases.keys import dotted
from cutsim.cases.refusals import refusing
from cutsim.cases.sizes import mesh_sizes
from cutsim.results.checkpoints import Checkpoints
from cutsim.results.folder import CASE, CHECKPOINTS, SETUP, SUMMARY
from cutsim.results.iteration_table import IterationTable
from cutsim.results.output import claim_folder, on_root
from cutsim.results.presentation import present
from cutsim.results.recording import Recording
from cutsim.results.stage_recorder import Stages

logger = logging.getLogger(__name__)

# keys that may be changed before a run is resumed: they say how, how far and for whom it is computed
_FREE = {"title", "steps", "solver", "output", ("analysis", "until")}


@dataclass(frozen=True)
class RunOutcome:
    """Outcome of a run.

    Attributes:
        folder: Where the files are.
        verdict: "trusted" or "questionable".
        reasons: What speaks against the result.
        error: What ended the run before its time; None if it came to its end.
    """

    folder: Path
    verdict: str
    reasons: tuple[str, ...] = ()
    error: BaseException | None = None


def run_case(
    case: Case,
    folder: Path | str,
    comm: MPI.Comm = MPI.COMM_WORLD,
    *,
    resume: bool = False,
    overwrite: bool = False,
    quiet: bool = False,
) -> RunOutcome:
    """Run a case in a folder. Collective.

    Writes the complete case, the history, fields for ParaView, checkpoints, and at the end, also of a run that fails or
    is interrupted, a summary, plots, pictures and a report.

    Args:
        case: The case.
        folder: Where the files go.
        comm: Communicator of the run.
        resume: Whether the run goes on from the last checkpoint in the folder, if there is one.
        overwrite: Whether the results of an older run in the folder are replaced.
        quiet: Whether no progress is shown.

    Returns:
        How it has ended.

    Raises:
        CaseError: The mesh has not what the case names, or parts do not fit; nothing is written then.
        CheckpointError: The checkpoint is that of another case.
        FileExistsError: The folder has the results of an older run, which are not to be replaced.
    """
    begun, folder = monotonic(), Path(folder)
    if not (resume or overwrite):
        claim_folder(folder, comm, subfolders=False)  # before it is meshed, which may take long
    simulation = case.build(comm)
    checkpoints = Checkpoints(
        folder / CHECKPOINTS, simulation.problem, minutes=case.output.checkpoint_minutes, case=_identity(case)
    )
    time = checkpoints.resume() if resume else None
    if time is None:
        with refusing(case.document, "supports"):
            simulation.problem.check()
    elif time >= simulation.until:  # the run has come to its end
        if comm.rank == 0:
            logger.warning("%s has come to its end: there is nothing to go on with", folder)
        return _outcome(simulation, folder)
    else:
        begun -= comm.bcast(_seconds(folder))
    recording = _recording(simulation, folder, checkpoints, overwrite=overwrite, quiet=quiet)
    on_root(comm, lambda: replace_file(folder / CASE, case.text.encode()))
    if simulation.problem.state.number == 0:
        simulation.draw(folder / SETUP)
    error = _run(simulation, recording)
    try:
        recording.summary(_facts(simulation, recording, monotonic() - begun))
        if case.output.report:
            on_root(comm, lambda: present(folder, animation=case.output.animation))
    except OSError as full:
        error = error or full
    return _outcome(simulation, folder, error)


def _identity(case: Case) -> dict[str, Any]:
    """What a case simulates, by dotted key."""
    leaves = ((keys, value) for keys, value in places(case.document.tables) if not isinstance(value, dict | list))
    return {dotted(keys): value for keys, value in leaves if keys[0] not in _FREE and keys not in _FREE}


def _seconds(folder: Path) -> float:
    """Time that earlier parts of a run have taken, as far as a summary says it [s]."""
    try:
        return float(json.loads((folder / SUMMARY).read_text(encoding="utf-8"))["wall_time"])
    except (OSError, ValueError, KeyError):  # it was killed before it wrote one
        return 0.0


def _outcome(simulation: Simulation, folder: Path, error: BaseException | None = None) -> RunOutcome:
    verdict = simulation.problem.state.verdict
    return RunOutcome(folder, "trusted" if verdict.trusted else "questionable", verdict.reasons, error)


def _recording(
    simulation: Simulation, folder: Path, checkpoints: Checkpoints, *, overwrite: bool, quiet: bool
) -> Recording:
    x, y = simulation.curve
    return Recording(
        folder,
        simulation.problem,
        simulation.until,
        title=simulation.title or "run",
        units=simulation.units,
        show={x: x, y: y},
        extra=simulation.columns,
        derived=simulation.derived,
        every=simulation.every,
        overwrite=overwrite,
        checkpoints=checkpoints,
        quiet=quiet,
        format=simulation.format,
    )


def _run(simulation: Simulation, recording: Recording) -> Exception | KeyboardInterrupt | None:
    """Run to the end; what has ended it before. Collective."""
    problem, until = simulation.problem, simulation.until
    try:
        with (
            recording,
            IterationTable(recording.folder, problem, simulation.units) as iterations,
            Stages(recording.folder, problem, until, units=simulation.units, mirror=simulation.mirror) as stages,
        ):

            def record(report: StepReport) -> None:
                iterations(report)  # before a checkpoint, which counts its rows
                recording(report)
                stages(report)

            simulation.run(record)
    except (Interrupted, StepError, OSError) as error:
        return error
    return None


def _facts(simulation: Simulation, recording: Recording, seconds: float) -> dict[str, Any]:
    """What a summary says of a run beside its verdict. Collective."""
    return {
        "title": simulation.title,
        "curve": list(simulation.curve),
        **_headline(simulation, recording),
        "mesh": mesh_sizes(simulation),
        "ranks": simulation.problem.state.mesh.comm.size,
        "wall_time": seconds,
        "versions": versions(),
    }


def _headline(simulation: Simulation, recording: Recording) -> dict[str, float]:
    """Largest and last ordinate of the curve that tells most."""
    x, y = simulation.curve
    if not {x, y} <= recording.history.keys():
        return {}
    abscissa, ordinate = recording.column(x), recording.column(y)
    largest = int(np.abs(ordinate).argmax())
    return {f"largest_{y}": ordinate[largest], f"{x}_at_largest_{y}": abscissa[largest], f"last_{y}": ordinate[-1]}


def versions() -> dict[str, str]:
    """Versions of what has computed a result."""
    return {
        "cutsim": cutsim.__version__,
        "dolfinx": dolfinx.__version__,
        "PETSc": petsc_version(),
        "MPI": mpi_version(),
        "Python": platform.python_version(),
        "system": platform.platform(),
    }
