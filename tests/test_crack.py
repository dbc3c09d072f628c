"""The modified contact law through the finite-element crack: two blocks that move as rigid bodies."""

import subprocess
import sys
from itertools import product
from pathlib import Path

import numpy as np
import pytest
import ufl
from dolfinx import fem, la

from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.stepping import StepControl
from cutsim.base.compat import form
from cutsim.bodies.loads import Support
from cutsim.interface.cohesive import Bilinear, Exponential
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.polynomial import Polynomial
from cutsim.interface.ppr import ParkPaulinoRoesler
from cutsim.materials.elastic import NeoHookean, StVenantKirchhoff
from cutsim.materials.rubbers import MooneyRivlin
from helpers.blocks import PENALTY, drag, make_blocks, remember
from helpers.examples import LAWS
from helpers.fields import rotation
from helpers.laws import BILINEAR, EXPONENTIAL, NU, E
from helpers.runs import history


def exponential(law, sliding, opening):
    """Thesis 4.20, written anew: tractions on the envelope."""
    n, t = opening / law.opening, sliding / law.shear_opening
    T_n = law.strength * n * np.exp(1 - n - t**2)
    T_t = 2 * np.sqrt(np.e / 2) * law.shear_strength * t * (1 + n) * np.exp(-n - t**2)
    return T_t, T_n


def bilinear(law, sliding, opening):
    """Turon and others, written anew with two stiffnesses: tractions on the envelope."""
    K_n, K_t = law.penalty, law.shear_penalty or law.penalty
    B = K_t * sliding**2 / (K_n * opening**2 + K_t * sliding**2)
    jump = (K_n * opening**2 + K_t * sliding**2) / np.sqrt(K_n**2 * opening**2 + K_t**2 * sliding**2)
    stiffness = K_n * (1 - B) + K_t * B
    onset_n, onset_t, final_n, final_t = (
        law.strength / K_n,
        law.shear_strength / K_t,
        2 * law.toughness / law.strength,
        2 * law.shear_toughness / law.shear_strength,
    )
    by = B**law.eta
    onset = np.sqrt((K_n * onset_n**2 + (K_t * onset_t**2 - K_n * onset_n**2) * by) / stiffness)
    final = (K_n * onset_n * final_n + (K_t * onset_t * final_t - K_n * onset_n * final_n) * by) / (stiffness * onset)
    d = np.clip(final * (jump - onset) / (jump * (final - onset)), 0, 1) if jump > onset else 0.0
    return (1 - d) * K_t * sliding, (1 - d) * K_n * opening


def ppr(law, sliding, opening):
    """Park, Paulino and Roesler (2009), as printed: tractions on the envelope."""
    (d_n, d_t), phi_n, phi_t = law.final, law.toughness, law.shear_toughness
    m = law.alpha * (law.alpha - 1) * law.peak**2 / (1 - law.alpha * law.peak**2)
    n = law.beta * (law.beta - 1) * law.shear_peak**2 / (1 - law.beta * law.shear_peak**2)
    gamma_n, gamma_t = (law.alpha / m) ** m, (law.beta / n) ** n
    gamma_n, gamma_t = (gamma_n, -phi_t * gamma_t) if phi_n < phi_t else (-phi_n * gamma_n, gamma_t)
    x, y = opening / d_n, sliding / d_t
    f = gamma_n * (1 - x) ** law.alpha * (m / law.alpha + x) ** m if x < 1 else 0.0
    g = gamma_t * (1 - y) ** law.beta * (n / law.beta + y) ** n if y < 1 else 0.0
    across, along = g + max(phi_t - phi_n, 0), f + max(phi_n - phi_t, 0)
    # f' and g', zero where the other mode has broken the bond
    df = f * (m / (m / law.alpha + x) - law.alpha / (1 - x)) / d_n if x < 1 and across * f < 0 else 0.0
    dg = g * (n / (n / law.beta + y) - law.beta / (1 - y)) / d_t if y < 1 and along * g < 0 else 0.0
    return dg * along, df * across


def polynomial(law, sliding, opening):
    """Tvergaard (1990), written anew: tractions on the envelope, from the final jumps 16 φ/(9 t)."""
    n, t = (
        9 * law.strength * opening / (16 * law.toughness),
        9 * law.shear_strength * sliding / (16 * law.shear_toughness),
    )
    left = 27 / 4 * (1 - min(np.hypot(n, t), 1)) ** 2
    return law.shear_strength * t * left, law.strength * n * left


def own(law, sliding, opening):
    """Tractions on the envelope by the law itself."""
    k_n, k_t = law.secants(opening, sliding)
    return k_t * sliding, k_n * opening


