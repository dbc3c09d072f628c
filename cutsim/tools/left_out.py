"""Faces of cracks that no tool can touch, where the tools of a problem might go into the body unresisted."""

from collections.abc import Sequence

import numpy as np
from dolfinx import la

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
    # whoever owns a cell knows which of its facets are touched, a bit each, and tells the ranks that hold it
    touched = la.vector(topology.index_map(fdim + 1), dtype=np.int64)
    for tool in tools:
        for patch in tool.touched:
            of_cells, local = patch.surface.entities.T
            np.bitwise_or.at(touched.array, of_cells, 1 << local.astype(np.int64))
    touched.scatter_forward()
    left = np.flatnonzero(touched.array[both.cells] >> both.local & 1 == 0)
    if state.mesh.comm.allreduce(len(left)):
        faces = Surface.of(state, both.some(left))
        for tool in tools:
            tool.leave_out(faces)
