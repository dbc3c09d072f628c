"""Supports on one face of a crack, forces on points and lines, and the lengths and areas of named facets."""

import basix.ufl
import numpy as np
import pytest
from dolfinx import fem, mesh
from mpi4py import MPI

from cutsim.analysis.mechanics import Mechanics
from cutsim.base.compat import create_mesh
from cutsim.bodies.loads import Support
from cutsim.bodies.nodal_loads import LineLoad, NodalForce
from cutsim.bodies.solid import Solid
from cutsim.cases import CaseError, read_case
from cutsim.fields.areas import area
from cutsim.fields.meshing import tag_mesh
from cutsim.fields.state import State
from cutsim.materials.elastic import LinearElastic
from helpers.blocks import make_blocks
from helpers.meshes import HEXAHEDRON, TETRAHEDRON, box, rectangle
from helpers.runs import final

COMM = MPI.COMM_WORLD


@pytest.mark.mpi
def test_a_support_holds_one_face_of_a_crack():
    """What the bond carries to the held face goes no further: the block behind it is at rest."""
    b = make_blocks()
    crack = b.crack()
    top = Support(b.state, b.face(1, 1.0), 1, lambda t: 0.02 * t, name="top")
    face = Support(b.state, crack.surface("+"), 1, name="face")
    bottom = Support(b.state, b.face(1, 0.0), 1, name="bottom")
    supports = [top, face, Support(b.state, crack.surface("+"), 0), bottom]
    row = final(Mechanics(b.state, [b.solid(), crack], supports), step=1.0)
    assert row["top_force"] > 1e-3
    assert row["face_force"] == pytest.approx(-row["top_force"], rel=1e-9)
    assert abs(row["bottom_force"]) < 1e-12
    nodes = Support(b.state, b.lower, 0, dim=2).nodes
    assert COMM.allreduce(np.abs(b.state.u.x.array.reshape(-1, 2)[nodes, 1]).max(initial=0.0), MPI.MAX) < 1e-14


def cube(cell, degree):
    return State(fem.functionspace(box(cell, n=2), ("Lagrange", degree, (3,))))


def edge_of(state):
    """Vertices of the upper front edge of the unit cube."""
    return mesh.locate_entities(state.mesh, 0, lambda x: np.isclose(x[1], 0.0) & np.isclose(x[2], 1.0))


@pytest.mark.mpi
@pytest.mark.parametrize("cell", [HEXAHEDRON, TETRAHEDRON])
@pytest.mark.parametrize("degree", [1, 2])
def test_line_load_does_the_work_of_its_line(cell, degree):
    """Nodal forces along a displacement of the elements' degree do the work ∫ q·u ds, here ∫ s^degree ds."""
    state = cube(cell, degree)
    load = LineLoad(state, edge_of(state), (0.0, 0.0, -3.0), 2.0)
    dofs, forces = load.forces()
    state.u.interpolate(lambda x: np.stack([0 * x[0], 0 * x[0], x[0] ** degree]))
    work = COMM.allreduce(float(forces @ state.u.x.array[dofs]))
    assert load.length == pytest.approx(1.0)
    assert work == pytest.approx(-6.0 / (degree + 1))


def test_lines_that_are_none_are_refused():
    state = cube(HEXAHEDRON, 1)
    face = mesh.locate_entities(state.mesh, 0, lambda x: np.isclose(x[2], 1.0))
    with pytest.raises(ValueError, match="more than two edges meet"):
        LineLoad(state, face, (0.0, 0.0, 1.0), 1.0)
    with pytest.raises(ValueError, match="with edges of the mesh between them"):
        LineLoad(state, face[:1], (0.0, 0.0, 1.0), 1.0)
    with pytest.raises(ValueError, match="of a mesh in space"):
        LineLoad(make_blocks().state, face[:2], (0.0, 1.0), 1.0)


@pytest.mark.mpi
def test_work_of_nodal_forces():
    """A linear body stores half the force times the way of its points of attack, and the supports carry the force."""
    state = cube(HEXAHEDRON, 1)
    bottom = mesh.locate_entities_boundary(state.mesh, 2, lambda x: np.isclose(x[2], 0.0))
    supports = [Support(state, bottom, i, name=f"bottom_{'xyz'[i]}") for i in range(3)]
    corner = mesh.locate_entities(state.mesh, 0, lambda x: np.isclose(x, 1.0).all(axis=0))
    point = NodalForce(state, corner, (0.0, 0.1, 0.0), lambda t: t, name="point")
    line = LineLoad(state, edge_of(state), (0.0, 0.0, -0.2), lambda t: t, name="line")
    row = final(Mechanics(state, [Solid(state, LinearElastic(10.0, 0.3)), point, line], supports), step=1.0)
    assert row["bottom_y_force"] == pytest.approx(-0.1, rel=1e-8)
    assert row["bottom_z_force"] == pytest.approx(0.2, rel=1e-8)
    work = 0.5 * sum(COMM.allreduce(float(f @ state.u.x.array[d])) for d, f in (point.forces(), line.forces()))
    assert row["work_external"] == pytest.approx(work, rel=1e-12)
    assert row["energy_strain"] == pytest.approx(work, rel=1e-8)


# -- lengths and areas -------------------------------------------------------------------------------------------------


