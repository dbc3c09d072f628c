"""Heat and mechanics together: expansion, softening, staggered step, friction heat, rollback, recording, ranks."""

import numpy as np
import pytest
from dolfinx import fem, mesh
from mpi4py import MPI
from scipy.optimize import brentq

from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.staggered import ThermoMechanics
from cutsim.analysis.stepping import StepControl, begin, run
from cutsim.base.compat import cell_partitioner
from cutsim.bodies.loads import Support
from cutsim.bodies.solid import Solid
from cutsim.fields.space import cracked_space
from cutsim.fields.state import State
from cutsim.fields.temperature import Temperature
from cutsim.heat.boundary import PrescribedTemperature
from cutsim.heat.conduction import HeatBody
from cutsim.heat.contact_heat import ContactHeat
from cutsim.heat.interface_heat import InterfaceHeat
from cutsim.heat.transfer import HeatTransfer
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.crack_friction import CrackFriction
from cutsim.interface.friction import Coulomb
from cutsim.interface.rubbing import Friction
from cutsim.materials.elastic import LinearElastic, NeoHookean
from cutsim.materials.thermoelastic import ThermoElastic
from cutsim.results.output import read_history
from cutsim.results.recording import Recording
from cutsim.solvers.convergence import Tolerances
from helpers.blocks import make_blocks
from helpers.coupled import coupled
from helpers.fields import smooth
from helpers.laws import NU, E
from helpers.output import written
from helpers.runs import history
from helpers.tangents import assert_slope_two

G, LAME = E / 2 / (1 + NU), E * NU / (1 + NU) / (1 - 2 * NU)
ALPHA, RISE = 1e-3, 100.0
STRETCH = 1 + ALPHA * RISE


class HotCube:
    """The unit square or cube, warmed evenly from 300 in unit time, resting on planes through the origin."""

    def __init__(self, material, law, gdim=3, rise=RISE, plane="strain", supports=(), iterate=1e-9):
        partitioner = cell_partitioner()
        create = (mesh.create_unit_square, mesh.create_unit_cube)[gdim - 2]
        kind = (mesh.CellType.quadrilateral, mesh.CellType.hexahedron)[gdim - 2]
        domain = create(MPI.COMM_WORLD, *(2,) * gdim, kind, partitioner=partitioner)
        self.state = State(fem.functionspace(domain, ("Lagrange", 1, (gdim,))))
        self.T = Temperature(self.state, fem.functionspace(domain, ("Lagrange", 1)), 300.0)
        self.solid = Solid(
            self.state, material, plane=plane, volumetric="full", thermoelastic=law, temperature=self.T, density=1.0
        )
        rest = [Support(self.state, self.face(i, 0.0), i, name=f"rest_{i}") for i in range(gdim)]
        held = [Support(self.state, self.face(i, at), j, value, name=name) for i, at, j, value, name in supports]
        mechanics = Mechanics(self.state, [self.solid], [*rest, *held], tolerances=Tolerances(rtol=1e-11))
        cells = np.arange(domain.topology.index_map(gdim).size_local, dtype=np.int32)
        warm = PrescribedTemperature(self.T, cells, lambda t: 300 + rise * t, dim=gdim)
        heat = HeatTransfer(self.T, [HeatBody(self.T, capacity=1.0, conductivity=1.0, body=self.solid)], [warm])
        self.problem = ThermoMechanics(mechanics, heat, iterate=iterate)

    def face(self, axis, at):
        fdim = self.state.mesh.topology.dim - 1
        return mesh.locate_entities_boundary(self.state.mesh, fdim, lambda x: np.isclose(x[axis], at))

    def run(self, steps=2):
        return history(self.problem, 1.0, StepControl.fixed(1 / steps))


# -- thermal expansion ------------------------------------------------------------------------------------------------


@pytest.mark.mpi
@pytest.mark.parametrize(("gdim", "plane"), [(3, "strain"), (2, "stress")])
@pytest.mark.parametrize("material", [NeoHookean(E, NU), LinearElastic(E, NU)])
def test_free_body_expands_without_stress(material, gdim, plane):
    cube = HotCube(material, ThermoElastic(ALPHA, 300.0), gdim, plane=plane)
    rows = cube.run()
    exact = fem.Function(cube.state.V)
    exact.interpolate(lambda x: (STRETCH - 1) * x[:gdim])
    np.testing.assert_allclose(cube.state.u.x.array, exact.x.array, atol=1e-9)
    assert abs(rows["rest_0_force"][-1]) < 1e-8
    assert rows["energy_strain"][-1] < 1e-12


