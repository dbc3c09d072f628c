# # Snap-back and limit points
#
# Bonds in stiff, slender bodies break by themselves once they have begun to: the force falls, and where the end of the
# body is held it has to be moved back to keep the crack in equilibrium.  Steps in time stop there.  Path following by
# dissipation goes through: the time is an unknown, and each step loses as much energy as a facet takes.
#
# ## Three kinds of bodies
#
# **Opened.** The arms of a double cantilever beam of carbon fibres are pulled apart.  The law is bilinear, with an
# intact bond of $10^5$ MPa/mm.  *Composite* is the specimen of Alfano and Crisfield (2001), *peek* that of Camanho,
# Dávila and de Moura (2003), *turon* that of Turon et al. (2007), *krueger* that of Krueger (2008).  *Rigid* is the
# first with $10^6$ MPa/mm, as good as initially rigid: it softens from 0.6 % of its final opening on.  On facets as
# long as the process zone or longer, the path turns back at each of them; the finest of all studies resolve it.  With
# $\Gamma = 1.18 \sqrt{E_{11} E_{22}}/G_{12}$ the crack grows under the force
#
# $$ P = \frac{\sqrt{G_c b E_{11} I}}{a + \chi h}, \qquad
#    \chi^2 = \frac{E_{11}}{11\, G_{12}} \left( 3 - 2 \left( \frac{\Gamma}{1 + \Gamma} \right)^2 \right). $$
#
# **Bent.** Mixed-mode bending of $2L$ between the pins (Reeder): *mixed* is of IM7/8552 with three levers (Krueger
# 2012), *bent* of AS4/PEEK with those for parts of sliding of 0.2, 0.5, 0.8 and 1 (Camanho, Dávila and de Moura 2003).
# The law is bilinear with the criterion of Benzeggagh and Kenane.  The lever of length $c$ turns the load $P$ into two
# dead loads, $P c/L$ that lifts the end of the upper arm, and $P (1 + c/L)$ that presses on the middle.  $P$ has two
# limit points: its largest value, at which the crack begins to run, and its smallest one, at which it has come below
# the middle.  In beam theory
#
# $$ G_I = \frac{3 P^2 (3c - L)^2 (a + \chi h)^2}{4 b^2 h^3 L^2 E_{11}}, \qquad
#    G_{II} = \frac{9 P^2 (c + L)^2 (a + 0.42 \chi h)^2}{16 b^2 h^3 L^2 E_{11}} $$
#
# (Reeder 1992) until the crack comes below the middle.  With $c = L/3$ it slides only, as in end-notched flexure under
# $\frac43 P$.
#
# **Fibre.** A strip with the stiffness $E t$ is drawn off a rigid body, to which it is bonded along the length $L$.
# The bond breaks in sliding from the loaded end on, under the force $F = \sqrt{2 G E t}$, until the process zone is at
# the other end.  Then the strip, which has been stretched by nearly $F L/(E t)$, comes loose: the path turns back to
# nearly nothing.
#
# All are followed without viscosity, and the energy audit closes to half a per cent.

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
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
CASES = {
    "composite": SIZES,
    "rigid": SIZES,
    "peek": SIZES[:3],
    "turon": SIZES[:3],
    "krueger": SIZES[:3],
    "mixed": (92.9, 41.3, 27.3),
    "bent": (109.9, 44.6, 28.5, 17.0),
    "fibre": (0.5, 0.25),
}


class Case(StrEnum):
    """Which body."""

    composite = "composite"
    rigid = "rigid"
    peek = "peek"
    turon = "turon"
    krueger = "krueger"
    mixed = "mixed"
    bent = "bent"
    fibre = "fibre"


def control(first: float, largest: float, facets: float = 1.0) -> StepControl:
    """Steps in time lose at most half as much as those along the path."""
    path = PathFollowing(facets=facets, onset=0.5 * facets)
    return StepControl(first=first, largest=largest, line_searches=("basic", "l2", "bt"), path=path)


# ## Opened


