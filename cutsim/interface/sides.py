"""Sides of a crack: both are meshed, or one of them and its image in a plane of symmetry (docs/theory.md §1, 3)."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Literal

import numpy as np
import ufl
from numpy.typing import NDArray
from ufl.geometry import FacetJacobian

from cutsim.base.checks import require
from cutsim.base.kinematics import Expr, displacement_jump, facing, midsurface_normal, surface_frame, tangents
from cutsim.fields.crack_checks import check_cracked
from cutsim.fields.faces import Face, rows
from cutsim.fields.points import FacetPoints
from cutsim.fields.space import crack_measure_entities, on_boundary
from cutsim.fields.state import State
from cutsim.fields.symmetry import SymmetryPlane

Facets = NDArray[np.int32]


class Sides(ABC):
    """Sides of a crack, '+' and '−'.

    Args:
        state: Displacement and time.
        points: Integration points of the crack.
        entities: Rows (cell, local facet) of the sides that are meshed, flattened, of the facets owned by this rank.

    Attributes:
        points: The points.
        entities: The rows.
        share: Part of the energy of the crack that belongs to what is meshed.
        plane: Plane of symmetry in which it lies; None if both sides are meshed.
    """

    share = 1.0
    plane: SymmetryPlane | None = None

    def __init__(self, state: State, points: FacetPoints, entities: NDArray[np.int32]) -> None:
        self._state, self.points, self.entities = state, points, entities

    @property
    @abstractmethod
    def meshed(self) -> tuple[Face, ...]:
        """The faces that are meshed, '+' first. Collective."""

    @abstractmethod
    def jump(self, u: Expr) -> Expr:
        """Jump u⁻ − u⁺ of a displacement, for use on the crack."""

    @abstractmethod
    def normal(self, u: Expr) -> Expr:
        """Unit normal at a displacement, from '+' to '−'."""

    @abstractmethod
    def facing(self, u: Expr) -> Expr:
        """Whether the faces face each other, see `cutsim.base.kinematics.facing`."""

    @abstractmethod
    def frame(self, u: Expr) -> tuple[Expr, ...]:
        """Unit tangents that turn with the crack, one in 2-D, two in 3-D."""

    @abstractmethod
    def face(self, side: Literal["+", "-"]) -> Face:
        """One of the faces. Collective.

        Raises:
            ValueError: It is not meshed.
        """


class TwoSides(Sides):
    """Both sides of facets within the mesh.

    Args:
        state: Displacement, on a space that is cracked along the facets, and time.
        facets: Local interior facets, ghosts included.
        plus: The side called '+', as for `cutsim.Crack`.
        name: Name of the crack.
        current: Whether the normal is that of the current mid-surface; else it is that of the reference configuration.

    Raises:
        ValueError: The facets are not a crack of the mesh.
    """

    def __init__(
        self, state: State, facets: Facets, plus: Facets | Sequence[float], name: str, *, current: bool
    ) -> None:
        entities = crack_measure_entities(state.mesh, facets, plus)
        check_cracked(state.V, facets, name)
        measure = state.measures.interior(entities)
        super().__init__(state, FacetPoints(state.mesh, facets, measure, interior=True), entities)
        self._current, self._N = current, ufl.FacetNormal(state.mesh)

    @property
    def meshed(self) -> tuple[Face, ...]:
        """Both faces. Collective."""
        return self.face("+"), self.face("-")

    def face(self, side: Literal["+", "-"]) -> Face:
        """One of the faces. Collective."""
        return Face.of_rows(self._state.mesh, self.entities, side)

    def jump(self, u: Expr) -> Expr:
        """Jump u⁻ − u⁺ of a displacement."""
        return displacement_jump(u)

    def normal(self, u: Expr) -> Expr:
        """Unit normal of the mid-surface."""
        return midsurface_normal(u, self._N) if self._current else self._N("+")

    def facing(self, u: Expr) -> Expr:
        """Whether the faces face each other; in the reference configuration they do."""
        return facing(u, self._N) if self._current else ufl.as_ufl(1.0)

    def frame(self, u: Expr) -> tuple[Expr, ...]:
        """Unit tangents of the mid-surface."""
        return surface_frame(u, self._state.mesh, self.normal(u), current=self._current)


class MirroredSide(Sides):
    """The '+' side of a crack in a plane of symmetry; the other one is its image.

    With the normal N of the plane the image of u is u − 2 (u·N) N: the jump is −2 (u·N) N, an opening without slide.
    Half of the work on it is done on the side that is meshed.

    Args:
        state: Displacement and time.
        facets: Local facets of the outer boundary, ghosts included, in one plane.

    Raises:
        ValueError: The facets are not on the outer boundary, or in no plane of symmetry.
    """

    share = 0.5

    def __init__(self, state: State, facets: Facets) -> None:
        require("plus", None, on_boundary(state.mesh, facets), "the cells of a side, or a direction, within the mesh")
        self._face = Face.outer(state.mesh, facets)
        self.plane = SymmetryPlane.of(state, self._face)
        require("facets", f"{len(facets)} on one rank", self.plane is not None, "in a plane of symmetry")
        points = FacetPoints(state.mesh, self._face.facets, state.measures.face(self._face), interior=False)
        owned = state.mesh.topology.index_map(state.mesh.topology.dim).size_local
        super().__init__(state, points, rows([self._face], owned).ravel())
        self._N = ufl.FacetNormal(state.mesh)

    @property
    def meshed(self) -> tuple[Face, ...]:
        """The '+' face."""
        return (self._face,)

    def face(self, side: Literal["+", "-"]) -> Face:
        """The '+' face; the other one is not meshed."""
        require("side", side, side == "+", "'+': the other side is an image")
        return self._face

    def jump(self, u: Expr) -> Expr:
        """Jump −2 (u·N) N from a displacement to that of the image."""
        return -2 * ufl.dot(u, self._N) * self._N

    def normal(self, u: Expr) -> Expr:
        """Normal of the plane."""
        return self._N

    def facing(self, u: Expr) -> Expr:
        """One: what leaves the plane is in front of its image."""
        return ufl.as_ufl(1.0)

    def frame(self, u: Expr) -> tuple[Expr, ...]:
        """Unit tangents of the plane."""
        return tangents(self._N, FacetJacobian(self._state.mesh)[:, 0] if len(self._N) == 3 else None)


def sides_of(state: State, facets: Facets, plus: Facets | Sequence[float] | None, name: str, *, current: bool) -> Sides:
    """The sides of a crack; arguments as for `TwoSides`, plus=None if one of them is the image of the other."""
    return MirroredSide(state, facets) if plus is None else TwoSides(state, facets, plus, name, current=current)
