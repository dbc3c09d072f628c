# # A penny-shaped crack
#
# A round crack of radius $a$ in a large cylinder under a tension $\sigma$ along its axis (Sneddon 1946).  In an
# infinite body
#
# $$ \delta(0) = \frac{8(1-\nu^2)\sigma a}{\pi E}, \qquad K_I = 2\sigma\sqrt{a/\pi}, \qquad G = \frac{K_I^2}{E'}
#    = \frac{4\sigma^2 a}{\pi E'}, \qquad \sigma_c = \sqrt{\frac{\pi E' G_c}{4 a}}. $$
#
# The body is one of revolution, ten crack radii large.  The opening of the middle and the energy that cracks of
# neighbouring radii release come from a linear body with an open crack; the largest tension that a bond around the
# crack carries tends to $\sigma_c$ as the process zone $l = E'G_c/t^2$ vanishes.  Behind it the path is followed.

import numpy as np
from _problems import solve
from dolfinx import mesh

from cutsim import (
    Crack,
    Exponential,
    LinearElastic,
    Mechanics,
    Solid,
    State,
    StepControl,
    Support,
    Traction,
    cracked_space,
    run,
)
from helpers.bodies import at
from helpers.meshes import QUADRILATERAL, rectangle
from helpers.runs import final

RADIUS, FAR, YOUNG, NU = 1.0, 10.0, 1.0, 0.3
PLANE = YOUNG / (1 - NU**2)
SOLID = LinearElastic(YOUNG, NU)


def graded(h: float, fine: tuple[float, float], end: float, growth: float = 1.2) -> np.ndarray:
    """Positions from zero: elements of size h within a stretch, growing ones beside it."""
    inner = [fine[0]]
    while inner[-1] > 1e-9:
        inner.append(max(inner[-1] - h * growth ** len(inner), 0.0))
        if inner[-1] < h:
            inner[-1] = 0.0
    middle = np.linspace(*fine, round((fine[1] - fine[0]) / h) + 1)
    outer = [fine[1]]
    while outer[-1] < end:
        outer.append(outer[-1] + h * growth ** len(outer))
    outer = fine[1] + (np.array(outer) - fine[1]) * (end - fine[1]) / (outer[-1] - fine[1])
    return np.concatenate([inner[:0:-1], middle, outer[1:]])


def body(h: float, radius: float) -> tuple[mesh.Mesh, np.ndarray, np.ndarray, np.ndarray]:
    """The cylinder with a crack of a radius: its mesh, the facets of crack and ligament, and the cells below them."""
    r, z = graded(h, (radius - 0.3, radius + 0.3), FAR), graded(h, (0.0, 4 * h), FAR)
    n, m = len(r) - 1, 2 * (len(z) - 1)
    domain = rectangle([(0, 0), (n, m)], (n, m), QUADRILATERAL)
    x, heights = domain.geometry.x, np.concatenate([-z[:0:-1], z])
    x[:, 0], x[:, 1] = r[np.rint(x[:, 0]).astype(int)], heights[np.rint(x[:, 1]).astype(int)]
    crack, ligament = (
        mesh.locate_entities(domain, 1, lambda x, s=s: np.isclose(x[1], 0) & (s * (x[0] - radius) < 1e-9))
        for s in (1, -1)
    )
    lower = mesh.locate_entities(domain, 2, lambda x: x[1] < 1e-9)
    return domain, crack, ligament, lower


def loaded(state: State, tension: float) -> tuple[list[Traction], list[Support]]:
    """Tension on both ends, the axis held from moving aside and one of its ends along it."""
    domain = state.mesh
    ends = [mesh.locate_entities_boundary(domain, 1, at(1, z)) for z in (-FAR, FAR)]
    pull = Traction(state, ends[1], (0.0, tension), lambda t: t, name="pull")
    axis = mesh.locate_entities_boundary(domain, 1, at(0, 0))
    return [pull], [Support(state, axis, 0), Support(state, ends[0], 1)]


def released(h: float, radius: float) -> tuple[float, float, int]:
    """Opening of the middle of an open crack, strain energy, and unknowns, under a unit of tension."""
    domain, crack, _, _ = body(h, radius)
    state = State(cracked_space(domain, ("Lagrange", 2, (2,)), crack), axisymmetric=True)
    loads, supports = loaded(state, 1.0)
    mechanics = Mechanics(state, [Solid(state, SOLID), *loads], supports)
    last = final(mechanics, step=1.0)
    x, u = state.V.tabulate_dof_coordinates(), state.u.x.array.reshape(-1, 2)[:, 1]
    return float(np.ptp(u[np.hypot(x[:, 0], x[:, 1]) < 1e-9])), last["energy_strain"], state.unknowns


def linear(quick: bool) -> dict[str, float]:
    """Opening of the middle, and energy release by radii that differ by a twentieth, over the closed forms."""
    found, unknowns, step = {}, 0, 0.05
    for h in (0.1,) if quick else (0.1, 0.05):
        opening, _, unknowns = released(h, RADIUS)
        found[f"opening, h = {h}"] = opening / (8 * RADIUS / (np.pi * PLANE))
        energies = [released(h, RADIUS + sign * step)[1] for sign in (-1, 1)]
        radii = np.array([RADIUS - step, RADIUS + step])
        exact = 8 / (3 * PLANE) * radii**3  # energy that the crack has added: G integrated over its area
        found[f"release, h = {h}"] = (energies[1] - energies[0]) / (exact[1] - exact[0])
    return found | {"unknowns": unknowns}


def bonded(quick: bool) -> dict[str, float]:
    """Largest tension over that of a sharp crack, for process zones of decreasing length."""
    found, toughness, unknowns = {}, 1e-3, 0
    critical = np.sqrt(np.pi * PLANE * toughness / (4 * RADIUS))
    for zone in (0.2,) if quick else (0.2, 0.1, 0.05):
        domain, crack, ligament, lower = body(zone / 8, RADIUS)
        state = State(cracked_space(domain, ("Lagrange", 1, (2,)), [crack, ligament]), axisymmetric=True)
        law = Exponential(strength=float(np.sqrt(PLANE * toughness / zone)), toughness=toughness)
        bond = Crack(state, ligament, lower, law, young=YOUNG, normal="reference")
        loads, supports = loaded(state, float(critical))
        mechanics = Mechanics(state, [Solid(state, SOLID), bond, *loads], supports)
        peak = [0.0]

        def record(report, peak=peak) -> None:
            peak[0] = max(peak[0], report.time)

        control = StepControl(first=0.1, largest=0.1, line_searches=("basic", "l2", "bt"))
        run(mechanics, 2.0, control, record, lambda report, peak=peak: report.time < 0.97 * peak[0])
        found[f"zone {zone}"], unknowns = peak[0], state.unknowns
    return found | {"unknowns": unknowns}


PROBLEMS = {"linear": linear, "bonded": bonded}

if __name__ == "__main__":
    solve("penny", PROBLEMS)