@dataclass(frozen=True)
class Opened:
    """A double cantilever beam of plies, and its bond. Lengths in mm, stresses in MPa."""

    plies: Orthotropic
    height: float  # of an arm
    width: float
    notch: float  # initial crack, from the loaded end
    toughness: float  # in opening [N/mm]
    strength: float
    penalty: float = 1e5  # stiffness of the intact bond, in opening, sliding and contact [MPa/mm]

    @property
    def beams(self) -> CantileverBeams:
        """Beam theory of its arms."""
        E, G = self.plies.E1, self.plies.G12
        return CantileverBeams(self.height, self.width, E, crack_length_correction(E, G, across=self.plies.E2))

    def build(self, size: float, comm: MPI.Comm = COMM) -> Body:
        """Arms pulled apart by t, with facets of a given size [mm], until the crack has grown by two arm heights."""
        lengths = dict(L=self.notch + 26, h=self.height, a0=self.notch, fine=4 * self.height, back=2)
        sizes = dict(lc=size, lc_arm=max(2 * size, 0.5), ny=2, growth=1.2)
        domain = read_geo(geometry("dcb"), comm, lengths | sizes, gdim=2)
        cracks = [domain.facets("crack"), domain.facets("precrack")]
        state = State(cracked_space(domain.mesh, ("Lagrange", 2, (2,)), cracks))
        law = Bilinear(self.penalty, self.strength, self.toughness, self.strength, self.toughness)
        options: dict[str, Any] = dict(
            young=self.plies.E2, normal="reference", contact=PenaltyContact(self.penalty), name="bond"
        )
        bond = Crack(state, cracks[0], domain.cells("lower"), law, **options)
        supports = [Support(state, domain.facets("end"), i) for i in (0, 1)]
        for arm, sign in (("upper", 0.5), ("lower", -0.5)):
            supports.append(Support(state, domain.facets(f"load_{arm}"), 1, lambda t, sign=sign: sign * t, name=arm))
        return Body(
            Mechanics(state, [Solid(state, self.plies, plane="stress"), bond], supports),
            bond,
            control(0.05, 0.05),
            lambda report: self.width * report.columns["upper_force"][0],
            lambda report: crack_front(bond) > self.notch + 2 * self.height,
        )

    def judge(self, rows: np.ndarray) -> dict[str, float]:
        """Peak, and distance of the force from beam theory while the crack runs."""
        _, force, front = rows.T[:3]
        running = front > self.notch + self.height
        theory = [self.beams.propagation(self.toughness, a)[0] for a in front[running]]
        sharp = self.beams.propagation(self.toughness, self.notch)[0]
        return {
            "peak_force": force.max(),
            "peak_over_sharp_crack": force.max() / sharp,
            "distance_from_beam": float(np.abs(force[running] / theory - 1).max()),
        }


ALFANO = Opened(laminate(135.3e3, 9e3, 5.2e3, 0.24), 1.5, 20.0, 30.0, 0.28, 57.0)
AS4_PEEK = laminate(122.7e3, 10.1e3, 5.5e3, 0.25)
CAMANHO = Opened(AS4_PEEK, 1.56, 25.4, 32.9, 0.969, 80.0)
TURON = Opened(laminate(150e3, 11e3, 6e3, 0.25), 1.98, 20.0, 55.0, 0.352, 60.0)
# fracture mechanics has no strength: this one gives a process zone of a millimetre
KRUEGER = Opened(laminate(139.4e3, 10.16e3, 4.6e3, 0.3), 1.5, 25.0, 30.0, 0.1703, 40.0)


# ## Bent


