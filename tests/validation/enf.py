# # End-notched flexure
#
# Two bonded arms, cracked from one end, are bent over three pins.  The arms slide on each other, and the bond breaks in
# shear (mode II).  Above the left pin their faces are pressed together and rub.  The work of this friction must not be
# taken for toughness.
#
# ## What theory says
#
# Arms of height $h$ and width $b$ with plane modulus $E'$, half the span $L$, and a crack of length $a$, which acts as
# one of length $a' = a + \chi h$ with $\chi = 0.206$ for isotropic arms (Bao, Ho, Suo and Fan 1992).  Without friction,
# with the shear modulus $G_s$ and under the load $P$
#
# $$ G_{II} = \frac{9 P^2 a'^2}{16 E' b^2 h^3}, \qquad
#    \frac{w}{P} = \frac{3 a'^3 + 2 L^3}{8 E' b h^3} + \frac{3 L}{10\, G_s b h}. $$
#
# At prescribed deflection the growth is stable from $a' = 0.69\,L$ on; here it begins at $a = 0.75\,L$.  The correction
# is 2 to 3 per cent of $G_{II}$, which is the error of the simple beam with $\chi = 0$.
#
# **Friction.**  Both arms bend alike, hence each carries half of the shear force $P/2$, and above the pin they press on
# each other with $P/4$.  Friction $F = \mu P/4$ acts on the upper arm and against it on the lower one, a couple
# $F h$ that takes $F h/2$ from the moment of each.  With the moment $m = P a'/2$ of the whole section the energy that
# a unit of growth releases is
#
# $$ b\,G_{II} = \frac{12}{E' b h^3} \left[ \frac{(m - F h)^2}{4} + \frac{F^2 h^2}{12} - \frac{m^2}{16} \right]
#    = \frac{9\,(m - \tfrac{4}{3} F h)^2}{4 E' b h^3}
#    \;\Rightarrow\; G_{II} = \frac{9 P^2 (a' - \tfrac{2}{3} \mu h)^2}{16 E' b^2 h^3}, $$
#
# so that friction unloads the front like a crack that is shorter by $2 \mu h/3$.  Its work is $F$ times the
# sliding above the pin, $s = 3 P a' (a' - \tfrac{4}{3} \mu h) / (2 E' b h^2)$, while load and crack grow.
#
# ## The specimen
#
# Plane strain and small strain, $E$ = 200 GPa, $\nu$ = 0.3, $h$ = 3 mm, $L$ = 60 mm, $a_0$ = 45 mm, $G_{IIc}$ = 1 N/mm.
# The shear strength of 200 MPa makes a process zone of 1 to 2 mm.

import logging
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from dolfinx import fem
from dolfinx.mesh import locate_entities
from mpi4py import MPI

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
    StepControl,
    Support,
    cracked_space,
    geometry,
    read_geo,
    run,
)
from cutsim.base.compat import nodal_expression
from cutsim.results.grids import gather_facets, gather_grid
from cutsim.results.output import claim_folder, write_summary
from cutsim.results.pictures import draw_body
from cutsim.results.plots import Curve, plot_curves, plot_energy
from cutsim.results.recording import Columns, Recording
from cutsim.studies.fracture import (
    ENF_CORRECTION,
    EndNotchedBeam,
    JIntegral,
    crack_front,
    crack_profile,
    energy_release_from_compliance,
    plane_modulus,
)

MESH = geometry("enf")
COMM = MPI.COMM_WORLD


# Elements are of degree 2.  Time counts steps: some to where the crack is about to grow, then smaller ones.


@dataclass(frozen=True)
class Specimen:
    """A beam, its bond and mesh, and how far it is bent."""

    material: LinearElastic
    law: Exponential
    height: float = 3.0  # of an arm [mm]
    half_span: float = 60.0  # [mm]
    crack: float = 45.0  # initial length, from the pin [mm]
    size: float = 0.5  # elements along the path of the crack [mm]
    layers: int = 3  # elements through an arm
    deflections: tuple[float, float] = (0.95, 1.15)  # before growth, at the end [mm]
    steps: tuple[int, int] = (10, 40)

    @property
    def until(self) -> float:
        """Time at the end."""
        return float(sum(self.steps))

    def deflection(self, time: float) -> float:
        """Deflection under the load at a time [mm]."""
        return float(np.interp(time, [0, self.steps[0], self.until], [0, *self.deflections]))

    @property
    def toughness(self) -> float:
        """G_IIc [N/mm]."""
        return self.law.shear_toughness

    def theory(self, friction: float = 0.0) -> EndNotchedBeam:
        """Beam theory for a unit width."""
        E, nu, G = self.material.young, self.material.poisson, self.material.shear
        return EndNotchedBeam(self.height, 1.0, self.half_span, plane_modulus(E, nu), G, ENF_CORRECTION, friction)


