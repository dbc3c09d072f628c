"""Inertia of the solids: mass, velocity and acceleration over the steps (docs/dynamics.md).

The scheme's balance at the end of a step, divided by 1 − α_f, is solved in the form

    R(u) + c M a(u) + h = 0,    a(u) = (u − u*)/(β Δt²),    c = (1 − α_m)/(1 − α_f),

with u* = u₀ + Δt v₀ + (½ − β) Δt² a₀ and the history forces h = (α_f R₀ + α_m M a₀)/(1 − α_f), which are known.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import ufl
from dolfinx import default_scalar_type, fem
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.base.assembly import Array, global_dot
from cutsim.base.checks import require
from cutsim.base.kinematics import Expr
from cutsim.base.places import Places
from cutsim.base.terms import Body, Term
from cutsim.bodies.mass import Mass
from cutsim.bodies.schemes import Scheme
from cutsim.fields.state import State
from cutsim.solvers.directions import Directions

#: Owned dofs of a support, their velocity and acceleration.
Prescribed = tuple[NDArray[np.int32], float, float]

Velocity = Callable[[NDArray[np.float64]], NDArray[np.float64]] | Sequence[float]


@dataclass(frozen=True)
class _Known:
    """Inertia forces M a on owned dofs and energies at the end of a step."""

    forces: Array
    kinetic: float = 0.0
    numerical: float = 0.0


class Inertia(Term):
    """Inertia of solids; made by `cutsim.analysis.mechanics.Mechanics` for a dynamic analysis.

    Args:
        state: Displacement and time.
        solids: The bodies; each needs a density.
        scheme: Time integration.
        mass: "consistent", or "lumped" by a quadrature in the nodes (degree 1, and degree 2 on quadrilaterals and
            hexahedra; on simplices of degree 2 some nodes would have no mass).

    Attributes:
        mass: The mass of the bodies.
        velocity: Trial velocity [length/time].
        acceleration: Trial acceleration [length/time²].

    Raises:
        ValueError: There is no solid, one has no density, or the mass cannot be lumped.
    """

    name = "inertia"

    def __init__(
        self,
        state: State,
        solids: Sequence[Body],
        scheme: Scheme,
        mass: Literal["consistent", "lumped"] = "consistent",
    ) -> None:
        require("terms", [s.name for s in solids], len(solids) > 0, "with a Solid in a dynamic analysis")
        require("scheme", scheme, isinstance(scheme, Scheme), "a scheme such as Newmark() or GeneralisedAlpha(0.8)")
        self.state, self.scheme = state, scheme
        self.mass = Mass(state, solids, mass)
        self.velocity = fem.Function(state.V, name="velocity")
        self.acceleration = fem.Function(state.V, name="acceleration")
        self._velocity = state.memory.array("velocity", self.velocity)
        self._acceleration = state.memory.array("acceleration", self.acceleration)
        self._started = state.memory.value("dynamic", False)
        self._predicted = fem.Function(state.V)
        # c/(β Δt²); zero until the first step begins
        self._weight = fem.Constant(state.mesh, default_scalar_type(0.0))
        self._known = state.memory.value(
            "inertia", _Known(np.zeros(len(state.increment))), places=Places.owned(state.V)
        )

    # -- start ----------------------------------------------------------------------------------------------------

    def set_velocity(self, value: Velocity, cells: NDArray[np.int32] | None = None) -> None:
        """Set the initial velocity. Collective.

        Where a support holds, its prescribed motion wins.

        Args:
            value: A vector, or a function of the positions (3, n) → (gdim, n) [length/time].
            cells: Local cells of the body that has it (ghosts included); all by default.

        Raises:
            ValueError: The vector has the wrong number of components, or the first step has begun.
        """
        gdim = self.state.mesh.geometry.dim
        require("velocity", value, not self.started, "set before the first step")
        if not callable(value):
            require("velocity", value, np.shape(value) == (gdim,), f"a function or {gdim} numbers")
            vector = np.asarray(value, dtype=np.float64)
            self.velocity.interpolate(lambda x: np.outer(vector, np.ones(x.shape[1])), cells)
        else:
            self.velocity.interpolate(value, cells)
        self.velocity.x.scatter_forward()
        self._velocity.commit()

    @property
    def started(self) -> bool:
        """Whether the first step has begun; the initial velocity is then history."""
        return self._started.committed

    def start(
        self, static: Array, bcs: Sequence[fem.DirichletBC], directions: Directions, prescribed: Sequence[Prescribed]
    ) -> Array:
        """Initial velocities, and accelerations M a = −R, those of the supports given. Collective.

        Args:
            static: Owned static forces R, internal minus external [force].
            bcs: Dirichlet conditions on components.
            directions: What is prescribed along other directions.
            prescribed: Owned dofs, velocity and acceleration of each support, along the axes of the nodes.

        Returns:
            Forces R + M a: zero but for those of the supports.
        """
        n, fixed = len(static), np.zeros(len(static), dtype=bool)
        a, v = self.acceleration.x, self.velocity.x
        velocity, acceleration = (directions.turn(x.array[:n].copy()) for x in (v, a))
        for dofs, first, second in prescribed:
            velocity[dofs], acceleration[dofs], fixed[dofs] = first, second, True
        v.array[:n], a.array[:n] = directions.back(velocity), directions.back(acceleration)
        a.scatter_forward()
        forces = directions.turn(-static - self.mass.times(a.array))
        a.array[:n] = directions.back(self.mass.divide(np.where(fixed, acceleration, forces), bcs, directions))
        for field, remembered in ((self.velocity, self._velocity), (self.acceleration, self._acceleration)):
            field.x.scatter_forward()
            remembered.commit()
        self._known.set(_Known(self.mass.times(a.array), self.mass.kinetic(self.velocity.x.array)))
        self._started.set(True)
        return static + self._known.committed.forces

    # -- steps ----------------------------------------------------------------------------------------------------

    @property
    def fields(self) -> Mapping[str, Expr]:
        """The velocity."""
        return {"velocity": self.velocity}

    @property
    def rate_dependent(self) -> bool:
        """Always."""
        return True

    def residual(self, v: Expr) -> ufl.Form:
        """Virtual work ∫ c ρ a(u)·v of the inertia forces."""
        return self.mass.form(self._weight * (self.state.u - self._predicted), v)

    def begin(self) -> None:
        """Known part of the motion; the displacement starts from that at constant velocity."""
        s, dt = self.scheme, self._dt
        start = self.state.u_old.x.array + dt * self._velocity.committed
        self._predicted.x.array[:] = start + (0.5 - s.beta) * dt**2 * self._acceleration.committed
        self._weight.value = (1 - s.alpha_m) / (1 - s.alpha_f) / (s.beta * dt**2)
        self.state.u.x.array[:] = start

    def history(self, old: Array) -> Array:
        """Known forces h of the step's balance.

        Args:
            old: Owned forces R + M a at the start of the step.
        """
        s = self.scheme
        # R₀ is old − M a₀
        weights = s.alpha_f / (1 - s.alpha_f), (s.alpha_m - s.alpha_f) / (1 - s.alpha_f)
        return weights[0] * old + weights[1] * self._known.committed.forces

    def evaluate(self) -> None:
        """Velocity, acceleration and their energies. Collective."""
        s, dt, old = self.scheme, self._dt, self._known.committed
        a, v = self.acceleration.x.array, self.velocity.x.array
        a[:] = (self.state.u.x.array - self._predicted.x.array) / (s.beta * dt**2)
        v[:] = self._velocity.committed + dt * ((1 - s.gamma) * self._acceleration.committed + s.gamma * a)
        forces, kinetic = self.mass.times(a), self.mass.kinetic(self.velocity.x.array)
        work = self._dot(0.5 * (forces + old.forces), self.state.increment)
        self._known.trial = _Known(forces, kinetic, old.numerical + work - (kinetic - old.kinetic))

    def balance(self, solved: Array, old: Array, supported: Callable[[Array], Array]) -> Array:
        """Forces R + M a at the end of the step; call after `evaluate`. Collective.

        A scheme with α_f > 0 balances forces within the step, so that those at its end are out of balance. Their work
        is booked as numerical.

        Args:
            solved: Owned residual of the step's balance, R + c M a + h.
            old: Forces R + M a at the start of the step.
            supported: Gives the part of owned forces that supports hold.
        """
        s, now = self.scheme, self._known.trial
        forces = solved - self.history(old) + (s.alpha_m - s.alpha_f) / (1 - s.alpha_f) * now.forces
        mean = 0.5 * (forces + old)
        work = self._dot(mean - supported(mean), self.state.increment)
        self._known.trial = _Known(now.forces, now.kinetic, now.numerical - work)
        return forces

    def energies(self) -> dict[str, float]:
        """Kinetic energy ½ v·M v, and what the scheme has dissipated so far."""
        return {"kinetic": self._known.trial.kinetic, "numerical": self._known.trial.numerical}

    def momentum(self) -> Array:
        """Linear momentum, one number a component [force·time]. Collective."""
        return self.mass.momentum(self.velocity.x.array)

    def record(self) -> dict[str, tuple[float, str]]:
        """Largest nodal speed. Collective."""
        nodal = self.velocity.x.array[: len(self.state.increment)].reshape(-1, self.state.mesh.geometry.dim)
        local = np.linalg.norm(nodal, axis=1).max(initial=0.0)
        return {"velocity_max": (float(self.state.mesh.comm.allreduce(local, op=MPI.MAX)), "velocity")}

    @property
    def _dt(self) -> float:
        return float(self.state.dt.value)

    def _dot(self, a: Array, b: Array) -> float:
        return global_dot(self.state.mesh.comm, a, b)
