"""Load curves and amplitudes: values over time, and how a case file says them."""

from dataclasses import dataclass

import numpy as np

from cutsim.base.arrays import Array

#: Points by which a smooth piece of a curve is replaced.
_PIECES = 16
#: Duration of a jump as a part of the time that the curve covers.
_JUMP = 1e-6

#: Difference of two times that is none, as a fraction of the run.
_ROUNDING = 1e-9

#: A value of a case file: a number, an expression of time, or a table over time.
Value = float | str | dict[str, list[float]]


@dataclass(frozen=True, eq=False)
class Curve:
    """Values over time, straight between points and constant outside of them.

    Attributes:
        times: Times, increasing [time].
        values: Value at each of them.
    """

    times: Array
    values: Array

    @classmethod
    def stepped(cls, times: Array, values: Array) -> "Curve":
        """The curve that jumps to the value of the next point behind each point."""
        jump = _JUMP * (times[-1] - times[0])
        after = times[:-1] + jump
        return cls(
            np.concatenate([times[:1], np.column_stack([after, times[1:]]).ravel()]),
            np.concatenate([values[:1], np.repeat(values[1:], 2)]),
        )

    @classmethod
    def smooth_steps(cls, times: Array, values: Array) -> "Curve":
        """The curve with a step w³ (10 − 15 w + 6 w²) over the part w of the way between two points, in pieces."""
        w = np.arange(1, _PIECES + 1) / _PIECES
        steps = w**3 * (10 - 15 * w + 6 * w**2)
        return cls(
            np.concatenate([times[:1], (times[:-1, None] + np.diff(times)[:, None] * w).ravel()]),
            np.concatenate([values[:1], (values[:-1, None] + np.diff(values)[:, None] * steps).ravel()]),
        )

    @classmethod
    def through_parabolas(cls, times: Array, values: Array) -> "Curve":
        """The curve through its points that blends the parabolas of three neighbours each, in pieces."""
        if len(times) < 3:
            return cls(times, values)
        w = np.arange(1, _PIECES + 1) / _PIECES
        fine, found = [times[:1]], [values[:1]]
        for n in range(len(times) - 1):
            t = times[n] + (times[n + 1] - times[n]) * w
            before = _parabola(times, values, max(n - 1, 0), t)
            behind = _parabola(times, values, min(n, len(times) - 3), t)
            fine.append(t)
            found.append(before + (behind - before) * w)
        return cls(np.concatenate(fine), np.concatenate(found))

    def extrapolated(self, end: float) -> "Curve":
        """The curve that goes on as its last piece does up to a time."""
        if len(self.times) < 2 or self.times[-1] >= end:
            return self
        slope = (self.values[-1] - self.values[-2]) / (self.times[-1] - self.times[-2])
        return Curve(
            np.append(self.times, end), np.append(self.values, self.values[-1] + slope * (end - self.times[-1]))
        )

    def repeated(self, end: float, *, offset: bool) -> "Curve":
        """The curve that is repeated up to a time, each time on top of the last value or from the first one again."""
        period, rise = self.times[-1] - self.times[0], self.values[-1] - self.values[0]
        if period <= 0 or self.times[-1] >= end:
            return self
        rounds = np.arange(np.ceil((end - self.times[0]) / period))[:, None]
        jump = 0.0 if offset or rise == 0 else _JUMP * period
        times = self.times + period * rounds + jump * (np.arange(len(self.times)) == 0) * (rounds > 0)
        values = self.values + (rise * rounds if offset else 0 * rounds)
        keep = np.ones(times.shape, dtype=bool)
        if not jump:  # the first point of a round is the last one of the round before
            keep[1:, 0] = False
        return Curve(times[keep], values[keep])

    def inside(self, end: float) -> Array:
        """Times of points between time 0 and `end`."""
        rounding = _ROUNDING * end
        return self.times[(self.times > rounding) & (self.times < end - rounding)]

    def value(self, scale: float, end: float) -> Value:
        """What a case file says for this curve times a number from time 0 to `end`."""
        times = np.concatenate([[0.0], self.inside(end), [end]])
        values = scale * np.interp(times, self.times, self.values)
        if np.ptp(values) == 0:
            return float(values[0])
        slope = _short(values[1] / end)
        if len(times) == 2 and values[0] == 0 and "e" not in slope:
            return f"{slope}*t"
        return {"times": [float(_short(t)) for t in times], "values": [float(_short(v)) for v in values]}


@dataclass(frozen=True, eq=False)
class Timed:
    """A number times a load curve.

    Attributes:
        number: The number.
        curve: The curve, None for a constant.
    """

    number: float
    curve: Curve | None = None

    @property
    def vanishes(self) -> bool:
        """Whether it is always zero."""
        return self.number == 0 or (self.curve is not None and not self.curve.values.any())

    def value(self, end: float) -> Value:
        """What a case file says for it from time 0 to `end`."""
        return self.number if self.curve is None else self.curve.value(self.number, end)

    def at(self, times: Array) -> Array:
        """Values at some times."""
        if self.curve is None:
            return np.full(len(times), self.number)
        return self.number * np.interp(times, self.curve.times, self.curve.values)

    def times(self, end: float) -> Array:
        """Times between 0 and `end` at which it has a kink, and these two."""
        inner = np.empty(0) if self.curve is None else self.curve.inside(end)
        return np.unique(np.concatenate([[0.0], inner, [end]]))


def with_jumps(times: Array) -> Array:
    """Times of points, of which two may be at one time, such that they increase."""
    times, jump = times.copy(), _JUMP * max(float(np.ptp(times)), 1e-300)
    for i in range(1, len(times)):
        times[i] = max(times[i], times[i - 1] + jump)
    return times


def _short(number: float) -> str:
    """A number without the digits of rounding."""
    return f"{number:.12g}"


def _parabola(times: Array, values: Array, first: int, t: Array) -> Array:
    """Values at times of the parabola through three neighbouring points."""
    return np.asarray(np.polyval(np.polyfit(times[first : first + 3], values[first : first + 3], 2), t))