def test_clamped_bar():
    """Warmed between rigid ends, free at the sides: exact for the neo-Hookean solid, −E α ΔT in the limit."""
    held = [(0, 1.0, 0, 0.0, "end")]

    def stresses(across, stretch):
        """P₁ and P₂ of F = diag(1, λ, λ), W(F/ϑ) per volume of the expanded body."""
        along, sides, J = 1 / stretch, across / stretch, across**2 / stretch**3
        return [stretch**2 * (G * (x - 1 / x) + LAME * np.log(J) / x) for x in (along, sides)]

    rows = HotCube(NeoHookean(E, NU), ThermoElastic(ALPHA, 300.0), supports=held).run()
    across = brentq(lambda x: stresses(x, STRETCH)[1], 1.0, 1.5)
    assert rows["end_force"][-1] == pytest.approx(stresses(across, STRETCH)[0], rel=1e-8)
    for material in (NeoHookean(E, NU), LinearElastic(E, NU)):
        rows = HotCube(material, ThermoElastic(1e-6, 300.0), supports=held).run()
        assert rows["end_force"][-1] == pytest.approx(-E * 1e-6 * RISE, rel=1e-3)


def test_expansion_from_another_reference():
    """At the reference temperature the body has its reference shape, wherever it starts."""
    cube = HotCube(NeoHookean(E, NU), ThermoElastic(ALPHA, 300.0 + RISE))
    cube.run()
    np.testing.assert_allclose(cube.state.u.x.array, 0.0, atol=1e-9)


@pytest.mark.mpi
def test_shear_modulus_falls_with_temperature():
    """Confined stretch of a body that does not expand: P = G(T) (λ − 1/λ) + λ_L ln λ/λ."""
    beta, stretch = -0.005, 1.3
    stretched = [(0, 1.0, 0, 0.0, None), (1, 1.0, 1, stretch - 1, "top")]
    rows = HotCube(NeoHookean(E, NU), ThermoElastic(0.0, 300.0, softening=beta), 2, supports=stretched).run(4)
    shear = G * np.exp(beta * RISE * rows["time"])
    expected = shear * (stretch - 1 / stretch) + LAME * np.log(stretch) / stretch
    np.testing.assert_allclose(rows["top_force"], expected, rtol=1e-9)


@pytest.mark.parametrize(("gdim", "plane"), [(3, "strain"), (2, "strain"), (2, "stress")])
def test_tangent(gdim, plane):
    b = make_blocks(gdim)
    T = Temperature(b.state, cracked_space(b.state.mesh, ("Lagrange", 1), b.facets), lambda x: 300 + 100 * x[0])
    law = ThermoElastic(ALPHA, 320.0, softening=0.0 if plane == "stress" else -0.01)
    solid = b.solid(NeoHookean(E, NU), plane=plane, thermoelastic=law, temperature=T)
    assert_slope_two(solid, b.state, smooth(b.state.V, 1, 0.2), 1.0)


# -- energy -----------------------------------------------------------------------------------------------------------


def test_audit_of_a_clamped_body():
    """Its strain energy 9/2 K (α ΔT)² is brought by heat alone, also what it has at the start."""
    clamped = [(i, 1.0, i, 0.0, None) for i in range(3)]
    rows = HotCube(LinearElastic(E, NU), ThermoElastic(1e-6, 250.0), supports=clamped).run(4)
    stored = 4.5 * E / 3 / (1 - 2 * NU) * (1e-6 * (50 + RISE * rows["time"])) ** 2
    np.testing.assert_allclose(rows["energy_strain"], stored, rtol=1e-3)
    np.testing.assert_allclose(rows["energy_thermoelastic"], -rows["energy_strain"], rtol=1e-9)
    assert np.abs(rows["energy_closure"]).max() < 1e-9


@pytest.mark.parametrize("iterate", [None, 1e-9])
def test_audit_of_a_warmed_linear_body_closes(iterate):
    """Warmed and stretched at once, the trapezoidal rule is exact for a linear body."""
    pulled = [(0, 1.0, 0, lambda t: 1e-5 * np.sin(3 * t), "end")]
    cube = HotCube(LinearElastic(E, NU), ThermoElastic(1e-7, 300.0), supports=pulled, iterate=iterate)
    rows = cube.run(10)
    assert np.abs(rows["energy_closure"]).max() < 1e-4
    assert np.abs(rows["energy_thermoelastic"]).max() > 0.1 * rows["energy_strain"].max()


