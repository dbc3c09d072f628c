"""Check that every piece of a body is held: rigid motions that nothing resists, in words."""

from collections.abc import Callable, Mapping

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.base.arrays import Array
from cutsim.base.assembly import box
from cutsim.base.checks import place
from cutsim.fields.pieces import connected_pieces
from cutsim.fields.state import State
from cutsim.solvers.preconditioners import rigid_motions

# resistance to a motion that is none, over that of the body to a stretch of the same size
_NOTHING = 1e-10
# more pieces than this are not looked at: the resistance of all to all is kept as a dense matrix
_MOST_PIECES = 60


def free_motion(
    state: State,
    supported: Callable[[Array], Array],
    resistance: Callable[[Array], tuple[Array, float]],
    bodies: Mapping[str, NDArray[np.int32] | None],
) -> str | None:
    """A motion of a piece as a rigid body that neither supports nor bonds nor closed contacts resist. Collective.

    Cracks and contacts count by what they resist at the present state: an open one holds nothing.

    Args:
        state: Displacement.
        supported: Gives the part of owned motions, one a row, that supports hold.
        resistance: Gives the forces against some motions, both of shape (motions, owned dofs), and a stiffness to
            compare with [force/length].
        bodies: Local cells of each body by name; None for all.

    Returns:
        The motion in words, or None.
    """
    count, piece = connected_pieces(state.V)
    if count > _MOST_PIECES:
        return None
    comm, gdim = state.mesh.comm, state.mesh.geometry.dim
    nodes = state.V.dofmap.index_map.size_local
    x = state.V.tabulate_dof_coordinates()[:nodes, :gdim] + state.u.x.array.reshape(-1, gdim)[:nodes]
    modes = _rigid_modes(x, extent(comm, x), axisymmetric=state.axisymmetric)
    kinds = len(modes)
    motions = np.zeros((count * kinds, nodes * gdim))
    for p in range(count):
        motions[p * kinds : (p + 1) * kinds] = np.where(piece[:nodes, None] == p, modes, 0.0).reshape(kinds, -1)
    sizes = np.array([comm.allreduce(np.count_nonzero(piece[:nodes] == p)) for p in range(count)])
    forces, stiffness = resistance(motions)
    matrix = motions @ forces.T / (stiffness or 1.0) + motions @ supported(motions).T
    matrix = comm.allreduce(0.5 * (matrix + matrix.T))
    scale = 1 / np.sqrt(np.repeat(np.maximum(sizes, 1), kinds))
    values, vectors = np.linalg.eigh(scale[:, None] * matrix * scale)
    # pressed surfaces may make a motion easier than none: that is no want of a support
    nothing = np.abs(values) <= _NOTHING
    if not nothing.any():
        return None
    free = (scale[:, None] * vectors[:, nothing]).T
    moving = int(np.abs(free[0]).argmax()) // kinds
    own = free[:, moving * kinds : (moving + 1) * kinds]
    return f"{_name(state, bodies, piece == moving, count)} can {_words(own, gdim, axisymmetric=state.axisymmetric)}"


def extent(comm: MPI.Comm, x: Array) -> float:
    """Diagonal of the box around points, one a row. Collective."""
    low, high = box(comm, x)
    return float(np.linalg.norm(high - low))


def _rigid_modes(x: Array, extent: float, *, axisymmetric: bool) -> Array:
    """Rigid motions, of equal size at the end of the body: shape (modes, nodes, components)."""
    gdim = x.shape[1]
    modes = rigid_motions(x)
    modes[gdim:] /= extent
    return modes[1:gdim] if axisymmetric else modes


def _name(state: State, bodies: Mapping[str, NDArray[np.int32] | None], moves: NDArray[np.bool_], pieces: int) -> str:
    """The bodies that a piece belongs to, and its middle where there are several pieces. Collective."""
    comm, gdim = state.mesh.comm, state.mesh.geometry.dim
    dofs = state.V.dofmap.list
    names = [
        name
        for name, cells in bodies.items()
        if comm.allreduce(bool(moves[dofs if cells is None else dofs[cells]].any()), MPI.LOR)
    ]
    nodes = state.V.dofmap.index_map.size_local
    x = state.V.tabulate_dof_coordinates()[:nodes, :gdim][moves[:nodes]]
    middle = comm.allreduce(x.sum(axis=0)) / max(comm.allreduce(len(x)), 1)
    who = "body " + " and ".join(repr(name) for name in names) if names else "a piece without material"
    where = "" if pieces == 1 else " (the piece around ({}))".format(", ".join(f"{c:.3g}" for c in middle))
    return who + where


def _words(free: Array, gdim: int, *, axisymmetric: bool) -> str:
    """Free motions of a piece, each a row of translations and rotations, in words."""
    axes = "xyz"[:gdim] if not axisymmetric else "y"
    _, sizes, basis = np.linalg.svd(free)
    space = basis[: np.count_nonzero(sizes > 1e-6 * sizes[0])]
    # a unit motion is free if its projection on the free space is all of it
    along = [axis for i, axis in enumerate(axes) if np.linalg.norm(space[:, i]) > 1 - 1e-6]
    if along:
        return "slide along " + " and ".join(along) + (" and turn" if len(space) > len(along) else "")
    if np.abs(space[0, len(axes) :]).max(initial=0.0) < 1e-6:
        return f"slide along {place(space[0, : len(axes)])}"
    return "turn"
