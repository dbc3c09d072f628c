"""Built-in cases that are problems of the thesis: their numbers against closed forms."""

from math import e, exp, sqrt

import numpy as np
import pytest
from scipy.optimize import brentq

from validation.thesis import AREA, OPENING, STRENGTH, nominal_stress, printed, rows, torn

# -- two boxes --------------------------------------------------------------------------------------------------------

FEW = {"steps.first": "0.1", "steps.largest": "0.1", "mesh.set.n": "2"}


@pytest.mark.parametrize("m", [2, 3])
def test_boxes_drawn_apart_follow_the_law(m):
    """Force x e^(1−x) t A and spent work (1 − (1 + x + x²/2) e^(−x)) e t ε A belong to one opening x."""
    found = rows("boxes", **FEW, **{"mesh.set.m": str(m)})
    force = found["pull_force"][-1] / STRENGTH / AREA
    x = brentq(lambda x: x * exp(1 - x) - force, 1.5, 20.0)
    spent = (1 - (1 + x + x**2 / 2) * exp(-x)) * e * STRENGTH * OPENING * AREA
    assert 4.5 < x < 5.0
    assert found["energy_fracture"][-1] == pytest.approx(spent, rel=2e-3)


@pytest.mark.parametrize("m", [2, 3])
def test_boxes_sheared_off_rub_on_each_other(m):
    """Of the bond its whole work of separation √(e/2) t ε is spent; then the force is that of friction."""
    changes = {"parameters.open": "0", "parameters.slide": "1", "parameters.press": "1e-4", "mesh.set.m": str(m)}
    found = rows("boxes", **FEW, **changes)
    whole = sqrt(e / 2) * STRENGTH * OPENING * AREA
    assert found["energy_fracture"][-1] == pytest.approx(whole, rel=2e-3)
    assert found["push_force"][-1] == pytest.approx(-0.3 * found["pull_force"][-1], rel=2e-3)
    assert -found["pull_force"][-1] > 1000.0


# -- tear test --------------------------------------------------------------------------------------------------------


def test_a_bar_tears_at_its_strength():
    """At the stretch at which its nominal stress reaches it; all of the toughness is spent, the halves fly back."""
    found = torn(2000)
    stretch = brentq(lambda x: nominal_stress(x, 48.0) - 5.0, 1.5, 2.5)
    whole = found["crack_broken"] < 0.9 * 25  # before the halves swing
    peak = found["pull_force"][whole].argmax()
    assert found["pull_force"][peak] == pytest.approx(5.0 * 25, rel=0.02)
    opening = 28.3 / e / 5.0  # of the bond, where its traction is largest
    assert found["pull_displacement"][peak] == pytest.approx(20 * (stretch - 1) + opening / 2, rel=0.02)
    assert found["energy_fracture"][-1] == pytest.approx(28.3 * 25, rel=1e-3)
    assert abs(found["energy_closure"][whole]).max() < 2e-3
    assert found["energy_kinetic"].max() > 0.3 * found["energy_strain"].max(), "the halves fly back"


def test_a_bar_of_the_printed_solid_cannot_tear():
    """Its nominal stress goes through a maximum far below the printed strength of 200 MPa, and of the corrected one."""
    found = printed()
    largest = max(nominal_stress(stretch, 0.48) for stretch in np.linspace(1.05, 8.0, 140))
    assert 1.15 < largest < 1.18
    assert found["pull_force"].max() == pytest.approx(25 * largest, rel=0.02)
    assert found["pull_force"][-1] < 0.8 * found["pull_force"].max() and not found["crack_broken"].any()


# -- bond, friction and heat between elastic bodies -------------------------------------------------------------------


def test_a_block_is_sheared_off_and_slides_on():
    """The bond spends its work of separation, friction is that of Coulomb, and all of it is heat in the bodies."""
    found = rows("sheared-off", **{"steps.first": "0.2", "steps.largest": "0.2"})
    assert found["energy_fracture"][-1] == pytest.approx(0.2 * 10, rel=1e-3)
    assert found["drive_force"][-1] == pytest.approx(0.1 * found["press_force"][-1], rel=5e-3)
    assert found["drive_force"].max() == pytest.approx(0.18 * 10, rel=0.02), "the bond is loaded nearly evenly"
    assert found["energy_friction"][-1] > 0.3
    given = found["energy_fracture"] + found["energy_friction"]
    np.testing.assert_allclose(found["heat_stored"], given, rtol=1e-6, atol=1e-9)
    warmed = sum(0.1 * area * (found[f"{body}_temperature"] - 273.15) for body, area in (("block", 25), ("slab", 100)))
    np.testing.assert_allclose(warmed, given, rtol=1e-6, atol=1e-9)
    assert np.diff(found["total_entropy"]).min() > -1e-12
    np.testing.assert_allclose(found["total_energy"], found["work_external"], atol=0.01 * given[-1])


# -- double cantilever beam with rigid ends ---------------------------------------------------------------------------


def test_j_of_the_rigid_ends_is_that_of_the_opening():
    """2 F θ, from the ends alone, is the work of the bond up to the opening of the tip, by the law alone."""
    changes = {"parameters.opening": "0.036", "steps.first": "0.004", "steps.largest": "0.004", "mesh.set.lc": "0.5"}
    found = rows("dcb-force", **changes)
    assert found["crack_opening"][-1] > 2 * 0.001, "much of the bond at the tip is broken"
    assert found["J"][-1] == pytest.approx(found["J_of_opening"][-1], rel=0.03)
    assert found["G_compliance"][-1] < 0.9 * found["J"][-1], "beam theory knows no process zone"
