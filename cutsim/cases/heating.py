"""Heat of a case."""

from collections.abc import Iterator, Sequence

from dolfinx import fem

from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.staggered import ThermoMechanics
from cutsim.base.units import Kind
from cutsim.bodies.solid import Solid
from cutsim.cases import schema_heat as schema
from cutsim.cases.domains import Domain, Entities
from cutsim.cases.expressions import corners_of
from cutsim.cases.parts import Parts
from cutsim.cases.quantities import Converter
from cutsim.cases.refusals import refused, refusing
from cutsim.fields.space import cracked_space
from cutsim.fields.state import State
from cutsim.fields.temperature import Temperature
from cutsim.heat.audit import HeatTerm
from cutsim.heat.boundary import Convection, HeatFlux, PrescribedTemperature
from cutsim.heat.conduction import HeatBody
from cutsim.heat.contact_heat import ContactHeat
from cutsim.heat.interface_heat import InterfaceHeat
from cutsim.heat.pair_heat import PairHeat
from cutsim.heat.tool_heat import ToolHeat
from cutsim.heat.transfer import HeatTransfer

# faces of a crack that is given no law: they lie apart wherever the bond has broken
_FACES = ContactHeat(1.0, 1.0)


def temperature(domain: Domain, state: State, split: Sequence[Entities]) -> Temperature | None:
    """Temperature of a case with heat, else None. Collective.

    Args:
        domain: Mesh and groups.
        state: Displacement and time.
        split: Facets across which the temperature may jump.

    Raises:
        CaseError: The initial temperature is below absolute zero.
    """
    heat, mesh = domain.tables.heat, state.mesh
    if heat is None:
        return None
    element = ("Lagrange", 1)
    space = cracked_space(mesh, element, split) if split else fem.functionspace(mesh, element)
    zero = Converter(domain.tables.units).number(0.0, "kelvin", Kind("temperature"))
    with refusing(domain.document, "heat"):
        return Temperature(state, space, heat.initial, absolute_zero=zero)


def coupled(domain: Domain, mechanics: Mechanics, parts: Parts, value: Temperature) -> ThermoMechanics:
    """Mechanics and heat of a case in one problem. Collective.

    Args:
        domain: Mesh and groups.
        mechanics: The mechanical problem.
        parts: Its bodies, cracks, pairs and tools.
        value: The temperature.

    Raises:
        CaseError: A body has no thermal properties, a group is missing, or a part refuses a parameter.
    """
    heat = domain.tables.heat
    assert heat is not None
    terms = [*_bodies(domain, heat, parts.solids, value), *_exchanges(domain, heat, parts, value)]
    held = list[PrescribedTemperature]()
    for name, table in heat.boundaries.items():
        made = _boundary(domain, name, table, value)
        held.append(made) if isinstance(made, PrescribedTemperature) else terms.append(made)
    with refusing(domain.document, "heat"):
        return ThermoMechanics(mechanics, HeatTransfer(value, terms, held), iterate=heat.iterate)


def _bodies(domain: Domain, heat: schema.Heat, solids: Sequence[Solid], value: Temperature) -> Iterator[HeatTerm]:
    for solid in solids:
        table = heat.bodies.get(solid.name)
        if table is None:
            raise refused(domain.document, ("heat", "bodies"), f"must have {solid.name!r}, with its thermal properties")
        with refusing(domain.document, "heat", "bodies", solid.name):
            yield HeatBody(
                value,
                capacity=table.capacity,
                conductivity=table.conductivity,
                density=table.density,
                body=solid,
                source=table.source,
                deformation=table.deformation,
                name=solid.name,
            )


def _exchanges(domain: Domain, heat: schema.Heat, parts: Parts, value: Temperature) -> Iterator[HeatTerm]:
    """Heat across cracks, pairs and tools; cracks that bond heat their faces also where the case says nothing."""
    for name, crack in parts.cracks.items():
        law = heat.cracks.get(name, _FACES if crack.law is not None else None)
        if law is not None:
            with refusing(domain.document, "heat", "cracks", name):
                yield InterfaceHeat(value, crack, law, crack.friction)
    for name, exchange in heat.pairs.items():
        with refusing(domain.document, "heat", "pairs", name):
            yield PairHeat(value, parts.pairs[name], exchange)
    for name, table in heat.tools.items():
        with refusing(domain.document, "heat", "tools", name):
            for tool in parts.tools[name]:
                given = (
                    None if table.law.adiabatic else heat.initial if table.temperature is None else table.temperature
                )
                yield ToolHeat(value, tool, table.law, given)


def _boundary(
    domain: Domain, name: str, table: schema.HeatBoundary, value: Temperature
) -> HeatTerm | PrescribedTemperature:
    key = ("heat", "boundaries", name)
    facets = domain.facets((*key, "facets"), table.facets)
    varying = table.ambient if isinstance(table, schema.Convection) else table.value
    corners = tuple(sorted({*table.corners, *corners_of(varying)}))
    with refusing(domain.document, *key):
        if isinstance(table, schema.Flux):
            return HeatFlux(value, facets, varying, name=name, corners=corners)
        if isinstance(table, schema.Convection):
            return Convection(value, facets, table.coefficient, varying, name=name, corners=corners)
        return PrescribedTemperature(value, facets, varying, name=name, corners=corners)
