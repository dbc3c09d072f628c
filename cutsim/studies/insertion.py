"""Insertion of a blade or a needle into a body along a predefined crack (docs/needle_insertion.md).

The body may be one solid or have layers; it may lie in space in any way.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal, Self

import numpy as np

from cutsim.analysis.mechanics import Mechanics
from cutsim.base.checks import above, nonnegative, require, require_number
from cutsim.base.signatures import checked
from cutsim.bodies.loads import Support
from cutsim.bodies.machine import Machine
from cutsim.fields.points import DEGREE, Surface
from cutsim.fields.state import State
from cutsim.interface.crack import Crack
from cutsim.interface.rubbing import AnyFriction, check_friction, completed
from cutsim.results.recording import Columns
from cutsim.studies.body import CrackedBody
from cutsim.studies.cut_area import CutArea
from cutsim.studies.drive import Drive, Motion
from cutsim.studies.fixture import STANDING, Fixture
from cutsim.studies.frame import Frame, on_axis
from cutsim.studies.plate import RestingPlate
from cutsim.tools.carriage import Carriage
from cutsim.tools.insertable import Insertable
from cutsim.tools.tool_contact import ToolContact, doubt_units
from cutsim.tools.tool_parts import PARTS, ToolParts

_WIDEST = 1.0472  # π/3 and a little
# of the quadrature of a contact that is not firm: the edge of the tool may be as small as a facet, and would catch on
# fewer points; a firm contact would need twice the time for it
_DEGREE = 8
#: Name of a half of the tool by its side.
_SIDES = {1: "right", -1: "left"}


@dataclass(frozen=True)
class Insertion:
    """Insertion of a blade or a needle into a body along its crack.

    The tool moves along its direction `push`, and is halved in the plane of the crack, whose normal is its direction
    `lateral`: each face of the crack meets a half.  In a body of revolution the face around the thread meets the whole
    needle, whose tip destroys the thread; a blade is a ring there, each half of which meets a face of the crack around
    the axis.

    Attributes:
        body: Solids, crack and notch.
        tool: The whole tool.
        frame: Where the tool enters, which way it goes, which way the crack opens.
        motion: Its depths and times.
        contacts: The tool as it meets the body: a half for each face of each part of the crack, or all of it in a body
            of revolution. Where layers are soft, so is the contact.
        parts: Force and friction work of its tip and its shaft.
        areas: How far each part of the crack has been cut.
        plate: What is under the body: a support, or a plate on which it rests.
        mechanics: The problem to run.
        carriage: What a machine drives along the push, with all of the tool on it; None for a tool that follows its
            motion.
        symmetry_factor: Factor from what is meshed to the whole body, 2 for each plane of symmetry.
    """

    body: CrackedBody
    tool: Insertable
    frame: Frame
    motion: Motion
    contacts: tuple[ToolContact, ...]
    parts: ToolParts
    areas: tuple[CutArea, ...]
    plate: Support | RestingPlate
    mechanics: Mechanics
    carriage: Carriage | None
    symmetry_factor: float

    @classmethod
    @checked
    def build(
        cls,
        body: CrackedBody,
        tool: Insertable,
        drive: Drive,
        *,
        notch: float = 0.0,
        friction: AnyFriction = None,
        fixture: Fixture = STANDING,
        machine: Machine | None = None,
        mechanics: Mapping[str, Any] | None = None,
    ) -> Self:
        """Put the problem together and compile its forms. Collective.

        Args:
            body: The body, from `cracked_block`, `LayeredBlock.build` or put together by hand.
            tool: The whole tool (side 0); a blade, in a body of revolution a ring, or there and in space a needle.
            drive: Its motion.
            notch: Depth of the notch in which the tool is inserted, 0 for a body without one [length].
            friction: Friction of tool and body, a law, or the coefficient of Coulomb's; None for none.
            fixture: Names of groups of the mesh, and how the body is held.
            machine: What drives the tool along the push, as a whole: then the motion along it is that of the machine,
                and where the tool goes is found. The spreading in the notch stays prescribed. A machine without
                stiffness takes over when the push begins, with its initial velocity.
            mechanics: Further arguments of `Mechanics`, such as ``{"analysis": "dynamic"}``.

        Raises:
            ValueError: A parameter is outside its range, the tool does not fit body or notch, or a group is missing.
        """
        check_friction("friction", friction)
        fixture.check(body)
        _check_tool(tool, body)
        whole = tool.mirrored or not fixture.halved(body)
        require("fixture.symmetry", fixture.symmetry, whole, "no group of the mesh: both halves of this tool differ")
        frame = Frame.of(body, tool, fixture.plate, fixture.symmetry if fixture.halved(body) else None)
        _check_notch(body, tool, frame, notch)
        motion = Motion.of(drive, tool, notch, np.inf if fixture.ends else frame.height)
        doubt_units(body.state.verdict, _kind(tool), tool, frame.height)
        factor = (2.0 if fixture.halved(body) else 1.0) * (2.0 if body.mirrored else 1.0)
        carriage = None
        if machine is not None:
            driven, release = motion.driven(machine, frame, factor)
            path = motion.push(frame, halves=not on_axis(body, tool))
            carriage = Carriage(body.state, path, [driven], name=f"{_kind(tool)}_drive", release=release)
        contacts = _contacts(body, tool, frame, motion, fixture.top, friction, carriage)
        parts, plate = ToolParts(contacts, tool), fixture.support(body, frame)
        resting, held = ([], [plate]) if isinstance(plate, Support) else ([plate], [])
        problem = Mechanics(
            body.state,
            [*body.terms, *contacts, *resting],
            [*held, *fixture.supports(body, frame, motion.entry_time)],
            observers=[parts],
            **(mechanics or {}),
        )
        areas = tuple(CutArea(crack) for crack in body.cracks)
        return cls(body, tool, frame, motion, contacts, parts, areas, plate, problem, carriage, factor)

    @property
    def state(self) -> State:
        """Displacement and time."""
        return self.body.state

    @property
    def edge_factor(self) -> float:
        """Factor from what is meshed to the whole along the edge, and of areas of the crack."""
        return self.symmetry_factor / 2 if self.body.mirrored else self.symmetry_factor

    @property
    def depth(self) -> float:
        """Present depth of the tip [length]."""
        return self.frame.depth(self.contacts[0].position.value)

    def time_of(self, depth: float, push: int = 1) -> float:
        """Time at which the tip, or the machine that pushes it, is this deep in the first or second push [time].

        Raises:
            ValueError: The push begins deeper, the body or the first push ends before, or there is no such push.
        """
        return self.motion.time_of(depth, push)

    def reaction(self) -> float:
        """Force of the plate on what is meshed of the body, against the push [force]."""
        if isinstance(self.plate, Support):
            return self.mechanics.reaction(self.plate)
        return float(self.plate.force() @ self.frame.push)

    def columns(self, columns: Columns) -> Columns:
        """Depth of the tip, force of the whole tool, its imbalance with the plate, areas; tip and shaft. Collective.

        Forces are positive against the push.  The imbalance is relative to the force.  The area behind the front is
        that where the crack has been open by more than spends half the work of separation; the cut area counts each
        point by the share of that work that belongs to its largest opening so far, and never falls.  What the body
        says of itself, such as the energies of its layers, follows.
        """
        factor, along, kind = self.symmetry_factor, self.edge_factor, self.state.facet_measure
        force = -factor * float(sum(contact.force() for contact in self.contacts) @ self.frame.push)
        reaction = factor * self.reaction()
        rows: Columns = {
            "depth": (self.depth, "length"),
            "force": (force, "force"),
            "imbalance": (abs(reaction - force) / abs(force) if force else 0.0, "one"),
            "cut": (along * sum(area.spent() for area in self.areas), kind),
            "front": (along * sum(area.swept() for area in self.areas), kind),
            "spent": (along * sum(c.points.integral(c.point_values("spent")) for c in self.body.cracks), kind),
        }
        for part in PARTS:
            rows[f"{part}_force"] = (factor * self.parts.force(part), "force")
            rows[f"{part}_friction"] = (factor * self.parts.friction(part), "force")
            rows[f"{part}_friction_work"] = (factor * self.parts.friction_work(part), "energy")
        return rows | self.body.columns(columns)


def _check_tool(tool: Insertable, body: CrackedBody) -> None:
    """Refuse half a tool, one given in degrees, and a needle in the plane."""
    require("tool.side", tool.side, tool.side == 0, "0, the whole tool")
    angle = getattr(tool, tool.angle)
    require(f"tool.{tool.angle}", angle, angle <= _WIDEST, "at most π/3: it is in radians")
    flat = body.domain.mesh.geometry.dim == 2 and not body.state.axisymmetric
    require("tool", tool, not (flat and tool.round), "a blade in the plane")


def _check_notch(body: CrackedBody, tool: Insertable, frame: Frame, notch: float) -> None:
    """Refuse a depth that is not that of the notch in the mesh, and a tool too blunt for it. Collective."""
    require_number("notch", notch, nonnegative)
    if body.notch is None:
        require("notch", notch, notch == 0, "0: the body has no notch")
        return
    depth = frame.span(body.domain.mesh, body.mouth, frame.push)[1]
    require("notch", notch, abs(notch - depth) <= 1e-3 * depth, f"{depth:g}, the depth of the notch in the mesh")
    require_number("notch", notch, above(tool.resolution, "the radius of the tip"))


def _kind(tool: Insertable) -> str:
    return type(tool).__name__.lower()


def _contacts(
    body: CrackedBody,
    tool: Insertable,
    frame: Frame,
    motion: Motion,
    top: tuple[str, str],
    friction: AnyFriction,
    carriage: Carriage | None,
) -> tuple[ToolContact, ...]:
    """The tool on each face of each part of the crack."""
    plus = frame.side(body.cracks[0])
    faces: list[tuple[Literal["+", "-"], int, str]] = [("+", plus, top[1])]
    whole = on_axis(body, tool)
    if not (whole or body.mirrored):  # else the thread does not meet the tool, or the other side is an image
        faces.append(("-", -plus, top[0]))
    intact = body.notch is None and body.state.axisymmetric
    firm = body.faces.firm or intact
    indenting = body.faces.symmetric and not firm
    found = []
    for face, side, group in faces:
        half = tool if whole else replace(tool, side=side)  # type: ignore[type-var]
        for crack in body.cracks:
            soft = half.soft_contact(crack.young, crack.normal_size, indenting=indenting)
            name = "_".join([_kind(tool), _SIDES[side], *([crack.name] if len(body.cracks) > 1 else [])])
            law = half.firm_contact(crack.young, crack.normal_size) if firm else soft
            contact = ToolContact(
                body.state,
                half,
                motion.path(frame, half, law.clearance),
                _surfaces(body, crack, face, group, DEGREE if firm else _DEGREE),
                contact=law,
                friction=completed(friction, soft.stiffness),
                name=name,
                machines=() if carriage is None else carriage,
            )
            if whole:  # the face of the thread, which does not meet it
                contact.destroys()
            if crack is not body.cracks[0]:  # how deep the cut will go is not known
                contact.may_miss()
            found.append(contact)
    return tuple(found)


def _surfaces(body: CrackedBody, crack: Crack, face: Literal["+", "-"], top: str, degree: int) -> list[Surface]:
    """Face of a part of the crack; with the first one that of the notch, and the surface beside it."""
    cut = Surface.of(body.state, crack.face(face), degree)
    if crack is not body.cracks[0]:
        return [cut]
    surfaces = [Surface.exterior(body.state, body.domain.facets(top), degree), cut]
    return surfaces + ([] if body.notch is None else [Surface.of(body.state, body.notch.face(face), degree)])
