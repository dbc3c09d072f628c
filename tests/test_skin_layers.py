"""Layered blocks: mesh and regions, laminates in tension and compression, one crack through all layers; skin."""

import numpy as np
import pytest
from dolfinx import fem
from mpi4py import MPI

from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.stepping import StepControl, run
from cutsim.base.assembly import integrate
from cutsim.base.compat import form
from cutsim.bodies.loads import Support
from cutsim.fields.laminate import laminate
from cutsim.fields.measures import Measures
from cutsim.fields.space import crack_measure_entities
from cutsim.interface.cohesive import Exponential
from cutsim.materials.elastic import LinearElastic, NeoHookean
from cutsim.materials.library import SKIN, material
from cutsim.materials.rubbers import MooneyRivlin, Ogden
from cutsim.studies.drive import Drive
from cutsim.studies.fixture import Fixture
from cutsim.studies.insertion import Insertion
from cutsim.studies.layered import Layer, LayeredBlock, skin
from cutsim.tools.pointed import Blade, Needle
from helpers.runs import history

HARD, SOFT = (Exponential(strength=t, toughness=G) for t, G in ((0.3, 0.06), (0.1, 0.02)))
GLUE = Exponential(strength=1e3, opening=1e-4)
THICKNESSES = {"top": 0.1, "core": 0.3, "base": 0.6}
ELASTIC = {"top": (3.0, 0.2), "core": (1.0, 0.4), "base": (1.5, 0.3)}
WIDTH = 0.5
ENDS = ("far_left", "far_right")


def laminated(dim, laws=(GLUE, GLUE, GLUE), *, length=1.0, notch=0.0, comm=MPI.COMM_WORLD):
    """Three linear elastic layers, 1 mm high."""
    layers = [
        Layer(n, t, LinearElastic(*ELASTIC[n]), law) for (n, t), law in zip(THICKNESSES.items(), laws, strict=True)
    ]
    width = WIDTH if dim == 3 else None
    domain = laminate(comm, THICKNESSES, length=length, size=0.2, band=0.2, notch=notch, width=width, rows=1)
    return LayeredBlock.build(layers, domain)


def supported(block, **values):
    """Supports that hold the named sides smoothly or move them, in the order of components of their normals."""
    normals = {"far_left": 0, "far_right": 0, "bottom": 1, "top_left": 1, "top_right": 1, "front": 2, "back": 2}
    sides = {"bottom": 0.0, **({"front": 0.0, "back": 0.0} if "front" in block.domain.names else {}), **values}
    return [
        Support(block.state, block.domain.facets(side), normals[side], value, name=side)
        for side, value in sides.items()
    ]


class Sizes:
    """Sizes of the groups of a mesh."""

    def __init__(self, domain):
        self.domain, self.measures, self.one = domain, Measures(domain.mesh), fem.Constant(domain.mesh, 1.0)

    def volume(self, name):
        return integrate(form(self.one * self.measures.cells(self.domain.cells(name))))

    def outside(self, name):
        return integrate(form(self.one * self.measures.exterior(self.domain.facets(name))))

    def inside(self, name):
        mesh = self.domain.mesh
        entities = crack_measure_entities(mesh, self.domain.facets(name), (1.0, 0.0, 0.0)[: mesh.geometry.dim])
        return integrate(form(self.one * self.measures.interior(entities)))


@pytest.mark.mpi
@pytest.mark.parametrize("dim", [2, 3])
def test_regions_have_the_size_of_the_layers(dim):
    """Layers by volume, parts of the crack plane and sides by area; a notch that ends within a layer."""
    depth, notch = (WIDTH if dim == 3 else 1.0), 0.07
    width = WIDTH if dim == 3 else None
    domain = laminate(MPI.COMM_WORLD, SKIN, length=2.0, size=0.1, band=0.3, notch=notch, width=width, rows=2)
    sizes, top = Sizes(domain), 0.0
    for name, thickness in SKIN.items():
        assert sizes.volume(name) == pytest.approx(4.0 * thickness * depth, rel=1e-10)
        bottom = top + thickness
        if bottom > notch:
            assert sizes.inside(f"crack_{name}") == pytest.approx((bottom - max(top, notch)) * depth, rel=1e-10)
        else:
            assert f"crack_{name}" not in domain.names
        top = bottom
    assert sizes.inside("notch") == pytest.approx(notch * depth, rel=1e-10)
    areas = {"top_left": 2.0 * depth, "top_right": 2.0 * depth, "bottom": 4.0 * depth, "far_right": top * depth}
    areas |= {"front": 4.0 * top, "back": 4.0 * top} if dim == 3 else {}
    for name, area in areas.items():
        assert sizes.outside(name) == pytest.approx(area, rel=1e-10)


