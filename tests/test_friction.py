"""Friction between crack faces against Coulomb's law: stick, slip, reversal, turning interfaces, broken bonds."""

import numpy as np
import pytest
from dolfinx import fem
from mpi4py import MPI

from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.stepping import StepControl, begin, run
from cutsim.bodies.loads import Support
from cutsim.fields.points import Surface
from cutsim.fields.space import cracked_space
from cutsim.fields.temperature import Temperature
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.crack_friction import CrackFriction
from cutsim.interface.damage import damage
from cutsim.interface.friction import Coulomb, SmoothCoulomb
from cutsim.interface.rubbing import Friction
from cutsim.materials.elastic import LinearElastic
from cutsim.solvers.convergence import Tolerances
from cutsim.tools.shapes import Plane, ToolPath
from cutsim.tools.tool_contact import ToolContact
from helpers.blocks import make_blocks, remember
from helpers.fields import rotation
from helpers.laws import EXPONENTIAL, E
from helpers.runs import history

MU, NORMAL, TANGENTIAL = 0.3, 50.0, 40.0
DEPTH = 0.02
PRESSURE = NORMAL * DEPTH
LAW = Coulomb(MU, TANGENTIAL)
# elastic slip at which a point begins to slip
ELASTIC = MU * PRESSURE / TANGENTIAL


def driven(path, law=LAW, gdim=2, bond=None, **options):
    """Two rigid blocks, the upper one on a path: the jump is that of the path."""
    b = make_blocks(gdim)
    crack = b.crack(bond, contact=PenaltyContact(NORMAL))
    friction = CrackFriction(crack, Friction(law, **options))
    supports = b.drive(b.lower, [0.0] * gdim, "base") + b.drive(b.upper, path, "top")
    return Mechanics(b.state, [crack, friction], supports), friction


def test_a_crack_takes_a_coefficient_or_a_law():
    """As tools and pairs do; the term that it makes is the one that can be written out."""
    rows = []
    for friction in (MU, Coulomb(MU), Coulomb(MU, NORMAL), None):
        b = make_blocks()
        crack = b.crack(None, contact=PenaltyContact(NORMAL), friction=friction)
        terms = [crack] if friction else [crack, CrackFriction(crack, MU)]
        supports = b.drive(b.lower, [0.0, 0.0], "base") + b.drive(b.upper, to_and_fro(0.1), "top")
        rows.append(history(Mechanics(b.state, terms, supports), 3.0, StepControl.fixed(0.25)))
    for other in rows[1:]:
        assert rows[0].keys() == other.keys()
        for name, column in rows[0].items():
            np.testing.assert_array_equal(column, other[name], err_msg=name)
    assert rows[0]["energy_friction"][-1] > 0


def to_and_fro(far, gdim=2):
    """Press by DEPTH until t = 1, then slide to +far, −far and back to 0 until t = 5."""

    def slide(t):
        return float(np.interp(t, [1, 2, 4, 5], [0, far, -far, 0]))

    def press(t):
        return -DEPTH * min(t, 1.0)

    return [slide, *([0.0] * (gdim - 2)), press]


@pytest.mark.parametrize("gdim", [2, 3])
def test_slip_at_exactly_mu_n(gdim):
    """Pushed and pulled: μ N in slip, elastic on reversal, dissipation μ N times the slip."""
    far = 0.1
    mechanics, _ = driven(to_and_fro(far, gdim), gdim=gdim)
    rows = history(mechanics, 5.0, StepControl.fixed(0.125))
    way = np.interp(rows["time"], [1, 2, 4, 5], [0, far, -far, 0])
    expected, previous = [], 0.0
    anchor = 0.0
    for s in way:
        previous = np.clip(TANGENTIAL * (s - anchor), -MU * PRESSURE, MU * PRESSURE)
        anchor = s - previous / TANGENTIAL
        expected.append(previous)
    pressed = rows["time"] >= 1
    np.testing.assert_allclose(rows["top_x_force"][pressed], np.array(expected)[pressed], atol=1e-12)
    np.testing.assert_allclose(rows["base_x_force"], -rows["top_x_force"], atol=1e-12)
    slipped = far - ELASTIC + 2 * (far - ELASTIC) + (far - 2 * ELASTIC)
    assert rows["energy_friction"][-1] == pytest.approx(MU * PRESSURE * slipped, rel=1e-10)
    assert (np.diff(rows["energy_friction"]) >= 0).all()
    assert rows["crack_slipping"][-1] == pytest.approx(1.0)
    assert rows["crack_sticking"][-1] == 0.0