def test_audit_of_a_warmed_body_closes_with_the_square_of_the_step():
    drift = []
    for steps in (10, 20, 40):
        pulled = [(0, 1.0, 0, lambda t: 0.2 * np.sin(3 * t), "end")]
        law = ThermoElastic(ALPHA, 300.0, softening=-0.005)
        rows = HotCube(NeoHookean(E, NU), law, supports=pulled, iterate=None).run(steps)
        drift.append(abs(rows["energy_closure"][-1]))
    assert drift[-1] < 1e-3
    assert np.log2(np.divide(drift[:-1], drift[1:])).min() > 1.7, drift


# -- staggered step ---------------------------------------------------------------------------------------------------


def clamped_pair(iterate, conductance=50.0):
    """Two slabs that just touch between rigid walls, one heated: expansion presses them together."""
    b = make_blocks(2, 4)
    T = Temperature(b.state, cracked_space(b.state.mesh, ("Lagrange", 1), b.facets), 300.0)
    law = ThermoElastic(1e-4, 300.0)
    solid = b.solid(LinearElastic(E, NU), thermoelastic=law, temperature=T, density=1.0)
    crack = b.crack(None, contact=PenaltyContact(200.0), normal="reference")
    walls = [Support(b.state, b.face(1, at), 1) for at in (0.0, 1.0)]
    sides = [Support(b.state, np.concatenate([b.face(0, 0.0), b.face(0, 1.0)]), 0)]
    mechanics = Mechanics(b.state, [solid, crack], walls + sides, tolerances=Tolerances(rtol=1e-11))
    body = HeatBody(T, capacity=1.0, conductivity=1.0, body=solid)
    contact = InterfaceHeat(T, crack, ContactHeat(2 * conductance, 2 * conductance))
    held = [
        PrescribedTemperature(T, b.face(1, at), v, name=n) for at, v, n in ((0.0, 400.0, "hot"), (1.0, 300.0, "cold"))
    ]
    return ThermoMechanics(mechanics, HeatTransfer(T, [body, contact], held), iterate=iterate)


def test_pressure_of_expansion_opens_the_way_for_heat():
    """The steady state satisfies p = expansion/(compliance) and the flux its conductance γ p at once."""
    rows = history(clamped_pair(1e-9), 3e6, StepControl.fixed(1e6))
    modulus = LAME + 2 * G
    confined = (3 * LAME + 2 * G) * 1e-4

    def balance(p):
        flux = 100 / (1 + 1 / (50 * p))
        mean = 0.5 * (100 - flux * 0.25) + 0.5 * flux * 0.25  # of both slabs, above 300
        return p * (1 / modulus + 1 / 200) - confined / modulus * mean

    p = brentq(balance, 1e-6, 1.0)
    assert rows["hot_heat_flow"][-1] == pytest.approx(100 / (1 + 1 / (50 * p)), rel=2e-3)


def test_iteration_settles_what_one_pass_lags_behind():
    """In one large step: one pass conducts nothing yet, the iteration as much as it will."""
    once = history(clamped_pair(None), 1e6, StepControl.fixed(1e6))
    settled = history(clamped_pair(1e-9), 1e6, StepControl.fixed(1e6))
    steady = history(clamped_pair(1e-9), 2e6, StepControl.fixed(1e6))
    assert abs(once["cold_heat_flow"][-1]) < 1e-6
    assert settled["cold_heat_flow"][-1] == pytest.approx(steady["cold_heat_flow"][-1], rel=1e-4)


# -- friction ---------------------------------------------------------------------------------------------------------


