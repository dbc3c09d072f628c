"""The cracked space against dof counts, spectra and solutions known in closed form or from one rank."""

import gc
import weakref

import basix.ufl
import numpy as np
import pytest
import ufl
from dolfinx import fem, la, mesh
from dolfinx.fem.petsc import assemble_matrix
from dolfinx.io import VTXWriter
from mpi4py import MPI

from cutsim.base.compat import form
from cutsim.fields.space import crack_measure_entities, cracked_space, locate_dofs
from cutsim.solvers.convergence import Criteria, Tolerances
from cutsim.solvers.newton import NonlinearProblem
from helpers.meshes import (
    CELLS,
    CRACKS,
    HEXAHEDRON,
    INTERVALS,
    PARTITIONERS,
    QUADRILATERAL,
    TETRAHEDRON,
    TRIANGLE,
    box,
    facets_of,
    upright,
)

WORLD = MPI.COMM_WORLD


every_partition = pytest.mark.parametrize("partition", list(PARTITIONERS) if WORLD.size > 1 else ["compact"])


def gathered(V, form):
    """The matrix of a form as a dense array, rows in the global order of the dofs, on every rank."""
    A = assemble_matrix(fem.form(form))
    A.assemble()
    indptr, columns, values = A.getValuesCSR()
    rows = np.zeros((len(indptr) - 1, A.getSize()[1]))
    rows[np.repeat(np.arange(len(indptr) - 1), np.diff(indptr)), columns] = values
    A.destroy()
    return np.vstack(V.mesh.comm.allgather(rows))


def sides(domain):
    """The cells left and right of x = 1/2."""
    markers = (lambda x: x[0] < 0.5 + 1e-9, lambda x: x[0] > 0.5 - 1e-9)
    return [mesh.locate_entities(domain, domain.topology.dim, marker) for marker in markers]


def integral(form):
    return WORLD.allreduce(fem.assemble_scalar(fem.form(form)))


def poisson(V, source, bcs):
    """Solution of −Δu = source."""
    uh, v = fem.Function(V), ufl.TestFunction(V)
    F = (ufl.inner(ufl.grad(uh), ufl.grad(v)) - fem.Constant(V.mesh, source) * v) * ufl.dx
    with NonlinearProblem(
        F, uh, petsc_options_prefix="poisson_", bcs=bcs, criteria=Criteria(Tolerances(rtol=1e-12))
    ) as problem:
        assert problem.solve().converged
    return uh


def plus_measure(domain, facets, plus):
    entities = crack_measure_entities(domain, facets, plus)
    return ufl.Measure("dS", domain=domain, subdomain_data=[(3, entities)])(3)


