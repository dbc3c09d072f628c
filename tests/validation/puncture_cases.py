# # Puncture in the cases that come with cutsim
#
# A ring, a blade in space, and skin on fat: each case is run as its file is, from above an intact
# surface, and once more from a notch.  As in `puncture.py`, what comes after the puncture knows nothing of it, once the
# surface is as far above the shank of the tool as what the tool parts is wide.
#
# In space there is a closed form of the steady force too, that of `steady_force` with free sides.  The slab is so short
# that the plate is felt where both runs are compared: there the force is some per cent larger.

import logging
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from mpi4py import MPI

from cutsim.cases import built_in_cases, read_case
from cutsim.results.output import claim_folder, write_summary
from cutsim.results.plots import Curve, plot_curves
from cutsim.results.recording import Columns, Recording
from cutsim.studies.insertion import Insertion
from cutsim.studies.insertion_work import SteadyCut, steady_force
from cutsim.studies.mesh_rule import MeshRule

COMM = MPI.COMM_WORLD
History = dict[str, np.ndarray]


@dataclass(frozen=True)
class Punctured:
    """A case, and the run from a notch that it is compared with [mm].

    Attributes:
        name: Its name in what is found.
        case: Name of the case.
        notch: Depth of the notch.
        width: Width of what the tool parts, above which the surface is no longer felt.
        ahead: Part of the whole cut that the front has swept at most when the surface gives way.
        settings: What differs from the file of the case.
    """

    name: str
    case: str
    notch: float
    width: float
    ahead: float = 0.25
    settings: Mapping[str, str] = field(default_factory=dict)


ROUGH = {
    "tool.friction": "0.2",
    "insertion.faces.firm": "true",
    "insertion.depth": "8 mm",
    "mesh.set.deep": "9",
    "mesh.set.H": "14",
}
ALL = (
    Punctured("ring", "puncture-ring", 0.3, 0.8),
    Punctured("slab", "puncture-slab", 0.3, 0.8),
    Punctured("skin", "puncture-skin", 0.3, 1.7),
    # the hole of a needle is felt over some radii of it; friction on the shaft grows with the depth, in both runs alike
    Punctured("needle", "puncture-needle", 0.3, 2.0, settings=ROUGH),
)


def main(
    only: Annotated[str, typer.Option(help="name of one of them, to run it alone")] = "",
    out: Annotated[Path, typer.Option(help="where the results go")] = Path("results/validation/puncture_cases"),
    overwrite: Annotated[bool, typer.Option("--overwrite", help="replace the results of an older run")] = False,
) -> None:
    """Run the cases of punctures, and the same from a notch."""
    logging.basicConfig(level=logging.ERROR, format="%(name)s: %(message)s")
    claim_folder(out, COMM, overwrite=overwrite)
    begun, summary, curves = time.perf_counter(), {}, []
    for one in [one for one in ALL if only in ("", one.name)]:
        values, histories = compared(one, out)
        summary |= {f"{one.name}: {name}": value for name, value in values.items()}
        curves += [Curve(h["depth"], h["force"], f"{one.name}, {label}") for label, h in histories.items()]
    summary |= {"ranks": float(COMM.size), "wall_time": time.perf_counter() - begun}
    write_summary(out / "summary.json", summary, COMM)
    if COMM.rank == 0:
        plot_curves(
            out / "force.png", curves, xlabel="depth of the tip [mm]", ylabel="force [N or N/mm]", title="Puncture"
        )
        for name, value in summary.items():
            typer.echo(f"{name:>60}  {value:.5g}")


def compared(one: Punctured, out: Path) -> tuple[dict[str, float], dict[str, History]]:
    """Both runs, and what they say. Collective."""
    intact = pushed(one, 0.0, out)
    notched = pushed(one, one.notch, out)
    return found(one, intact, notched), {"intact": intact.history, "notched": notched.history}


@dataclass(frozen=True)
class Push:
    """A push to the end, in a history, and what was pushed."""

    cut: Insertion
    history: History


