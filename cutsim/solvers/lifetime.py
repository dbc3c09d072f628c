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
    PETSc.garbage_cleanup(comm)


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
