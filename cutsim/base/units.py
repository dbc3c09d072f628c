"""Units in which a run is reported.

The equations carry no units: any consistent set will do. `Units` names the set in use, so that file headers
and axis labels say what a number means.
"""

from __future__ import annotations

from dataclasses import dataclass

from cutsim.base.checks import require

KINDS = (
    "length", "area", "force", "time", "stress", "energy", "toughness", "moment", "angle", "velocity",
    "temperature", "power", "flux", "entropy", "one",
)  # fmt: skip

_STRESS = {("mm", "N"): "MPa", ("m", "N"): "Pa", ("mm", "kN"): "GPa", ("m", "kN"): "kPa"}
_ENERGY = {("mm", "N"): "mJ", ("m", "N"): "J", ("mm", "kN"): "J", ("m", "kN"): "kJ"}


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
            kind: One of `KINDS`; toughness is energy per area, flux power per area, one is dimensionless.

        Returns:
            The symbol: a named unit where the set has one (MPa, mJ), composed otherwise (lbf/in²).

        Raises:
            ValueError: If the kind is unknown.
        """
        require("kind", kind, kind in KINDS, f"one of {', '.join(KINDS)}")
        base = (self.length, self.force)
        energy = _ENERGY.get(base, f"{self.force}·{self.length}")
        return {
            "length": self.length,
            "area": f"{self.length}²",
            "force": self.force,
            "time": self.time,
            "stress": _STRESS.get(base, f"{self.force}/{self.length}²"),
            "energy": energy,
            "toughness": f"{self.force}/{self.length}",
            "moment": f"{self.force}·{self.length}",
            "angle": "rad",
            "velocity": f"{self.length}/{self.time}",
            "temperature": self.temperature,
            "power": f"{energy}/{self.time}",
            "flux": f"{self.force}/({self.length}·{self.time})",
            "entropy": f"{energy}/{self.temperature}",
            "one": "1",
        }[kind]

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
