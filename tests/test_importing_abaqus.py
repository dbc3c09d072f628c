"""Abaqus models as case files: materials, conditions and loads through the steps, contacts, and what is left out."""

import tomllib

import numpy as np
import pytest
from mpi4py import MPI

from cutsim.cases import import_model, read_case

MODEL = """*HEADING
A stretched cube
*NODE, NSET=ALL
1, 0, 0, 0
2, 1, 0, 0
3, 1, 1, 0
4, 0, 1, 0
5, 0, 0, 1
6, 1, 0, 1
7, 1, 1, 1
8, 0, 1, 1
*ELEMENT, TYPE={kind}, ELSET=Cube
1, 1,2,3,4,5,6,7,8
*NSET, NSET=base
1,2,3,4
*NSET, NSET=top
5,6,7,8
*NSET, NSET=left
1,4,5,8
*NSET, NSET=front
1,2,5,6
*SURFACE, NAME=upper
Cube, S2
*SOLID SECTION, ELSET=CUBE, MATERIAL=rubber
*MATERIAL, NAME=Rubber
*DENSITY
2.0
{material}
{model}
*BOUNDARY
base, ZSYMM
left, 1
front, 2, 2
{steps}
"""
NEO_HOOKE = "*HYPERELASTIC, NEO HOOKE\n0.5, 0.02"
PULL = """*STEP, NLGEOM=YES
*STATIC
0.1, 1.0, 1e-5, 0.2
*BOUNDARY
top, 3, 3, 0.5
*OUTPUT, FIELD
*END STEP"""


def write(folder, *, material=NEO_HOOKE, kind="C3D8H", model="", steps=PULL):
    path = folder / "model.inp"
    path.write_text(MODEL.format(material=material, kind=kind, model=model, steps=steps))
    return path


def imported(folder, **parts):
    """Tables of the case, and what is not translated."""
    result = import_model(write(folder, **parts))
    return tomllib.loads(result.case_text), result


def value(case, name, time):
    """Value of a support or load at a time."""
    given = (case["supports"] | case.get("loads", {}))[name].get("value", 0.0)
    if isinstance(given, str):
        return float(given.removesuffix("*t")) * time
    return np.interp(time, given["times"], given["values"]) if isinstance(given, dict) else given


def test_stretched_cube(tmp_path):
    """The case runs: nominal stress of the neo-Hookean bar, 2 C10 (λ − λ⁻²) with K = 2/D1 as good as incompressible."""
    case, result = imported(tmp_path, material="*HYPERELASTIC, NEO HOOKE\n0.5, 2e-5")
    assert result.untranslated == result.differences == ()
    assert case["bodies"]["Cube"]["volumetric"] == "mixed" and case["title"] == "A stretched cube"
    assert case["steps"] == {"first": 0.1, "largest": 0.2}
    result.write(tmp_path / "case.toml")
    simulation = read_case(tmp_path / "case.toml").build(MPI.COMM_SELF)
    rows = []
    simulation.run(rows.append)
    assert rows[-1].columns["top_z_force"][0] == pytest.approx(1.5 - 1.5**-2, rel=1e-4)


ISOCHORIC = {"model": "isochoric-neo-hookean", "young": 9 * 100 / 301, "poisson": 298 / 602}
MATERIALS = {
    NEO_HOOKE: ISOCHORIC,
    "*HYPERELASTIC, REDUCED POLYNOMIAL, N=1\n0.5, 0.02": ISOCHORIC,
    "*HYPERELASTIC, MOONEY-RIVLIN\n1, 0.5, 0.02": {"model": "mooney-rivlin", "c1": 1, "c2": 0.5, "bulk": 100},
    "*HYPERELASTIC, POLYNOMIAL, N=1\n1, 0.5, 0.02": {"model": "mooney-rivlin", "c1": 1, "c2": 0.5, "bulk": 100},
    "*HYPERELASTIC, YEOH\n1, 0.2, 0.1, 0.02, 0, 0": {"model": "yeoh", "c1": 1, "c2": 0.2, "c3": 0.1, "bulk": 100},
    # 2 mu/alpha² is mu'/m²
    "*HYPERELASTIC, OGDEN, N=2\n1, 3, 0.25, -2, 0.02, 0": {
        "model": "isochoric-ogden", "moduli": [2, 0.5], "exponents": [3, -2], "bulk": 100,
    },
    "*HYPERELASTIC, ARRUDA-BOYCE\n1, 3, 0.02": {"model": "arruda-boyce", "modulus": 1, "links": 9, "bulk": 100},
    "*ELASTIC\n3, 0.3": {"model": "st-venant-kirchhoff", "young": 3, "poisson": 0.3},
}  # fmt: skip


