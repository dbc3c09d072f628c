"""Cracks and pairs of surfaces of a case."""

from collections.abc import Mapping, Sequence
from typing import Literal

from cutsim.bodies.solid import Solid
from cutsim.cases import schema_parts as schema
from cutsim.cases.bodies import softest
from cutsim.cases.domains import Domain
from cutsim.cases.keys import Keys
from cutsim.cases.refusals import refusing
from cutsim.fields.faces import Face
from cutsim.fields.temperature import Temperature
from cutsim.interface.crack import Crack
from cutsim.interface.rubbing import Friction
from cutsim.pairs.contact_surfaces import ContactSurfaces
from cutsim.pairs.surface_pair import SurfacePair

_SIDES: tuple[Literal["+", "-"], ...] = ("+", "-")


def cracks(domain: Domain, solids: tuple[Solid, ...], temperature: Temperature | None) -> dict[str, Crack]:
    """Cracks of a case by name, with their friction. Collective.

    Raises:
        CaseError: A group is missing, or a crack refuses a parameter.
    """
    tables = domain.tables.cracks.items()
    return {name: _crack(domain, solids, name, table, temperature) for name, table in tables}


def _crack(
    domain: Domain, solids: tuple[Solid, ...], name: str, table: schema.Crack, temperature: Temperature | None
) -> Crack:
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
            friction=friction_of(table, temperature),
            allowed_penetration=table.allowed_penetration,
            normal=table.normal,
            closing=table.closing,
        )


def friction_of(table: schema.Interface | schema.Tool, temperature: Temperature | None) -> Friction | None:
    """Friction of a crack, a pair or a tool, None for none."""
    if not table.friction:
        return None
    beside = {"acts_on": table.acts_on} if isinstance(table, schema.Interface) else {}
    return Friction(table.friction, allowed_slip=table.allowed_slip, temperature=temperature, **beside)


def pairs(
    domain: Domain, solids: tuple[Solid, ...], cracks: Mapping[str, Crack], temperature: Temperature | None
) -> dict[str, SurfacePair]:
    """Pairs of surfaces of a case by name. Collective.

    Raises:
        CaseError: A group is missing, or a pair refuses a parameter.
    """
    tables = domain.tables.pairs
    return {name: _pair(domain, solids, cracks, name, table, temperature) for name, table in tables.items()}


def _pair(
    domain: Domain,
    solids: tuple[Solid, ...],
    cracks: Mapping[str, Crack],
    name: str,
    table: schema.Pair,
    temperature: Temperature | None,
) -> SurfacePair:
    key = ("pairs", name)
    if table.automatic:
        closing = [(c.face("+"), c.face("-")) for c in cracks.values() if c.closing and c.plane is None]
        surfaces = ContactSurfaces.automatic(solids, closing=closing)
        sides: list[Sequence[Face]] = [surfaces.faces, ()]
        young = surfaces.young
    else:
        sides = [faces_of(domain, (*key, side), getattr(table, side), cracks) for side in ("slave", "master")]
        young = min(softest(solids, face.facets) for side in sides for face in side)
    with refusing(domain.document, *key):
        return SurfacePair(
            solids[0].state,
            sides[0],
            sides[1] or None,
            table.law,
            young=table.young or young,
            contact=table.contact,
            friction=friction_of(table, temperature),
            allowed_penetration=table.allowed_penetration,
            small_sliding=table.small_sliding,
            two_pass=table.two_pass,
            search=table.search,
            name=name,
        )


def faces_of(domain: Domain, key: Keys, names: Sequence[str], cracks: Mapping[str, Crack]) -> Sequence[Face]:
    """The faces of a surface, of which outer ones are one. Collective."""
    sides = {f"{name}{side}": (crack, side) for name, crack in cracks.items() for side in _SIDES}
    faces = [crack.face(side) for crack, side in (sides[name] for name in names if name in sides)]
    outer = [name for name in names if name not in sides]
    if outer:
        facets = domain.facets(key, outer)
        with refusing(domain.document, *key[:-1]):
            faces.append(Face.outer(domain.tagged.mesh, facets, str(key[-1])))
    return faces