def test_dissipation_is_mu_n_s_without_elastic_slip():
    """The penalty's elastic slip aside, nothing is lost: force times way = dissipated + stored, at any step."""
    mechanics, _ = driven(to_and_fro(0.1), law=Coulomb(MU, 1e9))
    rows = history(mechanics, 5.0, StepControl.fixed(0.25))
    assert rows["energy_friction"][-1] == pytest.approx(MU * PRESSURE * 0.4, rel=1e-8)


def test_elastic_loop_is_closed():
    mechanics, _ = driven(to_and_fro(0.9 * ELASTIC))
    rows = history(mechanics, 5.0, StepControl.fixed(0.125))
    peak = np.abs(rows["top_x_force"]).max()
    assert peak == pytest.approx(0.9 * MU * PRESSURE)
    assert abs(rows["top_x_force"][-1]) < 1e-12
    assert np.abs(rows["energy_friction"]).max() == 0.0
    assert rows["energy_contact"][-1] == pytest.approx(0.5 * NORMAL * DEPTH**2, rel=1e-10)
    assert np.abs(rows["energy_closure"]).max() < 1e-10
    assert rows["crack_sticking"][-1] == pytest.approx(1.0)


def test_dissipation_under_growing_pressure():
    """Slip with a pressure that grows in proportion: D = ∫ μ p ds = ½ μ p s, whatever the steps."""
    for step in (0.5, 0.1):
        mechanics, _ = driven([lambda t: 0.2 * t, lambda t: -DEPTH * t], law=Coulomb(MU, 1e8))
        rows = history(mechanics, 1.0, StepControl.fixed(step))
        assert rows["energy_friction"][-1] == pytest.approx(0.5 * MU * PRESSURE * 0.2, rel=1e-6)
        assert abs(rows["energy_closure"][-1]) < 1e-6


def test_circular_path():
    """On a circle the traction is of size μ p and opposes the velocity."""
    radius, steps = 0.05, 72

    def angle(t):
        return 2 * np.pi * max(t - 1, 0.0)

    path = [
        lambda t: radius * np.sin(angle(t)),
        lambda t: radius * (1 - np.cos(angle(t))),
        lambda t: -DEPTH * min(t, 1),
    ]
    mechanics, friction = driven(path, law=Coulomb(MU, 4e3), gdim=3)
    rows = history(mechanics, 2.0, StepControl.fixed(1 / steps))
    force = np.array([rows["top_x_force"], rows["top_y_force"]])
    turning = rows["time"] > 1 + 2 / steps
    np.testing.assert_allclose(np.linalg.norm(force, axis=0)[turning], MU * PRESSURE, rtol=1e-10)
    # the slip of a step is the chord of the circle, whose direction is that half a step before
    middle = angle(1) + 2 * np.pi * (rows["time"][turning] - 1 - 0.5 / steps)
    along = force[0, turning] * np.cos(middle) + force[1, turning] * np.sin(middle)
    assert along.min() > MU * PRESSURE * np.cos(np.deg2rad(3))
    traction, slip = friction.slip.values("traction"), friction.slip.values("advance")
    assert slip.min(initial=1.0) > 0
    np.testing.assert_allclose(np.linalg.norm(traction, axis=-1), MU * PRESSURE, rtol=1e-10)


