"""FEBio models as case files: materials, conditions, loads, contacts, rigid bodies, and what is left out."""

import tomllib

import numpy as np
import pytest
from mpi4py import MPI

from cutsim.cases import import_model, read_case
from cutsim.materials.anisotropic import FungOrthotropic
from helpers.materials import stress

CUBE = """<Nodes name="o">
<node id="1">0,0,0</node><node id="2">1,0,0</node><node id="3">1,1,0</node><node id="4">0,1,0</node>
<node id="5">0,0,1</node><node id="6">1,0,1</node><node id="7">1,1,1</node><node id="8">0,1,1</node>
<node id="9">0,0,2</node><node id="10">1,0,2</node><node id="11">1,1,2</node><node id="12">0,1,2</node>
</Nodes>
<Elements type="hex8" name="cube" mat="1"><elem id="1">1,2,3,4,5,6,7,8</elem></Elements>"""
SETS = """<NodeSet name="left">{left}</NodeSet><NodeSet name="top">{top}</NodeSet>
<Surface name="upper"><quad4 id="1">5,6,7,8</quad4></Surface>"""
# a brick on the cube that shares no node with it
BRICK = """<Nodes name="p"><node id="21">0,0,1</node><node id="22">1,0,1</node><node id="23">1,1,1</node>
<node id="24">0,1,1</node></Nodes>
<Elements type="hex8" name="brick" mat="2"><elem id="2">21,22,23,24,9,10,11,12</elem></Elements>
<Surface name="lower"><quad4 id="1">21,24,23,22</quad4></Surface>"""
SOFT = '<material id="1" name="soft" type="neo-Hookean"><density>2</density><E>3</E><v>0.3</v></material>'
CURVE = (
    '<load_controller id="1" type="loadcurve"><points><point>0,0</point><point>1,1</point></points></load_controller>'
)
STEPS = "<time_steps>5</time_steps><step_size>0.2</step_size>"


def listed(tag, numbers):
    return "".join(f'<{tag} id="{i}"/>' for i in numbers)


def write(folder, version="4.0", *, material=SOFT, mesh="", curve=CURVE, control=STEPS, **sections):
    """Write a model of a cube, with further sections by their tags."""
    new = version in ("3.0", "4.0")
    if version == "4.0":
        sets = SETS.format(left="1,4,5,8", top="5,6,7,8")
    else:
        tag = "n" if version == "3.0" else "node"
        sets = SETS.format(left=listed(tag, (1, 4, 5, 8)), top=listed(tag, (5, 6, 7, 8)))
    domains = '<MeshDomains><SolidDomain name="cube" mat="soft"/>{}</MeshDomains>'
    domains = domains.format('<SolidDomain name="brick" mat="other"/>' if "brick" in mesh else "") if new else ""
    geometry = "Mesh" if new else "Geometry"
    parts = "\n".join(f"<{tag}>{text}</{tag}>" for tag, text in sections.items())
    path = folder / "model.feb"
    path.write_text(
        f"""<?xml version="1.0" encoding="ISO-8859-1"?>
<febio_spec version="{version}">
<Module type="solid"/>
<Control>{control}</Control>
<Material>{material}</Material>
<{geometry}>{CUBE}{sets}{mesh}</{geometry}>{domains}
{parts}
<LoadData>{curve}</LoadData>
</febio_spec>
"""
    )
    return path


def imported(folder, *args, **sections):
    """Tables of the case, and what is not translated."""
    result = import_model(write(folder, *args, **sections))
    return tomllib.loads(result.case_text), result


CONDITIONS = {
    "2.0": (
        f'<fix bc="xy">{listed("node", (1, 4))}</fix><prescribe bc="z" lc="1" set="top"/>',
        '<loadcurve id="1" type="linear"><loadpoint>0,0</loadpoint><loadpoint>1,1</loadpoint></loadcurve>',
    ),
    "2.5": (
        '<fix bc="x,y" node_set="left"/><prescribe bc="z" node_set="top"><scale lc="1">1</scale></prescribe>',
        '<loadcurve id="1" type="linear"><point>0,0</point><point>1,1</point></loadcurve>',
    ),
    "3.0": (
        '<bc type="fix" node_set="left"><dofs>x,y</dofs></bc>'
        '<bc type="prescribe" node_set="top"><dof>z</dof><scale lc="1">1</scale><relative>0</relative></bc>',
        CURVE,
    ),
    "4.0": (
        '<bc type="zero displacement" node_set="left"><x_dof>1</x_dof><y_dof>1</y_dof><z_dof>0</z_dof></bc>'
        '<bc type="prescribed displacement" node_set="top"><dof>z</dof><value lc="1">1</value></bc>',
        CURVE,
    ),
}