def follow(envelope, law, jump, smallest):
    """Tractions at a jump (sliding, opening) with the smallest secants so far, and the new ones (theory §3.2)."""
    sliding, opening = jump
    # a secant has a limit at zero, found a little beside it
    beside = max(abs(sliding), 1e-7 * law.opening), max(opening, 1e-7 * law.opening)
    smallest = np.minimum(smallest, np.divide(envelope(law, *beside), beside))
    shear, pull = smallest * (sliding, max(opening, 0))
    return (shear, pull + PENALTY.stiffness * min(opening, 0)), smallest


# waypoints (sliding, opening) in units of the characteristic openings: load, unload, press, load again, break
LOOPS = {
    "opening": [(0, 0), (0, 2), (0, 0), (0, -0.05), (0, 3), (0, 0.5), (0, 14)],
    "sliding": [(0, 0), (1.2, 0), (-1.2, 0), (2, 0), (0.3, 0), (6, 0)],
    "mixed": [(0, 0), (0.8, 0.8), (0.1, 0.1), (1, 1), (0.2, 0.2), (8, 8)],
    "swerving": [(0, 0), (0.8, 0.8), (0, 0.1), (1, 1), (0.5, -0.02), (6, 8)],
    "pressed sliding": [(0, 0), (0, -0.05), (1.2, -0.05), (-0.5, -0.05), (6, -0.05)],
}
#: The laws that are written anew here; of others what they say of themselves is compared with what the crack does.
ENVELOPES = {Exponential: exponential, Bilinear: bilinear, ParkPaulinoRoesler: ppr, Polynomial: polynomial}


@pytest.mark.parametrize(
    ("law", "loop", "gdim"), [*product(LAWS, LOOPS, [2]), *product(LAWS, ["mixed", "pressed sliding"], [3])]
)
def test_two_boxes_follow_the_law(law, loop, gdim):
    law, scale = LAWS[law].law, LAWS[law].scale
    envelope = ENVELOPES.get(type(law), own)
    rows, _ = drag(law, np.array(LOOPS[loop]) * scale, steps=60, gdim=gdim)
    normal = "xyz"[gdim - 1]
    smallest = np.full(2, np.inf)
    for i in range(len(rows["time"])):
        jump = rows["upper_x_displacement"][i], rows[f"upper_{normal}_displacement"][i]
        (shear, pull), smallest = follow(envelope, law, jump, smallest)
        assert rows["upper_x_force"][i] == pytest.approx(shear, abs=1e-6 * law.strength)
        assert rows[f"upper_{normal}_force"][i] == pytest.approx(pull, abs=1e-6 * law.strength)
    assert (np.diff(rows["energy_fracture"]) >= 0).all()


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize(("direction", "mode"), [((0, 1), 0), ((1, 0), 1)], ids=["opening", "sliding"])
def test_work_of_separation_of_the_pure_modes(law, direction, mode):
    law, scale = LAWS[law].law, LAWS[law].scale
    rows, _ = drag(law, np.array([(0, 0), 14 * np.array(direction) / (1 + mode)]) * scale, steps=200)
    for work in (rows["work_external"][-1], rows["energy_fracture"][-1]):
        assert work == pytest.approx((law.toughness, law.shear_toughness)[mode], rel=1e-3)


def random_path(scale, legs=24, seed=3):
    """Corners of a path of the jump (sliding, opening), from rest."""
    corners = np.random.default_rng(seed).uniform((-3, -0.02), (3, 3), (legs, 2))
    return np.vstack([[0, 0], corners]) * scale


@pytest.mark.parametrize("law", LAWS)
def test_no_column_of_dissipation_ever_falls(law):
    """Between rigid blocks the audit also closes, however the jump turns."""
    law, scale = LAWS[law].law, LAWS[law].scale
    rows, _ = drag(law, random_path(scale, legs=12), steps=12 * 32)
    assert (np.diff(rows["energy_fracture"]) >= 0).all()
    assert np.abs(rows["energy_closure"]).max() < 5e-3


@pytest.mark.mpi
def test_no_body_gains_from_its_bond():
    """A glued block whose top is moved along a random path: the bond only ever takes."""
    law = Exponential(toughness=0.1, opening=0.1, shear_toughness=0.08, shear_opening=0.15)
    corners = random_path(law.opening)
    legs = np.arange(len(corners))
    b = make_blocks(n=4)
    top = [Support(b.state, b.face(1, 1.0), i, lambda t, c=c: np.interp(t, legs, c)) for i, c in enumerate(corners.T)]
    base = [Support(b.state, b.face(1, 0.0), i) for i in range(2)]
    crack = b.crack(law, contact=PENALTY)
    mechanics = Mechanics(b.state, [crack, b.solid(NeoHookean(E, NU))], base + top)
    rows = history(mechanics, legs[-1], StepControl(0.05, 0.1))
    assert (np.diff(rows["energy_fracture"]) >= 0).all() and rows["energy_fracture"][-1] > 0.01
    assert np.abs(rows["energy_closure"]).max() < 0.05


