"""Interface law for closing and opening, for any kinematics (docs/theory.md §3; thesis 4.10, 4.41)."""

from dataclasses import dataclass

import ufl

from cutsim.base.functions import if_less
from cutsim.base.kinematics import Expr, safe_norm
from cutsim.interface.cohesive import CohesiveLaw
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.damage import damage

# relative distance above its memory at which a secant still counts as loading
_AT_HISTORY = 1e-9
# floor of the amount of sliding, relative to the characteristic opening of a law
_REST = 1e-12


@dataclass(frozen=True)
class InterfaceResponse:
    """Symbolic response of the law to an opening and a slide at an integration point.

    Attributes:
        sliding: Magnitude of the slide [length].
        secants: Smallest secant stiffnesses so far, in opening and sliding [stress/length]; 0 without a law.
        tension: Cohesive traction along the normal, positive where it pulls the faces together [stress].
        shear: Cohesive traction along the slide, in the components of the slide [stress].
        penetration: Penetration that the pressure belongs to, with the part λ_N/ε_N that a multiplier makes up for;
            negative while open [length].
        pressure: Contact pressure ≥ 0 [stress].
        damage: Damage in opening and sliding (4.26, 4.27) [–]; 1 without a law.
    """

    sliding: Expr
    secants: tuple[Expr, Expr]
    tension: Expr
    shear: Expr
    penetration: Expr
    pressure: Expr
    damage: tuple[Expr, Expr]


def respond(
    law: CohesiveLaw | None,
    contact: PenaltyContact | None,
    gap: Expr,
    slide: Expr,
    memory: Expr,
    multiplier: Expr = 0.0,
    fade: Expr = 1.0,
) -> InterfaceResponse:
    """Penalty contact where the gap is closed, a cohesive law with irreversible damage where it is open.

    Args:
        law: Cohesive law, None for a broken interface.
        contact: Contact law, None for faces that pass through each other.
        gap: Opening δ_n, negative for penetration [length].
        slide: Tangential part δ_t of the jump, a vector of any components [length].
        memory: Smallest secant stiffnesses before this step, a vector [stress/length].
        multiplier: Contact multiplier λ_N [stress].
        fade: Factor of the pressure in [0, 1].
    """
    opening = ufl.conditional(ufl.ge(gap, 0), gap, 0.0)
    depth = -gap if contact is None else multiplier / contact.stiffness - gap
    pressure = ufl.as_ufl(0.0) if contact is None else fade * contact.pressure(depth)
    if law is None:
        none, whole = ufl.as_ufl(0.0), ufl.as_ufl(1.0)
        return InterfaceResponse(
            safe_norm(slide, _REST), (none, none), none, 0 * slide, depth, pressure, (whole, whole)
        )
    sliding = safe_norm(slide, _REST * law.opening)
    envelope = law.secants(opening, sliding)
    k_n, k_t = (_smaller(k, memory[i]) for i, k in enumerate(envelope))
    return InterfaceResponse(sliding, (k_n, k_t), k_n * opening, k_t * slide, depth, pressure, damage(law, k_n, k_t))


def _smaller(secant: Expr, memory: Expr) -> Expr:
    """Smallest secant so far, the present one included.

    A step starts with every point exactly at its history.  There it counts as loading, so that Newton's first
    tangent is that of the growing crack, and not a mixture of loading and unloading points drawn by rounding.
    """
    return if_less(secant, (1 + _AT_HISTORY) * memory, secant, memory)
