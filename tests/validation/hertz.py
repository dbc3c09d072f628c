# # Hertzian contact
#
# Round bodies touch at a point or along a line and flatten each other.  The size of the contact, the pressure and the
# onset of slip are known in closed form, which makes these bodies the benchmark of contact: here for a rigid ball, and
# for two deformable bodies whose meshes do not match.
#
# ## What theory says
#
# **A ball** of radius $R$ that approaches a large body by $d$ touches it within a radius $a$ (Hertz 1881; K. Bronik's
# thesis, 4.96–4.100), with
#
# $$ F = \tfrac{4}{3} E^* \sqrt{R}\, d^{3/2}, \qquad a = \sqrt{R d}, \qquad p_0 = \frac{2 E^* a}{\pi R}, \qquad
#    \frac{1}{E^*} = \frac{1-\nu_1^2}{E_1} + \frac{1-\nu_2^2}{E_2}. $$
#
# The pressure is a half ellipsoid, $p = p_0 \sqrt{1 - r^2/a^2}$.  All this is for $a \ll R$.  To first order in $a/R$ a
# compressible body meets a rigid ball with more force (Hay and Wolff 2001): its surface is drawn inwards by
#
# $$ -u_r = \frac{(1-2\nu)(1+\nu)\, p_0 a^2}{3 E r} \left[ 1 - \left( 1 - \frac{r^2}{a^2} \right)^{3/2} \right], $$
#
# where the ball is lower by $-r u_r/R$, and the energy grows by $\int p\, (-r u_r/R)\, dA$, hence the force by
#
# $$ \frac{\Delta F}{F} = \frac{1 - 2\nu}{\pi (1-\nu)}\, \frac{a}{R}, $$
#
# which is 2.9 per cent at the end here; higher orders reduce it by some tenths of a per cent.  Two equal bodies are
# drawn inwards alike.
#
# **Cylinders** under the line load $P$, with $1/R = 1/R_1 + 1/R_2$, touch within the half width $a$:
#
# $$ a = \sqrt{\frac{4 P R}{\pi E^*}}, \qquad p_0 = \frac{2P}{\pi a}. $$
#
# **Cattaneo and Mindlin**: a tangential load $Q < \mu P$ makes the rims slip, while the middle still sticks within $c$,
#
# $$ \frac{c}{a} = \sqrt{1 - \frac{Q}{\mu P}}, \qquad
#    q = \mu p_0 \left( \sqrt{1 - \frac{x^2}{a^2}} - \frac{c}{a} \sqrt{1 - \frac{x^2}{c^2}} \right),
#    \qquad q_{\max} = \mu p_0 \sqrt{1 - c^2/a^2} \text{ at } x = c. $$

import logging
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
import ufl
from dolfinx import fem
from mpi4py import MPI

from cutsim import (
    Ball,
    Coulomb,
    LinearElastic,
    Mechanics,
    PenaltyContact,
    Solid,
    State,
    StepControl,
    Support,
    SurfacePair,
    TaggedMesh,
    ToolContact,
    ToolPath,
    geometry,
    read_geo,
    run,
)
from cutsim.base.compat import geometry_nodes, nodal_expression
from cutsim.fields.points import FacetPoints, Surface, Values
from cutsim.results.grids import gather_grid
from cutsim.results.output import claim_folder, write_summary
from cutsim.results.pictures import draw_body
from cutsim.results.plots import Curve, plot_curves
from cutsim.results.recording import Columns, Recording

COMM = MPI.COMM_WORLD

# ## A ball on a block
#
# A quarter of each body, in elements of degree 2.  Close to the contact the cells are equal, from there on they grow
# outwards: the blocks end hundreds of contact radii away, because a block of the height $H$ is stiffer than a
# half-space by about $a/H$.  The elastic ball is a block whose face follows the ball near the contact.


