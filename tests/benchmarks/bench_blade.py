"""The frictionless plane cut: E = 0.777 MPa, nu = 0.45, G_c = 0.2 N/mm, tip radius and mesh size 0.05 mm, to 3 mm.

Prints set-up time (compiled kernels cached), wall and CPU time, steps, iterations, memory, energy closure, the force,
and what a solve costs by part, of a block and of one side of it, the plane of the crack being one of symmetry.  Runs on
any number of ranks.
"""

from pathlib import Path

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
    read_geo,
    run,
)

MESH = Path(__file__).parents[2] / "meshes" / "block.geo"
BLOCK = {"dim": 2, "Lx": 10.0, "H": 6.0, "lc": 0.05, "band": 0.4, "notch": 0.5}


def main() -> None:
    """Print two lines."""
    if MPI.COMM_WORLD.rank == 0:
        print(
            "   dofs  ranks  set-up [s]  wall [s]  CPU [s]  steps  cuts  Newton  Krylov"
            "  memory [GB]  closure  force [N/mm]"
        )
    for half in (0, 1):
        split(half)


def split(half: int) -> None:
    """Print one line, of the whole block or of one side of it."""
    comm, reports = MPI.COMM_WORLD, list[StepReport]()
    with measure(comm) as build:
        law = Exponential(strength=0.6, toughness=0.2)
        blade = Blade(np.radians(12), 0.05, 0.855)
        domain = read_geo(MESH, comm, BLOCK | {"half": half}, gdim=2)
        body = cracked_block(domain, NeoHookean(0.777, 0.45), law, viscosity=0.002)
        cut = Insertion.build(body, blade, Drive(1.0, 1.0), notch=0.5)
    with measure(comm) as usage:
        run(cut.mechanics, cut.time_of(3.0), StepControl(first=0.02, largest=0.1), reports.append)
    force = cut.columns({})["force"][0]
    if comm.rank == 0:
        print(
            f"{cut.state.unknowns:7d} {comm.size:6d} {build.wall:11.2f} {usage.wall:9.2f} {usage.cpu:8.2f}"
            f" {len(reports):6d} {sum(r.cuts for r in reports):5d} {sum(r.outcome.iterations for r in reports):7d}"
            f" {sum(r.outcome.linear_iterations for r in reports):7d} {usage.memory:12.2f}"
            f" {cut.mechanics.audit.closure:8.1e} {force:13.4f}\n{usage}"
        )


if __name__ == "__main__":
    main()
