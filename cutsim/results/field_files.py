"""Files of fields for ParaView: VTX by ADIOS2, or VTU."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from itertools import chain, count
from pathlib import Path
from typing import Literal, Self

from dolfinx import fem, has_adios2, io
from ufl.core.expr import Expr

from cutsim.base import compat
from cutsim.base.checks import require
from cutsim.results.output import Closing, on_root
from cutsim.results.vtu import VtuWriter

#: Formats of the files.
Format = Literal["vtx", "vtu"]

_TAKEN = ("displacement", "fields")
# bytes to be left on the disk, for what ADIOS2 writes beside the fields and when it closes its files
_RESERVE = 4_000_000

# ADIOS2, which writes the fields, looks for its settings there and does not survive if there is none
os.environ.setdefault("HOME", str(Path.home()))


class FieldWriter(Closing):
    """Writer of fields for ParaView, in the format "vtx" (ADIOS2) or "vtu". Collective.

    - ``displacement`` holds u as it is solved for. Its points are the nodes of the space, so a crack opens
      when the grid is warped by u.
    - ``fields`` holds the derived fields on a discontinuous linear space, with u beside them: the deformed
      body can be coloured by stress. For u of degree k expressions are sampled in degree k - 1, for a linear u in
      the middle of each cell, where stresses are most accurate and free of locking noise; a function, such as
      a temperature, is shown as it is.
    - Each entry of ``surfaces`` is a file of its own: a file has one mesh and one element.

    Files ``NAME.bp`` (VTX) are read by ParaView's ADIOS2VTXReader. The format "vtu" needs no ADIOS2, and pyvista
    and all other readers of VTK know it: a file ``NAME.pvd`` lists those of the times, ``NAME/000000.vtu`` and so on.

    Use it as a context manager. Files are readable up to the last step written, also after a crash.

    Args:
        directory: Where the files go; made if need be.
        u: The displacement, Lagrange of degree 1 or 2, on an ordinary or a cracked space.
        derived: Name -> UFL expression of a scalar, vector or tensor on the mesh of u; compiled once, here.
        surfaces: File name without suffix -> functions on one submesh of crack facets, of one element (DG 0
            or 1), known in the file by their own names.
        anew: Whether files that are there are replaced; else a .pvd goes on with the next time, but VTX files of the
            second part of a run are ``displacement_2.bp`` and so on, and of later parts ``displacement_3.bp``: nothing
            can be added to one that was closed.
        format: "vtx" or "vtu"; None for "vtx" where dolfinx has ADIOS2.

    Raises:
        ValueError: If a name is taken, or "vtx" is asked for without ADIOS2.
    """

    def __init__(
        self,
        directory: Path | str,
        u: fem.Function,
        derived: Mapping[str, Expr] | None = None,
        surfaces: Mapping[str, Sequence[fem.Function]] | None = None,
        *,
        anew: bool = True,
        format: Format | None = None,
    ) -> None:
        derived, surfaces = derived or {}, surfaces or {}
        chosen = format or ("vtx" if has_adios2 else "vtu")
        require("format", format, chosen in ("vtx", "vtu"), "'vtx', 'vtu' or None")
        require(
            "format", format, chosen == "vtu" or has_adios2, "'vtu': this dolfinx has no ADIOS2, which writes 'vtx'"
        )
        for name in surfaces:
            require("surfaces", name, name not in _TAKEN, f"a name other than {', '.join(_TAKEN)}")
        for name in derived:
            require("derived", name, name != u.name, "a name other than that of the displacement")
        self._derived = [_Derived.of(u, name, expression) for name, expression in derived.items()]
        if derived:
            self._derived.append(_Derived.of(u, u.name, u))
        groups = {"displacement": [u], "fields": [d.shown for d in self._derived], **surfaces}
        comm = u.function_space.mesh.comm
        on_root(comm, lambda: Path(directory).mkdir(parents=True, exist_ok=True))
        self._comm, self._directory = comm, Path(directory)
        self._bytes = comm.allreduce(sum(_bytes(f) for functions in groups.values() for f in functions))
        on_root(comm, self._check_space)
        self._stack = ExitStack()
        part = "" if anew or chosen == "vtu" else comm.bcast(_next_part(self._directory))
        self._writers: list[io.VTXWriter | VtuWriter] = []
        for stem, functions in groups.items():
            if functions and chosen == "vtu":
                self._writers.append(VtuWriter(self._directory / stem, functions, anew=anew))
            elif functions:
                writer = io.VTXWriter(comm, f"{directory}/{stem}{part}.bp", functions, engine="BP4")
                self._writers.append(self._stack.enter_context(writer))

    def write(self, time: float) -> None:
        """Evaluate the derived fields and write everything as the state at one time. Collective.

        Args:
            time: Time or load parameter, greater than that of the last call.

        Raises:
            OSError: There is no space for it, on all ranks.
        """
        on_root(self._comm, self._check_space)
        for field in self._derived:
            field.update()
        for writer in self._writers:
            writer.write(time)

    def _check_space(self) -> None:
        """ADIOS2 does not survive a full disk: it waits for ever or ends the process."""
        free = shutil.disk_usage(self._directory).free
        if free < self._bytes + _RESERVE:
            words = f"no space for the fields in {self._directory}: {free / 1e6:.3g} MB free, "
            raise OSError(errno.ENOSPC, words + f"{(self._bytes + _RESERVE) / 1e6:.3g} MB needed")

    def close(self) -> None:
        """Close the files. Collective; a second call does nothing."""
        self._stack.close()


def _next_part(folder: Path) -> str:
    """What distinguishes the files of the next part of a run."""
    parts = (f"_{number}" for number in count(2))
    return next(part for part in chain([""], parts) if not (folder / f"displacement{part}.bp").exists())


def _bytes(f: fem.Function) -> int:
    """Upper bound of what a file takes for a function of this rank at one time: three components, grid and ghosts."""
    cells, points = f.function_space.dofmap.list.shape
    return 8 * (cells * (points + 2) + 2 * 3 * (f.x.index_map.size_local + f.x.index_map.num_ghosts))


def interpolate(function: fem.Function, expression: Expr) -> None:
    """Interpolate a UFL expression, compiled with the project's options. Collective.

    Args:
        function: What is set, ghosts included.
        expression: UFL expression of the function's shape on its mesh.
    """
    function.interpolate(_compiled(function, expression))
    function.x.scatter_forward()


def _compiled(function: fem.Function, expression: Expr) -> fem.Expression:
    """The expression at the interpolation points of a function's space."""
    return compat.nodal_expression(expression, function.function_space)


@dataclass(frozen=True)
class _Derived:
    """A derived field, sampled where it is accurate and output on the discontinuous linear space."""

    source: fem.Expression | fem.Function
    sample: fem.Function
    shown: fem.Function

    @classmethod
    def of(cls, u: fem.Function, name: str, expression: Expr) -> Self:
        mesh, shape = u.function_space.mesh, expression.ufl_shape
        shown = fem.Function(fem.functionspace(mesh, ("DG", 1, shape)), name=name)
        if isinstance(expression, fem.Function):
            return cls(expression, shown, shown)
        degree = u.function_space.ufl_element().degree - 1
        sample = fem.Function(fem.functionspace(mesh, ("DG", degree, shape)))
        return cls(_compiled(sample, expression), sample, shown)

    def update(self) -> None:
        self.sample.interpolate(self.source)
        if self.shown is not self.sample:
            self.shown.interpolate(self.sample)
