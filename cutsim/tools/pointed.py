"""Blade and needle, whole or in halves (docs/theory.md §4)."""

from abc import abstractmethod
from dataclasses import dataclass
from math import cos, pi, sin, tan
from typing import ClassVar

import numpy as np
import ufl
from numpy.typing import NDArray

from cutsim.base.checks import above, between, positive, require, require_number
from cutsim.base.functions import larger, positive_part
from cutsim.base.kinematics import Expr
from cutsim.base.signatures import checked
from cutsim.base.units import Angle, Length
from cutsim.tools.insertable import Insertable
from cutsim.tools.shapes import Direction, along, from_axis, hypot, unit_vector


def _pointed(across: Expr, above: Expr, half_angle: Expr, width: Expr, scale: Expr) -> Expr:
    """Distance to a sharp pointed body, a convex polygon, in the plane of its axis.

    Args:
        across: Distance from the axis, or < 0 where the body goes on without end.
        above: Height above the tip, in the body.
        half_angle: Angle between axis and flank; 0 for a flank that is the shank itself.
        width: Half width of the shank.
        scale: A length, to which others are not small.
    """
    s, c = ufl.sin(half_angle), ufl.cos(half_angle)
    slope = across * s + above * c
    tip = ufl.conditional(ufl.lt(across, 0), -above, hypot(across, above, scale))
    flank = across * c - above * s
    if half_angle != 0:
        height = width / ufl.tan(half_angle)
        length = (width**2 + height**2) ** 0.5
        joint = hypot(across - width, above - height, scale)
        shank = ufl.conditional(ufl.gt(above, height), across - width, joint)
        flank = ufl.conditional(ufl.lt(slope, length), flank, shank)
    return ufl.conditional(ufl.lt(slope, 0), tip, flank)


