"""Runs that jump are carried by a brake or by inertia, and line searches keep elements from turning inside out."""

import numpy as np
import pytest
from dolfinx import fem, mesh
from mpi4py import MPI
from scipy.integrate import quad
from scipy.optimize import brentq, minimize_scalar

from cutsim import (
    Attachment,
    Checkpoints,
    LinearElastic,
    Mechanics,
    NeoHookean,
    PathFollowing,
    PenaltyContact,
    Plane,
    RigidLink,
    Solid,
    State,
    StepError,
    Support,
    Surface,
    ToolContact,
    ToolPath,
)
from cutsim.analysis.steps import begin
from cutsim.bodies.mass import Mass
from helpers.bars import BONDS, SOFT, WIDTH, Bar, narrow, traction

LAW = BONDS["exponential"]
NEVER = PathFollowing(facets=0)
# a step that jumps misses more than this of the energy
CLOSURE = 5e-3
# of a bar whose waves cross it in a fifth of a step
DENSITY = 1e-4
# what carries the bar, and what it takes from the body besides friction and fracture
CARRIERS = [("brake", "braked"), ("dynamics", "damped")]


def end(opening):
    """Displacement of the end of the bar at an opening."""
    return traction(LAW, opening) / SOFT + opening


@pytest.fixture
def jump():
    """Displacement at which equilibrium ends, and the openings before and after."""
    top = minimize_scalar(lambda d: -end(d), bounds=(0.05, 0.4), method="bounded")
    return -top.fun, top.x, brentq(lambda d: end(d) + top.fun, top.x + 0.05, 2.0)


def bond_energy(opening):
    """Work of the bond over its area on the way to an opening."""
    return quad(lambda x: traction(LAW, x), 0, opening)[0]


def set_free(time, before, after):
    """Energy of bar and bond that is lost between two openings while the end stands."""
    energies = [0.5 * SOFT * (time - d) ** 2 + bond_energy(d) for d in (before, after)]
    return WIDTH * (energies[0] - energies[1])


def columns(reports, name):
    return np.array([report.columns[name][0] for report in reports])


@pytest.mark.mpi
@pytest.mark.parametrize(("carrier", "entry"), CARRIERS)
def test_what_a_jump_sets_free_is_taken(jump, carrier, entry):
    """Without path following the bar snaps: equilibria before and after, and the difference is accounted for."""
    time, before, after = jump
    bar = Bar.build(LAW, density=DENSITY)
    until = 1.2 * time
    times, opening, T, reports = bar.run(until, NEVER, closure=CLOSURE, jumps=(carrier,))
    audit = bar.mechanics.audit
    assert before < 0.5 * after
    assert not bar.state.pace.committed.carrier and times[-1] == until
    assert T[-1] / SOFT + opening[-1] == pytest.approx(until, abs=1e-6)
    assert audit.entries[entry] == pytest.approx(set_free(time, before, after), rel=0.03)
    assert abs(audit.closure) < 1e-2
    lost, kinetic = columns(reports, f"energy_{entry}"), columns(reports, "energy_kinetic")
    carried = (np.diff(lost, prepend=0) != 0) | (kinetic > 0)
    assert not carried[: np.searchsorted(times, 0.9 * time)].any()
    if carrier == "brake":
        assert np.all(np.diff(lost) >= 0) and not kinetic.any()
    else:
        # in the middle it is a good part of what was set free, in the end nothing
        assert 0.1 * lost[-1] < kinetic.max() < lost[-1] and kinetic[-1] == 0
    # the end hardly moves in the meantime, and the run goes on in long steps
    assert np.ptp(times[carried]) < 0.2 * time
    assert len(times) < 120
    assert "motion" not in bar.state.verdict.doubts
    if MPI.COMM_WORLD.size > 1:
        alone = Bar.build(LAW, density=DENSITY, comm=MPI.COMM_SELF)
        again, *_, reports = alone.run(until, NEVER, closure=CLOSURE, jumps=(carrier,))
        assert again == pytest.approx(times, rel=1e-9)
        assert columns(reports, f"energy_{entry}") == pytest.approx(lost, rel=1e-6, abs=1e-9)


def test_no_step_of_a_jump_misses_more_than_a_tenth_of_what_it_sets_free(jump):
    """However lax the limit of the run is, which counts beside all that is turned over."""
    bar = Bar.build(LAW, density=DENSITY)
    *_, reports = bar.run(1.2 * jump[0], NEVER, closure=0.2, jumps=("dynamics",))
    damped = columns(reports, "energy_damped")
    assert damped[-1] == pytest.approx(set_free(*jump), rel=0.1)
    entries = ("strain", "kinetic", "cohesive_stored", "contact", "fracture", "damped")
    gap = columns(reports, "work_external") - sum(columns(reports, f"energy_{entry}") for entry in entries)
    freed = columns(reports, "energy_kinetic") + columns(reports, "energy_fracture") + damped
    in_jump = np.diff(damped) > 0
    assert in_jump.sum() > 5
    assert np.all(np.abs(np.diff(gap))[in_jump] <= 0.1 * np.abs(np.diff(freed))[in_jump] + 1e-5)


