"""How a command ends: exit codes, and errors said in a line."""

from __future__ import annotations

import logging
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from enum import IntEnum
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:  # its package loads dolfinx
    from cutsim.cases.running import RunOutcome

logger = logging.getLogger(__name__)


class Ending(IntEnum):
    """Exit codes of the command."""

    TRUSTED = 0
    QUESTIONABLE = 1
    BAD_INPUT = 2
    NO_EQUILIBRIUM = 3
    CANNOT_WRITE = 4
    INTERNAL = 70
    INTERRUPTED = 130

    @property
    def words(self) -> str:
        """How the command has ended, in a word or two."""
        return self.name.lower().replace("_", " ")


@contextmanager
def endings() -> Iterator[None]:
    """End the command by its exit code where it raises; an error of the user is said in plain words alone.

    Raises:
        typer.Exit: In place of what is raised within.
    """
    try:
        yield
    except (typer.Exit, typer.Abort, typer.TyperException, BrokenPipeError):  # typer ends the program
        raise
    except KeyboardInterrupt:
        say("interrupted")
        raise typer.Exit(Ending.INTERRUPTED) from None
    except Exception as error:
        ending = ending_of(error)
        if ending is Ending.INTERNAL:
            say("".join(traceback.format_exception(error)) + "This is a fault of cutsim itself: please report it.")
        else:
            say(_words(error))
            logger.debug("this ended the command", exc_info=error)
        raise typer.Exit(ending) from error


def _words(error: Exception) -> str:
    """What an error says; one of the operating system without its number."""
    if isinstance(error, OSError) and error.filename and error.strerror:
        return f"{error.filename}: {error.strerror.lower()}"
    return str(error)


def ending_of(error: BaseException) -> Ending:
    """The exit code that an error stands for; what is none of the user's is a fault of the program."""
    kinds = {kind.__name__ for kind in type(error).__mro__}
    if "StepError" in kinds:  # by name, as the next: their module loads dolfinx
        return Ending.NO_EQUILIBRIUM
    if "Interrupted" in kinds:
        return Ending.INTERRUPTED
    if isinstance(error, OSError):
        return Ending.BAD_INPUT if isinstance(error, _NOT_AS_NAMED) else Ending.CANNOT_WRITE
    return Ending.BAD_INPUT if isinstance(error, ValueError) else Ending.INTERNAL


def ending_of_run(outcome: RunOutcome) -> Ending:
    """The exit code for a run, which may have been ended by an error."""
    if outcome.error is not None:
        return ending_of(outcome.error)
    return Ending.TRUSTED if outcome.verdict == "trusted" else Ending.QUESTIONABLE


#: A file that the user has named is not there, or of another kind, or would be lost.
_NOT_AS_NAMED = (FileNotFoundError, FileExistsError, IsADirectoryError, NotADirectoryError)


def say(words: str) -> None:
    """Write a line to the standard error stream, once for all ranks."""
    if first_rank():
        print(words, file=sys.stderr)


def first_rank() -> bool:
    """Whether this process is the one that speaks: the first of an MPI run, or the only one."""
    mpi = sys.modules.get("mpi4py.MPI")
    return mpi is None or mpi.COMM_WORLD.rank == 0
