# # Snap-back and limit points
#
# Bonds in stiff, slender bodies break by themselves once they have begun to: the force falls, and where the end of the
# body is held it has to be moved back to keep the crack in equilibrium.  Steps in time stop there.  Path following by
# dissipation goes through: the time is an unknown, and each step loses as much energy as a facet takes.
#
# ## Three bodies
#
# **Composite.** The arms of a double cantilever beam of carbon fibres (Alfano and Crisfield 2001: $E_{11}$ = 135.3 GPa,
# $E_{22}$ = 9 GPa, $G_{12}$ = 5.2 GPa, $\nu_{12}$ = 0.24, $h$ = 1.5 mm, $b$ = 20 mm, $a_0$ = 30 mm, $G_c$ = 0.28 N/mm,
# 57 MPa) are pulled apart.  The law is bilinear, with an intact bond of $10^5$ MPa/mm.  *Rigid* is the same with $10^6$
# MPa/mm, as good as initially rigid: it softens from 0.6 % of its final opening on.  On facets as long as the process
# zone or longer, the path turns back at each of them; the finest of both studies resolve it.  With
# $\Gamma = 1.18 \sqrt{E_{11} E_{22}}/G_{12}$ the crack grows under the force
#
# $$ P = \frac{\sqrt{G_c b E_{11} I}}{a + \chi h}, \qquad
#    \chi^2 = \frac{E_{11}}{11\, G_{12}} \left( 3 - 2 \left( \frac{\Gamma}{1 + \Gamma} \right)^2 \right). $$
#
# **Mixed.** Mixed-mode bending (Reeder) of IM7/8552: $E_{11}$ = 161 GPa, $E_{22}$ = 11.38 GPa, $G_{12}$ = 5.2 GPa,
# $b$ = 25.4 mm, $2h$ = 4.5 mm, $2L$ = 100.8 mm, $a_0$ = 25.4 mm, $G_{Ic}$ = 0.212, $G_{IIc}$ = 0.774 N/mm, Benzeggagh
# and Kenane with $\eta$ = 2.1.  The lever of length $c$ turns the load $P$ into two dead loads, $P c/L$ that lifts the
# end of the upper arm, and $P (1 + c/L)$ that presses on the middle.  $P$ has two limit points: its largest value, at
# which the crack begins to run, and its smallest one, at which it has come below the middle.  In beam theory
#
# $$ G_I = \frac{3 P^2 (3c - L)^2 (a + \chi h)^2}{4 b^2 h^3 L^2 E_{11}}, \qquad
#    G_{II} = \frac{9 P^2 (c + L)^2 (a + 0.42 \chi h)^2}{16 b^2 h^3 L^2 E_{11}} $$
#
# (Reeder 1992) until the crack comes below the middle.
#
# **Fibre.** A strip with the stiffness $E t$ is drawn off a rigid body, to which it is bonded along the length $L$.
# The bond breaks in sliding from the loaded end on, under the force $F = \sqrt{2 G E t}$, until the process zone is at
# the other end.  Then the strip, which has been stretched by nearly $F L/(E t)$, comes loose: the path turns back to
# nearly nothing.
#
# All three are followed without viscosity, and the energy audit closes to half a per cent.

import logging
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from dolfinx import mesh
from mpi4py import MPI

from cutsim import (
    Bilinear,
    Crack,
    LinearElastic,
    Mechanics,
    Orthotropic,
    PathFollowing,
    PenaltyContact,
    Solid,
    State,
    StepControl,
    StepReport,
    Support,
    Traction,
    cracked_space,
    geometry,
    read_geo,
    run,
)
from cutsim.results.output import claim_folder, write_summary
from cutsim.results.plots import Curve, plot_curves
from cutsim.results.recording import Recording
from cutsim.studies.fracture import CantileverBeams, crack_front, crack_length_correction

COMM = MPI.COMM_WORLD


def laminate(along: float, across: float, shear: float, contraction: float) -> Orthotropic:
    """Plies with fibres along x; what happens out of the plane of the beam takes no part in plane stress.

    Args:
        along: Young's modulus along the fibres [MPa] ...
        across: ... and across them.
        shear: Shear modulus [MPa].
        contraction: Poisson's ratio across for a pull along the fibres [–].
    """
    return Orthotropic(along, across, across, contraction, contraction, 0.3, shear, shear, shear)