def test_elements_fit_the_layers():
    """Two elements in each thin layer, no larger than asked for in thick ones and in the band."""
    domain = laminate(MPI.COMM_SELF, SKIN, length=2.0, size=0.1, band=0.3)
    x, y = (np.unique(domain.mesh.geometry.x[:, i].round(12)) for i in (0, 1))
    bounds = -np.cumsum([0.0, *SKIN.values()])
    for top, bottom, thickness in zip(bounds, bounds[1:], SKIN.values(), strict=False):
        inside = np.diff(y[(y > bottom - 1e-9) & (y < top + 1e-9)])
        assert len(inside) == max(2, round(thickness / 0.1))
        np.testing.assert_allclose(inside, thickness / len(inside))
    steps = np.diff(x[x > -1e-9])
    np.testing.assert_allclose(steps[:3], 0.1)
    assert np.all(steps[3:] >= 0.1 - 1e-9) or np.all(np.diff(steps[3:]) > 0)
    np.testing.assert_allclose(steps[4:] / steps[3:-1], 1.3)


def test_elements_at_the_mouth_are_small_and_grow():
    """From the wanted size, by a fifth of the distance, to that along the crack; layers keep their bounds."""
    layers = {"skin": 0.5, "fat": 1.5}
    domain = laminate(MPI.COMM_SELF, layers, length=2.0, size=0.1, band=0.4, entry=0.03)
    x, y = (np.unique(domain.mesh.geometry.x[:, i].round(12)) for i in (0, 1))
    for lines in (x[x > -1e-9], -y[::-1]):
        at, steps = lines[:-1], np.diff(lines)
        assert 0.02 < steps[0] <= 0.03 + 1e-12
        near = at < 0.35
        assert np.all(steps[near] <= 0.03 + 0.2 * at[near] + 1e-9) and np.all(
            steps[at < 0.3] > 0.02 + 0.15 * at[at < 0.3]
        )
    assert np.isclose(y, -0.5).any() and -y[0] == pytest.approx(2.0)
    assert np.diff(y).max() <= 0.1 + 1e-12


@pytest.mark.mpi
@pytest.mark.parametrize("dim", [2, 3])
def test_tension_along_the_layers_adds_their_stiffnesses(dim):
    """Plane strain with a free top: F = ε Σ tᵢ Eᵢ/(1 − νᵢ²), and each layer holds its share of the energy."""
    block, strain = laminated(dim), 1e-4
    supports = supported(block, far_left=-strain, far_right=strain)
    rows = history(Mechanics(block.state, block.terms, supports), 1.0, StepControl.fixed(1.0))
    depth = WIDTH if dim == 3 else 1.0
    shares = {n: t * E / (1 - nu**2) for (n, t), (E, nu) in zip(THICKNESSES.items(), ELASTIC.values(), strict=True)}
    assert rows["far_right_force"][-1] == pytest.approx(strain * depth * sum(shares.values()), rel=1e-5)
    columns = block.columns({})
    for name, share in shares.items():
        assert columns[f"{name}_strain"][0] == pytest.approx(share * depth * strain**2, rel=1e-5)


