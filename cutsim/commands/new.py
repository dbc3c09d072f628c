"""``cutsim new``: a case file of one's own, from a built-in case."""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cutsim.commands.case_files import case_path, complete, free_path
from cutsim.commands.options import Overwrite, console

if TYPE_CHECKING:
    from tomlkit import TOMLDocument

EXAMPLES = ("cutsim new", "cutsim new --from blade", "cutsim new --from needle -o mine.toml")
#: Tables whose values are asked for, if their lines say what they are.
_ASKED = ("material", "law", "body", "tool", "insertion")


def command(
    source: Annotated[
        str | None, typer.Option("--from", metavar="NAME", help="Copy this built-in case.", autocompletion=complete)
    ] = None,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="The file; NAME.toml by default.")] = None,
    overwrite: Overwrite = False,
) -> None:
    """Write a case file: a copy of a built-in case, or one by a few questions.

    Each line that you would change has a comment that says what it is.
    """
    file = case_path(source or _choice())
    path = free_path(output or Path(file.name), overwrite=overwrite)
    text = file.read_text(encoding="utf-8")
    path.write_text(text if source else _answered(file, text), encoding="utf-8")
    console().print(f"written: {path}", f"next: cutsim check {path}, then cutsim run {path}", sep="\n", markup=False)


def _choice() -> str:
    """Name of the built-in case to begin with, as asked."""
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise typer.BadParameter("without a terminal nothing is asked: name a built-in case", param_hint="--from")
    import questionary

    from cutsim.cases import built_in_cases

    choices = [questionary.Choice(f"{name}: {title}", name) for name, (title, _) in built_in_cases().items()]
    return str(questionary.select("Which case is most like yours?", choices).unsafe_ask())


def _answered(file: Path, text: str) -> str:
    """The text of a case file with the values as asked, each checked in the file as a whole."""
    import questionary
    import tomlkit

    from cutsim.cases import CaseError, read_case

    document = tomlkit.parse(text)
    answers: dict[str, str] = {}
    for key, value, words in _questions(document):

        def valid(answer: str, key: str = key) -> bool | str:
            try:
                read_case(file, {**answers, key: answer})
            except CaseError as error:
                return error.problems[0].partition(f": {key}: ")[2] or error.problems[0]
            return True

        answers[key] = str(questionary.text(f"{key} ({words})", default=value, validate=valid).unsafe_ask())
    for key, answer in answers.items():
        table, _, name = key.rpartition(".")
        entries: Any = document[table] if table else document
        entries[name] = _value(answer)
    return tomlkit.dumps(document)


def _questions(document: TOMLDocument) -> Iterator[tuple[str, str, str]]:
    """Key, value as it is written and explanation of what is asked: the title, and lines with a comment."""
    yield "title", str(document["title"]), "what is simulated, in a few words"
    for table in _ASKED:
        entries: Any = document.get(table, {})
        for key, item in entries.items():
            words = item.trivia.comment.lstrip("# ") if hasattr(item, "trivia") else ""
            if words and key not in ("model", "shape"):
                yield f"{table}.{key}", str(item) if isinstance(item, str) else item.as_string(), words


def _value(answer: str) -> Any:
    """An answer as a value of TOML: a text needs no quotes."""
    with suppress(ValueError):
        return tomllib.loads(f"value = {answer}")["value"]
    return answer
