"""A blade or needle driven into a notched block along a crack, as one ready-made problem (docs/needle_insertion.md)."""

from dataclasses import dataclass, replace
from typing import Literal, Self

import numpy as np
from dolfinx.mesh import locate_entities_boundary
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.staggered import ThermoMechanics
from cutsim.base.assembly import box
from cutsim.base.checks import above, at_least, between, nonnegative, positive, require, require_number
from cutsim.base.signatures import checked
from cutsim.bodies.loads import Support
from cutsim.bodies.solid import Solid
from cutsim.fields.meshing import TaggedMesh
from cutsim.fields.points import Surface
from cutsim.fields.space import cracked_space
from cutsim.fields.state import State
from cutsim.fields.temperature import Temperature
from cutsim.heat.conduction import HeatBody
from cutsim.heat.contact_heat import AdiabaticTool, ContactHeat
from cutsim.heat.interface_heat import InterfaceHeat
from cutsim.heat.tool_heat import ToolHeat
from cutsim.heat.transfer import HeatTransfer
from cutsim.interface.cohesive import CohesiveLaw, separation_curve
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.crack import Crack
from cutsim.interface.friction import Coulomb
from cutsim.materials.elastic import Material
from cutsim.results.recording import Columns
from cutsim.tools.pointed import Blade, Needle
from cutsim.tools.shapes import Path
from cutsim.tools.tool_contact import ToolContact, doubt_units
from cutsim.tools.tool_parts import PARTS, ToolParts

# measured: stiff enough for the force, soft enough for Newton's method; a needle is pressed harder than a blade, all
# along its shaft (penalty times h over E, blend over tip radius)
_CONTACT = {Blade: (5.0, 0.4), Needle: (20.0, 0.1)}
_WIDEST = np.pi / 3
# way of an endless push over the depth of the tip when it begins
_ENDLESS = 1e6
#: Depth of the tip, as a part of the depth of the notch, when the push begins.
TIP_IN_NOTCH = 0.8
#: Face of the crack, side of the tool that it meets, name.
FACES: tuple[tuple[Literal["+", "-"], int, str], ...] = (("+", 1, "right"), ("-", -1, "left"))


@dataclass(frozen=True)
class ThermalCut:
    """Thermal properties of a block that is cut.

    Args:
        density: Density of the block [mass/length³].
        capacity: Its specific heat [energy/(mass·temperature)].
        conductivity: Its conductivity [power/(length·temperature)].
        blade: Exchange of heat between block ('+') and tool ('−'); an adiabatic tool, or one that stays at the
            initial temperature.
        fracture_fraction: Fraction of the fracture dissipation that becomes heat, in [0, 1].
    """

    density: float
    capacity: float
    conductivity: float
    blade: ContactHeat | AdiabaticTool
    fracture_fraction: float = 1.0


