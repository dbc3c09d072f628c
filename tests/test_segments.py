"""Integration over the parts of slave facets that face one master facet each (docs/theory.md §3.5)."""

import basix.ufl
import numpy as np
import pytest
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI
from scipy.spatial import Delaunay

from cutsim.analysis.stepping import begin
from cutsim.base.compat import create_mesh, geometry_nodes
from cutsim.fields.state import State
from cutsim.pairs.surface_pair import SurfacePair
from cutsim.pairs.tiles import divided_interval, divided_polygon, simple_parts
from helpers.boxes import Stack, stack, two
from helpers.laws import EXPONENTIAL, E
from helpers.pressing import pressed, stresses

SAME = 1e-10


def area(polygon):
    x, y = np.array(polygon).T
    return 0.5 * (x @ np.roll(y, -1) - y @ np.roll(x, -1))


def within(tile, triangle):
    """Whether all corners of a tile are in a triangle."""
    a, *edges = np.asarray(triangle)
    shares = np.linalg.solve((np.array(edges) - a).T, (np.array(tile) - a).T)
    return shares.min() > -1e-8 and shares.sum(axis=0).max() < 1 + 1e-8


@pytest.mark.parametrize("own", [((0, 0), (1, 0), (0, 1)), ((0, 0), (1, 0.1), (1.2, 0.9), (-0.1, 1))])
def test_tiles_lie_in_one_of_some_triangles_each(own):
    """The triangles cover the plane around the polygon, whose tiles then lie in one of them each."""
    random = np.random.default_rng(5)
    x = np.vstack([random.uniform(-0.5, 1.5, (40, 2)), [(-9, -9), (9, -9), (-9, 9), (9, 9)]])
    triangles = x[Delaunay(x).simplices]
    tiles = divided_polygon(own, triangles.tolist(), SAME)
    assert min(map(area, tiles)) > 0
    assert sum(map(area, tiles)) == pytest.approx(area(own), rel=1e-13)
    assert all(any(within(tile, t) for t in triangles) for tile in tiles)
    parts = [part for tile in tiles for part in simple_parts(tile)]
    assert {len(part) for part in parts} == {3, 4}
    assert sum(map(area, parts)) == pytest.approx(area(own), rel=1e-13)


@pytest.mark.parametrize("turn", [1, -1], ids=["counter-clockwise", "clockwise"])
def test_tiles_cover_a_polygon_also_where_others_overlap_or_leave_gaps(turn):
    own = [(0, 0), (1, 0), (1, 1), (0, 1)]
    squares = [np.array(own)[::turn] * 0.5 + shift for shift in ((0.2, 0.2), (0.4, 0.3), (3, 3), (0.2, 0.2))]
    tiles = divided_polygon(own, [square.tolist() for square in squares], SAME)
    assert min(map(area, tiles)) > 0
    assert sum(map(area, tiles)) == pytest.approx(1, rel=1e-13)
    assert area(tiles[0]) == pytest.approx(0.25), "what lies in several belongs to the first"


def test_edges_that_are_the_same_divide_nothing():
    own = [(0, 0), (1, 0), (1, 1), (0, 1)]
    beside = (np.array(own) + np.array([1 + 1e-13, 1e-13])).tolist()
    flat = [(0.2, 0.2), (0.8, 0.2), (0.5, 0.2)]
    assert divided_polygon(own, [(np.array(own) + 1e-13).tolist(), beside, flat], SAME) == [own]
    assert divided_interval(2.0, [-3, 1e-13, 2 + 1e-13, 5], SAME) == [[(0.0,), (2.0,)]]
    assert divided_interval(2.0, [1.5, 0.5, 1.5 + 1e-13], SAME) == [
        [(0.0,), (0.5,)],
        [(0.5,), (1.5,)],
        [(1.5,), (2.0,)],
    ]


def bent(b):
    """Move the nodes of two boxes along their interface, each by another amount, so that no facet keeps its shape."""
    domain = b.state.mesh
    for box, size in enumerate((-0.07, 0.11)):
        nodes = np.unique(geometry_nodes(domain)[b.cells(box)])
        x = domain.geometry.x[nodes]
        x[:, : b.gdim - 1] += size * np.prod(np.sin(np.pi * x[:, : b.gdim - 1]), axis=1)[:, None]
        domain.geometry.x[nodes] = x
    return b


def patch(b, **options):
    """Largest error of the stress in a cell over the stress, which is uniform, of two boxes pressed on each other."""
    pair = b.pair(**options)
    mechanics = pressed(b, pair)
    begin(mechanics, 1.0)
    assert mechanics.solve("basic").converged
    expected = -E * 0.01 / (2 + E / pair.contact.stiffness)
    return b.state.mesh.comm.allreduce(np.abs(stresses(b) / expected - 1).max(initial=0.0), MPI.MAX)


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize(
    ("gdim", "simplices"), [(2, False), (2, True), (3, False), pytest.param(3, True, marks=pytest.mark.mpi)]
)
def test_patch(gdim, simplices, degree):
    """A uniform pressure passes meshes that do not match as it passes one mesh, in contact as in a bond."""
    options = {"n": (2, 3), "simplices": simplices, "degree": degree}
    # surfaces that just touch count as pressed by 1e-12 of a facet, a ten-thousandth of what these are pressed
    for kind, most in ({"small_sliding": True, "two_pass": True}, 1e-12), ({"law": EXPONENTIAL}, 1e-12), ({}, 1e-10):
        b = two(gdim, **options)
        assert patch(b if gdim == 3 and not simplices else bent(b), **kind) < most


