"""Meshes of FEBio files: nodes, elements and sets of every version, and the refusal of what is none."""

import random

import numpy as np
import pytest

from cutsim.readers.febio import read_febio

NODES = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
# numbers with a gap, as FEBio Studio leaves them
IDS = [1, 2, 3, 4, 15, 16, 17, 18]


def nodes():
    return "\n".join(f'<node id="{i}">{x}, {y}, {z}</node>' for i, (x, y, z) in zip(IDS, NODES, strict=True))


CELLS = '<elem id="5">1,2,3,4,15,16,17,18</elem>'
SURFACES = """<Surface name="top"><quad4 id="1">15,16,17,18</quad4></Surface>
<Surface name="bottom"><quad4 id="1">4,3,2,1</quad4><tri3 id="2">1,2,3</tri3></Surface>"""

# what differs between versions: the section, attributes of elements, sets of nodes and elements, pairs
VERSIONS = {
    "2.0": (
        "Geometry", 'mat="1" elset="cube"', '<NodeSet name="left"><node id="1"/><node id="18"/></NodeSet>',
        '<ElementSet name="all"><elem id="5"/></ElementSet>', "",
    ),
    "2.5": (
        "Geometry", 'mat="soft" name="cube"',
        '<NodeSet name="left"><node id="1"/></NodeSet><NodeSet name="left"><NodeSet set="left"/><n id="18"/></NodeSet>',
        '<ElementSet name="all"><elem id="5"/></ElementSet>',
        '<SurfacePair name="pair"><master surface="bottom"/><slave surface="top"/></SurfacePair>',
    ),
    "3.0": (
        "Mesh", 'name="cube"', '<NodeSet name="left"><n id="1"/><n id="18"/></NodeSet>',
        '<ElementSet name="all"><e id="5"/></ElementSet>',
        '<SurfacePair name="pair"><primary>top</primary><secondary>bottom</secondary></SurfacePair>',
    ),
    "4.0": (
        "Mesh", 'name="cube"', '<NodeSet name="left">1,18</NodeSet><NodeSet name="base"> 1:4, 15:18:3 </NodeSet>',
        '<ElementSet name="all">5</ElementSet><PartList name="list">cube</PartList>',
        '<SurfacePair name="pair"><primary>top</primary><secondary>bottom</secondary></SurfacePair>'
        '<DiscreteSet name="springs"><delem>1,15</delem></DiscreteSet>'
        '<Edge name="rim"><line2 id="1">1,2</line2></Edge>',
    ),
}  # fmt: skip


def model(version="4.0", cells=CELLS, kind="hex8"):
    section, of_elements, node_sets, cell_sets, pairs = VERSIONS[version]
    return f"""<?xml version="1.0" encoding="ISO-8859-1"?>
<febio_spec version="{version}">
<{section}>
<Nodes name="object">
{nodes()}
</Nodes>
<Elements type="{kind}" {of_elements}>
{cells}
</Elements>
{node_sets}
{SURFACES}
{cell_sets}{pairs}
</{section}>
</febio_spec>
"""


def read(folder, text):
    path = folder / "model.feb"
    path.write_text(text, encoding="utf-8")
    return read_febio(path)


@pytest.mark.parametrize("version", VERSIONS)
def test_versions_say_the_same(tmp_path, version):
    data = read(tmp_path, model(version))
    assert data.points.tolist() == [list(map(float, x)) for x in NODES]
    assert data.numbers.tolist() == IDS
    (block,) = data.blocks
    assert (block.name, block.kind, block.shape, block.line) == ("cube", "hex8", "hexahedron", 14)
    assert block.nodes.tolist() == [list(range(8))] and block.numbers.tolist() == [5]
    assert list(data.cell_sets)[:2] == ["cube", "all"] and data.cell_sets["all"].tolist() == [0]
    assert data.node_sets["object"].tolist() == list(range(8))
    assert data.node_sets["left_2" if version == "2.5" else "left"].tolist() == [0, 7]
    assert [rows.tolist() for rows in data.facet_sets["top"]] == [[[4, 5, 6, 7]]]
    assert [rows.tolist() for rows in data.facet_sets["bottom"]] == [[[3, 2, 1, 0]], [[0, 1, 2]]]
    assert data.pairs == ({"pair": ("top", "bottom")} if version > "2.0" else {})
    if version == "4.0":
        assert data.node_sets["base"].tolist() == [0, 1, 2, 3, 4, 7]
        assert data.node_sets["springs"].tolist() == [0, 4] and data.node_sets["rim"].tolist() == [0, 1]
        assert data.cell_sets["list"].tolist() == [0]


