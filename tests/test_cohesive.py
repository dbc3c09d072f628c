"""Parameters and damage of the cohesive laws; what they do in a crack is in test_crack."""

from dataclasses import replace
from math import e, sqrt

import numpy as np
import pytest
import ufl
from conftest import BILINEAR, EXPONENTIAL, PPR

from cutsim.interface.cohesive import Bilinear, Exponential, process_zone_element

PAIRS = [
    {"strength": 2.0, "opening": 0.1},
    {"strength": 2.0, "toughness": 0.2 * e},
    {"opening": 0.1, "toughness": 0.2 * e},
    {"strength": 2.0, "opening": 0.1, "toughness": 0.2 * e},
]


@pytest.mark.parametrize("pair", PAIRS, ids=lambda p: "+".join(p))
def test_any_two_make_the_law(pair):
    law = Exponential.from_parameters(**pair)
    assert (law.t_n, law.eps_n) == (pytest.approx(2.0), pytest.approx(0.1))
    assert law.toughness == (pytest.approx(0.2 * e), pytest.approx(0.2 * e))
    assert law.t_t == pytest.approx(2.0)


def test_shear_has_its_own_parameters():
    law = Exponential.from_parameters(strength=2.0, opening=0.1, shear_strength=3.0, shear_toughness=0.5)
    assert law.eps_t == pytest.approx(0.5 / (3.0 * sqrt(e / 2)))
    assert law.toughness[1] == pytest.approx(0.5)


@pytest.mark.parametrize(("prefix", "factor"), [("", e), ("shear_", sqrt(e / 2))], ids=["opening", "sliding"])
def test_contradiction_names_all_three_and_the_implied_value(prefix, factor):
    """The sets printed in the thesis, e.g. 0.41 MPa, 0.0061 mm and 277.9 N/mm, contradict themselves."""
    triple = {f"{prefix}strength": 0.41, f"{prefix}opening": 0.0061, f"{prefix}toughness": 277.9}
    other = {} if not prefix else {"strength": 1.0, "opening": 1.0}
    with pytest.raises(ValueError, match=f"{prefix}strength = 0.41.*contradict") as error:
        Exponential.from_parameters(**triple, **other)
    for value in (0.41, 0.0061, 277.9, factor * 0.41 * 0.0061):
        assert f"{value:g}" in str(error.value)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"strength": 1.0}, "give two of strength, opening and toughness"),
        ({"strength": 1.0, "opening": -0.1}, "opening = -0.1 is not allowed"),
        ({"strength": 0.0, "opening": 0.1}, "strength = 0.0 is not allowed"),
        ({"strength": 1.0, "opening": 0.1, "shear_opening": 0.1}, "give two of shear_strength"),
    ],
)
def test_exponential_refuses(parameters, message):
    with pytest.raises(ValueError, match=message):
        Exponential.from_parameters(**parameters)


@pytest.mark.parametrize("name", ["penalty", "t_n", "G_I", "t_t", "G_II", "eta"])
def test_bilinear_refuses(name):
    good = {"penalty": 200.0, "t_n": 2.0, "G_I": 0.2, "t_t": 3.0, "G_II": 0.5, "eta": 1.7}
    with pytest.raises(ValueError, match=f"{name} = 0 is not allowed"):
        Bilinear(**{**good, name: 0})
    with pytest.raises(ValueError, match=r"penalty = 9.0 is not allowed.* = 10"):
        Bilinear(**{**good, "penalty": 9.0})


def damage(law, kappa):
    return [float(ufl.as_ufl(d)(())) for d in law.damage(ufl.as_ufl(kappa))]


def test_damage_starts_at_the_peak_and_ends_at_one():
    """D = 1 − T/t of each mode (thesis 4.26, 4.27), never falling."""
    law = EXPONENTIAL
    shear_peak = sqrt(law.toughness[1] / law.toughness[0]) * law.eps_t / sqrt(2)
    assert damage(law, 0.999 * law.eps_n)[0] == 0
    assert damage(law, 0.999 * shear_peak)[1] == 0
    assert damage(law, 3 * law.eps_n)[0] == pytest.approx(1 - 3 * np.exp(-2))
    for values in np.transpose([damage(law, k) for k in np.linspace(1e-6, 5, 200)]):
        assert values[0] == 0
        assert (np.diff(values) >= 0).all()
        assert values[-1] == pytest.approx(1)


def test_damage_of_the_bilinear_law_is_its_history():
    assert damage(BILINEAR, 0.4) == [0.4, 0.4]


def test_damage_of_the_law_of_park_paulino_and_roesler():
    """It starts at the peaks and is one from the final jumps on, 0.15 and 0.2 of which the peaks are at."""
    normal, tangential = PPR.final
    shear = sqrt(PPR.G_II / PPR.G_I) * tangential
    for mode, peak, final in ((0, 0.15 * normal, normal), (1, 0.2 * shear, shear)):
        assert damage(PPR, 0.999 * peak)[mode] == 0
        values = np.array([damage(PPR, k)[mode] for k in np.linspace(peak, 1.2 * final, 100)])
        assert (np.diff(values) >= 0).all() and values[0] == pytest.approx(0, abs=1e-12) and values[-1] == 1


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"t_n": 0.0}, "t_n = 0.0"),
        ({"beta": 1.0}, "beta = 1.0 is not allowed.*> 1"),
        ({"peak_n": 0.6}, r"peak_n = 0.6 is not allowed.*0\.577"),
    ],
)
def test_park_paulino_and_roesler_refuse(changed, message):
    with pytest.raises(ValueError, match=message):
        replace(PPR, **changed)


def test_initially_rigid_law():
    """T = t (1 − δ/δ_c) but for a rise over at most a hundredth of δ_c = 2 G/t."""
    law = Bilinear.rigid(2.0, 0.2, 3.0, 0.5)
    for delta in (0.01, 0.05, 0.15):
        kappa = law.demand(ufl.as_ufl(delta), ufl.as_ufl(0.0))
        traction = float(law.stiffness(delta, 0.0, float(kappa(())))[0]) * delta
        assert traction == pytest.approx(2.0 * (1 - delta / 0.2), rel=0.011)
    with pytest.raises(ValueError, match="rise = 1"):
        Bilinear.rigid(2.0, 0.2, 3.0, 0.5, rise=1)


def test_element_that_resolves_the_process_zone():
    """0.4 ε in soft solids, a twentieth of Irwin's length in stiff ones."""
    law = Exponential.from_parameters(strength=0.6, toughness=0.2)
    assert process_zone_element(law, young=0.777) == pytest.approx(0.4 * 0.2 / (e * 0.6))
    steel = Exponential.from_parameters(strength=57.0, toughness=0.28)
    assert process_zone_element(steel, young=200e3) == pytest.approx(0.05 * 200e3 * 0.28 / 57.0**2)
