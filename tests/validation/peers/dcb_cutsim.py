"""The beam of `dcb` in cutsim."""

import json
import time

import basix.ufl
import dcb
import numpy as np
from dolfinx import mesh
from mpi4py import MPI

from cutsim import (
    Bilinear,
    Crack,
    LinearElastic,
    Mechanics,
    PenaltyContact,
    Solid,
    State,
    StepControl,
    StepReport,
    Support,
    cracked_space,
    run,
)
from cutsim.base.compat import create_mesh


def build() -> Mechanics:
    """The beam, whose arms share their nodes where they meet: the space is cracked there."""
    nodes, cells = dcb.arm(0.0)
    row = dcb.CELLS[0] + 1
    lower = np.where(cells < row, cells, cells + len(nodes) - row)
    x = np.concatenate([nodes, nodes[row:] * [1, -1]])
    corners = np.concatenate([cells, lower])[:, [0, 1, 3, 2]].astype(np.int64)
    domain = create_mesh(MPI.COMM_WORLD, corners, x, basix.ufl.element("Lagrange", "quadrilateral", 1, shape=(2,)))
    domain.topology.create_connectivity(1, 2)
    plane = mesh.locate_entities(domain, 1, lambda x: np.isclose(x[1], 0.0))
    bonded = plane[mesh.compute_midpoints(domain, 1, plane)[:, 0] > dcb.CRACK]
    state = State(cracked_space(domain, ("Lagrange", 1, (2,)), plane))
    law = Bilinear(dcb.PENALTY, dcb.STRENGTH, dcb.TOUGHNESS, dcb.STRENGTH, dcb.TOUGHNESS)
    contact = PenaltyContact(dcb.PENALTY)
    crack = Crack(state, bonded, (0.0, 1.0), law, young=dcb.YOUNG, contact=contact, normal="reference")
    solid = Solid(state, LinearElastic(dcb.YOUNG, dcb.POISSON), volumetric="full")
    supports = []
    for name, sign in (("upper", 1.0), ("lower", -1.0)):
        corner = mesh.locate_entities(
            domain, 0, lambda x, y=sign * dcb.HEIGHT: np.isclose(x[0], 0.0) & np.isclose(x[1], y)
        )
        supports.append(Support(state, corner, 1, lambda t, sign=sign: 0.5 * sign * t, name=name, dim=0))
    end = mesh.locate_entities_boundary(domain, 1, lambda x: np.isclose(x[0], dcb.LENGTH))
    supports += [Support(state, end, i) for i in range(2)]
    return Mechanics(state, [solid, crack], supports)


def main() -> None:
    """Print what was found."""
    step = dcb.OPENING / dcb.STEPS
    control = StepControl(first=step, largest=step, line_searches=("basic", "l2", "bt"))
    run(build(), step, control)  # compiles
    mechanics = build()
    rows: list[StepReport] = []
    start = time.process_time()
    run(mechanics, dcb.OPENING, control, rows.append)
    seconds = time.process_time() - start
    opening = [row.time for row in rows]
    force = [row.columns["upper_force"][0] for row in rows]
    iterations = sum(row.outcome.iterations for row in rows)
    print(json.dumps(dcb.summary(opening, force, iterations, seconds, mechanics.state.unknowns)))


if __name__ == "__main__":
    main()
