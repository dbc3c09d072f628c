"""Deformation that heats bodies, and the one balance of mechanics and heat: total energy, entropy, available energy."""

from math import exp, log

import numpy as np
import pytest
from dolfinx import fem, mesh
from mpi4py import MPI
from scipy.optimize import brentq

from cutsim import (
    ContactHeat,
    Coulomb,
    Exponential,
    HeatBody,
    HeatTransfer,
    InterfaceHeat,
    LinearElastic,
    Mechanics,
    NeoHookean,
    PenaltyContact,
    Prony,
    Solid,
    State,
    StepControl,
    Support,
    Temperature,
    ThermoElastic,
    ThermoMechanics,
    Tolerances,
    cracked_space,
)
from cutsim.base.compat import cell_partitioner
from helpers.blocks import make_blocks
from helpers.laws import NU, E
from helpers.runs import history

WARMTH, CAPACITY = 300.0, 0.02
G, LAME = E / 2 / (1 + NU), E * NU / (1 + NU) / (1 - 2 * NU)


def drawn(stretch, material, law=None, steps=10, iterate=1e-11, **options):
    """History of an insulated square that is drawn along x in unit time, and held along y."""
    domain = mesh.create_unit_square(MPI.COMM_WORLD, 2, 2, mesh.CellType.quadrilateral, partitioner=cell_partitioner())
    state = State(fem.functionspace(domain, ("Lagrange", 1, (2,))))
    T = Temperature(state, fem.functionspace(domain, ("Lagrange", 1)), WARMTH)
    thermal = {} if law is None else {"thermoelastic": law, "temperature": T}
    solid = Solid(state, material, volumetric="full", density=1.0, **thermal, **options)

    def face(axis, at):
        return mesh.locate_entities_boundary(domain, 1, lambda x: np.isclose(x[axis], at))

    supports = [Support(state, face(i, at), i) for i, at in ((0, 0.0), (1, 0.0), (1, 1.0))]
    supports.append(Support(state, face(0, 1.0), 0, lambda t: (stretch - 1) * np.sin(np.pi / 2 * t), name="end"))
    mechanics = Mechanics(state, [solid], supports, tolerances=Tolerances(rtol=1e-12))
    body = HeatBody(T, capacity=CAPACITY, conductivity=1.0, body=solid, deformation=True)
    problem = ThermoMechanics(mechanics, HeatTransfer(T, [body]), iterate=iterate)
    return history(problem, 1.0, StepControl.fixed(1 / steps))


@pytest.mark.mpi
@pytest.mark.parametrize("stretch", [1 + 1e-4, 1 - 1e-4])
def test_a_thermoelastic_body_cools_when_it_is_drawn(stretch):
    """By T α Δσ/(ρ c), the sum of the stresses in place of σ: here 3 K ε, K the bulk modulus (Kelvin 1853)."""
    alpha = 1e-4
    rows = drawn(stretch, LinearElastic(E, NU), ThermoElastic(alpha, WARMTH))
    change = rows["body_temperature"][-1] - WARMTH
    bulk = LAME + 2 / 3 * G
    # c is the specific heat of a body that expands freely; that at constant volume is smaller by 9 K α² T/ρ
    exact = -3 * bulk * alpha * WARMTH * (stretch - 1) / (CAPACITY - 9 * bulk * alpha**2 * WARMTH)
    assert change == pytest.approx(exact, rel=1e-3)
    assert rows["heat_deformation"][-1] == pytest.approx(CAPACITY * change, rel=1e-9)
    assert abs(rows["total_entropy"]).max() < 1e-3 * CAPACITY * abs(log(1 + change / WARMTH)), "it is reversible"


def test_rubber_warms_when_it_is_drawn():
    """Its shear modulus grows with T: ρ c ln(T/T₀) = β G e^(β(T − T₀)) w keeps the entropy, w = W/G (Gough 1805)."""
    beta, stretch = 1 / WARMTH, 1.5
    w = 0.5 * (stretch**2 - 1) - log(stretch)

    def entropy(T):
        return CAPACITY * log(T / WARMTH) - beta * G * exp(beta * (T - WARMTH)) * w

    expected, errors = brentq(entropy, WARMTH, WARMTH + 50) - WARMTH, []
    for steps in (5, 10):
        rows = drawn(stretch, NeoHookean(E, NU), ThermoElastic(0.0, WARMTH, softening=beta), steps)
        assert rows["body_temperature"][-1] - WARMTH == pytest.approx(expected, rel=5e-5)
        errors.append([rows["total_entropy"][-1], rows["total_energy"][-1] - rows["work_external"][-1]])
    assert np.log2(np.divide(*np.abs(errors))).min() > 1.8, "what is missing of both falls with the square of the step"