@dataclass(frozen=True)
class Insertion:
    """A blade or a needle driven into a notched block along a predefined crack.

    The tool moves along −y from the top at y = 0.  Its halves part at the plane x = 0, the plane of the crack; the edge
    of a blade is along z.  Given a needle, a 2-D mesh is the meridian plane of a body of revolution: the crack is then
    the surface of a thread on the axis, which the tip destroys.  The block rests on a smooth plate, where it is also
    held across the crack plane along the last line of the crack.  Time is the way of the tool: it takes the time
    `insertion` into the notch, and is then pushed at unit speed.

    Attributes:
        domain: The tagged mesh.
        state: Displacement and time.
        mechanics: The problem to run.
        solid: The block.
        crack: The crack ahead of the notch.
        halves: The tool as the faces of the crack meet it: its halves on the side of +x and −x, or all of it in a body
            of revolution.
        parts: Books of its tip and shaft.
        plate: Support under the block.
        tool: The whole tool.
        insertion: Duration of the insertion [time].
        tip: Depth of the tip when the push begins [length].
        turn: Depth at which the tool turns back to where the push began, to be pushed once more; None if it does not.
        height: Height of the block [length].
        whole: Factor from the meshed part to the whole block.
        separation: Table of the law, opening → fraction of the toughness spent.
    """

    domain: TaggedMesh
    state: State
    mechanics: Mechanics
    solid: Solid
    crack: Crack
    halves: tuple[ToolContact, ...]
    parts: ToolParts
    plate: Support
    tool: Blade | Needle
    insertion: float
    tip: float
    turn: float | None
    height: float
    whole: float
    separation: tuple[NDArray[np.float64], NDArray[np.float64]]

    @classmethod
    @checked
    def build(
        cls,
        domain: TaggedMesh,
        material: Material,
        law: CohesiveLaw,
        tool: Blade | Needle,
        *,
        notch: float,
        friction: float = 0.0,
        viscosity: float = 0.0,
        insertion: float = 1.0,
        turn: float | None = None,
    ) -> Self:
        """Put the problem together and compile its forms. Collective.

        Args:
            domain: Mesh with cells "left", "right" and facets "crack", "notch", "top_left", "top_right", "bottom", and
                "symmetry" if only the half z > 0 of the block is meshed (see meshes/block.geo and meshes/needle.geo);
                around an axis "left" is the thread (see meshes/thread.geo).
            material: Material of the block.
            law: Cohesive law of the crack.
            tool: The whole tool (side 0).
            notch: Depth of the notch in which the tool is inserted [length].
            friction: Friction coefficient of tool and block [–].
            viscosity: Kelvin–Voigt viscosity of the block [stress·time].
            insertion: Time in which the halves are spread apart in the notch, or a whole needle enters it [time].
            turn: Depth at which the tool turns back, to be pushed once more [length]; None if it does not.

        Raises:
            ValueError: A parameter is outside its range or the mesh lacks a group.
        """
        check_tool("tool", tool, notch, domain.mesh.geometry.dim)
        tip = TIP_IN_NOTCH * notch
        require_number("friction", friction, nonnegative)
        require_number("insertion", insertion, positive)
        require_number("turn", turn, above(tip, "the start of the push").or_none)
        require_number("viscosity", viscosity, nonnegative)
        height = check_block(domain, notch)
        mesh, revolved = domain.mesh, isinstance(tool, Needle) and domain.mesh.geometry.dim == 2
        if revolved:
            left = float(box(mesh.comm, mesh.geometry.x)[0][0])
            meridian = "the meridian plane x >= 0 of a body of revolution, as in meshes/thread.geo, for a needle in 2-D"
            require("domain", f"a mesh that begins at x = {left:g}", left >= -1e-9 * height, meridian)
        state = State(cracked_space(mesh, ("Lagrange", 1, (mesh.geometry.dim,)), _slit(domain)), axisymmetric=revolved)
        solid = Solid(state, material, name="block", viscosity=viscosity)
        plus, kind = domain.cells("right"), type(tool).__name__.lower()
        crack = Crack(state, domain.facets("crack"), plus, law, young=material.young)
        mouth = Crack(state, domain.facets("notch"), plus, None, young=material.young, name="notch")
        doubt_units(state.verdict, kind, tool, height)
        contact = soft_contact(tool, crack, material.young)

        def half(face: Literal["+", "-"], side: int, name: str) -> ToolContact:
            side = 0 if revolved else side
            return ToolContact(
                state,
                replace(tool, side=side),
                tool_path(tool, side, (tip, insertion, turn), mesh.geometry.dim),
                [Surface.exterior(state, domain.facets(f"top_{name}")), crack.surface(face), mouth.surface(face)],
                contact=contact,
                friction=Coulomb(friction) if friction else None,
                name=f"{kind}_{name}",
            )

        halves = tuple(half(*face) for face in (FACES[:1] if revolved else FACES))
        parts = ToolParts(halves, tool)
        plate, supports = _supports(domain, state)
        mechanics = Mechanics(state, [solid, crack, mouth, *halves, parts], [plate, *supports])
        whole = 2.0 if "symmetry" in domain.names else 1.0
        table = separation_curve(law)
        return cls(
            domain,
            state,
            mechanics,
            solid,
            crack,
            halves,
            parts,
            plate,
            tool,
            insertion,
            tip,
            turn,
            height,
            whole,
            table,
        )

    def time_of(self, depth: float, push: int = 1) -> float:
        """Time at which the tip is this deep below the top in the first or second push [time].

        Raises:
            ValueError: The push begins deeper, or there is no such push.
        """
        require_number("depth", depth, at_least(self.tip, "the start of the push"))
        require_number("depth", depth, between(self.tip, self.height, "[)", name="the height of the block"))
        last = 1 if self.turn is None else 2
        require("push", push, push in range(1, last + 1), f"1 … {last}")
        back = 0.0 if self.turn is None or push == 1 else 2 * (self.turn - self.tip)
        require("depth", depth, push == last or self.turn is None or depth <= self.turn, f"<= turn = {self.turn}")
        return self.insertion + back + depth - self.tip

    def heated(self, thermal: ThermalCut, initial: float) -> ThermoMechanics:
        """The cut with heat from friction on the tool and from fracture; the block is insulated elsewhere. Collective.

        Args:
            thermal: Thermal properties.
            initial: Initial temperature of block and tool [K].

        Returns:
            The coupled problem, to run in place of `mechanics`.
        """
        space = cracked_space(self.domain.mesh, ("Lagrange", 1), _slit(self.domain))
        temperature = Temperature(self.state, space, initial)
        body = HeatBody(
            temperature,
            density=thermal.density,
            capacity=thermal.capacity,
            conductivity=thermal.conductivity,
            body=self.solid,
        )
        # the faces lie apart wherever the bond has broken: what they exchange before hardly matters
        faces = ContactHeat(1.0, 1.0, fracture_fraction=thermal.fracture_fraction)
        blade_temperature = None if isinstance(thermal.blade, AdiabaticTool) else initial
        tools = [ToolHeat(temperature, half, thermal.blade, blade_temperature) for half in self.halves]
        heat = HeatTransfer(temperature, [body, InterfaceHeat(temperature, self.crack, faces), *tools])
        return ThermoMechanics(self.mechanics, heat)

    def _largest_opening(self) -> NDArray[np.float64]:
        """Largest opening so far at the points of the crack, from the memory of the bond [length]."""
        openings = self.separation[0]
        assert self.crack.law is not None
        secants = self.crack.law.secants(openings, np.zeros_like(openings))[0]
        # an intact bond may keep its stiffness, a broken one has none: the smallest opening with it counts
        falling, first = np.unique(-secants, return_index=True)
        return np.interp(-self.crack.points.get(self.crack.history.secants)[..., 0], falling, openings[first])

    def columns(self, columns: Columns) -> Columns:
        """Depth of the tip, force of the whole tool, its imbalance with the plate, areas; tip and shaft. Collective.

        Forces are positive against the push.  The area behind the front is that where the crack has been open by more
        than spends half the work of separation; the cut area counts each point by the share of that work that belongs
        to its largest opening so far, and never falls.
        """
        force = self.whole * sum(half.force()[1] for half in self.halves)
        reaction = self.whole * self.mechanics.reaction(self.plate)
        depth = -float(self.halves[0].position.value[1])
        imbalance = abs(reaction - force) / abs(force) if force else 0.0
        points, opening = self.crack.points, self._largest_opening()
        openings, spent = self.separation
        cut = points.integral(np.interp(opening, openings, spent))
        front = points.area_above(opening, float(np.interp(0.5, spent, openings)))
        rows: Columns = {
            "depth": (depth, "length"),
            "force": (force, "force"),
            "imbalance": (imbalance, "one"),
            "cut": (self.whole * cut, self.state.facet_measure),
            "front": (self.whole * front, self.state.facet_measure),
        }
        for part in PARTS:
            rows[f"{part}_force"] = (self.whole * self.parts.force(part), "force")
            rows[f"{part}_friction"] = (self.whole * self.parts.friction(part), "force")
            rows[f"{part}_friction_work"] = (self.whole * self.parts.friction_work(part), "energy")
        return rows


