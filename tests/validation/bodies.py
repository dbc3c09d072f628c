# # Bodies without cracks
#
# Small problems with closed forms or published values: they show what elements and materials are worth before anything
# is cut.  Lengths are in mm, moduli in MPa.
#
# - *Cook's membrane*: plane stress, $\nu = 1/3$, deflection of the middle of the loaded edge times $E$ over the load.
# - *Membrane, nearly incompressible*: plane strain, $\nu = 0.4999$, upper corner; the limit 19.43 is approached from
#   both sides by two kinds of elements (docs/elements.md).
# - *Cube*: neo-Hookean, clamped at one face, drawn to one and a half times its height, on the mesh of another code.
# - *Sphere*: a thick incompressible neo-Hookean shell under inner pressure, whose inner surface is stretched by 20 %:
#   $p = \tfrac E3 [2/\lambda + 1/(2\lambda^4)]$ between the stretches of the inner and the outer surface.
# - *Torsion* of an incompressible neo-Hookean cylinder of fixed length (Rivlin 1949): with the twist $\tau$ per length,
#   the moment is $G \tau I_p$ at any angle, and the ends are pressed apart by $\tfrac12 G\tau^2 I_p$.
# - *Bending* of a strip into a part of a circle by moments at its ends: $M = E' I \theta/L$.
# - *Elastica*: a cantilever under a dead load $P L^2/(E'I) = 10$ at its end; the rod is integrated here by a method for
#   ordinary differential equations.
# - *Cylinder* under inner pressure (Lamé) and *punch* on a half-space (Sneddon): bodies of revolution.
# - *Patch*: a displacement that is linear in the position is prescribed on the border of an irregular mesh; every
#   element has to find it inside.

import numpy as np
import ufl
from _problems import solve
from dolfinx import fem, mesh
from mpi4py import MPI
from scipy.integrate import solve_bvp

from cutsim import (
    Attachment,
    LinearElastic,
    Mechanics,
    NeoHookean,
    Pressure,
    RigidLink,
    Solid,
    State,
    Support,
    Traction,
)
from cutsim.base.assembly import integrate
from cutsim.base.compat import form
from cutsim.materials.elastic import IsochoricNeoHookean, StVenantKirchhoff
from helpers.bodies import Body, at, cook, inflated, shell_pressure
from helpers.meshes import CELLS, HEXAHEDRON, QUADRILATERAL, TRIANGLE, box, rectangle
from helpers.runs import final

COMM = MPI.COMM_WORLD


def size(state: State) -> dict[str, float]:
    """Number of unknowns, by name."""
    return {"unknowns": float(state.unknowns)}


# ## Membranes and cube


def membrane(quick: bool) -> dict[str, float]:
    """Cook's membrane in plane stress: deflection of the middle of the loaded edge times E over the load."""
    found = {}
    for n in (8, 16) if quick else (8, 16, 32):
        domain = rectangle([(0, 0), (1, 1)], (n, n), QUADRILATERAL, COMM)
        x = domain.geometry.x
        s, t = x[:, 0].copy(), x[:, 1].copy()
        x[:, 0], x[:, 1] = 48 * s, 44 * s + t * (44 - 28 * s)
        b = Body(domain, 2, axisymmetric=False)
        load = Traction(b.state, b.where(at(0, 48)), (0.0, 1e-3 / 16), lambda t: t)
        solid = Solid(b.state, LinearElastic(1.0, 1 / 3), plane="stress")
        final(Mechanics(b.state, [solid, load], [b.hold(at(0, 0), i) for i in range(2)]), step=1.0)
        found[f"n = {n}"] = b.at(48, 52)[1] / 1e-3
    return found | size(b.state)


def tight_membrane(quick: bool) -> dict[str, float]:
    """The same, nearly incompressible, in plane strain: elements of two kinds."""
    sizes = (8, 16) if quick else (8, 16, 32)
    kinds = {"Q2": (QUADRILATERAL, 2, "reduced"), "P2": (TRIANGLE, 2, "reduced"), "Q1": (QUADRILATERAL, 1, "reduced")}
    return {f"{name}, n = {n}": cook(*kind, n) for name, kind in kinds.items() for n in sizes}


def cube(quick: bool) -> dict[str, float]:
    """A cube of 10 mm, clamped at its bottom, whose top is lifted by 5 mm: force."""
    n = 4 if quick else 8
    domain = mesh.create_box(COMM, [[0.0] * 3, [10.0] * 3], [n] * 3, HEXAHEDRON)
    state = State(fem.functionspace(domain, ("Lagrange", 1, (3,))))
    bottom, top = (mesh.locate_entities_boundary(domain, 2, at(2, z)) for z in (0.0, 10.0))
    supports = [Support(state, bottom, i) for i in range(3)] + [Support(state, top, i) for i in range(2)]
    supports.append(Support(state, top, 2, lambda t: 5 * t, name="top"))
    last = final(Mechanics(state, [Solid(state, NeoHookean(1.0, 0.45), volumetric="full")], supports))
    return {"force": last["top_force"]} | size(state)


