"""``cutsim doctor``: what is installed, and whether it computes what is known."""

from __future__ import annotations

import json
import os
import platform
import shutil
import subprocess
import sys
from importlib import metadata
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

import cutsim
from cutsim.commands import launch
from cutsim.commands.endings import Ending
from cutsim.commands.options import console, table

EXAMPLES = ("cutsim doctor", "cutsim doctor --no-test")
_DISTRIBUTIONS = ("numpy", "scipy", "gmsh", "meshio", "pyvista", "h5py", "matplotlib", "plotly", "imageio-ffmpeg")
#: What can only be known by loading it, which a broken installation may not survive: each in a process of its own.
_PROBES = {
    "dolfinx": "from mpi4py import MPI; import dolfinx; print(dolfinx.__version__, end='')\n"
    "print(', with ADIOS2' if dolfinx.has_adios2 else ', without ADIOS2: fields are written as VTU')",
    "PETSc": "from cutsim.base.versions import petsc_version; print(petsc_version(), end='')\n"
    "from petsc4py import PETSc; double = PETSc.ScalarType is float or PETSc.ScalarType(0).dtype == 'f8'\n"
    "print('' if double else ', not in double precision')",
    "MPI": "from cutsim.base.versions import mpi_version; print(mpi_version())",
    "pictures": "import ctypes; ctypes.CDLL('libEGL.so.1')\n"
    "import pyvista; p = pyvista.Plotter(off_screen=True, window_size=(32, 32)); p.add_mesh(pyvista.Sphere())\n"
    "p.screenshot(return_img=True); print('drawn off screen')",
}
_PEAK, _ENERGY, _TOLERANCE = 1.0, 0.1, 0.01


def command(
    test: Annotated[bool, typer.Option("--test/--no-test", help="Solve a problem whose answer is known.")] = True,
) -> None:
    """Show what is installed, and solve a problem whose answer is known on one rank and on two."""
    screen = console()
    screen.print(table(("what", "found"), list({**_python(), **_libraries(), **_machine()}.items())))
    if not test:
        return
    screen.print("\nTwo blocks that are glued are pulled apart:")
    passed = [_tested(screen, ranks) for ranks in (1, 2)]
    if not all(passed):
        raise typer.Exit(Ending.QUESTIONABLE)


def _python() -> dict[str, str]:
    return {
        "cutsim": f"{cutsim.__version__} in {Path(cutsim.__file__).parent}",
        "Python": f"{platform.python_version()} in {sys.prefix}",
    }


def _libraries() -> dict[str, str]:
    started = {name: _start([sys.executable, "-c", code]) for name, code in _PROBES.items()}
    found = {name: _said(process) for name, process in started.items()}
    pictures = found.pop("pictures")
    return {**found, "mpirun": _mpirun(), **{name: _version(name) for name in _DISTRIBUTIONS}, "pictures": pictures}


def _machine() -> dict[str, str]:
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    writable = os.access(cache if cache.exists() else cache.parent, os.W_OK)
    return {
        "C compiler": shutil.which(os.environ.get("CC", "cc")) or shutil.which("gcc") or "MISSING: none found",
        "kernels": f"compiled into {cache}" if writable else f"MISSING: {cache} cannot be written",
        "cores": str(os.cpu_count()),
    }


def _mpirun() -> str:
    try:
        return str(launch.mpirun())
    except FileNotFoundError as error:
        return f"MISSING: {error}"


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "MISSING"


def _start(command: list[str]) -> subprocess.Popen[str]:
    return subprocess.Popen(command, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE)


def _said(process: subprocess.Popen[str]) -> str:
    """What a probe has printed, or the last line of what was wrong."""
    words, trouble = process.communicate()
    if process.returncode == 0:
        return words.strip()
    return f"MISSING: {(trouble.strip().splitlines() or [f'exit status {process.returncode}'])[-1]}"


def _tested(screen: Console, ranks: int) -> bool:
    """Whether the self-test gives what is known."""
    try:
        words = _said(
            _start(
                [sys.executable, "-m", "cutsim.commands.launch", "-n", str(ranks), "-m", "cutsim.commands.self_test"]
            )
        )
        result = json.loads(words.splitlines()[-1])
        errors = result["peak"] / _PEAK - 1, result["energy"] / _ENERGY - 1
    except (ValueError, IndexError):
        screen.print(f"  {ranks} rank(s): FAILED: {words}", markup=False)
        return False
    passed = result["ranks"] == ranks and all(abs(error) < _TOLERANCE for error in errors)
    screen.print(
        f"  {ranks} rank(s): {'passed' if passed else 'FAILED'}: peak of the force {errors[0]:+.2%},"
        f" energy of the new surface {errors[1]:+.2%} off what is known",
        markup=False,
    )
    return passed