@pytest.mark.parametrize("version", CONDITIONS)
def test_conditions_of_each_version(version, tmp_path):
    """Two fixed directions of a set, and a third one that follows a load curve; nothing is left out."""
    boundary, curve = CONDITIONS[version]
    case, result = imported(tmp_path, version, Boundary=boundary, curve=curve)
    assert result.untranslated == result.differences == ()
    held = {"points": [[0, 0, 0], [0, 1, 0]]} if version == "2.0" else {"vertices": "left"}
    expected = [held | {"direction": "x"}, held | {"direction": "y"}]
    assert list(case["supports"].values()) == [*expected, {"vertices": "top", "direction": "z", "value": "1*t"}]
    assert case["analysis"] == {"type": "quasi-static", "until": 1.0} and case["steps"] == {"fixed": 0.2}
    assert case["bodies"]["cube"]["material"] == {"model": "neo-hookean", "young": 3.0, "poisson": 0.3}
    read_case(write_case(result, tmp_path))


def write_case(result, folder):
    result.write(folder / "case.toml")
    return folder / "case.toml"


def test_stretched_cube(tmp_path):
    """The case runs: the force on the upper face is that of the neo-Hookean bar, whose sides are free of stress."""
    fixed = "".join(
        f'<bc type="zero displacement" node_set="{name}"><{axis}_dof>1</{axis}_dof></bc>'
        for name, axis in (("left", "x"), ("front", "y"), ("base", "z"))
    )
    pulled = '<bc name="pull" type="prescribed displacement" node_set="top"><dof>z</dof><value lc="1">0.5</value></bc>'
    sets = '<NodeSet name="front">1,2,5,6</NodeSet><NodeSet name="base">1,2,3,4</NodeSet>'
    result = import_model(write(tmp_path, Boundary=fixed + pulled, mesh=sets))
    simulation = read_case(write_case(result, tmp_path)).build(MPI.COMM_SELF)
    rows = []
    simulation.run(rows.append)
    young, nu, stretch = 3.0, 0.3, 1.5
    shear, lame = young / (2 * (1 + nu)), young * nu / ((1 + nu) * (1 - 2 * nu))
    lateral = 1 + simulation.mechanics.state.u.x.array.min()
    assert shear * (lateral**2 - 1) + lame * np.log(lateral**2 * stretch) == pytest.approx(0, abs=1e-8)
    stress = (shear * (stretch**2 - 1) + lame * np.log(lateral**2 * stretch)) / stretch
    assert rows[-1].columns["pull_force"][0] == pytest.approx(stress, rel=1e-7)


UNCOUPLED = "<k>100</k><pressure_model>default</pressure_model>"
MATERIALS = {
    "isotropic elastic": ("<E>1</E><v>0.2</v>", {"model": "st-venant-kirchhoff", "young": 1.0, "poisson": 0.2}),
    "Mooney-Rivlin": (
        f"<c1>1</c1><c2>0.5</c2>{UNCOUPLED}",
        {"model": "mooney-rivlin", "c1": 1, "c2": 0.5, "bulk": 100},
    ),
    "Ogden": (
        f"<c1>2</c1><m1>3</m1><c2>0</c2><m2>1</m2><c3>0.5</c3><m3>-2</m3>{UNCOUPLED}",
        {"model": "isochoric-ogden", "moduli": [2, 0.5], "exponents": [3, -2], "bulk": 100},
    ),
    "Ogden unconstrained": (
        "<c1>2</c1><m1>3</m1><cp>4</cp>",
        {"model": "ogden", "moduli": [2], "exponents": [3], "volumetric": 4},
    ),
    "Yeoh": (
        f"<c1>1</c1><c2>0.2</c2><c3>0.1</c3>{UNCOUPLED}",
        {"model": "yeoh", "c1": 1, "c2": 0.2, "c3": 0.1, "bulk": 100},
    ),
    "coupled Mooney-Rivlin": ("<c1>1</c1><c2>0</c2><k>2</k>", {"model": "neo-hookean", "young": 5.0, "poisson": 0.25}),
    "incomp neo-Hookean": (
        f"<G>1</G>{UNCOUPLED}",
        {"model": "isochoric-neo-hookean", "young": 900 / 301, "poisson": 298 / 602},
    ),
}


