"""Stretching of a neo-Hookean cube, 10 mm, E = 1 MPa, nu = 0.45: clamped at the bottom, top lifted 5 mm in 10 steps.

Prints wall and CPU time without compilation, iterations, memory, the force, whose reference is known to eight digits,
and what a solve costs by part.
Takes the numbers of cells per edge as arguments (16 24 32) and runs on any number of ranks.
"""

import sys

import numpy as np
import ufl
from common import Usage, measure
from dolfinx import fem, mesh
from mpi4py import MPI

from cutsim.solvers.newton import NonlinearProblem
from cutsim.solvers.system import Structure

EDGE, LIFT, STEPS = 10.0, 5.0, 10
E, NU = 1.0, 0.45
FORCE = {16: 41.559485, 24: 41.327619, 32: 41.240493}  # N


def residual(u: fem.Function) -> ufl.Form:
    """First variation of G/2 (I1 - 3) - G ln J + lambda/2 (ln J)^2, fully integrated."""
    G, lam = E / (2 * (1 + NU)), E * NU / ((1 + NU) * (1 - 2 * NU))
    F = ufl.Identity(3) + ufl.grad(u)
    J = ufl.det(F)
    W = G / 2 * (ufl.inner(F, F) - 3) - G * ufl.ln(J) + lam / 2 * ufl.ln(J) ** 2
    dx = ufl.dx(metadata={"quadrature_degree": 2})
    return ufl.derivative(W, u, ufl.TestFunction(u.function_space)) * dx


def stretch(n: int) -> tuple[float, int, int, Usage]:
    """Force at full stretch, Newton and Krylov iterations, resources used."""
    comm = MPI.COMM_WORLD
    domain = mesh.create_box(comm, [[0.0] * 3, [EDGE] * 3], [n] * 3, mesh.CellType.hexahedron)
    V = fem.functionspace(domain, ("Lagrange", 1, (3,)))
    u = fem.Function(V)
    lift = fem.Constant(domain, np.zeros(3))
    bottom, top = (fem.locate_dofs_geometrical(V, lambda x, z=z: np.isclose(x[2], z)) for z in (0.0, EDGE))
    bcs = [fem.dirichletbc(np.zeros(3), bottom, V), fem.dirichletbc(lift, top, V)]
    with NonlinearProblem(
        residual(u), u, petsc_options_prefix="cube_", bcs=bcs, structure=Structure(symmetric=True)
    ) as problem:
        with measure(comm) as usage:
            outcomes = []
            for step in range(1, STEPS + 1):
                lift.value[2] = LIFT * step / STEPS
                outcomes.append(problem.solve("basic"))
                if not outcomes[-1].converged:
                    raise RuntimeError(f"n = {n}, step {step}: {outcomes[-1].message}")
        reactions = problem.reactions().array.reshape(-1, 3)
    force = comm.allreduce(reactions[top[top < len(reactions)], 2].sum())
    return force, sum(o.iterations for o in outcomes), sum(o.linear_iterations for o in outcomes), usage


def main() -> None:
    """Print one line for each mesh."""
    root = MPI.COMM_WORLD.rank == 0
    if root:
        print("  n    dofs  ranks  wall [s]  CPU [s]  Newton  Krylov  memory [GB]   force [N]  difference")
    for n in [int(a) for a in sys.argv[1:]] or sorted(FORCE):
        force, newton, krylov, usage = stretch(n)
        if root:
            size, difference = 3 * (n + 1) ** 3, f"{force / FORCE[n] - 1:.1e}" if n in FORCE else "-"
            print(
                f"{n:3d} {size:7d} {MPI.COMM_WORLD.size:6d} {usage.wall:9.2f} {usage.cpu:8.2f} {newton:7d}"
                f" {krylov:7d} {usage.memory:12.2f} {force:11.6f} {difference:>11}\n{usage}",
                flush=True,
            )


if __name__ == "__main__":
    main()
