"""Geometries and tagged meshes: measures against closed form, sizes, and the refusal of bad input."""

from itertools import pairwise
from pathlib import Path

import dolfinx
import gmsh
import numpy as np
import pytest
import ufl
from dolfinx import fem
from dolfinx.mesh import CellType, GhostMode
from mpi4py import MPI

from cutsim.base.assembly import box
from cutsim.fields.meshing import TaggedMesh, geometry, read_geo, read_mesh, tag_mesh
from cutsim.fields.refinement import Refinement
from cutsim.fields.sizes import facet_size, global_range, normal_size

MESHES = Path(__file__).parents[1] / "meshes"
COMM = MPI.COMM_WORLD
pytestmark = pytest.mark.mpi

BLOCK = {"Lx": 10, "H": 3, "B": 4, "lc": 0.4, "nz": 3}
DCB = {"L": 40, "h": 1.5, "b": 5, "a0": 12, "back": 2, "fine": 8, "lc": 0.5, "lc_arm": 1, "ny": 2, "nz": 2}
NEEDLE = {"dim": 3, "L": 2, "B": 1.5, "H": 2, "notch": 0.5, "slit": 0.6, "deep": 1.5, "band": 0.4, "lc": 0.2}
NEEDLE_MEASURES = (
    {"left": 6, "right": 6},
    {"crack": 2.7, "notch": 0.3},
    {"top_left": 3, "top_right": 3, "bottom": 6, "symmetry": 8, "back": 8},
)
SENB = {"W": 10, "S": 40, "L": 50, "B": 4, "a": 4.5, "lc": 0.5, "nz": 2}


def block_measures(dim, notch, width=1.0):
    cells = {"left": 30, "right": 30}
    inner = {"crack": 3 - notch} | ({"notch": notch} if notch else {})
    outer = {"top_left": 10, "top_right": 10, "bottom": 20, "far_left": 3, "far_right": 3}
    return scaled(dim, width, cells, inner, outer)


def dcb_measures(dim, width=1.0):
    cells = {"lower": 60, "upper": 60}
    inner = {"crack": 28, "precrack": 12}
    outer = {"load_upper": 1.5, "load_lower": 1.5, "end": 3, "top": 40, "bottom": 40}
    return scaled(dim, width, cells, inner, outer)


def senb_measures(dim, width=1.0):
    cells = {"left": 250, "right": 250}
    outer = {"support_left": 1, "support_right": 1, "load": 1}
    return scaled(dim, width, cells, {"crack": 5.5, "notch": 4.5}, outer)


def scaled(dim, width, cells, inner, outer):
    """Measures of the plane figure, times the width; the end faces have the area of the plane figure."""
    groups = [{name: width * value for name, value in group.items()} for group in (cells, inner, outer)]
    if dim == 3:
        groups[2] |= dict.fromkeys(("front", "back"), sum(cells.values()))
    return groups


def with_symmetry(groups):
    cells, inner, outer = groups
    return [cells, inner, {("symmetry" if name == "front" else name): value for name, value in outer.items()}]


def one_side(groups):
    """Of a block that is alike on both sides of the crack the right one, with the crack on its boundary."""
    cells, inner, outer = groups
    left = {name: value for name, value in outer.items() if not name.endswith("left")}
    halved = {name: value / 2 if name in ("bottom", "symmetry", "back") else value for name, value in left.items()}
    return [{"right": cells["right"]}, {}, inner | halved]


