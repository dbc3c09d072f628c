"""A crack in a plane of symmetry, one side of which is meshed: closed forms, tangent, the same cut as of the whole."""

from functools import cache

import numpy as np
import pytest
from dolfinx import fem, mesh
from mpi4py import MPI

from cutsim import (
    Blade,
    Crack,
    Drive,
    Exponential,
    Faces,
    Fixture,
    Insertion,
    Layer,
    LayeredBlock,
    Mechanics,
    NeoHookean,
    State,
    StepControl,
    Support,
    cracked_block,
    geometry,
    laminate,
    read_geo,
    run,
)
from cutsim.base.compat import cell_partitioner
from cutsim.cases import CaseError, read_case
from cutsim.fields.temperature import Temperature
from cutsim.heat.contact_heat import ContactHeat
from cutsim.heat.interface_heat import InterfaceHeat
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.viscous import ViscousBond
from cutsim.pairs.self_intersection import SelfIntersection
from cutsim.results.grids import gather_facets
from helpers.fields import smooth
from helpers.laws import BILINEAR, EXPONENTIAL
from helpers.runs import history
from helpers.tangents import assert_slope_two

COMM = MPI.COMM_WORLD
PENALTY = 500.0


def half(gdim=2, *, axisymmetric=False):
    """The lower half of the unit square or cube, on whose upper face the crack is: state and facets."""
    quads = (mesh.CellType.quadrilateral, mesh.CellType.hexahedron)
    create = (mesh.create_rectangle, mesh.create_box)[gdim - 2]
    ends = np.array([[0.0] * gdim, [*[1.0] * (gdim - 1), 0.5]])
    domain = create(COMM, ends, [2] * (gdim - 1) + [1], quads[gdim - 2], partitioner=cell_partitioner())
    return State(fem.functionspace(domain, ("Lagrange", 1, (gdim,))), axisymmetric=axisymmetric), at(domain, -1, 0.5)


def at(domain, axis, value):
    """Facets of the outer boundary where a coordinate has a value."""
    gdim = domain.geometry.dim
    return mesh.locate_entities_boundary(domain, gdim - 1, lambda x: np.isclose(x[axis % gdim], value))


def driven(law, openings, gdim=2, steps=100, **options):
    """A rigid half that moves off the plane, so that the jump takes some values at equal times: history and crack."""
    state, facets = half(gdim)
    legs = np.arange(len(openings))
    path = [0.0] * (gdim - 1) + [lambda t: -0.5 * np.interp(t, legs, openings)]
    cells = np.arange(state.mesh.topology.index_map(gdim).size_local, dtype=np.int32)
    held = [Support(state, cells, i, value, dim=gdim, name=f"half_{'xyz'[i]}") for i, value in enumerate(path)]
    crack = Crack(state, facets, None, law, young=2.0, contact=PenaltyContact(PENALTY), **options)
    return history(Mechanics(state, [crack], held), legs[-1], StepControl.fixed(legs[-1] / steps)), crack


@pytest.mark.mpi
@pytest.mark.parametrize("gdim", [2, 3])
def test_traction_is_that_of_the_jump_to_the_image(gdim):
    """Opened, taken back, opened on: T(2u) of the printed law, and half of the energies of the whole."""
    rows, crack = driven(EXPONENTIAL, [0.0, 0.15, 0.05, 0.4], gdim)
    law, axis = EXPONENTIAL, "xyz"[gdim - 1]
    jump = -2 * rows[f"half_{axis}_displacement"]
    largest = np.maximum.accumulate(jump)
    softened = np.maximum(largest, law.opening)
    expected = law.strength * jump / law.opening * np.exp(1 - softened / law.opening)
    rising = largest <= law.opening
    expected[rising] = (law.strength * jump / law.opening * np.exp(1 - jump / law.opening))[rising]
    monotone = (rows["time"] <= 1) | (rows["time"] >= 2.5)
    np.testing.assert_allclose(-rows[f"half_{axis}_force"][monotone], expected[monotone], atol=1e-9)
    x = 0.4 / law.opening
    whole = law.toughness * (1 - (1 + x) * np.exp(-x))
    assert rows["energy_fracture"][-1] + rows["energy_cohesive_stored"][-1] == pytest.approx(0.5 * whole, rel=1e-6)
    assert rows["crack_opening"][-1] == pytest.approx(0.4)
    assert np.abs(rows["energy_closure"]).max() < 2e-3
    assert crack.faces.sides.share == 0.5 and crack.plane is not None and len(crack.meshed) == 1


