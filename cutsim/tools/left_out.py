"""Faces of cracks that no tool can touch, where the tools of a problem might go into the body unresisted."""

from collections.abc import Sequence

import numpy as np
from dolfinx import la
from numpy.typing import NDArray

from cutsim.base.terms import Bonded, Term, offering
from cutsim.fields.faces import Face
from cutsim.fields.points import Surface
from cutsim.fields.state import State
from cutsim.tools.rigid_tool import RigidTool


def tell_left_out(state: State, terms: Sequence[Term]) -> None:
    """Tell tools which faces of cracks none of them can touch. Collective."""
    tools, cracks = offering(terms, RigidTool), offering(terms, Bonded)
    if not tools or not cracks:
        return
    topology, fdim = state.mesh.topology, state.mesh.topology.dim - 1
    facets = np.unique(np.concatenate([crack.interior for crack in cracks])).astype(np.int32)
    both = Face.joined(Face.both(state.mesh, facets[facets < topology.index_map(fdim).size_local]))
    touched = np.concatenate([patch.surface.entities for tool in tools for patch in tool.touched])
    cells = topology.index_map(fdim + 1)
    here = both.cells < cells.size_local
    left = np.flatnonzero(here & ~np.isin(_numbers(both.cells, both.local), _numbers(*touched.T)))
    # whoever owns a cell knows what is touched of it, and tells the ranks that hold it, whose facets belong to the mesh
    marks = la.vector(cells, dtype=np.int64)
    np.bitwise_or.at(marks.array, both.cells[left], 1 << both.local[left].astype(np.int64))
    marks.scatter_forward()
    if state.mesh.comm.allreduce(len(left)):
        faces = Surface.of(state, both.some(np.flatnonzero(marks.array[both.cells] >> both.local & 1)))
        for tool in tools:
            tool.leave_out(faces)


def _numbers(cells: NDArray[np.int32], local: NDArray[np.int32]) -> NDArray[np.int64]:
    """A number for each facet of a cell, of which no cell has more than eight."""
    return cells.astype(np.int64) * 8 + local
