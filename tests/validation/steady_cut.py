# # A steady cut: the toughness from force and front alone
#
# An energy audit that closes returns the toughness that was put in, whatever the mechanics.  A real test of a simulated
# cut uses quantities that do not contain the energies of the cohesive law: the *force* on the tool and the *position*
# of the crack front.
#
# ## What theory says
#
# A strip stands on a smooth plate, and its sides are free.  A rigid smooth blade splits it along its middle.  Once the
# cut is steady, all stored energy moves along with the tool, and the force per width of the edge is the toughness,
#
# $$ F = G_c\,w, $$
#
# with one correction.  The uncut part carries the force down to the plate and is shortened by $\varepsilon = F/S$, with
# the stiffness $S = EA$ of the section (in plane strain $EA/(1-\nu^2)$).  Per displacement of the tool the front
# therefore advances by $1+\varepsilon$ in the reference configuration, and the strip releases $\tfrac12 F\varepsilon$:
#
# $$ F\left(1+\tfrac{\varepsilon}{2}\right) = G_c\,w\,(1+\varepsilon), \qquad
# \frac{A_\mathrm{swept}}{w\,\Delta s} = 1+\varepsilon. $$
#
# From this follow three checks, in plane strain and in 3-D, each on two meshes:
#
# 1. the mean force of the steady cut against this closed form;
# 2. the work of the force over the area swept by the front between two depths, which should be $G_c$, and that area;
# 3. the work of a first insertion less that of a second along the broken path (Azar and Hayward 2008), to the lower
#    depth and to the upper one; the difference of the two over width × depth × $(1+\varepsilon)$.
#
# There is no friction, and only a trace of viscosity.  It carries coarse meshes across the jumps of the front from node
# to node, and adds 0.1 to 0.3 % to the force.

import logging
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from mpi4py import MPI

from cutsim import Blade, Drive, Exponential, Insertion, NeoHookean, StepControl, cracked_block, geometry, read_geo, run
from cutsim.results.output import claim_folder, write_summary
from cutsim.results.plots import Curve, plot_curves
from cutsim.results.recording import Recording
from cutsim.studies.insertion_work import SteadyCut, TwoInsertions, steady_force

MESH = geometry("block")

# ## The strip
#
# Half thickness and width [mm], a soft silicone, and a bond whose process zone several elements resolve.  The crack
# lies in a plane of symmetry, so that one side of the strip is meshed.

HALF, WIDTH, HEIGHT, NOTCH = 1.0, 1.0, 6.5, 0.5
SILICONE, VISCOSITY = NeoHookean(0.777, 0.45), 2e-4  # MPa, MPa s at 1 mm/s
BOND = Exponential(strength=0.3, toughness=0.1)  # MPa, N/mm
STEADY = (2.0, 4.0)  # depths of the tip between which the cut is steady [mm]
STEP = 0.05  # way of the tool in a step, at most [mm]
SPEED, ENTRY_TIME = 1.0, 1.0  # of the push [mm/s]; in which the halves of the blade are spread in the notch [s]


@dataclass(frozen=True)
class Strip:
    """Dimension, element size along the crack [mm], and in space layers of elements across the half width."""

    dim: int
    size: float
    layers: int = 2

    @property
    def name(self) -> str:
        """What the results are called."""
        return f"{self.dim}-D, h = {self.size:g} mm"

    @property
    def folder(self) -> str:
        """Where they go."""
        return f"{self.dim}d_{self.size:g}"

    @property
    def width(self) -> float:
        """Length of the cutting edge, 1 in plane strain [mm]."""
        return WIDTH if self.dim == 3 else 1.0

    @property
    def stiffness(self) -> float:
        """Axial stiffness of the section below the cut [N], per width in plane strain."""
        E, nu = SILICONE.young, SILICONE.poisson
        return 2 * HALF * self.width * (E if self.dim == 3 else E / (1 - nu**2))

    def build(self, turning_depth: float | None) -> Insertion:
        """One side of the strip and blade; in space a half of that, in front of its middle plane. Collective."""
        sizes = {"dim": self.dim, "Lx": HALF, "H": HEIGHT, "lc": self.size, "band": 0.3, "growth": 1.6, "notch": NOTCH}
        sizes |= {"half": 1}
        if self.dim == 3:
            sizes |= {"B": WIDTH, "sym": 1, "nz": self.layers}
        forward, lateral = (0.0, -1.0, 0.0)[: self.dim], (1.0, 0.0, 0.0)[: self.dim]
        blade = Blade(np.radians(20), max(0.1, self.size), 0.5, forward, lateral)
        domain = read_geo(MESH, MPI.COMM_WORLD, sizes, gdim=self.dim)
        body = cracked_block(domain, SILICONE, BOND, viscosity=VISCOSITY)
        return Insertion.build(body, blade, Drive(SPEED, ENTRY_TIME, turning_depth), notch=NOTCH)


# ## Settings

FULL = (Strip(2, 0.1), Strip(2, 0.05), Strip(3, 0.2), Strip(3, 0.1))
QUICK = (Strip(2, 0.1), Strip(3, 0.2, layers=1))

Summary = dict[str, float | list[float]]
History = dict[str, np.ndarray]


