# # Frictional heating
#
# A block of 10 × 10 × 10 mm is pressed on a slab of 100 × 10 × 10 mm and slid on it.  The work of friction becomes heat
# in the interface and flows into both bodies at a rate set by the pressure.  All surfaces but the contact are
# insulated.
#
# ## What theory says
#
# Under a uniform pressure $p$, friction $\mu$ and at the speed $v$, the interface generates $D = \mu p v$ per area.
# No heat is lost.  The mean temperature of block, slab (masses $m$, specific heat $c$) and an interface of area $A$ and
# capacity $C_c$, weighted by their capacities, has therefore risen by
#
# $$ \Delta\bar T = \frac{\int D A\,\mathrm{d}t}{\sum m c + C_c A}
#    = \frac{\mu p A\,(s - n\,\mu p/\varepsilon_T)}{\sum m c + C_c A} $$
#
# after a sliding distance $s$.  The penalty $\varepsilon_T$ that holds the faces till they slip takes
# $\mu p/\varepsilon_T$ of the first stroke, and twice that of each that follows: $n = 1, 3, 5\dots$ after 1, 2, 3…
# strokes.
#
# **Steady heat flow.**  Two slabs with $\kappa_i = k_i/h_i$ of conductivity and thickness, their outer faces kept at
# $T_1$ and $T_2$, exchange heat through $\gamma_1 p$ and $\gamma_2 p$ in series: a flux and two faces with
#
# $$ q = \frac{T_1 - T_2}{\frac{1}{\kappa_1} + \frac{1}{\gamma_1 p} + \frac{1}{\gamma_2 p} + \frac{1}{\kappa_2}}, \qquad
#    T_{c1} = T_1 - \frac{q}{\kappa_1}, \quad T_{c2} = T_2 + \frac{q}{\kappa_2} . $$
#
# For equal slabs these are the temperatures (4.133) of K. Bronik's thesis, which prints the two with their names
# exchanged: $T_{c1} = [\gamma p\,T_2 + (2\kappa + \gamma p)\,T_1]/(2\kappa + 2\gamma p)$.  A conductance $\kappa$ is
# meant there, though the table gives a conductivity.
#
# **Sharing.**  Where both faces have the same temperature, $q^\pm = -\gamma^\pm D/(\gamma^+ + \gamma^-)$.
#
# **Heating of a column**, the slab no longer than the block, is a problem in one dimension.  The mean of the two
# temperatures is that of a slab of thickness $h$ with the flux $D/2$ on one face; half their difference is that of a
# slab in surroundings of the temperature $\vartheta = (\gamma^+ - \gamma^-) D / (4 \gamma^+\gamma^- p)$ with the film
# coefficient $2 \gamma^+\gamma^- p/(\gamma^+ + \gamma^-)$.  Both are classical series (Carslaw and Jaeger 1959, §3.8
# and §3.11), with $F = k t/(\rho c h^2)$ and $\zeta \tan\zeta = B = 2 \gamma^+\gamma^- p h/((\gamma^+ + \gamma^-) k)$:
#
# $$ \frac{T^+ + T^-}{2} = \frac{D h}{2 k}\left[F + \frac13 - \frac{2}{\pi^2}\sum_n \frac{e^{-n^2\pi^2 F}}{n^2}\right],
#    \qquad \frac{T^+ - T^-}{2} = \vartheta\left[1 - \sum_\zeta
#    \frac{2 B\,e^{-\zeta^2 F}}{\zeta^2 + B^2 + B}\right]. $$
#
# While the faces stick after a turn nothing is generated; the series are added up accordingly.
#
# ## What is computed
#
# *thesis*: Tables 4.4 and 4.8, in mm, N, MPa, s, tonne and mJ.
#
# | table | taken as |
# |---|---|
# | $E$ = 5.10 MPa (4.4), 5·10⁷ MPa (4.8, more than forty times diamond), $\nu$ = 0.48 | 5.1 MPa |
# | $\mu$ = 0.1, $\varepsilon_T$ = 0.1 | 0.1 MPa/mm: the faces stick over $\mu p/\varepsilon_T$ = 0.1 mm |
# | $k$ = 100 N/(s K) | 100 mW/(mm K) |
# | $h$ = 1.0 W N⁻¹ K⁻¹ | $\gamma^\pm$ = 1000 mW/(N K) |
# | $C_c$ = 100 m²/(s² K), per area, in the unit of a specific heat | $C_c$ = 100 mJ/(mm² K), $c$ = 10⁸ mJ/(t K) |
# | density 1, its unit is illegible | 1 t/m³ |
# | $T_0$ = 0 °C, 10 steps of 0.1 | 0 °C; 10 steps of 0.1 s and 0.1 mm |
# | pressure: not given | 0.1 MPa |
#
# These numbers do not make a realistic problem.  An interface of that capacity equals a layer of the bodies one metre
# thick and keeps 95 % of the heat.  The 0.9 mJ of the slide warm everything by 0.08 mK; without the interface they
# would warm the bodies by 0.8 mK.  Conductivity is that of a metal, stiffness and pressure those of rubber.
#
# *column*: two blocks of steel under 100 MPa, rubbed back and forth over one millimetre at 10 mm/s.  The contact
# conducts 15 mW/(mm² K), as ground steel does; its slab side three times as well as its block side.  Asperities give by
# 1 µm before they slip.  *steel*: the same on the long slab.
#
# In *thesis* and *column* the pressure is uniform: the slab is fixed at every node, and the block in a holder that
# leaves it free to be compressed only.  This is what the closed forms need; the slab's modulus then does nothing, and
# that of the block only says how far it is pressed in.  In *steel* both are elastic, the top of the block is moved and
# the bottom of the slab held; pressed in as far as in *column*, it bears half the load, and its front and rear edges
# press most.  All strokes are shorter than an element, for which contact with small sliding is made.