@pytest.mark.parametrize("crack", CRACKS)
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("cell", CELLS)
def test_number_of_dofs(cell, degree, crack):
    domain = box(cell)
    gdim, m = domain.geometry.dim, INTERVALS * degree
    markers, points, _ = CRACKS[crack]
    facets = facets_of(domain, markers)
    expected = points(m, m // 2) * (m + 1) ** (gdim - 2)
    for shape in ((), (gdim,)):
        V = cracked_space(domain, ("Lagrange", degree, shape), facets)
        assert V.dofmap.index_map.size_global == expected
        assert V.dofmap.index_map_bs == V.dofmap.bs == (gdim if shape else 1)


@pytest.mark.mpi
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("cell", [TETRAHEDRON, HEXAHEDRON])
def test_front_of_a_crack_wholly_inside_a_body_is_shared(cell, degree):
    domain, m = box(cell), INTERVALS * degree
    facets = facets_of(domain, [lambda x: upright(0.25, 0.75)(x) & (np.abs(x[2] - 0.5) < 0.25 + 1e-9)])
    V = cracked_space(domain, ("Lagrange", degree), facets)
    assert V.dofmap.index_map.size_global == (m + 1) ** 3 + (m // 2 - 1) ** 2


@pytest.mark.mpi
@every_partition
@pytest.mark.parametrize("crack", ["inside", "corner", "tee", "cross"])
@pytest.mark.parametrize("cell", CELLS)
def test_spectrum_is_that_of_one_rank_with_one_zero_for_each_body(cell, crack, partition):
    """-Δ: nullspace of one constant for each body; the whole spectrum does not know of the partition."""

    def eigenvalues(domain):
        V = cracked_space(domain, ("Lagrange", 1), facets_of(domain, CRACKS[crack][0]))
        K = gathered(V, ufl.inner(ufl.grad(ufl.TrialFunction(V)), ufl.grad(ufl.TestFunction(V))) * ufl.dx)
        assert np.all(np.diag(K) > 0)
        return np.linalg.eigvalsh(K)

    found = eigenvalues(box(cell, partition))
    assert np.sum(np.abs(found) < 1e-10) == CRACKS[crack][2]
    np.testing.assert_allclose(found, eigenvalues(box(cell, comm=MPI.COMM_SELF)), atol=1e-10)


@pytest.mark.mpi
@pytest.mark.parametrize("crack", ["inside", "tee"])
def test_elastic_bodies_have_three_rigid_motions_each(crack):
    domain = box(TRIANGLE)
    V = cracked_space(domain, ("Lagrange", 2, (2,)), facets_of(domain, CRACKS[crack][0]))
    u, v = ufl.TrialFunction(V), ufl.TestFunction(V)
    K = gathered(V, ufl.inner(ufl.sym(ufl.grad(u)), ufl.sym(ufl.grad(v))) * ufl.dx)
    assert np.sum(np.abs(np.linalg.eigvalsh(K)) < 1e-10) == 3 * CRACKS[crack][2]


@pytest.mark.mpi
@every_partition
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("cell", CELLS)
def test_step_function_jumps_by_one_over_the_area(cell, degree, partition):
    domain = box(cell, partition)
    facets = facets_of(domain, [upright(0, 1)])
    left, right = sides(domain)
    u = fem.Function(cracked_space(domain, ("Lagrange", degree), facets))
    u.interpolate(lambda x: 1 + x[0] * x[1] ** (degree - 1), cells0=right)
    u.interpolate(lambda x: x[0] * x[1] ** (degree - 1), cells0=left)
    u.x.scatter_forward()
    for plus, sign in ((right, 1), (left, -1)):
        dS = plus_measure(domain, facets, plus)
        assert integral((u("+") - u("-")) * dS) == pytest.approx(sign, abs=1e-13)
        assert integral((u("+") - u("-")) ** 2 * dS) == pytest.approx(1, abs=1e-13)
    assert integral(ufl.inner(ufl.grad(u), ufl.grad(u)) * ufl.dx) == pytest.approx(
        1 if degree == 1 else 2 / 3, abs=1e-12
    )


@pytest.mark.mpi
@every_partition
@pytest.mark.parametrize("cell", CELLS)
def test_normal_of_the_plus_side_has_one_sign(cell, partition):
    """Also on cells so skewed that their midpoints do not tell the side; the crack is x = ½ + 3(y − ½)."""
    domain = box(cell, partition)
    domain.geometry.x[:, 0] += 3 * (domain.geometry.x[:, 1] - 0.5)
    facets = facets_of(domain, [lambda x: np.isclose(x[0] - 3 * (x[1] - 0.5), 0.5)])
    below = mesh.locate_entities(domain, domain.topology.dim, lambda x: x[0] - 3 * x[1] < -1 + 1e-9)
    n, zeros = ufl.FacetNormal(domain)("+"), [0.0] * (domain.geometry.dim - 2)
    cases = [([1.0, 0.0], 1), ([-1.0, 0.0], -1), ([0.0, 1.0], -1), ([0.0, -2.0], 1), (below, 1)]
    for plus, sign in cases:
        side = plus if plus is below else plus + zeros
        dS = plus_measure(domain, facets, side)
        assert integral(n[0] * dS) == pytest.approx(sign)
        assert integral(n[1] * dS) == pytest.approx(-3 * sign)
        assert integral(abs(n[0]) * dS) == pytest.approx(1)


@pytest.mark.mpi
@every_partition
def test_facets_and_cells_known_to_one_rank_are_enough(partition):
    domain = box(TRIANGLE, partition)
    (facets,) = facets_of(domain, [upright(0, 1)])
    facet_map, cell_map = domain.topology.index_map(1), domain.topology.index_map(2)
    elsewhere = la.vector(facet_map)
    elsewhere.array[facet_map.size_local :] = 1.0
    elsewhere.scatter_reverse(la.InsertMode.add)
    is_shared = (facets < facet_map.size_local) & (elsewhere.array[facets] > 0.0)
    left, _ = sides(domain)
    whole = cracked_space(domain, ("Lagrange", 1), facets)
    entities = crack_measure_entities(domain, facets, left)
    assert WORLD.allreduce(entities.size) == 4 * INTERVALS
    for part in (facets[facets < facet_map.size_local], facets[~is_shared]):
        V = cracked_space(domain, ("Lagrange", 1), [part, part[:1]])
        np.testing.assert_array_equal(V.dofmap.list, whole.dofmap.list)
        np.testing.assert_array_equal(V.dofmap.index_map.ghosts, whole.dofmap.index_map.ghosts)
        owned = left[left < cell_map.size_local]
        np.testing.assert_array_equal(crack_measure_entities(domain, part, owned), entities)


@pytest.mark.mpi
@every_partition
def test_boundary_dofs_are_found_on_both_sides_and_in_the_right_place(partition):
    domain = box(TRIANGLE, partition)
    V = cracked_space(domain, ("Lagrange", 2, (2,)), facets_of(domain, [upright(0, 1)]))
    bottom = mesh.locate_entities_boundary(domain, 1, lambda x: np.isclose(x[1], 0))
    dofs = fem.locate_dofs_topological(V, 1, bottom)
    owned = dofs[dofs < V.dofmap.index_map.size_local]
    assert WORLD.allreduce(owned.size) == 2 * INTERVALS + 2
    x = np.vstack(WORLD.allgather(V.tabulate_dof_coordinates()[owned]))
    expected = np.sort([*np.linspace(0, 1, 2 * INTERVALS + 1), 0.5])
    np.testing.assert_allclose(np.sort(x[:, 0]), expected, atol=1e-14)
    np.testing.assert_allclose(x[:, 1], 0, atol=1e-14)


@pytest.mark.mpi
@every_partition
@pytest.mark.parametrize(
    ("cell", "crack", "dim", "place", "expected"),
    [
        (TRIANGLE, "split", 0, (0.5, 0.0), 2),
        (QUADRILATERAL, "split", 0, (0.5, 0.0), 2),
        (QUADRILATERAL, "cross", 0, (0.5, 0.5), 4),
        (TRIANGLE, "tee", 0, (0.5, 0.5), 3),
        (TRIANGLE, "edge", 0, (0.5, 0.5), 1),
        (HEXAHEDRON, "split", 1, (0.5, 0.0), 2 * (2 * INTERVALS + 1)),
        (TETRAHEDRON, "split", 1, (0.5, 0.0), 2 * (2 * INTERVALS + 1)),
    ],
)
def test_dofs_are_found_on_every_side(partition, cell, crack, dim, place, expected):
    """Vertices and lines of the crack, named by a single rank."""
    domain = box(cell, partition)
    V = cracked_space(domain, ("Lagrange", 2, (domain.geometry.dim,)), facets_of(domain, CRACKS[crack][0]))
    domain.topology.create_entities(dim)
    entities = mesh.locate_entities(domain, dim, lambda x: np.isclose(x[0], place[0]) & np.isclose(x[1], place[1]))
    entities = entities[entities < domain.topology.index_map(dim).size_local]
    dofs = locate_dofs(V, dim, entities)
    assert WORLD.allreduce(int(np.sum(dofs < V.dofmap.index_map.size_local))) == expected
    np.testing.assert_allclose(V.tabulate_dof_coordinates()[dofs, :2] - place, 0, atol=1e-14)


@pytest.mark.mpi
@every_partition
def test_component_collapses_with_its_crack(partition):
    domain = box(TRIANGLE, partition)
    V = cracked_space(domain, ("Lagrange", 2, (2,)), facets_of(domain, CRACKS["tee"][0]))
    u = fem.Function(V)
    for k, cells in enumerate(sides(domain)):
        u.interpolate(lambda x, k=k: (k + x[1], k - x[0] ** 2), cells0=cells)
    component = u.sub(1).collapse()
    assert component.function_space.dofmap.index_map.size_global == V.dofmap.index_map.size_global
    assert integral((component - u[1]) ** 2 * ufl.dx) == 0


@pytest.mark.mpi
def test_continuous_functions_pass_between_the_spaces():
    domain = box(TRIANGLE)
    V = cracked_space(domain, ("Lagrange", 2), facets_of(domain, CRACKS["cross"][0]))
    source, target = fem.Function(fem.functionspace(domain, ("Lagrange", 2))), fem.Function(V)
    source.interpolate(lambda x: x[0] * x[1])
    target.interpolate(source)
    assert integral((target - source) ** 2 * ufl.dx) == 0
    assert integral(target * ufl.dx) == pytest.approx(0.25)


@pytest.mark.mpi
@every_partition
@pytest.mark.parametrize("cell", CELLS)
def test_insulated_bodies_solve_their_own_poisson_problems(cell, partition):
    """-u'' = 1 left and right of an insulating crack at x = ½, u(0) = 0, u(1) = 3: exact in degree 2."""
    domain = box(cell, partition)
    fdim = domain.topology.dim - 1
    V = cracked_space(domain, ("Lagrange", 2), facets_of(domain, [upright(0, 1)]))
    bcs = []
    for place, value in ((0.0, 0.0), (1.0, 3.0)):
        end = mesh.locate_entities_boundary(domain, fdim, lambda x, place=place: np.isclose(x[0], place))
        bcs.append(fem.dirichletbc(value, fem.locate_dofs_topological(V, fdim, end), V))
    uh = poisson(V, 1.0, bcs)
    exact = fem.Function(V)
    for cells, shift in zip(sides(domain), (0, 3), strict=True):
        exact.interpolate(lambda x, shift=shift: x[0] * (1 - x[0]) / 2 + shift, cells0=cells)
    exact.x.scatter_forward()
    assert integral((uh - exact) ** 2 * ufl.dx) < 1e-20


@pytest.mark.mpi
def test_inner_crack_lowers_the_flux_and_opens_symmetrically():
    """u from -1 at x = 0 to 1 at x = 1: the flux is 2 without a crack, less with one, none when split."""
    domain = box(QUADRILATERAL, n=8)
    x = ufl.SpatialCoordinate(domain)
    flux = []
    for facets in (facets_of(domain, [upright(0.25, 0.75)]), facets_of(domain, [upright(0, 1)])):
        V = cracked_space(domain, ("Lagrange", 1), facets)
        ends = mesh.locate_entities_boundary(domain, 1, lambda x: np.isclose(x[0], 0) | np.isclose(x[0], 1))
        given = fem.Function(V)
        given.interpolate(lambda x: 2 * x[0] - 1)
        bc = fem.dirichletbc(given, fem.locate_dofs_topological(V, 1, ends))
        uh = poisson(V, 0.0, [bc])
        flux.append(integral(ufl.inner(ufl.grad(uh), ufl.grad(uh)) * ufl.dx) / 2)
        assert integral(uh * ufl.dx) == pytest.approx(0, abs=1e-12)
        assert integral(uh * (x[1] - 0.5) * (x[0] - 0.5) * ufl.dx) == pytest.approx(0, abs=1e-12)
        dS = plus_measure(domain, facets, [-1.0, 0.0])
        assert integral((uh("+") - uh("-")) * dS) > 0.1
        assert integral((uh("+") + uh("-")) * dS) == pytest.approx(0, abs=1e-12)
    assert 0.2 < flux[0] < 1.9
    assert flux[1] == pytest.approx(0, abs=1e-12)


@pytest.mark.mpi
@pytest.mark.parametrize("cell", [TRIANGLE, HEXAHEDRON])
def test_vtx_writes_it(cell, tmp_path):
    path = WORLD.bcast(tmp_path) / "u.bp"
    domain = box(cell)
    V = cracked_space(domain, ("Lagrange", 2, (domain.geometry.dim,)), facets_of(domain, [upright(0, 1)]))
    with VTXWriter(WORLD, path, [fem.Function(V)]) as writer:
        writer.write(0.0)
    assert sum(file.stat().st_size for file in path.iterdir()) > V.dofmap.index_map.size_global * 8


@pytest.mark.mpi
@pytest.mark.parametrize(
    ("element", "text"),
    [
        (("Lagrange", 3), "degree 1 or 2"),
        (("DG", 1), "continuous Lagrange"),
        (("N1curl", 1), "continuous Lagrange"),
        (basix.ufl.mixed_element([basix.ufl.element("P", "triangle", 1)] * 2), "continuous Lagrange"),
    ],
)
def test_other_elements_are_refused(element, text):
    domain = box(TRIANGLE)
    with pytest.raises(ValueError, match=f"element: .*{text}"):
        cracked_space(domain, element, facets_of(domain, [upright(0, 1)]))


@pytest.mark.mpi
def test_facets_are_checked_on_all_ranks():
    domain = box(TRIANGLE)
    element, none = ("Lagrange", 1), np.empty(0, dtype=np.int32)
    with pytest.raises(ValueError, match=r"facets: 4 lie on the outer boundary, e\.g\. at \[0\.0, 0\.\d"):
        cracked_space(domain, element, facets_of(domain, [upright(0, 1), lambda x: np.isclose(x[0], 0)]))
    for empty in (none, [none, none], []):
        with pytest.raises(ValueError, match="facets: 0 on all ranks"):
            cracked_space(domain, element, empty)
    beyond = np.array([10**6], dtype=np.int32) if WORLD.rank == 0 else none
    with pytest.raises(ValueError, match=r"facets: 1 indices out of range.*1000000"):
        cracked_space(domain, element, beyond)


@pytest.mark.mpi
@pytest.mark.skipif(WORLD.size == 1, reason="one rank needs no ghost cells")
def test_missing_ghost_cells_are_refused():
    domain = mesh.create_unit_square(WORLD, 4, 4, ghost_mode=mesh.GhostMode.none)
    with pytest.raises(ValueError, match=r"mesh: \d+ facets between ranks lack .*GhostMode\.shared_facet"):
        cracked_space(domain, ("Lagrange", 1), facets_of(domain, [upright(0, 1)]))


@pytest.mark.mpi
def test_plus_side_is_checked_on_all_ranks():
    domain = box(QUADRILATERAL)
    facets = facets_of(domain, [upright(0, 1)])
    cells = mesh.locate_entities(domain, 2, lambda x: x[0] > -1)
    upper_left = mesh.locate_entities(domain, 2, lambda x: (x[0] < 0.5 + 1e-9) & (x[1] > 0.5 - 1e-9))
    for plus, count in ((cells, 4), (upper_left, 2)):
        with pytest.raises(ValueError, match=rf"plus: {count} facets have both .* at \[0\.5, 0\.\d"):
            crack_measure_entities(domain, facets, plus)
    with pytest.raises(ValueError, match=r"plus: \[0\. 1\.\] is tangent to 4 facets"):
        crack_measure_entities(domain, facets, [0.0, 1.0])
    for plus in ([0.0, 0.0], [1.0, 0.0, 0.0], [np.nan, 1.0]):
        with pytest.raises(ValueError, match=r"plus\b.* (is no direction|is not allowed)"):
            crack_measure_entities(domain, facets, plus)


def test_what_a_form_was_compiled_for_is_freed(tmp_path):
    """With it go the communicators of its mesh, of which MPICH has some two thousand a process."""

    def compiled():
        V = fem.functionspace(box(QUADRILATERAL), ("Lagrange", 1, (2,)))
        u = fem.Function(V)
        energy = ufl.inner(ufl.grad(u), ufl.grad(u)) ** 2 * ufl.dx
        gradient = ufl.derivative(energy, u, ufl.TestFunction(V))
        form(ufl.derivative(gradient, u, ufl.TrialFunction(V)), jit_options={"cache_dir": str(tmp_path)})
        return weakref.ref(V.mesh)

    held = compiled()
    gc.collect()
    assert held() is None and list(tmp_path.rglob("*.so")), "it was compiled, and nothing keeps it"