# Geometry, parameters, measures of the groups, measure of the whole boundary.
CASES = {
    "block": ("block", BLOCK | {"dim": 2}, block_measures(2, 0.5), 46),
    "block without notch": ("block", BLOCK | {"dim": 2, "notch": 0}, block_measures(2, 0), 46),
    "block 3-D": ("block", BLOCK | {"dim": 3}, block_measures(3, 0.5, 4), 4 * 46 + 2 * 60),
    "half block": (
        "block",
        BLOCK | {"dim": 3, "sym": 1},
        with_symmetry(block_measures(3, 0.5, 2)),
        2 * 46 + 2 * 60,
    ),
    "one side of a block": ("block", BLOCK | {"dim": 2, "half": 1}, one_side(block_measures(2, 0.5)), 26),
    "quarter of a block": (
        "block",
        BLOCK | {"dim": 3, "sym": 1, "half": 1},
        one_side(with_symmetry(block_measures(3, 0.5, 2))),
        2 * 26 + 2 * 30,
    ),
    "needle": ("needle", NEEDLE, NEEDLE_MEASURES, 34),
    "one side of a needle": ("needle", NEEDLE | {"half": 1}, one_side(NEEDLE_MEASURES), 20),
    "dcb": ("dcb", DCB | {"dim": 2}, dcb_measures(2), 86),
    "dcb 3-D": ("dcb", DCB | {"dim": 3}, dcb_measures(3, 5), 5 * 86 + 2 * 120),
    "half dcb": ("dcb", DCB | {"dim": 3, "sym": 1}, with_symmetry(dcb_measures(3, 2.5)), 2.5 * 86 + 2 * 120),
    "senb": ("senb", SENB | {"dim": 2}, senb_measures(2), 120),
    "senb 3-D": ("senb", SENB | {"dim": 3}, senb_measures(3, 4), 4 * 120 + 2 * 500),
    "half senb": ("senb", SENB | {"dim": 3, "sym": 1}, with_symmetry(senb_measures(3, 2)), 2 * 120 + 2 * 500),
}


def meshed(name, parameters):
    own = {key: value for key, value in parameters.items() if (name, key) != ("needle", "dim")}
    return read_geo(MESHES / f"{name}.geo", COMM, own, gdim=parameters["dim"])


def measure(mesh, kind, entities):
    """Integral of one over the given cells ("dx"), exterior ("ds") or interior ("dS") facets."""
    dim = mesh.topology.dim if kind == "dx" else mesh.topology.dim - 1
    tags = dolfinx.mesh.meshtags(mesh, dim, np.sort(entities), 1)
    one = fem.Constant(mesh, 1.0)
    integral = ufl.Measure(kind, domain=mesh, subdomain_data=tags)(1)
    return COMM.allreduce(fem.assemble_scalar(fem.form((one("+") if kind == "dS" else one) * integral)))


@pytest.mark.parametrize("case", CASES)
def test_groups_have_their_closed_form_measures(case):
    name, parameters, (cells, inner, outer), boundary = CASES[case]
    tagged = meshed(name, parameters)
    mesh = tagged.mesh
    between = ["|".join(cells)] if len(cells) > 1 else []
    assert set(tagged.names) == cells.keys() | inner.keys() | outer.keys() | set(between)
    for facets in map(tagged.facets, between):
        assert measure(mesh, "dS", facets) == pytest.approx(sum(inner.values()), rel=1e-12)
    for group, value in cells.items():
        assert measure(mesh, "dx", tagged.cells(group)) == pytest.approx(value, rel=1e-12)
    for group, value in inner.items():
        assert measure(mesh, "dS", tagged.facets(group)) == pytest.approx(value, rel=1e-12)
        assert measure(mesh, "ds", tagged.facets(group)) == 0
    for group, value in outer.items():
        assert measure(mesh, "ds", tagged.facets(group)) == pytest.approx(value, rel=1e-12)
        assert measure(mesh, "dS", tagged.facets(group)) == 0
    exterior = dolfinx.mesh.exterior_facet_indices(mesh.topology)
    assert measure(mesh, "ds", exterior) == pytest.approx(boundary, rel=1e-12)
    assert mesh.topology.cell_type == (CellType.quadrilateral if mesh.topology.dim == 2 else CellType.hexahedron)


@pytest.mark.parametrize("name", ["block", "dcb", "senb"])
def test_every_owned_crack_facet_knows_both_cells(name):
    tagged = meshed(name, {"dim": 2})
    topology = tagged.mesh.topology
    topology.create_connectivity(1, 2)
    facets = tagged.facets("crack")
    owned = facets[facets < topology.index_map(1).size_local]
    assert all(len(topology.connectivity(1, 2).links(facet)) == 2 for facet in owned)


