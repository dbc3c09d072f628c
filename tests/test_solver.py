"""The nonlinear solver and its preconditioners against linear algebra, closed forms and bounds on iterations."""

from pathlib import Path

import numpy as np
import pytest
import ufl
from dolfinx import fem, mesh
from dolfinx.fem import petsc
from mpi4py import MPI
from petsc4py import PETSc

from cutsim.base import compat
from cutsim.base.assembly import integrate
from cutsim.base.jit import compiled
from cutsim.fields.measures import Measures
from cutsim.fields.space import cracked_space
from cutsim.solvers import preconditioners, strips
from cutsim.solvers.convergence import Criteria, Tolerances
from cutsim.solvers.newton import Kept, NonlinearProblem
from cutsim.solvers.preconditioners import fallback_for, preset_for, rigid_body_modes
from cutsim.solvers.system import Structure

WORLD = MPI.COMM_WORLD
E, NU = 1.0, 0.3
G, LAMBDA = E / (2 * (1 + NU)), E * NU / ((1 + NU) * (1 - 2 * NU))
EXACT = {"ksp_type": "preonly", "pc_type": "lu", "pc_factor_mat_solver_type": "mumps"}


def square(comm=WORLD, n=8):
    return mesh.create_unit_square(comm, n, n, mesh.CellType.quadrilateral, ghost_mode=mesh.GhostMode.shared_facet)


def small_strain(u, v, modulus=1.0):
    eps = ufl.sym(ufl.grad(u))
    sigma = 2 * G * eps + LAMBDA * ufl.tr(eps) * ufl.Identity(len(u))
    return modulus * ufl.inner(sigma, ufl.sym(ufl.grad(v))) * ufl.dx


def neo_hookean(u, v):
    F = ufl.Identity(len(u)) + ufl.grad(u)
    J = ufl.det(F)
    W = G / 2 * (ufl.inner(F, F) - len(u)) - G * ufl.ln(J) + LAMBDA / 2 * ufl.ln(J) ** 2
    return ufl.derivative(W, u, v) * ufl.dx


def clamped(V, value, at):
    """Displacement `value` (a Constant, so that it can change) where the last coordinate is `at`."""
    gdim = V.mesh.geometry.dim
    return fem.dirichletbc(value, fem.locate_dofs_geometrical(V, lambda x: np.isclose(x[gdim - 1], at)), V)


class Block:
    """Unit square or cube, bottom clamped, top displaced by `top.value`."""

    def __init__(self, domain, residual=neo_hookean, V=None, **options):
        gdim = domain.geometry.dim
        self.V = fem.functionspace(domain, ("Lagrange", 1, (gdim,))) if V is None else V
        self.u = fem.Function(self.V)
        self.top = fem.Constant(domain, np.zeros(gdim))
        bcs = [clamped(self.V, fem.Constant(domain, np.zeros(gdim)), 0.0), clamped(self.V, self.top, 1.0)]
        options = {"petsc_options_prefix": "block_", "structure": Structure(symmetric=True), "bcs": bcs, **options}
        self.problem = NonlinearProblem(self.given(residual(self.u, ufl.TestFunction(self.V))), self.u, **options)

    def given(self, form):
        """What of the residual the problem is given."""
        return form

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.problem.destroy()

    def reaction(self, at=1.0):
        """Resultant on the face where the last coordinate is `at`."""
        gdim, n = self.V.mesh.geometry.dim, self.V.dofmap.index_map.size_local
        here = np.isclose(self.V.tabulate_dof_coordinates()[:n, gdim - 1], at)
        forces = self.problem.reactions().array.reshape(n, gdim)
        return self.V.mesh.comm.allreduce(forces[here].sum(axis=0))


