"""What the machine has."""

import os
from contextlib import suppress
from pathlib import Path

from mpi4py import MPI

# limits of containers and of jobs, which the kernel keeps to (control groups, versions 2 and 1)
_LIMITS = (Path("/sys/fs/cgroup/memory.max"), Path("/sys/fs/cgroup/memory/memory.limit_in_bytes"))


def memory_per_rank(comm: MPI.Comm) -> float:
    """Memory of the machine, or of the container or job, for each rank on it [MB]; the least of all ranks. Collective.

    What other programs use of it is not taken off, so that the same run finds the same number.
    """
    sizes = [os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")]
    for path in _LIMITS:
        with suppress(OSError, ValueError):  # "max" where there is no limit
            sizes.append(int(path.read_text()))
    machine = comm.Split_type(MPI.COMM_TYPE_SHARED)
    share = min(sizes) / machine.size
    machine.Free()
    return float(comm.allreduce(share, MPI.MIN)) / 1e6
