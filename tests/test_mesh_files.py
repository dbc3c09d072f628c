"""Meshes of Abaqus, FEBio and other files: measures by hand, groups, second order, coincident nodes, and bad input."""

import random

import meshio
import numpy as np
import pytest
from dolfinx.mesh import exterior_facet_indices
from mpi4py import MPI

from cutsim import read_mesh
from helpers.mesh_files import abaqus, area, bent_volume, boxes, febio, rows, volume, where

COMM = MPI.COMM_WORLD

ABAQUS = {
    "C3D8R": "hex8", "C3D20R": "hex20", "C3D4": "tet4", "C3D10MH": "tet10",
    "CPS4": "quad4", "CAX8R": "quad8", "CPE3": "tri3", "CPEG6": "tri6",
}  # fmt: skip
FEBIO = ("hex8", "hex20", "hex27", "tet4", "tet10")
MESHIO = {
    "hexahedron": "hex8", "hexahedron20": "hex20", "hexahedron27": "vtk27", "tetra": "tet4", "tetra10": "tet10",
    "quad": "quad4", "quad8": "quad8", "quad9": "quad9", "triangle": "tri3", "triangle6": "tri6",
}  # fmt: skip
LINEAR = ("hex8", "tet4", "quad4", "tri3")
# of every type straight, and bent where its nodes can follow
CASES = [
    (kind, shape, bend)
    for kind, shape in {**ABAQUS, **{name: name for name in FEBIO}, **MESHIO}.items()
    for bend in (0.0, 0.1)
    if not (bend and shape in LINEAR)
]


def write(folder, name, text):
    """Path of the same file on all ranks, written by rank 0."""
    path = COMM.bcast(folder / name)
    if COMM.rank == 0:
        path.write_text(text, encoding="utf-8")
    COMM.Barrier()
    return path


def dimension(shape):
    return 2 if shape.startswith(("quad", "tri")) else 3


def file_of(folder, kind, points, both, straight):
    """The two boxes with sets of nodes in a file of the format that has this type of elements."""
    sets = {name: where(straight, 0, x) for name, x in (("left", 0), ("middle", 1))} | {"corner": [1]}
    if kind in ABAQUS:
        more = "".join(f"*Nset, nset={name}\n{rows(nodes)}\n" for name, nodes in sets.items())
        return write(folder, "boxes.inp", abaqus(kind, points, both, more))
    if kind in FEBIO:
        more = "".join(f'<NodeSet name="{name}">{",".join(map(str, nodes))}</NodeSet>' for name, nodes in sets.items())
        return write(folder, "boxes.feb", febio(kind, points, both, more))
    path = COMM.bcast(folder / "boxes.xdmf")
    if COMM.rank == 0:
        cells, parts = np.concatenate(both), np.repeat([7, 8], [len(cells) for cells in both])
        nodes = {name: np.array(own) - 1 for name, own in sets.items()}
        meshio.Mesh(points, {kind: cells}, cell_data={"part": [parts]}, point_sets=nodes).write(path, data_format="XML")
    COMM.Barrier()
    return path


@pytest.mark.parametrize(("kind", "shape", "bend"), CASES)
def test_elements_have_their_shape_and_groups(tmp_path, kind, shape, bend):
    """Second-order elements follow a quadratic map exactly, which they do in the right order of their nodes only."""
    straight, both = boxes(shape)
    points = boxes(shape, bend=bend)[0]
    domain = read_mesh(file_of(tmp_path, kind, points, both, straight), COMM, dimension(shape))
    # of 27 and 9 nodes for those of 20 and 8
    counts = {"hex20": 45, "hex27": 45, "vtk27": 45, "quad8": 15, "quad9": 15}
    nodes = domain.mesh.geometry.index_map().size_global
    assert nodes == counts.get(shape, len(points))
    first, second = ("part 7", "part 8") if kind in MESHIO else ("A", "B")
    parts = [volume(domain.mesh, domain.cells(name)) for name in (first, second)]
    assert sum(parts) == pytest.approx(bent_volume(dimension(shape), bend), rel=1e-12)
    if not bend:
        assert parts == pytest.approx([1, 1])
        between = (f"{first}|{second}",) if kind in MESHIO else ("A|B", "middle", "left")
        for name in between:
            assert area(domain.mesh, domain.facets(name)) == pytest.approx(1)
        if kind not in MESHIO:
            owned = domain.mesh.topology.index_map(0).size_local
            assert COMM.allreduce(int((domain.vertices("corner") < owned).sum())) == 1


