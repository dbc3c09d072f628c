"""Interface law at points whose jump is not computed by a form (docs/theory.md §3, 3.5)."""

from dataclasses import dataclass

import numpy as np
import ufl

from cutsim.base.functions import larger
from cutsim.base.parameters import with_constants
from cutsim.fields.points import FacetPoints, Values
from cutsim.fields.state import State
from cutsim.interface.cohesive import CohesiveLaw
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.friction import FrictionLaw
from cutsim.interface.history import InterfaceHistory
from cutsim.interface.modified_contact import respond
from cutsim.interface.slip import Rubbing, SlipHistory
from cutsim.interface.viscous import ViscousBond, ViscousHistory
from cutsim.pairs.configuration import Pairs
from cutsim.pairs.pairing import Array


@dataclass(frozen=True)
class PairLaws:
    """Laws of a pair of surfaces; they are those of a crack.

    Args:
        cohesive: Cohesive law, None for a broken interface.
        contact: Contact law.
        friction: Friction law with a tangential penalty, None for none; it acts on the broken fraction.
        allowed_penetration: Largest mean penetration of a facet after augmentation [length]; None for no augmentation.
        allowed_slip: Largest mean slip in a step of a facet that sticks [length]; None for no augmentation.
    """

    cohesive: CohesiveLaw | None
    contact: PenaltyContact
    friction: FrictionLaw | None
    allowed_penetration: float | None
    allowed_slip: float | None


class PairLaw:
    """Tractions at the points and their derivatives by the jump. Every method is collective.

    Args:
        state: Displacement and time.
        name: Name of the surface.
        points: Integration points.
        laws: The laws.
        history: What the points remember of opening and damage.
        pairs: The points and their partners at the start.

    Attributes:
        slip: What the points remember of friction, or None.
        viscous: What they remember of the viscosity of the bond, or None.
    """

    def __init__(
        self, state: State, name: str, points: FacetPoints, laws: PairLaws, history: InterfaceHistory, pairs: Pairs
    ) -> None:
        self._points, self._laws, self._history = points, laws, history
        self._dim = state.mesh.geometry.dim
        self._jump, self._met = points.function(self._dim), points.function()
        self.set_pairs(pairs)
        jump = ufl.variable(points.at(self._jump))
        slide = ufl.as_vector([jump[i] for i in range(1, self._dim)])
        law = None if laws.cohesive is None else with_constants(state.mesh, laws.cohesive)
        contact = with_constants(state.mesh, laws.contact)
        r = respond(law, contact, jump[0], slide, points.at(history.secants), points.at(history.multiplier))
        shear = [r.shear[i] for i in range(self._dim - 1)]
        columns = {
            "secants": ufl.as_vector([*r.secants]),
            "jump": ufl.as_vector([jump[i] for i in range(self._dim)]),
            "stored": 0.5 * ufl.dot(ufl.as_vector([r.tension, *shear]), jump),
            "damage": larger(*r.damage),
            "sliding": r.sliding,
            "pressure": r.pressure,
            "held": contact.energy(-jump[0]),
        }
        self.slip: SlipHistory | None = None
        if laws.friction is not None:
            share = r.damage[1]
            # how a point without partner comes near is not known
            depth = points.at(self._met) * r.penetration
            rubbing = Rubbing(slide, r.pressure, depth, share=share)
            self.slip = SlipHistory(state, name, points, laws.friction, rubbing, tolerance=laws.allowed_slip)
            shear = [s + share * t for s, t in zip(shear, self.slip.traction, strict=True)]
        traction = ufl.as_vector([r.tension - r.pressure, *shear])
        self.viscous: ViscousHistory | None = None
        if isinstance(laws.cohesive, ViscousBond):
            self.viscous = ViscousHistory(state, name, points, laws.cohesive, [jump[0], *slide], r.damage)
            traction += self.viscous.traction
        stiffness = ufl.diff(traction, jump)
        flat = [stiffness[i, j] for i in range(self._dim) for j in range(self._dim)]
        self._values = points.evaluator(columns)
        self._traction = points.evaluator({"traction": traction})
        self._linear = points.evaluator({"traction": traction, "stiffness": ufl.as_vector(flat)})

    def set_pairs(self, pairs: Pairs) -> None:
        """Take opening and slide of all points, and which of them have a partner."""
        shape = self._points.weights.shape
        self._points.set(self._jump, pairs.jump.reshape(*shape, self._dim))
        met = np.zeros(len(pairs.jump))
        met[pairs.hits.points] = 1.0
        self._points.set(self._met, met.reshape(shape))

    def values(self) -> dict[str, Values]:
        """Values of the law for the present jump: what `InterfaceHistory` wants but the power, and "held"."""
        return self._values()

    def traction(self) -> Array:
        """Tractions on the slave in the components of the jump, shape (points, dimension) [stress]."""
        return self._traction()["traction"].reshape(-1, self._dim)

    def linear(self) -> tuple[Array, Array]:
        """Tractions, and their derivatives by the jump, shape (points, dimension, dimension) [stress/length]."""
        values = self._linear()
        return values["traction"].reshape(-1, self._dim), values["stiffness"].reshape(-1, self._dim, self._dim)

    def augment(self) -> bool:
        """Move multiplier and carried shear; True if one was off by more than is allowed.

        The multiplier is one value a facet: at every point it would hold a facet in more places than it has nodes.
        """
        pressed = False
        if self._laws.allowed_penetration is not None:
            pressure, met = self._values()["pressure"], self._points.get(self._met)
            # at an edge a facet is covered in part: points without partner are no part of the mean
            share = self._points.facet_mean(met)
            mean = np.divide(self._points.facet_mean(pressure), share, out=np.zeros_like(share), where=share > 0)
            mean = np.broadcast_to(mean[:, None], pressure.shape)
            pressed = self._history.augment(mean, self._laws.contact.stiffness * self._laws.allowed_penetration)
        return (self.slip is not None and self.slip.augment()) or pressed