def of_type(kind, parameters):
    return f'<material id="1" name="soft" type="{kind}"><density>1</density>{parameters}</material>'


@pytest.mark.parametrize("kind", MATERIALS)
def test_material(kind, tmp_path):
    """Constants of each material, and elements: mixed where FEBio's are."""
    parameters, table = MATERIALS[kind]
    case, result = imported(tmp_path, material=of_type(kind, parameters))
    body = case["bodies"]["cube"]
    model = body["material"].pop("model")
    assert model == table["model"]
    assert body["material"] == {k: pytest.approx(v) for k, v in table.items() if k != "model"}
    assert body["volumetric"] == ("mixed" if UNCOUPLED in parameters else "full")
    assert not result.differences and [line.split(":")[2] for line in result.untranslated] == [" <LoadData>"]


def test_fung(tmp_path):
    """The stiffness at small strain, c b and G, is the inverse of the compliance that FEBio's constants say."""
    constants = {"E1": 1, "E2": 2, "E3": 3, "G12": 4, "G23": 5, "G31": 6, "v12": 0.1, "v23": 0.2, "v31": 0.3, "c": 7}
    parameters = "".join(f"<{k}>{v}</{k}>" for k, v in constants.items()) + UNCOUPLED
    axes = '<mat_axis type="vector"><a>0,2,0</a><d>-1,1,0</d></mat_axis>'
    table = imported(tmp_path, material=of_type("Fung orthotropic", parameters + axes))[0]["bodies"]["cube"]["material"]
    assert table.pop("model") == "fung-orthotropic"
    fung = FungOrthotropic(**{k: tuple(v) if isinstance(v, list) else v for k, v in table.items() if k != "axes"})
    assert table["axes"] == [[0, 2, 0], [-1, 0, 0]]
    (b11, b22, b33), (b12, b23, b31) = fung.normal, fung.coupling
    compliance = np.linalg.inv(fung.modulus * np.array([[b11, b12, b31], [b12, b22, b23], [b31, b23, b33]]))
    np.testing.assert_allclose(1 / np.diag(compliance), [1, 2, 3])
    np.testing.assert_allclose([-compliance[0, 1] * 1, -compliance[1, 2] * 2, -compliance[2, 0] * 3], [0.1, 0.2, 0.3])
    np.testing.assert_allclose(fung.modulus * np.array(fung.shear), [4, 5, 6])


def test_fibres(tmp_path):
    """Two families at ± 30° in the plane of the axes; another volumetric energy is said."""
    parameters = f"<c>1</c><k1>2</k1><k2>3</k2><kappa>0.1</kappa><gamma>30</gamma>{UNCOUPLED}"
    case, result = imported(tmp_path, material=of_type("Holzapfel-Gasser-Ogden", parameters))
    families = case["bodies"]["cube"]["material"]["fibres"]
    assert [family.pop("direction")[:2] for family in families] == [
        pytest.approx([np.sqrt(3) / 2, sign * 0.5]) for sign in (1, -1)
    ]
    assert families == 2 * [{"model": "dispersed-fibres", "k1": 2.0, "k2": 3.0, "dispersion": 0.1}]
    assert "(J^2 - 1 - 2 ln J)" in result.differences[0] and "model.feb:5:" in result.differences[0]