def test_a_closed_crack_presses_on_its_image():
    """Pushed by u into the plane, both sides penetrate by 2u: p = 2 ε u, and half of ½ ε (2u)² on one side."""
    rows, _ = driven(None, [0.0, -0.02])
    assert rows["half_y_force"][-1] == pytest.approx(PENALTY * 0.02)
    assert rows["energy_contact"][-1] == pytest.approx(0.5 * 0.5 * PENALTY * 0.02**2)


def test_half_of_the_viscous_work_is_on_either_side():
    """T = T_law + η (1 − D) v with the rate v of the whole jump."""
    rows, _ = driven(ViscousBond(EXPONENTIAL, 3.0), [0.0, 0.4], steps=400)
    law = EXPONENTIAL
    x = -2 * rows["half_y_displacement"] / law.opening
    viscous = 3.0 * 0.4 * np.minimum(1, np.exp(1 - x))
    np.testing.assert_allclose(-rows["half_y_force"], law.strength * x * np.exp(1 - x) + viscous, atol=1e-6)
    whole = 3.0 * 0.4 * law.opening * (2 - np.exp(1 - x[-1]))
    assert rows["energy_cohesive_viscous"][-1] == pytest.approx(0.5 * whole, rel=2e-3)
    assert np.abs(rows["energy_closure"]).max() < 2e-3


def test_measure_of_a_path():
    """On a straight softening branch it is the loss of the step, and its derivative by the displacement is exact."""
    state, facets = half()
    crack = Crack(state, facets, None, BILINEAR, young=2.0)

    def opened(jump):
        state.u.interpolate(lambda x: np.array([0 * x[0], 0 * x[0] - 0.5 * jump]))

    def step(jump):
        opened(jump)
        crack.evaluate()
        state.commit()
        return crack.energies()["fracture"]

    onset, final = BILINEAR.strength / BILINEAR.penalty, 2 * BILINEAR.toughness / BILINEAR.strength
    before = step(onset + 0.3 * (final - onset))
    state.begin(1.0)
    opened(onset + 0.5 * (final - onset))
    loss, slope = crack.path_measure()
    crack.evaluate()
    assert loss == pytest.approx(crack.energies()["fracture"] - before, rel=1e-9)
    h = 1e-6
    opened(onset + 0.5 * (final - onset) + 2 * h)
    further = crack.path_measure()[0]
    total = COMM.allreduce(-slope.reshape(-1, 2)[:, 1].sum())
    assert total == pytest.approx((further - loss) / h, rel=1e-4)


@pytest.mark.parametrize("opening", [0.8, 1.8, -0.3], ids=["opening", "softening", "compression"])
@pytest.mark.parametrize("gdim", [2, 3])
def test_tangent(gdim, opening):
    state, facets = half(gdim)
    crack = Crack(state, facets, None, ViscousBond(EXPONENTIAL, 3.0), young=2.0, contact=PenaltyContact(30.0))
    state.begin(0.1)
    base, size = smooth(state.V, 4, 0.01 * EXPONENTIAL.opening), EXPONENTIAL.opening
    base.reshape(-1, gdim)[:, -1] -= 0.5 * opening * size
    assert_slope_two(crack, state, base, 0.2 * size, linear=opening < 0)
    if opening > 0:  # it softens with the damage
        assert_slope_two(crack.viscosity, state, base, 0.2 * size, linear=opening < 1)


@pytest.mark.mpi
@pytest.mark.parametrize("gdim", [2, 3])
def test_what_comes_beyond_the_plane_passes_through_its_image(gdim):
    """The mesh has one element of 0.5 across: a half of it is allowed, as elsewhere."""
    state, facets = half(gdim)
    crack = Crack(state, facets, None, EXPONENTIAL, young=2.0)
    look = SelfIntersection(state, [crack.plane])

    def moved(by):
        state.u.interpolate(lambda x: np.array([*[0 * x[0]] * (gdim - 1), 0 * x[0] + by]))
        state.u.x.scatter_forward()
        return look.found()

    assert moved(0.2) is None
    found = moved(0.3)
    assert found is not None and found.depth == pytest.approx(0.6) and found.place[-1] == pytest.approx(0.8)
    assert found.cells.all()