def test_block_is_uniform_along_the_crack_and_across_the_band():
    tagged = meshed("block", {"dim": 2, "H": 4, "notch": 0.5, "lc": 0.25, "band": 1, "growth": 1.25})
    crack = tagged.facets("crack")
    assert global_range(COMM, facet_size(tagged.mesh, crack)) == pytest.approx((0.25, 0.25))
    assert global_range(COMM, normal_size(tagged.mesh, crack)) == pytest.approx((0.25, 0.25))
    tops = np.concatenate(COMM.allgather(top_edges(tagged)))
    edges = np.unique(tops.round(9))
    sizes = np.diff(edges[edges >= 0])
    assert edges[0] == -30 and edges[-1] == 30
    assert sizes[:4] == pytest.approx(0.25)
    assert sizes[5:] / sizes[4:-1] == pytest.approx(1.25)
    assert 0.25 <= 1.25 * sizes[4] and sizes[4] <= 1.25 * 0.25


@pytest.mark.parametrize("notch", [0, 0.5])
def test_a_block_is_finest_at_the_mouth_and_coarser_below_the_fine_part(notch):
    sizes = {"dim": 2, "H": 4, "notch": notch, "lc": 0.25, "deep": 2, "band": 1, "growth": 1.5, "entry": 0.05}
    tagged = meshed("block", sizes)
    names = ("crack", "notch") if notch else ("crack",)
    heights = [tagged.mesh.geometry.x[nodes_of(tagged, name), 1] for name in names]
    levels = np.unique(np.concatenate([y for part in COMM.allgather(heights) for y in part]).round(9))[::-1]
    below = levels < -2 + 1e-6
    fine, coarse = -np.diff(levels[levels > -2 - 1e-6]), -np.diff(levels[below])
    assert (levels[0], levels[below][0], levels[-1]) == pytest.approx((0, -2, -4))
    assert 0.03 < fine[0] <= 0.05 and fine.max() <= 0.25 * (1 + 1e-9)
    assert len(coarse) > 2 and coarse[1:] / coarse[:-1] == pytest.approx(1.5)


def nodes_of(tagged, name):
    facets = tagged.facets(name)
    return dolfinx.mesh.entities_to_geometry(tagged.mesh, 1, facets).ravel() if len(facets) else np.empty(0, np.int32)


@pytest.mark.parametrize("dim", [2, 3])
def test_refinement_along_a_crack_keeps_all_groups(tmp_path, dim):
    """Two boxes with the crack between them: measures of all groups stay, facets of the crack get as small as asked."""

    def draw():
        occ = gmsh.model.occ
        draw = occ.addBox if dim == 3 else occ.addRectangle
        for x in (0, 1):
            draw(x, 0, 0, 1, *([1] * (dim - 1)))
        occ.fragment([(dim, 1)], [(dim, 2)])
        occ.synchronize()
        for tag, name in enumerate(("left", "right"), start=1):
            gmsh.model.addPhysicalGroup(dim, [tag], name=name)
        faces = [tag for _, tag in gmsh.model.getEntities(dim - 1)]
        middles = {tag: occ.getCenterOfMass(dim - 1, tag) for tag in faces}
        gmsh.model.addPhysicalGroup(dim - 1, [tag for tag, x in middles.items() if abs(x[0] - 1) < 1e-6], name="crack")
        gmsh.model.addPhysicalGroup(dim - 1, [tag for tag, x in middles.items() if abs(x[1]) < 1e-6], name="low")
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.5)
        gmsh.model.mesh.generate(dim)

    path = drawn(tmp_path / "boxes.msh", draw)
    coarse = read_mesh(path, COMM, dim)
    fine = read_mesh(path, COMM, dim, refine=Refinement(("crack",), 0.15, 2.0))
    assert fine.names == coarse.names
    for tagged in (coarse, fine):
        for name in ("left", "right"):
            assert measure(tagged.mesh, "dx", tagged.cells(name)) == pytest.approx(1)
        assert measure(tagged.mesh, "dS", tagged.facets("crack")) == pytest.approx(1)
        assert measure(tagged.mesh, "ds", tagged.facets("low")) == pytest.approx(2)
    assert longest_edge(coarse, "crack") > 0.15 >= longest_edge(fine, "crack") > 0.07
    assert longest_edge(fine, "low") > 0.15  # it grows away


