"""One example of each law, tool, material and step control: a line here is the whole test of a new class.

The tests of tangents, paths, dissipation, distances, energies and bad values try what stands in these lists. The pages
docs/adding_a_….md say what an entry needs.
"""

from dataclasses import dataclass
from itertools import chain

import numpy as np

from cutsim.analysis.stepping import StepControl
from cutsim.interface.cohesive import CohesiveLaw
from cutsim.materials.anisotropic import FungOrthotropic, TransverselyIsotropic
from cutsim.materials.elastic import IsochoricNeoHookean, LinearElastic, NeoHookean, StVenantKirchhoff
from cutsim.materials.fibres import DispersedFibres, EllipsoidalFibres, ExponentialFibres, Reinforced
from cutsim.materials.orthotropic import Orthotropic
from cutsim.materials.rubbers import ArrudaBoyce, IsochoricOgden, MooneyRivlin, Ogden, Yeoh
from cutsim.tools.needle_tips import BevelNeedle, HollowNeedle
from cutsim.tools.pointed import Blade, Needle
from cutsim.tools.shapes import Ball, FlatPunch, Plane
from helpers.laws import BILINEAR, EXPONENTIAL, NU, POLYNOMIAL, PPR, PROPORTIONAL, TRAPEZOIDAL, E

# -- cohesive laws ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Bond:
    """A cohesive law and the jump about which it is tried.

    Attributes:
        law: The law.
        jump: Sliding and opening near the peaks.  0.7 to 1.8 of it does not break the bond nor lie at a kink; 7 times
            the sliding and 14 times the opening break it.  None for the peaks of the pure modes.
    """

    law: CohesiveLaw
    jump: tuple[float, float] | None = None

    @property
    def scale(self):
        """Sliding and opening to try: the jump, or the peaks."""
        if self.jump is not None:
            return self.jump
        way = np.linspace(0, 8, 8001) * self.law.opening
        pulls = (self.law.secants(0 * way, way)[1] * way, self.law.secants(way, 0 * way)[0] * way)
        return tuple(float(way[np.argmax(pull)]) for pull in pulls)


LAWS = {
    "exponential": Bond(EXPONENTIAL),
    "bilinear": Bond(BILINEAR, (0.05, 0.02)),
    "proportional": Bond(PROPORTIONAL, (0.05, 0.02)),
    "ppr": Bond(PPR),
    "polynomial": Bond(POLYNOMIAL),
    "trapezoidal": Bond(TRAPEZOIDAL, (0.16, 0.16)),
}

# -- tools ------------------------------------------------------------------------------------------------------------

# shape, and a reference point from which it dips into the plane y = 1 (z = 1) at different depths along it
TOOLS = {
    "blade": (Blade(0.4, 0.3, 0.6), (0.4, 0.9)),
    "half blade": (Blade(0.4, 0.3, 0.6, side=1), (0.4, 0.9)),
    "blade ground on one side": (Blade(0.5, 0.25, 0.6, back_angle=0.0), (0.4, 0.9)),
    "cylinder": (Ball(0.8), (0.3, 1.7)),
    "punch": (FlatPunch(0.7, 0.2), (0.15, 0.9)),
    "plane": (Plane((0.1, -1.0)), (0.5, 0.97)),
    "blade in 3-D": (Blade(0.4, 0.3, 0.6, (0.0, 0.0, -1.0), (1.0, 0.0, 0.0)), (0.4, 0.5, 0.9)),
    "blade with ends": (
        Blade(0.4, 0.2, 0.6, (0.0, 0.0, -1.0), (1.0, 0.0, 0.0), back_angle=0.5, edge_length=0.8),
        (0.4, 0.5, 0.9),
    ),
    "sphere": (Ball(0.8), (0.3, 0.4, 1.7)),
    "cylinder in 3-D": (Ball(0.8, (1.0, 0.2, 0.1)), (0.3, 0.4, 1.7)),
    "punch in 3-D": (FlatPunch(0.5, 0.2, (0.0, 0.0, -1.0)), (0.1, 0.2, 0.93)),
    "needle in 3-D": (Needle(0.4, 0.2, 0.5, (0.0, 0.0, -1.0)), (0.4, 0.45, 0.9)),
    "hollow needle in 3-D": (HollowNeedle(0.45, 0.1, 0.1, (0.0, 0.0, -1.0)), (0.3, 0.4, 0.95)),
    "bevel needle": (BevelNeedle(0.9, 0.5, 0.1), (0.85, 0.45, 0.85)),
    "plane in 3-D": (Plane((0.1, 0.1, -1.0)), (0.5, 0.5, 0.97)),
}