@dataclass(frozen=True)
class Body:
    """A body whose bond breaks, and what is measured of it."""

    mechanics: Mechanics
    bond: Crack
    control: StepControl
    force: Callable[[StepReport], float]  # the force that is shown [N]
    ends: Callable[[StepReport], bool]


SIZES = (0.25, 0.125, 0.0625, 0.03125)
CASES = {"composite": SIZES, "rigid": SIZES, "mixed": (92.9, 41.3, 27.3), "fibre": (0.5, 0.25)}


class Case(StrEnum):
    """Which body."""

    composite = "composite"
    rigid = "rigid"
    mixed = "mixed"
    fibre = "fibre"


def control(first: float, largest: float, facets: float = 1.0) -> StepControl:
    """Steps in time lose at most half as much as those along the path."""
    path = PathFollowing(facets=facets, onset=0.5 * facets)
    return StepControl(first=first, largest=largest, line_searches=("basic", "l2", "bt"), path=path)


# ## Composite

FIBRES = laminate(135.3e3, 9e3, 5.2e3, 0.24)
HEIGHT, NOTCH, TOUGHNESS, WIDTH = 1.5, 30.0, 0.28, 20.0
ARMS = CantileverBeams(HEIGHT, WIDTH, FIBRES.E1, crack_length_correction(FIBRES.E1, FIBRES.G12, across=FIBRES.E2))


def composite(size: float, comm: MPI.Comm = COMM, *, penalty: float = 1e5) -> Body:
    """Arms pulled apart by t, with facets of a given size [mm], until the crack has grown by two arm heights.

    The intact bond has a given stiffness [MPa/mm], in opening, sliding and contact.
    """
    lengths = dict(L=NOTCH + 26, h=HEIGHT, a0=NOTCH, fine=6, back=2)
    domain = read_geo(
        geometry("dcb"), comm, lengths | dict(lc=size, lc_arm=max(2 * size, 0.5), ny=2, growth=1.2), gdim=2
    )
    cracks = [domain.facets("crack"), domain.facets("precrack")]
    state = State(cracked_space(domain.mesh, ("Lagrange", 2, (2,)), cracks))
    law = Bilinear(penalty, 57.0, TOUGHNESS, 57.0, TOUGHNESS)
    options: dict[str, Any] = dict(young=FIBRES.E2, normal="reference", contact=PenaltyContact(penalty))
    bond = Crack(state, cracks[0], domain.cells("lower"), law, name="bond", **options)
    supports = [Support(state, domain.facets("end"), i) for i in (0, 1)]
    for arm, sign in (("upper", 0.5), ("lower", -0.5)):
        supports.append(Support(state, domain.facets(f"load_{arm}"), 1, lambda t, sign=sign: sign * t, name=arm))
    return Body(
        Mechanics(state, [Solid(state, FIBRES, plane="stress"), bond], supports),
        bond,
        control(0.05, 0.05),
        lambda report: WIDTH * report.columns["upper_force"][0],
        lambda report: crack_front(bond) > NOTCH + 2 * HEIGHT,
    )


def rigid(size: float, comm: MPI.Comm = COMM) -> Body:
    """The same arms with a bond that hardly opens before it softens."""
    return composite(size, comm, penalty=1e6)


def judge_composite(rows: np.ndarray) -> dict[str, float]:
    """Peak, and distance of the force from beam theory while the crack runs."""
    _, force, front = rows.T[:3]
    running = front > NOTCH + HEIGHT
    theory = [ARMS.propagation(TOUGHNESS, a)[0] for a in front[running]]
    return {"peak_force": force.max(), "distance_from_beam": float(np.abs(force[running] / theory - 1).max())}


# ## Mixed

PLIES = laminate(161e3, 11.38e3, 5.2e3, 0.32)
HALF, OVER, ARM = 50.4, 5.6, 2.25
#: Load at the onset and least load, from energy release [N].
REEDER = {92.9: (126.6, 73.0), 41.3: (379.0, 218.0), 27.3: (725.2, 418.0)}


