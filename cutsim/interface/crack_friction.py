"""Friction between the faces of a crack (docs/theory.md §3.3; thesis 4.50–4.55)."""

from typing import Protocol

import ufl

from cutsim.base.checks import require
from cutsim.base.compat import EntityMaps
from cutsim.base.kinematics import Expr
from cutsim.base.signatures import checked
from cutsim.base.terms import Term
from cutsim.fields.points import FacetPoints, Values
from cutsim.fields.state import State
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.crack_faces import CrackFaces
from cutsim.interface.friction import FrictionLaw
from cutsim.interface.rubbing import Friction, Rubbing, check_friction, completed, hotter
from cutsim.interface.slip import SlipHistory


class Faced(Protocol):
    """What friction needs of a crack."""

    name: str
    state: State
    points: FacetPoints
    contact: PenaltyContact
    faces: CrackFaces
    closing: bool


class CrackFriction(Term):
    """Friction that resists the sliding of closed crack faces.

    A crack that is given `friction=` makes this term by itself.

    The traction is kept in components along tangents that turn with the crack, so that it is objective.  Its limit
    comes from the contact pressure; by default it acts on the broken fraction of the bond, its damage D_t, beside the
    cohesive traction of the rest (Alfano and Sacco 2006).

    Args:
        crack: The crack.
        friction: Friction, a law, or the coefficient of Coulomb's.

    Raises:
        ValueError: The friction is none.
    """

    symmetric = False

    @checked
    def __init__(self, crack: Faced, friction: Friction | FrictionLaw | float) -> None:
        check_friction("friction", friction)
        require("crack", crack.name, crack.closing, "one with closing=True: a pair of its faces rubs itself")
        whole = completed(friction, crack.contact.stiffness)
        require("friction", friction, whole is not None, "not zero")
        assert whole is not None
        if whole.acts_on == "tension":
            words = f"{crack.name}: open faces rub (friction on 'tension'); use it for comparison only"
            crack.state.verdict.doubt(f"{crack.name}: friction", words)
        self.crack, self.name = crack, f"{crack.name}_friction"
        u, T = crack.state.u, whole.temperature
        response, self._frame = crack.faces.response(u), crack.faces.frame(u)
        slip = ufl.as_vector([ufl.dot(response.jump, a) for a in self._frame])
        warm = None if T is None else hotter(T.value("+"), T.value("-"))
        rubbing = Rubbing.beside(whole, slip, response, response, temperature=warm)
        self._share = rubbing.share
        self.slip = SlipHistory(crack.state, self.name, crack.points, whole, rubbing)

    @property
    def entity_maps(self) -> EntityMaps:
        """Map from facets of the mesh to cells of the crack's submesh."""
        return self.crack.points.entity_maps

    def residual(self, v: Expr) -> ufl.Form:
        """Virtual work ∫ t·(v⁻ − v⁺) dΓ₀; the traction acts as t on the '+' face."""
        traction = sum(self.slip.traction[i] * a for i, a in enumerate(self._frame))
        return self.crack.faces.virtual_work(self._share * traction, v)

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
