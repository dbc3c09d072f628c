"""Rigid tools of a case."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from cutsim.base.checks import require
from cutsim.bodies.machine import Machine
from cutsim.bodies.solid import Solid
from cutsim.cases import schema_parts as schema
from cutsim.cases.bodies import softest
from cutsim.cases.domains import Domain
from cutsim.cases.expressions import TimeValue, corners_of
from cutsim.cases.interfaces import faces_of, friction_of
from cutsim.cases.keys import Keys
from cutsim.cases.refusals import refusing
from cutsim.cases.rigs import crack_surface, function, machines
from cutsim.fields.faces import Face, mean_size
from cutsim.fields.points import Surface
from cutsim.fields.sizes import normal_size
from cutsim.fields.state import State
from cutsim.fields.temperature import Temperature
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.crack import Crack
from cutsim.tools.carriage import Carriage
from cutsim.tools.insertable import Insertable
from cutsim.tools.rigid_tool import RigidTool
from cutsim.tools.shapes import ToolPath
from cutsim.tools.tool_contact import ToolContact
from cutsim.tools.triangulated_tool import TriangulatedTool
from cutsim.tools.triangulation import Triangulation


def tools(
    domain: Domain, solids: tuple[Solid, ...], cracks: Mapping[str, Crack], temperature: Temperature | None
) -> dict[str, RigidTool]:
    """Tools of a case by name. Collective.

    Raises:
        CaseError: A surface is unknown, or a tool refuses a parameter.
    """
    found: dict[str, RigidTool] = {}
    shared = {name: _carriage(domain, solids[0].state, name) for name in domain.tables.carriages}
    for name, table in domain.tables.tools.items():
        drive = shared.get(table.carriage or "") or machines(domain, ("tools", name), table.machines)
        if isinstance(table, schema.SurfaceTool):
            found[name] = _triangulated(domain, solids, name, table, cracks, temperature, drive)
        else:
            found[name] = _shaped(domain, solids, name, table, cracks, temperature, drive)
    return found


def _carriage(domain: Domain, state: State, name: str) -> Carriage:
    key, table = ("carriages", name), domain.tables.carriages[name]
    drive = machines(domain, key, table.machines)
    with refusing(domain.document, *key):
        return Carriage(state, path_of(table), drive, name=name, release=table.release)


def _shaped(
    domain: Domain,
    solids: tuple[Solid, ...],
    name: str,
    table: schema.Tool,
    cracks: Mapping[str, Crack],
    temperature: Temperature | None,
    drive: Sequence[Machine] | Carriage,
) -> ToolContact:
    key, shape, state = ("tools", name), table.made, solids[0].state
    surfaces = [_surface(domain, state, (*key, "surfaces"), surface, cracks) for surface in table.surfaces]
    with refusing(domain.document, *key):
        contact = table.contact or _contact(shape, solids, surfaces)
        friction, path = friction_of(table, temperature), path_of(table)
        return ToolContact(
            state,
            shape,
            path,
            surfaces,
            contact=contact,
            friction=friction,
            allowed_penetration=table.allowed_penetration,
            name=name,
            machines=drive,
        )


def _triangulated(
    domain: Domain,
    solids: tuple[Solid, ...],
    name: str,
    table: schema.SurfaceTool,
    cracks: Mapping[str, Crack],
    temperature: Temperature | None,
    drive: Sequence[Machine] | Carriage,
) -> TriangulatedTool:
    key, state = ("tools", name), solids[0].state
    face = Face.joined(faces_of(domain, (*key, "surfaces"), table.surfaces, cracks))
    with refusing(domain.document, *key):
        once = len(np.unique(face.facets)) == len(face.facets)
        require("surfaces", list(table.surfaces), once, "one face of a crack: the other one takes a tool of its own")
        surface = Triangulation.read(table.file, table.scale, comm=state.mesh.comm)
        contact = table.contact or PenaltyContact.automatic(
            softest(solids, face.facets), mean_size(state.mesh, [face], normal_size)
        )
        friction, path = friction_of(table, temperature), path_of(table)
        return TriangulatedTool(
            state,
            face,
            surface,
            path,
            contact=contact,
            friction=friction,
            allowed_penetration=table.allowed_penetration,
            search=table.search,
            machines=drive,
            name=name,
        )


def _surface(domain: Domain, state: State, key: Keys, name: str, cracks: Mapping[str, Crack]) -> Surface:
    """A group of outer facets, or a face of a crack by its name with + or −."""
    surface = crack_surface(name, cracks)
    if surface is not None:
        return surface
    facets = domain.facets(key, [name])
    with refusing(domain.document, *key):
        return Surface.exterior(state, facets)


def _contact(shape: object, solids: tuple[Solid, ...], surfaces: list[Surface]) -> PenaltyContact:
    """Contact law of a tool that is given none: that of its kind, or a penalty of 10 E/h. Collective."""
    points = [surface.points for surface in surfaces]
    young = min(softest(solids, p.facets) for p in points)
    h = min(p.mean(normal_size(solids[0].state.mesh, p.facets)) for p in points)
    return shape.soft_contact(young, h) if isinstance(shape, Insertable) else PenaltyContact.automatic(young, h)


def path_of(table: schema.Moved) -> ToolPath:
    """Motion of a tool or a carriage.

    Raises:
        ValueError: A motion that turns has a rotation beside it, or a parameter of the motion is refused.
    """
    if table.path is not None:
        path = table.path.made()
    else:
        position = [function(value) for value in table.position or ()]
        path = ToolPath(lambda t: np.array([f(t) for f in position]), _corners(table.position or ()))
    if table.rotation is None:
        return replace(path, corners=tuple(sorted({*path.corners, *table.corners})))
    require("rotation", "given", path.rotation is None, "left out: the path turns the tool")
    values = table.rotation if isinstance(table.rotation, tuple) else (table.rotation,)
    turns, corners = [function(value) for value in values], {*path.corners, *table.corners, *_corners(values)}
    return replace(path, corners=tuple(sorted(corners)), rotation=lambda t: np.array([f(t) for f in turns]))


def _corners(values: tuple[TimeValue, ...]) -> tuple[float, ...]:
    return tuple(corner for value in values for corner in corners_of(value))
