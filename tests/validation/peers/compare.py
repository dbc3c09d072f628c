"""Solve the same problems with cutsim and with other programs, and keep what each has found.

Looks for each program where it may be: for modules of Python in this one, in the system's and in those that are given,
for commands on the path.  What is not installed is said, and its former results stay.  Then ``cutsim validate --page``
shows them.
"""

import json
import shutil
import subprocess
import sys
from datetime import UTC, datetime
from os import cpu_count, environ
from pathlib import Path
from typing import Annotated

import typer

import cutsim
from cutsim.commands.launch import environment
from cutsim.validation.peers import Comparisons, Program, Solution

HERE = Path(__file__).parent


class NotInstalledError(Exception):
    """A program is not installed; says what it has said."""


def command(program: Program, pythons: list[str]) -> list[str]:
    """What runs the script of a program.

    Raises:
        NotInstalledError: It is not installed.
    """
    ours = [sys.executable, "-m", "cutsim.commands.launch", "-n", "1"]
    if program.command and shutil.which(program.command) is None:
        raise NotInstalledError(f"there is no command {program.command}")
    if not program.module:
        return ours
    said = "no Python was tried"
    for python in pythons:
        done = subprocess.run(
            [python, "-c", f"import {program.module}"], capture_output=True, text=True, env=foreign(), check=False
        )
        if done.returncode == 0:
            return [python]
        said = f"{python}: {(done.stderr.strip().splitlines() or ['no message'])[-1]}"
    raise NotInstalledError(said)


def foreign() -> dict[str, str]:
    """Environment of another Python: one thread, and nothing of ours."""
    kept = {name: value for name, value in environ.items() if name not in ("PYTHONPATH", "LD_LIBRARY_PATH")}
    return kept | {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL")}


def solve(folder: Path, problem: str, program: Program, pythons: list[str]) -> Solution:
    """Run the script of a program.

    Raises:
        NotInstalledError: It is not installed.
        RuntimeError: The script has failed.
    """
    start = command(program, pythons)
    variables = foreign() if program.module else environment()
    script = str(folder / program.script)
    done = subprocess.run([*start, script], capture_output=True, text=True, env=variables, check=False)
    if done.returncode:
        raise RuntimeError(f"{program.script} has failed:\n{done.stderr[-2000:]}")
    found = json.loads(done.stdout.strip().splitlines()[-1])
    version = found.pop("version", cutsim.__version__)
    made = f"{datetime.now(UTC).date().isoformat()}, {program.name} {version}, {cpu_count()} cores"
    return Solution(problem=problem, program=program.name, made=made, **found)


def main(
    only: Annotated[list[str] | None, typer.Option(help="problems; by default all")] = None,
    python: Annotated[list[str] | None, typer.Option(help="interpreters in which to look for modules")] = None,
    folder: Annotated[Path, typer.Option(help="folder of the problems and their scripts")] = HERE,
    data: Annotated[Path, typer.Option(help="file of what was found")] = HERE.parent / "peers.json",
) -> None:
    """Run all programs, one after the other, and keep what they have found."""
    pythons = [*(python or []), sys.executable, "/usr/bin/python3"]
    comparisons = Comparisons.read(folder / "problems.toml", data)
    for problem in comparisons.problems:
        for program in problem.program if not only or problem.name in only else ():
            try:
                solution = solve(folder, problem.name, program, pythons)
            except NotInstalledError as missing:
                typer.echo(f"{problem.name}, {program.name}: not installed ({missing}); its former results stay")
                continue
            typer.echo(f"{problem.name}, {program.name}: {dict(solution.values)}, {solution.seconds:.1f} s")
            comparisons = comparisons.with_solution(solution)
            comparisons.write(data)


if __name__ == "__main__":
    typer.run(main)
