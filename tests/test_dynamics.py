"""Dynamics against closed forms: vibration, amplification per step, impact, moving supports, and what is refused."""

from dataclasses import dataclass

import numpy as np
import pytest
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI

from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.stepping import StepControl, begin, run
from cutsim.base.assembly import integrate
from cutsim.base.compat import form
from cutsim.bodies.loads import Support, Traction
from cutsim.bodies.schemes import GeneralisedAlpha, Newmark
from cutsim.bodies.solid import Solid
from cutsim.fields.points import Surface
from cutsim.fields.state import State
from cutsim.interface.cohesive import Exponential
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.friction import Coulomb
from cutsim.materials.elastic import LinearElastic, NeoHookean
from cutsim.solvers.convergence import Tolerances
from cutsim.tools.shapes import Plane, ToolPath
from cutsim.tools.tool_contact import ToolContact
from helpers.blocks import make_blocks
from helpers.fields import smooth
from helpers.laws import BILINEAR
from helpers.runs import history
from helpers.tangents import STEPS, Linearised, slopes

E, RHO, LENGTH, CELLS = 3.0, 2.0, 4.0, 8
AMPLITUDE = 0.01


def step(mechanics, dt):
    begin(mechanics, mechanics.state.time_old + dt)
    assert mechanics.solve().converged
    mechanics.evaluate()
    mechanics.state.commit()


@dataclass
class Bar:
    """A slender bar along x, without lateral contraction, that can be held at x = 0."""

    state: State
    mechanics: Mechanics
    tip: int

    def step(self, dt):
        step(self.mechanics, dt)

    @property
    def motion(self):
        """Displacement, velocity and acceleration of the tip."""
        inertia = self.mechanics.inertia
        return np.array([f.x.array[self.tip] for f in (self.state.u, inertia.velocity, inertia.acceleration)])


def make_bar(shape=None, *, cells=CELLS, length=LENGTH, wall=0.0, loads=lambda state, end: [], **options):
    """A bar with an initial displacement along x, a function of x."""
    domain = mesh.create_rectangle(
        MPI.COMM_SELF, [(0, 0), (length, 1)], [cells, 1], mesh.CellType.quadrilateral, diagonal=mesh.DiagonalType.left
    )
    state = State(fem.functionspace(domain, ("Lagrange", 1, (2,))))
    left, right = (
        mesh.locate_entities_boundary(domain, 1, lambda x, at=at: np.isclose(x[0], at)) for at in (0.0, length)
    )
    everywhere = np.arange(domain.topology.index_map(2).size_local, dtype=np.int32)
    supports = [Support(state, everywhere, 1, dim=2)]
    supports += [] if wall is None else [Support(state, left, 0, wall, name="wall")]
    if shape is not None:
        state.u.interpolate(lambda x: np.array([shape(x[0]), 0 * x[0]]))
        state.commit()
    terms = [Solid(state, LinearElastic(E, 0.0), density=RHO), *loads(state, right)]
    tip = 2 * int(np.argmax(state.V.tabulate_dof_coordinates()[:, 0]))
    return Bar(state, Mechanics(state, terms, supports, analysis="dynamic", **options), tip)


def vibrating(mass="consistent", **options):
    """A bar in its first mode, and the angular frequency of that mode on the mesh."""
    k, h = 0.5 * np.pi / LENGTH, LENGTH / CELLS
    c = np.cos(k * h)
    squared = 6 * (1 - c) / (2 + c) if mass == "consistent" else 2 * (1 - c)
    bar = make_bar(lambda x: AMPLITUDE * np.sin(k * x), mass=mass, **options)
    return bar, np.sqrt(E / RHO * squared) / h


