"""Test rigs of a case: machines, rigid links, and the places of the body that supports and links hold."""

from collections.abc import Callable, Mapping, Sequence
from typing import Literal

from cutsim.bodies.machine import Machine
from cutsim.bodies.rigid_link import Attachment, RigidLink
from cutsim.cases import schema_rigs as schema
from cutsim.cases.domains import Domain, Entities
from cutsim.cases.expressions import TimeValue, corners_of
from cutsim.cases.keys import Keys
from cutsim.cases.refusals import refused, refusing
from cutsim.fields.points import Surface
from cutsim.fields.state import State
from cutsim.interface.crack import Crack


def links(domain: Domain, state: State, cracks: Mapping[str, Crack]) -> list[RigidLink]:
    """Rigid links of a case. Collective.

    Raises:
        CaseError: A group or vertex is missing, or a link refuses a parameter.
    """
    return [_link(domain, state, name, table, cracks) for name, table in domain.tables.links.items()]


def _link(domain: Domain, state: State, name: str, table: schema.Link, cracks: Mapping[str, Crack]) -> RigidLink:
    key, attachments = ("links", name), list[Attachment]()
    for part, where in table.attachments.items():
        dim, entities = place(domain, (*key, "attachments", part), where, cracks)
        with refusing(domain.document, *key, "attachments", part):
            attachments.append(Attachment(entities, where.along, dim, part))
    corners = {*table.corners, *(corner for value in table.motion.values() for corner in corners_of(value))}
    drive = machines(domain, key, table.machines)
    with refusing(domain.document, *key):
        return RigidLink(
            state,
            attachments,
            table.reference,
            motion=table.motion,
            machines=drive,
            name=name,
            corners=tuple(sorted(corners)),
        )


def machines(domain: Domain, key: Keys, tables: Sequence[schema.AnyMachine]) -> tuple[Machine, ...]:
    """Machines of a tool, a carriage or a link.

    Args:
        domain: Mesh of the case.
        key: Key of what they drive.
        tables: The machines.

    Raises:
        CaseError: A machine refuses a parameter.
    """
    return tuple(machine(domain, (*key, "machines", i), table) for i, table in enumerate(tables))


def machine(domain: Domain, key: Keys, table: schema.AnyMachine) -> Machine:
    """Machine of a table with a given key.

    Raises:
        CaseError: It refuses a parameter.
    """
    with refusing(domain.document, *key):
        corners = (*table.corners, *corners_of(table.force))
        return Machine(
            table.axis,
            table.stiffness,
            table.damping,
            table.mass,
            table.force,
            table.weight,
            table.velocity,
            corners,
        )


def place(
    domain: Domain, key: Keys, table: schema.Place, cracks: Mapping[str, Crack]
) -> tuple[int, Entities | Surface]:
    """Dimension and local entities, or face of a crack, of a part of the body. Collective.

    Raises:
        CaseError: A group or vertex is missing.
    """
    tdim = domain.tagged.mesh.topology.dim
    if table.points:
        return 0, domain.nearest((*key, "points"), table.points)
    if table.vertices:
        return 0, domain.vertices((*key, "vertices"), table.vertices)
    if table.cells:
        return tdim, domain.cells((*key, "cells"), table.cells)
    surface = crack_surface(table.facets[0], cracks)
    if surface is None:
        return tdim - 1, domain.facets((*key, "facets"), table.facets)
    if len(table.facets) > 1:
        words = "must be groups of facets, or one face of a crack alone"
        raise refused(domain.document, (*key, "facets"), words, list(table.facets))
    return tdim - 1, surface


def crack_surface(name: str, cracks: Mapping[str, Crack]) -> Surface | None:
    """A face of a crack by its name with + or −, as a tool or a support takes it; None for another name."""
    crack, face = cracks.get(name[:-1]), name[-1]
    if crack is None or face not in "+-":
        return None
    side: Literal["+", "-"] = "+" if face == "+" else "-"
    return crack.surface(side)


def function(value: TimeValue) -> Callable[[float], float]:
    """A function of time for what is one, or a number."""
    return value if callable(value) else lambda _: value
