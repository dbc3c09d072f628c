"""Contributions to the stress and energy of a body besides elasticity: viscosity, relaxation, thermal expansion."""

from collections.abc import Mapping

import ufl
from dolfinx import default_scalar_type, fem

from cutsim.base.assembly import Array, integrate, nodal_forces
from cutsim.base.compat import form
from cutsim.base.kinematics import Expr, green_lagrange
from cutsim.base.places import Places
from cutsim.bodies.formulations import Formulation
from cutsim.fields.state import State


class Contribution:
    """Base of contributions to a body; every method has a neutral default."""

    def residual(self, v: Expr) -> ufl.Form:
        """Virtual work of its stresses."""
        return ufl.Form([])

    def piola(self, F: Expr) -> Expr:
        """Its first Piola–Kirchhoff stress at the end of the step, 3 × 3 [stress]."""
        return ufl.zero(3, 3)

    def begin(self) -> None:
        """Move constants to their values in the step whose size the state knows."""

    def evaluate(self) -> None:
        """Compute trial history and energies from the converged trial displacement. Collective."""

    def energies(self) -> Mapping[str, float]:
        """Trial values of the audit entries to which it contributes [energy]."""
        return {}

    def rate_forces(self) -> Array | None:
        """The part of its forces that jumps with the velocity, owned entries. Collective."""
        return None

    @property
    def regularising_work(self) -> float:
        """Work so far of what is there for the sake of the solution, and no property of the material [energy]."""
        return 0.0


class KelvinVoigt(Contribution):
    """Kelvin–Voigt viscosity with the stress S = η dE/dt.

    Args:
        name: Name of the body.
        state: Displacement and time.
        viscosity: η ≥ 0 [stress·time].
        measure: Measure over the body.
    """

    def __init__(self, name: str, state: State, viscosity: float, measure: ufl.Measure) -> None:
        self._state, self._dx = state, measure
        self._viscosity = fem.Constant(state.mesh, default_scalar_type(viscosity))
        self._work_form = form(self._work())
        self._rate_form = form(self.residual(ufl.TestFunction(state.V)))
        self._dissipated = state.memory.value(f"{name}: viscous work", 0.0)

    def residual(self, v: Expr) -> ufl.Form:
        """Virtual work of the viscous stresses."""
        E, change = self._strain()
        rate = change / self._state.dt
        return self._viscosity * ufl.inner(rate, ufl.derivative(E, self._state.u, v)) * self._dx

    def evaluate(self) -> None:
        """Add the dissipation of the step. Collective."""
        self._dissipated.trial = self._dissipated.committed + integrate(self._work_form)

    def energies(self) -> Mapping[str, float]:
        """What was dissipated so far."""
        return {"viscous": self._dissipated.trial}

    @property
    def regularising_work(self) -> float:
        """All of its work."""
        return self._dissipated.trial

    def rate_forces(self) -> Array:
        """All of its forces. Collective."""
        return nodal_forces(self._rate_form)

    def _work(self) -> ufl.Form:
        _, change = self._strain()
        return self._viscosity / self._state.dt * ufl.inner(change, change) * self._dx

    def _strain(self) -> tuple[Expr, Expr]:
        """Green–Lagrange strain, and its change in the step."""
        state = self._state
        new, old = (green_lagrange(state.deformation_gradient(w)) for w in (state.u, state.u_old))
        return new, new - old


class Heating(Contribution):
    """Strain energy that a change of temperature brings into a body that expands with it.

    Args:
        name: Name of the body.
        formulation: Of the body; its elasticity depends on the temperature.
        reference: Temperature from which on it counts what heat has brought before the start.
    """

    def __init__(self, name: str, formulation: Formulation, reference: float) -> None:
        temperature = formulation.elasticity.temperature
        assert temperature is not None, "no temperature acts on the body"
        self._formulation, self._temperature = formulation, temperature
        # the temperature at which the last step was in equilibrium
        self._before = fem.Function(temperature.space)
        self._before.x.array[:] = reference
        self._form = form(self._brought())
        memory = formulation.elasticity.state.memory
        self._energy = memory.value(f"{name}: thermal work", -integrate(self._form))
        seen, places = temperature.value.x.array.copy(), Places.of(temperature.space)
        self._seen = memory.value(f"{name}: temperature", seen, self._show, places=places)
        self._show(self._seen.committed)

    def _show(self, seen: Array) -> None:
        self._before.x.array[:] = seen

    def evaluate(self) -> None:
        """Add what the change of temperature brings in the step. Collective."""
        self._energy.trial = self._energy.committed - integrate(self._form)
        self._seen.trial = self._temperature.value.x.array.copy()

    def energies(self) -> Mapping[str, float]:
        """Minus the strain energy that heat has brought so far."""
        return {"thermoelastic": self._energy.trial}

    def _brought(self) -> ufl.Form:
        """Strain energy brought since the last equilibrium, by the trapezoidal rule in the displacement."""
        now, before = self._formulation, self._formulation.at(self._before)
        state = now.elasticity.state
        total = now.stored(state.u) - before.stored(state.u) + now.stored(state.u_old) - before.stored(state.u_old)
        return 0.5 * total