def _slit(domain: TaggedMesh) -> list[NDArray[np.int32]]:
    return [domain.facets("crack"), domain.facets("notch")]


def check_block(domain: TaggedMesh, notch: float) -> float:
    """Height of a block, which has to begin at y = 0 and to be notched as deep as it is said to be. Collective.

    Args:
        domain: The tagged mesh.
        notch: Depth of the notch as the user gave it [length].

    Raises:
        ValueError: The mesh has its top elsewhere, or another notch.
    """
    top, bottom = domain.extent("top_right")[1][1], domain.extent("bottom")[0][1]
    height = float(top - bottom)
    require("domain", f"top at y = {top:g}", abs(top) <= 1e-6 * height, "a block whose top is at y = 0")
    depth = float(top - domain.extent("notch")[0][1])
    same = abs(notch - depth) <= 1e-3 * depth
    require("notch", notch, same, f"{depth:g}, the depth of the group 'notch' in the mesh")
    return height


def check_tool(name: str, tool: Blade | Needle, notch: float, gdim: int) -> None:
    """Refuse a tool that does not fit the notch or the direction of the push.

    Args:
        name: Name of the parameter as the user wrote it.
        tool: The tool.
        notch: Depth of the notch [length].
        gdim: Dimension of the mesh.

    Raises:
        ValueError: It is too blunt for the notch, halved, points elsewhere or has the components of another dimension.
    """
    require_number("notch", notch, above(tool.tip_radius, f"the tip radius of the {name}"))
    require(f"{name}.side", tool.side, tool.side == 0, "0, the whole tool")
    down = len(tool.push) == gdim and tool.push[1] == -1
    require(f"{name}.push", tool.push, down, f"along −y, of {gdim} components")
    require(f"{name}.half_angle", tool.half_angle, tool.half_angle <= _WIDEST, "at most π/3: it is in radians")


