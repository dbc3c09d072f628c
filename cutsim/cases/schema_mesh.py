"""Schema of case files: the mesh."""

from typing import Annotated, Literal

from pydantic import Discriminator, Field, Tag, model_validator

from cutsim.base.checks import above, require
from cutsim.base.units import Length, Number
from cutsim.cases.names import ExistingFile, Geometry, GeometryParameter, Groups
from cutsim.cases.tables import POSITIVE, Flag, Free, Table, within

Merge = Annotated[
    Annotated[Flag, Tag("<all>")] | Annotated[tuple[tuple[str, str], ...], Tag("<pairs>")],
    Discriminator(lambda value: "<pairs>" if isinstance(value, list | tuple) else "<all>"),
]


#: What stands in place of a size that follows from the tools and the laws of the case.
RULE = "rule"
#: Parameters of geometries that may be so: sizes along a crack, and with those at its mouth.
ALONG = ("lc", "size")
SIZES = (*ALONG, "entry")
# a number, of any kind or a length, or that word
_WHICH = Discriminator(lambda value: "<rule>" if value == RULE else "<number>")
_Parameter = Annotated[Annotated[Literal["rule"], Tag("<rule>")] | Annotated[Free, Tag("<number>")], _WHICH]
_Size = Annotated[Annotated[Literal["rule"], Tag("<rule>")] | Annotated[Length, POSITIVE, Tag("<number>")], _WHICH]


class Refine(Table):
    """Refinement of the triangles or tetrahedra of a file along some of its facets.

    Args:
        groups: Groups of facets, such as those of a crack.
        size: Longest edge on them, or "rule", by the tools and the laws of the case [length].
        growth: Ratio of the sizes of neighbouring elements away from them, > 1.
    """

    groups: Annotated[Groups, Field(min_length=1)]
    size: _Size = "rule"
    growth: Annotated[Number, within(above(1))] = 1.5


class Mesh(Table):
    """Mesh of the body: a built-in geometry, or a file.

    Args:
        geometry: Name of a built-in geometry; "laminate" is a block of the layers in ``[[layers]]``.
        set: Parameters of the geometry. Those that are sizes along a crack (lc, size) or at its mouth (entry) may be
            "rule", as they are in an insertion if they are left out: min(r, 0.4 ε) for tips of radius r and laws of the
            opening ε, and less at the mouth of a crack without notch.
        file: File with a mesh and its groups, relative to the case file.
        only: Groups of cells of the file that make the mesh; by default all its cells.
        scale: Length in the units of the case of one unit of the file.
        merge: Whether nodes of the file that lie on each other become one: true, false, or pairs of groups of cells
            between which they do.
        refine: Refinement of the triangles or tetrahedra of a file along a crack.
        dim: Dimension of the mesh and of its space; needed, but for a laminate, which is flat without a width.
        degree: Degree of the displacement.
        axisymmetric: Whether the mesh is the meridian plane of a body of revolution about x = 0.
        open: Groups of facets along which the body is cut from the start, with nothing between the faces.
    """

    geometry: Geometry | None = None
    set: dict[GeometryParameter, _Parameter] = Field(default_factory=dict)
    file: ExistingFile | None = None
    only: tuple[str, ...] = ()
    scale: Annotated[Number, POSITIVE] = 1.0
    merge: Merge = False
    refine: Refine | None = None
    dim: Literal[2, 3] | None = None
    degree: Literal[1, 2] = 1
    axisymmetric: Flag = False
    open: Groups = ()

    @model_validator(mode="after")
    def _one_source(self) -> "Mesh":
        if (self.geometry is None) == (self.file is None):
            raise ValueError("must have either geometry or file")
        require("merge", self.merge, self.geometry is None or not self.merge, "left out beside a geometry")
        require("only", list(self.only), self.geometry is None or not self.only, "left out beside a geometry")
        require("refine", self.refine, self.geometry is None or self.refine is None, "left out beside a geometry")
        for name, value in self.set.items():
            require(f"set.{name}", value, value != RULE or name in SIZES, "a number")
        require("set", list(self.set), self.file is None or not self.set, "left out beside a file")
        return self


Range = tuple[Length, Length]


class Selection(Table):
    """Group of facets, cells or vertices, selected from groups of the mesh by the coordinates of their middles.

    Args:
        facets: Groups of facets from which it is selected.
        cells: Groups of cells from which it is selected.
        vertices: Groups from whose vertices it is selected, of vertices, facets or cells: such as those of a line.
        points: Points to which the nearest vertices make the group [length].
        x: Lowest and highest x; by default any [length].
        y: Lowest and highest y [length].
        z: Lowest and highest z [length].
    """

    facets: Groups = ()
    cells: Groups = ()
    vertices: Groups = ()
    points: tuple[tuple[Length, ...], ...] = ()
    x: Range | None = None
    y: Range | None = None
    z: Range | None = None

    @model_validator(mode="after")
    def _one_source(self) -> "Selection":
        if sum(map(bool, (self.facets, self.cells, self.vertices, self.points))) != 1:
            raise ValueError("must have one of facets, cells, vertices and points")
        return self
