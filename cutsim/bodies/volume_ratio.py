"""Smallest volume ratio of a body, which tells how near its elements are to inversion."""

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
        self._counted.x.array[self._owned] = self._least < ratio
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
    def _counted(self) -> fem.Function:
        """1 in the elements whose energy is counted, 0 in the others."""
        return fem.Function(fem.functionspace(self._elasticity.state.mesh, ("DG", 0)))

    @cached_property
    def _energy(self) -> fem.Form:
        state, formulation = self._elasticity.state, self._formulation
        parts = formulation.parts(self._elasticity.deformation_gradient(state.u))
        return form(sum(self._counted * W * dx for W, dx in zip(parts, formulation.measures, strict=True)))