import logging
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import _sliding_heat
import numpy as np
import typer
from _sliding_heat import SOFT_ON_SOFT, STEEL_ON_STEEL, Rubbed, plot_heat, show
from dolfinx import fem
from mpi4py import MPI
from numpy.typing import NDArray
from scipy.optimize import brentq

from cutsim import (
    ContactHeat,
    Crack,
    CrackFriction,
    HeatBody,
    HeatTransfer,
    InterfaceHeat,
    Mechanics,
    PrescribedTemperature,
    Solid,
    State,
    StepControl,
    Support,
    TaggedMesh,
    Temperature,
    ThermoMechanics,
    cracked_space,
    geometry,
    read_geo,
    run,
)
from cutsim.base.kinematics import displacement_jump
from cutsim.base.units import Units
from cutsim.results.field_files import interpolate
from cutsim.results.grids import gather_grid
from cutsim.results.output import claim_folder, write_summary
from cutsim.results.pictures import draw_body
from cutsim.results.plots import Curve, plot_curves
from cutsim.results.recording import Columns, Recording

MESH = geometry("blocks")
COMM = MPI.COMM_WORLD
SIDE = 10.0  # of the block, width and height of the slab [mm]
AREA = SIDE**2
ABSOLUTE_ZERO = -273.15  # [°C]


@dataclass(frozen=True)
class Pair(Rubbed):
    """Block and slab, and how they are rubbed; '+' of their contact is the slab."""

    stroke: float = 1.0  # [mm]
    strokes: int = 1  # there and back are two
    steps: int = 10  # of a stroke
    slab: float = 100.0  # length [mm]
    uniform: bool = True  # pressure
    elements: int = 4  # along the block
    layer: float = 1.0  # height of the elements at the contact [mm]
    growth: float = 1.3  # ratio of the sizes of neighbouring elements away from it

    @property
    def step(self) -> float:
        """Time of a step, and of pressing [s]."""
        return self.stroke / self.speed / self.steps

    @property
    def stick(self) -> float:
        """Time for which the faces stick when sliding begins, twice as long after a turn [s]."""
        return self.elastic_slip / self.speed

    @property
    def turns(self) -> NDArray[np.float64]:
        """Times at which a stroke begins or ends [s]."""
        return self.step * (1 + self.steps * np.arange(self.strokes + 1))

    @property
    def corners(self) -> tuple[float, ...]:
        """Times at which the force has a kink: turns, and where the faces begin to slip [s]."""
        slips = self.turns[:-1] + np.where(np.arange(self.strokes) == 0, 1, 2) * self.stick
        return tuple(sorted({*self.turns, *slips}))

    @property
    def control(self) -> StepControl:
        """Steps that grow from the time of sticking."""
        return StepControl(first=min(self.stick, self.step), largest=self.step, growth=2.0, easy=20)

    def position(self, time: float) -> float:
        """Displacement of the block along the slab [mm]."""
        return float(np.interp(time, self.turns, self.stroke * (np.arange(self.strokes + 1) % 2)))

    def press(self, time: float, depth: float) -> float:
        """Displacement of the top of the block [mm]."""
        return -depth * min(time / self.step, 1.0)

    @property
    def heat_capacities(self) -> NDArray[np.float64]:
        """Of slab, block and interface [mJ/K]."""
        volumes = AREA * np.array([self.slab, SIDE])
        return np.append(self.density * self.capacity * volumes, self.contact.capacity * AREA)

    def slipped(self, way: float) -> float:
        """Part of a way on which the faces do not stick [mm]."""
        return way - (2 * self.strokes - 1) * self.stick * self.speed


