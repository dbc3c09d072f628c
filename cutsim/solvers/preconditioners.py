"""Preconditioners for the tangent: which one fits, how it is built, and when it is rebuilt."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from dolfinx import fem
from numpy.typing import NDArray
from petsc4py import PETSc

from cutsim.base.assembly import Array, owned_vector

#: Unknowns up to which a factorisation is the fastest, by dimension of space.
DIRECT_LIMIT = {1: 1_000_000, 2: 100_000, 3: 10_000}
#: The same with a crack: nearly incompressible, stretched cells under a blade cost multigrid 45 iterations a solve.
DIRECT_LIMIT_CRACK = {1: 1_000_000, 2: 100_000, 3: 60_000}
#: Unknowns in the plane up to which, on one rank, PETSc's own factor without pivots is the faster: it takes longer to
#: make than MUMPS's, the more so the larger it is, but half the time to apply, and it is applied twenty times.
NATIVE_LIMIT = 25_000
#: Unknowns of a body in space with a crack from which a kept factor of half the size is faster ...
FACTOR_FROM = 10_000
#: ... and up to which: operations of a factorisation grow with their square, those of multigrid in proportion.
FACTOR_LIMIT = 2_000_000
#: Unknowns up to which a factorisation is worth trying when everything else failed.
FALLBACK_LIMIT = 200_000


@dataclass(frozen=True)
class Preset:
    """Preset of a linear solver: a Krylov method, a preconditioner that is kept, and perhaps a strip along the crack.

    Attributes:
        name: "native", "direct", "bulk", "factor", "crack" or "saddle".
        ksp: PETSc options of the Krylov method, without prefix.
        kept: PETSc options of the preconditioner kept by `LaggedPC`, without prefix.
        patience: Krylov iterations of one solve beyond which the kept preconditioner counts as stale, if that decides.
        strip: PETSc options of the solver on the strip along the crack (`StripCycle`), empty without strip.
    """

    name: str
    ksp: Mapping[str, Any]
    kept: Mapping[str, Any]
    patience: int = 0
    strip: Mapping[str, Any] = field(default_factory=dict)


def preset_for(
    n_dofs: int,
    symmetric: bool,
    ranks: int,
    has_interface: bool,
    gdim: int,
    *,
    saddle_point: bool = False,
    memory: float = 0.0,
) -> Preset:
    """Choose the linear solver by size, symmetry, ranks and presence of a crack.

    The Krylov method is always GMRES with the preconditioner on the right: it bears a tangent made indefinite by
    softening or by a wild iterate, measures the true residual, and costs the same as CG at the few iterations
    needed here.

    Args:
        n_dofs: Global number of unknowns.
        symmetric: Whether the tangent is symmetric.
        ranks: Number of MPI ranks.
        has_interface: Whether there is a crack, whose stiffness may be very large or negative.
        gdim: Dimension of space; in the plane a factorisation stays cheap much longer.
        saddle_point: Whether there are multipliers.
        memory: What a kept factor may take of each rank [MB]; 0 for no limit.

    Returns:
        The preset.
    """
    if has_interface and not saddle_point and gdim == 3 and FACTOR_FROM <= n_dofs <= FACTOR_LIMIT:
        # blocks of low rank to 1e-4 take as many iterations; at 270 000 unknowns they save five sixths of the time
        compressed = {"mat_mumps_icntl_35": 2, "mat_mumps_cntl_7": 1e-4}
        kept = _factor(symmetric=True) | compressed | {"mat_mumps_icntl_23": int(memory)}
        return Preset("factor", _flexible(1e-4, 100), kept, strip=_factor(symmetric))
    limit = (DIRECT_LIMIT_CRACK if has_interface or saddle_point else DIRECT_LIMIT)[gdim]
    if gdim < 3 and ranks == 1 and n_dofs <= min(limit, NATIVE_LIMIT) and not saddle_point:
        return _native()
    # multipliers beside a stiff crack leave the strip along it no place in the cycle
    if n_dofs <= (FALLBACK_LIMIT if has_interface and saddle_point else limit):
        return _direct(symmetric)
    # a tighter tolerance gains nothing: Newton's own error is larger until the last iteration
    if saddle_point:
        return Preset("saddle", _gmres(1e-4, 200), _schur(_multigrid(ranks)), patience=60)
    if has_interface:
        return _crack(symmetric, ranks)
    return Preset("bulk", _gmres(1e-4, 200), _multigrid(ranks), patience=30)


def fallback_for(failed: Preset, n_dofs: int, symmetric: bool, ranks: int) -> Preset | None:
    """What to try when a freshly built preconditioner has failed.

    Args:
        failed: The preset that failed.
        n_dofs: Global number of unknowns.
        symmetric: Whether the tangent is symmetric.
        ranks: Number of MPI ranks.

    Returns:
        Multigrid where memory is short for a kept factor; else a factorisation with pivots, or None where that is what
        failed or would not fit.
    """
    if failed.name == "factor":
        return _crack(symmetric, ranks)
    return None if failed.name == "direct" or n_dofs > FALLBACK_LIMIT else _direct(symmetric)


def _crack(symmetric: bool, ranks: int) -> Preset:
    return Preset("crack", _gmres(1e-4, 200), _multigrid(ranks), patience=40, strip=_factor(symmetric))


def _multigrid(ranks: int) -> dict[str, Any]:
    # On several ranks SOR is a block method, which needs Chebyshev to bound it.
    smoother = "richardson" if ranks == 1 else "chebyshev"
    return {
        "pc_type": "gamg",
        "mg_levels_ksp_type": smoother,
        "mg_levels_ksp_max_it": 1,
        "mg_levels_pc_type": "sor",
    }


def _direct(symmetric: bool) -> Preset:
    # a factorisation of an older tangent is a preconditioner, too: a few iterations are cheaper than a new one
    return Preset("direct", _flexible(1e-6, 20), _factor(symmetric), patience=8)


def _factor(symmetric: bool) -> dict[str, Any]:
    return {"pc_type": "cholesky" if symmetric else "lu", "pc_factor_mat_solver_type": "mumps"}


def _native() -> Preset:
    own = {"pc_type": "lu", "pc_factor_mat_solver_type": "petsc", "pc_factor_mat_ordering_type": "nd"}
    return replace(_direct(symmetric=False), name="native", kept=own)


def _schur(amg: Mapping[str, Any]) -> dict[str, Any]:
    """Block elimination of the displacement: multigrid for it, the diagonal of its Schur complement for the rest."""
    # with GMRES on the right an upper factor is enough: were its blocks exact, two iterations would do (Murphy, Golub
    # and Wathen 2000); "selfp" is the complement with the diagonal in place of the block, sparse and cheap
    split = {
        "pc_type": "fieldsplit",
        "pc_fieldsplit_type": "schur",
        "pc_fieldsplit_schur_fact_type": "upper",
        "pc_fieldsplit_schur_precondition": "selfp",
        "fieldsplit_0_ksp_type": "preonly",
        "fieldsplit_1_ksp_type": "preonly",
        "fieldsplit_1_pc_type": "jacobi",
    }
    return split | {f"fieldsplit_0_{name}": value for name, value in amg.items()}


def _gmres(rtol: float, max_it: int) -> dict[str, Any]:
    return {"ksp_type": "gmres", "ksp_pc_side": "right", "ksp_rtol": rtol, "ksp_max_it": max_it}


def _flexible(rtol: float, max_it: int) -> dict[str, Any]:
    # it keeps the preconditioned vectors, and need not apply the preconditioner once more at the end
    return _gmres(rtol, max_it) | {"ksp_type": "fgmres"}


def rigid_body_modes(V: fem.FunctionSpace, turn: Callable[[Array], Array] = np.asarray) -> PETSc.NullSpace:
    """Translations and infinitesimal rotations of a displacement space, orthonormal. Collective.

    Args:
        V: Lagrange space of vectors with as many components as the space has dimensions, cracked or not.
        turn: Gives the unknowns of owned nodal vectors, their components by default.

    Returns:
        3 modes in the plane, 6 in space, as near-nullspace for algebraic multigrid.

    Raises:
        ValueError: If V is not a space of 2-D or 3-D displacements.
    """
    gdim, bs = V.mesh.geometry.dim, V.dofmap.index_map_bs
    if bs != gdim or gdim not in (2, 3):
        raise ValueError(f"V has {bs} components in {gdim} dimensions: must be 2 in 2 or 3 in 3")
    n = V.dofmap.index_map.size_local
    x = V.tabulate_dof_coordinates()[:n, :gdim]
    modes = rigid_motions(x)
    vectors = [owned_vector(V.dofmap.index_map, bs) for _ in modes]
    for vector, mode in zip(vectors, modes, strict=True):
        vector.array[:] = turn(mode.ravel())
    _orthonormalise(vectors)
    return PETSc.NullSpace().create(vectors=vectors, comm=vectors[0].comm)


def rigid_motions(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Small rigid motions of points: translations along the axes, then rotations about the origin.

    Args:
        x: Positions in the plane or in space, one a row [length].

    Returns:
        Displacements, shape (3 or 6, points, components).
    """
    gdim = x.shape[1]
    motions = [np.tile(e, (len(x), 1)) for e in np.eye(gdim)]
    for i, j in [(0, 1), (1, 2), (2, 0)][: 1 if gdim == 2 else 3]:
        rotation = np.zeros_like(x)
        rotation[:, i], rotation[:, j] = -x[:, j], x[:, i]
        motions.append(rotation)
    return np.array(motions)