def mixed(lever: float, comm: MPI.Comm = COMM, *, cells: int = 112) -> Body:
    """Mixed-mode bending under P = 100 N t, with a lever of a given length [mm], until the crack is far beyond L."""
    width, ghosts = 25.4, mesh.GhostMode.shared_facet
    corners = [(-OVER, -ARM), (2 * HALF + OVER, ARM)]
    domain = mesh.create_rectangle(comm, corners, [cells, 4], mesh.CellType.quadrilateral, ghost_mode=ghosts)
    size, x = (2 * HALF + 2 * OVER) / cells, np.linspace(-OVER, 2 * HALF + OVER, cells + 1)
    start, end, middle, far = (x[np.abs(x - at).argmin()] for at in (25.4, 0.0, HALF, 2 * HALF))
    plane = [
        mesh.locate_entities(domain, 1, lambda p, sign=sign: np.isclose(p[1], 0) & (sign * (p[0] - start) > -1e-9))
        for sign in (1, -1)
    ]
    lower = mesh.locate_entities(domain, 2, lambda p: p[1] < 1e-9)
    state = State(cracked_space(domain, ("Lagrange", 2, (2,)), plane))
    law = Bilinear.proportional(2e4, 30.0, 0.212, 50.0, 0.774, 2.1)
    options: dict[str, Any] = dict(young=PLIES.E2, normal="reference", contact=PenaltyContact(5e4))
    bond = Crack(state, plane[0], lower, law, name="bond", **options)
    faces = Crack(state, plane[1], lower, None, name="faces", **options)

    def load(name: str, at: float, force: float) -> Traction:
        near = mesh.locate_entities_boundary(
            domain, 1, lambda p: (np.abs(p[0] - at) < 1.01 * size) & np.isclose(p[1], ARM)
        )
        return Traction(state, near, (0.0, 100 * force / width / (2 * size)), lambda t: t, name=name)

    def pin(at: float, axis: int) -> Support:
        foot = mesh.locate_entities_boundary(domain, 0, lambda p: np.isclose(p[0], at) & np.isclose(p[1], -ARM))
        return Support(state, foot, axis, dim=0)

    loads = [load("end", end, lever / HALF), load("middle", middle, -(1 + lever / HALF))]
    pins = [pin(end, 1), pin(far, 0), pin(far, 1)]
    step = REEDER[lever][0] / 100 / 9.3
    return Body(
        Mechanics(state, [Solid(state, PLIES, plane="stress"), bond, faces, *loads], pins),
        bond,
        control(step, step, facets=0.5),
        lambda report: 100 * report.time,
        lambda report: crack_front(bond) > HALF + 15,
    )


def judge_mixed(rows: np.ndarray) -> dict[str, float]:
    """Both limit points."""
    _, force, front = rows.T[:3]
    first = int(force[front < 0.8 * HALF].argmax())
    return {
        "largest_load": force[first],
        "least_load": force[first:].min(),
        "front_there": front[first:][force[first:].argmin()],
    }


# ## Fibre

YOUNG, LENGTH, THICKNESS, SHEARED = 1000.0, 20.0, 0.5, 0.1


def fibre(size: float, comm: MPI.Comm = COMM) -> Body:
    """A strip whose end is drawn by t, with facets of a given size [mm]."""
    cells, ghosts = [round(LENGTH / size), 4], mesh.GhostMode.shared_facet
    corners = [(0.0, -THICKNESS), (LENGTH, THICKNESS)]
    domain = mesh.create_rectangle(comm, corners, cells, mesh.CellType.quadrilateral, ghost_mode=ghosts)
    plane = mesh.locate_entities(domain, 1, lambda p: np.isclose(p[1], 0))
    lower = mesh.locate_entities(domain, 2, lambda p: p[1] < 1e-9)
    state = State(cracked_space(domain, ("Lagrange", 1, (2,)), [plane]))
    law = Bilinear(200.0, 2.0, SHEARED, 2.0, SHEARED)
    bond = Crack(state, plane, lower, law, young=YOUNG, normal="reference", name="bond")
    # what lies below the bond is rigid
    supports = [Support(state, lower, i, dim=2) for i in (0, 1)]
    top, end = (
        mesh.locate_entities_boundary(domain, 1, where)
        for where in (lambda p: np.isclose(p[1], THICKNESS), lambda p: np.isclose(p[0], LENGTH) & (p[1] > -1e-9))
    )
    supports += [Support(state, top, 1), Support(state, end, 0, lambda t: t, name="end")]
    return Body(
        Mechanics(state, [Solid(state, LinearElastic(YOUNG, 0.0)), bond], supports),
        bond,
        control(0.002, 0.02, facets=0.3),
        lambda report: report.columns["end_force"][0],
        lambda report: report.columns["energy_fracture"][0] > (1 - 1e-6) * SHEARED * LENGTH,
    )


