"""Rigid bodies of FEBio: their motion, and the nodes that are fastened to them."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cutsim.cases.importing.curves import Timed
from cutsim.cases.importing.draft import Untranslatable
from cutsim.cases.importing.febio_context import AXES, Context, describe
from cutsim.cases.importing.febio_file import children
from cutsim.cases.importing.febio_supports import add_supports, nodes_of_set
from cutsim.readers.xml_tree import LinedElement

_ROTATIONS = {"Ru", "Rv", "Rw"}
_TRANSLATIONS = {"Rx": 0, "Ry": 1, "Rz": 2}


@dataclass
class RigidBody:
    """Rigid body that translates as prescribed.

    Attributes:
        name: Name of its material.
        line: Line of its material.
        motion: Displacement along each axis that is prescribed.
        held: Rotations that are prevented.
        problem: Why its motion is not that of a tool, if it is not.
    """

    name: str
    line: int
    motion: dict[int, Timed] = field(default_factory=dict)
    held: set[str] = field(default_factory=set)
    problem: str = ""

    def path(self, end: float) -> dict[str, Any]:
        """How a case file says the motion of a tool.

        Raises:
            Untranslatable: It is none that a tool can have.
        """
        self.check()
        if all(value.vanishes for value in self.motion.values()):
            return {"position": [0.0, 0.0, 0.0]}
        times = np.unique(np.concatenate([value.times(end) for value in self.motion.values()]))
        points = np.column_stack([self.motion[axis].at(times) for axis in range(len(AXES))])
        return {"path": {"times": times.tolist(), "points": points.tolist()}}

    def check(self) -> None:
        """Refuse a motion that is not wholly prescribed, or rotates.

        Raises:
            Untranslatable: It is so.
        """
        if self.problem:
            raise Untranslatable(f"rigid body {self.name!r} {self.problem}", self.line)
        if set(self.motion) != {0, 1, 2} or self.held != _ROTATIONS:
            raise Untranslatable(f"rigid body {self.name!r} moves freely in some direction", self.line)


def rigid_bodies(
    context: Context, materials: dict[str, LinedElement], references: dict[str, str]
) -> dict[str, RigidBody]:
    """The rigid bodies of a file with their motion.

    Args:
        context: The file and the case.
        materials: The rigid materials by name.
        references: Name of each by what elements of the file call it.
    """
    bodies = {name: RigidBody(name, element.line) for name, element in materials.items()}
    for element, reference in _motions(context):
        body = bodies.get(references.get(reference, ""))
        if body is not None:
            try:
                _move(context, element, body)
            except Untranslatable as problem:
                body.problem = f"has <{element.tag}> of type {element.get('type') or element.get('bc')!r}: {problem}"
                context.draft.untranslated(problem.line, f"{describe(element)}: {problem}")
            context.file.read_all(element)
    return bodies


def _motions(context: Context) -> Iterator[tuple[LinedElement, str]]:
    """Elements that say how a rigid body moves, and the body to which they refer."""
    for tag in ("Rigid", "Boundary", "Constraints"):
        for section in context.file.sections(tag):
            for element in children(section):
                if element.tag == "rigid_body":
                    context.file.read(element)
                    yield from ((child, element.get("mat", "")) for child in children(element))
                elif element.tag in ("rigid_bc", "rigid_constraint", "rigid_load"):
                    context.file.read(element)
                    yield element, context.file.text(element, "rb")


def _move(context: Context, element: LinedElement, body: RigidBody) -> None:
    """Take note of one condition on a rigid body."""
    file, kind = context.file, element.get("type") or element.tag
    if kind in ("rigid_fixed", "fix", "fixed"):
        for dof in _fixed(context, element):
            body.motion.update({_TRANSLATIONS[dof]: Timed(0.0)} if dof in _TRANSLATIONS else {})
            body.held |= {dof} & _ROTATIONS
        return
    if kind not in ("rigid_displacement", "prescribe", "prescribed"):
        raise Untranslatable("has no counterpart", element.line)
    dof = element.get("bc") or file.text(element, "dof")
    axis = _TRANSLATIONS.get(dof, AXES.find(dof) if dof else -1)
    if axis < 0:
        raise Untranslatable(f"prescribed rotation {dof}", element.line)
    if file.text(element, "relative", "0") not in ("0", "false", ""):
        raise Untranslatable("it is relative to the displacement at the start of a step", element.line)
    body.motion[axis] = file.timed(element) if element.tag == "prescribed" else file.timed_child(element, "value")


def _fixed(context: Context, element: LinedElement) -> list[str]:
    """Degrees of freedom that a condition fixes, as version 4.0 calls them."""
    if element.tag == "fixed":
        bc = element.get("bc", "")
        return [f"R{'uvw'[AXES.index(bc[1])]}" if bc.startswith("R") else f"R{bc}"]
    if element.get("type") == "fix":
        return [dof.strip() for dof in context.file.text(element, "dofs").split(",")]
    return [dof for dof in (*_TRANSLATIONS, *_ROTATIONS) if context.file.number(element, f"{dof}_dof", 0.0)]


def translate_fastened(context: Context, bodies: dict[str, RigidBody], references: dict[str, str]) -> None:
    """Translate nodes that are fastened to rigid bodies, in sets or because they belong to them, as supports.

    Args:
        context: The file and the case.
        bodies: The rigid bodies by name.
        references: Name of each body by what elements of the file call it.
    """
    for section in context.file.sections("Boundary"):
        for element in children(section):
            if element.tag == "rigid" or (element.tag == "bc" and element.get("type") == "rigid"):
                context.attempt(element, lambda each: _fasten(context, each, bodies, references))
    for section in context.file.sections("Contact"):
        for element in children(section):
            if element.get("type") == "rigid":
                context.attempt(element, lambda each: _fasten_nodes(context, each, bodies, references))
    deformable = context.deformable_nodes
    for name, parts in context.rigid_parts.items():
        shared = np.intersect1d(context.nodes_of(parts), deformable)
        if len(shared):
            _fasten_shared(context, bodies[name], shared)


def _fasten(context: Context, element: LinedElement, bodies: dict[str, RigidBody], references: dict[str, str]) -> None:
    body = bodies.get(references.get(element.get("rb") or context.file.text(element, "rb"), ""))
    if body is None:
        raise Untranslatable("it names no rigid body", element.line)
    body.check()
    name = element.get("name") or f"{body.name}_{element.get('node_set')}"
    comment = f"line {element.line}: fastened to the rigid body {body.name!r}"
    add_supports(context, name, nodes_of_set(context, element), body.motion, comment)


def _fasten_nodes(
    context: Context, element: LinedElement, bodies: dict[str, RigidBody], references: dict[str, str]
) -> None:
    """Nodes that version 2.0 lists with the body of each."""
    nodes: dict[str, list[int]] = {}
    for node in children(element):
        context.file.read(node)
        nodes.setdefault(node.get("rb", ""), []).append(context.file.whole(node, "id"))
    for reference, numbers in nodes.items():
        body = bodies.get(references.get(reference, ""))
        if body is None:
            raise Untranslatable("it names no rigid body", element.line)
        body.check()
        where = {"points": context.places(context.rows(numbers, element))}
        comment = f"line {element.line}: fastened to the rigid body {body.name!r}"
        add_supports(context, f"{body.name}_nodes", where, body.motion, comment)


def _fasten_shared(context: Context, body: RigidBody, nodes: Any) -> None:
    try:
        body.check()
    except Untranslatable as problem:
        context.draft.untranslated(
            problem.line, f"nodes that belong to a rigid body and to a deformable part: {problem}"
        )
        return
    comment = f"line {body.line}: nodes of the rigid body {body.name!r} that a deformable part has, too"
    add_supports(context, f"{body.name}_nodes", {"points": context.places(nodes)}, body.motion, comment)