class Pointed(Insertable):
    """Base of blade and needle: a rounded tip, flanks at a half angle, and a shank.

    Attributes:
        half_angle: Angle between axis and flank [rad].
        tip_radius: Radius of the tip and of the joint of flank and shank [length].
        push: Direction in which the tool points; the reference point is the foremost point of the tip.
        lateral: Direction normal to the plane in which the tool is halved.
    """

    half_angle: Angle
    tip_radius: Length

    @property
    def normal(self) -> Direction | None:
        """The lateral direction."""
        return self.lateral

    @property
    @abstractmethod
    def width(self) -> float:
        """Half the thickness of the shank [length]."""

    @property
    def resolution(self) -> float:
        """Tip radius [length]."""
        return self.tip_radius

    def flank_angle(self, side: int) -> float:
        """Angle between axis and flank on the side of ±lateral [rad]."""
        return self.half_angle

    @property
    def shaft_height(self) -> float:
        """Height above the foremost point at which the shank begins [length]."""
        sides = (self.side,) if self.side else (1, -1)
        return max(self._shaft_height(self.flank_angle(side)) for side in sides)

    def _shaft_height(self, angle: float) -> float:
        return (self.width - self.tip_radius) / tan(angle) + self.tip_radius if angle > 0 else self.tip_radius

    def half_width(self, height: float, side: int | None = None) -> float:
        """Distance from the axis to the flank or shank, a height above the tip [length].

        Args:
            height: The height [length].
            side: On the side of ±lateral; by default that of the tool, and + of a whole one.
        """
        angle = self.flank_angle(side or self.side or 1)
        flank = ((height - self.tip_radius) * sin(angle) + self.tip_radius) / cos(angle)
        return min(flank, self.width)

    def outline(self, height: float, points: int = 12) -> NDArray[np.float64]:
        """Section of the whole tool through its axis up to a height above the tip, for pictures.

        Args:
            height: Height above the tip [length].
            points: Points on the arc of the tip, on each side.

        Returns:
            Closed polygon without repeated point, rows (lateral, above the tip) [length].
        """
        right, left = (self._outline(side, height, points) for side in (1, -1))
        return np.vstack([right, (left * (-1, 1))[:0:-1]])

    def _outline(self, side: int, height: float, points: int) -> NDArray[np.float64]:
        """The part on one side, from the tip upwards."""
        angle = self.flank_angle(side)
        turn = np.linspace(0, pi / 2 - angle, points)
        arc = self.tip_radius * np.column_stack([np.sin(turn), 1 - np.cos(turn)])
        heights = sorted({min(self._shaft_height(angle), height), height})
        return np.vstack([arc, [(self.half_width(h, side), h) for h in heights]])

    def distance(self, x: Expr) -> Expr:
        """Distance to the sharp core minus the tip radius [length]."""
        above = -along(x, self.push) - self.tip_radius  # from the core's tip into the tool
        return self._core(x, above) - self.tip_radius

    @abstractmethod
    def _core(self, x: Expr, above: Expr) -> Expr:
        """Distance to the core, at a height above its tip."""

    def _section(self, across: Expr, above: Expr, angle: Expr) -> Expr:
        """Distance to the core in the plane of the axis, on a side with this angle between axis and flank."""
        return _pointed(across, above, angle, self.width - self.tip_radius, self.tip_radius)

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
    """Wedge blade with a rounded tip, flanks at the half angle and a parallel shank.

    The edge is straight and has no ends, or in space two rounded ones.  The flanks may differ, as those of a blade that
    is ground on one side.

    With `side` = ±1 it is the *convex half blade* that one crack face meets: the half on the side of ±lateral,
    continued without end to the other side, so that no face is ever pushed to the wrong side.

    Args:
        half_angle: Angle between flank and plane of symmetry [rad], in (0, π/2).
        tip_radius: Radius r > 0 of the tip and of the joint of flank and shank [length].
        half_thickness: Half the thickness of the shank, > r [length].
        push: Direction in which the blade cuts; the reference point is the foremost point of the tip.
        lateral: Direction normal to the plane of symmetry.
        side: 0 for the whole blade, +1 or −1 for the half on the side of ±lateral.
        back_angle: Angle of the flank on the side of −lateral [rad], in [0, π/2); 0 for a blade that is ground on one
            side, by default the half angle.
        edge_length: Length of the edge, in space, of which the reference point is the middle; > 2 r [length]. None for
            an edge without ends.

    Raises:
        ValueError: A value is outside its range, or push and lateral are not orthogonal.
    """

    round: ClassVar[bool] = False
    # met more firmly, an edge that is as small as an element catches on each node, and the force is too large; pressed
    # by 0.3 to 1 E a face gives way by 0.2 to 0.35 h, for most of which the clearance makes up
    firmness: ClassVar[tuple[float, float, float]] = (10.0, 0.3, 0.2)

    half_angle: Angle
    tip_radius: Length
    half_thickness: Length
    push: Direction = (0.0, -1.0)
    lateral: Direction = (1.0, 0.0)
    side: int = 0
    back_angle: Angle | None = None
    edge_length: Length | None = None

    def __post_init__(self) -> None:
        self._check("half_thickness")
        require_number("back_angle", self.back_angle, between(0, pi / 2, "[)", name="π/2 rad").or_none)
        require_number("edge_length", self.edge_length, above(2 * self.tip_radius, "2 tip_radius").or_none)
        spatial = self.edge_length is None or len(self.push) == 3
        require("edge_length", self.edge_length, spatial, "None in the plane")

    @property
    def width(self) -> float:
        """Half the thickness of the shank [length]."""
        return self.half_thickness

    def flank_angle(self, side: int) -> float:
        """Angle between axis and flank on the side of ±lateral [rad]."""
        return self.half_angle if side > 0 or self.back_angle is None else self.back_angle

    def _core(self, x: Expr, above: Expr) -> Expr:
        across = along(x, self.lateral)
        if self.back_angle is None:
            section = self._section(abs(across) if self.side == 0 else self.side * across, above, self.half_angle)
        else:
            front = self._section(across, above, self.half_angle)
            back = self._section(-across, above, self.back_angle)
            # a whole blade is the larger one of both halves, each without end on the other side
            section = larger(front, back) if self.side == 0 else ufl.conditional(ufl.gt(self.side, 0), front, back)
        if self.edge_length is None:
            return section
        edge = ufl.cross(ufl.as_vector(self.push), ufl.as_vector(self.lateral))
        beyond = abs(along(x, edge)) - (0.5 * self.edge_length - self.tip_radius)
        outside = hypot(positive_part(section), positive_part(beyond), self.tip_radius)
        deep = larger(section, beyond)
        return ufl.conditional(ufl.lt(deep, 0), deep, outside)


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
    # pressed harder than a blade, by 1 E and more, all along its shaft
    firmness: ClassVar[tuple[float, float, float]] = (20.0, 0.2, 0.2)

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

    def _core(self, x: Expr, above: Expr) -> Expr:
        return self._section(self._across(x), above, self.half_angle)

    def _across(self, x: Expr) -> Expr:
        """Distance from the axis, 0 where a half goes on without end."""
        if self.lateral is None or self.side == 0:
            return from_axis(x, self.push, self.tip_radius)
        lateral = along(x, self.lateral)
        rest = x - along(x, self.push) * ufl.as_vector(self.push) - lateral * ufl.as_vector(self.lateral)
        ahead = positive_part(self.side * lateral)
        return ufl.sqrt(ahead**2 + ufl.dot(rest, rest) + (1e-8 * self.tip_radius) ** 2)