def main(
    quick: Annotated[bool, typer.Option("--quick", help="coarser meshes")] = False,
    out: Annotated[Path, typer.Option(help="where the results go")] = Path("results/validation/steady_cut"),
    overwrite: Annotated[bool, typer.Option("--overwrite", help="replace the results of an older run")] = False,
) -> None:
    """Split strips, twice each, in plane strain and in space: what force and front say of the toughness."""
    logging.basicConfig(level=logging.ERROR, format="%(name)s: %(message)s")
    claim_folder(out, MPI.COMM_WORLD, overwrite=overwrite)
    begun = time.perf_counter()
    histories, summary = {}, {"toughness_given": BOND.toughness}
    for strip in QUICK if quick else FULL:
        twice = strip.dim == 2 or not quick
        runs = [push(strip, depth, out / f"{strip.folder}_to_{depth:g}", twice) for depth in STEADY[-1 - twice :]]
        histories[strip] = runs[-1][1]
        values = found(strip, histories[strip]) | (insertions(strip, *runs) if twice else {})
        summary |= {f"{strip.name}, {name}": value for name, value in values.items()}
    summary |= {"ranks": float(MPI.COMM_WORLD.size), "seconds": time.perf_counter() - begun}
    write_summary(out / "summary.json", summary, MPI.COMM_WORLD)
    if MPI.COMM_WORLD.rank == 0:
        draw(histories, out / "force.png")
        for name, value in summary.items():
            typer.echo(f"{name:>50}  {value:.5g}")
    check(summary, list(histories))


def push(strip: Strip, depth: float, out: Path, twice: bool) -> tuple[Insertion, History]:
    """An insertion to a depth, or two. Collective."""
    cut = strip.build(depth if twice else None)
    down, until = cut.time_of(depth), cut.time_of(depth, 1 + twice)
    show = {"depth": "depth", "force": "force"}
    with Recording(out, cut.mechanics, until, title=strip.name, show=show, extra=cut.columns, every=0) as recording:
        run(cut.mechanics, down, StepControl(first=0.02, largest=STEP), recording)
        if twice:
            run(cut.mechanics, until, StepControl(first=STEP, largest=4 * STEP), recording)
    recording.summary()
    return cut, recording.columns()


# ## Results
#
# The closed forms use toughness and section; force, front and work do not contain the energies of the cohesive law.


def expected(strip: Strip) -> tuple[float, float]:
    """Force, and area that the front sweeps in the steady stretch, in closed form [N, mm²]."""
    force = steady_force(BOND.toughness, strip.width, strip.stiffness)
    return force, strip.width * (STEADY[1] - STEADY[0]) * (1 + force / strip.stiffness)


def insertions(strip: Strip, shallow: tuple[Insertion, History], deep: tuple[Insertion, History]) -> Summary:
    """Toughness by the difference of works of two pairs of insertions [N/mm]."""
    first, second = (TwoInsertions.of(history, cut) for cut, history in (shallow, deep))
    added = second.beyond(first)
    return {"two insertions": (added.first - added.second) / expected(strip)[1]}


def found(strip: Strip, history: History) -> Summary:
    """What force and front say of a strip."""
    stretch, (force, area) = SteadyCut.of(history, *STEADY), expected(strip)
    return {
        "steady force per width": stretch.force / strip.width,
        "steady force over closed form": stretch.force / force,
        "drift of the steady force": stretch.drift,
        "swept area over closed form": stretch.swept / area,
        "force times way over swept area": stretch.toughness(strip.stiffness),
        "largest closure": float(np.abs(history["energy_closure"]).max()),
    }


def draw(histories: dict[Strip, History], path: Path) -> None:
    """Force per width of the first insertion into each strip, with the closed forms. Call it on one rank."""
    curves, theory = [], {}
    for strip, history in histories.items():
        first = slice(0, int(np.argmax(history["depth"])) + 1)
        curves.append(Curve(history["depth"][first], history["force"][first] / strip.width, strip.name))
        theory[strip.dim] = steady_force(BOND.toughness, strip.width, strip.stiffness) / strip.width
    curves += [
        Curve(STEADY, [force] * 2, f"closed form, {dim}-D", "k" + "-:"[dim - 2]) for dim, force in theory.items()
    ]
    plot_curves(
        path,
        curves,
        xlabel="depth of the tip [mm]",
        ylabel="force per width [N/mm]",
        title="A strip is split",
        references={"$G_c$": BOND.toughness},
    )


def check(summary: Summary, strips: list[Strip]) -> None:
    """The headline numbers, asserted; a mesh of 0.2 mm does not resolve the process zone."""
    for strip in strips:
        allowed = 0.01 if strip.size <= 0.1 else 0.04
        for name in ("steady force over closed form", "swept area over closed form"):
            assert abs(summary[f"{strip.name}, {name}"] - 1) < allowed, (strip.name, name)
        for name in ("force times way over swept area", "two insertions"):
            value = summary.get(f"{strip.name}, {name}", BOND.toughness)  # in space only one insertion if quick
            assert abs(value / BOND.toughness - 1) < 2 * allowed, (strip.name, name)


if __name__ == "__main__":
    typer.run(main)
