"""What a campaign of random cuts has shown, in words and as the table of docs/when_a_run_does_not_converge.md."""

import hashlib
import json
from collections import Counter
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from signal import Signals
from statistics import median
from typing import Any

import cutsim
from cutsim.commands.endings import Ending
from cutsim.interface.doubts import DEEP

#: Results that are kept, a file for each seed, and the page with their table.
KEPT = Path(__file__).parent / "results"
PAGE = Path(__file__).parents[2] / "docs" / "when_a_run_does_not_converge.md"
#: Closure of the energy audit that is good, and time over the median of a class that is.
CLOSURE, SLOW = 0.01, 2.0
#: Growth of the crack from which a tool has cut and not only indented the body [mm].
CUT = 0.1
# work of an indentation by a depth d over E/(1 − ν²) d² and the length of the edge, the same in two pushes that cut
# nothing (ν = 0.32 and 0.46); friction of a steady cut over μ E and the length of the edge, of a blade of 12° [mm]
_INDENTED, _RUBBED = 0.25, 1.4
_ENDED = (Ending.TRUSTED, Ending.QUESTIONABLE)
_BEGIN, _END = "<!-- campaign: begin -->\n", "<!-- campaign: end -->"
_TITLES = (
    "cuts",
    "number",
    "to the end",
    "of these have cut",
    "rightly indent",
    "trusted",
    "in twice the median",
    "median [s]",
    "closure",
    "penetration / h",
)
_FAULTS = ("cut", "class", "what is not good", "time [s]", "crack grown by [mm]", "steps (rejected)", "processor [s]")

Row = dict[str, Any]


@cache
def code() -> str:
    """A short number that tells states of the code apart: results of two of them are not those of one."""
    package = Path(cutsim.__file__).parent
    files = sorted(path.relative_to(package).as_posix() for path in package.rglob("*.py"))
    return hashlib.sha256(b"".join(name.encode() + (package / name).read_bytes() for name in files)).hexdigest()[:10]


def read(path: Path) -> list[Row]:
    """Lines of a file of results; none if there is no file."""
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    return [json.loads(line) for line in lines]


def ended(row: Row) -> bool:
    """Whether a cut has come to its end."""
    return row["status"] in _ENDED


def penetration(row: Row) -> float:
    """Deepest penetration over the mesh size."""
    return max(row["penetration"].values(), default=0.0)


def effort(row: Row) -> float:
    """What a cut to the depth of the tool costs, in new surface and friction, over the work of an indentation to it."""
    cut = row["toughness"] + _RUBBED * row["friction"] * row["young"]
    return float(cut / (_INDENTED * row["young"] / (1 - row["poisson"] ** 2) * row["depth"]))


def rightly_indents(row: Row) -> bool:
    """Whether a tool has not cut, and a cut would have cost more, about."""
    return row["cut"] < CUT and effort(row) >= 1


def causes(row: Row) -> list[str]:
    """How a cut has ended before its end, or what its verdict doubts, in a few words each; none if it is trusted."""
    if row["status"] < 0:
        return [f"ended by {Signals(-row['status']).name}" if row["status"] != -Signals.SIGXCPU else "out of time"]
    return row["doubts"] if ended(row) else [Ending(row["status"]).words]


def medians(rows: Sequence[Row]) -> dict[str, float]:
    """Processor time of the cuts that have come to their end, by class [s]."""
    done = [row for row in rows if ended(row)]
    return {kind: median(r["seconds"] for r in done if r["class"] == kind) for kind in {r["class"] for r in done}}


def summary(rows: Sequence[Row]) -> Iterator[str]:
    """How many have come to their end, and what is to be said of these, in words."""
    usual = medians(rows)
    for dim in sorted({row["dim"] for row in rows}):
        some = [row for row in rows if row["dim"] == dim]
        done = [row for row in some if ended(row)]
        yield f"{dim}-D: {len(done)} of {len(some)} come to their end, not {_names([r for r in some if not ended(r)])}"
        for words in sorted({words for row in some for words in causes(row)}):
            yield f"  {words}: {_names([row for row in some if words in causes(row)])}"
        findings = {
            f"in more than {SLOW:g} times the median of their class": [
                row for row in done if row["seconds"] > SLOW * usual[row["class"]]
            ],
            f"with a closure above {CLOSURE:.0%}": [row for row in done if row["closure"] > CLOSURE],
            f"with a penetration above {DEEP:g} h": [row for row in done if penetration(row) > DEEP],
            "not trusted": [row for row in done if row["verdict"] != "trusted"],
            "that do not cut, though it would cost less": [
                row for row in done if row["cut"] < CUT and not rightly_indents(row)
            ],
        }
        for words, found in findings.items():
            yield f"  {len(found)} {words}: {_names(found)}"


