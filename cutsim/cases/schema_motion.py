"""Schema of case files: motions of tools."""

from collections.abc import Mapping
from itertools import pairwise
from typing import Annotated, Any

from pydantic import Discriminator, Tag, model_validator

from cutsim.base.checks import require
from cutsim.base.units import Angle, Length, Number, Time, Velocity
from cutsim.cases.expressions import TimeValue
from cutsim.cases.tables import NONNEGATIVE, POSITIVE, Table, Varying
from cutsim.tools.shapes import ToolPath

_Turn = Annotated[TimeValue, Varying("angle")]
_ONE_OR_MORE = Discriminator(lambda value: "<list>" if isinstance(value, list | tuple) else "<single>")
#: An angle in the plane, or a rotation vector in space, as functions of time.
Rotation = Annotated[
    Annotated[_Turn, Tag("<single>")] | Annotated[tuple[_Turn, ...], Tag("<list>")],
    _ONE_OR_MORE,
]


class Polyline(Table):
    """Straight motion between points, at rest before the first and after the last time.

    Args:
        times: Increasing times [time].
        points: A position for each [length].
        turns: A rotation for each, an angle in the plane and a rotation vector in space [rad].
    """

    times: tuple[Time, ...]
    points: tuple[tuple[Length, ...], ...]
    turns: (
        tuple[
            Annotated[
                Annotated[Angle, Tag("<single>")] | Annotated[tuple[Angle, ...], Tag("<list>")],
                _ONE_OR_MORE,
            ],
            ...,
        ]
        | None
    ) = None

    @model_validator(mode="after")
    def _as_many(self) -> "Polyline":
        if len(self.times) != len(self.points) or not self.times:
            raise ValueError("must have as many points as times, at least one")
        rising = all(a < b for a, b in pairwise(self.times))
        require("times", list(self.times), rising, "increasing")
        return self

    def made(self) -> ToolPath:
        """The motion."""
        return ToolPath.polyline(self.times, self.points, self.turns)


class Saw(Table):
    """Constant velocity with a sinusoidal draw.

    Args:
        start: Position at time zero [length].
        velocity: Feed velocity [length/time].
        stroke: Full stroke of the sawing motion, a vector [length].
        period: Duration of a stroke to and fro > 0 [time].
    """

    start: tuple[Length, ...]
    velocity: tuple[Velocity, ...]
    stroke: tuple[Length, ...]
    period: Annotated[Time, POSITIVE]

    def made(self) -> ToolPath:
        """The motion."""
        return ToolPath.saw(self.start, self.velocity, self.stroke, self.period)


class SlicePush(Table):
    """Push with a slice along the edge at the same time.

    Args:
        start: Position at time zero [length].
        velocity: Velocity of the push [length/time].
        draw: Direction of the slice, that of the edge.
        ratio: Slice–push ratio ξ ≥ 0, the speed along the edge over that of the push [–].
    """

    start: tuple[Length, ...]
    velocity: tuple[Velocity, ...]
    draw: tuple[Number, ...]
    ratio: Annotated[Number, NONNEGATIVE]

    def made(self) -> ToolPath:
        """The motion."""
        return ToolPath.slice_push(self.start, self.velocity, self.draw, self.ratio)


class Rock(Table):
    """Constant velocity of a pivot, about which the tool rocks.

    Args:
        start: Position of the reference point at time zero [length].
        velocity: Feed velocity of the pivot [length/time].
        angle: Largest angle to either side [rad].
        period: Duration of a swing to and fro > 0 [time].
        pivot: Pivot relative to the reference point at time zero; by default this point itself [length].
        axis: Axis of the rotation in space.
    """

    start: tuple[Length, ...]
    velocity: tuple[Velocity, ...]
    angle: Annotated[Angle, NONNEGATIVE]
    period: Annotated[Time, POSITIVE]
    pivot: tuple[Length, ...] | None = None
    axis: tuple[Number, ...] | None = None

    def made(self) -> ToolPath:
        """The motion."""
        return ToolPath.rock(self.start, self.velocity, self.angle, self.period, self.pivot, self.axis)


# keys by which a motion is known, in the order in which they are looked for
_KEYS = {
    "<slice>": {"draw", "ratio"},
    "<rock>": {"angle", "pivot", "axis"},
    "<saw>": {"stroke", "period", "start", "velocity"},
}


def _motion(value: Any) -> str:
    keys = value.keys() if isinstance(value, Mapping) else ()
    return next((tag for tag, known in _KEYS.items() if known.intersection(keys)), "<points>")


#: Any of these motions.
Motion = Annotated[
    Annotated[Polyline, Tag("<points>")]
    | Annotated[Saw, Tag("<saw>")]
    | Annotated[SlicePush, Tag("<slice>")]
    | Annotated[Rock, Tag("<rock>")],
    Discriminator(_motion),
]
