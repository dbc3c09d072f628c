"""``cutsim cases``: the built-in cases."""

from __future__ import annotations

from rich.table import Table

from cutsim.commands.options import console

EXAMPLES = ("cutsim cases", "cutsim run blade --quick", "cutsim new --from blade -o mine.toml")


def command() -> None:
    """List the built-in cases, which run as they are and are copied by `cutsim new --from NAME`."""
    from cutsim.cases import built_in_cases

    table = Table("name", "what it shows", box=None, header_style="bold")
    for name, (title, _) in built_in_cases().items():
        table.add_row(name, title)
    console().print(table)