@pytest.mark.mpi
def test_a_linear_problem_takes_one_iteration():
    """Uniform strain is in the space, so the patch test must hold to rounding."""
    domain = square()
    V = fem.functionspace(domain, ("Lagrange", 1, (2,)))
    u, exact = fem.Function(V), fem.Function(V)
    exact.interpolate(lambda x: np.array([0.1 * x[0] + 0.2 * x[1], -0.3 * x[0] + 0.05 * x[1]]))
    domain.topology.create_connectivity(1, 2)
    rim = fem.locate_dofs_topological(V, 1, mesh.exterior_facet_indices(domain.topology))
    F = small_strain(u, ufl.TestFunction(V))
    with NonlinearProblem(F, u, petsc_options_prefix="a_", bcs=[fem.dirichletbc(exact, rim)]) as problem:
        outcome = problem.solve()
        assert outcome.converged and outcome.iterations == 1 and len(outcome.residuals) == 2
        assert problem.solve().iterations == 0
    np.testing.assert_allclose(u.x.array, exact.x.array, atol=1e-13)


def test_newton_is_quadratic():
    with Block(square(), petsc_options=EXACT, criteria=Criteria(Tolerances(rtol=1e-13))) as block:
        block.top.value[:] = 0.0, 2.0
        outcome = block.problem.solve("basic")
    assert outcome.converged
    logs = np.log([r for r in outcome.residuals if r > 1e-12])
    assert (logs[-1] - logs[-2]) / (logs[-2] - logs[-3]) >= 1.9


@pytest.mark.mpi
def test_prescribed_increments_are_lifted_through_the_tangent():
    """Written into u, 40 % of stretch in one row of flat cells would invert none but strain one row by 3.2."""
    with Block(square()) as block:
        block.top.value[:] = 0.0, 0.4
        outcome = block.problem.solve("basic")
        assert outcome.converged and outcome.iterations <= 6
        u = block.u.x.array.reshape(-1, 2)
        assert np.all(u[np.isclose(block.V.tabulate_dof_coordinates()[:, 1], 1.0)] == [0.0, 0.4])


def test_prescribed_values_hold_whatever_the_linear_tolerance(monkeypatch):
    monkeypatch.setattr(preconditioners, "DIRECT_LIMIT", {2: 0})
    with Block(square(), petsc_options={"ksp_rtol": 0.3, "snes_max_it": 1}) as block:
        block.top.value[:] = 0.0, 0.1
        assert not block.problem.solve("basic").converged
        np.testing.assert_allclose(block.u.x.array.reshape(-1, 2)[:, 1].max(), block.top.value[1], rtol=0.0, atol=1e-15)


def spring(root, domain, stiffness=1.0):
    """Springs atan(5 (u - root)) at the vertices: from far away a full Newton step overshoots ever more."""
    V = fem.functionspace(domain, ("Lagrange", 1))
    u = fem.Function(V)
    lumped = ufl.dx(metadata={"quadrature_rule": "vertex", "quadrature_degree": 1})
    F = stiffness * ufl.atan(5 * (u - root)) * ufl.TestFunction(V) * lumped
    u.x.array[:] = root + 0.8
    return F, u


@pytest.mark.mpi
def test_backtracking_does_not_spoil_the_iterate():
    F, u = spring(1.5, square())
    with NonlinearProblem(F, u, petsc_options_prefix="b_") as problem:
        outcome = problem.solve("bt")
    x, residuals = 4.0, [1.0]  # the same in one unknown, 5 (u - root), with PETSc's sufficient decrease
    while residuals[-1] > 1e-8:
        x, residual = backtrack(x)
        residuals.append(residual)
    assert outcome.converged
    np.testing.assert_allclose(u.x.array, 1.5, atol=1e-8)
    np.testing.assert_allclose(outcome.residuals[:3], residuals[:3], rtol=1e-6)
    assert outcome.iterations == len(residuals) - 1


def backtrack(x):
    """One Newton step for atan(x) with the cubic backtracking of Dennis and Schnabel, A6.3.1."""
    f = np.arctan(x)
    step = -f * (1 + x**2)
    slope, t = -(f**2), 1.0

    def energy(t):
        return 0.5 * np.arctan(x + t * step) ** 2

    t_old = None
    while energy(t) > 0.5 * f**2 + 1e-4 * t * slope:
        if t_old is None:
            new = -slope / (2 * (energy(t) - 0.5 * f**2 - slope))
        else:
            a, b = (energy(s) - 0.5 * f**2 - s * slope for s in (t, t_old))
            c3 = (a / t**2 - b / t_old**2) / (t - t_old)
            c2 = (-t_old * a / t**2 + t * b / t_old**2) / (t - t_old)
            new = (-c2 + np.sqrt(c2**2 - 3 * c3 * slope)) / (3 * c3)
        t_old, t = t, min(max(new, 0.1 * t), 0.5 * t)
    x = x + t * step
    return x, abs(np.arctan(x)) / np.arctan(4.0)