@dataclass(frozen=True)
class Specimen:
    """Ball and block, and how they are meshed."""

    material: LinearElastic
    radius: float = 20.0  # [mm]
    depth: float = 0.5  # approach at the end [mm]
    steps: int = 10
    core: float = 4.0  # edge of the cube of equal cells [mm]
    size: float = 2000.0  # of the blocks [mm]
    growth: float = 1.5  # ratio of neighbouring cells outside of the core
    stiffness: float = 20.0  # of the contact over E/h: it gives by about a hundredth of the approach

    def force(self, depth: np.ndarray, *, elastic: bool) -> np.ndarray:
        """Hertz's force; with a ball of the material of the block if elastic [N]."""
        modulus = self.material.young / (1 - self.material.poisson**2) / (1 + elastic)
        return 4 / 3 * modulus * self.radius**0.5 * depth**1.5

    def excess(self, depth: np.ndarray) -> np.ndarray:
        """Force of a body that is drawn inwards under a rigid ball over Hertz's, less one, to first order [–]."""
        nu = self.material.poisson
        return (1 - 2 * nu) / (np.pi * (1 - nu)) * self.contact_radius(depth) / self.radius

    def contact_radius(self, depth: np.ndarray) -> np.ndarray:
        """Hertz's contact radius [mm]."""
        return np.sqrt(self.radius * depth)

    def mesh(self, cells: int, upper: int, comm: MPI.Comm) -> TaggedMesh:
        """One or two blocks with so many cells along their cores."""
        parameters = dict(L=self.size, c=self.core, n=cells, n_upper=upper, growth=self.growth, order=2 if upper else 1)
        return read_geo(geometry("half_spaces"), comm, parameters)

    def supports(self, domain: TaggedMesh, state: State) -> list[Support]:
        """Planes of symmetry, and the bottom held."""
        sides = [Support(state, domain.facets(f"symmetry_{'xy'[i]}"), i) for i in range(2)]
        return sides + [Support(state, domain.facets("bottom"), i) for i in range(3)]

    def penalty(self, cells: int) -> PenaltyContact:
        """Contact law for so many cells along the core."""
        return PenaltyContact.automatic(self.material.young, self.core / cells, factor=self.stiffness)


FULL = Specimen(LinearElastic(1.0, 0.3))  # [MPa]
QUICK = replace(FULL, steps=5, size=1000.0, growth=2.0)
# Table 4.5 of the thesis, in its ten steps
THESIS = LinearElastic(0.004, 0.35)