SHEAR_AFTER_OPENING = {0.5: 0.545, 1.0: 0.632, 2.0: 0.797, 5.0: 0.980}
OPENING_AFTER_SHEAR = {0.5: 0.889, 1.0: 0.684, 2.0: 0.509, 5.0: 0.500}


@pytest.mark.parametrize("d", SHEAR_AFTER_OPENING)
def test_work_depends_on_the_path(d):
    scale = (EXPONENTIAL.shear_opening, EXPONENTIAL.opening)
    for corner, end, known in (((0, d), (6, d), SHEAR_AFTER_OPENING), ((d, 0), (d, 20), OPENING_AFTER_SHEAR)):
        rows, _ = drag(EXPONENTIAL, np.array([(0, 0), corner, end]) * scale, steps=200)
        separated = rows["energy_fracture"][-1] + rows["energy_cohesive_stored"][-1]
        assert separated == pytest.approx(known[d], abs=6e-4)
        assert rows["work_external"][-1] == pytest.approx(separated, abs=4e-3)


@pytest.mark.parametrize("ratio", [0.3, 1.0, 3.0])
def test_mixed_toughness_is_that_of_benzeggagh_and_kenane(ratio):
    mix = ratio**2 / (1 + ratio**2)
    toughness = BILINEAR.toughness + (BILINEAR.shear_toughness - BILINEAR.toughness) * mix**BILINEAR.eta
    rows, _ = drag(BILINEAR, 0.5 * np.array([(0, 0), (ratio, 1)]) / np.hypot(1, ratio), steps=200)
    assert rows["energy_fracture"][-1] == pytest.approx(toughness, rel=1e-3)
    assert rows["crack_broken"][-1] == pytest.approx(1.0)


def test_unloading_goes_to_the_origin():
    """On the secant the traction is proportional to the jump, and no energy is dissipated."""
    scale = np.array([EXPONENTIAL.shear_opening, EXPONENTIAL.opening])
    rows, _ = drag(EXPONENTIAL, np.array([(0, 0), (1.0, 1.5), (0.1, 0.15), (0.9, 1.35)]) * scale, steps=30)
    back = rows["time"] > 1 + 1e-9
    for axis in "xy":
        secant = rows[f"upper_{axis}_force"][back] / rows[f"upper_{axis}_displacement"][back]
        assert np.ptp(secant) < 1e-10 * secant[0]
    assert np.ptp(rows["energy_fracture"][back]) < 1e-10


# -- objectivity ------------------------------------------------------------------------------------------------------


class Forces:
    """Nodal forces of some terms."""

    def __init__(self, state, terms):
        v = ufl.TestFunction(state.V)
        self._form = form(
            sum((t.residual(v) for t in terms), start=ufl.Form([])),
            entity_maps={k: m for t in terms for k, m in t.entity_maps.items()},
        )

    def __call__(self):
        f = fem.assemble_vector(self._form)
        f.scatter_reverse(la.InsertMode.add)
        return f.array.copy()


def damaged_body(gdim, material):
    b = make_blocks(gdim)
    crack = b.crack(EXPONENTIAL, contact=PENALTY)
    remember(crack, 1.5 * EXPONENTIAL.opening)
    return b, Forces(b.state, [crack, b.solid(material)])


@pytest.mark.parametrize("angle", [0.1, 1.3, 3.14159, 4.0])
@pytest.mark.parametrize("gdim", [2, 3])
@pytest.mark.parametrize(
    "material",
    [NeoHookean(E, NU), StVenantKirchhoff(E, NU), MooneyRivlin(0.3, 0.1, 4.0)],
    ids=lambda m: type(m).__name__,
)
def test_rigid_motion_needs_no_force(material, gdim, angle):
    b, forces = damaged_body(gdim, material)
    Q, c = rotation(gdim, angle), np.arange(1.0, gdim + 1)
    b.move(*[lambda x: Q @ x[:gdim] + c[:, None] - x[:gdim]] * 2)
    assert np.abs(forces()).max() < 1e-10 * EXPONENTIAL.strength


