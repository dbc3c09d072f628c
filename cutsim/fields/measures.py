"""Integration measures of one mesh, which all share the same subdomain data.

dolfinx compiles a sum of terms only if they share their subdomain data.  A term asks for the entities it needs and
gets a measure with a marker of its own; '+' is the first cell of an interior-facet row, on any number of ranks.
In an axisymmetric problem every measure, of whatever kind, weighs with the circumference 2πr.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np
import ufl
from dolfinx.mesh import Mesh, compute_midpoints
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.base.checks import require
from cutsim.base.kinematics import Expr
from cutsim.fields.faces import Face, rows


class _Revolved(ufl.Measure):
    """Measure of the ring that an entity of the meridian plane describes when it goes round the axis x₀ = 0."""

    def __rmul__(self, integrand: Expr) -> ufl.Form:
        radius = ufl.SpatialCoordinate(self.ufl_domain())[0]
        at = radius("+") if self.integral_type() == "interior_facet" else radius
        return super().__rmul__(2 * np.pi * at * integrand)

    def reconstruct(self, *args: Any, **options: Any) -> "_Revolved":
        m = super().reconstruct(*args, **options)
        return _Revolved(m.integral_type(), m.ufl_domain(), m.subdomain_id(), m.metadata(), m.subdomain_data())


class Measures:
    """Source of the measures over cells, exterior facets and interior facets.

    Args:
        mesh: The mesh; its facet–cell connectivity is created.
        axisymmetric: Whether the mesh is a meridian plane: measures are then those of the body of revolution.
    """

    def __init__(self, mesh: Mesh, *, axisymmetric: bool = False) -> None:
        self.mesh = mesh
        self._kind = _Revolved if axisymmetric else ufl.Measure
        self._tdim = mesh.topology.dim
        mesh.topology.create_connectivity(self._tdim - 1, self._tdim)
        mesh.topology.create_connectivity(self._tdim, self._tdim - 1)
        self._data: dict[str, list[tuple[int, NDArray[np.int32]]]] = {"dx": [], "ds": [], "dS": []}

    def cells(self, cells: Iterable[int] | None = None, name: str = "cells") -> ufl.Measure:
        """Measure over local cells (all if None); ghosts are left out. Collective.

        Args:
            cells: The cells.
            name: Name of the parameter as the user wrote it.

        Raises:
            ValueError: There is none on any rank.
        """
        owned = self.mesh.topology.index_map(self._tdim).size_local
        chosen = np.arange(owned) if cells is None else np.unique(np.asarray(cells, dtype=np.int32))
        chosen = chosen[chosen < owned]
        found = self.mesh.comm.allreduce(len(chosen))
        require(name, found, found > 0, "at least one cell")
        return self._add("dx", chosen)

    def exterior(self, facets: Iterable[int], name: str = "facets") -> ufl.Measure:
        """Measure over local exterior facets; facets of ghost cells are left out. Collective.

        Args:
            facets: The facets.
            name: Name of the parameter as the user wrote it.

        Raises:
            ValueError: There is none on any rank, or some have no area because they are on the axis of rotation.
        """
        owned = self.mesh.topology.index_map(self._tdim).size_local
        to_cells = self.mesh.topology.connectivity(self._tdim - 1, self._tdim)
        to_facets = self.mesh.topology.connectivity(self._tdim, self._tdim - 1)
        pairs = []
        for facet in np.unique(np.asarray(facets, dtype=np.int32)):
            cells = to_cells.links(facet)
            if len(cells) == 1 and cells[0] < owned:
                pairs.append((cells[0], int(np.flatnonzero(to_facets.links(cells[0]) == facet)[0])))
        found = self.mesh.comm.allreduce(len(pairs))
        require(name, found, found > 0, "at least one exterior facet")
        self._check_area(np.asarray(facets, dtype=np.int32))
        return self._add("ds", np.asarray(pairs))

    def face(self, face: Face, name: str = "facets") -> ufl.Measure:
        """Measure over facets as parts of the boundary of their cells, also within the mesh. Collective.

        Args:
            face: The facets; those of ghost cells are left out.
            name: Name of the parameter as the user wrote it.

        Raises:
            ValueError: There is none on any rank, or some have no area because they are on the axis of rotation.
        """
        pairs = rows([face], self.mesh.topology.index_map(self._tdim).size_local)
        found = self.mesh.comm.allreduce(len(pairs))
        require(name, found, found > 0, "at least one facet")
        self._check_area(face.facets)
        return self._add("ds", pairs)

    def interior(self, entities: NDArray[np.int32]) -> ufl.Measure:
        """Measure over interior facets given as rows (cell⁺, local facet⁺, cell⁻, local facet⁻)."""
        return self._add("dS", entities)

    def _check_area(self, facets: NDArray[np.int32]) -> None:
        """Refuse facets on the axis of rotation. Collective."""
        if self._kind is not _Revolved:
            return
        size = self.mesh.comm.allreduce(self.mesh.geometry.x[:, 0].max(initial=0.0), MPI.MAX)
        radii = compute_midpoints(self.mesh, self._tdim - 1, facets)[:, 0]
        lost = self.mesh.comm.allreduce(int(np.sum(radii < 1e-9 * size)))
        require("facets", f"{lost} on the axis of rotation", lost == 0, "facets that have an area")

    def _add(self, kind: str, entities: NDArray[np.integer]) -> ufl.Measure:
        marker = len(self._data[kind])
        self._data[kind].append((marker, np.asarray(entities, dtype=np.int32).ravel()))
        return self._kind(kind, domain=self.mesh, subdomain_data=self._data[kind], subdomain_id=marker)
