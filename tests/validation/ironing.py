# # Ironing
#
# A stiff die with a round face is pressed into a soft slab and drawn along it over twice its width.  The meshes do not
# match: facets of the die pass over those of the slab, and the pairs in contact change in every step.  A contact
# between nodes and facets shows this as ripple in the forces; here forces come from an integral over the slab's face,
# and each of its points meets the die along its own normal.
#
# ## What theory says
#
# Far from the ends of the slab nothing changes while the die is drawn at a constant depth.  Hence
#
# - both forces are constant; any ripple comes from the mesh and vanishes with the size of its elements;
# - without friction the drag is zero, as the slab is elastic and recovers;
# - with friction $\mu$ all work of the drag is friction work, $F\,\dot s = \dot D$, and $F \approx \mu N$.
#
# ## The problem
#
# Plane strain, per millimetre of width.  The slab of 12 × 2 mm is neo-Hookean, $E$ = 1 MPa, $\nu$ = 0.3, and held at
# its bottom; the die, a thousand times as stiff, has a face of radius 2 mm over a chord of 2.4 mm and is moved by its
# top: 0.2 mm down, a tenth of the slab, and 4 mm along, in steps of an eighth of an element.  Its facets are 1.3 times
# as long as those of the slab.
#
# The ripple is the difference between the largest and the smallest force, without the first millimetre, over the mean
# normal force.  For the drag with friction it is taken over its own mean.

import logging
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from dolfinx import fem
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim import (
    Coulomb,
    Mechanics,
    NeoHookean,
    Solid,
    State,
    StepControl,
    Support,
    SurfacePair,
    geometry,
    read_geo,
    run,
)
from cutsim.base.compat import nodal_expression
from cutsim.results.grids import gather_grid
from cutsim.results.output import claim_folder, write_summary
from cutsim.results.pictures import draw_body
from cutsim.results.plots import Curve, plot_curves
from cutsim.results.recording import Columns, Recording

MESH = geometry("ironing")
COMM = MPI.COMM_WORLD
SLAB, DIE = NeoHookean(1.0, 0.3), NeoHookean(1000.0, 0.3)  # [MPa]
RADIUS, HALF_CHORD = 2.0, 1.2  # of the die's face [mm]
Array = NDArray[np.float64]
# time counts steps; full Newton steps follow the sliding best
CONTROL = StepControl(first=1.0, largest=1.0, line_searches=("basic", "l2", "bt"))


@dataclass(frozen=True)
class Ironing:
    """Mesh and friction of slab and die, and how far the die goes."""

    size: float  # elements at the face of the slab [mm]
    friction: float = 0.0
    ratio: float = 1.3  # length of the facets of the die to those of the slab
    depth: float = 0.2  # [mm]
    draw: float = 4.0  # [mm]
    pressing: int = 10  # steps
    steps: int = 8  # while the die passes over an element
    settled: float = 1.0  # way after which forces are to be constant [mm]

    @property
    def facets(self) -> int:
        """Of the face of the die."""
        return round(2 * RADIUS * np.arcsin(HALF_CHORD / RADIUS) / (self.ratio * self.size))

    @property
    def until(self) -> float:
        """Time at the end."""
        return self.pressing + self.draw / self.size * self.steps

    def press(self, time: float) -> float:
        """Displacement of the die down into the slab [mm]."""
        return -self.depth * min(time / self.pressing, 1.0)

    def way(self, time: float) -> float:
        """Displacement of the die along the slab [mm]."""
        return self.size / self.steps * max(time - self.pressing, 0.0)


@dataclass(frozen=True)
class Bodies:
    """Slab and die as a mechanical problem."""

    state: State
    solids: tuple[Solid, Solid]
    mechanics: Mechanics

    @classmethod
    def build(cls, ironing: Ironing, comm: MPI.Comm = COMM) -> "Bodies":
        """Mesh both and put the terms together."""
        shape = dict(h=ironing.size, nd=ironing.facets, R=RADIUS, W=HALF_CHORD)
        domain = read_geo(MESH, comm, shape, gdim=2)
        state = State(fem.functionspace(domain.mesh, ("Lagrange", 1, (2,))))
        slab = Solid(state, SLAB, domain.cells("slab"), name="slab")
        die = Solid(state, DIE, domain.cells("die"), name="die")
        friction = Coulomb(ironing.friction) if ironing.friction else None
        faces = domain.facets("track"), domain.facets("face")
        pair = SurfacePair(state, *faces, young=SLAB.young, friction=friction)
        top, bottom = domain.facets("top"), domain.facets("bottom")
        supports = [
            Support(state, top, 0, ironing.way, corners=(ironing.pressing,), name="drag"),
            Support(state, top, 1, ironing.press, name="press"),
            *(Support(state, bottom, i) for i in range(2)),
        ]
        return cls(state, (slab, die), Mechanics(state, [slab, die, pair], supports))


def columns(columns: Columns) -> Columns:
    """Way of the die, and the forces on it."""
    return {
        "way": (columns["drag_displacement"][0], "length"),
        "normal": (-columns["press_force"][0], "force"),
        "drag": (columns["drag_force"][0], "force"),
    }


# ## Pressing and drawing


def iron(ironing: Ironing, out: Path) -> dict[str, Array]:
    """Press and draw, with what is recorded and a picture at the end. Collective."""
    bodies = Bodies.build(ironing)
    title = f"friction {ironing.friction:g}, elements of {ironing.size:g} mm"
    with (
        bodies.mechanics.problem,
        Recording(
            out,
            bodies.mechanics,
            ironing.until,
            title=title,
            show={"normal": "normal", "drag": "drag"},
            extra=columns,
            every=20,
        ) as recording,
    ):
        run(bodies.mechanics, ironing.until, CONTROL, recording)
    draw(bodies, out / "body.png", f"Ironing, {title}")
    history = recording.columns()
    return history


