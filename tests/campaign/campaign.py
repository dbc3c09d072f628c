"""Campaign of random cuts: how many run to their end by themselves, and how well.

Each cut is a case file of its own, which `cutsim run` runs, and a line in results.jsonl.  The same command goes on
where it was interrupted; another seed gives other cuts.  See docs/when_a_run_does_not_converge.md.
"""

import argparse
import json
import resource
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from draws import LARGEST, Draw
from summary import code, keep, read, summary

from cutsim.results.folder import HISTORY
from cutsim.results.run_files import RunFiles

_LOST = ("fracture", "friction", "viscous", "cohesive_viscous", "braked", "damped", "numerical")


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the cuts that have not been run, and say how all of them have ended."""
    options = _options(arguments)
    folder = options.out / f"seed-{options.seed}"
    folder.mkdir(parents=True, exist_ok=True)
    results = folder / "results.jsonl"
    rows = {row["run"]: row for row in read(results)}
    for dim, number, seconds in ((2, options.plane, options.seconds), (3, options.space, options.space_seconds)):
        largest = options.unknowns if dim == 2 else LARGEST[3]
        for i in range(number):
            name = f"{dim}d-{i:03d}"
            if name not in rows:
                rows[name] = _run(name, Draw.of(options.seed, i, dim, largest), folder, seconds)
                with results.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(rows[name]) + "\n")
                print(_line(rows[name]), flush=True)
    print(*summary(list(rows.values())), sep="\n")
    if options.keep:
        keep(options.seed, list(rows.values()))


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1, help="seed of the draws")
    parser.add_argument("--plane", type=int, default=200, metavar="N", help="cuts in the plane")
    parser.add_argument("--space", type=int, default=20, metavar="N", help="cuts in space")
    parser.add_argument("--unknowns", type=int, default=LARGEST[2], help="most unknowns in the plane, about")
    limit = "processor time at which a cut in {} is ended"
    parser.add_argument("--seconds", type=int, default=900, help=limit.format("the plane"))
    parser.add_argument("--space-seconds", type=int, default=3600, help=limit.format("space"))
    parser.add_argument(
        "--keep", action="store_true", help="keep the results beside this file, and a table in the docs"
    )
    parser.add_argument("--out", type=Path, default=Path("results/campaign"), help="folder")
    return parser.parse_args(arguments)


def _run(name: str, draw: Draw, folder: Path, seconds: int) -> dict[str, Any]:
    """Run a cut; its line."""
    case, out = folder / f"{name}.toml", folder / name
    case.write_text(draw.case(name), encoding="utf-8")
    before = _spent()
    with (folder / f"{name}.log").open("w", encoding="utf-8") as log:
        status = subprocess.run(
            [sys.executable, "-m", "cutsim", "run", str(case), "-o", str(out), "--overwrite", "-v"],
            stdout=log,
            stderr=log,
            check=False,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 30)),
        ).returncode
    row = {"run": name, "class": draw.kind, "code": code(), "status": status, "seconds": round(_spent() - before, 1)}
    return row | draw.parameters() | (_found(RunFiles.read(out)) if (out / HISTORY).exists() else {})


def _spent() -> float:
    """Processor time of the runs so far [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _found(files: RunFiles) -> dict[str, Any]:
    """What a run has left: how far it came, and how well."""
    columns = {name: column.values for name, column in files.history.items()}
    if not len(columns["time"]):
        return {}
    lost = {name: float(columns[f"energy_{name}"][-1]) for name in _LOST if f"energy_{name}" in columns}
    total = sum(map(abs, lost.values()))
    back = np.diff(columns["path"]) - np.diff(columns["time"])
    deepest = int(columns["depth"].argmax())  # where the first push ends
    return {
        "verdict": files.summary.get("verdict"),
        "doubts": files.summary.get("kinds", []),
        "reasons": files.summary.get("reasons", []),
        "unknowns": files.summary.get("unknowns"),
        "time": float(columns["time"][-1]),
        "depth": float(columns["depth"][deepest]),
        "work": float(columns["work_external"][deepest]),
        "cut": float(columns["cut"][-1]),
        "closure": float(np.abs(columns["energy_closure"]).max()),
        "penetration": {n: float(values.max()) for n, values in columns.items() if n.endswith("_penetration")},
        "steps": len(columns["time"]),
        "steps_back": int(np.count_nonzero(back > 0)),
        "rejected": int(columns["cuts"].sum()),
        "iterations": int(columns["newton"].sum()),
        "shares": {name: value / total for name, value in lost.items() if value},
    }


def _line(row: dict[str, Any]) -> str:
    if "depth" not in row:
        return f"{row['run']}  {row['class']}: no step, exit status {row['status']}"
    closure, deepest = row["closure"], max(row["penetration"].values(), default=0.0)
    return (
        f"{row['run']}  {row['class']:32}  exit {row['status']:3d}  depth {row['depth']:.2f}, cut {row['cut']:.2f} mm  "
        f"closure {closure:.1e}  penetration {deepest:.2f} h  {row['steps']} steps, {row['rejected']} rejected, "
        f"{row['iterations']} iterations, {row['seconds']:.0f} s  {', '.join(row['doubts'])}"
    )


if __name__ == "__main__":
    main()