@pytest.mark.parametrize(("carrier", "entry"), CARRIERS)
def test_a_run_goes_on_from_the_middle_of_a_jump(jump, carrier, entry, tmp_path):
    """As if it had not been interrupted."""
    until = 1.1 * jump[0]

    def go(bar, stop=lambda _: False):
        times, *_, reports = bar.run(until, NEVER, stop, closure=CLOSURE, jumps=(carrier,))
        return times, columns(reports, f"energy_{entry}"), columns(reports, "energy_kinetic")

    whole = go(Bar.build(LAW, density=DENSITY))
    middle = 0.5 * whole[1][-1]
    bar = Bar.build(LAW, density=DENSITY)
    parts = go(bar, lambda report: report.columns[f"energy_{entry}"][0] > middle)
    assert bar.state.pace.committed.carrier == carrier
    Checkpoints(tmp_path, bar.mechanics).save()
    bar = Bar.build(LAW, density=DENSITY)
    Checkpoints(tmp_path, bar.mechanics).resume()
    rest = go(bar)
    for before, after, expected in zip(parts, rest, whole, strict=True):
        # what was factorised is not in a checkpoint
        assert np.concatenate([before, after]) == pytest.approx(expected, rel=1e-9, abs=1e-12)


def test_where_one_carrier_fails_the_next_one_acts(jump):
    """From where the first one has failed."""
    time, before, after = jump
    bar = Bar.build(LAW, density=DENSITY)
    brake, dynamics = bar.mechanics.carriers
    brake.hold = lambda: None
    bar.run(1.2 * time, NEVER, closure=CLOSURE)
    entries = bar.mechanics.audit.entries
    assert entries["braked"] == 0
    assert entries["damped"] == pytest.approx(set_free(time, before, after), rel=0.03)
    assert dynamics.rests()


def test_under_a_given_load_nothing_carries_a_bar_without_a_density():
    """A brake would slow its fall, but not stop it."""
    bar = Bar.build(LAW, pulled=True)
    why = (
        r"no step from time (0\.99\d*|1) of.*No brake .* given load\. No dynamics .* no density of body is given.*limit"
    )
    with pytest.raises(StepError, match=why):
        bar.run(2.0, NEVER, closure=CLOSURE)


GAP, STOP = 1.5, 50.0


def stop(b):
    """A plane beyond the end of the bar, of stiffness STOP."""
    path, top = ToolPath(lambda t: (0.0, 1.0 + GAP)), Surface.exterior(b.state, b.face(1, 1.0))
    return ToolContact(b.state, Plane((0.0, -1.0)), path, [top], contact=PenaltyContact(STOP), name="stop")


def test_what_a_given_load_tears_off_flies_to_a_stop():
    """The traction t tears the bar at t = 1; it comes to rest where the stop bears the load, and so it stays."""
    bar = Bar.build(LAW, pulled=True, density=DENSITY, terms=[stop])
    times, opening, _, reports = bar.run(1.5, NEVER, closure=CLOSURE)
    assert not bar.state.pace.committed.carrier and times[-1] == 1.5
    assert opening[-1] == pytest.approx(GAP + 1.5 / STOP, rel=1e-6)
    # before: a bar under the traction 1, its bond at its strength; after: bond broken, and the stop pressed by 1
    way = GAP + 1 / STOP - (1 / SOFT + LAW.opening)
    held = 0.5 / SOFT + bond_energy(LAW.opening), LAW.toughness + 0.5 / STOP
    free = WIDTH * (way + held[0] - held[1])
    assert columns(reports, "energy_damped")[-1] == pytest.approx(free, rel=0.02)
    assert columns(reports, "energy_kinetic").max() > 0.3 * free
    audit = bar.mechanics.audit
    assert audit.entries["fracture"] == pytest.approx(WIDTH * LAW.toughness, rel=1e-6)
    assert audit.worst_closure < 0.01


