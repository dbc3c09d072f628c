"""Slip history at integration points: anchor, traction and dissipation of friction (docs/theory.md §3.3)."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import ufl
from ufl.algorithms.analysis import extract_constants

from cutsim.base.checks import nonnegative, require_number
from cutsim.base.functions import positive_part
from cutsim.base.kinematics import Expr
from cutsim.base.parameters import with_constants
from cutsim.fields.points import FacetPoints, Values
from cutsim.fields.state import State
from cutsim.interface.friction import Coulomb, FrictionLaw

# advance relative to the slip below which a point sticks
_STICKS = 1e-9


def check_friction(name: str, friction: FrictionLaw | float | None) -> None:
    """Refuse what is neither a friction law nor the coefficient of Coulomb's, nor None.

    Raises:
        ValueError: It is something else, or a negative number.
    """
    if not isinstance(friction, FrictionLaw):
        require_number(name, friction, nonnegative.or_none)


def completed(friction: FrictionLaw | float, stiffness: float) -> FrictionLaw:
    """The law as it acts on a contact, with a tangential penalty where it needs one.

    Args:
        friction: A law, or the coefficient of Coulomb's.
        stiffness: Penalty of the normal contact [stress/length].
    """
    law = friction if isinstance(friction, FrictionLaw) else Coulomb(float(friction))
    return law.on_penalty(stiffness)


def _closed(before: Expr, now: Expr) -> Expr:
    """Fraction of a step after closure, from the penetration at both ends, if it changes evenly."""
    depth = positive_part(now)
    return ufl.conditional(ufl.lt(before, 0), depth / (depth - before), 1.0)


@dataclass(frozen=True)
class Rubbing:
    """Slip and pressure at the points of a surface, as expressions of the displacement.

    Attributes:
        slip: Slip s, a vector of components in a frame that turns with the surface [length].
        pressure: Contact pressure [stress].
        penetration: Penetration δ that goes with the pressure, negative while the point is open [length].
        share: Fraction of the area on which friction acts, in [0, 1].
        project: Projection of a slip to the tangential plane, if the frame is not tangential by itself.
        temperature: Temperature of the hotter side, for laws that need it.
    """

    slip: Expr
    pressure: Expr
    penetration: Expr
    share: Expr = 1.0
    project: Callable[[Expr], Expr] = lambda slip: slip
    temperature: Expr | None = None

    def slid(self, start: Expr, carried: Expr, before: Expr) -> tuple[Expr, Expr, Expr]:
        """Slide of the step, its fraction after closure, and the slip that the law resists.

        Args:
            start: Slip at the start of the step.
            carried: Elastic slip at that time.
            before: Penetration at that time.
        """
        closed = _closed(before, self.penetration)
        slid = self.project(self.slip - start)
        return slid, closed, closed * slid + self.project(carried)


class SlipHistory:
    """Friction state at the points of a surface, for any kinematics.

    The memory is the slip s₀ at the start of the step and the elastic slip e that carries a traction; the trial
    traction is ε_T (f (s − s₀) + e).  After a step e = t/ε_T.  Augmentation (Simo and Laursen 1992) raises e within a
    step until facets that stick do so within a tolerance.

    A point that closes within a step rubs from there on: with the penetration δ, negative while it is open,
    f = δ/(δ − δ₀) is the fraction of the step after closure on a straight path, and 1 if it was closed before.  So the
    traction of a point that comes down obliquely does not depend on the step.

    Args:
        state: Displacement and time.
        name: Name of the surface.
        points: Integration points.
        law: Friction law with a tangential penalty.
        rubbing: Slip and pressure.
        tolerance: Largest mean slip in a step of a facet that sticks [length]; None for no augmentation.

    Attributes:
        traction: Traction along the slip, on the whole area, in the frame of the slip [stress].
    """

    def __init__(
        self,
        state: State,
        name: str,
        points: FacetPoints,
        law: FrictionLaw,
        rubbing: Rubbing,
        *,
        tolerance: float | None = None,
    ) -> None:
        self.points, self._tolerance, self._compliance = points, tolerance, law.compliance
        self._dt = state.dt
        # augmentation leaves no elastic slip that energy is stored in
        self._elastic = law.compliance if tolerance is None else 0.0
        symbolic: FrictionLaw = with_constants(state.mesh, law)
        n = len(rubbing.slip)
        # one function for slip at the start of the step, elastic slip and penetration: each costs a form a coefficient
        self._memory = points.function(2 * n + 1)
        memory = [points.at(self._memory)[i] for i in range(2 * n + 1)]
        slid, closed, since = rubbing.slid(ufl.as_vector(memory[:n]), ufl.as_vector(memory[n:-1]), memory[-1])
        self.traction = symbolic.traction(since, rubbing.pressure, state.dt, rubbing.temperature)
        size, resistance = (ufl.sqrt(ufl.dot(w, w)) for w in (since, self.traction))
        self._evaluate = points.evaluator(
            {
                "slip": rubbing.slip,
                "slid": slid,
                "penetration": rubbing.penetration,
                "closed": closed,
                "traction": self.traction,
                "advance": size - symbolic.compliance * resistance if law.compliance else size,
                "limit": symbolic.limit(rubbing.pressure, rubbing.temperature),
                "pressure": rubbing.pressure,
                "share": ufl.as_ufl(rubbing.share),
            }
        )
        start = self._evaluate()
        none = np.zeros_like(points.weights)
        flat = dict.fromkeys(("advance", "limit", "pressure", "level", "dissipated", "held"), none)
        values = {**start, **flat, "traction": np.zeros_like(start["traction"])}
        self._known = state.memory.value(
            f"{name}: slip", values, lambda known: self._start_from(known["traction"]), places=points.places
        )
        self._start_from(values["traction"])

    @property
    def rate_dependent(self) -> bool:
        """Whether the traction depends on how long a step takes."""
        return any(constant is self._dt for t in self.traction for constant in extract_constants(t))

    def evaluate(self) -> None:
        """Slip, dissipation and stored energy of the trial step. Collective.

        A step that begins to slip on its way dissipates from there on: the limit at that place is interpolated.  Where
        a point closes, half of the limit dissipates over the whole way, as the mean force of the step does work.
        """
        new, old = self._evaluate(), self._known.committed
        size = np.linalg.norm(new["traction"], axis=-1)
        way = np.linalg.norm(new["slid"], axis=-1)
        # what the penalty does not hold has slipped; at the limit itself rounding leaves a trace of it
        advance = new["advance"]
        advance[advance <= _STICKS * (advance + self._compliance * size)] = 0.0
        if self._tolerance is not None:
            advance = new["advance"] = np.where(advance > 0, new["closed"] * way, 0.0)
        slipping = advance > 0
        new["level"] = np.where(slipping, size, new["limit"])
        growth = new["level"] - old["level"]
        # the fraction of the way on which it slips; what is held elastically grows with the limit meanwhile
        free = new["closed"] * way - self._elastic * growth
        late = np.divide(advance, free, out=slipping.astype(float), where=free > advance)
        # the audit takes the mean of the forces at both ends for the whole way, also where a point closes on it
        rubbed = np.where(slipping, advance + (1 - new["closed"]) * way, 0.0)
        mean = 0.5 * (new["share"] + old["share"])
        new["dissipated"] = old["dissipated"] + mean * (new["level"] - 0.5 * late * growth) * rubbed
        before, now = (0.5 * self._elastic * np.sum(w["traction"] ** 2, axis=-1) for w in (old, new))
        new["held"] = old["held"] + mean * (now - before)
        self._known.trial = new

    def augment(self) -> bool:
        """Raise what is carried so that points that stick do so better; True if one was off by too much. Collective."""
        if self._tolerance is None:
            return False
        new = self._evaluate()
        size = np.linalg.norm(new["traction"], axis=-1)
        # only facets that stick as a whole are held in place
        sticks = ((size < (1 - _STICKS) * new["limit"]) & (new["share"] > 0)).all(axis=1)
        # a mean over the facet: a facet has more points than its nodes could hold in place one by one
        moved = new["closed"] * np.moveaxis(new["slid"], -1, 0)
        mean = np.linalg.norm([self.points.facet_mean(component) for component in moved], axis=0)
        if self.points.maximum(np.where(sticks, mean, 0.0)) <= self._tolerance:
            return False
        self._start_from(new["traction"])
        return True

    def _start_from(self, traction: Values) -> None:
        """Start from the slip and the penetration of the last step, and carry a traction."""
        old, carried = self._known.committed, self._compliance * traction
        self.points.set(self._memory, np.concatenate([old["slip"], carried, old["penetration"][..., None]], axis=-1))

    def values(self, name: str) -> Values:
        """Trial point values: "traction", "slip" (vectors), "pressure", "advance" (slip of the step, not elastic)."""
        return self._known.trial[name]

    def dissipation(self) -> Values:
        """Friction dissipation of the trial step [energy per reference area]."""
        return self._known.trial["dissipated"] - self._known.committed["dissipated"]

    def energies(self) -> dict[str, float]:
        """Energy dissipated so far, and stored in the tangential penalty. Collective."""
        return {
            "friction": self.points.integral(self._known.trial["dissipated"]),
            "contact": self.points.integral(self._known.trial["held"]),
        }

    def areas(self) -> tuple[float, float]:
        """Area that sticks and area that slips under pressure. Collective."""
        pressed = self._known.trial["share"] * (self._known.trial["limit"] > 0)
        slips = self._known.trial["advance"] > 0
        return self.points.integral(pressed * ~slips), self.points.integral(pressed * slips)
