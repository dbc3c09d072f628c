"""Motion of a pushed tool: into the notch, at constant speed to a depth, and perhaps back and in again.

Where a machine pushes the tool, this is the motion of the machine.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cutsim.base.checks import above, at_least, between, nonnegative, positive, require, require_number
from cutsim.base.signatures import checked
from cutsim.base.units import Length, Number, Time, Velocity
from cutsim.bodies.machine import Machine
from cutsim.studies.frame import Frame
from cutsim.tools.insertable import Insertable
from cutsim.tools.shapes import ToolPath

#: Depth of the tip, as a part of the depth of the notch, when the push begins.
TIP_IN_NOTCH = 0.8
# difference of a cosine from 1 of directions that are the same
_ALIGNED = 1e-9


@checked
@dataclass(frozen=True)
class Drive:
    """Drive of a tool: speed and times, as a user gives them.

    Args:
        speed: Speed of the push, > 0 [length/time].
        entry_time: Time > 0 in which the tool comes into the notch, or to the surface of a body without one [time]. By
            default it is that in which the push would come as far.
        turning_depth: Depth of the tip at which the tool turns back to where the push began, to be pushed once more
            [length]; None if it goes on.
        slice_push: Slice–push ratio ξ ≥ 0: speed of a blade along its edge over the speed of the push, from the
            beginning of the push on, in space [–].
        dwell: Time ≥ 0 for which it rests there before [time].

    Raises:
        ValueError: A number is outside its range, or the tool is to rest without a turning depth.
    """

    speed: Velocity
    entry_time: Time | None = None
    turning_depth: Length | None = None
    slice_push: Number = 0.0
    dwell: Time = 0.0

    def __post_init__(self) -> None:
        require_number("speed", self.speed, positive)
        require_number("entry_time", self.entry_time, positive.or_none)
        require_number("turning_depth", self.turning_depth, positive.or_none)
        require_number("slice_push", self.slice_push, nonnegative)
        require_number("dwell", self.dwell, nonnegative)
        require("dwell", self.dwell, not self.dwell or self.turning_depth is not None, "0 without a turning_depth")


@dataclass(frozen=True)
class Motion:
    """Motion of a tool in a body: depths and times.

    In a notch the halves of a tool are spread apart from beside each other, at the depth at which the push begins; a
    whole tool comes from the surface.  Without a notch either comes from a tip radius above the surface.

    Attributes:
        speed: Speed of the push [length/time].
        start_height: How far above the start of the push a whole tool begins [length].
        start_depth: Depth of the tip when the push begins [length].
        entry_time: Time at which the push begins [time].
        turning_depth: Depth at which the tool turns back, None if it does not [length].
        reach: Depth that the tip has to stay above: that of the body's far side, or infinity if the body is held at
            its ends and may fall in two [length].
        slice_speed: Speed along the edge, from the beginning of the push on [length/time].
        dwell: Time for which it rests there before [time].
    """

    speed: float
    start_height: float
    start_depth: float
    entry_time: float
    turning_depth: float | None
    reach: float
    slice_speed: float = 0.0
    dwell: float = 0.0

    @classmethod
    def of(cls, drive: Drive, tool: Insertable, notch: float, reach: float) -> "Motion":
        """The motion of a tool in a body with a notch, or without one, above a depth.

        Raises:
            ValueError: The tool is to turn before the push begins, or below the body.
        """
        start_depth = TIP_IN_NOTCH * notch
        start_height = start_depth or tool.resolution
        if drive.turning_depth is not None:
            require_number("turning_depth", drive.turning_depth, above(start_depth, "the start of the push"))
            require_number("turning_depth", drive.turning_depth, between(0, reach, name="the height of the body"))
        entry_time, slice_speed = drive.entry_time or start_height / drive.speed, drive.slice_push * drive.speed
        require("drive.slice_push", drive.slice_push, not slice_speed or len(tool.push) == 3, "0 in the plane")
        moving = drive.turning_depth, reach, slice_speed, drive.dwell
        return cls(drive.speed, start_height, start_depth, entry_time, *moving)

    @property
    def pushes(self) -> int:
        """How often the tool is pushed."""
        return 1 if self.turning_depth is None else 2

    @property
    def corners(self) -> tuple[float, ...]:
        """Times at which the velocity jumps [time]."""
        if self.turning_depth is None:
            return (self.entry_time,)
        turning = self.time_of(self.turning_depth)
        rest = (turning + self.dwell,) if self.dwell else ()
        return self.entry_time, turning, *rest, self.time_of(self.start_depth, 2)

    def time_of(self, depth: float, push: int = 1) -> float:
        """Time at which the tip is this deep below the surface in the first or second push [time].

        Raises:
            ValueError: The push begins deeper, the body or the first push ends before, or there is no such push.
        """
        require_number("depth", depth, at_least(self.start_depth, "the start of the push"))
        require_number("depth", depth, between(self.start_depth, self.reach, "[)", name="the height of the body"))
        require("push", push, push in range(1, self.pushes + 1), f"1 … {self.pushes}")
        way, turning = depth - self.start_depth, self.turning_depth
        if turning is not None:
            require("depth", depth, push == 2 or depth <= turning, f"<= turning_depth = {turning}")
            way += 2 * (turning - self.start_depth) * (push - 1)
        return self.entry_time + way / self.speed + self.dwell * (push - 1)

    def depth(self, time: float) -> float:
        """Depth of the tip of a whole tool at a time [length]."""
        way = self.speed * (time - self.entry_time)
        if way < 0:
            return self.start_depth - self.start_height * (1 - time / self.entry_time)
        leg = np.inf if self.turning_depth is None else self.turning_depth - self.start_depth
        if way > leg:
            way = max(leg, way - self.speed * self.dwell)
        return self.start_depth + (way if way <= leg else abs(2 * leg - way))

    def driven(self, machine: Machine, frame: Frame, symmetry_factor: float) -> tuple[Machine, float]:
        """The machine of what is meshed, and the time from which on it drives the tool.

        A machine with a stiffness drives it from the start.  One without, which cannot hold a tool that does not touch
        the body yet, takes over when the push begins.

        Args:
            machine: The machine of the whole tool.
            frame: Which way the tool goes.
            symmetry_factor: Factor from what is meshed to the whole body.

        Raises:
            ValueError: It does not act along the push, has a stiffness and a velocity, or has no stiffness though the
                tool is to turn back.
        """
        along = not machine.turns and bool(machine.direction(len(frame.push)) @ frame.push > 1 - _ALIGNED)
        require("machine.axis", machine.axis, along, f"the direction of the push, {tuple(map(float, frame.push))}")
        stiff = machine.stiffness > 0
        require("machine.velocity", machine.velocity, not (stiff and machine.velocity), "0 with a stiffness")
        turns = self.turning_depth is not None
        require("machine.stiffness", machine.stiffness, stiff or not turns, "> 0 with a turning_depth")
        share, force = 1 / symmetry_factor, machine.force
        amounts = {name: share * getattr(machine, name) for name in ("stiffness", "damping", "mass", "weight")}
        part = (lambda time: share * force(time)) if callable(force) else share * force
        return replace(machine, force=part, **amounts), 0.0 if stiff else self.entry_time

    def push(self, frame: Frame, *, halves: bool) -> ToolPath:
        """Path of the whole tool along the push, without the spreading of its halves."""
        start = self.start_depth if halves else -np.inf
        return ToolPath(lambda time: frame.point(max(self.depth(time), start)), self.corners)

    def path(self, frame: Frame, tool: Insertable, clearance: float = 0.0) -> ToolPath:
        """ToolPath of a tool, or of a half of it, in a frame.

        Args:
            frame: Where the tool enters, and which way it goes.
            tool: The tool.
            clearance: Distance at which its contact begins: a half that is spread in a notch comes from there, else it
                would press on faces that nothing has deformed yet [length].
        """
        spread = tool.side and self.start_depth
        push = self._spread(frame, tool, clearance) if spread else self._lower(frame)
        return ToolPath(self._sliced(frame, push), self.corners)

    def _sliced(
        self, frame: Frame, push: Callable[[float], NDArray[np.float64]]
    ) -> Callable[[float], NDArray[np.float64]]:
        """A push, with the slice along the edge."""
        edge = frame.edge
        if edge is None or not self.slice_speed:
            return push
        return lambda time: push(time) + self.slice_speed * max(time - self.entry_time, 0.0) * edge

    def _lower(self, frame: Frame) -> Callable[[float], NDArray[np.float64]]:
        return lambda time: frame.point(self.depth(time))

    def _spread(self, frame: Frame, half: Insertable, clearance: float) -> Callable[[float], NDArray[np.float64]]:
        start = -half.side * (half.half_width(self.start_depth) + clearance)

        def position(time: float) -> NDArray[np.float64]:
            still_to_come = max(1 - time / self.entry_time, 0.0)
            return frame.point(max(self.depth(time), self.start_depth), start * still_to_come)

        return position
