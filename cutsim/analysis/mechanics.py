"""Mechanics of one step: the sum of the terms, the tangent, and the energy audit of a trial step."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import chain, count
from typing import Any, Literal

import numpy as np
import ufl
from dolfinx import cpp, la
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.analysis.energy import EnergyAudit
from cutsim.analysis.mobility import extent, free_motion
from cutsim.base.assembly import global_dot
from cutsim.base.checks import require
from cutsim.base.kinematics import Expr
from cutsim.base.signatures import checked
from cutsim.base.terms import Term
from cutsim.base.verdict import CLOSURE
from cutsim.bodies.inertia import Inertia
from cutsim.bodies.loads import Load, Support
from cutsim.bodies.schemes import TRAPEZOIDAL, Scheme
from cutsim.bodies.solid import Solid
from cutsim.fields.constraints import Constraints
from cutsim.fields.crack_checks import doubt_gaps
from cutsim.fields.state import State
from cutsim.fields.twins import unjoined
from cutsim.interface.crack import Crack
from cutsim.pairs.surface_pair import SurfacePair
from cutsim.solvers.convergence import TOLERANCES, Criteria, Tolerances
from cutsim.solvers.iterations import Outcome
from cutsim.solvers.newton import NonlinearProblem
from cutsim.solvers.system import Structure

# displacement over the size of the mesh at which a solve is given up
_RUNAWAY = 100.0
# difference of two prescribed displacements over that size that is none
_ROUNDING = 1e-12
# growth of the turnover in a step from which on nothing is said aloud: the books have just begun
_BEGUN = 2.0
#: What a viscosity may take of the energy that is lost.
VISCOUS = 0.01
#: Uzawa augmentations allowed in one step.
AUGMENTATIONS = 30

# problems that live in one process must not share PETSc options
_prefixes = chain(["cut_"], (f"cut{n}_" for n in count(2)))


class Mechanics:
    """Mechanical problem of solids, cracks, tools and loads, quasi-static or dynamic.

    Args:
        state: Displacement and time.
        terms: Terms of the virtual work.
        supports: Prescribed displacements.
        analysis: "quasi-static" or "dynamic"; the latter adds the inertia of the solids, each of which needs a density.
        scheme: Time integration of a dynamic analysis; the trapezoidal rule by default.
        mass: "consistent" or "lumped", see `cutsim.bodies.inertia`.
        petsc_options: PETSc options without prefix; they win over the presets.
        petsc_options_prefix: Prefix of all PETSc options of the problem, no other's; by default "cut_" for the first
            problem of a process, then "cut2_" and so on.
        tolerances: When a state is in equilibrium, by residual and, if asked for, displacement and energy.

    Attributes:
        inertia: Velocity, acceleration and momentum; None if quasi-static.

    Raises:
        ValueError: There is no term, two terms or supports share a name, two supports prescribe different displacements
            of one node, or a dynamic analysis has no solid or one without density.
    """

    @checked
    def __init__(
        self,
        state: State,
        terms: Sequence[Term],
        supports: Sequence[Support] = (),
        *,
        analysis: Literal["quasi-static", "dynamic"] = "quasi-static",
        scheme: Scheme = TRAPEZOIDAL,
        mass: Literal["consistent", "lumped"] = "consistent",
        petsc_options: Mapping[str, Any] | None = None,
        petsc_options_prefix: str | None = None,
        tolerances: Tolerances = TOLERANCES,
    ) -> None:
        names = [t.name for t in terms] + [s.name for s in supports if s.name]
        require("terms", len(terms), len(terms) > 0, "at least one term")
        require("names", names, len(set(names)) == len(names), "different for all terms and supports")
        self.state, self._static, self.supports = state, tuple(terms), tuple(supports)
        solids = [t for t in terms if isinstance(t, Solid)]
        self.inertia = Inertia(state, solids, scheme, mass) if analysis == "dynamic" else None
        self.terms: tuple[Term, ...] = self._static if self.inertia is None else (*terms, self.inertia)
        size = extent(state.mesh.comm, state.mesh.geometry.x)
        self._constraints = Constraints(state.V, supports, "supports", _ROUNDING * size)
        self._constraints.check(state.time)
        self._parts: tuple[Term | Support, ...] = (*self.terms, *supports)
        if cracks := [t for t in terms if isinstance(t, Crack)]:
            _check_one_law(state, cracks)
            facets = np.unique(np.concatenate([c.points.facets for c in cracks])).astype(np.int32)
            doubt_gaps(state.mesh, facets, " and ".join(c.name for c in cracks), state.verdict)
        v = ufl.TestFunction(state.V)
        interfaces = [t for t in terms if isinstance(t, Crack | SurfacePair)]
        self.problem = NonlinearProblem(
            sum((t.residual(v) for t in self.terms), start=ufl.Form([])),
            state.u,
            bcs=[s.bc for s in supports],
            entity_maps={mesh: entities for t in terms for mesh, entities in t.entity_maps.items()},
            structure=Structure(
                symmetric=all(t.symmetric for t in terms),
                terms=[t for t in terms if t.assembles],
                multipliers=[m for t in terms for m in t.multipliers],
                interface_dofs=self._interface_nodes(interfaces) if interfaces else None,
            ),
            criteria=Criteria(tolerances, largest=_RUNAWAY * size, by_start=self.inertia is not None),
            petsc_options=petsc_options,
            petsc_options_prefix=next(_prefixes) if petsc_options_prefix is None else petsc_options_prefix,
        )
        self.audit = self._trial_audit = EnergyAudit(scale=max((i.facet_energy for i in interfaces), default=0.0))
        self._apart = unjoined(state.mesh, [t.facets for t in terms if isinstance(t, SurfacePair)])
        if self._apart:
            state.verdict.doubt("mesh", f"mesh: {self._apart}")
        self._begun = self._moved = False
        self._residual: NDArray[np.float64] = np.zeros(len(state.increment))
        self._residual_old: NDArray[np.float64] = self._residual
        self._rate_forces = self._rate_forces_old = np.zeros_like(self._residual)

    @property
    def fields(self) -> Mapping[str, Expr]:
        """Fields of the terms for output, by name, such as the velocity of a dynamic analysis."""
        return {name: field for t in self.terms for name, field in t.fields.items()}

    @property
    def corners(self) -> tuple[float, ...]:
        """Times at which a path, load or prescribed velocity has a kink."""
        return tuple(sorted({c for part in self._parts for c in part.corners}))

    def check(self) -> None:
        """Refuse a static problem in which a body is free to move. Collective.

        Raises:
            ValueError: A piece of a body can move as a rigid body, and nothing resists at the committed state.
        """
        if self.inertia is not None:
            return
        bodies = {t.name: t.cells for t in self.terms if isinstance(t, Solid)}
        motion = free_motion(self.state, self.problem.fixed, self.problem.resistance, bodies)
        if motion is not None:
            raise ValueError(
                f"{motion}: neither a support nor a bond nor a closed contact holds it. Add a Support, let the "
                "surfaces overlap a little where a contact is to hold it, or use analysis='dynamic'"
                + (f". In the mesh {self._apart}" if self._apart else "")
            )

    def begin(self, time: float) -> None:
        """Start a trial step that ends at `time`. Collective.

        Constants move. The displacement stays, or with inertia goes on at the present velocity.
        """
        if self.inertia is not None and not self.inertia.started:
            self._start(self.inertia, time)
        elif self.inertia is None and not self._begun:
            self._take_over()
        self._begun = True
        self.state.begin(time)
        for part in self._parts:
            part.begin(time)
        self._constraints.check(time)
        if self.inertia is not None:
            self.problem.known[:] = self.inertia.history(self._residual_old)

    def predict(self) -> None:
        """Start the search for equilibrium where the last step leads; with inertia the velocity does so already."""
        if self.inertia is None:
            self.state.predict()

    def _take_over(self) -> None:
        """Forces and energies of a static state that others have loaded, or that was set."""
        u = self.state.u_old.x.array
        if self.state.mesh.comm.allreduce(bool(u.any()), MPI.LOR):
            self._residual = self._residual_old = self._out_of_balance()
            self.audit = self._trial_audit = self.audit.start([t.energies() for t in self.terms])

    def _start(self, inertia: Inertia, end: float) -> None:
        """Motion, forces and energies at the start of a dynamic analysis whose first step ends at a time."""
        for term in self._static:
            term.evaluate()
            term.commit()
        for support in self.supports:
            inertia.prescribe(support.dofs, *support.rates(self.state.time, end))
        static = self._out_of_balance()
        self._residual = self._residual_old = inertia.start(static, self.problem.bcs, self.problem.fixed)
        self.audit = self._trial_audit = self.audit.start([t.energies() for t in self.terms])

    def _out_of_balance(self) -> NDArray[np.float64]:
        residual = self.problem.residual()
        forces = residual.array_r.copy()
        residual.destroy()
        return forces

    def solve(self, line_search: str | None = None) -> Outcome:
        """Find equilibrium, with contact augmentations, that no term objects to. Collective.

        Args:
            line_search: "l2", "bt" or "basic"; the solver's default if None.
        """
        outcome = self.problem.solve(line_search)
        for _ in range(AUGMENTATIONS):
            # every term takes part: a list, because any() would stop at the first
            if not outcome.converged or not any([t.augment() for t in self.terms]):
                break
            outcome = self.problem.solve(line_search).after(outcome)
        else:
            message = f"contact not settled by {AUGMENTATIONS} augmentations"
            outcome = replace(outcome, converged=False, message=message)
        if outcome.converged and (objections := [why for t in self.terms if (why := t.objection())]):
            outcome = replace(outcome, converged=False, message="; ".join(objections))
        return outcome

    def evaluate(self) -> None:
        """Trial history, energies and reactions of the converged trial state. Collective."""
        for term in self.terms:
            term.evaluate()
        fixed = self.problem.fixed
        self._residual = self._out_of_balance()
        if self.inertia is not None:
            self._residual = self.inertia.balance(self._residual, self._residual_old, ~fixed)
        rates = [forces for t in self._static if (forces := t.rate_forces()) is not None]
        self._rate_forces = np.sum([np.zeros_like(self._residual), *rates], axis=0)
        mean = 0.5 * (self._residual + self._residual_old)
        if self._jerks():  # what follows the velocity has its value at the end of the step from its beginning on
            mean += 0.5 * (self._rate_forces - self._rate_forces_old)
        work = global_dot(self.state.mesh.comm, mean[fixed], self.state.increment[fixed])
        work += sum(t.external_work() for t in self.terms)
        self._trial_audit = self.audit.advance(work, [t.energies() for t in self.terms])

    def _jerks(self) -> bool:
        """Whether prescribed velocities may jump at the start of the step: at rest before it, or at a corner."""
        return not self._moved or self.state.time_old in self.corners

    @property
    def trial_audit(self) -> EnergyAudit:
        """Energy audit including the trial step."""
        return self._trial_audit

    def damage_increment(self) -> float:
        """Largest growth of damage at a point in the trial step. Collective."""
        return max(t.damage_increment() for t in self.terms)

    def watch(self) -> None:
        """Say in the verdict of the state what makes the trial step, which is accepted, questionable. Collective."""
        for term in self.terms:
            term.watch()
        self._watch_books()

    def _watch_books(self) -> None:
        """Doubt books that do not close, and a viscosity that takes part in what is lost."""
        verdict, audit, entries = self.state.verdict, self._trial_audit, self._trial_audit.entries
        verdict.withdraw("closure")
        if audit.worst_closure > CLOSURE:
            words = f"{audit.worst_closure:.1%} of the energy is missing in the audit: smaller steps are needed"
            verdict.suppose("closure", words, aloud=audit.scale < _BEGUN * self.audit.scale)
        lost = entries["fracture"] + entries["friction"]
        viscous = sum(t.viscous_work for t in self.terms if isinstance(t, Solid))
        verdict.withdraw("viscosity")
        if lost > 0 and viscous > VISCOUS * (lost + viscous):
            # before anything breaks it is all of it: what counts is how much it is in the end
            share = viscous / (lost + viscous)
            verdict.suppose("viscosity", f"the viscosity takes {share:.1%} of the energy that is lost")

    def diagnose(self) -> str:
        """After a failed solve: what is wrong and where, in words. Collective."""
        return "; ".join(words for t in self.terms if (words := t.diagnose()))

    def advise(self) -> str:
        """What may be tried where no step succeeds, in words; empty if nothing is known."""
        loads = [t.name for t in self.terms if isinstance(t, Load)]
        if not loads or self.inertia is not None:
            return ""
        return (
            f"there may be no equilibrium under more of {', '.join(loads)} (a limit point): prescribe a displacement "
            "instead of the load, or use analysis='dynamic'"
        )

    def reaction(self, support: Support) -> float:
        """Reaction of a support along its direction in the trial state [force]. Collective."""
        return support.sign * self._constraints.reaction(support, self._residual)

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
        self._rate_forces = self._rate_forces_old

    def commit(self) -> None:
        """Adopt the trial step."""
        for term in self.terms:
            term.commit()
        self.state.commit()
        self.audit, self._residual_old = self._trial_audit, self._residual
        self._rate_forces_old, self._moved = self._rate_forces, True

    def _interface_nodes(self, interfaces: Sequence[Crack | SurfacePair]) -> NDArray[np.int32]:
        """Owned nodes on both faces of all cracks and pairs of surfaces."""
        dofmap, tdim = self.state.V.dofmap, self.state.mesh.topology.dim
        facets = cpp.mesh.cell_num_entities(self.state.mesh.topology.cell_type, tdim - 1)
        closure = [dofmap.dof_layout.entity_closure_dofs(tdim - 1, f) for f in range(facets)]
        marks = la.vector(dofmap.index_map, 1)
        for interface in interfaces:
            for cell, facet in interface.entities.reshape(-1, 2):
                marks.array[dofmap.cell_dofs(cell)[closure[facet]]] = 1.0
        marks.scatter_reverse(la.InsertMode.add)
        return np.flatnonzero(marks.array[: dofmap.index_map.size_local]).astype(np.int32)


def _check_one_law(state: State, cracks: Sequence[Crack]) -> None:
    """Refuse two cracks on one facet, whose laws would add up. Collective."""
    for i, one in enumerate(cracks):
        for other in cracks[i + 1 :]:
            both = state.mesh.comm.allreduce(len(np.intersect1d(one.points.facets, other.points.facets)))
            if both:
                raise ValueError(f"cracks {one.name!r} and {other.name!r} share {both} facets: each facet has one law")
