"""What every benchmark reports: wall time and peak memory."""

import resource
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from mpi4py import MPI


@dataclass
class Usage:
    """Resources used, filled in at the end of `measure`.

    Attributes:
        wall: Seconds on the slowest rank.
        memory: Largest resident memory so far in GB, summed over the ranks; everything before counts too.
    """

    wall: float = 0.0
    memory: float = 0.0


@contextmanager
def measure(comm: MPI.Comm) -> Iterator[Usage]:
    """Measure the block. Collective."""
    usage = Usage()
    comm.barrier()
    start = time.perf_counter()
    yield usage
    usage.wall = comm.allreduce(time.perf_counter() - start, MPI.MAX)
    unit = 1e-9 if sys.platform == "darwin" else 1.024e-6  # bytes or KiB
    usage.memory = unit * comm.allreduce(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
