"""The mechanical problem of one step: adds the terms up, derives the tangent, keeps the books of a trial step."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import chain, count
from typing import Any

import numpy as np
import ufl
from dolfinx import cpp, la
from numpy.typing import NDArray

from cutsim.assembly import global_dot
from cutsim.checks import require
from cutsim.energy import EnergyAudit
from cutsim.interface import Crack
from cutsim.loads import Support
from cutsim.solver import NonlinearProblem, Outcome
from cutsim.state import State
from cutsim.terms import Term

#: Uzawa augmentations allowed in one step.
AUGMENTATIONS = 30

# problems that live in one process must not share PETSc options
_prefixes = chain(["cut_"], (f"cut{n}_" for n in count(2)))


class Mechanics:
    """Quasi-static equilibrium of solids, cracks, tools and loads.

    Args:
        state: Displacement and time.
        terms: Terms of the virtual work.
        supports: Prescribed displacements.
        petsc_options: PETSc options without prefix; they win over the presets.
        petsc_options_prefix: Prefix of all PETSc options of the problem, no other's; by default "cut_" for the first
            problem of a process, then "cut2_" and so on.
        rtol: Residual tolerance relative to the reactions.

    Raises:
        ValueError: There is no term, or two terms or supports share a name.
    """

    def __init__(
        self,
        state: State,
        terms: Sequence[Term],
        supports: Sequence[Support] = (),
        *,
        petsc_options: Mapping[str, Any] | None = None,
        petsc_options_prefix: str | None = None,
        rtol: float = 1e-8,
    ) -> None:
        names = [t.name for t in terms] + [s.name for s in supports if s.name]
        require("terms", len(terms), len(terms) > 0, "at least one term")
        require("names", names, len(set(names)) == len(names), "different for all terms and supports")
        self.state, self.terms, self.supports = state, tuple(terms), tuple(supports)
        self._parts: tuple[Term | Support, ...] = (*terms, *supports)
        v = ufl.TestFunction(state.V)
        cracks = [t for t in terms if isinstance(t, Crack)]
        self.problem = NonlinearProblem(
            sum((t.residual(v) for t in terms), start=ufl.Form([])),
            state.u,
            bcs=[s.bc for s in supports],
            entity_maps={mesh: entities for t in terms for mesh, entities in t.entity_maps.items()},
            symmetric=all(t.symmetric for t in terms),
            interface_dofs=self._interface_nodes(cracks) if cracks else None,
            petsc_options=petsc_options,
            petsc_options_prefix=next(_prefixes) if petsc_options_prefix is None else petsc_options_prefix,
            rtol=rtol,
        )
        self.audit = self._trial_audit = EnergyAudit(scale=max((c.facet_energy for c in cracks), default=0.0))
        self._residual: NDArray[np.float64] = np.zeros(len(state.increment))
        self._residual_old: NDArray[np.float64] = self._residual

    @property
    def corners(self) -> tuple[float, ...]:
        """Times at which a path, load or prescribed velocity has a kink."""
        return tuple(sorted({c for part in self._parts for c in part.corners}))

    def begin(self, time: float) -> None:
        """Start a trial step that ends at `time`: constants move, the displacement stays."""
        self.state.begin(time)
        for part in self._parts:
            part.begin(time)

    def solve(self, line_search: str | None = None) -> Outcome:
        """Find equilibrium, with contact augmentations. Collective.

        Args:
            line_search: "l2", "bt" or "basic"; the solver's default if None.
        """
        outcome = self.problem.solve(line_search)
        for _ in range(AUGMENTATIONS):
            # every term takes part: a list, because any() would stop at the first
            if not outcome.converged or not any([t.augment() for t in self.terms]):
                break
            again = self.problem.solve(line_search)
            outcome = replace(
                again,
                iterations=outcome.iterations + again.iterations,
                linear_iterations=outcome.linear_iterations + again.linear_iterations,
            )
        else:
            message = f"contact not settled by {AUGMENTATIONS} augmentations"
            outcome = replace(outcome, converged=False, message=message)
        return outcome

    def evaluate(self) -> None:
        """Trial history, energies and reactions of the converged trial state. Collective."""
        for term in self.terms:
            term.evaluate()
        residual = self.problem.residual()
        self._residual = residual.array_r.copy()
        residual.destroy()
        mean = 0.5 * (self._residual + self._residual_old)
        work = global_dot(self.state.mesh.comm, mean, self.state.increment)
        work += sum(t.external_work() for t in self.terms)
        self._trial_audit = self.audit.advance(work, [t.energies() for t in self.terms])

    @property
    def trial_audit(self) -> EnergyAudit:
        """Energy audit including the trial step."""
        return self._trial_audit

    def damage_increment(self) -> float:
        """Largest growth of damage at a point in the trial step. Collective."""
        return max(t.damage_increment() for t in self.terms)

    def diagnose(self) -> str:
        """After a failed solve: what is wrong and where, in words. Collective."""
        return "; ".join(words for t in self.terms if (words := t.diagnose()))

    def reaction(self, support: Support) -> float:
        """Reaction of a support along its component in the trial state [force]. Collective."""
        return support.reaction(self._residual)

    def record(self) -> dict[str, tuple[float, str]]:
        """Columns of the history row: name → (value, kind of quantity). Collective."""
        columns: dict[str, tuple[float, str]] = {}
        for term in self.terms:
            columns |= term.record()
        for support in self.supports:
            if support.name:
                columns[f"{support.name}_displacement"] = (support.displacement, "length")
                columns[f"{support.name}_force"] = (self.reaction(support), "force")
        return columns | self._trial_audit.record()

    def rollback(self) -> None:
        """Give the trial step up: displacement, constants and multipliers as before, bit for bit."""
        self.state.rollback()
        for term in self.terms:
            term.rollback()
        for support in self.supports:
            support.begin(self.state.time)
        self._trial_audit, self._residual = self.audit, self._residual_old

    def commit(self) -> None:
        """Adopt the trial step."""
        for term in self.terms:
            term.commit()
        self.state.commit()
        self.audit, self._residual_old = self._trial_audit, self._residual

    def _interface_nodes(self, cracks: Sequence[Crack]) -> NDArray[np.int32]:
        """Owned nodes on both faces of all cracks."""
        dofmap, tdim = self.state.V.dofmap, self.state.mesh.topology.dim
        facets = cpp.mesh.cell_num_entities(self.state.mesh.topology.cell_type, tdim - 1)
        closure = [dofmap.dof_layout.entity_closure_dofs(tdim - 1, f) for f in range(facets)]
        marks = la.vector(dofmap.index_map, 1)
        for crack in cracks:
            for cell, facet in crack.entities.reshape(-1, 2):
                marks.array[dofmap.cell_dofs(cell)[closure[facet]]] = 1.0
        marks.scatter_reverse(la.InsertMode.add)
        return np.flatnonzero(marks.array[: dofmap.index_map.size_local]).astype(np.int32)
