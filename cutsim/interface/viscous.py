"""Viscous regularisation of a bond: a traction that resists the rate of the jump (docs/theory.md §3.2)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import ufl

from cutsim.base.checks import positive, require, require_number
from cutsim.base.functions import positive_part
from cutsim.base.kinematics import Expr
from cutsim.base.parameters import with_constants
from cutsim.base.signatures import checked
from cutsim.base.units import InterfaceViscosity
from cutsim.fields.points import FacetPoints, Values
from cutsim.fields.state import State
from cutsim.interface.cohesive import CohesiveLaw


@checked
@dataclass(frozen=True)
class ViscousBond:
    """Cohesive law with a viscosity, T = T_law + η ((1 − D_n) d⟨δ_n⟩/dt n + (1 − D_t) dδ_t/dt).

    It carries a run over an instability, where a bond breaks faster than the body unloads (Gao and Bower, Modelling
    Simul. Mater. Sci. Eng. 12, 453–463, 2004); the factors let the viscosity break with the bond.  Its work has an
    entry of its own in the energy audit, `cohesive_viscous`; more than 1 % of what is lost makes a run questionable.

    Args:
        law: The law of slow opening.
        viscosity: η > 0 [stress·time/length].

    Raises:
        ValueError: The viscosity is not positive, or the law has one already.
    """

    law: CohesiveLaw
    viscosity: InterfaceViscosity

    def __post_init__(self) -> None:
        require_number("viscosity", self.viscosity, positive)
        require("law", self.law, not isinstance(self.law, ViscousBond), "a law without a viscosity of its own")

    @property
    def strength(self) -> float:
        """Strength of the law [stress]."""
        return self.law.strength

    @property
    def opening(self) -> float:
        """Characteristic opening of the law [length]."""
        return self.law.opening

    @property
    def toughness(self) -> float:
        """Work of separation in slow opening [force/length]."""
        return self.law.toughness

    @property
    def shear_toughness(self) -> float:
        """Work of separation in slow sliding [force/length]."""
        return self.law.shear_toughness

    def secants(self, opening: Expr, sliding: Expr) -> tuple[Expr, Expr]:
        """Secant stiffnesses of the law."""
        return self.law.secants(opening, sliding)

    @property
    def characteristic_secants(self) -> tuple[float, float]:
        """Secants of the law from which damage counts."""
        return self.law.characteristic_secants


class ViscousHistory:
    """Viscous traction of a bond at the points of an interface, for any kinematics.

    Args:
        state: Displacement and time.
        name: Name of the interface.
        points: Integration points.
        law: Law with a viscosity.
        jump: Opening, and slide in components that turn with the interface [length].
        damage: Damage in opening and sliding.

    Attributes:
        traction: Traction in the components of the jump [stress].
    """

    def __init__(
        self,
        state: State,
        name: str,
        points: FacetPoints,
        law: ViscousBond,
        jump: Sequence[Expr],
        damage: tuple[Expr, Expr],
    ) -> None:
        self._state, self._points = state, points
        self._before = points.function(len(jump))
        viscosity = with_constants(state.mesh, law).viscosity
        before = [points.at(self._before)[i] for i in range(len(jump))]
        now = [positive_part(jump[0]), *jump[1:]]
        change = ufl.as_vector([a - b for a, b in zip(now, before, strict=True)])
        left = [1 - damage[min(i, 1)] for i in range(len(jump))]
        self.traction = ufl.as_vector([viscosity / state.dt * f * c for f, c in zip(left, change, strict=True)])
        self._evaluate = points.evaluator({"jump": ufl.as_vector(now), "traction": self.traction})
        start = {**self._evaluate(), "lost": np.zeros_like(points.weights)}
        self._known = state.memory.value(f"{name}: viscous bond", start, self._show, places=points.places)
        self._show(start)

    def _show(self, known: dict[str, Values]) -> None:
        self._points.set(self._before, known["jump"])

    def evaluate(self) -> None:
        """Dissipation of the trial step: by the mean of the tractions at its ends if it goes on, ≥ 0. Collective.

        Where the jump begins to move or turns back, its rate, and so the traction, is that of the end of the step.
        """
        new, old = self._evaluate(), self._known.committed
        change = new["jump"] - old["jump"]
        before, now = ((w["traction"] * change).sum(axis=-1) for w in (old, new))
        goes_on = (before > 0) & (not self._state.jerks)
        work = np.where(goes_on, 0.5 * (before + now), now)
        self._known.trial = {**new, "lost": old["lost"] + work}

    def values(self) -> Values:
        """Present traction at the points, in the components of the jump [stress]. Collective."""
        return self._evaluate()["traction"]

    def dissipated(self) -> float:
        """Energy dissipated so far, in the trial state. Collective."""
        return self._points.integral(self._known.trial["lost"])