@dataclass(frozen=True)
class Indentation:
    """The specimen as a mechanical problem."""

    specimen: Specimen
    contact: ToolContact | SurfacePair
    solid: Solid
    size: float  # of the elements of the contact [mm]
    mechanics: Mechanics

    @classmethod
    def rigid(cls, specimen: Specimen, cells: int, comm: MPI.Comm = COMM) -> "Indentation":
        """A rigid ball."""
        domain = specimen.mesh(cells, 0, comm)
        state = State(fem.functionspace(domain.mesh, ("Lagrange", 2, (3,))))
        surface = Surface.exterior(state, domain.facets("contact_lower"))
        end = specimen.radius - specimen.depth
        path = ToolPath.polyline([0.0, 1.0], [(0.0, 0.0, specimen.radius), (0.0, 0.0, end)])
        ball = ToolContact(state, Ball(specimen.radius), path, [surface], contact=specimen.penalty(cells), name="ball")
        solid = Solid(state, specimen.material)
        mechanics = Mechanics(state, [solid, ball], specimen.supports(domain, state))
        return cls(specimen, ball, solid, specimen.core / cells, mechanics)

    @classmethod
    def bodies(cls, specimen: Specimen, cells: int, comm: MPI.Comm = COMM) -> "Indentation":
        """A ball of the material of the block, meshed 4 : 3."""
        upper = round(4 / 3 * cells)
        domain = specimen.mesh(cells, upper, comm)
        round_off(domain, specimen)
        state = State(fem.functionspace(domain.mesh, ("Lagrange", 2, (3,))))
        facets = [domain.facets(f"contact_{body}") for body in ("upper", "lower")]
        pair = SurfacePair(
            state, *facets, young=specimen.material.young, contact=specimen.penalty(upper), search=2 * specimen.depth
        )
        top = domain.facets("top")
        supports = specimen.supports(domain, state) + [Support(state, top, i) for i in range(2)]
        supports.append(Support(state, top, 2, lambda t: -specimen.depth * t, name="ball"))
        solid = Solid(state, specimen.material)
        return cls(specimen, pair, solid, specimen.core / upper, Mechanics(state, [solid, pair], supports))

    @property
    def elastic(self) -> bool:
        """Whether the ball deforms."""
        return isinstance(self.contact, SurfacePair)

    def pressure(self) -> tuple[FacetPoints, Values]:
        """Points of the contact and the pressure there [MPa]. Collective."""
        if isinstance(self.contact, SurfacePair):
            first = self.contact.passes[0]
            return first.points, first.history.trial["pressure"]
        patch = self.contact.patches[0]
        return patch.surface.points, patch.pressure()

    def columns(self, columns: Columns) -> Columns:
        """Approach, and force and contact radius of the whole bodies. Collective."""
        quarter = -columns["ball_force"][0] if self.elastic else columns["ball_force_z"][0]
        return {
            "depth": (self.specimen.depth * self.mechanics.state.time, "length"),
            "force": (4 * quarter, "force"),
            "radius": (self.radius(), "length"),
        }

    def radius(self) -> float:
        """Radius of the half ellipsoid of pressure that has the moments found [mm]. Collective.

        These do not go by elements as the area that is pressed does.  The moment ∫ p r² = ⅖ a² ∫ p is the sharpest;
        where meshes do not match it suffers from points that are pressed beyond the rim, and (∫ p)² = 8/9 π a² ∫ p²
        does not.
        """
        points, pressure = self.pressure()
        load = 4 * points.integral(pressure)
        if self.elastic:
            return float(np.sqrt(9 / 8 / np.pi * load**2 / (4 * points.integral(pressure**2))))
        place = points.evaluator({"x": ufl.SpatialCoordinate(self.mechanics.state.mesh)})()["x"]
        return float(np.sqrt(2.5 * 4 * points.integral(pressure * (place[..., :2] ** 2).sum(axis=-1)) / load))

    def result(self, history: dict[str, np.ndarray]) -> dict[str, float]:
        """Largest distances from Hertz's theory over all depths, and where they are in the end."""
        depth, force, radius = (history[name] for name in ("depth", "force", "radius"))
        ratio = force / self.specimen.force(depth, elastic=self.elastic)
        off = radius / self.specimen.contact_radius(depth) - 1
        return {
            "unknowns": self.mechanics.state.unknowns,
            "force_off": float(np.abs(ratio - 1).max()),
            "force_over_hertz_first": float(ratio[0]),
            "force_over_hertz_last": float(ratio[-1]),
            "radius_off": float(np.abs(off).max()),
            "radius_over_hertz_last": float(1 + off[-1]),
            "energy_closure": float(abs(history["energy_closure"][-1])),
        }


def round_off(domain: TaggedMesh, specimen: Specimen) -> None:
    """Raise the face of the upper block to that of a ball, which levels off outside of the core."""
    x, R = domain.mesh.geometry.x, specimen.radius
    nodes = np.unique(geometry_nodes(domain.mesh)[domain.cells("upper")])
    r, rim = np.hypot(x[nodes, 0], x[nodes, 1]), 1.5 * specimen.core
    inside = np.minimum(r, rim)
    slope = rim / np.sqrt(R**2 - rim**2)
    rise = R - np.sqrt(R**2 - inside**2) + slope * rim * (1 - np.exp(-(r - inside) / rim))
    x[nodes, 2] += rise * np.exp(-x[nodes, 2] / (2 * specimen.core))


# ## Cylinders
#
# Quadratic triangles with curved edges, in plane strain: with straight ones the corners would show in the pressure.
# The flat face of the upper body is held level, lowered, then drawn sideways; the loads are its reactions.


