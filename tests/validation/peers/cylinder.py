"""NAFEMS CGS-1, a cylinder on a block, on one mesh for all programs: triangles of degree 2 with curved edges.

Plane strain, small strain, radius 50 mm, E = 210 and 70 GPa, ν = 0.3, no friction; the flat face of the cylinder is
lowered by 1.547 mm, which needs about 35 kN/mm.  The contact is a penalty of the same stiffness in all programs.  Each
program has points of its own on the contact: the largest pressure is that in one of them.
"""

from dataclasses import replace

import numpy as np
from dolfinx.mesh import Mesh

from cutsim.base.compat import geometry_nodes
from validation.hertz import CYLINDER

LINES = replace(CYLINDER, friction=0.0)


def centre(mesh: Mesh, cells: np.ndarray) -> int:
    """Node of the mesh where the block, of some cells, is touched first."""
    nodes = np.unique(geometry_nodes(mesh)[cells])
    return int(nodes[np.argmin(np.linalg.norm(mesh.geometry.x[nodes], axis=1))])
