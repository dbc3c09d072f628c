"""Cracks and pairs of surfaces of a case."""

from collections.abc import Iterator

from cutsim.bodies.solid import Solid
from cutsim.cases import schema_parts as schema
from cutsim.cases.bodies import softest
from cutsim.cases.domains import Domain
from cutsim.cases.refusals import refusing
from cutsim.fields.temperature import Temperature
from cutsim.interface.crack import Crack
from cutsim.interface.crack_friction import CrackFriction
from cutsim.pairs.surface_pair import SurfacePair


def cracks(domain: Domain, solids: tuple[Solid, ...]) -> dict[str, Crack]:
    """Cracks of a case by name. Collective.

    Raises:
        CaseError: A group is missing, or a crack refuses a parameter.
    """
    return {name: _crack(domain, solids, name, table) for name, table in domain.tables.cracks.items()}


def _crack(domain: Domain, solids: tuple[Solid, ...], name: str, table: schema.Crack) -> Crack:
    key = ("cracks", name)
    facets = domain.facets((*key, "facets"), table.facets)
    plus = domain.cells((*key, "plus"), [table.plus]) if isinstance(table.plus, str) else table.plus
    with refusing(domain.document, *key):
        return Crack(
            solids[0].state,
            facets,
            plus,
            domain.tables.law_of(table),
            young=table.young or softest(solids, facets),
            name=name,
            contact=table.contact,
            allowed_penetration=table.allowed_penetration,
            normal=table.normal,
        )


def crack_friction(
    domain: Domain, cracks: dict[str, Crack], temperature: Temperature | None
) -> Iterator[CrackFriction]:
    """Friction of the cracks that have it, as terms of their own. Collective."""
    for name, table in domain.tables.cracks.items():
        if table.friction:
            with refusing(domain.document, "cracks", name):
                yield CrackFriction(
                    cracks[name],
                    table.friction,
                    acts_on=table.acts_on,
                    allowed_slip=table.allowed_slip,
                    temperature=temperature,
                )


def pairs(domain: Domain, solids: tuple[Solid, ...]) -> dict[str, SurfacePair]:
    """Pairs of surfaces of a case by name. Collective.

    Raises:
        CaseError: A group is missing, or a pair refuses a parameter.
    """
    return {name: _pair(domain, solids, name, table) for name, table in domain.tables.pairs.items()}


def _pair(domain: Domain, solids: tuple[Solid, ...], name: str, table: schema.Pair) -> SurfacePair:
    key = ("pairs", name)
    slave, master = (domain.facets((*key, side), getattr(table, side)) for side in ("slave", "master"))
    with refusing(domain.document, *key):
        return SurfacePair(
            solids[0].state,
            slave,
            master,
            table.law,
            young=table.young or min(softest(solids, slave), softest(solids, master)),
            contact=table.contact,
            friction=table.friction,
            allowed_penetration=table.allowed_penetration,
            allowed_slip=table.allowed_slip,
            small_sliding=table.small_sliding,
            two_pass=table.two_pass,
            search=table.search,
            name=name,
        )