def test_what_nothing_stops_flies_on():
    """By Newton's second law: the momentum grows by what the load does in time; and the verdict says that it moves."""
    bar = Bar.build(LAW, pulled=True, density=DENSITY)
    far = 5.0
    times, _, _, reports = bar.run(
        2.0, NEVER, lambda r: columns([r], "energy_kinetic")[0] > far, step=0.01, closure=CLOSURE
    )
    mass = DENSITY * 0.5 * WIDTH
    momentum = np.sqrt(2 * mass * columns(reports, "energy_kinetic"))
    assert bar.state.pace.committed.carrier == "dynamics"
    impulse = WIDTH * times[1:] * np.diff(times)
    assert np.diff(momentum)[-4:] == pytest.approx(impulse[-4:], rel=1e-3)
    assert "come to rest" in bar.state.verdict.doubts["motion"]


@pytest.mark.mpi
@pytest.mark.parametrize("cell", ["triangle", "quadrilateral"])
def test_lumped_mass_of_any_element(cell):
    """Its total is that of the body, and every node has some, also with quadratic triangles."""
    domain = mesh.create_rectangle(MPI.COMM_WORLD, [(0.0, 0.0), (2.0, 1.0)], [4, 3], mesh.CellType[cell])
    state = State(fem.functionspace(domain, ("Lagrange", 2, (2,))))
    mass = Mass(state, [Solid(state, LinearElastic(1.0, 0.3), density=3.0)], "consistent").lumped()
    assert state.mesh.comm.allreduce(mass.reshape(-1, 2).sum(axis=0)) == pytest.approx([6.0, 6.0])
    assert mass.min(initial=1.0) > 0


@pytest.mark.mpi
@pytest.mark.parametrize("carrier", [0, 1])
@pytest.mark.parametrize("linked", [False, True])
def test_tangent_of_a_step_across_a_jump(carrier, linked):
    """A linear body is solved in one iteration, also where it is held in oblique directions or by a rigid link."""
    domain = mesh.create_unit_square(MPI.COMM_WORLD, 4, 4, mesh.CellType.quadrilateral)
    state = State(fem.functionspace(domain, ("Lagrange", 1, (2,))))
    sides = [mesh.locate_entities_boundary(domain, 1, lambda x, y=y: np.isclose(x[1], y)) for y in (0, 1)]
    terms, held = [Solid(state, LinearElastic(1.0, 0.3), density=2.0)], [Support(state, sides[0], (1.0, 0.4))]
    if linked:
        motion = {"y": lambda t: 0.1 * t, "rz": 0.0}
        terms.append(RigidLink(state, [Attachment(sides[1], "xy")], (0.5, 1.0), motion=motion))
    else:
        held.append(Support(state, sides[1], 1, lambda t: 0.1 * t))
    mechanics = Mechanics(state, terms, held)
    acting = mechanics.carriers[carrier]
    mechanics.start(1.0)
    dt = acting.start(0.1, 1.0)
    begin(mechanics, dt)
    acting.hold()
    outcome = mechanics.solve("basic")
    assert outcome.converged and outcome.iterations == 1
    mechanics.evaluate()
    assert abs(mechanics.trial_audit.closure) < 1e-8


@pytest.mark.parametrize("material", [NeoHookean(1.0, 0.48), LinearElastic(1.0, 0.48)], ids=["finite", "small"])
def test_an_element_that_is_inside_out_is_no_iterate(material):
    """Its middle, where the volume change is taken, looks whole; small strains know no inside."""
    blocks = narrow(MPI.COMM_WORLD)
    state, solid, crack = blocks.state, blocks.solid(material), blocks.crack(LAW, young=1.0)
    held = [Support(state, blocks.face(1, end), axis, name=f"{end}{axis}") for end in (0.0, 1.0) for axis in (0, 1)]
    mechanics = Mechanics(state, [solid, crack], held)
    begin(mechanics, 1.0)
    state.u.interpolate(lambda x: (0.09 * (2 * x[0] / WIDTH - 1) * (-1) ** np.round(4 * x[1]), 0 * x[1]))
    small = isinstance(material, LinearElastic)
    assert solid.possible() == small and solid.smallest_jacobian() < 0
    outcome = mechanics.solve("bt")
    assert outcome.converged == small
    assert small or (outcome.iterations == 0 and "not finite" in outcome.message)


def test_what_a_jump_sets_free_is_no_fault_of_a_viscosity(jump):
    """It takes a part, and the brake the rest."""
    time, before, after = jump
    bar = Bar.build(LAW, viscosity=1e-4)
    bar.run(1.2 * time, NEVER, closure=CLOSURE)
    audit = bar.mechanics.audit
    taken = audit.entries["viscous"] + audit.entries["braked"]
    assert taken == pytest.approx(set_free(time, before, after), rel=0.05)
    assert audit.entries["viscous"] > 0.1 * audit.scale
    assert "viscosity" not in bar.state.verdict.doubts
