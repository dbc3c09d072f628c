# # Cutting skin, layer by layer
#
# A blade cuts a block of skin of eight layers: five of epidermis, two of dermis, and the fat below.  The epidermis is a
# tenth of a millimetre thick and its thinnest layers a hundredth, the block is 2 mm high and 4 mm long; the stiffest
# layer is eight hundred times as stiff as the softest.
#
# ## The layers
#
# The models are those of K. Bronik's thesis (section 5.2.1): neo-Hookean epidermis, Ogden's dermis, Mooney–Rivlin fat.
# It prints no values; those here are in `cutsim.materials.library` with their sources and assumptions.
#
# **The toughness is assumed.**  The toughness found for skin spans orders of magnitude with the tool and its size,
# and no source separates the layers.  The values below, 20 and 30 J/m² for epidermis and dermis and 1 J/m² for fat, are
# of the order that was found for microscopic penetrators (see the page on layers).
#
# ## The cut
#
# The cut is in plane strain, per millimetre of width.  The far ends of the block are held where the skin would
# continue.  Before the cut they are pulled apart by 5 %, since skin on a body is under tension.  This opens the
# wound.  The fat rests on a smooth plate.  A blade of 12° half angle is spread apart in a notch of 50 µm, which goes
# through the first three layers, and then pushed at unit speed.
#
# First the skin bends into the soft fat, until the force is large enough to cut.  The force is then of the order of the
# toughness of the layer at the tip, less the contribution of the tension of the skin.  A layer whose bond has broken
# has dissipated its toughness times its thickness, which follows from the law whatever the mechanics; the run ends
# with this as a check of the energy audit.

import logging
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import matplotlib
import numpy as np
import typer
from dolfinx import fem
from matplotlib.figure import Figure
from mpi4py import MPI

from cutsim import Blade, Drive, Exponential, Fixture, Insertion, LayeredBlock, StepControl, laminate, run
from cutsim.results.grids import VonMises, gather_grid
from cutsim.results.output import claim_folder
from cutsim.results.pictures import draw_body
from cutsim.results.plots import Curve, plot_curves, plot_energy
from cutsim.results.recording import Recording
from cutsim.studies.layered import Layer, skin
from cutsim.studies.picture import tool_surface

COMM = MPI.COMM_WORLD
HALF_ANGLE, HALF_THICKNESS = float(np.deg2rad(12.0)), 0.2  # of the blade [mm]
LENGTH = 2.0  # of each half of the block [mm]
STRETCH = 0.05  # of the skin before the cut
DAMPING = 0.003  # Kelvin–Voigt viscosity over Young's modulus [s], at a cutting speed of 1 mm/s
TOUGHNESS = {"epidermis": 0.02, "dermis": 0.03, "hypodermis": 0.001}  # [N/mm]

# The openings at which the laws have their maximum, 2.5 elements and ten for fat, keep the strength below the stiffness
# and let the mesh resolve the process zone.


@dataclass(frozen=True)
class Setting:
    """Elements along the crack, which is also the tip radius; notch; depth of the cut [mm]."""

    size: float
    notch: float
    depth: float

    @property
    def laws(self) -> tuple[Exponential, Exponential, Exponential]:
        """Cohesive laws of epidermis, dermis and hypodermis."""
        openings = (2.5 * self.size, 2.5 * self.size, 10 * self.size)
        first, second, third = (
            Exponential(opening=opening, toughness=toughness)
            for opening, toughness in zip(openings, TOUGHNESS.values(), strict=True)
        )
        return first, second, third


SETTINGS = {False: Setting(0.02, 0.05, 1.45), True: Setting(0.04, 0.09, 1.0)}

History = dict[str, np.ndarray]
Summary = dict[str, float | list[float]]


def main(
    depth: Annotated[float | None, typer.Option(help="depth of the cut in mm")] = None,
    stretch: Annotated[float, typer.Option(min=0.0, help="stretch of the skin before the cut")] = STRETCH,
    quick: Annotated[bool, typer.Option("--quick", help="coarse and short")] = False,
    out: Annotated[Path, typer.Option(help="where the results go")] = Path("results/validation/skin_layers"),
    overwrite: Annotated[bool, typer.Option("--overwrite", help="replace the results of an older run")] = False,
) -> None:
    """Cut through the eight layers of skin."""
    begun = time.perf_counter()
    logging.basicConfig(level=logging.WARNING if COMM.rank == 0 else logging.ERROR, format="%(name)s: %(message)s")
    claim_folder(out, COMM, overwrite=overwrite)
    setting = SETTINGS[quick]
    cut = build(setting, stretch)
    until = cut.time_of(depth or setting.depth)
    recording = push(cut, until, setting.size, out)
    history = recording.columns()
    draw(cut, history, out)
    summary = summarise(cut, history, time.perf_counter() - begun)
    recording.summary(summary)
    check(cut, summary, history)


def build(setting: Setting, stretch: float) -> Insertion:
    """Mesh, layers and blade."""
    layers = skin(*setting.laws)
    thicknesses = {layer.name: layer.thickness for layer in layers}
    size = setting.size
    domain = laminate(COMM, thicknesses, length=LENGTH, size=size, band=6 * size, notch=setting.notch)
    block = LayeredBlock.build(layers, domain, damping=DAMPING)
    blade = Blade(HALF_ANGLE, size, HALF_THICKNESS)
    fixture = Fixture(ends=("far_left", "far_right"), drawn=stretch * LENGTH)
    return Insertion.build(block, blade, Drive(speed=1.0, entry_time=1.0), notch=setting.notch, fixture=fixture)


