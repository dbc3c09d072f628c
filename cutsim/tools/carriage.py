"""Rigid motion of tools as unknowns, found together with the displacement of the body (docs/test_rigs.md)."""

from collections.abc import Sequence
from functools import partial

import numpy as np
import ufl
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from cutsim.base.arrays import Array
from cutsim.base.assembly import summed
from cutsim.base.borders import BorderBlocks
from cutsim.base.checks import nonnegative, require, require_number
from cutsim.base.kinematics import Expr
from cutsim.base.signatures import checked
from cutsim.base.terms import Columns, Term
from cutsim.bodies.machine import Machine
from cutsim.bodies.schemes import Scheme
from cutsim.fields.state import State
from cutsim.tools.driven_tool import DrivenPart, MachineAxes
from cutsim.tools.shapes import ToolPath

# eigenvalue of the contact's stiffness, over the sum of all, that is none
_NOTHING = 1e-12


class CarriageBorder:
    """Unknowns of a driven rigid motion and their equations, as `cutsim.base.borders.Border`.

    Args:
        comm: Communicator of the mesh.
        name: Name of the motion.
        axes: Its coordinates.

    Attributes:
        motion: The coordinates over the steps.
        held: None of them.
        tied: No displacement.
        touched: Owned dofs of the surfaces that its tools can touch.
    """

    def __init__(self, comm: MPI.Comm, name: str, axes: MachineAxes) -> None:
        self._comm, self._name, self.motion = comm, name, axes.motion
        self._parts: list[DrivenPart] = []
        self.held = self.motion.held
        self.tied, self.touched = (np.empty(0, dtype=np.int32) for _ in range(2))
        self._reaction = np.zeros(len(self.held))

    def add(self, part: DrivenPart) -> None:
        """Let a contact act on the motion."""
        self._parts.append(part)
        self.touched = np.unique(np.concatenate([self.touched, part.touched]))

    def move(self) -> None:
        """Move all tools to the end of the step."""
        for part in self._parts:
            part.move()

    def reaction(self) -> Array:
        """Force of the body on all tools along each unknown at the present pose [force]. Collective."""
        return np.sum([np.zeros_like(self._reaction), *(part.reaction() for part in self._parts)], axis=0)

    def _rows(self) -> Array:
        return np.sum([part.rows() for part in self._parts], axis=0)

    def _corner(self) -> Array:
        return np.sum([part.corner() for part in self._parts], axis=0)

    @property
    def values(self) -> Array:
        """The present unknowns [length]."""
        return self.motion.values * self.motion.units

    @property
    def target(self) -> Array:
        """Prescribed values: none."""
        return np.empty(0)

    def assign(self, values: Array, u: Array) -> None:
        """Set the unknowns, and move the tools."""
        self.motion.assign(values / self.motion.units)
        self.move()

    def residual(self, forces: Array, jump: Array | None) -> Array:
        """Equations of motion; arguments as `Border.residual`. Collective."""
        motion, self._reaction = self.motion, self.reaction()
        if motion.clamped:
            return (motion.values - motion.paths) * motion.units
        advance = self._reaction if jump is None else self._reaction + summed(self._comm, self._rows() @ jump)
        return motion.equations(advance * motion.units) / motion.units

    @property
    def loads(self) -> Array:
        """Forces of the machines and of the body at the last residual [force]."""
        return np.maximum(self.motion.loads / self.motion.units, np.abs(self._reaction))

    def blocks(self, stiffness: PETSc.Mat) -> BorderBlocks:
        """Derivatives at the present unknowns. Collective."""
        columns, rows = np.sum([part.columns() for part in self._parts], axis=0), self._rows()
        if self.motion.clamped:
            return BorderBlocks(columns, np.zeros_like(rows), np.eye(len(rows)))
        own = np.diag(self.motion.stiffness() / self.motion.units**2)
        return BorderBlocks(columns, -rows, own - self._corner())

    def restrained(self, motions: Array) -> Array:
        """Nothing: what the contact resists is in the tangent."""
        return np.zeros_like(motions)

    def free(self) -> str | None:
        """A motion that neither machine nor contact resists at the committed state, in words, or None. Collective."""
        loose = [i for i, c in enumerate(self.motion.coordinates) if c.machine is None or not c.machine.holds]
        if self.motion.clamped or not loose:
            return None
        stiffness = -self._corner()[np.ix_(loose, loose)]
        values, vectors = np.linalg.eigh(0.5 * (stiffness + stiffness.T))
        if values[0] > _NOTHING * np.abs(values).sum():
            return None
        axes = [self.motion.coordinates[i].machine.axis for i in loose]  # type: ignore[union-attr]
        along = " and ".join(repr(axes[i]) for i in np.flatnonzero(np.abs(vectors[:, 0]) > 0.1))
        return (
            f"{self._name} is free along {along}: nothing resists its forces. Give its machine a stiffness, a damping "
            "or a mass, or let it begin in contact with the body"
        )

    def integrate(self, scheme: Scheme) -> None:
        """Use a time integration scheme for the inertia of the machines."""
        self.motion.scheme = scheme

    def predict(self) -> None:
        """Go on at the rate of the last step."""
        self.motion.predict()
        self.move()

    def settle(self, forces: Array) -> None:
        """Take note of the force of the body at the end of a step. Collective."""
        self._reaction = self.reaction()
        self.motion.settle(self._reaction * self.motion.units)


