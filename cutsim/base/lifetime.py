"""Lifetime of PETSc objects, so that a loop over many problems does not use up MPI communicators."""

import gc
from collections.abc import Callable
from itertools import count
from typing import Any
from weakref import WeakMethod

from mpi4py import MPI
from petsc4py import PETSc

# problems after which what is left of dropped ones is looked for
_COLLECT = 16

_made = count(1)


def free_dropped(comm: MPI.Comm) -> None:
    """Free what earlier problems have left, to be called where all ranks meet. Collective.

    Objects that refer to each other wait for Python's collector, which does not know that their communicators are
    few; and on several ranks PETSc only notes what Python has dropped.
    """
    if next(_made) % _COLLECT == 0:
        gc.collect()
    PETSc.garbage_cleanup(petsc_comm(comm))


def petsc_comm(comm: MPI.Comm) -> MPI.Comm:
    """The communicator on which PETSc objects are made: that of all processes, where the mesh is on all of them.

    Each mesh and each of its index maps has a communicator of its own. PETSc would add one of its own to each, and on
    several ranks it frees what Python has dropped by communicator: what was made on that of a mesh which is gone would
    stay for ever.

    Args:
        comm: Communicator of a mesh or of an index map.

    Returns:
        The communicator of all processes, or `comm` if it holds only some of them.
    """
    same = MPI.Comm.Compare(comm, MPI.COMM_WORLD) in (MPI.IDENT, MPI.CONGRUENT)
    return MPI.COMM_WORLD if same else comm


def weakly(method: Callable[..., Any]) -> Callable[..., Any]:
    """A method that PETSc may call and that does not keep its object alive.

    Python cannot see what PETSc holds. A problem held there is never freed, nor are its matrices, spaces and
    communicators, of which MPI has no more than some thousands: a loop over runs ends when they are used up.
    """
    reference = WeakMethod(method)

    def call(*arguments: Any) -> Any:
        alive = reference()
        assert alive is not None, "the solver has outlived its problem"
        return alive(*arguments)

    return call
