"""Supports and loads of a case."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Literal

import numpy as np

from cutsim.bodies.body_force import BodyForce
from cutsim.bodies.loads import Load, Pressure, Support, Traction
from cutsim.bodies.nodal_loads import LineLoad, NodalForce
from cutsim.bodies.solid import Solid
from cutsim.cases import schema_parts as schema
from cutsim.cases.domains import Domain, Entities
from cutsim.cases.expressions import TimeValue, corners_of
from cutsim.cases.keys import Keys
from cutsim.cases.refusals import refusing
from cutsim.cases.rigs import function, place
from cutsim.fields.state import State
from cutsim.interface.crack import Crack


def supports(domain: Domain, state: State, cracks: Mapping[str, Crack]) -> list[Support]:
    """Supports of a case, with a reaction by the name of each; those of all components as name_x and so on. Collective.

    Args:
        domain: The mesh of the case.
        state: Displacement and time.
        cracks: Its cracks by name.

    Raises:
        CaseError: A group or vertex is missing, or a support refuses a parameter.
    """
    tables = domain.tables.supports.items()
    return [s for name, table in tables for s in _supports(domain, state, name, table, cracks)]


def _supports(
    domain: Domain, state: State, name: str, table: schema.Support, cracks: Mapping[str, Crack]
) -> Iterator[Support]:
    dim, entities = place(domain, ("supports", name), table, cracks)
    gdim, corners = state.mesh.geometry.dim, _corners(table.corners, table.value)
    with refusing(domain.document, "supports", name):
        if table.direction == "all":
            for i in range(gdim):
                label = f"{name}_{'xyz'[i]}"
                yield Support(state, entities, i, table.value, name=label, dim=dim, corners=corners)
            return
        along = direction(table.direction, gdim)
        yield Support(state, entities, along, table.value, name=name, dim=dim, corners=corners)


def _vertices(domain: Domain, key: Keys, table: schema.NodalForce | schema.LineLoad) -> Entities:
    if isinstance(table, schema.NodalForce) and table.points:
        return domain.nearest((*key, "points"), table.points)
    return domain.vertices((*key, "vertices"), table.vertices)


def loads(domain: Domain, state: State, solids: Sequence[Solid]) -> list[Load]:
    """Loads of a case. Collective.

    Args:
        domain: The mesh of the case.
        state: Displacement and time.
        solids: Its bodies.

    Raises:
        CaseError: A group is missing, or a load refuses a parameter.
    """
    found: list[Load] = []
    for name, table in domain.tables.loads.items():
        if isinstance(table, schema.BodyForce | schema.Weight):
            found += _body_forces(domain, state, solids, name, table)
        else:
            found.append(_load(domain, state, name, table))
    return found


def _body_forces(
    domain: Domain, state: State, solids: Sequence[Solid], name: str, table: schema.BodyForce | schema.Weight
) -> Iterator[BodyForce]:
    """A force on each body, with its name behind that of the load if there are several."""
    chosen = [solid for solid in solids if not table.bodies or solid.name in table.bodies]
    per: Literal["mass", "volume"] = "mass" if isinstance(table, schema.Weight) else "volume"
    corners, value = _corners(table.corners, table.value), function(table.value)
    for solid in chosen:
        label = name if len(chosen) == 1 else f"{name}_{solid.name}"
        with refusing(domain.document, "loads", name):
            along = direction(table.direction, state.mesh.geometry.dim)
            yield BodyForce(state, solid, along, value, per=per, name=label, corners=corners)


def _load(
    domain: Domain,
    state: State,
    name: str,
    table: schema.Pressure | schema.Traction | schema.NodalForce | schema.LineLoad,
) -> Load:
    key, corners, value = ("loads", name), _corners(table.corners, table.value), function(table.value)
    if isinstance(table, schema.NodalForce | schema.LineLoad):
        vertices = _vertices(domain, key, table)
        kind = NodalForce if isinstance(table, schema.NodalForce) else LineLoad
        with refusing(domain.document, *key):
            along = direction(table.direction, state.mesh.geometry.dim)
            return kind(state, vertices, along, value, name=name, corners=corners)
    facets = domain.facets((*key, "facets"), table.facets)
    with refusing(domain.document, *key):
        if isinstance(table, schema.Pressure):
            return Pressure(state, facets, value, name=name, corners=corners)
        along, current = direction(table.direction, state.mesh.geometry.dim), table.current_area
        return Traction(state, facets, along, value, name=name, corners=corners, current_area=current)


def direction(given: str | Sequence[float], gdim: int) -> tuple[float, ...]:
    """Unit vector of a direction, given as an axis such as "x" or "-y", or as a vector of any length.

    Raises:
        ValueError: The mesh has no such axis, or the vector has another dimension or no length.
    """
    if isinstance(given, str):
        axes = "xyz"[:gdim]
        if given[-1] not in axes:
            raise ValueError(f"direction = {given!r} is not allowed: it must be one of {', '.join(axes)}")
        return tuple((-1.0 if given[0] == "-" else 1.0) * np.eye(gdim)["xyz".index(given[-1])])
    length = float(np.linalg.norm(given))
    if len(given) != gdim or not length:
        raise ValueError(f"direction = {list(given)} is not allowed: it must have {gdim} components, not all zero")
    return tuple(float(c) / length for c in given)


def _corners(given: Sequence[float], value: TimeValue) -> tuple[float, ...]:
    return tuple(sorted({*given, *corners_of(value)}))