FULL = Specimen(
    material=LinearElastic(200e3, 0.3),
    law=Exponential(strength=50.0, toughness=0.25, shear_strength=200.0, shear_toughness=1.0),
)
QUICK = replace(FULL, size=0.75, layers=2, deflections=(0.9, 1.14), steps=(6, 30))


# ## The problem
#
# The pins hold points of the lower face, the load pushes a point of the upper one: rollers leave the arms free to
# slide.  The arms touch along the whole crack but press on each other above the pin only.  A contact whose pressure
# begins gradually does not alternate between open and closed there.


@dataclass(frozen=True)
class Beam:
    """The specimen as a mechanical problem, of unit width."""

    state: State
    solid: Solid
    faces: Crack
    bond: Crack | None
    mechanics: Mechanics

    @classmethod
    def build(cls, specimen: Specimen, friction: float = 0.0, *, grows: bool = True, comm: MPI.Comm = COMM) -> "Beam":
        """Mesh the specimen and put its terms together; without `grows` nothing can break ahead of the crack."""
        h, L, young = specimen.height, specimen.half_span, specimen.material.young
        parameters = dict(h=h, L=L, a0=specimen.crack, lc=specimen.size, ny=specimen.layers)
        domain = read_geo(MESH, comm, parameters, gdim=2)
        open_facets, bond_facets = domain.facets("precrack"), domain.facets("crack")
        state = State(cracked_space(domain.mesh, ("Lagrange", 2, (2,)), [open_facets, bond_facets][: 1 + grows]))
        solid = Solid(state, specimen.material)
        common = dict(young=young, normal="reference")
        contact = PenaltyContact.automatic(young, h, factor=3.0, blend=1e-5 * h)
        lower = domain.cells("lower")
        faces = Crack(state, open_facets, lower, name="faces", contact=contact, **common)
        bond = Crack(state, bond_facets, lower, specimen.law, name="bond", contact=contact, **common) if grows else None
        cracks = [c for c in (faces, bond) if c is not None]
        rubbing = [CrackFriction(c, Coulomb(friction)) for c in cracks] if friction else []

        def pin(x: float, y: float, component: int, **options) -> Support:
            at = locate_entities(domain.mesh, 0, lambda X: np.isclose(X[0], x) & np.isclose(X[1], y))
            return Support(state, at, component, dim=0, **options)

        supports = [
            pin(0.0, -h, 1, name="left"),
            pin(2 * L, -h, 1, name="right"),
            pin(2 * L, -h, 0),
            pin(L, h, 1, name="load", value=lambda t: -specimen.deflection(t), corners=(float(specimen.steps[0]),)),
        ]
        return cls(state, solid, faces, bond, Mechanics(state, [solid, *cracks, *rubbing], supports))

    def columns(self, columns: Columns) -> Columns:
        """Deflection and load per width, sliding above the left pin, and the front. Collective.

        The sharp front of theory is where the bond carries its strength: where it slides by ε_t/√2.
        """
        at_strength = self.bond and crack_front(self.bond, 0, "sliding", self.bond.law.shear_opening / np.sqrt(2))
        front = {"front": (at_strength, "length")} if self.bond else {}
        return front | {
            "deflection": (-columns["load_displacement"][0], "length"),
            "load": (-columns["load_force"][0], "toughness"),
            "slip": (float(np.interp(0.0, *crack_profile(self.faces, "sliding"))), "length"),
        }


def control() -> StepControl:
    """Equal steps; full Newton steps go through softening best."""
    return StepControl(first=1.0, largest=1.0, line_searches=("basic", "l2", "bt"))


# ## Before growth
#
# Beams that cannot break: $G_{II}$ from $J$ around the front, away from the faces that rub, and without friction from
# the compliances of three lengths of crack too.


def stationary(specimen: Specimen, length: float, friction: float) -> dict[str, float]:
    """Load and deflection of a beam that cannot break, and J, compliance and slip over theory. Collective."""
    beam = Beam.build(replace(specimen, crack=length, steps=(4, 1)), friction, grows=False)
    rows: list[Columns] = []
    with beam.mechanics.problem:
        run(beam.mechanics, 4.0, control(), lambda report: rows.append(report.columns | beam.columns(report.columns)))
    load, deflection, slip = (rows[-1][name][0] for name in ("load", "deflection", "slip"))
    radii = (0.5 * specimen.height, 0.95 * specimen.height)
    J = JIntegral(beam.solid, (length, 0.0), (1.0, 0.0), *radii)()
    theory = specimen.theory(friction)
    return {
        "load": load,
        "deflection": deflection,
        "J_over_theory": J / theory.release(load, length),
        "compliance_over_theory": deflection / load / theory.compliance(length),
        "slip_over_theory": slip / theory.slip(load, length),
    }


