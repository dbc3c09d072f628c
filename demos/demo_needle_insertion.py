# # Needle insertion
#
# A needle is pushed into silicone, pulled back, and pushed in again along the path that it has made.  From the two
# insertions one can tell how tough the silicone is.
#
# ## What the force is spent on
#
# The work of the force $F$ goes into the strain energy $\Psi$ of the body, into new surface of the area $A$, and into
# friction on the tip and on the shaft (and, here, a little into viscosity).  Per depth $s$,
#
# $$ F = \frac{\mathrm d\Psi}{\mathrm ds} + G_c\,\frac{\mathrm dA}{\mathrm ds} + F_\text{tip} + F_\text{shaft} . $$
#
# The second insertion goes as deep, but makes no new surface.  If all else is the same in both, the difference of their
# works is what the new surface has cost (Azar and Hayward 2008):
#
# $$ G_c \approx \frac{W_1 - W_2}{A} . $$
#
# But not all else is the same: the force that opens the crack presses on the tip, and so causes friction on it, in the
# first insertion only.  With the friction coefficient $\mu$ and the half angle $\alpha$ of the tip the experiment reads
# about $G_c\,(1 + \mu/\tan\alpha)$.  In the simulation the energy audit knows that friction, and it can be taken off.
#
# ## Body of revolution
#
# The needle moves along the axis, and the mesh is half of a section through it.  A crack on the axis would have no
# area.  Instead the blunt tip destroys a thread of the radius $r_0$ around the axis; the crack is the surface of the
# thread, $2\pi r_0$ per depth, and the needle widens the hole to its own radius.

import sys

import numpy as np
from mpi4py import MPI

from cutsim import Exponential, Needle, NeoHookean

quick = "--quick" in sys.argv  # a blunter tip, a coarser mesh, and half of the depth
half_angle, depth = (30.0, 1.6) if quick else (15.0, 4.0)  # degrees, mm
r0, notch, friction = 0.2, 0.5, 0.1  # mm, mm

# ## Silicone, bond and needle
#
# Silicone 1 of K. Bronik's thesis, and a needle of 1 mm diameter with a tip rounded by 0.15 mm.

silicone = NeoHookean(young=0.777, poisson=0.48)  # MPa
bond = Exponential(strength=1.0, toughness=0.1)  # MPa, N/mm
needle = Needle(np.radians(half_angle), 0.15, 0.5, push=(0.0, -1.0), lateral=(1.0, 0.0))

# ## Body
#
# The geometry `thread` comes with cutsim.  The mesh must resolve the tip: two or three elements along its radius are
# worth more than a fine mesh elsewhere.  The viscosity (MPa s) carries the run across the small jumps of the crack.

from cutsim import cracked_block, geometry, read_geo

radius, height, deep, lc = (4, 4, 2.5, 0.075) if quick else (6, 8, 5, 0.05)
size = dict(r0=r0, R=radius, H=height, notch=notch, deep=deep, lc=lc)
domain = read_geo(geometry("thread"), MPI.COMM_WORLD, size, gdim=2)
block = cracked_block(domain, silicone, bond, viscosity=0.005, axisymmetric=True)

# ## Two insertions
#
# With a `turning_depth` the needle turns there, goes back to the notch, and is pushed in a second time.  A step that
# misses more than a thousandth of the energy is taken back and made shorter.

from cutsim import Drive, Insertion, Recording, StepControl, run

drive = Drive(speed=1.0, entry_time=1.0, turning_depth=depth)  # mm/s, s, mm
cut = Insertion.build(block, needle, drive, notch=notch, friction=friction)
until = cut.time_of(depth, push=2)
control = StepControl(first=0.02, largest=0.1, smallest=1e-4, closure=1e-3)
stress = {"cauchy_stress": block.solids[0].cauchy_stress(block.state.u)}
options = dict(show={"depth": "depth", "force": "force"}, extra=cut.columns, derived=stress, overwrite=True)
with Recording("results/needle_insertion", cut.mechanics, until, title="needle", **options) as recording:
    run(cut.mechanics, until, control, recording)

# ## Results
#
# `force_parts` divides the force of the first insertion among what its work is spent on, in windows of 0.1 mm, and
# `TwoInsertions` evaluates the experiment: `apparent` is what it reads, `toughness` is corrected for the friction.

from cutsim import Curve, draw_insertion, plot_curves, plot_parts
from cutsim.studies.insertion_work import TwoInsertions, force_parts

history = recording.columns()
parts = force_parts(history, cut.symmetry_factor, window=0.1)
way, force = parts.pop("depth"), parts.pop("force")
experiment = TwoInsertions.of(history, cut)
result = {
    "largest_force": history["force"].max(),
    "force_at_the_end": force[-1],
    **{f"{name.replace(' ', '_')}_at_the_end": part[-1] for name, part in parts.items()},
    "toughness_apparent": experiment.apparent,
    "toughness_of_two_insertions": experiment.toughness,
    "largest_closure": np.abs(history["energy_closure"]).max(),
}
recording.summary(result)
wall = ((-1.0, 0.0, 0.0), (r0, 0.0, 0.0))  # the thread is not shown
view = dict(mirror=("x",), clip=wall, window=(-3.0, 3.0, -depth - 1.5, 0.8, 0.0, 0.0))
draw_insertion("results/needle_insertion/section.png", cut, **view)
if MPI.COMM_WORLD.rank == 0:
    print(*(f"{name}: {value:.5g}" for name, value in result.items()), sep="\n")
    labels = dict(xlabel="depth of the tip [mm]", ylabel="force [N]")
    plot_parts("results/needle_insertion/parts.png", way, parts, force, **labels)
    plot_curves("results/needle_insertion/force.png", [Curve(history["depth"], history["force"])], **labels)
assert abs(sum(part[-1] for part in parts.values()) / force[-1] - 1) < 0.02 and result["largest_closure"] < 0.02
assert abs(result["toughness_of_two_insertions"] / 0.1 - 1) < 0.05
