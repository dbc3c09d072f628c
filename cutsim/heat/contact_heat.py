"""Laws of heat exchange between two surfaces in contact (docs/theory.md §3.4; thesis 4.58–4.67)."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import ufl
from numpy.typing import NDArray

from cutsim.base.checks import between, nonnegative, positive, require_number
from cutsim.base.kinematics import Expr
from cutsim.base.signatures import checked
from cutsim.base.units import Conductance, ConductancePerPressure, HeatCapacityPerArea
from cutsim.fields.points import Values


class HeatLaw(Protocol):
    """Protocol of a law of heat exchange."""

    @property
    def capacity(self) -> float:
        """Heat capacity of the interface per area [energy/(area·temperature)]."""

    @property
    def adiabatic(self) -> bool:
        """Whether no heat passes between the surfaces, so that the temperature of the other one does not matter."""

    def exchange(
        self, pressure: Expr, plus: Expr, minus: Expr, source: Expr, contact: Expr, dt: Expr
    ) -> tuple[Expr, Expr, Expr]:
        """Fluxes out of both surfaces and interface temperature; arguments as `ContactHeat.exchange`."""

    def conducts(self, pressure: Values) -> NDArray[np.bool_]:
        """Where there is a way for heat between surface and interface, at a pressure."""


@checked
@dataclass(frozen=True)
class ContactHeat:
    """Heat exchange of two faces with the interface between them (thesis 4.58–4.67).

    The flux out of a face is q± = γ± p (T± − T_c); the interface stores C_c dT_c/dt = q⁺ + q⁻ + D.

    Args:
        gamma_plus: Conductance γ⁺ > 0 per pressure of the '+' face [power/(force·temperature)].
        gamma_minus: Conductance γ⁻ > 0 per pressure of the '−' face [power/(force·temperature)].
        capacity: Heat capacity C_c ≥ 0 of the interface per area [energy/(area·temperature)].
        gap_conductance: Conductance ≥ 0 between the faces where they do not touch, half of its resistance on either
            side of the interface [power/(area·temperature)]; 0 insulates an open gap.
        fracture_fraction: Fraction of the fracture dissipation that becomes heat, in [0, 1] [–].

    Raises:
        ValueError: A value is outside its range.
    """

    gamma_plus: ConductancePerPressure
    gamma_minus: ConductancePerPressure
    capacity: HeatCapacityPerArea = 0.0
    gap_conductance: Conductance = 0.0
    fracture_fraction: float = 1.0

    def __post_init__(self) -> None:
        for name in ("gamma_plus", "gamma_minus"):
            require_number(name, getattr(self, name), positive)
        for name in ("capacity", "gap_conductance"):
            require_number(name, getattr(self, name), nonnegative)
        require_number("fracture_fraction", self.fracture_fraction, between(0, 1, "[]"))

    def exchange(
        self, pressure: Expr, plus: Expr, minus: Expr, source: Expr, contact: Expr, dt: Expr
    ) -> tuple[Expr, Expr, Expr]:
        """Fluxes and interface temperature after a step of backward Euler, T_c eliminated (4.65, 4.66).

        Without pressure, gap conductance and capacity there is no path for the source; it is then shared as γ⁺ : γ⁻,
        the limit of a vanishing pressure, so that no heat is lost.

        Args:
            pressure: Contact pressure p ≥ 0 [stress].
            plus: Temperature of the '+' face.
            minus: Temperature of the '−' face.
            source: Heat generated [power/area].
            contact: Interface temperature at the start of the step.
            dt: Step size.

        Returns:
            q⁺ and q⁻, the fluxes that leave the bodies [power/area], and T_c.
        """
        gap = ufl.conditional(ufl.gt(pressure, 0), 0.0, 2 * self.gap_conductance)
        g_plus, g_minus = self.gamma_plus * pressure + gap, self.gamma_minus * pressure + gap
        stored = self.capacity / dt
        total = g_plus + g_minus + stored
        path = ufl.gt(total, 0)
        divisor = ufl.conditional(path, total, 1.0)
        gammas = self.gamma_plus + self.gamma_minus
        r_plus = ufl.conditional(path, g_plus / divisor, self.gamma_plus / gammas)
        r_minus = ufl.conditional(path, g_minus / divisor, self.gamma_minus / gammas)
        q_plus = r_plus * (g_minus * (plus - minus) + stored * (plus - contact) - source)
        q_minus = r_minus * (g_plus * (minus - plus) + stored * (minus - contact) - source)
        mixed = (g_plus * plus + g_minus * minus + stored * contact + source) / divisor
        return q_plus, q_minus, ufl.conditional(path, mixed, r_plus * plus + r_minus * minus)

    @property
    def adiabatic(self) -> bool:
        """False."""
        return False

    def conducts(self, pressure: Values) -> NDArray[np.bool_]:
        """Where there is a way for heat between surface and interface, at a pressure."""
        return (pressure > 0) | (self.gap_conductance > 0)


@checked
@dataclass(frozen=True)
class AdiabaticTool:
    """Tool that exchanges no heat with the body but takes its share of the friction heat.

    Args:
        share: Fraction of the friction dissipation that flows into the body, in [0, 1] [–].

    Raises:
        ValueError: The fraction is outside its range.
    """

    share: float = 1.0

    def __post_init__(self) -> None:
        require_number("share", self.share, between(0, 1, "[]"))

    @property
    def capacity(self) -> float:
        """Zero [energy/(area·temperature)]."""
        return 0.0

    @property
    def adiabatic(self) -> bool:
        """True."""
        return True

    def exchange(
        self, pressure: Expr, plus: Expr, minus: Expr, source: Expr, contact: Expr, dt: Expr
    ) -> tuple[Expr, Expr, Expr]:
        """Fluxes out of body ('+') and tool ('−'), and the temperature of the body's surface."""
        return -self.share * source, -(1 - self.share) * source, plus

    def conducts(self, pressure: Values) -> NDArray[np.bool_]:
        """Nowhere."""
        return np.zeros(pressure.shape, dtype=bool)