def push(cut: Insertion, until: float, size: float, out: Path) -> Recording:
    """Insert and push the blade. Collective."""
    with Recording(
        out,
        cut.mechanics,
        until,
        title="skin",
        show={"depth": "depth", "force": "force"},
        extra=cut.columns,
        every=20,
    ) as recording:
        insertion = StepControl(first=0.05, largest=0.1, smallest=1e-5)
        run(cut.mechanics, cut.motion.entry_time, insertion, recording)
        run(cut.mechanics, until, StepControl(first=size / 4, largest=size, smallest=1e-5), recording)
    return recording


# ## Results


def summarise(cut: Insertion, history: History, seconds: float) -> Summary:
    """Headline numbers."""
    depth, force = history["depth"], history["force"]
    summary: Summary = {
        "depth": float(depth[-1]),
        "largest_force": float(force.max()),
        **{f"{layer.name}_fracture": float(history[f"{layer.name}_fracture"][-1]) for layer in cut_through(cut)},
        "largest_closure": float(np.abs(history["energy_closure"]).max()),
        "largest_imbalance": float((history["imbalance"] * force).max() / force.max()),
        "steps": len(depth),
        "rejected_steps": float(history["cuts"].sum()),
        "newton_iterations": float(history["newton"].sum()),
        "degrees_of_freedom": cut.state.V.dofmap.index_map.size_global * 2,
        "ranks": COMM.size,
        "seconds": seconds,
    }
    if COMM.rank == 0:
        for name, value in summary.items():
            typer.echo(f"{name:>34}  {value:.6g}")
    return summary


def cut_through(cut: Insertion) -> list[Layer]:
    """Layers all of whose bond has broken. Collective."""
    found = []
    for crack in cut.body.cracks:
        damage = crack.facet_mean("damage")
        for layer in cut.body.layers_of(crack):
            within = np.isin(crack.points.facets, cut.body.domain.facets(f"crack_{layer.name}"))
            if COMM.allreduce(float(damage[within].min(initial=1.0)), MPI.MIN) > 0.99:
                found.append(layer)
    return found


def draw(cut: Insertion, history: History, out: Path) -> None:
    """Force, energies of the layers, audit, and the cut skin by its layers and by its stress."""
    if COMM.rank == 0:
        plot_curves(
            out / "force.png",
            [Curve(history["depth"], history["force"], "force on the blade")],
            xlabel="depth of the tip [mm]",
            ylabel="force per width [N/mm]",
            title="Cutting skin",
            references={"toughness of the dermis": TOUGHNESS["dermis"]},
        )
        plot_layers(cut.body, history, out / "layer_energies.png")
        plot_energy(out / "energy.png", history, x="time", xlabel="way of the blade [mm]")
    block, space = cut.body, fem.functionspace(cut.body.state.mesh, ("DG", 0))
    number, stress = fem.Function(space), VonMises(block.solids)()
    stress.x.array[:] *= 1e3
    for i, solid in enumerate(block.solids):
        number.x.array[space.dofmap.list[solid.cells, 0]] = i
    grid = gather_grid(block.state.u, {"layer": number, "stress": stress})
    layers = [layer.name.replace("_", " ") for layer in block.layers]
    for field, names in {"layer": layers, "stress": []}.items():
        draw_body(
            out / f"{field}.png",
            grid,
            field,
            label="von Mises stress [kPa]",
            names=names,
            tool=tool_surface(cut),
            window=(-0.9, 0.9, -cut.depth - 0.3, 0.3, 0.0, 0.0),
        )


def plot_layers(block: LayeredBlock, history: History, path: Path) -> None:
    """What each layer holds and what the crack in it has cost, over the depth. Call it on one rank."""
    figure = Figure(figsize=(8.0, 6.0), layout="constrained")
    panels = figure.subplots(2, sharex=True)
    shades = matplotlib.colormaps["viridis"](np.linspace(0.0, 1.0, len(block.layers)))
    colours = dict(zip((layer.name for layer in block.layers), shades, strict=True))
    for axes, kind in zip(panels, ("strain", "fracture"), strict=True):
        parts = {name: history[f"{name}_{kind}"] for name in colours if f"{name}_{kind}" in history}
        axes.stackplot(history["depth"], parts.values(), labels=parts, colors=[colours[name] for name in parts])
        axes.set_ylabel(f"{kind} energy [mJ/mm]")
    handles, names = panels[0].get_legend_handles_labels()
    figure.legend(handles[::-1], [name.replace("_", " ") for name in names[::-1]], loc="outside right center")
    panels[1].set_xlabel("depth of the tip [mm]")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)


def check(cut: Insertion, summary: Summary, history: History) -> None:
    """The steady force in the dermis, and the energy audit."""
    depth, force = history["depth"], history["force"]
    steady = (depth > 0.75) & (depth < 0.95)
    if depth[-1] > 1.0:
        assert abs(force[steady].mean() / TOUGHNESS["dermis"] - 1) < 0.05, "the dermis is cut at another force"
    for layer in cut_through(cut):
        given = layer.law.toughness * (layer.thickness - notched(cut, layer))
        spent = history[f"{layer.name}_fracture"][-1]
        assert abs(spent / given - 1) < 0.03, f"{layer.name}: {spent} spent, {given} given"
    assert summary["largest_closure"] < 0.01
    assert summary["largest_imbalance"] < 1e-6


def notched(cut: Insertion, layer: Layer) -> float:
    """How far the notch reaches into a layer [mm]."""
    layers = cut.body.layers
    top = sum(other.thickness for other in layers[: layers.index(layer)])
    notch = cut.frame.span(cut.state.mesh, cut.body.mouth, cut.frame.push)[1]
    return float(np.clip(notch - top, 0.0, layer.thickness))


if __name__ == "__main__":
    typer.run(main)
