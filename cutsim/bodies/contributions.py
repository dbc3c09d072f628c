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

# of the strain energy, as the measures of a formulation integrate them
Parts = tuple[Expr, ...]


class Contribution:
    """Base of contributions to a body; every method has a neutral default."""

    def residual(self, v: Expr) -> ufl.Form:
        """Virtual work of its stresses."""
        return ufl.Form([])

    def piola(self, F: Expr) -> Expr:
        """Its first Piola–Kirchhoff stress at the end of the step, 3 × 3 [stress]."""
        return ufl.zero(3, 3)

    def heat(self, w: Expr) -> ufl.Form:
        """Heat that the deformation of the step generates, times a function w [energy]."""
        return ufl.Form([])

    def bound_entropy(self) -> ufl.Form:
        """Entropy that the strain energy holds [energy/temperature]."""
        return ufl.Form([])

    def begin(self) -> None:
        """Move constants to their values in the step whose size the state knows."""

    @property
    def rate_dependent(self) -> bool:
        """Whether its stresses depend on how long a step takes, apart from `State.dt` in their form."""
        return False

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
        self._work_form = form(self.heat(ufl.as_ufl(1)))
        self._rate_form = form(self.residual(ufl.TestFunction(state.V)))
        self._dissipated = state.memory.value(f"{name}: viscous work", 0.0)

    def residual(self, v: Expr) -> ufl.Form:
        """Virtual work of the viscous stresses."""
        E, change = self._strain()
        rate = change / self._state.dt
        return self._viscosity * ufl.inner(rate, ufl.derivative(E, self._state.u, v)) * self._dx

    def heat(self, w: Expr) -> ufl.Form:
        """All of its work."""
        _, change = self._strain()
        return w * self._viscosity / self._state.dt * ufl.inner(change, change) * self._dx

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
        brought = zip(self._brought(self._before), formulation.measures, strict=True)
        self._form = form(sum((part * dx for part, dx in brought), start=ufl.Form([])))
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

    def heat(self, w: Expr) -> ufl.Form:
        """Heat of the thermoelastic effect in the step: Δ(T ∂W/∂T) less what the change of temperature brings.

        It is T Δ(∂W/∂T) to second order, and leaves the sum of internal energies as it is (docs/heat.md).
        """
        T, old = self._temperature.value, self._temperature.old
        state = self._formulation.elasticity.state
        latent = zip(self._latent(T, state.u), self._latent(old, state.u_old), strict=True)
        parts = zip(latent, self._brought(old), self._formulation.measures, strict=True)
        return sum((w * (new - before - brought) * dx for (new, before), brought, dx in parts), start=ufl.Form([]))

    def bound_entropy(self) -> ufl.Form:
        """Entropy −∂W/∂T of the body beside that of its heat capacity."""
        u = self._formulation.elasticity.state.u
        slopes = self._slopes(self._temperature.value, u)
        return -sum((s * dx for s, dx in zip(slopes, self._formulation.measures, strict=True)), start=ufl.Form([]))

    def _brought(self, before: Expr) -> Parts:
        """Strain energy that the change of temperature brings, by the trapezoidal rule in the displacement."""
        now, then = self._formulation, self._formulation.at(before)
        state = now.elasticity.state
        ways = [(_stored(now, u), _stored(then, u)) for u in (state.u, state.u_old)]
        return tuple(0.5 * sum(new[i] - old[i] for new, old in ways) for i in range(2))

    def _latent(self, temperature: Expr, u: Expr) -> Parts:
        """T ∂W/∂T, with the absolute temperature."""
        absolute = temperature - self._temperature.absolute_zero
        return tuple(absolute * slope for slope in self._slopes(temperature, u))

    def _slopes(self, temperature: Expr, u: Expr) -> Parts:
        """∂W/∂T of both parts of the strain energy."""
        T = ufl.variable(temperature)
        return tuple(ufl.diff(part, T) for part in _stored(self._formulation.at(T), u))


def _stored(formulation: Formulation, u: Expr) -> Parts:
    """Both parts of the strain energy of a displacement per reference volume."""
    return formulation.parts(formulation.elasticity.deformation_gradient(u))
