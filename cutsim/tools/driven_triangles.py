"""Unknown translations of a tool whose contact is no form, from the tangent of that contact (docs/test_rigs.md).

Forces f of the contact depend on the places of the body's points relative to the tool.  So a translation e of the tool
changes them by −K e, with K the tangent of the contact and e the same translation of all nodes.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from cutsim.base.arrays import Array
from cutsim.base.assembly import owned_vector, summed
from cutsim.base.checks import require
from cutsim.base.lifetime import petsc_comm
from cutsim.base.terms import Assembler
from cutsim.fields.state import State
from cutsim.tools.driven_tool import DrivenPart, MachineAxes, owned_dofs


class DrivenAssembler(DrivenPart):
    """Contact of a driven tool that does not turn, which assembles itself.

    Args:
        state: Displacement and time.
        axes: Coordinates of the motion.
        move: Moves the tool to the end of the step.
        contact: The forces of the contact; their pattern never changes.
        nodes: Local nodes (blocked dofs) that it can touch.

    Raises:
        ValueError: A machine turns the tool.
    """

    def __init__(
        self,
        state: State,
        axes: MachineAxes,
        move: Callable[[], None],
        *,
        contact: Assembler,
        nodes: NDArray[np.int32],
    ) -> None:
        for i, c in enumerate(axes.motion.coordinates):
            axis = None if c.machine is None else c.machine.axis
            require(f"machines[{i}].axis", axis, not c.turns, "a translation for a tool of triangles")
        super().__init__(state.mesh.comm, axes, move, owned_dofs(state, nodes))
        self._contact = contact
        index_map, size = state.V.dofmap.index_map, state.V.dofmap.index_map_bs
        self._f = owned_vector(index_map, size)
        self._units = np.tile(axes.shifts, (1, index_map.size_local))
        n, total = index_map.size_local * size, index_map.size_global * size
        self._tangent = PETSc.Mat().createAIJ(((n, total), (n, total)), comm=petsc_comm(state.mesh.comm))
        self._tangent.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, False)
        self._tangent.setUp()
        contact.add_pattern(self._tangent)
        self._tangent.assemble()

    def reaction(self) -> Array:
        """Force of the body on the tool along each unknown at the present pose [force]. Collective."""
        self._f.set(0.0)
        self._contact.add_forces(self._f, None)
        self._f.assemble()
        return summed(self._comm, self._units @ self._f.array_r)

    def _products(self, multiply: str) -> Array:
        """Products of the contact's tangent, or its transpose, with the translations. Collective."""
        self._tangent.zeroEntries()
        self._contact.add_tangent(self._tangent)
        self._tangent.assemble()
        x, y = self._tangent.createVecs()
        found = np.empty_like(self._units)
        for unit, product in zip(self._units, found, strict=True):
            x.array[:] = unit
            getattr(self._tangent, multiply)(x, y)
            product[:] = y.array_r
        x.destroy()
        y.destroy()
        return found

    def rows(self) -> Array:
        """Derivative of it by the owned displacements, one row for each unknown. Collective."""
        return self._products("multTranspose")

    def columns(self) -> Array:
        """Derivative of the owned contact forces on the displacement by each unknown, one a row. Collective."""
        return -self._products("mult")

    def corner(self) -> Array:
        """Derivative of the reaction by the unknowns. Collective."""
        return summed(self._comm, self._units @ self.columns().T)
