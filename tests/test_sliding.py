"""Two bodies with meshes of their own: they find each other, press, stick and slide (docs/theory.md §3.5)."""

import numpy as np
import pytest
from mpi4py import MPI

from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.stepping import StepControl, begin, run
from cutsim.bodies.loads import Support
from cutsim.bodies.solid import Solid
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.friction import Coulomb
from cutsim.interface.rubbing import Friction
from cutsim.materials.elastic import NeoHookean
from cutsim.pairs.surface_pair import SurfacePair
from helpers.boxes import stack, two
from helpers.fields import rotation, wavy
from helpers.laws import E
from helpers.pressing import pressed, stresses
from helpers.runs import LINE_SEARCHES, history
from helpers.tangents import STEPS, Assembled, slopes

# -- tangent ----------------------------------------------------------------------------------------------------------


CASES = {
    "frictionless": (None, 0.0),
    "stick": (Coulomb(50.0, 7.0), 0.02),
    "slip": (Coulomb(0.4, 1e3), 0.05),
}


ELEMENTS = [(2, False, 1), (2, True, 2), (3, False, 1), (3, True, 1), (3, False, 2)]  # dimension, simplices, degree


@pytest.mark.parametrize("fixed", [False, True], ids=["sliding", "fixed"])
@pytest.mark.parametrize(
    ("gdim", "simplices", "degree", "case"),
    [*((*element, "slip") for element in ELEMENTS), *((*ELEMENTS[0], case) for case in CASES if case != "slip")],
)
def test_tangent(gdim, simplices, degree, case, fixed):
    friction, slid = CASES[case]
    b = two(gdim, overhang=0.5, simplices=simplices, degree=degree, comm=MPI.COMM_SELF)
    pair = b.pair(friction=friction, small_sliding=fixed, contact=PenaltyContact(20.0), search=0.5)
    b.state.u_old.x.array[:] = wavy(b.state.V, 1, 0.01)
    pair.begin()
    shift = np.zeros(3)
    shift[0], shift[gdim - 1] = slid, -0.1
    b.move(lambda x: shift[:, None] + 0 * x, 1)
    u = b.state.u.x.array + wavy(b.state.V, 1, 0.01) + wavy(b.state.V, 2, 0.01)
    w = wavy(b.state.V, 3, 0.02)
    problem = Assembled(pair, b.state)
    f, slope = problem.forces(u), problem.matrix(u) @ w
    remainders = np.array([np.linalg.norm(problem.forces(u + h * w) - f - h * slope) for h in STEPS])
    remainders /= np.linalg.norm(slope)
    assert remainders[0] > 1e-8
    assert slopes(STEPS, remainders).min() > 1.95, remainders
    np.testing.assert_allclose(problem.forces(u, w), f + slope, atol=1e-12 * np.linalg.norm(slope))
    assert np.abs(f.reshape(-1, gdim).sum(axis=0)).max() < 1e-13 * np.abs(f).sum()


@pytest.mark.parametrize("offset", [-2e-3, 2e-3])
@pytest.mark.parametrize("gdim", [2, 3])
def test_tangent_beside_an_edge(gdim, offset):
    """A point of the slave is just left or right of an edge of the master."""
    b = two(gdim, n=(2, 3), overhang=0.5, comm=MPI.COMM_SELF)
    pair = b.pair(friction=Coulomb(0.4, 1e3), contact=PenaltyContact(20.0), search=0.5)
    pair.begin()
    slave, edge = pair.passes[0].kinematics.slave, 0.5
    way = edge - slave.at_points(slave.reference)[:, 0]
    shift = np.zeros(3)
    shift[0], shift[gdim - 1] = way[np.abs(way).argmin()] + offset, -0.05
    b.move(lambda x: shift[:, None] + 0 * x, 1)
    u, w = b.state.u.x.array + wavy(b.state.V, 1, 0.01), wavy(b.state.V, 3, 1e-3)
    problem = Assembled(pair, b.state)
    f, slope = problem.forces(u), problem.matrix(u) @ w
    xi = pair.passes[0].partners().hits.xi
    assert 0 < min(xi.min(), (1 - xi).min()) < 5e-3
    remainders = np.array([np.linalg.norm(problem.forces(u + h * w) - f - h * slope) for h in 10 * STEPS])
    assert slopes(STEPS, remainders).min() > 1.95, remainders