def before_growth(specimen: Specimen, friction: float) -> dict[str, float]:
    """Ratios to theory of beams that cannot break, with the initial crack. Collective."""
    fine = replace(specimen, size=0.5 * specimen.size, layers=2 * specimen.layers)
    middle = stationary(fine, specimen.crack, friction)
    result = {name: value for name, value in middle.items() if name.endswith("theory")}
    if not friction:  # which makes the compliance depend on the path
        lengths = specimen.crack + np.array([-2.0, 0.0, 2.0])
        rows = [stationary(fine, lengths[0], friction), middle, stationary(fine, lengths[2], friction)]
        loads, deflections = ([row[name] for row in rows] for name in ("load", "deflection"))
        G = energy_release_from_compliance(loads, deflections, lengths, 1.0)[1]
        result["G_by_compliance_over_theory"] = G / specimen.theory().release(loads[1], specimen.crack)
    return result


# ## Growth
#
# Theory assumes a sharp front in a rigid bond.  Here the bond deforms ahead of the crack before it breaks, so the
# beam is a little softer and the peak is rounded and lower.  Once the process zone travels, load and deflection are
# those of theory.  The front is where the bond carries its strength, at a slide of $\varepsilon_t/\sqrt2$: ahead of
# it the traction still rises, behind it the bond softens.


def theory_curve(specimen: Specimen, friction: float) -> dict[str, np.ndarray]:
    """Crack length, deflection, load and work of friction per width by beam theory: the rise, then growth."""
    theory = specimen.theory(friction)
    a = np.linspace(specimen.crack, 0.95 * specimen.half_span, 500)
    P, w = np.transpose([theory.propagation(specimen.toughness, x) for x in a])
    s = np.array([theory.slip(*pair) for pair in zip(P, a, strict=True)])
    rise = np.linspace(0.0, 1.0, 100)
    a, P, w, s = (np.concatenate([x[0] * rise, x[1:]]) for x in (a, P, w, s))
    a = np.maximum(a, specimen.crack)
    force = friction * P / 4
    rubbed = np.concatenate([[0.0], np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(s))])
    return {"length": a, "deflection": w, "load": P, "friction": rubbed}


def growth(specimen: Specimen, history: dict[str, np.ndarray], friction: float) -> dict[str, float]:
    """Steady growth against beam theory, and the balance of friction."""
    curve = theory_curve(specimen, friction)
    grown = history["front"] > specimen.crack + specimen.height
    front, load, deflection = (history[name][grown] for name in ("front", "load", "deflection"))
    on_curve = np.interp(deflection, curve["deflection"], curve["load"])
    G = np.array([specimen.theory(friction).release(*pair) for pair in zip(load, front, strict=True)])
    spent, broken, advance = (np.ptp(history[name][grown]) for name in ("energy_fracture", "bond_broken", "front"))
    kept = ("energy_strain", "energy_cohesive_stored", "energy_contact", "energy_fracture")
    last = {name: column[-1] for name, column in history.items()}
    rest = last["work_external"] - sum(last[name] for name in kept)
    return {
        "peak_load": float(history["load"].max()),
        "peak_load_of_theory": float(curve["load"].max()),
        "distance_from_theory": float(np.abs(load / on_curve - 1).max()),
        "toughness": specimen.toughness,
        "G_by_load_and_front": float(G.mean()),
        "toughness_by_damage": float(spent / broken),
        "toughness_by_front": float(spent / advance),
        "growth": float(last["front"] - specimen.crack),
        "work_external": float(last["work_external"]),
        "friction": float(last["energy_friction"]),
        "work_left_for_friction": float(rest),
        "friction_of_theory": float(np.interp(last["deflection"], curve["deflection"], curve["friction"])),
        "energy_closure": float(np.abs(history["energy_closure"]).max()),
    }


def grow(specimen: Specimen, friction: float, out: Path) -> dict[str, np.ndarray]:
    """Bend the beam to the end, with its pictures; the history. Collective."""
    beam = Beam.build(specimen, friction)
    with (
        beam.mechanics.problem,
        Recording(
            out,
            beam.mechanics,
            specimen.until,
            title=f"enf, friction {friction:g}",
            show={"load": "load", "front": "front"},
            extra=beam.columns,
            derived={"cauchy_stress": beam.solid.cauchy_stress(beam.state.u)},
        ) as recording,
    ):
        run(beam.mechanics, specimen.until, control(), recording)
    history = recording.columns()
    draw(beam, history, out, f"End-notched flexure, friction {friction:g}")
    return history


