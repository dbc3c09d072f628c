# # Puncture: a crack starts by itself under a tip
#
# A tool that comes to an intact surface indents it.  At some depth the bond under the tip gives way: a crack starts in
# the plane of the cut, runs ahead, and the force drops.  From then on the tool cuts as if it had started in a notch.
#
# ## What theory says
#
# 1. After the puncture nothing is left of how the cut began.  The force and the toughness by force and front are those
#    of the same tool that starts in a notch.
#    "After" has a measure that is known beforehand.  Whatever the surface looks like after the event, its tractions
#    balance themselves, and are not felt farther away than half of the block is wide (Saint-Venant).  So the cut is
#    compared from where the surface is so far above the beginning of the shank: what touches the tool from there on
#    knows nothing of it.
# 2. At a given depth the body holds the energy $U_i(d)$ if it is indented, and with a cut it holds $U_c$ and has cost
#    $G_c A$.  A crack cannot start before the sum $U_c + G_c A$ has fallen below $U_i$ (Fregonese and Bacca 2021): the
#    work done until the puncture is at least that of the notched run at the same depth.
# 3. The drop of the force is unstable.  What is set free, the difference of these energies, goes into viscosity,
#    however small that is: it bounds the share of the viscosity from below.  The audit still closes.

import logging
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from mpi4py import MPI
from scipy.integrate import cumulative_trapezoid

from cutsim import (
    Blade,
    CrackedBody,
    Drive,
    Exponential,
    Faces,
    Insertion,
    MeshRule,
    NeoHookean,
    StepControl,
    cracked_block,
    geometry,
    read_geo,
    run,
)
from cutsim.results.output import claim_folder, write_summary
from cutsim.results.plots import Curve, plot_curves
from cutsim.results.recording import Recording
from cutsim.studies.insertion_work import SteadyCut, steady_force

COMM = MPI.COMM_WORLD
History = dict[str, np.ndarray]


# ## Bodies
#
# A soft gel, of 20 kPa and 15 J/m², and a strip of silicone [mm, MPa].  The strength is chosen: the mesh has to resolve
# the zone in which the bond softens.


@dataclass(frozen=True)
class Block:
    """Block of one material that a blade punctures, and the push [mm, MPa, N/mm, s].

    Attributes:
        name: Its name.
        solid: Material.
        bond: Law of the crack.
        blade: The tool.
        damping: Kelvin–Voigt viscosity over Young's modulus.
        steady: Way on which steady cuts are compared.
        notch: Depth of the notch of the run that it is compared with.
        length: Length of each half.
        below: What is left of the block below the tip at the end.
        friction: Coefficient of friction of the blade.
    """

    name: str
    solid: NeoHookean
    bond: Exponential
    blade: Blade
    damping: float
    steady: float
    notch: float
    length: float
    below: float
    friction: float = 0.0

    @property
    def rule(self) -> MeshRule:
        """Sizes of the elements."""
        return MeshRule.of([self.blade], [self.bond])

    @property
    def settled(self) -> float:
        """Depth of the tip from which on nothing is felt of the surface."""
        return self.blade.shaft_height + self.length

    @property
    def depth(self) -> float:
        """Depth of the tip at the end."""
        return self.settled + self.steady

    @property
    def stiffness(self) -> float:
        """Axial stiffness of the section below the cut, in plane strain, per width."""
        return 2 * self.length * self.solid.young / (1 - self.solid.poisson**2)

    def body(self, notch: float) -> CrackedBody:
        """The body, with a notch of this depth or none. Collective."""
        size, mouth = self.rule.size, self.rule.mouth
        sizes = {"dim": 2, "Lx": self.length, "H": self.depth + self.below, "notch": notch, "deep": self.depth + 0.5}
        sizes["half"] = 1  # both sides of the crack are alike: energies are those of one
        sizes |= {"lc": size, "band": 2 * size, "growth": 1.8, "entry": mouth}
        domain = read_geo(geometry("block"), COMM, sizes, gdim=2)
        viscosity = self.damping * self.solid.young
        return cracked_block(domain, self.solid, self.bond, viscosity=viscosity, faces=Faces(symmetric=True, firm=True))


def blade(degrees: float, radius: float, half_thickness: float) -> Blade:
    """A blade."""
    return Blade(np.radians(degrees), radius, half_thickness)


GEL, GEL_BOND = NeoHookean(0.02, 0.45), Exponential(strength=0.03, toughness=0.015)
STRIP, STRIP_BOND = NeoHookean(0.777, 0.45), Exponential(strength=0.3, toughness=0.1)
SILICONE = Block("silicone", STRIP, STRIP_BOND, blade(20, 0.1, 0.4), 1e-3, 0.3, 0.4, 1.2, 1.4)
SHARP = replace(SILICONE, name="silicone, sharp", blade=blade(20, 0.05, 0.4))
RUBBED = replace(SILICONE, name="silicone, friction 0.3", friction=0.3)
BLOCKS = (
    Block("gel", GEL, GEL_BOND, blade(15, 0.3, 0.75), 5e-4, 0.6, 0.8, 3.0, 3.0),
    SILICONE,
    SHARP,
    RUBBED,
)
QUICK = 0.9  # depth of the tip at the end, a fifth of a millimetre after the puncture [mm]