def test_relaxation(tmp_path):
    """g₀ scales what relaxes and not the bulk modulus; in a coupled material the volumetric part relaxes, too: said."""
    inner = '<elastic type="Mooney-Rivlin"><c1>1</c1><c2>0</c2><k>0</k></elastic>'
    series = f"<g0>0.5</g0><g1>0.25</g1><t1>2</t1><g2>0</g2><t2>0</t2>{UNCOUPLED}"
    body = imported(tmp_path, material=of_type("uncoupled viscoelastic", series + inner))[0]["bodies"]["cube"]
    assert body["material"] == {"model": "mooney-rivlin", "c1": 0.5, "c2": 0.0, "bulk": 100.0}
    assert body["relaxation"] == {"strengths": [0.5], "times": [2.0]}
    for poisson, said in ((0.3, 1), (0.0, 0)):
        inner = f'<elastic type="neo-Hookean"><E>1</E><v>{poisson}</v></elastic>'
        result = imported(tmp_path, material=of_type("viscoelastic", f"<g1>0.25</g1><t1>2</t1>{inner}"))[1]
        assert len(result.differences) == said


CURVES = {
    "linear": ("<interpolate>LINEAR</interpolate>", {0.25: 0.5, 0.75: 1.0, 1.5: 1.0}),
    "step": ("<interpolate>STEP</interpolate>", {0.25: 1.0, 0.6: 1.0, 1.5: 1.0}),
    "smooth step": ("<interpolate>SMOOTH STEP</interpolate>", {0.125: 53 / 512, 0.25: 0.5, 1.5: 1.0}),
    "smooth": ("<interpolate>SMOOTH</interpolate>", {0.25: 0.75, 0.75: 0.75, 0.5: 1.0}),
    "extrapolate": ("<extend>EXTRAPOLATE</extend>", {0.25: 0.5, 1.5: 1.0, 2.0: 1.0}),
    "repeat": ("<extend>REPEAT</extend>", {0.25: 0.5, 1.25: 0.5, 1.75: 1.0}),
    "repeat offset": ("<extend>REPEAT OFFSET</extend>", {0.25: 0.5, 1.25: 1.5, 1.75: 2.0}),
}


@pytest.mark.parametrize("kind", CURVES)
def test_load_curve(kind, tmp_path):
    """Values of each kind of curve through (0, 0), (½, 1), (1, 1), and of a parabola for the smooth one."""
    setting, values = CURVES[kind]
    last = 0 if kind == "smooth" else 1
    points = f"<points><pt>0,0</pt><pt>0.5,1</pt><pt>1,{last}</pt></points>"
    curve = f'<load_controller id="1" type="loadcurve">{setting}{points}</load_controller>'
    control = "<time_steps>10</time_steps><step_size>0.2</step_size>"
    table = imported(tmp_path, Boundary=CONDITIONS["4.0"][0], curve=curve, control=control)[0]
    value = next(s["value"] for s in table["supports"].values() if "value" in s)
    found = np.interp(list(values), value["times"], value["values"])
    np.testing.assert_allclose(found, list(values.values()), atol=2e-3 if kind == "smooth" else 1e-5)


def test_loads(tmp_path):
    """Pressure; tractions on the current area from version 3 on; forces on nodes, by direction and size."""
    loads = (
        '<surface_load name="p" type="pressure" surface="upper"><pressure lc="1">2</pressure></surface_load>'
        '<surface_load name="t" type="traction" surface="upper"><scale lc="1">1</scale><traction>3,0,4</traction>'
        "</surface_load>"
        '<body_load type="const"><x>0</x><y>0</y><z lc="1">10</z></body_load>'
        '<nodal_load name="f" type="nodal_force" node_set="top"><value lc="1">0,-2,0</value></nodal_load>'
    )
    case, result = imported(tmp_path, Loads=loads)
    assert result.untranslated == ()
    assert case["loads"] == {
        "p": {"kind": "pressure", "facets": "upper", "value": "2*t"},
        "t": {
            "kind": "traction", "facets": "upper", "direction": [0.6, 0, 0.8], "value": "5*t", "current_area": True,
        },
        # against its component in FEBio
        "weight_z": {"kind": "weight", "direction": "-z", "value": "10*t"},
        "f": {"kind": "force", "vertices": "top", "direction": [0, -1, 0], "value": "2*t"},
    }  # fmt: skip


