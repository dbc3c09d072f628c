"""Schema of case files: heat."""

from typing import Annotated, Literal

from pydantic import Field, Tag

from cutsim.base.units import (
    Conductance,
    Conductivity,
    Density,
    SpecificHeat,
    TemperatureDifference,
    TemperatureValue,
    Time,
)
from cutsim.cases.constructed import FromTable
from cutsim.cases.expressions import TimeValue
from cutsim.cases.names import BodyName, CrackName, Groups, PairName, ToolName
from cutsim.cases.tables import FORM, NONNEGATIVE, POSITIVE, Flag, Table, Varying, chosen_by
from cutsim.heat.contact_heat import ContactHeat, HeatLaw

Warmth = Annotated[TimeValue, Varying("temperature")]


class HeatBody(Table):
    """Heat capacity and conduction of a body.

    Args:
        capacity: Specific heat c > 0 [energy/(mass·temperature)].
        conductivity: k ≥ 0, a number or a symmetric matrix [power/(length·temperature)].
        density: Mass per reference volume > 0; by default that of the body [mass/length³].
        source: Heat source per reference volume [power/volume].
        deformation: Whether its deformation heats it: what viscosity and relaxation dissipate, and the thermoelastic
            effect of a body that expands or softens with temperature.
    """

    capacity: Annotated[SpecificHeat, POSITIVE]
    conductivity: Annotated[
        Annotated[Conductivity, NONNEGATIVE, Tag("<single>")]
        | Annotated[tuple[tuple[Conductivity, ...], ...], Tag("<list>")],
        FORM,
    ]
    density: Annotated[Density, POSITIVE] | None = None
    source: Annotated[TimeValue, Varying("heat source")] = 0.0
    deformation: Flag = False


class Flux(Table):
    """Prescribed heat flux into the body.

    Args:
        facets: Groups of facets.
        value: Heat flux per reference area [power/area].
        corners: Times at which it has a kink; those of a table are known [time].
    """

    kind: Literal["flux"]
    facets: Groups
    value: Annotated[TimeValue, Varying("flux")]
    corners: tuple[Time, ...] = ()


class Convection(Table):
    """Heat exchange with the surroundings.

    Args:
        facets: Groups of facets.
        coefficient: Heat transfer coefficient ≥ 0 [power/(area·temperature)].
        ambient: Temperature of the surroundings [temperature].
        corners: Times at which it has a kink; those of a table are known [time].
    """

    kind: Literal["convection"]
    facets: Groups
    coefficient: Annotated[Conductance, NONNEGATIVE]
    ambient: Warmth
    corners: tuple[Time, ...] = ()


class PrescribedTemperature(Table):
    """Prescribed temperature.

    Args:
        facets: Groups of facets.
        value: Temperature [temperature].
        corners: Times at which it has a kink; those of a table are known [time].
    """

    kind: Literal["temperature"]
    facets: Groups
    value: Warmth
    corners: tuple[Time, ...] = ()


HeatBoundary = Annotated[
    Flux | Convection | PrescribedTemperature,
    Field(discriminator="kind"),
    chosen_by("kind", ["flux", "convection", "temperature"]),
]


class HeatTool(Table):
    """Heat that a tool exchanges with the body.

    Args:
        law: Law of exchange, body ('+') and tool ('−'), or an adiabatic tool.
        temperature: Temperature of the tool; by default the initial one of the body [temperature].
    """

    law: Annotated[HeatLaw, FromTable()]
    temperature: Warmth | None = None


class Heat(Table):
    """Heat: conduction in the bodies, exchange across cracks, pairs and tools.

    Args:
        initial: Initial temperature [temperature].
        iterate: Repeat mechanics and heat in each step until the temperature changes nowhere by more than this
            [temperature]; by default one pass.
        bodies: Properties of each body by its name; every body needs them.
        cracks: Exchange across each crack by its name.
        pairs: Exchange between the surfaces of each pair by its name.
        tools: Exchange with each tool by its name.
        boundaries: What flows through the boundary.
    """

    initial: TemperatureValue
    iterate: Annotated[TemperatureDifference, POSITIVE] | None = None
    bodies: dict[BodyName, HeatBody] = Field(min_length=1)
    cracks: dict[CrackName, Annotated[ContactHeat, FromTable()]] = Field(default_factory=dict)
    pairs: dict[PairName, Annotated[ContactHeat, FromTable()]] = Field(default_factory=dict)
    tools: dict[ToolName, HeatTool] = Field(default_factory=dict)
    boundaries: dict[str, HeatBoundary] = Field(default_factory=dict)
