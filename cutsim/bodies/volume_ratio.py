"""Smallest volume ratio of a body, which tells how near its elements are to inversion."""

from functools import cached_property

import basix
import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.base.compat import evaluate, expression
from cutsim.bodies.formulations import Cells, Formulation


class VolumeRatio:
    """Volume ratio det F at the integration points of a body.

    Args:
        formulation: Of the body.
        cells: Local cells of the body, all by default.
    """

    def __init__(self, formulation: Formulation, cells: Cells) -> None:
        self._elasticity, self._measure, self._cells = formulation.elasticity, formulation.measures[0], cells

    def smallest(self) -> float:
        """The smallest one at the present displacement, minus infinity where it is not finite. Collective."""
        mesh = self._elasticity.state.mesh
        values = evaluate(self._compiled, mesh, self._owned)
        local = float(np.nan_to_num(values, nan=-np.inf).min()) if values.size else np.inf
        return float(mesh.comm.allreduce(local, op=MPI.MIN))

    @property
    def _owned(self) -> NDArray[np.int32]:
        topology = self._elasticity.state.mesh.topology
        owned = topology.index_map(topology.dim).size_local
        return np.arange(owned, dtype=np.int32) if self._cells is None else self._cells[self._cells < owned]

    @cached_property
    def _compiled(self) -> fem.Expression:
        state = self._elasticity.state
        cell = basix.CellType[state.mesh.topology.cell_name()]
        points = basix.make_quadrature(cell, self._measure.metadata()["quadrature_degree"])[0]
        return expression(ufl.det(self._elasticity.deformation_gradient(state.u)), points, state.mesh)
