"""Needles that are not pointed in the middle: with a bevel, and hollow (docs/theory.md §4)."""

from dataclasses import dataclass
from math import cos, pi, radians, sin, sqrt, tan
from typing import ClassVar

import numpy as np
import ufl

from cutsim.base.checks import above, between, positive, require, require_number
from cutsim.base.functions import larger, positive_part
from cutsim.base.kinematics import Expr
from cutsim.base.signatures import checked
from cutsim.base.units import Angle, Length
from cutsim.tools.insertable import Insertable
from cutsim.tools.shapes import Direction, along, flat_ended, from_axis, unit_vector

# iterations for the nearest point of the edge of a bevel: 2e-6 of the radius for the sharpest and bluntest one
_ITERATIONS = 3
_SHARPEST, _BLUNTEST = radians(15), 0.2


@checked
@dataclass(frozen=True)
class HollowNeedle:
    """Hollow needle, or ring punch, with a flat end whose edges are rounded; for 3-D and bodies of revolution.

    The reference point is on the axis, in the plane of the end.  In a plane problem it is a pair of strips.

    Args:
        outer_radius: Outer radius of the wall [length].
        inner_radius: Radius of the bore > 0 [length].
        edge_radius: Radius of the rounded edges > 0, below half the thickness of the wall [length].
        push: Direction in which the needle points.

    Raises:
        ValueError: A value is outside its range.
    """

    parametric: ClassVar[bool] = True

    outer_radius: Length
    inner_radius: Length
    edge_radius: Length
    push: Direction = (0.0, -1.0)

    def __post_init__(self) -> None:
        require_number("edge_radius", self.edge_radius, positive)
        require_number("inner_radius", self.inner_radius, positive)
        least = self.inner_radius + 2 * self.edge_radius
        require_number("outer_radius", self.outer_radius, above(least, "inner_radius + 2 edge_radius"))
        object.__setattr__(self, "push", unit_vector("push", self.push))

    @property
    def resolution(self) -> float:
        """Edge radius [length]."""
        return self.edge_radius

    def distance(self, x: Expr) -> Expr:
        """Distance to the core, a tube of a thinner wall, minus the edge radius [length]."""
        r, middle = self.edge_radius, 0.5 * (self.outer_radius + self.inner_radius)
        half = 0.5 * (self.outer_radius - self.inner_radius) - r
        across = abs(from_axis(x, self.push, r) - middle) - half
        return flat_ended(across, along(x, self.push) + r, r) - r


