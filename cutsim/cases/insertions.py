"""Insertion of a blade or needle, as a case gives it: the ready-made problem."""

from collections.abc import Mapping, Sequence
from typing import Any

from cutsim.cases import schema_parts as schema
from cutsim.cases.bodies import softest, solid_options, solids
from cutsim.cases.domains import Domain, Entities
from cutsim.cases.heating import temperature
from cutsim.cases.interfaces import friction_of
from cutsim.cases.refusals import refused, refusing
from cutsim.cases.rigs import machine
from cutsim.fields.state import State
from cutsim.fields.temperature import Temperature
from cutsim.studies.body import CrackedBody, cracked_state
from cutsim.studies.insertion import Insertion
from cutsim.studies.layered import Layer, LayeredBlock
from cutsim.tools.insertable import Insertable

_KEY = "insertion"


def inserted(domain: Domain, mechanics: Mapping[str, Any]) -> tuple[Insertion, Temperature | None]:
    """The insertion of a case, and its temperature if it has heat. Collective.

    Args:
        domain: Mesh and groups.
        mechanics: Arguments of `Mechanics`.

    Raises:
        CaseError: A group is missing, or tool and body do not fit.
    """
    table = domain.tables.insertion
    assert table is not None
    body, value = _layered(domain) if domain.tables.layers else _cracked(domain)
    _check_fixture(domain, body)
    tool = domain.tables.tools[table.tool]
    shape = tool.made
    if not isinstance(shape, Insertable):
        raise refused(domain.document, ("tools", table.tool, "shape"), "must be a blade or a needle, to be inserted")
    drive = None if table.machine is None else machine(domain, (_KEY, "machine"), table.machine)
    with refusing(domain.document, _KEY, elsewhere={"tool": ("tools", table.tool), "drive": (_KEY,)}):
        cut = Insertion.build(
            body,
            shape,
            table.drive,
            notch=table.notch,
            friction=friction_of(tool, value),
            fixture=table.fixture,
            machine=drive,
            mechanics=mechanics,
        )
    return cut, value


def _check_fixture(domain: Domain, body: CrackedBody) -> None:
    """Refuse names that are no groups of the mesh."""
    assert domain.tables.insertion is not None
    fixture = domain.tables.insertion.fixture
    key = (_KEY, "fixture")
    named: Mapping[str, Sequence[str]] = {
        "top": fixture.tops(body),
        "plate": (fixture.plate,),
        "walls": fixture.walls,
        "ends": fixture.ends,
    }
    for name, groups in named.items():
        domain.facets((*key, name), groups)
    if domain.tables.mesh.axisymmetric:
        domain.cells((*key, "thread"), (fixture.thread,))


def _cracked(domain: Domain) -> tuple[CrackedBody, Temperature | None]:
    """Bodies with one bonded crack. Collective."""
    tables = domain.tables
    assert tables.insertion is not None
    crack, notch, side = tables.insertion.groups
    key = (_KEY, "groups")
    bonded, plus = domain.facets(key, [crack]), domain.cells(key, [side])
    broken = [domain.facets(key, [notch])] if notch in domain.tagged.names else []
    state = _state(domain, [bonded, *broken])
    value = temperature(domain, state, [bonded, *broken])
    bodies = solids(domain, state, value)
    with refusing(domain.document, _KEY):
        faces = tables.insertion.faces
        cracks = (faces.crack(state, bonded, plus, tables.law, young=softest(bodies, bonded)),)
        cut = [faces.crack(state, f, plus, None, young=softest(bodies, f), name="notch") for f in broken]
        guides, pairs, slit = faces.guides(cracks), faces.pairs([*cut, *cracks], bodies), cut[0] if cut else None
    made: dict[str, Any] = {"guides": guides, "pairs": pairs, "faces": faces}
    return CrackedBody(domain.tagged, state, bodies, cracks, slit, **made), value


def _state(domain: Domain, split: Sequence[Entities]) -> State:
    mesh = domain.tables.mesh
    with refusing(domain.document, "mesh"):
        return cracked_state(domain.tagged, split, mesh.degree, mesh.axisymmetric)


def _layered(domain: Domain) -> tuple[LayeredBlock, Temperature | None]:
    """Block of layers, each a body of its own. Collective."""
    tables = domain.tables
    assert tables.insertion is not None
    with refusing(domain.document, "layers"):
        block = LayeredBlock.build(
            [_layer(domain, table) for table in tables.layers],
            domain.tagged,
            damping=tables.insertion.damping,
            axisymmetric=tables.mesh.axisymmetric,
            degree=tables.mesh.degree,
            faces=tables.insertion.faces,
        )
    return block, temperature(domain, block.state, [block.slit])


def _layer(domain: Domain, table: schema.Layer) -> Layer:
    options = solid_options(table)
    if "viscosity" not in table.model_fields_set:  # that of the damping
        del options["viscosity"]
    material, law = table.material or domain.tables.material, table.law or domain.tables.law
    assert material is not None and law is not None  # a case without is refused
    return Layer(table.name, table.thickness, material, law, options)
