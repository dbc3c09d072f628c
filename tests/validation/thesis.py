# # Cases of the thesis
#
# The built-in cases that are problems of K. Bronik's thesis, against closed forms.  What it prints and what was
# corrected stands at the head of each case (`cutsim new --from boxes`).  No measured curve and no table of computed
# forces survives, so that figures alone could be compared.
#
# - *Boxes* (4.5.1, 4.5.2, 4.6.2; tables 4.2, 4.3, 4.6): two boxes of $A$ = 100 mm² are drawn apart, sheared off along
#   either axis, and sheared off under pressure.  The largest force is $tA$; the work is that of the law (4.20) up to
#   the opening reached; in the end the force is $\mu$ times the pressing one.
# - *Tear test* (4.5.1): a bar tears when its nominal stress is the strength.  Of the printed solid
#   ($C_1 = C_2 = 1$, $K = 0.48$) no bar can tear, as its stress has a maximum of 1.18 MPa.
# - *Beam with rigid ends* (4.5.1): $J = 2F\theta$ from the ends alone against the work of the law at the tip.
# - *Block sheared off* (4.5.3, 4.6.3; tables 4.4, 4.8): work of the bond, Coulomb's force, and all of it as heat.
# - *Indentation* (3.2–3.9; table 3.4): force of a flat punch on a layer that is bonded to its base or slides on it,
#   over that on a half-space, against the factors of Hayes et al. and those of the integral equation.

from collections.abc import Mapping
from itertools import product
from math import e, exp, sqrt

import numpy as np
from _problems import solve
from mpi4py import MPI
from scipy.optimize import brentq, minimize_scalar

from cutsim import LinearElastic, Mechanics, Solid
from cutsim.cases import built_in_cases, read_case
from cutsim.identify.indentation import layer_factor
from helpers.bodies import Body, at
from helpers.meshes import rectangle
from helpers.runs import final

COMM = MPI.COMM_WORLD
CASES = {name: path for name, (_, path) in built_in_cases().items()}


def rows(name: str, **changes: str) -> dict[str, np.ndarray]:
    """History of a built-in case in its quick form, with some values changed."""
    simulation, found = read_case(CASES[name], changes, quick=True).build(COMM), {}

    def record(report) -> None:
        for column, (value, _) in {**report.columns, **simulation.columns(report.columns)}.items():
            found.setdefault(column, []).append(value)

    simulation.run(record)
    return {column: np.array(values) for column, values in found.items()}


# ## Boxes

STRENGTH, OPENING, AREA = 200.0, 0.001, 100.0


def boxes(quick: bool) -> dict[str, float]:
    """Largest force over tA, and work over that of the law, in each mode; friction at the end over µ times pressing."""
    found = {}
    for steps in (40,) if quick else (20, 40, 80):
        few = {"mesh.set.n": "2", "mesh.set.m": "3", "steps.first": str(1 / steps), "steps.largest": str(1 / steps)}
        apart = rows("boxes", **few)
        force, spent = apart["pull_force"], apart["energy_fracture"][-1]
        x = brentq(lambda x, last: x * exp(1 - x) - last, 1.5, 20.0, force[-1] / STRENGTH / AREA)
        work = (1 - (1 + x + x**2 / 2) * exp(-x)) * e * STRENGTH * OPENING * AREA
        found |= {f"I force, {steps}": force.max() / (STRENGTH * AREA), f"I work, {steps}": spent / work}
        for mode, way, column in (("II", "slide", "push_force"), ("III", "tear", "tear_force")):
            sheared = rows("boxes", **few, **{"parameters.open": "0", f"parameters.{way}": "1"})
            found[f"{mode} force, {steps}"] = sheared[column].max() / (STRENGTH * AREA)
            spent = sheared["energy_fracture"][-1]
            found[f"{mode} work, {steps}"] = spent / (sqrt(e / 2) * STRENGTH * OPENING * AREA)
        rubbed = rows("boxes", **few, **{"parameters.open": "0", "parameters.slide": "1", "parameters.press": "1e-4"})
        found[f"friction, {steps}"] = rubbed["push_force"][-1] / (-0.3 * rubbed["pull_force"][-1])
    return {name: float(value) for name, value in found.items()}


# ## Tear test


def drawn(stretch: float, bulk: float) -> float:
    """Energy of a bar of the solid of Mooney and Rivlin, C1 = C2 = 1, that is free to contract."""

    def energy(across: float) -> float:
        volume, squares = stretch * across**2, np.array([stretch, across, across]) ** 2
        first, second = squares.sum(), volume**2 * (1 / squares).sum()
        return first * volume ** (-2 / 3) + second * volume ** (-4 / 3) - 6 + bulk / 2 * np.log(volume) ** 2

    return minimize_scalar(energy, (0.1, 2.0), options={"xtol": 1e-10}).fun


def nominal_stress(stretch: float, bulk: float) -> float:
    """Of the bar [MPa]."""
    return (drawn(stretch + 1e-3, bulk) - drawn(stretch - 1e-3, bulk)) / 2e-3


def torn(speed: float) -> dict[str, np.ndarray]:
    """A bar of the corrected solid, drawn at some speed of its ends [mm/s] until it has torn."""
    coarse = {"mesh.set.lc": "5", "mesh.set.band": "10", "mesh.set.nz": "1", "mesh.set.growth": "2"}
    return rows("tear-bar", **coarse, **{"parameters.speed": str(speed), "steps.largest": str(2 / speed)})


