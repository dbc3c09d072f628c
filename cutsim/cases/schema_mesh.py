"""Schema of case files: the mesh."""

from typing import Literal

from pydantic import Field, ValidationInfo, model_validator

from cutsim.base.units import Number
from cutsim.cases.tables import Flag, Free, Table


class Mesh(Table):
    """Mesh of the body: a built-in geometry, or a file.

    Args:
        geometry: Name of a built-in geometry; "laminate" is a block of the layers in ``[[layers]]``.
        set: Parameters of the geometry.
        file: File with a mesh and its groups, relative to the case file.
        scale: Length in the units of the case of one unit of the file.
        dim: Dimension of the mesh and of its space; by default that of the geometry, or 3 for a file.
        degree: Degree of the displacement.
        axisymmetric: Whether the mesh is the meridian plane of a body of revolution about x = 0.
    """

    geometry: str | None = None
    set: dict[str, Free] = Field(default_factory=dict)
    file: str | None = None
    scale: Number = 1.0
    dim: Literal[2, 3] | None = None
    degree: Literal[1, 2] = 1
    axisymmetric: Flag = False

    @model_validator(mode="after")
    def _one_source(self, info: ValidationInfo) -> "Mesh":
        if (self.geometry is None) == (self.file is None):
            raise ValueError("must have either a geometry or a file")
        if self.file is not None and self.set:
            raise ValueError("must not have parameters (set) beside a file: they are those of a geometry")
        return self
