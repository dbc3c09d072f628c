"""Smallest volume ratio of a body, which tells how near its elements are to inversion."""

from dataclasses import dataclass
from functools import cached_property

import basix
import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.base.assembly import integrate
from cutsim.base.compat import evaluate, expression, form
from cutsim.bodies.formulations import Cells, Formulation


@dataclass(frozen=True)
class Turned:
    """Elements that are turned over at a node.

    Attributes:
        smallest: The smallest volume ratio at a node, < 0.
        place: Where this node is in the reference configuration [length].
        energy: Strain energy that all such elements hold [energy].
    """

    smallest: float
    place: NDArray[np.float64]
    energy: float


class VolumeRatio:
    """Volume ratio det F at the integration points of a body.

    Args:
        formulation: Of the body.
        cells: Local cells of the body, all by default.
    """

    def __init__(self, formulation: Formulation, cells: Cells) -> None:
        self._formulation, self._cells = formulation, cells
        self._elasticity = formulation.elasticity

    def smallest(self) -> float:
        """The smallest one at the present displacement, minus infinity where it is not finite. Collective."""
        local = float(self._least.min(initial=np.inf))
        return float(self._elasticity.state.mesh.comm.allreduce(local, op=MPI.MIN))

    def held_below(self, ratio: float) -> float:
        """Strain energy of the elements that have a point at which the ratio is below this [energy]. Collective."""
        return self._held(self._least < ratio)

    def turned(self) -> Turned | None:
        """Elements that are turned over at a node. Collective.

        Out of the plane, and around an axis of revolution, nothing turns over: what counts there is the plane.

        Returns:
            None if there is no such element, or if none can be turned over at a node without being so everywhere.
        """
        if self._at_nodes is None:
            return None
        state = self._elasticity.state
        values = evaluate(self._at_nodes, state.mesh, self._owned)
        found: tuple[float, list[float]] = (0.0, [])
        if values.min(initial=0.0) < 0:
            cell, node = np.unravel_index(values.argmin(), values.shape)
            at = state.V.dofmap.list[self._owned[cell], node]
            found = float(values[cell, node]), state.V.tabulate_dof_coordinates()[at].tolist()
        smallest, place = min(state.mesh.comm.allgather(found))
        if not place:
            return None
        return Turned(smallest, np.array(place[: state.mesh.geometry.dim]), self._held(values.min(axis=1) < 0))

    def held(self, cells: NDArray[np.bool_]) -> tuple[float, float]:
        """Strain energy and reference volume of the body in some of the owned cells of the mesh. Collective."""
        energy = self._held(cells[self._owned])
        return energy, integrate(self._room)  # of the cells that have just been counted

    def _held(self, where: NDArray[np.bool_]) -> float:
        """Strain energy of some of the owned cells of the body [energy]. Collective."""
        self._counted.x.array[self._owned] = where
        return integrate(self._energy)

    @property
    def _least(self) -> NDArray[np.float64]:
        """The smallest one in each owned cell of the body."""
        values = evaluate(self._compiled, self._elasticity.state.mesh, self._owned)
        return np.asarray(np.nan_to_num(values, nan=-np.inf).min(axis=1, initial=np.inf))

    @property
    def _owned(self) -> NDArray[np.int32]:
        topology = self._elasticity.state.mesh.topology
        owned = topology.index_map(topology.dim).size_local
        return np.arange(owned, dtype=np.int32) if self._cells is None else self._cells[self._cells < owned]

    @cached_property
    def _compiled(self) -> fem.Expression:
        state = self._elasticity.state
        cell = basix.CellType[state.mesh.topology.cell_name()]
        points = basix.make_quadrature(cell, self._formulation.measures[0].metadata()["quadrature_degree"])[0]
        return expression(ufl.det(self._elasticity.deformation_gradient(state.u)), points, state.mesh)

    @cached_property
    def _at_nodes(self) -> fem.Expression | None:
        """The ratio in the plane or in space at the nodes; None where it is the same all over an element."""
        state = self._elasticity.state
        element = state.V.element.basix_element
        simplex = element.cell_type in (basix.CellType.triangle, basix.CellType.tetrahedron)
        if simplex and element.degree == 1:
            return None
        F = ufl.Identity(state.mesh.geometry.dim) + ufl.grad(state.u)
        return expression(ufl.det(F), element.points, state.mesh)

    @cached_property
    def _counted(self) -> fem.Function:
        """1 in the elements whose energy is counted, 0 in the others."""
        return fem.Function(fem.functionspace(self._elasticity.state.mesh, ("DG", 0)))

    @cached_property
    def _energy(self) -> fem.Form:
        state, formulation = self._elasticity.state, self._formulation
        parts = formulation.parts(self._elasticity.deformation_gradient(state.u))
        return form(sum(self._counted * W * dx for W, dx in zip(parts, formulation.measures, strict=True)))

    @cached_property
    def _room(self) -> fem.Form:
        return form(self._counted * self._formulation.measures[0])
