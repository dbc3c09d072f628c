"""A rigid tool in the body: contact on outer surfaces and crack faces, friction, reactions (docs/theory.md §4)."""

import logging
from collections.abc import Sequence

import numpy as np
import ufl
from dolfinx import default_scalar_type, fem
from numpy.typing import NDArray

from cutsim.assembly import global_dot, integrate, moment, nodal_forces, resultant
from cutsim.checks import require
from cutsim.compat import form
from cutsim.contact import Coulomb, PenaltyContact
from cutsim.kinematics import Expr, tangential
from cutsim.parameters import with_constants
from cutsim.points import Surface
from cutsim.state import State
from cutsim.terms import Term
from cutsim.tools import Path, Shape

logger = logging.getLogger(__name__)

_AXES = "xyz"


class ToolContact(Term):
    """Contact between a moving rigid tool and some surfaces of the body.

    Args:
        state: Displacement and time.
        shape: Signed distance of the tool.
        path: Motion of its reference point.
        surfaces: Surfaces the tool can touch; each side of a crack by itself.
        contact: Contact law; the pressure acts per reference area.
        friction: Friction law against the slip relative to the tool, None for a frictionless tool.
        name: Name in messages and output.

    Raises:
        ValueError: No surface is given, or the path has another dimension than the mesh.
    """

    def __init__(
        self,
        state: State,
        shape: Shape,
        path: Path,
        surfaces: Sequence[Surface],
        *,
        contact: PenaltyContact,
        friction: Coulomb | None = None,
        name: str = "tool",
    ) -> None:
        gdim = state.mesh.geometry.dim
        start = np.asarray(path.position(0.0), dtype=float)
        require("surfaces", len(surfaces), len(surfaces) > 0, "at least one surface")
        require("path", start.shape, start.shape == (gdim,), f"positions of {gdim} components")
        self.name, self.state, self.shape, self.path = name, state, shape, path
        self.contact, self.friction = contact, friction
        self._contact = with_constants(state.mesh, contact)
        self._coulomb = None if friction is None else with_constants(state.mesh, friction)
        self.symmetric = friction is None
        self._surfaces = tuple(surfaces)
        self.position = fem.Constant(state.mesh, start.astype(default_scalar_type))
        self.position_old = fem.Constant(state.mesh, start.astype(default_scalar_type))
        v = ufl.TestFunction(state.V)
        self._energy_form = form(self._sum(lambda s: self._contact.energy(-self._distance(s))))
        self._contact_form = form(self.residual(v))
        self._friction_form = (
            form(self._sum(lambda s: -ufl.dot(self._friction(s), s.restrict(v)))) if friction else None
        )
        zero: NDArray[np.float64] = np.zeros(len(state.increment))
        self._forces, self._forces_old = zero, zero.copy()
        self._rubbing, self._rubbing_old = zero, zero.copy()
        self._friction_work = self._friction_work_old = 0.0

    @property
    def corners(self) -> tuple[float, ...]:
        """Times at which the tool's velocity jumps."""
        return self.path.corners

    @property
    def displacement(self) -> NDArray[np.float64]:
        """Increment of the tool's position in the step [length]."""
        return np.asarray(self.position.value - self.position_old.value)

    def residual(self, v: Expr) -> ufl.Form:
        """Virtual work −∫ (p ∇d + t)·v of pressure and friction on the body."""

        def density(surface: Surface) -> Expr:
            traction = self._pressure(surface) * self._normal(surface)
            if self.friction is not None:
                traction += self._friction(surface)
            return -ufl.dot(traction, surface.restrict(v))

        return self._sum(density)

    def begin(self, time: float) -> None:
        """Move the tool to its position at the end of the step."""
        self.position.value[:] = self.path.position(time)

    def rollback(self) -> None:
        """Move the tool back to the start of the step."""
        self.position.value[:] = self.position_old.value
        self._forces, self._rubbing = self._forces_old, self._rubbing_old
        self._friction_work = self._friction_work_old

    def evaluate(self) -> None:
        """Contact forces of the trial state and friction work of the step (trapezoidal). Collective."""
        self._forces = nodal_forces(self._contact_form)
        if self._friction_form is not None:
            self._rubbing = nodal_forces(self._friction_form)
            mean = 0.5 * (self._rubbing + self._rubbing_old)
            dissipated = global_dot(self.state.mesh.comm, mean, self.state.increment)
            dissipated -= float(self._resultant(mean) @ self.displacement)
            self._friction_work = self._friction_work_old + dissipated

    def energies(self) -> dict[str, float]:
        """Energy of the contact penalty and friction work so far. Collective."""
        return {"contact": integrate(self._energy_form), "friction": self._friction_work}

    def external_work(self) -> float:
        """Work of the tool on the body in the step: mean force times increment. Collective."""
        return float(-self._resultant(0.5 * (self._forces + self._forces_old)) @ self.displacement)

    def force(self) -> NDArray[np.float64]:
        """Force on the tool, from the virtual work of a rigid translation [force]. Collective."""
        return self._resultant(self._forces)

    def moment(self) -> NDArray[np.float64]:
        """Moment on the tool about its reference point, from the virtual work of a rigid rotation. Collective."""
        V, gdim = self.state.V, self.state.mesh.geometry.dim
        nodes = len(self._forces) // gdim
        arms = V.tabulate_dof_coordinates()[:nodes].copy()
        arms[:, :gdim] += self.state.u.x.array[: nodes * gdim].reshape(-1, gdim) - self.position.value
        return moment(self.state.mesh.comm, self._forces, arms, gdim)

    def record(self) -> dict[str, tuple[float, str]]:
        """Position, force and moment of the tool. Collective."""
        force, couple = self.force(), self.moment()
        gdim = len(force)
        columns = {f"{self.name}_{_AXES[i]}": (float(self.position.value[i]), "length") for i in range(gdim)}
        columns |= {f"{self.name}_force_{_AXES[i]}": (float(force[i]), "force") for i in range(gdim)}
        axes = _AXES if gdim == 3 else "z"
        columns |= {f"{self.name}_moment_{a}": (float(m), "moment") for a, m in zip(axes, couple, strict=True)}
        return columns

    def commit(self) -> None:
        """Adopt position, forces and friction work."""
        self.position_old.value[:] = self.position.value
        self._forces_old, self._rubbing_old = self._forces, self._rubbing
        self._friction_work_old = self._friction_work

    def _resultant(self, forces: NDArray[np.float64]) -> NDArray[np.float64]:
        return resultant(self.state.mesh.comm, forces, self.state.mesh.geometry.dim)

    def _sum(self, density) -> ufl.Form:  # type: ignore[no-untyped-def]
        return sum((density(s) * s.measure for s in self._surfaces), start=ufl.Form([]))

    def _place(self, surface: Surface) -> Expr:
        X = ufl.SpatialCoordinate(self.state.mesh)
        return surface.restrict(X + self.state.u) - self.position

    def _distance(self, surface: Surface) -> Expr:
        return self.shape.distance(self._place(surface))

    def _normal(self, surface: Surface) -> Expr:
        x = ufl.variable(self._place(surface))
        return ufl.diff(self.shape.distance(x), x)

    def _pressure(self, surface: Surface) -> Expr:
        return self._contact.pressure(-self._distance(surface))

    def _friction(self, surface: Surface) -> Expr:
        assert self._coulomb is not None
        moved = surface.restrict(self.state.u - self.state.u_old) - (self.position - self.position_old)
        return self._coulomb.traction(self._pressure(surface), tangential(moved, self._normal(surface)))


def warn_coarse(name: str, shape: Shape, facet_size: float) -> None:
    """Warn with numbers if facets are larger than the smallest radius of a tool."""
    if facet_size > (1 + 1e-6) * shape.resolution:
        logger.warning(
            "%s: facets of %.3g do not resolve the tool's radius %.3g: use %.3g or less",
            name, facet_size, shape.resolution, shape.resolution,
        )  # fmt: skip
