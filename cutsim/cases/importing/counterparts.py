"""Materials of other programs as ours, and how a case file says them."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

from cutsim.cases.classes import kebab
from cutsim.interface.cohesive import Bilinear
from cutsim.materials.anisotropic import FungOrthotropic
from cutsim.materials.elastic import IsochoricNeoHookean, Material, NeoHookean, StVenantKirchhoff
from cutsim.materials.fibres import Reinforced
from cutsim.materials.rubbers import ArrudaBoyce, IsochoricOgden, MooneyRivlin, Ogden, Yeoh
from cutsim.materials.viscoelastic import Prony

#: Materials whose distortion carries no pressure: mixed elements take the volumetric part of these.
UNCOUPLED = (ArrudaBoyce, FungOrthotropic, IsochoricNeoHookean, IsochoricOgden, MooneyRivlin, Yeoh)
#: Constants of which the energy of a distortion is a multiple.
_MODULI = ("c1", "c2", "c3", "modulus", "moduli")
#: Strength of what is tied, in Young's modulus; no rubber-like body reaches it.
_STRONG = 50.0
#: Stiffness of what is tied and has no penalty of its own, in Young's modulus over the height of an element.
STIFF = 100.0


@dataclass(frozen=True)
class Counterpart:
    """A material of another program.

    Attributes:
        material: The same as ours.
        relaxation: How it relaxes, None if it does not.
        density: Mass per volume, None if the model has none [mass/length³].
    """

    material: Material
    relaxation: Prony | None = None
    density: float | None = None

    @property
    def uncoupled(self) -> bool:
        """Whether distortion and change of volume are independent."""
        matrix = self.material.matrix if isinstance(self.material, Reinforced) else self.material
        return isinstance(matrix, UNCOUPLED)

    def relaxes_wholly(self) -> bool:
        """Whether all of the stress relaxes here: there is no volumetric part."""
        return isinstance(self.material, NeoHookean | StVenantKirchhoff) and self.material.lame == 0


def distortion_scaled(material: Material, factor: float) -> Material:
    """A material whose distortion has a multiple of the energy, with the same volumetric part.

    Raises:
        ValueError: The constants of this material do not say what is distortion.
    """
    if isinstance(material, IsochoricNeoHookean):
        return IsochoricNeoHookean.from_moduli(factor * material.shear, material.bulk)
    if isinstance(material, Reinforced) or not isinstance(material, (*UNCOUPLED, Ogden)):
        raise ValueError(f"{type(material).__name__} with a factor on its distortion")
    scaled = {
        name: tuple(factor * m for m in value) if isinstance(value, tuple) else factor * value
        for name in _MODULI
        if (value := getattr(material, name, None)) is not None
    }
    return replace(material, **scaled)  # type: ignore[arg-type]


def tie(penalty: float, young: float) -> dict[str, Any]:
    """How a case file says a bond that does not break.

    Args:
        penalty: Its stiffness [stress/length].
        young: Young's modulus of what it joins [stress].
    """
    strength = rounded(_STRONG * young)
    toughness = rounded(10 * strength**2 / penalty)
    return table(Bilinear(rounded(penalty), strength, toughness, strength, toughness))


def rounded(number: float) -> float:
    """A number that need not be exact, with four digits."""
    return float(f"{number:.4g}")


def table(thing: Any) -> dict[str, Any]:
    """How a case file says a material, fibres or another dataclass of parameters; defaults are left out."""
    return {"model": kebab(type(thing).__name__)} | parameters(thing)


def parameters(thing: Any) -> dict[str, Any]:
    """Parameters of a dataclass that are not the default."""
    given = {f.name: getattr(thing, f.name) for f in fields(thing) if getattr(thing, f.name) != f.default}
    return {name: _plain(value) for name, value in given.items()}


def _plain(value: Any) -> Any:
    if is_dataclass(value):
        return table(value)
    if isinstance(value, tuple | list):
        return [_plain(v) for v in value]
    return value if isinstance(value, str | Mapping) else float(f"{value:.12g}")