@pytest.mark.mpi
def test_the_history_has_the_norms_of_every_iteration():
    """In one unknown x = 5 (u - root), the same at all nodes, the areas of which add up to one."""
    F, u = spring(0.0, square())
    u.x.array[:] = 0.1
    nodes = u.function_space.dofmap.index_map.size_global
    with NonlinearProblem(F, u, petsc_options_prefix="b_", petsc_options=EXACT) as problem:
        outcome = problem.solve("basic")
    x, first = 0.5, None
    assert len(outcome.history) == outcome.iterations == len(outcome.residuals) - 1
    for row in outcome.history:
        step = -np.arctan(x) * (1 + x**2) / 5
        first = first or (abs(step) * np.sqrt(nodes), abs(step * np.arctan(x)))
        x += 5 * step
        assert (row.initial.displacement, row.initial.energy) == pytest.approx(first, rel=1e-9)
        assert row.current.displacement == pytest.approx(abs(step) * np.sqrt(nodes), rel=1e-6)
        assert row.current.energy == pytest.approx(abs(step * np.arctan(x)), rel=1e-6, abs=1e-24)
    scale = row.initial.residual / outcome.residuals[0]
    np.testing.assert_allclose([row.current.residual / scale for row in outcome.history], outcome.residuals[1:])


@pytest.mark.mpi
def test_a_soft_part_is_solved_for_if_the_displacement_is_judged():
    """Springs a millionth as stiff start farther away: the forces of the others balance before they do."""

    def error(**further):
        domain = square()
        F, u = spring(1.5, domain, ufl.conditional(ufl.gt(ufl.SpatialCoordinate(domain)[0], 0.45), 1e-6, 1.0))
        u.interpolate(lambda x: 1.5 + np.where(x[0] > 0.45, 0.26, 0.01))
        criteria = Criteria(Tolerances(rtol=1e-4, **further))
        with NonlinearProblem(F, u, petsc_options_prefix="s_", petsc_options=EXACT, criteria=criteria) as problem:
            assert problem.solve("basic").converged
        return domain.comm.allreduce(np.abs(u.x.array - 1.5).max(), MPI.MAX)

    assert error() > 0.1
    assert error(dtol=1e-6) < 1e-6 * 0.26, "the last step is longer than what it leaves"
    first, soft = 0.45 * 0.05 * 0.01, 0.55 * 5 * 1e-6  # work of the stiff ones' first step, stiffness of the others
    assert error(etol=1e-9) < np.sqrt(1.1e-9 * first / soft)


@pytest.mark.mpi
def test_full_steps_diverge_and_say_so():
    F, u = spring(1.5, square())
    with NonlinearProblem(F, u, petsc_options_prefix="b_", petsc_options={"snes_max_it": 5}) as problem:
        outcome = problem.solve("basic")
    assert not outcome.converged and outcome.reason < 0 and np.max(np.abs(u.x.array)) > 10.0
    assert outcome.message == "no convergence" and outcome.iterations == 5


@pytest.mark.mpi
@pytest.mark.parametrize("line_search", ["l2", "bt", "basic"])
def test_inverted_elements_end_in_a_sentence_or_are_avoided(line_search):
    with Block(square()) as block:
        block.top.value[:] = 0.0, -1.5  # through the bottom: no solution
        outcome = block.problem.solve(line_search)
        assert not outcome.converged and " " in outcome.message
        block.u.x.array[:] = 0.0
        block.top.value[:] = 0.0, -0.2
        assert block.problem.solve(line_search).converged


@pytest.mark.mpi
def test_a_start_that_is_not_finite_is_named():
    with Block(square()) as block:
        block.u.interpolate(lambda x: np.array([0.0 * x[0], -1.5 * x[1]]))
        outcome = block.problem.solve()
    assert not outcome.converged and "inverted" in outcome.message and outcome.iterations == 0


