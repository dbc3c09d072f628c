# # A sliding block and its hot spot
#
# A block of 10 mm is pressed on a slab of 100 mm and slides over 60 mm of it.  Friction heats both, and the hot spot
# travels along the slab.  The meshes have no node in common: in every step, each point of the block's face finds its
# partner on the slab and gives it its share of the heat.
#
# ## What theory says
#
# All surfaces but the contact are insulated, so no heat is lost.  Under a uniform pressure $p$, friction $\mu$ and
# after a sliding distance $s$, block, slab (masses $m$, specific heat $c$) and an interface of area $A$ and capacity
# $C_c$ have warmed by
#
# $$ \Delta\bar T = \frac{\mu p A\,(s - \mu p/\varepsilon_T)}{\sum m c + C_c A} $$
#
# in the mean.  The penalty $\varepsilon_T$ that holds the faces until they slip has taken $\mu p/\varepsilon_T$ of
# the distance.
#
# **Faces.**  A flux $q(t)$ that enters the slab through a band of width $B$, its middle at $c(t)$, warms the face by
#
# $$ T(x, t) = \int_0^t \frac{q(t')}{\rho c}\, Y(\tau)\, X(x - c(t'), \tau)\,\mathrm{d}t', \qquad \tau = t - t', $$
# $$ Y = \frac{1}{\sqrt{\pi \alpha \tau}} \sum_n e^{-n^2 h^2/(\alpha\tau)}, \qquad
#    X(\xi, \tau) = \frac12\left[\operatorname{erf}\frac{\xi + B/2}{\sqrt{4\alpha\tau}}
#    - \operatorname{erf}\frac{\xi - B/2}{\sqrt{4\alpha\tau}}\right], $$
#
# the field of a source between insulated faces a height $h$ apart, $\alpha = k/(\rho c)$; images of the band do the
# same for the ends of the slab (Carslaw and Jaeger 1959, §10.3 and §10.7).  The face of the block follows with $X = 1$.
# Both fluxes and the temperature $T_c$ of the interface are those of the contact, with mean temperatures of the faces:
#
# $$ q_b = \gamma_b p\,(T_c - T_b), \quad q_s = \gamma_s p\,(T_c - T_s), \quad C_c \dot T_c = D - q_b - q_s, $$
#
# a linear system for each step in turn.  It is exact where the fluxes are uniform along the contact, as they are if the
# block takes no heat.  A band that has moved on a half-space for long enough shows Jaeger's (1942) profile
#
# $$ T(\xi) = \frac{q}{\pi k} \int_{-B/2}^{B/2} e^{-v(\xi - \xi')/(2\alpha)}\,
#    K_0\!\left(\frac{v|\xi - \xi'|}{2\alpha}\right) \mathrm{d}\xi' . $$
#
# ## What is computed
#
# Plane strain, per millimetre of width.  *thesis* (K. Bronik): Tables 4.4 and 4.8, read as in the program
# `frictional_heating`, now with the whole distance of 60 mm: $E$ = 5.1 MPa, $\nu$ = 0.48, $\mu$ = 0.1,
# $\varepsilon_T$ = 0.1 MPa/mm, $k$ = 100 mW/(mm K), $\gamma^\pm$ = 1000 mW/(N K), $C_c$ = 100 mJ/(mm² K),
# $c$ = 10⁸ mJ/(t K), density 1 t/m³, 1 mm/s, 0.1 MPa.  An interface of that capacity stays with the block and keeps
# 90 % of the heat, and the slab conducts so well that no spot is seen.
#
# *insulator*: steel under 100 MPa at 10 mm/s, the block taking no heat, which theory has in closed form.  In both the
# slab is fixed at every node, which makes the pressure uniform: its modulus does nothing.  *steel*:
# block and slab of steel, both elastic, the top of the block moved and the bottom of the slab held.  Front and rear
# edges of the block press most, and theory for a uniform flux is an estimate.

import logging
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
from scipy.special import erf, k0

from cutsim import (
    ContactHeat,
    HeatBody,
    HeatTransfer,
    Mechanics,
    PairHeat,
    PenaltyContact,
    Solid,
    State,
    StepControl,
    StepReport,
    Support,
    SurfacePair,
    TaggedMesh,
    Temperature,
    ThermoMechanics,
    geometry,
    read_geo,
    run,
)
from cutsim.base.units import Units
from cutsim.results.field_files import interpolate
from cutsim.results.grids import gather_grid
from cutsim.results.output import claim_folder, write_summary
from cutsim.results.pictures import draw_body
from cutsim.results.plots import Curve, plot_curves
from cutsim.results.recording import Columns, Recording

