"""Materials and cohesive laws that many tests share."""

from dataclasses import dataclass

from cutsim.base.checks import positive, require_number
from cutsim.base.functions import if_less, larger, positive_part, sqrt
from cutsim.interface.cohesive import Bilinear, Exponential
from cutsim.interface.polynomial import Polynomial
from cutsim.interface.ppr import ParkPaulinoRoesler
from cutsim.materials.elastic import LinearElastic

E, NU = 2.0, 0.3
ELASTIC = LinearElastic(E, NU)
# φ_n = 1 and φ_t = ½, the set of the path values in the theory
EXPONENTIAL = Exponential(toughness=1.0, opening=0.1, shear_toughness=0.5, shear_opening=0.2)
BILINEAR = Bilinear(penalty=200.0, strength=2.0, toughness=0.2, shear_strength=3.0, shear_toughness=0.5, eta=1.7)
PROPORTIONAL = Bilinear.proportional(
    penalty=200.0, strength=2.0, toughness=0.2, shear_strength=3.0, shear_toughness=0.5, eta=1.7
)
PPR = ParkPaulinoRoesler(
    strength=2.0, toughness=0.2, shear_strength=3.0, shear_toughness=0.5, alpha=3.0, beta=2.2, peak=0.15, shear_peak=0.2
)
POLYNOMIAL = Polynomial(strength=2.0, toughness=0.2, shear_strength=3.0, shear_toughness=0.5)


@dataclass(frozen=True)
class Trapezoidal:
    """Trapezoidal law (Tvergaard and Hutchinson 1992), the same in opening and sliding, with three kinks.

    The traction rises to the strength at δ_1, stays there up to δ_2 and falls to zero at δ_c.
    """

    strength: float = 2.0
    rise: float = 0.1
    plateau: float = 0.25
    final: float = 0.4

    def __post_init__(self):
        for name, value in vars(self).items():
            require_number(name, value, positive)

    @property
    def opening(self):
        return self.rise

    @property
    def toughness(self):
        return 0.5 * self.strength * (self.final + self.plateau - self.rise)

    @property
    def shear_toughness(self):
        return self.toughness

    def secants(self, opening, sliding):
        jump = sqrt(opening**2 + sliding**2 + (1e-8 * self.rise) ** 2)
        held = self.strength / larger(jump, self.rise)
        falling = self.strength * positive_part(self.final - jump) / ((self.final - self.plateau) * jump)
        k = if_less(jump, self.plateau, held, falling)
        return k, k

    @property
    def characteristic_secants(self):
        return self.strength / self.rise, self.strength / self.rise


TRAPEZOIDAL = Trapezoidal()
