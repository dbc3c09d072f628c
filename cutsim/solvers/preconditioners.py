"""Preconditioners for the tangent: which one fits, how it is built, and when it is rebuilt."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from dolfinx import fem, la
from numpy.typing import NDArray
from petsc4py import PETSc

from cutsim.base.assembly import Array, owned_vector

#: Unknowns up to which a factorisation is the fastest, by dimension of space.
DIRECT_LIMIT = {1: 1_000_000, 2: 100_000, 3: 10_000}
#: The same with a crack: nearly incompressible, stretched cells under a blade cost multigrid 45 iterations a solve.
DIRECT_LIMIT_CRACK = {1: 1_000_000, 2: 100_000, 3: 60_000}
#: Unknowns up to which a factorisation is worth trying when everything else failed.
FALLBACK_LIMIT = 200_000


@dataclass(frozen=True)
class Preset:
    """Preset of a linear solver: a Krylov method, a preconditioner that is kept, and perhaps a strip along the crack.

    Attributes:
        name: "direct", "bulk", "crack" or "saddle".
        ksp: PETSc options of the Krylov method, without prefix.
        kept: PETSc options of the preconditioner kept by `LaggedPC`, without prefix.
        patience: Krylov iterations of one solve beyond which the kept preconditioner counts as stale.
        strip: PETSc options of the solver on the strip along the crack (`StripCycle`), empty without strip.
    """

    name: str
    ksp: Mapping[str, Any]
    kept: Mapping[str, Any]
    patience: int
    strip: Mapping[str, Any] = field(default_factory=dict)


def preset_for(
    n_dofs: int, symmetric: bool, ranks: int, has_interface: bool, gdim: int, *, saddle_point: bool = False
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

    Returns:
        The preset.
    """
    limit = (DIRECT_LIMIT_CRACK if has_interface or saddle_point else DIRECT_LIMIT)[gdim]
    # multipliers beside a stiff crack leave the strip along it no place in the cycle
    if n_dofs <= (FALLBACK_LIMIT if has_interface and saddle_point else limit):
        return _direct(symmetric)
    # On several ranks SOR is a block method, which needs Chebyshev to bound it.
    smoother = "richardson" if ranks == 1 else "chebyshev"
    amg = {
        "pc_type": "gamg",
        "mg_levels_ksp_type": smoother,
        "mg_levels_ksp_max_it": 1,
        "mg_levels_pc_type": "sor",
    }
    # a tighter tolerance gains nothing: Newton's own error is larger until the last iteration
    if saddle_point:
        return Preset("saddle", _gmres(1e-4, 200), _schur(amg), patience=60)
    if has_interface:
        return Preset("crack", _gmres(1e-4, 200), amg, patience=40, strip=_factor(symmetric))
    return Preset("bulk", _gmres(1e-4, 200), amg, patience=30)


def fallback_for(failed: Preset, n_dofs: int, symmetric: bool) -> Preset | None:
    """What to try when a freshly built preconditioner has failed.

    Args:
        failed: The preset that failed.
        n_dofs: Global number of unknowns.
        symmetric: Whether the tangent is symmetric.

    Returns:
        A factorisation, or None where that is what failed or would not fit.
    """
    return None if failed.name == "direct" or n_dofs > FALLBACK_LIMIT else _direct(symmetric)


def _direct(symmetric: bool) -> Preset:
    # a factorisation of an older tangent is a preconditioner, too: a few iterations are cheaper than a new one
    return Preset("direct", _gmres(1e-6, 20), _factor(symmetric), patience=8)


def _factor(symmetric: bool) -> dict[str, Any]:
    return {"pc_type": "cholesky" if symmetric else "lu", "pc_factor_mat_solver_type": "mumps"}


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
    return PETSc.NullSpace().create(vectors=vectors, comm=V.mesh.comm)


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


def strip_dofs(V: fem.FunctionSpace, interface_dofs: NDArray[np.int32]) -> NDArray[np.int32]:
    """Unknowns of the crack faces and of one layer of cells beside each. Collective.

    Args:
        V: The displacement space.
        interface_dofs: Owned (blocked) dofs on both faces of the cracks.

    Returns:
        Owned unrolled dofs, ascending.
    """
    index_map, bs = V.dofmap.index_map, V.dofmap.index_map_bs
    mark = la.vector(index_map, 1)
    mark.array[interface_dofs] = 1.0
    mark.scatter_forward()
    cells = V.dofmap.list
    # a cell may touch the crack with a node that another rank owns, and mark nodes of that rank: forward, then back
    layer = cells[np.any(mark.array[cells] > 0.0, axis=1)]
    mark.array[layer.ravel()] = 1.0
    mark.scatter_reverse(la.InsertMode.add)
    nodes = np.flatnonzero(mark.array[: index_map.size_local] > 0.0)
    return (nodes[:, None] * bs + np.arange(bs)).ravel().astype(np.int32)


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
    """

    def __init__(self, prefix: str, patience: int) -> None:
        self.builds = 0
        self.fresh = False
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
        if self._inner is None:
            self._inner = _create_pc(self._prefix, *pc.getOperators())
            self._stale = True
        self.fresh = self._stale
        # PETSc would set the inner one up for every tangent: it is told to keep what it has until it is stale
        if self._stale:
            self._inner.setReusePreconditioner(False)
            self._inner.setUp()
            self._inner.setReusePreconditioner(True)
            self.builds += 1
        self._stale = False
        pc.setFailedReason(self._inner.getFailedReason())

    def apply(self, pc: PETSc.PC, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Called by PETSc: y = (kept preconditioner) x."""
        self._inner.apply(x, y)

    def destroy(self, pc: PETSc.PC) -> None:
        """Called by PETSc at the end."""
        self._free()

    def _free(self) -> None:
        if self._inner is not None:
            self._inner.destroy()
            self._inner = None