def test_a_tangent_that_is_not_finite_is_named():
    domain = square()
    V = fem.functionspace(domain, ("Lagrange", 1))
    u = fem.Function(V)
    F = (ufl.sqrt(u) - 1.0) * ufl.TestFunction(V) * ufl.dx  # slope 1/0 at u = 0
    with NonlinearProblem(F, u, petsc_options_prefix="c_") as problem:
        outcome = problem.solve()
    assert not outcome.converged and "tangent not finite" in outcome.message


@pytest.mark.mpi
def test_reactions_balance_the_load():
    domain = square()
    load = np.array([0.03, -0.07])

    def residual(u, v):
        return neo_hookean(u, v) - ufl.dot(fem.Constant(domain, load), v) * ufl.dx

    with Block(domain, residual) as block:
        block.top.value[:] = 0.1, 0.2
        assert block.problem.solve().converged
        np.testing.assert_allclose(block.reaction(0.0) + block.reaction(1.0), -load, atol=1e-8)
        reactions = block.problem.reactions()
        assert (block.problem.residual() - reactions).norm() <= 1e-8 * reactions.norm()
        y = np.repeat(block.V.tabulate_dof_coordinates()[: reactions.local_size // 2, 1], 2)
        assert np.all(reactions.array[(y > 0.01) & (y < 0.99)] == 0.0)


@pytest.mark.mpi
def test_unloading_to_a_state_free_of_forces_converges():
    with Block(square()) as block:
        for stretch in (0.2, 0.0):
            block.top.value[1] = stretch
            assert block.problem.solve().converged
        assert block.problem.solve().iterations == 0
        np.testing.assert_allclose(block.u.x.array, 0.0, atol=1e-9)


@pytest.mark.mpi
def test_a_problem_that_takes_over_what_another_has_kept_goes_on_like_it(monkeypatch):
    """On the way back to no forces only the scale of the solve before tells what is small."""
    monkeypatch.setattr(preconditioners, "DIRECT_LIMIT", {2: 0})

    def unloaded(block):
        block.top.value[1] = 0.0
        return block.problem.solve()

    def block(prefix, **options):
        return Block(square(), petsc_options_prefix=prefix, petsc_options=options)

    with block("first_") as first, block("second_") as second, block("third_") as third:
        first.top.value[1] = 0.2
        multigrid = first.problem.solve("bt")
        assert multigrid.converged
        for other in (second, third):
            other.u.x.array[:] = first.u.x.array
        first.problem.preconditioner.refresh(pattern=True)
        second.problem.kept = kept = first.problem.kept
        assert second.problem.kept == kept == Kept(kept.force, "bt", "bulk") and kept.force > 0.0
        outcomes = [unloaded(block) for block in (first, second, third)]
        starts = [outcome.residuals[0] for outcome in outcomes]
        assert starts[0] == pytest.approx(starts[1], rel=1e-9) and starts[2] > 1.1 * starts[0]
        if WORLD.size == 1:  # several ranks add in the order in which messages arrive
            assert outcomes[0] == outcomes[1]
    with block("failing_", bulk_pc_type="none", ksp_max_it=3) as first, block("other_") as second:
        first.top.value[1] = second.top.value[1] = 0.2
        assert first.problem.solve().converged and first.problem.kept.linear_solver == "direct"
        second.problem.kept = first.problem.kept
        outcome = second.problem.solve()
        assert outcome.converged and second.problem.kept.linear_solver == "direct"
        assert outcome.linear_iterations < multigrid.linear_iterations, "factorised from the start"


@pytest.mark.mpi
def test_ranks_agree_with_one():
    def stretched(comm):
        with Block(square(comm)) as block:
            block.top.value[:] = 0.1, 0.3
            outcome = block.problem.solve()
            assert outcome.converged
            return [*block.reaction(), *outcome.residuals[:3]]

    np.testing.assert_allclose(stretched(WORLD), stretched(MPI.COMM_SELF), rtol=1e-9)


def test_options_stay_with_their_problem():
    everywhere = PETSc.Options()
    everywhere["ksp_type"], everywhere["snes_linesearch_type"] = "bcgs", "cp"
    before = dict(everywhere.getAll())
    try:
        with Block(square(), petsc_options={"snes_max_it": 7}) as block:
            assert block.problem.snes.getKSP().getType() == "fgmres"
            assert block.problem.snes.getTolerances()[3] == 7
            assert everywhere["block_snes_max_it"] == "7"
            block.problem.solve()
        assert everywhere.getAll() == before
    finally:
        everywhere.delValue("ksp_type")
        everywhere.delValue("snes_linesearch_type")


def test_a_linear_solver_of_the_user_replaces_the_preset():
    with Block(square(), petsc_options={"pc_type": "jacobi", "ksp_type": "cg", "ksp_rtol": 1e-10}) as block:
        ksp = block.problem.snes.getKSP()
        assert (ksp.getType(), ksp.getPC().getType()) == ("cg", "jacobi")
        block.top.value[1] = 0.1
        assert block.problem.solve().converged


def test_a_problem_without_a_prefix_is_refused():
    with pytest.raises(ValueError, match="petsc_options_prefix"):
        Block(square(), petsc_options_prefix="")


def test_an_unknown_line_search_is_refused():
    with Block(square()) as block, pytest.raises(ValueError, match=r"line_search = 'cubic'.*l2, bt, basic"):
        block.problem.solve("cubic")


@pytest.mark.parametrize(
    ("n_dofs", "ranks", "has_interface", "gdim", "name", "smoother"),
    [
        (10_000, 1, False, 3, "direct", None),
        (9_999, 3, True, 3, "direct", None),
        (60_000, 1, True, 2, "direct", None),
        (25_000, 2, True, 2, "direct", None),
        (10_001, 1, False, 3, "bulk", "richardson"),
        (100_000, 2, False, 3, "bulk", "chebyshev"),
        (10_000, 1, True, 3, "factor", None),
        (5_000_000, 1, True, 3, "crack", "richardson"),
        (500_000, 2, True, 2, "crack", "chebyshev"),
    ],
)
@pytest.mark.parametrize(("symmetric", "factor"), [(True, "cholesky"), (False, "lu")])
def test_preset_by_size(n_dofs, ranks, has_interface, gdim, name, smoother, symmetric, factor):
    preset = preset_for(n_dofs, symmetric, ranks, has_interface, gdim)
    assert preset.name == name
    assert preset.kept.get("mg_levels_ksp_type") == smoother
    factorised = preset.kept if name == "direct" else preset.strip
    assert preset.kept["pc_type"] == {"direct": factor, "factor": "cholesky"}.get(name, "gamg")
    assert factorised.get("pc_type") == (None if name == "bulk" else factor)


def test_small_problems_of_the_plane_have_a_factor_of_their_own():
    """It is checked by the Krylov method, and where it needs pivots MUMPS finds them."""
    native = preset_for(25_000, True, 1, True, 2)
    assert native.name == "native" and native.kept["pc_factor_mat_solver_type"] == "petsc"
    assert preset_for(1_000, True, 1, True, 2, saddle_point=True).name == "direct"
    assert fallback_for(native, 25_000, True, 1).name == "direct"


def test_a_factor_that_needs_pivots_is_replaced(caplog):
    def crossed(u, v):
        return ((u[0] - 1.0) * v[1] + (u[1] - 2.0) * v[0]) * ufl.dx

    with Block(square(MPI.COMM_SELF), crossed, bcs=[]) as block:
        assert block.problem.linear_solver.startswith("a factorisation without pivots")
        assert block.problem.solve().converged and block.problem.kept.linear_solver == "direct"
        np.testing.assert_allclose(block.u.x.array.reshape(-1, 2), np.tile([1.0, 2.0], (81, 1)), rtol=1e-9)
    assert "'native' failed: 'direct' from now on" in caplog.text


def test_the_fallback_of_a_kept_factor_is_multigrid():
    assert fallback_for(preset_for(100_000, False, 2, True, 3), 100_000, False, 2).name == "crack"


def test_the_fallback_is_a_factorisation_while_it_fits():
    bulk = preset_for(100_000, True, 1, False, 3)
    fallback = fallback_for(bulk, 100_000, True, 1)
    assert fallback is not None and fallback.name == "direct"
    assert fallback_for(bulk, 5_000_000, True, 1) is None
    assert fallback_for(fallback, 100_000, True, 1) is None


@pytest.mark.mpi
@pytest.mark.parametrize("gdim", [2, 3])
def test_rigid_bodies_store_no_energy(gdim):
    create, n = (mesh.create_unit_square, (4, 4)) if gdim == 2 else (mesh.create_unit_cube, (2, 2, 2))
    V = fem.functionspace(create(WORLD, *n), ("Lagrange", 2, (gdim,)))
    A = petsc.assemble_matrix(fem.form(small_strain(ufl.TrialFunction(V), ufl.TestFunction(V))))
    A.assemble()
    modes = rigid_body_modes(V).getVecs()
    assert len(modes) == 3 * (gdim - 1)
    for mode in modes:
        assert (A * mode).norm() < 1e-12 * A.norm()
    np.testing.assert_allclose([[v.dot(w) for v in modes] for w in modes], np.eye(len(modes)), atol=1e-12)


def test_rigid_bodies_need_a_displacement():
    with pytest.raises(ValueError, match="V has 1 components in 2 dimensions"):
        rigid_body_modes(fem.functionspace(square(), ("Lagrange", 1)))


class GluedBlocks(Block):
    """Two halves of a cube held together by springs of `stiffness` per area, solved as if it were large."""

    def __init__(
        self, monkeypatch, n=6, with_strip=True, symmetric=True, coupling=((0,) * 3,) * 3, domain=None, **options
    ):
        for limit in ("DIRECT_LIMIT", "DIRECT_LIMIT_CRACK"):
            monkeypatch.setattr(preconditioners, limit, {3: 0})
        hexahedron, ghosts = mesh.CellType.hexahedron, mesh.GhostMode.shared_facet
        if domain is None:
            domain = mesh.create_unit_cube(WORLD, n, n, n, hexahedron, ghost_mode=ghosts)
        facets = mesh.locate_entities(domain, 2, lambda x: np.isclose(x[2], 0.5))
        V = cracked_space(domain, ("Lagrange", 1, (3,)), facets)
        tags = mesh.meshtags(domain, 2, facets, np.ones(len(facets), dtype=np.int32))
        dS = ufl.Measure("dS", domain=domain, subdomain_data=tags, subdomain_id=1)
        self.stiffness = fem.Constant(domain, 1.0)
        crack = fem.locate_dofs_geometrical(V, lambda x: np.isclose(x[2], 0.5))
        crack = crack[crack < V.dofmap.index_map.size_local]

        def residual(u, v):
            springs = self.stiffness * (ufl.Identity(3) + ufl.as_matrix(coupling))
            return small_strain(u, v) + ufl.dot(springs * ufl.jump(u), ufl.jump(v)) * dS

        structure = Structure(symmetric=symmetric, interface_dofs=crack if with_strip else None)
        super().__init__(domain, residual, V, structure=structure, **options)
        self.top.value[:] = 0.0, 0.1, 0.2

    def iterations(self, stiffness):
        """Krylov iterations of each Newton iteration, from u = 0."""
        self.stiffness.value = stiffness
        self.u.x.array[:] = 0.0
        outcome = self.problem.solve()
        assert outcome.converged
        return outcome.linear_iterations / outcome.iterations


@pytest.mark.mpi
def test_a_crack_of_any_stiffness_takes_few_iterations(monkeypatch):
    """The multigrid part is built once, at the first stiffness, and kept."""
    n = 6
    with GluedBlocks(monkeypatch, n) as blocks:
        for over_E_per_h in (1.0, 1e1, 1e2, 1e3, 1e4, 1e-2, -0.02):
            assert blocks.iterations(over_E_per_h * E * n) <= 20
        assert blocks.problem.preconditioner.builds == 1


def test_the_strip_matters(monkeypatch):
    with GluedBlocks(monkeypatch, with_strip=False) as blocks:
        blocks.iterations(6.0)
        assert blocks.iterations(6e3) > 20


class SkewBlocks(GluedBlocks):
    """Blocks with springs that answer to sliding with a pressure: the tangent is unsymmetric, as with friction."""

    def __init__(self, monkeypatch, prefix, domain=None, **options):
        monkeypatch.setattr(preconditioners, "FACTOR_FROM", 0)
        skew = ((0, 0, 0), (0, 0, 0), (0.9, 0, 0))
        options = {"petsc_options_prefix": prefix, "petsc_options": options}
        super().__init__(monkeypatch, symmetric=False, coupling=skew, domain=domain, **options)
        self.stiffness.value = 100.0

    def solve(self):
        """The displacement, from zero, and how many Krylov iterations a Newton iteration took."""
        self.u.x.array[:] = 0.0
        outcome = self.problem.solve()
        assert outcome.converged
        return self.u.x.array.copy(), outcome.linear_iterations / outcome.iterations


@pytest.mark.mpi
@pytest.mark.parametrize("stiffness", [1e3, 1.0, -1.0])  # the last one makes the tangent indefinite
def test_a_kept_factor_finds_the_solution_of_an_exact_one(monkeypatch, stiffness):
    # one mesh for both, since two of them may be divided among the ranks in two ways
    with (
        SkewBlocks(monkeypatch, "kept_") as kept,
        SkewBlocks(monkeypatch, "exact_", domain=kept.V.mesh, **EXACT) as direct,
    ):
        assert kept.problem.kept.linear_solver == "factor"
        kept.solve()
        kept.stiffness.value = direct.stiffness.value = stiffness
        reference, _ = direct.solve()
        of_another_crack, iterations = kept.solve()
        assert kept.problem.preconditioner.builds == 1 and iterations <= 12
        np.testing.assert_allclose(of_another_crack, reference, atol=1e-8 * np.abs(reference).max())
        kept.problem.preconditioner.refresh()
        of_this_one, iterations = kept.solve()
        assert kept.problem.preconditioner.builds >= 2 and iterations <= 6
        np.testing.assert_allclose(of_this_one, reference, atol=1e-8 * np.abs(reference).max())


@pytest.mark.mpi
def test_a_kept_factor_is_made_anew_once_its_excess_has_cost_as_much(monkeypatch):
    with SkewBlocks(monkeypatch, "excess_") as blocks:
        blocks.solve()
        pc = blocks.problem.preconditioner
        assert 0.0 < pc.price != strips.USUAL_PRICE and pc.memory > 0.0
        assert WORLD.allgather(pc.price) == [pc.price] * WORLD.size, "so that all ranks decide alike"
        for later, builds in (((5, 2, 9, 3), 1), ((5, 2, 9, 3, 4), 2)):  # excess over the least: 2, 2, 9, 10, 12
            pc.price, pc.fresh = 10.0, True
            pc.observe(3)
            pc.fresh = False
            for iterations in later:
                pc.observe(iterations)
            blocks.solve()
            assert pc.builds == builds


class BlocksInParts(SkewBlocks):
    """The same, cells and springs given one by one, after a part that is empty and a load that has no tangent."""

    def given(self, form):
        load = self.stiffness * ufl.TestFunction(self.V)[0] * ufl.dx
        return [ufl.Form([]), load, *(ufl.Form([integral]) for integral in form.integrals()), -load]


@pytest.mark.mpi
def test_parts_add_up_to_the_whole(monkeypatch):
    found, domain = [], None
    for kind in (SkewBlocks, BlocksInParts):
        with kind(monkeypatch, "parts_", domain=domain) as blocks:
            u, _ = blocks.solve()
            domain = blocks.V.mesh
            problem = blocks.problem
            matrix = problem.snes.getJacobian()[0]
            found.append((u, problem.residual().array.copy(), matrix.norm(), matrix.getDiagonal().array.copy()))
    for whole, parts in zip(*found, strict=True):
        np.testing.assert_allclose(parts, whole, rtol=1e-9, atol=1e-9)


@pytest.mark.mpi
def test_multigrid_takes_over_where_memory_is_short(monkeypatch, caplog):
    with (
        SkewBlocks(monkeypatch, "short_", factor_mat_mumps_icntl_23=1) as short,
        SkewBlocks(monkeypatch, "a_", domain=short.V.mesh) as ample,
    ):
        u, _ = short.solve()
        assert short.problem.kept.linear_solver == "crack" and "multigrid" in short.problem.linear_solver
        reference, _ = ample.solve()
        assert ample.problem.kept.linear_solver == "factor" and "MB on a rank" in ample.problem.linear_solver
        np.testing.assert_allclose(u, reference, atol=1e-8)
    if WORLD.rank == 0:
        assert "'factor' failed, its factor would need about" in caplog.text and "'crack' from now on" in caplog.text


@pytest.mark.mpi
@pytest.mark.parametrize("contrast", [8.0, 1e4])  # slow after the first, not converged at all after the second
def test_a_stale_preconditioner_is_rebuilt(contrast):
    """A stiff island grows in the body: the factorisation of before is of little use, and replaced."""
    domain = square(n=16)
    modulus = fem.Constant(domain, 1.0)
    x = ufl.SpatialCoordinate(domain)
    island = ufl.conditional(ufl.lt((x[0] - 0.5) ** 2 + (x[1] - 0.5) ** 2, 0.1), modulus, 1.0 + x[0])
    with Block(domain, lambda u, v: small_strain(u, v, island)) as block:
        iterations, builds = [], []
        for value in (1.0, contrast, contrast):
            modulus.value = value
            block.u.x.array[:] = 0.0
            block.top.value[:] = 0.1, 0.2
            outcome = block.problem.solve()
            assert outcome.converged
            iterations.append(outcome.linear_iterations)
            builds.append(block.problem.preconditioner.builds)
            # one more tangent, so that what the last solve taught can be used
            modulus.value = 1.01 * value
            assert block.problem.solve().converged
        assert (iterations[0], builds[0]) == (1, 1)
        assert iterations[1] > 8
        assert iterations[2] < 8 and block.problem.preconditioner.builds == 2


def test_a_source_left_half_built_is_removed(tmp_path):
    for name in ("whole.c", "whole.c.cached", "half.c", "half.o"):
        (tmp_path / name).touch()
    compiled(MPI.COMM_SELF, lambda: None, tmp_path)
    assert {p.name for p in tmp_path.glob("*.c*")} == {"whole.c", "whole.c.cached"}
    assert not list((tmp_path / "compiling").iterdir())


def test_a_source_is_kept_while_somebody_could_be_compiling_it(tmp_path):
    def somebody():
        (tmp_path / "theirs.c").touch()
        compiled(MPI.COMM_SELF, lambda: None, tmp_path)
        assert (tmp_path / "theirs.c").exists()

    compiled(MPI.COMM_SELF, somebody, tmp_path)
    compiled(MPI.COMM_SELF, lambda: None, tmp_path)
    assert not (tmp_path / "theirs.c").exists()


@pytest.mark.mpi
def test_a_wait_for_a_process_that_was_killed_is_repeated(tmp_path):
    folder = Path(WORLD.bcast(str(tmp_path)))
    tries = []

    def waits():
        tries.append((folder / "half.c").exists())
        if WORLD.rank == 0 and len(tries) == 1:
            (folder / "half.c").touch()
        if len(tries) == 1:  # the words of rank 0 and those of the others
            raise RuntimeError("JIT compilation timed out" if WORLD.rank == 0 else "JIT compilation failed on rank 0.")
        return "kernel"

    assert compiled(WORLD, waits, folder) == "kernel"
    assert len(tries) == 2 and not tries[1]


def test_forms_that_differ_in_the_markers_of_their_domains_are_compiled_once():
    quads = square(MPI.COMM_SELF, 4)
    measures = Measures(quads)
    four = np.arange(4, dtype=np.int32)
    everywhere, part = measures.cells(), measures.cells(four)
    x = ufl.SpatialCoordinate(quads)[0]
    kernels = compat.form(x * everywhere), compat.form(x * part)
    assert kernels[0].module.__name__ == kernels[1].module.__name__
    expected = mesh.compute_midpoints(quads, 2, four)[:, 0].sum() / 16
    assert [integrate(kernel) for kernel in kernels] == pytest.approx([0.5, expected])
    assert integrate(compat.form(x * part + 2 * x * everywhere)) == pytest.approx(1 + expected)


@pytest.mark.mpi
def test_a_cache_that_cannot_be_written_is_named_on_all_ranks(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(RuntimeError, match=r"cannot be kept in .*: set XDG_CACHE_HOME"):
        compiled(WORLD, lambda: pytest.fail("nothing is compiled"), tmp_path / "file" / "cache")