def longest_edge(tagged, name):
    mesh, facets = tagged.mesh, tagged.facets(name)
    nodes = (
        dolfinx.mesh.entities_to_geometry(mesh, mesh.topology.dim - 1, facets) if len(facets) else np.empty((0, 2), int)
    )
    x = mesh.geometry.x[nodes]
    lengths = np.linalg.norm(x - np.roll(x, 1, axis=1), axis=2)
    return COMM.allreduce(float(lengths.max(initial=0.0)), MPI.MAX)


def test_only_straight_simplices_are_refined(tmp_path):
    def draw():
        gmsh.model.occ.addRectangle(0, 0, 0, 1, 1)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(2, [1], name="body")
        gmsh.model.addPhysicalGroup(1, [1], name="low")
        gmsh.model.mesh.setTransfiniteAutomatic()
        gmsh.option.setNumber("Mesh.RecombineAll", 1)
        gmsh.model.mesh.generate(2)

    path = drawn(tmp_path / "square.msh", draw)
    with pytest.raises(ValueError, match=r"refine = .* must be None for cells of the kind 'quadrilateral'"):
        read_mesh(path, COMM, 2, refine=Refinement(("low",), 0.1))


def top_edges(tagged):
    x = tagged.mesh.geometry.x
    return x[np.abs(x[:, 1]) < 1e-9, 0]


def test_dcb_sizes():
    tagged = meshed("dcb", {"dim": 2})
    assert global_range(COMM, facet_size(tagged.mesh, tagged.facets("precrack"))) == pytest.approx((0.25, 0.25))
    assert global_range(COMM, normal_size(tagged.mesh, tagged.facets("crack"))) == pytest.approx((0.25, 0.25))
    x = dolfinx.mesh.compute_midpoints(tagged.mesh, 1, tagged.facets("crack"))[:, 0]
    sizes = facet_size(tagged.mesh, tagged.facets("crack"))
    assert global_range(COMM, sizes[x < 65]) == pytest.approx((0.25, 0.25))
    assert global_range(COMM, sizes[x > 65])[1] > 2


def test_senb_has_vertices_at_the_tip_the_supports_and_the_load():
    tagged = meshed("senb", SENB | {"dim": 2})
    mesh = tagged.mesh
    owned = mesh.topology.index_map(0).size_local
    for point in ((0, 4.5), (-20, 0), (20, 0), (0, 10)):
        found = dolfinx.mesh.locate_entities(
            mesh, 0, lambda x, p=point: np.isclose(x[0], p[0]) & np.isclose(x[1], p[1])
        )
        assert COMM.allreduce(int((found < owned).sum())) == 1


@pytest.mark.parametrize(
    ("file", "parameters", "gdim", "message"),
    [
        ("block.geo", {"length": 3}, 3, "unknown parameter 'length'.*known: B, H, Lx"),
        ("block.geo", {"lc": float("nan")}, 3, "'lc' = nan must be finite"),
        ("block.geo", {"notch": 5}, 3, "notch = 5 must lie in"),
        ("block.geo", {"dim": 4}, 3, "dim = 4, must be 2 or 3"),
        ("block.geo", {"dim": 2}, 3, "gdim = 3, but the highest dimension of a physical group is 2"),
        ("dcb.geo", {"fine": 90}, 2, "fine = 90 in"),
        ("senb.geo", {"a": 25}, 2, "must lie in"),
        ("nothing.geo", None, 2, "nothing.geo: no such file"),
    ],
)
def test_bad_geometry_input_is_refused_on_all_ranks(file, parameters, gdim, message):
    with pytest.raises(ValueError, match=message):
        read_geo(MESHES / file, COMM, parameters, gdim)


def test_unknown_group_names_are_refused():
    tagged = meshed("block", BLOCK | {"dim": 2})
    with pytest.raises(ValueError, match="'crack' is no group of cells; known: left, right"):
        tagged.cells("crack")
    with pytest.raises(ValueError, match="'cleft' is no group of facets; known: crack, "):
        tagged.facets("cleft")


def test_an_open_gmsh_session_survives():
    if COMM.rank == 0:
        gmsh.initialize(interruptible=False)
    with pytest.raises(ValueError, match="session is already open"):
        meshed("block", BLOCK | {"dim": 2})
    if COMM.rank == 0:
        assert gmsh.isInitialized()
        gmsh.finalize()


