"""Case files: what is read, and what is said of what cannot be."""

import math
import pickle
import random
import re
import tomllib
from dataclasses import fields, is_dataclass

import dolfinx.jit
import gmsh
import jsonschema
import numpy as np
import pytest
from pydantic import TypeAdapter

from cutsim import (
    AdiabaticTool,
    Ball,
    Blade,
    Coulomb,
    Exponential,
    GeneralisedAlpha,
    NeoHookean,
    Ogden,
    PathFollowing,
    Prony,
    StepControl,
    ThermoElastic,
)
from cutsim.analysis.steps import Control
from cutsim.base.parameters import numbers
from cutsim.base.units import Kind, Units
from cutsim.cases import CaseError, built_in_cases, case_schema, read_case
from cutsim.cases.classes import FAMILIES, classes, kebab
from cutsim.cases.constructed import family
from cutsim.cases.document import File
from cutsim.cases.expressions import evaluate
from cutsim.cases.json_schema import kinds_in
from cutsim.cases.quantities import Converter, split
from cutsim.cases.schema import CaseTables
from cutsim.cases.schema_materials import in_units
from cutsim.cases.schema_motion import Motion
from cutsim.cases.scope import Scope
from cutsim.cases.tools import path_of
from cutsim.cases.validation import validated
from cutsim.fields import meshing
from cutsim.interface.cohesive import CohesiveLaw
from cutsim.materials.elastic import Material
from cutsim.materials.library import LIBRARY
from cutsim.tools.shapes import Shape
from helpers.examples import CONTROLS, LAWS, MATERIALS, TOOLS

BLADE = """
title = "Blade cut of silicone"
[parameters]
edge = 0.2
angle = "11.5 deg"
[mesh]
geometry = "block"
dim = 2
set = { Lx = 4, H = 6, lc = "edge", band = "2*edge" }
[material]
model = "neo-hookean"
young = "0.777 MPa"
poisson = 0.48
[law]
model = "exponential"
strength = 0.6
toughness = "200 N/m"
[body]
viscosity = "0.002 MPa s"
[tool]
shape = "blade"
half_angle = "angle"
tip_radius = "edge/4"
half_thickness = "855 um"
[insertion]
speed = "1 mm/s"
depth = 3.0
notch = 0.5
[steps]
first = 0.02
largest = 0.1
"""
PEELED = """
[units]
length = "m"
force = "kN"
[mesh]
file = "part.msh"
dim = 2
scale = 0.001
[material]
library = "silicone 1"
[bodies.upper]
cells = "upper"
relaxation = { strengths = [0.2], times = ["100 ms"] }
density = "1100 kg/m^3"
[bodies.lower]
cells = ["lower", "lowest"]
material = { model = "ogden", moduli = [1, "2 MPa"], exponents = [2, -2], volumetric = 3 }
thermoelastic = { expansion = "1e-5 1/degC", reference = "20 degC" }
density = 1.1
[cracks.glue]
facets = "glued"
plus = "upper"
law = { model = "exponential", strength = 0.15, toughness = 0.1 }
friction = { model = "coulomb", mu = 0.1 }
[cracks.cut]
facets = "open"
plus = [0, 1]
law = "none"
[pair]
slave = "lower_top"
master = "upper_bottom"
friction = 0.2
[tools.roller]
shape = "ball"
radius = "3 mm"
surfaces = ["top", "glue+", "glue-"]
path = { times = [0, "1 s", 3], points = [[0, 3.1], [0, 2.8], [5, 2.8]] }
[tools.die]
shape = "surface"
file = "die.stl"
surfaces = "bottom"
position = ["0", "3 - t*tools.roller.radius"]
[supports.pull]
facets = "grip"
direction = "y"
value = "t/2"
[supports.fix]
points = [[0, 1]]
direction = "all"
[loads.press]
kind = "pressure"
facets = "top"
value = { times = [0, "1 min"], values = ["0 Pa", "1 kPa"] }
[heat]
initial = "20 degC"
[heat.bodies.upper]
conductivity = "0.3 W/(m K)"
capacity = "2000 J/(kg K)"
[heat.bodies.lower]
conductivity = [[1, 0], [0, 1]]
capacity = 3
[heat.boundary]
kind = "convection"
facets = "top"
coefficient = "10 W/(m^2 K)"
ambient = "300 + t"
[heat.tools.roller]
law = { model = "adiabatic-tool" }
[analysis]
type = "dynamic"
scheme = { model = "generalised-alpha", rho_inf = 0.8 }
until = 3
[steps]
fixed = 0.1
"""


