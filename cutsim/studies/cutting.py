"""The blade cut as one ready-made problem: a notched block, a crack plane, a blade in two halves, a plate."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal, Self

import numpy as np
from dolfinx.mesh import locate_entities_boundary
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.staggered import ThermoMechanics
from cutsim.base.checks import require
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
from cutsim.tools.shapes import Blade, Path
from cutsim.tools.tool_contact import ToolContact, warn_coarse

# measured on blade cuts: stiff enough for the force, soft enough for Newton's method (pressure per length over E)
_PENALTY = 5.0
_BLEND = 0.4
_TIP_IN_NOTCH = 0.8


@dataclass(frozen=True)
class ThermalCut:
    """Thermal properties of a blade cut.

    Args:
        density: Density of the block [mass/length³].
        capacity: Its specific heat [energy/(mass·temperature)].
        conductivity: Its conductivity [power/(length·temperature)].
        blade: Exchange of heat between block ('+') and blade ('−'); an adiabatic blade, or one that stays at the
            initial temperature.
        fracture_fraction: Fraction of the fracture dissipation that becomes heat, in [0, 1].
    """

    density: float
    capacity: float
    conductivity: float
    blade: ContactHeat | AdiabaticTool
    fracture_fraction: float = 1.0


@dataclass(frozen=True)
class BladeCut:
    """A blade driven into a block along a predefined crack plane.

    The plane of the crack is x = 0, the blade moves along −y from the top at y = 0, and its edge lies along z.
    The block rests on a smooth plate, where it is also held across the crack plane along the last line of the crack.
    Time is the way of the tool: the insertion takes `insertion`, the push has unit speed.

    Attributes:
        domain: The tagged mesh.
        state: Displacement and time.
        mechanics: The problem to run.
        solid: The block.
        crack: The crack ahead of the notch.
        halves: The half blades on the side of +x and −x.
        plate: Support under the block.
        blade: The whole blade.
        insertion: Duration of the insertion [time].
        tip: Depth of the tip when the push begins [length].
        whole: Factor from the meshed part to the whole block.
        separation: Table of the law, opening → fraction of the toughness spent.
    """

    domain: TaggedMesh
    state: State
    mechanics: Mechanics
    solid: Solid
    crack: Crack
    halves: tuple[ToolContact, ToolContact]
    plate: Support
    blade: Blade
    insertion: float
    tip: float
    whole: float
    separation: tuple[NDArray[np.float64], NDArray[np.float64]]

    @classmethod
    def build(
        cls,
        domain: TaggedMesh,
        material: Material,
        law: CohesiveLaw,
        blade: Blade,
        *,
        notch: float,
        friction: float = 0.0,
        viscosity: float = 0.0,
        insertion: float = 1.0,
    ) -> Self:
        """Put the problem together and compile its forms. Collective.

        Args:
            domain: Mesh with cells "left", "right" and facets "crack", "notch", "top_left", "top_right", "bottom", and
                "symmetry" if only the half z > 0 of the block is meshed (see meshes/block.geo).
            material: Material of the block.
            law: Cohesive law of the crack.
            blade: The whole blade (side 0).
            notch: Depth of the notch in which the blade is inserted [length].
            friction: Friction coefficient of blade and block [–].
            viscosity: Kelvin–Voigt viscosity of the block [stress·time].
            insertion: Time in which the half blades are spread apart in the notch [time].

        Raises:
            ValueError: A parameter is outside its range or the mesh lacks a group.
        """
        require("notch", notch, notch > blade.tip_radius, f"> the blade's tip radius {blade.tip_radius}")
        require("friction", friction, friction >= 0, ">= 0")
        require("insertion", insertion, insertion > 0, "> 0")
        mesh = domain.mesh
        state = State(cracked_space(mesh, ("Lagrange", 1, (mesh.geometry.dim,)), _slit(domain)))
        solid = Solid(state, material, name="block", viscosity=viscosity)
        plus = domain.cells("right")
        crack = Crack(state, domain.facets("crack"), plus, law, young=material.young)
        mouth = Crack(state, domain.facets("notch"), plus, None, young=material.young, name="notch")
        warn_coarse("blade", blade, crack.size)
        tip = _TIP_IN_NOTCH * notch
        contact = PenaltyContact.automatic(material.young, crack.normal_size, _PENALTY, blend=_BLEND * blade.tip_radius)
        coulomb = Coulomb(friction) if friction else None

        def half(side: int, face: Literal["+", "-"], name: str) -> ToolContact:
            top = Surface.exterior(state, domain.facets(f"top_{name}"))
            return ToolContact(
                state,
                replace(blade, side=side),
                _path(blade, side, tip, insertion, mesh.geometry.dim),
                [top, crack.surface(face), mouth.surface(face)],
                contact=contact,
                friction=coulomb,
                name=f"blade_{name}",
            )

        halves = half(1, "+", "right"), half(-1, "-", "left")
        plate, supports = _supports(domain, state)
        mechanics = Mechanics(state, [solid, crack, mouth, *halves], [plate, *supports])
        whole = 2.0 if "symmetry" in domain.names else 1.0
        return cls(
            domain, state, mechanics, solid, crack, halves, plate, blade, insertion, tip, whole, separation_curve(law)
        )

    def time_of(self, depth: float) -> float:
        """Time at which the tip is this deep below the top [time]."""
        require("depth", depth, depth >= self.tip, f">= {self.tip}, where the push begins")
        return self.insertion + depth - self.tip

    def heated(self, thermal: ThermalCut, initial: float) -> ThermoMechanics:
        """The cut with heat from friction on the blade and from fracture; the block is insulated elsewhere. Collective.

        Args:
            thermal: Thermal properties.
            initial: Initial temperature of block and blade [K].

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

    def columns(self, columns: Columns) -> Columns:
        """Depth of the tip, force of the whole blade, its imbalance with the plate, cut area. Collective.

        The cut area counts each point of the crack by the share of its work of separation that belongs to its opening.
        """
        force = self.whole * sum(half.force()[1] for half in self.halves)
        reaction = self.whole * self.mechanics.reaction(self.plate)
        depth = -float(self.halves[0].position.value[1])
        imbalance = abs(reaction - force) / abs(force) if force else 0.0
        cut = self.crack.points.integral(np.interp(self.crack.point_values("opening"), *self.separation))
        return {
            "depth": (depth, "length"),
            "force": (force, "force"),
            "imbalance": (imbalance, "one"),
            "cut": (self.whole * cut, "length" if len(self.halves[0].force()) == 2 else "area"),
        }