# ## The problem


def supports(pair: Pair, state: State, domain: TaggedMesh, depth: float) -> list[Support]:
    """Press the block in and slide it; for uniform pressure in a holder, on a slab that is fixed everywhere."""
    moved = (domain.cells("upper"), 3) if pair.uniform else (domain.facets("top"), 2)
    fixed = (domain.cells("lower"), 3) if pair.uniform else (domain.facets("bottom"), 2)
    return [
        Support(state, moved[0], 0, pair.position, dim=moved[1], name="drive", corners=pair.corners),
        Support(state, moved[0], 2, dim=moved[1]),
        Support(state, domain.facets("top"), 1, lambda t: pair.press(t, depth), name="press"),
        *(Support(state, fixed[0], i, dim=fixed[1]) for i in range(3)),
    ]


def bodies(pair: Pair, temperature: Temperature, domain: TaggedMesh) -> list[HeatBody]:
    """Slab and block, to see the mean temperature of each."""
    properties = dict(capacity=pair.capacity, conductivity=pair.conductivity, density=pair.density)
    groups = {"slab": domain.cells("lower"), "block": domain.cells("upper")}
    return [HeatBody(temperature, body=cells, name=name, **properties) for name, cells in groups.items()]


@dataclass(frozen=True)
class Rubbing:
    """Mechanics and heat of a pair."""

    pair: Pair
    state: State
    crack: Crack
    temperature: Temperature
    contact: InterfaceHeat
    problem: ThermoMechanics
    jump: Callable[[], dict[str, NDArray[np.float64]]]  # of the displacement, at the points of the crack

    @classmethod
    def build(cls, pair: Pair, held: dict[str, float] | None = None, comm: MPI.Comm = COMM) -> "Rubbing":
        """Put the terms together.

        Args:
            pair: What is rubbed.
            held: Temperature of groups of facets that are not insulated [°C].
            comm: Communicator.
        """
        shape = dict(B=SIDE, H=SIDE, L=pair.slab, nx=pair.elements, ly=pair.layer, growth=pair.growth)
        domain = read_geo(MESH, comm, shape)
        facets, slab = domain.facets("crack"), domain.cells("lower")
        state = State(cracked_space(domain.mesh, ("Lagrange", 1, (3,)), facets))
        scalar = cracked_space(domain.mesh, ("Lagrange", 1), facets)
        temperature = Temperature(state, scalar, 0.0, absolute_zero=ABSOLUTE_ZERO)
        solid = Solid(state, pair.material, density=pair.density)
        crack = Crack(state, facets, slab, young=pair.material.young, name="contact", normal="reference")
        friction = CrackFriction(crack, pair.friction)
        contact = InterfaceHeat(temperature, crack, pair.contact, friction, name="interface")
        depth = pair.pressure * (SIDE / pair.confined_modulus + 1 / crack.contact.stiffness)

        mechanics = Mechanics(state, [solid, crack, friction], supports(pair, state, domain, depth))
        kept = [
            PrescribedTemperature(temperature, domain.facets(group), value, name=group)
            for group, value in (held or {}).items()
        ]
        heat = HeatTransfer(temperature, [*bodies(pair, temperature, domain), contact], kept)
        jump = crack.points.evaluator({"jump": displacement_jump(state.u)})
        return cls(pair, state, crack, temperature, contact, ThermoMechanics(mechanics, heat), jump)

    def columns(self, columns: Columns) -> Columns:
        """Load, mean sliding of the faces, and mean temperatures of the faces and between them. Collective."""
        points, exchange = self.crack.points, self.contact.exchange
        names = {"slab_face": "temperature_plus", "block_face": "temperature_minus", "interface": "temperature"}
        means = {name: points.integral(exchange.point_values(value)) / AREA for name, value in names.items()}
        return {
            "load": (-columns["press_force"][0], "force"),
            "slide": (points.integral(self.jump()["jump"][..., 0]) / AREA, "length"),
            **{name: (value, "temperature") for name, value in means.items()},
        }