# -- vibration --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("mass", ["consistent", "lumped"])
def test_trapezoidal_rule_keeps_energy_and_has_its_frequency(mass):
    """100 periods of 12 steps; u = A cos Ωt with tan(Ω Δt/2) = ω Δt/2, in the free tip exactly."""
    bar, omega = vibrating(mass)
    dt = 2 * np.pi / omega / 12
    tip, energy = [], []
    for _ in range(1200):
        bar.step(dt)
        tip.append(bar.motion[0])
        energy.append(sum(bar.mechanics.audit.entries[name] for name in ("strain", "kinetic")))
    audit = bar.mechanics.audit
    expected = AMPLITUDE * np.cos(2 * np.arctan(0.5 * omega * dt) * np.arange(1, 1201))
    np.testing.assert_allclose(tip, expected, atol=1e-8 * AMPLITUDE)
    np.testing.assert_allclose(energy, audit.initial, rtol=1e-10)
    assert abs(audit.entries["numerical"]) < 1e-10 * audit.initial
    assert abs(audit.closure) < 1e-10
    stiffness, mode = E * LENGTH / 2, 0.5 * np.pi / LENGTH
    assert audit.initial == pytest.approx(0.5 * stiffness * (AMPLITUDE * mode) ** 2, rel=0.01)


@pytest.mark.parametrize("scheme", [Newmark(), GeneralisedAlpha(0.8), GeneralisedAlpha(0.0)], ids=str)
def test_second_order(scheme):
    """Error of the tip after 0.7 periods, displacement and velocity together."""
    counts, errors = np.array([40, 80, 160]), []
    for count in counts:
        bar, omega = vibrating(scheme=scheme)
        end = 1.4 * np.pi / omega
        for _ in range(count):
            bar.step(end / count)
        exact = AMPLITUDE * np.array([np.cos(omega * end), -omega * np.sin(omega * end)])
        errors.append(np.linalg.norm((bar.motion[:2] - exact) / [1, omega]) / AMPLITUDE)
    np.testing.assert_allclose(-slopes(counts, errors), 2.0, atol=0.1)


# -- amplification of one step ----------------------------------------------------------------------------------------


def oscillator(**options):
    """A single cell whose free face is one degree of freedom; displacement and velocity at the start, frequency."""
    bar = make_bar(lambda x: AMPLITUDE * x, cells=1, length=1.0, **options)
    return bar, np.sqrt(3 * E / RHO)


def amplification(scheme, frequency):
    """Matrix that takes (u, Δt v, Δt² a) over one step of a mode, Ω = ω Δt (Chung and Hulbert, equation 10)."""
    m, f, b, g = scheme.alpha_m, scheme.alpha_f, scheme.beta, scheme.gamma
    new = np.array([[1, 0, -b], [0, 1, -g], [frequency**2 * (1 - f), 0, 1 - m]])
    old = np.array([[1, 1, 0.5 - b], [0, 1, 1 - g], [-(frequency**2) * f, 0, -m]])
    return np.linalg.solve(new, old)


SCHEMES = [*(GeneralisedAlpha(r) for r in (0.0, 0.5, 0.8, 1.0)), Newmark(), Newmark(0.3025, 0.6)]


@pytest.mark.parametrize("frequency", [0.3, 3.0, 30.0, 1e3])
@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
def test_each_step_amplifies_as_the_matrix_says(scheme, frequency):
    bar, omega = oscillator(scheme=scheme)
    dt = frequency / omega
    bar.mechanics.inertia.set_velocity(lambda x: np.array([0.3 * omega * AMPLITUDE * x[0], 0 * x[0]]))
    units = np.array([1, dt, dt**2])
    state = np.array([1, 0.3 * frequency, -(frequency**2)]) * AMPLITUDE  # the acceleration is that of equilibrium
    matrix, initial = amplification(scheme, frequency), None
    for _ in range(12):
        bar.step(dt)
        size = np.abs(state)
        state = matrix @ state
        # 1e-14 is the rounding in the displacements of a cell of size 1, at which the solver stops
        tolerance = 1e-9 * max(size.max(), np.abs(state).max()) + 1e-14
        np.testing.assert_allclose(units * bar.motion, state, atol=tolerance)
        initial = initial or bar.mechanics.audit.initial
        audit = bar.mechanics.audit
        kept = (state[0] ** 2 + (state[1] / frequency) ** 2) / (1 + 0.3**2) / AMPLITUDE**2
        assert audit.entries["numerical"] / initial == pytest.approx(1 - kept, abs=1e-8)
        assert abs(audit.closure) < 1e-8


