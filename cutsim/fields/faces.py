"""Facets that are seen from one of their cells: parts of the outer boundary, and faces of cuts."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, Self

import numpy as np
from dolfinx import la
from dolfinx.mesh import Mesh
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.base.checks import require
from cutsim.base.signatures import checked
from cutsim.fields.sizes import incidence
from cutsim.fields.space import crack_measure_entities, marks


@checked
@dataclass(frozen=True, eq=False)
class Face:
    """Facets, each with the cell on whose side it is; ghosts are included, as far as this rank knows their cell.

    `outer` makes one of the outer boundary, `cut` one of two faces of a cut, and `cutsim.Crack.face` that of a crack.

    Attributes:
        facets: Local facets.
        cells: Local cell of each.
        local: Number of each facet within its cell.
        closing: Number, from 1, of the cut to whose '+' face each belongs, negative for its '-' face, if the two press
            on each other elsewhere, as those of a `Crack` with closing=True; else 0. None for 0 throughout.
    """

    facets: NDArray[np.int32]
    cells: NDArray[np.int32]
    local: NDArray[np.int32]
    closing: NDArray[np.int64] | None = None

    @classmethod
    @checked
    def outer(cls, mesh: Mesh, facets: NDArray[np.int32], name: str = "facets") -> Self:
        """A part of the outer boundary. Collective.

        Args:
            mesh: The mesh.
            facets: Local exterior facets, ghosts included.
            name: Name of the parameter as the user wrote it.

        Raises:
            ValueError: Some of them are not on the outer boundary, or no facets of the mesh.
        """
        tdim = mesh.topology.dim
        mesh.topology.create_connectivity(tdim - 1, tdim)
        to_cells = mesh.topology.connectivity(tdim - 1, tdim)
        facets = np.unique(np.asarray(facets, dtype=np.int32))
        marks(mesh.comm, mesh.topology.index_map(tdim - 1), facets, name)  # all within the mesh
        owned = facets < mesh.topology.index_map(tdim - 1).size_local
        inner = mesh.comm.allreduce(int(np.count_nonzero(np.diff(to_cells.offsets)[facets[owned]] != 1)))
        require(
            name,
            f"{inner} facets between two cells",
            inner == 0,
            "on the outer boundary, or a face of a cut (of a crack, such as crack+)",
        )
        return cls._of(mesh, facets, to_cells.array[to_cells.offsets[facets]])

    @classmethod
    @checked
    def cut(
        cls,
        mesh: Mesh,
        facets: NDArray[np.int32] | Sequence[NDArray[np.int32]],
        plus: NDArray[np.int32] | Sequence[float],
        side: Literal["+", "-"],
    ) -> Self:
        """One face of a cut. Collective.

        Args:
            mesh: The mesh; on several ranks with ghost mode ``shared_facet``.
            facets: Facets along which the space is cracked, as for `cutsim.cracked_space`.
            plus: The '+' side, as for `cutsim.Crack`.
            side: Which face.

        Raises:
            ValueError: As `cutsim.fields.space.crack_measure_entities`.
        """
        return cls.of_rows(mesh, crack_measure_entities(mesh, facets, plus), side)

    @classmethod
    @checked
    def both(cls, mesh: Mesh, facets: NDArray[np.int32]) -> tuple[Self, Self]:
        """The two faces of cuts whose sides have no names: whichever face a facet's side belongs to. Collective.

        Args:
            mesh: The mesh; on several ranks with ghost mode ``shared_facet``.
            facets: Local facets along which the space is cracked, those that this rank owns.
        """
        tdim = mesh.topology.dim
        mesh.topology.create_connectivity(tdim - 1, tdim)
        to_cells = mesh.topology.connectivity(tdim - 1, tdim)
        pairs = to_cells.array[to_cells.offsets[facets][:, None] + np.arange(2)].astype(np.int32)
        # the order in which the cells were given is the same on any number of ranks
        order = np.argsort(mesh.topology.original_cell_index[pairs], axis=1)
        pairs = np.take_along_axis(pairs, order, axis=1)
        of_cells = incidence(mesh, tdim, tdim - 1)
        local = np.argmax(of_cells[pairs] == np.asarray(facets)[:, None, None], axis=2)
        entities = np.stack([pairs, local], axis=2).astype(np.int32).ravel()
        return cls.of_rows(mesh, entities, "+"), cls.of_rows(mesh, entities, "-")

    @classmethod
    @checked
    def of_rows(cls, mesh: Mesh, entities: NDArray[np.int32], side: Literal["+", "-"]) -> Self:
        """One face of the rows of `cutsim.fields.space.crack_measure_entities`. Collective."""
        require("side", side, side in ("+", "-"), "'+' or '-'")
        tdim = mesh.topology.dim
        cells, local = entities.reshape(-1, 2, 2)[:, "+-".index(side)].T
        # whoever owns a facet knows both its cells, and tells the ranks that hold it which of them is meant
        meant = la.vector(mesh.topology.index_map(tdim - 1), dtype=np.int64)
        meant.array[:] = -1
        index_map = mesh.topology.index_map(tdim)
        meant.array[incidence(mesh, tdim, tdim - 1)[cells, local]] = index_map.local_to_global(cells.astype(np.int32))
        meant.scatter_forward()
        facets = np.flatnonzero(meant.array >= 0).astype(np.int32)
        found = np.asarray(index_map.global_to_local(meant.array[facets]), dtype=np.int32)
        return cls._of(mesh, facets[found >= 0], found[found >= 0])

    @classmethod
    def _of(cls, mesh: Mesh, facets: NDArray[np.int32], cells: NDArray[np.int32]) -> Self:
        tdim = mesh.topology.dim
        local = np.argmax(incidence(mesh, tdim, tdim - 1)[cells] == facets[:, None], axis=1)
        return cls(facets, np.asarray(cells, dtype=np.int32), local.astype(np.int32))

    @classmethod
    @checked
    def joined(cls, faces: Sequence["Face"]) -> Self:
        """Several of them as one; both faces of a cut have the same facets."""
        return cls(
            *(np.concatenate([getattr(f, part) for f in faces]) for part in ("facets", "cells", "local", "cuts"))
        )

    @property
    def cuts(self) -> NDArray[np.int64]:
        """Numbers of the cuts that close elsewhere, 0 for none."""
        return np.zeros(len(self.facets), dtype=np.int64) if self.closing is None else self.closing

    def some(self, rows: NDArray[np.integer]) -> "Face":
        """Some of the facets, by their places."""
        return Face(self.facets[rows], self.cells[rows], self.local[rows], self.cuts[rows])

    def closing_as(self, cuts: Sequence[tuple["Face", "Face"]]) -> "Face":
        """The same facets, those of some cuts with the number of the cut; both faces of each are given."""
        found, labels = self.cuts.copy(), self._labels
        for number, sides in enumerate(cuts, start=1):
            for sign, side in zip((1, -1), sides, strict=True):
                found[np.isin(labels, side._labels)] = sign * number
        return Face(self.facets, self.cells, self.local, found)

    @property
    def _labels(self) -> NDArray[np.int64]:
        """A number for each facet as seen from its cell, which has six facets at most."""
        return 8 * self.cells.astype(np.int64) + self.local

    def in_order_of(self, facets: NDArray[np.int32]) -> "Face":
        """The same facets, none of which is there twice, in another order."""
        return self.some(self.order_of(facets))

    def order_of(self, facets: NDArray[np.int32]) -> NDArray[np.int64]:
        """Places of the same facets, none of which is there twice, in another order."""
        order = np.argsort(self.facets)
        return np.asarray(order[np.searchsorted(self.facets, facets, sorter=order)], dtype=np.int64)


def rows(faces: Sequence[Face], cells: int) -> NDArray[np.int32]:
    """Rows (cell, local facet) of faces, those in the first so many cells, which this rank owns."""
    found = [np.column_stack([face.cells, face.local])[face.cells < cells] for face in faces]
    return np.concatenate(found).astype(np.int32)


def mean_size(
    mesh: Mesh, faces: Sequence[Face], size: Callable[[Mesh, NDArray[np.int32]], NDArray[np.float64]]
) -> float:
    """Mean of a size of the facets of some faces, such as `cutsim.fields.sizes.normal_size` [length]. Collective."""
    cells = mesh.topology.index_map(mesh.topology.dim).size_local
    own = np.concatenate([size(mesh, face.facets)[face.cells < cells] for face in faces])
    total, count = mesh.comm.allreduce(np.array([own.sum(), len(own)]), op=MPI.SUM)
    return float(total / count)
