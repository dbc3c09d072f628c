"""Schema of case files: the one place that knows their keys."""

from typing import Annotated, Any

from pydantic import AfterValidator, Field, ValidationInfo, ValidatorFunctionWrapHandler, field_validator

from cutsim.base.units import Units
from cutsim.cases.constructed import FromTable
from cutsim.cases.expressions import RESERVED, TimeValue
from cutsim.cases.quantities import consistent
from cutsim.cases.schema_heat import Heat
from cutsim.cases.schema_materials import AnyMaterial, Law
from cutsim.cases.schema_mesh import Mesh, Selection
from cutsim.cases.schema_parts import AnyTool, Body, Carriage, Crack, Layer, Load, Pair, Support
from cutsim.cases.schema_rigs import Link
from cutsim.cases.schema_run import Analysis, AnyInsertion, Measure, Output, Solver, Steps
from cutsim.cases.tables import Table, Varying
from cutsim.interface.cohesive import CohesiveLaw
from cutsim.materials.elastic import Material

Named = Annotated[str, Field(pattern=r"^\w[\w -]*$")]


def _parameter(name: str) -> str:
    if not name.isidentifier() or name in RESERVED:
        raise ValueError(f"must be a name of letters, digits and _, and none of {', '.join(sorted(RESERVED))}")
    return name


Parameter = Annotated[str, AfterValidator(_parameter)]


class Header(Table):
    """What concerns the whole file.

    Args:
        title: What is simulated, in a few words.
        extends: Case file that this one adds to and changes, relative to this one.
        units: Units of plain numbers and of all output; consistent ones follow from these.
        parameters: Numbers or functions of time of your own, for use in expressions.
    """

    title: str = ""
    extends: str | None = None
    units: Annotated[Units, FromTable(), AfterValidator(consistent)] = Field(default_factory=Units)
    parameters: dict[Parameter, Annotated[TimeValue, Varying(None)]] = Field(default_factory=dict)


class Parts(Table):
    """What is simulated.

    Args:
        mesh: Mesh: a file, or a built-in geometry.
        groups: Further groups of facets, cells and vertices by name, selected from those of the mesh.
        layers: Layers of a block, from the surface downwards; with the geometry "laminate".
        material: Material of bodies and layers that have none of their own.
        law: Cohesive law of cracks and layers that have none of their own.
        bodies: Bodies by name; by default one of all cells.
        cracks: Cracks by name.
        pairs: Pairs of surfaces that touch, by name.
        tools: Rigid tools by name.
        carriages: Rigid carriages by name, each of which carries tools that machines drive together.
        insertion: Insertion of a blade or needle along a crack, ready-made: cracks, supports and motion follow.
        supports: Prescribed displacements by name.
        links: Rigid parts of a test rig by name: plates that may turn, pins, levers.
        loads: Loads by name.
        heat: Heat.
    """

    mesh: Mesh
    groups: dict[Named, Selection] = Field(default_factory=dict)
    layers: tuple[Layer, ...] = ()
    material: AnyMaterial | None = None
    law: Law | None = None
    bodies: dict[Named, Body] = Field(default_factory=dict)
    cracks: dict[Named, Crack] = Field(default_factory=dict)
    pairs: dict[Named, Pair] = Field(default_factory=dict)
    tools: dict[Named, AnyTool] = Field(default_factory=dict)
    carriages: dict[Named, Carriage] = Field(default_factory=dict)
    insertion: AnyInsertion | None = None
    supports: dict[Named, Support] = Field(default_factory=dict)
    links: dict[Named, Link] = Field(default_factory=dict)
    loads: dict[Named, Load] = Field(default_factory=dict)
    heat: Heat | None = None

    def material_of(self, part: Body | Layer) -> Material:
        """Material of a body or a layer."""
        found = part.material or self.material
        assert found is not None
        return found

    def law_of(self, part: Crack | Layer) -> CohesiveLaw | None:
        """Cohesive law of a crack, None for contact only, or of a layer."""
        own = "law" in part.model_fields_set if isinstance(part, Crack) else part.law is not None
        return part.law if own else self.law


class CaseTables(Parts, Header):
    """The tables of a case file.

    Args:
        analysis: Analysis.
        steps: Step control: the first and the largest step, or a fixed one.
        solver: Solver.
        measures: Further columns of the history by name.
        output: Output.
        quick: Tables with a coarser mesh or a shorter run for a first try; they take part where this is asked for.
    """

    analysis: Analysis = Field(default_factory=Analysis)
    steps: Steps
    solver: Solver = Field(default_factory=Solver)
    measures: dict[Named, Measure] = Field(default_factory=dict)
    output: Output = Field(default_factory=Output)
    quick: dict[str, Any] = Field(default_factory=dict)

    @field_validator("*", mode="wrap")
    @classmethod
    def _note(cls, value: Any, validate: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:
        """Keep what is valid, to be compared with the rest whether or not that is valid too."""
        found = validate(value)
        if info.context is not None and info.field_name is not None:
            info.context.valid[info.field_name] = found
        return found
