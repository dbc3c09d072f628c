"""Energy audit: external work against stored and dissipated energy (docs/theory.md §6)."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

from cutsim.base.checks import require
from cutsim.base.terms import ENTRIES, STORED


@dataclass(frozen=True)
class EnergyAudit:
    """Energy audit since the start of a run [energy].

    External work is summed from reactions and loads (trapezoidal rule); stored energies are functions of the state;
    dissipated ones are summed from the tractions of the residual.  They are computed independently of each other, so
    that their difference says how well the steps resolve the process.

    Attributes:
        external: Work of supports, loads and tools.
        initial: Energy at the start, such as that of an initial velocity.
        entries: The other side, `cutsim.base.terms.ENTRIES`; an entry to which no term contributes stays zero.
        scale: Reference of the relative closure: the largest turnover so far, and at least what the audit starts with
            (`cutsim.analysis.mechanics` takes the energy that breaks one facet, the least a cracked mesh can resolve).
        missed: The largest amount so far by which the two sides differ.
    """

    external: float = 0.0
    initial: float = 0.0
    entries: Mapping[str, float] = field(default_factory=lambda: dict.fromkeys(ENTRIES, 0.0))
    scale: float = 0.0
    missed: float = 0.0

    def start(self, energies: Iterable[Mapping[str, float]]) -> "EnergyAudit":
        """Audit of a state that starts with energy; arguments as `advance`."""
        audit = self.advance(0.0, energies)
        return replace(audit, initial=sum(audit.entries.values()), missed=self.missed)

    def advance(self, work: float, energies: Iterable[Mapping[str, float]]) -> "EnergyAudit":
        """Audit after a step.

        Args:
            work: External work of the step.
            energies: Contributions of the terms, totals since the start.

        Raises:
            ValueError: A contribution is no entry of the audit.
        """
        entries = dict.fromkeys(ENTRIES, 0.0)
        for contribution in energies:
            for name, value in contribution.items():
                require("name of an energy", name, name in entries, "one of " + ", ".join(ENTRIES))
                entries[name] += value
        external = self.external + work
        turnover = max(abs(external), sum(abs(v) for v in entries.values()))
        after = replace(self, external=external, entries=entries, scale=max(self.scale, turnover))
        return replace(after, missed=max(self.missed, abs(after.gap)))

    @property
    def stored(self) -> float:
        """What bodies, bonds and contacts hold [energy]."""
        return sum(self.entries[name] for name in STORED)

    @property
    def gap(self) -> float:
        """What is missing: initial energy + external work − sum of the entries [energy]."""
        return self.initial + self.external - sum(self.entries.values())

    @property
    def freed(self) -> float:
        """What bodies, bonds and contacts do not hold: what is lost by now, or in motion [energy]."""
        return sum(value for name, value in self.entries.items() if name not in STORED) + self.entries["kinetic"]

    @property
    def closure(self) -> float:
        """What is missing over the largest turnover so far [–]."""
        return self.gap / self.scale if self.scale > 0 else 0.0

    @property
    def worst_closure(self) -> float:
        """What was missing at the worst, relative to the largest turnover: a poor start counts little later on [–]."""
        return self.missed / self.scale if self.scale > 0 else 0.0

    def record(self) -> dict[str, tuple[float, str]]:
        """Columns of the history row: name → (value, kind of quantity)."""
        columns = {"work_external": (self.external, "energy"), "energy_initial": (self.initial, "energy")}
        columns |= {f"energy_{name}": (value, "energy") for name, value in self.entries.items()}
        return columns | {"energy_closure": (self.closure, "one")}
