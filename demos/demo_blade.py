# # Blade cutting of silicone
#
# A rigid wedge blade is pushed through a block of silicone along a crack plane that is known beforehand.  This is the
# cutting test of K. Bronik's thesis (section 5.2.4): two halves of 30 mm meet in a plane of 10.1 × 4.2 mm, the edge of
# the blade lies along the 10.1 mm, and the block rests on a smooth plate.
#
# ## Where the work of the blade goes
#
# The force $F$ on the blade does work along the way $s$ of the blade.  Part of this work is stored in the deformed
# silicone as strain energy $\Psi$, part of it makes new surface of the area $A$, and the rest is lost by friction and
# viscosity:
#
# $$ \int F\,\mathrm ds = \Delta\Psi + G_c\,\Delta A + \text{losses} . $$
#
# Deep in a tall block nothing but the place of the blade changes: $\Psi$ stays constant.  Without friction, an edge of
# the length $w$ then needs the force $F = G_c\,w$, whatever the stiffness of the material and the shape of the blade.
# In this thin block, however, the halves are still being spread when the blade is near the plate.
#
# ## One law for the crack
#
# Where the faces of the crack are pressed together, they are in contact.  Where they come apart by $\delta$, they still
# attract each other: $T = t\,(\delta/\varepsilon)\,e^{1-\delta/\varepsilon}$, with the strength $t$ as its peak and the
# toughness $G_c = e\,t\,\varepsilon$ as its area.  Behind the tip this traction has vanished, and the cut is open.

import sys

import numpy as np
from mpi4py import MPI

from cutsim import Blade, Exponential, NeoHookean

quick = "--quick" in sys.argv  # a coarse mesh and half of the depth
edge, radius, depth = (0.3, 0.3, 1.6) if quick else (0.19, 0.2, 3.4)  # element size, tip radius, depth of the cut [mm]

# ## Silicone, bond and blade
#
# Silicone 1 of the thesis is neo-Hookean.  Its printed fracture energies contradict each other; 0.8 N/mm is chosen so
# that the force stays below the 10 N of the testing machine.  The blade is a prism 4.2 mm high and 1.71 mm thick.
# Change `friction` to see what the dissipation of the rubbing faces adds to the force.

silicone = NeoHookean(young=0.777, poisson=0.48)  # MPa
bond = Exponential(strength=0.61477, toughness=0.8)  # MPa, N/mm
half_angle = float(np.arctan2(1.71 / 2, 4.2))
blade = Blade(half_angle, radius, half_thickness=1.71 / 2, push=(0.0, -1.0, 0.0), lateral=(1.0, 0.0, 0.0))
friction = 0.0

# ## Block
#
# The geometry `block` comes with cutsim.  With `sym=1` and `half=1` it is a quarter, mirrored in the middle of the edge
# and in the plane of the crack.  The elements along the crack resolve the tip of the blade.  A notch of 0.6 mm
# receives it.  The viscosity (MPa s) damps the small jumps with which a crack runs from element to element.

from cutsim import cracked_block, geometry, read_geo

layers, band, growth = (3, 0.6, 1.6) if quick else (6, 0.76, 1.5)
size = dict(dim=3, sym=1, half=1, lc=edge, band=band, growth=growth, nz=layers, notch=0.6)
domain = read_geo(geometry("block"), MPI.COMM_WORLD, size)
block = cracked_block(domain, silicone, bond, viscosity=0.002)

# ## Cut
#
# `Insertion` spreads the two halves of the blade apart in the notch, which takes a second, and then pushes the blade
# down at 1 mm/s.  A step is taken back and halved where the energies of step and work differ too much (`closure`).

from cutsim import Drive, Insertion, Recording, StepControl, run

cut = Insertion.build(block, blade, Drive(speed=1.0, entry_time=1.0), notch=0.6, friction=friction)
until = cut.time_of(depth)
control = StepControl(first=0.02, largest=0.05 if friction else 0.1, smallest=1e-4, closure=5e-3)
stress = {"cauchy_stress": block.solids[0].cauchy_stress(block.state.u)}
options = dict(show={"depth": "depth", "force": "force"}, extra=cut.columns, derived=stress, overwrite=True)
with Recording("results/blade", cut.mechanics, until, title="blade", **options) as recording:
    run(cut.mechanics, until, control, recording)

# ## Results
#
# `results/blade` now has the history of the run and files for ParaView.  The toughness is found again from the work
# that neither the body nor friction nor viscosity has taken, divided by the area cut; this checks the energy audit.
# The force of the blade and that of the plate balance each other.

from cutsim import Curve, draw_insertion, plot_curves, plot_energy
from cutsim.studies.insertion_work import audited_toughness

history = recording.columns()
way, force, start = history["depth"], history["force"], cut.motion.start_depth
late = way >= (start + way[-1]) / 2
result = {
    "largest_force": force.max(),
    "mean_force_per_width_second_half": np.trapezoid(force[late], way[late]) / np.ptp(way[late]) / 10.1,
    "toughness_found": audited_toughness(history, start + 0.4 * (depth - start), way[-1], cut.symmetry_factor),
    "largest_closure": np.abs(history["energy_closure"]).max(),
    "largest_imbalance": history["imbalance"][way > start].max(),
}
recording.summary(result)
near = (-8.0, 8.0, -4.2, 1.0, -5.05, 5.05)  # mm; the block is 60 mm long
draw_insertion("results/blade/cut.png", cut, mirror=("x", "z"), window=near)
if MPI.COMM_WORLD.rank == 0:
    print(*(f"{name}: {value:.5g}" for name, value in result.items()), sep="\n")
    labels = dict(xlabel="depth of the tip [mm]", ylabel="force [N]", title="Blade cutting of silicone")
    plot_curves("results/blade/force.png", [Curve(way, force)], references={"$G_c w$": 0.8 * 10.1}, **labels)
    plot_energy("results/blade/energy.png", history, xlabel="time [s]")
assert result["largest_closure"] < 0.01 and result["largest_imbalance"] < 1e-6
assert friction or abs(result["toughness_found"] / 0.8 - 1) < 0.03
