"""Dirichlet conditions of a problem: a dof that several parts prescribe has one value and one reaction."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from dolfinx import fem
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.base.checks import place

# difference of two prescribed values that is none, as a fraction of them
_SAME = 1e-9


class Prescribed(Protocol):
    """Value that is prescribed on some dofs.

    Attributes:
        name: Its name, or None.
        symbol: What is prescribed, such as "u_x".
        dofs: Owned dofs that it holds.
    """

    name: str | None
    symbol: str
    dofs: NDArray[np.int32]

    @property
    def prescribed(self) -> float:
        """The present value."""


class Constraints:
    """All prescribed values of a problem; several of them may share dofs.

    Args:
        V: The space.
        parts: What is prescribed.
        kind: What the user calls them, such as "supports".
        rounding: Difference of two values that is none.

    Attributes:
        parts: What is prescribed.
    """

    def __init__(self, V: fem.FunctionSpace, parts: Sequence[Prescribed], kind: str, rounding: float = 0.0) -> None:
        self.parts, self._V, self._kind, self._rounding = tuple(parts), V, kind, rounding
        self._shared = [
            (one, other, *found)
            for i, one in enumerate(self.parts)
            for other in self.parts[i + 1 :]
            if (found := self._common(one, other))
        ]
        self._counted = self._count_once()

    def check(self, time: float) -> None:
        """Refuse different values of one dof.

        Args:
            time: The present time.

        Raises:
            ValueError: On all ranks, with both parts and the place.
        """
        for one, other, count, where in self._shared:
            a, b = one.prescribed, other.prescribed
            if abs(a - b) > self._rounding + _SAME * max(abs(a), abs(b)):
                raise ValueError(
                    f"{self._kind} {_name(one)} and {_name(other)} prescribe {one.symbol} = {a:g} and {b:g} at time "
                    f"{time:g} on {count} nodes that both hold, one of which is at {where}: leave these out of one of "
                    "them, or give both the same value"
                )

    def reaction(self, part: Prescribed, residual: NDArray[np.float64]) -> float:
        """Sum of a residual over the dofs of a part. Collective.

        What several parts hold counts for the first of them that has a name, so that the reactions of all sum up.

        Args:
            part: One of the parts.
            residual: Owned entries.
        """
        dofs = self._counted[[p is part for p in self.parts].index(True)]
        return float(self._V.mesh.comm.allreduce(float(residual[dofs].sum())))

    def _common(self, one: Prescribed, other: Prescribed) -> tuple[int, str] | None:
        """Number of dofs that both hold and place of one; None if there is none. Collective."""
        comm, bs = self._V.mesh.comm, self._V.dofmap.index_map_bs
        both = np.intersect1d(one.dofs, other.dofs)
        told = ""
        if len(both):
            told = place(self._V.tabulate_dof_coordinates()[both[0] // bs, : self._V.mesh.geometry.dim])
        count, places = comm.allreduce(len(both), MPI.SUM), comm.allgather(told)
        return (count, next(p for p in places if p)) if count else None

    def _count_once(self) -> list[NDArray[np.int32]]:
        """Owned dofs whose reaction counts for each part."""
        free = np.ones(self._V.dofmap.index_map.size_local * self._V.dofmap.index_map_bs, dtype=bool)
        counted = [part.dofs for part in self.parts]
        for i in sorted(range(len(counted)), key=lambda i: self.parts[i].name is None):
            counted[i] = counted[i][free[counted[i]]]
            free[counted[i]] = False
        return counted


def _name(part: Prescribed) -> str:
    return repr(part.name) if part.name else "without a name"
