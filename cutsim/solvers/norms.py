"""Norms of an iterate, reduced over all ranks for the judge of convergence."""

from math import sqrt

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.solvers.convergence import Iterate
from cutsim.solvers.system import System


class Norms:
    """Norms of iterates and of the steps between them. Every method but `note_direction` is collective.

    Args:
        system: The equations.
    """

    def __init__(self, system: System) -> None:
        self._system = system
        self._free = np.setdiff1d(np.arange(len(system.unknowns)), system.held)
        self.start(system.unknowns)

    def start(self, x: NDArray[np.float64]) -> None:
        """Begin a solve at owned unknowns."""
        self._begin = self._last = x[self._free]
        self._first: tuple[float, float] | None = None

    def note_direction(self, y: NDArray[np.float64], f: NDArray[np.float64]) -> None:
        """Take note of a Newton step and the residual that it starts from; the first of a solve counts."""
        if self._first is None:
            step = y[self._free]
            self._first = float(step @ step), float(step @ f[self._free])

    def of(self, x: NDArray[np.float64], f: NDArray[np.float64]) -> Iterate:
        """The numbers of an iterate.

        Args:
            x: Owned unknowns.
            f: Owned residual, as `System.residual` gives it.
        """
        system, here = self._system, x[self._free]
        free, step, way = f[self._free], here - self._last, here - self._begin
        self._last = here
        squares = [free, system.reaction, system.tangent.diagonal[~system.forces.fixed], step, way]
        first_step, first_work = self._first or (0.0, 0.0)
        local = [*(np.sum(v**2) for v in squares), first_step, step @ free, first_work]
        *sums, work, first_work = system.comm.allreduce(np.array(local)).tolist()
        norms = [sqrt(total) for total in sums]
        jump, size = (
            float(system.comm.allreduce(np.max(np.abs(v), initial=0.0), MPI.MAX)) for v in (f[system.held], x)
        )
        return Iterate(
            free=norms[0], reaction=norms[1], stiffness=norms[2], size=size, jump=jump, step=norms[3], way=norms[4],
            work=work, first_step=norms[5], first_work=first_work,
        )  # fmt: skip
