"""The command `cutsim`."""

from __future__ import annotations

import logging
import os
from itertools import takewhile
from types import ModuleType
from typing import Annotated, Any

import typer
from rich.markup import escape
from typer.core import TyperGroup

import cutsim
from cutsim.commands import (
    animate,
    cases,
    check,
    compare,
    doctor,
    fit,
    fit_material,
    import_model,
    launch,
    new,
    plot,
    report,
    resume,
    run,
    sweep,
    validate,
)
from cutsim.commands.endings import endings
from cutsim.commands.options import show_messages, talking

#: Heading of the help → commands: name → module with the function `command` and its `EXAMPLES`.
COMMANDS: dict[str, dict[str, ModuleType]] = {
    "Begin": {"cases": cases, "new": new, "import": import_model, "check": check},
    "Simulate": {"run": run, "resume": resume, "sweep": sweep},
    "Look at results": {"plot": plot, "compare": compare, "report": report, "animate": animate},
    "Find parameters": {"fit": fit, "fit-material": fit_material},
    "Help": {"doctor": doctor, "validate": validate},
}


class _Commands(TyperGroup):
    """The commands, whose errors end the program as its exit codes say."""

    def invoke(self, ctx: Any) -> Any:
        with endings():
            return super().invoke(ctx)


def _version(asked: bool) -> None:
    if asked:
        print(f"cutsim {cutsim.__version__}")
        raise typer.Exit


def prepare(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and end.")
    ] = False,
) -> None:
    """Cutting, tearing and penetration of soft solids by blades and needles: simulate a case, look at it, fit it.

    A case is a file that says all of a simulation; `cutsim cases` lists those that come with the program.
    """
    os.environ.update(launch.environment())  # before a library that starts threads is loaded
    show_messages(logging.WARNING)


app = typer.Typer(
    name="cutsim",
    cls=_Commands,
    callback=prepare,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Exit codes: 0 trusted, 1 questionable, 2 bad input, 3 no equilibrium, 4 cannot write, 130 interrupted.",
)


def _help(module: ModuleType) -> str:
    """What a command is for: its docstring, of which each paragraph is a line, up to its sections."""
    paragraphs = [" ".join(lines.split()) for lines in (module.command.__doc__ or "").split("\n\n")]
    return escape("\n\n".join(takewhile(lambda text: not text.startswith(("Args:", "Raises:")), paragraphs)))


for panel, commands in COMMANDS.items():
    for name, module in commands.items():
        epilog = "\n\n".join(["[bold]Examples[/bold]", *(f"  $ {example}" for example in module.EXAMPLES)])
        app.command(name, help=_help(module), epilog=epilog, rich_help_panel=panel)(talking(module.command))


def main() -> None:
    """Run the command as the arguments of the program say."""
    app(prog_name="cutsim")
