# # Force of a puncture against the radius of the tip
#
# A cylindrical needle with a spherical tip of radius $a$ comes to an intact block (a body of revolution).  It destroys
# a thread of radius $r_0 = a/3$ on its axis and widens the hole to its own radius.
#
# ## What theory says
#
# Indentation and penetration are two states of the body under the same tip (Fregonese and Bacca 2021).  Indented to the
# depth $d$ it holds the work $W(d)$ of the indentation.  Penetrated to this depth it holds and has cost $U(d)$.  The
# needle penetrates where this is less: from the depth $d_c$ on at which $W(d_c) = U(d_c)$, and under the force
# $F_c = W'(d_c)$.
#
# In units of $E a^2$ and $a$ the indentation is the same for all radii.  It is taken from a push in which nothing
# breaks.  $U$ is a sum over the slices of the hole, each of them widened to the radius $\varrho$ of the tip at its
# height, as in an endless incompressible body (docs/needle_insertion.md):
#
# $$ U(d) = \int_0^d \Bigl[ 2\pi r_0 G_c + \int_{r_0}^{\varrho(z)} p\,2\pi r\,\mathrm dr \Bigr]\mathrm dz . $$
#
# The paper has another crack and its own account of the two energies.  What is taken from it is the criterion.

import logging
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from mpi4py import MPI
from scipy.integrate import cumulative_trapezoid, quad

from cutsim import (
    Drive,
    Exponential,
    Insertion,
    MeshRule,
    Needle,
    NeoHookean,
    StepControl,
    cracked_block,
    geometry,
    read_geo,
    run,
)
from cutsim.base.arrays import Array
from cutsim.results.output import claim_folder, write_summary
from cutsim.results.plots import Curve, plot_curves

COMM = MPI.COMM_WORLD
SOLID = NeoHookean(0.777, 0.48)  # a silicone [MPa]
BOND = Exponential(strength=0.6, toughness=0.1)  # [MPa, N/mm]
DAMPING = 1e-3  # Kelvin–Voigt viscosity over Young's modulus [s]
UNBROKEN = Exponential(strength=60.0, toughness=10.0)  # the same opening, and a hundred times as strong
RADII, QUICK = (0.15, 0.2, 0.3, 0.4, 0.55), (0.4,)  # of needle and tip [mm]
THREAD = 1 / 3  # radius of the thread over that of the tip
AFTER = 0.9  # the run ends when the force has fallen to this part of its peak
END = 2.2  # or at this depth over the radius


@dataclass(frozen=True)
class Push:
    """A push of a needle [mm, N].

    Attributes:
        radius: Radius of needle and tip.
        depth: Depths of the tip.
        force: Forces.
    """

    radius: float
    depth: Array
    force: Array

    @property
    def work(self) -> Array:
        """Work of the needle."""
        return np.asarray(cumulative_trapezoid(self.force, self.depth, initial=0.0))

    def scaled(self, radius: float) -> "Push":
        """The same push of a needle of another radius, in which nothing breaks."""
        ratio = radius / self.radius
        return Push(radius, ratio * self.depth, ratio**2 * self.force)


@dataclass(frozen=True)
class Hole:
    """Hole that a needle has made, by theory [mm, N].

    Attributes:
        radius: Radius of needle and tip.
    """

    radius: float

    def cost(self, hole: float) -> float:
        """What a slice has cost that is widened to this radius, per length."""
        inner, far, shear = THREAD * self.radius, block_radius(self.radius), SOLID.young / 3
        if hole <= inner:
            return 0.0

        def force(at: float) -> float:
            here, end = at / inner, np.sqrt(far**2 + at**2 - inner**2) / far
            return float(shear * (np.log(here / end) - 0.5 * (here**-2 - end**-2)) * 2 * np.pi * at)

        x = (hole - inner) / BOND.opening
        spent = 1 - (1 + x) * np.exp(-x)  # what the needle leaves of the bond is not paid for
        return float(2 * np.pi * inner * BOND.toughness * spent + quad(force, inner, hole)[0])

    @property
    def steady(self) -> float:
        """Force of a steady penetration."""
        return self.cost(self.radius)

    def energy(self, depth: Array) -> Array:
        """What a penetration to these depths holds and has cost."""
        heights = np.linspace(0.0, self.radius, 200)
        slices = [self.cost(float(np.sqrt(self.radius**2 - (self.radius - z) ** 2))) for z in heights]
        tip = cumulative_trapezoid(slices, heights, initial=0.0)
        return np.interp(depth, heights, tip) + self.steady * np.maximum(depth - self.radius, 0.0)


