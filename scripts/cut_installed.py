"""A small cut with an installed cutsim, away from its sources; writes results/ where it is run. For `make dist`."""

import sys
from pathlib import Path

import numpy as np
from mpi4py import MPI

import cutsim
from cutsim import Blade, Drive, Exponential, Insertion, NeoHookean, StepControl, cracked_block, geometry, read_geo, run
from cutsim.results.recording import Recording

assert Path(cutsim.__file__).is_relative_to(sys.prefix), f"{cutsim.__file__} is not installed in {sys.prefix}"

silicone = NeoHookean(young=0.777, poisson=0.45)
bond = Exponential(strength=0.6, toughness=0.5)
size = {"dim": 2, "Lx": 4, "H": 6, "lc": 0.1, "band": 0.4}
mesh = read_geo(geometry("block"), MPI.COMM_WORLD, size, gdim=2)
blade = Blade(half_angle=0.2, tip_radius=0.1, half_thickness=0.855)
body = cracked_block(mesh, silicone, bond, viscosity=0.002)
cut = Insertion.build(body, blade, Drive(speed=1.0), notch=0.5)
until = cut.time_of(depth=1.0)
with Recording("results", cut.mechanics, until, extra=cut.columns, show={"force": "force"}) as recording:
    run(cut.mechanics, until, StepControl(first=0.02, largest=0.1), recording)
force, closure = recording.column("force").max(), np.abs(recording.column("energy_closure")).max()
assert force > 0 and closure < 0.01, (force, closure)
print(f"cutsim {cutsim.__version__} cuts: peak force {force:.3f} N/mm, energy closes to {closure:.1e}")
