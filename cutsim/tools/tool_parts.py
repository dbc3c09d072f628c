"""Force and friction work of a pointed tool, divided into tip and shaft (docs/needle_insertion.md)."""

from collections.abc import Callable, Sequence

import ufl
from dolfinx.mesh import Mesh

from cutsim.base.signatures import checked
from cutsim.base.terms import Columns
from cutsim.fields.points import Values
from cutsim.tools.insertable import Insertable
from cutsim.tools.shapes import with_form_constants
from cutsim.tools.tool_contact import Patch, ToolContact

#: Parts of a tool, from its foremost point upwards.
PARTS = ("tip", "shaft")

_QUANTITIES = ("force", "friction", "work")
_Parts = dict[tuple[str, str], float]


class ToolParts:
    """Force and friction work of tip and shaft of a tool, as an observer of the mechanics.

    A point of the body counts to the part beside which it is now; the shaft begins at `Insertable.shaft_height`.  The
    parts sum up to the tool's force and friction work, as they come from the same tractions at the same points.

    Args:
        tools: The tool, or its halves.
        shape: Shape of the whole tool.
        name: Name in messages.
    """

    @checked
    def __init__(self, tools: Sequence[ToolContact], shape: Insertable, name: str = "tool_parts") -> None:
        self.name = name
        self._shaft = shape.shaft_height
        self._patches = [(patch, _evaluator(tool.state.mesh, patch, shape)) for tool in tools for patch in tool.patches]
        none: _Parts = {(quantity, part): 0.0 for quantity in _QUANTITIES for part in PARTS}
        self._known = tools[0].state.memory.value(name, none)

    def evaluate(self) -> None:
        """Forces of the trial state and work up to it. Collective."""
        total = {key: value if key[0] == "work" else 0.0 for key, value in self._known.committed.items()}
        for patch, evaluate in self._patches:
            now, points = evaluate(), patch.surface.points
            densities = {
                "force": now["pressure"] + now["friction"],
                "friction": now["friction"],
                "work": patch.dissipation(),
            }
            beside = {"tip": now["height"] < self._shaft, "shaft": now["height"] >= self._shaft}
            for quantity, part in total:
                total[quantity, part] += points.integral(beside[part] * densities[quantity])
        self._known.trial = total

    def record(self) -> Columns:
        """No columns of its own."""
        return {}

    def force(self, part: str) -> float:
        """Force on a part against the push, which turns with the tool, in the trial state; with friction [force]."""
        return self._known.trial["force", part]

    def friction(self, part: str) -> float:
        """What friction has in it [force]."""
        return self._known.trial["friction", part]

    def friction_work(self, part: str) -> float:
        """Friction work on a part up to the trial state [energy]."""
        return self._known.trial["work", part]


def _evaluator(mesh: Mesh, patch: Patch, shape: Insertable) -> Callable[[], dict[str, Values]]:
    """Force densities against the push, and height above the foremost point."""
    back = -ufl.as_vector(with_form_constants(mesh, shape).push)
    friction = ufl.as_ufl(0.0) if patch.slip is None else ufl.dot(patch.slip.traction, back)
    return patch.surface.points.evaluator(
        {"pressure": ufl.dot(patch.thrust, back), "friction": friction, "height": ufl.dot(patch.place, back)}
    )