# ## Closed forms


def response(pair: Pair, time: NDArray[np.float64]) -> NDArray[np.float64]:
    """Temperatures of the faces of slab and block of equal length, after a time of constant heating [°C]."""
    k, p, D = pair.conductivity, pair.pressure, pair.generation
    plus, minus = pair.contact.gamma_plus * p, pair.contact.gamma_minus * p
    F = k * np.maximum(time, 0.0) / (pair.density * pair.capacity * SIDE**2)
    n = np.arange(1, 2000)[:, None]
    mean = D * SIDE / (2 * k) * (F + 1 / 3 - 2 / np.pi**2 * np.sum(np.exp(-((n * np.pi) ** 2) * F) / n**2, axis=0))
    B = 2 * plus * minus / (plus + minus) * SIDE / k
    starts = np.pi * np.arange(2000)
    zeta = np.array([[brentq(lambda z: z * np.sin(z) - B * np.cos(z), m, m + np.pi / 2)] for m in starts])
    left = np.sum(2 * B / (zeta**2 + B**2 + B) * np.exp(-(zeta**2) * F), axis=0)
    half = (plus - minus) * D / (4 * plus * minus) * (1 - left)
    return np.where(F > 0, [mean + half, mean - half], 0.0)


def faces_of_column(pair: Pair, time: NDArray[np.float64]) -> NDArray[np.float64]:
    """Temperatures of the faces of slab and block of equal length; heat is generated where they slip [°C]."""
    kinks = np.setdiff1d(pair.corners, [pair.step])  # slip, turn, slip, turn, …
    signs = np.where(np.isin(kinks, pair.turns), -1.0, 1.0)
    return sum(sign * response(pair, time - kink) for sign, kink in zip(signs, kinks, strict=True))


def steady_slabs(
    outer: tuple[float, float], kappa: tuple[float, float], conductance: tuple[float, float]
) -> tuple[float, float, float]:
    """Flux from the first to the second slab, and the temperatures of their faces.

    Args:
        outer: Temperatures of the outer faces.
        kappa: Conductivity over thickness of both.
        conductance: γ p of both.
    """
    q = (outer[0] - outer[1]) / sum(1 / c for c in (*kappa, *conductance))
    return q, outer[0] - q / kappa[0], outer[1] + q / kappa[1]


# ## Heat flow without sliding, and sharing


def steady(pair: Pair, comm: MPI.Comm = COMM) -> dict[str, float]:
    """Heat flow between outer faces at 100 and 0 °C against the closed form. Collective."""
    still = replace(pair, slab=SIDE, strokes=0)
    outer = (100.0, 0.0)
    rubbing = Rubbing.build(still, {"bottom": outer[0], "top": outer[1]}, comm)
    problem, exchange = rubbing.problem, rubbing.contact.exchange
    with problem.mechanics.problem, problem.heat.problem:
        run(problem, still.step, StepControl.fixed(still.step))
        run(problem, 1e12, StepControl.fixed(1e12))  # in which everything has settled
        values = {name: exchange.point_values(name) for name in ("flux_plus", "temperature_plus", "temperature_minus")}
    p, k = still.pressure, still.conductivity
    thinner = 1 - p / still.confined_modulus  # the block, compressed in its holder
    conductance = (still.contact.gamma_plus * p, still.contact.gamma_minus * p)
    theory = steady_slabs(outer, (k / SIDE, k / (SIDE * thinner)), conductance)
    points = rubbing.crack.points

    def furthest(found: NDArray[np.float64], expected: float, scale: float) -> float:
        return points.maximum(np.abs(found - expected)) / scale

    flux, plus, minus = values.values()
    return {
        "flux": points.integral(flux) / AREA,
        "flux_of_theory": theory[0],
        "faces": [points.integral(face) / AREA for face in (plus, minus)],
        "faces_of_theory": theory[1:],
        "flux_error": furthest(flux, theory[0], theory[0]),
        "jump_error": furthest(plus - minus, theory[1] - theory[2], theory[1] - theory[2]),
        "face_error": max(furthest(plus, theory[1], outer[0]), furthest(minus, theory[2], outer[0])),
    }


