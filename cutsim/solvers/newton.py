"""The nonlinear problem F(u; v) = 0: one Newton solver with a preconditioner that looks after itself."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.common import Timer
from numpy.typing import NDArray
from petsc4py import PETSc

from cutsim.base import compat
from cutsim.base.checks import require
from cutsim.base.options import Options
from cutsim.solvers.convergence import BC_ROUNDING, CRITERIA, Criteria, Iteration, Judge, Reason
from cutsim.solvers.lifetime import free_dropped, weakly
from cutsim.solvers.linear import LinearSolver
from cutsim.solvers.measures import Measures
from cutsim.solvers.preconditioners import LaggedPC
from cutsim.solvers.system import STRUCTURE, Structure, System

LINE_SEARCHES = ("l2", "bt", "basic")

_SNES = PETSc.SNES.ConvergedReason
# SNES stops for a new matrix, and goes on
_PAUSE = _SNES.CONVERGED_ITS
_CODES = {
    Reason.GOING_ON: _SNES.ITERATING,
    Reason.CONVERGED: _SNES.CONVERGED_FNORM_RELATIVE,
    Reason.NOT_FINITE: compat.NOT_FINITE,
    Reason.GROWING: _SNES.DIVERGED_DTOL,
    Reason.STALLED: _SNES.DIVERGED_LOCAL_MIN,
    Reason.RUNAWAY: _SNES.DIVERGED_FUNCTION_COUNT,
}
_SENTENCES = {code: reason.value for reason, code in _CODES.items()} | {
    _SNES.DIVERGED_FUNCTION_DOMAIN: Reason.NOT_FINITE.value,
    _SNES.DIVERGED_LINE_SEARCH: "line search failed",
    _SNES.DIVERGED_LINEAR_SOLVE: "linear solver did not converge",
    _SNES.DIVERGED_MAX_IT: "no convergence",
}


@dataclass(frozen=True)
class Outcome:
    """What became of a solve.

    Attributes:
        converged: Whether equilibrium was reached; if not, u is the last iterate.
        reason: PETSc SNES reason, positive if converged.
        message: The reason in words, which "after so many iterations" may follow.
        iterations: Newton iterations.
        linear_iterations: Krylov iterations, summed over the Newton iterations.
        residuals: Norm of the out-of-balance forces over the force scale, one per iterate, the start included.
        history: Residual, displacement and energy of each iteration; `cutsim.solvers.convergence.table` prints them.
    """

    converged: bool
    reason: int
    message: str
    iterations: int
    linear_iterations: int
    residuals: tuple[float, ...]
    history: tuple[Iteration, ...] = ()

    def after(self, previous: "Outcome") -> "Outcome":
        """The same, with iterations and history of a previous solve of the same step before its own."""
        return replace(
            self,
            iterations=previous.iterations + self.iterations,
            linear_iterations=previous.linear_iterations + self.linear_iterations,
            history=previous.history + self.history,
        )


@dataclass(frozen=True)
class Kept:
    """All that a solve leaves to the next one, beside the solution.

    The preconditioner is kept as well, which no number can tell: a problem goes on exactly like another one if both
    make it anew, by `LaggedPC.refresh(pattern=True)`.

    Attributes:
        force: Force scale of the last converged solve [force].
        line_search: The line search.
        linear_solver: Name of the preset of the linear solver, empty where the user's options name one.
    """

    force: float
    line_search: str
    linear_solver: str


class NonlinearProblem:
    """Newton's method for F(u; v) = 0 with Dirichlet conditions. Every method is collective.

    Prescribed values are never written into u before the solve: their increment is lifted through the tangent in
    the first iteration. Converged means that the prescribed values hold and that the norm of the free rows of F is
    at most `rtol` times the force scale. The force scale is the norm of the reactions, of the present iterate or
    of the last converged solve, whichever is larger; without any Dirichlet condition it is the norm of F at the
    start, and with inertia the larger of both. A state free of forces is accepted when F is down to rounding,
    1e-14 ||diag(K)|| (max |u| + h). Displacement and energy are judged, too, if they have a tolerance.

    Args:
        F: Residual, linear in a test function of the space of u: internal minus external virtual work.
        u: The unknown; start and result of a solve.
        petsc_options_prefix: Prefix of all PETSc options of this problem; not empty, and its own.
        bcs: Dirichlet conditions. Their values may change between solves, their dofs may not.
        petsc_options: PETSc options without prefix. With `pc_type` or `ksp_type` among them no preset is used and
            PETSc does as told; otherwise they refine the preset of `cutsim.solvers.preconditioners.preset_for`, whose
            preconditioners have the prefixes `direct_`, `bulk_`, `crack_`, `strip_` and `saddle_`.
        entity_maps: Entity maps of the forms.
        structure: What is known of the problem beside the form.
        criteria: What convergence is judged by.

    Attributes:
        known: Owned nodal forces that are added to those of F, such as the share of the last step in a time
            integration scheme; zero at first.
        fixed: Which owned dofs have a Dirichlet condition.
        bcs: As above.

    Raises:
        ValueError: The prefix is empty.
    """

    def __init__(
        self,
        F: ufl.Form,
        u: fem.Function,
        *,
        petsc_options_prefix: str,
        bcs: Sequence[fem.DirichletBC] = (),
        petsc_options: Mapping[str, Any] | None = None,
        entity_maps: compat.EntityMaps | None = None,
        structure: Structure = STRUCTURE,
        criteria: Criteria = CRITERIA,
    ) -> None:
        self._options = Options(petsc_options_prefix, petsc_options or {})
        self.bcs = list(bcs)
        self._system = System(F, u, bcs, entity_maps, structure)
        self.known, self.fixed = self._system.forces.known, self._system.forces.fixed
        self._measures = Measures(self._system)
        self._judge = Judge(replace(criteria, by_start=criteria.by_start or not bcs), self._system.cell_size())
        free_dropped(self._system.comm)
        self._x = PETSc.Vec().createWithArray(self._system.unknowns, comm=self._system.comm)
        self._f = self._x.duplicate()
        self._create_snes()

    def _create_snes(self) -> None:
        self._snes = PETSc.SNES().create(self._system.comm)
        self._snes.setOptionsPrefix(self._options.prefix)
        self._snes.setFunction(weakly(self._evaluate_residual), self._f)
        self._set_matrix()
        self._snes.setConvergenceTest(weakly(self._test))
        self._snes.setLineSearchPreCheck(weakly(self._check_step))
        tolerances = self._judge.criteria.tolerances
        # stol = 0: a small step is no sign of equilibrium.
        self._snes.setTolerances(rtol=tolerances.rtol, stol=0.0, max_it=25)
        self._options.default({"snes_linesearch_type": LINE_SEARCHES[0], **compat.LINE_SEARCH_OPTIONS})
        self._linear = LinearSolver(self._snes, self._options, self._system)
        self._snes.setFromOptions()
        rtol, _, _, self._max_it = self._snes.getTolerances()
        self._judge.criteria = replace(self._judge.criteria, tolerances=replace(tolerances, rtol=rtol))
        self._kept = Kept(0.0, self._options.get("snes_linesearch_type"), self._linear.name)

    def _set_matrix(self) -> None:
        self._snes.setJacobian(weakly(self._evaluate_tangent), self._system.matrix())

    @property
    def snes(self) -> PETSc.SNES:
        """The PETSc solver."""
        return self._snes

    @property
    def preconditioner(self) -> LaggedPC | None:
        """The preconditioner of the preset: `refresh` it when the sparsity pattern has changed; None if the user's."""
        return self._linear.preconditioner

    @property
    def kept(self) -> Kept:
        """What the last solve has left to the next one; set it to go on as another problem of the same kind does."""
        return self._kept

    @kept.setter
    def kept(self, kept: Kept) -> None:
        self._search_by(kept.line_search)
        self._linear.use(kept.linear_solver)
        self._kept = kept

    def _search_by(self, line_search: str) -> None:
        self._options.set("snes_linesearch_type", line_search)
        self._snes.setFromOptions()
        self._kept = replace(self._kept, line_search=line_search)

    def solve(self, line_search: str | None = None) -> Outcome:
        """Solve from the present u.

        Args:
            line_search: "l2", "bt" or "basic"; by default the one of the last solve, at first "l2" or the option
                `snes_linesearch_type`.

        Returns:
            The outcome. Failure does not raise and leaves u at the last iterate.

        Raises:
            ValueError: The line search is unknown.
        """
        if line_search is not None:
            require("line_search", line_search, line_search in LINE_SEARCHES, f"one of {', '.join(LINE_SEARCHES)}")
            self._search_by(line_search)
        with Timer("~cutsim: nonlinear solve"):
            iterations, linear = self._iterate()
        self._system.assign(self._x.array_r)
        reason, judge = self._snes.getConvergedReason(), self._judge
        force = judge.force if reason > 0 else self._kept.force
        self._kept = replace(self._kept, force=force, linear_solver=self._linear.name)
        return Outcome(
            converged=reason > 0,
            reason=reason,
            message=self._message(reason),
            iterations=iterations,
            linear_iterations=linear,
            residuals=tuple(float(r / (judge.scale or 1.0)) for r in judge.residuals),
            history=tuple(judge.history),
        )

    def _iterate(self) -> tuple[int, int]:
        """Run SNES, again after each failure of the linear solver that a better preconditioner may cure."""
        x = self._system.unknowns
        self._x.array[:] = x
        self._system.forces.prescribe()
        self._measures.start(x)
        self._judge.start(self._kept.force, patient=self._kept.line_search != "bt")
        iterations = linear = 0
        while True:
            if self._system.tangent.outdated:
                self._renew_tangent()
            self._snes.setTolerances(max_it=self._max_it - iterations)
            self._snes.solve(None, self._x)
            iterations += self._snes.getIterationNumber()
            linear += self._snes.getLinearSolveIterations()
            reason = self._snes.getConvergedReason()
            if reason == _PAUSE:
                continue
            if reason != _SNES.DIVERGED_LINEAR_SOLVE or not self._linear.improve():
                return iterations, linear

    def _renew_tangent(self) -> None:
        """A matrix for another sparsity pattern."""
        self._linear.forget_pattern()
        self._system.tangent.renew()
        self._set_matrix()

    def _message(self, reason: int) -> str:
        if reason > 0:
            return Reason.CONVERGED.value
        if reason == _SNES.DIVERGED_LINEAR_SOLVE and not self._system.tangent.finite:
            return Reason.NOT_FINITE.value
        return _SENTENCES.get(reason, f"PETSc SNES reason {reason}")

    def residual(self) -> PETSc.Vec:
        """Internal minus external forces at the present u, known ones and the constrained rows included.

        Returns:
            A new vector of the owned dofs; the caller owns it.
        """
        return self._system.forces.vector()

    def reactions(self) -> PETSc.Vec:
        """Forces of the supports on the body at the present u: `residual` on constrained rows, zero elsewhere.

        Returns:
            A new vector of the owned dofs; the caller owns it.
        """
        b = self.residual()
        b.array[~self.fixed] = 0.0
        return b

    def resistance(self, motions: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
        """Forces against motions by the tangent at the present u, without any Dirichlet condition. Collective.

        Args:
            motions: Owned displacements, one motion a row [length].

        Returns:
            Owned forces, of the same shape, and the mean entry of the tangent's diagonal [force/length].
        """
        if self._system.tangent.outdated:
            self._renew_tangent()
        return self._system.resistance(motions)

    def _evaluate_residual(self, snes: PETSc.SNES, x: PETSc.Vec, b: PETSc.Vec) -> None:
        """Called by SNES."""
        b.array[:] = self._system.residual(x.array_r, BC_ROUNDING * self._judge.length)

    def _evaluate_tangent(self, snes: PETSc.SNES, x: PETSc.Vec, A: PETSc.Mat, P: PETSc.Mat) -> None:
        """Called by SNES."""
        self._system.assemble_tangent(x.array_r)

    def _check_step(self, x: PETSc.Vec, y: PETSc.Vec) -> bool:
        """Called by SNES after the linear solve: make the step of the constrained dofs exact."""
        forces = self._system.forces
        y.array[forces.held] = forces.violation(x.array_r)
        self._measures.note_direction(y.array_r, self._snes.getFunction()[0].array_r)
        self._linear.observe()
        return True

    def _test(self, snes: PETSc.SNES, iteration: int, norms: tuple[float, float, float]) -> int:
        """Called by SNES, whose iterations begin anew after a pause."""
        iterate = self._measures.of(snes.getSolution().array_r, snes.getFunction()[0].array_r)
        reason = self._judge.judge(iteration, iterate)
        pause = reason is Reason.GOING_ON and self._system.tangent.outdated
        return _PAUSE if pause else _CODES[reason]

    def destroy(self) -> None:
        """Free the PETSc objects and remove the options of this problem."""
        for thing in (self._snes, self._system, self._x, self._f):
            thing.destroy()
        self._options.clear()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.destroy()
