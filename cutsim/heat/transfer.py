"""Heat transfer in one step: the sum of the terms, the solution for the temperature, and the audit of heat."""

from collections.abc import Mapping, Sequence
from itertools import chain, count
from typing import Any

import numpy as np
import ufl
from dolfinx import la
from numpy.typing import NDArray

from cutsim.base.checks import require
from cutsim.base.kinematics import Expr
from cutsim.base.signatures import checked
from cutsim.base.verdict import CLOSURE
from cutsim.fields.constraints import Constraints
from cutsim.fields.temperature import Temperature
from cutsim.heat.balance import HeatBalance, HeatTerm
from cutsim.heat.conduction import HeatBody
from cutsim.heat.loads import PrescribedTemperature
from cutsim.solvers.convergence import Criteria, Tolerances
from cutsim.solvers.iterations import Outcome
from cutsim.solvers.newton import NonlinearProblem
from cutsim.solvers.system import Structure

#: Smallest turnover to which the closure of the audit refers, as a fraction of the heat of all bodies above absolute
#: zero. The tolerance of the solver, relative to that heat, then stays invisible while nothing happens.
SMALLEST_HEAT = 1e-6
#: The problem is linear: what is left is rounding.
TOLERANCES = Tolerances(rtol=1e-12)

# problems that live in one process must not share PETSc options
_prefixes = chain(["heat_"], (f"heat{n}_" for n in count(2)))


class HeatTransfer:
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
        ValueError: A node has no body, two terms or prescribed temperatures share a name, or two prescribe different
            temperatures of one node.
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
        names = [t.name for t in terms] + [p.name for p in prescribed if p.name]
        bodies = [t for t in terms if isinstance(t, HeatBody)]
        bare = _nodes_without(temperature, bodies)
        require("terms", names, bare == 0, f"a HeatBody for every cell ({bare} nodes have none)")
        require("names", names, len(set(names)) == len(names), "different for all terms and prescribed temperatures")
        self.temperature, self.state = temperature, temperature.state
        self.terms, self.prescribed = tuple(terms), tuple(prescribed)
        self._constraints = Constraints(temperature.space, prescribed, "prescribed temperatures")
        self._constraints.check(self.state.time)
        self._parts: tuple[HeatTerm | PrescribedTemperature, ...] = (*terms, *prescribed)
        w = ufl.TestFunction(temperature.space)
        self.problem = NonlinearProblem(
            sum((t.residual(w) for t in terms), start=ufl.Form([])),
            temperature.value,
            bcs=[p.bc for p in prescribed],
            entity_maps={mesh: entities for t in terms for mesh, entities in t.entity_maps.items()},
            structure=Structure(all(t.symmetric for t in terms), [t for t in terms if t.assembles]),
            # heat capacity takes part, and prescribed temperatures may take no heat
            criteria=Criteria(tolerances, by_start=True),
            petsc_options=petsc_options,
            petsc_options_prefix=next(_prefixes) if petsc_options_prefix is None else petsc_options_prefix,
        )
        absolute = max(abs(temperature.maximum() - temperature.absolute_zero), 1.0)
        scale = SMALLEST_HEAT * absolute * sum(b.content for b in bodies)
        self.audit = self._trial_audit = HeatBalance(scale=scale)
        self._residual: NDArray[np.float64] = np.zeros(temperature.space.dofmap.index_map.size_local)
        self._residual_old = self._residual

    @property
    def corners(self) -> tuple[float, ...]:
        """Times at which a load has a kink."""
        return tuple(sorted({c for part in self._parts for c in part.corners}))

    @property
    def fields(self) -> Mapping[str, Expr]:
        """Fields of the solution for output, by name."""
        return {"temperature": self.temperature.value}

    @property
    def trial_audit(self) -> HeatBalance:
        """Audit of heat including the trial step."""
        return self._trial_audit

    def check(self) -> None:
        """Nothing: with capacity there is always a temperature."""

    def advise(self) -> str:
        """Nothing is known."""
        return ""

    def begin(self, time: float) -> None:
        """Start a trial step that ends at `time`; in a coupled step, after the mechanical part is evaluated."""
        self.state.begin(time)
        for part in self._parts:
            part.begin(time)
        self._constraints.check(time)

    def predict(self) -> None:
        """Nothing: the problem is linear, and found in one iteration from anywhere."""

    def solve(self, line_search: str | None = None) -> Outcome:
        """Find the temperature at the end of the step. Collective.

        Args:
            line_search: "l2", "bt" or "basic"; the solver's default if None.
        """
        return self.problem.solve(line_search)

    def evaluate(self) -> None:
        """Trial history, heat flows and audit of the trial temperature. Collective."""
        for term in self.terms:
            term.evaluate()
        residual = self.problem.residual()
        self._residual = residual.array_r.copy()
        residual.destroy()
        dt = float(self.state.dt.value)
        flows = [{"outflow": -self._constraints.reaction(p, self._residual) * dt} for p in self.prescribed]
        self._trial_audit = self.audit.advance([*(t.heat() for t in self.terms), *flows])

    def damage_increment(self) -> float:
        """Heat damages nothing."""
        return 0.0

    def watch(self) -> None:
        """Doubt books of heat that do not close. Collective."""
        closure = abs(self._trial_audit.closure)
        if closure > CLOSURE:
            self.state.verdict.doubt("heat closure", f"{closure:.1%} of the heat is missing in the audit", closure)

    def diagnose(self) -> str:
        """After a failed solve: what is wrong and where, in words. Collective."""
        return f"temperatures from {self.temperature.minimum():.4g} to {self.temperature.maximum():.4g}"

    def record(self) -> dict[str, tuple[float, str]]:
        """Columns of the history row: name → (value, kind of quantity). Collective."""
        columns: dict[str, tuple[float, str]] = {}
        for term in self.terms:
            columns |= term.record()
        for prescribed in self.prescribed:
            if prescribed.name:
                columns[f"{prescribed.name}_heat_flow"] = (
                    self._constraints.reaction(prescribed, self._residual),
                    "power",
                )
        columns["temperature_min"] = (self.temperature.minimum(), "temperature")
        columns["temperature_max"] = (self.temperature.maximum(), "temperature")
        return columns | self._trial_audit.record()

    def rollback(self) -> None:
        """Give the trial step up: temperature, constants and interface temperatures as before, bit for bit."""
        self.state.rollback()
        self.temperature.rollback()
        for part in self._parts:
            part.rollback()
        self._trial_audit, self._residual = self.audit, self._residual_old

    def commit(self) -> None:
        """Adopt the trial step."""
        for term in self.terms:
            term.commit()
        self.temperature.commit()
        self.state.commit()
        self.audit, self._residual_old = self._trial_audit, self._residual


def _nodes_without(temperature: Temperature, bodies: Sequence[HeatBody]) -> int:
    """Number of nodes that belong to no body. Collective."""
    index_map = temperature.space.dofmap.index_map
    marks = la.vector(index_map)
    for body in bodies:
        marks.array[body.dofs] = 1.0
    marks.scatter_reverse(la.InsertMode.add)
    bare = int(np.sum(marks.array[: index_map.size_local] == 0))
    return int(temperature.space.mesh.comm.allreduce(bare))
