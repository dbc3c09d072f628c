"""Fields of a bond for output, means over facets of the values at its points."""

from abc import ABC, abstractmethod

import numpy as np
from dolfinx.mesh import Mesh
from numpy.typing import NDArray

from cutsim.base.terms import Term
from cutsim.fields.points import FacetPoints, Values


class PointFields(Term, ABC):
    """A term with fields on facets.

    Attributes:
        points: Integration points on the facets, in the order of all per-facet arrays.
    """

    points: FacetPoints

    @property
    @abstractmethod
    def facet_fields(self) -> tuple[str, ...]:
        """Names of the fields, none if there is nothing to show."""

    @abstractmethod
    def point_values(self, name: str) -> Values:
        """Trial values of a field at the points, shape (local facets, points)."""

    @property
    def facets(self) -> NDArray[np.int32]:
        """Local facets, ghosts included."""
        return self.points.facets

    @property
    def submesh(self) -> Mesh:
        """Mesh of the facets."""
        return self.points.submesh

    def facet_mean(self, name: str) -> Values:
        """Mean over each local facet of a point quantity; arguments as `point_values`."""
        return self.points.facet_mean(self.point_values(name))