# -- materials --------------------------------------------------------------------------------------------------------

MOONEY = MooneyRivlin(0.3, 0.1, 4.0)
# W'(I₁), a function of the first invariant, and W'(I₂), a number
INVARIANTS = {
    IsochoricNeoHookean(E, NU): (lambda I1: 0.25 * E / (1 + NU), 0.0),
    MOONEY: (lambda I1: 0.3, 0.1),
    Yeoh(0.3, -0.05, 0.02, 4.0): (lambda I1: 0.3 - 0.1 * (I1 - 3) + 0.06 * (I1 - 3) ** 2, 0.0),
    ArrudaBoyce(0.4, 8.0, 4.0): (
        lambda x: 0.4 * (0.5 + x / 80 + 33 * x**2 / 67200 + 76 * x**3 / 3584000 + 2595 * x**4 / 2759680000),
        0.0,
    ),
}
TWO_CONSTANTS = [kind(E, NU) for kind in (NeoHookean, StVenantKirchhoff, LinearElastic)]
ISOTROPIC = [
    *TWO_CONSTANTS,
    *INVARIANTS,
    Ogden((0.5, 0.3), (1.3, -2.0), 2.0),
    IsochoricOgden((0.5, 0.3), (1.3, -2.0), 4.0),
]
AXIS = (0.6, 0.8, 0.0)
ORTHOTROPIC = Orthotropic(4.0, 1.0, 2.0, 0.3, 0.25, 0.2, 0.7, 0.9, 0.4, (AXIS, (-0.8, 0.6, 0.0)))
ANISOTROPIC = [
    TransverselyIsotropic(AXIS, 1.0, 0.3, 4.0, 0.2, 0.7),
    ORTHOTROPIC,
    FungOrthotropic(0.2, (3.0, 2.0, 1.5), (0.5, 0.4, 0.3), (1.0, 0.8, 0.9), 4.0, (AXIS, (-0.8, 0.6, 0.0))),
    Reinforced(MOONEY, (ExponentialFibres(AXIS, 0.8, 0.5, 2.5),)),
    Reinforced(NeoHookean(E, NU), (DispersedFibres(AXIS, 0.8, 0.5, 0.1), DispersedFibres((0.0, 0.6, 0.8), 0.8, 0.5))),
    Reinforced(NeoHookean(E, NU), (EllipsoidalFibres((0.1, 0.2, 0.3), 2.5),)),
]
MATERIALS = [*ISOTROPIC, *ANISOTROPIC]

# -- step controls ----------------------------------------------------------------------------------------------------

CONTROLS = {"doubling": StepControl(first=0.1, largest=0.4, smallest=0.01)}


def instances():
    """All examples, and the fibres in the materials, by the name of their class; the first one of each."""
    fibres = chain.from_iterable(getattr(material, "fibres", ()) for material in MATERIALS)
    laws, tools = (bond.law for bond in LAWS.values()), (shape for shape, _ in TOOLS.values())
    found = {}
    for thing in chain(laws, tools, MATERIALS, fibres, CONTROLS.values()):
        found.setdefault(type(thing).__name__, thing)
    return found