@pytest.fixture
def written(tmp_path):
    """Write a case file."""

    def write(text, name="case.toml"):
        for file in ("part.msh", "die.stl"):
            (tmp_path / file).touch()
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write


def refused(path, changes=None):
    """What is wrong with a case file, without its folder."""
    with pytest.raises(CaseError) as error:
        read_case(path, changes)
    return [problem.replace(f"{path.parent}/", "") for problem in error.value.problems]


# ---- what is read


def test_values_become_the_objects_of_cutsim(written):
    case = read_case(written(BLADE))
    assert case.material == NeoHookean(0.777, 0.48)
    assert case.law == Exponential(strength=0.6, toughness=0.2)
    assert case.tools["tool"].made == Blade(math.radians(11.5), 0.05, 0.855)
    assert case.steps == StepControl(0.02, 0.1)
    assert case.mesh.set == {"Lx": 4, "H": 6, "lc": 0.2, "band": 0.4}
    assert case.bodies["body"].viscosity == 0.002


def test_steps_may_follow_a_path(written):
    case = read_case(written(BLADE), {"steps.path.facets": "2", "steps.path.onset": "0.5"})
    assert case.steps == StepControl(0.02, 0.1, path=PathFollowing(2, 0.5))
    assert "steps.path.facets" in refused(written(BLADE), {"steps.path.facets": "-1"})[0]


def test_numbers_are_in_the_units_of_the_file(written):
    """Everything in m, kN and s: stresses in kPa, masses in tonnes, powers in kW."""
    path = written(PEELED)
    case = read_case(path)
    assert case.material == NeoHookean(777.0, 0.48)
    upper, lower = case.bodies["upper"], case.bodies["lower"]
    assert lower.material == Ogden((1.0, 2000.0), (2.0, -2.0), 3.0) and lower.cells == ("lower", "lowest")
    assert upper.relaxation == Prony((0.2,), (0.1,)) and upper.density == pytest.approx(1.1)
    assert lower.thermoelastic == ThermoElastic(1e-5, 293.15)
    assert case.law_of(case.cracks["cut"]) is None and case.law_of(case.cracks["glue"]).strength == 0.15
    assert case.cracks["glue"].friction == Coulomb(0.1) and case.pairs["pair"].friction == 0.2
    assert case.tools["roller"].made == Ball(0.003) and case.tools["roller"].path.times == (0.0, 1.0, 3.0)
    assert case.tools["die"].file == path.parent / "die.stl"
    assert case.heat.bodies["upper"].conductivity == pytest.approx(3e-4)
    assert case.heat.bodies["upper"].capacity == pytest.approx(2000.0)
    assert case.heat.boundaries["boundary"].coefficient == pytest.approx(0.01)
    assert case.heat.tools["roller"].law == AdiabaticTool()
    assert case.analysis.scheme == GeneralisedAlpha(0.8)
    assert case.steps == StepControl.fixed(0.1)


def as_table(item):
    """What a case file says of an object of a class that cutsim exports."""
    parts = {f.name: getattr(item, f.name) for f in fields(item) if getattr(item, f.name) is not None}
    table = {n: as_table(v) if is_dataclass(v) else listed(v) if isinstance(v, tuple) else v for n, v in parts.items()}
    keys = [FAMILIES[protocol] for protocol in FAMILIES if type(item) in classes(protocol).values()]
    return table | {key: kebab(type(item).__name__) for key in keys}


def listed(value):
    return [listed(v) if isinstance(v, tuple) else as_table(v) if is_dataclass(v) else v for v in value]


