"""A problem with everything on."""

import numpy as np
from mpi4py import MPI

from cutsim import (
    ContactHeat,
    Convection,
    Coulomb,
    Exponential,
    HeatBody,
    HeatTransfer,
    InterfaceHeat,
    Mechanics,
    NeoHookean,
    PenaltyContact,
    Support,
    Temperature,
    ThermoElastic,
    ThermoMechanics,
    cracked_space,
)
from helpers.blocks import make_blocks
from helpers.laws import NU, E


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
