"""What drives a coordinate of a rigid body: a machine of finite stiffness, a force, inertia (docs/test_rigs.md)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cutsim.base.checks import finite, nonnegative, require, require_number, require_numbers
from cutsim.base.parameters import TimeFunction
from cutsim.base.signatures import checked

#: Rotations about the axes of space.
TURNS = ("rx", "ry", "rz")


@checked
@dataclass(frozen=True)
class Machine:
    """Machine that drives one coordinate s of a rigid body, a translation along an axis or a rotation about one.

    The coordinate is an unknown, found together with the displacement from

        m s̈ + d ṡ + k (s − s_machine(t)) = F_contact + F(t) + W,

    with s_machine the motion that is prescribed.  So a stiffness is that of a testing machine with its load cell, in
    series with the body; a force or weight without a stiffness loads the body; a mass with an initial velocity falls on
    it.  In a static analysis the inertia of the machine counts as well.  In the plane all but s is per thickness.

    Args:
        axis: Direction of the coordinate: "x", "-y" and so on, or a vector, whose length does not matter; "rx", "ry",
            "rz" for a rotation about an axis of space through the reference point, "rz" alone in the plane.
        stiffness: k ≥ 0 [force/length], of a rotation [moment/rad].
        damping: d ≥ 0, a dashpot to the ground [force·time/length].
        mass: m ≥ 0 that moves along [force·time²/length]; of a rotation the moment of inertia.
        force: F along the axis, a number or a function of time [force].
        weight: W along the axis, a dead weight that acts all the time [force].
        velocity: ṡ at time 0, of a machine with mass [length/time].
        corners: Times at which the force has a kink or a jump [time].

    Raises:
        ValueError: The axis is none, a number is outside its range, or a machine without mass has a velocity.
    """

    axis: str | tuple[float, ...]
    stiffness: float = 0.0
    damping: float = 0.0
    mass: float = 0.0
    force: float | TimeFunction = 0.0
    weight: float = 0.0
    velocity: float = 0.0
    corners: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if isinstance(self.axis, str):
            known = (*"xyz", "-x", "-y", "-z", *TURNS)
            require("axis", self.axis, self.axis in known, f"a vector, or one of {', '.join(known)}")
        else:
            require_numbers("axis", self.axis, finite, least=2)
            require("axis", self.axis, bool(np.any(self.axis)), "a direction, not all zero")
        for name in ("stiffness", "damping", "mass"):
            require_number(name, getattr(self, name), nonnegative)
        for name in ("weight", "velocity"):
            require_number(name, getattr(self, name), finite)
        require("velocity", self.velocity, self.mass > 0 or self.velocity == 0, "0 for a machine without mass")
        self.force_at(0.0)
        require_numbers("corners", self.corners, finite, least=0)

    def force_at(self, time: float) -> float:
        """Force at a time [force].

        Raises:
            ValueError: It is no finite number.
        """
        name, force = ("force", self.force) if not callable(self.force) else (f"force({time:.6g})", self.force(time))
        require_number(name, force, finite)
        return float(force)

    @property
    def turns(self) -> bool:
        """Whether the coordinate is a rotation."""
        return self.axis in TURNS

    @property
    def holds(self) -> bool:
        """Whether it resists a motion of its coordinate by itself."""
        return self.stiffness > 0 or self.damping > 0 or self.mass > 0

    def direction(self, gdim: int) -> NDArray[np.float64]:
        """Unit vector of the axis: `gdim` components of a translation, three of a rotation.

        Raises:
            ValueError: There is no such axis in this dimension.
        """
        if self.turns:
            require("axis", self.axis, gdim == 3 or self.axis == "rz", "'rz' in the plane")
            return np.eye(3)[TURNS.index(str(self.axis))]
        if isinstance(self.axis, str):
            axes = "xyz"[:gdim]
            require("axis", self.axis, self.axis[-1] in axes, f"along one of {', '.join(axes)}")
            return np.asarray((-1.0 if self.axis[0] == "-" else 1.0) * np.eye(gdim)[axes.index(self.axis[-1])])
        require_numbers("axis", self.axis, length=gdim)
        return np.asarray(self.axis, dtype=float) / np.linalg.norm(self.axis)