def test_parts_of_a_model_may_be_in_other_files(tmp_path):
    text = model("3.0")
    mesh = text[text.index("<Mesh>") : text.index("</febio_spec>")]
    (tmp_path / "mesh.feb").write_text(text)
    for how in ('<Mesh from="mesh.feb"/>', "<Include>mesh.feb</Include>"):
        data = read(tmp_path, text.replace(mesh, how))
        assert list(data.cell_sets) == ["cube", "all"]
    with pytest.raises(ValueError, match=r"line 3: <Mesh> takes 'other.feb': there is no such file"):
        read(tmp_path, text.replace(mesh, '<Mesh from="other.feb"/>'))
    (tmp_path / "mesh.feb").write_text(text.replace("17,18</elem>", "17,99</elem>"))
    with pytest.raises(ValueError, match=r"mesh.feb: line 15: <elem>: there is no node 99"):
        read(tmp_path, text.replace(mesh, '<Mesh from="mesh.feb"/>'))
    with pytest.raises(ValueError, match="files include each other in a circle"):
        read(tmp_path, text.replace(mesh, "<Include>model.feb</Include>"))


WRONG = {
    "line 2: version '1.2' .* known are 2.0, 2.5, 3.0, 4.0": ('version="4.0"', 'version="1.2"'),
    "line 5: <node> must have 3 numbers, found '0, 0'": (">0, 0, 0<", ">0, 0<"),
    "line 5: <node>: 'one' is no whole number": ('id="1"', 'id="one"'),
    "line 15: <elem> must have 8 whole numbers, found '1,2,3,4,15,16,17'": ("17,18</elem>", "17</elem>"),
    "line 15: <elem>: there is no node 19": ("17,18</elem>", "17,19</elem>"),
    "line 14: <Elements>: 'cube' is no type of elements": ('type="hex8"', 'type="cube"'),
    "line 17: <NodeSet> has no name": ('<NodeSet name="left"', "<NodeSet"),
    "line 17: <NodeSet>: there is no node 5": ("15:18:3", "5:9000000000000"),
    "line 17: <NodeSet>: '15:18:0' is no range": ("15:18:3", "15:18:0"),
    "line 18: <quad4>: there is no node 7": (">15,16,17,18</quad4>", ">15,16,17,7</quad4>"),
    "line 18: <hex8> is no facet": ('quad4 id="1">15,16,17,18</quad4>', 'hex8 id="1">15,16,17,18</hex8>'),
    "line 20: <ElementSet>: there is no element 6": (">5</ElementSet>", ">6</ElementSet>"),
    "line 20: <PartList>: there is no part called 'ball'": (">cube</PartList>", ">ball</PartList>"),
    "line 20: <SurfacePair>: there is no <Surface> 'lid' .primary": ("<primary>top", "<primary>lid"),
    "line 22: this is no well-formed XML": ("</febio_spec>", "</febio>"),
    "line 2: <mesh> is no model of FEBio": ("febio_spec", "mesh"),
    "no <Mesh>": ("Mesh>", "Lattice>"),
}


@pytest.mark.parametrize("message", WRONG)
def test_what_is_wrong_is_said_with_its_line(tmp_path, message):
    with pytest.raises(ValueError, match=message):
        read(tmp_path, model().replace(*WRONG[message]))


def test_damaged_files_are_refused_and_nothing_else_happens(tmp_path):
    path, rng, whole = tmp_path / "model.feb", random.Random(1), model("2.5").encode()
    for _ in range(100):
        path.write_bytes(whole[: rng.randrange(len(whole) - 2)])
        with pytest.raises(ValueError, match="line"):
            read_febio(path)
        damaged = bytearray(whole)
        damaged[rng.randrange(len(whole))] = rng.randrange(256)
        path.write_bytes(damaged)
        try:
            assert np.isfinite(read_febio(path).points).all()
        except ValueError:
            continue
