"""One interface law for closing and opening, whatever finds the opening (docs/theory.md §3; thesis 4.10, 4.41)."""

from dataclasses import dataclass

import ufl

from cutsim.base.kinematics import Expr, safe_norm
from cutsim.interface.cohesive import CohesiveLaw
from cutsim.interface.contact import PenaltyContact

# relative distance below its history at which a point still counts as loading
_AT_HISTORY = 1e-9
# floor of the amount of sliding, relative to the characteristic opening of a law
_REST = 1e-12


@dataclass(frozen=True)
class Response:
    """The law at an opening and a slide: symbolic, at an integration point.

    Attributes:
        sliding: Magnitude of the slide [length].
        demand: Loading measure of the cohesive law [its own unit].
        tension: Cohesive traction along the normal, positive where it pulls the faces together [stress].
        shear: Cohesive traction along the slide, in the components of the slide [stress].
        penetration: Penetration that the pressure belongs to, with the part λ_N/ε_N that a multiplier makes up for;
            negative while open [length].
        pressure: Contact pressure ≥ 0 [stress].
        damage: Damage in opening and sliding [–]; 1 without a law.
    """

    sliding: Expr
    demand: Expr
    tension: Expr
    shear: Expr
    penetration: Expr
    pressure: Expr
    damage: tuple[Expr, Expr]


def respond(
    law: CohesiveLaw | None,
    contact: PenaltyContact,
    gap: Expr,
    slide: Expr,
    kappa: Expr,
    multiplier: Expr = 0.0,
    fade: Expr = 1.0,
) -> Response:
    """Penalty contact where the gap is closed, a cohesive law with irreversible damage where it is open.

    Args:
        law: Cohesive law, None for a broken interface.
        contact: Contact law.
        gap: Opening δ_n, negative for penetration [length].
        slide: Tangential part δ_t of the jump, a vector of any components [length].
        kappa: Largest demand before this step.
        multiplier: Contact multiplier λ_N [stress].
        fade: Factor of the pressure in [0, 1].
    """
    opening = ufl.conditional(ufl.ge(gap, 0), gap, 0.0)
    depth = multiplier / contact.stiffness - gap
    pressure = fade * contact.pressure(depth)
    if law is None:
        none, whole = ufl.as_ufl(0.0), ufl.as_ufl(1.0)
        return Response(safe_norm(slide, _REST), none, none, 0 * slide, depth, pressure, (whole, whole))
    sliding = safe_norm(slide, _REST * law.opening)
    demand = law.demand(opening, sliding)
    largest = _largest(demand, kappa)
    k_n, k_t = law.stiffness(opening, sliding, largest)
    return Response(sliding, demand, k_n * opening, k_t * slide, depth, pressure, law.damage(largest))


def _largest(demand: Expr, kappa: Expr) -> Expr:
    """Largest demand so far, the present one included.

    A step starts with every point exactly at its history.  There it counts as loading, so that Newton's first
    tangent is that of the growing crack, and not a mixture of loading and unloading points drawn by rounding.
    """
    return ufl.conditional(ufl.gt(demand, (1 - _AT_HISTORY) * kappa), demand, kappa)
