"""Path following by dissipation: snap-back, limit points of a load, corners, failures, ranks, and resuming."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from mpi4py import MPI

from cutsim import (
    Bilinear,
    Crack,
    Exponential,
    LinearElastic,
    Mechanics,
    PathFollowing,
    PenaltyContact,
    Solid,
    State,
    StepControl,
    StepError,
    Support,
    Traction,
    cracked_space,
    run,
)
from cutsim.analysis import checkpoint
from cutsim.base.memory import Snapshot
from cutsim.fields.meshing import geometry, read_geo
from cutsim.studies.fracture import CantileverBeams, crack_front, crack_length_correction
from helpers.bars import BONDS, FINE, SOFT, WIDTH, Bar
from helpers.blocks import make_blocks
from helpers.boxes import two
from validation.snap_back import UNTIL, Case, build, check, follow, judge

# one law is enough on several ranks: the closed forms are the same on all
ON_RANKS = {"exponential": [], "bilinear": [pytest.mark.mpi]}


@pytest.mark.parametrize("law", [pytest.param(law, marks=ON_RANKS[name], id=name) for name, law in BONDS.items()])
def test_a_stiff_bond_in_a_soft_bar_snaps_back(law):
    """Displacement of the end: that of the bar, T L/E, and the opening."""
    bar = Bar.build(law)
    time, opening, T, reports = bar.run(1.2)
    np.testing.assert_allclose(time, T / SOFT + opening, atol=1e-6)
    assert time.max() > 0.7
    back = np.diff(time) < 0
    assert np.count_nonzero(back) > 5
    assert time[1:][back].min() < 0.45
    assert T[-1] < 1e-3
    audit = bar.mechanics.audit
    assert abs(audit.closure) < 5e-3
    assert audit.entries["fracture"] == pytest.approx(law.toughness * WIDTH, rel=5e-3)
    assert audit.entries["viscous"] == 0
    assert bar.state.path == pytest.approx(np.abs(np.diff(time, prepend=0)).sum())
    assert max(r.lost for r in reports) < 1.1 * FINE.facets * bar.mechanics.path.unit


def test_a_path_on_which_a_rigid_link_moves_the_bar():
    """Time may stand still within a step, in which the link has no rate."""
    time, opening, T, _ = Bar.build(linked=True).run(1.2)
    np.testing.assert_allclose(time, T / SOFT + opening, atol=1e-6)
    assert np.count_nonzero(np.diff(time) < 0) > 5 and T[-1] < 1e-3


@pytest.mark.parametrize("law", BONDS.values(), ids=BONDS)
def test_a_load_is_followed_through_its_limit_point(law):
    """The bar carries no more than the strength: after it the load falls with the bond."""
    bar = Bar.build(law, pulled=True)
    stop = lambda report: bar.state.time_old < 0.05 and report.dt < 0  # noqa: E731
    time, opening, T, _ = bar.run(2.0, stop=stop)
    np.testing.assert_allclose(time, T, atol=1e-6)
    assert time.max() == pytest.approx(1.0, abs=0.02)
    assert np.all(np.diff(opening) > 0)
    assert time[-1] < 0.05
    assert abs(bar.mechanics.audit.closure) < 5e-3


def test_by_default_the_path_is_followed_where_no_step_in_time_succeeds():
    bar = Bar.build(pulled=True)
    time, _, T, reports = bar.run(2.0, PathFollowing(), lambda report: report.dt < 0)
    assert reports[-1].size > 0
    assert [report.size for report in reports[:-1]] == [0] * (len(reports) - 1)
    np.testing.assert_allclose(time, T, atol=1e-6)


def test_without_it_the_run_ends_there():
    bar = Bar.build(pulled=True)
    with pytest.raises(StepError, match=r"no step from time (0\.99\d*|1) of"):
        bar.run(2.0, PathFollowing(facets=0))


def test_what_needs_time_is_not_followed():
    bar = Bar.build(pulled=True, viscosity=1e-9)
    assert "needs time" in bar.mechanics.path.obstacle
    with pytest.raises(StepError, match=r"path of equilibria is not followed: .* needs time"):
        bar.run(2.0, PathFollowing(onset=0.1), step=0.3)


def test_a_corner_on_the_path_is_met():
    """Also while the path is followed; after it steps are those in time until they fail."""
    corner = 0.715
    bar = Bar.build(corners=(corner,))
    time, opening, T, reports = bar.run(1.0)
    met = [report for report in reports if report.corner]
    assert {report.time for report in met} == {corner, 1.0}
    np.testing.assert_allclose(time, T / SOFT + opening, atol=1e-6)


def test_the_measure_of_the_path_has_its_derivative():
    b, rng = make_blocks(), np.random.default_rng(3)
    crack = b.crack(Exponential(1.0, 0.1, 0.7, 0.08), normal="current")
    b.move(lambda x: 0 * x, lambda x: np.stack([0.03 + 0.02 * x[0], 0.12 + 0.05 * x[0], 0 * x[0]]))
    for term in (crack,):
        term.evaluate()
    b.state.commit()
    size, way = b.state.u.x.array.size, rng.standard_normal(b.state.u.x.array.size)
    there = b.state.u.x.array + 0.03 * np.abs(rng.standard_normal(size))
    rest = []
    b.state.u.x.array[:] = there
    value, slope = crack.path_measure()
    assert value > 0
    for h in (1e-2, 5e-3, 2.5e-3):
        b.state.u.x.array[:] = there + h * way
        rest.append(abs(crack.path_measure()[0] - value - h * slope @ way))
    rates = np.log2(np.divide(rest[:-1], rest[1:]))
    assert rates.min() > 1.9


def test_the_measure_is_the_dissipation_of_a_softening_step():
    """On a straight branch of the law exactly; nothing on unloading."""
    law = BONDS["bilinear"]
    bar = Bar.build(law)
    b = bar.blocks
    for before, after in ((0.1, 0.3), (0.3, 0.2)):
        b.move(lambda x: 0 * x, lambda x, d=before: np.stack([0 * x[0], d + 0 * x[0], 0 * x[0]]))
        bar.crack.evaluate()
        b.state.commit()
        b.move(lambda x: 0 * x, lambda x, d=after: np.stack([0 * x[0], d + 0 * x[0], 0 * x[0]]))
        bar.crack.evaluate()
        lost = bar.crack.points.integral(bar.crack.dissipation())
        assert bar.crack.path_measure()[0] == pytest.approx(lost, rel=1e-8, abs=1e-12)
        assert (lost > 0) == (after > before)
        b.state.rollback()


@pytest.mark.mpi
def test_rejected_steps_along_the_path_leave_no_trace():
    """All but the smallest steps are refused: what counts is as before, bit for bit, and the run goes on."""
    bar, seen = Bar.build(), []

    @dataclass(frozen=True)
    class Picky(StepControl):
        def accept(self, report):
            if report.size > 0.01 * bar.mechanics.path.unit:
                bar.state.rollback()
                seen.append(kept(bar.state) == before[-1])
                return "too large"
            return None

    before = [kept(bar.state)]

    def record(report):
        before.append(kept(bar.state))

    control = Picky(0.05, 0.05, path=replace(FINE, facets=0.06))
    run(bar.mechanics, 1.2, control, record, lambda report: report.size > 0 and report.dt < 0)
    assert len(seen) > 1
    assert all(seen)


def test_a_run_goes_on_from_the_middle_of_a_path():
    whole, first, second = (Bar.build() for _ in range(3))
    turned = lambda report: report.number == 20  # noqa: E731
    time = whole.run(1.2)[0]
    first.run(1.2, stop=turned)
    assert first.state.pace.committed.path > 0
    checkpoint.load(second.mechanics, checkpoint.save(first.mechanics))
    rest = second.run(1.2)[0]
    np.testing.assert_allclose(rest, time[20:], atol=1e-9)
    assert second.state.path == pytest.approx(whole.state.path)


def kept(state):
    """All that is remembered but what a solver leaves to the next try, whether or not it has failed."""
    values = state.memory.save().values
    return Snapshot({name: value for name, value in values.items() if name != "mechanics: solver"})


@dataclass(frozen=True)
class Specimen:
    """A DCB with facets that are coarse for its bilinear bond."""

    crack: float = 20.0
    height: float = 1.5
    young: float = 200e3
    toughness: float = 0.28

    @property
    def beams(self):
        chi = crack_length_correction(self.young, self.young / 2.6)
        return CantileverBeams(self.height, 1.0, self.young / (1 - 0.09), chi)

    def run(self, *, pulled, comm=MPI.COMM_WORLD):
        """Size along the path, force, front and change of time of each step, and the mechanics."""
        size = dict(L=32, h=self.height, a0=self.crack, fine=6, back=2, lc=0.5, lc_arm=1.0, ny=2, growth=1.3)
        domain = read_geo(geometry("dcb"), comm, size, gdim=2)
        facets = [domain.facets("crack"), domain.facets("precrack")]
        state = State(cracked_space(domain.mesh, ("Lagrange", 2, (2,)), facets))
        contact, law = PenaltyContact(1e5), Bilinear(1e5, 57.0, self.toughness, 57.0, self.toughness)
        crack = Crack(
            state, facets[0], domain.cells("lower"), law, young=self.young, contact=contact, normal="reference"
        )
        terms = [Solid(state, LinearElastic(self.young, 0.3)), crack]
        supports = [Support(state, domain.facets("end"), i) for i in (0, 1)]
        for name, sign in (("upper", 1.0), ("lower", -1.0)):
            ends = domain.facets(f"load_{name}")
            if pulled:
                area = (0.0, sign / self.height)
                terms.append(Traction(state, ends, area, lambda t: 8 * t, name=name))
            else:
                supports.append(Support(state, ends, 1, lambda t, sign=sign: 0.5 * sign * t, name=name))
        mechanics, rows = Mechanics(state, terms, supports), []

        def record(report):
            force = report.columns["upper_force_y" if pulled else "upper_force"][0]
            rows.append((report.size, force, crack_front(crack), report.dt))

        control = StepControl(0.05, 0.1, line_searches=("basic", "l2", "bt"), path=PathFollowing(onset=0.5))
        run(mechanics, 3.0, control, record, lambda report: crack_front(crack) > self.crack + 4)
        return (*np.array(rows).T, mechanics)


@pytest.mark.parametrize("pulled", [False, True], ids=["by displacement", "by force"])
def test_a_coarse_bilinear_beam_is_followed_to_its_end(pulled):
    specimen = Specimen()
    size, force, front, dt, mechanics = specimen.run(pulled=pulled, comm=MPI.COMM_SELF)
    grown = front > specimen.crack + 1
    beam = [specimen.beams.propagation(specimen.toughness, a)[0] for a in front[grown]]
    assert grown.sum() > 3
    np.testing.assert_allclose(force[grown], beam, rtol=0.02)
    assert np.abs(mechanics.audit.worst_closure) < 5e-3
    assert (size > 0).any()
    assert (dt < 0).any() or not pulled


@pytest.mark.parametrize("case", [Case.composite, Case.rigid])
def test_stiff_bonds_in_a_composite_beam_are_followed_on_coarse_facets(case, tmp_path):
    """Facets of six times the length that resolves the process zone; the force is that of beams all the same."""
    size = 0.25
    rows, found = follow(build(case, size, comm=MPI.COMM_SELF), UNTIL[case], tmp_path, "beam")
    check(case, size, found | judge(case, size, rows))
    assert found["newton"] < 3 * found["steps"]


def test_the_measure_of_a_bonded_pair_is_its_dissipation_and_has_its_derivative():
    b, rng = two(2), np.random.default_rng(4)
    pair = b.pair(law=BONDS["bilinear"], contact=PenaltyContact(1.0), small_sliding=True, two_pass=True)
    b.move(lambda x: np.stack([0 * x[0], 0.1 + 0 * x[0]]), 1)
    pair.evaluate()
    b.state.commit()
    pair.begin()
    b.move(lambda x: np.stack([0 * x[0], 0.2 + 0 * x[0]]), 1)
    before = pair.energies()["fracture"]
    value, _ = pair.path_measure()
    pair.evaluate()
    assert value == pytest.approx(pair.energies()["fracture"] - before, rel=1e-8)
    u = b.state.u.x.array
    u[:] += 0.03 * rng.standard_normal(u.size)
    there, way = u.copy(), rng.standard_normal(u.size)
    value, slope = pair.path_measure()
    rest = []
    for h in (4e-3, 2e-3, 1e-3):
        u[:] = there + h * way
        rest.append(abs(pair.path_measure()[0] - value - h * slope @ way))
    assert np.log2(np.divide(rest[:-1], rest[1:])).min() > 1.9
