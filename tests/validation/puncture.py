# # Puncture: a crack starts by itself under a tip
#
# A tool that comes to an intact surface indents it.  At some depth the bond under the tip gives way: a crack starts in
# the plane of the cut, runs ahead, and the force drops.  From then on the tool cuts as if it had started in a notch.
#
# ## What theory says
#
# 1. After the puncture nothing is left of how the cut began.  The force and the toughness by force and front are those
#    of the same tool that starts in a notch.
# 2. At a given depth the body holds the energy $U_i(d)$ if it is indented, and with a cut it holds $U_c$ and has cost
#    $G_c A$.  A crack cannot start before the sum $U_c + G_c A$ has fallen below $U_i$ (Fregonese and Bacca 2021): the
#    work done until the puncture is at least that of the notched run at the same depth.
# 3. The drop of the force is unstable.  What is set free goes into viscosity, and the audit still closes.

import logging
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from mpi4py import MPI
from scipy.integrate import cumulative_trapezoid

from cutsim import (
    Blade,
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
from cutsim.studies.insertion_work import SteadyCut

History = dict[str, np.ndarray]


# ## Materials
#
# A soft gel, of 20 kPa and 15 J/m², and a strip of silicone [mm, MPa].  The strength is chosen: the mesh has to resolve
# the zone in which the bond softens.


@dataclass(frozen=True)
class Setting:
    """Material and tool of a puncture, with the measures of the block [mm, MPa, N/mm, MPa s]."""

    name: str
    solid: NeoHookean
    bond: Exponential
    viscosity: float
    radius: float
    depth: float
    half_thickness: float = 0.75
    length: float = 5.0
    degrees: float = 15
    friction: float = 0.0
    notch: float = 0.4

    @property
    def blade(self) -> Blade:
        """The tool."""
        return Blade(np.radians(self.degrees), self.radius, self.half_thickness)

    def build(self, notch: float) -> Insertion:
        """Block and blade, above an intact surface or in a notch. Collective."""
        rule = MeshRule.of([self.blade], [self.bond])
        deep = self.depth + 0.5
        sizes = {
            "dim": 2,
            "Lx": self.length,
            "H": self.depth + (3 if self.length > 2 else 1),
            "notch": notch,
            "deep": deep,
            "lc": rule.size,
        }
        sizes |= {"band": 2 * rule.size, "growth": 1.8, "entry": rule.mouth}
        domain = read_geo(geometry("block"), MPI.COMM_WORLD, sizes, gdim=2)
        faces = Faces(symmetric=True)
        body = cracked_block(domain, self.solid, self.bond, viscosity=self.viscosity, faces=faces)
        return Insertion.build(body, self.blade, Drive(1.0), notch=notch, friction=self.friction or None)


GEL, GEL_BOND = NeoHookean(0.02, 0.45), Exponential(strength=0.03, toughness=0.015)
STRIP, STRIP_BOND = NeoHookean(0.777, 0.45), Exponential(strength=0.3, toughness=0.1)
BLUNT_GEL = Setting("gel, r = 0.3 mm", GEL, GEL_BOND, 1e-4, 0.3, 6.5, notch=0.8)
SHARP_GEL = Setting("gel, r = 0.05 mm", GEL, GEL_BOND, 1e-4, 0.05, 5.0)
SILICONE = Setting("silicone, r = 0.1 mm", STRIP, STRIP_BOND, 2e-3, 0.1, 2.2, 0.4, 1.2, 20)
RUBBED = Setting("silicone, r = 0.1 mm, friction 0.2", STRIP, STRIP_BOND, 2e-3, 0.1, 2.2, 0.4, 1.2, 20, friction=0.2)

FULL = (BLUNT_GEL, SHARP_GEL, SILICONE, RUBBED)
QUICK = (SILICONE,)


def main(
    quick: Annotated[bool, typer.Option("--quick", help="silicone only")] = False,
    out: Annotated[Path, typer.Option(help="where the results go")] = Path("results/validation/puncture"),
    overwrite: Annotated[bool, typer.Option("--overwrite", help="replace the results of an older run")] = False,
    only: Annotated[str, typer.Option(help="name of a setting, to run it alone")] = "",
) -> None:
    """Puncture intact blocks with blades, and cut the same from a notch."""
    logging.basicConfig(level=logging.ERROR, format="%(name)s: %(message)s")
    claim_folder(out, MPI.COMM_WORLD, overwrite=overwrite)
    begun, summary, curves = time.perf_counter(), {}, []
    settings = [s for s in (QUICK if quick else FULL) if only in ("", s.name)]
    for setting in settings:
        intact, notched = (push(setting, notch, out) for notch in (0.0, setting.notch))
        summary |= {f"{setting.name}: {name}": value for name, value in found(setting, intact, notched).items()}
        for history, label in ((intact, "intact"), (notched, "notched")):
            curves.append(
                Curve(history["depth"], history["force"] / setting.bond.toughness, f"{setting.name}, {label}")
            )
    summary |= {"ranks": float(MPI.COMM_WORLD.size), "seconds": time.perf_counter() - begun}
    write_summary(out / "summary.json", summary, MPI.COMM_WORLD)
    if MPI.COMM_WORLD.rank == 0:
        plot_curves(
            out / "force.png",
            curves,
            xlabel="depth of the tip [mm]",
            ylabel="force per width over G_c",
            title="Puncture",
        )
        for name, value in summary.items():
            typer.echo(f"{name:>60}  {value:.5g}")
    check(summary, settings)


def push(setting: Setting, notch: float, out: Path) -> History:
    """A push to the end. Collective."""
    cut = setting.build(notch)
    folder = out / f"{''.join(c if c.isalnum() else '_' for c in setting.name)}_{'notched' if notch else 'intact'}"
    control = StepControl(first=0.02, largest=0.1 if not setting.friction else 0.05, smallest=1e-5, closure=2e-3)
    deepest: list[float] = []

    def columns(columns):
        deepest.append(max(contact.penetration() * contact.patches[0].normal_size for contact in cut.contacts))
        return cut.columns(columns) | {"penetration": (deepest[-1], "length")}

    with Recording(
        folder, cut.mechanics, cut.time_of(setting.depth), title=setting.name, extra=columns, every=0
    ) as recording:
        run(cut.mechanics, cut.time_of(setting.depth), control, recording)
    return recording.columns()


# ## Results


def found(setting: Setting, intact: History, notched: History) -> dict[str, float]:
    """What the two runs say."""
    rule = MeshRule.of([setting.blade], [setting.bond])
    peak = int(np.argmax(intact["force"]))
    after = slice(peak, None)
    end = setting.depth
    steady = [SteadyCut.of(history, end - 0.6, end) for history in (intact, notched)]
    works = [
        np.interp(intact["depth"][peak], h["depth"], cumulative_trapezoid(h["force"], h["depth"], initial=0.0))
        for h in (intact, notched)
    ]
    return {
        "depth of the puncture [mm]": float(intact["depth"][peak]),
        "force of the puncture over the toughness": float(intact["force"][peak] / setting.bond.toughness),
        "least force after it over the peak": float(intact["force"][after].min() / intact["force"][peak]),
        "steady force over that from a notch": steady[0].force / steady[1].force,
        "steady force over the toughness": steady[0].force / setting.bond.toughness,
        "work until the puncture over that from a notch": works[0] / works[1],
        "penetration over the size along the crack": float(intact["penetration"].max() / rule.size),
        "largest closure": float(np.abs(intact["energy_closure"]).max()),
        "steps": float(len(intact["depth"])),
    }


def work_until(depth: float, history: History) -> float:
    """Work of the tool per width until a depth."""
    return float(
        np.interp(depth, history["depth"], cumulative_trapezoid(history["force"], history["depth"], initial=0.0))
    )


def check(summary: dict[str, float], settings: list[Setting]) -> None:
    """The headline numbers, asserted."""
    for setting in settings:
        values = {
            name.removeprefix(f"{setting.name}, "): v for name, v in summary.items() if name.startswith(setting.name)
        }
        assert abs(values["steady force over that from a notch"] - 1) < 0.01, setting.name
        assert values["largest closure"] < 0.01, setting.name
        assert values["penetration over the size along the crack"] < 0.1, setting.name
        assert values["work until the puncture over that from a notch"] > 1, setting.name
        assert values["least force after it over the peak"] < 0.9, setting.name


if __name__ == "__main__":
    typer.run(main)
