"""Books of a pointed tool by its parts, tip and shaft: force along it, friction work (docs/needle_insertion.md)."""

from collections.abc import Callable, Sequence

import ufl

from cutsim.base.kinematics import Expr
from cutsim.base.terms import Term
from cutsim.fields.points import Values
from cutsim.tools.pointed import Pointed
from cutsim.tools.tool_contact import Patch, ToolContact

#: Parts of a tool, from its foremost point upwards.
PARTS = ("tip", "shaft")

_Values = dict[str, float]


class ToolParts(Term):
    """What tip and shaft contribute to the force along a tool and to its friction work; adds nothing to the balance.

    A point of the body counts to the part beside which it is now; the shaft begins at `Pointed.shaft_height`.  The
    parts sum up to the tool's force and friction work, as they come from the same tractions at the same points.

    Args:
        tools: The tool, or its halves; they come before this term in the mechanics.
        shape: Shape of the whole tool.
        name: Name in messages.
    """

    def __init__(self, tools: Sequence[ToolContact], shape: Pointed, name: str = "tool_parts") -> None:
        self.name = name
        self._shaft = shape.shaft_height
        self._books = [(patch, _evaluator(patch, shape)) for tool in tools for patch in tool.patches]
        self._forces: dict[str, _Values] = {kind: dict.fromkeys(PARTS, 0.0) for kind in ("force", "friction")}
        self._work = self._work_old = dict.fromkeys(PARTS, 0.0)

    def residual(self, v: Expr) -> ufl.Form:
        """Nothing."""
        return ufl.Form([])

    def evaluate(self) -> None:
        """Forces of the trial state and work up to it. Collective."""
        self._forces = {kind: dict.fromkeys(PARTS, 0.0) for kind in ("force", "friction")}
        self._work = dict(self._work_old)
        for patch, evaluate in self._books:
            now, points = evaluate(), patch.surface.points
            beside = {"tip": now["height"] < self._shaft, "shaft": now["height"] >= self._shaft}
            for part, here in beside.items():
                self._forces["force"][part] += points.integral(here * (now["pressure"] + now["friction"]))
                self._forces["friction"][part] += points.integral(here * now["friction"])
                self._work[part] += points.integral(here * patch.dissipation())

    def force(self, part: str) -> float:
        """Force on a part against the direction of push, pressure and friction, in the trial state [force]."""
        return self._forces["force"][part]

    def friction(self, part: str) -> float:
        """What friction has in it [force]."""
        return self._forces["friction"][part]

    def friction_work(self, part: str) -> float:
        """Friction work on a part up to the trial state [energy]."""
        return self._work[part]

    def rollback(self) -> None:
        """Forget the work of the trial step."""
        self._work = self._work_old

    def commit(self) -> None:
        """Adopt the work of the step."""
        self._work_old = self._work


def _evaluator(patch: Patch, shape: Pointed) -> Callable[[], dict[str, Values]]:
    """Force densities against the push, and height above the foremost point."""
    back = ufl.as_vector([-component for component in shape.push])
    friction = ufl.as_ufl(0.0) if patch.slip is None else ufl.dot(patch.slip.traction, back)
    return patch.surface.points.evaluator(
        {"pressure": ufl.dot(patch.thrust, back), "friction": friction, "height": ufl.dot(patch.place, back)}
    )