MESH = geometry("sliding")
COMM = MPI.COMM_WORLD
BLOCK, SLAB, HEIGHT = 10.0, 100.0, 10.0  # lengths of block and slab, height of each [mm]
START, SLIDE = 15.0, 60.0  # rear edge of the block at first, and its way [mm]
ABSOLUTE_ZERO = -273.15  # [°C]
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Case(Rubbed):
    """Block and slab, and how the block slides; '+' of their contact is the block."""

    uniform: bool = True  # pressure
    steps: int = 120  # of the slide
    elements: tuple[int, int] = (23, 100)  # along block and slab
    layer: float = 0.25  # height of the elements at the contact [mm]

    @property
    def step(self) -> float:
        """Time of a step, and of pressing [s]."""
        return SLIDE / self.speed / self.steps

    @property
    def until(self) -> float:
        """Time at the end [s]."""
        return self.step * (1 + self.steps)

    def position(self, time: float) -> float:
        """Displacement of the block along the slab [mm]."""
        return self.speed * max(time - self.step, 0.0)

    @property
    def corners(self) -> tuple[float, ...]:
        """Times at which the force has a kink: sliding begins, and slip [s]."""
        return (self.step, self.step + self.elastic_slip / self.speed)

    @property
    def control(self) -> StepControl:
        """Steps that grow from the time of sticking."""
        return StepControl(first=min(self.elastic_slip / self.speed, self.step), largest=self.step, growth=2.0, easy=20)

    @property
    def work(self) -> float:
        """Work of friction of a uniform pressure [mJ/mm]."""
        return self.friction.mu * self.pressure * (SLIDE - self.elastic_slip) * BLOCK

    @property
    def heat_capacities(self) -> Array:
        """Of slab, block and interface per width [mJ/(mm K)]."""
        areas = HEIGHT * np.array([SLAB, BLOCK])
        return np.append(self.density * self.capacity * areas, self.contact.capacity * BLOCK)

    @property
    def diffusivity(self) -> float:
        """α [mm²/s]."""
        return self.conductivity / (self.density * self.capacity)

    @property
    def penalty(self) -> PenaltyContact:
        """Contact law."""
        return PenaltyContact.automatic(self.material.young, self.layer)

    @property
    def depth(self) -> float:
        """Way of the top of the block that gives the pressure if nothing else gives way [mm]."""
        return self.pressure * (HEIGHT / self.confined_modulus + 1 / self.penalty.stiffness)


# ## The problem


def supports(case: Case, state: State, domain: TaggedMesh) -> list[Support]:
    """Press the block in and slide it; for uniform pressure in a holder that moves all of it, on a fixed slab."""
    moved = (domain.cells("upper"), 2) if case.uniform else (domain.facets("top"), 1)
    fixed = (domain.cells("lower"), 2) if case.uniform else (domain.facets("bottom"), 1)
    pressed = domain.facets("top")
    return [
        Support(state, moved[0], 0, case.position, dim=moved[1], name="drive", corners=case.corners),
        Support(state, pressed, 1, lambda t: -case.depth * min(t / case.step, 1.0), name="press"),
        *(Support(state, fixed[0], i, dim=fixed[1]) for i in range(2)),
    ]


