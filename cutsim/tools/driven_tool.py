"""What a tool on a driven rigid motion adds to the equations of that motion (docs/test_rigs.md)."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
import ufl
from dolfinx import default_scalar_type, fem
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.base.arrays import Array
from cutsim.base.assembly import box, integrate, nodal_forces
from cutsim.base.checks import require
from cutsim.base.compat import EntityMaps, form
from cutsim.base.kinematics import Expr
from cutsim.base.rotations import rotation_derivatives, rotation_vector
from cutsim.bodies.machine import Machine
from cutsim.bodies.rigid_motion import Coordinate, RigidMotion
from cutsim.fields.points import Surface
from cutsim.fields.space import locate_face_dofs
from cutsim.fields.state import State

# cosine between axes that counts as none
_RIGHT = 1e-9

#: Position and rotation matrix of a tool, or changes of them.
Pose = tuple[Array, Array]


class MachineAxes:
    """Path of a driven rigid motion, and the axes along which machines let it deviate from that.

    Args:
        state: Displacement and time.
        name: Name of the motion.
        path: Position and rotation of the path at a time, the latter a matrix; rotations are about this position.
        machines: What drives each axis.
        release: Time until which the path is followed, 0 for never [time].

    Attributes:
        motion: The coordinates: way along each axis since the start, of which the path prescribes that of the machine.
        turns: Whether one of them is a rotation.
        shifts: Change of position by each of them, one a row.

    Raises:
        ValueError: There is no machine, axes of translations or of rotations are not at right angles, or an axis makes
            no sense here.
    """

    def __init__(
        self,
        state: State,
        name: str,
        path: Callable[[float], Pose],
        machines: Sequence[Machine],
        release: float = 0.0,
    ) -> None:
        require("machines", len(machines), len(machines) > 0, "at least one machine")
        gdim, self._state, self._path = state.mesh.geometry.dim, state, path
        axes = [m.direction(gdim) for m in machines]
        self.turns = any(m.turns for m in machines)
        _check_axes(machines, axes, axisymmetric=state.axisymmetric)
        self.shifts = np.array([np.zeros(gdim) if m.turns else a for m, a in zip(machines, axes, strict=True)])
        self._spins = np.array([a if m.turns else np.zeros(3) for m, a in zip(machines, axes, strict=True)])
        low, high = box(state.mesh.comm, state.mesh.geometry.x)
        radius = 0.5 * float(np.linalg.norm(high - low))
        coordinates = [
            Coordinate(_name(i, m), m, partial(_way, path, m, axis), radius if m.turns else 1.0)
            for i, (m, axis) in enumerate(zip(machines, axes, strict=True))
        ]
        self.motion = RigidMotion(state.memory, name, coordinates, state.dt, release)

    def pose(self, path: Pose, fraction: float, time: float) -> Pose:
        """Where a tool on this motion is after a fraction of the step, which is a time.

        Args:
            path: Pose of the tool's own path at that time.
            fraction: The fraction.
            time: The time.
        """
        ahead, (centre, _) = self.motion.ahead(fraction, time), self._path(time)
        gdim = len(centre)
        turn = rotation_derivatives(ahead @ self._spins)[0][:gdim, :gdim]
        return centre + turn @ (path[0] - centre) + ahead @ self.shifts, turn @ path[1]

    def slopes(self, pose: Pose) -> tuple[list[Pose], list[list[Pose]]]:
        """First and second derivatives of the pose of a tool by the unknowns, at the end of the step.

        Args:
            pose: The present pose of the tool.
        """
        gdim, motion = len(pose[0]), self.motion
        ahead = motion.values - motion.paths
        turn, first, second = rotation_derivatives(ahead @ self._spins)
        back = turn[:gdim, :gdim].T
        arm = back @ (pose[0] - self._path(self._state.time)[0] - ahead @ self.shifts)
        rest = back @ pose[1]
        shifts, spins = (axes / motion.units[:, None] for axes in (self.shifts, self._spins))
        turns = np.einsum("mk,kij->mij", spins, first)[:, :gdim, :gdim]
        curvature = np.einsum("mk,nl,klij->mnij", spins, spins, second)[..., :gdim, :gdim]
        slopes = list(zip(shifts + turns @ arm, turns @ rest, strict=True))
        return slopes, [list(zip(row @ arm, row @ rest, strict=True)) for row in curvature]


def _name(place: int, machine: Machine) -> str:
    """Name of a coordinate: its axis, or its number where the axis is a vector."""
    return machine.axis.lstrip("-") if isinstance(machine.axis, str) else str(place + 1)


def _way(path: Callable[[float], Pose], machine: Machine, axis: Array, time: float) -> float:
    """Way of a path along or about an axis since the start."""
    (start, before), (end, after) = path(0.0), path(time)
    if not machine.turns:
        return float((end - start) @ axis)
    turn = rotation_vector(after @ before.T)
    return float(turn @ axis[-len(turn) :])


def _check_axes(machines: Sequence[Machine], axes: Sequence[Array], *, axisymmetric: bool) -> None:
    for i, (machine, axis) in enumerate(zip(machines, axes, strict=True)):
        allowed = not axisymmetric or (not machine.turns and abs(axis[0]) < _RIGHT)
        require(f"machines[{i}].axis", machine.axis, allowed, "along y in a body of revolution")
        others = [other for also, other in zip(machines[:i], axes[:i], strict=True) if also.turns == machine.turns]
        right = all(abs(axis @ other) < _RIGHT for other in others)
        require(f"machines[{i}].axis", machine.axis, right, "at right angles to those before")


class DrivenPart(ABC):
    """Base of a contact that acts on a driven rigid motion, and moves with it.

    Args:
        comm: Communicator of the mesh.
        axes: Coordinates of the motion.
        move: Moves the tool to the end of the step.
        touched: Owned dofs of the surfaces that it can touch.

    Attributes:
        axes: As above.
        move: As above.
        touched: As above.
    """

    def __init__(self, comm: MPI.Comm, axes: MachineAxes, move: Callable[[], None], touched: NDArray[np.int32]) -> None:
        self._comm, self.axes, self.move, self.touched = comm, axes, move, touched

    @abstractmethod
    def reaction(self) -> Array:
        """Force of the body on the tool along each unknown at the present pose [force]. Collective."""

    @abstractmethod
    def rows(self) -> Array:
        """Derivative of it by the owned displacements, one row for each unknown. Collective."""

    @abstractmethod
    def columns(self) -> Array:
        """Derivative of the owned contact forces on the displacement by each unknown, one a row. Collective."""

    @abstractmethod
    def corner(self) -> Array:
        """Derivative of the reaction by the unknowns. Collective."""


class _VirtualMotion:
    """Virtual motion of a tool, δp of its reference point and δR of its rotation, as form constants."""

    def __init__(self, state: State, *, turns: bool) -> None:
        gdim = state.mesh.geometry.dim
        self._p = fem.Constant(state.mesh, np.zeros(gdim, dtype=default_scalar_type))
        self._R = fem.Constant(state.mesh, np.zeros((gdim, gdim), dtype=default_scalar_type)) if turns else None

    def set(self, pose: Pose) -> None:
        """Choose the motion."""
        self._p.value[:] = pose[0]
        if self._R is not None:
            self._R.value[:] = pose[1]

    def displacement(self, place: Expr) -> Expr:
        """Displacement of the point of the tool at a place in its frame."""
        return self._p if self._R is None else self._p + self._R * place

    def change(self, f: Expr, pose: tuple[Expr, Expr]) -> Expr:
        """Change of a scalar that depends on the pose."""
        moved = ufl.dot(ufl.diff(f, pose[0]), self._p)
        return moved if self._R is None else moved + ufl.inner(ufl.diff(f, pose[1]), self._R)


class DrivenContact(DrivenPart):
    """Contact of a driven tool that is written as forms, which UFL differentiates by its pose.

    Args:
        state: Displacement and time.
        axes: Coordinates of the motion.
        move: Moves the tool to the end of the step.
        pose: Position and rotation as variables of the forms.
        constants: Position and rotation themselves.
        touches: For each surface the traction on the tool, and the place of its points in the frame of the tool.
        entity_maps: Entity maps of the forms.
    """

    def __init__(
        self,
        state: State,
        axes: MachineAxes,
        move: Callable[[], None],
        *,
        pose: tuple[Expr, Expr],
        constants: tuple[fem.Constant, fem.Constant],
        touches: Sequence[tuple[Surface, Expr, Expr]],
        entity_maps: EntityMaps,
    ) -> None:
        nodes = np.unique(np.concatenate([locate_face_dofs(state.V, surface.entities) for surface, _, _ in touches]))
        super().__init__(state.mesh.comm, axes, move, owned_dofs(state, nodes))
        self._constants = constants
        self._first, self._second = (_VirtualMotion(state, turns=axes.turns) for _ in range(2))
        v = ufl.TestFunction(state.V)

        def over_all(density: Callable[[Expr, Expr], Expr]) -> ufl.Form:
            return sum((density(*touch) * surface.measure for surface, *touch in touches), start=ufl.Form([]))

        work = over_all(lambda traction, place: ufl.dot(traction, self._first.displacement(place)))
        column = over_all(lambda traction, place: self._first.change(ufl.dot(traction, v), pose))
        corner = over_all(
            lambda traction, place: self._second.change(ufl.dot(traction, self._first.displacement(place)), pose)
        )
        self._work, self._column, self._row, self._corner = (
            form(f, entity_maps=entity_maps) for f in (work, column, ufl.derivative(work, state.u, v), corner)
        )

    def _slopes(self) -> tuple[list[Pose], list[list[Pose]]]:
        position, rotation = (np.asarray(c.value) for c in self._constants)
        return self.axes.slopes((position, rotation))

    def _each(self, evaluate: Callable[[], Array | float]) -> Array:
        """A quantity for each unknown in turn."""
        found = []
        for pose in self._slopes()[0]:
            self._first.set(pose)
            found.append(evaluate())
        return np.array(found)

    def reaction(self) -> Array:
        """Force of the body on the tool along each unknown at the present pose [force]. Collective."""
        return self._each(lambda: integrate(self._work))

    def rows(self) -> Array:
        """Derivative of it by the owned displacements, one row for each unknown. Collective."""
        return self._each(lambda: nodal_forces(self._row))

    def columns(self) -> Array:
        """Derivative of the owned contact forces on the displacement by each unknown, one a row. Collective."""
        return self._each(lambda: nodal_forces(self._column))

    def corner(self) -> Array:
        """Derivative of the reaction by the unknowns. Collective."""
        poses, curvature = self._slopes()
        found = np.zeros((len(poses), len(poses)))
        for i, pose in enumerate(poses):
            self._first.set(pose)
            for j, other in enumerate(poses):
                self._second.set(other)
                found[i, j] = integrate(self._corner)
        for i, j in np.ndindex(found.shape if self.axes.turns else (0, 0)):
            self._first.set(curvature[i][j])
            found[i, j] += integrate(self._work)
        return found


def owned_dofs(state: State, nodes: NDArray[np.int32]) -> NDArray[np.int32]:
    """Owned dofs of some local nodes (blocked dofs)."""
    gdim, owned = state.mesh.geometry.dim, state.V.dofmap.index_map.size_local
    return np.asarray((gdim * nodes[nodes < owned, None] + np.arange(gdim)).ravel(), dtype=np.int32)