SQUARES = """
Point(1) = {0, 0, 0}; Point(2) = {0, 1, 0}; Line(1) = {1, 2}; Transfinite Curve{1} = 4;
right[] = Extrude {2, 0, 0} { Curve{1}; Layers{4}; Recombine; };
left[] = Extrude {-1, 0, 0} { Curve{1}; Layers{2}; Recombine; };
Physical Curve("middle") = {1};
"""


def write(folder, name, text):
    """Path of the same file on all ranks, written by rank 0."""
    path = COMM.bcast(folder / name)
    if COMM.rank == 0:
        path.write_text(text + "\n")
    COMM.Barrier()
    return path


@pytest.mark.parametrize(
    ("groups", "message"),
    [
        (
            'Line(99) = {3, 1}; Physical Surface("a") = left[1]; Physical Surface("b") = right[1]; Foo;',
            "line",
        ),
        ("", "highest dimension of a physical group is 1"),
        (
            'Physical Surface("a") = left[1];'
            "Point(20) = {5, 0, 0}; Point(21) = {6, 0, 0}; Point(22) = {5, 1, 0}; Line(31) = {20, 21};"
            "Line(32) = {21, 22}; Line(33) = {22, 20}; Curve Loop(40) = {31, 32, 33};"
            "Plane Surface(50) = {40};"
            'Physical Surface("b") = 50;',
            "must be of one type, found .*Triangle",
        ),
    ],
)
def test_groups_that_make_no_mesh_are_refused(tmp_path, groups, message):
    with pytest.raises(ValueError, match=message):
        read_geo(write(tmp_path, "squares.geo", SQUARES + groups), COMM, gdim=2)


def test_a_geometry_without_groups_is_refused(tmp_path):
    text = "Point(1) = {0, 0, 0}; Point(2) = {1, 0, 0}; Line(1) = {1, 2}; Extrude {0, 1, 0} { Curve{1}; }\n"
    with pytest.raises(ValueError, match="there is no physical group: name the bodies"):
        read_geo(write(tmp_path, "square.geo", text), COMM, gdim=2)


def test_read_mesh_gives_the_same_mesh_as_its_geometry(tmp_path):
    groups = 'Physical Surface("a") = left[1]; Physical Surface("b") = right[1];'
    geo = write(tmp_path, "squares.geo", SQUARES + groups)
    msh = geo.with_suffix(".msh")

    def draw():
        gmsh.open(str(geo))
        gmsh.model.mesh.generate(2)

    for tagged in (read_mesh(drawn(msh, draw), COMM, gdim=2), read_geo(geo, COMM, gdim=2)):
        assert tagged.mesh.topology.index_map(2).size_global == 18
        assert measure(tagged.mesh, "dx", tagged.cells("a")) == pytest.approx(1)
        assert measure(tagged.mesh, "dx", tagged.cells("b")) == pytest.approx(2)
        assert measure(tagged.mesh, "dS", tagged.facets("middle")) == pytest.approx(1)


def drawn(path, draw):
    """The same file on all ranks, of a mesh that rank 0 makes in a session of its own, or a skip if gmsh lacks MED."""
    path, problem = COMM.bcast(path), None
    if COMM.rank == 0:
        gmsh.initialize(readConfigFiles=False, interruptible=False)
        gmsh.option.setNumber("General.Terminal", 0)
        try:
            draw()
            gmsh.write(str(path))
        except Exception as error:  # gmsh has no kinds of errors
            problem = str(error)
        finally:
            gmsh.finalize()
    problem = COMM.bcast(problem)
    if problem is not None and "MED support" in problem:
        pytest.skip("gmsh of Debian cannot write MED files")
    assert problem is None, problem
    return path


def slit(*, embed):
    """The unit square with a line in the middle, which is a part of the mesh or only drawn on it; groups overlap."""
    square = gmsh.model.occ.addRectangle(0, 0, 0, 1, 1)
    ends = [gmsh.model.occ.addPoint(x, 0.5, 0) for x in (0.25, 0.5, 0.75)]
    lines = [gmsh.model.occ.addLine(*pair) for pair in pairwise(ends)]
    gmsh.model.occ.synchronize()
    gmsh.model.mesh.embed(1, lines[:embed], 2, square)
    groups = {"body": (2, [square]), "again": (2, [square]), "crack": (1, lines), "half": (1, lines[:1])}
    for name, (dim, entities) in groups.items():
        gmsh.model.addPhysicalGroup(dim, entities, name=name)
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.125)
    gmsh.model.mesh.generate(2)


