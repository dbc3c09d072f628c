"""Guide that keeps the middle of a crack in its plane (docs/theory.md §4)."""

import ufl
from dolfinx import default_scalar_type, fem

from cutsim.base.assembly import integrate
from cutsim.base.checks import positive, require_number
from cutsim.base.compat import EntityMaps, form
from cutsim.base.kinematics import Expr
from cutsim.base.signatures import checked
from cutsim.base.terms import Term
from cutsim.interface.crack import Crack

# measured: firm enough that the mouth of a crack does not slip off a blunt tip
_FACTOR = 100.0


class Guide(Term):
    """Elastic guide of the middle of a plane crack: k m acts against its displacement m = ½(u⁺ + u⁻)·N off the plane.

    A smooth blunt tip rests on an intact surface like a ball on a ball: once the crack opens a little, its mouth slips
    off to one side, and the tool glides along one half.  Where body, tool and motion are alike on both sides of the
    plane, m = 0 is an equilibrium; the guide makes it the stable one and does not change it.

    Args:
        crack: The crack.
        stiffness: k > 0 [stress/length]; by default 100 E/h.

    Raises:
        ValueError: The stiffness is not positive.
    """

    @checked
    def __init__(self, crack: Crack, stiffness: float | None = None) -> None:
        require_number("stiffness", stiffness, positive.or_none)
        self.name, self._crack, mesh = f"{crack.name}_guide", crack, crack.state.mesh
        firm = stiffness or _FACTOR * crack.young / crack.normal_size
        self._stiffness = fem.Constant(mesh, default_scalar_type(firm))
        stored = 0.5 * self._stiffness * self._off_plane(crack.state.u) ** 2
        self._energy_form = form(stored * crack.points.measure, entity_maps=self.entity_maps)

    @property
    def entity_maps(self) -> EntityMaps:
        """Map from facets of the mesh to cells of the crack's submesh."""
        return self._crack.entity_maps

    def residual(self, v: Expr) -> ufl.Form:
        """Virtual work ∫ k m δm dΓ₀."""
        pressure = self._stiffness * self._off_plane(self._crack.state.u)
        return pressure * self._off_plane(v) * self._crack.points.measure

    def energies(self) -> dict[str, float]:
        """Energy of the guide, with that of the contacts; 0 as long as both sides are alike. Collective."""
        return {"contact": integrate(self._energy_form)}

    def _off_plane(self, u: Expr) -> Expr:
        """Displacement of the middle of the crack along its reference normal [length]."""
        return 0.5 * ufl.dot(u("+") + u("-"), ufl.FacetNormal(self._crack.state.mesh)("+"))
