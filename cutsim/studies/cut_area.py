"""Cut area of a crack: by the energy that its law has dissipated, and by its front."""

import numpy as np
from numpy.typing import NDArray

from cutsim.interface.cohesive import separation_curve
from cutsim.interface.crack import Crack


class CutArea:
    """Cut area of a bonded crack, by the largest opening so far at each of its points.

    Args:
        crack: The crack.
    """

    def __init__(self, crack: Crack) -> None:
        assert crack.law is not None
        self._crack = crack
        # table of the law, opening → fraction of the toughness spent
        self._openings, self._spent = separation_curve(crack.law)
        secants = crack.law.secants(self._openings, np.zeros_like(self._openings))[0]
        # an intact bond may keep its stiffness, a broken one has none: the smallest opening with it counts
        self._falling, first = np.unique(-secants, return_index=True)
        self._reached = self._openings[first]

    def spent(self) -> float:
        """Area in which each point counts by the share of its work of separation that is spent; it never falls."""
        return self._crack.points.integral(np.interp(self._opening(), self._openings, self._spent))

    def swept(self) -> float:
        """Area behind the front, where the crack has been open by more than spends half the work of separation."""
        middle = float(np.interp(0.5, self._spent, self._openings))
        return self._crack.points.area_above(self._opening(), middle)

    def _opening(self) -> NDArray[np.float64]:
        """Largest opening so far at the points, from the memory of the bond [length]."""
        secants = self._crack.points.get(self._crack.history.secants)[..., 0]
        return np.interp(-secants, self._falling, self._reached)
