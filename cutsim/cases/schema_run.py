"""Schema of case files: the insertion of a tool, analysis, steps, solver and output."""

from functools import reduce
from operator import or_
from typing import Annotated, Any, Literal, Self

from pydantic import (
    AfterValidator,
    Discriminator,
    Field,
    PlainValidator,
    Tag,
    ValidationInfo,
    WithJsonSchema,
    model_validator,
)
from pydantic_core import CoreSchema

from cutsim.analysis.stepping import StepControl
from cutsim.analysis.steps import Control
from cutsim.base.checks import positive, require_number
from cutsim.base.units import KINDS, Length, Number, Time
from cutsim.bodies.schemes import Newmark, Scheme
from cutsim.cases.constructed import Constructed, FromTable, With, annotated, choice, made, table_of
from cutsim.cases.expressions import RowExpression
from cutsim.cases.names import BodyName, CrackName, Groups, ToolName
from cutsim.cases.schema_rigs import Machine
from cutsim.cases.tables import NONNEGATIVE, POSITIVE, Flag, Table, Whole, chosen_by
from cutsim.studies.body import Faces
from cutsim.studies.drive import Drive
from cutsim.studies.fixture import Fixture


class Insertion(Constructed):
    """Insertion of a blade or needle into a body along its crack; the ready-made problem of `Insertion.build`.

    Args:
        tool: Name of the tool.
        depth: Depth of the tip, or of the machine that pushes the tool, at which the run ends [length]; or `until` in
            ``[analysis]``.
        push: In which push that is, 2 for the second one of a tool that turns.
        notch: Depth of the notch in which the tool is inserted, 0 for a body without one [length].
        groups: Groups of the facets of the crack, of those of the notch, and of the cells on the '+' side of both.
        faces: How the faces of crack and notch meet.
        fixture: Groups where the tool enters and where the body is held.
        damping: Kelvin–Voigt viscosity over Young's modulus of every layer [time].
        machine: What drives the whole tool along the push, whose direction is its axis; by default the tool follows the
            motion that speed and times give, which otherwise is that of the machine.
    """

    tool: ToolName = "tool"
    depth: Annotated[Length, POSITIVE] | None = None
    push: Annotated[Whole, POSITIVE] = 1
    notch: Annotated[Length, NONNEGATIVE] = 0.0
    groups: tuple[str, str, str] = ("crack", "notch", "right")
    faces: Annotated[Faces, FromTable()] = Field(default_factory=Faces)
    fixture: Annotated[Fixture, FromTable()] = Field(default_factory=Fixture)
    damping: Annotated[Time, NONNEGATIVE] = 0.0
    machine: Machine | None = None

    @property
    def drive(self) -> Drive:
        """Speed and times."""
        drive: Drive = self.made
        return drive


class Analysis(Table):
    """Analysis.

    Args:
        type: Whether inertia is left out or counts.
        until: Time at which the run ends, where no insertion gives the end [time].
        scheme: Time integration of a dynamic analysis; the trapezoidal rule by default.
        mass: Mass matrix of a dynamic analysis.
    """

    type: Literal["quasi-static", "dynamic"] = "quasi-static"
    until: Annotated[Time, POSITIVE] | None = None
    scheme: Annotated[Scheme, FromTable()] = Field(default_factory=Newmark)
    mass: Literal["consistent", "lumped"] = "consistent"


class FixedSteps(Constructed):
    """Equal steps as long as they converge.

    Args:
        fixed: Size of each step [time].
    """

    fixed: Time

    @model_validator(mode="after")
    def _make(self) -> Self:
        require_number("fixed", self.fixed, positive)
        self._made = StepControl.fixed(self.fixed)
        return self


def _plain(value: Any) -> Any:
    if not isinstance(value, str | int | float | bool):
        raise ValueError("must be a text, a number, true or false")
    return value


Plain = Annotated[Any, AfterValidator(_plain)]


class Solver(Table):
    """Solver.

    Args:
        rtol: Norm of the out-of-balance forces over the force scale.
        dtol: Norm of the last step over that of the displacement of the solve; by default no criterion.
        etol: Work of the out-of-balance forces over that at the start; by default no criterion.
        petsc: PETSc options without prefix; they win over the presets.
    """

    rtol: Annotated[Number, POSITIVE] = 1e-8
    dtol: Annotated[Number, POSITIVE] | None = None
    etol: Annotated[Number, POSITIVE] | None = None
    petsc: dict[str, Plain] = Field(default_factory=dict)


