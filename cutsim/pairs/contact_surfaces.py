"""All surfaces of bodies that may touch, found without being named (docs/theory.md §3.5; thesis 7.3)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from cutsim.base.checks import positive, require, require_number
from cutsim.base.signatures import checked
from cutsim.base.units import Stress
from cutsim.bodies.solid import Solid
from cutsim.fields.faces import Face
from cutsim.fields.space import CRACKED, marks, outer_marks, sum_over_ranks
from cutsim.fields.state import State
from cutsim.pairs.surface_pair import SurfacePair


@checked
@dataclass(frozen=True, eq=False)
class ContactSurfaces:
    """Surfaces any of which may meet any other one, or itself.

    Attributes:
        state: Displacement and time.
        faces: The surfaces; no side of a facet is in two of them.
        young: Young's modulus of the softest body, for the automatic penalty [stress].
    """

    state: State
    faces: tuple[Face, ...]
    young: Stress

    def __post_init__(self) -> None:
        require("faces", self.faces, len(self.faces) > 0, "at least one surface")
        require_number("young", self.young, positive)

    @classmethod
    @checked
    def automatic(
        cls,
        bodies: Sequence[Solid],
        without: NDArray[np.int32] | None = None,
        closing: Sequence[tuple[Face, Face]] = (),
    ) -> Self:
        """The outer boundary of some bodies, and both faces of all cuts in them and between them. Collective.

        Args:
            bodies: The bodies; the same state belongs to all.
            without: Local facets that are left out, such as those of a crack whose faces press on each other
                themselves (`Crack` with closing=True) and meet nothing else.
            closing: Both faces of each cut whose faces press on each other themselves, and meet all else.

        Raises:
            ValueError: There is no body, bodies have different states, or what is left out is no facet of the mesh.
        """
        require("bodies", bodies, len(bodies) > 0, "at least one body")
        state, mesh = bodies[0].state, bodies[0].state.mesh
        require("bodies", bodies, all(b.state is state for b in bodies), "bodies of one state")
        cell_map = mesh.topology.index_map(mesh.topology.dim)
        filled = np.zeros(cell_map.size_local + cell_map.num_ghosts, dtype=np.int32)
        for body in bodies:
            filled[slice(None) if body.cells is None else body.cells] = 1
        filled = sum_over_ranks(cell_map, filled)
        found = all_faces(state, without)
        faces = [face.some(np.flatnonzero(filled[face.cells])) for face in found]
        there = [face.closing_as(closing) for face in faces if mesh.comm.allreduce(len(face.facets))]
        return cls(state, tuple(there), min(body.material.young for body in bodies))

    def pair(self, **options: Any) -> SurfacePair:
        """Their contact, in which each point looks for its partner on all of them while running. Collective.

        Args:
            **options: Further arguments of `SurfacePair`, such as ``friction=0.3``.
        """
        return SurfacePair(self.state, self.faces, **{"young": self.young, **options})


def all_faces(state: State, without: NDArray[np.int32] | None = None) -> tuple[Face, ...]:
    """The outer boundary of a mesh, and both faces of all facets along which the displacement may jump. Collective.

    Args:
        state: Displacement and time.
        without: Local facets that are left out.

    Raises:
        ValueError: What is left out is no facet of the mesh.
    """
    mesh, tdim = state.mesh, state.mesh.topology.dim
    outer, facet_map = outer_marks(mesh), mesh.topology.index_map(tdim - 1)
    cracked = vars(state.V).get(CRACKED, np.zeros(len(outer), dtype=bool))
    named = np.empty(0, dtype=np.int32) if without is None else np.asarray(without, dtype=np.int32)
    left = ~marks(mesh.comm, facet_map, named, "without")
    cut = np.flatnonzero((cracked & left)[: facet_map.size_local]).astype(np.int32)
    surface = np.flatnonzero(outer & left).astype(np.int32)
    return Face.outer(mesh, surface), *Face.both(mesh, cut)
