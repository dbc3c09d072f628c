"""The nonlinear problem F(u; v) = 0: one Newton solver with a preconditioner that looks after itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import ufl
import dolfinx.fem.petsc  # makes fem.petsc available
from dolfinx import fem, la
from mpi4py import MPI
from petsc4py import PETSc

from cutsim import compat
from cutsim.preconditioners import LaggedPC, StripCycle, preset_for, rigid_body_modes, strip_dofs

LINE_SEARCHES = ("l2", "bt", "basic")
#: Rounding floor of the residual, as a fraction of the nodal forces diag(K) u that cancel in it.
ROUNDING = 1e-14
#: A prescribed displacement counts as reached within this fraction of the largest displacement.
BC_ROUNDING = 1e-12
#: Growth of the residual over the force scale at which an iteration is given up.
GROWTH = 1e6

_Reason = PETSc.SNES.ConvergedReason
_SENTENCES = {
    _Reason.DIVERGED_FUNCTION_DOMAIN: "residual or tangent not finite (element inverted, J <= 0)",
    _Reason.DIVERGED_FNORM_NAN: "residual or tangent not finite (element inverted, J <= 0)",
    _Reason.DIVERGED_JACOBIAN_DOMAIN: "residual or tangent not finite (element inverted, J <= 0)",
    _Reason.DIVERGED_LINE_SEARCH: "line search failed",
    _Reason.DIVERGED_LOCAL_MIN: "line search failed at a local minimum of the residual",
    _Reason.DIVERGED_LINEAR_SOLVE: "linear solver did not converge",
    _Reason.DIVERGED_DTOL: f"residual grew by more than {GROWTH:.0e}",
}


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

    Prescribed values are never written into u before the solve: their increment is lifted through the tangent
    in the first iteration, as upstream. Converged means that the norm of the free rows of F is at most
    `rtol` times the force scale and that the prescribed values hold. The force scale is the norm of the
    reactions, of the present iterate or of the last converged solve, whichever is larger; without any
    Dirichlet condition it is the norm of F at the start. A state free of forces is accepted when F is at its
    rounding level, 1e-14 ||diag(K) u||.

    Args:
        F: Residual form, linear in a test function of the space of u (internal minus external forces).
        u: The unknown; start and result of a solve.
        petsc_options_prefix: Prefix of all PETSc options of this problem; not empty.
        bcs: Dirichlet conditions. Their values may change between solves, their dofs may not.
        J: Tangent form; derived from F by default.
        petsc_options: PETSc options without prefix. With `pc_type` or `ksp_type` among them no preset is used
            and PETSc does as told.
        entity_maps: Entity maps for the forms.
        jit_options: Override `cutsim.compat.JIT_OPTIONS`.
        interface_dofs: Local (owned) blocked dofs on cracks; selects the preconditioner for cracks.
        symmetric: Whether the tangent is symmetric.
        form_compiler_options: Options of FFCx.
        rtol: Tolerance relative to the force scale.
        max_it: Newton iterations allowed in one solve.

    Raises:
        ValueError: If the prefix is empty, or `rtol` or `max_it` is not positive.
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
        entity_maps: Mapping[Any, Any] | None = None,
        jit_options: Mapping[str, Any] | None = None,
        interface_dofs: npt.NDArray[np.int32] | None = None,
        symmetric: bool = False,
        form_compiler_options: Mapping[str, Any] | None = None,
        rtol: float = 1e-8,
        max_it: int = 25,
    ) -> None:
        if not petsc_options_prefix:
            raise ValueError("petsc_options_prefix = '': a prefix such as 'cut_' is needed")
        if not rtol > 0.0:
            raise ValueError(f"rtol = {rtol}: must be positive")
        if max_it < 1:
            raise ValueError(f"max_it = {max_it}: must be at least 1")
        if J is None:
            J = ufl.derivative(F, u, ufl.TrialFunction(u.function_space))
        options = dict(
            entity_maps=entity_maps, jit_options=jit_options, form_compiler_options=form_compiler_options
        )
        self.u, self.bcs, self.rtol, self.max_it = u, list(bcs), rtol, max_it
        self._L, self._a = compat.form(F, **options), compat.form(J, **options)
        V = u.function_space
        self._comm: MPI.Comm = V.mesh.comm
        self._n = V.dofmap.index_map.size_local * V.dofmap.index_map_bs
        self._fixed = _constrained_dofs(self.bcs, self._n)
        self._r = la.vector(V.dofmap.index_map, V.dofmap.index_map_bs)
        self._x = la.create_petsc_vector(V.dofmap.index_map, V.dofmap.index_map_bs)
        self._diagonal = self._x.duplicate()
        self._diagonal.set(0.0)
        self._A = fem.petsc.create_matrix(self._a)
        self._A.setOption(PETSc.Mat.Option.SYMMETRIC, symmetric)
        if V.dofmap.index_map_bs == V.mesh.geometry.dim > 1:
            self._A.setNearNullSpace(rigid_body_modes(V))
        self._previous_scale = 0.0
        self._residuals: list[float] = []
        self._lagged: LaggedPC | None = None
        self._options = _Options(petsc_options_prefix, petsc_options or {})
        self._snes = self._create_snes()
        if not (self._options.has("pc_type") or self._options.has("ksp_type")):
            self._install_preset(symmetric, interface_dofs)
        self._snes.setFromOptions()

    def _create_snes(self) -> PETSc.SNES:
        snes = PETSc.SNES().create(self._comm)
        snes.setOptionsPrefix(self._options.prefix)
        snes.setFunction(self._evaluate_residual, self._x.duplicate())
        snes.setJacobian(self._evaluate_tangent, self._A)
        snes.setConvergenceTest(self._test)
        snes.setLineSearchPreCheck(self._fix_step)
        # stol = 0: a small step is no sign of equilibrium
        snes.setTolerances(stol=0.0, max_it=self.max_it)
        self._options.default("snes_linesearch_type", LINE_SEARCHES[0])
        return snes

    def _install_preset(self, symmetric: bool, interface_dofs: npt.NDArray[np.int32] | None) -> None:
        """Choose the linear solver; options of the user win over its own."""
        V, options = self.u.function_space, self._options
        size = V.dofmap.index_map.size_global * V.dofmap.index_map_bs
        preset = preset_for(size, symmetric, self._comm.size, interface_dofs is not None, V.mesh.geometry.dim)
        for part, values in (("", preset.ksp), ("kept_", preset.kept), ("strip_", preset.strip)):
            for key, value in values.items():
                options.default(part + key, value)
        kept = options.prefix + "kept_"
        if preset.strip:
            strip = strip_dofs(V, interface_dofs)
            self._lagged = StripCycle(kept, preset.patience, options.prefix + "strip_", strip, symmetric)
        else:
            self._lagged = LaggedPC(kept, preset.patience)
        pc = self._snes.getKSP().getPC()
        pc.setType(PETSc.PC.Type.PYTHON)
        pc.setPythonContext(self._lagged)

    @property
    def snes(self) -> PETSc.SNES:
        """The PETSc solver."""
        return self._snes

    def solve(self, line_search: str | None = None) -> Outcome:
        """Solve from the present u.

        Args:
            line_search: "l2", "bt" or "basic"; by default "l2", or what the options say.

        Returns:
            The outcome. Failure does not raise and leaves u at the last iterate.

        Raises:
            ValueError: If the line search is unknown.
        """
        self._set_line_search(line_search)
        self._x.array[:] = self.u.x.array[: self._n]
        self._residuals, self._scale = [], self._previous_scale
        iterations = linear = 0
        while True:
            self._snes.setTolerances(max_it=self.max_it - iterations)
            self._snes.solve(None, self._x)
            iterations += self._snes.getIterationNumber()
            linear += self._snes.getLinearSolveIterations()
            if not self._retry_linear_solve():
                break
        self._assign(self._x)
        reason = self._snes.getConvergedReason()
        if reason > 0:
            self._previous_scale = self._reaction_norm
        return Outcome(
            converged=reason > 0,
            reason=reason,
            message=self._message(reason),
            iterations=iterations,
            linear_iterations=linear,
            residuals=tuple(float(r / (self._scale or 1.0)) for r in self._residuals),
        )

    def _set_line_search(self, name: str | None) -> None:
        if name is not None and name not in LINE_SEARCHES:
            raise ValueError(f"line_search = {name!r}: must be one of {', '.join(LINE_SEARCHES)}")
        if self._options.set("snes_linesearch_type", name):
            self._snes.setFromOptions()

    def _retry_linear_solve(self) -> bool:
        """Whether the linear solve failed with an old preconditioner, and the iteration goes on with a new one."""
        failed = self._snes.getConvergedReason() == _Reason.DIVERGED_LINEAR_SOLVE
        if not failed or self._lagged is None or self._lagged.fresh:
            return False
        self._lagged.refresh()
        return True

    def _message(self, reason: int) -> str:
        if reason > 0:
            return "converged"
        if reason == _Reason.DIVERGED_MAX_IT:
            return f"{self.max_it} iterations without convergence"
        return _SENTENCES.get(reason, f"PETSc SNES reason {reason}")

    def residual(self) -> PETSc.Vec:
        """Internal minus external forces at the present u, the constrained rows included.

        Returns:
            A new vector, without ghosts updated; the caller owns it.
        """
        self._assemble_residual(lift=False)
        b = self._x.duplicate()
        b.array[:] = self._r.array[: self._n]
        return b

    def reactions(self) -> PETSc.Vec:
        """Forces of the supports on the body at the present u: `residual` on constrained rows, zero elsewhere.

        Returns:
            A new vector; the caller owns it.
        """
        b = self.residual()
        b.array[~self._fixed] = 0.0
        return b

    # -- callbacks of SNES ------------------------------------------------------------------------------------

    def _assign(self, x: PETSc.Vec) -> None:
        self.u.x.array[: self._n] = x.array_r
        self.u.x.scatter_forward()

    def _assemble_residual(self, *, lift: bool) -> None:
        r = self._r.array
        r[:] = 0.0
        fem.assemble_vector(r, self._L)
        if lift:
            fem.apply_lifting(r, [self._a], [self.bcs], [self.u.x.array], -1.0)
        self._r.scatter_reverse(la.InsertMode.add)

    def _evaluate_residual(self, snes: PETSc.SNES, x: PETSc.Vec, b: PETSc.Vec) -> None:
        self._assign(x)
        self._assemble_residual(lift=True)
        r = self._r.array[: self._n]
        # Where the prescribed values do not hold yet these rows carry lifting too, but then u is no solution.
        self._reaction_sq = float(np.sum(r[self._fixed] ** 2))
        for bc in self.bcs:
            bc.set(self._r.array, self.u.x.array, -1.0)
        b.array[:] = r

    def _evaluate_tangent(self, snes: PETSc.SNES, x: PETSc.Vec, A: PETSc.Mat, P: PETSc.Mat) -> None:
        self._assign(x)
        A.zeroEntries()
        fem.petsc.assemble_matrix(A, self._a, self.bcs)
        A.assemble()
        A.getDiagonal(self._diagonal)

    def _fix_step(self, x: PETSc.Vec, y: PETSc.Vec) -> bool:
        """Make the step of the constrained dofs exact, whatever the tolerance of the linear solver."""
        g = np.zeros_like(self.u.x.array)
        for bc in self.bcs:
            bc.set(g, None, 1.0)
        y.array[self._fixed] = x.array_r[self._fixed] - g[: self._n][self._fixed]
        if self._lagged is not None:
            ksp = self._snes.getKSP()
            self._lagged.observe(ksp.getIterationNumber(), ksp.getConvergedReason() > 0)
        return True

    def _test(self, snes: PETSc.SNES, iteration: int, norms: tuple[float, float, float]) -> int:
        f, x = snes.getFunction()[0].array_r, snes.getSolution().array_r
        jump = float(np.max(np.abs(f[self._fixed]), initial=0.0))
        free = float(np.sum(f[~self._fixed] ** 2))
        rounding = float(np.sum((self._diagonal.array_r * x) ** 2))
        free, reaction, rounding = np.sqrt(self._comm.allreduce(np.array([free, self._reaction_sq, rounding])))
        jump, size = (self._comm.allreduce(v, MPI.MAX) for v in (jump, float(np.max(np.abs(x), initial=0.0))))
        if not np.isfinite(free + jump):
            return _Reason.DIVERGED_FNORM_NAN
        return self._judge(iteration, free, reaction, ROUNDING * rounding, jump <= BC_ROUNDING * size)

    def _judge(self, iteration: int, free: float, reaction: float, floor: float, bcs_hold: bool) -> int:
        """Decide from global numbers only, so that every rank decides alike."""
        if iteration > 0 or not self._residuals:
            self._residuals.append(free)
        self._reaction_norm = reaction
        start = self._residuals[0]
        self._scale = max(self._previous_scale, reaction, start if not self.bcs else 0.0)
        if bcs_hold and free <= max(self.rtol * self._scale, floor):
            return _Reason.CONVERGED_FNORM_RELATIVE
        if free > GROWTH * max(start, self._scale):
            return _Reason.DIVERGED_DTOL
        return _Reason.ITERATING

    # -- lifetime ---------------------------------------------------------------------------------------------

    def destroy(self) -> None:
        """Free the PETSc objects and remove the options of this problem."""
        self._snes.destroy()
        for thing in (self._A, self._x, self._diagonal):
            thing.destroy()
        self._options.clear()

    def __enter__(self) -> NonlinearProblem:
        return self

    def __exit__(self, *exc: object) -> None:
        self.destroy()


class _Options:
    """Options of one prefix in the PETSc database, which PETSc also reads late, when a preconditioner is built."""

    def __init__(self, prefix: str, options: Mapping[str, Any]) -> None:
        self.prefix = prefix
        self._db = PETSc.Options(prefix)
        self._own: set[str] = set()
        for key, value in options.items():
            self.set(key, value)

    def has(self, key: str) -> bool:
        return self._db.hasName(key)

    def set(self, key: str, value: Any) -> bool:
        """Set an option unless the value is None or the same; say whether it changed."""
        if value is None or (self.has(key) and self._db.getString(key) == str(value)):
            return False
        self._db.setValue(key, value)
        self._own.add(key)
        return True

    def default(self, key: str, value: Any) -> None:
        if not self.has(key):
            self.set(key, value)

    def clear(self) -> None:
        for key in self._own:
            self._db.delValue(key)


def _constrained_dofs(bcs: Sequence[fem.DirichletBC], n_owned: int) -> npt.NDArray[np.bool_]:
    """Mask over the owned (unrolled) dofs: True where a condition prescribes the value."""
    mask = np.zeros(n_owned, dtype=bool)
    for bc in bcs:
        dofs = bc.dof_indices()[0]
        mask[dofs[dofs < n_owned]] = True
    return mask
