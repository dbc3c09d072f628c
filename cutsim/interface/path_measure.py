"""Energy that a bond loses in a step, as a form of the displacement: the measure of a path (docs/theory.md §5)."""

from functools import cached_property

import ufl
from dolfinx import fem

from cutsim.base.assembly import Array, integrate, nodal_forces
from cutsim.base.compat import form
from cutsim.base.functions import positive_part
from cutsim.fields.points import FacetPoints
from cutsim.fields.state import State
from cutsim.interface.crack_faces import CrackFaces
from cutsim.interface.history import InterfaceHistory


class PathMeasure:
    """Loss ½ Σ (K_i,old − K_i) δ_i,old δ_i over the modes, integrated over a crack.

    With the smallest secants K this is the exact dissipation of a step along a straight softening branch.  Elsewhere it
    is exact to first order in the step, which is all that a path parameter needs: the audit goes by
    `cutsim.interface.dissipation`.

    Args:
        state: Displacement and time.
        points: Integration points of the crack.
        faces: Law between its faces.
        history: Smallest secants at the start of the step.
    """

    def __init__(self, state: State, points: FacetPoints, faces: CrackFaces, history: InterfaceHistory) -> None:
        self._state, self._points, self._faces, self._history = state, points, faces, history

    @cached_property
    def _forms(self) -> tuple[fem.Form, fem.Form]:
        """Loss and derivative: compiled when a path is followed for the first time, which most runs never do."""
        state, points = self._state, self._points
        before, now = self._faces.response(state.u_old), self._faces.response(state.u)
        memory = points.at(self._history.secants)
        softened = [memory[i] - now.secants[i] for i in (0, 1)]
        opened = positive_part(before.opening) * positive_part(now.opening)
        loss = 0.5 * (softened[0] * opened + softened[1] * before.sliding * now.sliding) * points.measure
        slope = ufl.derivative(loss, state.u, ufl.TestFunction(state.V))
        return form(loss, entity_maps=points.entity_maps), form(slope, entity_maps=points.entity_maps)

    def __call__(self) -> tuple[float, Array]:
        """Loss [energy], and its derivative, owned entries [force]. Collective."""
        loss, slope = self._forms
        return integrate(loss), nodal_forces(slope)