def _orthonormalise(vectors: list[PETSc.Vec]) -> None:
    # Gram and Schmidt's method as modified by subtracting one after the other; the modes are far from parallel
    for i, v in enumerate(vectors):
        for w in vectors[:i]:
            v.axpy(-v.dot(w), w)
        v.normalize()


class LaggedPC:
    """PETSc python preconditioner that keeps an inner one until it has gone stale.

    The inner one is built when there is none, when the last linear solve took more iterations than `patience`
    and than 1.5 times those right after the build, and on `refresh`, to be called after a failure. All ranks see
    the same iteration counts, so the decision is collective.

    Args:
        prefix: Options prefix of the inner preconditioner.
        patience: Krylov iterations of one solve that never count as stale.

    Attributes:
        builds: How often the inner preconditioner was built.
        fresh: Whether it was built for the present tangent.
        memory: What it is expected to need on a rank [MB], 0 where that is not known.
        trouble: Why it could not be built, in words, if that is known.
    """

    def __init__(self, prefix: str, patience: int) -> None:
        self.builds = 0
        self.fresh = False
        self.memory = 0.0
        self.trouble = ""
        self._prefix, self._patience = prefix, patience
        self._limit = float(patience)
        self._stale = True
        self._inner: Any = None

    def refresh(self, *, pattern: bool = False) -> None:
        """Rebuild at the next linear solve.

        Args:
            pattern: The sparsity pattern has changed too: forget the symbolic factorisation.
        """
        self._stale = True
        if pattern:
            self._free()

    def observe(self, iterations: int) -> None:
        """Take note of a linear solve that met its tolerance.

        Args:
            iterations: Krylov iterations it took.
        """
        # how many iterations the best preconditioner of this kind needs depends on the problem: measure against it
        if self.fresh:
            self._limit = max(self._patience, 1.5 * iterations)
        self._stale = iterations > self._limit

    def setUp(self, pc: PETSc.PC) -> None:
        """Called by PETSc when the tangent has changed."""
        if self._inner is not None and self._inner.getFailedReason():
            self._free()  # set up again for an unchanged tangent it would forget that it has no factor
        self.fresh = self._stale = self._stale or self._inner is None
        if self._stale:
            self._build(*pc.getOperators())
            self.builds += 1
        self._stale = False
        pc.setFailedReason(self._inner.getFailedReason())

    def apply(self, pc: PETSc.PC, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Called by PETSc: y = (kept preconditioner) x."""
        self._inner.apply(x, y)

    def destroy(self, pc: PETSc.PC) -> None:
        """Called by PETSc at the end."""
        self._free()

    def _build(self, A: PETSc.Mat, P: PETSc.Mat) -> None:
        """Build the inner preconditioner for a tangent."""
        if self._inner is None:
            self._inner = create_pc(self._prefix, A, P)
        # PETSc would set the inner one up for every tangent: it is told to keep what it has until it is stale
        self._inner.setReusePreconditioner(False)
        self._inner.setUp()
        self._inner.setReusePreconditioner(True)

    def _free(self) -> None:
        if self._inner is not None:
            self._inner.destroy()
            self._inner = None


def create_pc(prefix: str, A: PETSc.Mat, P: PETSc.Mat) -> PETSc.PC:
    """A preconditioner for a tangent, as the options with a prefix say; not set up. Collective."""
    pc = PETSc.PC().create(A.comm)
    pc.setOptionsPrefix(prefix)
    pc.setOperators(A, P)
    pc.setFromOptions()
    if pc.getType() == PETSc.PC.Type.FIELDSPLIT:
        pc.setFieldSplitIS(*zip("01", A.getNestISs()[0], strict=True))
    return pc