@dataclass(frozen=True)
class Lines:
    """A cylinder on another one or on a block."""

    upper: LinearElastic
    lower: LinearElastic
    radius: float  # [mm]
    lower_radius: float  # 0 for a block [mm]
    friction: float
    band: float  # half the width that is meshed finely [mm]
    size: float  # elements in it, of the upper body [mm]
    far: float  # elements at the far ends [mm]
    approach: float  # [mm]
    slide: float = 0.0  # [mm]
    steps: tuple[int, int] = (10, 10)  # down, sideways

    def mesh(self, comm: MPI.Comm = COMM) -> TaggedMesh:
        """Mesh of both bodies."""
        shape = dict(R=self.radius, R_lower=self.lower_radius, band=self.band, lc=self.size, lc_far=self.far)
        return read_geo(geometry("cylinders"), comm, shape, gdim=2)

    @property
    def contact(self) -> PenaltyContact:
        """Contact law, by the softer body."""
        return PenaltyContact.automatic(min(self.upper.young, self.lower.young), self.size)

    @property
    def modulus(self) -> float:
        """E* [MPa]."""
        return 1 / sum((1 - m.poisson**2) / m.young for m in (self.upper, self.lower))

    def half_width(self, load: float) -> float:
        """Half width of the contact under a line load [mm]."""
        radius = 1 / (1 / self.radius + (1 / self.lower_radius if self.lower_radius else 0.0))
        return float(np.sqrt(4 * load * radius / (np.pi * self.modulus)))

    def peak(self, load: float) -> float:
        """Largest pressure [MPa]."""
        return 2 * load / (np.pi * self.half_width(load))

    def stick(self, load: float, tangential: float) -> float:
        """Half width that sticks [mm]."""
        return self.half_width(load) * float(np.sqrt(max(1 - tangential / (self.friction * load), 0.0)))

    def tractions(self, x: np.ndarray, load: float, tangential: float) -> tuple[np.ndarray, np.ndarray]:
        """Pressure and shear at places [MPa]."""
        a, c = self.half_width(load), self.stick(load, tangential)
        outer, inner = (np.sqrt(np.maximum(w**2 - x**2, 0.0)) / a for w in (a, c))
        return self.peak(load) * outer, self.friction * self.peak(load) * (outer - inner)


STEEL = LinearElastic(200.0, 0.3)
MINDLIN = Lines(STEEL, STEEL, 8.0, 8.0, 0.3, band=1.0, size=0.025, far=1.0, approach=0.1845, slide=0.0295)
# NAFEMS CGS-1, 35 kN/mm
CYLINDER = Lines(
    LinearElastic(210e3, 0.3), LinearElastic(70e3, 0.3), 50.0, 0.0, 0.1,
    band=9.0, size=0.25, far=15.0, approach=1.547, steps=(10, 0),
)  # fmt: skip
# The same without friction, and under smaller and smaller loads: what is left of the distance from Hertz's theory is
# neither friction between unlike bodies nor the size of the contact.
SMOOTH = {
    "smooth_1": replace(CYLINDER, friction=0.0),
    "smooth_2": replace(CYLINDER, friction=0.0, approach=CYLINDER.approach / 4, size=0.125, band=5.4),
    "smooth_3": replace(CYLINDER, friction=0.0, approach=CYLINDER.approach / 16, size=0.0625, band=2.7),
}
TITLES = {"mindlin": "Two cylinders drawn sideways", "cylinder_4": "NAFEMS CGS-1, cylinder on a block"}


