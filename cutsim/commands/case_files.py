"""Case files by path or by the name of a built-in case, and changes of their values."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Annotated

import typer


def case_path(case: str) -> Path:
    """Path of a case file.

    Args:
        case: A path, or the name of a built-in case; a file of this name goes first.

    Raises:
        FileNotFoundError: There is neither.
    """
    if Path(case).is_file():
        return Path(case)
    from cutsim.cases import built_in_cases

    known = built_in_cases()
    if case in known:
        return known[case][1]
    near = difflib.get_close_matches(case, known, n=1)
    words = f"; did you mean {near[0]}?" if near else ""
    raise FileNotFoundError(f"{case} is neither a file nor a built-in case (cutsim cases lists those){words}")


def free_path(path: Path, *, overwrite: bool) -> Path:
    """A path that may be written.

    Raises:
        FileExistsError: There is such a file, which is not to be overwritten.
    """
    if path.exists() and not overwrite:
        raise FileExistsError(f"{path} exists: name another file by -o, or have it replaced by --overwrite")
    return path


def settings(changes: Iterable[str], option: str = "--set") -> dict[str, str]:
    """Changes by key.

    Args:
        changes: Such as "tool.friction=0.3".
        option: The option by which they were given.

    Raises:
        typer.BadParameter: One is not of the form key=value.
    """
    return dict(_split(change, option) for change in changes)


def _split(text: str, option: str) -> tuple[str, str]:
    key, equals, value = text.partition("=")
    if not (equals and key.strip() and value.strip()):
        raise typer.BadParameter(
            f"{text!r} must be of the form key=value, such as tool.friction=0.3", param_hint=option
        )
    return key.strip(), value.strip()


def short_names(keys: Sequence[str]) -> dict[str, str]:
    """The last part of each key, or all of it where the last parts would be the same."""
    last = [key.rpartition(".")[2] for key in keys]
    return {key: name if last.count(name) == 1 else key for key, name in zip(keys, last, strict=True)}


def file_name(text: str) -> str:
    """A text as a part of a file name."""
    return re.sub(r"[^\w.+=,-]+", "-", text).strip("-")


def complete(incomplete: str) -> list[str]:
    """Names of built-in cases and of case files that begin so, for the completion of the shell."""
    from cutsim.cases import built_in_cases

    files = [str(path) for path in Path().glob(f"{incomplete}*.toml")]
    return [name for name in (*built_in_cases(), *files) if name.startswith(incomplete)]


CaseArgument = Annotated[
    str, typer.Argument(metavar="CASE", help="A case file, or the name of a built-in case.", autocompletion=complete)
]
Changes = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Another value: tool.friction=0.3. Repeat it."),
]
Quick = Annotated[bool, typer.Option("--quick", help="A coarser mesh and a shorter run, as the case says itself.")]
