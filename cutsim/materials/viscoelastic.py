"""Quasi-linear viscoelasticity: overstresses of a Prony series at integration points (docs/materials.md).

The second Piola–Kirchhoff stress S of the fully integrated part of a strain energy relaxes, that of the volumetric part
does not:

    S_total(t) = S(t) + Σ hᵢ(t),    hᵢ(t) = ∫ gᵢ exp(−(t−s)/τᵢ) dS(s),

so that the parameters of the material are those of slow deformation.  For S that goes straight over a step the update

    hᵢ ← exp(−Δt/τᵢ) hᵢ + gᵢ (1 − exp(−Δt/τᵢ)) τᵢ/Δt ΔS

is exact (Taylor, Pister and Goudreau 1970; Simo 1987).
"""

from collections.abc import Callable
from dataclasses import dataclass

import basix
import basix.ufl
import numpy as np
import ufl
from dolfinx import default_scalar_type, fem
from numpy.typing import NDArray

from cutsim.base.checks import positive, require_numbers
from cutsim.base.compat import evaluate, expression
from cutsim.base.kinematics import Expr, green_lagrange
from cutsim.base.signatures import checked
from cutsim.fields.state import State
from cutsim.materials.maxwell import Maxwell
from cutsim.materials.spring import Spring, symmetric_tensor

Array = NDArray[np.float64]


@checked
@dataclass(frozen=True)
class Prony:
    """Relaxation function 1 + Σ gᵢ exp(−t/τᵢ), relative to the relaxed stress.

    A series 1 − Σ g'ᵢ (1 − exp(−t/τᵢ)) relative to the instantaneous stress has gᵢ = g'ᵢ/(1 − Σ g'ᵢ), with moduli of
    the material 1 − Σ g'ᵢ times the instantaneous ones.

    Args:
        strengths: gᵢ > 0, one for each term [–].
        times: Relaxation times τᵢ > 0 [time].

    Raises:
        ValueError: A number is outside its range, or there are not as many strengths as times.
    """

    strengths: tuple[float, ...]
    times: tuple[float, ...]

    def __post_init__(self) -> None:
        require_numbers("strengths", self.strengths, positive)
        require_numbers("times", self.times, positive, len(self.strengths))

    def factors(self, dt: float) -> tuple[Array, Array]:
        """Decay of each overstress over a step, and the fraction of the change of stress that it takes up."""
        x = dt / np.array(self.times)
        return np.exp(-x), -np.array(self.strengths) * np.expm1(-x) / x


