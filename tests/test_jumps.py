"""Runs that jump are carried by a brake, and line searches keep elements from turning inside out."""

import numpy as np
import pytest
from mpi4py import MPI
from scipy.integrate import quad
from scipy.optimize import brentq, minimize_scalar

from cutsim import LinearElastic, Mechanics, NeoHookean, PathFollowing, StepError, Support
from cutsim.analysis.steps import begin
from helpers.bars import BONDS, SOFT, WIDTH, Bar, narrow, traction

LAW = BONDS["exponential"]
NEVER = PathFollowing(facets=0)
# a step that jumps misses more than this of the energy
CLOSURE = 5e-3


def end(opening):
    """Displacement of the end of the bar at an opening."""
    return traction(LAW, opening) / SOFT + opening


@pytest.fixture
def jump():
    """Displacement at which equilibrium ends, and the openings before and after."""
    top = minimize_scalar(lambda d: -end(d), bounds=(0.05, 0.4), method="bounded")
    return -top.fun, top.x, brentq(lambda d: end(d) + top.fun, top.x + 0.05, 2.0)


def set_free(time, before, after):
    """Energy of bar and bond that is lost between two openings while the end stands."""
    energies = [0.5 * SOFT * (time - d) ** 2 + quad(lambda x: traction(LAW, x), 0, d)[0] for d in (before, after)]
    return WIDTH * (energies[0] - energies[1])


@pytest.mark.mpi
def test_a_brake_takes_what_a_jump_sets_free(jump):
    """Without path following the bar snaps: equilibria before and after, and the difference is accounted for."""
    time, before, after = jump
    bar = Bar.build(LAW)
    until = 1.2 * time
    times, opening, T, reports = bar.run(until, NEVER, closure=CLOSURE)
    audit = bar.mechanics.audit
    assert before < 0.5 * after
    free = bar.state.pace.committed.drag == 0
    assert free and times[-1] == until
    assert T[-1] / SOFT + opening[-1] == pytest.approx(until, abs=1e-6)
    assert audit.entries["braked"] == pytest.approx(set_free(time, before, after), rel=0.03)
    assert abs(audit.closure) < 1e-2
    lost = [r.columns["energy_braked"][0] for r in reports]
    assert np.all(np.diff(lost) >= 0)
    assert lost[np.searchsorted(times, 0.9 * time)] == 0
    # the end hardly moves in the meantime, and the run goes on in long steps
    braked = times[np.diff(lost, prepend=0) > 0]
    assert np.ptp(braked) < 0.2 * time
    assert len(times) < 120


def test_under_a_given_load_there_is_no_brake():
    """It would slow the fall of the bar, but not stop it."""
    bar = Bar.build(LAW, pulled=True)
    assert bar.mechanics.brake is None
    with pytest.raises(StepError, match=r"no step from time (0\.99\d*|1) of"):
        bar.run(2.0, NEVER, closure=CLOSURE)


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