def forces(ironing: Ironing, history: dict[str, Array]) -> dict[str, float]:
    """Means and ripple of the forces at constant speed, and the balance of work."""
    steady = history["way"] > ironing.settled
    normal, drag = history["normal"][steady], history["drag"][steady]
    way, friction = history["way"][steady], history["energy_friction"][steady]
    work = np.sum(0.5 * (drag[1:] + drag[:-1]) * np.diff(way))
    rubbed = np.ptp(friction)
    return {
        "normal": float(normal.mean()),
        "drag": float(drag.mean()),
        "drag_over_normal": float(drag.mean() / normal.mean()),
        "ripple_of_normal": float(np.ptp(normal) / normal.mean()),
        "ripple_of_drag": float(np.ptp(drag) / (drag.mean() if ironing.friction else normal.mean())),
        **({"friction_over_work": float(rubbed / work)} if ironing.friction else {}),
        "energy_closure": float(np.abs(history["energy_closure"]).max()),
        "largest_penetration": float(history["pair_penetration"].max()),
        "iterations": float(history["newton"].mean()),
        "cuts": float(history["cuts"].sum()),
        "steps": len(way),
    }


# ## Pictures


def draw(bodies: Bodies, path: Path, title: str) -> None:
    """The bodies with their vertical stress. Collective."""
    space = fem.functionspace(bodies.state.mesh, ("DG", 0))
    stress = fem.Function(space)
    for solid in bodies.solids:
        vertical = solid.cauchy_stress(bodies.state.u)[1, 1]
        stress.interpolate(nodal_expression(vertical, space), solid.cells)
    body = gather_grid(bodies.state.u, {"stress": stress})
    draw_body(path, body, "stress", label="vertical stress [MPa]", title=title)


def plot_forces(histories: dict[float, dict[str, Array]], out: Path, friction: float) -> None:
    """Both forces over the way, for all sizes of elements. Call it on one rank."""
    for name, label in {"normal": "normal force", "drag": "drag"}.items():
        curves = [Curve(h["way"], h[name], f"elements of {size:g} mm") for size, h in histories.items()]
        plot_curves(
            out / f"{name}_{friction:g}.png",
            curves,
            xlabel="way [mm]",
            ylabel=f"{label} per width [N/mm]",
            title=f"Ironing, friction {friction:g}",
        )


def plot_ripple(results: dict[str, dict[str, float]], sizes: tuple[float, ...], path: Path) -> None:
    """Ripple against the size of the elements. Call it on one rank."""
    curves = [
        Curve(sizes, [100 * results[f"{mu:g}, {size:g} mm"][f"ripple_of_{force}"] for size in sizes], label, style)
        for mu, colour in zip(FRICTIONS, ("C0", "C1"), strict=True)
        for force, line in (("normal", "o-"), ("drag", "o--"))
        for label, style in [(f"{force}, friction {mu:g}", colour + line)]
    ]
    plot_curves(
        path, curves, xlabel="elements [mm]", ylabel="ripple [%]", title="Ripple of the forces at constant speed"
    )


# ## The study

FRICTIONS = (0.0, 0.3)
SIZES = (0.4, 0.2, 0.1)


def check(results: dict[str, dict[str, float]], sizes: tuple[float, ...]) -> None:
    """The headline numbers."""
    for mu in FRICTIONS:
        study = [results[f"{mu:g}, {size:g} mm"] for size in sizes]
        for result in study:
            assert result["energy_closure"] < 0.02 and result["cuts"] == 0
            assert abs(result["drag_over_normal"] - mu) < 0.01
        assert study[-1]["energy_closure"] < 5e-3
        for force in ("normal", "drag"):
            ripples = [result[f"ripple_of_{force}"] for result in study]
            assert ripples[-1] < 0.05 and all(b < 0.6 * a for a, b in pairwise(ripples)), ripples
        if mu:
            assert abs(study[-1]["friction_over_work"] - 1) < 5e-3


def main(
    quick: Annotated[bool, typer.Option("--quick", help="without the finest mesh, a shorter way")] = False,
    out: Annotated[Path, typer.Option(help="where the results go")] = Path("results/validation/ironing"),
    overwrite: Annotated[bool, typer.Option("--overwrite", help="replace the results of an older run")] = False,
) -> None:
    """Press a die into a slab, draw it along, and see how smooth the forces are."""
    level = logging.WARNING if COMM.rank == 0 else logging.ERROR
    logging.basicConfig(level=level, format="%(name)s: %(message)s")
    claim_folder(out, COMM, overwrite=overwrite)
    sizes, results = SIZES[:2] if quick else SIZES, {}
    for mu in FRICTIONS:
        histories = {}
        for size in sizes:
            ironing = Ironing(size, mu, draw=2.6 if quick else 4.0)
            histories[size] = iron(ironing, out / f"friction_{mu:g}_size_{size:g}")
            results[f"{mu:g}, {size:g} mm"] = forces(ironing, histories[size])
        if COMM.rank == 0:
            plot_forces(histories, out, mu)
    write_summary(out / "summary.json", results, COMM)
    if COMM.rank == 0:
        plot_ripple(results, sizes, out / "ripple.png")
        for name, result in results.items():
            print(f"friction {name}")
            for key, value in result.items():
                print(f"{key:>24} {value:.6g}")
    check(results, sizes)


if __name__ == "__main__":
    typer.run(main)
