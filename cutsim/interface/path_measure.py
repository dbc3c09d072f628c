"""Energy that a bond loses in a step, as a form of the displacement: the measure of a path (docs/theory.md §5)."""

from functools import cached_property

import ufl
from dolfinx import fem, la

from cutsim.base.assembly import Array, integrate
from cutsim.base.compat import form
from cutsim.base.functions import positive_part
from cutsim.base.kinematics import Expr
from cutsim.fields.state import State
from cutsim.interface.crack_faces import CrackFaces
from cutsim.interface.history import InterfaceHistory
from cutsim.interface.sides import Sides


def step_loss(memory: Expr, secants: tuple[Expr, Expr], before: tuple[Expr, Expr], now: tuple[Expr, Expr]) -> Expr:
    """Loss ½ Σ (K_i,old − K_i) δ_i,old δ_i over the modes at a point [energy per reference area].

    With the smallest secants K this is the exact dissipation of a step along a straight softening branch.  Elsewhere it
    is exact to first order in the step, which is all that a path parameter needs: the audit goes by
    `cutsim.interface.dissipation`.

    Args:
        memory: Smallest secants at the start of the step ...
        secants: ... and at its end.
        before: Opening, of either sign, and sliding ≥ 0 at the start ...
        now: ... and at the end.
    """
    opened = positive_part(before[0]) * positive_part(now[0])
    return 0.5 * ((memory[0] - secants[0]) * opened + (memory[1] - secants[1]) * before[1] * now[1])


class PathMeasure:
    """What the bond of a crack loses in a step, by `step_loss`.

    Args:
        state: Displacement and time.
        sides: Sides of the crack.
        faces: Law between its faces.
        history: Smallest secants at the start of the step.
    """

    def __init__(self, state: State, sides: Sides, faces: CrackFaces, history: InterfaceHistory) -> None:
        self._state, self._sides, self._faces, self._history = state, sides, faces, history

    @cached_property
    def _forms(self) -> tuple[fem.Form, fem.Form]:
        """Loss and derivative: compiled when a path is followed for the first time, which most runs never do."""
        state, points = self._state, self._sides.points
        before, now = self._faces.response(state.u_old), self._faces.response(state.u)
        jumps = ((r.opening, r.sliding) for r in (before, now))
        loss = self._sides.share * step_loss(points.at(self._history.secants), now.secants, *jumps) * points.measure
        slope = ufl.derivative(loss, state.u, ufl.TestFunction(state.V))
        return form(loss, entity_maps=points.entity_maps), form(slope, entity_maps=points.entity_maps)

    @cached_property
    def _vector(self) -> la.Vector:
        """A vector of the displacement, kept: on many ranks making one costs more than filling it."""
        dofmap = self._state.V.dofmap
        return la.vector(dofmap.index_map, dofmap.index_map_bs)

    def __call__(self) -> tuple[float, Array]:
        """Loss [energy], and its derivative, owned entries [force]. Collective."""
        loss, slope = self._forms
        b = self._vector
        b.array[:] = 0.0
        fem.assemble_vector(b.array, slope)
        b.scatter_reverse(la.InsertMode.add)
        return integrate(loss), b.array[: len(self._state.increment)].copy()
