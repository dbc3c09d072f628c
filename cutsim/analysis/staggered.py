"""Staggered step of mechanics and heat: mechanics at fixed temperature, then heat at fixed displacement."""

from collections.abc import Mapping
from dataclasses import replace
from math import isfinite

import numpy as np
from mpi4py import MPI

from cutsim.analysis.availability import Availability
from cutsim.analysis.carriers import Carrier
from cutsim.analysis.energy import EnergyAudit
from cutsim.analysis.mechanics import Mechanics
from cutsim.base.checks import positive, require, require_number
from cutsim.base.kinematics import Expr
from cutsim.base.signatures import checked
from cutsim.base.terms import Term
from cutsim.heat.transfer import HeatTransfer
from cutsim.solvers.iterations import Outcome

#: Passes of mechanics and heat allowed in one step.
PASSES = 30


class ThermoMechanics:
    """Staggered step: isothermal mechanics, then heat conduction at the new displacement (docs/theory.md §5).

    It is given to `cutsim.analysis.stepping.run` in place of `Mechanics`.

    Args:
        mechanics: The mechanical problem.
        heat: The heat problem, on the same state.
        iterate: Repeat both until the temperature changes nowhere by more than this from one pass to the next
            [temperature]; None for one pass, whose error is of first order in the step.

    Raises:
        ValueError: The problems have different states, or `iterate` is not positive.
    """

    @checked
    def __init__(self, mechanics: Mechanics, heat: HeatTransfer, *, iterate: float | None = None) -> None:
        require("heat", heat.state, heat.state is mechanics.state, "a problem on the state of the mechanics")
        require_number("iterate", iterate, positive.or_none)
        self.mechanics, self.heat, self.iterate = mechanics, heat, iterate
        self.state = mechanics.state
        self._availability = Availability(heat.temperature, heat.terms)

    @property
    def path(self) -> None:
        """None: heat needs time to go on."""

    @property
    def carriers(self) -> tuple[Carrier, ...]:
        """Those of the mechanics."""
        return self.mechanics.carriers

    @property
    def terms(self) -> tuple[Term, ...]:
        """Terms of both problems."""
        return (*self.mechanics.terms, *self.heat.terms)

    @property
    def fields(self) -> Mapping[str, Expr]:
        """Fields of the solution for output, by name."""
        return {**self.mechanics.fields, **self.heat.fields}

    @property
    def corners(self) -> tuple[float, ...]:
        """Times at which a path or load has a kink."""
        return tuple(sorted({*self.mechanics.corners, *self.heat.corners}))

    @property
    def audit(self) -> EnergyAudit:
        """Energy audit of the mechanics; the audit of heat is `heat.audit`."""
        return self.mechanics.audit

    @property
    def trial_audit(self) -> EnergyAudit:
        """Energy audit of the mechanics including the trial step."""
        return self.mechanics.trial_audit

    def refresh(self) -> None:
        """Forget what the solvers have factorised. Collective."""
        self.mechanics.refresh()
        self.heat.refresh()

    def check(self) -> None:
        """Refuse a problem in which a body is free to move. Collective."""
        self.mechanics.check()

    def advise(self) -> str:
        """What may be tried where no step succeeds, in words."""
        return self.mechanics.advise()

    def start(self, end: float) -> None:
        """Take over the committed state, if no step has begun yet. Collective."""
        self.mechanics.start(end)

    def begin(self) -> None:
        """Start the trial step that the state has begun. Collective."""
        self.mechanics.begin()

    def predict(self) -> None:
        """Start the search for equilibrium from where the last step leads."""
        self.mechanics.predict()

    def solve(self, line_search: str | None = None) -> Outcome:
        """Find equilibrium and temperature. Collective.

        Args:
            line_search: "l2", "bt" or "basic"; the solver's default if None. It is for the mechanics: heat is linear.

        Returns:
            The outcome of the mechanics, iterations summed over the passes; that of heat if this has failed.
        """
        previous: Outcome | None = None
        for _ in range(1 if self.iterate is None else PASSES):
            outcome = self.mechanics.solve(line_search)
            previous = outcome = outcome if previous is None else outcome.after(previous)
            if not outcome.converged:
                return outcome
            self.mechanics.evaluate()
            if not isfinite(self.mechanics.trial_audit.closure):
                return replace(outcome, converged=False, message="no admissible equilibrium")
            before = self.heat.temperature.value.x.array.copy()
            self.heat.begin()
            thermal = self.heat.solve()
            if not thermal.converged:
                return replace(thermal, message=f"heat: {thermal.message}")
            if self.iterate is None or self._change(before) <= self.iterate:
                return outcome
        return replace(outcome, converged=False, message=f"temperature not settled by {PASSES} passes")

    def _change(self, before: np.ndarray) -> float:
        """Largest change of temperature at a node. Collective."""
        change = np.abs(self.heat.temperature.value.x.array - before).max(initial=0.0)
        return float(self.state.mesh.comm.allreduce(change, op=MPI.MAX))

    def evaluate(self) -> None:
        """Heat flows and audit of heat; the mechanics was evaluated at the temperature it was solved at. Collective."""
        self.heat.evaluate()

    def damage_increment(self) -> float:
        """Largest growth of damage at a point in the trial step. Collective."""
        return self.mechanics.damage_increment()

    def watch(self) -> None:
        """Say in the verdict of the state what makes the trial step, which is accepted, questionable. Collective."""
        self.mechanics.watch()
        self.heat.watch()

    def diagnose(self) -> str:
        """After a failed solve: what is wrong and where, in words. Collective."""
        return "; ".join(words for part in (self.mechanics, self.heat) if (words := part.diagnose()))

    def record(self) -> dict[str, tuple[float, str]]:
        """Columns of the history row: name → (value, kind of quantity). Collective."""
        total = self._availability.record(self.mechanics.trial_audit, self.heat.trial_audit)
        return self.mechanics.record() | self.heat.record() | total
