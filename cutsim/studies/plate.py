"""Rigid plate on which a body rests, slides with friction, and from which it may lift off."""

import numpy as np
import ufl
from dolfinx import default_scalar_type, fem

from cutsim.base.arrays import Array
from cutsim.base.assembly import integrate
from cutsim.base.compat import form
from cutsim.base.kinematics import Expr
from cutsim.fields.points import Surface
from cutsim.fields.sizes import global_range, normal_size
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.rubbing import AnyFriction
from cutsim.studies.body import CrackedBody
from cutsim.studies.frame import Facets, Frame
from cutsim.tools.shapes import Plane, ToolPath
from cutsim.tools.tool_contact import ToolContact

# penalty over E/h, and blend over h: a body that lies on the plate sinks in by less than a hundredth of an element
_FIRM, _BLEND = 50.0, 0.005
# stiffness of the springs over E/H
_SPRINGS = 1e-3


class RestingPlate(ToolContact):
    """Rigid plate on which a cracked body rests, from which it may lift off.

    A body that begins at zero gap and has no weight would float before the tool presses on it: nothing would resist its
    motion away from the plate.  Weak springs hold it there, with the stiffness 0.001 E/H per area, where H is the depth
    of the body.  Where a part of it lifts off by the way w, they pull it back with 0.001 E w/H.

    Args:
        body: The body.
        facets: Its facets on the plate.
        frame: Frame of the push; the plate lies at its depth H, at right angles to the push.
        friction: Friction of the body on the plate, a law, or the coefficient of Coulomb's; None for none.
    """

    def __init__(self, body: CrackedBody, facets: Facets, frame: Frame, friction: AnyFriction) -> None:
        state, young = body.state, body.cracks[-1].young
        smallest = global_range(state.mesh.comm, normal_size(state.mesh, facets))[0]
        self._stiffness = fem.Constant(state.mesh, default_scalar_type(_SPRINGS * young / frame.height))
        self._normal = fem.Constant(state.mesh, frame.push.astype(default_scalar_type))
        surface = Surface.exterior(state, facets)
        self._ds = surface.measure
        place: Array = frame.point(frame.height)
        super().__init__(
            state,
            Plane(tuple(-frame.push)),
            ToolPath(lambda _: np.array(place)),
            [surface],
            contact=PenaltyContact.automatic(young, smallest, _FIRM, blend=_BLEND * smallest),
            friction=friction,
            name="plate",
        )
        self._spring_energy = form(0.5 * self._stiffness * ufl.dot(state.u, self._normal) ** 2 * self._ds)

    def residual(self, v: Expr) -> ufl.Form:
        """Virtual work of contact and springs on the body."""
        pull = self._stiffness * ufl.dot(self.state.u, self._normal)
        return super().residual(v) + pull * ufl.dot(v, self._normal) * self._ds

    def energies(self) -> dict[str, float]:
        """Energy of the contact penalty and of the springs, and friction work so far. Collective."""
        return super().energies() | {"strain": integrate(self._spring_energy)}
