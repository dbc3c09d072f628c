# # Orders of convergence
#
# How fast does the error fall with the size $h$ of the elements where bodies touch, rub or are bonded?  Theory says as
# $h^k$ in the energy norm for elements of degree $k$ (K. Bronik, equations A.17, A.45 and A.68).
#
# ## What is computed
#
# Two elastic bodies of 1 mm × 0.5 mm, one upon the other, whose displacement is chosen:
#
# $$ u_\text{lower} = y\,q(x), \qquad u_\text{upper} = D + (1 - y)\,r(x), $$
#
# with smooth $q$ and $r$.  The jump $\delta = D + \tfrac12 (r - q)$ opens and slides everywhere, or is pressed and
# slides.  The tractions $T(\delta)$ between the faces follow from the law by hand: the exponential one for a bond, a
# pressure $\varepsilon_N \langle -\delta_n \rangle$ for contact, $\mu$ times that for friction.  The loads
#
# $$ L(v) = \int \sigma(u) : \varepsilon(v)\,\mathrm dV
#    + \int T(\delta) \cdot (v_\text{upper} - v_\text{lower})\,\mathrm dA $$
#
# make this displacement the solution.  The meshes match, with a crack between the bodies or a pair of surfaces, or
# they do not, 3 : 2.  All displacements are a millionth of the bodies, which makes them those of small strain.  Contact
# and friction act between points that face each other in the reference configuration: the error on the finest meshes of
# degree 2 is so small that the turning of surfaces that slide would be seen.
#
# ## What is found
#
# The order is that of theory, and the errors on meshes that do not match are those of meshes that do.  What is needed
# for that is integration over the segments of slave facets that face one master facet each.  A rule for whole facets
# leaves an error of the order $h^{1/2}$, because its points do not know where a master facet ends.

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import typer
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim import (
    Coulomb,
    Crack,
    CrackFriction,
    Exponential,
    LinearElastic,
    Mechanics,
    PenaltyContact,
    Solid,
    State,
    Support,
    SurfacePair,
    Tolerances,
    cracked_space,
    geometry,
    read_geo,
)
from cutsim.analysis.stepping import begin
from cutsim.base.assembly import integrate
from cutsim.base.compat import cell_partitioner, form
from cutsim.base.kinematics import Expr
from cutsim.base.terms import Term
from cutsim.results.output import claim_folder, write_summary

COMM = MPI.COMM_WORLD
SOLID = LinearElastic(young=1.0, poisson=0.3)
SCALE = 1e-6  # of all displacements [mm]
MU, PENALTY = 0.3, 1.0  # stresses in contact and in the bodies are of one size
OPENING, STRENGTH = 2 * SCALE, 0.5 * SCALE
LAW = Exponential(strength=STRENGTH, opening=OPENING, shear_strength=STRENGTH, shear_opening=OPENING)
Joint = Literal["bond", "contact", "friction"]
Meshes = Literal["crack", "matching", "non-matching"]
JOINTS: tuple[Joint, ...] = ("bond", "contact", "friction")
MESHES: tuple[Meshes, ...] = ("crack", "matching", "non-matching")


# ## The solution


def lower(x: Expr) -> Expr:
    """Displacement of the lower body."""
    return SCALE * x[1] * ufl.as_vector([0.4 * ufl.sin(2 * x[0] + 1), 0.3 * ufl.cos(1.5 * x[0])])


def far(joint: Joint) -> tuple[float, float]:
    """Displacement D of the top."""
    return 0.5 * SCALE, (1.2 if joint == "bond" else -1.2) * SCALE


def upper(x: Expr, joint: Joint) -> Expr:
    """Displacement of the upper body."""
    r = SCALE * ufl.as_vector([0.3 * ufl.cos(x[0] + 0.5), -0.25 * ufl.sin(2 * x[0])])
    return ufl.as_vector(far(joint)) + (1 - x[1]) * r


def traction(x: Expr, joint: Joint) -> Expr:
    """Traction that holds the faces together, on the lower one."""
    slide, opening = upper(x, joint) - lower(x)
    if joint == "bond":
        s, o = slide / OPENING, opening / OPENING
        fading = STRENGTH * ufl.exp(-o - s**2)
        return ufl.as_vector([2 * np.sqrt(np.e / 2) * s * (1 + o) * fading, np.e * o * fading])
    pressure = -PENALTY * opening
    return ufl.as_vector([(MU if joint == "friction" else 0.0) * pressure, -pressure])