def judge_fibre(rows: np.ndarray) -> dict[str, float]:
    """Force while the bond breaks, and how far the end is moved back."""
    time, force, _, lost = rows.T[:4]
    breaks = (lost > 0.3 * SHEARED * LENGTH) & (lost < 0.6 * SHEARED * LENGTH)
    theory = np.sqrt(2 * SHEARED * YOUNG * THICKNESS)
    return {
        "distance_from_theory": float(np.abs(force[breaks] / theory - 1).max()),
        "farthest": time[lost < 0.9 * SHEARED * LENGTH].max(),
        "back_to": time[time.argmax() :].min() if time.argmax() < len(time) - 1 else time[-1],
        "lost": lost[-1] / (SHEARED * LENGTH),
    }


# ## The run

BUILD: dict[Case, Callable[[float], Body]] = {
    Case.composite: composite,
    Case.rigid: rigid,
    Case.mixed: mixed,
    Case.fibre: fibre,
}
JUDGE = {
    Case.composite: judge_composite,
    Case.rigid: judge_composite,
    Case.mixed: judge_mixed,
    Case.fibre: judge_fibre,
}
UNTIL = {Case.composite: 4.0, Case.rigid: 4.0, Case.mixed: 100.0, Case.fibre: 1.0}


def follow(body: Body, until: float, out: Path, title: str) -> tuple[np.ndarray, dict[str, float]]:
    """Time, force, front and loss after each step, and what is true of the whole run. Collective."""
    rows = []
    with Recording(out, body.mechanics, until, title=title, every=0, quiet=True) as recording:

        def record(report: StepReport) -> None:
            recording(report)
            lost = report.columns["energy_fracture"][0]
            rows.append((report.time, body.force(report), crack_front(body.bond), lost, report.dt))

        run(body.mechanics, until, body.control, record, body.ends)
    history = recording.columns()
    return np.array(rows), {
        "steps": len(rows),
        "newton": int(history["newton"].sum()),
        "steps_back": int((np.array(rows)[:, 4] < 0).sum()),
        "rejected": int(history["cuts"].sum()),
        "viscous": float(history["energy_viscous"][-1]),
        "energy_closure": float(body.mechanics.audit.worst_closure),
    }


def check(case: Case, which: float, found: dict[str, float]) -> None:
    """The headline numbers."""
    assert found["energy_closure"] < 5e-3
    assert found["viscous"] == 0
    if case in (Case.composite, Case.rigid):
        assert found["distance_from_beam"] < 0.015
        assert 61 < found["peak_force"] < 65
    if case is Case.mixed:
        largest, least = REEDER[which]
        assert abs(found["least_load"] / least - 1) < 0.04
        assert abs(found["largest_load"] / largest - 1) < 0.08
        assert found["steps_back"] > 10
    if case is Case.fibre:
        assert found["distance_from_theory"] < 0.01
        assert abs(found["lost"] - 1) < 1e-3
        assert found["back_to"] < 0.5 * found["farthest"]


def main(
    case: Annotated[list[Case] | None, typer.Option(help="bodies, by default all")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="only the first of each")] = False,
    out: Annotated[Path, typer.Option(help="where the results go")] = Path("results/validation/snap_back"),
    overwrite: Annotated[bool, typer.Option("--overwrite", help="replace the results of an older run")] = False,
) -> None:
    """Follow bonds that break by themselves, and compare forces and limit points with beam theory."""
    level = logging.WARNING if COMM.rank == 0 else logging.ERROR
    logging.basicConfig(level=level, format="%(name)s: %(message)s")
    claim_folder(out, COMM, overwrite=overwrite)
    summary: dict[str, dict[str, float]] = {}
    for body in case or list(Case):
        curves = []
        for which in CASES[body][:1] if quick else CASES[body]:
            name = f"{body}_{which:g}"
            rows, found = follow(BUILD[body](which), UNTIL[body], out / name, name)
            summary[name] = found | JUDGE[body](rows)
            curves.append(Curve(rows[:, 0] if body is not Case.mixed else rows[:, 2], rows[:, 1], f"{which:g}"))
            if COMM.rank == 0:
                print(name, {key: float(f"{value:.5g}") for key, value in summary[name].items()}, flush=True)
            check(body, which, summary[name])
        if COMM.rank == 0:
            label = "crack front [mm]" if body is Case.mixed else "displacement [mm]"
            plot_curves(out / f"{body}.png", curves, xlabel=label, ylabel="force [N]", title=str(body))
    write_summary(out / "summary.json", summary, COMM)


if __name__ == "__main__":
    typer.run(main)