@pytest.mark.mpi
@pytest.mark.parametrize("dim", [2, 3])
def test_confined_compression_across_the_layers_adds_their_compliances(dim):
    """One stress in all layers: σ = d/Σ(tᵢ/Mᵢ) with M = E(1−ν)/((1+ν)(1−2ν))."""
    block, d = laminated(dim), 1e-4
    supports = supported(block, far_left=0.0, far_right=0.0, top_left=-d, top_right=-d)
    # the faces of the crack held in its plane: what is measured is the layers
    supports += [Support(block.state, block.domain.facets(f"crack_{name}"), 0) for name in THICKNESSES]
    rows = history(Mechanics(block.state, block.terms, supports), 1.0, StepControl.fixed(1.0))
    compliance = sum(
        t * (1 + nu) * (1 - 2 * nu) / (E * (1 - nu))
        for t, (E, nu) in zip(THICKNESSES.values(), ELASTIC.values(), strict=True)
    )
    area = 2.0 * (WIDTH if dim == 3 else 1.0)
    assert rows["bottom_force"][-1] == pytest.approx(area * d / compliance, rel=1e-9)


def torn(comm, laws=(HARD, SOFT, SOFT), notch=0.0, steps=100):
    """A short block torn apart: history, and energies of the layers."""
    block = laminated(2, laws, length=0.2, notch=notch, comm=comm)
    supports = supported(block, far_left=lambda t: -t, far_right=lambda t: t)
    rows = history(Mechanics(block.state, block.terms, supports), 0.4, StepControl.fixed(0.4 / steps))
    return block, rows, block.columns({})


@pytest.mark.mpi
def test_the_crack_costs_each_layer_its_own_toughness():
    """Two laws, two parts of the crack; in the end Gᵢ tᵢ is spent in each layer, and the audit closes."""
    block, rows, columns = torn(MPI.COMM_WORLD)
    assert [crack.name for crack in block.cracks] == ["crack_top", "crack_core"]
    for layer in block.layers:
        spent = layer.law.toughness * layer.thickness
        assert columns[f"{layer.name}_fracture"][0] == pytest.approx(spent, rel=5e-3)
    total = sum(columns[f"{layer.name}_fracture"][0] for layer in block.layers)
    assert rows["energy_fracture"][-1] == pytest.approx(total, rel=1e-9)
    assert abs(rows["energy_closure"]).max() < 5e-3
    assert rows["energy_strain"][-1] < 1e-2 * total


@pytest.mark.mpi
def test_any_number_of_ranks_tears_alike():
    _, alone, apart = torn(MPI.COMM_SELF, notch=0.05, steps=20)
    _, together, shared = torn(MPI.COMM_WORLD, notch=0.05, steps=20)
    for name in ("far_right_force", "energy_strain", "energy_fracture"):
        np.testing.assert_allclose(together[name], alone[name], rtol=1e-7, atol=1e-9 * np.abs(alone[name]).max())
    for name, (value, _) in apart.items():
        assert shared[name][0] == pytest.approx(value, rel=1e-6, abs=1e-9)


def test_one_law_makes_one_crack_and_a_notch_saves_its_toughness():
    block, _, columns = torn(MPI.COMM_SELF, (HARD, HARD, HARD), notch=0.2)
    assert [crack.name for crack in block.cracks] == ["crack"]
    assert "top_fracture" not in columns
    assert columns["core_fracture"][0] == pytest.approx(0.2 * HARD.toughness, rel=5e-3)


def sliced(comm, depth=0.5, toughness=(0.1, 0.04), width=None, friction=0.0):
    """A blade through a stiff layer into a soft one, steps fixed: problem and history."""
    laws = [Exponential(opening=0.2, toughness=G) for G in toughness]
    layers = [
        Layer("film", 0.3, NeoHookean(1.0, 0.4), laws[0]),
        Layer("base", 0.7, NeoHookean(0.3, 0.4), laws[1]),
    ]
    thicknesses = {layer.name: layer.thickness for layer in layers}
    domain = laminate(comm, thicknesses, length=1.0, size=0.1, band=0.3, notch=0.2, width=width, rows=1)
    block = LayeredBlock.build(layers, domain, damping=0.003)
    push, lateral = (axis[: domain.mesh.geometry.dim] for axis in ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0)))
    blade, rows = Blade(0.3, 0.1, 0.15, push, lateral), []
    fixture = Fixture(ends=ENDS, drawn=0.1, walls=("front", "back") if width else ())
    cut = Insertion.build(block, blade, Drive(1.0, 1.0), notch=0.2, friction=friction, fixture=fixture)

    def record(report):
        columns = report.columns | cut.columns(report.columns)
        rows.append({name: value for name, (value, _) in columns.items()})

    run(cut.mechanics, cut.time_of(depth), StepControl.fixed(0.05), record)
    return cut, {name: np.array([row[name] for row in rows]) for name in rows[0]}


