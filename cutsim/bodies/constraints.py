"""Supports taken together: what several of them hold has one displacement and one reaction."""

from collections.abc import Sequence

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.base.assembly import box
from cutsim.base.checks import place
from cutsim.bodies.loads import Support
from cutsim.fields.state import State

# difference of two prescribed values that is none: as a fraction of them, and of the size of the mesh
_SAME, _ROUNDING = 1e-9, 1e-12


class Constraints:
    """The supports of a problem, some of which may hold the same dofs.

    Args:
        state: Displacement and time.
        supports: The supports.

    Raises:
        ValueError: Two supports prescribe different displacements of one node.
    """

    def __init__(self, state: State, supports: Sequence[Support]) -> None:
        self._state, self._supports = state, tuple(supports)
        low, high = box(state.mesh.comm, state.mesh.geometry.x)
        self._small = _ROUNDING * float((high - low).max())
        self._shared = [
            (one, other, *found)
            for i, one in enumerate(self._supports)
            for other in self._supports[i + 1 :]
            if one.component == other.component and (found := self._common(one, other))
        ]
        self._counted = self._count_once()
        self.check()

    def check(self) -> None:
        """Refuse different displacements of one dof at the present time.

        Raises:
            ValueError: On all ranks, with both supports and the place.
        """
        for one, other, count, where in self._shared:
            a, b = one.displacement, other.displacement
            if abs(a - b) > self._small + _SAME * max(abs(a), abs(b)):
                raise ValueError(
                    f"supports {_name(one)} and {_name(other)} prescribe u_{'xyz'[one.component]} = {a:g} and {b:g} at "
                    f"time {self._state.time:g} on {count} nodes that both hold, one of which is at {where}: leave "
                    "these out of one of them, or give both the same displacement"
                )

    def reaction(self, support: Support, residual: NDArray[np.float64]) -> float:
        """Reaction of a support along its component [force]. Collective.

        What several supports hold counts for the first of them that has a name, so that the reactions of all sum up.

        Args:
            support: One of the supports.
            residual: Owned entries of internal minus external nodal forces.
        """
        dofs = self._counted[[s is support for s in self._supports].index(True)]
        return float(self._state.mesh.comm.allreduce(float(residual[dofs].sum())))

    def _common(self, one: Support, other: Support) -> tuple[int, str] | None:
        """Number of dofs that both hold and place of one; None if there is none. Collective."""
        comm, gdim = self._state.mesh.comm, self._state.mesh.geometry.dim
        both = np.intersect1d(one.dofs, other.dofs)
        told = ""
        if len(both):
            told = place(self._state.V.tabulate_dof_coordinates()[both[0] // gdim, :gdim])
        count, places = comm.allreduce(len(both), MPI.SUM), comm.allgather(told)
        return (count, next(p for p in places if p)) if count else None

    def _count_once(self) -> list[NDArray[np.int32]]:
        """Owned dofs whose reaction counts for each support."""
        free = np.ones(len(self._state.increment), dtype=bool)
        counted = [support.dofs for support in self._supports]
        for i in sorted(range(len(counted)), key=lambda i: self._supports[i].name is None):
            counted[i] = counted[i][free[counted[i]]]
            free[counted[i]] = False
        return counted


def _name(support: Support) -> str:
    return repr(support.name) if support.name else "without a name"
