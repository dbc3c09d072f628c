"""Parameters, damage and losses of the cohesive laws; what they do in a crack is in test_crack."""

from dataclasses import replace
from math import e, sqrt

import numpy as np
import pytest

from cutsim.interface.cohesive import Bilinear, Exponential, process_zone_element
from cutsim.interface.damage import damage, spent, strength_loss
from cutsim.interface.dissipation import Way, losses
from helpers.examples import LAWS
from helpers.laws import BILINEAR, EXPONENTIAL, PPR, PROPORTIONAL, TRAPEZOIDAL

each = pytest.mark.parametrize("law", [bond.law for bond in LAWS.values()], ids=LAWS)

PAIRS = [
    {"strength": 2.0, "opening": 0.1},
    {"strength": 2.0, "toughness": 0.2 * e},
    {"opening": 0.1, "toughness": 0.2 * e},
    {"strength": 2.0, "opening": 0.1, "toughness": 0.2 * e},
]


@pytest.mark.parametrize("pair", PAIRS, ids=lambda p: "+".join(p))
def test_any_two_make_the_law(pair):
    law = Exponential(**pair)
    assert (law.strength, law.opening) == (pytest.approx(2.0), pytest.approx(0.1))
    assert (law.toughness, law.shear_toughness) == (pytest.approx(0.2 * e), pytest.approx(0.2 * e))
    assert law.shear_strength == pytest.approx(2.0)


def test_shear_has_its_own_parameters():
    law = Exponential(strength=2.0, opening=0.1, shear_strength=3.0, shear_toughness=0.5)
    assert law.shear_opening == pytest.approx(0.5 / (3.0 * sqrt(e / 2)))
    assert law.shear_toughness == pytest.approx(0.5)


@pytest.mark.parametrize(("prefix", "factor"), [("", e), ("shear_", sqrt(e / 2))], ids=["opening", "sliding"])
def test_contradiction_names_all_three_and_the_implied_value(prefix, factor):
    """The sets printed in the thesis, e.g. 0.41 MPa, 0.0061 mm and 277.9 N/mm, contradict themselves."""
    triple = {f"{prefix}strength": 0.41, f"{prefix}opening": 0.0061, f"{prefix}toughness": 277.9}
    other = {} if not prefix else {"strength": 1.0, "opening": 1.0}
    with pytest.raises(ValueError, match=f"{prefix}strength = 0.41.*contradict") as error:
        Exponential(**triple, **other)
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
        Exponential(**parameters)


@pytest.mark.parametrize("name", ["penalty", "strength", "toughness", "shear_strength", "shear_toughness", "eta"])
def test_bilinear_refuses(name):
    good = {
        "penalty": 200.0,
        "strength": 2.0,
        "toughness": 0.2,
        "shear_strength": 3.0,
        "shear_toughness": 0.5,
        "eta": 1.7,
    }
    with pytest.raises(ValueError, match=f"{name} = 0 is not allowed"):
        Bilinear(**{**good, name: 0})
    with pytest.raises(ValueError, match=r"penalty = 9.0 is not allowed.* = 10"):
        Bilinear(**{**good, "penalty": 9.0})


def test_another_stiffness_in_sliding():
    """Each mode by itself rises with its own stiffness to its own strength, and both in proportion if so chosen."""
    law = replace(BILINEAR, shear_penalty=77.0)
    for mode, (stiffness, strength, toughness) in enumerate(((200.0, 2.0, 0.2), (77.0, 3.0, 0.5))):
        peak, end = strength / stiffness, 2 * toughness / strength
        jumps = np.array([0.5 * peak, peak, 0.5 * (peak + end), end, 2 * end])
        opening, sliding = (jumps, 0 * jumps) if mode == 0 else (0 * jumps, jumps)
        traction = law.secants(opening, sliding)[mode] * jumps
        np.testing.assert_allclose(traction, strength * np.array([0.5, 1, 0.5, 0, 0]), atol=1e-9)
    assert PROPORTIONAL.shear_penalty == pytest.approx(200.0 * (0.2 / 0.5) * (3.0 / 2.0) ** 2)
    scale = np.sqrt(200.0 / PROPORTIONAL.shear_penalty)
    for mix in (
        0.0,
        0.3,
        0.8,
        1.0,
    ):  # of the work, along straight ways: damage begins at the same part of the toughness
        toughness = 0.2 + 0.3 * mix**1.7
        way = np.linspace(0, 1, 100_001) * 2 * 0.6
        D = damaged(PROPORTIONAL, way * sqrt(1 - mix), way * sqrt(mix) * scale)[0]
        onset = way[np.argmax(D > 1e-9)]
        assert 0.5 * 200.0 * onset**2 == pytest.approx(toughness * 2.0**2 / (2 * 200.0 * 0.2), rel=1e-2)
    with pytest.raises(ValueError, match=r"shear_penalty = 9.0 .* shear_strength²/\(2 shear_toughness\) = 9"):
        replace(BILINEAR, shear_penalty=9.0)