@pytest.mark.parametrize("material", MATERIALS)
def test_material(material, tmp_path):
    """Constants of each energy."""
    case, result = imported(tmp_path, material=material)
    found, expected = case["bodies"]["Cube"]["material"], MATERIALS[material]
    assert result.untranslated == () and found.pop("model") == expected["model"]
    assert found == {k: pytest.approx(v) for k, v in expected.items() if k != "model"}


def test_small_displacements(tmp_path):
    """Without NLGEOM an elastic solid is linear; with it the difference is said, as is that of much volume change."""
    case, result = imported(tmp_path, material="*ELASTIC\n3, 0.3", steps=PULL.replace("NLGEOM=YES", "INC=10"))
    assert case["bodies"]["Cube"]["material"]["model"] == "linear-elastic" and not result.differences
    assert len(imported(tmp_path, material="*ELASTIC\n3, 0.3")[1].differences) == 1
    assert "(J-1)^2/D" in imported(tmp_path, material="*HYPERELASTIC, NEO HOOKE\n0.5, 1")[1].differences[0]
    assert "incompressible" in imported(tmp_path, material="*HYPERELASTIC, NEO HOOKE\n0.5")[1].differences[0]


@pytest.mark.parametrize("instantaneous", [False, True])
def test_relaxation(instantaneous, tmp_path):
    """Fractions of the instantaneous modulus become strengths relative to the relaxed one."""
    moduli = ", MODULI=INSTANTANEOUS" if instantaneous else ""
    material = f"*HYPERELASTIC, MOONEY-RIVLIN{moduli}\n1, 0.5, 0.02\n*VISCOELASTIC, TIME=PRONY\n0.2, 0, 1\n0.3, 0, 10"
    body = imported(tmp_path, material=material)[0]["bodies"]["Cube"]
    factor = 0.5 if instantaneous else 1.0
    assert body["material"] == {"model": "mooney-rivlin", "c1": factor, "c2": 0.5 * factor, "bulk": 100}
    assert body["relaxation"] == {"strengths": [pytest.approx(0.4), pytest.approx(0.6)], "times": [1, 10]}


SECOND = """*STEP, NLGEOM
*STATIC
0.1, 2.0
*BOUNDARY{0}
top, 3, 3, {1}
*DSLOAD
upper, P, 3
*CLOAD
6, 2, -4
7, 2, -4
*END STEP"""
#: Nodes with the same force are one load.
CORNERS = [[1, 0, 1], [1, 1, 1]]


def test_values_through_steps(tmp_path):
    """Values grow in their step and stay; times of a step's amplitude start with it."""
    case, result = imported(tmp_path, steps=f"{PULL}\n{SECOND.format('', 0.2)}")
    assert result.untranslated == () and case["analysis"]["until"] == 3.0
    assert [value(case, "top_z", t) for t in (0.5, 1, 2, 3)] == pytest.approx([0.25, 0.5, 0.35, 0.2])
    assert [value(case, "upper_pressure", t) for t in (1, 2, 3)] == pytest.approx([0, 1.5, 3])
    force = case["loads"]["nodes_force"]
    assert (force["points"], force["direction"], value(case, "nodes_force", 3)) == (CORNERS, [0, 1, 0], -4)
    amplitude = "*AMPLITUDE, NAME=a\n0, 1, 1, 2, 2, 0"
    case = imported(tmp_path, steps=f"{PULL}\n{SECOND.format(', AMPLITUDE=A', 0.5)}", model=amplitude)[0]
    assert [value(case, "top_z", t) for t in (1, 1.5, 2, 2.5, 3)] == pytest.approx([0.5, 0.75, 1, 0.5, 0])
    total = amplitude.replace("NAME=a", "NAME=a, TIME=TOTAL TIME").replace("1, 2, 2, 0", "1, 1, 3, 3")
    case = imported(tmp_path, steps=f"{PULL}\n{SECOND.format(', AMPLITUDE=A', 0.5)}", model=total)[0]
    assert [value(case, "top_z", t) for t in (1, 2, 3)] == pytest.approx([0.5, 1, 1.5])


