"""Bonds between surfaces that do not match and slide far: on material partners, contact on the current ones (§3.5)."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.stepping import StepControl, run
from cutsim.bodies.loads import Support
from cutsim.bodies.solid import Solid
from cutsim.cases import read_case
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.friction import Coulomb
from cutsim.materials.elastic import LinearElastic, NeoHookean
from cutsim.pairs.surface_pair import SurfacePair
from cutsim.results.recording import Recording
from cutsim.solvers.convergence import Tolerances
from helpers.blocks import make_blocks, separated
from helpers.boxes import stack, two
from helpers.fields import wavy
from helpers.laws import EXPONENTIAL, E
from helpers.runs import LINE_SEARCHES, history
from helpers.tangents import STEPS, Assembled, Linearised, slopes

KINDS = pytest.mark.parametrize("small_sliding", [False, True], ids=["sliding", "small sliding"])

# -- tangent ----------------------------------------------------------------------------------------------------------

# mean jump of a bond (sliding, opening) over its characteristic openings of 0.1 and 0.2
JUMPS = {"opening": (0.02, 0.15), "sliding": (0.25, 0.0), "both": (0.15, 0.08), "pressed": (0.26, -0.03)}
STICK, SLIP = Coulomb(50.0, 7.0), Coulomb(0.4, 1e3)


def bonded(gdim, jump, past=1.0, law=EXPONENTIAL, friction=STICK, small_sliding=False, overhang=0.5, **options):
    """Two boxes with a bond whose mean jump has been a multiple of what it is now; the problem and a displacement."""
    b = two(gdim, overhang=overhang, comm=MPI.COMM_SELF, **options)
    contact = PenaltyContact(20.0)
    pair = b.pair(law=law, small_sliding=small_sliding, friction=friction, contact=contact, search=0.5)
    shift = np.zeros(3)
    shift[0], shift[gdim - 1] = jump
    if past > 1:
        b.move(lambda x: past * shift[:, None] + 0 * x, 1)
        pair.evaluate()
        b.state.commit()
    pair.begin()
    b.move(lambda x: shift[:, None] + 0 * x, 1)
    return pair, Assembled(pair, b.state), b.state.u.x.array + wavy(b.state.V, 1, 0.004)


def assert_exact(problem, u):
    """The tangent is that of the forces, from the matrix and along a direction, and the forces are in balance."""
    V = problem.state.V
    w = wavy(V, 3, 0.01)
    f, slope = problem.forces(u), problem.matrix(u) @ w
    remainders = np.array([np.linalg.norm(problem.forces(u + h * w) - f - h * slope) for h in STEPS])
    assert remainders[0] > 1e-9 * np.linalg.norm(slope)
    assert slopes(STEPS, remainders).min() > 1.95, remainders
    np.testing.assert_allclose(problem.forces(u, w), f + slope, atol=1e-12 * np.linalg.norm(slope))
    assert np.abs(f.reshape(-1, V.dofmap.index_map_bs).sum(axis=0)).max() < 1e-13 * np.abs(f).sum()


@KINDS
@pytest.mark.parametrize("past", [1.0, 1.6], ids=["loading", "unloading"])
@pytest.mark.parametrize("jump", JUMPS)
@pytest.mark.parametrize("gdim", [2, 3])
def test_tangent(gdim, jump, past, small_sliding):
    """On its envelope and below it, with friction on what is broken."""
    assert_exact(*bonded(gdim, JUMPS[jump], past, small_sliding=small_sliding)[1:])


@pytest.mark.parametrize("friction", [STICK, SLIP], ids=["stick", "slip"])
@pytest.mark.parametrize(
    ("gdim", "simplices", "degree"), [(2, False, 1), (2, True, 2), (3, False, 1), (3, True, 1), (3, False, 2)]
)
def test_tangent_of_a_bond_that_has_slid_far(gdim, simplices, degree, friction):
    """A long bond, half broken where it is pressed, some facets away from where its points were bonded."""
    law = replace(EXPONENTIAL, shear_opening=1.0)
    mesh = {"n": (8, 4) if gdim == 2 else (6, 2), "overhang": 1.5, "simplices": simplices, "degree": degree}
    pair, problem, u = bonded(gdim, (1.3, -0.03), law=law, friction=friction, **mesh)
    assert_exact(problem, u)
    first = pair.passes[0]
    share = first.slip._evaluate()["share"]
    assert 0.2 < np.median(share) < 0.8
    assert len(first._forces(linearised=True).coupling.rows[0]) > 0.3 * share.size, "contact and bond are coupled"


@pytest.mark.parametrize("offset", [-2e-3, 2e-3])
@pytest.mark.parametrize("gdim", [2, 3])
def test_tangent_beside_an_edge(gdim, offset):
    """The middle point of a facet has slid to just before or behind an edge of the master, while its bond breaks."""
    pair, problem, u = bonded(gdim, (0.125 + offset, -0.05), friction=SLIP, n=(8, 4))
    assert_exact(problem, u)
    xi = pair.passes[0].partners().hits.xi
    assert 0 < min(xi.min(), (1 - xi).min()) < 0.02


# -- bond -------------------------------------------------------------------------------------------------------------


def envelope(opening, sliding):
    """Normal and shear traction of the exponential law under growing openings (van den Bosch et al.)."""
    x, y = opening / EXPONENTIAL.opening, sliding / EXPONENTIAL.shear_opening
    normal, shear = EXPONENTIAL.toughness / 0.1, EXPONENTIAL.shear_toughness / 0.2
    return normal * x * np.exp(-x - y**2), 2 * shear * y * (1 + x) * np.exp(-x - y**2)


@KINDS
@pytest.mark.parametrize("pull", [(1.0, 0.0), (0.0, 1.0), (0.5, 1.0)], ids=["opened", "slid", "both"])
@pytest.mark.parametrize("gdim", [2, 3])
def test_bond_between_meshes_that_do_not_match(gdim, pull, small_sliding):
    """Pulled, sheared, and both, as a whole: force and work of separation of the law, whatever the meshes."""
    b = two(gdim)
    pair, up = b.pair(law=EXPONENTIAL, small_sliding=small_sliding), gdim - 1
    way = np.append(pull[1] * np.array([[1.0], [0.6, 0.8]][gdim - 2]), pull[0])
    rigid = [Support(b.state, b.cells(0), i, 0.0, dim=gdim) for i in range(gdim)]
    moved = [
        Support(b.state, b.cells(1), i, lambda t, part=part: part * t, dim=gdim, name=f"top_{'xyz'[i]}")
        for i, part in enumerate(way)
    ]
    mechanics = Mechanics(b.state, [Solid(b.state, LinearElastic(E, 0.3)), pair], rigid + moved)
    rows = history(mechanics, 1.5, StepControl(first=0.15, largest=0.15))
    normal, shear = envelope(pull[0] * rows["time"], pull[1] * rows["time"])
    force = np.array([rows[f"top_{'xyz'[i]}_force"] for i in range(gdim)])
    np.testing.assert_allclose(force[up], normal, rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(force[:up], np.outer(way[:up], shear) / max(pull[1], 1e-300), rtol=1e-8, atol=1e-10)
    s = np.linspace(0.0, 1.5, 20_001)
    work = np.trapezoid(np.dot(pull, envelope(pull[0] * s, pull[1] * s)), s)
    np.testing.assert_allclose(rows["energy_fracture"][-1], work, rtol=5e-3)
    np.testing.assert_allclose(rows["pair_broken"][-1], 1.0, rtol=5e-3)


@pytest.mark.parametrize("two_pass", [False, True], ids=["one pass", "two passes"])
def test_points_without_partner_have_no_bond(two_pass):
    """The slave overhangs: what is not bonded counts neither as broken nor as damaged, and rubs under all pressure."""
    b = two(2, n=(20, 3), overhang=0.5, comm=MPI.COMM_SELF)
    faces = b.face(0, 1, 1), b.face(1, 1, 0)
    pair = SurfacePair(b.state, *faces, EXPONENTIAL, young=E, friction=SLIP, two_pass=two_pass, search=0.2)
    first, shift = pair.passes[0], (0.3, -0.01)
    shares = []
    for part in (0.0, 1.0):
        pair.begin()
        b.move(lambda x, part=part: part * np.outer(shift, np.ones(x.shape[1])), 1)
        pair.evaluate()
        shares.append(first.slip._evaluate()["share"])
        b.state.commit()
    bonded = first.bonded == 1
    assert 0 < bonded.sum() < bonded.size and (shares[0] == ~bonded).all()
    broken = 1 - np.exp(1 - (0.3 / EXPONENTIAL.shear_opening) ** 2)
    np.testing.assert_allclose(shares[1], np.where(bonded, broken, 1.0), rtol=1e-9)
    area = first.points.integral(first.bonded)
    assert pair.record()["pair_broken"][0] == pytest.approx(broken * area)
    assert area == pytest.approx(1.0, rel=0.1), "of the block, as far as points tell"


def test_a_pair_without_a_law_has_no_damage():
    """A limit of the damage in a step would else refuse the first one."""
    b = two(2, comm=MPI.COMM_SELF)
    pair = b.pair()
    pair.evaluate()
    assert pair.damage_increment() == 0.0


def test_a_law_that_bonds_nothing_is_refused():
    apart = stack(((0.0, 0.0), (1.0, 1.0), (2, 2)), ((0.0, 1.1), (1.0, 2.0), (2, 2)))
    with pytest.raises(ValueError, match=r"search = 0\.01 .*as large as the gap that the law bonds"):
        apart.pair(law=EXPONENTIAL, search=0.01)


@pytest.mark.mpi
def test_a_bond_shows_its_damage(folder):
    """In the fields of a run, on the facets of the slave."""
    b = two(2, n=(4, 5))
    pair = b.pair(law=EXPONENTIAL)
    rigid = [Support(b.state, b.cells(box), 0, part, dim=2) for box, part in ((0, 0.0), (1, lambda t: 0.3 * t))]
    rigid += [Support(b.state, b.cells(box), 1, 0.0, dim=2) for box in (0, 1)]
    mechanics = Mechanics(b.state, [Solid(b.state, LinearElastic(E, 0.3)), pair], rigid)
    with Recording(folder, mechanics, 1.0, every=1) as recording:
        run(mechanics, 1.0, StepControl.fixed(0.5), recording)
    bond = pair.companions[0]
    broken = 1 - np.exp(1 - (0.3 / EXPONENTIAL.shear_opening) ** 2)
    np.testing.assert_allclose(bond.facet_mean("damage"), broken, rtol=1e-9)
    assert (folder / "pair_bond.bp").exists()


# -- curved surfaces --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("gdim", [2, 3])
def test_a_bond_that_has_not_slid_far_is_that_of_a_crack(gdim):
    """Nodal forces of a deformed crack that is open, from the crack and from a pair of its faces."""
    b = make_blocks(gdim, comm=MPI.COMM_SELF)
    crack = b.crack(EXPONENTIAL)
    pair = SurfacePair(b.state, crack.face("+"), crack.face("-"), EXPONENTIAL, young=E)
    u = separated(b, 0.1, 0.1, 0.03)
    expected = Linearised(crack, b.state).forces(u)
    np.testing.assert_allclose(Assembled(pair, b.state).forces(u), expected, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("gdim", [2, 3])
def test_sliding_over_a_curved_surface_is_no_opening(gdim):
    """Bent to a cylinder and slid along it by s: the jump is the chord; the normal of one face alone sees s²/2R."""
    radius, slide = 2.0, 0.4
    b = two(gdim, n=(5, 4), overhang=0.5, degree=2, comm=MPI.COMM_SELF)
    pair, up = b.pair(law=EXPONENTIAL), gdim - 1

    def bend(x, along):
        u = np.zeros_like(x)
        angle, r = (x[0] + along) / radius, radius + x[up]
        u[0], u[up] = r * np.sin(angle) - x[0], r * np.cos(angle) - radius - x[up]
        return u

    for box, along in ((0, 0.0), (1, slide)):
        b.move(lambda x, along=along: bend(x, along), box)
    pair.evaluate()
    jump = pair.passes[0]._now()[1].jump
    np.testing.assert_allclose(jump[:, 0], 0.0, atol=0.02 * slide**2 / (2 * radius))
    np.testing.assert_allclose(np.linalg.norm(jump[:, 1:], axis=1), 2 * radius * np.sin(slide / 2 / radius), rtol=1e-3)


# -- sheared off, slid on, lifted -------------------------------------------------------------------------------------

# of the case
LENGTH, TRACTION, FRICTION, SHEAR_MODULUS = 2.0, 0.1, 0.1, 50.0


def sheared(elements, comm=MPI.COMM_WORLD):
    """Columns of the case with a number of elements along the block."""
    case = read_case(Path(__file__).parent / "validation" / "sheared_bond.toml", {"mesh.set.nx": str(elements)})
    simulation, rows = case.build(comm), []
    simulation.run(lambda report: rows.append({name: value for name, (value, _) in report.columns.items()}))
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def expected(way, normal):
    """Force on the block at a way of its top, sliding of the bond and damage: T = t(δ) + D μ p, the block sheared."""
    slid = way
    for _ in range(20):
        broken = np.maximum(0.0, 1 - np.exp(1 - slid**2))
        force = LENGTH * 2 * np.sqrt(np.e / 2) * TRACTION * slid * np.exp(-(slid**2)) + FRICTION * broken * normal
        slid = way - force / (SHEAR_MODULUS * LENGTH)
    return force, slid, broken


def test_a_bond_is_sheared_off_and_slid_on():
    """Over ten facets of the block and fourteen of the slab: force, work, heat, on two meshes."""
    forces = []
    for elements in (5, 10):
        rows = sheared(elements)
        normal, way = -rows["press_force"], rows["drive_displacement"]
        force, slid, broken = expected(way, normal)
        np.testing.assert_allclose(rows["drive_force"], force, atol=2e-3 * force.max())
        np.testing.assert_allclose(rows["pair_broken"], LENGTH * broken, atol=0.01)
        assert rows["pair_slipping"][-2] == pytest.approx(LENGTH) and way[-1] > 10 * LENGTH / 5
        # pressed down by 0.004 mm, with a penalty of ten elements' stiffness
        np.testing.assert_allclose(normal[:-1], LENGTH * 100.0 * 0.004 / (1 + 0.5 / 10), rtol=0.01)
        fracture, friction = rows["energy_fracture"][-1], rows["energy_friction"][-1]
        assert fracture == pytest.approx(np.sqrt(np.e / 2) * TRACTION * LENGTH, rel=1e-4)
        assert friction == pytest.approx(np.trapezoid(FRICTION * broken * normal, slid), rel=2e-3)
        assert np.abs(rows["energy_closure"]).max() < 5e-3
        assert rows["heat_stored"][-1] == pytest.approx(fracture + friction, rel=1e-8)
        assert max(abs(rows["drive_force"][-1]), abs(normal[-1])) < 1e-6 * force.max(), "lifted"
        forces.append(rows["drive_force"])
    np.testing.assert_allclose(*forces, atol=1e-3 * forces[0].max())


@pytest.mark.mpi
def test_same_on_any_number_of_ranks():
    """A soft cube that is sheared off a slab in space while it is pressed, in two passes: rows of one rank and all."""
    if MPI.COMM_WORLD.size == 1:
        pytest.skip("compares several ranks with one")
    ends = []
    for comm in (MPI.COMM_SELF, MPI.COMM_WORLD):
        b = two(3, overhang=0.5, comm=comm)
        pair = b.pair(law=replace(EXPONENTIAL, shear_strength=0.5), friction=Coulomb(0.3), two_pass=True)
        path = [lambda t: 0.3 * t, 0.0, lambda t: -0.05 * min(t, 1)]
        supports = b.drive(0, 0, [0.0] * 3) + b.drive(1, 1, path, "top")
        terms = [Solid(b.state, NeoHookean(20.0, 0.3)), pair]
        mechanics = Mechanics(b.state, terms, supports, tolerances=Tolerances(rtol=1e-12))
        rows = history(mechanics, 2.0, StepControl(first=0.5, largest=0.5, line_searches=LINE_SEARCHES))
        ends.append({k: v for k, v in rows.items() if "closure" not in k})
    assert ends[0]["pair_broken"][-1] > 0.9 and ends[0]["pair_slipping"][-1] > 0.9
    for name in ends[0]:
        scale = np.abs(ends[0]["pair_force_x"]).max() if "force" in name else 1.0
        np.testing.assert_allclose(ends[1][name], ends[0][name], rtol=1e-7, atol=1e-8 * scale, err_msg=name)
