"""Schema of case files: bodies, cracks, pairs of surfaces, tools, supports and loads."""

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag, model_validator

from cutsim.base.units import Density, Length, Number, Stress, Time, Viscosity
from cutsim.cases.classes import classes
from cutsim.cases.constructed import Constructed, FromTable, With
from cutsim.cases.expressions import TimeValue
from cutsim.cases.names import BodyNames, CarriageName, ExistingFile, Group, Groups, Surfaces
from cutsim.cases.schema_materials import AnyMaterial, Contact, Friction, Law, LawOrNone
from cutsim.cases.schema_motion import Motion, Rotation
from cutsim.cases.schema_rigs import Machines, Place
from cutsim.cases.tables import FORM, NONNEGATIVE, POSITIVE, Flag, Table, Varying, chosen_by
from cutsim.materials.thermoelastic import ThermoElastic
from cutsim.materials.viscoelastic import Prony
from cutsim.tools.insertable import Insertable
from cutsim.tools.shapes import Shape

Volumetric = Literal["auto", "full", "reduced", "mixed", "taylor-hood"]
#: A component, or a vector.
Direction = Annotated[
    Annotated[Literal["x", "y", "z", "-x", "-y", "-z"], Tag("<single>")] | Annotated[tuple[Number, ...], Tag("<list>")],
    FORM,
]
AnyDirection = Annotated[
    Annotated[Literal["x", "y", "z", "-x", "-y", "-z", "all"], Tag("<single>")]
    | Annotated[tuple[Number, ...], Tag("<list>")],
    FORM,
]
Displacement = Annotated[TimeValue, Varying("length")]


class Deformable(Table):
    """What a body and a layer have in common.

    Args:
        material: Material; by default that of ``[material]``.
        volumetric: "full" or "reduced" integration of the volumetric part, "mixed" or "taylor-hood" elements; by
            default reduced for ν ≥ 0.45.
        viscosity: Kelvin–Voigt viscosity η ≥ 0 [stress·time].
        relaxation: Prony series by which all but the volumetric part relaxes.
        density: Mass per reference volume > 0, for dynamics and heat [mass/length³].
        thermoelastic: Thermal expansion and softening; needs ``[heat]``.
    """

    material: AnyMaterial | None = None
    volumetric: Volumetric = "auto"
    viscosity: Annotated[Viscosity, NONNEGATIVE] = 0.0
    relaxation: Annotated[Prony, FromTable()] | None = None
    density: Annotated[Density, POSITIVE] | None = None
    thermoelastic: Annotated[ThermoElastic, FromTable()] | None = None


class Body(Deformable):
    """Deformable body.

    Args:
        cells: Groups of cells that it occupies; by default all.
        plane: Plane strain or plane stress of a two-dimensional mesh.
    """

    cells: Groups | None = None
    plane: Literal["strain", "stress"] = "strain"


class Layer(Deformable):
    """Layer of a block, from the surface downwards.

    Args:
        name: Its name in messages and output.
        thickness: Thickness > 0 [length].
        law: Cohesive law of the crack in it; by default that of ``[law]``.
    """

    name: str
    thickness: Annotated[Length, POSITIVE]
    law: Law | None = None


class Interface(Table):
    """What a crack and a pair have in common.

    Args:
        law: Cohesive law, or "none" for contact only; by default that of ``[law]``.
        friction: Friction coefficient [–], or a law.
        contact: Contact law; by default a penalty of 10 E/h.
        allowed_penetration: If given, the contact is augmented until no point penetrates more than this [length].
        acts_on: Where friction acts: on the "broken" part of the bond, or wherever there is "contact".
        allowed_slip: If given, the friction is augmented until no sticking facet slides more than this in a step
            [length].
        young: Young's modulus for the automatic penalty; by default that of the softest neighbour [stress].
    """

    law: LawOrNone = None
    friction: Annotated[Friction, NONNEGATIVE] | None = None
    contact: Contact | None = None
    allowed_penetration: Annotated[Length, POSITIVE] | None = None
    acts_on: Literal["broken", "contact", "tension"] = "broken"
    allowed_slip: Annotated[Length, POSITIVE] | None = None
    young: Annotated[Stress, POSITIVE] | None = None


_Side = Annotated[Annotated[Group, Tag("<single>")] | Annotated[tuple[Number, ...], Tag("<list>")], FORM]