@dataclass(frozen=True)
class Bent:
    """A beam for mixed-mode bending, and its bond. Lengths in mm, stresses in MPa."""

    plies: Orthotropic
    law: Bilinear
    half: float  # half the distance of the pins
    over: float  # what sticks out beyond a pin
    height: float  # of an arm
    notches: Mapping[float, float]  # initial crack for each length of the lever
    cells: int  # along the beam
    until: float  # place of the front at the end
    width: float = 25.4

    def onset(self, lever: float) -> float:
        """Load under which a sharp crack of the initial length begins to grow, by beam theory [N]."""
        E, b, h, L = self.plies.E1, self.width, self.height, self.half
        chi = h * crack_length_correction(E, self.plies.G12, across=self.plies.E2)
        a, law = self.notches[lever], self.law
        opening = 3 * ((3 * lever - L) * (a + chi)) ** 2 / (4 * b**2 * h**3 * L**2 * E)
        sliding = 9 * ((lever + L) * (a + 0.42 * chi)) ** 2 / (16 * b**2 * h**3 * L**2 * E)
        part = (sliding / (opening + sliding)) ** law.eta
        return float(np.sqrt((law.toughness + (law.shear_toughness - law.toughness) * part) / (opening + sliding)))

    def build(self, lever: float, comm: MPI.Comm = COMM) -> Body:
        """Mixed-mode bending under P = 100 N t, with a lever of a given length [mm]."""
        ends, h = (-self.over, 2 * self.half + self.over), self.height
        domain = mesh.create_rectangle(
            comm,
            [(ends[0], -h), (ends[1], h)],
            [self.cells, 4],
            mesh.CellType.quadrilateral,
            ghost_mode=mesh.GhostMode.shared_facet,
        )
        start, places = self.notches[lever], (0.0, self.notches[lever], self.half, 2 * self.half)
        even = np.linspace(*ends, self.cells + 1)
        nearest = [even[np.abs(even - place).argmin()] for place in places]
        nodes, x = (
            np.interp(x, [ends[0], *nearest, ends[1]], [ends[0], *places, ends[1]])
            for x in (even, domain.geometry.x[:, 0])
        )
        domain.geometry.x[:, 0] = x  # loads, pins and front are at nodes
        plane = [
            mesh.locate_entities(domain, 1, lambda p, sign=sign: np.isclose(p[1], 0) & (sign * (p[0] - start) > -1e-9))
            for sign in (1, -1)
        ]
        lower = mesh.locate_entities(domain, 2, lambda p: p[1] < 1e-9)
        state = State(cracked_space(domain, ("Lagrange", 2, (2,)), plane))
        options: dict[str, Any] = dict(young=self.plies.E2, normal="reference", contact=PenaltyContact(5e4))
        bond = Crack(state, plane[0], lower, self.law, name="bond", **options)
        faces = Crack(state, plane[1], lower, None, name="faces", **options)

        def load(name: str, at: float, force: float) -> Traction:
            i = int(np.abs(nodes - at).argmin())
            first, last = nodes[i - 1], nodes[i + 1]
            patch = mesh.locate_entities_boundary(
                domain, 1, lambda p: (p[0] > first - 1e-9) & (p[0] < last + 1e-9) & np.isclose(p[1], h)
            )
            return Traction(state, patch, (0.0, 100 * force / self.width / (last - first)), lambda t: t, name=name)

        def pin(at: float, axis: int) -> Support:
            foot = mesh.locate_entities_boundary(domain, 0, lambda p: np.isclose(p[0], at) & np.isclose(p[1], -h))
            return Support(state, foot, axis, dim=0)

        loads = [load("end", 0.0, lever / self.half), load("middle", self.half, -(1 + lever / self.half))]
        pins = [pin(0.0, 1), pin(2 * self.half, 0), pin(2 * self.half, 1)]
        step = self.onset(lever) / 100 / 9.3
        return Body(
            Mechanics(state, [Solid(state, self.plies, plane="stress"), bond, faces, *loads], pins),
            bond,
            control(step, step, facets=0.5),
            lambda report: 100 * report.time,
            lambda report: crack_front(bond) > self.until,
        )

    def judge(self, rows: np.ndarray, lever: float) -> dict[str, float]:
        """Both limit points, as far as the crack has grown."""
        _, force, front = rows.T[:3]
        first = int(force[front < 0.5 * (self.notches[lever] + self.half)].argmax())
        return {
            "largest_load": force[first],
            "largest_over_onset": force[first] / self.onset(lever),
            "least_load": force[first:].min(),
            "front_there": front[first:][force[first:].argmin()],
        }