@checked
@dataclass(frozen=True)
class BevelNeedle(Insertable):
    """Round needle whose end is cut off obliquely, with a rounded edge, in 3-D.

    The reference point is on the axis, as high as the foremost point of the tip, which lies on the side of −lateral.
    The needle is halved in its plane of symmetry, that of push and lateral: in this plane lies a crack along which it
    is inserted.  With `side` = ±1 it is the *convex half needle* that one face of the crack meets: the half on the side
    of ±push × lateral, continued without end to the other side.

    Args:
        bevel_angle: Angle between axis and face of the bevel [rad], from 15° to below π/2.
        radius: Radius of the shaft [length].
        edge_radius: Radius of the rounded edge > 0, at most a fifth of the radius [length].
        push: Direction in which the needle points.
        lateral: Direction, normal to push, to which the face of the bevel looks.
        side: 0 for the whole needle, +1 or −1 for a half.

    Raises:
        ValueError: A value is outside its range, or push and lateral are not orthogonal vectors in space.
    """

    round: ClassVar[bool] = True
    mirrored: ClassVar[bool] = False
    halving: ClassVar[str] = "in the plane of the crack"
    angle: ClassVar[str] = "bevel_angle"
    firmness: ClassVar[tuple[float, float, float]] = (20.0, 0.2, 0.2)  # as that of other needles

    bevel_angle: Angle
    radius: Length
    edge_radius: Length
    push: Direction = (0.0, 0.0, -1.0)
    lateral: Direction = (1.0, 0.0, 0.0)
    side: int = 0

    def __post_init__(self) -> None:
        require_number("bevel_angle", self.bevel_angle, between(_SHARPEST, pi / 2, "[)", name="π/2 rad"))
        require_number("radius", self.radius, positive)
        blunt = between(0, _BLUNTEST * self.radius, "(]", name="radius/5")
        require_number("edge_radius", self.edge_radius, blunt)
        for name in ("push", "lateral"):
            object.__setattr__(self, name, unit_vector(name, getattr(self, name)))
            require(name, getattr(self, name), len(getattr(self, name)) == 3, "a vector of 3 numbers")
        inner = sum(p * q for p, q in zip(self.push, self.lateral, strict=True))
        require("lateral", self.lateral, abs(inner) < 1e-12, "orthogonal to push")
        require("side", self.side, self.side in (-1, 0, 1), "-1, 0 or 1")

    @property
    def resolution(self) -> float:
        """Edge radius [length]."""
        return self.edge_radius

    @property
    def normal(self) -> Direction:
        """Normal of its plane of symmetry, push × lateral."""
        return tuple(float(n) for n in np.cross(self.push, self.lateral))

    @property
    def shaft_height(self) -> float:
        """Height above the foremost point at which the section is the whole circle [length]."""
        return self._height_of(self.radius)

    def half_width(self, height: float, side: int | None = None) -> float:
        """Half the chord of the section where the bevel cuts it off, of a needle with a sharp edge [length].

        Args:
            height: Height above the tip [length].
            side: Of no consequence: both halves are alike.
        """
        tip = self._height_of(-self.radius)
        edge = -self.radius + (height - tip) * tan(self.bevel_angle)
        return sqrt(max(self.radius**2 - edge**2, 0.0)) if edge < 0 else self.radius

    def _height_of(self, place: float) -> float:
        """Height at which the plane of the bevel is at a place along lateral [length]."""
        r, s, c = self.edge_radius, sin(self.bevel_angle), cos(self.bevel_angle)
        return ((place + self.radius) * c - r * (1 + c - s)) / s

    def distance(self, x: Expr) -> Expr:
        """Distance to the core, a thinner cylinder with a sharp edge, minus the edge radius [length]."""
        r, s, c = self.edge_radius, ufl.sin(self.bevel_angle), ufl.cos(self.bevel_angle)
        core = self.radius - r
        u, height = along(x, self.lateral), -along(x, self.push) - r
        v = along(x, ufl.cross(ufl.as_vector(self.push), ufl.as_vector(self.lateral)))
        if self.side != 0:  # both halves mirror each other: beyond the plane all is as in it
            v = positive_part(self.side * v)
        radial = ufl.sqrt(u**2 + v**2 + (1e-8 * r) ** 2)
        side, face = radial - core, (u + core) * c - height * s
        # < 0 outside of either surface, where its nearest point is within the other one
        beside = larger((core * u / radial + core) * c - height * s, -side)
        below = larger((u - face * c) ** 2 + v**2 - core**2, -face)
        edge = self._to_edge((u, v, height), radial, core)
        outside = ufl.conditional(ufl.lt(beside, 0), side, ufl.conditional(ufl.lt(below, 0), face, edge))
        deep = larger(side, face)
        return ufl.conditional(ufl.lt(deep, 0), deep, outside) - r

    def _to_edge(self, place: tuple[Expr, Expr, Expr], radial: Expr, core: float) -> Expr:
        """Distance to the edge of the core, an ellipse, by Newton's method for the place on it."""
        (u, v, height), slope = place, 1 / ufl.tan(self.bevel_angle)
        c, s = u / radial, v / radial
        for _ in range(_ITERATIONS):
            rest = height - core * slope * (c + 1)
            step = (s * u - c * v + slope * s * rest) / (c * u + s * v + core * (slope * s) ** 2 + slope * c * rest)
            c, s = c + s * step, s - c * step
            size = ufl.sqrt(c**2 + s**2)
            c, s = c / size, s / size
        arm = u - core * c, v - core * s, height - core * slope * (c + 1)
        return ufl.sqrt(sum(a**2 for a in arm) + (1e-8 * self.edge_radius) ** 2)