def printed() -> dict[str, np.ndarray]:
    """A bar of the printed solid, drawn to eight times its length."""
    one = {"mesh.set.lc": "5", "mesh.set.band": "19", "mesh.set.nz": "1", "mesh.set.growth": "100"}
    changes = {"material.bulk": "0.48", "parameters.stretch": "8", "analysis.type": "quasi-static"}
    return rows("tear-bar", **one, **changes, **{"steps.first": "0.01", "steps.largest": "0.01"})


def tear(quick: bool) -> dict[str, float]:
    """Force and way at which the bar tears, and work of the bond, over theory; largest stress of the printed solid."""
    stretch = brentq(lambda x: nominal_stress(x, 48.0) - 5.0, 1.5, 2.5)
    way = 20 * (stretch - 1) + 28.3 / e / 5.0 / 2  # half of the opening at which the traction of the bond is largest
    found = {
        "printed stress": float(printed()["pull_force"].max() / 25),
        "printed stress in theory": float(max(nominal_stress(x, 0.48) for x in np.linspace(1.05, 8.0, 140))),
    }
    for speed in (2000,) if quick else (2000, 1000):
        bar = torn(speed)
        whole = bar["crack_broken"] < 0.9 * 25  # before the halves swing
        peak = bar["pull_force"][whole].argmax()
        found[f"force, {speed} mm/s"] = float(bar["pull_force"][peak] / (5.0 * 25))
        found[f"way, {speed} mm/s"] = float(bar["pull_displacement"][peak] / way)
        found[f"work, {speed} mm/s"] = float(bar["energy_fracture"][-1] / (28.3 * 25))
    return found


# ## Beam, block


def rigid_ends(quick: bool) -> dict[str, float]:
    """J of the ends over the work of the bond up to the opening of the tip."""
    steps = {"parameters.opening": "0.036", "steps.first": "0.004", "steps.largest": "0.004"}
    found = {}
    for size in ("1.0",) if quick else ("1.0", "0.5"):
        history = rows("dcb-force", **steps, **{"mesh.set.lc": size})
        found[f"J, {size} mm"] = float(history["J"][-1] / history["J_of_opening"][-1])
    return found


def sheared_off(quick: bool) -> dict[str, float]:
    """Work of the bond, drag at the end, and heat in both bodies, over theory."""
    found = rows("sheared-off", **{"steps.first": "0.2", "steps.largest": "0.2"})
    heat = sum(
        0.1 * area * (found[f"{body}_temperature"][-1] - 273.15) for body, area in (("block", 25), ("slab", 100))
    )
    return {
        "work": float(found["energy_fracture"][-1] / (0.2 * 10)),
        "drag": float(found["drive_force"][-1] / (0.1 * found["press_force"][-1])),
        "heat": float(heat / (found["energy_fracture"][-1] + found["energy_friction"][-1])),
    }


# ## Indentation


def layer(aspect: float, poisson: float, bonded: bool, n: int) -> float:
    """Force of a flat punch of radius 1 on a layer of thickness 1/aspect, over that on a half-space.

    There are n cells of degree 2 under the punch, and the layer ends after 25 of its radii: after 11, one that slides
    is softer by 0.3 %.
    """
    depth, height = 1e-3, 1 / aspect
    domain = rectangle([(0, 0), (2, 1)], (2 * n, n))
    x = domain.geometry.x  # cells shrink to the edge of the punch from both sides, and to the surface
    x[:, 0] = np.where(x[:, 0] <= 1, 1 - (1 - x[:, 0]) ** 2, 1 + (np.exp(3.2 * (x[:, 0] - 1) ** 2) - 1))
    x[:, 1] = -height * x[:, 1] ** 2
    b = Body(domain, 2)
    pressed = b.hold(lambda x: np.isclose(x[1], 0) & (x[0] <= 1 + 1e-9), 1, lambda t: -depth * t, "punch")
    supports = [b.hold(at(0, 0), 0), b.hold(at(1, -height), 1), pressed]
    if bonded:
        supports.append(b.hold(at(1, -height), 0))
    last = final(Mechanics(b.state, [Solid(b.state, LinearElastic(1.0, poisson))], supports), step=1.0)
    return -last["punch_force"] * (1 - poisson) / (4 * depth / (2 * (1 + poisson)))


def indentation(quick: bool) -> dict[str, float]:
    """Factors of layers, bonded and sliding, of elements and of the integral equation."""
    found = {}
    for aspect, n in product((1.0,) if quick else (0.4, 1.0), (16,) if quick else (8, 16)):
        found[f"bonded, a/h = {aspect}, {n}"] = layer(aspect, 0.4, True, n)
        found[f"sliding, a/h = {aspect}, {n}"] = layer(aspect, 0.4, False, n) / layer_factor(aspect, 0.4, bonded=False)
    return found


PROBLEMS: Mapping = {
    "boxes": boxes, "tear": tear, "rigid ends": rigid_ends, "sheared off": sheared_off, "indentation": indentation,
}  # fmt: skip

if __name__ == "__main__":
    solve("thesis", PROBLEMS)
