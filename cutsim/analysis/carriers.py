"""What carries a run across a jump, where there is no equilibrium near by (docs/theory.md §5).

Where an equilibrium ends, as when a bond gives way under a blunt tip, the body moves to another one within no time, and
sets energy free on the way.  A carrier adds forces on the nodes that take this energy, until the body rests again.  The
states before and after are equilibria without them.
"""

from typing import Protocol

import numpy as np

from cutsim.base.arrays import Array
from cutsim.base.assembly import global_dot
from cutsim.fields.state import State
from cutsim.solvers.newton import NonlinearProblem

#: Names of all carriers, in the order in which they are tried.
JUMPS = ("brake", "dynamics")


class Carrier(Protocol):
    """Protocol of what carries a run across a jump.

    Attributes:
        name: Its name, as in `StepControl.jumps`.
        entry: Entry of the energy audit that has what it takes.
    """

    name: str
    entry: str

    @property
    def obstacle(self) -> str | None:
        """Why it cannot be used, in words, or None. The same on all ranks."""

    @property
    def shortest(self) -> float:
        """Step below which the run gives it up, once it was started [time]."""

    def start(self, smallest: float, first: float) -> float:
        """Make it ready to act from the committed state on, and return the first step with it [time]. Collective.

        Args:
            smallest: Smallest step without it [time].
            first: Step from which on it may be taken off [time].
        """

    def begin(self) -> None:
        """Start a trial step in which it does not act unless it is held."""

    def hold(self) -> None:
        """Let it act in the trial step, which has begun."""

    def evaluate(self) -> None:
        """Its forces in the trial step, and what it has taken. Collective."""

    def rests(self) -> bool:
        """Whether the body rests enough at the end of the trial step to go on without it."""

    def energies(self) -> dict[str, float]:
        """Its entries of the energy audit, in the trial state [energy]."""


class NodalResistance:
    """Forces on the nodes against their displacement in the trial step, stiffness × (displacement − known part).

    Args:
        problem: The solver.
        state: Displacement and time.

    Attributes:
        acts: Whether there are any in the trial step.
    """

    def __init__(self, problem: NonlinearProblem, state: State) -> None:
        self._problem, self._state, self.acts = problem, state, False
        self._stiffness = self._ahead = np.zeros(len(problem.fixed))

    @property
    def scale(self) -> float:
        """Mean stiffness of a dof of the body, beside which they are weak or strong [force/length]. Collective."""
        return self._problem.resistance(np.empty((0, len(self._stiffness))))[1]

    def begin(self) -> None:
        """None in the trial step."""
        self.acts = False

    def hold(self, stiffness: Array, ahead: Array) -> None:
        """Let them act in the trial step.

        Args:
            stiffness: Stiffness at each owned dof [force/length].
            ahead: Displacement in the step at which there is no force [length].
        """
        self.acts, self._stiffness, self._ahead = True, stiffness, ahead
        self._problem.drag = stiffness
        old = self._state.u_old.x.array[: len(stiffness)]
        self._problem.known -= stiffness * (old + ahead)

    @property
    def forces(self) -> Array:
        """Forces in the trial step, which the body has to overcome [force]."""
        return self.acts * self._stiffness * (self._state.increment - self._ahead)

    def work(self, before: Array) -> float:
        """Work against the mean of the forces at both ends of the trial step [energy]. Collective.

        Args:
            before: Those at its start.
        """
        return global_dot(self._state.mesh.comm, 0.5 * (before + self.forces), self._state.increment)
