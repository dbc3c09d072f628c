"""Two neo-Hookean cubes, 10 mm, E = 1 MPa, nu = 0.45, on each other: 12³ on 10³ hexahedra, friction 0.3.

The upper one is pressed down by 1 mm in 5 steps and drawn sideways by 3 mm, over its neighbour's edge, in 15. Full
integration, as in the other codes.  GetFEM took 109 iterations and 181 s, CalculiX 223 s; the forces are compared in
docs/large_sliding.md.  Takes the numbers of cells per edge as arguments (12 10) and runs on any number of ranks.
"""

import argparse

import basix.ufl
import numpy as np
from common import measure
from dolfinx import fem, mesh
from mpi4py import MPI

from cutsim import Friction, Mechanics, NeoHookean, Solid, State, StepControl, StepReport, Support, SurfacePair, run
from cutsim.base.compat import create_mesh, geometry_nodes

EDGE, PRESS, DRAW = 10.0, 1.0, 3.0
COMM = MPI.COMM_WORLD


def cubes(upper: int, lower: int) -> mesh.Mesh:
    """Two cubes that share no node, the upper one from z = EDGE to 2 EDGE."""
    cells, x = [], []
    for n, bottom in ((lower, 0.0), (upper, EDGE)) if COMM.rank == 0 else ():
        corners = [[0.0, 0.0, bottom], [EDGE, EDGE, bottom + EDGE]]
        cube = mesh.create_box(MPI.COMM_SELF, corners, [n] * 3, mesh.CellType.hexahedron)
        cells.append(geometry_nodes(cube) + sum(len(part) for part in x))
        x.append(cube.geometry.x)
    element = basix.ufl.element("Lagrange", "hexahedron", 1, shape=(3,))
    topology = np.vstack([np.empty((0, 8), dtype=np.int64), *cells])
    return create_mesh(COMM, topology, np.vstack([np.empty((0, 3)), *x]), element)


def faces(domain: mesh.Mesh, z: float, above: bool) -> np.ndarray:
    """Exterior facets at a height whose cell is above it, or below."""
    domain.topology.create_connectivity(2, 3)
    facets = mesh.locate_entities_boundary(domain, 2, lambda x: np.isclose(x[2], z))
    cells = np.array([domain.topology.connectivity(2, 3).links(f)[0] for f in facets], dtype=np.int32)
    return facets[(mesh.compute_midpoints(domain, 3, cells)[:, 2] > z) == above]


def main() -> None:
    """Print one line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("upper", type=int, nargs="?", default=12)
    parser.add_argument("lower", type=int, nargs="?", default=10)
    parser.add_argument("--below", action="store_true", help="slave surface below")
    parser.add_argument("--penetration", type=float, help="largest one, and largest slide where it sticks, in mm")
    options = parser.parse_args()
    domain = cubes(options.upper, options.lower)
    state = State(fem.functionspace(domain, ("Lagrange", 1, (3,))))
    surfaces = [faces(domain, EDGE, above) for above in (not options.below, options.below)]
    friction = Friction(0.3, allowed_slip=options.penetration)
    pair = SurfacePair(state, *surfaces, young=1.0, friction=friction, allowed_penetration=options.penetration)
    bottom, top = faces(domain, 0.0, True), faces(domain, 2 * EDGE, False)
    motion = (lambda t: DRAW * max(t - 1, 0.0), 0.0, lambda t: -PRESS * min(t, 1.0))
    supports = [Support(state, bottom, i, 0.0) for i in range(3)]
    supports += [Support(state, top, i, value, name=f"top_{'xyz'[i]}") for i, value in enumerate(motion)]
    solid = Solid(state, NeoHookean(1.0, 0.45), volumetric="full")
    mechanics = Mechanics(state, [solid, pair], supports)
    reports: list[StepReport] = []
    with measure(COMM) as usage:
        for end, step in ((1.0, 1 / 5), (2.0, 1 / 15)):
            control = StepControl(first=step, largest=step)
            run(mechanics, end, control, reports.append)
    if COMM.rank == 0:
        columns = {name: value for name, (value, _) in reports[-1].columns.items()}
        print("   dofs  ranks  wall [s]  CPU [s]  steps  cuts  Newton  Krylov  memory [GB]  closure  forces [N]")
        print(
            f"{state.unknowns:7d} {COMM.size:6d} {usage.wall:9.2f} {usage.cpu:8.2f}"
            f" {len(reports):6d} {sum(r.cuts for r in reports):5d} {sum(r.outcome.iterations for r in reports):7d}"
            f" {sum(r.outcome.linear_iterations for r in reports):7d} {usage.memory:12.2f}"
            f" {columns['energy_closure']:8.1e} {columns['top_x_force']:7.4f} {-columns['top_z_force']:7.4f}\n{usage}"
        )


if __name__ == "__main__":
    main()