def test_layers_below_the_cut_need_not_be_touched():
    cut, _ = sliced(MPI.COMM_SELF, 0.2)
    pressed = [max(patch.pressure().max(initial=0.0) for patch in half.patches) > 0 for half in cut.contacts]
    assert pressed == [True, False, True, False]
    assert "has never touched" not in str(cut.state.verdict)


@pytest.mark.mpi
def test_blade_cuts_layers():
    """The plate carries the blade's force, the audit closes, the layers add up; on any number of ranks alike."""
    cut, rows = sliced(MPI.COMM_WORLD)
    assert rows["depth"][-1] == pytest.approx(0.5)
    assert rows["force"].max() > 0.01
    assert np.all(rows["imbalance"] * np.abs(rows["force"]) < 1e-6 * rows["force"].max())
    assert np.abs(rows["energy_closure"]).max() < 2e-2
    for kind in ("strain", "fracture"):
        parts = sum(rows[f"{layer.name}_{kind}"] for layer in cut.body.layers)
        np.testing.assert_allclose(parts, rows[f"energy_{kind}"], rtol=1e-9, atol=1e-12)
    assert rows["film_fracture"][-1] > rows["base_fracture"][-1] > 0
    _, alone = sliced(MPI.COMM_SELF)
    np.testing.assert_allclose(rows["force"], alone["force"], atol=1e-7 * alone["force"].max())


def test_a_cut_in_three_dimensions_is_that_of_the_plane():
    """Held by its front and back a block is in plane strain: the same force per width."""
    (_, plane), (_, solid) = (sliced(MPI.COMM_SELF, 0.25, (0.05, 0.05), width) for width in (None, 0.3))
    assert plane["force"][-1] > 1e-3
    np.testing.assert_allclose(solid["force"] / 0.3, plane["force"], atol=1e-6 * plane["force"].max())


def test_friction_holds_the_blade_back():
    """What friction costs is in its force, which the plate carries."""
    (_, smooth), (_, rough) = (sliced(MPI.COMM_SELF, 0.25, friction=mu) for mu in (0.0, 0.2))
    assert rough["force"][-1] > 1.05 * smooth["force"][-1]
    assert rough["energy_friction"][-1] > 0 and "energy_friction" in smooth
    assert np.all(rough["imbalance"] * np.abs(rough["force"]) < 1e-6 * rough["force"].max())


def test_tools_that_cut_no_layers_are_refused_by_name():
    block, drive = laminated(2, notch=0.2), Drive(1.0)
    with pytest.raises(ValueError, match=r"tool = Needle\(.*: it must be a blade in the plane"):
        Insertion.build(block, Needle(0.3, 0.1, 0.15), drive, notch=0.2)
    with pytest.raises(ValueError, match=r"tool.push = \(0.0, -1.0, 0.0\) .* of 2 components"):
        Insertion.build(block, Blade(0.3, 0.1, 0.15, (0.0, -1.0, 0.0), (1.0, 0.0, 0.0)), drive, notch=0.2)
    with pytest.raises(ValueError, match=r"friction = -0.1 is not allowed"):
        Insertion.build(block, Blade(0.3, 0.1, 0.15), drive, notch=0.2, friction=-0.1)