@dataclass(frozen=True)
class LineContact:
    """Two cylinders as a mechanical problem."""

    lines: Lines
    pair: SurfacePair
    mechanics: Mechanics

    @classmethod
    def build(cls, lines: Lines, comm: MPI.Comm = COMM) -> "LineContact":
        """Mesh the bodies and put the terms together."""
        domain = lines.mesh(comm)
        state = State(fem.functionspace(domain.mesh, ("Lagrange", 2, (2,))))
        solids = [
            Solid(state, material, cells=domain.cells(name), name=name)
            for name, material in (("upper", lines.upper), ("lower", lines.lower))
        ]
        young = min(lines.upper.young, lines.lower.young)
        facets = [domain.facets(f"contact_{name}") for name in ("upper", "lower")]
        pair = SurfacePair(
            state, *facets, young=young, contact=lines.contact,
            friction=Coulomb(lines.friction) if lines.friction else None, search=0.2 * lines.band,
        )  # fmt: skip
        top, down = domain.facets("top"), float(lines.steps[0])
        supports = [Support(state, domain.facets("bottom"), i) for i in range(2)]
        supports += [
            Support(state, top, 1, lambda t: -lines.approach * min(t / down, 1.0), name="down", corners=(down,)),
            Support(state, top, 0, lambda t: lines.slide * max(t - down, 0.0) / (lines.steps[1] or 1), name="side"),
        ]
        return cls(lines, pair, Mechanics(state, [*solids, pair], supports))

    def run(self) -> dict[str, float]:
        """Load it to the end; the last row. Collective."""
        rows: list[Columns] = []
        with self.mechanics.problem:
            run(self.mechanics, float(sum(self.lines.steps)), StepControl.fixed(1.0), lambda r: rows.append(r.columns))
        return {name: value for name, (value, _) in rows[-1].items()}

    def at_points(self) -> tuple[Values, Values, Values]:
        """Reference position along the contact, pressure and shear at the points of this rank. Collective."""
        first = self.pair.passes[0]
        place = first.points.evaluator({"x": ufl.SpatialCoordinate(self.pair.state.mesh)[0]})()["x"]
        shear = np.zeros(place.shape) if first.slip is None else first.slip.values("traction").reshape(place.shape)
        return place, first.history.trial["pressure"], shear

    def tractions(self) -> dict[str, np.ndarray]:
        """The same of all ranks, from left to right, by name. Collective."""
        rows = np.stack([column.ravel() for column in self.at_points()], axis=1)
        table = np.unique(np.concatenate(self.pair.state.mesh.comm.allgather(rows)), axis=0).T
        return dict(zip(("x", "pressure", "shear"), table, strict=True))

    def result(self, last: dict[str, float]) -> dict[str, float]:
        """What was measured and, by closed forms for the same loads, should have been. Collective."""
        lines, points = self.lines, self.pair.passes[0].points
        load, tangential = -last["down_force"], abs(last["side_force"])
        shear = np.abs(self.tractions()["shear"])
        x, pressure, _ = self.at_points()
        half_width = 2 * float(np.sqrt(points.integral(pressure * x**2) / points.integral(pressure)))
        peak = points.maximum(points.facet_mean(pressure)[:, None])
        result = {
            "load": load,
            "half_width": half_width,
            "half_width_of_theory": lines.half_width(load),
            "width_over_theory": half_width / lines.half_width(load),
            "peak_over_theory": peak / lines.peak(load),
            "width_over_radius": half_width / lines.radius,
            "peak_pressure": peak,
            "peak_pressure_of_theory": lines.peak(load),
            "element": lines.size,
            "energy_closure": abs(last["energy_closure"]),
        }
        if lines.slide:
            ratio = lines.stick(load, tangential) / lines.half_width(load)
            result |= {
                "tangential_load": tangential,
                "stick": 0.5 * last["pair_sticking"],
                "stick_of_theory": lines.stick(load, tangential),
                "peak_shear": float(shear.max()),
                "peak_shear_of_theory": lines.friction * lines.peak(load) * float(np.sqrt(1 - ratio**2)),
            }
        return result


# ## Runs
#
# The study goes through meshes from coarse to fine; the finest leaves its history and pictures.


