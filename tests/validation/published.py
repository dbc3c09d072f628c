# # Published contact problems
#
# Two problems with values in the tests of Code_Aster (EDF), with which that program and others are compared.  Lengths
# are in mm, moduli in MPa.
#
# - *Plate* (GRECO; Code_Aster's SSNV128, V6.04.128): a square plate of 40 mm, $E = 130\,000$, $\nu = 0.2$, in plane
#   strain, lies on a rigid plane with a friction of 1.  It is pressed down by 50 MPa from above and pushed by 150 MPa
#   from the left towards a plane of symmetry; both grow together.  The left end slides and lifts off, the rest sticks:
#   given are the displacements along the plane 0, 1.25, 5, 7.5 and 11.25 mm from the left end.
# - *Punch* (NAFEMS CGS-2; Code_Aster's SSNA122, V6.01.122): a punch of 210 GPa with a radius of 50 mm, its edge rounded
#   by 10 mm, is pressed by 100 MPa on a cylinder of 70 GPa, with and without friction: given are displacement and
#   stress at the centre of the contact.

from pathlib import Path

import numpy as np
import ufl
from _problems import solve
from dolfinx import fem, mesh
from mpi4py import MPI

from cutsim import (
    Coulomb,
    LinearElastic,
    Mechanics,
    PenaltyContact,
    Plane,
    Solid,
    State,
    StepControl,
    Support,
    SurfacePair,
    ToolContact,
    ToolPath,
    Traction,
    read_geo,
    run,
)
from cutsim.base.compat import geometry_nodes
from cutsim.fields.points import Surface
from helpers.bodies import Body
from helpers.meshes import QUADRILATERAL, rectangle

COMM = MPI.COMM_WORLD
# Full steps of Newton's method go through the changes of contact from the first step on.
CONTROL = StepControl(first=0.1, largest=0.1, line_searches=("basic", "bt", "l2"))

# ## Plate

PLATE, SIDE = LinearElastic(130e3, 0.2), 40.0
POINTS = {"A": 0.0, "B": 1.25, "C": 5.0, "D": 7.5, "E": 11.25}  # from the left end


def slid(cells: int) -> tuple[dict[str, float], int]:
    """Displacements along the plane [mm], of so many cells along the side, and the unknowns."""
    domain = rectangle([(0.0, 0.0), (SIDE, SIDE)], (cells, cells), QUADRILATERAL)
    b = Body(domain, axisymmetric=False)
    left, right, under, above = (
        b.where(lambda x, axis=axis, end=end: np.isclose(x[axis], end))
        for axis, end in ((0, 0.0), (0, SIDE), (1, 0.0), (1, SIDE))
    )
    loads = [
        Traction(b.state, above, (0.0, -50.0), lambda t: t, name="above"),
        Traction(b.state, left, (150.0, 0.0), lambda t: t, name="left"),
    ]
    plane = ToolContact(
        b.state, Plane((0.0, 1.0)), ToolPath.polyline([0.0, 1.0], [(0.0, 0.0), (0.0, 0.0)]),
        [Surface.exterior(b.state, under)], contact=PenaltyContact.automatic(PLATE.young, SIDE / cells, factor=20.0),
        friction=Coulomb(1.0, stiffness=2 * PLATE.young * cells / SIDE), name="plane",
    )  # fmt: skip
    corner = mesh.locate_entities_boundary(domain, 0, lambda x: np.isclose(x[0], SIDE) & np.isclose(x[1], 0.0))
    supports = [Support(b.state, right, 0), Support(b.state, corner, 1, dim=0)]  # as there, for the first step
    run(Mechanics(b.state, [Solid(b.state, PLATE), plane, *loads], supports), 1.0, CONTROL)
    return {name: float(b.at(x, 0.0)[0]) for name, x in POINTS.items()}, b.state.unknowns


def plate(quick: bool) -> dict[str, float]:
    """Displacements on finer and finer meshes [µm]."""
    found = {}
    for cells in (32,) if quick else (32, 64, 128):
        values, found["unknowns"] = slid(cells)
        found |= {f"{name}, {cells}": 1e3 * value for name, value in values.items()}
    return found


# ## Punch


def pressed(size: float, friction: float) -> dict[str, float]:
    """Displacement [mm] and pressure [MPa] at the centre of the contact, with elements of some size."""
    domain = read_geo(Path(__file__).with_name("punch.geo"), COMM, {"lc": size}, gdim=2)
    upper = np.unique(geometry_nodes(domain.mesh)[domain.cells("punch")])
    domain.mesh.geometry.x[upper, 1] -= 1e-6  # a contact that is closed holds the punch in the first step
    state = State(fem.functionspace(domain.mesh, ("Lagrange", 2, (2,))), axisymmetric=True)
    solids = [
        Solid(state, LinearElastic(young, 0.3), cells=domain.cells(name), name=name)
        for name, young in (("punch", 210e3), ("foundation", 70e3))
    ]
    surfaces = [domain.facets(f"contact_{name}") for name in ("punch", "foundation")]
    pair = SurfacePair(
        state, *surfaces, young=70e3, contact=PenaltyContact.automatic(70e3, size, factor=50.0),
        friction=Coulomb(friction) if friction else None, search=2.0,
    )  # fmt: skip
    load = Traction(state, domain.facets("top"), (0.0, -100.0), lambda t: t)
    supports = [Support(state, domain.facets("bottom"), i) for i in range(2)]
    supports.append(Support(state, domain.facets("axis"), 0))
    run(Mechanics(state, [*solids, pair, load], supports), 1.0, CONTROL)
    first = pair.passes[0]
    place = first.points.evaluator({"x": ufl.SpatialCoordinate(domain.mesh)[0]})()["x"]
    near = place < 5.0
    weight = np.where(near, first.history.trial["pressure"], 0.0)
    pressure = first.points.integral(weight) / first.points.integral(near.astype(float))
    x = state.V.tabulate_dof_coordinates()[: state.V.dofmap.index_map.size_local, :2]
    sunk = state.u.x.array[: 2 * len(x)].reshape(-1, 2)[np.hypot(*x.T) < 1e-9, 1]
    deepest = min(COMM.allgather(float(sunk.min(initial=0.0))))
    return {"displacement": deepest, "pressure": pressure, "unknowns": state.unknowns}


def punch(quick: bool) -> dict[str, float]:
    """Both on finer and finer meshes, with and without friction."""
    found = {}
    for friction in (0.0, 0.1):
        for size in (2.0,) if quick else (2.0, 1.0, 0.5):
            values = pressed(size, friction)
            found["unknowns"] = values.pop("unknowns")
            found |= {f"{name}, {friction}, {size} mm": value for name, value in values.items()}
    return found


PROBLEMS = {"plate": plate, "punch": punch}

if __name__ == "__main__":
    solve("published", PROBLEMS)
