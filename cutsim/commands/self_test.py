"""Self-test of an installation: a problem whose answer is known, ``python -m cutsim.commands.self_test``.

Two blocks that are glued are pulled apart.  Whatever the law of the glue, its fracture energy is dissipated, and the
largest force is its strength times the area.
"""

from __future__ import annotations

import json

from mpi4py import MPI

from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.stepping import StepControl, run
from cutsim.analysis.steps import StepReport
from cutsim.bodies.loads import Support
from cutsim.bodies.solid import Solid
from cutsim.fields.meshing import geometry, read_geo
from cutsim.fields.space import cracked_space
from cutsim.fields.state import State
from cutsim.interface.cohesive import Exponential
from cutsim.interface.crack import Crack
from cutsim.materials.elastic import LinearElastic

#: Strength [MPa] and fracture energy [N/mm] of the glue, on an area of 1 mm².
LAW = Exponential(strength=1.0, toughness=0.1)
#: Separation of the outer faces at the end, in openings at which the traction is largest.
_PULL = 12.0


def main() -> None:
    """Solve it and write the peak of the force and the energy as one line of JSON."""
    size = {"dim": 2, "Lx": 1, "H": 1, "notch": 0, "lc": 0.25, "band": 0.5}
    mesh = read_geo(geometry("block"), MPI.COMM_WORLD, size, gdim=2)
    facets = mesh.facets("crack")
    state = State(cracked_space(mesh.mesh, ("Lagrange", 1, (2,)), facets))
    stiff = LinearElastic(young=1000.0, poisson=0.0)
    crack = Crack(state, facets, mesh.cells("right"), LAW, young=stiff.young)
    pull = _PULL * LAW.opening
    supports = [
        *(Support(state, mesh.facets("far_left"), i) for i in range(2)),
        Support(state, mesh.facets("far_right"), 0, lambda t: pull * t, name="pulled"),
        Support(state, mesh.facets("far_right"), 1),
    ]
    mechanics = Mechanics(state, [Solid(state, stiff), crack], supports)
    rows: list[dict[str, float]] = []

    def note(report: StepReport) -> None:
        rows.append({name: value for name, (value, _) in report.columns.items()})

    run(mechanics, 1.0, StepControl.fixed(1 / (6 * _PULL)), note)
    if MPI.COMM_WORLD.rank == 0:
        peak = max(row["pulled_force"] for row in rows)
        print(json.dumps({"ranks": MPI.COMM_WORLD.size, "peak": peak, "energy": rows[-1]["energy_fracture"]}))


if __name__ == "__main__":
    main()
