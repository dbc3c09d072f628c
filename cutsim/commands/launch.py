"""Start of Python on one or more MPI ranks: ``python -m cutsim.commands.launch``, which scripts/run calls.

This module alone knows which mpirun belongs to the MPI of mpi4py, and what the ranks need in their environment.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import FrameType

# how many ranks have been started here
_STARTED = "CUTSIM_RANKS"

USAGE = """Run a Python script or module of cutsim, on one or more MPI ranks of this machine.

  scripts/run [-n RANKS] script.py [arguments]
  scripts/run [-n RANKS] -m module [arguments]

Without -n: one rank per two cores. Where one rank fails, all end and the exit status is not zero."""

_SETTINGS = {
    # threads inside each rank only slow the ranks down
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "PYTHONUNBUFFERED": "1",
    # Open MPI: root in containers, shared memory only (one machine), and neither binding nor slot
    # counting, so that ranks share the cores with what else runs. Other MPIs ignore these.
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_btl": "self,sm",
    "OMPI_MCA_btl_base_warn_component_unused": "0",
    # A waiting rank gives its core away: three ranks on two cores are nine times faster for it.
    "OMPI_MCA_mpi_yield_when_idle": "1",
    "PRTE_MCA_rmaps_default_mapping_policy": ":oversubscribe",
    "PRTE_MCA_hwloc_default_binding_policy": "none",
    # MPICH, which the wheel of dolfinx comes with: the same; three ranks on two cores are four times faster.
    "MPIR_CVAR_CH4_PROGRESS_THROTTLE": "1",
    "MPIR_CVAR_CH4_PROGRESS_THROTTLE_NO_PROGRESS_COUNT": "64",
}


def environment() -> dict[str, str]:
    """Environment variables of a rank."""
    values = os.environ | _SETTINGS
    # For scripts that import dolfinx of the wheel before mpi4py has loaded its MPI.
    library = Path(sys.prefix, "lib")
    if (library / "libmpi.so").exists():
        values["LD_LIBRARY_PATH"] = os.pathsep.join(filter(None, (str(library), values.get("LD_LIBRARY_PATH"))))
    # PETSc is to leave signals to Python: without it a closed pipe or SIGTERM ends in a page of error messages.
    values["PETSC_OPTIONS"] = f"{values.get('PETSC_OPTIONS', '')} -no_signal_handler".lstrip()
    # With an empty HOME caches would lie below /, and without one the writers of ADIOS2 crash: take the account's.
    if not values.get("HOME"):
        values.pop("HOME", None)
        values["HOME"] = os.path.expanduser("~")
    # mpirun gives its first rank a terminal of its own even where the output goes to a file.
    if not sys.stdout.isatty():
        values["TTY_COMPATIBLE"] = "0"
    return values


def started() -> bool:
    """Whether this process is one of several ranks, started here or by the user's own mpirun."""
    return any(int(os.environ.get(name, 1)) > 1 for name in (_STARTED, "PMI_SIZE", "OMPI_COMM_WORLD_SIZE"))


def mpirun() -> Path:
    """The mpirun of mpi4py's MPI: in its environment with the wheel or conda, else beside the Python that has it.

    Raises:
        FileNotFoundError: There is none.
    """
    folders = [Path(sys.prefix, "bin"), Path(os.path.realpath(sys.executable)).parent]
    found = shutil.which("mpirun", path=os.pathsep.join(map(str, folders))) or shutil.which("mpirun")
    if found is None:
        raise FileNotFoundError(f"no mpirun in {', '.join(map(str, folders))}, nor on PATH: only one rank can run")
    return Path(found)


def run_on_ranks(arguments: Sequence[str], ranks: int) -> int:
    """Run Python on several ranks and wait for its end.

    Args:
        arguments: A script or ``-m`` and a module, and its own arguments.
        ranks: How many.

    Returns:
        Its exit status; that of an interrupted run if Ctrl-C or SIGTERM has ended it.
    """
    program = [sys.executable, "-m", "cutsim.commands.rank", *arguments]
    return _Job([str(mpirun()), "-n", str(ranks), *program], environment() | {_STARTED: str(ranks)}).wait()


class _Job:
    """A process of mpirun that ends well.

    On SIGINT or SIGTERM mpirun kills its ranks at once. So it is kept out of the terminal's reach and sent SIGUSR1
    instead, which it passes on; `cutsim.commands.rank` takes that as SIGTERM, and the run ends after its step. A second
    signal is final, and so is the end of this process: SIGTERM where mpirun then kills its ranks; MPICH's only passes
    that on, but its ranks are killed as soon as it is gone.
    """

    def __init__(self, command: Sequence[str], environment: Mapping[str, str]) -> None:
        version = subprocess.run([command[0], "--version"], capture_output=True, text=True, env=environment)
        hydra = version.stdout.startswith("HYDRA")
        self._final = signal.SIGKILL if hydra else signal.SIGTERM
        self._asked = 0
        tie = ["setpriv", "--pdeathsig", self._final.name.removeprefix("SIG")] if shutil.which("setpriv") else []
        self._process = subprocess.Popen(
            [*tie, *command], env=environment, stdin=subprocess.DEVNULL, start_new_session=True
        )
        self._previous = {number: signal.signal(number, self._ask) for number in (signal.SIGINT, signal.SIGTERM)}

    def wait(self) -> int:
        """Exit status, as a shell gives it."""
        try:
            status = self._process.wait()
        finally:
            for number, handler in self._previous.items():
                signal.signal(number, handler)
        status = status if status >= 0 else 128 - status
        return 128 + signal.SIGINT if status and self._asked else status

    def _ask(self, number: int, frame: FrameType | None) -> None:
        """Ask for the end; a second time, insist."""
        self._asked += 1
        self._process.send_signal(signal.SIGUSR1 if self._asked == 1 else self._final)


def main(arguments: Sequence[str]) -> int:
    """Run what the arguments of scripts/run say; its exit status."""
    ranks = str(max(1, len(os.sched_getaffinity(0)) // 2))
    if arguments[:1] == ["-n"]:
        ranks, arguments = "".join(arguments[1:2]), arguments[2:]
    if not ranks.isdecimal() or int(ranks) < 1:
        print(f"scripts/run: -n takes a number of ranks >= 1, not '{ranks}'", file=sys.stderr)
        return 2
    if not arguments:
        print(USAGE, file=sys.stderr)
        return 2
    if int(ranks) == 1:
        os.execve(sys.executable, [sys.executable, *arguments], environment())
    return run_on_ranks(arguments, int(ranks))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
