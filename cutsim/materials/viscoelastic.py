"""Quasi-linear viscoelasticity: the relaxation function as a Prony series (docs/materials.md).

The second Piola–Kirchhoff stress S of the fully integrated part of a strain energy relaxes, that of the volumetric part
does not:

    S_total(t) = S(t) + Σ hᵢ(t),    hᵢ(t) = ∫ gᵢ exp(−(t−s)/τᵢ) dS(s),

so that the parameters of the material are those of slow deformation.
"""

from dataclasses import dataclass

import numpy as np

from cutsim.base.arrays import Array
from cutsim.base.checks import positive, require_numbers
from cutsim.base.signatures import checked
from cutsim.base.units import Time


@checked
@dataclass(frozen=True)
class Prony:
    """Relaxation function 1 + Σ gᵢ exp(−t/τᵢ), relative to the relaxed stress.

    A series 1 − Σ g'ᵢ (1 − exp(−t/τᵢ)) relative to the instantaneous stress has gᵢ = g'ᵢ/(1 − Σ g'ᵢ), with moduli of
    the material 1 − Σ g'ᵢ times the instantaneous ones.

    Args:
        strengths: gᵢ > 0, one for each term [–].
        times: Relaxation times τᵢ > 0 [time].

    Raises:
        ValueError: A number is outside its range, or there are not as many strengths as times.
    """

    strengths: tuple[float, ...]
    times: tuple[Time, ...]

    def __post_init__(self) -> None:
        require_numbers("strengths", self.strengths, positive)
        require_numbers("times", self.times, positive, len(self.strengths))

    def factors(self, dt: float) -> tuple[Array, Array]:
        """Decay of each overstress over a step, and the fraction of the change of stress that it takes up."""
        x = dt / np.array(self.times)
        return np.exp(-x), -np.array(self.strengths) * np.expm1(-x) / x
