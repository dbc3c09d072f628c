"""What programs of several small problems share: they run one problem after the other and write what each has found.

Their bodies are those of the tests, in the package `helpers`.
"""

import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated

import typer
from mpi4py import MPI

from cutsim.results.output import claim_folder, write_summary

sys.path.append(str(Path(__file__).parents[1]))

#: A problem: what it has found by name; it is told whether to be quick.
Problem = Callable[[bool], Mapping[str, float]]


def solve(name: str, problems: Mapping[str, Problem]) -> None:
    """Run a program: its options are those of all validation programs.

    Args:
        name: Its name.
        problems: Its problems by name.
    """

    def main(
        only: Annotated[list[str] | None, typer.Option(help=f"problems, by default {', '.join(problems)}")] = None,
        quick: Annotated[bool, typer.Option("--quick", help="coarser meshes")] = False,
        out: Annotated[Path, typer.Option(help="where the numbers go")] = Path("results/validation") / name,
        overwrite: Annotated[bool, typer.Option("--overwrite", help="replace those of an older run")] = False,
    ) -> None:
        comm = MPI.COMM_WORLD
        claim_folder(out, comm, overwrite=overwrite)
        summary = {}
        for problem in only or problems:
            summary[problem] = dict(problems[problem](quick))
            if comm.rank == 0:
                typer.echo(f"{problem}: " + ", ".join(f"{key} {value:.6g}" for key, value in summary[problem].items()))
        unknowns = [int(found["unknowns"]) for found in summary.values() if "unknowns" in found]
        write_summary(out / "summary.json", summary | ({"unknowns": max(unknowns)} if unknowns else {}), comm)

    typer.run(main)
