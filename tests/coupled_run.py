"""A run with everything on. As a script: save its state and go on, or restore the state and go on, for ten steps.

python coupled_run.py save FOLDER    writes state.pickle and whole.pickle
python coupled_run.py resume FOLDER  reads state.pickle, writes resumed.pickle
"""

import pickle
import sys
from pathlib import Path

import numpy as np
from conftest import NU, E, make_blocks
from mpi4py import MPI

from cutsim import (
    ContactHeat,
    Convection,
    Coulomb,
    CrackFriction,
    Exponential,
    HeatBody,
    HeatTransfer,
    InterfaceHeat,
    Mechanics,
    NeoHookean,
    PenaltyContact,
    StepControl,
    Support,
    Temperature,
    ThermoElastic,
    ThermoMechanics,
    cracked_space,
    run,
)
from cutsim.analysis.checkpoint import load, save

#: Time at which the state is saved, size of the steps, and their number afterwards.
SAVED, STEP, STEPS = 1.0, 0.02, 10


def coupled(comm=MPI.COMM_WORLD):
    """Inertia, viscosity, a bond that breaks in shear, friction on what is broken, expansion and all kinds of heat."""
    b = make_blocks(2, 4, comm)
    T = Temperature(b.state, cracked_space(b.state.mesh, ("Lagrange", 1), b.facets), 300.0)
    expansion = ThermoElastic(1e-4, 300.0, softening=-1e-3)
    law = Exponential(toughness=4e-4, opening=0.01, shear_toughness=2e-4, shear_opening=0.02)
    crack = b.crack(law, contact=PenaltyContact(50.0))
    friction = CrackFriction(crack, Coulomb(0.3, stiffness=100.0))
    solid = b.solid(
        NeoHookean(E, NU), thermoelastic=expansion, temperature=T, density=0.01, viscosity=0.01, volumetric="full"
    )
    times = (0.0, 1.0, 4.0)
    supports = [Support(b.state, b.face(1, 0.0), i) for i in range(2)]
    supports.append(
        Support(b.state, b.face(1, 1.0), 1, lambda t: np.interp(t, times, (0, -0.02, -0.02)), corners=(1.0,))
    )
    supports.append(Support(b.state, b.face(1, 1.0), 0, lambda t: np.interp(t, times, (0, 0, 0.1))))
    mechanics = Mechanics(b.state, [solid, crack, friction], supports, analysis="dynamic")
    body = HeatBody(T, capacity=0.2, conductivity=0.5, body=solid)
    contact = InterfaceHeat(T, crack, ContactHeat(3.0, 1.0, capacity=1e-3, fracture_fraction=0.9), friction)
    heat = HeatTransfer(T, [body, contact, Convection(T, b.face(0, 0.0), 0.01, 290.0)])
    return ThermoMechanics(mechanics, heat)


def go_on(problem):
    """Snapshots of the steps that follow."""
    snapshots = []
    end = SAVED + (STEPS + 5) * STEP
    run(
        problem,
        end,
        StepControl.fixed(STEP),
        lambda _: snapshots.append(problem.state.memory.save()),
        stop=lambda _: len(snapshots) == STEPS,
    )
    return snapshots


def main(what, folder):
    """Save or resume."""
    problem, path = coupled(MPI.COMM_SELF), folder / "state.pickle"
    if what == "save":
        run(problem, SAVED, StepControl.fixed(STEP))
        path.write_bytes(pickle.dumps(save(problem)))
    else:
        load(problem, pickle.loads(path.read_bytes()))
    name = {"save": "whole", "resume": "resumed"}[what]
    (folder / f"{name}.pickle").write_bytes(pickle.dumps(go_on(problem)))


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))