def soft_contact(tool: Blade | Needle, crack: Crack, young: float) -> PenaltyContact:
    """Contact of a tool with the faces of a crack in a solid, as soft as the force allows.

    Args:
        tool: The tool.
        crack: The crack.
        young: Young's modulus of the solid [stress].
    """
    factor, blend = _CONTACT[type(tool)]
    return PenaltyContact.automatic(young, crack.normal_size, factor, blend=blend * tool.tip_radius)


def tool_path(tool: Blade | Needle, side: int, way: tuple[float, float, float | None], gdim: int) -> Path:
    """Into the notch, then pushed at unit speed without end, perhaps back once and pushed again.

    A half is spread from beside the plane of symmetry, a whole tool comes from above.

    Args:
        tool: The tool.
        side: Side of the half, 0 for a whole tool.
        way: Depth of the tip when the push begins, time until then, and depth of the turn or None.
        gdim: Dimension of the mesh.
    """
    tip, insertion, turn = way
    start = (-side * tool.half_width(tip), -tip, 0.0) if side else (0.0, 0.0, 0.0)
    depths = [tip, *([] if turn is None else [turn, tip])]
    depths.append(depths[-1] + _ENDLESS * tip)
    times = [0.0, *(insertion + np.cumsum(np.abs(np.diff(depths, prepend=tip))))]
    rows = [start, *((0.0, -depth, 0.0) for depth in depths)]
    return Path.polyline(times, [row[:gdim] for row in rows])


def _supports(domain: TaggedMesh, state: State) -> tuple[Support, list[Support]]:
    """The plate; what stops the block from sliding across it, or keeps the thread on the axis; the symmetry plane."""
    mesh = state.mesh
    plate = Support(state, domain.facets("bottom"), 1, name="plate")
    if state.axisymmetric:
        return plate, [Support(state, domain.cells("left"), 0, dim=2)]
    bottom = mesh.comm.allreduce(float(mesh.geometry.x[:, 1].min(initial=np.inf)), op=MPI.MIN)
    line = locate_entities_boundary(mesh, 0, lambda x: np.isclose(x[0], 0.0) & np.isclose(x[1], bottom))
    others = [Support(state, line, 0, dim=0)]
    if "symmetry" in domain.names:
        others.append(Support(state, domain.facets("symmetry"), 2))
    return plate, others
