"""A rank of an MPI run: a script or ``-m module``; where one rank fails alone, all of them end.

``python -m mpi4py`` aborts only when MPI is finalised, which a failed rank never reaches here:
PETSc is finalised first, and that waits for the ranks that still compute.
"""

import signal
import sys
import time
import traceback
from typing import NoReturn

from mpi4py import MPI
from mpi4py.run import run_command_line

GRACE = 3.0  # seconds for the other ranks to fail in the same way, as they do on bad input


def end_together(comm: MPI.Comm, code: int, unsaid: BaseException | None = None) -> NoReturn:
    """End with an exit status if all ranks come here within the grace period, else abort them.

    Args:
        comm: All ranks.
        code: The exit status.
        unsaid: What has ended this rank, if that is said by one rank only.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    arrived = comm.Ibarrier()
    deadline = time.monotonic() + GRACE
    while not arrived.Test():
        if time.monotonic() > deadline:
            if unsaid is not None:
                traceback.print_exception(unsaid)
            sys.stderr.flush()
            MPI.COMM_WORLD.Abort(code)
        time.sleep(0.01)
    sys.exit(code)


def main() -> None:
    """Run what the arguments say; the exit status is its own."""
    # mpirun passes this signal on, and kills the ranks where it gets SIGTERM itself.
    signal.signal(signal.SIGUSR1, lambda number, frame: signal.raise_signal(signal.SIGTERM))
    comm = MPI.COMM_WORLD.Dup()  # its messages mix with no others
    try:
        run_command_line(sys.argv[1:])
    except SystemExit as end:
        if isinstance(end.code, str):
            print(end.code, file=sys.stderr)
        if end.code:
            end_together(comm, end.code if isinstance(end.code, int) else 1, end)
    except KeyboardInterrupt as end:
        if comm.rank == 0:
            print(f"{type(end).__name__}: {end}", file=sys.stderr)
        end_together(comm, 130, end)
    except BaseException:
        traceback.print_exc()
        end_together(comm, 1)


if __name__ == "__main__":
    main()