def test_weight(tmp_path):
    """Gravity acts on bodies with their density; forces per volume along an axis."""
    steps = PULL.replace("*OUTPUT", "*DLOAD\n, GRAV, 5, 0, 0, -2\ncube, BY, 3\n*OUTPUT")
    case, result = imported(tmp_path, steps=steps)
    assert result.untranslated == () and case["bodies"]["Cube"]["density"] == 2
    assert case["loads"] == {
        "weight": {"kind": "weight", "direction": [0, 0, -1], "value": "10*t"},
        "Cube_body_force": {"kind": "body-force", "bodies": ["Cube"], "direction": [0, 1, 0], "value": "3*t"},
    }
    result.write(tmp_path / "case.toml")
    read_case(tmp_path / "case.toml")


def test_jumps_and_loads_that_end(tmp_path):
    """A step may apply its values at once; a load that OP=NEW leaves out fades."""
    steps = PULL.replace("NLGEOM=YES", "NLGEOM=YES, AMPLITUDE=STEP").replace("*OUTPUT", "*DSLOAD\nupper, P, 2\n*OUTPUT")
    fading = "*STEP\n*STATIC\n1, 1\n*DSLOAD, OP=NEW\n*END STEP"
    case = imported(tmp_path, steps=f"{steps}\n{fading}")[0]
    assert [value(case, "upper_pressure", t) for t in (0, 0.01, 1, 1.5, 2)] == pytest.approx([0, 2, 2, 1, 0])
    released = "*STEP\n*STATIC\n1, 1\n*BOUNDARY, OP=NEW\nbase, ZSYMM\n*END STEP"
    assert "OP=NEW" in imported(tmp_path, steps=f"{PULL}\n{released}")[1].untranslated[0]


SECOND_CUBE = """*NODE
11, 0, 0, 1
12, 1, 0, 1
13, 1, 1, 1
14, 0, 1, 1
15, 0, 0, 2
16, 1, 0, 2
17, 1, 1, 2
18, 0, 1, 2
*ELEMENT, TYPE=C3D8H, ELSET=other
2, 11,12,13,14,15,16,17,18
*SURFACE, NAME=lower
other, S1
*SOLID SECTION, ELSET=other, MATERIAL=rubber
"""


def test_contacts(tmp_path):
    """Pairs with friction and a penalty of their own; ties are stiff bonds, which is said."""
    pair = """*SURFACE INTERACTION, NAME=rub
*FRICTION
0.3
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR
70
*CONTACT PAIR, INTERACTION=RUB, TYPE=SURFACE TO SURFACE, SMALL SLIDING
lower, upper"""
    case, result = imported(tmp_path, model=SECOND_CUBE + pair)
    assert result.untranslated == ()
    expected = {
        "slave": "lower",
        "master": "upper",
        "friction": 0.3,
        "contact": {"stiffness": 70},
        "small_sliding": True,
    }
    assert case["pairs"] == {"lower_upper": expected}
    result.write(tmp_path / "case.toml")
    read_case(tmp_path / "case.toml")
    case, result = imported(tmp_path, model=SECOND_CUBE + "*TIE, NAME=glue\nlower, upper")
    assert case["pairs"]["glue"]["law"]["model"] == "bilinear" and "*TIE" in result.differences[0]
    result.write(tmp_path / "case.toml")
    read_case(tmp_path / "case.toml")


FLAT = """*NODE
1, 1, 0
2, 2, 0
3, 2, 1
4, 1, 1
*ELEMENT, TYPE={0}, ELSET=sheet
1, 1,2,3,4
*NSET, NSET=low
1, 2
*SOLID SECTION, ELSET=sheet, MATERIAL=m
{1}
*MATERIAL, NAME=m
*ELASTIC
3, 0.3
*STEP
*STATIC
*BOUNDARY
low, ENCASTRE
*END STEP
"""


def test_plane_and_axisymmetric(tmp_path):
    """Types of elements say what a plane mesh stands for."""
    path = tmp_path / "model.inp"
    for kind, key, section in (("CPS4", ("bodies", "sheet", "plane"), ""), ("CAX4", ("mesh", "axisymmetric"), "")):
        path.write_text(FLAT.format(kind, section))
        case = found = tomllib.loads(import_model(path).case_text)
        for each in key:
            found = found[each]
        assert found in ("stress", True) and case["mesh"]["dim"] == 2
        assert [s["direction"] for s in case["supports"].values()] == ["x", "y"]
    path.write_text(FLAT.format("CPE4", "0.5"))
    assert "unit of thickness" in import_model(path).differences[0]