@pytest.mark.mpi
@pytest.mark.parametrize("cell", [HEXAHEDRON, TETRAHEDRON])
def test_area_of_named_facets(cell):
    """Outer and inner facets alike, and of a sheared cube."""
    domain = box(cell)
    domain.geometry.x[:, 0] += 0.5 * domain.geometry.x[:, 2]
    half = {"side": lambda x: np.isclose(x[0], 0.5 * x[2]), "middle": lambda x: np.isclose(x[2], 0.5)}
    tagged = tag_mesh(domain, {}, half)
    assert tagged.area("side") == pytest.approx(np.sqrt(1.25))
    assert tagged.area("middle") == pytest.approx(1.0)


@pytest.mark.mpi
def test_area_of_revolution():
    domain = rectangle([(1, 0), (3, 2)], (3, 4))
    faces = {"outside": lambda x: np.isclose(x[0], 3), "top": lambda x: np.isclose(x[1], 2)}
    tagged = tag_mesh(domain, {}, faces)
    assert tagged.area("outside") == pytest.approx(2.0)
    assert tagged.area("outside", axisymmetric=True) == pytest.approx(12 * np.pi)
    assert tagged.area("top", axisymmetric=True) == pytest.approx(8 * np.pi)


def test_length_of_curved_facets():
    """The parabola y = −4 s x (1 − x) is an edge of a triangle with nodes on its edges."""
    sag = 0.1
    points = np.array([[0, 0], [1, 0], [0, 1], [0.5, 0.5], [0, 0.5], [0.5, -sag]])
    element = basix.ufl.element("Lagrange", "triangle", 2, shape=(2,))
    domain = create_mesh(MPI.COMM_SELF, np.arange(6)[None], points, element)
    domain.topology.create_entities(1)
    domain.topology.create_connectivity(1, 2)
    middle = mesh.compute_midpoints(domain, 1, np.arange(3, dtype=np.int32))
    bottom = np.array([i for i in range(3) if np.isclose(middle[i, 0], 0.5) and middle[i, 1] < 0.1], dtype=np.int32)
    exact = 0.5 * np.sqrt(1 + 16 * sag**2) + np.arcsinh(4 * sag) / (8 * sag)
    assert area(domain, bottom) == pytest.approx(exact, rel=1e-6)


# -- case files --------------------------------------------------------------------------------------------------------

#: Two cubes of side 2 mm on each other.
CUBES = """*NODE
{nodes}
*ELEMENT, TYPE=C3D8, ELSET=lower
1, 1, 2, 4, 3, 5, 6, 8, 7
*ELEMENT, TYPE=C3D8, ELSET=upper
2, 5, 6, 8, 7, 9, 10, 12, 11
*NSET, NSET=edge
9, 10
*NSET, NSET=ground
1, 2, 3, 4
*NSET, NSET=seam
5, 6, 7, 8
""".format(
    nodes="\n".join(
        f"{1 + i + 2 * j + 4 * k}, {2 * i}, {2 * j}, {2 * k}" for k in range(3) for j in range(2) for i in range(2)
    )
)
CASE = """
title = "loads"
[mesh]
file = "cubes.inp"
dim = 3
[material]
model = "linear-elastic"
young = 100
poisson = 0.3
[bodies.lower]
cells = "lower"
density = "1 kg/dm^3"
[bodies.upper]
cells = "upper"
density = "3 kg/dm^3"
[crack]
facets = "seam"
plus = "lower"
law = { model = "bilinear", penalty = 100, strength = 10, toughness = 10, shear_strength = 10, shear_toughness = 10 }
[supports.hold]
facets = "crack+"
direction = "all"
[supports.ground]
facets = "ground"
direction = "all"
[loads.line]
kind = "line"
vertices = "edge"
direction = "-z"
value = "0.5 N/mm"
[loads.point]
kind = "force"
points = [[2, 2, 4]]
direction = "x"
value = "0.25*t"
[loads.gravity]
kind = "weight"
bodies = "upper"
direction = "-z"
value = "10 m/s^2"
[analysis]
until = 1
[steps]
fixed = 1
"""


@pytest.fixture
def written(tmp_path):
    (tmp_path / "cubes.inp").write_text(CUBES, encoding="utf-8")

    def write(text):
        path = tmp_path / "case.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_loads_of_a_case(written):
    """What acts on the upper body alone is held by the face on which it stands."""
    simulation = read_case(written(CASE)).build(COMM)
    row = final(simulation.problem, step=1.0)
    weight = 3e-9 * 1e4 * 8
    assert row["hold_z_force"] == pytest.approx(0.5 * 2 + weight, rel=1e-8)
    assert row["hold_x_force"] == pytest.approx(-0.25, rel=1e-8)
    assert row["gravity_force_z"] == pytest.approx(-weight)
    assert simulation.domain.area("seam") == pytest.approx(4.0)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('vertices = "edge"', 'vertices = "egde"', "edge"),
        ("[[2, 2, 4]]", "[[2, 2, 14]]", "no vertex of the mesh is near"),
        ('facets = "crack+"', 'facets = ["crack+", "ground"]', "one face of a crack alone"),
        ('bodies = "upper"', 'bodies = "uper"', "upper"),
    ],
)
def test_places_that_are_none_are_refused_by_name(written, old, new, words):
    with pytest.raises(CaseError, match=words):
        read_case(written(CASE.replace(old, new))).build(COMM)
