"""Fields as files of VTK: a .vtu file for each time, and a .pvd file that lists them."""

from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

import meshio
import numpy as np
from dolfinx import fem
from numpy.typing import NDArray

from cutsim.base.compat import geometry_nodes
from cutsim.base.files import replace_file
from cutsim.readers.shapes import in_order_of_vtk
from cutsim.results.output import on_root


class VtuWriter:
    """Writer of functions of one space, one file a time, written by the first rank. Collective.

    A file is there whole or not at all, and the list of files names whole ones only, so that it can be read at any
    moment, also after a crash.

    Args:
        path: The list without its ending, ``NAME`` for ``NAME.pvd``; the files go to the folder ``NAME``.
        functions: Functions of one element, Lagrange of degree 1 or 2 or constant on each cell, known in the files by
            their names; vectors of two components get a third one, which is zero.
        anew: Whether files that are there are removed; else the list goes on, and times that it has from the first new
            one on are written again.
    """

    def __init__(self, path: Path, functions: Sequence[fem.Function], *, anew: bool = True) -> None:
        self._folder, self._list, self._functions = path, path.with_name(f"{path.name}.pvd"), functions
        space = functions[0].function_space
        self._comm, dofmap = space.mesh.comm, space.dofmap
        owned = space.mesh.topology.index_map(space.mesh.topology.dim).size_local
        self._constant = dofmap.dof_layout.num_dofs == 1
        if self._constant:
            grid = space.mesh.geometry.index_map(), geometry_nodes(space.mesh), space.mesh.geometry.x
        else:
            grid = dofmap.index_map, dofmap.list, space.tabulate_dof_coordinates()
        nodes, table, points = grid
        self._rows = dofmap.list[:owned, 0] if self._constant else np.arange(nodes.size_local)
        kind, rows = in_order_of_vtk(space.mesh.topology.cell_name(), table[:owned])
        cells = nodes.local_to_global(rows.ravel()).reshape(rows.shape)
        parts = self._comm.gather((points[: nodes.size_local], cells))
        self._mesh: meshio.Mesh | None = None
        if parts is not None:
            points, cells = (np.concatenate([part[i] for part in parts]) for i in (0, 1))
            self._mesh = meshio.Mesh(points, {kind: cells})
        self._times: list[tuple[float, str]] = []
        on_root(self._comm, lambda: self._open(anew))

    def write(self, time: float) -> None:
        """Write the functions as they are at one time. Collective.

        Args:
            time: The time, greater than that of the last call.

        Raises:
            OSError: The file cannot be written, on all ranks.
        """
        own = [f.x.array.reshape(-1, f.function_space.dofmap.bs)[self._rows] for f in self._functions]
        parts = self._comm.gather(own)
        values = {} if parts is None else {
            function.name: _padded(np.concatenate([part[i] for part in parts]), len(function.ufl_shape))
            for i, function in enumerate(self._functions)
        }  # fmt: skip
        on_root(self._comm, lambda: self._save(time, values))

    def _open(self, anew: bool) -> None:
        self._folder.mkdir(parents=True, exist_ok=True)
        if anew:
            self._list.unlink(missing_ok=True)
            for file in self._folder.glob("*.vtu"):
                file.unlink()
        elif self._list.exists():
            entries = ElementTree.parse(self._list).getroot().iter("DataSet")
            self._times = [(float(entry.attrib["timestep"]), entry.attrib["file"]) for entry in entries]

    def _save(self, time: float, values: dict[str, NDArray[np.float64]]) -> None:
        assert self._mesh is not None
        self._times = [entry for entry in self._times if entry[0] < time]
        file = self._folder / f"{len(self._times):06}.vtu"
        if self._constant:
            self._mesh.cell_data = {name: [rows] for name, rows in values.items()}
        else:
            self._mesh.point_data = values
        draft = file.with_suffix(".part")
        try:
            self._mesh.write(draft, file_format="vtu")
            draft.replace(file)
        finally:
            draft.unlink(missing_ok=True)
        self._times.append((time, f"{self._folder.name}/{file.name}"))
        replace_file(self._list, _listed(self._times))


def _padded(rows: NDArray[np.float64], rank: int) -> NDArray[np.float64]:
    """Scalars as they are, vectors with three components, tensors with nine."""
    if rank == 0:
        return rows[:, 0]
    size = round(rows.shape[1] ** (1 / rank))
    full = np.zeros((len(rows), *(3,) * rank))
    full[(slice(None), *(slice(size),) * rank)] = rows.reshape(-1, *(size,) * rank)
    return full.reshape(len(rows), -1)


def _listed(times: Sequence[tuple[float, str]]) -> bytes:
    """The list of files with their times."""
    root = ElementTree.Element("VTKFile", type="Collection", version="0.1", byte_order="LittleEndian")
    collection = ElementTree.SubElement(root, "Collection")
    for time, file in times:
        ElementTree.SubElement(collection, "DataSet", timestep=repr(time), group="", part="0", file=file)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)