@pytest.mark.parametrize("strength", [1.0, 3.0, 6.0])
@pytest.mark.parametrize("mix", [0.0, 0.2, 0.5, 0.9, 1.0])
@pytest.mark.parametrize("make", [Bilinear, Bilinear.proportional], ids=["one stiffness", "in proportion"])
def test_toughness_at_a_mode_ratio_is_that_of_benzeggagh_and_kenane_whatever_the_strengths(make, mix, strength):
    law = make(400.0, 2.0, 0.2, strength, 0.5, 1.7)
    stiffer = (law.shear_penalty or law.penalty) / law.penalty
    end = np.array([sqrt(1 - mix), sqrt(mix / stiffer)])
    assert lost_in(law, np.array([[0.0, 0.0], 50 * end]))[0] == pytest.approx(0.2 + 0.3 * mix**1.7, rel=1e-7)


def test_work_of_a_way_that_changes_its_mode_and_the_strengths():
    """Opened to half the toughness, then slid: in proportion the work is the same for any shear strength."""
    way = np.array([[0.0, 0.0], [0.1, 0.0], [0.1, 2.0]])
    works = {
        make: [lost_in(make(4000.0, 2.0, 0.2, t_t, 0.5, 1.7), way).sum() for t_t in (1.0, 2.0, 6.0)]
        for make in (Bilinear, Bilinear.proportional)
    }
    assert np.ptp(works[Bilinear.proportional]) < 1e-7 * works[Bilinear.proportional][0]
    assert 0.2 < works[Bilinear.proportional][0] < 0.5
    assert max(works[Bilinear]) > 0.5 > 0.2 > min(works[Bilinear]), "with one stiffness not even between both modes"


def damaged(law, opening, sliding):
    return damage(law, *law.secants(np.asarray(opening, dtype=float), np.asarray(sliding, dtype=float)))


# δ/ε; opening: damage (4.26), loss of strength, fraction of φ_n dissipated; sliding: damage (4.27), loss of strength.
# Computed apart from this program, by the closed forms 1 − e^{1−x}, 1 − x e^{1−x}, 1 − (1 + x + x²/2) e^{−x},
# 1 − e^{1−y²} and 1 − √2 y e^{1/2−y²}
MEASURES = np.array(
    [
        (0.25, 0, 0, 0.0021615, 0, 0),
        (0.75, 0, 0, 0.0405054, 0, 0.00360198),
        (1, 0, 0, 0.0803014, 0, 0.142236),
        (1.25, 0.221199, 0.026499, 0.131532, 0.430217, 0.389076),
        (1.5, 0.393469, 0.090204, 0.191153, 0.713495, 0.63137),
        (2, 0.632121, 0.264241, 0.323324, 0.950213, 0.914589),
        (3, 0.864665, 0.593994, 0.57681, 0.999665, 0.999137),
        (5, 0.981684, 0.908422, 0.875348, 1, 1),
        (8, 0.999088, 0.992705, 0.986246, 1, 1),
    ]
)


def test_three_measures_of_the_exponential_law():
    """Damage, loss of strength and work spent of the pure modes, against tabulated values."""
    law, (x, *opening), sliding = EXPONENTIAL, MEASURES[:, :4].T, MEASURES[:, 4:].T
    secants = np.column_stack([law.secants(x * law.opening, 0 * x)[0], law.secants(0 * x, x * law.shear_opening)[1]])
    D = damage(law, *secants.T)
    lost, work = strength_loss(law, secants), spent(law, secants)
    for found, expected in zip((D[0], lost[:, 0], work[:, 0], D[1], lost[:, 1]), (*opening, *sliding), strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-6)


