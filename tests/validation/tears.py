# # Peeling and tearing
#
# Built-in cases of soft bodies that come apart, against energy balances of fracture mechanics that know force and
# stretch alone.
#
# - *Peel*: two glued strips are peeled off each other in a T.  In steady peeling each unit of glue lengthens the two
#   strips by its own length under the force $F$ per width, and stores $F^2/(2E'h)$ in each of them (Rivlin 1944;
#   Kendall 1975): $2F + F^2/(E'h) = G_c$.
# - *Pure shear*: a wide sheet with a cut in its edge, stretched between two grips at a distance $l_0$, tears once the
#   strain energy of a strip ahead of the cut is the toughness, $W(\lambda)\,l_0 = G_c$ (Rivlin and Thomas 1953).

import numpy as np
from _problems import solve
from mpi4py import MPI
from scipy.optimize import brentq, minimize_scalar
from thesis import rows

COMM = MPI.COMM_WORLD


def peel(quick: bool) -> dict[str, float]:
    """Toughness by the mean force of steady peeling, over that put in."""
    modulus, height, toughness, found = 1 / (1 - 0.45**2), 1.5, 0.1, {}
    for size in ("0.4",) if quick else ("0.4", "0.2"):
        length = {"parameters.opening": "36", "mesh.set.tail": "32"}  # bending at the grips dies out
        history = rows("peel", **length, **{"mesh.set.fine": size})
        opening, force = history["pull_displacement"] * 2, history["pull_force"]
        steady = opening > 0.9 * opening[-1]
        mean = np.trapezoid(force[steady], opening[steady]) / np.ptp(opening[steady])
        found[f"{size} mm"] = float((2 * mean + mean**2 / (modulus * height)) / toughness)
    return found


def pure_shear(quick: bool) -> dict[str, float]:
    """Stretch less 1 at which the tear begins to run, over that of the energy balance."""
    young, poisson, length, toughness, found = 1.0, 0.45, 20.0, 1.0, {}
    shear, lame = young / (2 * (1 + poisson)), young * poisson / ((1 + poisson) * (1 - 2 * poisson))

    def energy(stretch: float) -> float:
        def of_thickness(thickness: float) -> float:
            volume = stretch * thickness
            first = stretch**2 + 1 + thickness**2
            return shear / 2 * (first - 3) - shear * np.log(volume) + lame / 2 * np.log(volume) ** 2

        return minimize_scalar(of_thickness, bounds=(0.3, 1.2), method="bounded").fun

    stretch = brentq(lambda x: energy(x) * length - toughness, 1.01, 2.0)
    for size in ("1.0",) if quick else ("1.0", "0.5"):
        history = rows("fast-tear", **{"mesh.set.lc": size, "parameters.stretch": "0.35", "steps.largest": "3e-4"})
        front = np.abs(history["front"] - history["front"][0])
        begun = int(np.argmax(front > 2.0))
        found[f"{size} mm"] = float(2 * history["pull_displacement"][begun] / length / (stretch - 1))
    return found


PROBLEMS = {"peel": peel, "pure shear": pure_shear}

if __name__ == "__main__":
    solve("tears", PROBLEMS)