EXAMPLES = [
    *((CohesiveLaw, bond.law) for bond in LAWS.values()), *((Shape, shape) for shape, _ in TOOLS.values()),
    *((Material, material) for material in MATERIALS), *((Control, control) for control in CONTROLS.values()),
]  # fmt: skip
EXAMPLES = [(protocol, item) for protocol, item in EXAMPLES if type(item).__module__.startswith("cutsim.")]


@pytest.mark.parametrize(("protocol", "item"), EXAMPLES, ids=[type(item).__name__ for _, item in EXAMPLES])
def test_each_class_is_known_by_its_name(protocol, item):
    table = as_table(item)
    assert FAMILIES[protocol] in table
    read = TypeAdapter(family(protocol)).validate_python(table, context=Scope({}, Units()))
    assert type(read) is type(item) and numbers(read) == pytest.approx(numbers(item))


def test_functions_of_time(written):
    """They are values: equal if they are the same, and can be sent to other processes."""
    case = read_case(written(PEELED))
    pull, press, die = case.supports["pull"].value, case.loads["press"].value, case.tools["die"].position
    assert pull(3) == 1.5 and press(30.0) == 0.5 and press(-1) == 0.0 and press(90) == 1.0
    path = written(
        PEELED.replace("[units]", '[parameters]\nramp = "min(t, 2)"\n[units]').replace('"t/2"', '"ramp/2 + t"')
    )
    assert read_case(path).supports["pull"].value(3) == 4.0
    assert die[0] == 0.0 and die[1](2.0) == pytest.approx(3 - 2 * 0.003)
    assert pickle.loads(pickle.dumps((pull, press, die))) == (pull, press, die)
    with pytest.raises(ValueError, match=r"'1/t' cannot be evaluated \(float division by zero\) at t = 0"):
        read_case(written(PEELED.replace('"t/2"', '"1/(1 + t)"'))).supports["pull"].value.__class__("1/t")(0)


def test_tools_turn(written):
    """Motions are told apart by their keys; a rotation of its own is allowed beside one that does not turn."""
    path = 'path = { start = [0, 3], velocity = [0, -1], angle = "90 deg", period = "2 s", pivot = [0, "1 cm"] }'
    old = 'path = { times = [0, "1 s", 3], points = [[0, 3.1], [0, 2.8], [5, 2.8]] }'
    text = PEELED.replace(old, path).replace('position = ["0", "3', 'rotation = "min(t, 2)*pi"\nposition = ["0", "3')
    assert text.count("rotation") == 1 and path in text
    case = read_case(written(text))
    rocked, turned = (path_of(case.tools[name]) for name in ("roller", "die"))
    assert rocked.rotation(0.5) == pytest.approx(np.pi / 2)
    np.testing.assert_allclose(rocked.position(0.5), (0.01, 2.5 + 0.01), atol=1e-12)
    assert turned.rotation(1.0) == pytest.approx(np.pi) and turned.position(1.0)[1] == pytest.approx(3 - 0.003)
    space = {"start": [0, 0, 1], "velocity": [0, 0, -1], "draw": [0, 1, 0], "ratio": 3}
    for table, place in (
        (space, (0, 3, 0)),
        ({"times": [0, 1], "points": [[0, 0, 1], [0, 3, 0]], "turns": [[0, 0, 0], [0, 0, "90 deg"]]}, (0, 3, 0)),
        ({"start": [0, 3, 1], "velocity": [0, 0, -1], "stroke": [1, 0, 0], "period": 1}, (0, 3, 0)),
    ):
        made = TypeAdapter(Motion).validate_python(table, context=Scope({}, Units())).made()
        np.testing.assert_allclose(made.position(1.0), place, atol=1e-12)