class Overstress:
    """Overstresses of one body.

    Args:
        state: Displacement and time.
        prony: Relaxation function.
        energy: Strain energy per reference volume that relaxes, as a function of the deformation gradient.
        measure: Measure over the body whose integration points carry the history.
        cells: Local cells of the body (ghosts included); all by default.
        scale: A stress by which to judge whether strains have converged, such as Young's modulus.

    Attributes:
        energies: What the overstresses store and dissipate.
    """

    def __init__(
        self,
        state: State,
        prony: Prony,
        energy: Callable[[Expr], Expr],
        measure: ufl.Measure,
        cells: NDArray[np.int32] | None = None,
        *,
        scale: float,
    ) -> None:
        mesh, gdim = state.mesh, state.mesh.geometry.dim
        self._state, self._prony, self._energy, self._dx = state, prony, energy, measure
        index_map = mesh.topology.index_map(mesh.topology.dim)
        self._cells = np.arange(index_map.size_local + index_map.num_ghosts, dtype=np.int32) if cells is None else cells
        self._pairs = [(i, j) for i in range(gdim) for j in range(i, gdim)] + [(2, 2)] * (gdim == 2)
        self._conjugate = np.array([1.0 if i == j else 2.0 for i, j in self._pairs])
        degree, name = measure.metadata()["quadrature_degree"], mesh.topology.cell_name()
        points, self._weights = basix.make_quadrature(basix.CellType[name], degree)
        shapes = (len(self._pairs),), ()
        elements = (basix.ufl.quadrature_element(name, value_shape=shape, degree=degree) for shape in shapes)
        space, scalars = (fem.functionspace(mesh, element) for element in elements)
        self._dofs = space.dofmap.list[self._cells]
        F = state.deformation_gradient(state.u)
        entries = [tensor[i, j] for tensor in (self._stress(F), green_lagrange(F)) for i, j in self._pairs]
        self._response = expression(ufl.as_vector(entries), points, mesh)
        strain, stress = self._evaluate()
        self._remember(space, stress)
        spring = Spring(mesh, energy, self._pairs, self._cells, degree, scale)
        self.energies = Maxwell(state.memory, spring, np.array(prony.strengths), fem.Function(scalars), measure, strain)

    def _remember(self, space: fem.FunctionSpace, stress: Array) -> None:
        """Histories of a body at rest. In a step the overstress is known + weight × stress."""
        mesh, terms = space.mesh, len(self._prony.times)
        self._known = fem.Function(space)
        self._means = fem.Function(fem.functionspace(mesh, ("DG", 0, (len(self._pairs),))))
        self._weight = fem.Constant(mesh, default_scalar_type(0.0))
        memory = self._state.memory
        for name, shown in {"known": self._known, "means": self._means, "weight": self._weight}.items():
            memory.array(f"overstress: {name}", shown)
        self._points = memory.value("overstress", (stress, np.zeros((terms, *stress.shape))))
        self._decay: Array = np.ones(terms)
        self._gain: Array = np.zeros(terms)

    def residual(self, v: Expr) -> ufl.Form:
        """Virtual work of the overstresses."""
        u = self._state.u
        F = self._state.deformation_gradient(u)
        changing = ufl.derivative(self._weight * self._energy(F) * self._dx, u, v)
        return changing + ufl.inner(F * symmetric_tensor(self._known, self._pairs), ufl.derivative(F, u, v)) * self._dx

    def piola(self, F: Expr) -> Expr:
        """First Piola–Kirchhoff stress of the overstresses at the end of the step, 3 × 3 [stress].

        What is left of earlier steps is known at the integration points, and enters by its mean over each cell.
        """
        return F * (self._weight * self._stress(F) + symmetric_tensor(self._means, self._pairs))

    def begin(self) -> None:
        """Factors of the step whose size the state knows."""
        self._decay, self._gain = self._prony.factors(float(self._state.dt.value))
        self._weight.value = self._gain.sum()
        stress, overstress = self._points.committed
        self._know(np.tensordot(self._decay, overstress, 1) - self._gain.sum() * stress)

    def evaluate(self) -> None:
        """Overstresses at the end of the step, and their energies. Collective."""
        strain, stress = self._evaluate()
        stress_old, overstress_old = self._points.committed
        broadcast = (-1, 1, 1, 1)
        change = self._gain.reshape(broadcast) * (stress - stress_old)
        overstress = self._decay.reshape(broadcast) * overstress_old + change
        self._points.trial = stress, overstress
        steps = float(self._state.dt.value) / np.array(self._prony.times)
        self.energies.evaluate(strain, self._conjugate * stress, self._conjugate * overstress, steps)

    def _know(self, values: Array) -> None:
        self._known.x.array.reshape(-1, len(self._pairs))[self._dofs] = values
        means = np.tensordot(values, self._weights / self._weights.sum(), ([1], [0]))
        self._means.x.array.reshape(-1, len(self._pairs))[self._means.function_space.dofmap.list[self._cells, 0]] = (
            means
        )

    def _evaluate(self) -> tuple[Array, Array]:
        """Strain and stress at the integration points, shape (cells, points, components) each."""
        values = evaluate(self._response, self._state.mesh, self._cells)
        stress, strain = np.split(values.reshape(*self._dofs.shape, 2 * len(self._pairs)), 2, axis=-1)
        return strain, stress

    def _stress(self, F: Expr) -> Expr:
        """Second Piola–Kirchhoff stress S of the energy that relaxes, 3 × 3."""
        F = ufl.variable(F)
        return ufl.inv(F) * ufl.diff(self._energy(F), F)
