"""Frame of a push: the point of entry, the direction of the push and that in which the crack opens."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from dolfinx.mesh import Mesh, compute_midpoints
from numpy.typing import NDArray

from cutsim.base.arrays import Array
from cutsim.base.checks import require
from cutsim.fields.sizes import global_range
from cutsim.fields.twins import facet_nodes
from cutsim.interface.crack import Crack
from cutsim.studies.body import CrackedBody
from cutsim.tools.insertable import Insertable

Facets = NDArray[np.int32]

#: Distance from a plane that is none, over the depth of the body: meshes come with six digits at times.
FLAT = 1e-6


@dataclass(frozen=True)
class Frame:
    """Frame of a push: a point of the surface and two orthogonal directions, with as many components as the mesh has.

    Everything that depends on how a body lies in space is asked of it.

    Attributes:
        origin: Where the tip enters: on the surface, in the plane of the crack; in space in the plane of symmetry or,
            without one, in the middle of the crack's mouth. In a body of revolution a needle enters on the axis, and a
            blade, which there is a ring, on the crack around it [length].
        push: Unit vector along which the tool is pushed.
        normal: Unit normal of the crack plane, on which the half of the tool with side +1 lies; of a body of revolution
            in its meridian plane.
        height: Depth of the body's far side [length].
    """

    origin: Array
    push: Array
    normal: Array
    height: float

    @property
    def edge(self) -> Array | None:
        """Unit vector along the edge of a blade, at right angles to the other two; None in the plane."""
        return np.cross(self.push, self.normal) if len(self.push) == 3 else None

    def point(self, depth: float, across: float = 0.0) -> Array:
        """A point by its depth and its distance from the crack plane [length]."""
        return self.origin + depth * self.push + across * self.normal

    def depth(self, point: Array) -> float:
        """Depth of a point below the surface [length]."""
        return float((point - self.origin) @ self.push)

    def span(self, mesh: Mesh, facets: Facets, direction: Array) -> tuple[float, float]:
        """How far some facets reach along a direction, from the origin [length]. Collective."""
        low, high = _span(mesh, facets, direction)
        offset = float(self.origin @ direction)
        return low - offset, high - offset

    def side(self, crack: Crack) -> int:
        """On which side of the crack plane the '+' face of a crack has its body: that of ±normal. Collective."""
        mesh, cells = crack.state.mesh, crack.face("+").cells
        arms = compute_midpoints(mesh, mesh.topology.dim, cells).reshape(-1, 3)[:, : len(self.normal)] - self.origin
        return 1 if mesh.comm.allreduce(float((arms @ self.normal).sum())) > 0 else -1

    @classmethod
    def of(cls, body: CrackedBody, tool: Insertable, far: str, symmetry: str | None = None) -> Self:
        """The frame of a body that a tool is to cut. Collective.

        Args:
            body: The body.
            tool: The whole tool, which knows the direction of the push and the normal of the crack plane.
            far: Group of facets on the far side of the body.
            symmetry: Group of facets in the plane of symmetry that halves the tool along its edge; None without one.

        Raises:
            ValueError: The tool points another way than from the surface to the far side, or its lateral direction is
                not normal to the crack.
        """
        mesh, facets = body.domain.mesh, body.slit
        push, normal = _directions(body, tool)
        top, deepest = _span(mesh, facets, push)[0], _span(mesh, body.domain.facets(far), push)[1]
        found = f"along which the crack begins at {top:g} and the group {far!r} lies at {deepest:g}"
        require("tool.push", tool.push, deepest > top, f"a direction from the surface into the body, not one {found}")
        slack, low, high = FLAT * (deepest - top), 0.0, 0.0
        if not on_axis(body, tool):
            low, high = _span(mesh, facets, normal)
            expected = f"{tool.halving}, which reaches from {low:g} to {high:g} along it"
            require("tool.lateral", tool.lateral, high - low <= slack, expected)
        origin = top * push + 0.5 * (low + high) * normal
        if mesh.geometry.dim == 3:
            edge = np.cross(push, normal)
            origin = origin + _middle(body, edge, symmetry, slack) * edge
        return cls(origin, push, normal, deepest - top)


def on_axis(body: CrackedBody, tool: Insertable) -> bool:
    """Whether the tool is a needle on the axis of a body of revolution, where a blade is a ring about the axis."""
    return body.state.axisymmetric and tool.round


def _directions(body: CrackedBody, tool: Insertable) -> tuple[Array, Array]:
    """Direction of the push and normal of the crack plane, of the mesh's dimension."""
    gdim = body.domain.mesh.geometry.dim
    require("tool.push", tool.push, len(tool.push) == gdim, f"a direction of {gdim} components, as the mesh has")
    push = np.array(tool.push)
    if body.state.axisymmetric:
        require("tool.push", tool.push, push[0] == 0, "along the axis x = 0 of the body of revolution")
    if on_axis(body, tool):  # the crack goes round it
        return push, np.array([1.0, 0.0])
    given = tool.normal is not None and len(tool.normal) == gdim
    require("tool.lateral", tool.normal, given, f"the normal of the crack plane, of {gdim} components")
    return push, np.array(tool.normal)


def _middle(body: CrackedBody, edge: Array, symmetry: str | None, slack: float) -> float:
    """Where the tool is along its edge: in the plane of symmetry, or in the middle of the mouth. Collective."""
    mesh, domain = body.domain.mesh, body.domain
    if symmetry is None:
        return float(np.mean(_span(mesh, body.mouth, edge)))
    low, high = _span(mesh, domain.facets(symmetry), edge)
    flat = f"facets in a plane along push and lateral of the tool, not ones between {low:g} and {high:g}"
    require("symmetry", symmetry, high - low <= slack, flat)
    return 0.5 * (low + high)


def _span(mesh: Mesh, facets: Facets, direction: Array) -> tuple[float, float]:
    x = mesh.geometry.x[facet_nodes(mesh, facets), : len(direction)]
    return global_range(mesh.comm, x @ direction)
