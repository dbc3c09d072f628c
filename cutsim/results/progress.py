"""Progress of a run: a bar on a terminal, otherwise a plain line from time to time."""

from __future__ import annotations

import os
import time
from types import TracebackType
from typing import Any, Self

from mpi4py import MPI
from rich.console import Console
from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.progress import Progress as Bar

from cutsim.base.checks import require


class Progress:
    """Progress over the time of the run, shown by the first rank.

    A terminal gets a bar with the numbers of the current step and the time to go; a file or a CI log gets one
    plain line every few seconds and the last one. Use it as a context manager: the terminal is restored also
    after an error or Ctrl-C, which pass through.

    Args:
        end: Value of the load parameter at which the run is done.
        comm: Communicator of the run.
        title: What is running, in a word or two.
        start: Value of the load parameter at which the run begins, or from which a resumed run goes on.
        console: Where to write; standard output by default.
        interval: Seconds between plain lines.
        quiet: Whether nothing is shown.

    Raises:
        ValueError: If the end does not come after the start.
    """

    def __init__(
        self,
        end: float,
        comm: MPI.Comm,
        title: str = "run",
        *,
        start: float = 0.0,
        console: Console | None = None,
        interval: float = 5.0,
        quiet: bool = False,
    ) -> None:
        require("end", end, end > start, f"greater than start = {start}")
        self._start, self._end, self._title, self._interval = start, end, title, interval
        self._active = comm.rank == 0 and not quiet
        self._console = console or Console(highlight=False, soft_wrap=True)
        self._line, self._printed, self._last = "", "", -float("inf")
        self._bar: Bar | None = None

    def update(self, t: float, **info: float | str) -> None:
        """Show how far the run is.

        Args:
            t: Load parameter reached.
            **info: What to show, in this order, such as ``step=3, force=1.2, iterations=6, cuts=0``.
        """
        if not self._active:
            return
        text = "  ".join(f"{name} {_short(value)}" for name, value in {"t": t, **info}.items())
        if self._bar is not None:
            self._bar.update(self._task, completed=t, info=text)
            return
        share = t / self._end
        self._line = f"{self._title}: {share:4.0%}  {text}"
        if time.monotonic() - self._last >= self._interval:
            self._print()

    def say(self, text: str) -> None:
        """Write a line beside the progress."""
        if self._active:
            self._console.print(text, markup=False)

    def __enter__(self) -> Self:
        if self._active and self._console.is_terminal and os.environ.get("TTY_COMPATIBLE") != "0":
            self._bar = Bar(
                TextColumn("{task.description}"),
                BarColumn(),
                TaskProgressColumn(),
                TimeElapsedColumn(),
                TimeRemainingColumn(),
                TextColumn("{task.fields[info]}"),
                console=self._console,
            )
            begun: Any = self._start  # rich counts in numbers of any kind, whatever it says of them
            self._task = self._bar.add_task(self._title, completed=begun, total=self._end, info="")
            self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.stop()
        elif self._active and self._line != self._printed:
            self._print()

    def _print(self) -> None:
        self._console.print(self._line, markup=False)
        self._printed, self._last = self._line, time.monotonic()


def _short(value: float | str) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