@pytest.mark.parametrize("rho", [0.3, 0.5, 0.8, 1.0])
def test_fast_modes_fall_by_the_spectral_radius(rho):
    """The displacements obey u₃ = p u₂ + q u₁ + r u₀, whose roots are the eigenvalues: all −ρ∞ for Δt ω → ∞."""
    bar, omega = oscillator(scheme=GeneralisedAlpha(rho))
    u = []
    for _ in range(12):
        bar.step(1e4 / omega)
        u.append(bar.motion[0])
    u = np.array(u)
    scale = 1 / np.abs(u[:-3])
    rows = np.stack([u[2:-1], u[1:-2], u[:-3]], axis=1) * scale[:, None]
    recurrence = np.linalg.lstsq(rows, u[3:] * scale)[0] if rho < 1 else [-1.0, 0.0, 0.0]
    radius = np.abs(np.roots([1, *-np.asarray(recurrence)])).max()
    assert radius == pytest.approx(rho, rel=0.02)
    theory = np.abs(np.linalg.eigvals(amplification(GeneralisedAlpha(rho), 1e4))).max()
    assert theory == pytest.approx(rho, rel=0.02)
    kept = bar.mechanics.audit
    assert rho < 1 or abs(kept.entries["numerical"]) < 1e-10 * kept.initial


def test_rho_zero_annihilates_fast_modes():
    bar, omega = oscillator(scheme=GeneralisedAlpha(0.0))
    for _ in range(4):
        bar.step(1e4 / omega)
    assert abs(bar.motion[0]) < 1e-6 * AMPLITUDE
    audit = bar.mechanics.audit
    assert audit.entries["numerical"] == pytest.approx(audit.initial, rel=1e-10)


def test_generalised_alpha_without_dissipation_is_the_trapezoidal_rule():
    """Also with steps of different sizes."""
    bars = [vibrating(scheme=scheme)[0] for scheme in (Newmark(), GeneralisedAlpha(1.0))]
    for dt in np.random.default_rng(0).uniform(0.1, 2.0, 20):
        for bar in bars:
            bar.step(dt)
        np.testing.assert_allclose(bars[0].motion, bars[1].motion, atol=1e-8 * AMPLITUDE)


# -- loads and supports -----------------------------------------------------------------------------------------------


def test_sudden_load_swings_to_twice_the_static_displacement():
    stress = 0.01
    bar = make_bar(
        cells=1, length=1.0, loads=lambda state, end: [Traction(state, end, (stress, 0.0), lambda t: 1.0)]
    )  # fmt: skip
    omega = np.sqrt(3 * E / RHO)
    dt = np.pi / omega / 100
    tip = []
    for i in range(1, 151):
        bar.step(dt)
        tip.append(bar.motion[0])
        assert abs(bar.mechanics.audit.closure) < 1e-10, i
    assert max(tip) == pytest.approx(2 * stress / E, rel=1e-3)


def test_free_body_accelerates_uniformly():
    """No support holds it: a = F/m from the first step on, and the reaction-free solve stops at the right time."""
    stress = 0.05
    bar = make_bar(wall=None, loads=lambda state, end: [Traction(state, end, (stress, 0.0), lambda t: 1.0)])
    for dt in (0.3, 0.1, 0.2):
        bar.step(dt)
    momentum = bar.mechanics.inertia.momentum()
    np.testing.assert_allclose(momentum, [0.6 * stress, 0.0], rtol=1e-9, atol=1e-15)
    assert abs(bar.mechanics.audit.closure) < 1e-10


