"""Brake that carries a run across a jump: a drag on all nodes (docs/theory.md §5)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cutsim.analysis.carriers import NodalResistance
from cutsim.base.arrays import Array
from cutsim.base.places import Places
from cutsim.base.terms import Advising, Term, offering
from cutsim.fields.state import State
from cutsim.solvers.newton import NonlinearProblem

# first and smallest step over the smallest one without a brake
_FIRST, _SHORTEST = 2.0**-6, 2.0**-12


@dataclass(frozen=True)
class _Known:
    """What the brake does at the end of a step.

    Attributes:
        forces: Its forces on the owned dofs [force].
        acts: Whether there are any.
        lost: Energy that it has taken so far [energy].
        drag: Force on a node over its velocity, c [force·time/length].
        shortest: Step below which it is given up [time].
    """

    forces: Array
    acts: bool = False
    lost: float = 0.0
    drag: float = 0.0
    shortest: float = 0.0


class Brake:
    """Drag on all nodes, c times their velocity: as strong in its first step as the body is stiff, it fades with time.

    Inertia and viscosity would take what the body sets free; here the brake does.

    Args:
        problem: The solver.
        state: Displacement and time.
        terms: Terms of the problem.
    """

    name, entry = "brake", "braked"

    def __init__(self, problem: NonlinearProblem, state: State, terms: Sequence[Term]) -> None:
        self._state, self._loads = state, offering(terms, Advising)
        self._resistance = NodalResistance(problem, state)
        at_rest = _Known(self._resistance.forces)
        self._known = state.memory.value("mechanics: brake", at_rest, places=Places.owned(state.V))

    @property
    def obstacle(self) -> str | None:
        """A given load: beyond the largest one there may be no other equilibrium in which a body comes to rest."""
        return "a body may run away under a given load" if self._loads else None

    @property
    def shortest(self) -> float:
        """A fraction of the smallest step without it."""
        return self._known.committed.shortest

    def start(self, smallest: float, first: float) -> float:
        """As strong as the mean stiffness of a node is in its first step. Collective."""
        size = _FIRST * smallest
        drag = size * self._resistance.scale
        self._known.set(replace(self._known.committed, drag=drag, shortest=_SHORTEST * smallest))
        return size

    def begin(self) -> None:
        """No drag in the trial step."""
        self._resistance.begin()

    def hold(self) -> None:
        """Let the drag act in the trial step."""
        still = np.zeros_like(self._known.committed.forces)
        self._resistance.hold(still + self._known.committed.drag / float(self._state.dt.value), still)

    def evaluate(self) -> None:
        """Forces of the trial step, and what it has lost by their mean at its ends. Collective."""
        old, acts = self._known.committed, self._resistance.acts
        if acts or old.acts:
            lost = old.lost + self._resistance.work(old.forces)
            self._known.trial = replace(old, forces=self._resistance.forces, acts=acts, lost=lost)

    def rests(self) -> bool:
        """Always: where steps are long, the drag has faded."""
        return True

    def energies(self) -> dict[str, float]:
        """What it has taken."""
        return {self.entry: self._known.trial.lost}
