"""The pages say what the code does: their Python runs, and their examples pass the tests of what they extend."""

import importlib
import pkgutil
import re
from dataclasses import replace
from functools import reduce
from itertools import pairwise

import numpy as np
import pytest

import cutsim
from cutsim.cases import read_case
from cutsim.cases.expressions import FUNCTIONS
from cutsim.fields.points import Surface
from cutsim.interface.cohesive import CohesiveLaw
from cutsim.interface.contact import PenaltyContact
from cutsim.materials.elastic import Material
from cutsim.tools.shapes import Shape
from helpers.blocks import JUMPS, drag, make_blocks, separated
from helpers.fields import smooth
from helpers.materials import assert_free_of_energy_and_stress, assert_hooke, assert_objective
from helpers.pages import DOCS, run_page
from helpers.tangents import assert_slope_two
from helpers.tools import FRICTION, touch, values


@pytest.fixture(scope="module")
def material():
    return run_page("adding_a_material")["material"]


@pytest.fixture(scope="module")
def law():
    return run_page("adding_a_cohesive_law")["law"]


@pytest.fixture(scope="module")
def shape():
    return run_page("adding_a_tool")["shape"]


def test_user_guide(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    history = run_page("user_guide")["history"]
    force = history["cylinder_force_y"]
    np.testing.assert_allclose(force, history["plate_force"], rtol=1e-6)
    assert 0 < force.argmax() < len(force) - 1, "the page says that the force peaks"
    assert history["crack_broken"][-1] > 0
    assert {path.name for path in (tmp_path / "results").iterdir()} >= {"history.csv", "displacement.bp", "force.png"}


def test_elements():
    names = run_page("elements")
    assert names["force"] == pytest.approx(names["hertz"], rel=0.02)


def test_friction():
    last = run_page("friction")["rows"][-1]
    assert last["crack_slipping"][0] == pytest.approx(1.0), "the page's block slips in the end"
    assert last["energy_friction"][0] > 0 and abs(last["energy_closure"][0]) < 1e-2


def test_test_rigs():
    page = run_page("test_rigs")
    last = {name: value for name, (value, _) in page["rows"][-1].items()}
    assert 0.2 - last["tool_drive_y"] == pytest.approx(last["tool_force_y"] / 0.5, rel=1e-6), "the page's machine lags"
    last = {name: value for name, (value, _) in page["link_rows"][-1].items()}
    assert abs(last["plate_rz"]) > 1e-3 and abs(last["plate_rz_moment"]) < 1e-8, "the page's plate turns freely"


def test_large_sliding():
    page = run_page("large_sliding")
    last = {name: value for name, (value, _) in page["rows"][-1].items()}
    assert last["pair_slipping"] > 0.9 and last["pair_sticking"] == 0, "the page's block slides"
    # the normals of the block's bottom tilt
    assert last["pair_force_x"] == pytest.approx(-0.3 * last["pair_force_y"], rel=0.05)
    assert abs(last["energy_closure"]) < 0.01
    assert page["cutting"].terms[1].name == "wedge"


def test_needle_insertion(monkeypatch):
    monkeypatch.chdir(DOCS.parent)
    page = run_page("needle_insertion")
    assert page["both"].toughness == pytest.approx(0.1, rel=0.08), "on the coarse mesh of the page"
    assert page["both"].apparent > 1.2 * page["both"].toughness, "the page says that friction adds to it"
    names = ("deformation", "cutting", "tip friction", "shaft friction", "viscosity")
    assert sum(page["parts"][name][-1] for name in names) == pytest.approx(page["parts"]["force"][-1], rel=0.02)


def test_skin_layers():
    page = run_page("skin_layers")
    last = {name: value for name, (value, _) in page["rows"][-1].items()}
    assert last["depth"] == pytest.approx(0.4)
    assert last["force"] > 0 and last["imbalance"] < 1e-6 * last["force"]
    assert "papillary_dermis_fracture" in last and "stratum_corneum_fracture" not in last


def test_dynamics():
    momenta = run_page("dynamics")["momenta"]
    assert len(momenta) > 50
    np.testing.assert_allclose(momenta, [momenta[0]] * len(momenta), atol=1e-7 * np.linalg.norm(momenta[0]))


def test_page_on_materials():
    gel = run_page("materials")["gel"]
    assert gel.energies() == {"strain": 0.0, "viscous": 0.0, "thermoelastic": 0.0}


def test_heat():
    rows = run_page("heat")["rows"]
    last = {name: value for name, (value, _) in rows[-1].items()}
    assert last["heat_friction"] == pytest.approx(last["energy_friction"], rel=1e-9)
    assert last["temperature_max"] > last["lower_temperature"] > 293
    assert abs(last["heat_closure"]) < 1e-8
    assert abs(last["energy_closure"]) < 0.01


# -- material ---------------------------------------------------------------------------------------------------------


def test_material_follows_hooke_and_is_objective(material):
    assert isinstance(material, Material)
    assert_free_of_energy_and_stress(material)
    assert_hooke(material)
    assert_objective(material, 2.0, isotropic=True)


@pytest.mark.parametrize("gdim", [2, 3])
def test_tangent_of_material(material, gdim):
    b = make_blocks(gdim)
    assert_slope_two(b.solid(material), b.state, smooth(b.state.V, 1, 0.2), 1.0)


# -- cohesive law -----------------------------------------------------------------------------------------------------


def test_law_peaks_and_spends_its_toughness(law):
    assert isinstance(law, CohesiveLaw)
    assert law.opening == pytest.approx(0.45 / (2.0 * np.e))
    x = np.linspace(0, 20, 4001)[1:]
    traction = law.secants(x * law.opening, np.zeros(len(x)))[0] * x * law.opening
    np.testing.assert_allclose(traction, law.strength * x * np.exp(1 - x), atol=1e-6)
    assert max(traction) == pytest.approx(law.strength, rel=1e-5)
    assert np.trapezoid([0, *traction], [0, *x * law.opening]) == pytest.approx(law.toughness, rel=1e-4)


@pytest.mark.parametrize("end", [(0.0, 18.0), (18.0, 0.0), (14.4, 10.8)], ids=["opening", "sliding", "mixed"])
def test_law_in_a_crack(law, end):
    """Broken, unloaded half way and reloaded, the finite-element crack has dissipated the toughness."""
    path = np.array([(0, 0), np.multiply(end, 0.3), np.multiply(end, 0.1), end]) * law.opening
    rows, _ = drag(law, path, steps=40)
    assert rows["energy_fracture"][-1] == pytest.approx(law.toughness, rel=1e-3)
    assert rows["crack_broken"][-1] == pytest.approx(1.0)
    assert np.diff(rows["energy_fracture"]).min() > -1e-12


@pytest.mark.parametrize("jump", ["opening", "sliding", "mixed", "softening", "compression"])
def test_tangent_of_law(law, jump):
    sliding, opening, _ = JUMPS[jump]
    scale = law.opening
    b = make_blocks()
    crack = b.crack(law, contact=PenaltyContact(30.0))
    u = separated(b, sliding * scale, opening * scale, 0.01 * scale)
    assert_slope_two(crack, b.state, u, scale)


# -- tool -------------------------------------------------------------------------------------------------------------


def test_distance_of_cone(shape):
    """Along the axis and square to the surface; the gradient has length 1 everywhere."""
    assert isinstance(shape, Shape)
    s, c, r = np.sin(shape.half_angle), np.cos(shape.half_angle), shape.tip_radius
    turn, along = np.random.default_rng(0).uniform(0, 6, (2, 40))
    round_axis = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    normal = c * round_axis - [0, 0, s]
    core = along[:, None] * (s * round_axis + [0, 0, c]) + [0, 0, r]
    height = np.random.default_rng(1).uniform(0.1, 1.0, 40)
    distance, gradient = values(shape, core + height[:, None] * normal)
    np.testing.assert_allclose(distance, height - r, atol=1e-8)
    np.testing.assert_allclose(gradient, normal, atol=1e-6)
    below, straight = values(shape, [(0.0, 0.0, -0.5)])
    assert below[0] == pytest.approx(0.5)
    np.testing.assert_allclose(straight[0], (0, 0, -1), atol=1e-6)


@pytest.mark.parametrize("friction", [None, FRICTION], ids=["smooth", "rough"])
def test_tangent_of_cone(shape, friction):
    b = make_blocks(3)
    surface = Surface.exterior(b.state, b.face(2, 1.0))
    tool = touch(b, shape, (0.4, 0.5, 0.9), [surface], friction)
    assert_slope_two(tool, b.state, smooth(b.state.V, 4, 0.02), 0.05)


# -- term, step control ------------------------------------------------------------------------------------------------


def test_foundation():
    """A pressed block sinks by p/k + p L/M; the springs carry the load and the audit closes."""
    page = run_page("adding_a_term")
    young, poisson, pressure = page["young"], page["poisson"], page["pressure"]
    modulus = young * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson))
    assert page["sunk"] == pytest.approx(pressure / page["stiffness"] + pressure / modulus, rel=1e-9)
    last = page["rows"][-1]
    assert last["foundation_force_y"] == pytest.approx(pressure, rel=1e-9)
    assert last["load_force_y"] == pytest.approx(-pressure) and abs(last["energy_closure"]) < 1e-10