@pytest.mark.parametrize("gdim", [2, 3])
@pytest.mark.parametrize("steps", [1, 5])
def test_stuck_interface_turns(gdim, steps):
    """Pressed, sheared and stuck, then turned rigidly by 90°: the traction keeps its components in the turned frame."""
    b = make_blocks(gdim)
    crack = b.crack(None, contact=PenaltyContact(NORMAL))
    friction = CrackFriction(crack, LAW)
    mechanics = Mechanics(b.state, [crack, friction], b.drive(b.lower, [0.0] * gdim))
    shift = np.zeros((3, 1))
    shift[0], shift[gdim - 1] = 0.5 * ELASTIC, -DEPTH
    if gdim == 3:
        shift[1] = 0.3 * ELASTIC

    def place(angle):
        R = np.eye(3)
        R[:gdim, :gdim] = rotation(gdim, angle)
        b.move(lambda x: R @ x - x, lambda x: R @ (x + shift) - x)
        b.state.begin(b.state.time_old + 1)
        mechanics.evaluate()
        mechanics.state.commit()
        return friction.slip.values("traction").copy(), R

    before, _ = place(0.0)
    force = mechanics._residual.trial.reshape(-1, gdim).copy()
    np.testing.assert_allclose(np.linalg.norm(before, axis=-1), TANGENTIAL * np.linalg.norm(shift[: gdim - 1]))
    for i in range(steps):
        after, R = place((i + 1) * np.pi / 2 / steps)
    np.testing.assert_allclose(after, before, atol=1e-8 * np.abs(before).max(initial=1e-9))
    turned = mechanics._residual.trial.reshape(-1, gdim)
    np.testing.assert_allclose(turned, force @ R[:gdim, :gdim].T, atol=1e-10)
    assert friction.slip.energies()["friction"] == 0.0


def test_augmentation_sticks_within_tolerance():
    """A stuck point slides no more than allowed, at a soft penalty; in slip the force is μ N."""
    b = make_blocks(2, n=4)
    # the normal stays that of the reference, so that the force along x is friction alone
    crack = b.crack(None, contact=PenaltyContact(NORMAL), normal="reference")
    friction = CrackFriction(crack, Friction(MU, allowed_slip=1e-7))
    top = b.face(1, 1.0)
    supports = b.drive(b.lower, [0.0, 0.0], "base")
    supports += [Support(b.state, top, 1, lambda t: -DEPTH * min(t, 1.0))]
    supports += [Support(b.state, top, 0, lambda t: 0.01 * max(t - 1, 0.0), name="top_x")]
    mechanics = Mechanics(
        b.state, [b.solid(LinearElastic(E, 0.0)), crack, friction], supports, tolerances=Tolerances(rtol=1e-11)
    )
    slides = []

    def watch(report):
        if report.time > 1.01:
            slide = np.abs(crack.points.facet_mean(friction.slip.values("slip")[..., 0])).max()
            slides.append((report.columns["crack_slipping"][0], slide))

    run(mechanics, 3.0, StepControl.fixed(0.1), watch)
    stuck = [slide for slips, slide in slides if slips == 0]
    assert len(stuck) > 3 and max(stuck) < 1e-7 * len(stuck)
    columns = mechanics.record()
    assert columns["crack_slipping"][0] == pytest.approx(1.0)
    normal = crack.points.integral(crack.point_values("pressure"))
    assert columns["top_x_force"][0] == pytest.approx(MU * normal, rel=1e-6)


