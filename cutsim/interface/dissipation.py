"""Dissipation of a bond along the path of its jump over a step, exact for a step of any size (docs/theory.md §3.2).

With the smallest secants K_n and K_t as memory the loss is −½ ∫ (dK_n δ_n² + dK_t δ_t²), mode by mode.  A mode loses
energy only after its secant has fallen below its memory; from there on, by parts, it is ∫ k δ dδ − [½ k δ²].
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cutsim.base.arrays import Array
from cutsim.interface.cohesive import CohesiveLaw

# Lobatto's rule with six points on [0, 1]: as exact as that of Gauss with five, but it sees the ends of an interval, so
# that a kink of the law near one of them does not pass unseen by an interval and its halves alike
_P5 = np.polynomial.Legendre.basis(5)
_PLACES = 0.5 + 0.5 * np.concatenate([[-1.0], _P5.deriv().roots().real, [1.0]])
_WEIGHTS = 1 / (30 * _P5(2 * _PLACES - 1) ** 2)
# loss that is not resolved, as a fraction of the toughness
_TOLERANCE = 1e-11
# secant over its memory at which a bond is broken
_BROKEN = 1e-16
# a place on the step, whose error enters the loss squared, is looked for among so many parts, and again in one of them
_PARTS, _ROUNDS = 16, 10
# halvings of parts of the way, at the most
_HALVINGS = 48

#: Which points fulfil a condition at fractions of the step, shape (points, places).
Condition = Callable[[NDArray[np.intp], Array], NDArray[np.bool_]]


@dataclass(frozen=True)
class Way:
    """Straight paths of the jump over a step, in components that turn with the interface.

    Attributes:
        start: Opening and slide at the start, shape (points, components) [length].
        end: The same at the end.
    """

    start: Array
    end: Array

    def at(self, s: Array) -> tuple[Array, Array, Array]:
        """Opening ≥ 0, sliding and δ dδ/ds of each mode at fractions of the step.

        Args:
            s: Fractions, shape (points, places).

        Returns:
            Opening and sliding, shape (points, places), and δ dδ/ds, shape (2, points, places).
        """
        change = (self.end - self.start)[:, None, :]
        jump = self.start[:, None, :] + s[..., None] * change
        opening = np.maximum(jump[..., 0], 0.0)
        slide = jump[..., 1:]
        rates = np.stack([opening * change[..., 0], (slide * change[..., 1:]).sum(axis=-1)])
        return opening, np.linalg.norm(slide, axis=-1), rates

    def of(self, points: NDArray[np.bool_] | NDArray[np.intp]) -> "Way":
        """The ways of some points."""
        return Way(self.start[points], self.end[points])


def losses(law: CohesiveLaw, way: Way, memory: Array) -> Array:
    """Energy lost on the ways [energy per reference area], ≥ 0.

    Args:
        law: The law.
        way: The ways.
        memory: Smallest secants before, shape (points, 2) [stress/length].

    Returns:
        One value a point.
    """
    total = np.zeros(len(memory))
    at_end = np.stack(law.secants(*(values[:, 0] for values in way.at(np.ones((len(memory), 1)))[:2])), axis=-1)
    for mode in (0, 1):
        loading = np.flatnonzero(at_end[:, mode] < memory[:, mode])
        if loading.size:
            total[loading] += _loss(law, way.of(loading), memory[loading, mode], mode)
    return total


def _loss(law: CohesiveLaw, way: Way, memory: Array, mode: int) -> Array:
    """Loss of one mode at points where it is below its memory at the end."""

    def secants(points: NDArray[np.intp], s: Array) -> Array:
        return np.asarray(law.secants(*way.of(points).at(s)[:2])[mode])

    def secant(s: Array) -> Array:
        return np.asarray(law.secants(*way.at(s[:, None])[:2])[mode])[:, 0]

    def stored(s: Array, k: Array) -> Array:
        jump = way.at(s[:, None])[mode][:, 0]
        return 0.5 * k * jump**2

    def power(points: NDArray[np.intp], s: Array) -> Array:
        opening, sliding, rates = way.of(points).at(s)
        return np.asarray(law.secants(opening, sliding)[mode] * rates[mode])

    start = _last(lambda points, s: secants(points, s) >= memory[points, None], len(memory))
    # a long step is cut where nothing is left of the bond: no point of the rule might meet what is before
    end = _last(lambda points, s: secants(points, s) > _BROKEN * memory[points, None], len(memory))
    work = _integral(power, start, end, _TOLERANCE * (law.toughness, law.shear_toughness)[mode])
    left = np.where(end < 1.0, 0.0, stored(end, secant(end)))
    return np.maximum(work + stored(start, memory) - left, 0.0)


def _last(holds: Condition, points: int) -> Array:
    """Where on the way a condition that holds at its start, if anywhere, ends to hold."""
    every = np.arange(points)
    beyond, throughout = (holds(every, np.full((points, 1), s))[:, 0] for s in (float(_PARTS) ** -_ROUNDS, 1.0))
    last = np.where(throughout, 1.0, 0.0)
    rows = np.flatnonzero(beyond & ~throughout)
    low, size = np.zeros(rows.size), 1.0
    for _ in range(_ROUNDS if rows.size else 0):  # none in the common case: from the start, or not in this step
        size /= _PARTS
        # calls cost more than points: all ends of parts at a time
        still = holds(rows, low[:, None] + size * np.arange(1, _PARTS))
        low += size * np.where(still.all(axis=1), _PARTS - 1, still.argmin(axis=1))
    last[rows] = low
    return last


def _integral(power: Callable[[NDArray[np.intp], Array], Array], start: Array, end: Array, tolerance: float) -> Array:
    """Integrals along the ways, each halved until Lobatto's rule with six points is as good as twice on its halves."""

    def lobatto(points: NDArray[np.intp], a: Array, b: Array) -> Array:
        return np.asarray((power(points, a[:, None] + (b - a)[:, None] * _PLACES) @ _WEIGHTS) * (b - a))

    total = np.zeros(len(start))
    points, a, b = np.arange(len(start)), start, end
    whole = lobatto(points, a, b)
    for _ in range(_HALVINGS):
        middle = 0.5 * (a + b)
        first, second = lobatto(points, a, middle), lobatto(points, middle, b)
        good = np.abs(first + second - whole) <= tolerance
        np.add.at(total, points[good], (first + second)[good])
        if good.all():
            return total
        rest = ~good
        points, whole = np.tile(points[rest], 2), np.concatenate([first[rest], second[rest]])
        a, b = np.concatenate([a[rest], middle[rest]]), np.concatenate([middle[rest], b[rest]])
    np.add.at(total, points, whole)
    return total
