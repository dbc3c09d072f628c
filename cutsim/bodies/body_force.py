"""Body forces: loads throughout the volume of a solid, such as its weight."""

from typing import Literal

import numpy as np
import ufl
from dolfinx import default_scalar_type, fem
from numpy.typing import NDArray

from cutsim.base.assembly import nodal_forces
from cutsim.base.checks import require, require_numbers
from cutsim.base.compat import form
from cutsim.base.kinematics import Expr
from cutsim.base.parameters import TimeFunction
from cutsim.base.signatures import checked
from cutsim.bodies.loads import Load
from cutsim.bodies.solid import Solid
from cutsim.fields.state import State


class BodyForce(Load):
    """Force of fixed direction on all of a solid, per mass or per reference volume; a dead load.

    Weight is the force per mass whose vector is the acceleration of gravity, such as ``(0.0, -9810.0)`` in mm/s².  A
    factor that grows with time applies it gradually.

    Args:
        state: Displacement and time.
        solid: The body; its density is that of the reference state.
        vector: Force per mass [length/time²] or per volume [force/length³] at factor 1, one number a component.
        factor: Number or function of time that scales it.
        per: "mass" or "volume".
        name: Name in messages and output.
        corners: Times at which the factor has a kink.

    Raises:
        ValueError: The vector has the wrong number of components, or a force per mass acts on a solid without density.
    """

    @checked
    def __init__(
        self,
        state: State,
        solid: Solid,
        vector: tuple[float, ...],
        factor: float | TimeFunction = 1.0,
        *,
        per: Literal["mass", "volume"] = "mass",
        name: str = "body_force",
        corners: tuple[float, ...] = (),
    ) -> None:
        require_numbers("vector", vector, length=state.mesh.geometry.dim)
        density = solid.density if per == "mass" else 1.0
        known = density is not None
        require("solid", f"{solid.name!r} without density", known, "a solid with a density, or per = 'volume'")
        super().__init__(state, factor, "factor", name, corners)
        self._density = fem.Constant(state.mesh, density * np.array(vector, dtype=default_scalar_type))
        self._dx = state.measures.cells(solid.cells)
        self._form = form(self.residual(ufl.TestFunction(state.V)))

    def residual(self, v: Expr) -> ufl.Form:
        """Minus the virtual work of the force."""
        return -self._factor.constant * ufl.dot(self._density, v) * self._dx

    def _nodal_forces(self) -> NDArray[np.float64]:
        return -nodal_forces(self._form)
