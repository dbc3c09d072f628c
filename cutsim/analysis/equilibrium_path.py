"""Equilibrium path of a mechanical problem, along which steps are measured by the energy that they lose."""

from collections.abc import Callable
from typing import Any

import numpy as np

from cutsim.base.arrays import Array
from cutsim.base.terms import Dissipating, offering
from cutsim.solvers.balance import Balance
from cutsim.solvers.iterations import Outcome
from cutsim.solvers.path import PathStep


class EquilibriumPath:
    """Path of the equilibria of a problem, on which time may go back. Making it is collective.

    Args:
        balance: The balance of momentum.
        settle: Completes a solve by augmentations, see `Mechanics.settle`.
        lost: What the trial step has lost by fracture [energy]. Collective.

    Attributes:
        unit: Energy that breaks a facet of mean size, by which steps are chosen; 0 if nothing can break.
    """

    def __init__(
        self,
        balance: Balance[Any, Any],
        settle: Callable[[Callable[[], Outcome]], Outcome],
        lost: Callable[[], float],
    ) -> None:
        self._balance, self._settle, self._lost = balance, settle, lost
        energies = {term: term.facet_energy for term in offering(balance.terms, Dissipating)}
        # what has no law, such as the faces of a notch, loses nothing
        self._breaking = [term for term, energy in energies.items() if energy > 0]
        self.unit = max(energies.values(), default=0.0)

    @property
    def obstacle(self) -> str | None:
        """Why the path cannot be followed, in words, or None."""
        if self.unit == 0:
            return "nothing can break"
        balance = self._balance
        if balance.problem.uses(balance.state.dt) or any(t.rate_dependent for t in balance.terms):
            return "inertia, viscosity or relaxation needs time to go on"
        return None

    def lost(self) -> float:
        """What the trial step has lost by fracture, after it was evaluated [energy]. Collective."""
        return self._lost()

    def follow(self, size: float, span: float) -> Outcome:
        """Find equilibrium and time where the trial step has a given size. Collective.

        Args:
            size: What it loses, by `Dissipating.path_measure` [energy].
            span: Largest change of time in an iteration [time].
        """
        balance, start = self._balance, self._balance.state.time_old

        def move(after: float) -> None:
            balance.state.begin(max(start + after, 0.0))  # loads know no time before
            balance.begin()

        step = PathStep(size, self._measure, span, move)
        return self._settle(lambda: balance.solve_path(step.starting(balance.state.time - start)))

    def _measure(self) -> tuple[float, Array]:
        measures = [term.path_measure() for term in self._breaking]
        return sum(value for value, _ in measures), np.sum([slope for _, slope in measures], axis=0)