@pytest.mark.mpi
@pytest.mark.parametrize("kind", ["C3D8", "C3D4", "CPS4", "CPS3"])
def test_surfaces_of_abaqus_are_faces_of_elements(tmp_path, kind):
    shape = ABAQUS.get(kind) or {"C3D8": "hex8", "CPS3": "tri3"}[kind]
    points, both = boxes(shape)
    faces = {"C3D8": [(1, "S6")], "C3D4": [(3, "S1"), (4, "S1")], "CPS4": [(1, "S4")], "CPS3": [(2, "S3")]}[kind]
    more = "*SURFACE, NAME=left, TYPE=ELEMENT\n" + "".join(f"{number}, {face}\n" for number, face in faces)
    more += f"*ELSET, ELSET=both, GENERATE\n1, {2 * len(both[0])}, 1\n*SURFACE, NAME=outer\nboth\n"
    more += f"*NSET, NSET=Right\n{rows(where(points, 0, 2))}\n*SURFACE, TYPE=NODE, NAME=pulled\nRIGHT, 1.\n"
    domain = read_mesh(write(tmp_path, "boxes.inp", abaqus(kind, points, both, more)), COMM, dimension(shape))
    x = domain.mesh.geometry.x
    assert area(domain.mesh, domain.facets("left")) == pytest.approx(1)
    assert x[:, 0].min(initial=0.0) == 0 and domain.extent("left")[1][0] == pytest.approx(0)
    assert area(domain.mesh, domain.facets("outer")) == pytest.approx(10 if dimension(shape) == 3 else 6)
    assert area(domain.mesh, domain.facets("pulled")) == area(domain.mesh, domain.facets("Right")) == pytest.approx(1)


ASSEMBLY = """*Heading
*Part, name=Cube
*Node
{nodes}
*Element, type=C3D8,
 elset=Solid
1, 1, 2, 3, 4, 5, 6, 7, 8
*Nset, nset=Set-1, generate
1, 4, 1
*Surface, type=ELEMENT, name=Top
Solid, S2
*End Part
*Assembly, name=Assembly
*Instance, name=Lower, part=Cube
*End Instance
*Instance, name=Upper, part=CUBE
0., 0., 2.
0., 0., 2., 1., 0., 2., 180.
*End Instance
*Node
100, 5., 5., 5.
*Nset, nset="Reference point"
100
*Nset, nset=base, instance=lower
Set-1, 5
*Elset, elset=Everything, instance=Lower, internal
1
*Elset, elset=Everything, instance=Upper
1
*Surface, type=ELEMENT, name=Glued
Upper.Solid, S1
*End Assembly
"""


@pytest.mark.mpi
def test_instances_are_moved_and_their_sets_have_their_names(tmp_path):
    """The upper cube is shifted by 2 and turned by half a turn about an edge that goes along x."""
    nodes = "\n".join(f"{i}, {x}, {y}, {z}" for i, (x, y, z) in enumerate(boxes("hex8")[0][:8], start=1))
    domain = read_mesh(write(tmp_path, "model.inp", ASSEMBLY.format(nodes=nodes)), COMM, scale=1000)
    assert volume(domain.mesh, domain.cells("Everything")) == pytest.approx(2e9)
    for name in ("Lower", "Upper", "Lower.Solid", "Upper.Solid"):
        assert volume(domain.mesh, domain.cells(name)) == pytest.approx(1e9)
    low, high = (bound.tolist() for bound in domain.extent("Upper.Top"))
    assert (low, high) == (pytest.approx([0, -1000, 1000]), pytest.approx([1000, 0, 1000]))
    low, high = (bound.tolist() for bound in domain.extent("Glued"))
    assert (low, high) == (pytest.approx([0, -1000, 2000]), pytest.approx([1000, 0, 2000]))
    assert domain.extent("base")[1].tolist() == [1000, 1000, 0]
    assert area(domain.mesh, domain.facets("Lower.Set-1")) == pytest.approx(1e6)
    with pytest.raises(ValueError, match=r"'Reference point' is no group of vertices; known: Lower\.Set-1"):
        domain.vertices("Reference point")