# -- cuts -------------------------------------------------------------------------------------------------------------

SIZES = {"Lx": 0.8, "H": 1.0, "band": 0.2, "growth": 1.8, "lc": 0.1}


@cache
def cut(one_side, notch=0.3, dim=2, depth=0.6, **faces):
    """A rough blade in a block, or in one side of it: the insertion and its columns."""
    space = {"B": 0.4, "sym": 1, "nz": 1} if dim == 3 else {}
    domain = read_geo(geometry("block"), COMM, SIZES | space | {"dim": dim, "notch": notch, "half": one_side}, gdim=dim)
    ways = {} if dim == 2 else {"push": (0.0, -1.0, 0.0), "lateral": (1.0, 0.0, 0.0)}
    blade = Blade(np.radians(20), 0.1, 0.4, **ways)
    bond = Exponential(strength=0.3, toughness=0.1)
    body = cracked_block(domain, NeoHookean(0.777, 0.45), bond, viscosity=0.004, faces=Faces(**faces))
    made = Insertion.build(body, blade, Drive(1.0), notch=notch, friction=0.1)
    rows = []
    control = StepControl.fixed(0.05)
    run(made.mechanics, made.time_of(depth), control, lambda r: rows.append(r.columns | made.columns(r.columns)))
    return made, {name: np.array([row[name][0] for row in rows]) for name in rows[0]}


@pytest.mark.mpi
@pytest.mark.parametrize(("dim", "notch"), [(2, 0.3), (2, 0.0), (3, 0.3)])
def test_one_side_is_cut_as_the_whole(dim, notch):
    """The same force, areas and openings, half of the energies."""
    depth = 0.6 if notch else 0.4
    (whole, both), (part, one) = (cut(side, notch, dim, depth, symmetric=True) for side in (0, 1))
    assert part.symmetry_factor == 2 * whole.symmetry_factor and part.edge_factor == whole.edge_factor
    assert part.state.unknowns < 0.55 * whole.state.unknowns
    for name in ("force", "tip_force", "tip_friction", "cut", "front", "spent", "crack_opening", "crack_broken"):
        np.testing.assert_allclose(one[name], both[name], atol=1e-6 * np.abs(both[name]).max(), err_msg=name)
    for name in ("work_external", "energy_strain", "energy_friction", "energy_viscous", "energy_fracture"):
        np.testing.assert_allclose(2 * one[name], both[name], atol=1e-6 * both["work_external"].max(), err_msg=name)
    assert (np.abs(one["imbalance"]).max() < 1e-6 and both["front"][-1] > 0.05) or notch == 0


def test_faces_that_are_not_firm_and_surfaces_that_meet():
    """The face of one side meets its image whatever its contact; what does not fold is cut alike."""
    (_, plain), (_, met) = cut(1), cut(1, automatic=True)
    assert plain["crack_penetration"].max() > 0
    np.testing.assert_allclose(met["force"], plain["force"], rtol=1e-6)
    assert met["faces_pressed"].max() == 0


@cache
def drawn(half):
    """Two layers, or one side of them, that are drawn apart at the ends and cut: the columns."""
    bond = Exponential(strength=0.3, toughness=0.1)
    layers = [Layer("film", 0.4, NeoHookean(1.0, 0.45), bond), Layer("base", 0.8, NeoHookean(0.777, 0.45), bond)]
    thicknesses = {layer.name: layer.thickness for layer in layers}
    domain = laminate(COMM, thicknesses, length=1.0, size=0.1, band=0.2, notch=0.3, half=half)
    body = LayeredBlock.build(layers, domain, damping=0.005, faces=Faces(symmetric=True))
    fixture = Fixture(ends=("far_right",) if half else ("far_left", "far_right"), drawn=0.05)
    made = Insertion.build(body, Blade(np.radians(20), 0.1, 0.4), Drive(1.0), notch=0.3, fixture=fixture)
    rows = []
    control = StepControl.fixed(0.05)
    run(made.mechanics, made.time_of(0.5), control, lambda r: rows.append(r.columns | made.columns(r.columns)))
    return {name: np.array([row[name][0] for row in rows]) for name in rows[0]}


