"""Rigid tool whose surface consists of triangles, or of segments in 2-D (docs/theory.md §3.5, §4)."""

from collections.abc import Sequence

import basix
import numpy as np
import ufl
from numpy.typing import NDArray
from petsc4py import PETSc

from cutsim.base.assembly import add_blocks, moment
from cutsim.base.checks import positive, require, require_number
from cutsim.base.kinematics import Expr
from cutsim.base.memory import RememberedArray
from cutsim.base.signatures import checked
from cutsim.base.terms import Assembler
from cutsim.bodies.machine import Machine
from cutsim.fields.faces import Face
from cutsim.fields.points import Surface, Values
from cutsim.fields.sizes import facet_size, normal_size
from cutsim.fields.space import locate_dofs
from cutsim.fields.state import State
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.rubbing import AnyFriction, check_friction, completed
from cutsim.interface.slip import SlipHistory
from cutsim.pairs.outer_surface import OuterSurface, SlaveSurface
from cutsim.pairs.overlap import inside_surface
from cutsim.pairs.pair_forces import dofs_of
from cutsim.pairs.pair_law import PairLaws
from cutsim.pairs.pairing import Array, FacetShape, Indices
from cutsim.pairs.partners import CurrentPartners
from cutsim.pairs.surface_pass import SurfacePass, slave_points
from cutsim.tools.carriage import Carriage
from cutsim.tools.driven_triangles import DrivenAssembler
from cutsim.tools.rigid_tool import RigidTool
from cutsim.tools.shapes import ToolPath
from cutsim.tools.triangulation import Triangulation


class RigidSurface:
    """Triangulation that moves with a tool, as a master surface (`cutsim.pairs.outer_surface.Master`).

    Args:
        triangulation: The surface, relative to the reference point.
        pose: Position of the reference point and rotation about it; they are read whenever the surface is asked for.
    """

    def __init__(self, triangulation: Triangulation, pose: tuple[RememberedArray, RememberedArray]) -> None:
        kind = {2: basix.CellType.interval, 3: basix.CellType.triangle}[triangulation.points.shape[1]]
        self.shape = FacetShape(basix.create_element(basix.ElementFamily.P, kind, 1))
        self._corners, (self._position, self._rotation) = triangulation.corners, pose
        self.sides: Array = np.ones(len(self._corners))
        self.reference: Array = self._placed(start=True)
        self.global_nodes: Indices = np.full(triangulation.facets.shape, -1)
        self.pieces: Indices = np.full(len(triangulation.facets), -1)
        self.cuts: Indices = np.zeros(len(triangulation.facets), dtype=np.int64)

    def nodes(self, u: Array, *, start: bool) -> Array:
        """Current nodes of the facets, at the start or the end of the step, whatever the displacement."""
        return self._placed(start=start)

    def _placed(self, *, start: bool) -> Array:
        position, rotation = (p.committed if start else p.trial for p in (self._position, self._rotation))
        return np.asarray(self._corners @ rotation.T + position)

    def gather(self, values: Array) -> Array:
        """Zero: the surface has no unknowns."""
        return np.zeros_like(self._corners)

    def holds(self, points: Array, slave: OuterSurface) -> NDArray[np.bool_]:
        """Which points are in the tool at the start."""
        return inside_surface(points, self.reference)


class _Touch(SurfacePass):
    """Points of a body against a rigid surface, which has no nodes: the sparsity pattern never changes."""

    @property
    def pattern(self) -> int:
        """Always the same."""
        return 0

    def forget(self) -> None:
        """Find the partners anew: the rigid surface has moved."""
        self._seen = None

    @property
    def surface(self) -> Surface:
        """The surface of the body."""
        return Surface(self.points)

    def pressure(self) -> Values:
        """Contact pressure of the trial step at the points [stress]."""
        return self.history.trial["pressure"]

    def dissipation(self) -> Values:
        """Friction dissipation of the trial step at the points [energy per reference area]."""
        return np.zeros_like(self.points.weights) if self.slip is None else self.slip.dissipation()

    def add_pattern(self, A: PETSc.Mat) -> None:
        """Add zeros for all facets. Collective."""
        slave = self.kinematics.slave
        dofs = dofs_of(slave.global_nodes[slave.owned], slave.reference.shape[-1])
        add_blocks(A, dofs, np.zeros((*dofs.shape, dofs.shape[1])))


