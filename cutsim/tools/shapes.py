"""Shapes of rigid tools as smooth signed distances, and prescribed paths (docs/theory.md §4).

A shape is a frozen dataclass with one method, `distance(x)`, for a position relative to the tool's reference point:
negative inside, |∇d| = 1.  Rounded shapes are the set of points within the tip radius of a sharp core, so that a
single formula gives tip, flank and shank without a kink.
"""

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, field
from math import pi
from typing import ClassVar, Protocol, TypeVar, runtime_checkable

import numpy as np
import ufl
from dolfinx import default_scalar_type, fem
from dolfinx.mesh import Mesh
from numpy.typing import NDArray

from cutsim.base.checks import (
    above,
    as_array,
    between,
    nonnegative,
    positive,
    require,
    require_number,
    require_numbers,
)
from cutsim.base.kinematics import Expr
from cutsim.base.rotations import rotation_matrix
from cutsim.base.signatures import checked
from cutsim.base.units import Length

Direction = tuple[float, ...]


@runtime_checkable
class Shape(Protocol):
    """Protocol of a tool's shape; see docs/adding_a_tool.md."""

    @property
    def resolution(self) -> float:
        """Smallest radius of the surface [length]; the mesh under the tool has to resolve it."""

    def distance(self, x: Expr) -> Expr:
        """Signed distance at a position relative to the reference point [length], negative inside."""


AnyShape = TypeVar("AnyShape", bound=Shape)


def unit_vector(name: str, vector: Direction) -> Direction:
    """Unit vector along one that the user gave under a name."""
    require_numbers(name, vector)
    norm = float(np.linalg.norm(vector))
    require(name, vector, len(vector) in (2, 3) and norm > 0, "a non-zero vector of 2 or 3 numbers")
    return tuple(float(v) / norm for v in vector)


def directions(shape: object) -> dict[str, Direction]:
    """The parameters of a shape that have as many components as the mesh has dimensions, by name."""
    return {name: value for name, value in vars(shape).items() if isinstance(value, tuple)}


def check_directions(shape: Shape, gdim: int) -> None:
    """Refuse a shape with directions of another dimension than the mesh.

    Raises:
        ValueError: A direction has not as many components as the mesh.
    """
    for name, value in directions(shape).items():
        require(f"shape.{name}", value, len(value) == gdim, f"of {gdim} components, as the mesh has")


def with_form_constants(mesh: Mesh, shape: AnyShape) -> AnyShape:
    """A shape whose numbers and directions are form constants, so that another one needs no other kernel.

    The copy is for writing forms only. None and zero are kept, since they change the formula.  A shape whose numbers
    enter `distance` by algebra and UFL's functions alone says so by a class attribute `parametric`; others are left as
    they are.

    Args:
        mesh: Mesh of the forms.
        shape: The shape.
    """
    if not getattr(type(shape), "parametric", False):
        return shape
    changed = copy(shape)
    for name, value in vars(shape).items():
        if isinstance(value, int | float | tuple) and value != 0:
            object.__setattr__(changed, name, fem.Constant(mesh, np.array(value, dtype=default_scalar_type)))
    return changed


def along(x: Expr, direction: Direction) -> Expr:
    """Component along a unit vector."""
    return ufl.dot(x, ufl.as_vector(direction))


def hypot(a: Expr, b: Expr, scale: float) -> Expr:
    """Length √(a² + b²), differentiable where it vanishes."""
    # the floor keeps the gradient finite at the core's corner, a tip radius away from any contact
    return ufl.sqrt(a**2 + b**2 + (1e-8 * scale) ** 2)


def from_axis(x: Expr, push: Direction, scale: float) -> Expr:
    """Distance from the axis along push, differentiable on it."""
    radial = x - along(x, push) * ufl.as_vector(push)
    return ufl.sqrt(ufl.dot(radial, radial) + (1e-8 * scale) ** 2)


def flat_ended(across: Expr, below: Expr, scale: float) -> Expr:
    """Distance to a body with a flat end, from the distances across its side and below its end."""
    corner = hypot(across, below, scale)
    side = ufl.conditional(ufl.lt(below, 0), across, corner)
    face = ufl.conditional(ufl.lt(across, 0), below, corner)
    return ufl.conditional(ufl.gt(across, below), side, face)


