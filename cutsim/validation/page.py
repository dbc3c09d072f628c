"""The page on validation, and rows of other pages, made of what was found."""

import re
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from functools import partial

from cutsim.validation.peers import Comparisons
from cutsim.validation.results import Findings, Result
from cutsim.validation.rows import Group, Row, Run

#: What stands above this mark in the page is written by hand.
MARK = "<!-- What follows is written by cutsim validate. -->\n"
#: Figure of the page, in the folder of the pages.
FIGURE = "figures/validation.png"
_CAPTION = (
    "*Left: error of each row over what it is allowed. Right, in the colours of the left: how the errors of rows fall "
    "that were made on finer and finer meshes, or with smaller and smaller steps. Lines that stay level are of errors "
    "that are not of the mesh.*"
)
_HEAD = (
    "| what | expected | computed, coarse to fine | error | allowed | source | run |\n"
    "|---|---|---|---|---|---|---|\n"
)  # fmt: skip
_PEERS = (
    "Each problem was solved by all programs on one machine, one after the other, each on one thread. Processor times "
    "are those of the solution, without meshing and compilation. `tests/validation/peers/compare.py` runs all that are "
    "installed."
)
_EXCERPT = re.compile(r"(<!-- validation: ([A-Za-z0-9/, -]+) -->\n).*?(<!-- end of validation -->\n)", re.DOTALL)


def page(head: str, groups: Sequence[Group], found: Findings, peers: Comparisons) -> str:
    """The page, whose head is kept.

    Args:
        head: The page as it is, or what is to stand above the mark.
        groups: The rows.
        found: What was found for them.
        peers: The same problems in several programs.
    """
    parts = [head.split(MARK)[0] + MARK, _summary(groups, found), f"![Errors of all rows]({FIGURE})", _CAPTION]
    for group in groups:
        parts += [f"## {group.title}", group.text] if group.text else [f"## {group.title}"]
        parts.append(_HEAD + "".join(line for run in group.run for line in _lines(run, found)))
    if peers.problems:
        parts += ["## Beside other programs", _PEERS, peers.section()]
    return "\n\n".join(part.strip() for part in parts) + "\n"


def with_excerpts(text: str, groups: Sequence[Group], found: Findings) -> str:
    """A page in which tables between marks, ``<!-- validation: run/row, … -->``, are made anew.

    Args:
        text: The page.
        groups: The rows.
        found: What was found for them.

    Raises:
        KeyError: A mark names a row that there is not.
    """
    return _EXCERPT.sub(partial(_excerpt, rows=dict(keyed(groups)), found=found), text)


def keyed(groups: Sequence[Group]) -> Iterator[tuple[str, Row]]:
    """All rows with the names of their runs before their own."""
    for group in groups:
        for run in group.run:
            for row in run.row:
                yield f"{run.name}/{row.name}", row


def _excerpt(match: re.Match[str], rows: dict[str, Row], found: Findings) -> str:
    lines = ["| what | computed | expected | source |", "|---|---|---|---|"]
    for key in (key.strip() for key in match[2].split(",")):
        row, result = rows[key], found.results.get(key)
        computed = "not run" if result is None else _values(row, result)
        lines.append(f"| {row.what} | {computed} | {_number(row.expected, row.unit)} | {row.source} |")
    return match[1] + "\n".join(lines) + "\n" + match[3]


def _summary(groups: Sequence[Group], found: Findings) -> str:
    """How many rows are inside, which are not, and what they were made with."""
    keys = [key for key, _ in keyed(groups)]
    results = [found.results[key] for key in keys if key in found.results]
    inside, minutes = sum(result.inside for result in results), _total(results) / 60
    missing, made = len(keys) - len(results), Counter(result.made for result in results)
    words = f"{inside} of {len(keys)} rows are within their tolerance"
    words += f", {len(results) - inside} are outside" if len(results) > inside else ""
    words += f", {missing} have not been run" if missing else ""
    versions = "; ".join(f"{number} on {words}" for words, number in sorted(made.items())) or "none"
    return f"{words}. All runs together take {minutes:.0f} minutes of processor time. Rows were made: {versions}."


def _total(results: Sequence[Result]) -> float:
    """Time of all runs, each counted once."""
    return sum({result.key.split("/")[0]: result.seconds for result in results}.values())


def _lines(run: Run, found: Findings) -> Iterator[str]:
    """A line for each row of a run, the first of which says what the run is."""
    for number, row in enumerate(run.row):
        what = f"{row.what}. {row.note}" if row.note else row.what
        result = found.results.get(f"{run.name}/{row.name}")
        if result is None:
            yield f"| {what} | {_number(row.expected, row.unit)} | not run | | | {row.source} | `{run.name}` |\n"
            continue
        allowed = _share(result.tolerance, result.expected).lstrip("+")
        error = "" if result.error is None else _share(result.error, result.expected)
        verdict = error if result.inside else f'<span style="color:#c00">**{error} outside: {result.reason}**</span>'
        made_by = f"`{run.name}`" if number else _made_by(run, result)
        cells = (what, _number(result.expected, row.unit), _values(row, result), verdict, allowed, row.source, made_by)
        yield "| " + " | ".join(cells) + " |\n"


def _made_by(run: Run, result: Result) -> str:
    """Name of a run, the program or the case that makes it, and what it takes."""
    case = run.case + "".join(f" --set {name}={value}" for name, value in run.levels[-1].items())
    name = f"[`{run.name}`](validation/{run.program}.py)" if run.program else f"`{run.name}`: `cutsim run {case}`"
    size = "" if result.unknowns is None else f", {result.unknowns} unknowns"
    return f"{name}, {result.seconds:.0f} s{size}" + ("" if result.trusted else ", questionable")


def _values(row: Row, result: Result) -> str:
    """The values of all levels, and the order observed."""
    show: Callable[[float], str] = partial(_number, unit="")
    values = ", ".join("–" if value is None else show(value) for value in result.values)
    order = "" if result.order is None else f" (order {result.order:.1f})"
    return f"{values} {row.unit}".rstrip() + order


def _number(value: float, unit: str) -> str:
    return f"{value:.5g} {unit}".rstrip()


def _share(value: float, expected: float) -> str:
    """A relative error in per cent, an absolute one as it is."""
    return f"{value:+.2g}" if not expected else f"{100 * value:+.2g} %"