def sharing(pair: Pair, comm: MPI.Comm = COMM) -> dict[str, float]:
    """Ratio of the heat flows into slab and block while their faces are kept cold. Collective."""
    short = replace(pair, slab=SIDE, strokes=1)
    rubbing = Rubbing.build(short, {"crack": 0.0}, comm)
    with rubbing.problem.mechanics.problem, rubbing.problem.heat.problem:
        report = run(rubbing.problem, short.turns[-1], short.control)
    flows = [report.columns[f"interface_heat_flow_{side}"][0] for side in ("plus", "minus")]
    return {
        "ratio": flows[0] / flows[1],
        "ratio_of_theory": short.contact.gamma_plus / short.contact.gamma_minus,
        "heat_flow": -sum(flows),
        "heat_flow_of_theory": short.generation * AREA,
    }


# ## Rubbing


def rub(pair: Pair, name: str, out: Path) -> tuple[Rubbing, dict[str, NDArray[np.float64]]]:
    """Press and slide, with what is recorded. Collective."""
    rubbing = Rubbing.build(pair)
    problem, until = rubbing.problem, float(pair.turns[-1])
    with (
        problem.mechanics.problem,
        problem.heat.problem,
        Recording(
            out,
            problem,
            until,
            title=name,
            units=Units(temperature="°C"),
            show={"slide": "slide", "interface": "interface"},
            extra=rubbing.columns,
        ) as recording,
    ):
        run(problem, until, pair.control, recording)
    history = recording.columns()
    return rubbing, history


def balance(rubbing: Rubbing, history: dict[str, NDArray[np.float64]]) -> dict[str, float]:
    """Heat and work of friction against theory."""
    pair, capacities = rubbing.pair, rubbing.pair.heat_capacities
    way = np.abs(np.diff(history["slide"]))
    load = 0.5 * (history["load"][1:] + history["load"][:-1])
    work = pair.friction.mu * float(load @ way) * pair.slipped(way.sum()) / way.sum()
    closed = pair.generation / pair.speed * AREA * pair.slipped(pair.stroke * pair.strokes)
    of_theory = {
        "load_of_uniform_pressure": pair.pressure * AREA,
        "mean_rise_of_uniform_pressure": closed / float(capacities.sum()),
    }
    return {
        **_sliding_heat.balance(history, capacities),
        "mu_N_s": work,
        **(of_theory if pair.uniform else {}),
        "interface_part_of_capacity": float(capacities[2] / capacities.sum()),
        "slab_face_rise": float(history["slab_face"][-1]),
        "block_face_rise": float(history["block_face"][-1]),
    }


def faces(pair: Pair, history: dict[str, NDArray[np.float64]]) -> dict[str, float]:
    """Temperatures of the faces of a column against the series."""
    theory = faces_of_column(pair, history["time"])
    slid = history["time"] >= pair.turns[1]
    errors = [
        np.abs(history[name][slid] / series[slid] - 1).max()
        for name, series in zip(("slab_face", "block_face"), theory, strict=True)
    ]
    return {"slab_face_of_theory": theory[0][-1], "block_face_of_theory": theory[1][-1], "face_error": max(errors)}


# ## Pictures


def travelled(history: dict[str, NDArray[np.float64]]) -> NDArray[np.float64]:
    """Way of the faces so far [mm]."""
    return np.append(0.0, np.cumsum(np.abs(np.diff(history["slide"]))))


def draw(rubbing: Rubbing, history: dict[str, NDArray[np.float64]], out: Path, title: str) -> None:
    """Temperature of the bodies, and what became of the work of friction. Collective."""
    cells = fem.Function(fem.functionspace(rubbing.state.mesh, ("DG", 0)))
    interpolate(cells, rubbing.temperature.value)
    body = gather_grid(rubbing.state.u, {"temperature": cells})
    limits = (0.0, rubbing.temperature.maximum())
    draw_body(out / "temperature.png", body, "temperature", label="temperature [°C]", title=title, limits=limits)
    if COMM.rank:
        return
    labels = {"xlabel": "time [s]", "ylabel": "heat [mJ]", "title": title}
    plot_heat(out / "heat.png", history, rubbing.pair.heat_capacities, "time", **labels)


