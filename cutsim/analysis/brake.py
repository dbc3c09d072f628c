"""Brake that carries a run across a jump, where there is no equilibrium near by (docs/theory.md §5)."""

from dataclasses import dataclass

import numpy as np

from cutsim.base.arrays import Array
from cutsim.base.assembly import global_dot
from cutsim.base.places import Places
from cutsim.fields.state import State
from cutsim.solvers.newton import NonlinearProblem


@dataclass(frozen=True)
class _Known:
    """What the brake does at the end of a step.

    Attributes:
        forces: Its forces on the owned dofs [force].
        acts: Whether there are any.
        lost: Energy that it has taken so far [energy].
    """

    forces: Array
    acts: bool = False
    lost: float = 0.0


class Brake:
    """Drag on all nodes of a body, c times their velocity, in steps that nothing else carries.

    Where an equilibrium ends, as when a bond gives way under a blunt tip, the body moves to another one within no time.
    What it sets free on that way inertia and viscosity would take; here the brake does, until the body rests again.
    The states before and after are equilibria without it.  What it has taken is an entry of the energy audit, `braked`.

    Args:
        problem: The solver.
        state: Displacement and time.
    """

    def __init__(self, problem: NonlinearProblem, state: State) -> None:
        self._problem, self._state = problem, state
        at_rest = _Known(np.zeros(len(problem.fixed)))
        self._known = state.memory.value("mechanics: brake", at_rest, places=Places.owned(state.V))

    @property
    def stiffness(self) -> float:
        """Mean stiffness of a node at the present displacement, beside which a drag is weak or strong. Collective."""
        return self._problem.resistance(np.empty((0, len(self._problem.fixed))))[1]

    def hold(self, drag: float) -> None:
        """Let the drag act in the trial step, which has begun; 0 for none.

        Args:
            drag: Force on a node over its velocity, c [force·time/length].
        """
        problem, state = self._problem, self._state
        problem.drag = drag / float(state.dt.value) if drag else 0.0
        problem.known -= problem.drag * state.u_old.x.array[: len(problem.known)]

    def evaluate(self) -> None:
        """Forces of the trial step, and what it has lost by their mean at its ends. Collective."""
        drag, increment, old = self._problem.drag, self._state.increment, self._known.committed
        if drag or old.acts:
            forces = drag * increment
            lost = global_dot(self._state.mesh.comm, 0.5 * (forces + old.forces), increment)
            self._known.trial = _Known(forces, drag > 0, old.lost + lost)

    @property
    def lost(self) -> float:
        """Energy that it has taken so far, in the trial state [energy]."""
        return self._known.trial.lost