class Front(Table):
    """Place of a crack front, as a column of the history.

    Args:
        crack: Name of the crack.
        axis: Coordinate along which it grows, or "-x" and so on if it grows against it.
        quantity: Quantity that tells where the front is.
        level: Level below which this falls at the front; one half of the damage (4.26, 4.27) by default.
    """

    kind: Literal["front"]
    crack: CrackName
    axis: Literal["x", "y", "z", "-x", "-y", "-z"] = "x"
    quantity: Literal["damage", "strength_loss", "spent", "opening", "sliding"] = "damage"
    level: Number = 0.5


class Size(Table):
    """Length or area of facets in the reference configuration, as a column of the history, for use in formulas.

    Args:
        facets: Groups of facets, outer or inner ones.
    """

    kind: Literal["area"]
    facets: Groups


class DomainIntegral(Table):
    """J-integral of a crack front over a domain around it, as a column of the history.

    Args:
        body: Name of the body around the front.
        tip: A point of the front [length].
        direction: Direction in which the crack grows.
        inner: Radius of the part of the domain that moves along, < outer [length].
        outer: Radius of the domain [length].
        front: Direction of the straight front in 3-D.
        length: Length of the front in the body; in 2-D the thickness, 1 [length].
    """

    kind: Literal["j-integral"]
    body: BodyName = "body"
    tip: tuple[Length, ...]
    direction: tuple[Number, ...]
    inner: Annotated[Length, POSITIVE]
    outer: Annotated[Length, POSITIVE]
    front: tuple[Number, ...] | None = None
    length: Annotated[Length, POSITIVE] | None = None


def _formula(value: Any, info: ValidationInfo) -> RowExpression:
    found: RowExpression = info.context.formula(value)  # type: ignore[union-attr]
    return found


class Formula(Table):
    """Column of the history that is computed from others, such as an energy-release rate from force and rotation.

    Args:
        value: Expression in names of columns, parameters and numbers of the file.
        quantity: Kind of quantity of its value, for its unit.
    """

    kind: Literal["formula"]
    value: Annotated[RowExpression, PlainValidator(_formula), WithJsonSchema({"type": "string"})]
    quantity: Literal[KINDS] = "one"  # type: ignore[valid-type]


Measure = Annotated[
    Front | Size | DomainIntegral | Formula,
    Field(discriminator="kind"),
    chosen_by("kind", ["front", "area", "j-integral", "formula"]),
]


class Output(Table):
    """Output.

    Args:
        curve: Columns of the history for abscissa and ordinate of the curve that tells most; by default depth and force
            of an insertion, else of the first tool, or of the first support that moves.
        mirror: Planes of symmetry through the origin in which pictures show the whole body, by the axes normal to them;
            that of an insertion is known.
        every: Fields are written every so many steps; 0 for none.
        stress: Whether stresses are written.
        format: Files for ParaView: "vtx" needs ADIOS2, "vtu" nothing; by default what dolfinx can write.
        animation: Whether an animation is made at the end.
        report: Whether a report is made at the end.
        checkpoint_minutes: Minutes of computing > 0 after which a checkpoint is written; another one is written at the
            end.
    """

    curve: tuple[str, str] | None = None
    mirror: tuple[Literal["x", "y", "z"], ...] = ()
    every: Annotated[Whole, NONNEGATIVE] = 5
    stress: Flag = True
    format: Literal["vtx", "vtu"] | None = None
    animation: Flag = True
    report: Flag = True
    checkpoint_minutes: Annotated[Number, POSITIVE] = 10.0


class AnySteps:
    """Annotation of a step control: the parameters of `StepControl`, equal steps, or another control by its name."""

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> CoreSchema:
        """How it is read."""
        kinds = {"<fixed>": FixedSteps, "<control>": table_of(StepControl), "<model>": choice(Control)}
        either = reduce(or_, (annotated(made(table), Tag(tag)) for tag, table in kinds.items()))
        schema: CoreSchema = handler.generate_schema(annotated(either, Discriminator(_steps)))
        return schema


def _steps(value: Any) -> str:
    keys = value if isinstance(value, dict) else ()
    return "<fixed>" if "fixed" in keys else "<model>" if "model" in keys else "<control>"


#: Insertion whose further keys are the parameters of a `Drive`.
AnyInsertion = Annotated[Insertion, With(Drive)]
Steps = Annotated[Control, AnySteps()]