@pytest.mark.parametrize(("embed", "found"), [(0, "0 of 4"), (1, "2 of 4")])
def test_a_crack_that_is_only_drawn_is_refused(tmp_path, embed, found):
    path = drawn(tmp_path / "slit.msh", lambda: slit(embed=embed))
    message = rf"group 'crack': {found} facets .* the others lie near .* to \(0.6875, 0.5, 0\).*Curve\{{…\}} In Surface"
    with pytest.raises(ValueError, match=message):
        read_mesh(path, COMM, gdim=2)


@pytest.mark.parametrize("ending", ["msh", "med", "unv"])
def test_groups_overlap_and_nodes_have_any_numbers(tmp_path, ending):
    def draw():
        slit(embed=2)
        tags = [int(tag) for tag in gmsh.model.mesh.getNodes()[0]]
        gmsh.model.mesh.renumberNodes(tags, [100 + 7 * tag for tag in tags])

    tagged = read_mesh(drawn(tmp_path / f"slit.{ending}", draw), COMM, gdim=2)
    for name in ("body", "again"):
        assert measure(tagged.mesh, "dx", tagged.cells(name)) == pytest.approx(1)
    assert measure(tagged.mesh, "dS", tagged.facets("crack")) == pytest.approx(0.5)
    assert measure(tagged.mesh, "dS", tagged.facets("half")) == pytest.approx(0.25)


@pytest.mark.parametrize("dim", [2, 3])
def test_curved_cells_keep_their_groups(tmp_path, dim):
    """A disc or cylinder of second order: its area and that of its rim are those of the circle to 1e-4."""

    def draw():
        occ = gmsh.model.occ
        body = occ.addDisk(0, 0, 0, 1, 1) if dim == 2 else occ.addCylinder(0, 0, 0, 0, 0, 1, 1)
        occ.synchronize()
        rim = gmsh.model.getEntities(dim - 1)[0][1]
        gmsh.model.addPhysicalGroup(dim, [body], name="body")
        gmsh.model.addPhysicalGroup(dim - 1, [rim], name="rim")
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.5)
        gmsh.option.setNumber("Mesh.ElementOrder", 2)
        gmsh.model.mesh.generate(dim)

    tagged = read_mesh(drawn(tmp_path / "round.msh", draw), COMM, gdim=dim)
    assert measure(tagged.mesh, "dx", tagged.cells("body")) == pytest.approx(np.pi, rel=3e-4)
    assert measure(tagged.mesh, "ds", tagged.facets("rim")) == pytest.approx(2 * np.pi, rel=3e-4)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("incomplete", [0, 1])
def test_quadrilaterals_and_hexahedra_of_second_order_are_curved(tmp_path, dim, incomplete):
    """A quarter of a ring, also with nodes on the edges of its cells only."""

    def draw():
        geo = gmsh.model.geo
        centre, *points = [geo.addPoint(*x, 0) for x in ((0, 0), (1, 0), (2, 0), (0, 2), (0, 1))]
        lines = [geo.addLine(points[0], points[1]), geo.addCircleArc(points[1], centre, points[2])]
        lines += [geo.addLine(points[2], points[3]), geo.addCircleArc(points[3], centre, points[0])]
        ring = geo.addPlaneSurface([geo.addCurveLoop(lines)])
        for line in lines:
            geo.mesh.setTransfiniteCurve(line, 5)
        geo.mesh.setTransfiniteSurface(ring)
        geo.mesh.setRecombine(2, ring)
        body = [tag for of, tag in geo.extrude([(2, ring)], 0, 0, 1, [2], recombine=True) if of == 3]
        geo.synchronize()
        gmsh.model.addPhysicalGroup(dim, body if dim == 3 else [ring], name="ring")
        gmsh.option.setNumber("Mesh.SecondOrderIncomplete", incomplete)
        gmsh.option.setNumber("Mesh.ElementOrder", 2)
        gmsh.model.mesh.generate(dim)

    tagged = read_mesh(drawn(tmp_path / "ring.msh", draw), COMM, gdim=dim)
    assert measure(tagged.mesh, "dx", tagged.cells("ring")) == pytest.approx(3 * np.pi / 4, rel=1e-4)


