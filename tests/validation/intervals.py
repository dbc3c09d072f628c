# # Intervals of fitted constants
#
# A hundred tests of a material are made with noise of 2 % of the largest stress, and its constants are fitted to each
# of them.  The interval of 95 % that a fit states has to hold the true constant in about 95 of the hundred fits: with
# 100 trials, 90 to 99 are within chance.  Intervals are exact where the stress is linear in the constants; with four
# constants of a sum of powers they need not be.

from collections import Counter

import numpy as np
from _problems import solve

from cutsim import MooneyRivlin, NeoHookean, Ogden
from cutsim.base.parameters import numbers
from cutsim.identify.fitting import fit_model
from cutsim.identify.response import HomogeneousResponse

RANGES = {"uniaxial": (0.6, 2.5), "equibiaxial": (1.0, 2.0), "pure shear": (1.0, 2.5)}
TRIALS = {
    "neo-Hookean": (NeoHookean(0.7, 0.45), {"young": 0.4}, ["uniaxial"]),
    "Mooney-Rivlin": (MooneyRivlin(0.3, 0.1, 4.0), {"c1": 0.2, "c2": 0.2}, ["uniaxial"]),
    "Ogden-2": (
        Ogden((0.5, 0.3), (1.3, -2.0), 2.0),
        {"moduli[0]": 0.4, "moduli[1]": 0.4, "exponents[0]": 2.0, "exponents[1]": -3.0},
        list(RANGES),
    ),
}


def trials(case: str) -> tuple[Counter, Counter, int]:
    """How often the true constants are inside, mean widths of the intervals over them, and fits that are in doubt."""
    solid, guess, paths = TRIALS[case]
    response = HomogeneousResponse(solid, [(path, np.linspace(*RANGES[path], 25)) for path in paths])
    exact = response.stress({})
    weights = np.repeat(1 / np.abs(exact.reshape(-1, 25)).max(axis=1), 25)
    rng, inside, widths, doubts = np.random.default_rng(1), Counter(), Counter(), 0
    for _ in range(100):
        data = exact + 0.02 / weights * rng.standard_normal(len(weights))
        fit = fit_model(response.stress, guess, data, weights=weights)
        doubts += fit.systematic
        for parameter, (low, high) in fit.intervals().items():
            inside[parameter] += low <= numbers(solid)[parameter] <= high
            widths[parameter] += (high - low) / abs(numbers(solid)[parameter]) / 100
    return inside, widths, doubts


def coverage(case: str) -> dict[str, float]:
    """The constant that is inside least often."""
    return {"inside": float(min(trials(case)[0].values()))}


PROBLEMS = {case: lambda quick, case=case: coverage(case) for case in TRIALS}

if __name__ == "__main__":
    solve("intervals", PROBLEMS)
