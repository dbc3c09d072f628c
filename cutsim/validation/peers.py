"""The same problem in several programs: what each has found, kept as data, and the section of the page made of it."""

import json
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Self

from cutsim.base.files import replace_file

#: Program against which the others are shown.
OURS = "cutsim"


@dataclass(frozen=True)
class Program:
    """A program that solves a problem.

    Attributes:
        name: Its name.
        script: Script beside the file of problems that solves it; its last line is a table in JSON with ``values``,
            ``iterations``, ``seconds`` of processor time and ``unknowns``.
        module: Module of Python that the script needs; empty for one that runs with cutsim.
        command: Command that the script calls, if it calls one.
    """

    name: str
    script: str
    module: str = ""
    command: str = ""


@dataclass(frozen=True)
class Problem:
    """A problem and the programs that solve it.

    Attributes:
        name: Its name.
        what: What it is, for a reader of the page.
        unit: Unit of each value, by the name of the value.
        program: The programs, ours first.
    """

    name: str
    what: str
    unit: Mapping[str, str]
    program: tuple[Program, ...]


@dataclass(frozen=True)
class Solution:
    """What a program has found.

    Attributes:
        problem: Name of the problem.
        program: Name of the program.
        values: What is compared, as far as the program has come.
        iterations: Iterations of its Newton method, all steps together; None if it does not say.
        seconds: Processor time of the solution, without meshing and compilation [s].
        unknowns: Unknowns.
        made: Version, date and machine.
    """

    problem: str
    program: str
    values: Mapping[str, float]
    iterations: int | None
    seconds: float
    unknowns: int
    made: str


@dataclass(frozen=True)
class Comparisons:
    """Problems and what programs have found.

    Attributes:
        problems: The problems.
        solutions: What was found, by the names of problem and program.
    """

    problems: Sequence[Problem]
    solutions: Mapping[tuple[str, str], Solution]

    @classmethod
    def read(cls, problems: Path, solutions: Path) -> Self:
        """Read both; nothing is compared without a file of problems, and nothing found without one of solutions.

        Args:
            problems: File of problems, ``problems.toml``.
            solutions: File that `write` has written.
        """
        tables = tomllib.loads(problems.read_text(encoding="utf-8"))["problem"] if problems.exists() else []
        found = [
            Problem(t["name"], t["what"], t["unit"], tuple(Program(**program) for program in t["program"]))
            for t in tables
        ]
        entries = json.loads(solutions.read_text(encoding="utf-8")) if solutions.exists() else []
        return cls(found, {(e["problem"], e["program"]): Solution(**e) for e in entries})

    def with_solution(self, solution: Solution) -> Self:
        """The same with one more solution, in the order of the problems; those of problems that are gone are left out.

        Args:
            solution: What a program has found; it replaces what the program had found before.
        """
        known = {**self.solutions, (solution.problem, solution.program): solution}
        keys = [(problem.name, program.name) for problem in self.problems for program in problem.program]
        return type(self)(self.problems, {key: known[key] for key in keys if key in known})

    def write(self, path: Path) -> None:
        """Write the solutions in one go.

        Args:
            path: The file.
        """
        text = json.dumps([asdict(solution) for solution in self.solutions.values()], indent=1, ensure_ascii=False)
        replace_file(path, (text + "\n").encode())

    def section(self) -> str:
        """The section of the page; empty if there are no problems."""
        return "\n\n".join(text for problem in self.problems for text in (problem.what.strip(), self._table(problem)))

    def _table(self, problem: Problem) -> str:
        names = [f"{name} [{unit}]" if unit else name for name, unit in problem.unit.items()]
        head = ["program", *names, "farthest from cutsim", "unknowns", "iterations", "processor time [s]", "made"]
        lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
        ours = self.solutions.get((problem.name, OURS))
        for program in problem.program:
            found = self.solutions.get((problem.name, program.name))
            cells = ["not run"] + [""] * (len(head) - 2) if found is None else _cells(problem, found, ours)
            lines.append("| " + " | ".join([program.name, *cells]) + " |")
        return "\n".join(lines)


def _cells(problem: Problem, found: Solution, ours: Solution | None) -> list[str]:
    values = [f"{found.values[name]:.5g}" if name in found.values else "not reached" for name in problem.unit]
    off = ""
    if ours is not None and found is not ours:
        off = f"{100 * max(abs(value / ours.values[name] - 1) for name, value in found.values.items()):.2g} %"
    iterations = "" if found.iterations is None else str(found.iterations)
    return [*values, off, str(found.unknowns), iterations, f"{found.seconds:.1f}", found.made]
