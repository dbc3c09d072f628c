"""Terms of the heat balance, and the audit of heat (docs/theory.md §3.4)."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

from cutsim.base.terms import Term
from cutsim.fields.temperature import Temperature

#: Entries of the heat audit: where heat comes from, and what becomes of it.
GAINED = ("friction", "fracture", "deformation", "source", "inflow")
#: What comes from the work of the mechanics.
WORK = ("friction", "fracture", "deformation")
SPENT = ("stored", "outflow")


class HeatTerm(Term):
    """Term of the heat balance; `residual` is tested with a temperature and is heat going in minus coming out.

    Args:
        temperature: The temperature.
        name: Name in messages and columns of the history.
    """

    def __init__(self, temperature: Temperature, name: str) -> None:
        self.temperature, self.state, self.name = temperature, temperature.state, name

    def heat(self) -> dict[str, float]:
        """Heat of the trial step by entry of the audit [energy]; a negative outflow is an inflow. Collective."""
        return {}

    def held_entropy(self) -> float:
        """Entropy that it holds, in the trial state [energy/temperature]. Collective."""
        return 0.0


@dataclass(frozen=True)
class HeatAudit:
    """Audit of heat since the start of a run [energy].

    Attributes:
        entries: Heat from friction, fracture, deformation and sources, heat that has come in through boundaries and
            tools; heat stored in bodies and interfaces, and heat that has left through boundaries and tools.
        scale: Reference of the relative closure: the largest turnover so far, and at least what the audit starts with.
    """

    entries: Mapping[str, float] = field(default_factory=lambda: dict.fromkeys((*GAINED, *SPENT), 0.0))
    scale: float = 0.0

    def advance(self, heats: Iterable[Mapping[str, float]]) -> "HeatAudit":
        """Audit after a step.

        Args:
            heats: Contributions of the terms to the step.
        """
        entries = dict(self.entries)
        for contribution in heats:
            for name, value in contribution.items():
                inward = name == "outflow" and value < 0
                entries["inflow" if inward else name] += abs(value) if inward else value
        turnover = max(sum(abs(entries[name]) for name in names) for names in (GAINED, SPENT))
        return replace(self, entries=entries, scale=max(self.scale, turnover))

    @property
    def gap(self) -> float:
        """What is missing: heat gained − stored − left [energy]."""
        return sum(self.entries[name] for name in GAINED) - sum(self.entries[name] for name in SPENT)

    @property
    def freed(self) -> float:
        """Nothing: heat is only exchanged [energy]."""
        return 0.0

    @property
    def closure(self) -> float:
        """What is missing over the largest turnover so far [–]."""
        return self.gap / self.scale if self.scale > 0 else 0.0

    def record(self) -> dict[str, tuple[float, str]]:
        """Columns of the history row: name → (value, kind of quantity)."""
        columns = {f"heat_{name}": (value, "energy") for name, value in self.entries.items()}
        return columns | {"heat_closure": (self.closure, "one")}