@dataclass(frozen=True)
class Rubbing:
    """Mechanics and heat of a case."""

    case: Case
    domain: TaggedMesh
    pair: SurfacePair
    temperature: Temperature
    contact: PairHeat
    problem: ThermoMechanics

    @classmethod
    def build(cls, case: Case, comm: MPI.Comm = COMM) -> "Rubbing":
        """Put the terms together."""
        shape = dict(B=BLOCK, H=HEIGHT, L=SLAB, X=START, nx=case.elements[0], nl=case.elements[1], ly=case.layer)
        domain = read_geo(MESH, comm, shape, gdim=2)
        state = State(fem.functionspace(domain.mesh, ("Lagrange", 1, (2,))))
        solid = Solid(state, case.material, density=case.density)
        faces = domain.facets("rubbing"), domain.facets("track")
        laws = dict(contact=case.penalty, friction=case.friction)
        pair = SurfacePair(state, *faces, young=case.material.young, name="contact", **laws)
        mechanics = Mechanics(state, [solid, pair], supports(case, state, domain))

        scalar = fem.functionspace(domain.mesh, ("Lagrange", 1))
        temperature = Temperature(state, scalar, 0.0, absolute_zero=ABSOLUTE_ZERO)
        properties = dict(capacity=case.capacity, conductivity=case.conductivity, density=case.density)
        groups = {"slab": domain.cells("lower"), "block": domain.cells("upper")}
        bodies = [HeatBody(temperature, body=cells, name=name, **properties) for name, cells in groups.items()]
        contact = PairHeat(temperature, pair, case.contact, name="interface")
        heat = HeatTransfer(temperature, [*bodies, contact])
        return cls(case, domain, pair, temperature, contact, ThermoMechanics(mechanics, heat))

    def columns(self, columns: Columns) -> Columns:
        """Load, way of the block, and mean temperatures of the faces and between them. Collective."""
        exchange = self.contact.passes[0].exchange
        points, pressure = self.pair.passes[0].points, self.pair.passes[0].history.trial["pressure"]
        names = {"block_face": "temperature_plus", "slab_face": "temperature_minus"}
        means = {name: points.integral(exchange.point_values(v)) / BLOCK for name, v in names.items()}
        # where hardly anything is pressed, hardly any heat makes the interface very hot
        load = points.integral(pressure)
        means["interface"] = points.integral(pressure * exchange.point_values("temperature")) / load
        return {
            "load": (-columns["press_force"][0], "force"),
            "way": (columns["drive_displacement"][0], "length"),
            **{name: (value, "temperature") for name, value in means.items()},
        }

    def track(self) -> tuple[Array, Array]:
        """Places along the face of the slab, ascending, and the temperatures there. Collective."""
        space = self.temperature.space
        dofs = fem.locate_dofs_topological(space, 1, self.domain.facets("track"))
        dofs = dofs[dofs < space.dofmap.index_map.size_local]
        mine = space.tabulate_dof_coordinates()[dofs, 0], self.temperature.value.x.array[dofs]
        x, T = (np.concatenate(part) for part in zip(*space.mesh.comm.allgather(mine), strict=True))
        order = np.argsort(x)
        return x[order], T[order]


# ## Closed forms


def rise(case: Case, x: Array, time: float, ends: Array) -> tuple[Array, Array]:
    """What a unit of flux in each interval of time has done to the faces at a later time.

    Args:
        case: The case.
        x: Places on the slab [mm].
        time: The later time [s].
        ends: Ends of the intervals, ascending up to that time [s].

    Returns:
        Rise of the slab at each place, shape (intervals, places), and of the block [K mm²/mW].
    """
    nodes, weights = np.polynomial.legendre.leggauss(8)
    roots = np.sqrt(np.maximum(time - ends, 0.0))  # in which the source is not singular
    half = 0.5 * (roots[:-1] - roots[1:])
    w = 0.5 * (roots[:-1] + roots[1:])[:, None] + half[:, None] * nodes
    spread = case.diffusivity * w**2
    n = np.arange(-250, 251)[:, None, None]
    Y = np.exp(-((n * HEIGHT) ** 2) / spread).sum(axis=0) / np.sqrt(np.pi * case.diffusivity)
    share = 2 * half[:, None] * weights * Y / (case.density * case.capacity)
    centre = START + BLOCK / 2 + np.vectorize(case.position)(time - w**2)
    images = 2 * SLAB * np.arange(-8, 9)
    middles = np.concatenate([sign * centre[..., None] + images for sign in (1.0, -1.0)], axis=-1)
    distance, width = x[:, None, None, None] - middles, np.sqrt(4 * spread)[..., None]
    X = 0.5 * (erf((distance + BLOCK / 2) / width) - erf((distance - BLOCK / 2) / width)).sum(axis=-1)
    return np.einsum("xij,ij->ix", X, share), share.sum(axis=1)


@dataclass(frozen=True)
class Theory:
    """Mean temperatures of both faces and between them [°C], and the fluxes into block and slab, by the steps."""

    block_face: Array
    slab_face: Array
    interface: Array
    fluxes: Array


def theory(case: Case, history: dict[str, Array]) -> Theory:
    """Temperatures for uniform fluxes, from the work of friction and the load of each step."""
    times = np.append(0.0, history["time"])
    steps = np.diff(times)
    source = np.diff(history["energy_friction"], prepend=0.0) / steps / BLOCK
    gammas = np.array([case.contact.gamma_plus, case.contact.gamma_minus])
    places, weights = np.polynomial.legendre.leggauss(6)
    fluxes, faces, between = np.zeros((len(steps), 2)), np.zeros((len(steps), 2)), np.zeros(len(steps))
    for i, (dt, D) in enumerate(zip(steps, source, strict=True)):
        end = times[i + 1]
        x = START + BLOCK / 2 * (1 + places) + case.position(end)
        slab, block = rise(case, x, end, times[: i + 2])
        influence = np.column_stack([block, slab @ (0.5 * weights)])
        before = (influence[:-1] * fluxes[:i]).sum(axis=0)
        # q = γ p (T_c − before − influence q) for both faces, and the balance of the interface
        g = gammas * history["load"][i] / BLOCK
        g = g / (1 + g * influence[-1])
        stored = case.contact.capacity / dt
        old = between[i - 1] if i else 0.0
        between[i] = (D + stored * old + g @ before) / (stored + g.sum()) if g.sum() else old
        fluxes[i] = g * (between[i] - before)
        faces[i] = before + influence[-1] * fluxes[i]
    return Theory(faces[:, 0], faces[:, 1], between, fluxes)


