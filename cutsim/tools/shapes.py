"""Rigid tools: smooth signed distances and prescribed paths (docs/theory.md §4).

A shape is a frozen dataclass with one method, `distance(x)`, for a position relative to the tool's reference point:
negative inside, |∇d| = 1.  Rounded shapes are the set of points within the tip radius of a sharp core, so that a
single formula gives tip, flank and shank without a kink.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import cos, pi, sin, tan
from typing import Protocol, runtime_checkable

import numpy as np
import ufl
from numpy.typing import NDArray

from cutsim.base.checks import require
from cutsim.base.kinematics import Expr

Direction = tuple[float, ...]


@runtime_checkable
class Shape(Protocol):
    """What tool contact needs of a shape; see docs/adding_a_tool.md."""

    @property
    def resolution(self) -> float:
        """Smallest radius of the surface [length]; the mesh under the tool has to resolve it."""

    def distance(self, x: Expr) -> Expr:
        """Signed distance at a position relative to the reference point [length], negative inside."""


def _unit(name: str, vector: Direction) -> Direction:
    norm = float(np.linalg.norm(vector))
    require(name, vector, len(vector) in (2, 3) and norm > 0, "a non-zero vector of 2 or 3 numbers")
    return tuple(float(v) / norm for v in vector)


def _along(x: Expr, direction: Direction) -> Expr:
    return ufl.dot(x, ufl.as_vector(direction))


def _hypot(a: Expr, b: Expr, scale: float) -> Expr:
    # the floor keeps the gradient finite at the core's corner, a tip radius away from any contact
    return ufl.sqrt(a**2 + b**2 + (1e-8 * scale) ** 2)


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
    along = across * s + above * c
    length = (width**2 + height**2) ** 0.5
    tip = ufl.conditional(ufl.lt(across, 0), -above, _hypot(across, above, radius))
    flank = across * c - above * s
    joint = _hypot(across - width, above - height, radius)
    shank = ufl.conditional(ufl.gt(above, height), across - width, joint)
    return ufl.conditional(ufl.lt(along, 0), tip, ufl.conditional(ufl.lt(along, length), flank, shank)) - radius


def _from_axis(x: Expr, push: Direction, scale: float) -> Expr:
    """Distance from the axis along push, differentiable on it."""
    radial = x - _along(x, push) * ufl.as_vector(push)
    return ufl.sqrt(ufl.dot(radial, radial) + (1e-8 * scale) ** 2)


@dataclass(frozen=True)
class Blade:
    """Wedge blade: rounded tip, flank at the half angle, parallel shank; its edge extends without end.

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

    half_angle: float
    tip_radius: float
    half_thickness: float
    push: Direction = (0.0, -1.0)
    lateral: Direction = (1.0, 0.0)
    side: int = 0

    def __post_init__(self) -> None:
        require("half_angle", self.half_angle, 0 < self.half_angle < pi / 2, "in (0, pi/2) rad")
        require("tip_radius", self.tip_radius, self.tip_radius > 0, "> 0")
        require(
            "half_thickness",
            self.half_thickness,
            self.half_thickness > self.tip_radius,
            f"> tip_radius = {self.tip_radius}",
        )
        require("side", self.side, self.side in (-1, 0, 1), "-1, 0 or 1")
        object.__setattr__(self, "push", _unit("push", self.push))
        object.__setattr__(self, "lateral", _unit("lateral", self.lateral))
        inner = float(np.dot(self.push, self.lateral))
        require("lateral", self.lateral, abs(inner) < 1e-12, "orthogonal to push")

    @property
    def resolution(self) -> float:
        """Tip radius [length]."""
        return self.tip_radius

    @property
    def flank_height(self) -> float:
        """Distance along the blade from the tip's centre to the beginning of the shank [length]."""
        return (self.half_thickness - self.tip_radius) / tan(self.half_angle)

    def half_width(self, height: float) -> float:
        """Lateral distance from the plane of symmetry to the flank or shank, a height above the tip [length]."""
        flank = ((height - self.tip_radius) * sin(self.half_angle) + self.tip_radius) / cos(self.half_angle)
        return min(flank, self.half_thickness)

    def outline(self, height: float, points: int = 12) -> NDArray[np.float64]:
        """Cross-section of the whole blade up to a height above the tip, for pictures.

        Args:
            height: Height above the tip [length].
            points: Points on the arc of the tip, on each side.

        Returns:
            Closed polygon without repeated point, rows (lateral, above the tip) [length].
        """
        turn = np.linspace(0, pi / 2 - self.half_angle, points)
        arc = self.tip_radius * np.column_stack([np.sin(turn), 1 - np.cos(turn)])
        flank = self.flank_height + self.tip_radius
        rest = [(self.half_width(h), h) for h in sorted({min(flank, height), height})]
        right = np.vstack([arc, rest])
        return np.vstack([right, (right * (-1, 1))[:0:-1]])

    def distance(self, x: Expr) -> Expr:
        """Distance to the sharp core (a convex polygon) minus the tip radius [length]."""
        across = _along(x, self.lateral)
        across = abs(across) if self.side == 0 else self.side * across
        above = -_along(x, self.push) - self.tip_radius  # from the core's tip into the blade
        return _pointed(across, above, self.half_angle, self.half_thickness - self.tip_radius, self.tip_radius)