CORNERS = [(0, 0), (1, 0), (1, 1), (0, 1)]
FAN = [(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)]


def discrete(points, cells, kind):
    """A mesh of given nodes and cells; points in the plane of x and y unless they have three coordinates."""
    dim = gmsh.model.mesh.getElementProperties(kind)[1]
    entity = gmsh.model.addDiscreteEntity(dim)
    x = np.array([(*p, 0)[:3] for p in points], dtype=float)
    gmsh.model.mesh.addNodes(dim, entity, list(range(1, len(x) + 1)), x.ravel())
    gmsh.model.mesh.addElementsByType(entity, kind, [], (np.array(cells) + 1).ravel())
    gmsh.model.addPhysicalGroup(dim, [entity], name="body")


PRISM = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)]
BROKEN = {
    "no volume": ([*CORNERS, (0.5, 0)], FAN, 2, r"1 cells have no volume, the first at \(0.5, 0\)"),
    "folded": ([*CORNERS, (0.5, -0.1)], FAN, 2, r"2 facets have both their cells on the same side"),
    "not finite": ([*CORNERS, (0.5, np.nan)], FAN, 2, r"1 nodes .* not finite, the first \(0.5, nan, 0\)"),
    "a node twice": ([*CORNERS, (0.5, 0.5)], [*FAN[:3], (3, 3, 4)], 2, "1 cells have a node twice"),
    "a cell twice": ([*CORNERS, (0.5, 0.5)], [*FAN, FAN[0]], 2, "2 facets belong to more than two cells"),
    "bow": ([CORNERS[i] for i in (0, 1, 3, 2)], [(0, 1, 2, 3)], 3, r"1 cells are folded .* \(0.5, 0.5\)"),
    "dart": ([(0, 0), (1, 0), (0.1, 0.1), (0, 1), (1, 1)], [(0, 1, 2, 3), (1, 4, 3, 2)], 3, "1 pairs of cells share"),
    "prism": (PRISM, [range(6)], 6, "1 'Prism 6' of 1 cells cannot be used: use tetrahedra, or hexahedra"),
    "tilted": ([(*CORNERS[i], 0.1 * i) for i in range(3)], [(0, 1, 2)], 2, "not flat: z goes from 0 to 0.2"),
}  # fmt: skip


@pytest.mark.parametrize("case", BROKEN)
def test_cells_that_are_none_are_refused_on_all_ranks(tmp_path, case):
    points, cells, kind, message = BROKEN[case]
    path = drawn(tmp_path / "broken.msh", lambda: discrete(points, [list(cell) for cell in cells], kind))
    with pytest.raises(ValueError, match=message):
        read_mesh(path, COMM, gdim=2 + (case == "prism"))


@pytest.mark.parametrize(("axis", "level"), [(1, 0.0), (0, 0.5), (2, 0.25)])
def test_a_flat_mesh_may_lie_in_any_plane_of_two_axes(tmp_path, axis, level, caplog):
    points = np.insert(np.array([*CORNERS, (0.5, 0.5)]) * (2.0, 1.0), axis, level, axis=1)
    tagged = read_mesh(drawn(tmp_path / "flat.msh", lambda: discrete(points, FAN, 2)), COMM, gdim=2)
    assert measure(tagged.mesh, "dx", tagged.cells("body")) == pytest.approx(2)
    low, high = box(COMM, tagged.mesh.geometry.x)
    assert (low.tolist(), high.tolist()) == ([0, 0, 0], [2, 1, 0])
    said = COMM.bcast(f"in the plane {'xyz'[axis]} = {level:g}:" in caplog.text)
    assert said == (axis != 2)


def halves(mesh) -> TaggedMesh:
    return tag_mesh(
        mesh,
        {"left": lambda x: x[0] < 0.5 + 1e-9, "right": lambda x: x[0] > 0.5 - 1e-9},
        {"crack": lambda x: np.isclose(x[0], 0.5), "far": lambda x: np.isclose(x[0], 1)},
    )