def jaeger(case: Case, x: Array) -> Array:
    """Steady profile of a unit of flux through a band on a half-space, x from its middle [K mm²/mW]."""
    a = case.speed / (2 * case.diffusivity)
    nodes, weights = np.polynomial.legendre.leggauss(40)
    total = np.zeros_like(x)
    for low, high in ((-BLOCK / 2, np.clip(x, -BLOCK / 2, BLOCK / 2)), (np.clip(x, -BLOCK / 2, BLOCK / 2), BLOCK / 2)):
        # squares gather the nodes at the logarithmic end, that at x
        near, far = (high, low) if np.ndim(high) else (low, high)
        source = near + (far - near) * (0.5 + 0.5 * nodes[:, None]) ** 2
        measure = np.abs(far - near) * (0.5 + 0.5 * nodes[:, None])
        distance = x - source
        total += (weights[:, None] * measure * np.exp(-a * distance) * k0(a * np.abs(distance) + 1e-300)).sum(axis=0)
    return total / (np.pi * case.conductivity)


# ## Sliding


def slide(case: Case, name: str, out: Path) -> tuple[Rubbing, dict[str, Array]]:
    """Press and slide, with what is recorded and pictures on the way. Collective."""
    rubbing = Rubbing.build(case)
    problem = rubbing.problem
    with (
        problem.mechanics.problem,
        problem.heat.problem,
        Recording(
            out,
            problem,
            case.until,
            title=name,
            units=Units(temperature="°C"),
            show={"way": "way", "interface": "interface"},
            extra=rubbing.columns,
        ) as recording,
    ):
        pictures = iter([20.0, 40.0, 60.0, np.inf])
        following = next(pictures)

        def report(step: StepReport) -> None:
            nonlocal following
            recording(step)
            if recording.history["way"][-1] > following - 1e-6:
                draw(rubbing, out / f"after_{following:.0f}mm.png", f"Sliding block, {name}, after {following:.0f} mm")
                following = next(pictures)

        run(problem, case.until, case.control, report)
    history = recording.columns()
    return rubbing, history


def balance(case: Case, history: dict[str, Array]) -> dict[str, float]:
    """Heat and work of friction against theory."""
    closed = {
        "friction_of_theory": case.work,
        "mean_rise_of_theory": case.work / float(case.heat_capacities.sum()),
    }
    return _sliding_heat.balance(history, case.heat_capacities) | (closed if case.uniform else {})


def faces(history: dict[str, Array], expected: Theory) -> dict[str, float]:
    """Mean temperatures of the faces against theory, errors after a fifth of the way relative to the interface."""
    late = history["way"] > 0.2 * SLIDE
    result = {}
    for name in ("block_face", "slab_face", "interface"):
        series = getattr(expected, name)
        result[name] = float(history[name][-1])
        result[f"{name}_of_theory"] = float(series[-1])
        result[f"{name}_error"] = float(np.abs((history[name] - series)[late] / expected.interface[late]).max())
    return result


def profile(rubbing: Rubbing, history: dict[str, Array], expected: Theory, path: Path) -> dict[str, float]:
    """Temperature along the slab at the end against theory, with a picture. Collective."""
    case, (x, T) = rubbing.case, rubbing.track()
    times = np.append(0.0, history["time"])
    slab = rise(case, x, float(times[-1]), times)[0]
    series = expected.fluxes[:, 1] @ slab
    xi = x - (START + BLOCK / 2 + SLIDE)
    steady = expected.fluxes[-1, 1] * jaeger(case, xi)
    if COMM.rank == 0:
        plot_curves(
            path,
            [
                Curve(x, T, "computed", "o"),
                Curve(x, series, "theory", "-"),
                Curve(x, steady, "Jaeger: half-space, long after the start", "k--"),
            ],
            xlabel="place on the slab [mm]",
            ylabel="temperature [°C]",
            title="Face of the slab at the end of the slide",
        )
    return {
        "peak": float(T.max()),
        "peak_of_theory": float(series.max()),
        "peak_of_jaeger": float(steady.max()),
        "peak_behind_the_middle": float(-xi[T.argmax()]),
        "profile_error": float(np.linalg.norm(T - series) / np.linalg.norm(series)),
    }


