# # Motion and heat in simple bodies
#
# Closed forms of dynamics and of conduction, in any consistent units.
#
# - *Vibration*: a bar in its first mode, $\omega = \pi c/(2L)$; order of the error of the trapezoidal rule in the step,
#   and drift of the energy over 20 periods.
# - *Sudden load*: a bar that is loaded at once stretches to twice the static length at the time $2L/c$.
# - *Impact*: two equal bars that meet exchange their velocities while a wave runs to and fro; momentum is kept.
# - *Braking*: a block pressed by $p$ on a rough plane is slowed down by $\mu p A/m$.
# - *Tearing in flight*: two glued blocks that fly apart pay the toughness of the bond with their kinetic energy.
# - *Half-space* under a flux $q$: $T = (2q/k)\sqrt{\alpha t/\pi}$ at its surface (Carslaw and Jaeger 1959, §2.9).
# - *Ring*: heat through a hollow cylinder, $2\pi k\,\Delta T/\ln(b/a)$ per height.
# - *Stretched bar*: conduction is that of the deformed shape, $k\,\Delta T\,\lambda_2\lambda_3/\lambda_1$ per section.

import numpy as np
from _problems import solve
from dolfinx import fem, mesh
from mpi4py import MPI

from cutsim import (
    Exponential,
    GeneralisedAlpha,
    HeatBody,
    HeatFlux,
    HeatTransfer,
    LinearElastic,
    Mechanics,
    NeoHookean,
    PenaltyContact,
    Plane,
    PrescribedTemperature,
    Solid,
    State,
    StepControl,
    Support,
    Temperature,
    Tolerances,
    ToolContact,
    ToolPath,
    Traction,
    run,
)
from cutsim.base.assembly import integrate
from cutsim.base.compat import form
from cutsim.fields.points import Surface
from cutsim.interface.friction import Coulomb
from helpers.blocks import make_blocks
from helpers.bodies import Body, at
from helpers.meshes import QUADRILATERAL, rectangle
from helpers.runs import final, history

YOUNG, DENSITY, LENGTH = 3.0, 2.0, 4.0
SPEED_OF_SOUND = float(np.sqrt(YOUNG / DENSITY))
TIGHT = Tolerances(rtol=1e-11)

# ## A bar along x, clamped at its left end, without lateral contraction


def bar(cells: int, shape=None, load: float = 0.0) -> tuple[Mechanics, int]:
    """A bar with an initial displacement along x or a constant pull at its end, and the dof of its end."""
    domain = rectangle([(0, 0), (LENGTH, 1)], (cells, 1), QUADRILATERAL, MPI.COMM_SELF)
    state = State(fem.functionspace(domain, ("Lagrange", 1, (2,))))
    left, right = (mesh.locate_entities_boundary(domain, 1, at(0, x)) for x in (0.0, LENGTH))
    everywhere = np.arange(domain.topology.index_map(2).size_local, dtype=np.int32)
    supports = [Support(state, everywhere, 1, dim=2), Support(state, left, 0)]
    if shape is not None:
        state.u.interpolate(lambda x: np.array([shape(x[0]), 0 * x[0]]))
        state.commit()
    terms = [Solid(state, LinearElastic(YOUNG, 0.0), density=DENSITY)]
    if load:
        terms.append(Traction(state, right, (load, 0.0), lambda t: 1.0))
    tip = 2 * int(np.argmax(state.V.tabulate_dof_coordinates()[:, 0]))
    return Mechanics(state, terms, supports, analysis="dynamic", tolerances=TIGHT), tip


def vibration(quick: bool) -> dict[str, float]:
    """Frequency over that of the bar, order in the step, and drift of the energy."""
    wave, amplitude = 0.5 * np.pi / LENGTH, 0.01

    def released(cells: int, steps: int, periods: float) -> tuple[np.ndarray, np.ndarray]:
        mechanics, tip = bar(cells, lambda x: amplitude * np.sin(wave * x))
        dt, rows = periods * 2 * np.pi / (SPEED_OF_SOUND * wave) / steps, []

        def record(report) -> None:
            entries = mechanics.audit.entries
            rows.append((report.time, mechanics.state.u.x.array[tip], entries["strain"] + entries["kinetic"]))

        run(mechanics, dt * steps, StepControl.fixed(dt), record)
        return np.array(rows).T, mechanics.audit.initial

    found = {}
    for cells in (4, 8) if quick else (4, 8, 16):
        (time, tip, _), _ = released(cells, 600, 1.5)
        zeros = np.flatnonzero(tip[:-1] * tip[1:] < 0)  # at a quarter, three quarters and five quarters of a period
        times = time[zeros] - tip[zeros] * np.diff(time)[zeros] / np.diff(tip)[zeros]
        found[f"frequency, {cells} cells"] = float(np.pi / np.diff(times).mean() / (SPEED_OF_SOUND * wave))
    fine = released(4, 640, 0.7)[0][1][-1]
    errors = [abs(released(4, steps, 0.7)[0][1][-1] - fine) for steps in (20, 40, 80)]
    energy, initial = released(4, 240, 20.0)
    found["order"] = float(np.log2(errors[0] / errors[1]))
    return found | {"drift": float(np.abs(energy[2] / initial - 1).max())}


