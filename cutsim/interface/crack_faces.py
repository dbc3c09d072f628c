"""Kinematics and tractions of the two faces of a crack, as expressions of the displacement (docs/theory.md §1, 3)."""

from dataclasses import dataclass

import ufl
from dolfinx import default_scalar_type, fem

from cutsim.base.functions import larger
from cutsim.base.kinematics import Expr
from cutsim.base.parameters import with_constants
from cutsim.fields.points import Values
from cutsim.fields.state import State
from cutsim.interface.cohesive import CohesiveLaw
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.history import InterfaceHistory
from cutsim.interface.modified_contact import InterfaceResponse, respond
from cutsim.interface.sides import Sides


@dataclass(frozen=True)
class CrackResponse(InterfaceResponse):
    """Response of a crack at a displacement: kinematics and tractions.

    Attributes:
        jump: Displacement jump δ = u⁻ − u⁺ [length].
        opening: δ·n [length].
        slide: Tangential part of the jump, a vector [length].
        cohesive: Cohesive traction on the '+' face, a vector [stress].
        normal: Unit normal of the mid-surface, from '+' to '−'.
    """

    jump: Expr
    opening: Expr
    slide: Expr
    cohesive: Expr
    normal: Expr


class CrackFaces:
    """Interface law between the faces of a crack, at any displacement.

    Args:
        state: Displacement and time.
        sides: Sides of the crack.
        history: What its points remember.
        law: Cohesive law, None for a crack that is already broken.
        contact: Contact law of the closed crack, None if its faces do not press on each other.
        augmented: Whether a multiplier makes up for penetration.

    Attributes:
        sides: The sides.
    """

    def __init__(
        self,
        state: State,
        sides: Sides,
        history: InterfaceHistory,
        law: CohesiveLaw | None,
        contact: PenaltyContact | None,
        *,
        augmented: bool,
    ) -> None:
        self.sides, self._state, self._history, self._augmented = sides, state, history, augmented
        self._points = points = sides.points
        self._law = None if law is None else with_constants(state.mesh, law)
        self._contact = None if contact is None else with_constants(state.mesh, contact)
        self._s = fem.Constant(state.mesh, default_scalar_type(1.0))
        self._values = points.evaluator(self._columns())

    def response(self, u: Expr) -> CrackResponse:
        """The law at a displacement, restricted to the crack."""
        n, jump = self.sides.normal(u), self.sides.jump(u)
        gap = ufl.dot(jump, n)
        slide = jump - gap * n
        multiplier = self._points.at(self._history.multiplier) if self._augmented else 0.0
        memory = self._points.at(self._history.secants)
        r = respond(self._law, self._contact, gap, slide, memory, multiplier, self.sides.facing(u))
        return CrackResponse(**vars(r), jump=jump, opening=gap, slide=slide, cohesive=r.tension * n + r.shear, normal=n)

    def frame(self, u: Expr) -> tuple[Expr, ...]:
        """Unit tangents of the mid-surface that turn with it: one in 2-D, two in 3-D."""
        return self.sides.frame(u)

    def virtual_work(self, traction: Expr, v: Expr) -> ufl.Form:
        """Virtual work ∫ t·(v⁻ − v⁺) dΓ₀ of a traction that acts as t on the '+' face, as far as that is meshed."""
        return self.sides.share * ufl.dot(traction, self.sides.jump(v)) * self._points.measure

    def values(self, s: float) -> dict[str, Values]:
        """Values at the points for the fraction s of the step's displacement increment."""
        self._s.value = s
        return self._values()

    def _columns(self) -> dict[str, Expr]:
        """What is known at each point, at the fraction s of the step's displacement increment."""
        u_s = self._state.u_old + self._s * (self._state.u - self._state.u_old)
        r = self.response(u_s)
        increment = self.sides.jump(self._state.u) - self.sides.jump(self._state.u_old)
        return {
            "secants": ufl.as_vector([*r.secants]),
            "jump": ufl.as_vector([r.opening, *(ufl.dot(r.jump, a) for a in self.frame(u_s))]),
            "contact_power": -r.pressure * ufl.dot(r.normal, increment),
            "stored": 0.5 * ufl.dot(r.cohesive, r.jump),
            "damage": larger(*r.damage),
            "opening": r.opening,
            "sliding": r.sliding,
            "pressure": r.pressure,
        }
