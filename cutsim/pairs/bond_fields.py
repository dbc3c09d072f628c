"""Fields of the bond of a pair of surfaces for output."""

from collections.abc import Callable

import ufl
from dolfinx.mesh import Mesh

from cutsim.base.kinematics import Expr
from cutsim.base.terms import Term
from cutsim.fields.points import FacetPoints, Values

#: Fields of a bond, averaged over each facet of the slave.
FIELDS = ("damage", "strength_loss", "spent", "sliding", "pressure", "dissipated")


class BondFields(Term):
    """Fields on a part of the slave surface of a pair; it adds nothing to the balance.

    Args:
        name: Name in output.
        points: Integration points of the part.
        values: Trial values at the points by name, of `FIELDS`.
    """

    def __init__(self, name: str, points: FacetPoints, values: Callable[[str], Values]) -> None:
        self.name, self._points, self._values = name, points, values

    def residual(self, v: Expr) -> ufl.Form:
        """No form."""
        return ufl.Form([])

    @property
    def submesh(self) -> Mesh:
        """Mesh of the facets."""
        return self._points.submesh

    @property
    def facet_fields(self) -> tuple[str, ...]:
        """Names of the fields."""
        return FIELDS

    def facet_mean(self, name: str) -> Values:
        """Mean of a field over each local facet."""
        return self._points.facet_mean(self._values(name))
