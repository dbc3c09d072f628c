"""Checkpoints of a run in a folder, from which it is resumed."""

from collections.abc import Mapping
from pathlib import Path
from time import monotonic
from types import TracebackType
from typing import Any, Self

from mpi4py import MPI

from cutsim.analysis.stepping import Interrupted
from cutsim.analysis.steps import Problem, StepError, StepReport
from cutsim.base.checks import nonnegative, require_number
from cutsim.base.log import collective_logger
from cutsim.base.signatures import checked
from cutsim.results.checkpoint_file import read_checkpoint, write_checkpoint
from cutsim.results.output import on_root

logger = collective_logger(__name__)

#: Checkpoints of a run that are kept.
KEPT = 2


class Checkpoints:
    """Checkpoints of a run, written every few minutes and at its end, also if it fails or is stopped. Collective.

    Give them to `Recording`, or use them as a recorder and context manager by themselves. A script that is to be
    resumed builds its problem, resumes and runs; if there is no checkpoint yet, the run begins at its beginning::

        checkpoints = Checkpoints("results/blade/checkpoint", cut.mechanics)
        checkpoints.resume()
        with Recording("results/blade", cut.mechanics, until, checkpoints=checkpoints) as recording:
            run(cut.mechanics, until, control, recording)

    A checkpoint has all that is remembered from step to step, and may be resumed on another number of ranks. It is
    written beside the older one, which is removed when the new one is safe; the last two are kept.

    Args:
        folder: Folder of their own; it is made when the first one is written.
        problem: The problem.
        minutes: Time between two on the clock on the wall, ≥ 0 [min].
        case: Name → number or words, of what tells the problem from others: a checkpoint with other values is refused,
            as is that of another mesh. What is not named, such as a parameter, may be changed.
    """

    @checked
    def __init__(
        self, folder: Path | str, problem: Problem, *, minutes: float = 10.0, case: Mapping[str, Any] | None = None
    ) -> None:
        require_number("minutes", minutes, nonnegative)
        self.folder, self.problem = Path(folder), problem
        self._seconds, self._case, self._last = 60 * minutes, dict(case or {}), monotonic()
        self._files: list[Path] = []

    def resume(self) -> float | None:
        """Bring the problem to the last state that was saved, if there is one. Call it before recorders are made.

        Returns:
            Its time [time]; None if there is no checkpoint.

        Raises:
            CheckpointError: The checkpoint is that of another case, mesh, problem or version; says what differs.
            OSError: None can be read.
        """
        files = self._comm.bcast(sorted(self.folder.glob("*.h5")))
        for count in range(len(files), 0, -1):
            try:
                read_checkpoint(files[count - 1], self.problem, self._case)
            except OSError as error:
                if count == 1:
                    raise
                logger.warning("%s cannot be read (%s); the one before is taken", files[count - 1], error)
                continue
            self._files = files[:count]
            return self.problem.state.time_old
        return None

    def save(self) -> None:
        """Write a checkpoint of the committed state, if there is none yet.

        Raises:
            OSError: It cannot be written, on all ranks; the older ones are as they were.
        """
        path = self.folder / f"step-{self.problem.state.number:06d}.h5"
        if path not in self._files[-1:]:
            on_root(self._comm, lambda: self.folder.mkdir(parents=True, exist_ok=True))
            write_checkpoint(path, self.problem, self._case)
            self._files = [*self._files, path][-KEPT:]
            on_root(self._comm, lambda: self._keep(self._files))
        self._last = monotonic()

    def due(self) -> bool:
        """Whether it is time to, on the clock of the first rank."""
        return bool(self._comm.bcast(monotonic() - self._last >= self._seconds))

    def begin(self) -> None:
        """Remove checkpoints of older runs from the folder, and write a first one: also a young run can be resumed.

        Raises:
            OSError: It cannot be written, on all ranks.
        """
        on_root(self._comm, lambda: self._keep(self._files))
        self.save()

    def __call__(self, report: StepReport) -> None:
        """Write a checkpoint if it is time to."""
        if self.due():
            self.save()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if ended_together(kind):
            self.save()

    def _keep(self, files: list[Path]) -> None:
        """Remove all other checkpoints, and what runs that were killed while they wrote have left."""
        for path in [*self.folder.glob("*.h5"), *self.folder.glob(".*.part")]:
            if path not in files:
                path.unlink()

    @property
    def _comm(self) -> MPI.Comm:
        comm: MPI.Comm = self.problem.state.mesh.comm
        return comm


def ended_together(kind: type[BaseException] | None) -> bool:
    """Whether a block has ended in a way that all ranks are known to have met."""
    return kind is None or issubclass(kind, StepError | Interrupted)
