"""Double cantilever beam in plane strain: 10k unknowns, opened by 4 mm in 100 equal steps, irreversible bond.

Prints wall and CPU time without compilation, iterations, memory, what is known in closed form, force and toughness,
and what a solve costs by part.  The same problem took fedoo 12.4 s and plain dolfinx with MUMPS 7.1 s, each with 324
Newton iterations, on an idle machine.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from common import measure
from mpi4py import MPI

from cutsim import StepReport, run

sys.path.insert(0, str(Path(__file__).parents[1]))
from validation.dcb import ISOTROPIC, Beam, control, growth

COMM = MPI.COMM_WORLD
STEPS = 100


def main() -> None:
    """Print one line."""
    specimen = replace(ISOTROPIC, step=ISOTROPIC.turns[-1] / STEPS, length=85.0, fine=50.0, size=0.3)
    beam = Beam.build(specimen)
    rows: list[dict[str, float]] = []

    def record(report: StepReport) -> None:
        columns = report.columns | beam.columns(report.columns)
        counts = {"newton": report.outcome.iterations, "krylov": report.outcome.linear_iterations, "cuts": report.cuts}
        rows.append({"time": report.time, **counts} | {name: value for name, (value, _) in columns.items()})

    with measure(COMM) as usage:
        run(beam.mechanics, specimen.turns[-1], control(specimen), record)
    history = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    result = growth(specimen, history, width=1.0)
    if COMM.rank == 0:
        dofs = beam.state.V.dofmap.index_map.size_global * beam.state.V.dofmap.bs
        newton, krylov, cuts = (int(history[name].sum()) for name in ("newton", "krylov", "cuts"))
        error = result["toughness_by_damage"] / result["toughness"] - 1
        print(
            "  dofs  ranks  steps  cuts  wall [s]  CPU [s]  Newton  Krylov"
            "  memory [GB]  off beam theory  G/G_c - 1  closure"
        )
        print(
            f"{dofs:6d} {COMM.size:6d} {len(rows):6d} {cuts:5d} {usage.wall:9.2f} {usage.cpu:8.2f}"
            f" {newton:7d} {krylov:7d} {usage.memory:12.2f} {result['distance_from_beam']:16.2%} {error:10.3%}"
            f" {result['energy_closure']:8.1e}\n{usage}"
        )


if __name__ == "__main__":
    main()