def test_one_side_of_layers_that_are_drawn_apart():
    both, one = drawn(0), drawn(1)
    for name, share in {"force": 1, "cut": 1, "film_strain": 2, "base_fracture": 2, "work_external": 2}.items():
        np.testing.assert_allclose(share * one[name], both[name], atol=1e-6 * np.abs(both[name]).max(), err_msg=name)
    assert both["base_fracture"][-1] > 0


CASE = """
title = "Half a bar"
[mesh]
geometry = "block"
dim = 2
[mesh.set]
half = 1
Lx = 1.0
H = 1.0
lc = 0.5
band = 0.5
notch = 0
[material]
model = "neo-hookean"
young = 1e4
poisson = 0.0
[law]
model = "exponential"
strength = 1.0
toughness = 0.5
[bodies.bar]
cells = ["right"]
[cracks.glue]
facets = "crack"
[supports.end]
facets = "far_right"
direction = "x"
value = "0.2*t"
[supports.bottom]
facets = "bottom"
direction = "y"
[analysis]
until = 1.0
[steps]
first = 0.05
largest = 0.05
"""


def test_a_case_file_may_have_such_a_crack(tmp_path):
    """Left out, `plus` says that the facets lie in a plane of symmetry; a bar that is stiff opens its bond by 2 u."""
    path = tmp_path / "half.toml"
    path.write_text(CASE)
    simulation, rows = read_case(path).build(COMM), []
    simulation.run(lambda report: rows.append(report.columns))
    opening = rows[-1]["glue_opening"][0]
    bond = Exponential(strength=1.0, toughness=0.5)
    force = bond.strength * opening / bond.opening * np.exp(1 - opening / bond.opening)
    assert opening == pytest.approx(0.4, rel=1e-3)
    assert rows[-1]["end_force"][0] == pytest.approx(force, rel=1e-6)
    path.write_text(CASE.replace("half = 1", "half = 0"))
    with pytest.raises(CaseError, match=r"cracks.glue.plus"):
        read_case(path).build(COMM)


@pytest.mark.mpi
def test_pictures_show_the_side_that_is_there():
    state, facets = half()
    crack = Crack(state, facets, None, EXPONENTIAL, young=2.0)
    damage = np.linspace(0, 1, len(crack.facets))
    grid = gather_facets(state.u, crack.facets, damage)
    if COMM.rank == 0:
        assert grid is not None and grid.n_cells == 2
        assert (grid.cell_data["middle"][:, 1] < 0.5).all()


@pytest.mark.mpi
def test_refusals():
    state, facets = half()
    domain = state.mesh
    make = {"young": 2.0, "law": EXPONENTIAL}
    with pytest.raises(ValueError, match=r"facets = .*plane of symmetry"):
        Crack(state, np.concatenate([facets, at(domain, 0, 0.0)]), None, **make)
    inner = mesh.locate_entities(domain, 1, lambda x: np.isclose(x[0], 0.5))
    with pytest.raises(ValueError, match=r"plus = None.*the cells of a side"):
        Crack(state, inner, None, **make)
    with pytest.raises(ValueError, match=r"friction = 0.3.*image"):
        Crack(state, facets, None, friction=0.3, **make)
    with pytest.raises(ValueError, match=r"side = '-'"):
        Crack(state, facets, None, **make).face("-")
    with pytest.raises(ValueError, match=r"outer boundary"):
        Crack(state, facets, (0.0, 1.0), **make)
    round_, cylinder = half(axisymmetric=True)[0], at(half()[0].mesh, 0, 1.0)
    with pytest.raises(ValueError, match=r"plane of symmetry"):
        Crack(round_, cylinder, None, **make)
    heat = Temperature(state, fem.functionspace(domain, ("Lagrange", 1)), 300.0)
    with pytest.raises(ValueError, match=r"both sides are meshed"):
        InterfaceHeat(heat, Crack(state, facets, None, **make), ContactHeat(1.0, 1.0, 1.0))
    with pytest.raises(ValueError, match=r"faces.sliding = True.*image"):
        cut(1, sliding=True)
    with pytest.raises(ValueError, match=r"faces.friction = 0.3.*image"):
        cut(1, friction=0.3)
