"""Symmetric tensors at the integration points of cells, by their components."""

from functools import cached_property

import basix
import basix.ufl
import numpy as np
import ufl
from dolfinx import fem
from dolfinx.mesh import Mesh
from numpy.typing import NDArray

from cutsim.base.assembly import Array
from cutsim.base.compat import evaluate, expression
from cutsim.base.kinematics import Expr
from cutsim.base.memory import Memory
from cutsim.base.places import Places


class TensorPoints:
    """Integration points of cells, and the components of a symmetric tensor that are not zero there.

    In the plane these are the components in it and the one normal to it.  Arrays of components have the shape
    (cells, points, components).

    Args:
        mesh: The mesh.
        cells: Local cells.
        degree: Degree of the quadrature rule.

    Attributes:
        mesh: As above.
        cells: As above.
        degree: As above.
        pairs: Row and column of each component, the row not below the column.
        conjugate: How often each component counts in the product of two tensors.
        points: Points of the rule in the reference cell ...
        weights: ... and their weights.
    """

    def __init__(self, mesh: Mesh, cells: NDArray[np.int32], degree: int) -> None:
        gdim = mesh.geometry.dim
        self.mesh, self.cells, self.degree = mesh, cells, degree
        self.pairs = [(i, j) for i in range(gdim) for j in range(i, gdim)] + [(2, 2)] * (gdim == 2)
        self.conjugate = np.array([1.0 if i == j else 2.0 for i, j in self.pairs])
        self.points, self.weights = basix.make_quadrature(basix.CellType[mesh.topology.cell_name()], degree)

    @cached_property
    def dofs(self) -> NDArray[np.int32]:
        """Local dof of each point of each cell, in a space of any number of components."""
        dofs: NDArray[np.int32] = self._scalar.dofmap.list[self.cells]
        return dofs

    def places(self, axis: int = 0) -> Places:
        """Places of arrays of components whose cells are counted by an axis, and their points by the next one."""
        return Places(self._scalar, self.dofs, axis)

    @cached_property
    def _scalar(self) -> fem.FunctionSpace:
        return self.space()

    def space(self, *shape: int) -> fem.FunctionSpace:
        """Space of functions with values of a shape at the points."""
        name = self.mesh.topology.cell_name()
        return fem.functionspace(self.mesh, basix.ufl.quadrature_element(name, value_shape=shape, degree=self.degree))

    def tensor(self, components: Expr) -> Expr:
        """The tensor, 3 × 3, of a vector that begins with its components."""
        order = {pair: k for k, pair in enumerate(self.pairs)}
        places = [[order.get((min(i, j), max(i, j))) for j in range(3)] for i in range(3)]
        return ufl.as_matrix([[0 if k is None else components[k] for k in row] for row in places])

    def compiled(self, *tensors: Expr) -> fem.Expression:
        """The components of tensors, one tensor after the other. Collective."""
        entries = [tensor[i, j] for tensor in tensors for i, j in self.pairs]
        return expression(ufl.as_vector(entries), self.points, self.mesh)

    def values(self, compiled: fem.Expression) -> Array:
        """Values of a compiled expression at the points, shape (cells, points, entries)."""
        size = int(np.prod(compiled.ufl_expression.ufl_shape))
        return evaluate(compiled, self.mesh, self.cells).reshape(len(self.cells), len(self.points), size)


class TensorField:
    """Symmetric tensor at the integration points for forms, with its means over the cells for output.

    Args:
        name: Name in the memory.
        memory: Memory of the run.
        points: The points.

    Attributes:
        tensor: The tensor, 3 × 3, for forms over the body with the rule of the points.
        mean: Its mean over each cell, 3 × 3.
    """

    def __init__(self, name: str, memory: Memory, points: TensorPoints) -> None:
        self._points, self._size = points, len(points.pairs)
        self._values = fem.Function(points.space(self._size))
        self._means = fem.Function(fem.functionspace(points.mesh, ("DG", 0, (self._size,))))
        memory.array(name, self._values)
        memory.array(f"{name}, means", self._means)
        self.tensor, self.mean = points.tensor(self._values), points.tensor(self._means)

    def set(self, values: Array) -> None:
        """Set the components, shape (cells, points, components)."""
        points = self._points
        self._values.x.array.reshape(-1, self._size)[points.dofs] = values
        means = np.tensordot(values, points.weights / points.weights.sum(), ([1], [0]))
        dofs = self._means.function_space.dofmap.list[points.cells, 0]
        self._means.x.array.reshape(-1, self._size)[dofs] = means


def all_cells(mesh: Mesh) -> NDArray[np.int32]:
    """All local cells, ghosts included."""
    index_map = mesh.topology.index_map(mesh.topology.dim)
    return np.arange(index_map.size_local + index_map.num_ghosts, dtype=np.int32)