def pushed(one: Punctured, notch: float, out: Path) -> Push:
    """Run a case with a notch or without one. Collective."""
    open_ = {"mesh.set.notch": f"{notch}", "insertion.notch": f"{notch}"} if notch else {}
    simulation = read_case(built_in_cases()[one.case][1], {**one.settings, **open_}).build(COMM)
    cut = simulation.insertion
    assert cut is not None

    def columns(row: Columns) -> Columns:
        deepest = max(contact.penetration() * contact.patches[0].normal_size for contact in cut.contacts)
        return simulation.columns(row) | {"penetration": (deepest, "length")}

    folder = out / f"{one.name}-{'notched' if notch else 'intact'}"
    with Recording(folder, simulation.problem, simulation.until, title=one.name, extra=columns, every=0) as recording:
        simulation.run(recording)
    return Push(cut, recording.columns())


def found(one: Punctured, intact: Push, notched: Push) -> dict[str, float]:
    """What the two runs say."""
    cut, history = intact.cut, intact.history
    tool, start, end = cut.tool, cut.tool.shaft_height + one.width, float(history["depth"][-1])
    size = MeshRule.of([tool], [crack.law for crack in cut.body.cracks]).size
    before = history["front"] < one.ahead * history["front"][-1]
    peak = int(np.argmax(np.where(before, history["force"], 0.0)))
    steady = [SteadyCut.of(push.history, start, end) for push in (intact, notched)]
    return {
        "depth at the end [mm]": end,
        "depth of the puncture [mm]": float(history["depth"][peak]),
        "force of the puncture over the steady one": float(history["force"][peak] / steady[0].force),
        "least force after it over the peak": float((history["force"][peak:] / history["force"][peak]).min()),
        "steady force": steady[0].force,
        "steady force over that from a notch": steady[0].force / steady[1].force,
        **closed_form(cut, history, steady[0], start, end),
        **parts(intact.history, notched.history, start, end),
        "drift of the steady force": steady[0].drift,
        "drift of that from a notch": steady[1].drift,
        "penetration over the size along the crack": float(history["penetration"].max() / size),
        "largest closure": float(np.abs(history["energy_closure"]).max()),
        "steps": float(len(history["depth"])),
    }


def parts(intact: History, notched: History, start: float, end: float) -> dict[str, float]:
    """What does not depend on how deep the shaft is in the body, which friction tells: over the same from a notch."""
    depths = np.linspace(start, end, 200)
    tips, forces = (
        np.array([np.interp(depths, h["depth"], h[name]) for h in (intact, notched)]) for name in ("tip_force", "force")
    )
    growth = [np.polyfit(depths, force, 1)[0] for force in forces]
    return {
        "force on the tip over that from a notch": float(tips[0].mean() / tips[1].mean()),
        "growth of the force over that from a notch": float(growth[0] / growth[1]),
    }


def closed_form(cut: Insertion, history: History, steady: SteadyCut, start: float, end: float) -> dict[str, float]:
    """Steady force of a blade in a slab over that of one with free sides, with the viscous work per way and width."""
    mesh, crack, (solid, *others) = cut.state.mesh, cut.body.cracks[0], cut.body.solids
    if mesh.geometry.dim != 3 or others:
        return {}
    width = cut.edge_factor * np.ptp(cut.frame.span(mesh, cut.body.slit, cut.frame.edge))
    length = (2 if cut.body.mirrored else 1) * np.ptp(
        cut.frame.span(mesh, cut.body.domain.facets("bottom"), cut.frame.normal)
    )
    viscous = cut.symmetry_factor * np.diff(np.interp([start, end], history["depth"], history["energy_viscous"]))[0]
    cost = crack.law.toughness + viscous / (end - start) / width
    force = steady_force(cost, width, solid.material.young * length * width)
    return {"steady force over closed form": steady.force / force}


if __name__ == "__main__":
    typer.run(main)
