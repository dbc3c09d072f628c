"""Slip history at integration points: anchor, traction and dissipation of friction (docs/theory.md §3.3)."""

import numpy as np
import ufl
from ufl.algorithms.analysis import extract_constants

from cutsim.base.parameters import with_constants
from cutsim.fields.points import FacetPoints, Values
from cutsim.fields.state import State
from cutsim.interface.friction import FrictionLaw
from cutsim.interface.rubbing import Friction, Rubbing

# advance relative to the slip below which a point sticks
_STICKS = 1e-9


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
        friction: Friction, whose law has a tangential penalty.
        rubbing: Slip and pressure.

    Attributes:
        traction: Traction along the slip, on the whole area, in the frame of the slip [stress].
    """

    def __init__(self, state: State, name: str, points: FacetPoints, friction: Friction, rubbing: Rubbing) -> None:
        law = friction.law
        assert isinstance(law, FrictionLaw), "completed"
        self.points, self._tolerance, self._compliance = points, friction.allowed_slip, law.compliance
        self._dt = state.dt
        # augmentation leaves no elastic slip that energy is stored in
        self._elastic = law.compliance if self._tolerance is None else 0.0
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
