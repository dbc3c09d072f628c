"""Slip at integration points: the memory of friction, its dissipation, stick and slip (docs/theory.md §3.3)."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import ufl

from cutsim.base.kinematics import Expr
from cutsim.base.parameters import with_constants
from cutsim.fields.points import FacetPoints, Values
from cutsim.fields.state import State
from cutsim.interface.friction import Coulomb, FrictionLaw

# advance relative to the slip below which a point sticks
_STICKS = 1e-9


def completed(law: FrictionLaw, stiffness: float) -> FrictionLaw:
    """The law with a tangential penalty: its own, or that of the normal contact."""
    return replace(law, stiffness=stiffness) if isinstance(law, Coulomb) and law.stiffness is None else law


class SlipHistory:
    """Friction at the points of a surface, whatever its kinematics.

    The slip is a vector s of components in a frame that turns with the surface.  The memory is the anchor a, the slip
    at which the traction would vanish; the trial traction is ε_T (s − a).  After a step a = s − t/ε_T.  Augmentation
    (Simo and Laursen 1992) moves the anchor within a step until facets that stick do so within a tolerance.

    Args:
        state: Displacement and time.
        points: Integration points.
        law: Friction law with a tangential penalty.
        slip: Slip s, a vector [length].
        pressure: Contact pressure [stress].
        share: Fraction of the area on which friction acts, in [0, 1].
        project: Projection of a slip to the tangential plane, if the frame is not tangential by itself.
        tolerance: Largest mean slip in a step of a facet that sticks [length]; None for no augmentation.
        temperature: Temperature of the hotter side, for laws that need it.

    Attributes:
        traction: Traction along the slip, on the whole area, in the frame of the slip [stress].
    """

    def __init__(
        self,
        state: State,
        points: FacetPoints,
        law: FrictionLaw,
        slip: Expr,
        pressure: Expr,
        *,
        share: Expr = 1.0,
        project: Callable[[Expr], Expr] = lambda slip: slip,
        tolerance: float | None = None,
        temperature: Expr | None = None,
    ) -> None:
        self.points, self._tolerance, self._compliance = points, tolerance, law.compliance
        symbolic: FrictionLaw = with_constants(state.mesh, law)
        self._anchor = points.function(len(slip))
        # a function with one component is a scalar
        anchor = ufl.as_vector([points.at(self._anchor)]) if len(slip) == 1 else points.at(self._anchor)
        since = project(slip - anchor)
        self.traction = symbolic.traction(since, pressure, state.dt, temperature)
        size, resistance = (ufl.sqrt(ufl.dot(w, w)) for w in (since, self.traction))
        self._evaluate = points.evaluator(
            {
                "slip": slip,
                "traction": self.traction,
                "advance": size - symbolic.compliance * resistance if law.compliance else size,
                "limit": symbolic.limit(pressure, temperature),
                "pressure": pressure,
                "share": ufl.as_ufl(share),
            }
        )
        start = self._evaluate()
        flat = dict.fromkeys(
            ("advance", "limit", "pressure", "level", "dissipated", "held"), np.zeros_like(points.weights)
        )
        self._trial = self._old = {**start, **flat, "traction": np.zeros_like(start["traction"])}
        self._set_anchor(self._old["traction"])

    def evaluate(self) -> None:
        """Slip, dissipation and stored energy of the trial step. Collective.

        A step that begins to slip on its way dissipates from there on: the limit at that place is interpolated.
        """
        new, old = self._evaluate(), self._old
        size = np.linalg.norm(new["traction"], axis=-1)
        moved = np.linalg.norm(new["slip"] - old["slip"], axis=-1)
        advance = new["advance"]
        advance[advance <= _STICKS * (advance + self._compliance * size)] = 0.0
        if self._tolerance is not None:
            advance = new["advance"] = np.where(advance > 0, moved, 0.0)
        slipping = advance > 0
        new["level"] = np.where(slipping, size, new["limit"])
        late = np.divide(advance, moved, out=np.zeros_like(moved), where=moved > 0).clip(max=1.0)
        level = new["level"] - 0.5 * late * (new["level"] - old["level"])
        mean = 0.5 * (new["share"] + old["share"])
        new["dissipated"] = old["dissipated"] + mean * level * advance
        before, now = (0.5 * self._compliance * np.sum(w["traction"] ** 2, axis=-1) for w in (old, new))
        # augmentation leaves no elastic slip to store energy in
        new["held"] = old["held"] + (mean * (now - before) if self._tolerance is None else 0.0)
        self._trial = new

    def augment(self) -> bool:
        """Move the anchor so that points that stick do so better; True if one was off by too much. Collective."""
        if self._tolerance is None:
            return False
        new = self._evaluate()
        size = np.linalg.norm(new["traction"], axis=-1)
        sticks = ((size < (1 - _STICKS) * new["limit"]) & (new["share"] > 0)).all(axis=1)
        # a mean over the facet: a facet has more points than its nodes could hold in place one by one
        moved = np.moveaxis(new["slip"] - self._old["slip"], -1, 0)
        mean = np.linalg.norm([self.points.facet_mean(component) for component in moved], axis=0)
        if self.points.maximum(np.where(sticks, mean, 0.0)) <= self._tolerance:
            return False
        self._set_anchor(new["traction"])
        return True

    def rollback(self) -> None:
        """Restore the committed anchor and point values."""
        self._trial = self._old
        self._set_anchor(self._old["traction"])

    def commit(self) -> None:
        """Adopt the trial step."""
        self._old = self._trial
        self._set_anchor(self._old["traction"])

    def _set_anchor(self, traction: Values) -> None:
        """Place the anchor where the slip of the last step would carry a traction."""
        self.points.set(self._anchor, self._old["slip"] - self._compliance * traction)

    def values(self, name: str) -> Values:
        """Trial point values: "traction", "slip" (vectors), "pressure", "advance" (slip of the step, not elastic)."""
        return self._trial[name]

    def dissipation(self) -> Values:
        """Friction dissipation of the trial step [energy per reference area]."""
        return self._trial["dissipated"] - self._old["dissipated"]

    def energies(self) -> dict[str, float]:
        """Energy dissipated so far, and stored in the tangential penalty. Collective."""
        return {
            "friction": self.points.integral(self._trial["dissipated"]),
            "contact": self.points.integral(self._trial["held"]),
        }

    def areas(self) -> tuple[float, float]:
        """Area that sticks and area that slips under pressure. Collective."""
        pressed = self._trial["share"] * (self._trial["limit"] > 0)
        slips = self._trial["advance"] > 0
        return self.points.integral(pressed * ~slips), self.points.integral(pressed * slips)
