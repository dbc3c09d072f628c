"""Library of named rubbers and tissues with published values (docs/materials.md).

Units are N, mm, MPa.  A name gives a `Record`: the material, a strength where one is known, and the source.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import cos, radians, sin
from types import MappingProxyType

from cutsim.base.checks import require
from cutsim.materials.elastic import IsochoricNeoHookean, Material, NeoHookean
from cutsim.materials.fibres import DispersedFibres, Reinforced
from cutsim.materials.rubbers import ArrudaBoyce, MooneyRivlin, Ogden

#: Poisson's ratio given to solids that their source takes to be incompressible.
INCOMPRESSIBLE = 0.495
#: Poisson's ratio assumed for the epidermis.
EPIDERMIS_POISSON = 0.48


@dataclass(frozen=True)
class Record:
    """A material of the library, with its source.

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


_TRAN = (
    "Tran, Charleux, Rachik, Ehrlacher, Ho Ba Tho, Computer Methods in Biomechanics and Biomedical Engineering 10"
    " (2007) 401: human forearm in vivo, indentation with magnetic resonance imaging"
)


def _skin(c10: float, bulk: float) -> Record:
    """Skin in three layers, W = C₁₀ (Ī₁−3) + volumetric part."""
    return Record(IsochoricNeoHookean.from_moduli(2 * c10, bulk), _TRAN)


def _epidermis(young: float) -> Record:
    """A layer of the epidermis."""
    source = (
        "Geerligs, van Breemen, Peters, Ackermans, Baaijens, Oomens, Journal of Biomechanics 44 (2011) 1176: 1 to 2 MPa"
        " in indentation of stratum corneum and epidermis, without a difference between them; order within this range"
        f" and nu = {EPIDERMIS_POISSON} assumed"
    )
    return Record(NeoHookean(young, EPIDERMIS_POISSON), source)


def _dermis(fraction: float, added: str) -> Record:
    """A layer of the dermis, one term of Ogden with a fraction of the modulus of the stiff one."""
    # E = 3/2 μ is the initial slope of 1.18 MPa, and P = μ/m (λ^(m−1) − λ^(−m/2−1)) = 21.6 MPa at λ = 1.54
    source = (
        "Ni Annaidh, Bruyere, Destrade, Gilchrist, Ottenio, Journal of the Mechanical Behavior of Biomedical Materials"
        " 5 (2012) 139: mean initial slope, strength and failure strain of human skin from the back in tension; one"
        f" term through them{added}; nu = {INCOMPRESSIBLE} added"
    )
    return Record(Ogden.from_poisson((fraction * 1.18 / 1.5,), (14.93,), INCOMPRESSIBLE), source)


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
        "stratum corneum": _epidermis(2.0),
        "stratum lucidum": _epidermis(1.75),
        "stratum granulosum": _epidermis(1.5),
        "stratum spinosum": _epidermis(1.25),
        "stratum basale": _epidermis(1.0),
        "papillary dermis": _dermis(0.25, ", of which a quarter of the modulus is assumed"),
        "reticular dermis": _dermis(1.0, ""),
        "hypodermis": Record(MooneyRivlin(0.21e-3, 0.21e-3, 36.0e-3), f"{_TRAN}; C10 = 0.42 kPa in two equal parts"),
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

#: Thickness of the layers of skin from the surface downwards [mm], for the records of the same names.  Epidermis 0.1
#: and dermis 1 as in the thesis (section 2.3), a fifth of the dermis papillary as anatomy has it.  Assumed are the
#: hypodermis and how the epidermis is shared (10 to 15 µm of stratum corneum are usual; only thick skin has a lucidum).
SKIN: Mapping[str, float] = MappingProxyType(
    {
        "stratum corneum": 0.015,
        "stratum lucidum": 0.010,
        "stratum granulosum": 0.015,
        "stratum spinosum": 0.050,
        "stratum basale": 0.010,
        "papillary dermis": 0.2,
        "reticular dermis": 0.8,
        "hypodermis": 0.9,
    }
)
