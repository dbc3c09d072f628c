"""What tables of a case file, each valid by itself, have to have in common."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from cutsim.cases.geometries import LAMINATE
from cutsim.cases.keys import Keys
from cutsim.cases.schema_parts import Carriage, Moved, Pair, Tool, Weight
from cutsim.cases.schema_rigs import AnyMachine
from cutsim.tools.shapes import directions

_ABSOLUTE_ZERO = {"K": 0.0, "degC": -273.15}
# vectors of the motions of tools
_MOTIONS = ("start", "velocity", "stroke", "draw", "pivot", "axis")
#: Where something is wrong, what, and the value.
Problem = tuple[Keys, str, Any]


def contradictions(valid: Mapping[str, Any]) -> Iterator[Problem]:
    """What is wrong between the tables of a case.

    Args:
        valid: Those tables that are valid by themselves; what concerns others is not looked at.
    """
    for check in _CHECKS:
        try:
            yield from check(valid)
        except KeyError:  # it concerns a table that is not valid
            continue


def _dimension(valid: Mapping[str, Any]) -> Iterator[Problem]:
    """Vectors have as many components as the mesh."""
    mesh = valid["mesh"]
    gdim = (3 if "width" in mesh.set else 2) if mesh.geometry == LAMINATE else mesh.dim
    if gdim is None:
        yield ("mesh", "dim"), "missing, must be given: 2 or 3, the dimension of the mesh and of its space", None
        return
    flat = {"z", "rx", "ry"} if gdim == 2 else set()
    for name, link in valid.get("links", {}).items():
        for axis in sorted(flat & link.motion.keys()):
            yield ("links", name, axis), "not allowed: the mesh is flat", getattr(link, axis)
    for keys, vector in _vectors(valid):
        if isinstance(vector, tuple) and len(vector) != gdim:
            yield keys, f"must have {gdim} components, as the mesh has dimensions", list(vector)
        if vector in flat or (flat and vector == "-z"):
            yield keys, "must be another axis: the mesh is flat", vector


def _vectors(valid: Mapping[str, Any]) -> Iterator[tuple[Keys, Any]]:
    """Positions and directions of a case."""
    for name, tool in valid.get("tools", {}).items():
        yield from _moving(("tools", name), tool)
        if tool.made is not None:
            yield from ((("tools", name, part), getattr(tool, part)) for part in directions(tool.made))
    for name, carriage in valid.get("carriages", {}).items():
        yield from _moving(("carriages", name), carriage)
    insertion = valid.get("insertion")
    if insertion is not None and insertion.machine is not None:
        yield ("insertion", "machine", "axis"), insertion.machine.axis
    for name, link in valid.get("links", {}).items():
        yield ("links", name, "reference"), link.reference
        yield from _axes(("links", name), link.machines)
        for part, place in link.attachments.items():
            where = ("links", name, "attachments", part, "points")
            yield from (((*where, i), point) for i, point in enumerate(place.points))
    for table in ("supports", "loads"):
        for name, entry in valid.get(table, {}).items():
            yield (table, name, "direction"), getattr(entry, "direction", None)
            yield from (((table, name, "points", i), p) for i, p in enumerate(getattr(entry, "points", ())))
    for name, crack in valid.get("cracks", {}).items():
        yield ("cracks", name, "plus"), None if isinstance(crack.plus, str) else crack.plus


def _moving(key: Keys, table: Tool | Carriage) -> Iterator[tuple[Keys, Any]]:
    """Positions and directions of a tool or a carriage."""
    yield (*key, "position"), table.position
    yield from (((*key, "path", "points", i), p) for i, p in enumerate(getattr(table.path, "points", ())))
    yield from (((*key, "path", part), getattr(table.path, part, None)) for part in _MOTIONS)
    yield from _axes(key, table.machines)


def _axes(key: Keys, machines: Sequence[AnyMachine]) -> Iterator[tuple[Keys, Any]]:
    yield from (((*key, "machines", i, "axis"), machine.axis) for i, machine in enumerate(machines))


def _materials(valid: Mapping[str, Any]) -> Iterator[Problem]:
    if valid["material"] is not None:
        return
    if not valid["bodies"] and not valid["layers"]:
        yield ("material",), "missing, must be given: the material of the body", None
    parts = [*valid["bodies"].items(), *enumerate(valid["layers"])]
    for name, part in parts:
        if part.material is None:
            table = "layers" if isinstance(name, int) else "bodies"
            yield (table, name, "material"), "missing, must be given here or as [material] for all", None


def _laws(valid: Mapping[str, Any]) -> Iterator[Problem]:
    if valid["law"] is not None:
        return
    for name, crack in valid["cracks"].items():
        if "law" not in crack.model_fields_set:
            yield (
                ("cracks", name, "law"),
                'missing, must be given here or as [law] for all, or "none" for contact',
                None,
            )
    for i, layer in enumerate(valid["layers"]):
        if layer.law is None:
            yield ("layers", i, "law"), "missing, must be given here or as [law] for all", None
    if valid["insertion"] is not None and not valid["layers"]:
        yield ("law",), "missing, must be given: the cohesive law of the crack along which the tool is inserted", None


def _layers(valid: Mapping[str, Any]) -> Iterator[Problem]:
    laminate = valid["mesh"].geometry == LAMINATE
    if laminate and not valid["layers"]:
        yield ("layers",), f"missing, must be given: the layers of the geometry {LAMINATE!r}", None
    if valid["layers"] and valid["bodies"]:
        yield ("bodies",), "not allowed beside [[layers]], each of which is a body", None
    if valid["layers"] and valid["insertion"] is None:
        yield (
            ("layers",),
            "not allowed without [insertion]: name the groups of the mesh under [bodies] and [cracks]",
            None,
        )
    names = [layer.name for layer in valid["layers"]]
    for i, name in enumerate(names):
        if name in names[:i]:
            yield ("layers", i, "name"), "must differ from the names of the other layers", name


def _insertion(valid: Mapping[str, Any]) -> Iterator[Problem]:
    insertion = valid["insertion"]
    if insertion is None:
        return
    for table in ("cracks", "pairs", "carriages", "supports", "links", "loads"):
        if valid[table]:
            yield (table,), "not allowed beside [insertion], which makes its own", None
    for name in valid["tools"]:
        if name != insertion.tool:
            yield ("tools", name), f"not allowed beside [insertion], whose tool is {insertion.tool!r}", None
    tool = valid["tools"].get(insertion.tool)
    if tool is None:
        yield ("insertion", "tool"), "must be the name of a tool, such as that of [tool]", insertion.tool
    elif not tool.pointed:
        yield ("insertion", "tool"), "must be a blade or a needle", insertion.tool
    if insertion.depth is not None and insertion.machine is not None and not insertion.machine.stiffness:
        words = "not allowed with a machine without stiffness, which goes where it can: give until in [analysis]"
        yield ("insertion", "depth"), words, insertion.depth


def _end(valid: Mapping[str, Any]) -> Iterator[Problem]:
    insertion = valid["insertion"]
    depth = None if insertion is None else insertion.depth
    if depth is None and valid["analysis"].until is None:
        where = "" if insertion is None else ", or depth in [insertion]"
        yield ("analysis", "until"), f"missing, must be given: the time at which the run ends{where}", None
    if depth is not None and valid["analysis"].until is not None:
        yield ("analysis", "until"), "not allowed beside depth in [insertion]", valid["analysis"].until


def _pairs(valid: Mapping[str, Any]) -> Iterator[Problem]:
    pairs: Mapping[str, Pair] = valid["pairs"]
    for name, pair in pairs.items():
        if not pair.slave and not pair.automatic:
            words = "missing, must be given: a surface that touches another one, or itself; or automatic = true"
            yield ("pairs", name, "slave"), words, None
        if pair.automatic and (pair.slave or pair.master):
            key = "slave" if pair.slave else "master"
            yield ("pairs", name, key), "not allowed beside automatic, which takes all surfaces", None
        if pair.master or not pair.slave:
            continue
        if pair.law is not None and not isinstance(pair.law, str):
            yield ("pairs", name, "law"), "not allowed for a surface that meets itself: give a master", None


def _tools(valid: Mapping[str, Any]) -> Iterator[Problem]:
    inserted = None if valid["insertion"] is None else valid["insertion"].tool
    tools: Mapping[str, Tool] = valid["tools"]
    for name, tool in tools.items():
        if name == inserted:
            moved = tool.position is not None or tool.path is not None
            if moved or tool.rotation is not None or tool.surfaces:
                yield ("tools", name), "must have no surfaces and no motion: [insertion] gives them", None
            for key in ("machines", "carriage"):
                if getattr(tool, key):
                    yield ("tools", name, key), "not allowed: give [insertion] a machine, which moves the tool", None
            continue
        if not tool.surfaces:
            yield ("tools", name, "surfaces"), "missing, must be given: what the tool can touch", None
        yield from _motion(("tools", name), tool)
        if tool.machines and tool.carriage is not None:
            yield ("tools", name, "machines"), "not allowed beside carriage, which has machines of its own", None


def _motion(key: Keys, table: Moved) -> Iterator[Problem]:
    """Whether a motion is given, and one only."""
    if (table.position is None) == (table.path is None):
        yield (*key, "position"), "must be given, or path, and not both", None


def _carriages(valid: Mapping[str, Any]) -> Iterator[Problem]:
    carried = {tool.carriage for tool in valid["tools"].values()}
    for name, carriage in valid["carriages"].items():
        yield from _motion(("carriages", name), carriage)
        if name not in carried:
            yield ("carriages", name), f"carries nothing: give a tool carriage = {name!r}", None


def _dynamics(valid: Mapping[str, Any]) -> Iterator[Problem]:
    weights = [load for load in valid["loads"].values() if isinstance(load, Weight)]
    dynamic = valid["analysis"].type == "dynamic"
    if not weights and not dynamic:
        return
    words = f"missing, must be given for {'a dynamic analysis' if dynamic else 'a weight'}"
    if not valid["bodies"] and not valid["layers"]:
        yield ("bodies", "body", "density"), words, None
    for name, body in [*valid["bodies"].items(), *enumerate(valid["layers"])]:
        heavy = dynamic or any(not weight.bodies or name in weight.bodies for weight in weights)
        if heavy and body.density is None:
            yield ("layers" if isinstance(name, int) else "bodies", name, "density"), words, None


def _heat(valid: Mapping[str, Any]) -> Iterator[Problem]:
    heat, bodies, unit = valid["heat"], valid["bodies"], valid["units"].temperature
    if heat is not None and heat.initial < (zero := _ABSOLUTE_ZERO[unit]):
        yield ("heat", "initial"), f"must be at least absolute zero, {zero:g} {unit}", heat.initial
    names = list(bodies) or [layer.name for layer in valid["layers"]] or ["body"]
    for name in names:
        if heat is not None and name not in heat.bodies:
            yield ("heat", "bodies", name), "missing, must be given: conductivity and capacity of this body", None
        if heat is None and name in bodies and bodies[name].thermoelastic is not None:
            yield ("bodies", name, "thermoelastic"), "needs [heat], which gives the temperature", None


_CHECKS = (
    _dimension,
    _materials,
    _laws,
    _layers,
    _insertion,
    _end,
    _pairs,
    _tools,
    _carriages,
    _dynamics,
    _heat,
)