def test_displacement_that_is_not_finite():
    """What Newton's method may try is no reason to stop."""
    b = two(3, comm=MPI.COMM_SELF)
    pair = b.pair(friction=Coulomb(0.3))
    for value in (np.nan, np.inf, 1e200):
        forces = Assembled(pair, b.state).forces(np.full_like(b.state.u.x.array, value))
        assert not np.isfinite(forces).all() or not forces.any()


# -- patch test -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("two_pass", "tolerance"), [(False, 0.02), (True, 0.005)], ids=["one pass", "two passes"])
@pytest.mark.parametrize(("gdim", "simplices", "degree"), ELEMENTS)
def test_patch(gdim, simplices, degree, two_pass, tolerance):
    b = two(gdim, n=(4, 5), simplices=simplices, degree=degree)
    pair = b.pair(two_pass=two_pass)
    mechanics = pressed(b, pair)
    begin(mechanics, 1.0)
    outcome = mechanics.solve("basic")
    assert outcome.converged and outcome.iterations <= 3
    stress = stresses(b)
    expected = -E * 0.01 / (2 + E / pair.contact.stiffness)
    error = b.state.mesh.comm.allreduce(np.abs(stress / expected - 1).max(), MPI.MAX)
    assert error < tolerance


@pytest.mark.mpi
@pytest.mark.parametrize("gdim", [2, 3])
def test_augmentation(gdim):
    """A penetration of 1e-4 of the mesh size is met, and the stress is that without any penalty."""
    b = two(gdim, n=(4, 5))
    h = 0.5
    pair = b.pair(allowed_penetration=1e-5 * h, two_pass=True)
    mechanics = pressed(b, pair)
    begin(mechanics, 1.0)
    assert mechanics.solve("basic").converged
    mechanics.evaluate()
    assert pair.penetration() < 1e-4
    np.testing.assert_allclose(b.state.mesh.comm.allreduce(stresses(b).min(), MPI.MIN), -E * 0.005, rtol=5e-3)


class Settled:
    """Sees after each step that no facet penetrates, or slides where it sticks, by more than is allowed."""

    def __init__(self, pair, allowed):
        self.first, self.allowed = pair.passes[0], allowed
        self.slides, self.partial = 0.0, 0

    def __call__(self, report):
        points, slip, trial = self.first.points, self.first.slip, self.first.history.trial
        assert report.cuts == 0
        met = np.zeros(points.weights.size)
        met[self.first.partners().hits.points] = 1.0
        met = met.reshape(points.weights.shape)
        # facets of the slab that the block covers in part: over what it covers
        share = np.maximum(points.facet_mean(met), 1e-12)
        assert points.maximum((points.facet_mean(-met * trial["opening"]) / share)[:, None]) < self.allowed
        sticks = ((slip.values("advance") == 0) & (trial["pressure"] > 0)).all(axis=1)
        slides = np.array([points.facet_mean(s) for s in np.moveaxis(slip.values("slip"), -1, 0)])
        assert np.linalg.norm(slides - self.slides, axis=0)[sticks].max(initial=0.0) < self.allowed
        self.slides = slides
        self.partial += min(slip.areas()) > 0.1


@pytest.mark.parametrize(
    ("gdim", "slave"),
    [(2, 0), (2, 1), pytest.param(3, 1, marks=pytest.mark.mpi)],
    ids=["slab", "block", "block in 3-D"],
)
def test_from_stick_to_slip_without_penetration(gdim, slave):
    """A block on a rigid slab, either of them the slave: slip from the edges inwards, and μ N in the end."""
    mu, up, h = 0.3, gdim - 1, 0.5 / (4 - gdim)
    slab, block = ((-0.5, -0.5, -0.5), (2.5, 1.5, 0.0), (7, 5, 1)), ((0.0, 0.0, 0.0), (2.0, 1.0, 0.5), (4, 3, 1))
    if gdim == 2:
        slab, block = ((-0.5, -0.5), (2.5, 0.0), (11, 1)), ((0.0, 0.0), (2.0, 0.5), (10, 2))
    b = stack(slab, block)
    faces = b.face(0, up, 1), b.face(1, up, 0)
    options = {
        "friction": Friction(mu, allowed_slip=1e-4 * h),
        "contact": PenaltyContact(40 * E / h),
        "allowed_penetration": 1e-4 * h,
    }
    pair = SurfacePair(b.state, faces[slave], faces[1 - slave], young=E, **options)
    rigid = [Support(b.state, b.cells(0), i, 0.0, dim=gdim) for i in range(gdim)]
    path = [lambda t: 0.05 * max(t - 1, 0.0), *[0.0] * (gdim - 2), lambda t: -0.05 * min(t, 1.0)]
    mechanics = Mechanics(b.state, [Solid(b.state, NeoHookean(E, 0.3)), pair], rigid + b.drive(1, 1, path, "top"))
    watch = Settled(pair, 1e-4 * h)
    for end, step in ((1.0, 1.0), (3.0, 0.25)):
        run(mechanics, end, StepControl(first=step, largest=step, line_searches=LINE_SEARCHES), watch)
    assert watch.partial > 3, "some facets stick while others slip"
    assert pair.passes[0].slip.areas()[0] == 0.0
    force = pair.force()
    assert np.linalg.norm(force[:up]) == pytest.approx(mu * abs(force[up]), rel=1e-3)


