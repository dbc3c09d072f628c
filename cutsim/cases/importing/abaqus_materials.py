"""Materials of Abaqus and their counterparts.

Abaqus writes the volumetric energy as (J−1)²/D, so that K = 2/D, the terms of Ogden's energy as 2 μᵢ/αᵢ² Σ λ̄^αᵢ, and
relaxation as a fraction of the instantaneous modulus; moduli are those of slow deformation unless it says otherwise.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from cutsim.cases.importing.abaqus_file import AbaqusFile
from cutsim.cases.importing.counterparts import Counterpart, distortion_scaled
from cutsim.cases.importing.draft import Untranslatable
from cutsim.materials.elastic import IsochoricNeoHookean, LinearElastic, Material, StVenantKirchhoff
from cutsim.materials.rubbers import ArrudaBoyce, IsochoricOgden, MooneyRivlin, Yeoh
from cutsim.materials.viscoelastic import Prony
from cutsim.readers.abaqus_cards import Card, real

#: Bulk modulus over shear modulus of what is incompressible in Abaqus (D = 0).
_INCOMPRESSIBLE = 1000.0
#: Bulk modulus over shear modulus from which the volumetric energies of both programs act the same.
_STIFF = 100.0
_OPTIONS = ("ELASTIC", "HYPERELASTIC", "DENSITY", "VISCOELASTIC")


@dataclass
class Definition:
    """Keywords that define a material.

    Attributes:
        head: Its ``*MATERIAL``.
        options: The keywords by name.
    """

    head: Card
    options: dict[str, Card] = field(default_factory=dict)


def definitions(file: AbaqusFile) -> dict[str, Definition]:
    """The materials of a file by their names in capitals."""
    found: dict[str, Definition] = {}
    current: Definition | None = None
    for located in file.cards:
        card = located.card
        if card.keyword == "MATERIAL":
            file.read(card)
            current = found.setdefault(card.needed("NAME").upper(), Definition(card))
        elif current is not None and card.keyword in _OPTIONS:
            file.read(card)
            current.options[card.keyword] = card
        elif card.keyword in ("STEP", "SOLID SECTION", "PART", "ASSEMBLY"):
            current = None
    return found


def counterpart(file: AbaqusFile, definition: Definition) -> Counterpart:
    """The counterpart of a material.

    Raises:
        Untranslatable: It has none.
        ValueError: A number is missing.
    """
    options = definition.options
    elastic = options.get("HYPERELASTIC") or options.get("ELASTIC")
    if elastic is None:
        raise Untranslatable("neither *ELASTIC nor *HYPERELASTIC", definition.head.line)
    material = _elastic(file, elastic)
    density = file.numbers(options["DENSITY"], 1)[0] if "DENSITY" in options else None
    if "VISCOELASTIC" not in options:
        return Counterpart(material, density=density)
    return _relaxing(file, material, elastic, options["VISCOELASTIC"], density)


def _elastic(file: AbaqusFile, card: Card) -> Material:
    make = _linear if card.keyword == "ELASTIC" else _hyperelastic
    if len(card.data) > 1 and "OGDEN" not in card.parameters and "YEOH" not in card.parameters:
        raise Untranslatable("it depends on temperature or on more", card.line)
    given = file.numbers(card, 1)
    try:
        return make(file, card, given)
    except ValueError as error:
        raise Untranslatable(str(error), card.line) from None


def _linear(file: AbaqusFile, card: Card, given: list[float]) -> Material:
    kind = card.get("TYPE").upper() or "ISOTROPIC"
    if kind not in ("ISOTROPIC", "ISO"):
        raise Untranslatable(f"TYPE={kind}", card.line)
    young, poisson = _padded(given, 2)
    if not file.large:
        return LinearElastic(young, poisson)
    file.draft.difference(card.line, "*ELASTIC: St Venant-Kirchhoff: the same as long as strains are small")
    return StVenantKirchhoff(young, poisson)


def _hyperelastic(file: AbaqusFile, card: Card, given: list[float]) -> Material:
    kinds = [kind for kind in _ENERGIES if kind in card.parameters]
    if not kinds or "TEST DATA INPUT" in card.parameters:
        raise Untranslatable(f"with {', '.join(card.parameters) or 'no energy'}", card.line)
    return _ENERGIES[kinds[0]](file, card, given)


def _bulk(file: AbaqusFile, card: Card, shear: float, constants: list[float]) -> float:
    """Bulk modulus of the constants D₁, D₂ …."""
    first = constants[0] if constants else 0.0
    if first <= 0:
        file.draft.difference(
            card.line, f"*HYPERELASTIC: incompressible: the bulk modulus is {_INCOMPRESSIBLE:g} G here"
        )
        return _INCOMPRESSIBLE * shear
    bulk = 2 / first
    if bulk < _STIFF * shear:
        file.draft.difference(
            card.line, "*HYPERELASTIC: the volumetric energy is K/2 (ln J)^2 in place of (J-1)^2/D: the same near J = 1"
        )
    if any(constants[1:]):
        file.draft.difference(card.line, "*HYPERELASTIC: D2 and more are left out")
    return bulk


def _neo_hooke(file: AbaqusFile, card: Card, given: list[float]) -> Material:
    c10, *volumetric = _padded(given, 2)
    return IsochoricNeoHookean.from_moduli(2 * c10, _bulk(file, card, 2 * c10, volumetric))


def _mooney_rivlin(file: AbaqusFile, card: Card, given: list[float]) -> Material:
    c10, c01, *volumetric = _padded(given, 3)
    return MooneyRivlin(c10, c01, _bulk(file, card, 2 * (c10 + c01), volumetric))


def _yeoh(file: AbaqusFile, card: Card, given: list[float]) -> Material:
    c10, c20, c30, *volumetric = _padded(given, 6)
    return Yeoh(c10, c20, c30, _bulk(file, card, 2 * c10, volumetric))


def _order(card: Card) -> int:
    text = card.get("N") or "1"
    if not text.isdecimal():
        raise ValueError(f"N = {text!r} is no number")
    return int(text)


def _reduced_polynomial(file: AbaqusFile, card: Card, given: list[float]) -> Material:
    order = _order(card)
    if order > 3:
        raise Untranslatable(f"REDUCED POLYNOMIAL with N = {order}", card.line)
    terms, volumetric = _padded(given, 2 * order)[:order], _padded(given, 2 * order)[order:]
    if order == 1:
        return _neo_hooke(file, card, [*terms, *volumetric])
    return _yeoh(file, card, [*_padded(terms, 3), *volumetric])


def _polynomial(file: AbaqusFile, card: Card, given: list[float]) -> Material:
    if _order(card) > 1:
        raise Untranslatable(f"POLYNOMIAL with N = {_order(card)}", card.line)
    return _mooney_rivlin(file, card, given)


def _ogden(file: AbaqusFile, card: Card, given: list[float]) -> Material:
    order = _order(card)
    given = _padded(given, 3 * order)
    moduli = tuple(2 * mu for mu in given[0 : 2 * order : 2])
    bulk = _bulk(file, card, sum(moduli) / 2, given[2 * order : 3 * order])
    return IsochoricOgden(moduli, tuple(given[1 : 2 * order : 2]), bulk)


def _arruda_boyce(file: AbaqusFile, card: Card, given: list[float]) -> Material:
    modulus, limit, *volumetric = _padded(given, 3)
    material = ArrudaBoyce(modulus, limit**2, 1.0)
    return ArrudaBoyce(modulus, limit**2, _bulk(file, card, material.shear, volumetric))


_ENERGIES: Mapping[str, Callable[[AbaqusFile, Card, list[float]], Material]] = MappingProxyType(
    {
        "NEO HOOKE": _neo_hooke,
        "MOONEY-RIVLIN": _mooney_rivlin,
        "YEOH": _yeoh,
        "REDUCED POLYNOMIAL": _reduced_polynomial,
        "POLYNOMIAL": _polynomial,
        "OGDEN": _ogden,
        "ARRUDA-BOYCE": _arruda_boyce,
    }
)


def _padded(numbers: list[float], count: int) -> list[float]:
    return [*numbers, *[0.0] * (count - len(numbers))]


def _relaxing(file: AbaqusFile, material: Material, elastic: Card, card: Card, density: float | None) -> Counterpart:
    """A material with a Prony series."""
    if card.get("TIME").upper() != "PRONY":
        raise Untranslatable(f"*VISCOELASTIC with TIME={card.get('TIME')}", card.line)
    rows = []
    for line, entries in card.rows():
        with card.at(line):
            rows.append(_padded([real(entry) for entry in entries], 3)[:3])
    if any(k for _, k, _ in rows):
        file.draft.difference(card.line, "*VISCOELASTIC: the volumetric part does not relax here")
    series = [(g, time) for g, _, time in rows if g]
    relaxed = 1 - sum(g for g, _ in series)
    instantaneous = elastic.get("MODULI").upper() == "INSTANTANEOUS"
    try:
        base = Counterpart(material)
        if instantaneous:
            material = distortion_scaled(material, relaxed)
        elif not base.uncoupled:
            file.draft.difference(card.line, "*VISCOELASTIC: more than the deviatoric part of the stress relaxes here")
        prony = Prony(tuple(g / relaxed for g, _ in series), tuple(t for _, t in series)) if series else None
    except ValueError as error:
        raise Untranslatable(f"*VISCOELASTIC with {error}", card.line) from None
    return Counterpart(material, prony, density)
