"""Options that several commands take, and what they set."""

from __future__ import annotations

import inspect
import logging
import sys
from collections.abc import Callable, Iterable, Sequence
from functools import wraps
from inspect import Parameter
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from cutsim.commands import launch
from cutsim.commands.endings import Ending, say

logger = logging.getLogger("cutsim")


class Messages(logging.Handler):
    """Handler that looks up the standard error stream each time: a progress bar replaces it while it is shown."""

    def emit(self, record: logging.LogRecord) -> None:
        """Write a message in a line."""
        print(self.format(record), file=sys.stderr)


def show_messages(level: int) -> None:
    """Show what the package has to say from a level on, and nothing below it."""
    handler = Messages()
    handler.setFormatter(
        logging.Formatter(
            "%(levelname)s: %(message)s" if level > logging.DEBUG else "%(levelname)s: %(name)s: %(message)s"
        )
    )
    logger.handlers[:] = [handler]
    logger.propagate = False
    logger.setLevel(level)


def _louder(count: int) -> int:
    if count:
        show_messages(logging.INFO if count == 1 else logging.DEBUG)
    return count


def _quieter(quiet: bool) -> bool:
    if quiet:
        show_messages(logging.ERROR)
    return quiet


def talking(command: Callable[..., None]) -> Callable[..., None]:
    """A command that also takes ``--verbose`` and ``--quiet``.

    Args:
        command: The command.
    """
    signature = inspect.signature(command, eval_str=True)
    options = {"verbose": (_Verbose, 0), "quiet": (_Quiet, False)}

    @wraps(command)
    def talk(*, verbose: int, quiet: bool, **values: Any) -> None:
        command(**values)

    further = [Parameter(n, Parameter.KEYWORD_ONLY, default=d, annotation=a) for n, (a, d) in options.items()]
    # what typer reads of a function
    talk.__annotations__ |= {name: annotation for name, (annotation, _) in options.items()}
    vars(talk)["__signature__"] = signature.replace(parameters=[*signature.parameters.values(), *further])
    return talk


def quiet() -> bool:
    """Whether nothing is to be said but what is wrong."""
    return logger.level > logging.WARNING


_Verbose = Annotated[
    int,
    typer.Option(
        "--verbose",
        "-v",
        count=True,
        callback=_louder,
        show_default=False,
        metavar="",
        help="Say more: decisions of the run; twice: those of the solvers too.",
    ),
]
_Quiet = Annotated[bool, typer.Option("--quiet", "-q", callback=_quieter, help="Say nothing but what is wrong.")]
Ranks = Annotated[int, typer.Option("-n", "--ranks", min=1, help="MPI ranks on this machine, which are started here.")]
Width = Annotated[
    float | None,
    typer.Option(min=1e-9, help=r"Width of the specimen \[mm]: its force is divided by it, for plane cases."),
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace what an older run has left in the folder.")]


def console() -> Console:
    """Where commands write: a file gets lines of any length."""
    screen = Console(highlight=False, soft_wrap=True)
    if not screen.is_terminal:
        screen.width = 10_000
    return screen


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> Table:
    """A table to be printed as it is, units in brackets too.

    Args:
        header: Heads of the columns.
        rows: Cells of each row.
    """
    found = Table(*map(escape, header), box=None, header_style="bold")
    for row in rows:
        found.add_row(*map(Text, row))
    return found


def on_ranks(ranks: int) -> None:
    """Go on in this process, or start this command anew on several ranks and end as it ends.

    Args:
        ranks: How many; ranks that were started go on.

    Raises:
        typer.Exit: The command has ended on its ranks.
    """
    if ranks > 1 and not launch.started():
        status = launch.run_on_ranks(["-m", "cutsim", *sys.argv[1:]], ranks)
        if status not in set(Ending):
            say(f"a rank has crashed or was killed, all have ended (exit status {status})")
        raise typer.Exit(status if status in set(Ending) else Ending.INTERNAL)