@pytest.mark.parametrize("degree", [1, 2])
def test_patch_of_quadrilaterals_of_any_shape(degree):
    """Shape functions of the master are no polynomials of the place then, and a quadrature is not exact."""
    assert patch(bent(two(3, degree=degree, comm=MPI.COMM_SELF)), small_sliding=True) < 5e-5


@pytest.mark.mpi
@pytest.mark.parametrize("overhang", [0.0, 0.13])
def test_area_of_revolution(overhang):
    """The points of a disc on a larger one weigh with the circumference, where they have partners and where not."""
    flat = stack(([0, -1], [1, 0], (4, 1)), ([0, 0], [1 + overhang, 1], (5, 1)))
    b = Stack(State(flat.state.V, axisymmetric=True), flat.boxes)
    first = b.pair(law=EXPONENTIAL, small_sliding=True).passes[0]
    assert first.points.integral(np.ones_like(first.points.weights)) == pytest.approx(
        np.pi * (1 + overhang) ** 2, 1e-13
    )
    assert first.points.integral(first.bonded) == pytest.approx(np.pi, 1e-13), "up to the edge of the master"


@pytest.mark.parametrize("gdim", [2, 3])
def test_a_bond_ends_where_the_master_ends(gdim):
    """Facets that hang over are bonded up to the edge."""
    low, n = [0.0] * (gdim - 1), gdim - 1
    b = stack(
        ([*low, -1], [1.0] * n + [0], [3] * n + [1]), ([*low, 0], [1.3] * n + [1], [4] * n + [1]), comm=MPI.COMM_SELF
    )
    first = b.pair(law=EXPONENTIAL, small_sliding=True).passes[0]
    assert first.points.integral(first.bonded) == pytest.approx(1, rel=1e-13)


def arched(gdim, n, height):
    """Two boxes whose interface is an arch, on facets with curved edges that meet it exactly."""
    flat = two(gdim, n=n, degree=2, comm=MPI.COMM_SELF)
    x = flat.state.V.tabulate_dof_coordinates()[:, :gdim]
    x[:, -1] += height * x[:, 0] * (1 - x[:, 0]) * (1 - x[:, -1] ** 2)
    element = basix.ufl.element("Lagrange", flat.state.mesh.topology.cell_name(), 2, shape=(gdim,))
    domain = create_mesh(MPI.COMM_SELF, flat.state.V.dofmap.list.astype(np.int64), x, element)
    b = Stack(State(fem.functionspace(domain, ("Lagrange", 2, (gdim,)))), flat.boxes)

    def on_arch(x):
        return np.isclose(x[gdim - 1], height * x[0] * (1 - x[0]))

    facets = mesh.locate_entities_boundary(domain, gdim - 1, on_arch)
    domain.topology.create_connectivity(gdim - 1, gdim)
    owners = domain.topology.connectivity(gdim - 1, gdim)
    above = np.isin([owners.links(f)[0] for f in facets], b.cells(1))
    return b, facets[above], facets[~above]


@pytest.mark.parametrize("gdim", [2, 3])
def test_nodes_of_a_curved_master(gdim):
    """A pressure of one acts on them as if it were integrated over the facets of the master itself."""
    b, slave, master = arched(gdim, (2, 3), 0.4)
    first = SurfacePair(b.state, slave, master, young=E, small_sliding=True, search=0.1).passes[0]
    pairs, shared = first.partners(), first.kinematics.master
    assert len(pairs.hits.points) == first.points.weights.size
    assert np.abs(pairs.hits.gap).max() < 1e-12
    V = fem.functionspace(b.state.mesh, ("Lagrange", 2))
    forces = np.zeros(V.dofmap.index_map.size_local)
    np.add.at(forces, shared.global_nodes[pairs.hits.facets], first.weights[pairs.hits.points, None] * pairs.values)
    expected = fem.assemble_vector(fem.form(ufl.TestFunction(V) * b.state.measures.exterior(master))).array
    np.testing.assert_allclose(forces, expected, atol=1e-6 * expected.max())


def test_a_slave_that_is_much_coarser_is_not_divided():
    """Every facet would have as many points as the one that faces hundreds of facets of the master."""
    b = two(3, n=(9, 1), comm=MPI.COMM_SELF)
    assert b.pair().passes[0].points.weights.shape == (1, 9)
    assert two(3, n=(4, 1), comm=MPI.COMM_SELF).pair().passes[0].points.weights.shape == (1, 64)