@checked
@dataclass(frozen=True)
class Ball:
    """Sphere in 3-D; cylinder (or wire) in 2-D and, with an axis, in 3-D. The reference point is the centre.

    Args:
        radius: Radius > 0 [length].
        axis: Axis of a cylinder in 3-D, None for a sphere or in 2-D.

    Raises:
        ValueError: A value is outside its range.
    """

    parametric: ClassVar[bool] = True

    radius: Length
    axis: Direction | None = None

    def __post_init__(self) -> None:
        require_number("radius", self.radius, positive)
        if self.axis is not None:
            object.__setattr__(self, "axis", unit_vector("axis", self.axis))

    @property
    def resolution(self) -> float:
        """Radius [length]."""
        return self.radius

    def distance(self, x: Expr) -> Expr:
        """Distance from the centre (or axis) minus the radius [length]."""
        radial = x if self.axis is None else x - along(x, self.axis) * ufl.as_vector(self.axis)
        return ufl.sqrt(ufl.dot(radial, radial) + (1e-8 * self.radius) ** 2) - self.radius


@checked
@dataclass(frozen=True)
class FlatPunch:
    """Flat-ended punch with a rounded edge, circular in 3-D and a strip in 2-D. The reference point is on the face.

    Args:
        radius: Radius (half width in 2-D) > edge_radius [length].
        edge_radius: Radius of the rounded edge > 0 [length].
        push: Direction in which the punch indents.

    Raises:
        ValueError: A value is outside its range.
    """

    parametric: ClassVar[bool] = True

    radius: Length
    edge_radius: Length
    push: Direction = (0.0, -1.0)

    def __post_init__(self) -> None:
        require_number("edge_radius", self.edge_radius, positive)
        require_number("radius", self.radius, above(self.edge_radius, "edge_radius"))
        object.__setattr__(self, "push", unit_vector("push", self.push))

    @property
    def resolution(self) -> float:
        """Edge radius [length]."""
        return self.edge_radius

    def distance(self, x: Expr) -> Expr:
        """Distance to the core, a flat disc with a straight shank, minus the edge radius [length]."""
        r = self.edge_radius
        return flat_ended(from_axis(x, self.push, r) - (self.radius - r), along(x, self.push) + r, r) - r


@checked
@dataclass(frozen=True)
class Plane:
    """Half-space behind a plane through the reference point.

    Args:
        normal: Outward normal of the tool, pointing to the body.

    Raises:
        ValueError: The normal is zero.
    """

    parametric: ClassVar[bool] = True

    normal: Direction

    def __post_init__(self) -> None:
        object.__setattr__(self, "normal", unit_vector("normal", self.normal))

    @property
    def resolution(self) -> float:
        """A plane needs no resolution: infinite."""
        return float("inf")

    def distance(self, x: Expr) -> Expr:
        """Distance along the normal [length]."""
        return along(x, self.normal)