class Carriage(Term):
    """Rigid carriage that machines drive, and that carries one tool or several: they share its unknown motion.

    Tools are given to it by their argument `machines`.  Along the axes of the machines all of them go where equilibrium
    lets the carriage go, beyond their own paths by as much as the carriage is ahead of its path; a rotation is about
    its reference point.  A problem with one of the tools has the carriage, too.

    Args:
        state: Displacement and time.
        path: Motion of its reference point, and rotation about it; along the axes of the machines it is that of the far
            ends of their springs.
        machines: What drives it, each along one axis.
        name: Name in messages and output.
        release: Time ≥ 0 until which it follows its path; then the machines take over, with their initial velocity
            [time].

    Attributes:
        axes: Its coordinates.
        border: They as unknowns, with their equations.

    Raises:
        ValueError: There is no machine, axes of translations or of rotations are not at right angles, or an axis makes
            no sense here.
    """

    @checked
    def __init__(
        self,
        state: State,
        path: ToolPath,
        machines: Sequence[Machine],
        *,
        name: str = "carriage",
        release: float = 0.0,
    ) -> None:
        require_number("release", release, nonnegative)
        turns = path.rotation is not None
        require("path.rotation", path.rotation, not (turns and state.axisymmetric), "None for a body of revolution")
        self.name, self.state, self.path = name, state, path
        gdim = state.mesh.geometry.dim
        self.axes = MachineAxes(state, name, partial(path.pose, gdim=gdim), machines, release)
        self.border = CarriageBorder(state.mesh.comm, name, self.axes)

    @property
    def corners(self) -> tuple[float, ...]:
        """Times at which a velocity or a force jumps."""
        return (*self.path.corners, *self.axes.motion.corners)

    @property
    def rate_dependent(self) -> bool:
        """Whether forces depend on the size of the step."""
        return self.axes.motion.rate_dependent

    @property
    def heading(self) -> NDArray[np.float64]:
        """Axis along which the first machine pushes, zero if all turn."""
        axes = [axis for axis in self.axes.shifts if axis.any()]
        return np.asarray(axes[0]) if axes else np.zeros(self.state.mesh.geometry.dim)

    def residual(self, v: Expr) -> ufl.Form:
        """No form: the forces are those of the tools."""
        return ufl.Form([])

    def begin(self) -> None:
        """Prescribe what acts at the end of the step, and move the tools; they begin where they are."""
        motion = self.axes.motion
        # in the first step its tools are still where they were before it
        reaction = np.zeros_like(motion.values) if motion.started else self.border.reaction() * motion.units
        motion.begin(self.state.time_old, self.state.time, reaction)
        self.border.move()

    def external_work(self) -> float:
        """Work of the machines in the step, without what they pass on to the tools [energy]."""
        return self.axes.motion.work() - self.axes.motion.passed_on()

    def energies(self) -> dict[str, float]:
        """Energies of the machines."""
        return self.axes.motion.energies()

    def record(self) -> Columns:
        """Way along each axis, and what its machine does."""
        return self.axes.motion.record(self.name)
