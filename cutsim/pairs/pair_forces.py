"""Forces of a pass in vector and matrix: contact, a bond with partners of its own, and what couples them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc

from cutsim.base.assembly import add_blocks
from cutsim.pairs.nodal_forces import Action, Coupling
from cutsim.pairs.pairing import Array, Indices
from cutsim.pairs.partners import PairKinematics

# points whose tangents are held in memory at a time
_CHUNK = 10_000


@dataclass(frozen=True)
class PairForces:
    """Tractions at the points of a slave surface, as nodal forces.

    Attributes:
        actions: Tractions between the points and their partners, of contact and of a bond if that has its own.
        coupling: How those of the contact depend on the bond, None if no partners are the bond's own.
    """

    actions: Sequence[Action]
    coupling: Coupling | None = None

    def add(self, b: PETSc.Vec, along: Array | None = None) -> None:
        """Add nodal forces, and their tangent times a displacement of the local dofs. Collective."""
        # nodes of a rigid master have no number; matrices pass over them unasked
        b.setOption(PETSc.Vec.Option.IGNORE_NEGATIVE_INDICES, True)
        for action in self.actions:
            rows = action.rows
            forces = action.forces(rows)
            if along is not None:
                forces += _times(action.tangents(rows), action.at_nodes(along, rows))
            _add(b, action.nodes(rows), forces)
        if along is not None and self.coupling is not None:
            first, second = self.coupling.rows
            forces = _times(self.coupling.tangents((first, second)), self.coupling.bond.at_nodes(along, second))
            _add(b, self.coupling.contact.nodes(first), forces)

    def add_tangent(self, A: PETSc.Mat) -> None:
        """Add the tangent. Collective."""
        for action in self.actions:
            for rows in _chunks(action.rows):
                nodes = action.nodes(rows)
                _add_tangents(A, action.tangents(rows), nodes, nodes)
        if self.coupling is not None:
            first, second = self.coupling.rows
            for some in zip(_chunks(first), _chunks(second), strict=True):
                nodes, columns = self.coupling.contact.nodes(some[0]), self.coupling.bond.nodes(some[1])
                _add_tangents(A, self.coupling.tangents(some), nodes, columns)


def add_pattern(A: PETSc.Mat, kinds: Sequence[PairKinematics]) -> None:
    """Add zeros wherever forces of contact, and of a bond with partners of its own, may have a tangent. Collective."""
    slave = kinds[0].slave
    near = [tuple(facets[slave.owned[k.facets[0]]] for facets in k.facets) for k in kinds]
    nodes = [k.between(*facets) for k, facets in zip(kinds, near, strict=True)]
    joined = [(n, n) for n in nodes]
    if len(kinds) == 2:
        first, second = _with_same(near[0][0], near[1][0])
        joined.append((nodes[0][first], nodes[1][second]))
    dim = slave.reference.shape[-1]
    for rows, columns in joined:
        for some, others in zip(_chunks(rows), _chunks(columns), strict=True):
            dofs, across = dofs_of(some, dim), dofs_of(others, dim)
            add_blocks(A, dofs, np.zeros((*dofs.shape, across.shape[1])), across)


def dofs_of(nodes: Indices, dim: int) -> Indices:
    """Global dofs of global nodes, shape (n, nodes) → (n, dofs); negative for −1."""
    return (nodes[..., None] * dim + np.arange(dim)).reshape(len(nodes), dim * nodes.shape[1])


def _add(b: PETSc.Vec, nodes: Indices, forces: Array) -> None:
    dofs = dofs_of(nodes, forces.shape[-1]).ravel().astype(PETSc.IntType)
    b.setValues(dofs, forces.ravel(), addv=PETSc.InsertMode.ADD)


def _add_tangents(A: PETSc.Mat, tangents: Array, nodes: Indices, columns: Indices) -> None:
    """Add tangents of consecutive pairs, those of the same nodes as one block."""
    starts = np.flatnonzero(np.any(np.diff(np.hstack([nodes, columns]), axis=0, prepend=-1), axis=1))
    if len(starts):
        dim = tangents.shape[2]
        rows, across = dofs_of(nodes[starts], dim), dofs_of(columns[starts], dim)
        blocks = np.add.reduceat(tangents, starts)
        add_blocks(A, rows, blocks.reshape(*rows.shape, across.shape[1]), across)


def _times(tangents: Array, change: Array) -> Array:
    """Nodal forces of a change at the nodes, from their tangents."""
    return np.asarray(np.einsum("nricj,ncj->nri", tangents, change))


def _chunks(rows: Indices) -> list[Indices]:
    """Consecutive parts of an array of points or facets, so that not all tangents are in memory at a time."""
    return np.array_split(rows, 1 + len(rows) // _CHUNK)


def _with_same(first: Indices, second: Indices) -> tuple[Indices, Indices]:
    """All places (i, j) at which first[i] equals second[j], two arrays of numbers; the second is ascending."""
    low, high = np.searchsorted(second, first, "left"), np.searchsorted(second, first, "right")
    i = np.repeat(np.arange(len(first)), high - low)
    before = np.repeat(np.cumsum(high - low) - (high - low), high - low)
    return i, low[i] + np.arange(len(i)) - before
