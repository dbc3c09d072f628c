"""Dynamics through a jump: the inertia of the bodies counts until they rest again (docs/theory.md §5)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cutsim.analysis.carriers import NodalResistance
from cutsim.base.arrays import Array
from cutsim.base.assembly import global_dot
from cutsim.base.places import Places
from cutsim.base.terms import Body, Term, offering
from cutsim.bodies.mass import Mass
from cutsim.fields.state import State
from cutsim.solvers.newton import NonlinearProblem

# smallest step over the first one
_SHORTEST = 2.0**-10
# part of what was set free that is kinetic energy of a body at rest
_REST = 1e-2


@dataclass(frozen=True)
class _Known:
    """Motion at the end of a step.

    Attributes:
        forces: Inertia forces on owned dofs, mass × acceleration [force].
        velocity: Velocity of owned dofs [length/time].
        acts: Whether inertia counts.
        kinetic: Kinetic energy [energy].
        lost: Energy that the time integration has taken so far [energy].
        before: The same when the jump began [energy].
        shortest: Step below which it is given up [time].
    """

    forces: Array
    velocity: Array
    acts: bool = False
    kinetic: float = 0.0
    lost: float = 0.0
    before: float = 0.0
    shortest: float = 0.0


class JumpDynamics:
    """Inertia of the bodies by the backward Euler rule, M (v − v₀)/Δt with v = Δu/Δt, from rest to rest.

    The rule damps what the steps do not resolve; as they grow, all motion comes to rest that a support or a bond
    stops.  The mass is lumped to the nodes; those that supports hold have none, so that reactions are static forces.

    Args:
        problem: The solver.
        state: Displacement and time.
        terms: Terms of the problem.
    """

    name, entry = "dynamics", "damped"

    def __init__(self, problem: NonlinearProblem, state: State, terms: Sequence[Term]) -> None:
        self._problem, self._state, self._bodies = problem, state, offering(terms, Body)
        self._resistance = NodalResistance(problem, state)
        none = self._resistance.forces
        at_rest, places = _Known(none, none), Places.owned(state.V)
        self._known = state.memory.value("mechanics: dynamics through jumps", at_rest, places=places)

    @property
    def obstacle(self) -> str | None:
        """Bodies without a density."""
        without = [body.name for body in self._bodies if body.density is None]
        return f"no density of {', '.join(without) or 'a body'} is given" if without or not self._bodies else None

    @property
    def shortest(self) -> float:
        """A fraction of its first step."""
        return self._known.committed.shortest

    @cached_property
    def _mass(self) -> Array:
        """Mass of each owned dof [mass]. Collective."""
        mass = Mass(self._state, self._bodies, "consistent").lumped()
        return np.asarray(np.where(self._problem.guided, 0.0, mass))

    def start(self, smallest: float, first: float) -> float:
        """From rest, unless it has just acted; at first a node is as inert as it is stiff, in the mean. Collective."""
        known = self._known.committed
        total, size = self._state.mesh.comm.allreduce(np.array([self._mass.sum(), len(self._mass)]))
        step = min(float(np.sqrt(total / size / self._resistance.scale)), first)
        self._known.set(replace(known, before=known.lost, shortest=_SHORTEST * step))
        return step

    def begin(self) -> None:
        """No inertia in the trial step."""
        self._resistance.begin()

    def hold(self) -> None:
        """Let inertia count in the trial step."""
        dt = float(self._state.dt.value)
        self._resistance.hold(self._mass / dt**2, dt * self._known.committed.velocity)

    def evaluate(self) -> None:
        """Velocity, kinetic energy, and what the time integration has taken in the trial step. Collective."""
        old, acts = self._known.committed, self._resistance.acts
        if acts or old.acts:
            velocity = acts * self._state.increment / float(self._state.dt.value)
            kinetic = 0.5 * global_dot(self._state.mesh.comm, self._mass * velocity, velocity) if acts else 0.0
            lost = old.lost + self._resistance.work(old.forces) - (kinetic - old.kinetic)
            forces = self._resistance.forces
            self._known.trial = replace(old, forces=forces, velocity=velocity, acts=acts, kinetic=kinetic, lost=lost)

    def rests(self) -> bool:
        """Whether little of what was set free is still kinetic energy."""
        now = self._known.trial
        return now.kinetic <= _REST * (now.kinetic + now.lost - now.before)

    def energies(self) -> dict[str, float]:
        """Kinetic energy while it acts, and what the time integration has taken."""
        now = self._known.trial
        return {"kinetic": now.kinetic, self.entry: now.lost}
