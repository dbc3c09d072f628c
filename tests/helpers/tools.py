"""Distances from tools, and tools that touch a block."""

import basix.ufl
import numpy as np
import ufl

from cutsim.interface.contact import PenaltyContact
from cutsim.interface.friction import SmoothCoulomb
from cutsim.tools.shapes import ToolPath
from cutsim.tools.tool_contact import ToolContact
from helpers.numeric import Numeric


def values(shape, points):
    """Distances and gradients at points, shape (n, dimension)."""
    n = len(points[0])
    cell = {2: "triangle", 3: "tetrahedron"}[n]
    x = ufl.variable(ufl.SpatialCoordinate(ufl.Mesh(basix.ufl.element("Lagrange", cell, 1, shape=(n,)))))
    distance, at = shape.distance(x), Numeric(points)
    return at(distance), at(ufl.diff(distance, x))


CONTACT = PenaltyContact(40.0, blend=0.02)
FRICTION = SmoothCoulomb(0.3, 0.01)


def touch(b, shape, place, surfaces, friction):
    """Contact with a tool that moved a little in the step."""
    before = np.array(place) + np.eye(len(place))[0] * 0.05
    path = ToolPath.polyline([0.0, 1.0], [before, place])
    tool = ToolContact(b.state, shape, path, surfaces, contact=CONTACT, friction=friction)
    b.state.begin(1.0)
    tool.begin()
    return tool
