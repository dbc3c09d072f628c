"""Viscous regularisation of a bond: tractions and work in closed form, tangent, frames, pairs, a snap-back."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.stepping import StepControl
from cutsim.bodies.loads import Support
from cutsim.bodies.solid import Solid
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.viscous import ViscousBond
from cutsim.materials.elastic import LinearElastic
from helpers.blocks import drag, make_blocks, separated
from helpers.boxes import two
from helpers.fields import rotation
from helpers.laws import ELASTIC, EXPONENTIAL
from helpers.runs import history
from helpers.tangents import assert_slope_two

ETA = 3.0
VISCOUS = ViscousBond(EXPONENTIAL, ETA)
SPEED = 0.4  # of the jump in its mode, in a path of unit time


def works(law, mode, end):
    """Envelope φ(x) and viscous work over speed of a monotone jump in a pure mode, from the printed formulas."""
    scale = (law.opening, law.shear_opening)[mode]
    x = end / scale
    if mode == 0:
        envelope = law.toughness * (1 - (1 + x) * np.exp(-x))
        whole = 1 + 1 - np.exp(1 - x)
    else:
        envelope = law.shear_toughness * (1 - np.exp(-(x**2)))
        whole = 1 + quad(lambda y: np.exp(1 - y**2), 1, x)[0]
    return envelope, ETA * scale * whole


@pytest.mark.parametrize(("mode", "jump"), [(0, (0.0, 0.4)), (1, (0.4, 0.0))], ids=["opening", "sliding"])
def test_traction_and_work_at_a_constant_rate(mode, jump):
    """T = T_law + η (1 − D) v, and ∫ η (1 − D) v dδ has its own entry, which closes the audit."""
    rows, _ = drag(VISCOUS, np.array([(0, 0), jump]), steps=400)
    law, axis = EXPONENTIAL, "yx"[mode]
    delta = rows[f"upper_{axis}_displacement"]
    if mode == 0:
        x = delta / law.opening
        envelope, left = law.strength * x * np.exp(1 - x), np.minimum(1, np.exp(1 - x))
    else:
        y = delta / law.shear_opening
        envelope = np.sqrt(2 * np.e) * law.shear_strength * y * np.exp(-(y**2))
        left = np.minimum(1, np.exp(1 - y**2))
    np.testing.assert_allclose(rows[f"upper_{axis}_force"], envelope + ETA * SPEED * left, atol=1e-6 * law.strength)
    slow, fast = works(law, mode, 0.4)
    assert rows["energy_cohesive_viscous"][-1] == pytest.approx(SPEED * fast, rel=2e-3)
    assert rows["energy_fracture"][-1] + rows["energy_cohesive_stored"][-1] == pytest.approx(slow, rel=1e-9)
    assert rows["work_external"][-1] == pytest.approx(slow + SPEED * fast, rel=2e-3)
    assert np.abs(rows["energy_closure"]).max() < 2e-3


def test_its_work_never_falls_and_a_broken_bond_has_none():
    """Opened, closed, pressed, slid and broken; the broken faces then move freely."""
    way = np.array([(0, 0), (0, 0.15), (0, -0.004), (0.2, -0.004), (-0.1, 0.1), (0, 2.0), (1.0, 0.5)])
    b, corners = make_blocks(), np.arange(len(way))
    path = [lambda t, i=i: np.interp(t, corners, way[:, i]) for i in range(2)]
    supports = b.drive(b.lower, [0.0, 0.0])
    supports += [Support(b.state, b.upper, i, path[i], dim=2, corners=tuple(corners[1:-1])) for i in range(2)]
    crack = b.crack(VISCOUS, contact=PenaltyContact(500.0))
    rows = history(Mechanics(b.state, [crack], supports), 6.0, StepControl.fixed(0.01))
    lost = rows["energy_cohesive_viscous"]
    assert np.diff(lost).min() >= 0
    assert np.ptp(lost[rows["time"] >= 5]) < 1e-6 * lost[-1]
    assert np.abs(rows["energy_closure"]).max() < 5e-3


@pytest.mark.parametrize(("jump", "gdim"), [((0.5, 0.8), 2), ((1.3, 1.6), 2), ((0.5, -0.3), 2), ((1.3, 1.6), 3)])
def test_tangent(jump, gdim):
    b = make_blocks(gdim)
    crack = b.crack(VISCOUS, contact=PenaltyContact(30.0))
    b.state.begin(0.1)
    u = separated(b, jump[0] * EXPONENTIAL.shear_opening, jump[1] * EXPONENTIAL.opening, 0.01 * EXPONENTIAL.opening)
    assert_slope_two(crack.viscosity, b.state, u, EXPONENTIAL.opening)


@pytest.mark.parametrize("gdim", [2, 3])
def test_a_turn_has_no_rate(gdim):
    """An open bond that is turned by a right angle with its jump: no viscous work."""
    b = make_blocks(gdim)
    crack = b.crack(VISCOUS)
    jump = np.array([0.05, 0.02, 0.08])[[0, 2] if gdim == 2 else [0, 1, 2]]
    for step, angle in enumerate((0.0, 0.5 * np.pi)):
        Q = rotation(gdim, angle)
        b.state.begin(step + 1.0)

        def turned(x, Q=Q, jump=0.0):
            return Q @ (x[:gdim] + np.reshape(jump, (-1, 1))) - x[:gdim]

        b.move(turned, lambda x, Q=Q: turned(x, Q, jump))
        crack.viscosity.evaluate()
        b.state.commit()
        if step == 0:
            before = crack.viscosity.viscous_work
    assert before > 0
    assert crack.viscosity.viscous_work == pytest.approx(before, rel=1e-12)


def test_pairs_have_the_same_viscosity():
    """Two boxes with different meshes, pulled and sheared at a constant rate: force and work as in a crack."""
    rows = {}
    for law in (EXPONENTIAL, VISCOUS):
        b = two(2, overhang=0.0)
        pair = b.pair(law=law, small_sliding=True, contact=PenaltyContact(500.0))
        path = (lambda t: 0.3 * t, lambda t: 0.2 * t)
        supports = [Support(b.state, b.cells(0), i, dim=2) for i in range(2)]
        supports += [Support(b.state, b.cells(1), i, path[i], dim=2) for i in range(2)]
        rows[law] = history(Mechanics(b.state, [Solid(b.state, ELASTIC), pair], supports), 1.0, StepControl.fixed(0.01))
    slow, fast = rows[EXPONENTIAL], rows[VISCOUS]
    more = fast["work_external"][-1] - slow["work_external"][-1]
    assert fast["energy_cohesive_viscous"][-1] == pytest.approx(more, rel=5e-3)
    assert np.abs(fast["energy_closure"]).max() < 2e-3


def test_what_a_snap_sets_free_is_viscous_work():
    """A bar pulled beyond the point where it snaps: W = ∫F du to there is lost to fracture and viscosity."""
    young = 5.0
    b = make_blocks()
    law = ViscousBond(EXPONENTIAL, 0.005)
    crack = b.crack(law, young=young)
    supports = [Support(b.state, b.face(1, 0.0), i) for i in range(2)]
    supports.append(Support(b.state, b.face(1, 1.0), 1, lambda t: t, name="top"))
    solid = b.solid(LinearElastic(young, 0.0))
    control = StepControl(0.01, 0.05, smallest=1e-7, damage=0.02)
    rows = history(Mechanics(b.state, [solid, crack], supports), 1.2, control)
    t, eps = EXPONENTIAL.strength, EXPONENTIAL.opening
    x = brentq(lambda x: t / eps * np.exp(1 - x) * (x - 1) - young, 1, 2)
    held = (t * x * np.exp(1 - x)) ** 2 / (2 * young)
    free = held - EXPONENTIAL.toughness * (1 + x) * np.exp(-x)
    assert rows["energy_fracture"][-1] == pytest.approx(EXPONENTIAL.toughness, rel=1e-3)
    assert rows["energy_cohesive_viscous"][-1] == pytest.approx(free, rel=0.05)
    assert np.abs(rows["energy_closure"]).max() < 0.02
    assert "the viscosity takes" not in "; ".join(b.state.verdict.reasons), "the load has not spent it"


def test_a_law_has_one_viscosity():
    with pytest.raises(ValueError, match=r"law = .* without a viscosity"):
        ViscousBond(ViscousBond(EXPONENTIAL, 1.0), 1.0)