def sudden_load(quick: bool) -> dict[str, float]:
    """Largest stretch over twice the static one, for several meshes."""
    found, load = {}, 1e-3
    for cells in (16, 32) if quick else (16, 32, 64):
        mechanics, tip = bar(cells, load=load)
        period, moved = 2 * LENGTH / SPEED_OF_SOUND, []
        run(
            mechanics,
            1.2 * period,
            StepControl.fixed(period / (4 * cells)),
            lambda report, m=mechanics, i=tip, moved=moved: moved.append(m.state.u.x.array[i]),
        )
        found[f"{cells} cells"] = float(max(moved) / (2 * load * LENGTH / YOUNG))
    return found


# ## Blocks that fly

GAP, FAST, SLOW = 0.02, 0.06, -0.02


def impact(quick: bool) -> dict[str, float]:
    """Velocity of the bar that was hit over that of the other one before, and momentum over that before."""
    found = {}
    for n in (8,) if quick else (8, 16):
        b = make_blocks(2, n, MPI.COMM_SELF)
        b.move(lambda x: 0 * x, lambda x: np.array([0 * x[0], 0 * x[0] + GAP]))
        b.state.commit()
        terms = [b.solid(LinearElastic(YOUNG, 0.0), density=DENSITY), b.crack(None, contact=PenaltyContact(100.0))]
        mechanics = Mechanics(b.state, terms, analysis="dynamic", scheme=GeneralisedAlpha(0.8), tolerances=TIGHT)
        for cells, speed in ((b.lower, FAST), (b.upper, SLOW)):
            mechanics.inertia.set_velocity((0.0, speed), cells)
        until = GAP / (FAST - SLOW) + 2 * 0.5 / SPEED_OF_SOUND + 0.2
        run(mechanics, until, StepControl.fixed(0.04 / n), lambda report: None)
        after = 2 * integrate(form(mechanics.inertia.velocity[1] * b.state.measures.cells(b.upper)))
        found[f"velocity, n = {n}"] = after / FAST
        found[f"momentum, n = {n}"] = mechanics.inertia.momentum()[1] / (0.5 * DENSITY * (FAST + SLOW))
    return found


def braking(quick: bool) -> dict[str, float]:
    """Momentum that friction has taken from a sliding block in one second, over μ p A t, in more and more steps."""
    return {f"taken, {steps} steps": braked(steps) for steps in ((50,) if quick else (25, 50, 100))}


def braked(steps: int) -> float:
    """Momentum taken in so many steps, over μ p A t."""
    mu, p, speed, dt = 0.3, 0.02, 0.1, 1 / steps
    domain = mesh.create_unit_square(MPI.COMM_SELF, 2, 2, QUADRILATERAL)
    state = State(fem.functionspace(domain, ("Lagrange", 1, (2,))))
    bottom, top = (mesh.locate_entities_boundary(domain, 1, at(1, y)) for y in (0, 1))
    contact = PenaltyContact(20.0)
    path = ToolPath(lambda t: np.array([0.5, p / contact.stiffness]))  # as deep as the pressure needs
    surface = [Surface.exterior(state, bottom)]
    plane = ToolContact(state, Plane((0.0, 1.0)), path, surface, contact=contact, friction=Coulomb(mu), name="plane")
    load = Traction(state, top, (0.0, -p), lambda t: 1.0)
    terms = [Solid(state, NeoHookean(1e3, 0.0), density=DENSITY), load, plane]
    mechanics = Mechanics(state, terms, analysis="dynamic", scheme=GeneralisedAlpha(0.5), tolerances=TIGHT)
    mechanics.inertia.set_velocity((speed, 0.0))
    run(mechanics, steps * dt, StepControl.fixed(dt), lambda report: None)
    return (DENSITY * speed - mechanics.inertia.momentum()[0]) / (mu * p * dt * steps)


