"""The beam of `dcb` in fedoo."""

import json
import time

import dcb
import fedoo as fd
import numpy as np


def main() -> None:
    """Print what was found."""
    fd.ModelingSpace("2D")
    nodes, cells = dcb.arm(0.0)
    below = dcb.arm(-dcb.HEIGHT)[0]
    x = np.concatenate([below, nodes])
    arms = fd.Mesh(x, np.concatenate([cells, cells + len(below)]), "quad4", ndim=2)
    row = dcb.CELLS[0] + 1
    upper = len(below) + np.arange(row)
    lower = len(below) - row + np.arange(row)
    bonded = np.flatnonzero(0.5 * (nodes[: row - 1, 0] + nodes[1:row, 0]) > dcb.CRACK)
    joint = np.stack([lower[bonded], lower[bonded + 1], upper[bonded], upper[bonded + 1]], axis=1)
    interface = fd.Mesh(x, joint, "lin2interface", ndim=2)

    body = fd.constitutivelaw.ElasticIsotrop(dcb.YOUNG, dcb.POISSON)
    law = fd.constitutivelaw.CohesiveLaw(
        GIc=dcb.TOUGHNESS, SImax=dcb.STRENGTH, KI=dcb.PENALTY,
        GIIc=dcb.TOUGHNESS, SIImax=dcb.STRENGTH, KII=dcb.PENALTY,
        axis=1, tangent_mode="consistent",
    )  # fmt: skip
    parts = [
        fd.Assembly.create(fd.weakform.StressEquilibrium(body), arms),
        fd.Assembly.create(fd.weakform.InterfaceForce(law), interface, n_elm_gp=3),
    ]
    problem = fd.problem.NonLinear(parts[0] + parts[1], nlgeom=False)

    def node(x0: float, y0: float) -> int:
        return int(np.argmin(np.hypot(x[:, 0] - x0, x[:, 1] - y0)))

    ends = node(0.0, dcb.HEIGHT), node(0.0, -dcb.HEIGHT)
    held = np.flatnonzero(np.isclose(x[:, 0], dcb.LENGTH))
    problem.bc.add("Dirichlet", held, "Disp", 0.0)
    for end, sign in zip(ends, (1.0, -1.0), strict=True):
        problem.bc.add("Dirichlet", [end], "DispY", 0.5 * sign * dcb.OPENING)
    problem.set_nr_criterion("Force", tol=1e-6, max_subiter=40, check_early_divergence=False)

    opening, force, counts = [], [], []
    increment = problem.solve_time_increment

    def counted(*args: float) -> tuple:
        found = increment(*args)
        counts.append(found[1])
        return found

    def keep(solved: fd.problem.NonLinear) -> None:
        opening.append(dcb.OPENING * solved.time)
        force.append(float(solved.get_ext_forces("DispY")[ends[0]]))

    problem.solve_time_increment = counted
    step = 1.0 / dcb.STEPS
    start = time.process_time()
    problem.nlsolve(
        dt=step, dt_max=step, dt_min=step / 256, print_info=0,
        interval_output=step, callback=keep, exec_callback_at_each_iter=False,
    )  # fmt: skip
    seconds = time.process_time() - start
    iterations = sum(counts)
    found = dcb.summary(opening, force, iterations, seconds, 2 * len(x))
    print(json.dumps(found | {"version": fd.__version__}))


if __name__ == "__main__":
    main()
