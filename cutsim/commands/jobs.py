"""Runs as processes of their own, started through submitit on this machine or on a cluster."""

from __future__ import annotations

import logging
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from threading import Event, Lock
from types import FrameType
from typing import TYPE_CHECKING, Any

from cutsim.commands.endings import Ending

if TYPE_CHECKING:
    import submitit

logger = logging.getLogger(__name__)
#: Longest time of a run on this machine [min]; that on a cluster is the user's choice.
_ENDLESS = 60 * 24 * 365
#: Exit status of a run that is told to end before it has begun.
_ENDED_AT_ONCE = 128 + signal.SIGTERM


@dataclass(frozen=True)
class Job:
    """A Python program that fills a folder.

    Attributes:
        folder: The folder; what the program says goes to log.txt in it.
        arguments: Arguments of Python.
    """

    folder: Path
    arguments: tuple[str, ...]

    @property
    def log(self) -> Path:
        """What the program has said."""
        return self.folder / "log.txt"

    @property
    def pid(self) -> Path:
        """Number of the process while it runs."""
        return self.folder / "pid"

    def run(self) -> int:
        """Run the program, out of the reach of a terminal's Ctrl-C; its exit status."""
        self.folder.mkdir(parents=True, exist_ok=True)
        with self.log.open("w", encoding="utf-8") as log:
            process = subprocess.Popen(
                [sys.executable, *self.arguments],
                stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT, start_new_session=True,
            )  # fmt: skip
        self.pid.write_text(str(process.pid))
        status = process.wait()
        self.pid.unlink()
        return status if status >= 0 else 128 - status

    def interrupt(self) -> None:
        """Ask the program, if it runs on this machine, to end after its step."""
        with suppress(OSError, ValueError):
            os.kill(int(self.pid.read_text()), signal.SIGTERM)


@dataclass
class Runner:
    """Runner of jobs.

    Args:
        folder: Where submitit keeps its files.
        workers: Jobs at once.
        cluster: "local", or "slurm" and what else submitit knows.
        options: Its options for the cluster, such as ``{"slurm_partition": "main"}``.
    """

    folder: Path
    workers: int
    cluster: str
    options: Mapping[str, Any]
    _stopped: Event = field(default_factory=Event)
    _lock: Lock = field(default_factory=Lock)

    def run(self, jobs: Sequence[Job], done: Callable[[Job, int], None]) -> None:
        """Run all of them; Ctrl-C and SIGTERM end those that run on this machine after their step, and start no more.

        Args:
            jobs: The jobs.
            done: Called with each job and its exit status as it ends.
        """
        executor = self._executor()
        with self._interruptible(jobs), ThreadPoolExecutor(self.workers) as pool:
            futures = {pool.submit(self._submit, executor, job): job for job in jobs}
            for future in as_completed(futures):
                done(futures[future], future.result())

    def _executor(self) -> submitit.AutoExecutor:
        import submitit

        logging.getLogger("submitit").setLevel(logging.WARNING)
        executor = submitit.AutoExecutor(folder=self.folder, cluster=self.cluster)
        # its processes share the terminal with this one, which ends them in order
        local = {"timeout_min": _ENDLESS, "local_setup": ["trap '' INT"]} if self.cluster == "local" else {}
        executor.update_parameters(**local, **self.options)
        return executor

    def _submit(self, executor: submitit.AutoExecutor, job: Job) -> int:
        """Exit status of a job once it has ended."""
        if self._stopped.is_set():
            return Ending.INTERRUPTED
        try:
            with self._lock:
                submitted = executor.submit(job.run)
            status = int(submitted.result())
        except Exception as error:  # whatever submitit or the cluster has met
            logger.error("%s did not run: %s", job.folder, str(error).strip().splitlines()[-1])
            return Ending.INTERNAL
        begun = status != _ENDED_AT_ONCE or not self._stopped.is_set()
        return status if begun else Ending.INTERRUPTED

    @contextmanager
    def _interruptible(self, jobs: Sequence[Job]) -> Iterator[None]:
        def stop(number: int, frame: FrameType | None) -> None:
            logger.warning("%s: runs end after their steps, no more are started", signal.Signals(number).name)
            self._stopped.set()
            for job in jobs if self.cluster == "local" else ():
                job.interrupt()

        previous = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
        try:
            yield
        finally:
            for number, handler in previous.items():
                signal.signal(number, handler)
