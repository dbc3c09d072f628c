"""One pushed tool for all bodies: any way in space, layered or not, half or whole, heated, moving, notched or not."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

from cutsim import (
    AdiabaticTool,
    Blade,
    Drive,
    Exponential,
    Fixture,
    Insertion,
    Layer,
    LayeredBlock,
    Needle,
    NeoHookean,
    StepControl,
    cracked_block,
    laminate,
    read_geo,
    run,
)
from cutsim.studies.body import Faces
from cutsim.studies.fixture import STANDING
from cutsim.studies.insertion_heat import Conductor, ThermalCut, heated
from helpers.fields import rotation

MESHES = Path(__file__).parents[1] / "meshes"
BOND = Exponential(strength=0.3, toughness=0.1)
SOFT = Exponential(strength=0.2, toughness=0.08)
RUBBER = NeoHookean(0.777, 0.45)
NOTCH = 0.4


def drive(cut, until, step, problem=None):
    """Run to a time and return the columns, with an entry for each step."""
    rows = []
    run(
        problem or cut.mechanics, until, StepControl.fixed(step),
        lambda r: rows.append({"time": (r.time, "")} | r.columns | cut.columns(r.columns)),
    )  # fmt: skip
    return {name: np.array([row[name][0] for row in rows]) for name in rows[0]}


def turned(domain, angle):
    """Turn a mesh, about a skew axis in space, and shift it: the rotation."""
    gdim = domain.mesh.geometry.dim
    R = rotation(gdim, angle) if angle else np.eye(gdim)
    x = domain.mesh.geometry.x
    x[:, :gdim] = x[:, :gdim] @ R.T + (0.3 if angle else 0.0)
    return R


def same(found, expected, names, rtol=1e-9):
    for name in names:
        scale = np.abs(expected[name]).max()
        np.testing.assert_allclose(found[name], expected[name], atol=rtol * scale, err_msg=name)


# -- any way in space -------------------------------------------------------------------------------------------------


@cache
def sliced(angle, number=2, everything=False):
    """A blade in layers that are drawn apart, with friction, pushed twice, perhaps heated and moving: history."""
    options = {"solid": {"density": 1e-3}} if everything else {}
    layers = [Layer(f"layer_{i}", 1.6 / number, RUBBER, BOND, **options) for i in range(number)]
    thicknesses = {layer.name: layer.thickness for layer in layers}
    domain = laminate(MPI.COMM_WORLD, thicknesses, length=1.0, size=0.2, band=0.4, notch=NOTCH)
    R = turned(domain, angle)
    block = LayeredBlock.build(layers, domain, damping=0.01, plus=tuple(-R[:, 0]))
    cut = Insertion.build(
        block,
        Blade(0.3, 0.2, 0.3, tuple(-R[:, 1]), tuple(R[:, 0])),
        Drive(2.0, turning_depth=0.6),
        notch=NOTCH,
        friction=0.05,
        fixture=Fixture(ends=("far_left", "far_right"), drawn=0.05),
        mechanics={"analysis": "dynamic"} if everything else None,
    )
    same = Conductor(density=1.0, capacity=1.0, conductivity=0.01)
    thermal = ThermalCut({layer.name: same for layer in layers}, AdiabaticTool(1.0))
    rows = drive(cut, cut.time_of(0.5, 2), 0.02, heated(cut, thermal, 300.0) if everything else None)
    assert cut.depth == pytest.approx(0.5)
    np.testing.assert_allclose(cut.frame.origin, 0.3 if angle else 0.0, atol=1e-12)
    return rows


@cache
def pierced(angle, half=True):
    """A needle that splits two layers, half of them or all: history."""
    layers = [Layer("film", 0.4, NeoHookean(1.0, 0.45), BOND), Layer("base", 1.2, RUBBER, SOFT)]
    thicknesses = {layer.name: layer.thickness for layer in layers}
    width, rows = (0.6, 1) if half else (1.2, 2)
    domain = laminate(MPI.COMM_WORLD, thicknesses, length=1.0, size=0.4, band=0.4, notch=NOTCH, width=width, rows=rows)
    R = turned(domain, angle)
    needle = Needle(np.radians(25), 0.2, 0.4, tuple(-R[:, 1]), tuple(R[:, 0]))
    block = LayeredBlock.build(layers, domain, damping=0.01, plus=tuple(-R[:, 0]))
    cut = Insertion.build(block, needle, Drive(1.0), notch=NOTCH, fixture=Fixture(symmetry="front" if half else "none"))
    assert cut.symmetry_factor == 1 + half
    return drive(cut, cut.time_of(0.6), 0.1)


@pytest.mark.mpi
@pytest.mark.parametrize("angle", [np.pi / 6, np.pi / 2, np.pi / 4])
def test_a_turned_block_is_cut_by_the_same_force(angle):
    same(sliced(angle), sliced(0.0), ("depth", "force", "cut", "energy_friction", "work_external", "layer_0_strain"))
    assert sliced(0.0)["force"].max() > 0.02 and sliced(0.0)["imbalance"].max() < 1e-6


@pytest.mark.mpi
def test_a_block_turned_in_space_is_split_by_the_same_force():
    same(pierced(np.pi / 6), pierced(0.0), ("depth", "force", "tip_force", "front", "film_strain", "work_external"))


def test_half_a_block_is_half_of_it():
    """A plane of symmetry, or the whole held in its middle: the same force and areas, half of the energies."""
    half, whole = pierced(0.0), pierced(0.0, half=False)
    same(half, whole, ("depth", "force", "tip_force", "cut", "front"), 1e-7)
    np.testing.assert_allclose(2 * half["film_strain"], whole["film_strain"], rtol=1e-7)
    assert np.abs(whole["imbalance"]).max() < 1e-6


# -- any body ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("everything", [False, True], ids=["quasi-static", "heated and moving"])
def test_layers_of_one_material_are_one_body(everything):
    """Friction, two insertions, heat and inertia: in two layers all is as in one."""
    together, apart = (sliced(0.0, number, everything) for number in (1, 2))
    names = ["force", "cut", "front", "tip_friction_work", "energy_closure"]
    same(apart, together, names + ["temperature_max", "energy_kinetic"] * everything, 1e-8)
    np.testing.assert_allclose(apart["layer_0_strain"] + apart["layer_1_strain"], together["layer_0_strain"])
    if everything:
        assert together["energy_kinetic"].max() > 0 and together["temperature_max"].max() > 300.01
        np.testing.assert_allclose(apart["heat_friction"][-1], apart["energy_friction"][-1], rtol=1e-8)


@cache
def split(notch=NOTCH, length=0.8, fixture=STANDING, **options):
    """A strip of one material, its sides free, that a blade splits: insertion and history."""
    size = {"dim": 2, "Lx": length, "H": 2.0, "lc": 0.1, "band": 0.3, "growth": 1.6, "notch": notch}
    body = cracked_block(
        read_geo(MESHES / "block.geo", MPI.COMM_WORLD, size, gdim=2), RUBBER, BOND, viscosity=0.005, **options
    )
    cut = Insertion.build(body, Blade(0.35, 0.1, 0.3), Drive(1.0), notch=notch, fixture=fixture)
    return cut, drive(cut, cut.time_of(0.7), 0.05)


def test_any_degree_and_formulation():
    """Elements of degree 2 with a pressure of their own: nearly the same force, on a coarse mesh."""
    (_, plain), (cut, fine) = split(), split.__wrapped__(degree=2, solid={"volumetric": "taylor-hood"})
    assert fine["force"][-1] == pytest.approx(plain["force"][-1], rel=0.05)
    assert "block_pressure" in cut.mechanics.fields and np.abs(fine["energy_closure"]).max() < 0.01


def test_faces_that_slide_are_a_pair():
    """The pair of both faces, of notch and bond, in place of the contact of the cracks: the same cut."""
    (_, plain), (cut, sliding) = split(), split(faces=Faces(sliding=True))
    np.testing.assert_allclose(sliding["force"][-1], plain["force"][-1], rtol=0.01)
    assert [type(pair).__name__ for pair in cut.body.pairs] == ["SurfacePair"]
    assert sliding["faces_pressed"].max() > 0 and sliding["faces_penetration"].max() < 0.1
    assert np.abs(sliding["energy_closure"]).max() < 0.01
    with pytest.raises(ValueError, match="sliding"):
        Faces(sliding=True, symmetric=True)
    with pytest.raises(ValueError, match="sliding"):
        Faces(sliding=True, firm=True)


def test_all_surfaces_may_meet():
    """The outer surface, too, which does not come to lie on itself here: again the same cut."""
    (_, plain), (cut, met) = split(), split(faces=Faces(automatic=True))
    np.testing.assert_allclose(met["force"][-1], plain["force"][-1], rtol=0.01)
    whole = sum(len(face.facets) for face in cut.body.pairs[0].sides)
    assert whole > len(cut.body.slit) * 2 and np.abs(met["energy_closure"]).max() < 0.01
    with pytest.raises(ValueError, match="automatic"):
        Faces(automatic=True, sliding=True)


def test_all_surfaces_may_meet_beside_faces_that_are_alike():
    """These press on each other as without it, and nothing else comes to lie on anything here: the same cut."""
    (_, plain), (cut, met) = split(faces=Faces(symmetric=True)), split(faces=Faces(symmetric=True, automatic=True))
    np.testing.assert_allclose(met["force"], plain["force"], rtol=1e-6)
    assert all(crack.closing for crack in cut.body.cracks) and met["faces_pressed"].max() == 0


def test_a_body_without_a_notch_is_entered_at_its_surface():
    """The tool comes from above, dents the body, and then opens the crack; the plate carries its force."""
    cut, rows = split(notch=0.0)
    assert cut.motion.start_depth == 0 and cut.motion.entry_time == pytest.approx(
        cut.tool.tip_radius / cut.motion.speed
    )
    clearance = cut.contacts[0].contact.clearance
    above = rows["time"] <= cut.motion.entry_time - clearance / cut.motion.speed
    assert above.any() and not rows["force"][above].any() and rows["depth"][above].max() <= 0
    assert np.diff(rows["force"][~above][:5]).min() > 0, "it dents the body"
    assert rows["front"][-1] > 0.2 and rows["imbalance"].max() < 1e-6


# -- the plate --------------------------------------------------------------------------------------------------------


def test_a_smooth_plate_is_a_smooth_support():
    """A body that rests on it begins at zero gap, with nothing but the plate to hold it; the plate bears the blade."""
    (_, held), (cut, resting) = split(), split(fixture=Fixture(resting=True))
    assert resting["force"][-1] > 0.05
    np.testing.assert_allclose(resting["force"], held["force"], rtol=0.01, atol=1e-3 * held["force"][-1])
    assert resting["imbalance"].max() < 1e-6 and np.abs(resting["energy_closure"]).max() < 0.01
    assert cut.reaction() == pytest.approx(resting["force"][-1])
    np.testing.assert_allclose(resting["plate_force_y"], -resting["force"], rtol=1e-6)


def test_a_long_body_lifts_off_the_plate_at_its_ends():
    """No tension there but that of the springs, less than a hundredth of the force; the support draws it down."""
    cut, rows = split(length=8.0, fixture=Fixture(resting=True))
    x, u = (values[:, :2] for values in (cut.state.V.tabulate_dof_coordinates(), cut.state.u.x.array.reshape(-1, 2)))
    floor = np.isclose(x[:, 1], -2.0)
    ends, middle = floor & (np.abs(x[:, 0]) > 7.9), floor & (np.abs(x[:, 0]) < 1.0)
    assert u[ends, 1].min() > 0.01 and u[middle, 1].max() < 0
    patch = cut.plate.patches[0]
    assert patch.surface.points.integral(patch.pressure()) == pytest.approx(rows["force"][-1], rel=0.01)
    assert patch.surface.points.area_above(-patch.contact()["depth"], 0.0) > 2.0, "much of it is in the air"
    np.testing.assert_allclose(rows["force"][-1], split(length=8.0)[1]["force"][-1], rtol=0.01)


def test_the_plate_rubs():
    """It holds the halves that the blade drives apart, within the cone of Coulomb, with work of its own."""
    _, rows = split(length=3.0, fixture=Fixture(resting=True, friction=0.3))
    assert rows["force"][10] > 1.03 * split(length=3.0)[1]["force"][10]
    assert rows["energy_friction"][-1] > 0 and np.abs(rows["energy_closure"]).max() < 0.01
    assert np.all(rows["plate_sticking"] + rows["plate_slipping"] <= 6.0 + 1e-9)
    assert rows["imbalance"].max() < 1e-6
    with pytest.raises(ValueError, match=r"friction = 0\.3.*resting"):
        Fixture(friction=0.3)
