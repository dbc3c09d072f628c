"""A blade that slices along its edge while it is pushed: what friction and energy say of the two forces."""

import numpy as np
import pytest
from mpi4py import MPI

from cutsim import (
    Blade,
    Drive,
    Exponential,
    Fixture,
    Insertion,
    NeoHookean,
    StepControl,
    cracked_block,
    geometry,
    read_geo,
)
from cutsim.analysis.stepping import run

TOUGHNESS, WIDTH, HALF_ANGLE, MU = 0.1, 0.2, np.radians(20), 0.2


def steady_forces(ratio, friction):
    """Forces along push and slice, and friction work per push, over the width; walls hold the strip along the edge."""
    sizes = {"dim": 3, "Lx": 1.0, "H": 4.5, "lc": 0.2, "band": 0.3, "growth": 1.6, "notch": 0.5, "B": WIDTH, "nz": 1}
    domain = read_geo(geometry("block"), MPI.COMM_WORLD, sizes, gdim=3)
    body = cracked_block(
        domain, NeoHookean(0.777, 0.45), Exponential(strength=0.3, toughness=TOUGHNESS), viscosity=2e-4
    )
    blade = Blade(HALF_ANGLE, 0.2, 0.5, (0.0, -1.0, 0.0), (1.0, 0.0, 0.0))
    drive, held = Drive(1.0, 1.0, slice_push=ratio), Fixture(walls=("front", "back"))
    cut = Insertion.build(body, blade, drive, notch=0.5, friction=friction, fixture=held)
    rows = []

    def record(report):
        force = -sum(contact.force() for contact in cut.contacts)
        rubbed = report.columns["energy_friction"][0]
        rows.append((cut.depth, force @ cut.frame.push, force @ cut.frame.edge, rubbed))

    run(cut.mechanics, cut.time_of(2.8), StepControl(first=0.02, largest=0.1), record)
    depth, push, along, rubbed = np.array([row for row in rows if row[0] >= 1.7]).T
    way = depth[-1] - depth[0]
    return np.array([np.trapezoid(push, depth), np.trapezoid(along, depth), rubbed[-1] - rubbed[0]]) / (way * WIDTH)


def test_a_smooth_blade_gains_nothing_by_slicing():
    """Without friction no force acts along the edge, and F_push + ξ F_slice = G_c w leaves the push as it was."""
    push, along, rubbed = steady_forces(3.0, None)
    assert push == pytest.approx(TOUGHNESS, rel=0.04)
    assert abs(along) < 1e-9 and rubbed == 0


def test_friction_turns_to_the_edge():
    """The push falls as ξ grows, because friction acts against the slip, most of which is along the edge then."""
    plain, sliced = steady_forces(0.0, MU), steady_forces(3.0, MU)
    assert abs(plain[1]) < 1e-9 and sliced[0] < 0.8 * plain[0]
    # friction against the slip: ξ cos α along the edge to 1 along the flank, which turns by α from the push
    friction = sliced[0] - TOUGHNESS
    assert sliced[1] > 1.5 * friction > 0
    # what is left of the work of both forces is the toughness
    for ratio, (push, along, rubbed) in ((0.0, plain), (3.0, sliced)):
        assert push + ratio * along - rubbed == pytest.approx(TOUGHNESS, rel=0.1)
