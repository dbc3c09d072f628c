"""Further columns of the history that a case asks for."""

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np

from cutsim.base.arrays import Array
from cutsim.base.terms import Columns
from cutsim.cases import schema_run as schema
from cutsim.cases.domains import Domain
from cutsim.cases.parts import Parts
from cutsim.cases.refusals import refused, refusing
from cutsim.fields.areas import area
from cutsim.studies.fracture import JIntegral, crack_front
from cutsim.tools.rigid_tool import RigidTool

# times of a path at which it is asked whether the tool moves
_SAMPLES = 1000

#: A number that is found after each step, and what kind of quantity it is.
Measure = tuple[Callable[[], float], str]


def measures(domain: Domain, parts: Parts) -> dict[str, Measure]:
    """What a case measures, by the names of the columns. Collective.

    Raises:
        CaseError: A crack or body is unknown, or a measure refuses a parameter.
    """
    tables = domain.tables.measures.items()
    return {name: _measure(domain, parts, name, table) for name, table in tables if table.kind != "formula"}


def columns_of(domain: Domain, found: Mapping[str, Measure], row: Columns) -> Columns:
    """Columns of what is measured in a step, formulas last. Collective.

    Args:
        domain: The mesh of the case.
        found: What is measured.
        row: Columns that the step has already.

    Raises:
        CaseError: A formula has a name that is no column.
    """
    measured: Columns = {name: (float(value()), kind) for name, (value, kind) in found.items()}
    for name, table in domain.tables.measures.items():
        if isinstance(table, schema.Formula):
            with refusing(domain.document, "measures", name, "value"):
                values = {column: value for column, (value, _) in {**row, **measured}.items()}
                measured[name] = table.value(values), table.quantity
    return measured


def _measure(
    domain: Domain, parts: Parts, name: str, table: schema.Front | schema.Size | schema.DomainIntegral
) -> Measure:
    key = ("measures", name)
    if isinstance(table, schema.Size):
        state, facets = parts.solids[0].state, domain.facets((*key, "facets"), table.facets)
        size = area(state.mesh, facets, axisymmetric=state.axisymmetric)
        return lambda: size, state.facet_measure
    if isinstance(table, schema.Front):
        crack = parts.cracks[table.crack]
        axis, backwards = "xyz".index(table.axis[-1]), table.axis.startswith("-")
        if axis >= domain.tagged.mesh.geometry.dim:
            raise refused(domain.document, (*key, "axis"), "must be x or y: the mesh has two dimensions", table.axis)
        return partial(crack_front, crack, axis, table.quantity, table.level, backwards=backwards), "length"
    solid = next(solid for solid in parts.solids if solid.name == table.body)
    with refusing(domain.document, *key):
        length = 1.0 if table.length is None else table.length
        return JIntegral(
            solid, table.tip, table.direction, table.inner, table.outer, front=table.front, length=length
        ), "toughness"


def tool_measures(tools: Mapping[str, RigidTool], until: float) -> dict[str, Measure]:
    """Travel of each tool along the direction in which it starts, and the force against it.

    Args:
        tools: Tools by name.
        until: Time at which the run ends [time].
    """
    found: dict[str, Measure] = {}
    for name, tool in tools.items():
        start = tool.path.position(0.0)
        along = _direction(tool, until)
        found[f"{name}_travel"] = partial(_travel, tool, start, along), "length"
        found[f"{name}_resistance"] = partial(_resistance, tool, along), "force"
    return found


def _direction(tool: RigidTool, until: float) -> Array:
    """Unit vector along which the path of a tool first moves, or a machine pushes it; zero if neither."""
    start = tool.path.position(0.0)
    for time in np.linspace(0.0, until, _SAMPLES):
        way = tool.path.position(time) - start
        if size := np.linalg.norm(way):
            return np.asarray(way / size)
    return tool.heading


def _travel(tool: RigidTool, start: Array, along: Array) -> float:
    return float((tool.position.value - start) @ along)


def _resistance(tool: RigidTool, along: Array) -> float:
    return float(-tool.force() @ along)
