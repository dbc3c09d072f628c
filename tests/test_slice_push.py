"""A blade that slices along its edge while it is pushed: what friction and energy say of the two forces."""

import pytest

from validation.cuts import MU, TOUGHNESS, steady_forces


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