@pytest.mark.parametrize("acts_on", ["broken", "contact", "tension"])
def test_where_friction_acts(acts_on, caplog):
    """Beside a bond: on its broken fraction, everywhere, or, as the thesis has it, under tension too."""
    past, slide = 2.0 * EXPONENTIAL.opening, 0.1
    for opening in (-DEPTH, 0.5 * EXPONENTIAL.opening):
        b = make_blocks()
        crack = b.crack(EXPONENTIAL, contact=PenaltyContact(NORMAL))
        remember(crack, past)
        friction = CrackFriction(crack, Friction(Coulomb(MU, 1e6), acts_on=acts_on))
        mechanics = Mechanics(b.state, [crack, friction], b.drive(b.lower, [0.0, 0.0]))
        b.move(lambda x: 0 * x, lambda x, o=opening: np.array([0 * x[0] + slide, 0 * x[0] + o]))
        b.state.begin(1.0)
        mechanics.evaluate()
        force = friction.slip.points.integral(friction.slip.values("traction")[..., 0] * friction.slip.values("share"))
        k_n, k_t = np.minimum(EXPONENTIAL.secants(past, 0.0), EXPONENTIAL.secants(max(opening, 0.0), slide))
        broken = damage(EXPONENTIAL, k_n, k_t)[1]
        tension = k_n * max(opening, 0.0) if acts_on == "tension" else 0.0
        limit = MU * (NORMAL * max(-opening, 0.0) + tension)
        expected = limit * (float(broken) if acts_on == "broken" else 1.0)
        assert abs(force) == pytest.approx(expected, rel=1e-6, abs=1e-12)
    assert ("open faces rub" in caplog.text) == (acts_on == "tension")


def test_viscous_friction_exceeds_the_limit_by_its_rate():
    """Steady slip at speed s': t = μ p + η s' (viscoplastic regularisation)."""
    mechanics, _ = driven(to_and_fro(0.1), law=Coulomb(MU, 1e4, viscosity=0.7))
    rows = history(mechanics, 2.0, StepControl.fixed(0.05))
    assert rows["top_x_force"][-1] == pytest.approx(MU * PRESSURE + 0.7 * 0.1, rel=1e-6)


@pytest.mark.parametrize("hot", ["+", "-"])
def test_friction_falls_with_the_hotter_side(hot):
    """μ(T) = μ (T_d − T)²/(T_d − T_ref)² with the temperature of the hotter face; none above T_d."""
    for warm in (320.0, 500.0):
        b = make_blocks()
        space = cracked_space(b.state.mesh, ("Lagrange", 1), b.facets)
        field = fem.Function(space)
        field.x.array[:] = 290.0
        field.interpolate(lambda x, warm=warm: 0 * x[0] + warm, b.lower if hot == "+" else b.upper)
        temperature = Temperature(b.state, space, field)
        crack = b.crack(None, contact=PenaltyContact(NORMAL))
        law = Coulomb(MU, 1e5, T_ref=300.0, T_damage=400.0)
        friction = CrackFriction(crack, Friction(law, temperature=temperature))
        supports = b.drive(b.lower, [0.0, 0.0]) + b.drive(b.upper, to_and_fro(0.1), "top")
        mechanics = Mechanics(b.state, [crack, friction], supports)
        rows = history(mechanics, 1.5, StepControl.fixed(0.25))
        factor = max(400.0 - warm, 0) ** 2 / 100.0**2
        assert rows["top_x_force"][-1] == pytest.approx(factor * MU * PRESSURE, abs=1e-12)


# -- tools ------------------------------------------------------------------------------------------------------------


def test_tool_slips_at_mu_n():
    """A plate pushed to and fro over a block that does not move: μ N exactly, dissipation μ N s, closed loop."""
    b = make_blocks()
    path = ToolPath.polyline([0, 1, 2, 4, 5], [(0, 1), (0, 0.98), (0.1, 0.98), (-0.1, 0.98), (0, 0.98)])
    top = Surface.exterior(b.state, b.face(1, 1.0))
    plate = ToolContact(b.state, Plane((0.0, -1.0)), path, [top], contact=PenaltyContact(NORMAL), friction=LAW)
    mechanics = Mechanics(b.state, [plate], b.drive(np.union1d(b.lower, b.upper), [0.0, 0.0], "base"))
    rows = history(mechanics, 5.0, StepControl.fixed(0.125))
    slid = (rows["time"] > 1 + ELASTIC / 0.1) & (rows["time"] <= 2)
    np.testing.assert_allclose(rows["tool_force_x"][slid], -MU * PRESSURE, rtol=1e-12)
    np.testing.assert_allclose(rows["base_x_force"], -rows["tool_force_x"] * -1, atol=1e-12)
    slipped = 0.1 - ELASTIC + 2 * (0.1 - ELASTIC) + 0.1 - 2 * ELASTIC
    assert rows["energy_friction"][-1] == pytest.approx(MU * PRESSURE * slipped, rel=1e-10)
    assert rows["tool_slipping"][-1] == pytest.approx(1.0)


