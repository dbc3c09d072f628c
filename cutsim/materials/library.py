"""Named rubbers and tissues with published values (docs/materials.md).

Units are N, mm, MPa.  A name gives a `Record`: the material, a strength where one is known, and the source.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import cos, radians, sin
from types import MappingProxyType

from cutsim.base.checks import require
from cutsim.materials.elastic import IsochoricNeoHookean, Material, NeoHookean
from cutsim.materials.fibres import DispersedFibres, Reinforced
from cutsim.materials.rubbers import ArrudaBoyce, Ogden

#: Poisson's ratio given to solids that their source takes to be incompressible.
INCOMPRESSIBLE = 0.495


@dataclass(frozen=True)
class Record:
    """A material with published values.

    Args:
        material: The material [MPa].
        source: Where the values are from, and what has been added to them.
        strength: Normal and tangential strength of a cut through it [MPa]; None if the source gives none.
    """

    material: Material
    source: str
    strength: float | None = None


def material(name: str) -> Record:
    """A named rubber or tissue.

    Args:
        name: A key of `LIBRARY`.

    Raises:
        ValueError: The name is unknown; the message lists those there are.
    """
    require("name", name, name in LIBRARY, "one of " + ", ".join(LIBRARY))
    return LIBRARY[name]


def _silicone(young: float, poisson: float, strength: float) -> Record:
    """One of the silicone rubbers that the thesis made and cut."""
    return Record(NeoHookean(young, poisson), "thesis, table 5.1", strength)


def _skin(c10: float, bulk: float) -> Record:
    """A layer of skin, W = C₁₀ (Ī₁−3) + volumetric part."""
    source = (
        "Tran, Charleux, Rachik, Ehrlacher, Ho Ba Tho, Computer Methods in Biomechanics and Biomedical Engineering 10"
        " (2007) 401: human forearm in vivo, indentation with magnetic resonance imaging"
    )
    return Record(IsochoricNeoHookean.from_moduli(2 * c10, bulk), source)


def _bulk(shear: float) -> float:
    """Bulk modulus that goes with a shear modulus for ν = 0.495."""
    return 2 * shear * (1 + INCOMPRESSIBLE) / (3 * (1 - 2 * INCOMPRESSIBLE))


def _artery(shear: float, k1: float, k2: float, angle: float, dispersion: float, source: str) -> Record:
    """Two families of fibres at ± an angle [degrees] from the circumference, x; the vessel runs along y."""
    families = [(cos(radians(angle)), sign * sin(radians(angle)), 0.0) for sign in (1, -1)]
    fibres = tuple(DispersedFibres(a, k1, k2, dispersion) for a in families)
    matrix = IsochoricNeoHookean.from_moduli(shear, _bulk(shear))
    return Record(Reinforced(matrix, fibres), f"{source}; nu = {INCOMPRESSIBLE} of the matrix added")


def _gelatin(young: float) -> Record:
    """Gelatin by the mass ratio of powder to water, loaded fast."""
    source = (
        f"Bonavia et al., arXiv:2512.20502 (2025): instantaneous stiffness in compression; nu = {INCOMPRESSIBLE} added"
    )
    return Record(IsochoricNeoHookean(young, INCOMPRESSIBLE), source)


_NATURAL_RUBBER = Record(
    # μₚ = 0.63, 0.0012, −0.01 MPa with α = 1.3, 5, −2
    Ogden.from_poisson((0.63 * 1.3, 0.0012 * 5.0, 0.01 * 2.0), (1.3, 5.0, -2.0), INCOMPRESSIBLE),
    "Ogden, Proceedings of the Royal Society A 326 (1972) 565, for data of Treloar (1944); nu = 0.495 added",
)
_EIGHT_CHAINS = Record(
    ArrudaBoyce(0.27, 26.5, _bulk(0.27)),
    "Arruda and Boyce, Journal of the Mechanics and Physics of Solids 41 (1993) 389, for data of Treloar (1944);"
    " bulk modulus for nu = 0.495 added",
)

#: Records by name.
LIBRARY: Mapping[str, Record] = MappingProxyType(
    {
        "silicone 1": _silicone(0.777, 0.48, 0.61477),
        "silicone 2": _silicone(0.527, 0.35, 0.34235),
        "silicone 3": _silicone(0.813, 0.43, 0.79311),
        "silicone 4": _silicone(0.723, 0.41, 0.59311),
        "natural rubber, Ogden": _NATURAL_RUBBER,
        "natural rubber, Arruda-Boyce": _EIGHT_CHAINS,
        "epidermis": _skin(0.12, 5.45),
        "dermis": _skin(1.11, 29.6),
        "hypodermis": _skin(0.42e-3, 36.0e-3),
        "gelatin 1:2": _gelatin(0.277),
        "gelatin 1:20": _gelatin(4.34e-3),
        "iliac adventitia": _artery(
            7.64e-3, 0.9966, 524.6, 49.98, 0.226, "Gasser, Ogden, Holzapfel, J. R. Soc. Interface 3 (2006) 15: human"
        ),
        "carotid media": _artery(
            3.0e-3, 2.3632e-3, 0.8393, 29.0, 0.0, "Holzapfel, Gasser, Ogden, Journal of Elasticity 61 (2000) 1: rabbit"
        ),
    }
)
