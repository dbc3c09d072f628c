"""Taylor's theorem for all unknowns of a problem: displacement, multipliers and the motion of rigid bodies."""

import numpy as np

from helpers.tangents import STEPS, slopes


def bordered_slopes(problem, x, w, steps=STEPS):
    """Slopes of the remainder of the linearised equations at owned unknowns x along w."""
    system, comm = problem._system, problem._system.comm
    A, b = system.matrix(), system.residual(x, np.inf)
    system.assemble_tangent(x)
    y, along = A.createVecs()
    along = along.duplicate()
    y.array[:] = w
    A.mult(y, along)
    # rows of what is tied say nothing, and its values in the vector do nothing
    change = along.array_r.copy()
    change[system._borders.tied] = 0.0
    remainders = []
    for h in steps:
        rest = system.residual(x + h * w, np.inf) - b - h * change
        remainders.append(np.sqrt(comm.allreduce(float(rest @ rest))))
    return slopes(steps, np.array(remainders))