@pytest.mark.parametrize("angle", [0.1, 1.3, 3.14159, 4.0])
@pytest.mark.parametrize("opening", [0.05, -0.01], ids=["open", "pressed"])
@pytest.mark.parametrize("gdim", [2, 3])
def test_forces_turn_with_the_body(gdim, opening, angle):
    """f(Q x + c) = Q f(x) for a deformed, damaged body with a jump carried along."""
    b, forces = damaged_body(gdim, NeoHookean(E, NU))
    jump = np.array([0.08, *[0.02] * (gdim - 2), opening])
    stretch = 0.1 * np.random.default_rng(2).uniform(-1, 1, (gdim, gdim))

    def place(x, jump):
        return x[:gdim] + stretch @ x[:gdim] + jump[:, None] * (1 + 0.2 * x[0])

    def move(Q, c):
        b.move(*[lambda x, j=j: Q @ place(x, j) + c[:, None] - x[:gdim] for j in (0 * jump, jump)])
        return forces().reshape(-1, gdim)

    f = move(np.eye(gdim), np.zeros(gdim))
    Q = rotation(gdim, angle)
    assert np.abs(f).max() > 1e-2
    np.testing.assert_allclose(move(Q, np.arange(1.0, gdim + 1)), f @ Q.T, atol=1e-10 * np.abs(f).max())


# -- closing ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("gdim", [2, 3])
def test_faces_that_have_turned_apart_do_not_touch(gdim):
    """Beyond 90° the mid-surface is turned over and takes open faces for penetrating ones: no pressure may act."""
    b = make_blocks(gdim)
    crack = b.crack(None, contact=PENALTY)
    forces = Forces(b.state, [crack])
    middle = np.array([[0.0], [0.5], [0.0]]) if gdim == 2 else np.array([[0.0], [0.0], [0.5]])

    def turn(degrees, shift):
        angle, c = np.deg2rad(degrees), gdim - 1
        R = np.eye(3)
        R[np.ix_([0, c], [0, c])] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        return lambda x: R @ (x - middle) - (x - middle) + shift * np.eye(3)[:, [c]]

    b.move(turn(-20, 0.0), turn(20, -1.0))
    opening = crack.faces.values(1.0)["opening"].max()
    assert opening < 0 and np.abs(forces()).max() > 1.0, "pressed faces at 40° to each other do touch"
    assert "largest penetration 0." in crack.diagnose()
    for degrees in (50, 100, 135):
        b.move(turn(-degrees, 0.0), turn(degrees, 0.0))
        assert np.abs(forces()).max() < 1e-12
    assert crack.faces.values(1.0)["opening"].min() < 0, "the test needs a mid-surface that is turned over"
    assert crack.diagnose().endswith("largest penetration 0"), "faces that do not touch do not penetrate"


@pytest.mark.parametrize("blend", [0.0, 0.002])
def test_pressure_is_the_penalty_times_the_penetration(blend):
    contact = PenaltyContact(500.0, blend)
    rows, crack = drag(None, np.array([(0, 0), (0, -0.01)]), steps=10, contact=contact)
    penetration = -rows["upper_y_displacement"]
    quadratic = penetration < 2 * blend
    pressure = 500 * np.where(quadratic, penetration**2 / (4 * blend or 1), penetration - blend)
    np.testing.assert_allclose(-rows["upper_y_force"], pressure, rtol=1e-9)
    np.testing.assert_allclose(rows["crack_penetration"], penetration / crack.normal_size, rtol=1e-9)
    assert rows["energy_contact"][-1] == pytest.approx(500 * ((0.01 - blend) ** 2 / 2 + blend**2 / 6), rel=1e-4)


def test_automatic_penalty_is_a_multiple_of_young_over_size():
    crack = make_blocks().crack(None)
    assert crack.contact.stiffness == pytest.approx(10 * E / 0.5)
    assert make_blocks(n=8).crack(None).contact.stiffness == pytest.approx(4 * crack.contact.stiffness)


def test_an_error_beside_a_new_crack_lets_the_process_end():
    """Python drops the crack while the error is under way; its communicator must not block those that come after."""
    program = (
        "import sys; sys.path.insert(0, sys.argv[1])\n"
        "from helpers.blocks import make_blocks\n"
        "from mpi4py import MPI\n"
        "b = make_blocks()\n"
        "try:\n    [b.crack(), b.crack(young='x')]\n"
        "except ValueError as error:\n    print(error)\n"
        "print(MPI.COMM_WORLD.allreduce(7))\n"
    )
    here = str(Path(__file__).parent)
    done = subprocess.run([sys.executable, "-c", program, here], capture_output=True, text=True, timeout=200)
    assert done.returncode == 0 and "young = 'x'" in done.stdout and done.stdout.endswith("7\n"), done.stderr
