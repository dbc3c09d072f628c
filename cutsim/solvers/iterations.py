"""Newton iterations by PETSc's SNES, and the outcome of a solve."""

from dataclasses import dataclass, replace

from petsc4py import PETSc

from cutsim.base import compat
from cutsim.base.lifetime import petsc_comm, weakly
from cutsim.base.options import Options
from cutsim.solvers.convergence import BC_ROUNDING, Criteria, Iteration, Judge, Reason
from cutsim.solvers.linear import LinearSolver
from cutsim.solvers.norms import Norms
from cutsim.solvers.system import System

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
    """Outcome of a solve.

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


class Iterations:
    """Newton iterations on a system, by PETSc's SNES. Every method is collective.

    Args:
        system: The equations.
        criteria: What convergence is judged by.
        options: PETSc options of the problem.

    Attributes:
        snes: The PETSc solver.
        linear: Its linear solver.
        judge: Judge of the iterates.
        measures: Norms of the iterates.
    """

    def __init__(self, system: System, criteria: Criteria, options: Options) -> None:
        self._system, self._options = system, options
        self.measures = Norms(system)
        # the vector is not that of u, which line searches would spoil as their own start
        self._x = PETSc.Vec().createWithArray(system.unknowns, comm=petsc_comm(system.comm))
        self._f = self._x.duplicate()
        self.snes = PETSc.SNES().create(self._x.comm)
        self.snes.setOptionsPrefix(options.prefix)
        self.snes.setFunction(weakly(self._evaluate_residual), self._f)
        self._set_matrix()
        self.snes.setConvergenceTest(weakly(self._test))
        self.snes.setLineSearchPreCheck(weakly(self._check_step))
        # stol = 0: a small step is no sign of equilibrium.
        self.snes.setTolerances(rtol=criteria.tolerances.rtol, stol=0.0, max_it=25)
        options.default({"snes_linesearch_type": LINE_SEARCHES[0], **compat.LINE_SEARCH_OPTIONS})
        self.linear = LinearSolver(self.snes, options, system)
        self.snes.setFromOptions()
        rtol, _, _, self._max_it = self.snes.getTolerances()
        tolerances = replace(criteria.tolerances, rtol=rtol)
        self.judge = Judge(replace(criteria, tolerances=tolerances), system.cell_size())

    def _set_matrix(self) -> None:
        self.snes.setJacobian(weakly(self._evaluate_tangent), self._system.matrix())

    @property
    def line_search(self) -> str:
        """The line search in use."""
        return self._options.get("snes_linesearch_type")

    @line_search.setter
    def line_search(self, line_search: str) -> None:
        self._options.set("snes_linesearch_type", line_search)
        self.snes.setFromOptions()

    @property
    def force(self) -> float:
        """Force scale of the last iterate [force]."""
        return self.judge.force

    def run(self, force: float) -> Outcome:
        """Iterate from the present unknowns to equilibrium or failure, which leaves the last iterate.

        Args:
            force: Force scale of the last converged solve [force].
        """
        x = self._system.unknowns
        self._x.array[:] = x
        self._system.forces.prescribe()
        self.measures.start(x)
        judge = self.judge
        judge.start(force, line_search=self.line_search)
        iterations, linear = self._iterate()
        self._system.assign(self._x.array_r)
        reason = self.snes.getConvergedReason()
        return Outcome(
            converged=reason > 0,
            reason=reason,
            message=self._message(reason),
            iterations=iterations,
            linear_iterations=linear,
            residuals=tuple(r / (judge.scale or 1.0) for r in judge.residuals),
            history=tuple(judge.history),
        )

    def _iterate(self) -> tuple[int, int]:
        """Run SNES, again after each failure of the linear solver that a better preconditioner may cure."""
        iterations = linear = 0
        while True:
            self.renew_tangent()
            # SNES counts anew after each interruption, but the limit is one for the whole solve
            self.snes.setTolerances(max_it=self._max_it - iterations)
            self.snes.solve(None, self._x)
            iterations += self.snes.getIterationNumber()
            linear += self.snes.getLinearSolveIterations()
            reason = self.snes.getConvergedReason()
            if reason == _PAUSE:
                continue
            if reason != _SNES.DIVERGED_LINEAR_SOLVE or not self.linear.improve():
                return iterations, linear

    def vectors(self) -> tuple[PETSc.Vec, PETSc.Vec]:
        """Two new vectors of the owned unknowns; the caller owns them."""
        return self._x.duplicate(), self._x.duplicate()

    def renew_tangent(self) -> None:
        """Make the matrix anew if the sparsity pattern has changed."""
        if self._system.tangent.outdated:
            self.linear.forget_pattern()
            self._system.tangent.renew()
            self._set_matrix()

    def _message(self, reason: int) -> str:
        if reason > 0:
            return Reason.CONVERGED.value
        if reason == _SNES.DIVERGED_LINEAR_SOLVE and not self._system.tangent.finite:
            return Reason.NOT_FINITE.value
        return _SENTENCES.get(reason, f"PETSc SNES reason {reason}")

    def _evaluate_residual(self, snes: PETSc.SNES, x: PETSc.Vec, b: PETSc.Vec) -> None:
        """Called by SNES."""
        b.array[:] = self._system.residual(x.array_r, BC_ROUNDING * self.judge.length)

    def _evaluate_tangent(self, snes: PETSc.SNES, x: PETSc.Vec, A: PETSc.Mat, P: PETSc.Mat) -> None:
        """Called by SNES."""
        self._system.assemble_tangent(x.array_r)

    def _check_step(self, x: PETSc.Vec, y: PETSc.Vec) -> bool:
        """Called by SNES after the linear solve: make the step of the constrained dofs exact."""
        # the linear solver meets these rows within its tolerance only, and what is left would be lifted again
        y.array[self._system.held] = self._system.violation(x.array_r)
        self.measures.note_direction(y.array_r, self.snes.getFunction()[0].array_r)
        self.linear.observe()
        return True

    def _test(self, snes: PETSc.SNES, iteration: int, norms: tuple[float, float, float]) -> int:
        """Called by SNES, whose iterations begin anew after a pause."""
        iterate = self.measures.of(snes.getSolution().array_r, snes.getFunction()[0].array_r)
        reason = self.judge.judge(iteration, iterate)
        pause = reason is Reason.GOING_ON and self._system.tangent.outdated
        return _PAUSE if pause else _CODES[reason]

    def destroy(self) -> None:
        """Free the PETSc objects."""
        for thing in (self.snes, self._x, self._f):
            thing.destroy()
