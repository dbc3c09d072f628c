"""Just-in-time compilation of forms: the options of the C compiler, and the cache of compiled kernels."""

import fcntl
import functools
import hashlib
import os
import platform
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from importlib import metadata
from pathlib import Path
from typing import Any, TypeVar

from mpi4py import MPI

#: Options of every kernel compilation. The tangent of a blade's cut in 3-D is assembled in 10 ms, against 13 ms with
#: -O3 and 9 ms with -O2, and compiled in 2.5 s, against 7 s and 5 s; kernels of a body alone run equally fast.
#: NaN must survive: a NaN residual is how an inverted element is recognised.
C_OPTIONS = ["-O1", "-ftree-vectorize", "-g0", "-march=native", "-ffast-math", "-fno-finite-math-only"]


def _target() -> str:
    """Short digest of options and instruction set, so that a home shared by machines never serves foreign kernels."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    features = next((line for line in lines if line.startswith(("flags", "Features"))), platform.machine())
    return hashlib.sha256(" ".join([*C_OPTIONS, features]).encode()).hexdigest()[:8]


#: Kernels are compiled for the processor at hand, so each kind of processor has its own cache.
CACHE_DIR = Path(os.getenv("XDG_CACHE_HOME", Path.home() / ".cache")) / "cutsim" / _target()

#: Options of every compilation by dolfinx.
JIT_OPTIONS: dict[str, Any] = {"cffi_extra_compile_args": C_OPTIONS, "cache_dir": str(CACHE_DIR), "timeout": 20}

# how long another process may take for a form that is needed here too [s]
_PATIENCE = 600.0

T = TypeVar("T")

_seen = functools.cache(metadata.entry_points)


def compiled(comm: MPI.Comm, compile_: Callable[[], T], directory: Path = CACHE_DIR) -> T:
    """Compile in the cache of kernels, having removed what a killed process left half built. Collective.

    A source file without its `.c.cached` mark makes the next compilation of the same form wait for a process
    that may be gone. Whoever compiles keeps a file of its own locked meanwhile: a source that is older than all of
    these is nobody's. As long as it could be somebody's, the wait is repeated.

    Args:
        comm: Communicator of the compilation; only its rank 0 compiles.
        compile_: Calls dolfinx' compiler, with `JIT_OPTIONS`.
        directory: The cache.

    Returns:
        What `compile_` returns.

    Raises:
        RuntimeError: On all ranks, if the cache cannot be written or the compilation fails.
    """
    began = time.monotonic()
    while True:
        try:
            with _compiling(comm, directory), _packages_seen_once():
                return compile_()
        except (RuntimeError, TimeoutError) as error:
            again = "compilation timed out" in str(error) and time.monotonic() - began < _PATIENCE
            if not comm.bcast(again):  # rank 0 is the one that has waited and knows why
                raise


@contextmanager
def _packages_seen_once() -> Iterator[None]:
    """For each kernel setuptools, which calls the C compiler, looks through all installed packages six times."""
    look = metadata.entry_points
    metadata.entry_points = _seen  # type: ignore[assignment]
    try:
        yield
    finally:
        metadata.entry_points = look


@contextmanager
def _compiling(comm: MPI.Comm, directory: Path) -> Iterator[None]:
    """Remove what nobody compiles any more, and tell other processes that this one compiles."""
    mine, problem = None, None
    if comm.rank == 0:
        marks = directory / "compiling"
        try:
            marks.mkdir(parents=True, exist_ok=True)
            _remove_abandoned(directory, marks)
            mine = _mark(marks)
        except OSError as error:
            problem = str(error)
    if (problem := comm.bcast(problem)) is not None:
        raise RuntimeError(
            f"compiled forms cannot be kept in {directory} ({problem}): set XDG_CACHE_HOME to another folder"
        )
    if mine is None:
        yield
        return
    with mine:  # the file is unlocked when it is closed, also when the process dies
        yield


def _mark(marks: Path) -> Any:
    """A new file, locked, that vanishes when it is closed."""
    while True:
        mark = tempfile.NamedTemporaryFile(dir=marks)
        fcntl.flock(mark, fcntl.LOCK_EX)
        if Path(mark.name).exists():
            return mark
        with suppress(FileNotFoundError):  # another process took it for one left behind, before it was locked
            mark.close()


def _oldest(marks: Path) -> float:
    """Time at which the first of those that compile now has begun [s]; infinite if there is none."""
    times = [float("inf")]
    for path in marks.iterdir():
        with suppress(FileNotFoundError), open(path) as mark:
            try:
                fcntl.flock(mark, fcntl.LOCK_EX | fcntl.LOCK_NB)
                path.unlink()
            except BlockingIOError:
                times.append(path.stat().st_mtime)
    return min(times)


def _remove_abandoned(directory: Path, marks: Path) -> None:
    """Remove the half-built kernels that nobody can be compiling."""
    # the names are read before the marks: whoever began one of these sources is marked by now, or has ended
    names = set(os.listdir(directory))
    half = [directory / name for name in names if name.endswith(".c") and f"{name}.cached" not in names]
    oldest = _oldest(marks) if half else 0.0
    for source in half:
        with suppress(FileNotFoundError):
            if source.stat().st_mtime < oldest and not source.with_suffix(".c.cached").exists():
                source.unlink()