KRUEGER_BENT = Bent(
    laminate(161e3, 11.38e3, 5.2e3, 0.32),
    Bilinear.proportional(2e4, 30.0, 0.212, 50.0, 0.774, 2.1),
    half=50.4, over=5.6, height=2.25, notches=dict.fromkeys((92.9, 41.3, 27.3), 25.4), cells=112, until=65.4,
)  # fmt: skip
#: Least load after the crack has run, from energy release, for each lever of the first [N].
LEAST = {92.9: 73.0, 41.3: 218.0, 27.3: 418.0}
CAMANHO_BENT = Bent(
    AS4_PEEK,
    Bilinear.proportional(1e5, 80.0, 0.969, 100.0, 1.719, 2.284),
    half=51.0, over=3.0, height=1.56, notches={109.9: 33.7, 44.6: 34.1, 28.5: 31.4, 17.0: 39.3}, cells=216, until=46.0,
)  # fmt: skip


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

OPENED = {
    Case.composite: ALFANO,
    Case.rigid: replace(ALFANO, penalty=1e6),
    Case.peek: CAMANHO,
    Case.turon: TURON,
    Case.krueger: KRUEGER,
}
BENT = {Case.mixed: KRUEGER_BENT, Case.bent: CAMANHO_BENT}
UNTIL = {**dict.fromkeys(OPENED, 10.0), **dict.fromkeys(BENT, 100.0), Case.fibre: 1.0}


def build(case: Case, which: float, coarser: float = 1.0, comm: MPI.Comm = COMM) -> Body:
    """A body with facets of a given size [mm] or a lever of a given length [mm], a bent one on coarser facets."""
    if case is Case.fibre:
        return fibre(which, comm)
    if case in BENT:
        return replace(BENT[case], cells=round(BENT[case].cells / coarser)).build(which, comm)
    return OPENED[case].build(which, comm)


def judge(case: Case, which: float, rows: np.ndarray) -> dict[str, float]:
    """What a curve is compared by."""
    if case in BENT:
        return BENT[case].judge(rows, which)
    return judge_fibre(rows) if case is Case.fibre else OPENED[case].judge(rows)


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
    if case in OPENED:
        assert found["distance_from_beam"] < 0.015
        assert 0.92 < found["peak_over_sharp_crack"] < 1.03
    if case in (Case.composite, Case.rigid):
        assert 61 < found["peak_force"] < 65
    if case in BENT:
        assert abs(found["largest_over_onset"] - 1) < 0.08
    if case is Case.mixed:
        assert abs(found["least_load"] / LEAST[which] - 1) < 0.04
        assert found["steps_back"] > 10
    if case is Case.fibre:
        assert found["distance_from_theory"] < 0.01
        assert abs(found["lost"] - 1) < 1e-3
        assert found["back_to"] < 0.5 * found["farthest"]


def main(
    case: Annotated[list[Case] | None, typer.Option(help="bodies, by default all")] = None,
    coarser: Annotated[float, typer.Option(min=1, help="factor on the facets of bent beams")] = 1.0,
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
            rows, found = follow(build(body, which, coarser), UNTIL[body], out / name, name)
            summary[name] = found | judge(body, which, rows)
            curves.append(Curve(rows[:, 2] if body in BENT else rows[:, 0], rows[:, 1], f"{which:g}"))
            if COMM.rank == 0:
                print(name, {key: float(f"{value:.5g}") for key, value in summary[name].items()}, flush=True)
            if coarser == 1:
                check(body, which, summary[name])
        if COMM.rank == 0:
            label = "crack front [mm]" if body in BENT else "displacement [mm]"
            plot_curves(out / f"{body}.png", curves, xlabel=label, ylabel="force [N]", title=str(body))
    write_summary(out / "summary.json", summary, COMM)


if __name__ == "__main__":
    typer.run(main)
