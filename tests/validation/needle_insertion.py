# # Needle insertion
#
# A needle with a conical tip and a cylindrical shaft is pushed into silicone.  Two models of what the tip does to the
# material in its way (see the page on needle insertion):
#
# - `--dim 2`: a body of revolution.  A crack on the axis would have no area.  A blunt tip destroys a thread of its own
#   width, and the crack is the surface of that thread; the hole is then widened to the radius of the shaft.
# - `--dim 3`: a sharp tip splits the block in a plane through its axis (Shergold and Fleck 2004; K. Bronik's thesis,
#   5.2.1), and the faces wrap around the shaft.  How far the crack goes to either side is a result.
#
# The work of the force goes into the deformation of the body, into new surface, and into friction on tip and shaft.
# Then the needle is pulled back and pushed in again along the broken path.  The difference in work is the cost of the
# new surface (Azar and Hayward 2008).

import logging
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from mpi4py import MPI

from cutsim import (
    Drive,
    Exponential,
    Insertion,
    Needle,
    NeoHookean,
    StepControl,
    cracked_block,
    geometry,
    read_geo,
    run,
)
from cutsim.results.output import claim_folder
from cutsim.results.pictures import draw_stress
from cutsim.results.plots import Curve, plot_curves, plot_energy, plot_parts
from cutsim.results.recording import Recording
from cutsim.studies.insertion_work import TwoInsertions, force_parts
from cutsim.studies.picture import draw_insertion, tool_surface

# Silicone 1 of the thesis: Young's modulus [MPa], Poisson's ratio; viscosity [MPa s] at a speed of 1 mm/s, which
# carries the run across the small jumps of a crack with friction; its share is an entry of the energy audit.

YOUNG, POISSON, VISCOSITY = 0.777, 0.48, 0.005

# ## Settings
#
# The mesh must resolve the tip: two to three elements along its radius are worth more than a finer mesh elsewhere.


@dataclass(frozen=True)
class Setting:
    """Mesh, needle and bond [mm, N]; depth of the tip, window over which the parts of the force are averaged."""

    geometry: str
    mesh: dict[str, float]
    half_angle: float
    tip_radius: float
    radius: float
    strength: float
    toughness: float
    depth: float
    window: float


THREAD = dict(r0=0.2, R=6, H=8, notch=0.5, deep=5, lc=0.05)
BLOCK = dict(half=1, L=6, B=6, H=7.5, notch=1.0, slit=1.0, deep=6, band=0.75, lc=0.25, growth=1.6)
SETTINGS = {
    # (dim, quick)
    (2, False): Setting("thread", THREAD, 15, 0.15, 0.5, 1.0, 0.1, 4.0, 0.1),
    (2, True): Setting("thread", THREAD | dict(H=4, R=4, deep=2.5, lc=0.075), 30, 0.15, 0.5, 1.0, 0.1, 1.6, 0.1),
    (3, False): Setting("needle", BLOCK, 20, 0.3, 1.0, 0.3, 0.15, 4.5, 0.2),
    (3, True): Setting("needle", BLOCK | dict(H=5, deep=3, lc=0.3, growth=1.8), 25, 0.4, 1.0, 0.3, 0.15, 1.8, 0.2),
}

Summary = dict[str, float | list[float]]
History = dict[str, np.ndarray]


def main(
    dim: Annotated[int, typer.Option(min=2, max=3, help="2: body of revolution; 3: planar crack")] = 2,
    friction: Annotated[
        float | None, typer.Option(min=0.0, help="of needle and silicone; 0.1 in 2-D, 0 in 3-D by default")
    ] = None,
    once: Annotated[bool, typer.Option("--once", help="do not draw the needle back and push it again")] = False,
    toughness: Annotated[float | None, typer.Option(help="G_c in N/mm")] = None,
    depth: Annotated[float | None, typer.Option(help="depth of the tip in mm")] = None,
    coarser: Annotated[float, typer.Option(min=1, help="factor on the size of the elements along the crack")] = 1.0,
    quick: Annotated[bool, typer.Option("--quick", help="coarse and short")] = False,
    out: Annotated[Path, typer.Option(help="where the results go")] = Path("results/validation/needle_insertion"),
    overwrite: Annotated[bool, typer.Option("--overwrite", help="replace the results of an older run")] = False,
) -> None:
    """Push a needle into silicone and say what its force is made of."""
    level = logging.WARNING if MPI.COMM_WORLD.rank == 0 else logging.ERROR
    logging.basicConfig(level=level, format="%(name)s: %(message)s")
    claim_folder(out, MPI.COMM_WORLD, overwrite=overwrite)
    begun = time.perf_counter()
    setting = SETTINGS[dim, quick]
    setting = replace(setting, mesh=setting.mesh | {"lc": coarser * setting.mesh["lc"]})
    end = depth or setting.depth
    law = Exponential(strength=setting.strength, toughness=toughness or setting.toughness)
    rough = friction if friction is not None else (0.1, 0.0)[dim - 2]
    cut = problem(setting, law, rough, dim, None if once else end)
    until = cut.time_of(end, 1 if once else 2)
    control = StepControl(first=0.02, largest=0.1, smallest=1e-4)
    with Recording(
        out,
        cut.mechanics,
        until,
        title="needle",
        show={"depth": "depth", "force": "force"},
        extra=cut.columns,
        derived={"cauchy_stress": cut.body.solids[0].cauchy_stress(cut.state.u)},
    ) as recording:
        run(cut.mechanics, until, control, recording)
    history = recording.columns()
    draw(cut, out)
    parts = force_parts(history, cut.symmetry_factor, setting.window)
    summary = summarise(cut, history, parts, law, time.perf_counter() - begun)
    recording.summary(summary)
    if MPI.COMM_WORLD.rank == 0:
        plot(out, cut, history, parts)
    check(summary, long=dim == 2 or not quick)