@pytest.mark.parametrize("scheme", [Newmark(), GeneralisedAlpha(0.6)], ids=str)
def test_work_of_a_moving_support_is_the_energy_gained(scheme):
    bar = make_bar(wall=lambda t: 0.1 * (1 - np.cos(0.7 * t)), scheme=scheme)
    for _ in range(40):
        bar.step(0.2)
    audit = bar.mechanics.audit
    assert audit.external > 0.01
    gained = -audit.initial + audit.entries["strain"] + audit.entries["kinetic"] + audit.entries["numerical"]
    assert audit.external == pytest.approx(gained, rel=1e-10)
    assert abs(audit.entries["numerical"]) < 0.1 * audit.external


@pytest.mark.parametrize("scheme", [Newmark(), GeneralisedAlpha(0.6)], ids=str)
def test_supports_of_a_rigid_motion_carry_mass_times_acceleration(scheme):
    """Constant acceleration of all nodes, from the first step on, without ringing."""
    b = make_blocks()
    cells = np.union1d(b.lower, b.upper)
    supports = b.drive(cells, (lambda t: 0.5 * t + 0.15 * t**2, lambda t: -0.3 * t), name="all")
    mechanics = Mechanics(b.state, [b.solid(density=RHO)], supports, analysis="dynamic", scheme=scheme)
    rows = history(mechanics, 1.0, StepControl.fixed(0.2))
    np.testing.assert_allclose(rows["all_x_force"], 0.3 * RHO)
    np.testing.assert_allclose(rows["all_y_force"], 0.0, atol=1e-12)
    np.testing.assert_allclose(rows["velocity_max"], np.hypot(0.5 + 0.3 * rows["time"], 0.3))
    np.testing.assert_allclose(rows["energy_kinetic"], 0.5 * RHO * rows["velocity_max"] ** 2)
    np.testing.assert_allclose(rows["energy_closure"], 0, atol=1e-12)


# -- impact -----------------------------------------------------------------------------------------------------------

GAP, FAST, SLOW = 0.02, 0.06, -0.02


def impact(comm=MPI.COMM_WORLD, n=4, law=None, material=None, **options):
    """Two halves of the unit square a gap apart, flying towards each other."""
    b = make_blocks(2, n, comm)
    b.move(lambda x: 0 * x, lambda x: np.array([0 * x[0], 0 * x[0] + (GAP if law is None else 0)]))
    b.state.commit()
    terms = [b.solid(material or LinearElastic(E, 0.0), density=RHO), b.crack(law, contact=PenaltyContact(100.0))]
    mechanics = Mechanics(b.state, terms, analysis="dynamic", **options)
    speeds = (FAST, SLOW) if law is None else (-1.0, 1.0)
    for cells, speed in zip((b.lower, b.upper), speeds, strict=True):
        mechanics.inertia.set_velocity((0.0, speed), cells)
    return b, mechanics


@pytest.mark.parametrize("scheme", [Newmark(), GeneralisedAlpha(0.8)], ids=str)
def test_impact_keeps_momentum_and_energy(scheme):
    """Equal bars exchange their velocities in the time 2 L/c in which a wave runs to and fro (thin-bar theory)."""
    b, mechanics = impact(n=8, scheme=scheme, tolerances=Tolerances(rtol=1e-12))
    initial = 0.5 * RHO * (FAST + SLOW)
    until = GAP / (FAST - SLOW) + 2 * 0.5 / np.sqrt(E / RHO) + 0.2
    momenta, audits = [], []

    def watch(report):
        momenta.append(mechanics.inertia.momentum())
        audits.append(mechanics.audit)

    run(mechanics, until, StepControl.fixed(0.005), watch)
    np.testing.assert_allclose(np.array(momenta)[:, 1], initial, rtol=1e-10)
    np.testing.assert_allclose(np.array(momenta)[:, 0], 0.0, atol=1e-10 * initial)
    assert max(abs(a.closure) for a in audits) < 1e-3
    assert audits[0].initial == pytest.approx(0.25 * RHO * (FAST**2 + SLOW**2))
    v = mechanics.inertia.velocity
    dx = [b.state.measures.cells(cells) for cells in (b.lower, b.upper)]
    after = [2 * integrate(form(v[1] * m)) for m in dx]
    np.testing.assert_allclose(after, [SLOW, FAST], atol=0.05 * (FAST - SLOW))