@checked
@dataclass(frozen=True)
class ToolPath:
    """Prescribed motion of a tool: the position of its reference point, and the rotation about it.

    Args:
        position: Position at a time, array of the geometric dimension [length].
        corners: Times at which a velocity jumps; the stepping meets them exactly.
        rotation: Rotation at a time from the frame in which the tool's shape is given: an angle in the plane,
            counterclockwise; a rotation vector in space, the axis times the angle [rad]. None for a tool that never
            turns.
    """

    position: Callable[[float], NDArray[np.float64]]
    corners: tuple[float, ...] = field(default=())
    rotation: Callable[[float], float | NDArray[np.float64]] | None = None

    def __post_init__(self) -> None:
        require_numbers("corners", self.corners, least=0)

    def pose(self, time: float, gdim: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Position of the reference point and rotation matrix at a time.

        Args:
            time: The time.
            gdim: Dimension of space.

        Raises:
            ValueError: They have another dimension.
        """
        position = as_array(f"path({time:.6g})", self.position(time))
        require(f"path({time:.6g})", position, position.shape == (gdim,), f"a position of {gdim} components")
        if self.rotation is None:
            return position, np.eye(gdim)
        name = f"path.rotation({time:.6g})"
        turn = np.atleast_1d(as_array(name, self.rotation(time)))
        words = "a rotation vector of 3 components" if gdim == 3 else "an angle"
        require(name, turn, turn.shape == (3 if gdim == 3 else 1,), words)
        return position, rotation_matrix(turn)

    @classmethod
    @checked
    def polyline(
        cls,
        times: Sequence[float],
        points: Sequence[Sequence[float]],
        turns: Sequence[float | Sequence[float]] | None = None,
    ) -> "ToolPath":
        """Straight motion between points, at rest before the first and after the last time.

        Args:
            times: Increasing times [time].
            points: A position for each [length].
            turns: A rotation for each, an angle in the plane and a rotation vector in space, between which the angle or
                the vector changes evenly [rad]; None for a tool that never turns.

        Raises:
            ValueError: Times do not increase or their number differs from that of the points or turns.
        """
        require_numbers("times", times)
        t = np.asarray(times, dtype=float)
        require("times", list(times), bool(np.all(np.diff(t) > 0)), "increasing")
        p = as_array("points", points)
        rows = f"one row for each of the {len(t)} times"
        require("points", p.shape, p.ndim == 2 and len(p) == len(t), rows)
        rotation = None
        if turns is not None:
            r = as_array("turns", turns).reshape(len(turns), -1)
            require("turns", r.shape, r.shape in ((len(t), 1), (len(t), 3)), f"{rows}: an angle or a rotation vector")
            rotation = _interpolated(t, r)
        return cls(_interpolated(t, p), tuple(float(v) for v in t), rotation)

    @classmethod
    @checked
    def saw(
        cls,
        start: Sequence[float],
        velocity: Sequence[float],
        stroke: Sequence[float],
        period: float,
    ) -> "ToolPath":
        """Constant velocity with a sinusoidal draw: x₀ + v t + ½ stroke sin(2πt/period).

        Args:
            start: Position at time zero [length].
            velocity: Feed velocity [length/time].
            stroke: Full stroke of the sawing motion, a vector [length].
            period: Duration of a stroke to and fro > 0 [time].

        Raises:
            ValueError: A number is outside its range, or vectors have different lengths.
        """
        require_number("period", period, positive)
        x, v, a = _vectors(start=start, velocity=velocity, stroke=stroke)
        return cls(lambda s: x + v * s + 0.5 * a * np.sin(2 * pi * s / period))

    @classmethod
    @checked
    def slice_push(
        cls, start: Sequence[float], velocity: Sequence[float], draw: Sequence[float], ratio: float
    ) -> "ToolPath":
        """Push with a slice along the edge at the same time: x₀ + t (v + ξ |v| draw/|draw|).

        Args:
            start: Position at time zero [length].
            velocity: Velocity v of the push, not along the edge [length/time].
            draw: Direction of the slice, that of the edge.
            ratio: Slice–push ratio ξ ≥ 0, the speed along the edge over that of the push: the tangent of the angle
                between push and motion (Atkins, Xu, Jeronimidis 2004) [–].

        Raises:
            ValueError: A number is outside its range, a direction is zero, both are the same, or vectors have different
                lengths.
        """
        require_number("ratio", ratio, nonnegative)
        x, v, e = _vectors(start=start, velocity=velocity, draw=draw)
        e = np.asarray(unit_vector("draw", tuple(e.tolist())))
        across = float(np.linalg.norm(v - (v @ e) * e))
        require("velocity", v.tolist(), bool(across > 1e-9 * np.linalg.norm(v)), "not zero and not along draw")
        rate = v + ratio * np.linalg.norm(v) * e
        return cls(lambda s: x + rate * s)

    @classmethod
    @checked
    def rock(
        cls,
        start: Sequence[float],
        velocity: Sequence[float],
        angle: float,
        period: float,
        pivot: Sequence[float] | None = None,
        axis: Sequence[float] | None = None,
    ) -> "ToolPath":
        """Constant velocity of a pivot, about which the tool rocks by the angle φ sin(2πt/period).

        Args:
            start: Position of the reference point at time zero [length].
            velocity: Feed velocity of the pivot [length/time].
            angle: Largest angle φ to either side, in [0, π) [rad].
            period: Duration of a swing to and fro > 0 [time].
            pivot: Pivot relative to the reference point at time zero; by default this point itself [length].
            axis: Axis of the rotation in space; None in the plane.

        Raises:
            ValueError: A number is outside its range, vectors have different lengths, or the axis is missing.
        """
        require_number("angle", angle, between(0, pi, "[)", name="π rad"))
        require_number("period", period, positive)
        given = {} if pivot is None else {"pivot": pivot}
        x, v, *arms = _vectors(start=start, velocity=velocity, **given)
        arm = arms[0] if arms else np.zeros_like(x)
        require("axis", axis, (axis is not None) == (len(x) == 3), "given in space, and None in the plane")
        unit = np.ones(1) if axis is None else np.asarray(unit_vector("axis", tuple(axis)))
        require("axis", axis, axis is None or len(unit) == 3, "a vector of 3 numbers")

        def turn(s: float) -> NDArray[np.float64]:
            return np.asarray(angle * np.sin(2 * pi * s / period) * unit)

        return cls(lambda s: x + v * s + arm - rotation_matrix(turn(s)) @ arm, (), turn)


def _vectors(**vectors: Sequence[float]) -> tuple[NDArray[np.float64], ...]:
    """Vectors by the names of their parameters, all as long as the first."""
    length = None
    for name, vector in vectors.items():
        require_numbers(name, vector, length=length)
        length = len(vector)
    return tuple(np.asarray(vector, dtype=float) for vector in vectors.values())


def _interpolated(t: NDArray[np.float64], rows: NDArray[np.float64]) -> Callable[[float], NDArray[np.float64]]:
    return lambda s: np.array([np.interp(s, t, column) for column in rows.T])