@pytest.mark.parametrize(
    "options", [{"viscosity": 0.05}, {"relaxation": Prony(strengths=(0.5,), times=(0.2,))}], ids=["viscous", "relaxing"]
)
def test_what_is_dissipated_warms_the_body(options):
    rows = drawn(1.3, NeoHookean(E, NU), steps=20, **options)
    assert rows["energy_viscous"][-1] > 1e-3
    np.testing.assert_allclose(rows["heat_deformation"], rows["energy_viscous"], rtol=1e-10)
    warmed = CAPACITY * (rows["body_temperature"] - WARMTH)
    np.testing.assert_allclose(warmed, rows["energy_viscous"], rtol=1e-9)
    np.testing.assert_allclose(rows["total_energy"], rows["work_external"], atol=2e-3 * rows["work_external"][-1])
    assert np.diff(rows["total_entropy"]).min() > 0


def test_only_a_solid_is_heated_by_its_deformation():
    b = make_blocks()
    T = Temperature(b.state, cracked_space(b.state.mesh, ("Lagrange", 1), b.facets), WARMTH)
    with pytest.raises(ValueError, match="deformation = True is not allowed: it must be False without a Solid"):
        HeatBody(T, density=1.0, capacity=1.0, conductivity=1.0, deformation=True)


END = 0.6  # of the motion of the supports


def left_alone():
    """Two blocks, torn off each other and rubbing, are moved until `END` and swing between fixed supports then."""
    b = make_blocks(2, 4)
    T = Temperature(b.state, cracked_space(b.state.mesh, ("Lagrange", 1), b.facets), lambda x: WARMTH + 5 * x[0])
    law = Exponential(toughness=4e-4, opening=0.01, shear_toughness=2e-4, shear_opening=0.02)
    crack = b.crack(law, contact=PenaltyContact(50.0), friction=Coulomb(0.3, stiffness=100.0))
    expansion = ThermoElastic(1e-4, WARMTH, softening=-1e-3)
    solid = b.solid(
        NeoHookean(E, NU), thermoelastic=expansion, temperature=T, density=0.01, viscosity=0.01, volumetric="full"
    )

    def moved(t, first, then):
        return float(np.interp(t, (0.0, END / 3, END), (0.0, first, then)))

    supports = [Support(b.state, b.face(1, 0.0), i) for i in range(2)]
    for axis, ways in ((1, (-0.02, -0.02)), (0, (0.0, 0.1))):
        supports.append(
            Support(b.state, b.face(1, 1.0), axis, lambda t, ways=ways: moved(t, *ways), corners=(END / 3, END))
        )
    mechanics = Mechanics(b.state, [solid, crack], supports, analysis="dynamic", tolerances=Tolerances(rtol=1e-10))
    body = HeatBody(T, capacity=0.2, conductivity=0.5, body=solid, deformation=True)
    contact = InterfaceHeat(T, crack, ContactHeat(3.0, 1.0, capacity=1e-3, fracture_fraction=0.9))
    return ThermoMechanics(mechanics, HeatTransfer(T, [body, contact]), iterate=1e-9)


@pytest.mark.mpi
def test_available_energy_of_what_is_left_alone_never_grows():
    """Total energy stays, entropy grows, and so V = E − T₀ S falls (thesis C.53), whatever turns into what."""
    rows = history(left_alone(), 1.0, StepControl.fixed(0.01))
    alone = rows["time"] > END + 0.015  # the corner of the motion costs an audit of time steps more than the rest
    lost = rows["energy_friction"] + rows["energy_viscous"]
    assert np.ptp(lost[alone]) > 0.1 * lost[-1], "much is dissipated then"
    assert np.ptp(rows["work_external"][alone]) == 0.0
    moved = rows["work_external"][-1]
    assert np.ptp(rows["total_energy"][alone]) < 5e-3 * moved
    assert np.diff(rows["total_entropy"]).min() > 0
    assert np.diff(rows["available_energy"][alone]).max() < 1e-5 * moved, "beside what the steps miss of the energy"
    # all that is dissipated is no longer available, and what the conduction of heat wastes is not either
    assert rows["available_energy"][alone][0] - rows["available_energy"][-1] > 0.95 * np.ptp(lost[alone])
    # the same balance while work is done: what is missing is missing in the audits
    missing = rows["energy_closure"] * np.maximum.accumulate(np.maximum(abs(rows["work_external"]), 1e-12))
    np.testing.assert_allclose(rows["total_energy"], rows["work_external"], atol=2 * abs(missing).max())