def problem(setting: Setting, law: Exponential, friction: float, dim: int, turning_depth: float | None) -> Insertion:
    """Block, crack and needle."""
    push, lateral = ((0.0, -1.0, 0.0)[:dim], (1.0, 0.0, 0.0)[:dim])
    needle = Needle(np.radians(setting.half_angle), setting.tip_radius, setting.radius, push, lateral)
    domain = read_geo(geometry(setting.geometry), MPI.COMM_WORLD, setting.mesh, gdim=dim)
    body = cracked_block(domain, NeoHookean(YOUNG, POISSON), law, viscosity=VISCOSITY, axisymmetric=dim == 2)
    drive = Drive(speed=1.0, entry_time=1.0, turning_depth=turning_depth)
    return Insertion.build(body, needle, drive, notch=setting.mesh["notch"], friction=friction)


# ## Results


def summarise(cut: Insertion, history: History, parts: History, law: Exponential, seconds: float) -> Summary:
    """Headline numbers of a run; the parts of the force are those of the last window of the first push."""
    summary: Summary = {
        "toughness_given": law.toughness,
        "largest_force": float(history["force"].max()),
        "depth": float(history["depth"].max()),
        "new_area": cut.edge_factor * float(history["crack_broken"].max()),
        **{f"{name.replace(' ', '_')}_at_the_end": float(part[-1]) for name, part in parts.items() if name != "depth"},
        "largest_closure": float(np.abs(history["energy_closure"]).max()),
        "steps": len(history["time"]),
        "rejected_steps": float(history["cuts"].sum()),
        "newton_iterations": float(history["newton"].sum()),
        "degrees_of_freedom": cut.state.V.dofmap.index_map.size_global * cut.state.mesh.geometry.dim,
        "ranks": cut.state.mesh.comm.size,
        "seconds": seconds,
    }
    if cut.motion.turning_depth is not None:
        both = TwoInsertions.of(history, cut)
        summary |= {"work_first": both.first, "work_second": both.second}
        summary |= {"toughness_apparent": both.apparent, "toughness_of_two_insertions": both.toughness}
    if cut.state.mesh.comm.rank == 0:
        for name, value in summary.items():
            typer.echo(f"{name:>34}  {value:.6g}")
    return summary


def plot(out: Path, cut: Insertion, history: History, parts: History) -> None:
    """Force by its parts and by the place where it acts, energy audit."""
    stack = {name: parts[name] for name in ("deformation", "cutting", "tip friction", "shaft friction", "viscosity")}
    labels = {"xlabel": "depth of the tip [mm]", "ylabel": "force [N]"}
    plot_parts(out / "parts.png", parts["depth"], stack, parts["force"], title="What the force is spent on", **labels)
    time = history["time"]
    turn = cut.motion.turning_depth
    down = cut.time_of(float(history["depth"].max()) if turn is None else turn)
    up = down if turn is None else cut.time_of(cut.motion.start_depth, 2)
    legs = {"-": time <= down, ":": (time >= down) & (time <= up), "--": time >= up}  # in, back, in again
    curves = [
        Curve(history["depth"][leg], history[column][leg], place if style == "-" else "", f"C{i}{style}")
        for i, (place, column) in enumerate({"needle": "force", "tip": "tip_force", "shaft": "shaft_force"}.items())
        for style, leg in legs.items()
    ]
    title = "Force on tip and shaft" + ("" if turn is None else ": in, back (dotted) and in again (dashed)")
    plot_curves(out / "force.png", curves, title=title, **labels)
    whole = {n: v * cut.symmetry_factor if n.startswith(("work", "energy")) else v for n, v in history.items()}
    whole["energy_closure"] = history["energy_closure"]
    plot_energy(out / "energy.png", whole, x="time", xlabel="way of the needle [mm]")


def draw(cut: Insertion, out: Path) -> None:
    """The body in a plane through the axis, and in space also the plane of the crack."""
    dim, depth = cut.state.mesh.geometry.dim, cut.depth
    if dim == 2:
        points = cut.body.cracks[0].points.submesh.geometry.x
        wall = (cut.state.mesh.comm.allreduce(float(points[:, 0].max(initial=0.0)), MPI.MAX), 0, 0)
        box = (-3.0, 3.0, -depth - 1.5, 0.8, 0.0, 0.0)
        draw_insertion(out / "section.png", cut, mirror=("x",), clip=((-1.0, 0.0, 0.0), wall), window=box)
        return
    box = (-3.0, 3.0, -depth - 1.5, 1.0, -3.0, 3.0)
    tool, across = tool_surface(cut), ((-1.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    draw_stress(out / "section.png", cut.body.solids, tool=tool, mirror=("x",), window=box, view=(0.5, 0.5, -1.6))
    draw_insertion(out / "crack.png", cut, mirror=("z",), clip=across, window=box, view=(-1.6, 0.3, 0.4))


# With friction the two insertions differ by more than the new surface: the force that opens the crack presses on the
# tip, and so causes friction on it, in the first insertion only.  The energy audit contains that work.  The rest is the
# toughness if the crack is long compared with its process zone.


def check(summary: Summary, *, long: bool) -> None:
    """The headline numbers, asserted."""
    names = ("deformation", "cutting", "tip_friction", "shaft_friction", "viscosity")
    total = sum(summary[f"{name}_at_the_end"] for name in names)
    assert abs(total / summary["force_at_the_end"] - 1) < 0.02
    assert summary["largest_closure"] < 0.02
    if long and "toughness_of_two_insertions" in summary:
        assert abs(summary["toughness_of_two_insertions"] / summary["toughness_given"] - 1) < 0.05


if __name__ == "__main__":
    typer.run(main)
