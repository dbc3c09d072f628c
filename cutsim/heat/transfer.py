"""Balance of heat of one step: the sum of the terms, and the audit of heat."""

from collections.abc import Mapping, Sequence
from itertools import chain, count
from typing import Any, Protocol, runtime_checkable

import numpy as np
from dolfinx import la
from numpy.typing import NDArray

from cutsim.base.checks import require
from cutsim.base.kinematics import Expr
from cutsim.base.signatures import checked
from cutsim.base.terms import Columns, offering
from cutsim.base.verdict import CLOSURE
from cutsim.fields.cells import Filling, check_disjoint
from cutsim.fields.temperature import Temperature
from cutsim.heat.audit import HeatAudit, HeatTerm
from cutsim.heat.boundary import PrescribedTemperature
from cutsim.solvers.balance import Balance
from cutsim.solvers.convergence import Criteria, Tolerances

#: Smallest turnover to which the closure of the audit refers, as a fraction of the heat of all bodies above absolute
#: zero. The tolerance of the solver, relative to that heat, then stays invisible while nothing happens.
SMALLEST_HEAT = 1e-6
#: The problem is linear: what is left is rounding.
TOLERANCES = Tolerances(rtol=1e-12)

# problems that live in one process must not share PETSc options
_prefixes = chain(["heat_"], (f"heat{n}_" for n in count(2)))


class HeatTransfer(Balance[HeatTerm, PrescribedTemperature]):
    """Heat conduction at a fixed displacement; alone it can be given to `cutsim.analysis.stepping.run`.

    Args:
        temperature: The temperature.
        terms: Bodies, interfaces, tools and loads; every cell needs a body.
        prescribed: Prescribed temperatures.
        petsc_options: PETSc options without prefix; they win over the presets.
        petsc_options_prefix: Prefix of all PETSc options of the problem, no other's; by default "heat_" for the first
            problem of a process, then "heat2_" and so on.
        tolerances: When the heat flows balance.

    Raises:
        ValueError: A node has no body, two bodies share a cell, two terms or prescribed temperatures share
            a name, or two prescribe different temperatures of one node.
    """

    @checked
    def __init__(
        self,
        temperature: Temperature,
        terms: Sequence[HeatTerm],
        prescribed: Sequence[PrescribedTemperature] = (),
        *,
        petsc_options: Mapping[str, Any] | None = None,
        petsc_options_prefix: str | None = None,
        tolerances: Tolerances = TOLERANCES,
    ) -> None:
        bodies = offering(terms, Storing)
        bare = _nodes_without(temperature, bodies)
        require("terms", [t.name for t in terms], bare == 0, f"a HeatBody for every cell ({bare} nodes have none)")
        check_disjoint(temperature.state.mesh, bodies)
        super().__init__(
            "heat",
            temperature.state,
            temperature.value,
            terms,
            prescribed,
            kind="prescribed temperatures",
            # heat capacity takes part, and prescribed temperatures may take no heat
            criteria=Criteria(tolerances, by_start=True),
            petsc_options=petsc_options,
            petsc_options_prefix=next(_prefixes) if petsc_options_prefix is None else petsc_options_prefix,
        )
        self.temperature, self.prescribed = temperature, tuple(prescribed)
        absolute = max(abs(temperature.maximum() - temperature.absolute_zero), 1.0)
        scale = SMALLEST_HEAT * absolute * sum(b.content for b in bodies)
        self._audit = self.state.memory.value("heat: audit", HeatAudit(scale=scale))

    @property
    def path(self) -> None:
        """None: heat needs time to go on."""

    @property
    def carriers(self) -> tuple[()]:
        """None: heat does not jump."""
        return ()

    @property
    def fields(self) -> Mapping[str, Expr]:
        """Fields of the solution for output, by name."""
        return {"temperature": self.temperature.value}

    @property
    def audit(self) -> HeatAudit:
        """Audit of heat of the committed state."""
        return self._audit.committed

    @property
    def trial_audit(self) -> HeatAudit:
        """Audit of heat including the trial step."""
        return self._audit.trial

    def check(self) -> None:
        """Nothing: with capacity there is always a temperature."""

    def advise(self) -> str:
        """Nothing is known."""
        return ""

    def start(self, end: float) -> None:
        """Nothing: no flow of heat is remembered from step to step."""

    def predict(self) -> None:
        """Nothing: the problem is linear, and found in one iteration from anywhere."""

    def evaluate(self) -> None:
        """Trial history, heat flows and audit of the trial temperature. Collective."""
        for term in self.terms:
            term.evaluate()
        self._residual.trial = self._out_of_balance()
        dt = float(self.state.dt.value)
        flows = [{"outflow": -self.reaction(p) * dt} for p in self.prescribed]
        self._audit.trial = self.audit.advance([*(t.heat() for t in self.terms), *flows])

    def damage_increment(self) -> float:
        """Heat damages nothing."""
        return 0.0

    def watch(self) -> None:
        """Say in the verdict what is questionable, such as an audit of heat that does not close. Collective."""
        super().watch()
        closure = abs(self.trial_audit.closure)
        if closure > CLOSURE:
            self.state.verdict.doubt("heat closure", f"{closure:.1%} of the heat is missing in the audit", closure)

    def diagnose(self) -> str:
        """After a failed solve: what is wrong and where, in words. Collective."""
        return f"temperatures from {self.temperature.minimum():.4g} to {self.temperature.maximum():.4g}"

    def record(self) -> Columns:
        """Columns of the history row: name → (value, kind of quantity). Collective."""
        columns = super().record()
        columns["temperature_min"] = (self.temperature.minimum(), "temperature")
        columns["temperature_max"] = (self.temperature.maximum(), "temperature")
        return columns | self.trial_audit.record()


@runtime_checkable
class Storing(Filling, Protocol):
    """Protocol of a body that gives unknowns their heat capacity.

    Attributes:
        dofs: Local dofs of the temperature that it has.
    """

    dofs: NDArray[np.int32]

    @property
    def content(self) -> float:
        """Heat capacity of the whole of it [energy/temperature]."""


def _nodes_without(temperature: Temperature, bodies: Sequence[Storing]) -> int:
    """Number of nodes that belong to no body. Collective."""
    index_map = temperature.space.dofmap.index_map
    marks = la.vector(index_map)
    for body in bodies:
        marks.array[body.dofs] = 1.0
    marks.scatter_reverse(la.InsertMode.add)
    bare = int(np.sum(marks.array[: index_map.size_local] == 0))
    return int(temperature.space.mesh.comm.allreduce(bare))