def test_three_measures_of_linear_softening():
    """Bilinear: damage d; 1 − T/t falls with the jump; lost at d is the triangle between onset, peak and jump."""
    law, d = BILINEAR, np.array([0.0, 0.4, 0.9, 1.0])
    for mode, (K, t, phi) in enumerate(((200.0, 2.0, 0.2), (200.0, 3.0, 0.5))):
        first, final = t / K, 2 * phi / t
        jump = first * final / (final - d * (final - first))
        secants = np.column_stack([(1 - d) * K, (1 - d) * K])
        np.testing.assert_allclose(damage(law, *secants.T)[mode], d, atol=1e-14)
        np.testing.assert_allclose(strength_loss(law, secants)[:, mode], (jump - first) / (final - first), atol=1e-9)
        lost = 0.5 * t * (jump - first) * (final / (final - first))
        np.testing.assert_allclose(spent(law, secants)[:, mode], lost / phi, atol=1e-9)


@each
def test_measures_never_fall_and_keep_their_order(law):
    """From 0 to 1; what has lost stiffness since the characteristic opening may still be as strong as ever."""
    jumps = np.geomspace(1e-3, 1e3, 200) * law.opening
    secants = np.transpose(law.secants(jumps, 2 * jumps))
    for measure in (np.transpose(damage(law, *secants.T)), strength_loss(law, secants), spent(law, secants)):
        assert (np.diff(measure, axis=0) >= -1e-9).all()
        np.testing.assert_allclose(measure[[0, -1]], [[0, 0], [1, 1]], atol=1e-5)


@each
def test_secants_fall_and_damage_grows(law):
    """In both jumps; from zero where the bond is intact to one where nothing is left of it."""
    jumps = np.linspace(0, 1, 201) * 60 * law.opening
    opening, sliding = np.meshgrid(jumps, 2 * jumps, indexing="ij")
    for secant, D in zip(law.secants(opening, sliding), damaged(law, opening, sliding), strict=True):
        assert (np.diff(secant, axis=0) <= 1e-12 * secant[0, 0]).all()
        assert (np.diff(secant, axis=1) <= 1e-12 * secant[0, 0]).all()
        assert (secant >= 0).all() and D[0, 0] == pytest.approx(0, abs=1e-12) and D.min() >= -1e-12
        assert D[-1, 0] == pytest.approx(1) and D[0, -1] == pytest.approx(1)


@each
def test_the_strength_is_the_largest_traction(law):
    opening = np.linspace(0, 8, 80_001) * law.opening
    traction = law.secants(opening, 0 * opening)[0] * opening
    assert traction.max() == pytest.approx(law.strength, rel=1e-3)


def memory_along(law, jumps):
    """Smallest secants after each of some jumps (opening, slide, …)."""
    secants = np.transpose(law.secants(np.maximum(jumps[:, 0], 0.0), np.linalg.norm(jumps[:, 1:], axis=1)))
    return np.minimum.accumulate(secants, axis=0)


def lost_in(law, jumps):
    """What is lost in each leg of a path of jumps, one step a leg."""
    return losses(law, Way(jumps[:-1], jumps[1:]), memory_along(law, jumps)[:-1])


def divided(jumps, n):
    """The same path in n parts a leg."""
    legs = np.arange(len(jumps))
    places = np.linspace(0, legs[-1], n * legs[-1] + 1)
    return np.column_stack([np.interp(places, legs, component) for component in jumps.T])


def stored(law, jumps):
    """Energy that the bond holds at the end of a path."""
    return 0.5 * memory_along(law, jumps)[-1] @ (max(jumps[-1, 0], 0.0) ** 2, jumps[-1, 1:] @ jumps[-1, 1:])


@each
@pytest.mark.parametrize("mode", [0, 1], ids=["opening", "sliding"])
@pytest.mark.parametrize("size", [540.0, 1e5])
def test_a_jump_of_any_size_spends_the_toughness(law, mode, size):
    end = size * law.opening * np.eye(2)[mode]
    toughness = (law.toughness, law.shear_toughness)[mode]
    assert lost_in(law, np.array([[0.0, 0.0], end]))[0] == pytest.approx(toughness, rel=1e-9)


def test_no_kink_is_missed_wherever_it_lies_in_a_step():
    """The loss in one step is work less what is stored, T = t up to δ_2: a kink near an end of a part must be seen."""
    law = TRAPEZOIDAL
    jump = law.opening * 10 ** np.random.default_rng(0).uniform(0, 3, 20_000)
    end, held = np.zeros((len(jump), 2)), np.clip(jump, law.rise, law.plateau) - law.rise
    end[:, 0] = jump
    left = (law.final - np.clip(jump, law.plateau, law.final)) / (law.final - law.plateau)
    fallen = 0.5 * (law.final - law.plateau) * (1 - left**2)
    work = law.strength * (0.5 * law.rise + held + fallen)
    stored = 0.5 * law.secants(jump, 0 * jump)[0] * jump**2
    memory = np.full((len(jump), 2), law.strength / law.rise)
    lost = losses(law, Way(0 * end, end), memory)
    np.testing.assert_allclose(lost, work - stored, atol=1e-7 * law.toughness)


