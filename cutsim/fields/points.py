"""Integration points on facets: history variables, evaluation of expressions, and sums."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import basix.ufl
import numpy as np
import ufl
from dolfinx import fem, la
from dolfinx.mesh import Mesh
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.base.checks import count, require_number
from cutsim.base.compat import EntityMaps, create_submesh, form
from cutsim.base.kinematics import Expr
from cutsim.base.places import Places, corners, facet_order
from cutsim.base.signatures import checked
from cutsim.fields.faces import Face
from cutsim.fields.state import State

#: Degree of the quadrature on interfaces and tool surfaces.
DEGREE = 4

Values = NDArray[np.float64]


class FacetPoints:
    """Integration points of a facet measure, with their values and weights.

    Arrays of point values have the shape (local facets, points) or, for vectors, (local facets, points, components), in
    the order of `facets`; they are equal on owner and ghosts.

    Args:
        mesh: The mesh.
        facets: Local facets, ghosts included.
        measure: Measure over them, interior if `interior`.
        interior: Whether the facets have a cell on either side.
        degree: Degree of the quadrature.
        ordered: Whether values are stored for the points of a facet in an order that does not depend on the ranks,
            as who computes them has it; else in that of the quadrature, in which forms see them.

    Attributes:
        comm: Communicator of the mesh.
        degree: Degree of the quadrature.
        measure: The measure, with its quadrature rule.
        submesh: Mesh of the facets, on which history functions live.
        facets: Local facet of the parent mesh for each cell of the submesh.
        weights: Weights of the points in the reference configuration [length or area].
    """

    def __init__(
        self,
        mesh: Mesh,
        facets: NDArray[np.int32],
        measure: ufl.Measure,
        *,
        interior: bool,
        degree: int = DEGREE,
        ordered: bool = False,
    ) -> None:
        require_number("degree", degree, count(1))
        fdim = mesh.topology.dim - 1
        # that of the submesh, which dies with the points, would do: but mpi4py keeps a lock with each communicator that
        # Python objects went through, and freeing it while an exception is under way blocks all that come after
        self.comm = mesh.comm
        self._interior, self.degree, self._ordered = interior, degree, ordered
        self.measure = measure(metadata={"quadrature_degree": degree, "quadrature_scheme": "default"})
        unique = np.unique(np.asarray(facets, dtype=np.int32))
        self.submesh, self.facets, self._entity_map = create_submesh(mesh, fdim, unique)
        self._owned = self.submesh.topology.index_map(fdim).size_local
        self.weights = self._rule = self._assemble({"one": ufl.as_ufl(1.0)})()["one"]

    @property
    def entity_maps(self) -> EntityMaps:
        """Map between facets of the mesh and cells of the submesh, for forms with functions of these points."""
        return {self.submesh: self._entity_map}

    @property
    def xi(self) -> Values:
        """Reference coordinates of `ordered` points on their facets, shape (local facets, points, directions)."""
        places = basix.make_quadrature(basix.CellType[self.submesh.topology.cell_name()], self.degree)[0]
        return np.broadcast_to(places, (len(self.facets), *places.shape))

    def function(self, components: int = 1) -> fem.Function:
        """A function with a value, or a vector of values, at each point."""
        return fem.Function(self._space(components))

    @cached_property
    def places(self) -> Places:
        """Places of arrays of point values."""
        space = self._space(1)
        return Places(space, space.dofmap.list, cells=self._dofs)

    @property
    def flat_places(self) -> Places:
        """Places of arrays of point values that are flattened over the facets."""
        return replace(self.places, dofs=self.places.dofs.ravel())

    @property
    def function_places(self) -> Places:
        """Places of the values of a function made by `function`."""
        return replace(self.places, dofs=np.arange(self.weights.size))

    def _dofs(self) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """The facets, and the dofs of their points in an order that does not depend on the ranks. Collective."""
        dofs = self.places.dofs
        facets = np.arange(len(dofs), dtype=np.int32)
        if not self._ordered:
            x = self.evaluator({"x": self.at(ufl.SpatialCoordinate(self.measure.ufl_domain()))})()["x"]
            dofs = np.take_along_axis(dofs, facet_order(x, corners(self.submesh, facets)[1]), axis=1)
        return facets, np.asarray(dofs)

    def at(self, f: fem.Function) -> Expr:
        """A function of the points as it enters a form over them."""
        return f("+") if self._interior else f

    def get(self, f: fem.Function) -> Values:
        """Point values of a function made by `function`."""
        dofs, bs = f.function_space.dofmap.list, f.function_space.dofmap.index_map_bs
        values = f.x.array.reshape(-1, bs)[dofs]
        return values if bs > 1 else values[..., 0]

    def set(self, f: fem.Function, values: Values) -> None:
        """Assign point values to a function made by `function`."""
        dofs, bs = f.function_space.dofmap.list, f.function_space.dofmap.index_map_bs
        f.x.array.reshape(-1, bs)[dofs] = values.reshape(*dofs.shape, bs)

    def evaluator(self, expressions: Mapping[str, Expr]) -> Callable[[], dict[str, Values]]:
        """Compile expressions, restricted as in a form over the points.

        Args:
            expressions: Scalars and vectors by name.

        Returns:
            A collective function without arguments that gives the present values by name.
        """
        assemble = self._assemble(expressions)

        def evaluate() -> dict[str, Values]:
            # the transposed weights broadcast over scalars and vectors alike
            return {name: (values.T / self._rule.T).T for name, values in assemble().items()}

        return evaluate

    def integral(self, values: Values) -> float:
        """Integral over the facets of point values. Collective."""
        owned = slice(0, self._owned)
        return float(self.comm.allreduce((values * self.weights)[owned].sum(), op=MPI.SUM))

    def area_above(self, values: Values, level: float) -> float:
        """Area where point values exceed a level, the edge of it placed within the facets. Collective."""
        share = (self.weights.T / self.weights.sum(axis=1)).T
        mean = (share * values).sum(axis=1, keepdims=True)
        # a linear function on a segment, or along a side of a rectangle, has this range
        spread = np.sqrt(12 * (share * (values - mean) ** 2).sum(axis=1, keepdims=True))
        own = spread * share ** (1 / self.submesh.topology.dim)
        steep = 1e-12 * np.maximum(np.abs(values), abs(level)) + np.finfo(float).tiny
        return self.integral(np.clip(0.5 + (values - level) / np.maximum(own, steep), 0.0, 1.0))

    def maximum(self, values: Values) -> float:
        """Largest point value, −∞ if there is no point. Collective."""
        return float(self.comm.allreduce(float(values[: self._owned].max(initial=-np.inf)), op=MPI.MAX))

    def count(self, where: NDArray[np.bool_]) -> int:
        """Number of points at which something holds. Collective."""
        return int(self.comm.allreduce(int(np.count_nonzero(where[: self._owned])), op=MPI.SUM))

    def facet_mean(self, values: Values) -> Values:
        """Mean over each local facet of point values."""
        return (values * self.weights).sum(axis=1) / self.weights.sum(axis=1)

    def mean(self, per_facet: Values) -> float:
        """Mean over all facets of one value per local facet, unweighted. Collective."""
        total = np.array([per_facet[: self._owned].sum(), self._owned])
        total = self.comm.allreduce(total, op=MPI.SUM)
        return float(total[0] / total[1])

    def median(self, per_facet: Values) -> float:
        """Median over all facets of one value per local facet. Collective."""
        return float(np.median(np.concatenate(self.comm.allgather(per_facet[: self._owned]))))

    def _space(self, components: int) -> fem.FunctionSpace:
        shape = () if components == 1 else (components,)
        cell = self.submesh.topology.cell_name()
        return fem.functionspace(
            self.submesh, basix.ufl.quadrature_element(cell, value_shape=shape, degree=self.degree)
        )

    def _assemble(self, expressions: Mapping[str, Expr]) -> Callable[[], dict[str, Values]]:
        """Expressions times weights: one vector form for all of them."""
        sizes = {name: int(np.prod(e.ufl_shape, dtype=int)) for name, e in expressions.items()}
        parts = [p for e in expressions.values() for p in ([e] if e.ufl_shape == () else [e[i] for i in range(len(e))])]
        space = self._space(len(parts))
        integrand = ufl.as_vector(parts) if len(parts) > 1 else parts[0]
        test = self.at(ufl.TestFunction(space))
        compiled = form(ufl.inner(integrand, test) * self.measure, entity_maps=self.entity_maps)
        dofs = space.dofmap.list

        def assemble() -> dict[str, Values]:
            b = fem.assemble_vector(compiled)
            b.scatter_reverse(la.InsertMode.add)
            b.scatter_forward()
            values = b.array.reshape(-1, len(parts))[dofs]
            columns = np.split(values, np.cumsum(list(sizes.values()))[:-1], axis=-1)
            return {
                name: column if e.ufl_shape else column[..., 0]
                for (name, e), column in zip(expressions.items(), columns, strict=True)
            }

        return assemble


@checked
@dataclass(frozen=True)
class Surface:
    """Surface that a tool can touch, a part of the outer boundary or a face of a crack: its integration points.

    Args:
        points: Integration points, over facets that are each seen from one cell.
    """

    points: FacetPoints

    @classmethod
    @checked
    def exterior(cls, state: State, facets: NDArray[np.int32], degree: int = DEGREE) -> "Surface":
        """A part of the outer boundary, given by its local facets, with a quadrature of some degree. Collective.

        Raises:
            ValueError: The degree is no positive integer.
        """
        measure = state.measures.exterior(facets)
        return cls(FacetPoints(state.mesh, facets, measure, interior=False, degree=degree))

    @classmethod
    @checked
    def of(cls, state: State, face: Face, degree: int = DEGREE) -> "Surface":
        """The surface of facets that are seen from one of their cells, with a quadrature of some degree. Collective.

        Raises:
            ValueError: The degree is no positive integer.
        """
        measure = state.measures.face(face)
        return cls(FacetPoints(state.mesh, face.facets, measure, interior=False, degree=degree))

    @property
    def measure(self) -> ufl.Measure:
        """Measure over the surface in the reference configuration."""
        return self.points.measure

    @property
    def entities(self) -> NDArray[np.int32]:
        """Rows (cell, local facet) of the facets that this rank integrates over."""
        return np.asarray(dict(self.measure.subdomain_data())[self.measure.subdomain_id()].reshape(-1, 2))