def test_files_of_nodes_and_elements_are_included(tmp_path):
    text = abaqus("C3D8", *boxes("hex8"))
    at = text.index("*Element")
    write(tmp_path, "nodes.txt", text[text.index("*NODE") : at])
    write(tmp_path, "elements.txt", text[at:].replace("1, 1, 2,", "1, 1, 99,"))
    path = write(tmp_path, "boxes.inp", "*INCLUDE, INPUT=nodes.txt\n*INCLUDE, INPUT=elements.txt\n")
    with pytest.raises(ValueError, match=r"elements.txt: line 2: \*ELEMENT: there is no node 99"):
        read_mesh(path, COMM)
    write(tmp_path, "elements.txt", text[at:])
    domain = read_mesh(path, COMM)
    assert volume(domain.mesh, domain.cells("A")) == pytest.approx(1)


@pytest.mark.mpi
@pytest.mark.parametrize("kind", ["hex8", "tet4", "hex20", "tet10"])
@pytest.mark.parametrize("merge", [False, True, [("B", "A")], [("A", "A")]])
def test_coincident_nodes_are_kept_apart_or_merged(tmp_path, kind, merge):
    points, both = boxes(kind, joined=False)
    # files have rounded numbers
    points[both[1].min() :] += 1e-6
    domain = read_mesh(write(tmp_path, "boxes.feb", febio(kind, points, both)), COMM, merge=merge)
    exterior = exterior_facet_indices(domain.mesh.topology)
    joined = merge in (True, [("B", "A")])
    assert area(domain.mesh, exterior) == pytest.approx(10 if joined else 12, rel=1e-5)
    assert area(domain.mesh, domain.facets("A|B")) == pytest.approx(1, rel=1e-5)
    assert area(domain.mesh, np.intersect1d(domain.facets("A|B"), exterior)) == pytest.approx(
        0 if joined else 1, rel=1e-5
    )
    assert ("B|A" in domain.names) is not joined
    if not joined:
        assert area(domain.mesh, domain.facets("B|A")) == pytest.approx(1, rel=1e-5)
        assert not len(np.intersect1d(domain.facets("A|B"), domain.facets("B|A")))


def test_meshio_and_read_mesh_agree(tmp_path):
    """On files that meshio has written in its formats with sets or integers on cells."""
    points, both = boxes("hex8")
    cells, parts = [("hexahedron", np.concatenate(both))], [np.array([1, 2])]
    nodes = {"left": where(points, 0, 0) - 1}
    own = meshio.Mesh(points, cells, cell_data={"medit:ref": parts}, point_sets=nodes)
    for name, group in (("a.inp", None), ("b.vtu", "medit:ref 1"), ("c.vtk", "medit:ref 1"), ("d.mesh", "medit:ref 1")):
        if COMM.rank == 0:
            own.write(tmp_path / name)
        domain = read_mesh(COMM.bcast(tmp_path / name), COMM)
        assert volume(domain.mesh, domain.cells(group or "part1")) == pytest.approx(1 if group else 2)
        if name == "a.inp":
            assert area(domain.mesh, domain.facets("left")) == pytest.approx(1)