def test_what_is_said_of_the_mesh_is_compared_with_it():
    """Notch, direction of the push, crack plane and groups: what was expected, and what there is."""
    notched, whole, drive = laminated(2, notch=0.2), laminated(2), Drive(1.0)
    for block, tool, options, message in (
        (whole, {}, {"notch": 0.2}, r"notch = 0\.2 .* 0: the body has no notch"),
        (notched, {}, {}, r"notch = 0\.0 .* 0\.2, the depth of the notch in the mesh"),
        (notched, {}, {"notch": 0.05}, r"notch = 0\.05 .* 0\.2, the depth of the notch in the mesh"),
        (notched, {"push": (0.0, 1.0)}, {"notch": 0.2}, r"tool\.push = \(0\.0, 1\.0\) .*'bottom' lies at -1"),
        (notched, {"push": (1.0, 0.0), "lateral": (0.0, 1.0)}, {"notch": 0.2}, r"tool\.lateral = .* from -1 to 0"),
        (notched, {}, {"notch": 0.2, "fixture": Fixture(plate="floor")}, r"fixture\.plate = .*floor.* far_right"),
        (notched, {}, {"notch": 0.2, "fixture": Fixture(top=("top", "top"))}, r"fixture\.top = .*top_left"),
    ):
        with pytest.raises(ValueError, match=message):
            Insertion.build(block, Blade(0.3, 0.1, 0.15, **tool), drive, **options)
    with pytest.raises(ValueError, match=r"drawn = 0\.1 is not allowed"):
        Fixture(drawn=0.1)


def test_skin_has_the_models_of_the_thesis():
    """Five neo-Hookean layers, two of Ogden, one of Mooney and Rivlin, 2 mm in all; laws by their tissue."""
    layers = skin(HARD, SOFT, GLUE)
    kinds = [NeoHookean] * 5 + [Ogden] * 2 + [MooneyRivlin]
    assert [type(layer.material) for layer in layers] == kinds
    assert [layer.law for layer in layers] == [HARD] * 5 + [SOFT] * 2 + [GLUE]
    assert sum(layer.thickness for layer in layers) == pytest.approx(2.0)
    assert sum(layer.thickness for layer in layers[:5]) == pytest.approx(0.1)


def test_reticular_dermis_meets_its_source():
    """Slope 1.18 MPa at first and 21.6 MPa at a stretch of 1.54, incompressible uniaxial tension."""
    dermis = material("reticular dermis").material
    (modulus,), (m,) = dermis.moduli, dermis.exponents

    def stress(x):
        return modulus / m * (x ** (m - 1) - x ** (-m / 2 - 1))

    assert stress(1 + 1e-6) / 1e-6 == pytest.approx(1.18, rel=1e-4)
    assert stress(1.54) == pytest.approx(21.6, rel=2e-3)
    assert dermis.shear == pytest.approx(1.18 / 3)


def test_hypodermis_has_the_moduli_of_its_source():
    fat = material("hypodermis").material
    assert (fat.shear, fat.bulk) == (pytest.approx(0.84e-3), 36.0e-3)


@pytest.mark.parametrize(
    ("change", "name"),
    [
        ({"size": 0.0}, "size"),
        ({"band": 2.0}, "band"),
        ({"notch": 1.0}, "notch"),
        ({"entry": 0.3}, "entry"),
        ({"least": 0}, "least"),
        ({"width": -1.0}, "width"),
        ({"width": 1.0, "rows": 0}, "rows"),
        ({"half": 2}, "half"),
        ({"half": 1, "thread": 0.1}, "half"),
    ],
)
def test_refuses_what_is_no_block(change, name):
    with pytest.raises(ValueError, match=f"{name} = .* is not allowed"):
        laminate(MPI.COMM_SELF, THICKNESSES, **{"length": 1.0, "size": 0.2, "band": 0.2, **change})


def test_refuses_layers_that_are_none():
    with pytest.raises(ValueError, match=r"thickness = 0\.0 is not allowed"):
        Layer("film", 0.0, LinearElastic(1.0, 0.3), GLUE)
    with pytest.raises(ValueError, match=r"layers = .*bottom.* is not allowed"):
        laminate(MPI.COMM_SELF, {"bottom": 1.0}, length=1.0, size=0.2, band=0.2)
    domain = laminate(MPI.COMM_SELF, {"film": 1.0}, length=1.0, size=0.5, band=0.5)
    with pytest.raises(ValueError, match="'foil' is no group of cells; known: film"):
        LayeredBlock.build([Layer("foil", 1.0, LinearElastic(1.0, 0.3), GLUE)], domain)
