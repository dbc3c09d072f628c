"""Units and kinds of quantities.

The equations carry no units: any consistent set will do. `Units` names the set in use, so that file headers and axis
labels say what a number means. A `Kind` in the annotation of a parameter, as in ``young: Stress``, says what a number
is, so that an input in another unit can be checked and converted.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated, Any

from cutsim.base.checks import require

#: Kinds of quantities with their exponents of length, force, time and temperature. Toughness is energy per area, flux
#: power per area, stiffness stress per length, and what is "one" is dimensionless.
DIMENSIONS: Mapping[str, tuple[int, int, int, int]] = MappingProxyType(
    {
        "length": (1, 0, 0, 0),
        "area": (2, 0, 0, 0),
        "force": (0, 1, 0, 0),
        "time": (0, 0, 1, 0),
        "stress": (-2, 1, 0, 0),
        "energy": (1, 1, 0, 0),
        "toughness": (-1, 1, 0, 0),
        "moment": (1, 1, 0, 0),
        "angle": (0, 0, 0, 0),
        "velocity": (1, 0, -1, 0),
        "angular velocity": (0, 0, -1, 0),
        "temperature": (0, 0, 0, 1),
        "power": (1, 1, -1, 0),
        "flux": (-1, 1, -1, 0),
        "entropy": (1, 1, 0, -1),
        "one": (0, 0, 0, 0),
        "temperature difference": (0, 0, 0, 1),
        "acceleration": (1, 0, -2, 0),
        "force per volume": (-3, 1, 0, 0),
        "force per length": (-1, 1, 0, 0),
        "damping": (-1, 1, 1, 0),
        "mass": (-1, 1, 2, 0),
        "rotational damping": (1, 1, 1, 0),
        "moment of inertia": (1, 1, 2, 0),
        "stiffness": (-3, 1, 0, 0),
        "viscosity": (-2, 1, 1, 0),
        "interface viscosity": (-3, 1, 1, 0),
        "density": (-4, 1, 2, 0),
        "expansion": (0, 0, 0, -1),
        "specific heat": (2, 0, -2, -1),
        "conductivity": (0, 1, -1, -1),
        "conductance": (-1, 1, -1, -1),
        "conductance per pressure": (1, 0, -1, -1),
        "heat capacity per area": (-1, 1, 0, -1),
        "heat source": (-2, 1, -1, 0),
    }
)
KINDS = tuple(DIMENSIONS)

_STRESS = {("mm", "N"): "MPa", ("m", "N"): "Pa", ("mm", "kN"): "GPa", ("m", "kN"): "kPa"}
_ENERGY = {("mm", "N"): "mJ", ("m", "N"): "J", ("mm", "kN"): "J", ("m", "kN"): "kJ"}
# what is per width in a plane problem
_EXTENSIVE = (
    "force", "energy", "moment", "power", "entropy", "force per length", "damping", "mass", "rotational damping",
    "moment of inertia",
)  # fmt: skip
_POWERS = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclass(frozen=True)
class Kind:
    """Kind of a quantity, as the metadata of an annotation.

    Args:
        name: One of `KINDS`.

    Raises:
        ValueError: The kind is unknown.
    """

    name: str

    def __post_init__(self) -> None:
        require("kind", self.name, self.name in KINDS, f"one of {', '.join(KINDS)}")

    @property
    def dimension(self) -> tuple[int, int, int, int]:
        """Exponents of length, force, time and temperature."""
        return DIMENSIONS[self.name]

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        """How a number of this kind is read from a case file: by what the file is read with (`cutsim.cases`)."""
        from pydantic_core import core_schema

        return core_schema.with_info_plain_validator_function(lambda value, info: info.context.number(value, self))

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> dict[str, Any]:
        """What may be written in a case file: a number, or a text with a quantity or an expression."""
        return {"anyOf": [{"type": "number"}, {"type": "string"}], "x-kind": self.name}


#: A dimensionless number.
Number = Annotated[float, Kind("one")]

Length = Annotated[float, Kind("length")]
Time = Annotated[float, Kind("time")]
Stress = Annotated[float, Kind("stress")]
Toughness = Annotated[float, Kind("toughness")]
Angle = Annotated[float, Kind("angle")]
Velocity = Annotated[float, Kind("velocity")]
TemperatureValue = Annotated[float, Kind("temperature")]
TemperatureDifference = Annotated[float, Kind("temperature difference")]
Force = Annotated[float, Kind("force")]
Moment = Annotated[float, Kind("moment")]
ForcePerLength = Annotated[float, Kind("force per length")]
Damping = Annotated[float, Kind("damping")]
RotationalDamping = Annotated[float, Kind("rotational damping")]
Mass = Annotated[float, Kind("mass")]
MomentOfInertia = Annotated[float, Kind("moment of inertia")]
AngularVelocity = Annotated[float, Kind("angular velocity")]
Flux = Annotated[float, Kind("flux")]
Stiffness = Annotated[float, Kind("stiffness")]
Viscosity = Annotated[float, Kind("viscosity")]
InterfaceViscosity = Annotated[float, Kind("interface viscosity")]
Density = Annotated[float, Kind("density")]
Expansion = Annotated[float, Kind("expansion")]
SpecificHeat = Annotated[float, Kind("specific heat")]
Conductivity = Annotated[float, Kind("conductivity")]
Conductance = Annotated[float, Kind("conductance")]
ConductancePerPressure = Annotated[float, Kind("conductance per pressure")]
HeatCapacityPerArea = Annotated[float, Kind("heat capacity per area")]


@dataclass(frozen=True)
class Units:
    """A consistent set of units, by the symbols of its base units.

    Args:
        length: Symbol of the unit of length.
        force: Symbol of the unit of force.
        time: Symbol of the unit of time.
        temperature: Symbol of the unit of temperature.
    """

    length: str = "mm"
    force: str = "N"
    time: str = "s"
    temperature: str = "K"

    def of(self, kind: str) -> str:
        """Symbol of the unit of a kind of quantity.

        Args:
            kind: One of `KINDS`.

        Returns:
            The symbol: a named unit where the set has one (MPa, mJ), composed otherwise (lbf/in²).

        Raises:
            ValueError: If the kind is unknown.
        """
        require("kind", kind, kind in KINDS, f"one of {', '.join(KINDS)}")
        base = (self.length, self.force)
        energy = _ENERGY.get(base, f"{self.force}·{self.length}")
        named = {
            "stress": _STRESS.get(base),
            "energy": energy,
            "angle": "rad",
            "power": f"{energy}/{self.time}",
            "entropy": f"{energy}/{self.temperature}",
        }
        return named.get(kind) or self._composed(*DIMENSIONS[kind])

    def _composed(self, length: int, force: int, time: int, temperature: int) -> str:
        powers = {self.force: force, self.length: length, self.time: time, self.temperature: temperature}
        above, below = (
            [symbol + (str(n).translate(_POWERS) if n > 1 else "") for symbol, n in side if n > 0]
            for side in (powers.items(), ((symbol, -n) for symbol, n in powers.items()))
        )
        divisor = f"({'·'.join(below)})" if len(below) > 1 else "".join(below)
        return "·".join(above or ["1"]) + (f"/{divisor}" if divisor else "")

    def label(self, name: str, kind: str) -> str:
        """A name with its unit in brackets, such as ``depth [mm]``; a dimensionless one stays bare.

        Args:
            name: What the number is.
            kind: One of `KINDS`.

        Returns:
            The label, for a file header or an axis.

        Raises:
            ValueError: If the kind is unknown.
        """
        symbol = self.of(kind)
        return name if kind == "one" else f"{name} [{symbol}]"

    def per_width(self) -> PlaneUnits:
        """The units of plane problems, in which forces and energies are per width."""
        return PlaneUnits(self.length, self.force, self.time, self.temperature)


@dataclass(frozen=True)
class PlaneUnits(Units):
    """A consistent set of units for a plane problem: forces, energies and what follows from them are per width."""

    def of(self, kind: str) -> str:
        """Symbol of the unit of a kind of quantity; see `Units.of`."""
        symbol = super().of(kind)
        if kind not in _EXTENSIVE:
            return symbol
        above, slash, below = symbol.partition("/")
        return f"{above}/({below}·{self.length})" if slash else f"{symbol}/{self.length}"
