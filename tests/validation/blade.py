# # Blade cutting of silicone
#
# A rigid wedge blade is pushed through a silicone specimen along a predefined crack plane: two halves of
# 30 mm meet in a plane of 10.1 × 4.2 mm, the cutting edge lies along the 10.1 mm, and the specimen rests with
# its 4.2 mm of thickness on a smooth plate.  This is the cutting test of K. Bronik's thesis (section 5.2.4).
#
# ## Model
#
# Both halves are neo-Hookean, $W = \tfrac{G}{2}(I_1-3) - G\ln J + \tfrac{\lambda}{2}(\ln J)^2$, with a little
# Kelvin–Voigt viscosity.  The crack obeys the modified contact law: penalty contact when closed, the exponential
# cohesive law $T_n = t_n\,(\delta_n/\varepsilon)\,e^{1-\delta_n/\varepsilon}$ with $G_c = e\,t_n\,\varepsilon$ when
# open.  Each half meets its own convex half blade, the cut starts from a notch of 0.5 mm, and the blade is
# inserted by spreading the two half blades apart inside it.
#
# **The fracture energy.**  The thesis prints a strength of 0.615 MPa with an opening of 0.0061 mm, which gives
# $G_c = e\,t_n\,\varepsilon = 0.0103$ N/mm, and it also prints $G_c = 277.9$ N/mm.  A steady frictionless cut
# needs the force $F = G_c\,w$ on an edge of length $w$: 0.1 N for the one and 2800 N for the other, over $w = 10.1$ mm.
# The measured force is not printed; the machine was set to a largest load of 9–10 N.  The default here is
# $G_c = 0.8$ N/mm, which needs 8.1 N for the fracture alone and leaves room for friction below that load.
#
# **What the force tells.**  A tall block (`--dim 2`) reaches a steady cut, in which $F/w$ is the toughness, apart from
# the compression of the block below; the program `steady_cut` has the same in 3-D.  This thin specimen does not become
# steady.  The energy that the audit leaves for the crack, $(\int F\,\mathrm{d}s - \Delta E - \text{losses})/\Delta A$,
# equals the toughness that was put in whenever the audit closes.  The summary has it as a check of the audit, not as a
# result.

import logging
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from dolfinx import fem
from mpi4py import MPI

from cutsim import (
    AdiabaticTool,
    Blade,
    Drive,
    Exponential,
    Insertion,
    NeoHookean,
    StepControl,
    TaggedMesh,
    cracked_block,
    geometry,
    read_geo,
    run,
)
from cutsim.results.field_files import interpolate
from cutsim.results.grids import gather_grid
from cutsim.results.output import claim_folder
from cutsim.results.pictures import draw_body
from cutsim.results.plots import Curve, plot_curves, plot_energy
from cutsim.results.recording import Recording
from cutsim.studies.insertion_heat import Conductor, ThermalCut, heated
from cutsim.studies.insertion_work import audited_toughness, steady_force
from cutsim.studies.picture import draw_insertion, tool_surface

MESH = geometry("block")

# The four silicones of Table 5.1: Young's modulus [MPa], Poisson's ratio, strength of the interface [MPa].

SILICONES = {
    1: (0.777, 0.48, 0.61477),
    2: (0.527, 0.35, 0.34235),
    3: (0.813, 0.43, 0.79311),
    4: (0.723, 0.41, 0.59311),
}

# The blade of the thesis is a prism of 10.45 × 4.2 × 1.71 mm: its half angle is atan(0.855 / 4.2).

THICKNESS, HEIGHT, WIDTH = 1.71, 4.2, 10.1
HALF_ANGLE = float(np.arctan2(THICKNESS / 2, HEIGHT))

# Viscosity of the block [MPa s] at a cutting speed of 1 mm/s; its share of the work is in the audit.

VISCOSITY = 0.002

# ## Geometry, mesh size and steps of the settings
#
# The element size along the crack has to resolve the tip radius and 0.4 ε of the cohesive law.


@dataclass(frozen=True)
class Setting:
    """Mesh parameters, tip radius [mm], G_c [N/mm], depth of the cut [mm]."""

    mesh: dict[str, float]
    radius: float
    toughness: float
    depth: float


SETTINGS = {
    # (dim, quick)
    (2, False): Setting(dict(dim=2, Lx=4, H=13, lc=0.05, band=0.3, growth=1.4, notch=0.5), 0.05, 0.2, 8.6),
    (2, True): Setting(dict(dim=2, Lx=4, H=6, lc=0.1, band=0.4, notch=0.5), 0.1, 0.4, 2.0),
    (3, False): Setting(dict(dim=3, sym=1, lc=0.2, band=1.0, nz=8, notch=0.6), 0.2, 0.8, 3.4),
    (3, True): Setting(dict(dim=3, sym=1, lc=0.3, band=0.6, growth=1.6, nz=3, notch=0.6), 0.3, 0.8, 1.6),
}

