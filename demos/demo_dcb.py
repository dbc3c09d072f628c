# # Double cantilever beam
#
# Two stiff arms are bonded to each other along a plane.  Their ends are pulled apart, the bond breaks, and a crack runs
# along the plane.  This is the standard test for the toughness of a bond, and a good first lesson: beam theory says
# what the force must be.
#
# ## What theory says
#
# Each arm has the height $h$, the width $b$ and, in plane strain, the modulus $E' = E/(1-\nu^2)$.  It bends like a
# cantilever that is a little longer than the crack, $a + \chi h$, because the bond ahead of the crack yields too
# (Williams 1989).  With $I = b h^3/12$, a force $P$ opens the ends by
#
# $$ w = \frac{2 P (a + \chi h)^3}{3 E' I} . $$
#
# The crack grows when the energy that a unit of new crack area sets free reaches the toughness of the bond:
#
# $$ G = \frac{P^2 (a + \chi h)^2}{b E' I} = G_c . $$
#
# Before growth $a$ is the initial length $a_0$, and the force is proportional to the opening.  During growth the second
# equation gives $a + \chi h$, and the first one the force at an opening, $P = \sqrt{2 c^3 / (3 E' I w)}$ with
# $c^2 = G_c b E' I$: the force falls while the crack runs.

import sys

import numpy as np
from mpi4py import MPI

from cutsim import Exponential, LinearElastic

quick = "--quick" in sys.argv  # a shorter beam, opened less far
length, opening = (55.0, 2.4) if quick else (70.0, 4.0)  # mm
h, b, a0 = 1.5, 1.0, 30.0  # height and width of an arm, initial crack [mm]

# ## Material and bond
#
# The arms are of steel.  The bond follows an exponential law: as its faces come apart, its traction rises to the
# strength and falls to zero.  The area below this curve is the toughness $G_c$.

steel = LinearElastic(young=200e3, poisson=0.3)  # MPa
G_c = 0.28  # N/mm
bond = Exponential(strength=57.0, toughness=G_c)  # MPa, N/mm

# ## Mesh and unknowns
#
# The geometry `dcb` comes with cutsim.  Its plane has two groups of facets: `precrack`, open from the start, and
# `crack`, the bond.  On a *cracked space* the two faces of these facets have displacements of their own.  Elements of
# degree 2 let the arms bend as they should with two elements through each.

from cutsim import State, cracked_space, geometry, read_geo

size = dict(L=length, h=h, a0=a0, fine=length - 35, back=5, lc=0.5, lc_arm=1.0, ny=2, growth=1.05)
domain = read_geo(geometry("dcb"), MPI.COMM_WORLD, size, gdim=2)
bonded, precrack = domain.facets("crack"), domain.facets("precrack")
state = State(cracked_space(domain.mesh, ("Lagrange", 2, (2,)), [bonded, precrack]))

# ## Parts of the problem
#
# The body and the crack are terms of the virtual work.  Two supports move the ends of the arms apart, so that the time
# is the opening, and the far end is clamped.  The faces are hardly pressed together anywhere: a soft contact will do.

from cutsim import Crack, Mechanics, PenaltyContact, Solid, Support

body = Solid(state, steel)
soft = PenaltyContact.automatic(steel.young, 0.5, factor=1.0)
crack = Crack(state, bonded, domain.cells("lower"), bond, young=steel.young, contact=soft, normal="reference")
upper = Support(state, domain.facets("load_upper"), 1, lambda t: t / 2, name="upper")
lower = Support(state, domain.facets("load_lower"), 1, lambda t: -t / 2, name="lower")
clamp = [Support(state, domain.facets("end"), axis) for axis in (0, 1)]
mechanics = Mechanics(state, [body, crack], [upper, lower, *clamp])

# ## Run
#
# Each step adds a row to `results/dcb/history.csv`; here the place of the crack front is added to the usual columns.
# Where little is in contact, full Newton steps ("basic") go through the softening best.

from cutsim import Recording, StepControl, run
from cutsim.studies.fracture import crack_front, crack_length_correction

control = StepControl(first=0.02, largest=0.02, line_searches=("basic", "l2", "bt"))
options = dict(show={"force": "upper_force"}, extra=lambda _: {"front": (crack_front(crack), "length")}, overwrite=True)
with Recording("results/dcb", mechanics, opening, title="dcb", **options) as recording:
    run(mechanics, opening, control, recording)

# ## Compare
#
# Once the crack has grown by two arm heights, the force is compared with theory, and the energy that the bond has
# dissipated is divided by the area that the front has swept: it must be $G_c$.  The peak lies 5 % below that of theory,
# which knows no strength: in the simulation the bond softens over 2 to 3 mm before it breaks.

from cutsim import Curve, plot_curves, plot_energy

history = recording.columns()
w, force, front = history["time"], history["upper_force"], history["front"]
EI = steel.young / (1 - steel.poisson**2) * b * h**3 / 12
c, a = np.sqrt(G_c * b * EI), a0 + crack_length_correction(steel.young, steel.shear) * h
theory = np.minimum(1.5 * EI * w / a**3, np.sqrt(2 * c**3 / (3 * EI * w)))
steady = (w > opening / 2) & (front > a0 + 2 * h)
result = {
    "peak_force": force.max(),
    "peak_force_of_theory": c / a,
    "distance_from_theory": np.abs(force / theory - 1)[steady].max(),
    "toughness_found": np.ptp(history["energy_fracture"][steady]) / (b * np.ptp(front[steady])),
}
recording.summary(result)
if MPI.COMM_WORLD.rank == 0:
    print(*(f"{name}: {value:.5g}" for name, value in result.items()), sep="\n")
    curves = [Curve(w, force, "simulation"), Curve(w, theory, "beam theory", "--")]
    plot_curves("results/dcb/force.png", curves, xlabel="opening [mm]", ylabel="force [N]", title="Two arms, peeled")
    plot_energy("results/dcb/energy.png", history, xlabel="opening [mm]")
assert abs(result["toughness_found"] / G_c - 1) < 0.01 and result["distance_from_theory"] < 0.015
