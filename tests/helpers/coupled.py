"""Problems with everything on."""

import numpy as np
from dolfinx import mesh
from mpi4py import MPI

from cutsim import (
    Ball,
    ContactHeat,
    Convection,
    Coulomb,
    Crack,
    Exponential,
    Friction,
    HeatBody,
    HeatTransfer,
    InterfaceHeat,
    Mechanics,
    NeoHookean,
    PairHeat,
    PenaltyContact,
    Pressure,
    Prony,
    Solid,
    Support,
    Surface,
    Temperature,
    ThermoElastic,
    ThermoMechanics,
    ToolContact,
    ToolPath,
    cracked_space,
)
from helpers.blocks import make_blocks
from helpers.boxes import stack
from helpers.laws import NU, E

# so weak that it is sheared off within a few steps
GLUE = Exponential(toughness=1e-6, opening=0.001, shear_toughness=5e-7, shear_opening=0.001)


def coupled(comm=MPI.COMM_WORLD):
    """Inertia, viscosity, a bond that breaks in shear, friction on what is broken, expansion and all kinds of heat."""
    b = make_blocks(2, 4, comm)
    T = Temperature(b.state, cracked_space(b.state.mesh, ("Lagrange", 1), b.facets), 300.0)
    expansion = ThermoElastic(1e-4, 300.0, softening=-1e-3)
    law = Exponential(toughness=4e-4, opening=0.01, shear_toughness=2e-4, shear_opening=0.02)
    crack = b.crack(law, contact=PenaltyContact(50.0), friction=Coulomb(0.3, stiffness=100.0))
    solid = b.solid(
        NeoHookean(E, NU), thermoelastic=expansion, temperature=T, density=0.01, viscosity=0.01, volumetric="full"
    )
    times = (0.0, 1.0, 4.0)
    supports = [Support(b.state, b.face(1, 0.0), i) for i in range(2)]
    supports.append(
        Support(b.state, b.face(1, 1.0), 1, lambda t: np.interp(t, times, (0, -0.02, -0.02)), corners=(1.0,))
    )
    supports.append(Support(b.state, b.face(1, 1.0), 0, lambda t: np.interp(t, times, (0, 0, 0.1))))
    mechanics = Mechanics(b.state, [solid, crack], supports, analysis="dynamic")
    body = HeatBody(T, capacity=0.2, conductivity=0.5, body=solid)
    contact = InterfaceHeat(T, crack, ContactHeat(3.0, 1.0, capacity=1e-3, fracture_fraction=0.9))
    heat = HeatTransfer(T, [body, contact, Convection(T, b.face(0, 0.0), 0.01, 290.0)])
    return ThermoMechanics(mechanics, heat)


def sliding(comm=MPI.COMM_WORLD):
    """Two boxes of tetrahedra that are glued and sheared off each other, the upper one cracked and rubbed by a ball.

    With inertia, relaxation, augmented contact of crack and pair, friction, expansion, and heat across crack and pair.
    """
    boxes = ((0, 0, -1), (1.4, 1, 0), (2, 1, 1)), ((0, 0, 0), (1, 1, 1), (2, 2, 2))
    b = stack(*boxes, simplices=True, comm=comm, cracked=lambda x: np.isclose(x[2], 0.5))
    state, domain = b.state, b.state.mesh
    glued = mesh.locate_entities(domain, 2, lambda x: np.isclose(x[2], 0.5))
    T = Temperature(state, cracked_space(domain, ("Lagrange", 1), glued), lambda x: 300.0 + 5 * x[2])
    law = Exponential(toughness=2e-5, opening=0.005, shear_toughness=1e-5, shear_opening=0.005)
    contact = PenaltyContact(50.0)
    crack = Crack(
        state, glued, (0.0, 0.0, -1.0), law, young=E, contact=contact, friction=Coulomb(0.3, 100.0),
        allowed_penetration=1e-4,
    )  # fmt: skip
    friction = Friction(Coulomb(0.2, 100.0), allowed_slip=1e-3)
    pair = b.pair(law=GLUE, contact=contact, friction=friction, allowed_penetration=1e-4)
    path = ToolPath.polyline([0.0, 0.1, 2.0], [(0.4, 0.5, 2.0), (0.4, 0.5, 1.97), (0.9, 0.5, 1.97)])
    top = Surface.exterior(state, b.face(1, 2, 1))
    ball = ToolContact(state, Ball(1.0), path, [top], contact=contact, friction=Coulomb(0.3, 100.0), name="ball")
    expansion = ThermoElastic(1e-4, 300.0)
    solid = Solid(
        state, NeoHookean(E, NU), thermoelastic=expansion, temperature=T, density=0.01, volumetric="full",
        relaxation=Prony(strengths=(0.3, 0.2), times=(0.1, 1.0)),
    )  # fmt: skip
    press = Pressure(state, b.face(1, 1, 1), lambda t: 0.02 * t)
    supports = b.drive(0, 0, [0.0] * 3) + b.drive(1, 1, [lambda t: 0.1 * t, None, lambda t: -0.04 * t], "top")
    mechanics = Mechanics(state, [solid, crack, pair, ball, press], supports, analysis="dynamic")
    body = HeatBody(T, capacity=0.2, conductivity=0.5, body=solid)
    across = InterfaceHeat(T, crack, ContactHeat(3.0, 1.0, capacity=1e-3, fracture_fraction=0.9))
    return ThermoMechanics(mechanics, HeatTransfer(T, [body, across, PairHeat(T, pair, ContactHeat(3.0, 1.0))]))