def indent(problem: Indentation, out: Path | None = None) -> dict[str, np.ndarray]:
    """Indent to the end, with a folder for what is recorded if it is given; the history. Collective."""
    rows: list[Columns] = []
    control = StepControl.fixed(1 / problem.specimen.steps)
    with problem.mechanics.problem:
        if out is None:
            run(problem.mechanics, 1.0, control, lambda r: rows.append(r.columns | problem.columns(r.columns)))
            return {name: np.array([row[name][0] for row in rows]) for name in rows[0]}
        title, show = "hertz", {"depth": "depth", "force": "force"}
        derived = {"cauchy_stress": problem.solid.cauchy_stress(problem.mechanics.state.u)}
        with Recording(
            out, problem.mechanics, 1.0, title=title, show=show, extra=problem.columns, derived=derived
        ) as recording:
            run(problem.mechanics, 1.0, control, recording)
    draw(problem, out)
    return recording.columns()


def study(
    build: Callable[[Specimen, int], Indentation], specimen: Specimen, meshes: tuple[int, ...], out: Path
) -> tuple[dict[int, dict[str, float]], dict[int, dict[str, np.ndarray]]]:
    """Results and histories by the number of cells along the core. Collective."""
    results, histories = {}, {}
    for cells in meshes:
        problem = build(specimen, cells)
        histories[cells] = indent(problem, out if cells == meshes[-1] else None)
        results[cells] = problem.result(histories[cells])
    return results, histories


# ## Pictures


def draw(problem: Indentation, out: Path) -> None:
    """The deformed bodies near the contact. Collective."""
    state, specimen = problem.mechanics.state, problem.specimen
    space = fem.functionspace(state.mesh, ("DG", 0))
    stress = fem.Function(space)
    deviator = ufl.dev(problem.solid.cauchy_stress(state.u))
    mises = ufl.sqrt(1.5 * ufl.inner(deviator, deviator))
    stress.interpolate(nodal_expression(mises, space))
    body = gather_grid(state.u, {"stress": stress})
    if body is not None:
        body = body.extract_cells(np.abs(body.cell_centers().points).max(axis=1) < 3 * specimen.core)
    draw_body(
        out / "body.png", body, "stress", label="von Mises stress [MPa]", title="Hertzian contact",
        mirror=("x",), view=(0.3, -1.0, 0.35), up=(0.0, 0.0, 1.0),
    )  # fmt: skip


def compare(specimen: Specimen, histories: dict[int, dict[str, np.ndarray]], out: Path, *, elastic: bool) -> None:
    """Force and contact radius of all meshes with Hertz's. Call it on one rank."""
    d = np.linspace(0.0, specimen.depth, 200)
    theory = {"force": specimen.force(d, elastic=elastic), "radius": specimen.contact_radius(d)}
    labels = {"force": "force [N]", "radius": "contact radius [mm]"}
    ball = "elastic ball" if elastic else "rigid ball"
    for name, label in labels.items():
        curves = [Curve(d, theory[name], "Hertz", "k-")]
        for cells, history in histories.items():
            curves.append(Curve(history["depth"], history[name], f"{cells} cells along the core", "o--"))
        plot_curves(out / f"{name}.png", curves, xlabel="approach [mm]", ylabel=label, title=f"Hertz, {ball}")


def profile(contact: LineContact, last: dict[str, float], out: Path, title: str) -> None:
    """Pressure and shear along the contact with the closed forms. Collective."""
    measured = contact.tractions()
    if COMM.rank:
        return
    load, tangential = -last["down_force"], abs(last["side_force"])
    x = np.linspace(-1.2, 1.2, 400) * contact.lines.half_width(load)
    pressure, shear = contact.lines.tractions(x, load, tangential)
    shown = np.abs(measured["x"]) < x[-1]
    curves = [
        Curve(measured["x"][shown], measured["pressure"][shown], "pressure", "C0."),
        Curve(x, pressure, "Hertz", "C0-"),
    ]
    if contact.lines.slide:
        towards = np.abs(measured["shear"][shown]) / contact.lines.friction
        curves.append(Curve(measured["x"][shown], towards, "shear over friction coefficient", "C1."))
        curves.append(Curve(x, shear / contact.lines.friction, "Cattaneo and Mindlin", "C1-"))
    plot_curves(out, curves, xlabel="place [mm]", ylabel="traction [MPa]", title=title)