def test_step_control():
    """Each step follows from the iterations of the one before; a rejected one is halved."""
    page = run_page("adding_a_step_control")
    control, reports = page["control"], page["reports"]
    assert reports[-1].time == pytest.approx(1.0) and reports[0].dt == pytest.approx(control.first)
    uncut = [pair for pair in pairwise(reports[:-1]) if not pair[1].cuts]  # the last one is shortened to end at 1
    assert len(uncut) > 5
    for before, after in uncut:
        assert after.dt == pytest.approx(before.dt * (control.iterations / before.outcome.iterations) ** 0.5)
    assert control.next(replace(reports[1], refusal="too large")) == reports[1].dt / 2
    with pytest.raises(ValueError, match="smallest = 1"):
        page["Aimed"](first=0.1, largest=0.5, smallest=1.0)


def resolves(name):
    """Whether a dotted name is a module of the package or something in one."""
    parts = name.split(".")
    for i in range(len(parts), 0, -1):
        try:
            found = importlib.import_module(".".join(parts[:i]))
        except ModuleNotFoundError:
            continue
        return reduce(lambda thing, part: getattr(thing, part, None), parts[i:], found) is not None
    return False


def test_names_on_the_pages_exist():
    """Modules, classes and functions that the pages mention by their dotted names."""
    packages = "|".join(m.name for m in pkgutil.iter_modules(cutsim.__path__))
    pattern = re.compile(rf"`(?:cutsim\.)?((?:{packages})\.[\w.]+(?<!\.bp))`")
    texts = {path.name: path.read_text(encoding="utf-8") for path in [*DOCS.glob("*.md"), DOCS.parent / "README.md"]}
    names = {(page, name) for page, text in texts.items() for name in pattern.findall(text)}
    assert len(names) > 50
    assert not {f"{page}: {name}" for page, name in names if not resolves(f"cutsim.{name}")}


