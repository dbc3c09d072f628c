"""What every benchmark reports: wall and CPU time, peak memory, and what each part of a solve costs."""

import resource
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from mpi4py import MPI
from petsc4py import PETSc

#: Parts of a solve and the events of PETSc's log that time them.
PARTS = {
    "residual": "SNESFunctionEval",
    "tangent": "SNESJacobianEval",
    "set-up of the preconditioner": "PCSetUp",
    "Krylov": "KSPSolve",
}


@dataclass
class Usage:
    """Resources used, filled in at the end of `measure`.

    Attributes:
        wall: Seconds on the slowest rank.
        cpu: Seconds of the processor, summed over the ranks.
        memory: Largest resident memory so far in GB, summed over the ranks; everything before counts too.
        parts: Share of the wall time on the first rank, by part.
    """

    wall: float = 0.0
    cpu: float = 0.0
    memory: float = 0.0
    parts: dict[str, float] = field(default_factory=dict)

    def __str__(self) -> str:
        parts = ", ".join(f"{name} {share:.0%}" for name, share in self.parts.items())
        return f"  of the time: {parts}, the rest {1 - sum(self.parts.values()):.0%}"


@contextmanager
def measure(comm: MPI.Comm) -> Iterator[Usage]:
    """Measure the block. Collective."""
    usage = Usage()
    PETSc.Log.begin()
    comm.barrier()
    before, cpu, start = _in_parts(), time.process_time(), time.perf_counter()
    yield usage
    wall = time.perf_counter() - start
    usage.parts = {name: (seconds - before[name]) / wall for name, seconds in _in_parts().items()}
    usage.cpu = comm.allreduce(time.process_time() - cpu)
    usage.wall = comm.allreduce(wall, MPI.MAX)
    unit = 1e-9 if sys.platform == "darwin" else 1.024e-6  # bytes or KiB
    usage.memory = unit * comm.allreduce(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)


def _in_parts() -> dict[str, float]:
    """Seconds in each part so far."""
    return {name: PETSc.Log.Event(event).getPerfInfo()["time"] for name, event in PARTS.items()}