def draw_faces(pair: Pair, history: dict[str, NDArray[np.float64]], path: Path) -> None:
    """Temperatures of both faces of the column against the way, with the series. Call it on one rank."""
    way, theory = travelled(history), faces_of_column(pair, history["time"])
    curves = []
    for number, (name, series) in enumerate(zip(("slab", "block"), theory, strict=True)):
        curves.append(Curve(way[::8], history[f"{name}_face"][::8], f"face of the {name}", f"C{number}o"))
        curves.append(Curve(way, series, f"face of the {name}, series", f"C{number}-"))
        curves.append(Curve(way, history[f"{name}_temperature"], f"{name}, mean", f"C{number}:"))
    title = "Column of steel, rubbed back and forth"
    plot_curves(path, curves, xlabel="way [mm]", ylabel="temperature [°C]", title=title)


# ## The run

THESIS = Pair(**SOFT_ON_SOFT)
STEEL = Pair(
    **STEEL_ON_STEEL,
    contact=ContactHeat(0.6, 0.2),
    strokes=10,
    uniform=False,
    elements=5,
    layer=0.5,
)
COLUMN = replace(STEEL, slab=SIDE, uniform=True, elements=1, layer=0.1, growth=1.1, steps=20)


def pairs(coarser: int, *, quick: bool) -> dict[str, Pair]:
    """What is rubbed, by name."""
    if not quick:
        return {
            name: replace(pair, steps=pair.steps // coarser, layer=pair.layer * coarser)
            for name, pair in {"thesis": THESIS, "steel": STEEL, "column": COLUMN}.items()
        }
    return {
        "thesis": replace(THESIS, elements=3, layer=2.0),
        "steel": replace(STEEL, elements=3, layer=2.0, strokes=3, steps=4),
        "column": replace(COLUMN, strokes=4, steps=10),
    }


def check(results: dict[str, dict[str, float]]) -> None:
    """The headline numbers."""
    for name in ("thesis", "steel", "column"):
        result = results[name]
        assert abs(result["heat_kept_over_friction"] - 1) < 1e-6, name
        assert result["heat_closure"] < 1e-9 and result["energy_closure"] < 1e-2, name
        assert result["least_contact_dissipation"] > -1e-12, name
        assert abs(result["friction"] / result["mu_N_s"] - 1) < (5e-3 if name == "steel" else 1e-6), name
    for name in ("thesis", "column"):
        result = results[name]
        assert abs(result["load"] / result["load_of_uniform_pressure"] - 1) < 1e-6, name
        assert abs(result["mean_rise"] / result["mean_rise_of_uniform_pressure"] - 1) < 0.005, name
        steady_state = results[f"{name}_steady"]
        assert max(steady_state[f"{kind}_error"] for kind in ("flux", "jump", "face")) < 1e-6, name
    assert results["column"]["face_error"] < 0.02
    shared = results["sharing"]
    assert abs(shared["ratio"] / shared["ratio_of_theory"] - 1) < 1e-6
    assert abs(shared["heat_flow"] / shared["heat_flow_of_theory"] - 1) < 1e-6


def main(
    coarser: Annotated[int, typer.Option(min=1, help="factor on the height of elements and on the steps")] = 1,
    quick: Annotated[bool, typer.Option("--quick", help="coarser, with fewer strokes")] = False,
    out: Annotated[Path, typer.Option(help="where the results go")] = Path("results/validation/frictional_heating"),
    overwrite: Annotated[bool, typer.Option("--overwrite", help="replace the results of an older run")] = False,
) -> None:
    """Rub a block on a slab and compare the heat with closed forms."""
    level = logging.WARNING if COMM.rank == 0 else logging.ERROR
    logging.basicConfig(level=level, format="%(name)s: %(message)s")
    claim_folder(out, COMM, overwrite=overwrite)
    results = {}
    for name, pair in pairs(coarser, quick=quick).items():
        rubbing, history = rub(pair, name, out / name)
        results[name] = balance(rubbing, history)
        draw(rubbing, history, out / name, f"Frictional heating: {name}")
        if pair.slab == SIDE:
            results[name] |= faces(pair, history)
            if COMM.rank == 0:
                draw_faces(pair, history, out / "faces.png")
        if pair.uniform:
            results[f"{name}_steady"] = steady(pair)
    results["sharing"] = sharing(COLUMN)
    write_summary(out / "summary.json", results, COMM)
    if COMM.rank == 0:
        show(results)
    check(results)


if __name__ == "__main__":
    typer.run(main)