def test_a_file_extends_another(written):
    written(BLADE, "base.toml")
    path = written('extends = "base.toml"\n[tools.tool]\nfriction = 0.3\n[law]\nmodel = "bilinear"\npenalty = 100\n')
    problems = refused(path)
    assert problems[0] == "case.toml:4: law.strength: missing, must be given: Normal strength t_n [stress]."
    path = written('extends = "base.toml"\n[tools.tool]\nfriction = 0.3\n[steps]\nlargest = 0.01\n')
    assert refused(path) == ["case.toml:5: steps.largest: 0.01: must be a finite number >= first = 0.02"]
    case = read_case(path, {"steps.largest": "edge", "mesh.set.lc": "0.1 mm", "tool.push": "[0, -2]"})
    assert case.steps.largest == 0.2 and case.mesh.set["lc"] == 0.1 and case.tools["tool"].friction == 0.3
    assert case.tools["tool"].made.push == (0, -1)
    again = read_case(written(case.text, "whole.toml"))
    assert dict(again) == dict(case)


def test_files_that_extend_each_other_are_refused(written):
    written('extends = "case.toml"\n', "base.toml")
    path = written('title = "x"\nextends = "base.toml"\n')
    assert refused(path)[0].startswith("base.toml:1: extends: 'case.toml': must be another file")
    assert refused(written('extends = "none.toml"')) == [
        "case.toml:1: extends: 'none.toml': must be a case file, relative to this one"
    ]


def test_settings_change_entries_of_lists(written):
    path = written(PEELED)
    case = read_case(path, {"tools.roller.path.points.1": '[0, "2 mm"]', "bodies.lower.material.moduli.0": "7"})
    assert case.tools["roller"].path.points[1] == (0, 0.002)
    assert case.bodies["lower"].material.moduli == (7, 2000)


def test_tables_for_a_first_try(written):
    """They take part where this is asked for, and are checked always."""
    path = written(BLADE + "[quick.tool]\nfriction = 0.3\n[quick.insertion]\ndepth = 1.0\n")
    assert read_case(path).insertion.depth == 3 and "quick" in read_case(path).text
    case = read_case(path, {"insertion.depth": "2"}, quick=True)
    assert case.insertion.depth == 2 and case.tools["tool"].friction == 0.3 and "quick" not in case.text
    path = written(BLADE + "[quick.tool]\nfrition = 0.3\n")
    assert [problem.split(", must")[0] for problem in refused(path)] == [
        "case.toml:33: quick.tool.frition: unknown key"
    ]


@pytest.mark.parametrize(
    ("key", "text", "words"),
    [
        ("tool.frictoin", "0.3", "tool.frictoin: unknown key, must be one of"),
        ("title.x", "3", "title: {x}: must be a text in quotes"),
        ("mesh", "3", "mesh: 3: must be a table"),
        ("a..b", "1", "a: unknown key"),
        ("material.0.1", "edge", "material.0: unknown key"),
        ("", "1", "unknown key"),
        ("tool.push.7", "1", "tool.push: {7}: must be a list in brackets"),
        ("tools.blade.shape", "ball", "tools.blade.radius: missing"),
        ("steps.first", "1 m\n ", "steps.first: '1 m\\n ': must be a number [s]"),
    ],
)
def test_settings_that_are_refused(written, key, text, words):
    line = " ".join(f"--set {key}={text}: {words}".splitlines())
    assert any(problem.startswith(line) for problem in refused(written(BLADE), {key: text}))


# ---- units and expressions


@pytest.mark.parametrize(
    ("text", "kind", "value"),
    [
        ("0.8 N/mm", "toughness", 0.8), ("15 deg", "angle", math.radians(15)), ("15°", "angle", math.radians(15)),
        ("1e3 kg/m^3", "density", 1e-9), ("5 %", "one", 0.05), ("-3 cm", "length", -30),
        ("20 degC", "temperature", 293.15),
        ("2 MPa·s", "viscosity", 2), ("1 W/(m K)", "conductivity", 1), ("1 J/(kg K)", "specific heat", 1e6),
        ("1e-4 1/degC", "expansion", 1e-4), ("5 degC", "temperature difference", 5),
        ("0.1 K", "temperature difference", 0.1),
    ],
)  # fmt: skip
def test_quantities(text, kind, value):
    assert Converter(Units()).number(*split(text), Kind(kind)) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "kind"), [("1 deg", "one"), ("1 mm/m", "angle"), ("1 N", "length"), ("1 A", "one"), ("1 mmm", "length")]
)
def test_units_of_another_kind_are_refused(text, kind):
    with pytest.raises(ValueError, match="is no unit"):
        Converter(Units()).number(*split(text), Kind(kind))