RIGID = SOFT + '<material id="2" name="other" type="rigid body"><density>1</density></material>'
PRESSED = """<rigid_bc type="rigid_fixed"><rb>other</rb><Rx_dof>1</Rx_dof><Ry_dof>1</Ry_dof><Ru_dof>1</Ru_dof>
<Rv_dof>1</Rv_dof><Rw_dof>1</Rw_dof></rigid_bc>
<rigid_bc type="rigid_displacement"><rb>other</rb><dof>z</dof><value lc="1">-0.1</value></rigid_bc>"""
PAIR = BRICK + '<SurfacePair name="pair"><primary>upper</primary><secondary>lower</secondary></SurfacePair>'
SLIDING = """<contact name="touch" type="sliding-elastic" surface_pair="pair"><laugon>{laugon}</laugon>
<penalty>5</penalty><auto_penalty>1</auto_penalty><two_pass>0</two_pass><fric_coeff>0.2</fric_coeff>
<search_tol>0.01</search_tol></contact>"""


def test_rigid_body_becomes_a_tool(tmp_path):
    """A rigid brick that is pressed on the cube is a closed surface with a path, and no part of the mesh."""
    mesh = PAIR + '<NodeSet name="far">9,10,11,12</NodeSet>'
    held = '<bc type="zero displacement" node_set="far"><x_dof>1</x_dof></bc>'
    contact = SLIDING.format(laugon="PENALTY")
    case, result = imported(tmp_path, material=RIGID, mesh=mesh, Rigid=PRESSED, Contact=contact, Boundary=held)
    assert result.untranslated == () and case["mesh"]["only"] == ["cube"]
    assert "supports" not in case and "no effect" in result.differences[0]
    tool = case["tools"]["other"]
    assert tool["path"] == {"times": [0, 1], "points": [[0, 0, 0], [0, 0, -0.1]]}
    # 5 E over the height of the element
    assert (tool["surfaces"], tool["friction"], tool["contact"]) == (["upper"], 0.2, {"stiffness": 15.0})
    lines = result.files[tool["file"]].splitlines()
    points = np.array([line.split()[1:] for line in lines if line[0] == "v"], dtype=float)
    facets = np.array([line.split()[1:] for line in lines if line[0] == "f"], dtype=int) - 1
    # a closed surface with outward normals around the volume of the brick
    assert np.linalg.det(points[facets]).sum() / 6 == pytest.approx(1.0)
    read_case(write_case(result, tmp_path))


def test_free_rigid_body(tmp_path):
    """A rigid body that is pushed by a force has no counterpart: body and contact are listed, with their lines."""
    free = PRESSED.replace('<rigid_bc type="rigid_displacement"', '<rigid_load type="rigid_force"')
    free = free.replace("</value></rigid_bc>", "</value></rigid_load>")
    case, result = imported(tmp_path, material=RIGID, mesh=PAIR, Rigid=free, Contact=SLIDING.format(laugon="PENALTY"))
    assert "tools" not in case
    listed = "\n".join(result.untranslated)
    assert "'rigid_force': has no counterpart" in listed and "'touch'" in listed
    assert all(line in result.case_text for line in result.untranslated)


