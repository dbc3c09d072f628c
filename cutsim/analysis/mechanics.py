"""Balance of momentum of one step: the sum of the terms, and the energy audit."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, partial
from itertools import chain, count
from typing import Any, Literal

import numpy as np
from dolfinx import cpp, la
from numpy.typing import NDArray

from cutsim.analysis.brake import Brake
from cutsim.analysis.carriers import Carrier
from cutsim.analysis.distortions import Distortions
from cutsim.analysis.doubts import doubt_audit, doubt_way_back, warn_of_jump
from cutsim.analysis.energy import EnergyAudit
from cutsim.analysis.equilibrium_path import EquilibriumPath
from cutsim.analysis.jump_dynamics import JumpDynamics
from cutsim.analysis.mobility import extent
from cutsim.analysis.motion import Dynamic, Motion, QuasiStatic
from cutsim.base.assembly import global_dot
from cutsim.base.checks import require
from cutsim.base.signatures import checked
from cutsim.base.terms import (
    Augmenting,
    Body,
    Bonded,
    Columns,
    Cushioned,
    Damaging,
    Energetic,
    Interface,
    Joining,
    Loading,
    Objecting,
    Observer,
    RateDependent,
    Regularised,
    Term,
    offering,
    with_companions,
)
from cutsim.bodies.inertia import Inertia
from cutsim.bodies.loads import Support
from cutsim.bodies.schemes import TRAPEZOIDAL, Scheme
from cutsim.fields.cells import check_disjoint
from cutsim.fields.crack_checks import check_cracks
from cutsim.fields.state import State
from cutsim.fields.twins import unjoined
from cutsim.solvers.balance import Balance
from cutsim.solvers.convergence import TOLERANCES, Criteria, Tolerances
from cutsim.solvers.iterations import Outcome
from cutsim.tools.left_out import tell_left_out

# displacement over the size of the mesh at which a solve is given up
_RUNAWAY = 100.0
# difference of two prescribed displacements over that size that is none
_ROUNDING = 1e-12
#: Uzawa augmentations allowed in one step.
AUGMENTATIONS = 30

# problems that live in one process must not share PETSc options
_prefixes = chain(["cut_"], (f"cut{n}_" for n in count(2)))


class Mechanics(Balance[Term, Support]):
    """Mechanical problem of solids, cracks, tools and loads, quasi-static or dynamic.

    Args:
        state: Displacement and time.
        terms: Terms of the virtual work.
        supports: Prescribed displacements.
        observers: What watches the terms without adding to the balance; evaluated after them.
        analysis: "quasi-static" or "dynamic"; the latter adds the inertia of the solids, each of which needs a density.
        scheme: Time integration of a dynamic analysis, and of machines with a mass; the trapezoidal rule by default.
        mass: "consistent" or "lumped", see `cutsim.bodies.inertia`.
        petsc_options: PETSc options without prefix; they win over the presets.
        petsc_options_prefix: Prefix of all PETSc options of the problem, no other's; by default "cut_" for the first
            problem of a process, then "cut2_" and so on.
        tolerances: When a state is in equilibrium, by residual and, if asked for, displacement and energy.

    Attributes:
        supports: Prescribed displacements.
        motion: What a dynamic analysis adds.
        carriers: What may carry a run across a jump; with inertia nothing has to.

    Raises:
        ValueError: There is no term, two terms or supports share a name, two solids share a cell, two supports
            prescribe different displacements of one node, or a dynamic analysis has no solid or one without density.
    """

    @checked
    def __init__(
        self,
        state: State,
        terms: Sequence[Term],
        supports: Sequence[Support] = (),
        *,
        observers: Sequence[Observer] = (),
        analysis: Literal["quasi-static", "dynamic"] = "quasi-static",
        scheme: Scheme = TRAPEZOIDAL,
        mass: Literal["consistent", "lumped"] = "consistent",
        petsc_options: Mapping[str, Any] | None = None,
        petsc_options_prefix: str | None = None,
        tolerances: Tolerances = TOLERANCES,
    ) -> None:
        require("terms", len(terms), len(terms) > 0, "at least one term")
        terms = with_companions(terms)
        self.supports, self._observers = tuple(supports), tuple(observers)
        self.motion: Motion = QuasiStatic(state, terms, scheme)
        if analysis == "dynamic":
            self.motion = Dynamic(Inertia(state, offering(terms, Body), scheme, mass), terms, supports)
        interfaces, size = offering(terms, Interface), extent(state.mesh.comm, state.mesh.geometry.x)
        _check_places(state, terms)
        super().__init__(
            "mechanics",
            state,
            state.u,
            terms if self.inertia is None else [*terms, self.inertia],
            supports,
            kind="supports",
            rounding=_ROUNDING * size,
            interface_dofs=_interface_nodes(state, interfaces) if interfaces else None,
            criteria=Criteria(tolerances, largest=_RUNAWAY * size, by_start=self.inertia is not None),
            petsc_options=petsc_options,
            petsc_options_prefix=next(_prefixes) if petsc_options_prefix is None else petsc_options_prefix,
        )
        self._apart = unjoined(state.mesh, [t.facets for t in offering(terms, Joining)])
        if self._apart:
            state.verdict.doubt("mesh", f"mesh: {self._apart}")
        audit, rest = EnergyAudit(scale=max((i.facet_energy for i in interfaces), default=0.0)), 0 * state.increment
        self._audit = state.memory.value("mechanics: audit", audit)
        self._rate_forces = state.memory.value("mechanics: rate forces", rest, places=self._residual.places)
        static = self.inertia is None
        kinds: tuple[type[Brake], type[JumpDynamics]] = (Brake, JumpDynamics)
        self.carriers: tuple[Carrier, ...] = tuple(kind(self.problem, state, terms) for kind in kinds if static)
        self._resisted = state.memory.value("mechanics: viscous work, and what is not set free by the body", (0.0, 0.0))
        self._distortions = Distortions(state, terms)
        self._begun, self._moved = (state.memory.value(f"mechanics: {what}", False) for what in ("begun", "moved"))

    @property
    def inertia(self) -> Inertia | None:
        """Velocity, acceleration and momentum; None if quasi-static."""
        return self.motion.inertia

    def check(self) -> None:
        """Refuse a static problem in which a body is free to move. Collective.

        Raises:
            ValueError: A piece of a body can move as a rigid body, and nothing resists at the committed state.
        """
        self.motion.check(self.problem, self._apart)

    def start(self, end: float) -> None:
        """Take over the committed state, if no step has begun yet. Collective.

        Args:
            end: Time at which the first step ends.
        """
        if self._begun.committed:
            return
        self._begun.set(True)
        forces = self.motion.start(self.problem, self._out_of_balance, end)
        if forces is not None:
            self._residual.set(forces)
            self._audit.set(self.audit.start(self._energies()))

    def begin(self) -> None:
        """Start the trial step that the state has begun. Collective.

        Constants move. The displacement stays, or with inertia goes on at the present velocity.
        """
        # at rest before the step, or at a corner
        self.state.jerks = not self._moved.committed or self.state.time_old in self.corners
        super().begin()
        self.motion.begin()
        self.problem.known[:] = self.motion.known(self._residual.committed)
        self.problem.drag = None
        for carrier in self.carriers:
            carrier.begin()

    def predict(self) -> None:
        """Start the search for equilibrium where the last step leads; with inertia the velocity does so already."""
        self.motion.predict()

    def solve(self, line_search: str | None = None) -> Outcome:
        """Find equilibrium, with contact augmentations, that no term objects to. Collective.

        Args:
            line_search: "l2", "bt" or "basic"; the solver's default if None.
        """
        return _settled(self.terms, lambda: super(Mechanics, self).solve(line_search))

    def evaluate(self) -> None:
        """Trial history, energies and reactions of the converged trial state. Collective."""
        for part in (*self.terms, *self._observers):
            part.evaluate()
        for carrier in self.carriers:
            carrier.evaluate()
        old = self._residual.committed
        residual = self.motion.forces(self._out_of_balance(), old, self.problem.carried)
        rates = [forces for t in offering(self.terms, RateDependent) if (forces := t.rate_forces()) is not None]
        rate_forces = np.sum([np.zeros_like(residual), *rates], axis=0)
        mean = 0.5 * (residual + old)
        if self.state.jerks:  # what follows the velocity has its value at the end of the step from its beginning on
            mean += 0.5 * (rate_forces - self._rate_forces.committed)
        work = global_dot(self.state.mesh.comm, self.problem.supported(mean), self.state.increment)
        work += sum((t.external_work() for t in offering(self.terms, Loading)), start=0.0)
        self._residual.trial, self._rate_forces.trial, self._moved.trial = residual, rate_forces, True
        self._audit.trial = self.audit.advance(work, self._energies())

    @cached_property
    def path(self) -> EquilibriumPath:
        """The path of its equilibria. Making it is collective."""
        return EquilibriumPath(self, partial(_settled, self.terms), self._lost)

    def _lost(self) -> float:
        return self.trial_audit.entries["fracture"] - self.audit.entries["fracture"]

    def _energies(self) -> list[dict[str, float]]:
        return [part.energies() for part in (*offering(self.terms, Energetic), *self.carriers)]

    @property
    def audit(self) -> EnergyAudit:
        """Energy audit of the committed state."""
        return self._audit.committed

    @property
    def trial_audit(self) -> EnergyAudit:
        """Energy audit including the trial step."""
        return self._audit.trial

    def damage_increment(self) -> float:
        """Largest growth of damage at a point in the trial step. Collective."""
        return max((t.damage_increment() for t in offering(self.terms, Damaging)), default=0.0)

    def watch(self) -> None:
        """Say in the verdict of the state what makes the trial step, which is accepted, questionable. Collective."""
        super().watch()
        viscous = sum((t.viscous_work for t in offering(self.terms, Regularised)), start=0.0)
        # what the body sets free by itself some viscosity has to take, however small it is
        free = max(self.audit.stored - self.trial_audit.stored, 0.0)
        before, resisted = self._resisted.committed
        self._resisted.trial = (viscous, resisted + max(viscous - before - free, 0.0))
        cushion = sum((t.cushion for t in offering(self.terms, Cushioned)), start=0.0)
        doubt_audit(self.state.verdict, self.audit, self.trial_audit, self._resisted.trial[1], cushion)
        for carrier in self.carriers:
            warn_of_jump(carrier.name, carrier.entry, self.audit, self.trial_audit, self.state.time)
        self._distortions.watch(self.trial_audit.scale)
        doubt_way_back(self.state, self.audit, self.trial_audit)

    def reaction(self, held: Support) -> float:
        """Reaction of a support along its direction in the trial state [force]. Collective."""
        return held.sign * super().reaction(held)

    def advise(self) -> str:
        """What may be tried where no step succeeds, in words; empty if nothing is known."""
        return self.motion.advise()

    def record(self) -> Columns:
        """Columns of the history row: name → (value, kind of quantity). Collective."""
        columns = super().record()
        for observer in self._observers:
            columns |= observer.record()
        return columns | self.trial_audit.record()


def _settled(terms: Sequence[Term], solve: Callable[[], Outcome]) -> Outcome:
    """Outcome of a solve and of those after augmentations, to which no term objects. Collective."""
    outcome = solve()
    for _ in range(AUGMENTATIONS):
        # every term takes part: a list, because any() would stop at the first
        if not outcome.converged or not any([t.augment() for t in offering(terms, Augmenting)]):
            break
        outcome = solve().after(outcome)
    else:
        message = f"contact not settled by {AUGMENTATIONS} augmentations"
        outcome = replace(outcome, converged=False, message=message)
    if outcome.converged:
        objections = [why for t in offering(terms, Objecting) if (why := t.objection())]
        if objections:
            outcome = replace(outcome, converged=False, message="; ".join(objections))
    return outcome


def _check_places(state: State, terms: Sequence[Term]) -> None:
    """Refuse solids that share cells and cracks that share facets, doubt gaps in these, watch faces. Collective."""
    check_disjoint(state.mesh, offering(terms, Body))
    check_cracks(state, offering(terms, Bonded), offering(terms, Joining))
    tell_left_out(state, terms)


def _interface_nodes(state: State, interfaces: Sequence[Interface]) -> NDArray[np.int32]:
    """Owned nodes on both faces of all cracks and pairs of surfaces."""
    dofmap, tdim = state.V.dofmap, state.mesh.topology.dim
    facets = cpp.mesh.cell_num_entities(state.mesh.topology.cell_type, tdim - 1)
    closure = [dofmap.dof_layout.entity_closure_dofs(tdim - 1, f) for f in range(facets)]
    marks = la.vector(dofmap.index_map, 1)
    for interface in interfaces:
        for cell, facet in interface.entities.reshape(-1, 2):
            marks.array[dofmap.cell_dofs(cell)[closure[facet]]] = 1.0
    marks.scatter_reverse(la.InsertMode.add)
    return np.flatnonzero(marks.array[: dofmap.index_map.size_local]).astype(np.int32)
