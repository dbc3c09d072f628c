"""Motion of a rigid body as unknowns: its coordinates over the steps, and their machines (docs/test_rigs.md).

A coordinate s has the equation, at the end of a step and divided by 1 − α_f as that of the bodies (`bodies.inertia`),

    d ṡ + k (s − s_machine) − F − Q + c m s̈(s) + h = 0,

with Q the force of the deformable body along it.  Without mass ṡ = Δs/Δt.  Until they are released the coordinates are
clamped to their paths, s = s_machine: then the machines take over.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from dolfinx import fem

from cutsim.base.arrays import Array
from cutsim.base.memory import Memory
from cutsim.base.parameters import TimeFunction
from cutsim.bodies.machine import Machine
from cutsim.bodies.schemes import TRAPEZOIDAL, Scheme


@dataclass(frozen=True)
class Coordinate:
    """One coordinate of a rigid body.

    Attributes:
        name: Its name, such as "y" or "rz".
        machine: What drives it; None where its value is prescribed.
        path: Value that is prescribed to it, or to the far end of the machine's spring, as a function of time.
        unit: Length by which an unknown differs from it: 1, or a radius for a rotation [length].
    """

    name: str
    machine: Machine | None
    path: TimeFunction
    unit: float = 1.0

    @property
    def turns(self) -> bool:
        """Whether it is a rotation."""
        return self.name in ("rx", "ry", "rz")


@dataclass(frozen=True)
class _Motion:
    """Coordinates and all that moves them, at the end of a step; energies are sums since the start."""

    values: Array
    velocity: Array
    acceleration: Array
    path: Array
    force: Array
    reaction: Array  # force of the deformable body, Q
    balance: Array  # what is left of the equation at the end of a step, with inertia
    started: bool = False
    clamped: bool = False
    viscous: float = 0.0
    numerical: float = 0.0
    work: float = 0.0  # of the machines and what is prescribed, in the step
    blow: float = 0.0  # energy with which masses that were clamped before begin the step

    @classmethod
    def at_rest(cls, values: Array, velocity: Array) -> Self:
        none = np.zeros_like(values)
        return cls(values, velocity, none, values, none, none, none)


class _Machines:
    """Machines of some coordinates, of which those that have none take part in nothing.

    Args:
        coordinates: The coordinates.

    Attributes:
        stiffness: k of each.
        damping: d of each.
        mass: m of each.
        velocity: Initial velocity of each.
        corners: Times at which a force has a kink.
    """

    def __init__(self, coordinates: Sequence[Coordinate]) -> None:
        self._coordinates, self._each = coordinates, [c.machine or Machine("x") for c in coordinates]
        numbers = [(m.stiffness, m.damping, m.mass, m.velocity) for m in self._each]
        self.stiffness, self.damping, self.mass, self.velocity = np.array(numbers).T
        self.corners = {t for m in self._each for t in m.corners}

    def paths(self, time: float) -> Array:
        """What is prescribed at a time."""
        return np.array([c.path(time) for c in self._coordinates], dtype=float)

    def forces(self, time: float) -> Array:
        """Forces with weights at a time."""
        return np.array([m.weight + m.force_at(time) for m in self._each])

    def started(self, old: _Motion, time: float, reaction: Array) -> _Motion:
        """The motion at the time when the machines begin to act.

        Args:
            old: The motion as it was before.
            time: The time.
            reaction: Force of the deformable body [force].
        """
        path, force, inert = self.paths(time), self.forces(time), self.mass > 0
        velocity = np.where(inert, self.velocity, old.velocity)
        static = self.damping * velocity + self.stiffness * (old.values - path) - force - reaction
        acceleration = np.where(inert, -static / np.where(inert, self.mass, 1.0), 0.0)
        balance = static + self.mass * acceleration
        blow = 0.5 * float(self.mass @ velocity**2) if old.clamped else 0.0
        now = replace(old, path=path, force=force, reaction=reaction, started=True, clamped=False, blow=blow)
        return replace(now, velocity=velocity, acceleration=acceleration, balance=balance)


class RigidMotion:
    """Coordinates of a rigid body over the steps.

    Args:
        memory: What a run remembers.
        name: Name of the body.
        coordinates: The coordinates.
        dt: Size of the step.
        release: Time until which all of them are clamped to their paths, 0 for never [time].

    Attributes:
        coordinates: As above.
        held: Which of them are prescribed.
        units: Length of an unknown over its coordinate.
        scheme: Time integration of the machines' inertia.
    """

    scheme: Scheme = TRAPEZOIDAL

    def __init__(
        self, memory: Memory, name: str, coordinates: Sequence[Coordinate], dt: fem.Constant, release: float = 0.0
    ) -> None:
        self.coordinates, self._dt_constant, self._release = tuple(coordinates), dt, release
        self.held = np.array([c.machine is None for c in coordinates])
        self.units = np.array([c.unit for c in coordinates])
        self._machines = machines = _Machines(self.coordinates)
        self._k, self._d, self._m = machines.stiffness, machines.damping, machines.mass
        rest = _Motion.at_rest(machines.paths(0.0), (release <= 0) * machines.velocity)
        self._motion = memory.value(f"{name}: motion", replace(rest, clamped=release > 0))

    @property
    def corners(self) -> tuple[float, ...]:
        """Times at which a force of a machine has a kink, and that of the release."""
        return tuple(sorted(self._machines.corners | ({self._release} if self._release > 0 else set())))

    @property
    def rate_dependent(self) -> bool:
        """Whether a machine has a dashpot or inertia."""
        return bool(self._d.any() or self._m.any())

    @property
    def values(self) -> Array:
        """Trial value of each coordinate [length or rad]."""
        return self._motion.trial.values

    @property
    def reaction(self) -> Array:
        """Force of the deformable body along each coordinate at the end of the step [force or moment]."""
        return self._motion.trial.reaction

    @property
    def paths(self) -> Array:
        """What is prescribed at the end of the step."""
        return self._motion.trial.path

    def assign(self, values: Array) -> None:
        """Set the trial values."""
        self._motion.trial = replace(self._motion.trial, values=values)

    def ahead(self, fraction: float, time: float) -> Array:
        """What each coordinate is ahead of its path after a fraction of the step, which is a time."""
        old, now = self._motion.committed.values, self._motion.trial.values
        return np.asarray(old + fraction * (now - old) - self._machines.paths(time))

    @property
    def started(self) -> bool:
        """Whether a step has begun in which the coordinates are not clamped."""
        return self._motion.committed.started

    @property
    def clamped(self) -> bool:
        """Whether the coordinates follow their paths at the end of the step."""
        return self._motion.trial.clamped

    # -- steps ----------------------------------------------------------------------------------------------------

    def begin(self, start: float, end: float, reaction: Array) -> None:
        """Prescribe what acts at the end of a step, and keep the coordinates as they are unless they are clamped.

        Args:
            start: Time at the start of the step.
            end: Time at its end.
            reaction: Force of the deformable body at the start, which the first step needs.
        """
        path = self._machines.paths(end)
        if end <= self._release:
            self._motion.trial = replace(self._motion.committed, values=path, path=path)
            return
        if not self._motion.committed.started:
            self._motion.set(self._machines.started(self._motion.committed, start, reaction))
        self._motion.trial = replace(self._motion.committed, path=path, force=self._machines.forces(end))

    def predict(self) -> None:
        """Go on at the rate of the last step, where they are not clamped."""
        old = self._motion.committed
        if not self.clamped:
            self.assign(old.values + self._dt * old.velocity)

    def _rates(self) -> tuple[Array, Array]:
        """Velocity and acceleration at the end of the step."""
        s, dt, old, values = self.scheme, self._dt, self._motion.committed, self.values
        if not self.rate_dependent:  # along an equilibrium path time may stand still
            none = np.zeros_like(values)
            return (values - old.values) / dt if dt else none, none
        inert = self._m > 0
        known = old.values + dt * old.velocity + (0.5 - s.beta) * dt**2 * old.acceleration
        a = np.where(inert, (values - known) / (s.beta * dt**2), 0.0)
        v = old.velocity + dt * ((1 - s.gamma) * old.acceleration + s.gamma * a)
        return np.where(inert, v, (values - old.values) / dt), a

    def equations(self, reaction: Array) -> Array:
        """Left-hand sides of the equations [force].

        Args:
            reaction: Force Q of the deformable body along each coordinate [force].
        """
        s, old = self.scheme, self._motion.committed
        weight = (1 - s.alpha_m) / (1 - s.alpha_f)
        history = s.alpha_f * old.balance + (s.alpha_m - s.alpha_f) * self._m * old.acceleration
        return self._static(reaction) + weight * self._m * self._rates()[1] + history / (1 - s.alpha_f)

    def _static(self, reaction: Array) -> Array:
        now = self._motion.trial
        return self._d * self._rates()[0] + self._k * (now.values - now.path) - now.force - reaction

    def stiffness(self) -> Array:
        """Derivative of each equation by its coordinate, without that of the deformable body [force/length]."""
        if not self.rate_dependent:
            return self._k
        s, dt, inert = self.scheme, self._dt, self._m > 0
        inertia = (1 - s.alpha_m) / (1 - s.alpha_f) * self._m / (s.beta * dt**2)
        return self._k + self._d * np.where(inert, s.gamma / (s.beta * dt), 1 / dt) + inertia

    @property
    def loads(self) -> Array:
        """Forces of machines that tell what is large [force]."""
        now = self._motion.trial
        return np.abs(self._k * (now.values - now.path)) + np.abs(now.force)

    def settle(self, reaction: Array) -> None:
        """Take note of the force of the deformable body at the end of the step."""
        old, now = self._motion.committed, self._motion.trial
        if now.clamped:
            way = now.values - old.values
            work = float(-_mean(old.reaction, reaction) @ way)
            velocity = np.where(self._m > 0, 0.0, way / self._dt)
            self._motion.trial = replace(now, velocity=velocity, reaction=reaction, work=work)
            return
        velocity, acceleration = self._rates()
        balance = np.where(self.held, 0.0, self._static(reaction) + self._m * acceleration)
        way, far = now.values - old.values, now.path - old.path
        spring = self._k * _mean(old.values - old.path, now.values - now.path)
        work = _mean(old.force, now.force) @ way - spring @ far
        work -= _mean(old.reaction, reaction)[self.held] @ way[self.held]
        taken = _numerical(self._m, old, acceleration, velocity, way) - float(_mean(old.balance, balance) @ way)
        self._motion.trial = replace(
            now,
            velocity=velocity,
            acceleration=acceleration,
            reaction=reaction,
            balance=balance,
            viscous=old.viscous + float(self._d * _mean(old.velocity, velocity) @ way),
            numerical=old.numerical + taken,
            work=float(work) + old.blow,
            blow=0.0,
        )

    def work(self) -> float:
        """Work of machines, forces and what is prescribed, in the step [energy]."""
        return self._motion.trial.work

    def passed_on(self) -> float:
        """Part of it that goes to the deformable body, in the step [energy]."""
        old, now = self._motion.committed, self._motion.trial
        return float(-0.5 * (old.reaction + now.reaction) @ (now.values - old.values))

    def energies(self) -> dict[str, float]:
        """Energy of springs, kinetic energy, work of dashpots, and what the time integration has taken."""
        now = self._motion.trial
        spring = 0.5 * self._k @ (now.values - now.path) ** 2
        kinetic = 0.5 * self._m @ now.velocity**2
        return {"strain": float(spring), "kinetic": float(kinetic), "viscous": now.viscous, "numerical": now.numerical}

    def record(self, name: str) -> dict[str, tuple[float, str]]:
        """Value of each coordinate that a machine drives, its rate, and the machine's own place and force."""
        now, columns = self._motion.trial, dict[str, tuple[float, str]]()
        for i, c in enumerate(self.coordinates):
            place, force = ("angle", "moment") if c.turns else ("length", "force")
            columns[f"{name}_{c.name}"] = now.values[i], place
            if self._m[i] > 0:
                columns[f"{name}_{c.name}_rate"] = now.velocity[i], "angular velocity" if c.turns else "velocity"
            if self._k[i] > 0:
                columns[f"{name}_{c.name}_machine"] = now.path[i], place
                columns[f"{name}_{c.name}_machine_{force}"] = self._k[i] * (now.path[i] - now.values[i]), force
        return {column: (float(value), kind) for column, (value, kind) in columns.items()}

    @property
    def _dt(self) -> float:
        return float(self._dt_constant.value)


def _mean(first: Array, second: Array) -> Array:
    """Mean of the values at the start and the end of a step."""
    return 0.5 * (first + second)


def _numerical(mass: Array, old: _Motion, acceleration: Array, velocity: Array, way: Array) -> float:
    """Work of inertia that is not found in the kinetic energy."""
    work = mass * 0.5 * (old.acceleration + acceleration) @ way
    return float(work - 0.5 * mass @ (velocity**2 - old.velocity**2))
