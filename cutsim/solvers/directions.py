"""Inclined supports: nodes at which a displacement is prescribed along no component have axes of their own.

At such a node the solver works with the components û = Q u along orthonormal axes, the rows of Q, among which are all
directions that are held there. Each condition then holds one unknown, as it does elsewhere, and the equations
Q R(Qᵀ û) = 0 with the tangent Q K Qᵀ are as symmetric as before.
"""

from collections.abc import Sequence
from typing import Protocol, runtime_checkable

import numpy as np
from dolfinx import fem
from numpy.typing import NDArray
from petsc4py import PETSc

from cutsim.base.assembly import Array
from cutsim.base.lifetime import petsc_comm
from cutsim.fields.space import refuse

# cosine between directions that counts as none, and its difference from one
_RIGHT = 1e-9


@runtime_checkable
class Guided(Protocol):
    """A displacement that is prescribed along a direction at some nodes.

    Attributes:
        name: Its name, or None.
        nodes: Local nodes (blocked dofs), ghosts included.
        direction: Unit vector; of two opposite ones always the same.
        component: Index of the component if the direction is that of one, else None.
        dofs: Owned unknowns that it holds; `Directions` sets them where there is no component.
    """

    name: str | None
    nodes: NDArray[np.int32]
    direction: Array
    component: int | None
    dofs: NDArray[np.int32]

    @property
    def prescribed(self) -> float:
        """The present value along the direction."""