def test_instances(tmp_path):
    """A section of a part is that of all its instances; sets of the assembly are found."""
    head, _ = MODEL.split("*NSET, NSET=base")
    part = (
        head.replace("*HEADING\nA stretched cube\n", "*PART, NAME=p\n") + "*SOLID SECTION, ELSET=CUBE, MATERIAL=rubber"
    )
    assembly = """
*END PART
*ASSEMBLY, NAME=a
*INSTANCE, NAME=one, PART=p
*END INSTANCE
*INSTANCE, NAME=two, PART=p
3, 0, 0
*END INSTANCE
*NSET, NSET=grip, INSTANCE=two
5,6,7,8
*END ASSEMBLY
*MATERIAL, NAME=rubber
*ELASTIC
1, 0.3
*STEP
*STATIC
*BOUNDARY
GRIP, 3, 3, 0.1
one.all, 1
*END STEP
"""
    path = tmp_path / "model.inp"
    path.write_text(part.format(kind="C3D8") + assembly)
    case = tomllib.loads(import_model(path).case_text)
    assert [body["cells"] for body in case["bodies"].values()] == ["one.Cube", "two.Cube"]
    assert [s["vertices"] for s in case["supports"].values()] == ["grip", "one.ALL"]


def test_nothing_is_dropped(tmp_path):
    """Keywords without a counterpart, and some values, are listed with their lines."""
    model = "*ORIENTATION, NAME=o\n1,0,0,0,1,0\n*INITIAL CONDITIONS, TYPE=TEMPERATURE\nall, 20\n*EQUATION\n1\n1,1,1"
    material = f"{NEO_HOOKE}\n*EXPANSION\n1e-5"
    steps = PULL.replace("*OUTPUT", "*DLOAD\nCube, P2, 1\n*MODEL CHANGE, REMOVE\nCube\n*OUTPUT")
    result = imported(tmp_path, model=model, material=material, steps=steps)[1]
    text = (tmp_path / "model.inp").read_text().splitlines()
    for word in ("*ORIENTATION", "*INITIAL CONDITIONS", "*EQUATION", "*EXPANSION", "*MODEL CHANGE"):
        line = 1 + next(i for i, each in enumerate(text) if each.startswith(word))
        assert f"model.inp:{line}: {word}: has no counterpart" in result.untranslated
    assert any("P2 on elements" in line for line in result.untranslated)
    assert all(f"#   {line}" in result.case_text for line in result.untranslated)


def test_without_counterpart(tmp_path):
    """Materials that our classes refuse, or that are none of ours, are listed."""
    for material in (
        "*HYPERELASTIC, MOONEY-RIVLIN\n1, -0.5, 0.02",
        "*HYPERELASTIC, VAN DER WAALS\n1, 10, 0.1, 0, 0.02",
        "*HYPERELASTIC, OGDEN, N=1\n-1, 3, 0.02",
        "*ELASTIC, TYPE=ORTHOTROPIC\n1,2,3,4,5,6,7,8",
        "*ELASTIC\n1, 0.3, 20\n2, 0.3, 40",
        "*HYPERFOAM\n1, 2, 0",
    ):
        case, result = imported(tmp_path, material=material)
        assert "bodies" not in case and any("*SOLID SECTION" in line for line in result.untranslated), material


MALFORMED = {
    "number": ("0.5, 0.02", "0.5, soft", "line 29: *HYPERELASTIC: 'soft' is no number"),
    "material": ("MATERIAL=rubber", "MATERIAL=steel", "there is no *MATERIAL 'steel'"),
    "elset": ("ELSET=CUBE", "ELSET=ball", "there is no set of elements 'ball'"),
    "node set": ("top, 3, 3, 0.5", "tip, 3, 3, 0.5", "there is no set of nodes 'tip'"),
    "node": ("1, 1,2,3,4,5,6,7,8", "1, 1,2,3,4,5,6,7,88", "node 88"),
    "amplitude": ("*BOUNDARY\ntop", "*BOUNDARY, AMPLITUDE=up\ntop", "there is no *AMPLITUDE 'up'"),
    "name": ("*MATERIAL, NAME=Rubber", "*MATERIAL", "there is no NAME="),
    "empty": (MODEL.format(material=NEO_HOOKE, kind="C3D8H", model="", steps=PULL), "nothing", "no *NODE"),
}


@pytest.mark.parametrize("what", MALFORMED)
def test_malformed(what, tmp_path):
    """One line that names the file and the place."""
    old, new, message = MALFORMED[what]
    path = write(tmp_path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(ValueError) as error:
        import_model(path)
    assert message in str(error.value) and "\n" not in str(error.value) and str(error.value).startswith("model.inp:")