class StripCycle(LaggedPC):
    """Multiplicative cycle strip, kept preconditioner, strip; for cracks of any stiffness.

    Multigrid built in the elastic state is kept while the crack stiffens, softens and opens: what changes is
    confined to the strip along the crack, and that is factorised anew for every tangent.

    Args:
        prefix: Options prefix of the kept preconditioner.
        patience: As for `LaggedPC`.
        strip_prefix: Options prefix of the solver on the strip.
        dofs: Owned unrolled dofs of the strip, see `strip_dofs`.
        symmetric: Whether the tangent is symmetric.
    """

    def __init__(self, prefix: str, patience: int, strip_prefix: str, dofs: NDArray[np.int32], symmetric: bool) -> None:
        super().__init__(prefix, patience)
        self._strip_prefix, self._dofs, self._symmetric = strip_prefix, dofs, symmetric
        self._strip: Any = None

    def setUp(self, pc: PETSc.PC) -> None:
        """Called by PETSc when the tangent has changed."""
        super().setUp(pc)
        A = pc.getOperators()[1]
        if self._strip is None:
            self._is = PETSc.IS().createGeneral(self._dofs + A.getOwnershipRange()[0], comm=A.comm)
            self._B = A.createSubMatrix(self._is, self._is)
            # a sub-matrix does not inherit this from the matrix
            self._B.setOption(PETSc.Mat.Option.SYMMETRIC, self._symmetric)
            self._strip = _create_pc(self._strip_prefix, self._B, self._B)
            self._b, self._c = self._B.createVecs()
            self._r, self._z = A.createVecs()
        else:
            A.createSubMatrix(self._is, self._is, self._B)
            self._strip.setOperators(self._B, self._B)
        self._strip.setUp()
        if self._strip.getFailedReason():
            pc.setFailedReason(self._strip.getFailedReason())

    def apply(self, pc: PETSc.PC, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Called by PETSc: one cycle from y = 0."""
        # each part sees the residual that the one before it leaves; added up, they would correct the strip twice
        A = pc.getOperators()[0]
        y.set(0.0)
        self._correct_strip(x, y)
        A.mult(y, self._r)
        self._r.aypx(-1.0, x)
        self._inner.apply(self._r, self._z)
        y.axpy(1.0, self._z)
        A.mult(y, self._r)
        self._r.aypx(-1.0, x)
        self._correct_strip(self._r, y)

    def _correct_strip(self, r: PETSc.Vec, y: PETSc.Vec) -> None:
        """Add to y the solution on the strip for the residual r."""
        self._b.array[:] = r.array_r[self._dofs]
        self._strip.apply(self._b, self._c)
        y.array[self._dofs] += self._c.array_r

    def _free(self) -> None:
        super()._free()
        if self._strip is not None:
            for thing in (self._strip, self._is, self._B, self._b, self._c, self._r, self._z):
                thing.destroy()
            self._strip = None


def create_lagged(
    preset: Preset,
    prefix: str,
    V: fem.FunctionSpace,
    interface_dofs: NDArray[np.int32] | None,
    symmetric: bool,
) -> LaggedPC:
    """The preconditioner of a preset, to be made the context of a PETSc python preconditioner. Collective.

    Args:
        preset: The preset.
        prefix: Options prefix of the problem; the kept preconditioner adds the name of the preset.
        V: The displacement space.
        interface_dofs: Owned (blocked) dofs on both faces of the cracks, if the preset has a strip.
        symmetric: Whether the tangent is symmetric.
    """
    kept = f"{prefix}{preset.name}_"
    if not preset.strip or interface_dofs is None:
        return LaggedPC(kept, preset.patience)
    return StripCycle(kept, preset.patience, prefix + "strip_", strip_dofs(V, interface_dofs), symmetric)


def _create_pc(prefix: str, A: PETSc.Mat, P: PETSc.Mat) -> PETSc.PC:
    pc = PETSc.PC().create(A.comm)
    pc.setOptionsPrefix(prefix)
    pc.setOperators(A, P)
    pc.setFromOptions()
    if pc.getType() == PETSc.PC.Type.FIELDSPLIT:
        pc.setFieldSplitIS(*zip("01", A.getNestISs()[0], strict=True))
    return pc
