"""Base of rigid tools: path, force and moment, and work on the body (docs/theory.md §4)."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Protocol

import numpy as np
from dolfinx import default_scalar_type, fem
from numpy.typing import NDArray

from cutsim.base.checks import require
from cutsim.base.rotations import rotation_vector
from cutsim.base.terms import Term
from cutsim.bodies.machine import Machine
from cutsim.fields.points import Surface, Values
from cutsim.fields.state import State
from cutsim.interface.doubts import doubt_penetration
from cutsim.interface.slip import SlipHistory
from cutsim.tools.carriage import Carriage
from cutsim.tools.shapes import ToolPath

_AXES = "xyz"
# a tool of unknown temperature is never the hotter side
_COLD = -1e30
_Action = tuple[NDArray[np.float64], NDArray[np.float64]]


class Touched(Protocol):
    """Protocol of a surface of the body that a tool touches, as heat uses it."""

    @property
    def surface(self) -> Surface:
        """The surface."""

    def pressure(self) -> Values:
        """Present contact pressure at its points [stress]. Collective."""

    def dissipation(self) -> Values:
        """Friction dissipation of the trial step at its points [energy per reference area]."""


class RigidTool(Term, ABC):
    """Rigid tool that moves and turns along a path, or that machines drive along it.

    Args:
        state: Displacement and time.
        path: Motion of the reference point, and rotation about it.
        name: Name in messages and output.
        machines: What drives the tool, each along one axis, along which the path is that of the machine; along all
            others the tool follows the path itself. Or the carriage that it shares with other tools.

    Attributes:
        carriage: What carries it along unknown ways; None if it follows its path.
        position: Present position of the reference point [length].
        rotation: Present rotation R, a matrix: a point x of the body lies at Rᵀ(x − position) in the tool's frame.
        temperature: Temperature of the tool, as friction feels it; `cutsim.heat.tool_heat` knows it.

    Raises:
        ValueError: The path has another dimension than the mesh, or turns the tool of a body of revolution.
    """

    def __init__(self, state: State, path: ToolPath, name: str, machines: Sequence[Machine] | Carriage = ()) -> None:
        gdim = state.mesh.geometry.dim
        turns = path.rotation is not None
        require("path.rotation", path.rotation, not (turns and state.axisymmetric), "None for a body of revolution")
        self.name, self.state, self.path = name, state, path
        position, rotation = (np.array(p, dtype=default_scalar_type) for p in path.pose(0.0, gdim))
        self.position, self.rotation = fem.Constant(state.mesh, position), fem.Constant(state.mesh, rotation)
        self._position = state.memory.array(f"{name}: position", self.position)
        self._rotation = state.memory.array(f"{name}: rotation", self.rotation)
        self.temperature = fem.Constant(state.mesh, default_scalar_type(_COLD))
        state.memory.array(f"{name}: temperature", self.temperature)
        none: _Action = (np.zeros(gdim), np.zeros(3 if gdim == 3 else 1))
        self._action = state.memory.value(f"{name}: force and moment", none)
        self.carriage: Carriage | None = None
        if isinstance(machines, Carriage):
            self.carriage = machines
        elif machines:
            self.carriage = Carriage(state, path, machines, name=f"{name}_drive")
        state.verdict.suppose(self._untouched, f"{name} has never touched the body")

    @property
    def slips(self) -> Sequence[SlipHistory]:
        """Memory of friction of the surfaces that the tool touches."""
        return ()

    @property
    @abstractmethod
    def touched(self) -> Sequence[Touched]:
        """The surfaces of the body that it can touch."""

    @property
    def corners(self) -> tuple[float, ...]:
        """Times at which the tool's velocity jumps."""
        return self.path.corners

    @property
    def companions(self) -> Sequence[Term]:
        """What carries it."""
        return [] if self.carriage is None else [self.carriage]

    @property
    def heading(self) -> NDArray[np.float64]:
        """Axis along which the first machine pushes it, zero if none does."""
        return np.zeros_like(self.position.value) if self.carriage is None else self.carriage.heading

    @property
    def displacement(self) -> NDArray[np.float64]:
        """Increment of the tool's position in the step [length]."""
        return np.asarray(self._position.trial - self._position.committed)

    @property
    def turn(self) -> NDArray[np.float64]:
        """Increment of the tool's rotation in the step, an angle or a rotation vector in space [rad]."""
        return rotation_vector(self._rotation.trial @ self._rotation.committed.T)

    def act(self, force: NDArray[np.float64], moment: NDArray[np.float64]) -> None:
        """Note force and moment on the tool in the trial state, for `evaluate`."""
        self._action.trial = force, moment

    def begin(self) -> None:
        """Move the tool to where it is at the end of the step, unless a carriage does so."""
        if self.carriage is None:
            self.move(1.0)

    def move(self, fraction: float) -> None:
        """Move the tool to where it is after a fraction of the step."""
        time = self.state.time_old + fraction * (self.state.time - self.state.time_old)
        pose = self.path.pose(time, len(self.position.value))
        if self.carriage is not None:
            pose = self.carriage.axes.pose(pose, fraction, time)
        self.position.value[:], self.rotation.value[:] = pose

    def external_work(self) -> float:
        """Work of the tool on the body in the step, mean force and moment times their increments. Collective."""
        force, moment = (0.5 * (now + old) for now, old in zip(self._action.trial, self._action.committed, strict=True))
        return float(-force @ self.displacement - moment @ self.turn)

    def force(self) -> NDArray[np.float64]:
        """Force on the tool in the trial state, from the virtual work of a rigid translation [force]."""
        return self._action.trial[0]

    def moment(self) -> NDArray[np.float64]:
        """Moment on the tool about its reference point, from the virtual work of a rigid rotation."""
        return self._action.trial[1]

    def record(self) -> dict[str, tuple[float, str]]:
        """Position, rotation, force and moment of the tool, areas that stick and slip. Collective."""
        force, couple = self.force(), self.moment()
        gdim = len(force)
        columns = {f"{self.name}_{_AXES[i]}": (float(self.position.value[i]), "length") for i in range(gdim)}
        axes = _AXES if gdim == 3 else "z"
        if self.path.rotation is not None or (self.carriage is not None and self.carriage.axes.turns):
            angles = zip(axes, rotation_vector(self.rotation.value), strict=True)
            columns |= {f"{self.name}_rotation_{a}": (float(angle), "angle") for a, angle in angles}
        columns |= {f"{self.name}_force_{_AXES[i]}": (float(force[i]), "force") for i in range(gdim)}
        if not self.state.axisymmetric:  # moments of a ring balance each other
            columns |= {f"{self.name}_moment_{a}": (float(m), "moment") for a, m in zip(axes, couple, strict=True)}
        if self.slips:
            sticks, slips = np.sum([slip.areas() for slip in self.slips], axis=0)
            kind = self.state.facet_measure
            columns |= {f"{self.name}_sticking": (float(sticks), kind), f"{self.name}_slipping": (float(slips), kind)}
        return columns

    @property
    @abstractmethod
    def blend(self) -> float:
        """Blend of the contact over the mesh size, see `PenaltyContact` [–]."""

    @abstractmethod
    def penetration(self) -> float:
        """Largest depth of a point of the body in the tool over the mesh size, ≤ 0 if none is in it. Collective."""

    def watch(self) -> None:
        """Doubt a tool that has not touched the body yet, or that lies deep in it. Collective."""
        depth = self.penetration()
        if self.force().any():
            self.state.verdict.withdraw(self._untouched)
        doubt_penetration(self.state.verdict, self.name, depth, self.blend)

    def leave_out(self, faces: Surface) -> None:
        """Note faces of cracks that no tool can touch; some tools look whether they are in them. Collective."""

    def may_miss(self) -> None:
        """Say that a run is to be trusted also if the tool does not come to these surfaces of the body."""
        self.state.verdict.withdraw(self._untouched)

    @property
    def _untouched(self) -> str:
        return f"{self.name}: untouched"
