"""Linear solvers for the tangent: which preconditioner fits, how it is built, and when it is rebuilt."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from petsc4py import PETSc


@dataclass(frozen=True)
class Preset:
    """A linear solver: options of the Krylov method and of the preconditioner kept by `LaggedPC`.

    Attributes:
        name: Short name, for logs.
        ksp: PETSc options of the Krylov method, without prefix.
        pc: PETSc options of the preconditioner, without prefix.
        patience: Krylov iterations of one solve beyond which the preconditioner is rebuilt.
    """

    name: str
    ksp: Mapping[str, Any]
    pc: Mapping[str, Any] = field(default_factory=dict)
    patience: int = 8


def preset_for(n_dofs: int, symmetric: bool, ranks: int, has_interface: bool, gdim: int) -> Preset:
    """Choose the linear solver by size, symmetry, ranks and presence of a crack.

    Args:
        n_dofs: Global number of unknowns.
        symmetric: Whether the tangent is symmetric.
        ranks: Number of MPI ranks.
        has_interface: Whether there is a crack whose stiffness may be very large or negative.
        gdim: Dimension of space; in the plane a factorisation stays cheap much longer.

    Returns:
        The preset.
    """
    return _direct(symmetric)


def _direct(symmetric: bool) -> Preset:
    """Factorisation, kept as preconditioner over iterations and steps; GMRES because softening is indefinite."""
    ksp = {"ksp_type": "gmres", "ksp_pc_side": "right", "ksp_rtol": 1e-6, "ksp_max_it": 40}
    pc = {"pc_type": "cholesky" if symmetric else "lu", "pc_factor_mat_solver_type": "mumps"}
    return Preset("direct", ksp, pc)


class LaggedPC:
    """PETSc python preconditioner that keeps an inner one until it has gone stale.

    It is (re)built when there is none, when the last linear solve failed or took more than `patience`
    iterations, and on `refresh`. All ranks see the same iteration counts, so the decision is collective.

    Args:
        prefix: Options prefix of the inner preconditioner.
        patience: Krylov iterations of one solve beyond which it counts as stale.
    """

    def __init__(self, prefix: str, patience: int) -> None:
        self.prefix = prefix
        self.patience = patience
        self.builds = 0
        self.fresh = False  # built for the tangent of the current linear solve
        self._stale = True
        self._inner: PETSc.PC | None = None

    def refresh(self, *, pattern: bool = False) -> None:
        """Rebuild at the next linear solve; with `pattern`, also forget the symbolic factorisation."""
        self._stale = True
        if pattern and self._inner is not None:
            self._inner.destroy()
            self._inner = None

    def observe(self, iterations: int, converged: bool) -> None:
        """Take note of a finished linear solve.

        Args:
            iterations: Krylov iterations it took.
            converged: Whether it met its tolerance.
        """
        self._stale |= not converged or iterations > self.patience

    def setUp(self, pc: PETSc.PC) -> None:  # noqa: N802 (name fixed by PETSc)
        """Called by PETSc when the tangent has changed."""
        A, P = pc.getOperators()
        if self._inner is None:
            self._inner = PETSc.PC().create(pc.comm)
            self._inner.setOptionsPrefix(self.prefix)
            self._inner.setOperators(A, P)
            self._inner.setFromOptions()
        self.fresh = self._stale
        if self._stale:
            self._inner.setReusePreconditioner(False)
            self._inner.setUp()
            self._inner.setReusePreconditioner(True)
            self.builds += 1
        self._stale = False
        pc.setFailedReason(self._inner.getFailedReason())

    def apply(self, pc: PETSc.PC, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Apply the kept preconditioner."""
        self._inner.apply(x, y)

    def destroy(self, pc: PETSc.PC) -> None:
        """Free the kept preconditioner."""
        if self._inner is not None:
            self._inner.destroy()
            self._inner = None