@pytest.mark.parametrize("cell", [CellType.tetrahedron, CellType.hexahedron])
def test_markers_tag_cells_and_facets(cell):
    tagged = halves(dolfinx.mesh.create_unit_cube(COMM, 4, 4, 4, cell, ghost_mode=GhostMode.shared_facet))
    for name in ("left", "right"):
        assert measure(tagged.mesh, "dx", tagged.cells(name)) == pytest.approx(0.5)
    assert measure(tagged.mesh, "dS", tagged.facets("crack")) == pytest.approx(1)
    assert measure(tagged.mesh, "ds", tagged.facets("far")) == pytest.approx(1)


def test_bad_markers_are_refused_and_groups_may_overlap():
    mesh = dolfinx.mesh.create_unit_square(COMM, 4, 4)
    everything = {"all": lambda x: x[0] < 2}
    corner = {"corner": lambda x: (x[0] < 0.3) & (x[1] < 0.3)}  # on one rank only, if there are more
    with pytest.raises(ValueError, match="'gap' finds no entity of dimension 1"):
        tag_mesh(mesh, everything, {"gap": lambda x: x[0] > 2})
    tagged = tag_mesh(mesh, everything | corner, {})
    counts = [
        COMM.allreduce(int((tagged.cells(n) < mesh.topology.index_map(2).size_local).sum())) for n in tagged.names
    ]
    assert counts == [32, 2]
    tagged = tag_mesh(mesh, everything, everything)  # also those of cells and facets with the same name
    assert len(tagged.facets("all")) > len(tagged.cells("all")) > 0


def test_geometries_are_found_by_name():
    assert geometry("block").samefile(MESHES / "block.geo")
    with pytest.raises(ValueError, match="name = 'common' is no geometry of cutsim; known: block, blocks"):
        geometry("common")


@pytest.mark.parametrize("cell", [CellType.triangle, CellType.quadrilateral])
def test_sizes_in_the_plane(cell):
    mesh = dolfinx.mesh.create_rectangle(COMM, [(0, 0), (1, 2)], [4, 4], cell, ghost_mode=GhostMode.shared_facet)
    tagged = halves(mesh)
    assert global_range(COMM, facet_size(mesh, tagged.facets("crack"))) == pytest.approx((0.5, 0.5))
    assert global_range(COMM, normal_size(mesh, tagged.facets("crack"))) == pytest.approx((0.25, 0.25))


@pytest.mark.parametrize("cell", [CellType.tetrahedron, CellType.hexahedron])
def test_sizes_in_space(cell):
    corners = [(0, 0, 0), (1, 2, 4)]
    mesh = dolfinx.mesh.create_box(COMM, corners, [4, 4, 4], cell, ghost_mode=GhostMode.shared_facet)
    tagged = halves(mesh)
    assert global_range(COMM, facet_size(mesh, tagged.facets("crack"))) == pytest.approx((0.5, 0.5))
    assert global_range(COMM, normal_size(mesh, tagged.facets("crack"))) == pytest.approx((0.25, 0.25))


def test_normal_size_is_that_of_the_thinner_cell_and_of_sheared_cells_the_height():
    ghosts = GhostMode.shared_facet
    mesh = dolfinx.mesh.create_unit_square(COMM, 2, 4, CellType.quadrilateral, ghost_mode=ghosts)
    tagged = halves(mesh)
    x = mesh.geometry.x
    x[np.isclose(x[:, 0], 0.5), 0] = 0.2
    x[:, 1] += 3 * x[:, 0]
    assert global_range(COMM, normal_size(mesh, tagged.facets("crack"))) == pytest.approx((0.2, 0.2))
    assert global_range(COMM, normal_size(mesh, tagged.facets("far"))) == pytest.approx((0.8, 0.8))


def test_global_range_spans_the_ranks_and_needs_a_value():
    mine = np.array([1.0 + COMM.rank]) if COMM.rank == COMM.size - 1 else np.empty(0)
    assert global_range(COMM, mine) == (COMM.size, COMM.size)
    with pytest.raises(ValueError, match="values is empty on every rank"):
        global_range(COMM, np.empty(0))
