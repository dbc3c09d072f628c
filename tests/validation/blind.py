# # Parameters from curves that another model has made
#
# A fit of a curve by the model that made it says how noise shifts the parameters, and no more.  Here a curve of a blade
# cut with an exponential bond is made on finer elements of degree 2.  Two of toughness, friction and strength are found
# from it, with the third one known, on coarser elements of degree 1, with the exponential and with a bilinear bond,
# with noise of 1 and of 3 % of the largest force.  One curve does not determine all three (docs/identification.md).
# What mesh and law do is no noise: the intervals, which are of noise, need not hold the truth.  A fit can see it in
# residuals that are systematic.

import logging
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from _problems import solve
from identify_silicone import COMM, MESH, TALL, cut

from cutsim import Bilinear, CohesiveLaw, Exponential, NeoHookean, read_geo
from cutsim.identify import fit_simulation

logging.getLogger("cutsim").setLevel(logging.ERROR)
SOLID = NeoHookean(0.777, 0.45)
TRUE = {"toughness": 0.3, "friction": 0.1, "strength": 0.4}
GUESS = {"toughness": 0.4, "friction": 0.15, "strength": 0.5}
COARSE, FINE = 0.1, 0.075  # elements [mm]


def exponential(values: dict[str, float]) -> CohesiveLaw:
    """The law that makes the curves."""
    return Exponential(strength=values["strength"], toughness=values["toughness"])


def bilinear(values: dict[str, float]) -> CohesiveLaw:
    """The other law; it is intact up to a tenth of its last opening."""
    strength, toughness = values["strength"], values["toughness"]
    return Bilinear(10 * strength**2 / (2 * toughness), strength, toughness, strength, toughness)


class Model:
    """Depth and force of a cut for parameters, on elements of some size [mm] and degree."""

    def __init__(self, law: Callable[[dict[str, float]], CohesiveLaw], size: float, degree: int = 1) -> None:
        self._specimen = replace(TALL[True], mesh=TALL[True].mesh | {"lc": size}, step=size)
        self._domain = read_geo(MESH, COMM, self._specimen.mesh, gdim=2)
        self._law, self._degree = law, degree

    def __call__(self, values: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
        return cut(self._domain, self._specimen, SOLID, self._law(values), values["friction"], degree=self._degree)


def recovered(truth: Model, model: Model, noise: float, unknown: tuple[str, str]) -> dict[str, float]:
    """Parameters over those that made the curve, how many intervals hold the truth, and whether the fit has a doubt."""
    depth, force = truth(TRUE)
    x = np.linspace(depth[0], 0.99 * depth[-1], 60)
    measured = np.interp(x, depth, force) + noise * force.max() * np.random.default_rng(3).standard_normal(60)
    guess = {name: GUESS[name] for name in unknown}
    bounds = {"friction": (0.0, 1.0)} if "friction" in unknown else {}
    fit = fit_simulation(
        lambda values: model(TRUE | values), guess, x, measured, bounds=bounds, step=0.05, tolerance=1e-2
    )
    held = {name: low <= TRUE[name] <= high for name, (low, high) in fit.intervals().items()}
    widths = {f"{name}_width": (high - low) / TRUE[name] for name, (low, high) in fit.intervals().items()}
    shares = {name: value / TRUE[name] for name, value in fit.values.items()}
    missed = float(not all(held.values()) and not fit.systematic)
    return {**shares, **widths, "held": float(sum(held.values())), "doubt": float(fit.systematic), "missed": missed}


FRICTION, STRENGTH = ("toughness", "friction"), ("toughness", "strength")


def same(quick: bool) -> dict[str, float]:
    """The model itself."""
    return recovered(Model(exponential, COARSE), Model(exponential, COARSE), 0.01, FRICTION)


def mesh(quick: bool) -> dict[str, float]:
    """Another mesh."""
    return recovered(Model(exponential, FINE, 2), Model(exponential, COARSE), 0.01, FRICTION)


def law(quick: bool) -> dict[str, float]:
    """Another law."""
    return recovered(Model(exponential, COARSE), Model(bilinear, COARSE), 0.01, FRICTION)


def both(quick: bool) -> dict[str, float]:
    """Another mesh and another law, with more noise."""
    return recovered(Model(exponential, FINE, 2), Model(bilinear, COARSE), 0.03, FRICTION)


def strength(quick: bool) -> dict[str, float]:
    """Another mesh and another law: toughness and strength, with the friction known."""
    return recovered(Model(exponential, FINE, 2), Model(bilinear, COARSE), 0.01, STRENGTH)


PROBLEMS = {"same": same, "mesh": mesh, "law": law, "both": both, "strength": strength}

if __name__ == "__main__":
    solve("blind", PROBLEMS)