@dataclass(frozen=True)
class Needle:
    """Round needle: cone with a rounded tip, cylindrical shaft; for 3-D and bodies of revolution.

    In a plane problem it is a wedge blade.

    Args:
        half_angle: Angle between axis and cone [rad], in (0, π/2).
        tip_radius: Radius r > 0 of the tip and of the joint of cone and shaft [length].
        radius: Radius of the shaft, > r [length].
        push: Direction in which the needle points; the reference point is the foremost point of the tip.

    Raises:
        ValueError: A value is outside its range.
    """

    half_angle: float
    tip_radius: float
    radius: float
    push: Direction = (0.0, -1.0)

    def __post_init__(self) -> None:
        require("half_angle", self.half_angle, 0 < self.half_angle < pi / 2, "in (0, pi/2) rad")
        require("tip_radius", self.tip_radius, self.tip_radius > 0, "> 0")
        require("radius", self.radius, self.radius > self.tip_radius, f"> tip_radius = {self.tip_radius}")
        object.__setattr__(self, "push", _unit("push", self.push))

    @property
    def resolution(self) -> float:
        """Tip radius [length]."""
        return self.tip_radius

    @property
    def shaft_height(self) -> float:
        """Height above the foremost point at which the shaft begins [length]."""
        return (self.radius - self.tip_radius) / tan(self.half_angle) + self.tip_radius

    def distance(self, x: Expr) -> Expr:
        """Distance to the sharp core (a cone with a cylinder) minus the tip radius [length]."""
        across = _from_axis(x, self.push, self.tip_radius)
        above = -_along(x, self.push) - self.tip_radius
        return _pointed(across, above, self.half_angle, self.radius - self.tip_radius, self.tip_radius)


@dataclass(frozen=True)
class Ball:
    """Sphere in 3-D, cylinder (or wire) in 2-D or, with an axis, in 3-D; the reference point is the centre.

    Args:
        radius: Radius > 0 [length].
        axis: Axis of a cylinder in 3-D, None for a sphere or in 2-D.

    Raises:
        ValueError: A value is outside its range.
    """

    radius: float
    axis: Direction | None = None

    def __post_init__(self) -> None:
        require("radius", self.radius, self.radius > 0, "> 0")
        if self.axis is not None:
            object.__setattr__(self, "axis", _unit("axis", self.axis))

    @property
    def resolution(self) -> float:
        """Radius [length]."""
        return self.radius

    def distance(self, x: Expr) -> Expr:
        """Distance from the centre (or axis) minus the radius [length]."""
        radial = x if self.axis is None else x - _along(x, self.axis) * ufl.as_vector(self.axis)
        return ufl.sqrt(ufl.dot(radial, radial) + (1e-8 * self.radius) ** 2) - self.radius


