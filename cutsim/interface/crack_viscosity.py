"""Viscous regularisation of the bond between the faces of a crack (docs/theory.md §3.2)."""

import ufl

from cutsim.base.assembly import Array, nodal_forces
from cutsim.base.compat import EntityMaps, form
from cutsim.base.kinematics import Expr
from cutsim.base.terms import Term
from cutsim.interface.crack_friction import Faced
from cutsim.interface.viscous import ViscousBond, ViscousHistory


class CrackViscosity(Term):
    """Viscous traction between the faces of a crack, which makes this term by itself if its law has a viscosity.

    Args:
        crack: The crack.
        law: Its law.
    """

    symmetric = False

    def __init__(self, crack: Faced, law: ViscousBond) -> None:
        self.crack, self.name = crack, f"{crack.name}_viscosity"
        state = crack.state
        response, tangents = crack.faces.response(state.u), crack.faces.frame(state.u)
        self._axes = (response.normal, *tangents)
        jump = [response.opening, *(ufl.dot(response.jump, a) for a in tangents)]
        self._history = ViscousHistory(state, crack.name, crack.points, law, jump, response.damage)
        self._rate_form = form(self.residual(ufl.TestFunction(state.V)), entity_maps=self.entity_maps)

    @property
    def entity_maps(self) -> EntityMaps:
        """Map from facets of the mesh to cells of the crack's submesh."""
        return self.crack.points.entity_maps

    def residual(self, v: Expr) -> ufl.Form:
        """Virtual work ∫ t·(v⁻ − v⁺) dΓ₀; the traction acts as t on the '+' face."""
        traction = sum(self._history.traction[i] * a for i, a in enumerate(self._axes))
        return self.crack.faces.virtual_work(traction, v)

    def evaluate(self) -> None:
        """Dissipation of the trial step. Collective."""
        self._history.evaluate()

    def rate_forces(self) -> Array:
        """All of its forces. Collective."""
        return nodal_forces(self._rate_form)

    def energies(self) -> dict[str, float]:
        """Energy dissipated so far. Collective."""
        return {"cohesive_viscous": self.viscous_work}

    @property
    def viscous_work(self) -> float:
        """The same [energy]."""
        return self.crack.faces.sides.share * self._history.dissipated()