def recovered_toughness(history: Mapping[str, NDArray[np.float64]], start: float, end: float, whole: float) -> float:
    """Toughness from a simulated curve by a balance of work, G = (∫F ds − ΔE − losses)/ΔA [force/length].

    What the tool spends between two depths is taken from its force, not from the cohesive law: the external work less
    the energy held by body and contact, and less friction and viscous losses; ΔA is the growth of the cut area.

    Args:
        history: Columns of a run of `BladeCut`.
        start: Depth at which the balance begins [length].
        end: Depth at which it ends [length].
        whole: Factor from the meshed part to the whole block.

    Raises:
        ValueError: The cut does not grow between the two depths.
    """
    held = ("strain", "contact", "friction", "viscous")
    spent = whole * (history["work_external"] - sum(history[f"energy_{name}"] for name in held))
    depth = history["depth"]
    pushed = np.flatnonzero(np.diff(depth, prepend=-np.inf) > 0)

    def grown(column: NDArray[np.float64]) -> float:
        first, last = np.interp([start, end], depth[pushed], column[pushed])
        return float(last - first)

    area = grown(history["cut"])
    require("depths", (start, end), area > 0, "such that the cut grows between them")
    return grown(spent) / area


def _slit(domain: TaggedMesh) -> list[NDArray[np.int32]]:
    return [domain.facets("crack"), domain.facets("notch")]


def _path(blade: Blade, side: int, tip: float, insertion: float, gdim: int) -> Path:
    """Retracted beside the plane of symmetry, spread inside the notch, then pushed at unit speed without end."""
    away = -side * blade.half_width(tip)
    push = 1e3
    rows = [(away, -tip, 0.0), (0.0, -tip, 0.0), (0.0, -tip - push, 0.0)]
    return Path.polyline([0.0, insertion, insertion + push], [row[:gdim] for row in rows])


def _supports(domain: TaggedMesh, state: State) -> tuple[Support, list[Support]]:
    """The plate; the line that stops the block from sliding across it; the symmetry plane."""
    mesh = state.mesh
    bottom = mesh.comm.allreduce(float(mesh.geometry.x[:, 1].min(initial=np.inf)), op=MPI.MIN)
    line = locate_entities_boundary(mesh, 0, lambda x: np.isclose(x[0], 0.0) & np.isclose(x[1], bottom))
    plate = Support(state, domain.facets("bottom"), 1, name="plate")
    others = [Support(state, line, 0, dim=0)]
    if "symmetry" in domain.names:
        others.append(Support(state, domain.facets("symmetry"), 2))
    return plate, others
