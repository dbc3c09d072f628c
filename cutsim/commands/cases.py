"""``cutsim cases``: the built-in cases."""

from __future__ import annotations

from rich.table import Table

from cutsim.commands.case_files import built_in
from cutsim.commands.options import console

EXAMPLES = ("cutsim cases", "cutsim run blade --quick", "cutsim new --from blade -o mine.toml")


def command() -> None:
    """List the built-in cases, which run as they are and are copied by `cutsim new --from NAME`."""
    table = Table("name", "what it shows", box=None, header_style="bold")
    for case in built_in().values():
        table.add_row(case.name, case.title)
    console().print(table)