# ## Pictures


def draw(beam: Beam, history: dict[str, np.ndarray], out: Path, title: str) -> None:
    """The energies and the bent beam. Collective."""
    space = fem.functionspace(beam.state.mesh, ("DG", 0))
    stress = fem.Function(space)
    axial = beam.solid.cauchy_stress(beam.state.u)[0, 0]
    stress.interpolate(nodal_expression(axial, space))
    body = gather_grid(beam.state.u, {"stress": stress})
    crack = gather_facets(beam.state.u, beam.bond.points.facets, beam.bond.facet_mean("damage"))
    scale = 10.0
    for grid in (body, crack):
        if grid is not None:
            grid.point_data["u"] *= scale
    text = f"{title}; displacements × {scale:g}"
    draw_body(out / "body.png", body, "stress", label="axial stress [MPa]", title=text, crack=crack)
    if COMM.rank == 0:
        plot_energy(out / "energy.png", history, x="deflection", xlabel="deflection [mm]")


def compare(specimen: Specimen, histories: dict[float, dict[str, np.ndarray]], out: Path) -> None:
    """Load and work of friction of all runs with beam theory. Call it on one rank."""
    labels = {"load": "load per width [N/mm]", "friction": "work of friction per width [mJ/mm]"}
    start = {"load": specimen.deflections[0], "friction": 0.0}  # the rise is straight
    for name, label in labels.items():
        curves = []
        for number, (mu, history) in enumerate(histories.items()):
            measured = {"load": history["load"], "friction": history["energy_friction"]}[name]
            theory = theory_curve(specimen, mu)
            for w, values, text, style in (
                (history["deflection"], measured, f"friction {mu:g}", "-"),
                (theory["deflection"], theory[name], f"friction {mu:g}, beam theory", "--"),
            ):
                shown = (w >= start[name]) & (w <= specimen.deflections[-1])
                curves.append(Curve(w[shown], values[shown], text, f"C{number}{style}"))
        title = "End-notched flexure"
        plot_curves(out / f"{name}.png", curves, xlabel="deflection [mm]", ylabel=label, title=title)


# ## The run


def check(result: dict[str, float], friction: float) -> None:
    """The headline numbers."""
    assert result["energy_closure"] < 1e-3
    for name in ("toughness_by_damage", "toughness_by_front", "G_by_load_and_front"):
        assert abs(result[name] / result["toughness"] - 1) < 0.02, name
    assert abs(result["J_over_theory"] - 1) < 0.02
    assert result["distance_from_theory"] < 0.01
    if friction:
        assert abs(result["work_left_for_friction"] / result["friction"] - 1) < 0.03
        assert abs(result["friction"] / result["friction_of_theory"] - 1) < 0.05
    else:
        assert result["friction"] == 0.0
        assert abs(result["G_by_compliance_over_theory"] - 1) < 0.02


def main(
    friction: Annotated[
        list[float] | None, typer.Option(min=0.0, help="friction coefficient; give it several times to compare")
    ] = None,
    coarser: Annotated[float, typer.Option(min=1, help="factor on the size of the elements along the crack")] = 1.0,
    quick: Annotated[bool, typer.Option("--quick", help="coarser, in fewer steps")] = False,
    out: Annotated[Path, typer.Option(help="where the results go")] = Path("results/validation/enf"),
    overwrite: Annotated[bool, typer.Option("--overwrite", help="replace the results of an older run")] = False,
) -> None:
    """Bend an end-notched beam till its crack grows in shear, without and with friction (0, 0.3 and 0.5)."""
    level = logging.WARNING if COMM.rank == 0 else logging.ERROR
    logging.basicConfig(level=level, format="%(name)s: %(message)s")
    claim_folder(out, COMM, overwrite=overwrite)
    specimen = QUICK if quick else FULL
    specimen = replace(specimen, size=coarser * specimen.size)
    histories, results = {}, {}
    for mu in friction or (0.0, 0.3, 0.5):
        histories[mu] = grow(specimen, mu, out / f"friction_{mu:g}")
        results[mu] = before_growth(specimen, mu) | growth(specimen, histories[mu], mu)
    write_summary(out / "summary.json", {f"friction_{mu:g}": result for mu, result in results.items()}, COMM)
    if COMM.rank == 0:
        compare(specimen, histories, out)
        for name in dict.fromkeys(name for result in results.values() for name in result):
            print(f"{name:>28}", *(f"{result.get(name, np.nan):10.6g}" for result in results.values()))
    for mu, result in results.items():
        check(result, mu)


if __name__ == "__main__":
    typer.run(main)