def tearing(quick: bool) -> dict[str, float]:
    """Kinetic and strain energy that two glued blocks have lost which fly apart, over the toughness."""
    return {f"lost, {step} s": torn(step) for step in ((0.005,) if quick else (0.01, 0.005, 0.0025))}


def torn(step: float) -> float:
    """Energy lost over the toughness, in steps of some size."""
    b = make_blocks(2, 4, MPI.COMM_SELF)
    law = Exponential(toughness=0.1, opening=0.05, shear_toughness=0.1, shear_opening=0.05)
    terms = [b.solid(LinearElastic(YOUNG, 0.0), density=DENSITY), b.crack(law, contact=PenaltyContact(100.0))]
    mechanics = Mechanics(b.state, terms, analysis="dynamic", tolerances=TIGHT)
    for cells, speed in ((b.lower, -1.0), (b.upper, 1.0)):
        mechanics.inertia.set_velocity((0.0, speed), cells)
    rows = history(mechanics, 0.6, StepControl.fixed(step))
    lost = rows["energy_initial"] - rows["energy_kinetic"] - rows["energy_strain"]
    return float(lost[-1] / 0.1)


# ## Heat


def half_space(quick: bool) -> dict[str, float]:
    """Rise of the temperature at the end of a long bar under a constant flux, over that of a half-space."""
    rho, c, k, q, until = 2.0, 3.0, 0.5, 2.0, 1.0
    rise, found = 2 * q / k * np.sqrt(k / (rho * c) * until / np.pi), {}
    for n in (40,) if quick else (40, 80, 160):
        b = Body(rectangle([(0, 0), (4.0, 0.1)], (n, 1)), axisymmetric=False)
        T = Temperature(b.state, fem.functionspace(b.state.mesh, ("Lagrange", 1)), 300.0)
        body = HeatBody(T, density=rho, capacity=c, conductivity=k)
        heat = HeatTransfer(T, [body, HeatFlux(T, b.where(at(0, 0)), q)])
        rows = history(heat, until, StepControl.fixed(until / n))
        found[f"n = {n}"] = float((rows["temperature_max"][-1] - 300) / rise)
    return found


def ring(quick: bool) -> dict[str, float]:
    """Heat that flows through a hollow cylinder, over that of the closed form."""
    inner, outer, height, k, found = 1.0, 3.0, 0.5, 0.7, {}
    for n in (6, 12) if quick else (6, 12, 24):
        b = Body(rectangle([(inner, 0), (outer, height)], (n, 1)))
        T = Temperature(b.state, fem.functionspace(b.state.mesh, ("Lagrange", 1)), 0.0)
        held = [PrescribedTemperature(T, b.where(at(0, r)), v, name=s) for r, v, s in ((1.0, 1, "i"), (3.0, 0, "o"))]
        heat = HeatTransfer(T, [HeatBody(T, capacity=2.0, conductivity=k, density=0.5)], held)
        flow = final(heat, 1e6, 2.5e5)["i_heat_flow"]
        found[f"n = {n}"] = flow / (2 * np.pi * k * height / np.log(outer / inner))
    return found


def stretched(quick: bool) -> dict[str, float]:
    """Heat that flows through a bar stretched to 1.5 along and 0.8 across, over that of its deformed shape."""
    b = Body(rectangle([(0, 0), (1.0, 1.0)], (4, 1)), axisymmetric=False)
    T = Temperature(b.state, fem.functionspace(b.state.mesh, ("Lagrange", 1)), 300.0)
    b.state.u.interpolate(lambda x: np.array([0.5 * x[0], -0.2 * x[1]]))
    b.state.commit()
    solid = Solid(b.state, NeoHookean(1.0, 0.3), density=2.0)
    held = [PrescribedTemperature(T, b.where(at(0, x)), v, name=s) for x, v, s in ((0, 320, "i"), (1, 300, "o"))]
    heat = HeatTransfer(T, [HeatBody(T, capacity=3.0, conductivity=0.5, body=solid)], held)
    return {"flow": final(heat, 3e9, 1e9)["i_heat_flow"] / (0.5 * 20 * 0.8 / 1.5)}


PROBLEMS = {
    "vibration": vibration, "sudden load": sudden_load, "impact": impact, "braking": braking, "tearing": tearing,
    "half-space": half_space, "ring": ring, "stretched": stretched,
}  # fmt: skip

if __name__ == "__main__":
    solve("motion", PROBLEMS)