def test_fastened_nodes(tmp_path):
    """Nodes that a rigid brick and the cube have in common, and a set fastened to it, move as the brick does."""
    shared = BRICK.replace("21,22,23,24,9", "5,6,7,8,9").split("<Surface")[0]
    fastened = '<bc name="glued" type="rigid" node_set="left"><rb>other</rb></bc>'
    case, result = imported(tmp_path, material=RIGID, mesh=shared, Rigid=PRESSED, Boundary=fastened)
    assert result.untranslated == ()
    supports = case["supports"]
    assert supports["glued_z"] == {"vertices": "left", "direction": "z", "value": "-0.1*t"}
    assert supports["other_nodes_x"]["points"] == [[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]


def test_pairs(tmp_path):
    """Sliding surfaces with an augmented penalty, and tied ones with a bond of FEBio's own penalty."""
    other = SOFT + SOFT.replace('"1"', '"2"').replace('"soft"', '"other"')
    case, result = imported(tmp_path, material=other, mesh=PAIR, Contact=SLIDING.format(laugon="AUGLAG"))
    pair = case["pairs"]["touch"]
    assert (pair["slave"], pair["master"], pair["friction"]) == ("upper", "lower", 0.2)
    assert pair["allowed_penetration"] == pytest.approx(0.01)
    tied = SLIDING.format(laugon="PENALTY").replace("sliding-elastic", "tied-elastic")
    case, result = imported(
        tmp_path, material=other, mesh=PAIR, Contact=tied.replace("<fric_coeff>0.2</fric_coeff>", "")
    )
    assert [line.split(": ", 1)[1] for line in result.untranslated] == [
        "<LoadData>: nothing that is translated uses it"
    ]
    assert case["pairs"]["touch"]["law"]["penalty"] == pytest.approx(15.0) and case["pairs"]["touch"]["small_sliding"]
    read_case(write_case(result, tmp_path))


def test_steps_and_inertia(tmp_path):
    """Adaptive steps, the scheme, and the density that inertia needs."""
    control = (
        f"<analysis>DYNAMIC</analysis>{STEPS}<time_stepper><dtmin>0.01</dtmin><dtmax>0.1</dtmax></time_stepper>"
        '<solver type="solid"><rhoi>0.5</rhoi><dtol>0.001</dtol></solver>'
    )
    case, result = imported(tmp_path, control=control, Boundary=CONDITIONS["4.0"][0])
    assert result.untranslated == () and case["steps"] == {"first": 0.1, "largest": 0.1}
    assert case["analysis"]["scheme"] == {"model": "generalised-alpha", "rho_inf": 0.5}
    assert case["bodies"]["cube"]["density"] == 2.0
    read_case(write_case(result, tmp_path))


def test_nothing_is_dropped(tmp_path):
    """Unknown sections, elements and parameters are listed with their lines, in the case file, too."""
    unknown = {
        "Loads": '\n<surface_load type="fluidflux" surface="upper"/>\n<body_load type="odd"><x>1</x></body_load>',
        "Boundary": '\n<bc type="prescribed displacement" node_set="top"><dof>z</dof><value lc="1">1</value>'
        "\n<strange>1</strange></bc>",
        "Discrete": "\n<spring/>",
    }
    material = SOFT.replace("<E>", "\n<mystery>1</mystery><E>")
    result = import_model(write(tmp_path, material=material, **unknown))
    text = (tmp_path / "model.feb").read_text().splitlines()
    for word in ("fluidflux", "odd", "strange", "Discrete", "mystery"):
        line = 1 + next(i for i, each in enumerate(text) if f"<{word}" in each or f'"{word}"' in each)
        found = [each for each in result.untranslated if each.startswith(f"model.feb:{line}:") and word in each]
        assert len(found) == 1 and f"#   {found[0]}" in result.case_text, word


def test_without_counterpart(tmp_path):
    """What our classes refuse is listed and not forced on them."""
    for material in (
        of_type("Mooney-Rivlin", f"<c1>1</c1><c2>-0.1</c2>{UNCOUPLED}"),
        of_type("Yeoh", f"<c1>1</c1><c4>0.1</c4>{UNCOUPLED}"),
        of_type("coupled Mooney-Rivlin", "<c1>1</c1><c2>1</c2><k>2</k>"),
        of_type("neo-Hookean", '<E type="map">field</E><v>0.3</v>'),
        of_type("neo-Hookean", '<E lc="1">2</E><v>0.3</v>'),
        of_type("ionised gel", ""),
    ):
        case, result = imported(tmp_path, material=material)
        assert "bodies" not in case and any("model.feb:5: <material> 'soft'" in line for line in result.untranslated)


MALFORMED = {
    "no XML": ("<febio_spec", "<febio_spec <", "no well-formed XML"),
    "no model": ("febio_spec", "html", "is no model of FEBio"),
    "version": ('version="4.0"', 'version="1.2"', "version '1.2'"),
    "number": ("<E>3</E>", "<E>soft</E>", "model.feb:5: E = 'soft' is no number"),
    "constant": ("<v>0.3</v>", "", "model.feb:5: <material> has no v"),
    "node set": ('node_set="top"', 'node_set="tip"', "there is no node set 'tip'"),
    "load curve": ('lc="1"', 'lc="3"', "there is no load curve 3"),
    "points": ("<point>1,1</point>", "<point>1</point>", "<point> has 1 numbers in place of 2"),
    "order": ("<point>1,1</point>", "<point>-1,1</point>", "increasing times"),
    "element": ("1,2,3,4,5,6,7,8", "1,2,3,4,5,6,7,88", "node 88"),
    "end": ("</febio_spec>", "", "no well-formed XML"),
}


@pytest.mark.parametrize("what", MALFORMED)
def test_malformed(what, tmp_path):
    """One line that names the file and the place."""
    old, new, message = MALFORMED[what]
    path = write(tmp_path, Boundary=CONDITIONS["4.0"][0])
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(ValueError) as error:
        import_model(path)
    assert message in str(error.value) and "\n" not in str(error.value) and str(error.value).startswith("model.feb:")


def test_other_files(tmp_path):
    """The name says the format."""
    with pytest.raises(ValueError, match=r"\(\.feb\) or Abaqus \(\.inp\)"):
        import_model(tmp_path / "model.stl")


# -- stresses as FEBio computes them ----------------------------------------------------------------------------------


def deviator(stress):
    return stress - np.trace(stress) / 3 * np.eye(3)


def holzapfel_stress(F, c=1.0, k1=2.0, k2=3.0, kappa=0.1, gamma=30.0):
    """Deviatoric Cauchy stress times J by FEBio's manual: c b̄ + Σ 2 k₁ E exp(k₂E²) h, h = κ b̄ + (1 − 3κ) a ⊗ a."""
    bar = F / np.cbrt(np.linalg.det(F))
    b, total = bar @ bar.T, 0.0
    for sign in (1, -1):
        a = bar @ [np.cos(np.radians(gamma)), sign * np.sin(np.radians(gamma)), 0.0]
        strain = max(kappa * (np.trace(b) - 3) + (1 - 3 * kappa) * (a @ a - 1), 0.0)
        total = total + 2 * k1 * strain * np.exp(k2 * strain**2) * (kappa * b + (1 - 3 * kappa) * np.outer(a, a))
    return deviator(c * b + total)


def fung_stress(F, E=(1.0, 2.0, 3.0), G=(4.0, 5.0, 6.0), v=(0.1, 0.2, 0.3), c=7.0):
    """The same for Fung's solid: W = c/2 (exp(Q/c) − 1), Q = Σ 2 μₐ A:E² + Σ λₐᵦ (A:E)(B:E)."""
    mu = np.array([G[0] + G[2] - G[1], G[0] - G[2] + G[1], -G[0] + G[2] + G[1]])
    compliance = np.diag([1 / e for e in E])
    for i, j, value in ((0, 1, v[0] / E[0]), (1, 2, v[1] / E[1]), (0, 2, v[2] / E[2])):
        compliance[i, j] = compliance[j, i] = -value
    lame = np.linalg.inv(compliance) - 2 * np.diag(mu)
    bar = F / np.cbrt(np.linalg.det(F))
    strain = 0.5 * (bar.T @ bar - np.eye(3))
    normal, dQ = np.diag(strain), np.zeros((3, 3))
    Q = 2 * mu @ np.diag(strain @ strain) + normal @ lame @ normal
    for i in range(3):
        A = np.outer(np.eye(3)[i], np.eye(3)[i])
        dQ += 2 * mu[i] * (A @ strain + strain @ A) + 2 * (lame @ normal)[i] * A
    return deviator(bar @ (0.5 * np.exp(Q / c) * dQ) @ bar.T)


STRESSES = {
    "Holzapfel-Gasser-Ogden": (
        "<c>1</c><k1>2</k1><k2>3</k2><kappa>0.1</kappa><gamma>30</gamma>", holzapfel_stress,
    ),
    "Fung orthotropic": (
        "<E1>1</E1><E2>2</E2><E3>3</E3><G12>4</G12><G23>5</G23><G31>6</G31><v12>0.1</v12><v23>0.2</v23><v31>0.3</v31>"
        "<c>7</c>", fung_stress,
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", STRESSES)
def test_stress_of_anisotropic_materials(kind, tmp_path):
    """The deviatoric stress of the material in the case is that of FEBio's formulas, in shear and stretch."""
    constants, formula = STRESSES[kind]
    case = read_case(
        write_case(
            imported(tmp_path, material=of_type(kind, constants + UNCOUPLED), Boundary=CONDITIONS["4.0"][0])[1],
            tmp_path,
        )
    )
    F = np.array([[1.2, 0.3, -0.1], [0.05, 0.9, 0.2], [0.1, -0.15, 1.1]])
    cauchy = stress(case.bodies["cube"].material, F) @ F.T
    np.testing.assert_allclose(deviator(cauchy), formula(F), rtol=1e-9, atol=1e-12)
