"""Friction between the faces of a crack (docs/theory.md §3.3; thesis 4.50–4.55)."""

from typing import Literal, Protocol

import ufl

from cutsim.base.checks import positive, require, require_number
from cutsim.base.compat import EntityMaps
from cutsim.base.kinematics import Expr, displacement_jump
from cutsim.base.signatures import checked
from cutsim.base.terms import Term
from cutsim.fields.points import FacetPoints, Surface, Values
from cutsim.fields.state import State
from cutsim.fields.temperature import Temperature
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.crack_faces import CrackFaces
from cutsim.interface.friction import FrictionLaw
from cutsim.interface.slip import Rubbing, SlipHistory, check_friction, completed


class Faced(Protocol):
    """What friction needs of a crack."""

    name: str
    state: State
    points: FacetPoints
    contact: PenaltyContact
    faces: CrackFaces
    closing: bool

    def surface(self, side: Literal["+", "-"]) -> Surface:
        """One face of it."""


class CrackFriction(Term):
    """Friction that resists the sliding of closed crack faces.

    A crack that is given `friction=` makes this term by itself; it is written out for the options that only it has.

    The traction is kept in components along tangents that turn with the crack, so that it is objective.  Its limit
    comes from the contact pressure; by default it acts on the broken fraction D_t of the bond, beside the cohesive
    traction of the rest (Alfano and Sacco 2006).

    Args:
        crack: The crack.
        law: Friction law, or the coefficient of Coulomb's; without a tangential penalty of its own it takes that of the
            normal contact.
        acts_on: "broken": on the broken fraction.  "contact": wherever the faces are pressed together, broken or not.
            "tension": as "contact", and the tension of the bond counts as pressure, as in (4.52) of the thesis; then
            an open gap rubs, which is physically wrong, so that a warning is given.
        allowed_slip: If given, augmentation until no sticking facet slides more than this in a step, in the mean
            [length].
        temperature: Temperature, cracked like the displacement, for laws that depend on it; the hotter side counts.

    Raises:
        ValueError: A parameter is outside its range.
    """

    symmetric = False

    @checked
    def __init__(
        self,
        crack: Faced,
        law: FrictionLaw | float,
        *,
        acts_on: Literal["broken", "contact", "tension"] = "broken",
        allowed_slip: float | None = None,
        temperature: Temperature | None = None,
    ) -> None:
        require("law", law, law is not None, "a friction law or a coefficient")
        check_friction("law", law)
        require("crack", crack.name, crack.closing, "one with closing=True: a pair of its faces rubs itself")
        require_number("allowed_slip", allowed_slip, positive.or_none)
        if acts_on == "tension":
            words = f"{crack.name}: open faces rub (friction on 'tension'); use it for comparison only"
            crack.state.verdict.doubt(f"{crack.name}: friction", words)
        self.crack, self.name = crack, f"{crack.name}_friction"
        u = crack.state.u
        response, self._frame = crack.faces.response(u), crack.faces.frame(u)
        tension = ufl.dot(response.cohesive, response.normal) if acts_on == "tension" else 0.0
        hotter = None if temperature is None else ufl.max_value(temperature.value("+"), temperature.value("-"))
        self._share = response.damage[1] if acts_on == "broken" else ufl.as_ufl(1.0)
        rubbing = Rubbing(
            ufl.as_vector([ufl.dot(response.jump, a) for a in self._frame]),
            response.pressure + tension,
            ufl.as_ufl(0.0) if acts_on == "tension" else response.penetration,
            share=self._share,
            temperature=hotter,
        )
        friction = completed(law, crack.contact.stiffness)
        self.slip = SlipHistory(crack.state, self.name, crack.points, friction, rubbing, tolerance=allowed_slip)

    @property
    def entity_maps(self) -> EntityMaps:
        """Map from facets of the mesh to cells of the crack's submesh."""
        return self.crack.points.entity_maps

    def residual(self, v: Expr) -> ufl.Form:
        """Virtual work ∫ t·(v⁻ − v⁺) dΓ₀; the traction acts as t on the '+' face."""
        traction = sum(self.slip.traction[i] * a for i, a in enumerate(self._frame))
        return self._share * ufl.dot(traction, displacement_jump(v)) * self.crack.points.measure

    def augment(self) -> bool:
        """Uzawa step if a facet that sticks slides by more than is allowed. Collective."""
        return self.slip.augment()

    def evaluate(self) -> None:
        """Slip and dissipation of the trial step. Collective."""
        self.slip.evaluate()

    def energies(self) -> dict[str, float]:
        """Energy dissipated so far, and stored in the tangential penalty. Collective."""
        return self.slip.energies()

    def dissipation(self) -> Values:
        """Friction dissipation of the trial step at the points of the crack [energy per reference area]."""
        return self.slip.dissipation()

    def record(self) -> dict[str, tuple[float, str]]:
        """Areas that stick and slip under pressure. Collective."""
        sticks, slips = self.slip.areas()
        kind = self.crack.state.facet_measure
        return {f"{self.crack.name}_sticking": (sticks, kind), f"{self.crack.name}_slipping": (slips, kind)}
