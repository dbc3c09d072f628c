"""Fields of the bond of a pair of surfaces for output."""

from collections.abc import Callable

import ufl

from cutsim.base.kinematics import Expr
from cutsim.fields.points import FacetPoints, Values
from cutsim.interface.point_fields import PointFields

#: Fields of a bond, averaged over each facet of the slave.
FIELDS = ("damage", "strength_loss", "spent", "sliding", "pressure", "dissipated")


class BondFields(PointFields):
    """Fields on a part of the slave surface of a pair; it adds nothing to the balance.

    Args:
        name: Name in output.
        points: Integration points of the part.
        values: Trial values at the points by name, of `FIELDS`.
    """

    def __init__(self, name: str, points: FacetPoints, values: Callable[[str], Values]) -> None:
        self.name, self.points, self._values = name, points, values

    def residual(self, v: Expr) -> ufl.Form:
        """No form."""
        return ufl.Form([])

    @property
    def facet_fields(self) -> tuple[str, ...]:
        """Names of the fields."""
        return FIELDS

    def point_values(self, name: str) -> Values:
        """Trial values of a field at the points."""
        return self._values(name)