# ## Pictures


def draw(rubbing: Rubbing, path: Path, title: str) -> None:
    """Temperature of the bodies. Collective."""
    cells = fem.Function(fem.functionspace(rubbing.domain.mesh, ("DG", 0)))
    interpolate(cells, rubbing.temperature.value)
    body = gather_grid(rubbing.pair.state.u, {"temperature": cells})
    limits = (0.0, rubbing.temperature.maximum())
    draw_body(path, body, "temperature", label="temperature [°C]", title=title, limits=limits)


def plot(case: Case, history: dict[str, Array], expected: Theory, out: Path, title: str) -> None:
    """Temperatures of the faces, and what became of the work of friction. Call it on one rank."""
    curves = []
    every = max(1, case.steps // 30)
    for number, name in enumerate(("block_face", "slab_face", "interface")):
        label = name.replace("_", " ")
        curves.append(Curve(history["way"][::every], history[name][::every], label, f"C{number}o"))
        curves.append(Curve(history["way"], getattr(expected, name), f"{label}, theory", f"C{number}-"))
    plot_curves(out / "faces.png", curves, xlabel="way [mm]", ylabel="mean temperature [°C]", title=title)
    labels = {"xlabel": "way [mm]", "ylabel": "heat per width [mJ/mm]", "title": title}
    plot_heat(out / "heat.png", history, case.heat_capacities, "way", **labels)


# ## The run

THESIS = Case(**SOFT_ON_SOFT)
STEEL = Case(**STEEL_ON_STEEL, contact=ContactHeat(0.2, 0.6), uniform=False)
INSULATOR = replace(STEEL, contact=ContactHeat(1e-9, 0.6), uniform=True)


def cases(coarser: int, *, quick: bool) -> dict[str, Case]:
    """What slides, by name."""
    sizes = dict(steps=120 // coarser, elements=(23 // coarser, 100 // coarser), layer=0.25 * coarser)
    if quick:
        sizes = dict(steps=30, elements=(11, 50), layer=1.0)
    return {
        name: replace(case, **sizes)
        for name, case in {"thesis": THESIS, "insulator": INSULATOR, "steel": STEEL}.items()
    }


def check(results: dict[str, dict[str, float]]) -> None:
    """The headline numbers."""
    for name, result in results.items():
        assert abs(result["heat_kept_over_friction"] - 1) < 1e-6, name
        assert result["heat_closure"] < 5e-3 and result["energy_closure"] < 2e-2, name
        assert result["least_contact_dissipation"] > -1e-9, name
        if "friction_of_theory" in result:
            assert abs(result["friction"] / result["friction_of_theory"] - 1) < 5e-3, name
            assert abs(result["mean_rise"] / result["mean_rise_of_theory"] - 1) < 5e-3, name
        errors = [result[f"{face}_error"] for face in ("block_face", "slab_face", "interface")]
        assert max(errors) < {"thesis": 1e-3, "insulator": 0.02, "steel": 0.05}[name], (name, errors)


def main(
    coarser: Annotated[int, typer.Option(min=1, help="factor on the sizes of elements and steps")] = 1,
    quick: Annotated[bool, typer.Option("--quick", help="coarser, with larger steps")] = False,
    out: Annotated[Path, typer.Option(help="where the results go")] = Path("results/validation/sliding_block_heat"),
    overwrite: Annotated[bool, typer.Option("--overwrite", help="replace the results of an older run")] = False,
) -> None:
    """Slide a block over a slab and compare the hot spot with closed forms."""
    level = logging.WARNING if COMM.rank == 0 else logging.ERROR
    logging.basicConfig(level=level, format="%(name)s: %(message)s")
    claim_folder(out, COMM, overwrite=overwrite)
    results = {}
    for name, case in cases(coarser, quick=quick).items():
        rubbing, history = slide(case, name, out / name)
        expected = theory(case, history)
        results[name] = balance(case, history) | faces(history, expected)
        if not case.contact.capacity:
            results[name] |= profile(rubbing, history, expected, out / name / "profile.png")
        if COMM.rank == 0:
            plot(case, history, expected, out / name, f"Sliding block: {name}")
    write_summary(out / "summary.json", results, COMM)
    if COMM.rank == 0:
        show(results)
    if coarser == 1:
        check(results)


if __name__ == "__main__":
    typer.run(main)
