"""Materials and cohesive laws that many tests share."""

from cutsim.interface.cohesive import Bilinear, Exponential
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
