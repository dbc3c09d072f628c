"""Material directions in the reference configuration, for anisotropic solids and fibres.

A direction is a vector of any length: a tuple of two or three numbers, or, where it changes from place to place, a UFL
vector such as a `dolfinx.fem.Function`.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.mesh import Mesh
from numpy.typing import NDArray

from cutsim.base.checks import finite, require
from cutsim.base.kinematics import Expr
from cutsim.base.signatures import checked

Direction = tuple[float, ...] | Expr


@checked
def piecewise_direction(mesh: Mesh, regions: Mapping[tuple[float, ...], NDArray[np.int32]]) -> fem.Function:
    """A direction for each region of cells, as a function that is constant in every cell.

    Args:
        mesh: The mesh.
        regions: Local cells (ghosts included) by direction, a tuple of three numbers.

    Raises:
        ValueError: A direction is not three numbers, or zero.
    """
    field = fem.Function(fem.functionspace(mesh, ("Discontinuous Lagrange", 0, (3,))))
    values = field.x.array.reshape(-1, 3)
    for direction, cells in regions.items():
        require_direction("direction", direction)
        values[cells] = direction
    return field


def squared_stretch(F: Expr, direction: Direction) -> Expr:
    """Squared stretch I₄ = a·Ca along a direction a of the reference configuration."""
    image = F * normalised(direction)
    return ufl.dot(image, image)


def normalised(direction: Direction) -> Expr:
    """A direction as a UFL vector of length one and three components."""
    components = list(direction) if isinstance(direction, tuple) else [direction[i] for i in range(len(direction))]
    a = ufl.as_vector(components + [0.0] * (3 - len(components)))
    return a / ufl.sqrt(ufl.dot(a, a))


def stretches_in(F: Expr, axes: tuple[Direction, Direction]) -> list[list[Expr]]:
    """Components of C = FᵀF along two directions at right angles and their vector product."""
    first, second = (normalised(a) for a in axes)
    images = [F * e for e in (first, second, ufl.cross(first, second))]
    upper = {(i, j): ufl.dot(images[i], images[j]) for i in range(3) for j in range(i, 3)}
    return [[upper[min(i, j), max(i, j)] for j in range(3)] for i in range(3)]


def require_direction(name: str, direction: Any) -> None:
    """Refuse what is not a direction.

    Raises:
        ValueError: A tuple of other than two or three numbers, or zero; or an expression of another shape.
    """
    constant = isinstance(direction, tuple)
    shape = (len(direction),) if constant else getattr(direction, "ufl_shape", None)
    valid = shape in ((2,), (3,)) and (not constant or (all(d in finite for d in direction) and any(direction)))
    require(name, direction, valid, "two or three numbers, not all zero, or a UFL vector of that size")


def require_axes(axes: tuple[Direction, Direction]) -> None:
    """Refuse what are not two directions at right angles.

    Raises:
        ValueError: One is not a direction, or both are constant and not at right angles.
    """
    for axis in axes:
        require_direction("axes", axis)
    if all(isinstance(a, tuple) for a in axes):
        first, second = (np.array([*a, 0.0][:3]) / np.linalg.norm(a) for a in axes)
        require("axes", axes, bool(abs(first @ second) < 1e-9), "at right angles")
