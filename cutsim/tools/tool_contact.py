"""Contact of a rigid tool with outer surfaces and crack faces, with friction and reactions (docs/theory.md §4)."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import ufl

from cutsim.base.assembly import integrate, moment, nodal_forces, resultant
from cutsim.base.checks import positive, require, require_number
from cutsim.base.compat import EntityMaps, form
from cutsim.base.kinematics import Expr, cofactor, tangential
from cutsim.base.memory import Remembered
from cutsim.base.parameters import with_constants
from cutsim.base.signatures import checked
from cutsim.base.verdict import Verdict
from cutsim.bodies.machine import Machine
from cutsim.fields.points import Surface, Values
from cutsim.fields.sizes import facet_size, normal_size
from cutsim.fields.state import State
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.doubts import DEEP
from cutsim.interface.multiplier import ContactMultiplier
from cutsim.interface.rubbing import AnyFriction, Friction, Rubbing, check_friction, completed, hotter
from cutsim.interface.slip import SlipHistory
from cutsim.tools.carriage import Carriage
from cutsim.tools.driven_tool import DrivenContact
from cutsim.tools.passing import Passing
from cutsim.tools.rigid_tool import RigidTool
from cutsim.tools.shapes import Shape, ToolPath, check_directions, with_form_constants


@dataclass(frozen=True)
class ToolLaws:
    """Laws of the contact of a tool.

    Args:
        contact: Contact law.
        friction: Friction whose law has a tangential penalty, None for none.
        allowed_penetration: Largest mean penetration of a facet after augmentation [length]; None for no augmentation.
    """

    contact: PenaltyContact
    friction: Friction | None
    allowed_penetration: float | None = None


class Patch:
    """Contact of a rigid tool with one surface: gap, pressure, friction.

    Args:
        state: Displacement and time.
        name: Name of the tool.
        surface: The surface.
        shape: Signed distance of the tool.
        pose: Its present position and rotation.
        laws: Laws of the contact.
        temperature: Temperature of the tool.

    Attributes:
        surface: The surface.
        place: Position of its points in the frame of the tool [length].
        traction: Traction on the tool, with friction, in space [stress].
        thrust: Traction of the contact pressure on the tool in that frame, −p ∇d [stress].
        normal_size: Mean size of the cells normal to the surface [length].
        slip: Memory of friction, None without friction.
    """

    def __init__(
        self,
        state: State,
        name: str,
        surface: Surface,
        shape: Shape,
        pose: tuple[Expr, Expr],
        laws: ToolLaws,
        temperature: Expr,
    ) -> None:
        self.surface, points = surface, surface.points
        position, self._rotation = pose
        moved = ufl.SpatialCoordinate(state.mesh) + state.u - position
        self.place = ufl.transpose(self._rotation) * moved
        x, shape = ufl.variable(self.place), with_form_constants(state.mesh, shape)
        normal = ufl.diff(shape.distance(x), x)
        self._contact = with_constants(state.mesh, laws.contact)
        self._penetration = held = -shape.distance(self.place)
        self.normal_size = points.mean(normal_size(state.mesh, points.facets))
        self._multiplier: ContactMultiplier | None = None
        if laws.allowed_penetration is not None:
            allowed = laws.allowed_penetration
            self._multiplier = ContactMultiplier(state.memory, name, points, laws.contact, allowed)
            held = self._penetration + self._multiplier.shift
        self._pressure = self._contact.pressure(held)
        self.thrust = -self._pressure * normal
        self._facing = ufl.dot(_outward(state), self._rotation * normal)
        self.slip: SlipHistory | None = None
        if laws.friction is not None:
            body = laws.friction.temperature
            rubbing = Rubbing(
                self.place,  # it changes by the slip relative to the tool, which moves and turns
                self._pressure,
                held + self._contact.clearance,
                project=lambda slip: tangential(slip, normal),
                temperature=None if body is None else hotter(body.value, temperature),
            )
            self.slip = SlipHistory(state, name, points, laws.friction, rubbing)
        self._known: Remembered[dict[str, Values]] | None = None
        if self._multiplier is not None:
            start = {"work": np.zeros_like(points.weights), **self.contact()}
            self._known = state.memory.value(f"{name}: contact", start, places=points.places)

        self.traction = self._rotation * (self.thrust if self.slip is None else self.thrust + self.slip.traction)

    def virtual_work(self, v: Expr) -> ufl.Form:
        """Virtual work ∫ (t − p ∇d)·v: pressure and friction as they act on the tool."""
        return ufl.dot(self.traction, v) * self.surface.measure

    def energy(self) -> ufl.Form:
        """Energy of the contact penalty."""
        return self._contact.energy(self._penetration) * self.surface.measure

    def evaluate(self) -> None:
        """Slip of the trial state, and with a multiplier the work of the pressure on the penetration. Collective."""
        if self.slip is not None:
            self.slip.evaluate()
        if self._known is not None:
            now, old = self.contact(), self._known.committed
            mean = 0.5 * (now["pressure"] + old["pressure"])
            self._known.trial = {**now, "work": old["work"] + mean * (now["depth"] - old["depth"])}

    def work(self) -> float | None:
        """Work of the pressure on the penetration so far; None without multiplier [energy]. Collective."""
        return None if self._known is None else self.surface.points.integral(self._known.trial["work"])

    def augment(self) -> bool:
        """Improve multiplier and carried friction; True if one was off by more than is allowed. Collective."""
        now = self.contact()
        pressed = self._multiplier is not None and self._multiplier.augment(now["pressure"], now["depth"])
        return (self.slip is not None and self.slip.augment()) or pressed

    def penetration(self) -> float:
        """Largest depth of a point in the tool over the mesh size normal to the surface, < 0 outside. Collective."""
        return self.surface.points.maximum(self.contact()["depth"]) / self.normal_size

    @cached_property
    def _evaluate(self):  # type: ignore[no-untyped-def]
        return self.surface.points.evaluator(
            {"pressure": self._pressure, "depth": self._penetration, "facing": self._facing}
        )

    def contact(self) -> dict[str, Values]:
        """Present contact at the points. Collective.

        Returns:
            "pressure" [stress]; "depth" inside the tool [length]; "facing", the cosine between the normals of body and
            tool: −1 where they look at each other, > 0 where the tool would push the body outwards.
        """
        values: dict[str, Values] = self._evaluate()
        return values

    def pressure(self) -> Values:
        """Present contact pressure at the points [stress]. Collective."""
        return self.contact()["pressure"]

    def dissipation(self) -> Values:
        """Friction dissipation of the trial step at the points [energy per reference area]."""
        return np.zeros_like(self.surface.points.weights) if self.slip is None else self.slip.dissipation()


def _outward(state: State) -> Expr:
    """Current unit normal of the body on its surface."""
    N, gdim = ufl.FacetNormal(state.mesh), state.mesh.geometry.dim
    turned = cofactor(state.deformation_gradient(state.u)) * ufl.as_vector(
        [*(N[i] for i in range(gdim)), *[0] * (3 - gdim)]
    )
    normal = ufl.as_vector([turned[i] for i in range(gdim)])
    return normal / ufl.sqrt(ufl.dot(normal, normal))


class ToolContact(RigidTool):
    """Contact between a moving rigid tool and some surfaces of the body.

    Args:
        state: Displacement and time.
        shape: Signed distance of the tool.
        path: Motion of its reference point, and rotation about it.
        surfaces: Surfaces the tool can touch; each side of a crack by itself.
        contact: Contact law; the pressure acts per reference area.
        friction: Friction against the slip relative to the tool, a friction law, or the coefficient of Coulomb's, None
            for none.
        allowed_penetration: If given, the contact is augmented until the mean penetration of no facet that is pressed
            as a whole is larger [length].
        name: Name in messages and output.
        machines: What drives the tool along some axes, each one unknown; along these the path is that of the machine.
            Or the carriage that it shares with other tools.

    Attributes:
        patches: The tool on each surface.

    Raises:
        ValueError: No surface is given, path or shape have another dimension than the mesh, or the tool begins so deep
            in the body that it would come out on the far side.
    """

    @checked
    def __init__(
        self,
        state: State,
        shape: Shape,
        path: ToolPath,
        surfaces: Sequence[Surface],
        *,
        contact: PenaltyContact,
        friction: AnyFriction = None,
        allowed_penetration: float | None = None,
        name: str = "tool",
        machines: Sequence[Machine] | Carriage = (),
    ) -> None:
        check_friction("friction", friction)
        require_number("allowed_penetration", allowed_penetration, positive.or_none)
        super().__init__(state, path, name, machines)
        require("surfaces", len(surfaces), len(surfaces) > 0, "at least one surface")
        check_directions(shape, state.mesh.geometry.dim)
        self.shape, self.contact, self.friction = shape, contact, friction
        laws = ToolLaws(contact, completed(friction, contact.stiffness), allowed_penetration)
        self.symmetric = laws.friction is None
        pose = self.position, self.rotation
        if self.carriage is not None:  # forms that are differentiated by the pose name it
            pose = ufl.variable(self.position), ufl.variable(self.rotation)
        self.patches = tuple(Patch(state, name, s, shape, pose, laws, self.temperature) for s in surfaces)
        self._energy_form = form(sum((p.energy() for p in self.patches), start=ufl.Form([])))
        self._contact_form = form(self.residual(ufl.TestFunction(state.V)), entity_maps=self.entity_maps)
        if self.carriage is not None:
            part = DrivenContact(
                state,
                self.carriage.axes,
                lambda: self.move(1.0),
                pose=pose,
                constants=(self.position, self.rotation),
                touches=[(p.surface, p.traction, p.place) for p in self.patches],
                entity_maps=self.entity_maps,
            )
            self.carriage.border.add(part)
        self._left_out: Patch | None = None
        self._destroys = False
        self._passing = Passing(self, self.patches)
        self._doubt_resolution()

    def _doubt_resolution(self) -> None:
        """Doubt a tool whose smallest radius not even the smallest facet resolves. Collective."""
        radius, surfaces = self.shape.resolution, [p.surface.points for p in self.patches]
        smallest = min(-p.maximum(-facet_size(self.state.mesh, p.facets)) for p in surfaces)
        if smallest > (1 + 1e-6) * radius:
            words = f"facets of {smallest:.3g} do not resolve the tool's radius {radius:.3g}: use {radius:.3g} or less"
            self.state.verdict.doubt(f"{self.name}: radius", f"{self.name}: {words}")

    @property
    def entity_maps(self) -> EntityMaps:
        """Maps from facets of the mesh to the points of the surfaces."""
        return {mesh: cells for p in self.patches for mesh, cells in p.surface.points.entity_maps.items()}

    @property
    def touched(self) -> Sequence[Patch]:
        """The tool on each surface."""
        return self.patches

    @property
    def slips(self) -> Sequence[SlipHistory]:
        """Memory of friction of the surfaces."""
        return [p.slip for p in self.patches if p.slip is not None]

    def residual(self, v: Expr) -> ufl.Form:
        """Virtual work of pressure and friction on the body."""
        return sum((p.virtual_work(v) for p in self.patches), start=ufl.Form([]))

    def objection(self) -> str | None:
        """Whether the tool has passed through the surface of the body within the step, in words. Collective."""
        return self._passing.objection()

    def evaluate(self) -> None:
        """Contact forces, slip and friction work of the trial state. Collective."""
        comm, gdim = self.state.mesh.comm, self.state.mesh.geometry.dim
        forces = nodal_forces(self._contact_form)
        nodes = len(forces) // gdim
        arms = self.state.V.tabulate_dof_coordinates()[:nodes].copy()
        arms[:, :gdim] += self.state.u.x.array[: nodes * gdim].reshape(-1, gdim) - self.position.value
        self.act(resultant(comm, forces, gdim), moment(comm, forces, arms, gdim))
        for patch in self.patches:
            patch.evaluate()

    def augment(self) -> bool:
        """Improve multipliers and carried friction; True if the step has to be solved again. Collective."""
        # every patch takes part: a list, because any() would stop at the first
        return any([patch.augment() for patch in self.patches])

    @property
    def blend(self) -> float:
        """Blend of the contact over the smallest mesh size of a surface [–]."""
        return self.contact.blend / min(p.normal_size for p in self.patches)

    def penetration(self) -> float:
        """Largest depth of a point of the body in the tool over the mesh size, ≤ 0 if none is in it. Collective."""
        return max(p.penetration() for p in self.patches)

    @property
    def cushion(self) -> float:
        """Energy of the penalties beyond half the work of the pressure on the penetration, < 0 for a blend alone."""
        seen = [(p.surface.points, p.contact()) for p in self.patches]
        return integrate(self._energy_form) - 0.5 * sum(at.integral(now["pressure"] * now["depth"]) for at, now in seen)

    def leave_out(self, faces: Surface) -> None:
        """Note faces of cracks that no tool can touch, to look whether they come into this one. Collective."""
        if self._destroys:
            return
        laws, pose = ToolLaws(self.contact, None, None), (self.position, self.rotation)
        self._left_out = Patch(self.state, self.name, faces, self.shape, pose, laws, self.temperature)

    def destroys(self) -> None:
        """Say that a run is to be trusted also if faces that it cannot touch come into it, as it destroys them."""
        self._destroys = True

    def watch(self) -> None:
        """Doubt a tool that lies deep in the body, also where nothing resists it. Collective."""
        super().watch()
        depth = -np.inf if self._left_out is None else self._left_out.penetration()
        if depth > DEEP:
            self.state.verdict.doubt(
                f"{self.name}: left out",
                f"{self.name}: faces of cracks are in the tool by {depth:.2g} of the mesh size, unresisted: add them "
                "to its surfaces, such as 'crack+' and 'crack-'",
                depth,
            )

    def energies(self) -> dict[str, float]:
        """Energy of the contact penalties and friction work so far. Collective.

        What the pressure of a multiplier does beside the energy of the penalty is numerical; it vanishes with the
        penetration.
        """
        total = {"contact": integrate(self._energy_form), "friction": 0.0}
        works = [work for patch in self.patches if (work := patch.work()) is not None]
        if works:
            total["numerical"] = sum(works) - total["contact"]
        for slip in self.slips:
            for entry, value in slip.energies().items():
                total[entry] += value
        return total


def doubt_units(verdict: Verdict, name: str, shape: Shape, body: float) -> None:
    """Doubt a tool whose smallest radius is larger than the whole body.

    Args:
        verdict: Where to say so.
        name: Name of the tool.
        shape: The tool.
        body: Largest extent of the body [length].
    """
    if shape.resolution > body:
        verdict.doubt(
            f"{name}: size",
            f"{name}: the tool's radius {shape.resolution:.3g} is larger than the whole body, {body:.3g}: are both in "
            "the same units?",
        )
