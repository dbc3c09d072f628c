"""The nonlinear problem F(u; v) = 0: one Newton solver with a preconditioner that looks after itself."""

import gc
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import count
from typing import Any, Self
from weakref import WeakMethod

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.common import Timer
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from cutsim.base import compat
from cutsim.base.checks import positive, require, require_number
from cutsim.base.log import collective_logger
from cutsim.base.options import Options
from cutsim.base.terms import Multiplier, Term
from cutsim.solvers.multipliers import Multipliers
from cutsim.solvers.preconditioners import LaggedPC, Preset, create_lagged, fallback_for, preset_for
from cutsim.solvers.residual import Residual
from cutsim.solvers.tangent import Tangent

log = collective_logger(__name__)

LINE_SEARCHES = ("l2", "bt", "basic")
#: Rounding level of the residual, as a fraction of the nodal forces ||diag(K)|| (max |u| + h) that cancel in it. The
#: cell size h stands for the deformation gradient, which is known within the rounding of 1 however small u is.
ROUNDING = 1e-14
#: A prescribed displacement holds when it is met within this fraction of max |u| + h.
BC_ROUNDING = 1e-12
# problems after which what is left of dropped ones is looked for
_COLLECT = 16
#: Growth of the residual at which an iteration is given up.
GROWTH = 1e6
#: A backtracking search crawls at a kink: it is given up where the residual has not fallen to this fraction ...
STALLED = 0.95
#: ... in so many iterations.
STALL = 5

_Reason = PETSc.SNES.ConvergedReason
# SNES stops for a new matrix, and goes on
_PAUSE = _Reason.CONVERGED_ITS
_NOT_FINITE = "residual or tangent not finite (element inverted, J <= 0)"
_SENTENCES = {
    _Reason.DIVERGED_FUNCTION_DOMAIN: _NOT_FINITE,
    compat.NOT_FINITE: _NOT_FINITE,
    _Reason.DIVERGED_LINE_SEARCH: "line search failed",
    _Reason.DIVERGED_LOCAL_MIN: "line search failed at a local minimum of the residual",
    _Reason.DIVERGED_LINEAR_SOLVE: "linear solver did not converge",
    _Reason.DIVERGED_DTOL: f"residual grew by more than {GROWTH:.0e}",
    _Reason.DIVERGED_FUNCTION_COUNT: "the solution runs away: something moves freely, or there is no equilibrium",
}


_made = count(1)


def _free_dropped(comm: MPI.Comm) -> None:
    """Free what earlier problems have left, to be called where all ranks meet. Collective.

    Objects that refer to each other wait for Python's collector, which does not know that their communicators are
    few; and on several ranks PETSc only notes what Python has dropped.
    """
    if next(_made) % _COLLECT == 0:
        gc.collect()
    PETSc.garbage_cleanup(comm)


def _weakly(method: Callable[..., Any]) -> Callable[..., Any]:
    """A method that PETSc may call and that does not keep its object alive.

    Python cannot see what PETSc holds. A problem held there is never freed, nor are its matrices, spaces and
    communicators, of which MPI has no more than some thousands: a loop over runs ends when they are used up.
    """
    reference = WeakMethod(method)

    def call(*arguments: Any) -> Any:
        alive = reference()
        assert alive is not None, "the solver has outlived its problem"
        return alive(*arguments)

    return call


@dataclass(frozen=True)
class Outcome:
    """What became of a solve.

    Attributes:
        converged: Whether equilibrium was reached; if not, u is the last iterate.
        reason: PETSc SNES reason, positive if converged.
        message: The reason as a sentence.
        iterations: Newton iterations.
        linear_iterations: Krylov iterations, summed over the Newton iterations.
        residuals: Norm of the out-of-balance forces over the force scale, one per iterate, the start included.
    """

    converged: bool
    reason: int
    message: str
    iterations: int
    linear_iterations: int
    residuals: tuple[float, ...]


