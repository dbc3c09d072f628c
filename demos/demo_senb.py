# # Three-point bending of a notched beam
#
# A beam with a notch lies on two supports and is pressed down in the middle.  The notch opens, and at some load a crack
# runs from it.  The beam is that of K. Bronik's thesis (section 4.5.1): span $S$ = 80 mm, height $W$ = 20 mm, notch
# $a$ = 9 mm, $E$ = 50 GPa, $\nu$ = 0.48, in plane strain.
#
# ## When does the crack run?
#
# Linear elastic fracture mechanics takes the crack as sharp.  The load $P$ per thickness gives the stress intensity
# (ASTM E399) and the energy-release rate
#
# $$ K = \frac{P S}{W^{3/2}} f\!\left(\frac aW\right), \qquad
#    f(x) = \frac{3\sqrt x\,[1.99 - x(1-x)(2.15 - 3.93x + 2.7x^2)]}{2(1+2x)(1-x)^{3/2}}, \qquad
#    G = \frac{K^2}{E'}, \quad E' = \frac{E}{1-\nu^2}, $$
#
# and the crack runs when $G$ reaches the toughness $G_c$.  A real material also has a strength $t$: ahead of the notch
# there is a *process zone*, of a length of about $\ell = E' G_c/t^2$, in which the bond softens.  The peak load is
# therefore lower than that of a sharp crack, and the more so the longer the zone is (Bažant's size effect):
#
# $$ \left(\frac{P_c}{P}\right)^2 = 1 + c\,\frac{\ell}{W} + \dots $$
#
# One number holds in spite of the process zone.  Rice's integral $J$, over a domain around all of the zone, is the
# energy that flows into it per unit of growth.  Once the bond at the notch is broken, $J$ is $G_c$ and stays there.

import sys

import numpy as np
from mpi4py import MPI

from cutsim import Exponential, LinearElastic

quick = "--quick" in sys.argv  # a coarser mesh, a longer process zone, fewer steps
lc, zone, steps = (0.15, 4.0, 24) if quick else (0.075, 2.0, 96)  # mm, mm
W, S, a = 20.0, 80.0, 9.0  # mm

# ## Material and bond
#
# The thesis prints a strength of 2.5 MPa and an opening of 0.001 mm, which imply the toughness
# $G_c = e\,t\,\varepsilon$ that is used here.  Its strength is not used: the process zone of 71 mm would be longer than
# the beam is high.  Instead the length of the zone is chosen, and the strength follows from it.

material = LinearElastic(young=50e3, poisson=0.48)  # MPa
modulus = material.young / (1 - material.poisson**2)
G_c = np.e * 2.5 * 0.001  # N/mm
bond = Exponential(strength=np.sqrt(modulus * G_c / zone), toughness=G_c)

# ## Mesh, notch and ligament
#
# The groups `notch` and `crack` are the lower and the upper part of the plane $x = 0$.  The bond reaches 9 mm above the
# notch; above that the beam cannot break, so that the load presses on one body and not on the faces of a crack.

from dolfinx.mesh import compute_midpoints, locate_entities

from cutsim import State, cracked_space, geometry, read_geo

size = dict(a=a, lc=lc, band=0.5, patch=0.4, ahead=9, growth=1.3, lc_far=4)
domain = read_geo(geometry("senb"), MPI.COMM_WORLD, size, gdim=2)
notch, ligament = domain.facets("notch"), domain.facets("crack")
ligament = ligament[compute_midpoints(domain.mesh, 1, ligament)[:, 1] < a + 9]
state = State(cracked_space(domain.mesh, ("Lagrange", 1, (2,)), [notch, ligament]))

# ## Parts of the problem
#
# Supports and load act on single vertices (`dim=0`), as the closed form assumes.  The deflection of mid-span, and not
# the load, is prescribed, so that the run passes the peak of the load.

from cutsim import Crack, Mechanics, Solid, Support


def vertex(x, y):
    return locate_entities(domain.mesh, 0, lambda p: np.isclose(p[0], x) & np.isclose(p[1], y))


deflection = 0.012  # mm, reached at time 1
body = Solid(state, material)
crack = Crack(state, ligament, domain.cells("left"), bond, young=material.young, normal="reference")
load = Support(state, vertex(0, W), 1, lambda t: -deflection * t, name="load", dim=0)
pins = [Support(state, vertex(x, 0), 1, dim=0) for x in (-S / 2, S / 2)]
mechanics = Mechanics(state, [body, crack], [load, *pins, Support(state, vertex(0, W), 0, dim=0)])

# ## Run
#
# $J$ is evaluated after each step over a domain of 5 to 8 mm around the tip of the notch.

from cutsim import Recording, StepControl, run
from cutsim.studies.fracture import BentBeam, JIntegral

J = JIntegral(body, tip=(0.0, a), direction=(0.0, 1.0), inner=5.0, outer=8.0)
control = StepControl(first=1 / steps, largest=1 / steps, line_searches=("basic", "l2", "bt"))
options = dict(show={"force": "load_force"}, extra=lambda _: {"J": (J(), "toughness")}, overwrite=True)
with Recording("results/senb", mechanics, 1.0, title="senb", **options) as recording:
    run(mechanics, 1.0, control, recording)

# ## Compare
#
# The peak stays below that of a sharp crack; halve the length of the zone (and of the elements) to see it come closer.
# $J$ rises to $G_c$ and stays while the crack runs.  What the beam then gives, the work of the load without what is
# stored in the beam and its bond, is $G_c$ times the area that breaks.

from cutsim import Curve, draw_stress, plot_curves

history = recording.columns()
P, running = -history["load_force"], history["J"] > 0.99 * G_c
P_c = BentBeam(W, 1.0).critical_load(G_c, a, modulus)
given = history["work_external"] - history["energy_strain"] - history["energy_cohesive_stored"]
result = {
    "peak_load_per_thickness": P.max(),
    "peak_over_closed_form": P.max() / P_c,
    "largest_J_over_toughness": history["J"].max() / G_c,
    "given_per_area_over_toughness": np.polyfit(history["crack_broken"][running], given[running], 1)[0] / G_c,
}
recording.summary(result)
draw_stress("results/senb/beam.png", body, crack, title="The crack runs upwards from the notch")
if MPI.COMM_WORLD.rank == 0:
    print(*(f"{name}: {value:.5g}" for name, value in result.items()), sep="\n")
    way, labels = -history["load_displacement"], dict(xlabel="deflection [mm]", ylabel="load per thickness [N/mm]")
    plot_curves("results/senb/load.png", [Curve(way, P)], references={"sharp crack": P_c}, **labels)
    labels["ylabel"] = "J over toughness"
    plot_curves("results/senb/J.png", [Curve(way, history["J"] / G_c)], references={"running crack": 1.0}, **labels)
assert abs(result["largest_J_over_toughness"] - 1) < 0.01 and abs(result["given_per_area_over_toughness"] - 1) < 0.01
