"""Blade and needle, whole or in halves (docs/theory.md §4)."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from math import cos, pi, sin, tan
from typing import ClassVar

import numpy as np
import ufl
from numpy.typing import NDArray

from cutsim.base.checks import above, between, positive, require, require_number
from cutsim.base.functions import positive_part
from cutsim.base.kinematics import Expr
from cutsim.base.signatures import checked
from cutsim.base.units import Angle, Length
from cutsim.interface.contact import PenaltyContact
from cutsim.tools.shapes import Direction, along, from_axis, hypot, unit_vector

# penalty over E/h and half the width of the quadratic start over h, for an intact surface
_FIRM, _BLEND = 1000.0, 0.1


def _pointed(across: Expr, above: Expr, half_angle: float, width: float, radius: float) -> Expr:
    """Distance to a pointed body with a rounded tip and joint, in the plane of its axis.

    Args:
        across: Distance from the axis, or < 0 where the body goes on without end.
        above: Height above the tip of the core, in the body.
        half_angle: Angle between axis and flank.
        width: Half width of the shank of the core, a convex polygon.
        radius: Radius of tip and joint, by which the body is larger than its core.
    """
    height = width / tan(half_angle)
    s, c = sin(half_angle), cos(half_angle)
    slope = across * s + above * c
    length = (width**2 + height**2) ** 0.5
    tip = ufl.conditional(ufl.lt(across, 0), -above, hypot(across, above, radius))
    flank = across * c - above * s
    joint = hypot(across - width, above - height, radius)
    shank = ufl.conditional(ufl.gt(above, height), across - width, joint)
    return ufl.conditional(ufl.lt(slope, 0), tip, ufl.conditional(ufl.lt(slope, length), flank, shank)) - radius


class Pointed(ABC):
    """Base of blade and needle: a rounded tip, flanks at a half angle, and a shank.

    Attributes:
        half_angle: Angle between axis and flank [rad].
        tip_radius: Radius of the tip and of the joint of flank and shank [length].
        push: Direction in which the tool points; the reference point is the foremost point of the tip.
        lateral: Direction normal to the plane in which the tool is halved.
        side: 0 for the whole tool, +1 or −1 for the half on the side of ±lateral.
        round: Whether it is a body of revolution about its axis, else it extends along an edge.
        firmness: Penalty of its contact with a soft solid, times mesh size over Young's modulus, and half the width of
            the quadratic start over the tip radius; as `contact` takes them.
    """

    directions: ClassVar[tuple[str, ...]] = ("push", "lateral")

    half_angle: Angle
    tip_radius: Length
    push: Direction
    lateral: Direction | None
    side: int
    round: ClassVar[bool]
    # measured: stiff enough for the force, soft enough for Newton's method
    firmness: ClassVar[tuple[float, float]]

    @property
    @abstractmethod
    def width(self) -> float:
        """Half the thickness of the shank [length]."""

    @property
    def resolution(self) -> float:
        """Tip radius [length]."""
        return self.tip_radius

    def contact(self, young: float, h: float) -> PenaltyContact:
        """Contact law of the tool in a soft solid, as soft as the force allows.

        Args:
            young: Young's modulus of the solid [stress].
            h: Size of its cells normal to the surface [length].
        """
        factor, blend = self.firmness
        return PenaltyContact.automatic(young, h, factor, blend=blend * self.tip_radius)

    @staticmethod
    def firm_contact(young: float, h: float) -> PenaltyContact:
        """Contact law on an intact surface, where a tip presses much harder than in a cut.

        The pressure grows with the square of the penetration. At 25 times Young's modulus that is a tenth of h.

        Args:
            young: Young's modulus of the solid [stress].
            h: Size of its cells normal to the surface [length].
        """
        return PenaltyContact.automatic(young, h, _FIRM, blend=_BLEND * h)

    @property
    def shaft_height(self) -> float:
        """Height above the foremost point at which the shank begins [length]."""
        return (self.width - self.tip_radius) / tan(self.half_angle) + self.tip_radius

    def half_width(self, height: float) -> float:
        """Distance from the axis to the flank or shank, a height above the tip [length]."""
        flank = ((height - self.tip_radius) * sin(self.half_angle) + self.tip_radius) / cos(self.half_angle)
        return min(flank, self.width)

    def outline(self, height: float, points: int = 12) -> NDArray[np.float64]:
        """Section of the whole tool through its axis up to a height above the tip, for pictures.

        Args:
            height: Height above the tip [length].
            points: Points on the arc of the tip, on each side.

        Returns:
            Closed polygon without repeated point, rows (lateral, above the tip) [length].
        """
        turn = np.linspace(0, pi / 2 - self.half_angle, points)
        arc = self.tip_radius * np.column_stack([np.sin(turn), 1 - np.cos(turn)])
        rest = [(self.half_width(h), h) for h in sorted({min(self.shaft_height, height), height})]
        right = np.vstack([arc, rest])
        return np.vstack([right, (right * (-1, 1))[:0:-1]])

    def distance(self, x: Expr) -> Expr:
        """Distance to the sharp core minus the tip radius [length]."""
        above = -along(x, self.push) - self.tip_radius  # from the core's tip into the tool
        width = self.width - self.tip_radius
        return _pointed(self._across(x), above, self.half_angle, width, self.tip_radius)

    @abstractmethod
    def _across(self, x: Expr) -> Expr:
        """Distance from the axis, < 0 where a half goes on without end."""

    def _check(self, width: str) -> None:
        """Refuse values outside their range; directions become unit vectors."""
        require_number("half_angle", self.half_angle, between(0, pi / 2, name="π/2 rad"))
        require_number("tip_radius", self.tip_radius, positive)
        require_number(width, self.width, above(self.tip_radius, "tip_radius"))
        require("side", self.side, self.side in (-1, 0, 1), "-1, 0 or 1")
        object.__setattr__(self, "push", unit_vector("push", self.push))
        require("lateral", self.lateral, self.side == 0 or self.lateral is not None, "a direction, to halve the tool")
        if self.lateral is not None:
            object.__setattr__(self, "lateral", unit_vector("lateral", self.lateral))
            alike = len(self.lateral) == len(self.push)
            require("lateral", self.lateral, alike, f"of {len(self.push)} components, as push has")
            inner = float(np.dot(self.push, self.lateral))
            require("lateral", self.lateral, abs(inner) < 1e-12, "orthogonal to push")


@checked
@dataclass(frozen=True)
class Blade(Pointed):
    """Wedge blade with a rounded tip, flanks at the half angle and a parallel shank; its edge has no ends.

    With `side` = ±1 it is the *convex half blade* that one crack face meets: the half on the side of ±lateral,
    continued without end to the other side, so that no face is ever pushed to the wrong side.

    Args:
        half_angle: Angle between flank and plane of symmetry [rad], in (0, π/2).
        tip_radius: Radius r > 0 of the tip and of the joint of flank and shank [length].
        half_thickness: Half the thickness of the shank, > r [length].
        push: Direction in which the blade cuts; the reference point is the foremost point of the tip.
        lateral: Direction normal to the plane of symmetry.
        side: 0 for the whole blade, +1 or −1 for the half on the side of ±lateral.

    Raises:
        ValueError: A value is outside its range, or push and lateral are not orthogonal.
    """

    round: ClassVar[bool] = False
    firmness: ClassVar[tuple[float, float]] = (5.0, 0.4)

    half_angle: Angle
    tip_radius: Length
    half_thickness: Length
    push: Direction = (0.0, -1.0)
    lateral: Direction = (1.0, 0.0)
    side: int = 0

    def __post_init__(self) -> None:
        self._check("half_thickness")

    @property
    def width(self) -> float:
        """Half the thickness of the shank [length]."""
        return self.half_thickness

    def _across(self, x: Expr) -> Expr:
        across = along(x, self.lateral)
        return abs(across) if self.side == 0 else self.side * across


@checked
@dataclass(frozen=True)
class Needle(Pointed):
    """Round needle with a rounded conical tip and a cylindrical shaft, for 3-D and bodies of revolution.

    In a plane problem it is a wedge blade.  With `side` = ±1 it is the *convex half needle* that one face of a planar
    crack meets: the half on the side of ±lateral, continued without end to the other side.

    Args:
        half_angle: Angle between axis and cone [rad], in (0, π/2).
        tip_radius: Radius r > 0 of the tip and of the joint of cone and shaft [length].
        radius: Radius of the shaft, > r [length].
        push: Direction in which the needle points; the reference point is the foremost point of the tip.
        lateral: Direction normal to the plane in which the needle is halved; a whole one needs none.
        side: 0 for the whole needle, +1 or −1 for the half on the side of ±lateral.

    Raises:
        ValueError: A value is outside its range, or push and lateral are not orthogonal.
    """

    round: ClassVar[bool] = True
    firmness: ClassVar[tuple[float, float]] = (20.0, 0.1)  # pressed harder than a blade, all along its shaft

    half_angle: Angle
    tip_radius: Length
    radius: Length
    push: Direction = (0.0, -1.0)
    lateral: Direction | None = None
    side: int = 0

    def __post_init__(self) -> None:
        self._check("radius")

    @property
    def width(self) -> float:
        """Radius of the shaft [length]."""
        return self.radius

    def _across(self, x: Expr) -> Expr:
        if self.lateral is None or self.side == 0:
            return from_axis(x, self.push, self.tip_radius)
        lateral = along(x, self.lateral)
        rest = x - along(x, self.push) * ufl.as_vector(self.push) - lateral * ufl.as_vector(self.lateral)
        ahead = positive_part(self.side * lateral)
        return ufl.sqrt(ahead**2 + ufl.dot(rest, rest) + (1e-8 * self.tip_radius) ** 2)