def block_on_plane(n, height, contact, friction=None):
    """The unit square above a rigid plane: its state, facets at the bottom and at the top, and the plane."""
    domain = mesh.create_unit_square(MPI.COMM_SELF, n, n, mesh.CellType.quadrilateral)
    state = State(fem.functionspace(domain, ("Lagrange", 1, (2,))))
    bottom, top = (mesh.locate_entities_boundary(domain, 1, lambda x, at=at: np.isclose(x[1], at)) for at in (0, 1))
    path, surface = ToolPath(lambda t: np.array([0.5, height])), Surface.exterior(state, bottom)
    shape = Plane((0.0, 1.0))
    return state, top, ToolContact(state, shape, path, [surface], contact=contact, friction=friction, name="plane")


def test_block_bounces_off_a_rigid_plane():
    """The impulse of the plane is the change of momentum; the block, a bar, flies back with its velocity."""
    speed, gap, dt = 0.05, 0.01, 0.0025
    state, _, plane = block_on_plane(8, -gap, PenaltyContact(100.0))
    solid = Solid(state, LinearElastic(E, 0.0), density=RHO)
    mechanics = Mechanics(state, [solid, plane], analysis="dynamic", tolerances=Tolerances(rtol=1e-11))
    mechanics.inertia.set_velocity((0.0, -speed))
    momenta, forces, closures = [-RHO * speed], [0.0], []
    for _ in range(round((gap / speed + 2 / np.sqrt(E / RHO) + 0.2) / dt)):
        step(mechanics, dt)
        momenta.append(mechanics.inertia.momentum()[1])
        forces.append(-plane.force()[1])
        closures.append(mechanics.audit.closure)
    impulse = dt * np.cumsum(np.add(forces[1:], forces[:-1])) / 2
    np.testing.assert_allclose(np.subtract(momenta[1:], momenta[0]), impulse, atol=1e-8 * RHO * speed)
    assert momenta[-1] == pytest.approx(RHO * speed, rel=0.05), "but for what the mesh keeps as vibration"
    assert np.abs(closures).max() < 1e-4


def test_friction_brakes_a_sliding_block():
    """Pressed by p on a plane, a block slows down by μ p A/m; the energy lost is the work of friction."""
    mu, p, speed, dt = 0.3, 0.02, 0.1, 0.02
    contact = PenaltyContact(20.0)
    state, top, plane = block_on_plane(2, p / contact.stiffness, contact, Coulomb(mu))  # as deep as p needs
    load = Traction(state, top, (0.0, -p), lambda t: 1.0)
    terms = [Solid(state, NeoHookean(1e3, 0.0), density=RHO), load, plane]
    mechanics = Mechanics(
        state, terms, analysis="dynamic", scheme=GeneralisedAlpha(0.5), tolerances=Tolerances(rtol=1e-10)
    )
    mechanics.inertia.set_velocity((speed, 0.0))
    for i in range(1, 51):
        step(mechanics, dt)
        assert mechanics.inertia.momentum()[0] == pytest.approx(RHO * speed - mu * p * dt * i, rel=0.002)
    audit = mechanics.audit
    assert audit.entries["friction"] == pytest.approx(mu * p * (speed - 0.5 * mu * p / RHO), rel=0.02)
    # friction jumps in the first step, over which the trapezoidal rule errs by half its work
    assert abs(audit.closure) * audit.scale < 0.6 * mu * p * speed * dt


