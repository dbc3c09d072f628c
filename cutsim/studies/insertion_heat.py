"""Heat of an insertion: from friction on the tool and from fracture, conducted in the body."""

from collections.abc import Mapping
from dataclasses import dataclass

from cutsim.analysis.staggered import ThermoMechanics
from cutsim.base.checks import require
from cutsim.base.signatures import checked
from cutsim.bodies.solid import Solid
from cutsim.fields.space import cracked_space
from cutsim.fields.temperature import Temperature
from cutsim.heat.conduction import HeatBody
from cutsim.heat.contact_heat import ContactHeat, HeatLaw
from cutsim.heat.interface_heat import InterfaceHeat
from cutsim.heat.tool_heat import ToolHeat
from cutsim.heat.transfer import HeatTransfer
from cutsim.studies.insertion import Insertion


@dataclass(frozen=True)
class Conductor:
    """Thermal properties of a solid; `HeatBody` checks them.

    Args:
        density: Its density [mass/length³].
        capacity: Its specific heat [energy/(mass·temperature)].
        conductivity: Its conductivity [power/(length·temperature)].
    """

    density: float
    capacity: float
    conductivity: float


@checked
@dataclass(frozen=True)
class ThermalCut:
    """Thermal properties of a body that is cut, and of its tool.

    Args:
        solids: Properties of all solids, or of each by its name.
        tool: Exchange of heat between body ('+') and tool ('−'); an adiabatic tool, or one that stays at the initial
            temperature.
        fracture_fraction: Fraction of the fracture dissipation that becomes heat, in [0, 1].
    """

    solids: Conductor | Mapping[str, Conductor]
    tool: HeatLaw
    fracture_fraction: float = 1.0

    def of(self, solid: Solid) -> Conductor:
        """Properties of a solid.

        Raises:
            ValueError: There are none of its name.
        """
        if isinstance(self.solids, Conductor):
            return self.solids
        require("solids", sorted(self.solids), solid.name in self.solids, f"with {solid.name!r}")
        return self.solids[solid.name]


@checked
def heated(cut: Insertion, thermal: ThermalCut, initial: float) -> ThermoMechanics:
    """An insertion with heat from friction on the tool and from fracture; insulated elsewhere. Collective.

    Args:
        cut: The insertion.
        thermal: Thermal properties.
        initial: Initial temperature of body and tool [K].

    Returns:
        The coupled problem, to run in place of `Insertion.mechanics`.

    Raises:
        ValueError: A solid has no properties, or one is outside its range.
    """
    body = cut.body
    temperature = Temperature(body.state, cracked_space(body.domain.mesh, ("Lagrange", 1), [body.slit]), initial)
    single = len(body.solids) == 1
    conductors = [
        HeatBody(temperature, body=solid, name="body" if single else solid.name, **vars(thermal.of(solid)))
        for solid in body.solids
    ]
    # the faces lie apart wherever the bond has broken: what they exchange before hardly matters
    faces = ContactHeat(1.0, 1.0, fracture_fraction=thermal.fracture_fraction)
    cracks = [InterfaceHeat(temperature, crack, faces) for crack in body.cracks]
    given = None if thermal.tool.adiabatic else initial
    tools = [ToolHeat(temperature, contact, thermal.tool, given) for contact in cut.contacts]
    return ThermoMechanics(cut.mechanics, HeatTransfer(temperature, [*conductors, *cracks, *tools]))
