"""Interface law at points whose jump is not computed by a form (docs/theory.md §3, 3.5)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import ufl

from cutsim.base.functions import larger
from cutsim.base.kinematics import Expr, safe_norm
from cutsim.base.parameters import with_constants
from cutsim.fields.points import FacetPoints, Values
from cutsim.fields.state import State
from cutsim.interface.cohesive import CohesiveLaw
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.history import InterfaceHistory
from cutsim.interface.modified_contact import InterfaceResponse, respond
from cutsim.interface.path_measure import step_loss
from cutsim.interface.rubbing import Friction, Rubbing
from cutsim.interface.slip import SlipHistory
from cutsim.interface.viscous import ViscousBond, ViscousHistory
from cutsim.pairs.configuration import Pairs
from cutsim.pairs.pairing import Array


@dataclass(frozen=True)
class PairLaws:
    """Laws of a pair of surfaces; they are those of a crack.

    Args:
        cohesive: Cohesive law, None for a broken interface.
        contact: Contact law.
        friction: Friction whose law has a tangential penalty, None for none.
        allowed_penetration: Largest mean penetration of a facet after augmentation [length]; None for no augmentation.
    """

    cohesive: CohesiveLaw | None
    contact: PenaltyContact
    friction: Friction | None
    allowed_penetration: float | None


class PairLaw:
    """Tractions at the points and their derivatives by the jumps. Every method is collective.

    Contact and friction follow from the jump to the first partner of a point, the bond from that to the last: on
    surfaces that slide far it stays with a material point, while contact passes on to the next one.

    Args:
        state: Displacement and time.
        name: Name of the surface.
        points: Integration points.
        laws: The laws.
        history: What the points remember of opening and damage.
        pairs: The points and their partners at the start, of one kind or two.
        temperature: Temperature of the hotter side, for friction that depends on it.

    Attributes:
        slip: What the points remember of friction, or None.
        viscous: What they remember of the viscosity of the bond, or None.
        bonded: 1 at the points with a partner of the bond, else 0.
    """

    def __init__(
        self,
        state: State,
        name: str,
        points: FacetPoints,
        laws: PairLaws,
        history: InterfaceHistory,
        pairs: Sequence[Pairs],
        temperature: Expr | None,
    ) -> None:
        self._points, self._laws, self._history = points, laws, history
        self._dim, self._kinds = state.mesh.geometry.dim, len(pairs)
        self._jumps = [points.function(self._dim) for _ in pairs]
        self._met, tied = points.function(), points.function()
        self.set_pairs(pairs)
        self.bonded = self._with_partner(pairs[-1])
        points.set(tied, self.bonded)
        jumps = [ufl.variable(points.at(jump)) for jump in self._jumps]
        law = None if laws.cohesive is None else with_constants(state.mesh, laws.cohesive)
        contact = with_constants(state.mesh, laws.contact)
        memory = points.at(history.secants), points.at(history.multiplier)
        slides = [ufl.as_vector([jump[i] for i in range(1, self._dim)]) for jump in jumps]
        bond = respond(law, contact if self._kinds == 1 else None, jumps[-1][0], slides[-1], *memory)
        touch = bond if self._kinds == 1 else respond(None, contact, jumps[0][0], slides[0], *memory)
        # where the bond has no partner there is none to be broken, and friction acts
        bonded = ufl.as_ufl(1.0) if law is None else points.at(tied)
        columns = {
            "secants": ufl.as_vector([*bond.secants]),
            "jump": ufl.as_vector([jumps[-1][i] for i in range(self._dim)]),
            "stored": 0.5 * ufl.dot(ufl.as_vector([bond.tension, *bond.shear]), jumps[-1]),
            "damage": bonded * larger(*bond.damage),
            "sliding": bond.sliding,
            "pressure": touch.pressure,
            "held": contact.energy(-jumps[0][0]),
        }
        self.slip: SlipHistory | None = None
        friction = 0 * slides[0]
        if laws.friction is not None:
            # how a point without partner comes near is not known
            near = replace(touch, penetration=points.at(self._met) * touch.penetration)
            rubbing = Rubbing.beside(laws.friction, slides[0], near, bond, bonded=bonded, temperature=temperature)
            self.slip = SlipHistory(state, name, points, laws.friction, rubbing)
            friction = rubbing.share * self.slip.traction
        tractions = [ufl.as_vector([-touch.pressure, *friction])]
        cohesive = ufl.as_vector([bond.tension, *bond.shear])
        self.viscous: ViscousHistory | None = None
        if isinstance(laws.cohesive, ViscousBond):
            opened = [jumps[-1][i] for i in range(self._dim)]
            self.viscous = ViscousHistory(state, name, points, laws.cohesive, opened, bond.damage)
            cohesive += self.viscous.traction
        tractions = [*tractions, cohesive] if self._kinds == 2 else [tractions[0] + cohesive]
        # the traction of a bond does not depend on other partners
        blocks = {(i, j): ufl.diff(tractions[i], jumps[j]) for i in range(self._kinds) for j in range(i, self._kinds)}
        traction = {str(i): t for i, t in enumerate(tractions)}
        self._before = points.function(self._dim)
        self._lost = self._step_loss(bond, jumps[-1])
        self._values = points.evaluator(columns)
        self._traction = points.evaluator(traction)
        self._linear = points.evaluator(traction | {f"{i}{j}": _flat(block) for (i, j), block in blocks.items()})

    def set_pairs(self, pairs: Sequence[Pairs]) -> None:
        """Take opening and slide of all points, and which of them have a partner to touch."""
        shape = self._points.weights.shape
        for jump, kind in zip(self._jumps, pairs, strict=True):
            self._points.set(jump, kind.jump.reshape(*shape, self._dim))
        self._points.set(self._met, self._with_partner(pairs[0]))

    def _with_partner(self, pairs: Pairs) -> Values:
        """1 at the points that have a partner, else 0."""
        found = np.zeros(len(pairs.jump))
        found[pairs.hits.points] = 1.0
        return found.reshape(self._points.weights.shape)

    def values(self) -> dict[str, Values]:
        """Values of the law for the present jump: what `InterfaceHistory` wants but the power, and "held"."""
        return self._values()

    def _step_loss(self, bond: InterfaceResponse, jump: Expr) -> dict[str, Expr]:
        """What the bond loses in the step, and the derivative by its jump."""
        before, memory = self._points.at(self._before), self._points.at(self._history.secants)
        slid = safe_norm(ufl.as_vector([before[i] for i in range(1, self._dim)]), 0.0)
        loss = step_loss(memory, bond.secants, (before[0], slid), (jump[0], bond.sliding))
        return {"loss": loss, "slope": ufl.diff(loss, jump)}

    @cached_property
    def _loss(self) -> Callable[[], dict[str, Values]]:
        return self._points.evaluator(self._lost)

    def loss(self) -> tuple[Values, Array]:
        """What the bond loses in the step, and the derivative by its jump, shape (points, dimension)."""
        start = self._history.jump
        self._points.set(self._before, np.zeros((*self._points.weights.shape, self._dim)) if start is None else start)
        values = self._loss()
        return values["loss"], values["slope"].reshape(-1, self._dim)

    def linear(self) -> tuple[list[Array], list[Array], Array | None]:
        """Tractions, their derivatives by the jump, and those of the contact by the jump of the bond.

        Returns:
            For each kind of partner the tractions on the slave in the components of its jump, shape (points,
            dimension) [stress], and their derivatives by its jump, shape (points, dimension, dimension)
            [stress/length]; the derivative of the first by the second jump, None for one kind.
        """
        values, square = self._linear(), (-1, self._dim, self._dim)
        own = [values[f"{i}{i}"].reshape(square) for i in range(self._kinds)]
        return self._tractions(values), own, values["01"].reshape(square) if self._kinds == 2 else None

    def constant(self) -> tuple[list[Array], list[Array], None]:
        """As `linear`, with zero for all derivatives."""
        tractions = self._tractions(self._traction())
        return tractions, [np.zeros((*t.shape, self._dim)) for t in tractions], None

    def _tractions(self, values: dict[str, Values]) -> list[Array]:
        return [values[str(i)].reshape(-1, self._dim) for i in range(self._kinds)]

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


def _flat(matrix: Expr) -> Expr:
    """Components of a matrix, row by row, as a vector."""
    return ufl.as_vector([matrix[i, j] for i in range(matrix.ufl_shape[0]) for j in range(matrix.ufl_shape[1])])