def rubbing(gdim=2, law=None, coulomb=None, comm=MPI.COMM_WORLD, capacity=2.0, hot=None):
    """A block pressed on another and slid by less than an element."""
    b = make_blocks(gdim, 4, comm)
    T = Temperature(b.state, cracked_space(b.state.mesh, ("Lagrange", 1), b.facets), 300.0)
    crack = b.crack(None, contact=PenaltyContact(50.0))
    friction = CrackFriction(crack, Friction(coulomb or Coulomb(0.3, stiffness=1e4), temperature=T))
    law = law or ContactHeat(3.0, 1.0)
    times = (0.0, 1.0, 3.0)
    moved = [
        lambda t: np.interp(t, times, (0, 0, 0.1)),
        *[0.0] * (gdim - 2),
        lambda t: np.interp(t, times, (0, -0.02, -0.02)),
    ]
    supports = b.drive(b.lower, [0.0] * gdim) + b.drive(b.upper, moved, name="upper")
    for support in supports:
        support.corners = (1.0,)
    mechanics = Mechanics(b.state, [b.solid(), crack, friction], supports)
    bodies = [
        HeatBody(T, density=1.0, capacity=capacity, conductivity=0.5, body=cells, name=name)
        for name, cells in (("lower", b.lower), ("upper_body", b.upper))
    ]
    contact = InterfaceHeat(T, crack, law, friction)
    held = [] if hot is None else [PrescribedTemperature(T, b.upper, hot, dim=gdim)]
    return ThermoMechanics(mechanics, HeatTransfer(T, [*bodies, contact], held))


@pytest.mark.mpi
@pytest.mark.parametrize("gdim", [2, 3])
def test_block_on_block(gdim):
    """Σ m c ΔT is the friction work of the audit, and that is μ p s."""
    rows = history(rubbing(gdim), 3.0, StepControl.fixed(0.1))
    warmed = 2.0 * 0.5 * (rows["lower_temperature"] + rows["upper_body_temperature"] - 600)
    np.testing.assert_allclose(warmed, rows["energy_friction"], rtol=1e-6, atol=1e-12)
    assert warmed[-1] == pytest.approx(0.3 * 50 * 0.02 * 0.1, rel=5e-3)
    assert np.abs(rows["heat_closure"]).max() < 1e-9
    assert rows["crack_contact_dissipation_min"].min() > -1e-30
    assert np.diff(rows["crack_entropy"]).min() >= 0


def test_block_on_block_shares_by_conductance():
    """Bodies too heavy to warm: γ⁺ : γ⁻."""
    rows = history(rubbing(capacity=1e9), 3.0, StepControl.fixed(0.1))
    plus, minus = rows["crack_heat_flow_plus"][-1], rows["crack_heat_flow_minus"][-1]
    assert minus < 0 and plus / minus == pytest.approx(3.0, rel=1e-4)


def test_friction_falls_with_temperature():
    """μ(T) = μ (T_d − T)²/(T_d − T_ref)² of the hotter side (thesis B.21): a quarter of it half way to T_d."""
    problem = rubbing(coulomb=Coulomb(0.3, stiffness=1e4, T_ref=300.0, T_damage=500.0), hot=lambda t: 200 + 100 * t)
    rows = history(problem, 3.0, StepControl.fixed(0.125))
    rate = np.diff(rows["energy_friction"]) / np.diff(rows["time"])
    temperature = rows["temperature_max"][:-1]  # a step slides at the temperature of its start
    expected = 0.3 * 50 * 0.02 * 0.05 * ((500 - temperature) / 200) ** 2
    assert rate[-1] == pytest.approx(0.5 * (expected[-1] + expected[-2]), rel=1e-3)


# -- everything on ----------------------------------------------------------------------------------------------------


