"""Loads of FEBio on surfaces and nodes."""

from collections.abc import Callable, Mapping
from math import hypot
from types import MappingProxyType
from typing import Any

from cutsim.cases.importing.curves import Timed
from cutsim.cases.importing.draft import MalformedFile, Untranslatable
from cutsim.cases.importing.febio_context import AXES, Context
from cutsim.cases.importing.febio_file import children
from cutsim.cases.importing.febio_supports import amount, axis_of, nodes_of_set
from cutsim.readers.xml_tree import LinedElement

_OFF = ("", "0", "false")
#: First version in which a traction acts per current area unless it is ``linear``.
_CURRENT_AREA = 3.0


def translate_loads(context: Context) -> None:
    """Translate pressures, tractions and forces on nodes."""
    for section in context.file.sections("Loads"):
        for element in children(section):
            context.attempt(element, lambda each: _translate(context, each))


def _translate(context: Context, element: LinedElement) -> None:
    kind = element.get("type", "") if element.tag == "surface_load" else element.tag
    kind = element.get("type", kind) if element.tag in ("nodal_load", "body_load") else kind
    translate = _KINDS.get(kind)
    if translate is None:
        raise Untranslatable("has no counterpart", element.line)
    values = translate(context, element)
    comment, name = f"line {element.line}", element.get("name") or kind
    if element.tag == "body_load":
        for axis, value in values.items():
            context.draft.add(
                "loads", f"weight_{axis[-1]}", {"kind": "weight", "direction": axis, "value": value}, comment
            )
    else:
        context.draft.add("loads", name, values, comment)


def _surface(context: Context, element: LinedElement) -> str:
    """Name of the surface on which a load acts."""
    child = context.file.child(element, "surface")
    name = (element.get("surface") or ("" if child is None else child.get("set")) or "").strip()
    if name not in context.mesh.facet_sets:
        if not name:
            raise Untranslatable("its facets have no name", element.line)
        raise MalformedFile(f"{context.file.place(element)}: there is no surface {name!r}")
    return name


def _refuse_shells(context: Context, element: LinedElement) -> None:
    if context.file.text(element, "shell_bottom") not in _OFF:
        raise Untranslatable("on the bottom of a shell", element.line)


def _pressure(context: Context, element: LinedElement) -> dict[str, Any]:
    file = context.file
    _refuse_shells(context, element)
    file.child(element, "symmetric_stiffness")
    if file.text(element, "linear") not in _OFF:
        raise Untranslatable("a pressure on the reference configuration", element.line)
    value = file.timed_child(element, "pressure").value(file.end)
    return {"kind": "pressure", "facets": _surface(context, element), "value": value}


def _traction(context: Context, element: LinedElement) -> dict[str, Any]:
    file = context.file
    _refuse_shells(context, element)
    dead = file.text(element, "linear") not in _OFF or float(file.root.get("version", "")) < _CURRENT_AREA
    scale = file.child(element, "scale")
    value = Timed(1.0) if scale is None else file.timed(scale)
    surface = {"kind": "traction", "facets": _surface(context, element)}
    return surface | _along(context, file.vector(element, "traction"), value) | ({} if dead else {"current_area": True})


def _along(context: Context, vector: tuple[float, ...], value: Timed) -> dict[str, Any]:
    """Direction and amount of a vector that varies in time."""
    size = hypot(*vector)
    return {
        "direction": [c / size if size else float(i == 0) for i, c in enumerate(vector)],
        "value": Timed(size * value.number, value.curve).value(context.file.end),
    }


def _nodal_load(context: Context, element: LinedElement) -> dict[str, Any]:
    """Force on each node along one axis."""
    axis = axis_of(element.get("bc") or context.file.text(element, "dof"), element)
    vector = tuple(float(i == axis) for i in range(len(AXES)))
    return {"kind": "force", **_vertices(context, element)} | _along(context, vector, amount(context, element))


def _nodal_force(context: Context, element: LinedElement) -> dict[str, Any]:
    """Force on each node along a vector."""
    file = context.file
    _refuse_shells(context, element)
    if file.text(element, "relative") not in _OFF:
        raise Untranslatable("it is relative to the force at the start of a step", element.line)
    child = file.child(element, "value")
    if child is None:
        raise MalformedFile(f"{file.place(element)}: <{element.tag}> has no value")
    return {"kind": "force", **_vertices(context, element)} | _along(
        context, file.vector(child), Timed(1.0, file.curve(child))
    )


def _vertices(context: Context, element: LinedElement) -> dict[str, Any]:
    """Key and value of the case file for the nodes of a load."""
    where = nodes_of_set(context, element)
    if not where.keys() & {"vertices", "points"}:
        raise Untranslatable("forces on the nodes of quadratic elements, or of a surface", element.line)
    return where


def _weight(context: Context, element: LinedElement) -> dict[str, Any]:
    """Acceleration along each axis, by its direction; a force of FEBio acts against its components."""
    if element.get("elem_set"):
        raise Untranslatable("on a set of elements", element.line)
    found = {f"-{axis}": context.file.child(element, axis) for axis in AXES}
    values = {axis: context.file.timed(child) for axis, child in found.items() if child is not None}
    return {axis: value.value(context.file.end) for axis, value in values.items() if not value.vanishes}


_KINDS: Mapping[str, Callable[[Context, LinedElement], dict[str, Any]]] = MappingProxyType(
    {
        "pressure": _pressure,
        "traction": _traction,
        "nodal_load": _nodal_load,
        "nodal_force": _nodal_force,
        "const": _weight,
    }
)