class TriangulatedTool(RigidTool):
    """Contact between a rigid tool of triangles and an outer surface of the body, or a face of a crack.

    The points of the body find the tool along their own normals, as in a pair of surfaces: the traction turns with the
    surface of the body and is continuous where points slide over the edges of the triangles.

    Args:
        state: Displacement, of degree 1 or 2, and time.
        facets: Local exterior facets that the tool can touch, ghosts included, or one face of a crack (`Crack.face`);
            a tool between both faces is two of these.
        surface: Surface of the tool relative to its reference point, the same on all ranks.
        path: Motion of the reference point, and rotation about it.
        contact: Contact law; the pressure acts per reference area.
        friction: Friction against the slip relative to the tool, a friction law, or the coefficient of Coulomb's, None
            for none.
        allowed_penetration: If given, the contact is augmented until the mean penetration of no facet that is pressed
            as a whole is larger [length].
        search: Largest distance of a partner, on either side, beyond what has moved in the step [length]; by
            default the mean size of the facets.
        name: Name in messages and output.
        machines: What drives the tool along some axes, each one unknown; along these the path is that of the machine.
            Or the carriage that it shares with other tools.

    Raises:
        ValueError: A parameter is outside its range, a machine turns the tool, or path or surface have another
            dimension than the mesh.
    """

    symmetric = False

    @checked
    def __init__(
        self,
        state: State,
        facets: NDArray[np.int32] | Face,
        surface: Triangulation,
        path: ToolPath,
        *,
        contact: PenaltyContact,
        friction: AnyFriction = None,
        allowed_penetration: float | None = None,
        search: float | None = None,
        name: str = "tool",
        machines: Sequence[Machine] | Carriage = (),
    ) -> None:
        check_friction("friction", friction)
        super().__init__(state, path, name, machines)
        gdim = state.mesh.geometry.dim
        require_number("search", search, positive.or_none)
        require_number("allowed_penetration", allowed_penetration, positive.or_none)
        require("surface", surface.points.shape, surface.points.shape[1] == gdim, f"of nodes of {gdim} components")
        face = facets if isinstance(facets, Face) else Face.outer(state.mesh, facets)
        points = slave_points(state, face, "facets")
        size = points.mean(facet_size(state.mesh, points.facets))
        master = RigidSurface(surface, (self._position, self._rotation))
        self.contact, self.surface = contact, surface
        self._normal_size = points.mean(normal_size(state.mesh, points.facets))
        slave = SlaveSurface(state.V, face, points)
        kinematics = CurrentPartners(state.memory, name, slave, master, search=search or size, size=size)
        laws = PairLaws(None, contact, completed(friction, contact.stiffness), allowed_penetration)
        self.touch = _Touch(state, name, points, (kinematics,), laws, weight=1.0, tool=self.temperature)
        if self.carriage is not None:
            nodes, axes = locate_dofs(state.V, gdim - 1, face.facets), self.carriage.axes
            part = DrivenAssembler(state, axes, lambda: self.move(1.0), contact=self.touch, nodes=nodes)
            self.carriage.border.add(part)

    @property
    def touched(self) -> Sequence[_Touch]:
        """The one surface of the body."""
        return (self.touch,)

    @property
    def slips(self) -> Sequence[SlipHistory]:
        """Memory of friction of the surface."""
        return [] if self.touch.slip is None else [self.touch.slip]

    def residual(self, v: Expr) -> ufl.Form:
        """No form: all forces are those of the contact."""
        return ufl.Form([])

    @property
    def assemblers(self) -> Sequence[Assembler]:
        """The contact."""
        return (self.touch,)

    def begin(self) -> None:
        """Move the tool; the slide of the step counts from the committed displacement."""
        super().begin()
        self.touch.begin()

    def move(self, fraction: float) -> None:
        """Move the tool to where it is after a fraction of the step: its partners are others."""
        super().move(fraction)
        self.touch.forget()

    def augment(self) -> bool:
        """Improve multiplier and carried friction; True if the step has to be solved again. Collective."""
        return self.touch.augment()

    def evaluate(self) -> None:
        """Trial history, force and moment of the step. Collective."""
        self.touch.evaluate()
        pairs, gdim = self.touch.partners(), self.state.mesh.geometry.dim
        points = pairs.hits.points
        arms = np.zeros((len(points), 3))
        arms[:, :gdim] = pairs.slave.x[points] + pairs.distance - self.position.value
        forces = -self.touch.point_forces()[points]
        self.act(-self.touch.force, moment(self.state.mesh.comm, forces.ravel(), arms, gdim))

    @property
    def blend(self) -> float:
        """Blend of the contact over the mesh size [–]."""
        return self.contact.blend / self._normal_size

    def penetration(self) -> float:
        """Largest depth of a point of the body in the tool over the mesh size, ≤ 0 if none is in it. Collective."""
        return self.touch.points.maximum(-self.touch.history.trial["opening"]) / self._normal_size

    def energies(self) -> dict[str, float]:
        """Energy of the contact penalty, friction work, and work of the pressure that neither holds. Collective."""
        return self.touch.energies()
