"""File with the committed state of a problem, from which it goes on in another process on any number of ranks.

It is HDF5, written by the first rank: a header and the remembered values as JSON, and their arrays in the order of
numbers that do not depend on the ranks (`cutsim.base.places`).
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from dolfinx.mesh import Mesh
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.analysis.checkpoint import load, save
from cutsim.analysis.steps import Problem
from cutsim.base.files import replace_file
from cutsim.base.memory import Snapshot
from cutsim.base.packing import pack, unpack
from cutsim.base.places import Places, corners
from cutsim.results.output import on_root

#: Version of the format.
FORMAT = 1
#: What the names of quantities that recorders remember begin with: they may be registered later.
RECORDERS = "recording: "
_KIND = "cutsim checkpoint"

Array = NDArray[Any]


class CheckpointError(ValueError):
    """Raised on all ranks when a checkpoint is not one of this problem; says what differs. Nothing is changed then."""


@dataclass(frozen=True)
class Header:
    """Header of a checkpoint.

    Attributes:
        case: Name → value of what tells the problem from others.
        mesh: Its numbers of cells and nodes, and a digest of both.
        time: Time of the state [time].
        step: Number of the last step.
        format: Version of the format.
    """

    case: Mapping[str, Any]
    mesh: Mapping[str, Any]
    time: float
    step: int
    format: int = FORMAT

    def check(self, problem: "Header") -> None:
        """Refuse the checkpoint of another case or mesh.

        Raises:
            CheckpointError: They differ; names what does.
        """
        for kind in ("case", "mesh"):
            mine, its = getattr(self, kind), getattr(problem, kind)
            for name in dict.fromkeys((*mine, *its)):
                if mine.get(name) != its.get(name):
                    words = f"{kind}: {name} = {mine.get(name)!r} in place of {its.get(name)!r}"
                    raise CheckpointError(f"it is of another {words}")


def header(problem: Problem, case: Mapping[str, Any]) -> Header:
    """Header of a checkpoint of the present state. Collective."""
    state = problem.state
    plain = json.loads(json.dumps(dict(case), default=str))
    return Header(plain, mesh_digest(state.mesh), state.time_old, state.number)


def write_checkpoint(path: Path, problem: Problem, case: Mapping[str, Any]) -> None:
    """Write the committed state. Collective.

    Solvers forget what they have factorised: the run goes on as one that starts from the file does.

    Args:
        path: The file, which is replaced in one go; its folder exists.
        problem: The problem.
        case: Name → value of what tells the problem from others.

    Raises:
        OSError: It cannot be written, on all ranks; an older file of this name is as it was.
        TypeError: A value that is remembered is no plain data, or its arrays belong to places that were not named.
    """
    snapshot, quantities, comm = save(problem), problem.state.memory.quantities, problem.state.mesh.comm
    arrays: list[Array | None] = []

    def store(array: Array, places: Places | None) -> int:
        arrays.append(_common(array, comm) if places is None else places.gather(array))
        return len(arrays) - 1

    values = {}
    for name, value in snapshot.values.items():
        try:
            values[name] = pack(value, quantities[name].places, store)
        except TypeError as error:
            raise TypeError(f"{name} cannot be written: {error}") from error
    head = asdict(header(problem, case))
    on_root(comm, lambda: replace_file(path, _file(head, values, arrays)))


def _common(array: Array, comm: MPI.Comm) -> Array:
    """An array that is the same on all ranks. Collective."""
    shapes = set(comm.allgather(array.shape))
    if len(shapes) > 1:
        raise TypeError(f"its arrays have the shapes {sorted(shapes)} on the ranks; register it with places=")
    return array


def read_checkpoint(path: Path, problem: Problem, case: Mapping[str, Any]) -> None:
    """Bring a problem, which was built as the one that was saved, to the state in a file. Collective.

    Args:
        path: The file.
        problem: The problem.
        case: As it was written.

    Raises:
        CheckpointError: It is the file of another case, mesh, problem or version.
        OSError: It cannot be read.
    """
    comm: MPI.Comm = problem.state.mesh.comm
    content = _Content({}, {}, [])

    def read() -> None:
        nonlocal content
        content = _content(path)

    on_root(comm, read)
    head, values = comm.bcast((content.header, content.values))
    try:
        Header(**head).check(header(problem, case))
        load(problem, Snapshot(_spread(values, content.arrays, problem)))
    except (ValueError, LookupError, AttributeError) as error:
        raise CheckpointError(f"{path} is not a checkpoint of this problem: {error}") from error


def _spread(values: Mapping[str, Any], arrays: list[Array], problem: Problem) -> dict[str, Any]:
    """The remembered values of this rank, from arrays that are whole on the first one. Collective."""
    comm, quantities = problem.state.mesh.comm, problem.state.memory.quantities
    if strange := [name for name in values if name not in quantities and not name.startswith(RECORDERS)]:
        raise ValueError(f"it has {', '.join(strange)}, which the problem has not")

    def fetch(number: int, places: Places | None) -> Array:
        whole = arrays[number] if comm.rank == 0 else None
        return np.asarray(comm.bcast(whole) if places is None else places.scatter(whole))

    spread = {}
    for name, value in values.items():
        try:
            spread[name] = unpack(value, quantities[name].places if name in quantities else None, fetch)
        except ValueError as error:
            raise ValueError(f"{name}: {error}") from error
    return spread


@dataclass(frozen=True)
class _Content:
    """Content of a file: header, values as JSON, and their arrays."""

    header: Mapping[str, Any]
    values: Mapping[str, Any]
    arrays: list[Array]


def _file(head: Mapping[str, Any], values: Mapping[str, Any], arrays: list[Array | None]) -> bytes:
    """The file: it is made in memory, as HDF5 does not survive a full disk."""
    buffer = BytesIO()
    with h5py.File(buffer, "w") as file:
        file.attrs["kind"] = _KIND
        for name, part in (("header", head), ("values", values)):
            file[name] = json.dumps(part)
        for number, array in enumerate(arrays):
            file[f"arrays/{number}"] = array
    return buffer.getvalue()


def _content(path: Path) -> _Content:
    """Read a file."""
    with h5py.File(path, "r") as file:
        if file.attrs.get("kind") != _KIND:
            raise CheckpointError(f"{path} is no checkpoint")
        head, values = (json.loads(file[name].asstr()[()]) for name in ("header", "values"))
        if head["format"] != FORMAT:
            raise CheckpointError(f"{path} has the format {head['format']}; this version of cutsim reads {FORMAT}")
        numbers = range(len(file["arrays"]))
        return _Content(head, values, [file[f"arrays/{number}"][()] for number in numbers])


def mesh_digest(mesh: Mesh) -> dict[str, Any]:
    """Numbers of cells and nodes of a mesh, and a digest of its positions and cells. Collective."""
    topology, geometry, comm = mesh.topology, mesh.geometry, mesh.comm
    cells, nodes = topology.index_map(topology.dim).size_local, geometry.index_map().size_local
    keys, _ = corners(mesh, np.arange(cells, dtype=np.int32))
    parts = comm.gather((keys, geometry.input_global_indices[:nodes], geometry.x[:nodes]))
    digest = None
    if parts is not None:
        keys, numbers, x = (np.concatenate(part) for part in zip(*parts, strict=True))
        ordered = keys[np.lexsort(keys.T)], x[np.argsort(numbers)]
        text = sha256(b"".join(np.ascontiguousarray(array).tobytes() for array in ordered)).hexdigest()
        digest = {"cells": len(keys), "nodes": len(x), "digest": text[:16]}
    return dict(comm.bcast(digest))