# ## The run


def check(results: dict[str, dict[str, float]], *, quick: bool) -> None:
    """The headline numbers."""
    # the audit's trapezoidal rule for the work of a force that grows with the power 3/2
    force = np.linspace(0.0, 1.0, 1 + (QUICK if quick else FULL).steps) ** 1.5
    trapezoidal = np.mean(0.5 * (force[1:] + force[:-1])) / 0.4 - 1
    for name in ("rigid", "elastic", *(() if quick else ("thesis",))):
        result = results[name]
        assert result["force_off"] < (0.03 if quick else 0.02), name
        assert abs(result["radius_over_hertz_last"] - 1) < (0.05 if name == "elastic" else 0.02), name
        assert result["energy_closure"] < 2 * trapezoidal, name
    for name in ("mindlin", "cylinder"):
        result = results[name]
        assert abs(result["half_width"] / result["half_width_of_theory"] - 1) < 0.01, name
        assert abs(result["peak_pressure"] / result["peak_pressure_of_theory"] - 1) < 0.03, name
        assert result["energy_closure"] < 1e-3, name
    assert abs(results["mindlin"]["stick"] / results["mindlin"]["stick_of_theory"] - 1) < 0.05
    assert abs(results["mindlin"]["peak_shear"] / results["mindlin"]["peak_shear_of_theory"] - 1) < 0.03


def main(
    quick: Annotated[bool, typer.Option("--quick", help="coarser, in fewer steps")] = False,
    out: Annotated[Path, typer.Option(help="where the results go")] = Path("results/validation/hertz"),
    overwrite: Annotated[bool, typer.Option("--overwrite", help="replace the results of an older run")] = False,
) -> None:
    """Press balls and cylinders on each other: a rigid ball, two bodies, two cylinders that are drawn sideways."""
    level = logging.WARNING if COMM.rank == 0 else logging.ERROR
    logging.basicConfig(level=level, format="%(name)s: %(message)s")
    claim_folder(out, COMM, overwrite=overwrite)
    specimen = QUICK if quick else FULL
    meshes = {"rigid": (2, 3) if quick else (2, 3, 4), "elastic": (2,) if quick else (2, 3)}
    results: dict[str, dict[str, float]] = {}
    for name, build in (("rigid", Indentation.rigid), ("elastic", Indentation.bodies)):
        rows, histories = study(build, specimen, meshes[name], out / name)
        results |= {f"{name}_{cells}": row for cells, row in rows.items()} | {name: rows[meshes[name][-1]]}
        if COMM.rank == 0:
            compare(specimen, histories, out / name, elastic=name == "elastic")
    for name, cells in ({} if quick else {"thesis_2": 2, "thesis": 3}).items():
        thesis = Indentation.rigid(replace(specimen, material=THESIS), cells)
        results[name] = thesis.result(indent(thesis))
    lines = {"mindlin": MINDLIN, "cylinder": CYLINDER}
    if not quick:
        fine = {f"cylinder_{n}": replace(CYLINDER, size=0.5 / n) for n in (1, 2, 4)}
        lines = {"mindlin_coarse": replace(MINDLIN, size=2 * MINDLIN.size), "mindlin": MINDLIN, **fine, **SMOOTH}
    for name, problem in lines.items():
        contact = LineContact.build(replace(problem, size=1.6 * problem.size) if quick else problem)
        last = contact.run()
        results[name] = contact.result(last)
        if name in TITLES:
            profile(contact, last, out / f"{name}.png", TITLES[name])
    if not quick:
        results["cylinder"] = results["cylinder_4"]
    write_summary(out / "summary.json", results, COMM)
    if COMM.rank == 0:
        for name, result in results.items():
            print(f"{name:>12}", ", ".join(f"{key} {value:.5g}" for key, value in result.items()))
    check(results, quick=quick)


if __name__ == "__main__":
    typer.run(main)
