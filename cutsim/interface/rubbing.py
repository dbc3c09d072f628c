"""What rubs where: friction as it acts on a surface, and slip and pressure at its points (docs/theory.md §3.3)."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import ufl

from cutsim.base.checks import nonnegative, positive, require_number
from cutsim.base.functions import positive_part
from cutsim.base.kinematics import Expr
from cutsim.base.signatures import checked
from cutsim.fields.temperature import Temperature
from cutsim.interface.friction import Coulomb, FrictionLaw
from cutsim.interface.modified_contact import InterfaceResponse


@checked
@dataclass(frozen=True)
class Friction:
    """Friction with its options, the same on cracks, on pairs of surfaces and on all rigid tools.

    Args:
        law: Friction law, or the coefficient of Coulomb's; without a tangential penalty of its own it takes that of the
            normal contact.
        acts_on: Where it acts beside a bond.  "broken": on its broken fraction.  "contact": wherever the faces are
            pressed together, broken or not.  "tension": as "contact", and the tension of the bond counts as pressure,
            as in (4.52) of the thesis; then an open gap rubs, which is physically wrong, so that a warning is given.
        allowed_slip: If given, augmentation until no sticking facet slides more than this in a step, in the mean
            [length].
        temperature: Temperature, for laws that depend on it; the hotter side counts, be it the other face of a crack,
            the partner in a pair, or a tool with a `ToolHeat`.

    Raises:
        ValueError: A parameter is outside its range.
    """

    law: FrictionLaw | float
    acts_on: Literal["broken", "contact", "tension"] = "broken"
    allowed_slip: float | None = None
    temperature: Temperature | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.law, FrictionLaw):
            require_number("law", self.law, nonnegative)
        require_number("allowed_slip", self.allowed_slip, positive.or_none)


#: Friction as constructors take it: with options, a law, or the coefficient of Coulomb's; None or 0 for none.
AnyFriction = Friction | FrictionLaw | float | None


def check_friction(name: str, friction: AnyFriction) -> None:
    """Refuse what is neither friction, nor a law, nor the coefficient of Coulomb's, nor None.

    Raises:
        ValueError: It is something else, or a negative number.
    """
    if not isinstance(friction, Friction | FrictionLaw):
        require_number(name, friction, nonnegative.or_none)


def completed(friction: AnyFriction, stiffness: float) -> Friction | None:
    """Friction as it acts on a contact, with a tangential penalty where its law needs one; None for none.

    Args:
        friction: What was given.
        stiffness: Penalty of the normal contact [stress/length].
    """
    if not friction:
        return None
    given = friction if isinstance(friction, Friction) else Friction(friction)
    law = given.law if isinstance(given.law, FrictionLaw) else Coulomb(float(given.law))
    return replace(given, law=law.on_penalty(stiffness))


def hotter(first: Expr, second: Expr) -> Expr:
    """Temperature of the hotter of two sides."""
    return ufl.max_value(first, second)


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

    @classmethod
    def beside(
        cls,
        friction: Friction,
        slip: Expr,
        touch: InterfaceResponse,
        bond: InterfaceResponse,
        *,
        bonded: Expr = 1.0,
        temperature: Expr | None = None,
    ) -> "Rubbing":
        """Rubbing of two faces beside a bond.

        Args:
            friction: The friction, which says on what it acts.
            slip: Slip, in components along tangents of the faces [length].
            touch: Response of the contact.
            bond: Response of the bond, the same unless the bond has another partner.
            bonded: 1 where there is a bond, 0 where there is none to be broken.
            temperature: Temperature of the hotter side.
        """
        if friction.acts_on == "tension":
            return cls(slip, touch.pressure + bond.tension, ufl.as_ufl(0.0), temperature=temperature)
        share = 1 - bonded * (1 - bond.damage[1]) if friction.acts_on == "broken" else ufl.as_ufl(1.0)
        return cls(slip, touch.pressure, touch.penetration, share=share, temperature=temperature)


def _closed(before: Expr, now: Expr) -> Expr:
    """Fraction of a step after closure, from the penetration at both ends, if it changes evenly."""
    depth = positive_part(now)
    return ufl.conditional(ufl.lt(before, 0), depth / (depth - before), 1.0)