def test_expressions_run_no_python():
    assert evaluate("2*sin(pi/6) + a.b**2", {"a.b": 3.0}) == pytest.approx(10.0)
    for text in (
        "__import__('os')",
        "(1).real",
        "[1][0]",
        "9**9**9**9",
        "'a'*3",
        "lambda: 1",
        "1 < 2",
        "(-1)**0.5",
        "f''",
    ):
        with pytest.raises(ValueError, match=r"cannot be evaluated|no expression|finite number"):
            evaluate(text, {})


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("edge = 0.2", "angle*edge", "it refers to itself, edge -> edge"),
        ('lc = "edge"', "angle*egde", "'egde' is neither a parameter nor a number of this file; did you mean 'edge'?"),
        ("first = 0.02", "t", "it cannot depend on the time t"),
        ("depth = 3.0", "mesh.geometry", "'block' is neither a parameter nor a number of this file"),
        ("notch = 0.5", "1/0", "cannot be evaluated (float division by zero)"),
    ],
)  # fmt: skip
def test_expressions_that_have_no_value(written, key, value, words):
    wrong = BLADE.replace(key, f'{key.split(" ")[0]} = "{value}"')
    assert any(problem.endswith(words) for problem in refused(written(wrong)))


def test_a_material_in_other_units_is_the_same():
    for record in LIBRARY.values():
        there = in_units(record.material, Units(), Units("m", "N"))
        back = numbers(in_units(there, Units("m", "N"), Units()))
        assert there.young == pytest.approx(1e6 * record.material.young)
        assert there.poisson == pytest.approx(record.material.poisson)
        assert back == pytest.approx(numbers(record.material))


# ---- what is refused


def test_all_that_is_wrong_is_said_at_once(written):
    wrong = BLADE.replace("poisson = 0.48", "poison = 0.48").replace('"200 N/m"', '"200 N"').replace("= 0.02", "= 0.2")
    assert refused(written(wrong), {"output.every": "often"}) == [
        "case.toml:10: material.poisson: missing, must be given: Poisson's ratio, −1 < ν < ½ [–].",
        "case.toml:13: material.poison: unknown key, must be one of model, young, poisson; did you mean 'poisson'?",
        "case.toml:17: law.toughness: '200 N': must be a number [N/mm], a quantity such as '1 N/mm' or an expression: "
        "'N' is no unit of a toughness",
        "case.toml:31: steps.largest: 0.1: must be a finite number >= first = 0.2",
        "--set output.every=often: output.every: 'often': must be a number or an expression: 'often' is neither a "
        "parameter nor a number of this file",
    ]


WRONG = {
    'geometry = "block"': ('geometry = "blok"', "mesh.geometry: 'blok': .* the geometries .*; did you mean 'block'"),
    "Lx = 4": ("lx = 4", "mesh.set.lx: 'lx': .* the parameters of the geometry .*; did you mean 'Lx'"),
    'model = "exponential"': ('model = "exponentail"', "law.model: 'exponentail': .*; did you mean 'exponential'"),
    "[body]": ("[bodi]", "bodi: unknown key, must be one of .*; did you mean 'bodies'"),
    "angle = ": ("sin = ", "parameters.sin: .* must be a name of letters"),
    'shape = "blade"': ('shape = "ball"\nradius = 1', "tool.half_angle: unknown key"),
    "depth = 3.0": ("", "analysis.until: missing, must be given: the time at which the run ends, or depth in"),
    "[insertion]": ('[cracks.glue]\nfacets = "crak"\nplus = true\n[insertion]', "'crak': .*; did you mean 'crack'"),
    "[steps]": ("[crack]\nfacets = 'crack'\nplus = 'right'\n[steps]", "cracks: not allowed beside .insertion."),
    '"0.002 MPa s"': ("0\nplane = 'strss'", "body.plane: 'strss': must be 'strain' or 'stress'; did you mean 'stress'"),
    "speed =": ("friction = 0.1\nspeed =", "insertion.friction: unknown key, .*; it is a key of .tool."),
    '"blade"': ('"surfaces"', "tool.shape: 'surfaces': must be one of .*; did you mean 'surface'"),
    "dim = 2": ("dim = 3", "tool.push: .0.0, -1.0.: must have 3 components, as the mesh has dimensions"),
    "notch = 0.5": ("notch = -0.5", "insertion.notch: -0.5: must be a finite number >= 0"),
    "first = 0.02": ("first = 0.02\n[output]\nevery = 0.5\n[steps]", "must be TOML: Cannot declare"),
    'title = "': ('output.every = 0.5\ntitle = "', "output.every: 0.5: must be a whole number"),
    "[steps]\n": (
        "[support.plate]\nvalue = 1\n[steps]\n",
        "support.plate: unknown key, .*; did you mean .supports.plate.",
    ),
    '"0.777 MPa"': ('"0.777 Mpa"', "material.young: '0.777 Mpa': .* 'Mpa' is no unit; did you mean 'MPa'"),
    "[tool]": ("[tool.knife]", r"tool.shape: must be one of .*; did you mean .tools.knife.\?"),
    "[law]": ("[tools.tool]\n[law]", "tool: given twice, as tools.tool and as tool"),
}