class Crack(Interface):
    """Crack along facets of the mesh.

    Args:
        facets: Groups of facets.
        plus: Group of cells on its '+' side, or a direction that points out of them. Left out for facets of the outer
            boundary in a plane of symmetry: the other side is the image of the one that is meshed.
        normal: Normal of the "current" or of the "reference" configuration (small strain).
        closing: Whether closed faces press on the points that they met at the start. Faces that slide over each other
            need false, and a pair of the two, such as ``slave = "glue+"`` with ``master = "glue-"``.
    """

    facets: Groups
    plus: _Side | None = None
    normal: Literal["current", "reference"] = "current"
    closing: Flag = True


class Pair(Interface):
    """Pair of surfaces that touch, or a surface that meets itself; their meshes need not match.

    Args:
        slave: The finer or softer surface: groups of outer facets, and faces of cracks such as "glue+".
        master: The other one; without it the first one may fold and meet itself.
        automatic: Whether, in place of a slave and a master, all outer surfaces and faces of cuts may meet each other,
            but for the two faces of a crack that press on each other themselves (``closing``).
        law: Cohesive law of a bond, which each point has with the one that it faces in the reference configuration,
            wherever they slide; by default contact only.
        small_sliding: Whether contact and friction, too, keep these partners.
        two_pass: Whether each surface is slave once.
        search: Largest distance of a partner; by default the mean size of the slave facets [length].
    """

    slave: Surfaces = ()
    master: Surfaces = ()
    automatic: Flag = False
    small_sliding: Flag = False
    two_pass: Flag = False
    search: Annotated[Length, POSITIVE] | None = None


class Moved(Table):
    """What tools and carriages have in common: a prescribed motion.

    Args:
        position: Position of its reference point, one number or expression in t a component [length].
        rotation: Rotation about its reference point, one number or expression in t: an angle in the plane,
            counterclockwise; in space three, the components of a rotation vector [rad].
        path: Motion of its reference point, as points at times, or as a feed with a sawing stroke, a slice or rocking.
        corners: Times at which its velocity jumps; those of `path` are known [time].
    """

    position: tuple[Displacement, ...] | None = None
    rotation: Rotation | None = None
    path: Motion | None = None
    corners: tuple[Time, ...] = ()


class Carriage(Moved):
    """Rigid carriage that machines drive and that carries one tool or several, which share its unknown motion.

    Along the axes of the machines each of its tools is ahead of its own path by as much as the carriage is ahead of
    its path, and turns about the reference point of the carriage.

    Args:
        machines: What drives it along some axes, one machine or several; its path there is that of the machines.
        release: Time until which it follows its path; then the machines take over, with their initial velocity [time].
    """

    machines: Machines
    release: Annotated[Time, NONNEGATIVE] = 0.0


class Tool(Moved, Constructed):
    """Rigid tool.

    Args:
        friction: Friction coefficient [–], or a law.
        surfaces: Groups of outer facets, and faces of cracks such as "glue+", that it can touch. A tool that is
            inserted needs none.
        contact: Contact law; by default a penalty of 10 E/h, and that of an inserted tool is its own.
        allowed_penetration: If given, the contact is augmented until no facet penetrates more than this in the mean
            [length].
        allowed_slip: If given, the friction is augmented until no sticking facet slides more than this in a step
            [length].
        machines: What drives it along some axes, one machine or several: its motion there is found, and its path is
            that of the machine. Not for an inserted tool; a tool of triangles is not turned by them.
        carriage: Name of the carriage that it shares with other tools, in place of machines of its own.
    """

    friction: Annotated[Friction, NONNEGATIVE] = 0.0
    surfaces: Surfaces = ()
    contact: Contact | None = None
    allowed_penetration: Annotated[Length, POSITIVE] | None = None
    allowed_slip: Annotated[Length, POSITIVE] | None = None
    machines: Machines = ()
    carriage: CarriageName | None = None

    @property
    def pointed(self) -> bool:
        """Whether it can be inserted."""
        return isinstance(self._made, Insertable)


class SurfaceTool(Tool):
    """Rigid tool of triangles, or of segments in the plane, from an STL, OBJ or PLY file.

    Its surfaces may have one face of a crack, such as "glue+"; a tool between both faces is two of these.

    Args:
        file: The file, relative to the case file.
        scale: Length in the units of the case of one unit of the file, > 0.
        search: Largest distance of a partner; by default the mean size of the facets [length].
    """

    shape: Literal["surface"]
    file: ExistingFile
    scale: Annotated[Number, POSITIVE] = 1.0
    search: Annotated[Length, POSITIVE] | None = None


def _tool(value: Any) -> str:
    return "<surface>" if isinstance(value, dict) and value.get("shape") == "surface" else "<shape>"


