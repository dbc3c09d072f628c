"""Parameters and damage of the cohesive laws; what they do in a crack is in test_crack."""

from math import e, sqrt

import numpy as np
import pytest
import ufl
from conftest import BILINEAR, EXPONENTIAL

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


def test_element_that_resolves_the_process_zone():
    """0.4 ε in soft solids, a twentieth of Irwin's length in stiff ones."""
    law = Exponential.from_parameters(strength=0.6, toughness=0.2)
    assert process_zone_element(law, young=0.777) == pytest.approx(0.4 * 0.2 / (e * 0.6))
    steel = Exponential.from_parameters(strength=57.0, toughness=0.28)
    assert process_zone_element(steel, young=200e3) == pytest.approx(0.05 * 200e3 * 0.28 / 57.0**2)
