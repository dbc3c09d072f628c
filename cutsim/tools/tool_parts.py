"""Force and friction work of a pointed tool, divided into tip and shaft (docs/needle_insertion.md)."""

from collections.abc import Callable, Sequence

import ufl

from cutsim.base.kinematics import Expr
from cutsim.base.signatures import checked
from cutsim.base.terms import Term
from cutsim.fields.points import Values
from cutsim.tools.pointed import Pointed
from cutsim.tools.tool_contact import Patch, ToolContact

#: Parts of a tool, from its foremost point upwards.
PARTS = ("tip", "shaft")

_QUANTITIES = ("force", "friction", "work")
_Books = dict[tuple[str, str], float]


class ToolParts(Term):
    """Force and friction work of tip and shaft of a tool; adds nothing to the balance.

    A point of the body counts to the part beside which it is now; the shaft begins at `Pointed.shaft_height`.  The
    parts sum up to the tool's force and friction work, as they come from the same tractions at the same points.

    Args:
        tools: The tool, or its halves; they come before this term in the mechanics.
        shape: Shape of the whole tool.
        name: Name in messages.
    """

    @checked
    def __init__(self, tools: Sequence[ToolContact], shape: Pointed, name: str = "tool_parts") -> None:
        self.name = name
        self._shaft = shape.shaft_height
        self._books = [(patch, _evaluator(patch, shape)) for tool in tools for patch in tool.patches]
        self._trial: _Books = {(quantity, part): 0.0 for quantity in _QUANTITIES for part in PARTS}
        self._old = self._trial

    def residual(self, v: Expr) -> ufl.Form:
        """Nothing."""
        return ufl.Form([])

    def evaluate(self) -> None:
        """Forces of the trial state and work up to it. Collective."""
        self._trial = {key: self._old[key] if key[0] == "work" else 0.0 for key in self._old}
        for patch, evaluate in self._books:
            now, points = evaluate(), patch.surface.points
            densities = {
                "force": now["pressure"] + now["friction"],
                "friction": now["friction"],
                "work": patch.dissipation(),
            }
            beside = {"tip": now["height"] < self._shaft, "shaft": now["height"] >= self._shaft}
            for quantity, part in self._trial:
                self._trial[quantity, part] += points.integral(beside[part] * densities[quantity])

    def force(self, part: str) -> float:
        """Force on a part against the direction of push, pressure and friction, in the trial state [force]."""
        return self._trial["force", part]

    def friction(self, part: str) -> float:
        """What friction has in it [force]."""
        return self._trial["friction", part]

    def friction_work(self, part: str) -> float:
        """Friction work on a part up to the trial state [energy]."""
        return self._trial["work", part]

    def rollback(self) -> None:
        """Back to the forces and the work of the committed state."""
        self._trial = self._old

    def commit(self) -> None:
        """Adopt the trial step."""
        self._old = self._trial


def _evaluator(patch: Patch, shape: Pointed) -> Callable[[], dict[str, Values]]:
    """Force densities against the push, and height above the foremost point."""
    back = ufl.as_vector([-component for component in shape.push])
    friction = ufl.as_ufl(0.0) if patch.slip is None else ufl.dot(patch.slip.traction, back)
    return patch.surface.points.evaluator(
        {"pressure": ufl.dot(patch.thrust, back), "friction": friction, "height": ufl.dot(patch.place, back)}
    )
