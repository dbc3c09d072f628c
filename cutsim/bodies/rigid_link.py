"""Rigid parts of a test rig to which nodes of a body are tied: plates, pins, levers (docs/test_rigs.md)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, cast

import numpy as np
import ufl
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from cutsim.base.arrays import Array
from cutsim.base.assembly import summed
from cutsim.base.borders import BorderBlocks
from cutsim.base.checks import count, finite, require, require_number, require_numbers
from cutsim.base.kinematics import Expr
from cutsim.base.parameters import TimeFunction
from cutsim.base.rotations import rotation_derivatives
from cutsim.base.signatures import checked
from cutsim.base.terms import Columns, Term
from cutsim.bodies.machine import TURNS, Machine
from cutsim.bodies.rigid_motion import Coordinate, RigidMotion
from cutsim.bodies.schemes import Scheme
from cutsim.fields.points import Surface
from cutsim.fields.space import locate_dofs, locate_face_dofs
from cutsim.fields.state import State

# mean square displacement of attached nodes, over that of a translation, by a motion that moves none
_NOTHING = 1e-12
# distance from the reference point over the largest that is none
_ROUNDING = 1e-9


@checked
@dataclass(frozen=True, eq=False)
class Attachment:
    """Nodes of a body that a rigid link moves.

    Args:
        entities: Local mesh entities, or a surface such as a face of a crack.
        along: Axes along which they follow the link, such as "xy"; along others they are free, as on a roller. None for
            all.
        dim: Dimension of the entities; facets by default. Vertices of a single point make a hinge.
        name: Name of the columns with the force of the link on these nodes; None for no columns.

    Raises:
        ValueError: There is no such axis.
    """

    entities: NDArray[np.int32] | Surface
    along: str | None = None
    dim: int | None = None
    name: str | None = None

    def __post_init__(self) -> None:
        known = self.along is None or (len(self.along) > 0 and set(self.along) <= set("xyz"))
        require("along", self.along, known, "axes such as 'y' or 'xy', or None")
        require_number("dim", self.dim, count().or_none)

    def dofs(self, state: State) -> NDArray[np.int32]:
        """Owned dofs that follow the link. Collective.

        Raises:
            ValueError: The mesh has no such axis or entities, or no node is found on any rank.
        """
        gdim, tdim = state.mesh.geometry.dim, state.mesh.topology.dim
        known = self.dim is None or self.dim <= tdim
        require("dim", self.dim, known, f"0 … {tdim}, or None for facets")
        axes = "xyz"[:gdim] if self.along is None else self.along
        require("along", self.along, set(axes) <= set("xyz"[:gdim]), f"some of {', '.join('xyz'[:gdim])}")
        if isinstance(self.entities, Surface):
            nodes = locate_face_dofs(state.V, self.entities.entities)
        else:
            nodes = locate_dofs(state.V, tdim - 1 if self.dim is None else self.dim, self.entities)
        nodes = nodes[nodes < state.V.dofmap.index_map.size_local]
        found = state.mesh.comm.allreduce(len(nodes))
        require("entities", found, found > 0, "entities that carry dofs")
        components = np.array(["xyz".index(axis) for axis in sorted(set(axes))], dtype=np.int32)
        return np.asarray((gdim * nodes[:, None] + components).ravel())


class LinkBorder:
    """Coordinates of a rigid link as unknowns, `cutsim.base.borders.Border`; the attached nodes are tied to them.

    Args:
        state: Displacement and time.
        name: Name of the link, for messages.
        motion: The coordinates.
        parts: Owned dofs that follow, by attachments, and the name under which the force on them is recorded, or None.
        reference: The reference point.

    Attributes:
        motion: As above.
        held: Which coordinates are prescribed.
        tied: The dofs.
        touched: None.
    """

    def __init__(
        self,
        state: State,
        name: str,
        motion: RigidMotion,
        parts: Sequence[tuple[str | None, NDArray[np.int32]]],
        reference: Array,
    ) -> None:
        dofs = np.unique(np.concatenate([own for _, own in parts])).astype(np.int32)
        gdim = len(reference)
        self._comm: MPI.Comm = state.mesh.comm
        self._name, self._gdim, self.motion = name, gdim, motion
        self.tied, self.touched = dofs, np.empty(0, dtype=np.int32)
        self.held = motion.held
        self._components = dofs % gdim
        self._named = {part: np.isin(dofs, own) for part, own in parts if part is not None}
        none: Mapping[str, Array] = {part: np.zeros(gdim) for part in self._named}
        self._resultants = state.memory.value(f"{name}: forces", none)
        self._arms = state.V.tabulate_dof_coordinates()[dofs // gdim] - np.pad(reference, (0, 3 - gdim))
        self._places = {c.name: i for i, c in enumerate(motion.coordinates)}
        self._forces, self._reaction = np.zeros(len(dofs)), np.zeros(len(self.held))
        holds = [c.machine is None or c.machine.holds for c in motion.coordinates]
        self._loose = np.flatnonzero(~np.array(holds, dtype=bool))
        self._check_loose()

    def _check_loose(self) -> None:
        """Refuse coordinates that the attached nodes do not tell. Collective."""
        slopes = self._slopes()[self._loose]
        gram = summed(self._comm, slopes @ slopes.T)
        values, vectors = np.linalg.eigh(gram) if len(gram) else (np.empty(0), gram)
        for value, vector in zip(values, vectors.T, strict=True):
            if value <= _NOTHING * max(values[-1], 1.0):
                names = [self.motion.coordinates[self._loose[i]].name for i in np.flatnonzero(np.abs(vector) > 0.1)]
                raise ValueError(
                    f"link {self._name!r} can move along {' and '.join(map(repr, names))} while no attached node does: "
                    "prescribe its motion there, or attach more"
                )

    @property
    def values(self) -> Array:
        """The present unknowns [length]."""
        return self.motion.values * self.motion.units

    @property
    def target(self) -> Array:
        """Prescribed values, of those that are held [length]."""
        return (self.motion.paths * self.motion.units)[self.held]

    def assign(self, values: Array, u: Array) -> None:
        """Set the unknowns, and move the attached nodes of an owned displacement."""
        self.motion.assign(values / self.motion.units)
        shift, vector = self._split(self.motion.values)
        moved = self._arms @ (rotation_derivatives(vector)[0] - np.eye(3)).T + shift
        u[self.tied] = np.take_along_axis(moved, self._components[:, None], axis=1)[:, 0]

    def _split(self, values: Array) -> tuple[Array, Array]:
        """Translation and rotation vector, three components each."""
        parts = np.zeros(6)
        for name, place in self._places.items():
            parts[("x", "y", "z", *TURNS).index(name)] = values[place]
        return parts[:3], parts[3:]

    def _slopes(self) -> Array:
        """Derivative of the attached displacements by each unknown, shape (unknowns, dofs)."""
        first = rotation_derivatives(self._split(self.motion.values)[1])[1]
        slopes = np.zeros((len(self._places), len(self.tied)))
        for name, place in self._places.items():
            if name in TURNS:
                moved = self._arms @ first[TURNS.index(name)].T
                slopes[place] = np.take_along_axis(moved, self._components[:, None], axis=1)[:, 0]
            else:
                slopes[place] = self._components == "xyz".index(name)
        return slopes / self.motion.units[:, None]

    def _curvature(self) -> Array:
        """Second derivative of the attached displacements, times the forces on them. Collective."""
        second = rotation_derivatives(self._split(self.motion.values)[1])[2]
        spread = np.zeros((len(self.tied), 3))
        spread[np.arange(len(self.tied)), self._components] = self._forces
        torque = summed(self._comm, spread.T @ self._arms)
        found = np.zeros((len(self._places),) * 2)
        for one, i in self._places.items():
            for other, j in self._places.items():
                if one in TURNS and other in TURNS:
                    found[i, j] = np.sum(second[TURNS.index(one), TURNS.index(other)] * torque)
        return found / np.outer(self.motion.units, self.motion.units)

    def _reacting(self, forces: Array) -> Array:
        """Force of the body on the link along each unknown [force]. Collective."""
        return -summed(self._comm, self._slopes() @ forces[self.tied])

    def residual(self, forces: Array, jump: Array | None) -> Array:
        """Equations of motion [force]. Collective.

        Args:
            forces: Owned forces on the displacement, with what prescribed increments add to them.
            jump: These increments, of which nothing more is needed.
        """
        self._forces = forces[self.tied].copy()
        self._reaction = self._reacting(forces)
        return self.motion.equations(self._reaction * self.motion.units) / self.motion.units

    @property
    def loads(self) -> Array:
        """Forces of the machines, and of what is prescribed, at the last residual [force]."""
        return np.where(self.held, np.abs(self._reaction), self.motion.loads / self.motion.units)

    def blocks(self, stiffness: PETSc.Mat) -> BorderBlocks:
        """Derivatives at the present unknowns, at which the residual was asked for last. Collective."""
        x, y = stiffness.createVecs()
        slopes = self._slopes()
        columns, rows = (np.zeros((len(slopes), x.local_size)) for _ in range(2))
        for i, slope in enumerate(slopes):
            x.set(0.0)
            x.array[self.tied] = slope
            for multiply, found in ((stiffness.mult, columns), (stiffness.multTranspose, rows)):
                multiply(x, y)
                found[i] = y.array_r
        x.destroy()
        y.destroy()
        corner = summed(self._comm, slopes @ columns[:, self.tied].T) + self._curvature()
        return BorderBlocks(columns, rows, corner + np.diag(self.motion.stiffness() / self.motion.units**2))

    def restrained(self, motions: Array) -> Array:
        """What of motions the attached nodes cannot do while the link moves as it may. Collective."""
        held = np.zeros_like(motions)
        slopes, tied = self._slopes()[self._loose], motions[:, self.tied]
        gram, along = summed(self._comm, slopes @ slopes.T), summed(self._comm, slopes @ tied.T)
        held[:, self.tied] = tied - np.linalg.solve(gram, along).T @ slopes if len(slopes) else tied
        return held

    @property
    def resultants(self) -> Mapping[str, Array]:
        """Force of the link on the attachments that have a name, at the end of the step [force]."""
        return self._resultants.trial

    def free(self) -> str | None:
        """None: what the attached nodes do not tell is refused at the start."""
        return None

    def integrate(self, scheme: Scheme) -> None:
        """Use a time integration scheme for the inertia of the machines."""
        self.motion.scheme = scheme

    def predict(self) -> None:
        """Go on at the rate of the last step."""
        self.motion.predict()

    def settle(self, forces: Array) -> None:
        """Take note of the forces of the body at the end of a step. Collective."""
        on_part = {part: forces[self.tied] * among for part, among in self._named.items()}
        self._resultants.trial = {
            part: summed(self._comm, np.bincount(self._components, own, minlength=self._gdim))
            for part, own in on_part.items()
        }
        self.motion.settle(self._reacting(forces) * self.motion.units)


class RigidLink(Term):
    """Rigid part of a test rig, such as a plate, a pin or a lever, that moves the nodes attached to it.

    Its coordinates are the translations x, y, z of a reference point and the rotation vector rx, ry, rz about it, of
    any size; in the plane x, y and rz, in a body of revolution y alone. Each is prescribed, driven by a machine, which
    may be a load alone, or free; they are unknowns beside the displacement. So of a plate with free rotation only the
    translations are prescribed, and a lever joins several attachments.

    Args:
        state: Displacement and time.
        attachments: Nodes that follow it.
        reference: Reference point, at which forces of machines act, in or outside the body [length].
        motion: Value of each prescribed coordinate, by its name: a number or a function of time [length or rad]. Where
            a machine with a stiffness drives a coordinate too, the far end of its spring is prescribed.
        machines: What drives coordinates, at most one each, along axes such as "y" or "rz".
        name: Name in messages and output.
        corners: Times at which a prescribed velocity jumps; those of the machines' forces are known.

    Attributes:
        border: Its coordinates as unknowns.
        nodes: Owned nodes (blocked dofs) that are attached.

    Raises:
        ValueError: A coordinate does not exist, is prescribed and driven without a stiffness, or moves no attached
            node; an attachment is empty.
    """

    @checked
    def __init__(
        self,
        state: State,
        attachments: Sequence[Attachment],
        reference: tuple[float, ...],
        *,
        motion: Mapping[str, float | TimeFunction] | None = None,
        machines: Sequence[Machine] = (),
        name: str = "link",
        corners: tuple[float, ...] = (),
    ) -> None:
        gdim = state.mesh.geometry.dim
        require("attachments", len(attachments), len(attachments) > 0, "at least one attachment")
        require_numbers("reference", reference, finite, length=gdim)
        require_numbers("corners", corners, least=0)
        self.name, self.state, self._corners = name, state, corners
        parts = [(a.name, a.dofs(state)) for a in attachments]
        self.nodes = np.unique(np.concatenate([own for _, own in parts]) // gdim)
        place = np.array(reference, dtype=float)
        radius = _radius(state, self.nodes, place)
        coordinates = _coordinates(state, motion or {}, machines, radius)
        rigid = RigidMotion(state.memory, name, coordinates, state.dt)
        self.border = LinkBorder(state, name, rigid, parts, place)
        self.symmetric = not self.border.held.any()

    @property
    def corners(self) -> tuple[float, ...]:
        """Times at which a prescribed velocity or a force has a kink."""
        return tuple(sorted({*self._corners, *self.border.motion.corners}))

    @property
    def rate_dependent(self) -> bool:
        """Whether forces depend on the size of the step."""
        return self.border.motion.rate_dependent

    def residual(self, v: Expr) -> ufl.Form:
        """No form: the forces are those of the attached nodes."""
        return ufl.Form([])

    def begin(self) -> None:
        """Prescribe what acts at the end of the step."""
        self.border.motion.begin(self.state.time_old, self.state.time, np.zeros(len(self.border.held)))

    def external_work(self) -> float:
        """Work of machines, forces and what is prescribed, in the step [energy]."""
        return self.border.motion.work()

    def energies(self) -> dict[str, float]:
        """Energies of the machines."""
        return self.border.motion.energies()

    def record(self) -> Columns:
        """Coordinates, and force or moment of the link on the body along each."""
        columns, motion = self.border.motion.record(self.name), self.border.motion
        for coordinate, force in zip(motion.coordinates, motion.reaction, strict=True):
            kind = "moment" if coordinate.turns else "force"
            columns[f"{self.name}_{coordinate.name}_{kind}"] = float(-force), kind
        for part, total in self.border.resultants.items():
            columns |= {f"{self.name}_{part}_force_{'xyz'[i]}": (float(f), "force") for i, f in enumerate(total)}
        return columns


def _radius(state: State, nodes: NDArray[np.int32], reference: Array) -> float:
    """Largest distance of an attached node from the reference point, or of any node if it is there [length]."""
    x = state.V.tabulate_dof_coordinates()[: state.V.dofmap.index_map.size_local, : len(reference)]
    distances = np.linalg.norm(x - reference, axis=1)
    attached, any_node = (
        state.mesh.comm.allreduce(float(some.max(initial=0.0)), MPI.MAX) for some in (distances[nodes], distances)
    )
    return float(attached if attached > _ROUNDING * any_node else any_node)


def _coordinates(
    state: State, motion: Mapping[str, float | TimeFunction], machines: Sequence[Machine], radius: float
) -> list[Coordinate]:
    """Coordinates of a link: what is neither prescribed nor driven is free."""
    gdim = state.mesh.geometry.dim
    names = ("y",) if state.axisymmetric else {2: ("x", "y", "rz"), 3: ("x", "y", "z", *TURNS)}[gdim]
    for key in motion:
        require("motion", key, key in names, f"values of some of {', '.join(names)}")
    driven: dict[str, Machine] = {}
    for i, machine in enumerate(machines):
        axis = machine.axis
        require(f"machines[{i}].axis", axis, axis in names, f"one of {', '.join(names)}")
        require(f"machines[{i}].axis", axis, axis not in driven, "another one for each machine")
        driven[cast(str, axis)] = machine
    found = []
    for name in names:
        drive, value = driven.get(name), motion.get(name)
        unit = radius if name in TURNS else 1.0
        if drive is not None and value is not None:
            words = f"> 0, since the motion along {name!r} is prescribed"
            require("stiffness", drive.stiffness, drive.stiffness > 0, words)
        free = None if value is not None else Machine(name)
        found.append(Coordinate(name, drive or free, partial(_at, name, value), unit))
    return found


def _at(name: str, value: Any, time: float) -> float:
    """A prescribed value at a time, zero if nothing is prescribed."""
    found = value(time) if callable(value) else value or 0.0
    require_number(f"motion[{name!r}]({time:.6g})", found, finite)
    return float(found)