# **Heat**, with `--heat`.  All work of friction and of fracture becomes heat, at a cutting speed of 1 mm/s and from
# room temperature [K].  The block has the thermal properties of silicone rubber in round numbers: density [t/mm³],
# specific heat [mJ/(t K)], conductivity [mW/(mm K)].  How friction heat is shared with the blade is a matter of both
# materials; here the block takes all of it, which is the upper bound of its temperature.

ROOM = 293.15
SILICONE = ThermalCut(Conductor(density=1.1e-9, capacity=1.3e9, conductivity=0.2), AdiabaticTool(share=1.0))

Summary = dict[str, float | list[float]]
History = dict[str, np.ndarray]


def main(
    dim: Annotated[int, typer.Option(min=2, max=3, help="2: tall block in plane strain; 3: the specimen")] = 3,
    material: Annotated[int, typer.Option(min=1, max=4, help="which silicone of the thesis")] = 1,
    toughness: Annotated[float | None, typer.Option(help="G_c in N/mm; 0.8 in 3-D, 0.2 in 2-D by default")] = None,
    friction: Annotated[
        list[float] | None, typer.Option(min=0.0, help="friction coefficient of blade and silicone; repeat for a sweep")
    ] = None,
    heat: Annotated[bool, typer.Option("--heat", help="temperature of the cut faces, with friction")] = False,
    depth: Annotated[float | None, typer.Option(help="depth of the cut in mm")] = None,
    coarser: Annotated[float, typer.Option(min=1, help="factor on the size of the elements along the crack")] = 1.0,
    quick: Annotated[bool, typer.Option("--quick", help="coarse and short")] = False,
    out: Annotated[Path, typer.Option(help="where the results go")] = Path("results/validation/blade"),
    overwrite: Annotated[bool, typer.Option("--overwrite", help="replace the results of an older run")] = False,
) -> None:
    """Push a rigid wedge blade through silicone."""
    level = logging.WARNING if MPI.COMM_WORLD.rank == 0 else logging.ERROR
    logging.basicConfig(level=level, format="%(name)s: %(message)s")
    claim_folder(out, MPI.COMM_WORLD, overwrite=overwrite)
    given = SETTINGS[dim, quick]
    setting = replace(given, toughness=toughness or given.toughness, depth=depth or given.depth)
    setting = replace(setting, mesh=setting.mesh | {"lc": coarser * setting.mesh["lc"]})
    domain = read_geo(MESH, MPI.COMM_WORLD, setting.mesh, gdim=dim)
    values = friction or [0.0]
    curves: list[Curve] = []
    try:
        for mu in values:
            folder = out if len(values) == 1 else out / f"mu_{mu:g}"
            summary = push(domain, setting, SILICONES[material], mu, folder, heat, curves)
            check(summary, mu, steady=dim == 2 and not quick and not mu and coarser == 1)
    finally:  # also what an interrupted sweep has come to
        if len(values) > 1 and MPI.COMM_WORLD.rank == 0:
            plot_curves(
                out / "friction.png",
                [replace(c, style=("-", "--")[i // 4 % 2]) for i, c in enumerate(curves)],
                xlabel="depth of the tip [mm]",
                ylabel="force on the blade [N]" if dim == 3 else "force per width [N/mm]",
                title="Blade cutting of silicone with friction",
            )


def push(
    domain: TaggedMesh,
    setting: Setting,
    silicone: tuple[float, float, float],
    friction: float,
    out: Path,
    heat: bool,
    curves: list[Curve],
) -> Summary:
    """One cut: run it, add its curve to the others, draw it, sum it up."""
    begun = time.perf_counter()
    young, poisson, strength = silicone
    dim = domain.mesh.geometry.dim
    law = Exponential(strength=strength, toughness=setting.toughness)
    forward, lateral = (0.0, -1.0, 0.0)[:dim], (1.0, 0.0, 0.0)[:dim]
    cut = Insertion.build(
        cracked_block(domain, NeoHookean(young, poisson), law, viscosity=VISCOSITY),
        Blade(HALF_ANGLE, setting.radius, THICKNESS / 2, forward, lateral),
        Drive(speed=1.0, entry_time=1.0),
        notch=setting.mesh["notch"],
        friction=friction,
    )
    problem = heated(cut, SILICONE, ROOM) if heat else cut.mechanics
    control = StepControl(first=0.02, largest=0.05 if friction else 0.1, smallest=1e-4, closure=5e-3)
    until = cut.time_of(setting.depth)
    with Recording(
        out,
        problem,
        until,
        title=f"blade, μ = {friction:g}" if friction else "blade",
        show={"depth": "depth", "force": "force"},
        extra=cut.columns,
        derived={"cauchy_stress": cut.body.solids[0].cauchy_stress(cut.state.u)},
    ) as recording:
        try:
            run(problem, until, control, recording)
        finally:
            depth, force = (recording.history.get(name, []) for name in ("depth", "force"))
            curves.append(Curve(depth, force, f"μ = {friction:g}", partial=not recording.complete))
    history = recording.columns()
    draw(cut, history, law, out, problem.fields.get("temperature"))
    summary = summarise(cut, history, law, time.perf_counter() - begun)
    if dim == 2:
        section = 2 * setting.mesh["Lx"] * young / (1 - poisson**2)
        summary["steady_force_per_width"] = steady_force(law.toughness, 1.0, section)
    recording.summary(summary)
    return summary


# ## Results


def summarise(cut: Insertion, history: History, law: Exponential, seconds: float) -> Summary:
    """Headline numbers of a run."""
    dim = cut.state.mesh.geometry.dim
    depth, force = history["depth"], history["force"]
    end = float(depth[-1])
    width = 1.0 if dim == 2 else WIDTH
    start = cut.motion.start_depth
    late = depth >= end - 0.5 * (end - start)
    summary: Summary = {
        "toughness_given": law.toughness,
        "toughness_in_the_books": audited_toughness(history, start + 0.4 * (end - start), end, cut.symmetry_factor),
        "mean_force_per_width_second_half": float(np.trapezoid(force[late], depth[late]) / np.ptp(depth[late])) / width,
        "largest_force": float(force.max()),
        "depth": end,
        "cut_area": float(history["cut"][-1]),
        "largest_closure": float(np.abs(history["energy_closure"]).max()),
        "largest_imbalance": float(history["imbalance"][depth > start].max()),
        "steps": len(depth),
        "rejected_steps": float(history["cuts"].sum()),
        "newton_iterations": float(history["newton"].sum()),
        "krylov_iterations": float(history["krylov"].sum()),
        "degrees_of_freedom": cut.state.V.dofmap.index_map.size_global * dim,
        "ranks": cut.state.mesh.comm.size,
        "seconds": seconds,
    }
    if "temperature_max" in history:
        summary["largest_heating"] = float(history["temperature_max"].max()) - ROOM
        summary["largest_heat_closure"] = float(np.abs(history["heat_closure"]).max())
    if cut.state.mesh.comm.rank == 0:
        for name, value in summary.items():
            typer.echo(f"{name:>34}  {value:.6g}")
    return summary


def draw(cut: Insertion, history: History, law: Exponential, out: Path, temperature: fem.Function | None) -> None:
    """Curves, energy audit and the cut body."""
    dim = cut.state.mesh.geometry.dim
    width = 1.0 if dim == 2 else WIDTH
    if cut.state.mesh.comm.rank == 0:
        expected = {"$G_c w$": law.toughness * width}
        plot_curves(
            out / "force.png",
            [Curve(history["depth"], history["force"], "force on the blade")],
            xlabel="depth of the tip [mm]",
            ylabel="force [N]" if dim == 3 else "force per width [N/mm]",
            title="Blade cutting of silicone",
            references=expected,
        )
        whole = {n: v * cut.symmetry_factor if n.startswith(("work", "energy")) else v for n, v in history.items()}
        whole["energy_closure"] = history["energy_closure"]
        plot_energy(out / "energy.png", whole, x="time", xlabel="way of the tool [mm]")
    view = {
        "tool": tool_surface(cut),
        "mirror": ("z",) if dim == 3 else (),
        "window": (-7.0, 7.0, -4.4, 1.5, -5.5, 5.5) if dim == 3 else (-4.2, 4.2, -cut.frame.height, 1.0, 0.0, 0.0),
    }
    draw_insertion(out / "cut.png", cut, **view)
    if temperature is not None:
        heating = fem.Function(fem.functionspace(cut.state.mesh, ("DG", 0)))
        interpolate(heating, temperature - ROOM)
        grid = gather_grid(cut.state.u, {"heating": heating})
        draw_body(out / "temperature.png", grid, "heating", label="temperature rise [K]", **view)


# With friction above the tangent of the half angle, 0.2, the faces stick to the blade and are dragged along.  Little is
# cut, and the energy that the audit leaves for the crack is then a small difference of large numbers.


def check(summary: Summary, friction: float, *, steady: bool) -> None:
    """The headline numbers, asserted."""
    given, booked = summary["toughness_given"], summary["toughness_in_the_books"]
    if friction < np.tan(HALF_ANGLE):
        assert abs(booked / given - 1) < 0.03, f"{booked} by the audit, given {given}"
    assert summary["largest_closure"] < 0.01
    assert summary["largest_imbalance"] < 1e-6
    assert summary.get("largest_heat_closure", 0.0) < 1e-6
    if steady:
        assert abs(summary["mean_force_per_width_second_half"] / summary["steady_force_per_width"] - 1) < 0.01


if __name__ == "__main__":
    typer.run(main)
