"""The beam of `dcb` in Akantu, whose bilinear law takes the opening at which the bond is strongest.

Where Newton's method finds no equilibrium, steps are cut; where that does not help, the values before are printed.
"""

import json
import sys
import time
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory

import akantu as aka
import dcb
import numpy as np

MATERIAL = f"""
model solid_mechanics_model_cohesive [
  cohesive_inserter [
    cohesive_surfaces = [interface]
  ]
  material elastic [
    name = body
    rho = 1
    E = {dcb.YOUNG}
    nu = {dcb.POISSON}
    Plane_Stress = 0
  ]
  material cohesive_bilinear [
    name = interface
    beta = 1
    G_c = {dcb.TOUGHNESS}
    sigma_c = {dcb.STRENGTH}
    delta_0 = {dcb.STRENGTH / dcb.PENALTY}
    penalty = {dcb.PENALTY}
  ]
]
"""


def write(path: Path) -> None:
    """Write the mesh: the arms share the nodes of the bond, which Akantu splits, and not those of the initial crack."""
    nodes, cells = dcb.arm(0.0)
    x, count = nodes[: dcb.CELLS[0] + 1, 0], len(nodes)
    shared = np.flatnonzero(x >= dcb.CRACK)
    below = count + np.arange(count)
    below[shared] = shared
    used = np.concatenate([np.arange(count), np.setdiff1d(below, shared)])
    number = np.zeros(2 * count, dtype=int)
    number[used] = 1 + np.arange(len(used))
    quads = np.concatenate([number[cells], number[below[cells]][:, [0, 3, 2, 1]]])
    joint = number[np.stack([shared[:-1], shared[1:]], axis=1)]
    elements = [f"1 2 2 2 {a} {b}" for a, b in joint] + [f"3 2 1 1 {a} {b} {c} {d}" for a, b, c, d in quads]
    places = np.concatenate([nodes, nodes * [1, -1]])[used]
    parts = {
        "MeshFormat": ["2.2 0 8"],
        "PhysicalNames": ["2", '1 2 "interface"', '2 1 "body"'],
        "Nodes": [str(len(places)), *(f"{i} {p:.15g} {q:.15g} 0" for i, (p, q) in enumerate(places, start=1))],
        "Elements": [str(len(elements)), *(f"{i} {element}" for i, element in enumerate(elements, start=1))],
    }
    path.write_text("".join(f"${name}\n" + "\n".join(rows) + f"\n$End{name}\n" for name, rows in parts.items()))


def build() -> tuple[aka.Mesh, aka.SolidMechanicsModelCohesive]:
    """Mesh and model."""
    with TemporaryDirectory() as folder:
        write(Path(folder, "beam.msh"))
        Path(folder, "beam.dat").write_text(MATERIAL)
        aka.parseInput(str(Path(folder, "beam.dat")))
        mesh = aka.Mesh(2)
        mesh.read(str(Path(folder, "beam.msh")))
    model = aka.SolidMechanicsModelCohesive(mesh)
    model.initFull(_analysis_method=aka._static, _is_extrinsic=False)
    newton = model.getNonLinearSolver("static")
    newton.set("max_iterations", 60)
    newton.set("threshold", 1e-6)
    newton.set("convergence_type", aka.SolveConvergenceCriteria.residual)
    return mesh, model


def main() -> None:
    """Print what was found."""
    mesh, model = build()
    newton = model.getNonLinearSolver("static")
    x, u, held = mesh.getNodes(), model.getDisplacement(), model.getBlockedDOFs()
    upper, lower = (int(np.argmin(np.hypot(x[:, 0], x[:, 1] - y))) for y in (dcb.HEIGHT, -dcb.HEIGHT))
    held[np.isclose(x[:, 0], dcb.LENGTH)] = True
    held[[upper, lower], 1] = True
    opening, force, iterations, now, step = [], [], 0, 0.0, dcb.OPENING / dcb.STEPS
    size, start = step, time.process_time()
    while len(force) < dcb.STEPS and size > step / 256:
        goal, before = min(now + size, (len(force) + 1) * step), u.copy()
        u[upper, 1], u[lower, 1] = 0.5 * goal, -0.5 * goal
        try:
            model.solveStep("static")
        except aka.NLSNotConvergedException:
            u[:] = before
            size *= 0.5
            continue
        finally:
            iterations += newton.getInt("nb_iterations") if hasattr(newton, "getInt") else 0
        now = goal
        if np.isclose(now, (len(force) + 1) * step):
            opening.append(now)
            force.append(abs(float(model.getInternalForce()[upper, 1])))
            size = step
    seconds = time.process_time() - start
    print(f"{len(force)} of {dcb.STEPS} steps", file=sys.stderr)
    found = dcb.summary(opening, force, iterations, seconds, 2 * mesh.getNbNodes())
    print(json.dumps(found | {"version": version("akantu")}))


if __name__ == "__main__":
    main()