def test_a_body_that_is_split_in_the_file_can_be_cut_where_it_was(tmp_path):
    points, both = boxes("quad4", joined=False)
    text = abaqus("CPE4", points, both).replace("ELSET=B", "ELSET=A")
    path = write(tmp_path, "boxes.inp", text)
    domain = read_mesh(path, COMM, gdim=2, merge=True)
    assert area(domain.mesh, domain.facets("A|A")) == pytest.approx(1)
    assert area(domain.mesh, exterior_facet_indices(domain.mesh.topology)) == pytest.approx(6)
    assert "A|A" not in read_mesh(path, COMM, gdim=2).names


def test_tolerance_is_a_length_after_scaling(tmp_path):
    points, both = boxes("hex8", joined=False)
    points[both[1].min() :, 0] += 0.01
    path = write(tmp_path, "boxes.inp", abaqus("C3D8", points, both))
    assert read_mesh(path, COMM, scale=10, merge=True, tolerance=0.09).names == ("A", "B", "all")
    assert "A|B" in read_mesh(path, COMM, scale=10, merge=True, tolerance=0.11).names
    for wrong in (10.0, 0.0, np.nan):
        with pytest.raises(ValueError, match=f"tolerance = {wrong} is not allowed"):
            read_mesh(path, COMM, scale=10, tolerance=wrong)


def mixed():
    """A box of a hexahedron beside one of tetrahedra, and a spring."""
    points, (hexahedron, _) = boxes("hex8")
    text = abaqus("C3D8", points, (hexahedron, hexahedron[:0]))
    more, (_, tetrahedra) = boxes("tet4")
    numbers = {tuple(x): i for i, x in enumerate(points.tolist(), start=1)}
    text += "*ELEMENT, TYPE=C3D4, ELSET=tool\n"
    for i, cell in enumerate(tetrahedra, start=20):
        text += rows([i, *(numbers[tuple(more[node].tolist())] for node in cell)]) + "\n"
    text += "*SURFACE, NAME=skin\ntool,\n*SURFACE, NAME=top\n1, S2\n*ELEMENT, TYPE=SPRINGA, ELSET=spring\n40, 1, 2\n"
    return text.replace("*Element, type=C3D8, ELSET=B\n", "")


@pytest.mark.mpi
def test_groups_of_one_type_can_be_read_of_a_file_with_several(tmp_path, caplog):
    path = write(tmp_path, "mixed.inp", mixed())
    message = r"of one type, found 1 'C3D8' \(in 'A'\), 6 'C3D4' \(in 'tool'\): read the groups of one type \(only="
    with pytest.raises(ValueError, match=message):
        read_mesh(path, COMM)
    domain = read_mesh(path, COMM, only=["A"])
    assert volume(domain.mesh, domain.cells("A")) == pytest.approx(1)
    assert domain.names == ("A", "top", "all")
    assert COMM.bcast("group 'skin' is left out" in caplog.text and "1 'SPRINGA' (in 'spring')" in caplog.text)
    assert "skin" in read_mesh(path, COMM, only=("tool",)).names
    for wrong, words in ((["tools"], "only = 'tools' .* A, tool"), ([], "only = "), ("tool", "only = 'tool'")):
        with pytest.raises(ValueError, match=words):
            read_mesh(path, COMM, only=wrong)


def test_cells_that_do_not_fit_are_refused(tmp_path):
    """Cells of second order with another node on a common edge, and a node in two places."""
    points, (first, second) = boxes("tet10")
    edge = next(node for node in np.intersect1d(first[:, 4:], second[:, 4:]))
    other = np.where(second == edge, len(points), second)
    text = abaqus("C3D10", np.vstack([points, points[edge]]), (first, other))
    with pytest.raises(ValueError, match="edges or faces have other nodes in other cells, the first at"):
        read_mesh(write(tmp_path, "edge.inp", text), COMM)
    assert "A|B" in read_mesh(COMM.bcast(tmp_path / "edge.inp"), COMM, merge=True).names
    lost = np.setdiff1d(second[:, 4:], first)[0]
    text = abaqus("C3D10", points, (first, np.where(second == lost, first[0, 0], second)))
    with pytest.raises(ValueError, match="is a corner of one cell and lies on an edge"):
        read_mesh(write(tmp_path, "corner.inp", text), COMM)