@pytest.mark.parametrize("text", ["a = " + "[" * 5000, "a = " + "[" * 40 + "]" * 40, "a." * 2000 + "b = 1"])
def test_what_lies_too_deep_is_refused(written, text):
    (problem,) = refused(written(text))
    assert problem.startswith("case.toml:1: ")


@pytest.mark.parametrize("right", WRONG)
def test_what_is_wrong_is_named_with_what_is_allowed(written, right):
    wrong, words = WRONG[right]
    problems = refused(written(BLADE.replace(right, wrong)))
    assert any(re.match(rf"case\.toml:\d+: .*{words}", problem) for problem in problems), problems


def test_groups_of_a_mesh_that_has_been_read(written):
    path = written(PEELED)
    names = "upper lower lowest glued open lower_top upper_bottom top bottom grip".split()
    case = read_case(path)
    validated(CaseTables, case.document, names)
    with pytest.raises(CaseError, match=r"cracks.glue.facets: 'glued': .* groups .*'glue'"):
        validated(CaseTables, case.document, [*names[:3], "glue", *names[4:]])


VALUES = [
    "3", "-1", "1e999", "nan", "true", '""', '"x"', "[]", "{}", "[[1]]", "{ a = 1 }", '"1 N"', '"1/0"', '"t"', '"2*"',
    "1979-05-27", "9" * 400, '"9**9**9**9"', '"1 m^9^9^9^9"', '"1 mm^999999999"', '"exp(1e9)"', '"mesh.dim"',
    '"((1"', '"\\u0000"',
]  # fmt: skip


def corrupted(data, chance):
    """A file with a random fault: of its bytes, lines, keys, or values."""
    lines, fault = data.split(b"\n"), chance.randrange(7)
    at = chance.choice([i for i, line in enumerate(lines) if b"=" in line])
    if fault == 0:
        return data[: chance.randrange(len(data))]
    if fault == 1:
        return bytes(chance.randrange(256) for _ in range(chance.randint(1, 400)))
    if fault == 2:
        place = chance.randrange(len(data))
        return data[:place] + bytes([chance.randrange(256)]) + data[place + 1 :]
    if fault == 3:
        del lines[chance.randrange(len(lines))]
    if fault == 4:
        place = chance.randrange(lines[at].index(b"="))
        lines[at] = lines[at][:place] + chance.choice(b"abcxyz_.").to_bytes(1, "big") + lines[at][place + 1 :]
    if fault >= 5:
        lines[at] = lines[at].split(b"=")[0] + b"= " + chance.choice(VALUES).encode()
    return b"\n".join(lines)