# -- state ------------------------------------------------------------------------------------------------------------


def elastic_blocks(allowed_slip=None, comm=MPI.COMM_WORLD, gdim=2):
    """Two elastic blocks, pressed and dragged over each other: some points stick while others slip."""
    b = make_blocks(gdim, n=4, comm=comm)
    crack = b.crack(None, contact=PenaltyContact(NORMAL))
    friction = CrackFriction(crack, Friction(LAW, allowed_slip=allowed_slip))
    bottom, top = b.face(gdim - 1, 0.0), b.face(gdim - 1, 1.0)
    drag = [0.1, *([0.04] * (gdim - 2)), -0.1]
    supports = [Support(b.state, bottom, i) for i in range(gdim)]
    supports += [
        Support(b.state, top, i, lambda t, far=far: far * t, name=f"top_{'xyz'[i]}") for i, far in enumerate(drag)
    ]
    return Mechanics(b.state, [b.solid(), crack, friction], supports, tolerances=Tolerances(rtol=1e-11)), friction


@pytest.mark.parametrize("stick", [None, 1e-5], ids=["penalty", "augmented"])
def test_rollback_restores_the_slip(stick):
    mechanics, friction = elastic_blocks(stick)
    history(mechanics, 0.4, StepControl.fixed(0.2))
    before = friction.slip._memory.x.array.copy()
    values = {name: v.copy() for name, v in friction.slip._known.trial.items()}
    begin(mechanics, 0.8)
    assert mechanics.solve().converged
    mechanics.evaluate()
    assert friction.dissipation().max(initial=1.0) > 0
    mechanics.state.rollback()
    np.testing.assert_array_equal(friction.slip._memory.x.array, before)
    for name, v in values.items():
        np.testing.assert_array_equal(friction.slip._known.trial[name], v)


@pytest.mark.mpi
@pytest.mark.parametrize("gdim", [2, 3])
def test_any_number_of_ranks(gdim):
    """Stick and slip beside each other: the numbers of one rank."""
    control = StepControl.fixed(0.125)
    rows = history(elastic_blocks(gdim=gdim)[0], 1.0, control)
    alone = history(elastic_blocks(comm=MPI.COMM_SELF, gdim=gdim)[0], 1.0, control)
    both = (alone["crack_sticking"] > 0.1) & (alone["crack_slipping"] > 0.1)
    assert both.any(), "the test needs points that stick and points that slip"
    for name in ("top_x_force", "energy_friction", "energy_contact", "crack_sticking", "crack_slipping"):
        np.testing.assert_allclose(rows[name], alone[name], rtol=1e-7, atol=1e-12, err_msg=name)
    assert np.abs(rows["energy_closure"]).max() < 1e-2


# -- refusal ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Coulomb(-0.1), "mu = -0.1 is not allowed"),
        (lambda: Coulomb(0.1, 0.0), "stiffness = 0.0 is not allowed"),
        (lambda: Coulomb(0.1, viscosity=-1.0), "viscosity = -1.0 is not allowed"),
        (lambda: Coulomb(0.1, T_ref=300.0), "T_damage = None is not allowed"),
        (lambda: Coulomb(0.1, T_ref=300.0, T_damage=200.0), "T_damage = 200.0 is not allowed"),
        (lambda: SmoothCoulomb(-1.0, 0.1), "mu = -1.0 is not allowed"),
    ],
)
def test_refuses_a_law(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_refuses_an_option():
    with pytest.raises(ValueError, match="acts_on = 'all' is not allowed"):
        Friction(LAW, acts_on="all")
    with pytest.raises(ValueError, match=r"allowed_slip = 0.0 is not allowed"):
        Friction(LAW, allowed_slip=0.0)
    with pytest.raises(ValueError, match=r"friction = 0\.0 is not allowed"):
        CrackFriction(make_blocks().crack(None), 0.0)