@each
@pytest.mark.parametrize("seed", range(6))
def test_no_path_gives_energy_back(law, seed):
    """24 random legs: no leg gains, a step a leg is as good as 40, and work = stored + lost."""
    rng = np.random.default_rng(seed)
    legs = np.vstack([np.zeros(3), rng.uniform(-0.5, 3, (24, 3)) * law.opening * (1, 2, 2)])
    lost = lost_in(law, legs)
    assert (lost >= 0).all()
    assert lost_in(law, divided(legs, 40)).sum() == pytest.approx(lost.sum(), rel=1e-8)
    # the work from the tractions alone, by the trapezoidal rule on a much finer path
    finer = divided(legs, 4000)
    traction = memory_along(law, finer)[:, [0, 1, 1]] * np.column_stack([np.maximum(finer[:, 0], 0), finer[:, 1:]])
    power = np.einsum("ni,ni->n", 0.5 * (traction[1:] + traction[:-1]), np.diff(finer, axis=0))
    assert power.sum() == pytest.approx(lost.sum() + stored(law, legs), rel=2e-5)


@each
def test_a_closed_cycle_below_the_history_costs_nothing(law):
    """Open, close, and then shear, open, unshear, close, again and again, in either sense."""
    n, t = law.opening, 1.19 * law.opening
    corners = np.array([[0, 0], [0, t], [1.6 * n, t], [1.6 * n, 0]])
    for cycle in (corners, corners[::-1]):
        path = np.vstack([[[0, 0], [2 * n, 0]], np.tile(cycle, (4, 1)), [[0, 0]]])
        lost = lost_in(law, path)
        assert lost[:6].sum() > 0
        assert lost[6:].sum() < 1e-12 * law.toughness


@pytest.mark.parametrize(
    ("corner", "end", "total"),
    [((3, 0), (3, 9), 1.13940379), ((0, 3), (60, 3), 1.69991361), ((0, 0.5), (60, 0.5), 1.15483945)],
    ids=["open, then slide", "slide, then open", "slide a little, then open"],
)
def test_work_of_mixed_paths(corner, end, total):
    """Known for φ_t = 1.7 φ_n."""
    law = Exponential(toughness=1.0, opening=0.1, shear_toughness=1.7, shear_opening=0.2)
    path = np.array([(0, 0), corner, end]) * (law.opening, law.shear_opening)
    assert lost_in(law, path).sum() + stored(law, path) == pytest.approx(total, abs=2e-8)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"strength": 0.0}, "strength = 0.0"),
        ({"beta": 1.0}, "beta = 1.0 is not allowed.*> 1"),
        ({"peak": 0.5}, r"peak = 0.5 is not allowed.*0\.447"),
    ],
)
def test_park_paulino_and_roesler_refuse(changed, message):
    with pytest.raises(ValueError, match=message):
        replace(PPR, **changed)


def test_initially_rigid_law():
    """T = t (1 − δ/δ_c) but for a rise over at most a hundredth of δ_c = 2 G/t."""
    law = Bilinear.rigid(2.0, 0.2, 3.0, 0.5)
    for delta in (0.01, 0.05, 0.15):
        traction = float(law.secants(delta, 0.0)[0]) * delta
        assert traction == pytest.approx(2.0 * (1 - delta / 0.2), rel=0.011)
    with pytest.raises(ValueError, match="rise = 1"):
        Bilinear.rigid(2.0, 0.2, 3.0, 0.5, rise=1)


def test_element_that_resolves_the_process_zone():
    """0.4 ε in soft solids, a twentieth of Irwin's length in stiff ones."""
    law = Exponential(strength=0.6, toughness=0.2)
    assert process_zone_element(law, young=0.777) == pytest.approx(0.4 * 0.2 / (e * 0.6))
    steel = Exponential(strength=57.0, toughness=0.28)
    assert process_zone_element(steel, young=200e3) == pytest.approx(0.05 * 200e3 * 0.28 / 57.0**2)