#: A tool of one of the shapes that cutsim exports, or of a surface from a file.
AnyTool = Annotated[
    Annotated[SurfaceTool, Tag("<surface>")] | Annotated[Tool, With(Shape), Tag("<shape>")],
    Discriminator(_tool),
    chosen_by("shape", [*classes(Shape), "surface"]),
]


class Support(Place):
    """Prescribed displacement along one direction, with its reaction.

    Args:
        direction: Along which the displacement is prescribed: "x", "-x" and so on, a vector, or "all" for each
            component. The reaction counts along it.
        value: Displacement [length].
        corners: Times at which its velocity jumps; those of a table are known [time].
    """

    direction: AnyDirection
    value: Displacement = 0.0
    corners: tuple[Time, ...] = ()


class Pressure(Table):
    """Fluid pressure on a part of the boundary, along the current normal.

    Args:
        facets: Groups of facets.
        value: Pressure, > 0 pushes on the body [stress].
        corners: Times at which it has a kink; those of a table are known [time].
    """

    kind: Literal["pressure"]
    facets: Groups
    value: Annotated[TimeValue, Varying("stress")]
    corners: tuple[Time, ...] = ()


class Traction(Table):
    """Traction of fixed direction on a part of the boundary.

    Args:
        facets: Groups of facets.
        direction: Direction of the traction: "x", "y", "z", or a vector, whose length does not matter.
        value: Force per reference area along the direction [stress].
        corners: Times at which it has a kink; those of a table are known [time].
        current_area: Whether it is a force per current area instead.
    """

    kind: Literal["traction"]
    facets: Groups
    direction: Direction
    value: Annotated[TimeValue, Varying("stress")]
    corners: tuple[Time, ...] = ()
    current_area: Flag = False


class NodalForce(Table):
    """The same force on each of some vertices.

    Args:
        vertices: Groups of vertices.
        points: Points of which the nearest vertices are loaded [length].
        direction: Direction of the force: "x", "y", "z", or a vector, whose length does not matter.
        value: Force on each vertex along the direction [force].
        corners: Times at which it has a kink; those of a table are known [time].
    """

    kind: Literal["force"]
    vertices: Groups = ()
    points: tuple[tuple[Length, ...], ...] = ()
    direction: Direction
    value: Annotated[TimeValue, Varying("force")]
    corners: tuple[Time, ...] = ()

    @model_validator(mode="after")
    def _one_place(self) -> "NodalForce":
        if bool(self.vertices) == bool(self.points):
            raise ValueError("must have either vertices or points")
        return self


class LineLoad(Table):
    """Force per length along a line of edges in space.

    Args:
        vertices: Groups of vertices of the line, such as a physical curve of gmsh; the edges between them are loaded.
        direction: Direction of the force: "x", "y", "z", or a vector, whose length does not matter.
        value: Force per length along the direction [force/length].
        corners: Times at which it has a kink; those of a table are known [time].
    """

    kind: Literal["line"]
    vertices: Groups
    direction: Direction
    value: Annotated[TimeValue, Varying("force per length")]
    corners: tuple[Time, ...] = ()


class BodyForce(Table):
    """Force on all of a body per reference volume; a dead load.

    Args:
        bodies: Names of the bodies; by default all.
        direction: Direction of the force: "x", "-y" and so on, or a vector, whose length does not matter.
        value: Force per reference volume along the direction [force/length³].
        corners: Times at which it has a kink; those of a table are known [time].
    """

    kind: Literal["body-force"]
    bodies: BodyNames = ()
    direction: Direction
    value: Annotated[TimeValue, Varying("force per volume")]
    corners: tuple[Time, ...] = ()


class Weight(Table):
    """Weight of bodies with a density: a force per mass.

    Args:
        bodies: Names of the bodies; by default all.
        direction: Direction of gravity: "x", "-y" and so on, or a vector, whose length does not matter.
        value: Acceleration of gravity, such as "9.81 m/s^2"; it may grow from zero [length/time²].
        corners: Times at which it has a kink; those of a table are known [time].
    """

    kind: Literal["weight"]
    bodies: BodyNames = ()
    direction: Direction
    value: Annotated[TimeValue, Varying("acceleration")]
    corners: tuple[Time, ...] = ()


Load = Annotated[
    Pressure | Traction | NodalForce | LineLoad | BodyForce | Weight,
    Field(discriminator="kind"),
    chosen_by("kind", ["pressure", "traction", "force", "line", "body-force", "weight"]),
]