@pytest.mark.mpi
def test_all_books_close():
    rows = history(coupled(), 4.0, StepControl.fixed(0.02))
    assert np.abs(rows["energy_closure"]).max() < 0.01
    assert np.abs(rows["heat_closure"]).max() < 1e-9
    for name in ("energy_kinetic", "energy_fracture", "energy_friction", "energy_viscous", "energy_thermoelastic"):
        assert np.abs(rows[name]).max() > 0, name
    np.testing.assert_allclose(rows["heat_friction"], rows["energy_friction"], rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(rows["heat_fracture"], 0.9 * rows["energy_fracture"], rtol=1e-9, atol=1e-15)
    # dissipation is integrated with five points over the kinks of the interface law, hence the small allowance
    assert np.diff(rows["crack_entropy"]).min() > -1e-6 * rows["crack_entropy"][-1]


# -- two phases -------------------------------------------------------------------------------------------------------


def snapshot(problem):
    """Everything that a step changes."""
    parts = [problem.state.u, problem.heat.temperature.value]
    exchange = problem.heat.terms[-1].exchange
    arrays = [p.x.array.copy() for p in parts] + [exchange._contact.x.array.copy()]
    arrays += [exchange.point_values(n).copy() for n in ("flux_plus", "temperature", "dissipation")]
    numbers = [problem.state.time, problem.audit, problem.heat.audit, problem.heat.trial_audit, exchange.entropy]
    return arrays, numbers, problem.record()


@pytest.mark.mpi
def test_rollback_is_bit_for_bit():
    problem = rubbing(law=ContactHeat(3.0, 1.0, capacity=0.5))
    run(problem, 2.0, StepControl.fixed(0.25))
    arrays, numbers, columns = snapshot(problem)
    begin(problem, 2.7)
    assert problem.solve().converged
    problem.evaluate()
    assert problem.heat.trial_audit != numbers[2]
    problem.state.rollback()
    after = snapshot(problem)
    for a, b in zip(arrays, after[0], strict=True):
        np.testing.assert_array_equal(a, b)
    assert numbers == after[1]
    assert columns == after[2]


def test_a_rejected_step_leaves_no_trace():
    """The same end, to the bit, after an attempt that was given up."""
    ends = []
    for attempt in (False, True):
        problem = rubbing(law=ContactHeat(3.0, 1.0, capacity=0.5))
        run(problem, 2.0, StepControl.fixed(0.25))
        if attempt:
            begin(problem, 2.9)
            problem.solve()
            problem.evaluate()
            problem.state.rollback()
        run(problem, 2.5, StepControl.fixed(0.25))
        ends.append(problem.heat.temperature.value.x.array.copy())
    np.testing.assert_allclose(ends[0], ends[1], rtol=1e-13)


@pytest.mark.mpi
def test_ranks_agree():
    results = [history(rubbing(comm=comm), 3.0, StepControl.fixed(0.25)) for comm in (MPI.COMM_WORLD, MPI.COMM_SELF)]
    for name in ("lower_temperature", "upper_body_temperature", "temperature_max", "heat_friction", "crack_entropy"):
        np.testing.assert_allclose(results[0][name], results[1][name], rtol=1e-9, err_msg=name)


# -- recording --------------------------------------------------------------------------------------------------------


@pytest.mark.mpi
def test_recording(tmp_path):
    folder = MPI.COMM_WORLD.bcast(tmp_path)
    problem = rubbing()
    with Recording(folder, problem, 3.0, every=5) as record:
        run(problem, 3.0, StepControl.fixed(0.25), record)
    rows = read_history(folder / "history.csv")
    assert rows["temperature_max"][-1] > rows["lower_temperature"][-1] > 300
    assert {"heat_closure", "energy_closure", "crack_entropy"} <= set(rows)
    T = problem.heat.temperature
    shown = fem.Function(fem.functionspace(T.space.mesh, ("DG", 1)))
    shown.interpolate(T.value)
    cells = T.space.mesh.topology.index_map(T.space.mesh.topology.dim).size_local
    assert shown.x.array[: 4 * cells].tobytes() in written(folder, "fields.bp"), "both sides of the crack"


# -- refusals ---------------------------------------------------------------------------------------------------------


def test_bad_input_is_refused():
    with pytest.raises(ValueError, match="expansion = nan"):
        ThermoElastic(np.nan, 300.0)
    b = make_blocks()
    T = Temperature(b.state, fem.functionspace(b.state.mesh, ("Lagrange", 1)), 300.0)
    with pytest.raises(ValueError, match="given with thermoelastic"):
        b.solid(thermoelastic=ThermoElastic(1e-3, 300.0))
    with pytest.raises(ValueError, match="plane = 'stress'"):
        b.solid(thermoelastic=ThermoElastic(1e-3, 300.0, softening=-0.1), temperature=T, plane="stress")
    with pytest.raises(ValueError, match="with the state of the body"):
        make_blocks().solid(thermoelastic=ThermoElastic(1e-3, 300.0), temperature=T)
    mechanics = Mechanics(b.state, [b.solid()])
    heat = HeatTransfer(T, [HeatBody(T, density=1, capacity=1, conductivity=1)])
    with pytest.raises(ValueError, match="iterate = 0"):
        ThermoMechanics(mechanics, heat, iterate=0)
    other = rubbing()
    with pytest.raises(ValueError, match="a problem on the state of the mechanics"):
        ThermoMechanics(mechanics, other.heat)
