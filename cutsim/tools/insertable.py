"""What an insertion asks of the tool that it pushes along a crack, whole or in halves (docs/needle_insertion.md)."""

from abc import ABC, abstractmethod
from typing import ClassVar

from cutsim.base.kinematics import Expr
from cutsim.interface.contact import HardeningContact, PenaltyContact, SoftenedContact
from cutsim.tools.shapes import Direction

# penalty over E/h and half the width of the quadratic start over h, for an intact surface
_FIRM, _BLEND = 1000.0, 0.1
# how much larger than in a cut the slope ε is of a tool that may also indent: at a pressure of E it is twice as stiff
_INDENTING = 2.0


class Insertable(ABC):
    """Base of blades and needles that can be halved in the plane of a crack, whose faces meet a half each.

    Attributes:
        push: Direction in which the tool points; the reference point is on its axis, as high as the foremost point.
        lateral: Direction across that tells how it is turned about its axis.
        side: 0 for the whole tool, +1 or −1 for the half on the side of ±normal, continued without end to the other
            side.
        parametric: Its numbers may be form constants, see `cutsim.tools.shapes.with_form_constants`.
        round: Whether its shank is a body of revolution, else it extends along an edge.
        mirrored: Whether it is symmetric about the plane of its axis and of the normal of the crack.
        halving: How its direction `lateral` has to lie to the crack, in words.
        angle: Name of its angle between axis and flank.
        firmness: Of its contact in a cut: penalty times h/E, half the width of the quadratic start over h, and the
            clearance over h.
    """

    push: Direction
    lateral: Direction | None
    side: int
    parametric: ClassVar[bool] = True
    round: ClassVar[bool]
    mirrored: ClassVar[bool] = True
    halving: ClassVar[str] = "normal to the crack"
    angle: ClassVar[str] = "half_angle"
    firmness: ClassVar[tuple[float, float, float]]

    @property
    @abstractmethod
    def resolution(self) -> float:
        """Radius of the tip, or of its edge [length]."""

    @property
    @abstractmethod
    def normal(self) -> Direction | None:
        """Normal of the plane in which it is halved, None for a whole one that need not know."""

    @property
    @abstractmethod
    def shaft_height(self) -> float:
        """Height above the foremost point at which the shank begins [length]."""

    @abstractmethod
    def half_width(self, height: float, side: int | None = None) -> float:
        """Distance from the plane in which it is halved to its surface, a height above the tip [length].

        Args:
            height: The height [length].
            side: On the side of ±normal; by default that of the tool, and + of a whole one.
        """

    @abstractmethod
    def distance(self, x: Expr) -> Expr:
        """Signed distance at a position relative to the reference point [length], negative inside."""

    def soft_contact(self, young: float, h: float, *, indenting: bool = False) -> SoftenedContact:
        """Contact law of the tool in a cut, so soft that its tip does not catch on the nodes.

        Args:
            young: Young's modulus of the solid [stress].
            h: Size of its cells normal to the surface [length].
            indenting: Whether it may also indent the solid, by pressures of up to thirty times Young's modulus.
        """
        penalty, blend, clearance = self.firmness
        if indenting:
            return HardeningContact(_INDENTING * penalty * young / h, blend * h, clearance * h)
        return SoftenedContact(penalty * young / h, blend * h, clearance * h)

    @staticmethod
    def firm_contact(young: float, h: float) -> PenaltyContact:
        """Contact law for an intact surface, on which a tip presses much harder than in a cut.

        The pressure grows with the square of the penetration. At 25 times Young's modulus that is a tenth of h.

        Args:
            young: Young's modulus of the solid [stress].
            h: Size of its cells normal to the surface [length].
        """
        return PenaltyContact.automatic(young, h, _FIRM, blend=_BLEND * h)