def test_page_of_the_api_is_up_to_date(monkeypatch):
    monkeypatch.syspath_prepend(str(DOCS))
    import make_api

    assert (DOCS / "api.md").read_text(encoding="utf-8") == make_api.page(), "make api writes it anew"


def test_page_of_case_files_is_up_to_date(monkeypatch):
    monkeypatch.syspath_prepend(str(DOCS))
    import make_case_files

    assert make_case_files.PAGE.read_text(encoding="utf-8") == make_case_files.page(), "make api writes it anew"


def test_case_of_the_page_on_case_files(tmp_path):
    """It is read, and the functions that the page lists are those that there are."""
    page = (DOCS / "case_files.md").read_text(encoding="utf-8")
    path = tmp_path / "case.toml"
    path.write_text(re.search(r"```toml\n(.*?)```", page, re.DOTALL)[1], encoding="utf-8")
    case = read_case(path)
    assert case.tools["tool"].made.tip_radius == 0.05 and case.mesh.set["band"] == 0.4
    assert set(re.search(r"the functions `([\w\s]+)`", page)[1].split()) == set(FUNCTIONS)


def test_readme_has_the_case_that_it_names():
    text = (DOCS.parent / "README.md").read_text(encoding="utf-8")
    case = DOCS.parent / "demos" / "split.toml"
    assert f"```toml\n{case.read_text(encoding='utf-8')}```" in text
    assert read_case(case).title == "Splitting a notched block"