WRONG_ABAQUS = {
    r"line 5: \*NODE: 'x' is no number": ("1, 0, 0, 0", "1, x, 0, 0"),
    r"line 5: \*NODE: 'one' is no whole number": ("1, 0, 0, 0", "one, 0, 0, 0"),
    r"line 18: \*ELEMENT: there is no node 99": ("1, 1, 2, 3,", "1, 99, 2, 3,"),
    r"line 18: \*ELEMENT: an element must have 8 nodes, found 7": (",\n8\n*Element", "\n*Element"),
    r"line 17: \*ELEMENT: elements of type C3D9 are not read": ("C3D8, ELSET=A", "C3D9, ELSET=A"),
    r"line 17: \*ELEMENT: there is no TYPE=…": ("type=C3D8, ELSET=A", "ELSET=A"),
    r"line 24: \*NSET: there is no set of nodes called 'some' before": ("*END", "*NSET, NSET=all\nsome"),
    r"line 24: \*NSET: must be first, last, step": ("*END", "*NSET, NSET=a, GENERATE\n1"),
    r"line 24: \*SURFACE: elements of type C3D8 have no face 'S7'": ("*END", "*SURFACE, NAME=a\nA, S7"),
    r"line 23: \*SURFACE: there is no NAME=…": ("*END", "*SURFACE\nA, S1"),
    r"line 23: \*NGEN: this is not read": ("*END", "*NGEN\n1, 2, 1"),
    r"line 23: \*INSTANCE: there is no \*PART 'P' before": ("*END", "*INSTANCE, NAME=I, PART=P"),
    r"line 23: \*INCLUDE: 'model.inp': files include each other": ("*END", "*INCLUDE, INPUT=model.inp"),
    r"line 18: \*ELEMENT: there is no node 1": ("*NODE", "*PRINT"),
    r"cells have a node twice": ("1, 1, 2, 3,", "1, 1, 1, 3,"),
    r"1 cells are folded": ("1, 1, 2, 3,", "1, 1, 3, 2,"),
    r"gdim = 3, but the file has no cells of this dimension, it has 2 'CPS8' \(in 'A', 'B'\)": ("C3D8", "CPS8"),
    r"1 'C3D6'": ("C3D8, ELSET=A\n1, 1, 2, 3, 4, 5, 6, 7,\n8", "C3D6, ELSET=A\n1, 1, 2, 3, 4, 5, 6"),
}


@pytest.mark.parametrize("message", WRONG_ABAQUS)
def test_what_is_wrong_in_a_file_of_abaqus_is_said_with_its_line(tmp_path, message):
    old, new = WRONG_ABAQUS[message]
    text = abaqus("C3D8", *boxes("hex8"), more="*END\n")
    assert old in text
    with pytest.raises(ValueError, match=f"path = .*model.inp: .*{message}"):
        read_mesh(write(tmp_path, "model.inp", text.replace(old, new)), COMM)


def test_damaged_files_are_refused(tmp_path):
    """Whatever becomes of a file, it makes a mesh or a ValueError."""
    rng, straight = random.Random(2), boxes("hex8")
    texts = {
        "a.inp": abaqus("C3D8", *straight, "*SURFACE, NAME=left\nA, S6\n*NSET, NSET=n, GENERATE\n1, 4\n"),
        "b.feb": febio("hex8", *straight, '<Surface name="s"><quad4 id="1">1,4,8,5</quad4></Surface>'),
        "c.vtk": "", "d.xdmf": "", "e.msh": "",
    }  # fmt: skip
    for name, text in texts.items():
        for trial in range(8):
            size = len(text) * trial // 8 + rng.randrange(1 + len(text) // 8)
            broken = text[:size] + text[size + rng.randrange(20) :] * (trial % 2)
            try:
                read_mesh(write(tmp_path, name, broken), COMM)
            except ValueError as error:
                assert name in str(error)
