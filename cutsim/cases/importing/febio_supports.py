"""Fixed and prescribed displacements of FEBio as supports."""

from typing import Any

import numpy as np

from cutsim.cases.importing.curves import Timed
from cutsim.cases.importing.draft import MalformedFile, Untranslatable
from cutsim.cases.importing.febio_context import AXES, Context, describe
from cutsim.cases.importing.febio_file import children
from cutsim.readers.xml_tree import LinedElement

_RIGID_BODIES = ("rigid_body", "rigid")


def translate_supports(context: Context) -> None:
    """Translate what is fixed and prescribed; rigid bodies are left to `febio_rigid`."""
    for section in context.file.sections("Boundary"):
        for element in children(section):
            if element.tag not in _RIGID_BODIES and element.get("type") != "rigid":
                context.attempt(element, lambda each: _translate(context, each))


def add_supports(context: Context, name: str, where: dict[str, Any], values: dict[int, Timed], comment: str) -> None:
    """Add the supports of some nodes.

    Args:
        context: The file and the case.
        name: Name of the condition.
        where: Key and value of the case file for the nodes.
        values: Displacement along each axis that is held.
        comment: Where it comes from.
    """
    end = context.file.end
    if len(values) == len(AXES) and all(value.vanishes for value in values.values()):
        context.draft.add("supports", name, {**where, "direction": "all"}, comment)
        return
    for axis, value in values.items():
        amount = {} if value.vanishes else {"value": value.value(end)}
        called = name if len(values) == 1 else f"{name}_{AXES[axis]}"
        context.draft.add("supports", called, {**where, "direction": AXES[axis], **amount}, comment)


def nodes_of_set(context: Context, element: LinedElement) -> dict[str, Any]:
    """Key and value of the case file for the nodes of a condition: a set of the mesh, or their positions.

    Raises:
        Untranslatable: The condition is on something else.
        MalformedFile: There is no such set or node.
    """
    kind, _, name = (element.get("node_set") or element.get("set") or "").strip().rpartition(":")
    if kind == "@surface":
        return {"facets": name}
    if kind == "@elem_set" and name in context.mesh.cell_sets:
        return {"cells": name}
    if name:
        if name not in context.mesh.node_sets:
            raise MalformedFile(f"{context.file.place(element)}: there is no node set {name!r}")
        return {"facets" if context.quadratic else "vertices": name}
    nodes = [context.file.read(child) for child in children(element) if child.tag == "node"]
    if not nodes:
        raise Untranslatable("it names no nodes", element.line)
    rows = context.rows([context.file.whole(node, "id") for node in nodes], element)
    rows = rows[np.isin(rows, context.deformable_nodes)]
    return {"points": context.places(rows)}


def _translate(context: Context, element: LinedElement) -> None:
    values = _values(context, element)
    if values and _on_rigid_bodies(context, element):
        context.draft.difference(element.line, f"{describe(element)}: no effect, all its nodes belong to rigid bodies")
        return
    name = element.get("name") or element.get("node_set") or element.get("set") or f"{element.tag}_{element.get('bc')}"
    comment = f"line {element.line}"
    if values:
        add_supports(context, name, nodes_of_set(context, element), values, comment)


def _on_rigid_bodies(context: Context, element: LinedElement) -> bool:
    """Whether all nodes of a condition belong to rigid bodies, which move as they are told."""
    name = (element.get("node_set") or element.get("set") or "").strip()
    nodes = context.mesh.node_sets.get(name)
    if nodes is None:
        numbers = [context.file.whole(node, "id") for node in children(element) if node.tag == "node"]
        nodes = context.rows(numbers, element)
    return bool(context.rigid_parts) and len(nodes) > 0 and not np.isin(nodes, context.deformable_nodes).any()


def _values(context: Context, element: LinedElement) -> dict[int, Timed]:
    """Displacement along each axis that a condition holds."""
    file, kind = context.file, element.get("type") if element.tag == "bc" else element.tag
    if kind in ("fix", "zero displacement"):
        return {axis: Timed(0.0) for axis in _fixed_axes(context, element)}
    if kind not in ("prescribe", "prescribed displacement"):
        raise Untranslatable("has no counterpart", element.line)
    if file.text(element, "relative") not in ("", "0", "false") or element.get("type") == "relative":
        raise Untranslatable("it is relative to the displacement at the start of a step", element.line)
    return {axis_of(element.get("bc") or file.text(element, "dof"), element): amount(context, element)}


def amount(context: Context, element: LinedElement) -> Timed:
    """Value of a condition on nodes: a number with a load curve, the same for all nodes.

    Raises:
        Untranslatable: Each node has a value of its own.
    """
    file = context.file
    holder = file.child(element, "value", "scale")
    if holder is not None:
        return file.timed(holder)
    numbers = {(node.text or "1").strip() for node in children(element) if node.tag == "node"} or {"1"}
    if len(numbers) > 1:
        raise Untranslatable("each node has a value of its own", element.line)
    return Timed(float(numbers.pop()), file.curve(element))


def _fixed_axes(context: Context, element: LinedElement) -> list[int]:
    file = context.file
    if element.get("type") == "zero displacement":
        return [i for i, axis in enumerate(AXES) if file.number(element, f"{axis}_dof", 0.0)]
    dofs = (element.get("bc") or file.text(element, "dofs")).replace(",", "").replace(" ", "")
    return [axis_of(dof, element) for dof in dofs]


def axis_of(dof: str, element: LinedElement) -> int:
    """Number of the axis of a degree of freedom.

    Raises:
        Untranslatable: It is no component of the displacement.
    """
    if len(dof) != 1 or dof not in AXES:
        raise Untranslatable(f"degree of freedom {dof!r}", element.line)
    return AXES.index(dof)