class NonlinearProblem:
    """Newton's method for F(u; v) = 0 with Dirichlet conditions. Every method is collective.

    Prescribed values are never written into u before the solve: their increment is lifted through the tangent in
    the first iteration. Converged means that the prescribed values hold and that the norm of the free rows of F is
    at most `rtol` times the force scale. The force scale is the norm of the reactions, of the present iterate or
    of the last converged solve, whichever is larger; without any Dirichlet condition it is the norm of F at the
    start, and with inertia the larger of both. A state free of forces is accepted when F is down to rounding,
    1e-14 ||diag(K)|| (max |u| + h).

    Args:
        F: Residual, linear in a test function of the space of u: internal minus external virtual work.
        u: The unknown; start and result of a solve.
        petsc_options_prefix: Prefix of all PETSc options of this problem; not empty, and its own.
        bcs: Dirichlet conditions. Their values may change between solves, their dofs may not.
        J: Tangent; derived from F by default.
        petsc_options: PETSc options without prefix. With `pc_type` or `ksp_type` among them no preset is used and
            PETSc does as told; otherwise they refine the preset of `cutsim.solvers.preconditioners.preset_for`, whose
            preconditioners have the prefixes `direct_`, `bulk_`, `crack_`, `strip_` and `saddle_`.
        entity_maps: Entity maps of the forms.
        jit_options: Override `cutsim.base.jit.JIT_OPTIONS`.
        interface_dofs: Owned (blocked) dofs on both faces of all cracks; selects the solver for cracks.
        symmetric: Whether the tangent is symmetric.
        inertia: Whether inertia balances forces, too: there may be supports without any reaction.
        terms: Terms with forces that are not in F: they assemble themselves.
        multipliers: Further unknowns, on which F depends, with their equations.
        form_compiler_options: Options of FFCx.
        rtol: Tolerance relative to the force scale; PETSc option `snes_rtol`.
        largest: Size of an entry of u, or of a multiplier, at which a solve is given up: the rounding level grows with
            u, so that far away everything would count as converged.

    Attributes:
        known: Owned nodal forces that are added to those of F, such as the share of the last step in a time
            integration scheme; zero at first.
        fixed: Which owned dofs have a Dirichlet condition.

    Raises:
        ValueError: The prefix is empty or `rtol` is not positive.
    """

    def __init__(
        self,
        F: ufl.Form,
        u: fem.Function,
        *,
        petsc_options_prefix: str,
        bcs: Sequence[fem.DirichletBC] = (),
        J: ufl.Form | None = None,
        petsc_options: Mapping[str, Any] | None = None,
        entity_maps: compat.EntityMaps | None = None,
        jit_options: Mapping[str, Any] | None = None,
        interface_dofs: NDArray[np.int32] | None = None,
        symmetric: bool = False,
        inertia: bool = False,
        terms: Sequence[Term] = (),
        multipliers: Sequence[Multiplier] = (),
        form_compiler_options: Mapping[str, Any] | None = None,
        rtol: float = 1e-8,
        largest: float = np.inf,
    ) -> None:
        require_number("rtol", rtol, positive)
        self._largest = largest
        self._options = Options(petsc_options_prefix, petsc_options or {})
        self.u, self.bcs = u, list(bcs)
        self._symmetric, self._interface_dofs, self._by_start = symmetric, interface_dofs, inertia or not bcs
        if J is None:
            J = ufl.derivative(F, u, ufl.TrialFunction(u.function_space))
        L, a = (
            compat.form(
                form, entity_maps=entity_maps, jit_options=jit_options, form_compiler_options=form_compiler_options
            )
            for form in (F, J)
        )
        self._terms = tuple(terms)
        self._forces = Residual(L, a, u, bcs, terms)
        self.known, self.fixed = self._forces.known, self._forces.fixed
        self._tangent = Tangent(a, u.function_space, symmetric, terms)
        self._multipliers = Multipliers(multipliers, u, bcs)
        self._create_vectors()
        self._create_snes(rtol)

    def _create_vectors(self) -> None:
        mesh = self.u.function_space.mesh
        self._comm: MPI.Comm = mesh.comm
        _free_dropped(self._comm)
        # SNES iterates on a vector of its own, displacement first, then multipliers: were it that of u, line searches
        # would spoil their own start.
        self._x = PETSc.Vec().createWithArray(self._unknowns(), comm=self._comm)
        self._f = self._x.duplicate()
        self._n_dofs = self._x.size
        self._free = np.setdiff1d(np.arange(self._x.local_size), self._forces.held)
        self._previous_scale = self._size = 0.0
        cells = np.arange(mesh.topology.index_map(mesh.topology.dim).size_local, dtype=np.int32)
        h = np.max(mesh.h(mesh.topology.dim, cells), initial=0.0)
        self._h = self._comm.allreduce(h, MPI.MAX)

    def _create_snes(self, rtol: float) -> None:
        self._snes = PETSc.SNES().create(self._comm)
        self._snes.setOptionsPrefix(self._options.prefix)
        self._snes.setFunction(_weakly(self._evaluate_residual), self._f)
        self._set_matrix()
        self._snes.setConvergenceTest(_weakly(self._test))
        self._snes.setLineSearchPreCheck(_weakly(self._check_step))
        # stol = 0: a small step is no sign of equilibrium.
        self._snes.setTolerances(rtol=rtol, stol=0.0, max_it=25)
        self._options.default({"snes_linesearch_type": LINE_SEARCHES[0], **compat.LINE_SEARCH_OPTIONS})
        self._line_search = LINE_SEARCHES[0]
        self._lagged: LaggedPC | None = None
        if "pc_type" not in self._options and "ksp_type" not in self._options:
            has_interface, gdim = self._interface_dofs is not None, self.u.function_space.mesh.geometry.dim
            saddle = self._n_dofs > self._tangent.A.size[0]
            self._install(
                preset_for(self._n_dofs, self._symmetric, self._comm.size, has_interface, gdim, saddle_point=saddle)
            )
        self._snes.setFromOptions()
        self._rtol, _, _, self._max_it = self._snes.getTolerances()

    def _install(self, preset: Preset) -> None:
        """Use a preset; options of the user win over its own."""
        self._preset = preset
        self._options.default(preset.ksp)
        self._options.default(preset.kept, preset.name + "_")
        self._options.default(preset.strip, "strip_")
        self._lagged = create_lagged(
            preset, self._options.prefix, self.u.function_space, self._interface_dofs, self._symmetric
        )
        pc = self._snes.getKSP().getPC()
        pc.setType(PETSc.PC.Type.PYTHON)
        pc.setPythonContext(self._lagged)

    @property
    def snes(self) -> PETSc.SNES:
        """The PETSc solver."""
        return self._snes

    @property
    def preconditioner(self) -> LaggedPC | None:
        """The preconditioner of the preset: `refresh` it when the sparsity pattern has changed; None if the user's."""
        return self._lagged

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
            self._options.set("snes_linesearch_type", line_search)
            self._snes.setFromOptions()
            self._line_search = line_search
        with Timer("~cutsim: nonlinear solve"):
            iterations, linear = self._iterate()
        self._assign(self._x)
        reason = self._snes.getConvergedReason()
        if reason > 0:
            self._previous_scale = self._force
        return Outcome(
            converged=reason > 0,
            reason=reason,
            message=self._message(reason),
            iterations=iterations,
            linear_iterations=linear,
            residuals=tuple(float(r / (self._scale or 1.0)) for r in self._residuals),
        )

    def _iterate(self) -> tuple[int, int]:
        """Run SNES, again after each failure of the linear solver that a better preconditioner may cure."""
        self._x.array[:] = self._unknowns()
        self._forces.prescribe()
        self._residuals: list[float] = []
        self._size = 0.0
        self._scale = self._previous_scale
        iterations = linear = 0
        while True:
            if self._tangent.outdated:
                self._renew_tangent()
            self._snes.setTolerances(max_it=self._max_it - iterations)
            self._snes.solve(None, self._x)
            iterations += self._snes.getIterationNumber()
            linear += self._snes.getLinearSolveIterations()
            if self._snes.getConvergedReason() == _PAUSE:
                continue
            if self._snes.getConvergedReason() != _Reason.DIVERGED_LINEAR_SOLVE or not self._better_preconditioner():
                return iterations, linear

    def _renew_tangent(self) -> None:
        """A matrix for another sparsity pattern; what was factorised before is of no use."""
        if self._lagged is None:
            self._snes.getKSP().reset()
        else:
            self._lagged.refresh(pattern=True)
        self._tangent.renew()
        self._set_matrix()

    def _better_preconditioner(self) -> bool:
        """After a failed linear solve: rebuild the preconditioner, or else factorise; False if neither is left."""
        if self._lagged is None or not self._tangent.finite:
            return False
        was_fresh = self._lagged.fresh
        self._lagged.refresh()
        if not was_fresh:
            return True
        fallback = fallback_for(self._preset, self._n_dofs, self._symmetric)
        if fallback is None:
            return False
        log.warning("Linear solver %r failed: %r from now on", self._preset.name, fallback.name)
        self._install(fallback)
        return True

    def _message(self, reason: int) -> str:
        if reason > 0:
            return "converged"
        if reason == _Reason.DIVERGED_MAX_IT:
            return f"no convergence in {self._max_it} iterations"
        if reason == _Reason.DIVERGED_LINEAR_SOLVE and not self._tangent.finite:
            return _NOT_FINITE
        return _SENTENCES.get(reason, f"PETSc SNES reason {reason}")

    def residual(self) -> PETSc.Vec:
        """Internal minus external forces at the present u, known ones and the constrained rows included.

        Returns:
            A new vector of the owned dofs; the caller owns it.
        """
        return self._forces.vector()

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
        if self._tangent.outdated:
            self._renew_tangent()
        for term in self._terms:
            term.prepare()
        self._tangent.assemble(())
        x, y = self._tangent.A.createVecs()
        forces = np.empty_like(motions)
        for motion, force in zip(motions, forces, strict=True):
            x.array[:] = motion
            self._tangent.A.mult(x, y)
            force[:] = y.array_r
        x.destroy()
        y.destroy()
        diagonal = self._tangent.diagonal
        total, size = self._comm.allreduce(np.array([np.abs(diagonal).sum(), diagonal.size]))
        return forces, float(total / size)

    def _set_matrix(self) -> None:
        A = self._multipliers.around(self._tangent.A, symmetric=self._symmetric)
        self._snes.setJacobian(_weakly(self._evaluate_tangent), A)

    def _unknowns(self) -> NDArray[np.float64]:
        return np.concatenate([self.u.x.array[: self._forces.n], self._multipliers.values])

    def _assign(self, x: PETSc.Vec) -> None:
        n = self._forces.n
        self.u.x.array[:n] = x.array_r[:n]
        self.u.x.scatter_forward()
        self._multipliers.assign(x.array_r[n:])

    def _evaluate_residual(self, snes: PETSc.SNES, x: PETSc.Vec, b: PETSc.Vec) -> None:
        """Called by SNES: residual with lifting; u - g in the constrained rows."""
        self._assign(x)
        lift = self._forces.violated(BC_ROUNDING * (self._size + self._h))
        b.array[:] = np.concatenate([self._forces.assemble(lift=lift), self._multipliers.residual()])
        # While prescribed values do not hold, these rows carry lifting too; but then u is no solution either.
        self._reaction = b.array_r[self._forces.held]
        b.array[self._forces.held] = self._forces.violation(x.array_r)

    def _evaluate_tangent(self, snes: PETSc.SNES, x: PETSc.Vec, A: PETSc.Mat, P: PETSc.Mat) -> None:
        """Called by SNES."""
        self._assign(x)
        for term in self._terms:
            term.prepare()
        self._tangent.assemble(self.bcs)
        self._multipliers.assemble()

    def _check_step(self, x: PETSc.Vec, y: PETSc.Vec) -> bool:
        """Called by SNES after the linear solve: make the step of the constrained dofs exact."""
        y.array[self._forces.held] = self._forces.violation(x.array_r)
        if self._lagged is not None:
            self._lagged.observe(self._snes.getKSP().getIterationNumber())
        return True

    def _test(self, snes: PETSc.SNES, iteration: int, norms: tuple[float, float, float]) -> int:
        """Called by SNES: reduce the local numbers, then judge."""
        f, x = snes.getFunction()[0].array_r, snes.getSolution().array_r
        squares = [f[self._free], self._reaction, self._tangent.diagonal[~self.fixed]]
        free, reaction, stiffness = np.sqrt(self._comm.allreduce(np.array([np.sum(s**2) for s in squares])))
        held = f[self._forces.held]
        jump, size = (self._comm.allreduce(np.max(np.abs(v), initial=0.0), MPI.MAX) for v in (held, x))
        if iteration > 0 and size > self._largest:
            return _Reason.DIVERGED_FUNCTION_COUNT
        self._size = max(self._size, size)
        length = self._size + self._h
        reason = self._judge(iteration, free, reaction, ROUNDING * stiffness * length, jump <= BC_ROUNDING * length)
        return _PAUSE if reason == _Reason.ITERATING and self._tangent.outdated else reason

    def _judge(self, iteration: int, free: float, reaction: float, floor: float, bcs_hold: bool) -> int:
        """Decide from global numbers only, so that every rank decides alike."""
        if iteration > 0 or not self._residuals:  # a start after a cured linear solve is no new iterate
            self._residuals.append(free)
        start = self._residuals[0]
        self._force = max(reaction, start) if self._by_start else reaction
        self._scale = max(self._previous_scale, self._force)
        if not np.isfinite(free):
            return compat.NOT_FINITE
        if bcs_hold and free <= max(self._rtol * self._scale, floor):
            return _Reason.CONVERGED_FNORM_RELATIVE
        if free > GROWTH * max(start, self._scale):
            return _Reason.DIVERGED_DTOL
        if self._line_search == "bt" and len(self._residuals) > STALL and free > STALLED * self._residuals[-1 - STALL]:
            return _Reason.DIVERGED_LOCAL_MIN
        return _Reason.ITERATING

    def destroy(self) -> None:
        """Free the PETSc objects and remove the options of this problem."""
        for thing in (self._snes, self._multipliers, self._tangent, self._forces, self._x, self._f):
            thing.destroy()
        self._options.clear()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.destroy()