def test_blocks_that_tear_apart_pay_the_toughness_with_kinetic_energy():
    law = Exponential(toughness=0.1, opening=0.05, shear_toughness=0.1, shear_opening=0.05)
    _, mechanics = impact(law=law, tolerances=Tolerances(rtol=1e-11))
    rows = history(mechanics, 0.6, StepControl.fixed(0.005))
    assert rows["energy_fracture"][-1] == pytest.approx(0.1, rel=1e-3)
    lost = rows["energy_initial"] - rows["energy_kinetic"] - rows["energy_strain"]
    assert lost[-1] == pytest.approx(0.1, rel=5e-3)
    assert np.abs(rows["energy_closure"]).max() < 1e-3


@pytest.mark.mpi
@pytest.mark.parametrize("mass", ["consistent", "lumped"])
def test_motion_does_not_depend_on_the_number_of_ranks(mass):
    def rows(comm):
        options = {"scheme": GeneralisedAlpha(0.7), "mass": mass, "tolerances": Tolerances(rtol=1e-11)}
        _, mechanics = impact(comm, material=NeoHookean(E, 0.3), **options)
        return history(mechanics, 1.0, StepControl.fixed(0.04))

    together, alone = rows(MPI.COMM_WORLD), rows(MPI.COMM_SELF)
    assert alone["energy_contact"].max() > 1e-5
    for name, values in alone.items():
        scale = 1.0 if name == "energy_closure" else max(np.abs(values).max(), 1e-6)
        np.testing.assert_allclose(together[name], values, atol=1e-8 * scale, err_msg=name)


# -- mass, tangent, phases --------------------------------------------------------------------------------------------


@pytest.mark.mpi
@pytest.mark.parametrize(
    ("cell", "degree"),
    [("triangle", 1), ("quadrilateral", 1), ("quadrilateral", 2), ("tetrahedron", 1), ("hexahedron", 1)],
)
def test_lumped_and_consistent_mass_agree(cell, degree):
    """In the momentum of a rigid body, which is its mass times the velocity; nodal masses are positive."""
    kind = mesh.CellType[cell]
    domain = (
        mesh.create_unit_square(MPI.COMM_WORLD, 3, 2, kind)
        if cell in ("triangle", "quadrilateral")
        else mesh.create_unit_cube(MPI.COMM_WORLD, 2, 2, 2, kind)
    )
    gdim = domain.geometry.dim
    for mass in ("consistent", "lumped"):
        state = State(fem.functionspace(domain, ("Lagrange", degree, (gdim,))))
        solid = Solid(state, LinearElastic(E, 0.3), density=RHO)
        inertia = Mechanics(state, [solid], analysis="dynamic", mass=mass).inertia
        inertia.set_velocity(np.arange(1.0, gdim + 1))
        np.testing.assert_allclose(inertia.momentum(), RHO * np.arange(1, gdim + 1))
        nodal = inertia.mass.times(np.ones_like(state.u.x.array))
        assert state.mesh.comm.allreduce(nodal.min(initial=np.inf), MPI.MIN) > 0


@pytest.mark.parametrize("mass", ["consistent", "lumped"])
def test_tangent_of_the_step(mass):
    b = make_blocks()
    solid = b.solid(NeoHookean(E, 0.3), density=RHO)
    mechanics = Mechanics(b.state, [solid], analysis="dynamic", scheme=GeneralisedAlpha(0.6), mass=mass)
    mechanics.inertia.set_velocity((0.2, 0.1))
    begin(mechanics, 0.5)

    class Both:
        entity_maps = None

        def residual(self, v):
            return sum((t.residual(v) for t in mechanics.terms), start=ufl.Form([]))

    problem = Linearised(Both(), b.state)
    u, w = smooth(b.state.V, 1, 0.2), smooth(b.state.V, 7, 1.0)
    remainders = problem.remainders(u, w)
    assert remainders[0] > 1e-9
    assert slopes(STEPS, remainders).min() > 1.95
    matrix = problem.matrix(u)
    assert np.linalg.norm(matrix - matrix.T) < 1e-12 * np.linalg.norm(matrix)
    static = Linearised(solid, b.state).matrix(u)
    assert np.linalg.norm(matrix - static) > 0.1 * np.linalg.norm(static)