class Directions:
    """Axes of the nodes at which something is prescribed along no component; elsewhere Q is the identity.

    Args:
        V: Space of the displacement.
        parts: All that is prescribed, components among them.

    Attributes:
        held: Owned unknowns that are prescribed along no component.

    Raises:
        ValueError: On all ranks, if one node is held along two directions neither parallel nor at right angles.
    """

    def __init__(self, V: fem.FunctionSpace, parts: Sequence[Guided] = ()) -> None:
        self._V, self._gdim = V, V.dofmap.index_map_bs
        self._parts = [part for part in parts if part.component is None]
        self._owned = V.dofmap.index_map.size_local
        self.nodes, self._axes = np.empty(0, dtype=np.int32), np.empty((0, self._gdim, self._gdim))
        self.held: NDArray[np.int32] = np.empty(0, dtype=np.int32)
        if self._parts:
            self._find_axes(list(parts))
            self.held = np.unique(np.concatenate([part.dofs for part in self._parts]))
            self._target = fem.Function(V)
            self._everywhere = fem.dirichletbc(self._target, self.nodes)

    def __bool__(self) -> bool:
        """Whether something is prescribed along no component, the same on all ranks."""
        return bool(self._parts)

    def _find_axes(self, parts: Sequence[Guided]) -> None:
        marks = np.zeros((self._owned + self._V.dofmap.index_map.num_ghosts, len(parts)), dtype=bool)
        for i, part in enumerate(parts):
            marks[part.nodes, i] = True
        oblique = [i for i, part in enumerate(parts) if part.component is None]
        self.nodes = np.flatnonzero(marks[:, oblique].any(axis=1)).astype(np.int32)
        patterns, pattern = np.unique(marks[self.nodes], axis=0, return_inverse=True)
        pattern, message = pattern.ravel(), None
        axes, slots = np.empty((len(patterns), self._gdim, self._gdim)), np.zeros((len(patterns), len(parts)), int)
        for k, together in enumerate(patterns):
            try:
                here = [part for part, held in zip(parts, together, strict=True) if held]
                axes[k], slots[k, together] = _axes(here, self._gdim)
            except ValueError as error:
                message = str(error)
        refuse(self._V.mesh.comm, message)
        self._axes = axes[pattern]
        for i in oblique:
            here = marks[self.nodes, i] & (self.nodes < self._owned)
            parts[i].dofs = (self._gdim * self.nodes[here] + slots[pattern[here], i]).astype(np.int32)

    def turn(self, v: Array) -> Array:
        """Components along the axes, Q v, of owned vectors, one a row."""
        return self._apply(v, self._axes)

    def back(self, v: Array) -> Array:
        """Components of space, Qᵀ v."""
        return self._apply(v, self._axes.transpose(0, 2, 1))

    def _apply(self, v: Array, axes: Array) -> Array:
        if not self._parts:
            return v
        here = self.nodes < self._owned
        blocks = v.reshape(*v.shape[:-1], v.shape[-1] // self._gdim, self._gdim).copy()
        blocks[..., self.nodes[here], :] = np.einsum("nij,...nj->...ni", axes[here], blocks[..., self.nodes[here], :])
        return blocks.reshape(v.shape)

    def prescribe(self, values: Array) -> None:
        """Set the present values of what is prescribed among owned unknowns."""
        for part in self._parts:
            values[part.dofs] = part.prescribed

    def lifting(self, u: Array) -> list[fem.DirichletBC]:
        """A condition on all components of the nodes, through which the increments of a displacement are lifted.

        Collective.

        Args:
            u: The displacement, local components, ghosts included.
        """
        if not self._parts:
            return []
        target = self.turn(u[: self._owned * self._gdim])
        self.prescribe(target)
        self._target.x.array[: target.size] = self.back(target)
        self._target.x.scatter_forward()
        return [self._everywhere]

    def matrix(self) -> PETSc.Mat:
        """Qᵀ, which the caller owns. Collective."""
        index_map = self._V.dofmap.index_map
        blocks = np.tile(np.eye(self._gdim), (self._owned, 1, 1))
        here = self.nodes < self._owned
        blocks[self.nodes[here]] = self._axes[here].transpose(0, 2, 1)
        starts = np.arange(0, blocks.size + 1, self._gdim, dtype=PETSc.IntType)
        first, last = (bound * self._gdim for bound in index_map.local_range)
        unknowns = np.arange(first, last, dtype=PETSc.IntType).reshape(-1, 1, self._gdim)
        columns = np.broadcast_to(unknowns, blocks.shape)
        size = index_map.size_local * self._gdim, index_map.size_global * self._gdim
        csr = starts, columns.ravel(), blocks.ravel()
        return PETSc.Mat().createAIJ((size, size), bsize=self._gdim, csr=csr, comm=petsc_comm(self._V.mesh.comm))


def _axes(parts: Sequence[Guided], gdim: int) -> tuple[Array, NDArray[np.int64]]:
    """Orthonormal axes with the directions of some parts among them, and the place of each part.

    Raises:
        ValueError: Two of them are neither parallel nor at right angles.
    """
    axes, taken, slots = np.zeros((gdim, gdim)), dict[int, Guided](), np.zeros(len(parts), dtype=np.int64)
    # components keep their place
    for i in sorted(range(len(parts)), key=lambda i: parts[i].component is None):
        part = parts[i]
        slots[i] = _place(axes, taken, part)
        taken.setdefault(int(slots[i]), part)
    for slot in range(gdim):
        if slot not in taken:
            rest = np.eye(gdim) - axes.T @ axes  # of the unit vectors what is at right angles to all axes so far
            longest = int(np.linalg.norm(rest, axis=1).argmax())
            axes[slot] = rest[longest] / np.linalg.norm(rest[longest])
    return axes, slots


def _place(axes: Array, taken: dict[int, Guided], part: Guided) -> int:
    """Place of a part among the axes; its direction becomes one of them if it is not."""
    direction = part.direction
    cosines = axes @ direction
    for slot, other in taken.items():
        if cosines[slot] > 1 - _RIGHT:
            return slot
        if abs(cosines[slot]) > _RIGHT:
            one, two = (f"{p.name!r} along ({', '.join(f'{c:.4g}' for c in p.direction)})" for p in (other, part))
            raise ValueError(
                f"supports {one} and {two} hold the same nodes: allowed are directions that are parallel or at right "
                "angles"
            )
    if part.component is not None:
        slot = part.component
    else:
        slot = int(np.argmax([-1.0 if i in taken else abs(c) for i, c in enumerate(direction)]))
    rest = direction - axes.T @ cosines
    axes[slot] = rest / np.linalg.norm(rest)
    return slot
