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
    topology = state.mesh.topology
    faces = Face.joined([face for crack in cracks for face in crack.meshed])
    # whoever owns a cell knows which of its facets are touched, a bit each, and tells the ranks that hold it
    touched = la.vector(topology.index_map(topology.dim), dtype=np.int64)
    for tool in tools:
        for patch in tool.touched:
            of_cells, local = patch.surface.entities.T
            np.bitwise_or.at(touched.array, of_cells, 1 << local.astype(np.int64))
    touched.scatter_forward()
    left = np.flatnonzero(touched.array[faces.cells] >> faces.local & 1 == 0)
    if state.mesh.comm.allreduce(len(left)):
        surface = Surface.of(state, faces.some(left))
        for tool in tools:
            tool.leave_out(surface)
