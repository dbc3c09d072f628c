"""Time integration schemes, given by four numbers that weight accelerations and forces over a step (docs/dynamics.md).

With u, v, a at the start (0) and the end (1) of a step of size Δt, the mass M and the static forces R, internal minus
external:

    u₁ = u₀ + Δt v₀ + Δt² ((½ − β) a₀ + β a₁),    v₁ = v₀ + Δt ((1 − γ) a₀ + γ a₁),
    M ((1 − α_m) a₁ + α_m a₀) + (1 − α_f) R₁ + α_f R₀ = 0.
"""

from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

from cutsim.base.checks import at_least, between, positive, require_number
from cutsim.base.signatures import checked


@runtime_checkable
class Scheme(Protocol):
    """Protocol of a scheme: the numbers of the equations above, all dimensionless."""

    @property
    def alpha_m(self) -> float:
        """Weight of the old acceleration in the balance."""

    @property
    def alpha_f(self) -> float:
        """Weight of the old static forces in the balance, < 1."""

    @property
    def beta(self) -> float:
        """Weight of the new acceleration in the displacement, > 0."""

    @property
    def gamma(self) -> float:
        """Weight of the new acceleration in the velocity."""


@checked
@dataclass(frozen=True)
class Newmark:
    """Newmark's scheme; by default the trapezoidal rule, which keeps the energy of a linear system.

    Newmark, A method of computation for structural dynamics, J. Eng. Mech. Div. ASCE 85 (1959) 67–94.

    Args:
        beta: β > 0; unconditionally stable for β ≥ γ/2.
        gamma: γ ≥ ½; of second order for ½, dissipative beyond.

    Raises:
        ValueError: A number is outside its range.
    """

    beta: float = 0.25
    gamma: float = 0.5

    def __post_init__(self) -> None:
        require_number("beta", self.beta, positive)
        require_number("gamma", self.gamma, replace(at_least(0.5), words=">= 0.5: below, steps feed energy in"))

    @property
    def alpha_m(self) -> float:
        """Balance at the end of the step: 0."""
        return 0.0

    @property
    def alpha_f(self) -> float:
        """Balance at the end of the step: 0."""
        return 0.0


#: The default scheme: second order, unconditionally stable, no dissipation.
TRAPEZOIDAL = Newmark()


@checked
@dataclass(frozen=True)
class GeneralisedAlpha:
    """Generalised-α scheme: of second order, with damping of the modes that the steps do not resolve.

    Chung, Hulbert, A time integration algorithm for structural dynamics with improved numerical dissipation: the
    generalized-α method, J. Appl. Mech. 60 (1993) 371–375, equations 17 and 25.

    Args:
        rho_inf: Factor in [0, 1] by which a step scales the amplitude of a mode much faster than it; 1 dissipates
            nothing, 0 annihilates such modes in one step.

    Raises:
        ValueError: `rho_inf` is outside its range.
    """

    rho_inf: float

    def __post_init__(self) -> None:
        require_number("rho_inf", self.rho_inf, between(0, 1, "[]"))

    @property
    def alpha_m(self) -> float:
        """Weight of the old acceleration (2 ρ∞ − 1)/(ρ∞ + 1)."""
        return (2 * self.rho_inf - 1) / (self.rho_inf + 1)

    @property
    def alpha_f(self) -> float:
        """Weight of the old forces ρ∞/(ρ∞ + 1)."""
        return self.rho_inf / (self.rho_inf + 1)

    @property
    def beta(self) -> float:
        """β = ¼ (1 − α_m + α_f)²."""
        return 0.25 * (1 - self.alpha_m + self.alpha_f) ** 2

    @property
    def gamma(self) -> float:
        """γ = ½ − α_m + α_f."""
        return 0.5 - self.alpha_m + self.alpha_f