def found(push: Push, indentation: Push) -> dict[str, float]:
    """Force of the puncture, and what theory says of it."""
    hole, unit, peak = Hole(push.radius), SOLID.young * push.radius**2, int(np.argmax(push.force))
    depth = np.linspace(0.3 * push.radius, indentation.depth[-1], 2000)
    excess = np.interp(depth, indentation.depth, indentation.work) - hole.energy(depth)
    critical = float(depth[np.argmax(excess > 0)])
    force = float(np.interp(critical, indentation.depth, indentation.force))
    end = push.depth[peak]
    return {
        "toughness over E a": BOND.toughness / (SOLID.young * push.radius),
        "depth of the puncture over a": float(end / push.radius),
        "critical depth over a": critical / push.radius,
        "force of the puncture over E a²": float(push.force[peak] / unit),
        "critical force over E a²": force / unit,
        "force of the puncture over the critical one": float(push.force[peak]) / force,
        "work until the puncture over that of a penetration": float(push.work[peak] / hole.energy(end)),
        "steady force over E a²": hole.steady / unit,
    }


def block_radius(radius: float) -> float:
    """Radius of the block [mm]."""
    return 12 * radius


def main(
    quick: Annotated[bool, typer.Option("--quick", help="one radius only")] = False,
    out: Annotated[Path, typer.Option(help="where the results go")] = Path("results/validation/puncture_tips"),
    overwrite: Annotated[bool, typer.Option("--overwrite", help="replace the results of an older run")] = False,
) -> None:
    """Puncture a block with needles of several radii."""
    logging.basicConfig(level=logging.ERROR, format="%(name)s: %(message)s")
    claim_folder(out, COMM, overwrite=overwrite)
    begun, summary, curves = time.perf_counter(), {}, []
    indentation = push(0.4, UNBROKEN)
    for radius in QUICK if quick else RADII:
        puncture = push(radius, BOND)
        values = found(puncture, indentation.scaled(radius))
        summary |= {f"a = {radius:g} mm: {name}": value for name, value in values.items()}
        unit = SOLID.young * radius**2
        curves.append(Curve(puncture.depth / radius, puncture.force / unit, f"a = {radius:g} mm"))
    summary |= {"ranks": float(COMM.size), "wall_time": time.perf_counter() - begun}
    write_summary(out / "summary.json", summary, COMM)
    if COMM.rank == 0:
        plot_curves(
            out / "force.png",
            curves,
            xlabel="depth over radius",
            ylabel="force over E a²",
            title="Puncture by a needle",
        )
        for name, value in summary.items():
            typer.echo(f"{name:>70}  {value:.5g}")


def push(radius: float, bond: Exponential) -> Push:
    """Push a needle until the surface has given way, or to the end. Collective."""
    needle = Needle(np.radians(45), radius, 1.001 * radius)
    rule = MeshRule.of([needle], [bond])
    deep = 5.5 * radius
    sizes = {"r0": THREAD * radius, "R": block_radius(radius), "H": 1.6 * deep, "deep": deep, "notch": 0}
    sizes |= {"lc": rule.size, "entry": rule.mouth, "growth": 1.4}
    domain = read_geo(geometry("thread"), COMM, sizes, gdim=2)
    body = cracked_block(domain, SOLID, bond, viscosity=DAMPING * SOLID.young, axisymmetric=True)
    cut = Insertion.build(body, needle, Drive(1.0))
    rows: list[tuple[float, float]] = []

    def record(report) -> None:
        columns = cut.columns(report.columns)
        rows.append((columns["depth"][0], columns["force"][0]))

    def punctured(report) -> bool:
        return rows[-1][1] < AFTER * max(force for _, force in rows)

    control = StepControl(first=0.1 * radius, largest=0.2 * radius, smallest=1e-6, closure=5e-3)
    run(cut.mechanics, cut.time_of(END * radius), control, record, stop=punctured)
    depth, force = np.array([row for row in rows if row[0] >= 0]).T
    return Push(radius, depth, force)


if __name__ == "__main__":
    typer.run(main)