# -- sliding ----------------------------------------------------------------------------------------------------------


def drawn(gdim, steps, slave=0, mu=0.3):
    """A soft block, pressed on a rigid slab and drawn over three of its facets; the pair and its history."""
    up, across = gdim - 1, [0.0] * (gdim - 2)
    if gdim == 2:
        b = stack(((0.0, -0.5), (4.0, 0.0), (13, 1)), ((0.2, 0.0), (1.2, 1.0), (4, 4)))
    else:
        b = stack(((0.0, -0.5, -0.5), (4.0, 1.5, 0.0), (13, 6, 1)), ((0.2, 0.0, 0.0), (1.2, 1.0, 1.0), (3, 3, 3)))
    faces = b.face(0, up, 1), b.face(1, up, 0)
    pair = SurfacePair(b.state, faces[slave], faces[1 - slave], young=E, friction=Coulomb(mu))
    rigid = [Support(b.state, b.cells(0), i, 0.0, dim=gdim) for i in range(gdim)]
    path = [lambda t: max(t - 1, 0.0), *across, lambda t: -0.05 * min(t, 1.0)]
    mechanics = Mechanics(b.state, [Solid(b.state, NeoHookean(E, 0.3)), pair], rigid + b.drive(1, 1, path, "top"))
    press = history(mechanics, 1.0, StepControl(first=0.5, largest=0.5, line_searches=LINE_SEARCHES))
    draw = history(mechanics, 2.0, StepControl(first=1 / steps, largest=1 / steps, line_searches=LINE_SEARCHES))
    return pair, {name: np.append(press[name], draw[name]) for name in press}


