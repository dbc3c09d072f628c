"""``cutsim cases``: the built-in cases."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from cutsim.commands.options import console, table

EXAMPLES = (
    "cutsim cases",
    "cutsim run blade --quick",
    "cutsim new --from blade -o mine.toml",
    "cutsim cases --schema > case.schema.json",
)


def command(
    schema: Annotated[
        bool, typer.Option("--schema", help="Print the JSON schema of case files instead, for editors.")
    ] = False,
) -> None:
    """List the built-in cases, which run as they are and are copied by `cutsim new --from NAME`."""
    from cutsim.cases import built_in_cases

    if schema:
        from cutsim.cases import case_schema  # loads all of the package

        print(json.dumps(case_schema(), indent=1, ensure_ascii=False))
        return
    rows = [(name, title) for name, (title, _) in built_in_cases().items()]
    console().print(table(("name", "what it shows"), rows))