def table(rows: Sequence[Row]) -> list[str]:
    """The table of the page: a line for each class, and one for all."""
    usual, kinds = medians(rows), sorted({row["class"] for row in rows})
    groups = [(kind, [row for row in rows if row["class"] == kind]) for kind in kinds]
    lines = [_TITLES, ("---",) * len(_TITLES)]
    lines += [_cells(kind, some, usual) for kind, some in [*groups, ("all", list(rows))]]
    return [f"| {' | '.join(line)} |" for line in lines]


def _cells(kind: str, rows: Sequence[Row], usual: dict[str, float]) -> tuple[str, ...]:
    done = [row for row in rows if ended(row)]
    if not done:
        return (kind, str(len(rows)), "0", *["–"] * (len(_TITLES) - 3))
    return (
        kind,
        str(len(rows)),
        str(len(done)),
        str(sum(row["cut"] >= CUT for row in done)),
        str(sum(map(rightly_indents, done))),
        str(sum(row["verdict"] == "trusted" for row in done)),
        str(sum(row["seconds"] <= SLOW * usual[row["class"]] for row in done)),
        f"{median(row['seconds'] for row in done):.0f}",
        f"{max(row['closure'] for row in done):.1e}",
        f"{max(map(penetration, done)):.2f}",
    )


def not_good(rows: Sequence[Row]) -> list[str]:
    """The other table of the page: a line for each cut that does not end, is doubted, or takes long."""
    usual, lines = medians(rows), [_FAULTS, ("---",) * len(_FAULTS)]
    for row in rows:
        slow = ended(row) and row["seconds"] > SLOW * usual[row["class"]]
        if found := causes(row) + [f"{row['seconds'] / usual[row['class']]:.1f} times the median"] * slow:
            how = ("–",) * 3
            if "depth" in row:
                how = (f"{row['time']:.2f}", f"{row['cut']:.2f}", f"{row['steps']} ({row['rejected']})")
            lines.append((row["run"], row["class"], ", ".join(found), *how, f"{row['seconds']:.0f}"))
    return [f"| {' | '.join(line)} |" for line in lines]


def states(rows: Sequence[Row]) -> str:
    """How many cuts were run with which state of the code, in a sentence."""
    counts = Counter(row.get("code") for row in rows)
    words = [f"{n} with {f'state {state} of the code' if state else 'older states'}" for state, n in counts.items()]
    return f"Of these cuts {', '.join(words)} were run."


def kept() -> list[Row]:
    """The results that are kept, each with its seed before its number."""
    files = {path.stem.removeprefix("seed-"): read(path) for path in sorted(KEPT.glob("seed-*.jsonl"))}
    return [row | {"run": f"{seed}/{row['run']}"} for seed, rows in files.items() for row in rows]


def page() -> str:
    """The page with the tables of the results that are kept."""
    before, rest = PAGE.read_text(encoding="utf-8").split(_BEGIN)
    tables = ["", *table(kept()), "", *not_good(kept()), "", states(kept()), "", ""]
    return before + _BEGIN + "\n".join(tables) + _END + rest.split(_END)[1]


def keep(seed: int, rows: Sequence[Row]) -> None:
    """Keep the results of a seed, and make the tables of the page of all that are kept."""
    KEPT.mkdir(exist_ok=True)
    lines = [json.dumps(row) + "\n" for row in rows]
    (KEPT / f"seed-{seed}.jsonl").write_text("".join(lines), encoding="utf-8")
    PAGE.write_text(page(), encoding="utf-8")


def _names(rows: Sequence[Row]) -> str:
    return ", ".join(row["run"] for row in rows) or "–"