def test_corrupted_files_are_refused_in_clear_words(written, monkeypatch):
    """300 of them, in one line for each fault, with its place; nothing is meshed or compiled."""

    def never(*args, **kwargs):
        raise AssertionError("nothing is to be meshed or compiled")

    monkeypatch.setattr(gmsh, "initialize", never)
    monkeypatch.setattr(dolfinx.jit, "ffcx_jit", never)
    monkeypatch.setattr(meshing, "create_mesh", never)
    sources = [written(text).read_bytes() for text in (BLADE, PEELED)]
    path, chance, refusals = written(BLADE), random.Random(0), 0
    while refusals < 300:
        path.write_bytes(corrupted(chance.choice(sources), chance))
        try:
            read_case(path)
        except CaseError as error:
            refusals += 1
            assert error.problems
            for problem in error.problems:
                assert re.fullmatch(rf"{re.escape(str(path))}:\d+: .*\w.*", problem)
                assert not re.search(r"pydantic|[Ii]nput|validat|function-|None|<\w+>:", problem), problem


def test_the_line_of_each_key(written):
    """Also in lists of tables, in values of several lines, and behind keys with dots."""
    text = "# head|a = 1|b.c = [|  1,|  [2]]||[d.e]|f = { g = 1 }|[[h]]|i = 1|[h.j]|k = '''|[x]|'''"
    text += "|[[h]]|i = 2|[h.j]|k = 3"
    file = File(written(""), text.replace("|", "\n"))
    places = {
        ("a",): 2, ("b",): 3, ("b", "c"): 3, ("b", "c", 1, 0): 3, ("d",): 7, ("d", "e", "f"): 8,
        ("d", "e", "f", "g"): 8, ("h",): 9, ("h", 0): 9, ("h", 0, "i"): 10, ("h", 0, "j"): 11, ("h", 0, "j", "k"): 12,
        ("h", 1): 15, ("h", 1, "i"): 16, ("h", 1, "j", "k"): 18, ("h", 1, "z"): 15, ("z",): 1,
    }  # fmt: skip
    assert {keys: int(file.place(keys).rpartition(":")[2]) for keys in places} == places


# ---- the schema


def test_schema_fits_what_is_read(written):
    """By the rules of JSON schemas, and for all built-in cases that are whole files."""
    validator = jsonschema.Draft4Validator(case_schema())
    validator.check_schema(case_schema())
    texts = [path.read_text(encoding="utf-8") for _, path in built_in_cases().values()]
    texts = [BLADE, PEELED, *(text for text in texts if "\nextends" not in text)]
    assert len(texts) > 10
    for text in texts:
        validator.validate(tomllib.loads(text))
    for right, wrong in (("young", "yuong"), ('"blade"', '"knife"'), ("speed = ", "speed = true #")):
        assert not validator.is_valid(tomllib.loads(BLADE.replace(right, wrong)))


def test_each_number_with_a_unit_has_its_kind():
    """What a description gives a unit in brackets is checked by dimension, also in classes that are added later."""
    tables = {name: table.get("properties", {}) for name, table in case_schema()["definitions"].items()}
    keys = [(name, key, entry) for name, table in tables.items() for key, entry in table.items()]
    pattern = re.compile(r"\[(1/)?(stress|length|time|force|temperature|energy|power|mass|rad)\b")
    numbers = [(name, key, entry) for name, key, entry in keys if pattern.search(entry.get("description", ""))]
    assert len(numbers) > 60
    assert not [(name, key) for name, key, entry in numbers if not set(kinds_in(entry)) - {"one"}]
    assert tables["NeoHookean"]["young"]["description"].endswith("Unit: MPa unless [units] says otherwise.")


def test_a_formula_takes_columns_and_numbers_of_the_file():
    scope = Scope({"parameters": {"h": 2.0, "now": "2*t"}, "law": {"toughness": "1.5*h"}}, Units())
    formula = scope.formula("h*force**2/law.toughness")
    assert formula({"force": 3.0}) == pytest.approx(6.0)
    assert math.isnan(scope.formula("force/way")({"force": 1.0, "way": 0.0}))
    with pytest.raises(ValueError, match="'fore' is neither a number of this file nor one of the columns force"):
        scope.formula("fore")({"force": 1.0})
    with pytest.raises(ValueError, match="must not have 'now', which depends on time"):
        scope.formula("now*force")
    with pytest.raises(ValueError, match="no expression"):
        scope.formula("force +")