# ## Large strain and rotation


def sphere(quick: bool) -> dict[str, float]:
    """Stretch of the inner surface of a shell, less 1, under the pressure that stretches it by 20 %."""
    found = {}
    for n in (4, 8) if quick else (4, 8, 16):
        b, mechanics = inflated((n, 2 * n), 2, "reduced", pressure=shell_pressure(1.2))
        final(mechanics)
        found[f"n = {n}"] = float(np.mean([b.at(1, 0)[0], b.at(0, 1)[1]]))
    return found | size(b.state)


def torsion(quick: bool) -> dict[str, float]:
    """A cylinder of radius 1 and length 1, twisted by 1 rad: moment and axial force over Rivlin's."""
    found = {}
    for n in (2, 4):
        domain = mesh.create_box(COMM, [[-1.0, -1.0, 0.0], [1.0, 1.0, 1.0]], [n, n, n // 2], HEXAHEDRON)
        x = domain.geometry.x  # squares become circles
        square, circle = np.abs(x[:, :2]).max(axis=1), np.maximum(np.hypot(x[:, 0], x[:, 1]), 1e-12)
        x[:, :2] *= (square / circle)[:, None]
        state = State(fem.functionspace(domain, ("Lagrange", 2, (3,))))
        bottom, top = (mesh.locate_entities_boundary(domain, 2, at(2, z)) for z in (0.0, 1.0))
        shear, nu = 1.0, 0.4999
        solid = Solid(state, IsochoricNeoHookean(2 * shear * (1 + nu), nu), volumetric="reduced")
        held = {"x": 0.0, "y": 0.0, "z": 0.0, "rx": 0.0, "ry": 0.0}
        link = RigidLink(state, [Attachment(top)], (0.0, 0.0, 1.0), motion={**held, "rz": lambda t: t}, name="top")
        last = final(Mechanics(state, [solid, link], [Support(state, bottom, i) for i in range(3)]))
        r = ufl.SpatialCoordinate(domain)
        polar = integrate(form((r[0] ** 2 + r[1] ** 2) * ufl.dx))  # of the section of the mesh, of length 1
        found |= {f"moment, n = {n}": last["top_rz_moment"] / (shear * polar)}
        found |= {f"force, n = {n}": -last["top_z_force"] / (0.5 * shear * polar)}
    return found | size(state)


#: Length and height of a strip, its modulus, and its stiffness in bending per width in plane strain.
LENGTH, HEIGHT, YOUNG, NU = 20.0, 0.5, 1.0, 0.0
BENDING = YOUNG / (1 - NU**2) * HEIGHT**3 / 12


def strip(n: int) -> Body:
    """A strip of n × 2 quadrilaterals of degree 2, clamped at its left end."""
    return Body(rectangle([(0, -HEIGHT / 2), (LENGTH, HEIGHT / 2)], (n, 2), QUADRILATERAL, COMM), 2, axisymmetric=False)


def bending(quick: bool) -> dict[str, float]:
    """A strip whose end is turned by half a turn and else free: moment over that of beam theory."""
    found = {}
    for n in (20,) if quick else (20, 40):
        b = strip(n)
        link = RigidLink(
            b.state, [Attachment(b.where(at(0, LENGTH)))], (LENGTH, 0.0), motion={"rz": lambda t: np.pi * t}, name="end"
        )
        solid = Solid(b.state, StVenantKirchhoff(YOUNG, NU))
        last = final(Mechanics(b.state, [solid, link], [b.hold(at(0, 0), i) for i in range(2)]), step=0.05)
        found[f"n = {n}"] = last["end_rz_moment"] / (BENDING * np.pi / LENGTH)
    return found | size(b.state)


def elastica(quick: bool) -> dict[str, float]:
    """A cantilever under a dead load at its end: its deflection and shortening over those of an inextensible rod."""
    load = 10 * BENDING / LENGTH**2

    def slope(s, y):
        return np.array([y[1], -10 * np.cos(y[0])])

    s = np.linspace(0, 1, 101)
    rod = solve_bvp(slope, lambda a, b: np.array([a[0], b[1]]), s, np.array([s, 1 - s]), tol=1e-9)
    angle = rod.sol(np.linspace(0, 1, 4001))[0]
    x, y = (LENGTH * np.trapezoid(f(angle), dx=1 / 4000) for f in (np.cos, np.sin))
    found = {}
    for n in (20,) if quick else (20, 40):
        b = strip(n)
        dead = Traction(b.state, b.where(at(0, LENGTH)), (0.0, -load / HEIGHT), lambda t: t)
        solid = Solid(b.state, StVenantKirchhoff(YOUNG, NU))
        final(Mechanics(b.state, [solid, dead], [b.hold(at(0, 0), i) for i in range(2)]), step=0.1)
        u = b.at(LENGTH, 0.0)
        found |= {f"deflection, n = {n}": -u[1] / y, f"shortening, n = {n}": u[0] / (x - LENGTH)}
    return found | size(b.state)


# ## Bodies of revolution


def cylinder(quick: bool) -> dict[str, float]:
    """A thick cylinder under inner pressure in plane strain: opening over Lamé's."""
    p, inner, outer, E, nu = 1e-6, 1.0, 2.0, 1.0, 0.3
    opening = p * inner * (1 + nu) / E * ((1 - 2 * nu) * inner**2 + outer**2) / (outer**2 - inner**2)
    found = {}
    for n in (2, 4) if quick else (2, 4, 8):
        b = Body(rectangle([(inner, 0), (outer, 1.0)], (n, 2)), 1)
        load = Pressure(b.state, b.where(at(0, inner)), lambda t: p * t)
        solid = Solid(b.state, LinearElastic(E, nu))
        final(Mechanics(b.state, [solid, load], [b.hold(at(1, z), 1) for z in (0, 1)]), step=1.0)
        found[f"n = {n}"] = b.at(inner, 0.5)[0] / opening
    return found | size(b.state)


def punch(quick: bool) -> dict[str, float]:
    """A rigid frictionless flat punch on a block of a hundred of its radii: force over Sneddon's."""
    depth, nu, found = 1e-3, 0.3, {}
    for n in (12,) if quick else (12, 24):
        domain = rectangle([(0, 0), (2, 1)], (n, 2 * n // 3))
        x = domain.geometry.x  # the edge of the punch is at 1; cells shrink to it from both sides
        x[:, 0] = np.where(x[:, 0] <= 1, 1 - (1 - x[:, 0]) ** 2, 1 + (np.exp(4.6 * (x[:, 0] - 1) ** 2) - 1))
        x[:, 1] = -(np.exp(4.6 * x[:, 1] ** 1.5) - 1)
        b = Body(domain, 2)
        far = x[:, 1].min()
        pressed = b.hold(lambda x: np.isclose(x[1], 0) & (x[0] <= 1 + 1e-9), 1, lambda t: -depth * t, "punch")
        supports = [b.hold(at(0, 0), 0), b.hold(at(1, far), 1), pressed]
        last = final(Mechanics(b.state, [Solid(b.state, LinearElastic(1.0, nu))], supports), step=1.0)
        found[f"n = {n}"] = -last["punch_force"] / (4 * depth / (2 * (1 + nu)) / (1 - nu))
    return found | size(b.state)


# ## Patch tests


def patch(quick: bool) -> dict[str, float]:
    """A square or cube on an irregular mesh, drawn by a tenth: largest error of the displacement over the way."""
    nu, strain, found = 0.3, 0.1, {}
    for cell in CELLS:
        for degree in (1, 2):
            domain = box(cell, comm=COMM, n=3)
            gdim = domain.geometry.dim
            x = domain.geometry.x
            inside = np.all((x[:, :gdim] > 1e-9) & (x[:, :gdim] < 1 - 1e-9), axis=1)
            x[inside, :gdim] += 0.08 * np.sin(7 * x[inside, :gdim][:, ::-1] + 1)
            state = State(fem.functionspace(domain, ("Lagrange", degree, (gdim,))))
            sides = [mesh.locate_entities_boundary(domain, gdim - 1, at(i, 0)) for i in range(gdim)]
            top = mesh.locate_entities_boundary(domain, gdim - 1, at(gdim - 1, 1))
            supports = [Support(state, side, i) for i, side in enumerate(sides)]
            supports.append(Support(state, top, gdim - 1, lambda t: strain * t))
            final(Mechanics(state, [Solid(state, LinearElastic(1.0, nu), volumetric="full")], supports), step=1.0)
            across = -nu / (1 - nu) if gdim == 2 else -nu  # plane strain
            exact = strain * state.V.tabulate_dof_coordinates()[:, :gdim] * [*[across] * (gdim - 1), 1.0]
            difference = state.u.x.array.reshape(-1, gdim) - exact
            found[f"{cell.name}, degree {degree}"] = COMM.allreduce(np.abs(difference).max(), MPI.MAX) / strain
    return {"largest": max(found.values()), **found}


PROBLEMS = {
    "membrane": membrane, "tight membrane": tight_membrane, "cube": cube, "sphere": sphere, "torsion": torsion,
    "bending": bending, "elastica": elastica, "cylinder": cylinder, "punch": punch, "patch": patch,
}  # fmt: skip

if __name__ == "__main__":
    solve("bodies", PROBLEMS)