@pytest.mark.mpi
@pytest.mark.parametrize("gdim", [2, 3])
def test_block_drawn_over_facets(gdim):
    """The points are on the flat slab: their normals, and with them the ratio of the tractions, are exact."""
    # in space the block bulges, so that its edges slide a little sideways, too
    ends, aside = [], {2: 1e-6, 3: 1e-4}[gdim]
    for steps in (5, 10):
        pair, rows = drawn(gdim, steps)
        normal, shear = rows[f"pair_force_{'xyz'[gdim - 1]}"], rows["pair_force_x"]
        assert rows["pair_sticking"][1] > 0 and rows["pair_sticking"][-1] == 0
        np.testing.assert_allclose(shear[-1], -0.3 * normal[-1], rtol=aside)
        pressure, traction = pair.passes[0].history.trial["pressure"], pair.passes[0].slip.values("traction")
        traction = np.linalg.norm(traction.reshape(*pressure.shape, gdim - 1), axis=-1)
        np.testing.assert_allclose(traction, 0.3 * pressure, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(rows["top_x_force"], shear, rtol=1e-6, atol=1e-8 * abs(normal[-1]))
        ends.append(normal[-1])
    np.testing.assert_allclose(*ends, rtol=1e-5)
    assert pair.passes[0].pattern > 3, "the block is to pass over facets that it was not near before"


def test_energy_of_a_drawn_block_closes_with_the_steps():
    closures = []
    for steps in (10, 20, 40):
        rows = drawn(2, steps, slave=1)[1]
        closures.append(abs(rows["energy_closure"][-1]))
        assert (np.diff(rows["energy_friction"]) >= 0).all()
        friction = rows["energy_friction"][-1]
        assert abs(rows["energy_numerical"][-1]) < 0.03 * friction
    assert closures[0] / closures[2] > 8 and closures[2] < 2e-3, closures


# -- objectivity ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("fixed", [False, True], ids=["sliding", "fixed"])
@pytest.mark.parametrize("gdim", [2, 3])
def test_rotation_of_a_stuck_interface(gdim, fixed):
    """Both bodies turn by 90° in three steps: the forces turn with them, and nothing slips."""
    b = two(gdim, overhang=0.5, comm=MPI.COMM_SELF)
    pair = b.pair(friction=Coulomb(5.0, 7.0), small_sliding=fixed, contact=PenaltyContact(20.0), search=0.5)
    problem = Assembled(pair, b.state)
    pair.begin()
    shift = np.zeros(3)
    shift[0], shift[gdim - 1] = 0.02, -0.05
    b.move(lambda x: shift[:, None] + 0 * x, 1)
    b.state.u.x.array[:] += wavy(b.state.V, 1, 0.002)
    sheared = b.state.u.x.array.copy()
    x = b.state.V.tabulate_dof_coordinates()[:, :gdim]
    forces = problem.forces(sheared).reshape(-1, gdim)
    for angle in (0.0, 30.0, 60.0, 90.0):
        turn = rotation(gdim, np.deg2rad(angle))
        if angle:
            pair.begin()
        b.state.u.x.array[:] = ((x + sheared.reshape(-1, gdim)) @ turn.T - x).ravel()
        pair.evaluate()
        now = problem.forces(b.state.u.x.array.copy()).reshape(-1, gdim)
        np.testing.assert_allclose(now, forces @ turn.T, atol=1e-8 * np.abs(forces).max())
        b.state.commit()
    assert abs(forces[:, 0]).max() > 0.1 * abs(forces).max()
    assert pair.energies()["friction"] == 0


# -- state ------------------------------------------------------------------------------------------------------------


def test_rollback():
    """A step that is given up leaves no trace, bit for bit, and the next one ends where it would have without."""
    ends = []
    for disturbed in (False, True):
        b = two(2, overhang=0.5)
        pair = b.pair(friction=Friction(0.3, allowed_slip=1e-3), allowed_penetration=1e-3, two_pass=True)
        path = [lambda t: 0.1 * t, lambda t: -0.02 * min(t, 1)]
        supports = b.drive(0, 0, [0.0, 0.0]) + b.drive(1, 1, path)
        mechanics = Mechanics(b.state, [Solid(b.state, NeoHookean(E, 0.3)), pair], supports)
        for end in (1.0, 1.5):
            if disturbed:
                before = memory(mechanics, pair)
                step(mechanics, end + 0.05)
                mechanics.state.rollback()
                for one, other in zip(before, memory(mechanics, pair), strict=True):
                    np.testing.assert_array_equal(one, other)
            step(mechanics, end)
            mechanics.state.commit()
        ends.append([b.state.u.x.array, pair.force(), *mechanics.audit.entries.values()])
    for one, other in zip(*ends, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-12)


def step(mechanics, end):
    """Solve a step and evaluate it."""
    begin(mechanics, end)
    assert mechanics.solve("basic").converged
    mechanics.evaluate()


def memory(mechanics, pair):
    """Copies of all that a step changes."""
    arrays = [mechanics.state.u.x.array, pair.force(), list(pair.energies().values())]
    for p in pair.passes:
        arrays += [p.history.secants.x.array, p.history.multiplier.x.array, *p.history.trial.values()]
        arrays += [p.slip.values(name) for name in ("slip", "traction", "dissipated")]
        arrays.append(p.kinematics._slid.trial)
    return [np.array(a) for a in arrays]


BAD = {
    "young": {"young": 0.0},
    "search": {"search": -1.0},
    "allowed_penetration": {"allowed_penetration": 0.0},
    "friction": {"friction": -1.0},
}


@pytest.mark.mpi
@pytest.mark.parametrize("name", BAD)
def test_refusal(name):
    with pytest.raises(ValueError, match=name):
        two(2).pair(**BAD[name])


def overlapping(gdim, n, overlap=0.1, drop=0.0, **options):
    """Two unit blocks (E 1, ν 0) with held outer faces, of n and n + 1 cells a side: force between them."""
    across = gdim - 1
    lower = ([0.0] * gdim, [1.0] * gdim, [n] * gdim)
    upper = ([0.0] * across + [1 - overlap], [1.0] * across + [2 - overlap], [n + 1] * gdim)
    s = stack(lower, upper)
    pair = s.pair(contact=PenaltyContact(1e3), **options)
    supports = [*s.drive(0, 0, [0.0] * gdim), *s.drive(1, 1, [0.0] * across + [lambda t: -drop * t], "top")]
    mechanics = Mechanics(s.state, [Solid(s.state, NeoHookean(1.0, 0.0)), pair], supports)
    return -history(mechanics, 1.0, StepControl.fixed(1.0))[f"top_{'xyz'[across]}_force"][-1]


# of blocks that shorten from 1 to 0.95
PRESSED = 0.5 * (1 / 0.95 - 0.95)


@pytest.mark.mpi
@pytest.mark.parametrize(("gdim", "n"), [(2, 4), (2, 10), (2, 20), (3, 5)])
def test_an_overlap_is_found_whatever_the_facets(gdim, n):
    assert overlapping(gdim, n) == pytest.approx(PRESSED, rel=1e-3)
    if gdim == 2:
        assert overlapping(gdim, n, search=0.01) == pytest.approx(PRESSED, rel=1e-3)
        assert overlapping(gdim, n, two_pass=True) == pytest.approx(PRESSED, rel=1e-3)


@pytest.mark.mpi
@pytest.mark.parametrize("n", [4, 20])
def test_surfaces_do_not_pass_each_other_in_a_step(n):
    """They close a gap of 0.1 and 0.1 more in one step, whatever the facets."""
    assert overlapping(2, n, overlap=-0.1, drop=0.2) == pytest.approx(PRESSED, rel=1e-3)


@pytest.mark.mpi
def test_the_far_side_of_a_thin_body_is_no_partner():
    """Two sheets that move far together in a step: the face of one does not meet the far face of the other."""
    s = stack(((0.0, 0.0), (1.0, 0.05), (4, 1)), ((0.0, 0.06), (1.0, 0.11), (4, 1)))
    faces = [np.concatenate([s.face(box, 1, end) for end in (0, 1)]) for box in (1, 0)]
    kinematics = SurfacePair(s.state, *faces, young=E, search=0.02).passes[0].kinematics
    before = kinematics.pairs(kinematics.nodes(s.state.u.x.array)).hits
    s.move(lambda x: np.stack([0 * x[0], 0 * x[0] + 0.3]))
    after = kinematics.pairs(kinematics.nodes(s.state.u.x.array)).hits
    np.testing.assert_array_equal(after.points, before.points)
    np.testing.assert_allclose(after.gap, 0.01, rtol=1e-9)


@pytest.mark.mpi
def test_overlaps_that_face_nothing_are_refused():
    """A block in another one, whose top and bottom are slaves of the other's sides."""
    s = stack(((0.0, 0.0), (1.0, 1.0), (4, 4)), ((0.3, 0.3), (0.7, 0.7), (2, 2)))
    with pytest.raises(ValueError, match=r"slave_facets: \d+ points lie in the body of master_facets .* deep"):
        SurfacePair(s.state, s.face(1, 1, 1), s.face(0, 1, 1), young=E)


@pytest.mark.mpi
def test_refusal_of_one_surface_with_itself():
    b = two(2)
    with pytest.raises(ValueError, match="slave_facets"):
        SurfacePair(b.state, b.face(1, 1, 0), b.face(1, 1, 0), young=E)


@pytest.mark.mpi
def test_same_on_any_number_of_ranks():
    """The rows of a run on one rank, and of the same run on all of them."""
    if MPI.COMM_WORLD.size == 1:
        pytest.skip("compares several ranks with one")
    ends = []
    for comm in (MPI.COMM_SELF, MPI.COMM_WORLD):
        b = two(3, overhang=0.5, comm=comm)
        pair = b.pair(friction=Coulomb(0.3), two_pass=True)
        path = [lambda t: 0.2 * t, 0.0, lambda t: -0.05 * min(t, 1)]
        supports = b.drive(0, 0, [0.0] * 3) + b.drive(1, 1, path, "top")
        mechanics = Mechanics(b.state, [Solid(b.state, NeoHookean(E, 0.3)), pair], supports)
        rows = history(mechanics, 2.0, StepControl(first=0.5, largest=0.5, line_searches=LINE_SEARCHES))
        ends.append({k: v for k, v in rows.items() if "closure" not in k})
    for name in ends[0]:
        scale = np.abs(ends[0]["pair_force_z"]).max() if "force" in name else 1.0
        np.testing.assert_allclose(ends[1][name], ends[0][name], rtol=1e-7, atol=1e-8 * scale, err_msg=name)