@pytest.mark.mpi
def test_rejected_step_leaves_no_trace():
    def snapshot(mechanics):
        inertia, state = mechanics.inertia, mechanics.state
        fields = (state.u, state.u_old, inertia.velocity, inertia.acceleration)
        return *(f.x.array.copy() for f in fields), mechanics.audit, mechanics.record()

    _, mechanics = impact(scheme=GeneralisedAlpha(0.5), material=NeoHookean(E, 0.3))
    run(mechanics, 0.4, StepControl.fixed(0.05))
    before = snapshot(mechanics)
    begin(mechanics, 0.5)
    assert mechanics.solve().converged
    mechanics.evaluate()
    assert not np.array_equal(mechanics.inertia.velocity.x.array, before[2])
    first = snapshot(mechanics)
    mechanics.state.rollback()
    for now, then in zip(snapshot(mechanics), before, strict=True):
        np.testing.assert_equal(now, then)
    begin(mechanics, 0.5)
    mechanics.solve()
    mechanics.evaluate()
    for now, then in zip(snapshot(mechanics)[:4], first[:4], strict=True):
        np.testing.assert_allclose(now, then, rtol=1e-9, atol=1e-14)


# -- refusals ---------------------------------------------------------------------------------------------------------


def dynamic(b, *terms, **options):
    return Mechanics(b.state, terms, analysis="dynamic", **options)


@pytest.mark.mpi
@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda b: dynamic(b, b.solid(name="liver")), "density of liver = None"),
        (lambda b: dynamic(b, b.crack(BILINEAR)), "terms = "),
        (lambda b: b.solid(density=-1.0), "density = -1.0"),
        (lambda b: b.solid(density=0.0), "density = 0.0"),
        (lambda b: GeneralisedAlpha(1.1), "rho_inf = 1.1"),
        (lambda b: GeneralisedAlpha(-0.1), "rho_inf = -0.1"),
        (lambda b: Newmark(beta=0.0), "beta = 0.0"),
        (lambda b: Newmark(gamma=0.4), "gamma = 0.4"),
        (lambda b: Mechanics(b.state, [b.solid()], analysis="static"), "analysis = 'static'"),
        (lambda b: dynamic(b, b.solid(density=1.0), scheme=0.8), "scheme = 0.8"),
        (lambda b: dynamic(b, b.solid(density=1.0), mass="diagonal"), "mass = 'diagonal'"),
        (lambda b: dynamic(b, b.solid(density=1.0)).inertia.set_velocity((1.0,)), "velocity = "),
    ],
)
def test_refuses_bad_input(make, message):
    with pytest.raises(ValueError, match=f"{message}.* is not allowed"):
        make(make_blocks())


def test_refuses_masses_that_would_vanish():
    domain = mesh.create_unit_square(MPI.COMM_SELF, 1, 1)
    state = State(fem.functionspace(domain, ("Lagrange", 2, (2,))))
    with pytest.raises(ValueError, match=r"mass = 'lumped' is not allowed: .* triangle of degree 2"):
        Mechanics(state, [Solid(state, LinearElastic(E, 0.3), density=RHO)], analysis="dynamic", mass="lumped")


def test_refuses_a_late_initial_velocity():
    bar, _ = oscillator()
    bar.step(0.1)
    with pytest.raises(ValueError, match=r"velocity = .* before the first step"):
        bar.mechanics.inertia.set_velocity((1.0, 0.0))