def main(
    quick: Annotated[bool, typer.Option("--quick", help="silicone only, until it has punctured")] = False,
    out: Annotated[Path, typer.Option(help="where the results go")] = Path("results/validation/puncture"),
    overwrite: Annotated[bool, typer.Option("--overwrite", help="replace the results of an older run")] = False,
    only: Annotated[str, typer.Option(help="name of a block, to puncture it alone")] = "",
) -> None:
    """Puncture intact blocks with blades, and cut the same from a notch."""
    logging.basicConfig(level=logging.ERROR, format="%(name)s: %(message)s")
    claim_folder(out, COMM, overwrite=overwrite)
    begun, summary, curves = time.perf_counter(), {}, []
    blocks = [SILICONE] if quick else [block for block in BLOCKS if only in ("", block.name)]
    for block in blocks:
        histories = {"intact": push(block, 0.0, QUICK if quick else block.depth, out)}
        values = punctured(block, histories["intact"])
        if not quick:
            histories["notched"] = push(block, block.notch, block.depth, out)
            values |= compared(block, *histories.values())
        summary |= {f"{block.name}: {name}": value for name, value in values.items()}
        for label, history in histories.items():
            curves.append(Curve(history["depth"], history["force"] / block.bond.toughness, f"{block.name}, {label}"))
    summary |= {"ranks": float(COMM.size), "wall_time": time.perf_counter() - begun}
    write_summary(out / "summary.json", summary, COMM)
    if COMM.rank == 0:
        plot_curves(
            out / "force.png",
            curves,
            xlabel="depth of the tip [mm]",
            ylabel="force per width over toughness",
            title="Puncture",
        )
        for name, value in summary.items():
            typer.echo(f"{name:>60}  {value:.5g}")
    check(summary, blocks)


def push(block: Block, notch: float, depth: float, out: Path) -> History:
    """A push to a depth. Collective."""
    drive = Drive(1.0)
    cut = Insertion.build(block.body(notch), block.blade, drive, notch=notch, friction=block.friction or None)
    folder = out / f"{block.name.replace(', ', '-').replace(' ', '-')}-{'notched' if notch else 'intact'}"
    largest = 0.05 if block.friction else 0.1
    control = StepControl(first=0.02, largest=largest, smallest=1e-6, closure=5e-3)

    def columns(columns):
        deepest = max(contact.penetration() * contact.patches[0].normal_size for contact in cut.contacts)
        return cut.columns(columns) | {"penetration": (deepest, "length")}

    end = cut.time_of(depth)
    with Recording(folder, cut.mechanics, end, title=block.name, extra=columns, every=0) as recording:
        run(cut.mechanics, end, control, recording)
    return recording.columns()


# ## Results


def at_puncture(block: Block, intact: History) -> int:
    """Step at which the block gives way; on the shank the force may grow beyond that of the puncture."""
    return int(np.argmax(np.where(intact["front"] < 2 * block.blade.tip_radius, intact["force"], 0.0)))


def punctured(block: Block, intact: History) -> dict[str, float]:
    """What the run into the intact block says."""
    peak = at_puncture(block, intact)
    return {
        "depth of the puncture [mm]": float(intact["depth"][peak]),
        "force of the puncture over the toughness": float(intact["force"][peak] / block.bond.toughness),
        "least force after it over the peak": float((intact["force"][peak:] / intact["force"][peak]).min()),
        "penetration over the size along the crack": float(intact["penetration"].max() / block.rule.size),
        "largest closure": float(np.abs(intact["energy_closure"]).max()),
        "steps": float(len(intact["depth"])),
    }


def compared(block: Block, intact: History, notched: History) -> dict[str, float]:
    """What it says beside the run from a notch."""
    start, end = block.settled, block.depth
    peak = at_puncture(block, intact)
    steady = [SteadyCut.of(history, start, end) for history in (intact, notched)]
    works = [work_until(intact["depth"][peak], history) for history in (intact, notched)]
    lost = intact["energy_fracture"] + intact["energy_friction"] + intact["energy_viscous"]
    viscous = 2 * np.diff(np.interp([start, end], intact["depth"], intact["energy_viscous"]))[0] / block.steady
    expected = steady_force(block.bond.toughness + viscous, 1.0, block.stiffness)
    return {
        "steady force over that from a notch": steady[0].force / steady[1].force,
        "drift of the steady force": steady[0].drift,
        "drift of that from a notch": steady[1].drift,
        "steady force over the toughness": steady[0].force / block.bond.toughness,
        "steady force over closed form": float(steady[0].force / expected),
        "work until the puncture over that from a notch": works[0] / works[1],
        "part of what is lost that the viscosity takes": float(intact["energy_viscous"][-1] / lost[-1]),
    }


def work_until(depth: float, history: History) -> float:
    """Work of the tool per width until a depth."""
    work = cumulative_trapezoid(history["force"], history["depth"], initial=0.0)
    return float(np.interp(depth, history["depth"], work))


def check(summary: dict[str, float], blocks: list[Block]) -> None:
    """The headline numbers, asserted."""
    for block in blocks:
        start = f"{block.name}: "
        values = {name.removeprefix(start): v for name, v in summary.items() if name.startswith(start)}
        assert values["largest closure"] < 0.01, block.name
        assert values["penetration over the size along the crack"] < 0.1, block.name
        if "steady force over that from a notch" in values:
            assert abs(values["steady force over that from a notch"] - 1) < 0.01, block.name
            assert values["work until the puncture over that from a notch"] > 1, block.name
        else:
            assert values["least force after it over the peak"] < 0.7, block.name


if __name__ == "__main__":
    typer.run(main)
