"""The one balance of mechanics and heat: total energy, entropy, and available energy (docs/heat.md)."""

from collections.abc import Sequence
from math import nan

from cutsim.analysis.energy import EnergyAudit
from cutsim.base.terms import Columns
from cutsim.fields.temperature import Temperature
from cutsim.heat.audit import WORK, HeatAudit, HeatTerm


class Availability:
    """Energy E, entropy S and available energy V = E − T₀ S of all bodies and interfaces (thesis C.43–C.53).

    E changes by the work and the heat that are supplied from outside, whatever happens inside.  In a system that is
    left to itself S cannot fall, so that V never grows: it is the function by which Lyapunov's theorem shows stability.
    All are counted from the state in which this object is made; T₀ is the lowest absolute temperature there.

    Args:
        temperature: The temperature.
        terms: Terms of the heat balance.
    """

    def __init__(self, temperature: Temperature, terms: Sequence[HeatTerm]) -> None:
        self._terms = tuple(terms)
        self.reference = temperature.minimum() - temperature.absolute_zero
        self._start = self._entropy()

    def _entropy(self) -> float:
        # at absolute zero entropy has no bound
        return sum(term.held_entropy() for term in self._terms) if self.reference > 0 else nan

    def record(self, mechanics: EnergyAudit, heat: HeatAudit) -> Columns:
        """Columns of the history row. Collective.

        Args:
            mechanics: Audit of the trial step: stored and dissipated energy, the work of heat on the bodies.
            heat: Audit of heat of the trial step.
        """
        # what the mechanics calls dissipated is stored as heat, as far as it was given to the heat balance
        stored = sum(mechanics.entries.values()) + heat.entries["stored"]
        energy = stored - sum(heat.entries[name] for name in WORK) - mechanics.initial
        columns: Columns = {"total_energy": (energy, "energy")}
        if not self.reference > 0:
            return columns
        entropy = self._entropy() - self._start
        available = energy - self.reference * entropy
        return columns | {"total_entropy": (entropy, "entropy"), "available_energy": (available, "energy")}
