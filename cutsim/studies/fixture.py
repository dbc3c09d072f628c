"""Fixture of a body while a tool is pushed into it, and the surface where the tool enters."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from dolfinx.mesh import compute_midpoints, locate_entities_boundary
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.base.checks import finite, require, require_number
from cutsim.base.parameters import TimeFunction
from cutsim.base.signatures import checked
from cutsim.base.units import Length
from cutsim.bodies.loads import Support
from cutsim.interface.rubbing import AnyFriction, check_friction
from cutsim.studies.body import CrackedBody
from cutsim.studies.frame import FLAT, Array, Facets, Frame
from cutsim.studies.plate import RestingPlate


@checked
@dataclass(frozen=True)
class Fixture:
    """Fixture: names of the groups of a mesh where the tool enters and where the body is held.

    The body lies on a smooth plate that holds it from below, against a push and a pull; or it rests on it in contact,
    may slide with friction and lift off, see `RestingPlate`. Where its ends are free it is also held across the crack
    plane along the line in which that meets the plate; in space, without plane of symmetry or walls, also along this
    line, in its middle. A body that is held at its ends may be cut through.

    Args:
        top: Facets of the surface beside the '−' and the '+' face of the crack; of a crack in a plane of symmetry only
            the second are used.
        plate: Facets on the plate, on the far side of the body.
        resting: Whether the body rests on the plate and may lift off; if not, the plate holds it.
        friction: Friction of a resting body on the plate, a law, or the coefficient of Coulomb's; None for none.
        symmetry: Facets in the plane of symmetry that halves body and tool; used if the mesh has this group.
        walls: Facets that are held along the edge of the tool: a body between two of them is in plane strain.
        ends: Facets at the far ends, one group on either side of the crack plane, which are held along its normal; they
            are free if there are none. In a body of revolution, or if the crack lies in a plane of symmetry, they are
            one group.
        drawn: Way by which each end is drawn outwards while the tool comes into the notch [length].
        thread: Cells of the thread in a body of revolution, which stays on the axis; not used with a blade, a ring.

    Raises:
        ValueError: Ends are to be drawn and there are none, or a body that does not rest on the plate is to rub on it.
    """

    top: tuple[str, str] = ("top_left", "top_right")
    plate: str = "bottom"
    resting: bool = False
    friction: AnyFriction = None
    symmetry: str = "symmetry"
    walls: tuple[str, ...] = ()
    ends: tuple[str, ...] = ()
    drawn: Length = 0.0
    thread: str = "left"

    def __post_init__(self) -> None:
        require_number("drawn", self.drawn, finite)
        require("drawn", self.drawn, not self.drawn or len(self.ends) > 0, "0 for a body with free ends")
        check_friction("friction", self.friction)
        require("friction", self.friction, self.resting or self.friction is None, "None unless resting = True")
        require("top", self.top, len(self.top) == 2, "the groups beside the '−' and the '+' face")

    def check(self, body: CrackedBody) -> None:
        """Refuse names that are no groups of the mesh.

        Raises:
            ValueError: With the name, and those that the mesh has.
        """
        for parameter, names in (
            ("top", self.tops(body)),
            ("plate", (self.plate,)),
            ("walls", self.walls),
            ("ends", self.ends),
        ):
            _facets(body, f"fixture.{parameter}", names)

    def tops(self, body: CrackedBody) -> tuple[str, ...]:
        """The surface beside the faces of the crack that are meshed."""
        return self.top[1:] if body.mirrored else self.top

    def halved(self, body: CrackedBody) -> bool:
        """Whether the mesh is that of a half, with a plane of symmetry."""
        return self.symmetry in body.domain.names

    def support(self, body: CrackedBody, frame: Frame) -> Support | RestingPlate:
        """The plate; its force on the body acts against the push. Collective."""
        facets = body.domain.facets(self.plate)
        if self.resting:
            return RestingPlate(body, facets, frame, self.friction)
        return _held(body, facets, -frame.push, name="plate")

    def supports(self, body: CrackedBody, frame: Frame, entry_time: float) -> list[Support]:
        """All that holds the body beside the plate. Collective."""
        domain, edge = body.domain, frame.edge
        parts = [self._end(body, frame, name, entry_time) for name in self.ends]
        if body.state.axisymmetric:
            if frame.origin[0] > FLAT * frame.height:  # the tool is a ring, and what it cuts out deforms
                return [*parts, Support(body.state, _axis(body, frame), 0, dim=0)]
            return [*parts, Support(body.state, domain.cells(self.thread), 0, dim=2)]
        line = _line(body, frame)
        if not self.ends:
            parts.append(_held(body, line, frame.normal, dim=0))
        if edge is None:
            return parts
        along = [*self.walls, *([self.symmetry] if self.halved(body) else [])]
        if not along:
            return [*parts, _held(body, _middle_of(body, line, frame, edge), edge, dim=0)]
        return parts + [_held(body, domain.facets(name), edge) for name in along]

    def _end(self, body: CrackedBody, frame: Frame, name: str, entry_time: float) -> Support:
        """A far end, drawn outwards at a constant speed, then held."""
        facets, drawn = body.domain.facets(name), self.drawn
        side = 1 if sum(frame.span(body.domain.mesh, facets, frame.normal)) > 0 else -1

        def way(time: float) -> float:
            return side * drawn * min(time / entry_time, 1.0)

        return _held(body, facets, frame.normal, way, corners=(entry_time,), name=name)


#: A body that stands on a plate, its sides free.
STANDING = Fixture()


def _held(
    body: CrackedBody, entities: NDArray[np.int32], direction: Array, value: float | TimeFunction = 0.0, **options: Any
) -> Support:
    return Support(body.state, entities, tuple(direction), value, **options)


def _facets(body: CrackedBody, parameter: str, names: Sequence[str]) -> Facets:
    """Facets of some groups, none without a name."""
    domain = body.domain
    known = [name for dim, name in domain.groups if dim == domain.mesh.topology.dim - 1]
    require(parameter, names, set(names) <= set(known), f"groups of facets of the mesh: {', '.join(known)}")
    return np.concatenate([np.empty(0, dtype=np.int32), *(domain.facets(name) for name in names)])


def _line(body: CrackedBody, frame: Frame) -> NDArray[np.int32]:
    """Vertices in which the crack plane meets the plate."""
    slack = FLAT * frame.height

    def on_line(x: Array) -> NDArray[np.bool_]:
        arms = x[: len(frame.origin)].T - frame.origin
        return (np.abs(arms @ frame.normal) <= slack) & (np.abs(arms @ frame.push - frame.height) <= slack)

    return np.asarray(locate_entities_boundary(body.domain.mesh, 0, on_line))


def _axis(body: CrackedBody, frame: Frame) -> NDArray[np.int32]:
    """Vertices on the axis of a body of revolution."""
    slack = FLAT * frame.height
    return np.asarray(locate_entities_boundary(body.domain.mesh, 0, lambda x: np.abs(x[0]) <= slack))


def _middle_of(body: CrackedBody, vertices: NDArray[np.int32], frame: Frame, edge: Array) -> NDArray[np.int32]:
    """The one of some vertices that is nearest to the tool along its edge. Collective."""
    mesh = body.domain.mesh
    arms = (compute_midpoints(mesh, 0, vertices).reshape(-1, 3) - frame.origin) @ edge
    # of two that are equally near the one ahead
    distances = np.round(np.abs(arms) / (FLAT * frame.height)) - 0.25 * np.sign(arms)
    nearest = mesh.comm.allreduce(float(distances.min(initial=np.inf)), MPI.MIN)
    return vertices[distances == nearest]