@dataclass(frozen=True)
class FlatPunch:
    """Flat-ended punch, circular in 3-D and a strip in 2-D, with a rounded edge; reference point on the face.

    Args:
        radius: Radius (half width in 2-D) > edge_radius [length].
        edge_radius: Radius of the rounded edge > 0 [length].
        push: Direction in which the punch indents.

    Raises:
        ValueError: A value is outside its range.
    """

    radius: float
    edge_radius: float
    push: Direction = (0.0, -1.0)

    def __post_init__(self) -> None:
        require("edge_radius", self.edge_radius, self.edge_radius > 0, "> 0")
        require("radius", self.radius, self.radius > self.edge_radius, f"> edge_radius = {self.edge_radius}")
        object.__setattr__(self, "push", _unit("push", self.push))

    @property
    def resolution(self) -> float:
        """Edge radius [length]."""
        return self.edge_radius

    def distance(self, x: Expr) -> Expr:
        """Distance to the core, a flat disc with a straight shank, minus the edge radius [length]."""
        r = self.edge_radius
        across = _from_axis(x, self.push, r) - (self.radius - r)
        below = _along(x, self.push) + r
        corner = _hypot(across, below, r)
        side = ufl.conditional(ufl.lt(below, 0), across, corner)
        face = ufl.conditional(ufl.lt(across, 0), below, corner)
        return ufl.conditional(ufl.gt(across, below), side, face) - r


@dataclass(frozen=True)
class Plane:
    """Half-space behind a plane through the reference point.

    Args:
        normal: Outward normal of the tool, pointing to the body.

    Raises:
        ValueError: The normal is zero.
    """

    normal: Direction

    def __post_init__(self) -> None:
        object.__setattr__(self, "normal", _unit("normal", self.normal))

    @property
    def resolution(self) -> float:
        """A plane needs no resolution: infinite."""
        return float("inf")

    def distance(self, x: Expr) -> Expr:
        """Distance along the normal [length]."""
        return _along(x, self.normal)


@dataclass(frozen=True)
class Path:
    """Prescribed motion of a tool's reference point.

    Args:
        position: Position at a time, array of the geometric dimension [length].
        corners: Times at which the velocity jumps; the stepping meets them exactly.
    """

    position: Callable[[float], NDArray[np.float64]]
    corners: tuple[float, ...] = field(default=())

    @classmethod
    def polyline(cls, times: Sequence[float], points: Sequence[Sequence[float]]) -> "Path":
        """Straight motion between points, at rest before the first and after the last time.

        Raises:
            ValueError: Times do not increase or their number differs from that of the points.
        """
        t, p = np.asarray(times, dtype=float), np.asarray(points, dtype=float)
        require("times", list(times), t.ndim == 1 and bool(np.all(np.diff(t) > 0)), "increasing")
        require("points", p.shape, p.ndim == 2 and len(p) == len(t), f"one row for each of the {len(t)} times")
        return cls(
            lambda s: np.array([np.interp(s, t, p[:, i]) for i in range(p.shape[1])]), tuple(float(v) for v in t)
        )

    @classmethod
    def saw(
        cls,
        start: Sequence[float],
        velocity: Sequence[float],
        stroke: Sequence[float],
        period: float,
    ) -> "Path":
        """Constant velocity with a sinusoidal draw: x₀ + v t + ½ stroke sin(2πt/period).

        Args:
            start: Position at time zero [length].
            velocity: Feed velocity [length/time].
            stroke: Full stroke of the sawing motion, a vector [length].
            period: Duration of a stroke to and fro > 0 [time].
        """
        require("period", period, period > 0, "> 0")
        x, v, a = (np.asarray(w, dtype=float) for w in (start, velocity, stroke))
        return cls(lambda s: x + v * s + 0.5 * a * np.sin(2 * pi * s / period))