def stress(u: Expr) -> Expr:
    """Stress of plane strain."""
    strain = ufl.sym(ufl.grad(u))
    return 2 * SOLID.shear * strain + (SOLID.bulk - 2 / 3 * SOLID.shear) * ufl.tr(strain) * ufl.Identity(2)


# ## The bodies


@dataclass(frozen=True)
class Bodies:
    """Both bodies, the measures over them, and the form of a traction on the faces."""

    state: State
    terms: tuple[Term, ...]
    parts: tuple[ufl.Measure, ufl.Measure]
    on_faces: Callable[[Expr, Expr], ufl.Form]
    ends: tuple[NDArray[np.int32], NDArray[np.int32]]
    place: Expr

    @classmethod
    def cracked(cls, n: int, degree: int, joint: Joint) -> "Bodies":
        """One mesh, with a crack between the bodies."""
        kind = mesh.CellType.quadrilateral
        domain = mesh.create_unit_square(COMM, n, n, kind, partitioner=cell_partitioner())
        facets = mesh.locate_entities(domain, 1, lambda x: np.isclose(x[1], 0.5))
        cells = [mesh.locate_entities(domain, 2, lambda x, s=s: s * (x[1] - 0.5) > -1e-9) for s in (-1, 1)]
        state = State(cracked_space(domain, ("Lagrange", degree, (2,)), facets))
        options = {"young": SOLID.young, "normal": "reference", "contact": PenaltyContact(PENALTY)}
        crack = Crack(state, facets, cells[0], LAW if joint == "bond" else None, **options)
        terms = [crack, CrackFriction(crack, Coulomb(MU, 100.0))] if joint == "friction" else [crack]

        def on_faces(T: Expr, v: Expr) -> ufl.Form:
            return ufl.inner(T("+"), v("-") - v("+")) * crack.points.measure

        ends = [mesh.locate_entities_boundary(domain, 1, lambda x, y=y: np.isclose(x[1], y)) for y in (0.0, 1.0)]
        parts = [state.measures.cells(c) for c in cells]
        return cls(state, tuple(terms), tuple(parts), on_faces, tuple(ends), ufl.SpatialCoordinate(domain))

    @classmethod
    def paired(cls, n: int, m: int, degree: int, joint: Joint) -> "Bodies":
        """A mesh for each body, with a pair of surfaces between them."""
        sizes = {"dim": 2, "L": 1, "H": 0.5, "n": n, "m": m, "ly": 1 / m, "growth": 1}
        tagged = read_geo(geometry("boxes"), COMM, sizes, gdim=2)
        domain = tagged.mesh
        state = State(fem.functionspace(domain, ("Lagrange", degree, (2,))))
        faces = [tagged.facets(name) for name in ("slave", "master")]
        friction = Coulomb(MU, 100.0) if joint == "friction" else None
        law = LAW if joint == "bond" else None
        options = {"young": SOLID.young, "contact": PenaltyContact(PENALTY), "friction": friction}
        pair = SurfacePair(state, *faces, law, small_sliding=law is None, search=0.2, **options)
        above, below = (state.measures.exterior(facets, "facets") for facets in faces)

        def on_faces(T: Expr, v: Expr) -> ufl.Form:
            exact = {"quadrature_degree": 10}
            return ufl.inner(T, v) * above(metadata=exact) - ufl.inner(T, v) * below(metadata=exact)

        parts = [state.measures.cells(tagged.cells(name)) for name in ("lower", "upper")]
        ends = [tagged.facets(name) for name in ("bottom", "top")]
        place = ufl.SpatialCoordinate(domain) + ufl.as_vector([0.0, 0.5])
        return cls(state, (pair,), tuple(parts), on_faces, tuple(ends), place)

    @classmethod
    def build(cls, meshes: Meshes, n: int, degree: int, joint: Joint) -> "Bodies":
        """Bodies with n elements along their faces, the upper one, the slave, with 3/2 of that if they do not match."""
        if meshes == "crack":
            return cls.cracked(n, degree, joint)
        return cls.paired(n if meshes == "matching" else 3 * n // 2, n, degree, joint)


class Given(Term):
    """Loads that make a chosen displacement the solution."""

    def __init__(self, bodies: Bodies, joint: Joint) -> None:
        self.name, self.state = "given", bodies.state
        self._bodies, self._joint = bodies, joint

    def residual(self, v: Expr) -> ufl.Form:
        """Minus the work of the stresses and tractions of that displacement."""
        x, exact = self._bodies.place, {"quadrature_degree": 8}
        fields = lower(x), upper(x, self._joint)
        work = self._bodies.on_faces(traction(x, self._joint), v)
        for u, dx in zip(fields, self._bodies.parts, strict=True):
            work += ufl.inner(stress(u), ufl.sym(ufl.grad(v))) * dx(metadata=exact)
        return -work


# ## The error


def error(meshes: Meshes, joint: Joint, degree: int, n: int) -> float:
    """Energy norm of the error over that of the displacement. Collective."""
    bodies = Bodies.build(meshes, n, degree, joint)
    state = bodies.state
    supports = [Support(state, bodies.ends[0], i) for i in range(2)]
    supports += [Support(state, bodies.ends[1], i, value) for i, value in enumerate(far(joint))]
    solid = Solid(state, SOLID, volumetric="full")
    terms = [solid, *bodies.terms, Given(bodies, joint)]
    mechanics = Mechanics(state, terms, supports, tolerances=Tolerances(rtol=1e-10))
    with mechanics.problem:
        begin(mechanics, 1.0)
        outcome = mechanics.solve("basic")
        assert outcome.converged, outcome.message
    x, norms = bodies.place, []
    for start in (state.u, 0 * state.u):
        differences = (start - field for field in (lower(x), upper(x, joint)))
        energies = (
            integrate(form(ufl.inner(stress(e), ufl.grad(e)) * dx(metadata={"quadrature_degree": 8})))
            for e, dx in zip(differences, bodies.parts, strict=True)
        )
        norms.append(np.sqrt(sum(energies)))
    return float(norms[0] / norms[1])


@dataclass(frozen=True)
class Row:
    """Errors on finer and finer meshes."""

    joint: Joint
    meshes: Meshes
    degree: int
    sizes: tuple[int, ...]
    errors: tuple[float, ...]

    @property
    def orders(self) -> NDArray[np.float64]:
        """Order from each mesh to the next one."""
        e, n = np.log(self.errors), np.log(self.sizes)
        return -np.diff(e) / np.diff(n)

    @property
    def least(self) -> float:
        """Order that it is to have: that of theory, as far as these meshes are fine enough to show it."""
        return self.degree - 0.1

    def __str__(self) -> str:
        errors = "  ".join(f"{e:9.3e}" for e in self.errors)
        orders = "  ".join(f"{order:5.2f}" for order in self.orders)
        return f"{self.joint:9} {self.meshes:13} {self.degree}   {errors}   {orders}"


def rows(
    sizes: tuple[int, ...], joints: tuple[Joint, ...] = JOINTS, meshes: tuple[Meshes, ...] = MESHES
) -> Iterator[Row]:
    """A row for each joint, meshes and degree. Collective."""
    for joint in joints:
        for kind in meshes:
            for degree in (1, 2):
                yield Row(joint, kind, degree, sizes, tuple(error(kind, joint, degree, n) for n in sizes))


def main(
    quick: Annotated[bool, typer.Option("--quick", help="coarser meshes")] = False,
    out: Annotated[Path, typer.Option(help="where the table goes")] = Path("results/validation/orders"),
    overwrite: Annotated[bool, typer.Option("--overwrite", help="replace the results of an older run")] = False,
) -> None:
    """Print a table of errors and orders, and see that no order is too low."""
    claim_folder(out, COMM, overwrite=overwrite)
    sizes = (4, 8, 16) if quick else (4, 8, 16, 32, 64)
    lines = [f"elements along the joint: {', '.join(map(str, sizes))}", "joint, meshes, degree, errors, orders"]
    found = list(rows(sizes))
    lines += map(str, found)
    if COMM.rank == 0:
        sys.stdout.write("\n".join([*lines, ""]))
    values = {f"{r.joint}, {r.meshes}, degree {r.degree}": [*r.errors, *r.orders] for r in found}
    write_summary(out / "summary.json", values, COMM)
    for row in found:
        assert row.orders[-1] > row.least, row


if __name__ == "__main__":
    typer.run(main)
