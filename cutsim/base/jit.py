"""Just-in-time compilation of forms: the options of the C compiler, and the cache of compiled kernels."""

import fcntl
import hashlib
import os
import platform
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TextIO

from mpi4py import MPI


def _processor() -> str:
    """Short digest of the instruction set, so that a home shared by machines never serves foreign kernels."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.machine()
    features = next((line for line in lines if line.startswith(("flags", "Features"))), platform.machine())
    return hashlib.sha256(features.encode()).hexdigest()[:8]


#: Kernels are compiled for the processor at hand, so each kind of processor has its own cache.
CACHE_DIR = Path(os.getenv("XDG_CACHE_HOME", Path.home() / ".cache")) / "cutsim" / _processor()

#: Options of every kernel compilation. Against plain -O2 these take 0.6 times as long for the tangent of a hexahedron
#: at equal compile time. NaN must survive: a NaN residual is how an inverted element is recognised.
JIT_OPTIONS: dict[str, Any] = {
    "cffi_extra_compile_args": ["-O3", "-g0", "-march=native", "-ffast-math", "-fno-finite-math-only"],
    "cache_dir": str(CACHE_DIR),
    "timeout": 600,
}


# state of each cache directory (its time of change) in which nothing was found abandoned
_clean: dict[Path, int] = {}


@contextmanager
def jit_cache(comm: MPI.Comm, directory: Path = CACHE_DIR) -> Iterator[None]:
    """Share the kernel cache while compiling, having removed what a killed process left half built.

    A source file without its `.c.cached` mark makes the next compilation of the same form wait for a process
    that is gone. While nobody else is compiling, which the lock tells, such a file is known to be abandoned.

    Args:
        comm: Communicator of the compilation; only its rank 0 compiles, so only that rank takes the lock.
        directory: The cache.

    Raises:
        RuntimeError: On all ranks, if the cache cannot be written.
    """
    lock, problem = None, None
    if comm.rank == 0:
        try:
            directory.mkdir(parents=True, exist_ok=True)
            lock = open(directory / "lock", "w")  # unlocked when the file is closed, also when the process dies
        except OSError as error:
            problem = str(error)
    if (problem := comm.bcast(problem)) is not None:
        raise RuntimeError(
            f"compiled forms cannot be kept in {directory} ({problem}): set XDG_CACHE_HOME to another folder"
        )
    if lock is None:
        yield
        return
    with lock:
        if _clean.get(directory) != directory.stat().st_mtime_ns:
            _remove_abandoned(directory, lock)
        fcntl.flock(lock, fcntl.LOCK_SH)
        yield


def _remove_abandoned(directory: Path, lock: TextIO) -> None:
    """Remove half-built kernels unless somebody is compiling."""
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return
    for source in directory.glob("*.c"):
        if not source.with_suffix(".c.cached").exists():
            source.unlink(missing_ok=True)
    _clean[directory] = directory.stat().st_mtime_ns
