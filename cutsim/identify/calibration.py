"""Calibration of a material: its parameters from stress–stretch tests."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from cutsim.base.checks import positive, require, require_number
from cutsim.base.parameters import numbers, with_numbers
from cutsim.base.signatures import checked
from cutsim.identify.fitting import Bounds, Fit, Parameters, fit_model, require_pairs
from cutsim.identify.response import HomogeneousResponse, nominal_stress, unstable_stretches
from cutsim.materials.elastic import Material
from cutsim.results.plots import Curve, plot_curves

logger = logging.getLogger(__name__)
Offset = Literal["strain", "stress"]
#: Sizes from which offsets are looked for: a per cent of stretch, or of the largest stress.
_ZEROS: dict[str, Callable[[StressTest], float]] = {
    "strain": lambda test: 0.01,
    "stress": lambda test: 0.01 * float(np.abs(test.stress).max()) or 1.0,
}
# smallest stretch that the search for an offset may try
_LEAST = 1e-3


@checked
@dataclass(frozen=True)
class StressTest:
    """Nominal stress measured against stretch.

    Args:
        path: "uniaxial", "equibiaxial" or "pure shear".
        stretch: Stretches λ₁ = 1 + engineering strain.
        stress: Nominal stress, force over initial area [stress].
        weight: Factor on its residuals, such as one over the largest stress, where tests of different sizes shall count
            alike.

    Raises:
        ValueError: There are not as many stresses as stretches, a number is not finite, or the weight is not positive.
    """

    path: str
    stretch: NDArray[np.float64]
    stress: NDArray[np.float64]
    weight: float = 1.0

    def __post_init__(self) -> None:
        require_pairs("stretch", self.stretch, "stress", self.stress)
        require_number("weight", self.weight, positive)


@dataclass(frozen=True)
class MaterialFit:
    """A material fitted to tests.

    Attributes:
        material: The material with the fitted numbers.
        fit: The numbers that were fitted, their intervals and the quality of the fit.
        tests: The tests, with the offsets that were fitted taken off.
        unstable: Path -> smallest and largest stretch, within those measured, at which the material fails Drucker's
            criterion.
    """

    material: Material
    fit: Fit
    tests: tuple[StressTest, ...]
    unstable: dict[str, tuple[float, float]]

    def plot(self, path: Path | str, *, unit: str = "MPa", title: str = "") -> None:
        """Plot data and fit. Call it on one rank.

        Args:
            path: The file; its suffix tells the format.
            unit: Unit of stress.
            title: Text above the plot.
        """
        curves = []
        for test in self.tests:
            fine = np.linspace(min(1.0, test.stretch.min()), test.stretch.max(), 100)
            curves.append(Curve(fine, nominal_stress(self.material, test.path, fine), f"{test.path}, fit"))
            curves.append(Curve(test.stretch, test.stress, f"{test.path}, measured", "."))
        plot_curves(path, curves, xlabel="stretch [1]", ylabel=f"nominal stress [{unit}]", title=title)


@checked
def fit_material(
    guess: Material,
    vary: Sequence[str],
    tests: Sequence[StressTest],
    *,
    bounds: Bounds | None = None,
    offsets: Sequence[Offset] = (),
) -> MaterialFit:
    """Fit numbers of an incompressible material to one or several tests at once by least squares.

    A material that is unstable within the measured stretches is logged as a warning, and so are residuals that are not
    noise: then the model or the zero of a test is wrong, and no interval is right.

    Args:
        guess: Material with a first guess of the numbers, none zero, and the others fixed.
        vary: Names of the numbers to fit, as in `cutsim.base.parameters.numbers`: ``"c1"``, ``"moduli[0]"``,
            ``"matrix.young"``; or ``"moduli"`` for all of them.
        tests: The tests.
        bounds: Number -> lower and upper bound.
        offsets: What of the zeros of each test is fitted too.  "strain": the specimen was stretched by more than was
            measured, by a preload (> 0), or less, by slack (< 0), while which it carries nothing; "stress": a load cell
            that showed this without load.  They are called ``"strain_offset[0]"``, ``"stress_offset[0]"`` and so on, by
            the number of the test.

    Raises:
        ValueError: A name is unknown, the data do not determine a number, or the material refuses the result.
    """
    start = _varied(guess, vary)
    require("tests", len(tests), len(tests) > 0, "at least one test")
    require("offsets", offsets, set(offsets) <= set(_ZEROS), "of " + ", ".join(_ZEROS))
    response = HomogeneousResponse(guess, [(test.path, test.stretch) for test in tests])

    def model(values: Parameters) -> NDArray[np.float64]:
        stretch = np.concatenate([_carried(test, values, i) for i, test in enumerate(tests)])
        shown = [np.full(len(test.stretch), values.get(f"stress_offset[{i}]", 0.0)) for i, test in enumerate(tests)]
        return response.stress({name: values[name] for name in start}, stretch) + np.concatenate(shown)

    fit = fit_model(
        model,
        start | {f"{kind}_offset[{i}]": _ZEROS[kind](t) for kind in offsets for i, t in enumerate(tests)},
        np.concatenate([test.stress for test in tests]),
        weights=np.concatenate([np.full(len(test.stretch), test.weight) for test in tests]),
        bounds=bounds,
    )
    material = with_numbers(guess, {name: fit.values[name] for name in start})
    tests = [_corrected(test, fit.values, i) for i, test in enumerate(tests)]
    stretches = np.concatenate([[1.0], *(test.stretch for test in tests)])
    unstable = unstable_stretches(material, float(stretches.min()), float(stretches.max()))
    for path, (low, high) in unstable.items():
        name = type(material).__name__
        logger.warning("%s fails Drucker's criterion in %s at stretches from %.3g to %.3g", name, path, low, high)
    return MaterialFit(material, fit, tuple(tests), unstable)


def _carried(test: StressTest, values: Parameters, number: int) -> NDArray[np.float64]:
    """Stretches of the specimen with the offset of a test; while a specimen in tension or compression is slack, 1."""
    measured = np.asarray(test.stretch, dtype=np.float64)
    stretch = np.maximum(measured + values.get(f"strain_offset[{number}]", 0.0), _LEAST)
    if measured.min() >= 1:
        return np.maximum(stretch, 1.0)
    return np.minimum(stretch, 1.0) if measured.max() <= 1 else stretch


def _corrected(test: StressTest, values: Parameters, number: int) -> StressTest:
    return replace(
        test,
        stretch=_carried(test, values, number),
        stress=np.asarray(test.stress) - values.get(f"stress_offset[{number}]", 0.0),
    )


def _varied(guess: Material, vary: Sequence[str]) -> Parameters:
    """First guesses of the numbers that are to be fitted."""
    known = numbers(guess)
    start: Parameters = {}
    for name in vary:
        matching = {n: v for n, v in known.items() if n == name or n.startswith((f"{name}[", f"{name}."))}
        require("vary", name, bool(matching), "one of " + ", ".join(known))
        start |= matching
    return start
