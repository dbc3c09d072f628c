"""Meshes of all formats that meshio reads: VTK, XDMF, Exodus, Nastran and others."""

import contextlib
import io
from collections.abc import Iterator
from pathlib import Path

import meshio
import numpy as np

from cutsim.readers.mesh_data import Block, Floats, Indices, MeshData, add_set
from cutsim.readers.shapes import dimension

# meshes of more cells than this have no group for each cell
_FEW = 100
# integers on cells that are no groups
_NO_GROUPS = ("gmsh:geometrical", "vtkGhostType", "vtkOriginalCellIds", "vtkOriginalPointIds")


def open_mesh(path: Path | str) -> meshio.Mesh:
    """Read a file by meshio.

    Raises:
        ValueError: It cannot be read.
    """
    words = io.StringIO()
    try:
        # meshio prints what is wrong and leaves the interpreter; it takes text for a large number first
        with np.errstate(over="ignore"), contextlib.redirect_stdout(words), contextlib.redirect_stderr(words):
            return meshio.read(path)
    except SystemExit:
        raise ValueError(" ".join(words.getvalue().split())) from None
    except Exception as error:  # readers raise whatever a broken file makes them
        raise ValueError(f"meshio cannot read it: {str(error) or type(error).__name__}") from error


def read_meshio(path: Path | str) -> MeshData:
    """Read a mesh by meshio.

    Sets of cells and of points are groups, and every value of integers on cells, such as ``medit:ref 3`` or, where the
    file names it, by its name.

    Raises:
        ValueError: The file cannot be read.
    """
    mesh = open_mesh(path)
    points: Floats = np.zeros((len(mesh.points), 3))
    points[:, : np.shape(mesh.points)[1]] = mesh.points
    shapes = [block.type for block in mesh.cells]
    top = max(map(dimension, shapes), default=0)
    starts = np.cumsum([0, *(len(block.data) for block in mesh.cells)])
    blocks = tuple(
        Block("", shape, shape, np.arange(start, start + len(block.data)), np.asarray(block.data, dtype=np.int64))
        for shape, block, start in zip(shapes, mesh.cells, starts, strict=False)
    )
    node_sets: dict[str, Indices] = {}
    cell_sets: dict[str, Indices] = {}
    for name, of_blocks in _groups(mesh):
        # what is lower in dimension than facets names its nodes
        for position, own in enumerate(of_blocks):
            if len(own) and dimension(shapes[position]) < top - 1:
                add_set(node_sets, name, blocks[position].nodes[own].ravel())
        members = [starts[i] + own for i, own in enumerate(of_blocks) if dimension(shapes[i]) >= top - 1]
        if any(map(len, members)):
            add_set(cell_sets, name, np.concatenate(members))
    for name, nodes in mesh.point_sets.items():
        add_set(node_sets, name.strip(), np.asarray(nodes, dtype=np.int64))
    return MeshData(points, np.arange(1, len(points) + 1), blocks, node_sets, cell_sets)


def _groups(mesh: meshio.Mesh) -> Iterator[tuple[str, list[Indices]]]:
    """Names of groups of cells, and the members of each in every block."""
    for name, members in mesh.cell_sets.items():
        yield name.strip(), [np.asarray([] if own is None else own, dtype=np.int64) for own in members]
    named = {(int(number), int(dim)): name for name, (number, dim) in _named(mesh)}
    for name, values in mesh.cell_data.items():
        arrays = [np.asarray(own) for own in values]
        if name in _NO_GROUPS or not all(own.dtype.kind in "iu" and own.ndim == 1 for own in arrays):
            continue
        found = np.unique(np.concatenate(arrays))
        if _FEW < sum(map(len, arrays)) == len(found):
            continue  # each cell has a number of its own
        for value in found:
            labels = [named.get((int(value), dimension(block.type)), f"{name} {value}") for block in mesh.cells]
            for label in dict.fromkeys(labels):
                own_label = [other == label for other in labels]
                yield label, [np.flatnonzero((own == value) & its) for own, its in zip(arrays, own_label, strict=True)]


def _named(mesh: meshio.Mesh) -> Iterator[tuple[str, tuple[int, int]]]:
    """Names that a file gives to values of integers on cells, and value and dimension."""
    for name, entry in mesh.field_data.items():
        if np.shape(entry) == (2,) and np.asarray(entry).dtype.kind in "iu":
            yield name.strip(), (int(entry[0]), int(entry[1]))
