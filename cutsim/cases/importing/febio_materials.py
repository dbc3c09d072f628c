"""Materials of FEBio and their counterparts.

FEBio's definitions are those of its user manual and source code: the bulk energy of an uncoupled material is
K/2 (ln J)² unless ``pressure_model`` says another one, the viscoelastic stress is g₀ S + Σ gᵢ hᵢ.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from math import cos, radians, sin
from types import MappingProxyType

import numpy as np

from cutsim.cases.importing.counterparts import Counterpart, distortion_scaled
from cutsim.cases.importing.draft import Draft, MalformedFile, Untranslatable
from cutsim.cases.importing.febio_context import describe
from cutsim.cases.importing.febio_file import FebioFile, children
from cutsim.materials.anisotropic import FungOrthotropic
from cutsim.materials.elastic import IsochoricNeoHookean, Material, NeoHookean, StVenantKirchhoff
from cutsim.materials.fibres import DispersedFibres, ExponentialFibres, FibreLaw, Reinforced
from cutsim.materials.rubbers import ArrudaBoyce, IsochoricOgden, MooneyRivlin, Ogden, Yeoh
from cutsim.materials.viscoelastic import Prony
from cutsim.readers.xml_tree import LinedElement

_TERMS = range(1, 7)
_DEFAULT_PRESSURE = ("", "0", "default")


class MaterialReader:
    """Reader of the materials of a FEBio file.

    Args:
        file: The file.
        draft: Where differences are noted.
    """

    def __init__(self, file: FebioFile, draft: Draft) -> None:
        self._file, self._draft = file, draft

    def counterpart(self, element: LinedElement) -> Counterpart:
        """The counterpart of a material.

        Raises:
            Untranslatable: It has none.
            MalformedFile: A parameter is missing or no number.
        """
        self._file.read(element)
        kind = element.get("type", "")
        density = self._file.number(element, "density", 1.0)
        if kind in ("viscoelastic", "uncoupled viscoelastic"):
            return replace(self._viscoelastic(element), density=density)
        return Counterpart(self._elastic(element, self._bulk(element)), density=density)

    def _elastic(self, element: LinedElement, bulk: float) -> Material:
        kind = element.get("type", "")
        make = _MODELS.get(kind)
        if make is None:
            raise Untranslatable(f"{kind!r} has no counterpart", element.line)
        if make in _BY_VOLUME:
            self._check_pressure(element, "3" if make is _holzapfel else "0")
        try:
            return make(self, element, bulk)
        except MalformedFile:
            raise
        except ValueError as error:
            raise Untranslatable(f"{kind!r} with {error}", element.line) from None

    def _bulk(self, element: LinedElement) -> float:
        return self.number(element, "k", 0.0)

    def _check_pressure(self, element: LinedElement, default: str) -> None:
        model = self._file.text(element, "pressure_model").lower()
        model = default if model in _DEFAULT_PRESSURE else model
        if model != "0":
            energy = {"2": "K/2 (J-1)^2", "abaqus": "K/2 (J-1)^2"}.get(model, "K/4 (J^2 - 1 - 2 ln J)")
            self.difference(element, f"the volumetric energy is K/2 (ln J)^2 in place of {energy}: the same near J = 1")

    def difference(self, element: LinedElement, what: str) -> None:
        """Note that a material is translated, but not exactly."""
        self._draft.difference(element.line, f"{describe(element)}: {what}")

    def number(self, element: LinedElement, tag: str, default: float | None = None) -> float:
        """A parameter."""
        return self._file.number(element, tag, default)

    def terms(self, element: LinedElement, tag: str, default: float = 0.0) -> list[float]:
        """Parameters c1 … c6."""
        return [self.number(element, f"{tag}{i}", default) for i in _TERMS]

    def _viscoelastic(self, element: LinedElement) -> Counterpart:
        """An elastic material that relaxes: g₀ S + Σ gᵢ hᵢ."""
        base = self._file.child(element, "elastic")
        if base is None:
            raise MalformedFile(f"{self._file.place(element)}: {element.get('type')!r} has no elastic material")
        density = self.number(base, "density", 1.0)
        bulk = self._bulk(element) + self._bulk(base)
        counterpart = Counterpart(self._elastic(base, bulk), density=density)
        if element.get("type") == "uncoupled viscoelastic":
            self._check_pressure(element, "0")
        strengths, times = self.terms(element, "g"), self.terms(element, "t", 1.0)
        relaxed = self.number(element, "g0", 1.0)
        series = [(g, t) for g, t in zip(strengths, times, strict=True) if g]
        try:
            return self._relaxing(counterpart, relaxed, series, element)
        except ValueError as error:
            raise Untranslatable(f"{element.get('type')!r} with {error}", element.line) from None

    def _relaxing(
        self, base: Counterpart, relaxed: float, series: list[tuple[float, float]], element: LinedElement
    ) -> Counterpart:
        material = base.material
        if relaxed != 1:
            if not base.uncoupled or relaxed <= 0:
                raise ValueError(f"g0 = {relaxed:g} has no counterpart")
            material = distortion_scaled(material, relaxed)
        if element.get("type") == "viscoelastic" and not base.relaxes_wholly():
            self.difference(element, "only the distortional part of the stress relaxes, in FEBio all of it")
        prony = Prony(tuple(g / relaxed for g, _ in series), tuple(t for _, t in series)) if series else None
        return Counterpart(material, prony)

    def axes(self, element: LinedElement) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """First and second material axis.

        Raises:
            Untranslatable: They are not given by vectors.
            MalformedFile: The vectors are parallel.
        """
        given = self._file.child(element, "mat_axis")
        if given is None:
            return (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
        if given.get("type") != "vector":
            raise Untranslatable(f"material axes of type {given.get('type')!r}", given.line)
        a, d = (np.array(self._file.vector(given, tag)) for tag in ("a", "d"))
        second = np.cross(np.cross(a, d), a)
        if not np.any(second):
            raise MalformedFile(f"{self._file.place(given)}: the vectors a and d of mat_axis are parallel")
        return tuple(a.tolist()), tuple((second / np.linalg.norm(second)).tolist())

    def fibre_direction(self, element: LinedElement) -> tuple[float, ...]:
        """Direction of a family of fibres.

        Raises:
            Untranslatable: It has axes of its own, or is given neither by a vector nor by angles.
        """
        if self._file.child(element, "mat_axis") is not None:
            raise Untranslatable("fibres in axes of their own", element.line)
        fiber = self._file.child(element, "fiber")
        if fiber is None or fiber.get("type") == "angles":
            holder = element if fiber is None else fiber
            theta, phi = (
                radians(self.number(holder, tag, default)) for tag, default in (("theta", 0.0), ("phi", 90.0))
            )
            return cos(theta) * sin(phi), sin(theta) * sin(phi), cos(phi)
        if fiber.get("type") != "vector":
            raise Untranslatable(f"fibre direction of type {fiber.get('type')!r}", fiber.line)
        return self._file.vector(fiber, "vector") if len(fiber) else self._file.vector(fiber)

    def parts(self, element: LinedElement) -> tuple[list[LinedElement], list[LinedElement]]:
        """Solids of a mixture, and those of them that are fibres."""
        solids = [
            self._file.read(child)
            for child in children(element)
            if child.get("type") and child.tag in ("solid", "material")
        ]
        fibres = [solid for solid in solids if solid.get("type", "").startswith("fiber")]
        return [solid for solid in solids if solid not in fibres], fibres

    def mixture(self, element: LinedElement, bulk: float, family: Callable[[LinedElement], FibreLaw]) -> Material:
        """One solid with fibres in it.

        Raises:
            Untranslatable: There is not one solid beside the fibres, or the mixture has axes of its own.
        """
        solids, fibres = self.parts(element)
        if self._file.child(element, "mat_axis") is not None:
            raise Untranslatable("a mixture in axes of its own", element.line)
        if len(solids) != 1:
            raise Untranslatable(f"a mixture of {len(solids)} solids that are no fibres", element.line)
        matrix = self._elastic(solids[0], bulk + self._bulk(solids[0]))
        return Reinforced(matrix, tuple(family(fibre) for fibre in fibres)) if fibres else matrix

    def plain_fibres(self, element: LinedElement) -> FibreLaw:
        """Family of fibres by their stretch."""
        modulus, exponential, power = self._fibre_constants(element, "fiber-exp-pow")
        return ExponentialFibres(self.fibre_direction(element), modulus, exponential, power)

    def isochoric_fibres(self, element: LinedElement) -> FibreLaw:
        """Family of fibres by their isochoric stretch.

        Raises:
            Untranslatable: They have another exponent than 2.
        """
        modulus, exponential, power = self._fibre_constants(element, "fiber-exp-pow-uncoupled")
        if power != 2:
            raise Untranslatable(f"fibres with beta = {power:g}, other than 2", element.line)
        return DispersedFibres(self.fibre_direction(element), modulus, exponential)

    def _fibre_constants(self, element: LinedElement, kind: str) -> tuple[float, float, float]:
        if element.get("type") != kind:
            raise Untranslatable(f"{element.get('type')!r} has no counterpart", element.line)
        for tag, neutral in (("mu", 0.0), ("lam0", 1.0)):
            if self.number(element, tag, neutral) != neutral:
                raise Untranslatable(f"fibres with {tag}", element.line)
        return self.number(element, "ksi"), self.number(element, "alpha", 0.0), self.number(element, "beta", 2.0)


def _neo_hookean(read: MaterialReader, element: LinedElement, bulk: float) -> Material:
    return NeoHookean(read.number(element, "E"), read.number(element, "v"))


def _st_venant_kirchhoff(read: MaterialReader, element: LinedElement, bulk: float) -> Material:
    return StVenantKirchhoff(read.number(element, "E"), read.number(element, "v"))


def _isochoric_neo_hookean(read: MaterialReader, element: LinedElement, bulk: float) -> Material:
    return IsochoricNeoHookean.from_moduli(read.number(element, "G"), bulk)


def _mooney_rivlin(read: MaterialReader, element: LinedElement, bulk: float) -> Material:
    return MooneyRivlin(read.number(element, "c1"), read.number(element, "c2", 0.0), bulk)


def _coupled_mooney_rivlin(read: MaterialReader, element: LinedElement, bulk: float) -> Material:
    c1, c2 = read.number(element, "c1"), read.number(element, "c2", 0.0)
    if c2:
        raise ValueError(f"c2 = {c2:g} has no counterpart")
    return NeoHookean.from_moduli(2 * c1, bulk + 4 * c1 / 3)


def _ogden_terms(read: MaterialReader, element: LinedElement) -> tuple[tuple[float, ...], tuple[float, ...]]:
    terms = [(c, m) for c, m in zip(read.terms(element, "c"), read.terms(element, "m", 1.0), strict=True) if c]
    return tuple(c for c, _ in terms), tuple(m for _, m in terms)


def _isochoric_ogden(read: MaterialReader, element: LinedElement, bulk: float) -> Material:
    return IsochoricOgden(*_ogden_terms(read, element), bulk)


def _ogden(read: MaterialReader, element: LinedElement, bulk: float) -> Material:
    return Ogden(*_ogden_terms(read, element), read.number(element, "cp"))


def _yeoh(read: MaterialReader, element: LinedElement, bulk: float) -> Material:
    c1, c2, c3, *more = read.terms(element, "c")
    if any(more):
        raise ValueError("more than three terms has no counterpart")
    return Yeoh(c1, c2, c3, bulk)


def _fung(read: MaterialReader, element: LinedElement, bulk: float) -> Material:
    """Fung's solid from the stiffness at small strain: c b is the inverse of FEBio's compliance, and Gᵢⱼ."""
    E1, E2, E3, G12, G23, G31, v12, v23, v31, c = (
        read.number(element, tag) for tag in ("E1", "E2", "E3", "G12", "G23", "G31", "v12", "v23", "v31", "c")
    )
    compliance = [[1 / E1, -v12 / E1, -v31 / E3], [-v12 / E1, 1 / E2, -v23 / E2], [-v31 / E3, -v23 / E2, 1 / E3]]
    b = np.linalg.inv(compliance) / c
    coupling = (b[0, 1], b[1, 2], b[2, 0])
    return FungOrthotropic(c, tuple(np.diag(b)), coupling, (G12 / c, G23 / c, G31 / c), bulk, read.axes(element))


def _holzapfel(read: MaterialReader, element: LinedElement, bulk: float) -> Material:
    """Two families at ± γ to the first axis in the plane of the first two."""
    matrix = IsochoricNeoHookean.from_moduli(read.number(element, "c"), bulk)
    k1, k2, kappa = read.number(element, "k1"), read.number(element, "k2"), read.number(element, "kappa", 0.0)
    angle = radians(read.number(element, "gamma", 0.0))
    first, second = (np.array(axis) / np.linalg.norm(axis) for axis in read.axes(element))
    directions = [cos(angle) * first + sign * sin(angle) * second for sign in (1, -1)]
    return Reinforced(matrix, tuple(DispersedFibres(tuple(d.tolist()), k1, k2, kappa) for d in directions))


def _mixture(read: MaterialReader, element: LinedElement, bulk: float) -> Material:
    return read.mixture(element, bulk, read.plain_fibres)


def _uncoupled_mixture(read: MaterialReader, element: LinedElement, bulk: float) -> Material:
    return read.mixture(element, bulk, read.isochoric_fibres)


def _arruda_boyce(read: MaterialReader, element: LinedElement, bulk: float) -> Material:
    read.difference(element, "the terms after the first are i times as large in FEBio as in its manual and here")
    return ArrudaBoyce(read.number(element, "mu"), read.number(element, "N"), bulk)


_MODELS: Mapping[str, Callable[[MaterialReader, LinedElement, float], Material]] = MappingProxyType(
    {
        "neo-Hookean": _neo_hookean,
        "isotropic elastic": _st_venant_kirchhoff,
        "St.Venant-Kirchhoff": _st_venant_kirchhoff,
        "incomp neo-Hookean": _isochoric_neo_hookean,
        "Mooney-Rivlin": _mooney_rivlin,
        "coupled Mooney-Rivlin": _coupled_mooney_rivlin,
        "Ogden": _isochoric_ogden,
        "Ogden unconstrained": _ogden,
        "Yeoh": _yeoh,
        "Arruda-Boyce": _arruda_boyce,
        "Fung orthotropic": _fung,
        "Holzapfel-Gasser-Ogden": _holzapfel,
        "solid mixture": _mixture,
        "uncoupled solid mixture": _uncoupled_mixture,
    }
)
_BY_VOLUME = (_isochoric_neo_hookean, _mooney_rivlin, _isochoric_ogden, _yeoh, _arruda_boyce, _fung, _holzapfel)
