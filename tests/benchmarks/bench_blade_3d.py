"""The thesis's slab cut by a blade with friction 0.2, and a chunky block, in 3-D: what an iteration costs by size.

A mesh is named by its unknowns in thousands, or "chunk", which is as high as it is wide.  Give names, and perhaps the
time of the end [s]: `bench_blade_3d.py 26k 82k chunk 2`.  Within the first second the halves of the blade are spread
in the notch, then it is pushed at 1 mm/s.  Runs on any number of ranks.
"""

import sys

import numpy as np
from common import measure
from mpi4py import MPI

from cutsim import (
    Blade,
    Drive,
    Exponential,
    Insertion,
    NeoHookean,
    StepControl,
    StepReport,
    cracked_block,
    geometry,
    read_geo,
    run,
)

NOTCH = 0.6  # mm
SLAB = {"dim": 3, "sym": 1, "notch": NOTCH}
SIZES = {
    "26k": SLAB | {"lc": 0.3, "nz": 14},
    "82k": SLAB | {"lc": 0.2, "nz": 27},
    "268k": SLAB | {"lc": 0.13, "nz": 43, "growth": 1.2},
    "chunk": SLAB | {"Lx": 6, "H": 10, "B": 20, "lc": 0.3, "nz": 20, "band": 2},
}


def main() -> None:
    """Print two lines for each size."""
    comm = MPI.COMM_WORLD
    names = [name for name in sys.argv[1:] if name in SIZES] or ["26k", "chunk"]
    end = float(sys.argv[-1]) if sys.argv[-1] not in {*SIZES, sys.argv[0]} else 1.5
    if comm.rank == 0:
        print("  name    dofs  ranks  set-up [s]  wall [s]  CPU [s]  steps  cuts  Newton  Krylov  builds"
              "  CPU/Newton [s]  Newton/step  memory [GB]  closure  force [N]", flush=True)  # fmt: skip
    for name in names:
        size, reports = SIZES[name], list[StepReport]()
        with measure(comm) as build:
            law = Exponential(strength=0.61477, toughness=0.8)
            blade = Blade(np.arctan2(0.855, 4.2), size["lc"], 0.855, (0.0, -1.0, 0.0), (1.0, 0.0, 0.0))
            domain = read_geo(geometry("block"), comm, size, gdim=3)
            body = cracked_block(domain, NeoHookean(0.777, 0.48), law, viscosity=0.002)
            cut = Insertion.build(body, blade, Drive(1.0, 1.0), notch=NOTCH, friction=0.2)
        with measure(comm) as usage:
            run(cut.mechanics, end, StepControl(first=0.02, largest=0.05), reports.append)
        force = cut.columns({})["force"][0]
        newton, krylov = (sum(getattr(r.outcome, of) for r in reports) for of in ("iterations", "linear_iterations"))
        if comm.rank == 0:
            builds = cut.mechanics.problem.preconditioner.builds
            print(
                f"{name:>6s} {cut.state.unknowns:7d} {comm.size:6d} {build.wall:11.2f}"
                f" {usage.wall:9.2f} {usage.cpu:8.2f} {len(reports):6d} {sum(r.cuts for r in reports):5d} {newton:7d}"
                f" {krylov:7d} {builds:7d} {usage.cpu / newton:15.3f} {newton / len(reports):12.2f}"
                f" {usage.memory:12.2f} {cut.mechanics.audit.closure:8.1e} {force:10.5f}\n{usage}\n"
                f"  linear solver: {cut.mechanics.problem.linear_solver}",
                flush=True,
            )


if __name__ == "__main__":
    main()
