# # A mesh of your own: peeling a T
#
# Two soft strips are glued to each other, and their ends stand up like the arms of a T.  Grips pull the arms apart, and
# the strips peel off each other.  The mesh is drawn here with gmsh.  A file from elsewhere will do as well: `read_mesh`
# reads those of gmsh, Abaqus, FEBio, VTK and others.
#
# ## What theory says
#
# In steady peeling a unit of length of glued strips turns into a unit of length of two straight, stretched arms.
# Meanwhile each grip moves by the stretch $\lambda$, and each arm of the thickness $h$ stores the strain energy
# $\psi(\lambda)\,h$.  The rest of the work of the force $F$ (per width) breaks the glue (Rivlin and Thomas 1953):
#
# $$ G_c = 2\,\bigl(F \lambda - \psi(\lambda)\,h\bigr) \approx 2F + \frac{F^2}{E' h}, \qquad E' = \frac{E}{1-\nu^2} . $$
#
# The approximation is for stretches near one.  It does not matter how the strips bend at the front, nor how the glue
# yields.

import sys
from pathlib import Path

import gmsh
import numpy as np
from mpi4py import MPI

quick = "--quick" in sys.argv  # shorter strips, a coarser mesh
tail, opening = (20.0, 20.0) if quick else (26.0, 30.0)  # length of the strips, way of the grips apart [mm]
fine, coarse = (0.22, 0.6) if quick else (0.2, 0.5)  # element size at the glued plane and elsewhere [mm]
h, arm, cut = 1.5, 5.0, 4.0  # thickness of the strips, height of the arms, length without glue [mm]
folder, comm = Path("results/own_mesh"), MPI.COMM_WORLD

# ## Draw the mesh
#
# The plane between the strips is a line *inside* the mesh, with a single set of nodes: do not double them.  Everything
# that the simulation speaks of gets a physical group with a name: the two strips, the line with and without glue, and
# the grips.  The elements are small where the strips are glued.  Only one rank draws.
#
# In 3-D nothing changes but the dimensions: the plane is then a surface inside the volumes.

if comm.rank == 0:
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    geo = gmsh.model.geo
    start, front, end = (geo.addPoint(x, 0, 0, fine) for x in (0, cut, tail))
    middle = [geo.addLine(start, front), geo.addLine(front, end)]
    groups = {"cut": (1, middle[0]), "glued": (1, middle[1])}
    for side, name in ((1, "upper"), (-1, "lower")):
        corners = [geo.addPoint(x, side * y, 0, coarse) for x, y in ((tail, h), (h, h), (h, arm), (0, arm))]
        sides = [geo.addLine(a, b) for a, b in zip([end, *corners], [*corners, start], strict=True)]
        strip = geo.addPlaneSurface([geo.addCurveLoop([*middle, *sides])])
        groups |= {name: (2, strip), f"{name}_grip": (1, sides[3])}
    geo.synchronize()
    for name, (dim, tag) in groups.items():
        gmsh.model.addPhysicalGroup(dim, [tag], name=name)
    gmsh.model.mesh.generate(2)
    folder.mkdir(parents=True, exist_ok=True)
    gmsh.write(str(folder / "peel.msh"))
    gmsh.finalize()
comm.barrier()

# ## Read and crack it
#
# All ranks read the file; `domain.names` then lists the groups that it has.  On the cracked space the nodes of both
# lines have a displacement for each strip.  Triangles need the degree 2, because rubber hardly changes its volume.

from cutsim import State, cracked_space, read_mesh

domain = read_mesh(folder / "peel.msh", comm, gdim=2)
glued = domain.facets("glued")
state = State(cracked_space(domain.mesh, ("Lagrange", 2, (2,)), [glued, domain.facets("cut")]))

# ## Rubber, glue and grips
#
# The names of the groups are all that connects the problem with the mesh.  `domain.cells("upper")` tells which side of
# the crack is its '+' side.  The elements along the glue must resolve the zone in which it yields: they should not be
# larger than $E G_c/(20\,t^2)$, here 0.22 mm.  If they are, the run says so.

from cutsim import Crack, Exponential, Mechanics, NeoHookean, Solid, Support

rubber = NeoHookean(young=1.0, poisson=0.45)  # MPa
glue = Exponential(strength=0.15, toughness=0.1)  # MPa, N/mm
body = Solid(state, rubber)
crack = Crack(state, glued, domain.cells("upper"), glue, young=rubber.young)
upper, lower = domain.facets("upper_grip"), domain.facets("lower_grip")
pull = [Support(state, upper, 1, lambda t: t / 2, name="pull"), Support(state, lower, 1, lambda t: -t / 2)]
hold = [Support(state, upper, 0), Support(state, lower, 0)]
mechanics = Mechanics(state, [body, crack], [*pull, *hold])

# ## Run and compare
#
# The glued end of the strips is free, and moves towards the grips while they peel.  The force has a peak, because at
# first the short arms must be bent, and then falls to that of steady peeling.

from cutsim import Curve, Recording, StepControl, draw_stress, plot_curves, run

control = StepControl(first=0.1, largest=0.25, line_searches=("basic", "l2", "bt"))
with Recording(folder, mechanics, opening, title="peel", show={"force": "pull_force"}, overwrite=True) as recording:
    run(mechanics, opening, control, recording)
way, force = recording.column("time"), recording.column("pull_force")
found = 2 * force + force**2 / (h * rubber.young / (1 - rubber.poisson**2))
closure = np.abs(recording.column("energy_closure")).max()
recording.summary({"toughness_found": found[-1], "largest_force": force.max(), "largest_closure": closure})
draw_stress(folder / "peel.png", body, crack)
if comm.rank == 0:
    print(f"toughness found: {found[-1]:.5g} N/mm, put in: 0.1 N/mm; the energy audit closes to {closure:.2g}")
    labels = dict(xlabel="opening [mm]", ylabel="$2F + F^2/(E'h)$ [N/mm]", title="Peeling becomes steady")
    plot_curves(folder / "toughness.png", [Curve(way, found)], references={"put in": 0.1}, **labels)
assert abs(found[-1] / 0.1 - 1) < (0.05 if quick else 0.01) and closure < 0.01
