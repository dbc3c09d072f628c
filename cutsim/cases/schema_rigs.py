"""Schema of case files: what belongs to a test rig beside the body: machines, and rigid parts that move it."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Discriminator, Tag, model_validator

from cutsim.base.units import (
    AngularVelocity,
    Damping,
    Force,
    ForcePerLength,
    Length,
    Mass,
    Moment,
    MomentOfInertia,
    Number,
    RotationalDamping,
    Time,
    Velocity,
)
from cutsim.bodies.machine import TURNS
from cutsim.cases.expressions import TimeValue
from cutsim.cases.names import Groups, Surfaces
from cutsim.cases.tables import FORM, NONNEGATIVE, Table, Varying


class Place(Table):
    """Part of a body, by the groups of its mesh.

    Args:
        facets: Groups of facets, or one face of a crack, such as "glue+".
        cells: Groups of cells.
        vertices: Groups of vertices.
        points: Points of which the nearest vertices are taken [length].
    """

    facets: Surfaces = ()
    cells: Groups = ()
    vertices: Groups = ()
    points: tuple[tuple[Length, ...], ...] = ()

    @model_validator(mode="after")
    def _one_place(self) -> "Place":
        if sum(map(bool, (self.facets, self.cells, self.vertices, self.points))) != 1:
            raise ValueError("must have one of facets, cells, vertices and points")
        return self


class Machine(Table):
    """Machine that drives a translation: a finite stiffness, a force, a mass.

    Args:
        axis: Direction: "x", "-y" and so on, or a vector, whose length does not matter.
        stiffness: Stiffness of machine and load cell, in series with the body [force/length].
        damping: Dashpot to the ground [force·time/length].
        mass: Mass that moves along.
        force: Force along the axis [force].
        weight: Dead weight along the axis, which acts all the time [force].
        velocity: Velocity at the start, of a machine with mass [length/time].
        corners: Times at which the force has a kink or a jump; those of a table are known [time].
    """

    axis: Annotated[
        Annotated[Literal["x", "y", "z", "-x", "-y", "-z"], Tag("<single>")]
        | Annotated[tuple[Number, ...], Tag("<list>")],
        FORM,
    ]
    stiffness: Annotated[ForcePerLength, NONNEGATIVE] = 0.0
    damping: Annotated[Damping, NONNEGATIVE] = 0.0
    mass: Annotated[Mass, NONNEGATIVE] = 0.0
    force: Annotated[TimeValue, Varying("force")] = 0.0
    weight: Force = 0.0
    velocity: Velocity = 0.0
    corners: tuple[Time, ...] = ()


class TurningMachine(Table):
    """Machine that drives a rotation about the reference point: a finite stiffness, a moment, an inertia.

    Args:
        axis: Axis of space; "rz" in the plane.
        stiffness: Stiffness [moment/rad].
        damping: Dashpot to the ground [moment·time/rad].
        mass: Moment of inertia.
        force: Moment about the axis [moment].
        weight: Dead moment about the axis, which acts all the time [moment].
        velocity: Angular velocity at the start, of a machine with inertia [1/time].
        corners: Times at which the moment has a kink or a jump; those of a table are known [time].
    """

    axis: Literal["rx", "ry", "rz"]
    stiffness: Annotated[Moment, NONNEGATIVE] = 0.0
    damping: Annotated[RotationalDamping, NONNEGATIVE] = 0.0
    mass: Annotated[MomentOfInertia, NONNEGATIVE] = 0.0
    force: Annotated[TimeValue, Varying("moment")] = 0.0
    weight: Moment = 0.0
    velocity: AngularVelocity = 0.0
    corners: tuple[Time, ...] = ()


def _kind(value: Any) -> str:
    return "<rotation>" if isinstance(value, dict) and value.get("axis") in TURNS else "<translation>"


AnyMachine = Annotated[
    Annotated[Machine, Tag("<translation>")] | Annotated[TurningMachine, Tag("<rotation>")], Discriminator(_kind)
]
#: One machine or several.
Machines = Annotated[
    tuple[AnyMachine, ...],
    BeforeValidator(lambda value: [value] if isinstance(value, Mapping) else value),
]


class Attachment(Place):
    """Nodes of a body that a rigid link moves.

    Args:
        along: Axes along which they follow it, such as "y" of a roller; by default all.
    """

    along: Literal["x", "y", "z", "xy", "xz", "yz"] | None = None


class Link(Table):
    """Rigid part of a test rig, such as a plate that may turn, a pin or a lever.

    What is neither prescribed nor driven by a machine is free. A machine with a stiffness moves its coordinate by a
    spring, whose far end is then prescribed.

    Args:
        attachments: Nodes that follow it, by name.
        reference: Reference point, at which forces of machines act [length].
        x: Displacement of the reference point along x [length].
        y: Displacement of the reference point along y [length].
        z: Displacement of the reference point along z [length].
        rx: Component of the rotation vector along x [rad].
        ry: Component of the rotation vector along y [rad].
        rz: Component of the rotation vector along z, in the plane the angle, counterclockwise [rad].
        machines: What drives a coordinate, along "x", "y", "z", "rx", "ry" or "rz".
        corners: Times at which a prescribed velocity jumps; those of tables are known [time].
    """

    attachments: dict[str, Attachment]
    reference: tuple[Length, ...]
    x: Annotated[TimeValue, Varying("length")] | None = None
    y: Annotated[TimeValue, Varying("length")] | None = None
    z: Annotated[TimeValue, Varying("length")] | None = None
    rx: Annotated[TimeValue, Varying("angle")] | None = None
    ry: Annotated[TimeValue, Varying("angle")] | None = None
    rz: Annotated[TimeValue, Varying("angle")] | None = None
    machines: Machines = ()
    corners: tuple[Time, ...] = ()

    @property
    def motion(self) -> dict[str, TimeValue]:
        """Coordinates that are prescribed."""
        values = {name: getattr(self, name) for name in ("x", "y", "z", *TURNS)}
        return {name: value for name, value in values.items() if value is not None}
