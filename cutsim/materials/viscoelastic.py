"""Quasi-linear viscoelasticity: overstresses of a Prony series at the integration points of a body (docs/materials.md).

The second Piola–Kirchhoff stress S of the fully integrated part of a strain energy relaxes, that of the volumetric part
does not:

    S_total(t) = S(t) + Σ hᵢ(t),    hᵢ(t) = ∫ gᵢ exp(−(t−s)/τᵢ) dS(s),

so that the parameters of the material are those of slow deformation.  For S that goes straight over a step the update

    hᵢ ← exp(−Δt/τᵢ) hᵢ + gᵢ (1 − exp(−Δt/τᵢ)) τᵢ/Δt ΔS

is exact (Taylor, Pister and Goudreau 1970; Simo 1987).
"""

from dataclasses import dataclass

import basix
import basix.ufl
import numpy as np
import ufl
from dolfinx import default_scalar_type, fem
from numpy.typing import NDArray

from cutsim.base.assembly import integrate
from cutsim.base.checks import require
from cutsim.base.compat import expression, form
from cutsim.base.kinematics import Expr
from cutsim.fields.state import State

Array = NDArray[np.float64]


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
        require(
            "strengths", self.strengths, bool(self.strengths) and min(self.strengths) > 0, "at least one number > 0"
        )
        as_many = len(self.times) == len(self.strengths)
        require("times", self.times, as_many and min(self.times) > 0, "numbers > 0, as many as strengths")

    def factors(self, dt: float) -> tuple[Array, Array]:
        """What remains of each overstress after a step, and what it takes up of the change of stress in it."""
        x = dt / np.array(self.times)
        return np.exp(-x), -np.array(self.strengths) * np.expm1(-x) / x


class Overstress:
    """Overstresses of one body, with a trial and a committed value.

    Args:
        state: Displacement and time.
        prony: Relaxation function.
        energy: Strain energy per reference volume that relaxes, at `state.u`.
        stress: Its second Piola–Kirchhoff stress, 3 × 3, at `state.u`.
        measure: Measure over the body whose integration points carry the history.
        cells: Local cells of the body (ghosts included); all by default.
    """

    def __init__(
        self,
        state: State,
        prony: Prony,
        energy: Expr,
        stress: Expr,
        measure: ufl.Measure,
        cells: NDArray[np.int32] | None = None,
    ) -> None:
        mesh, gdim = state.mesh, state.mesh.geometry.dim
        self._state, self._prony, self._energy, self._dx = state, prony, energy, measure
        self._gradient = state.deformation_gradient
        index_map = mesh.topology.index_map(mesh.topology.dim)
        self._cells = np.arange(index_map.size_local + index_map.num_ghosts, dtype=np.int32) if cells is None else cells
        # strain has no component out of the plane but around an axis
        self._pairs = [(i, j) for i in range(gdim) for j in range(i, gdim)] + [(2, 2)] * state.axisymmetric
        degree, name = measure.metadata()["quadrature_degree"], mesh.topology.cell_name()
        element = basix.ufl.quadrature_element(name, value_shape=(len(self._pairs),), degree=degree)
        space = fem.functionspace(mesh, element)
        self._dofs = space.dofmap.list[self._cells]
        points = basix.make_quadrature(basix.CellType[name], degree)[0]
        self._stress = expression(ufl.as_vector([stress[i, j] for i, j in self._pairs]), points, mesh)
        # in a step the overstress is known + weight × stress
        self._known, self._total, self._total_old = (fem.Function(space) for _ in range(3))
        self._weight = fem.Constant(mesh, default_scalar_type(0.0))
        self._before: tuple[float, Array] = (0.0, self._known.x.array.copy())
        self._S: Array = self._evaluate_stress()
        self._h: Array = np.zeros((len(prony.times), *self._S.shape))
        self._S_old, self._h_old = self._S, self._h
        self._decay: Array = np.ones(len(prony.times))
        self._gain: Array = np.zeros(len(prony.times))
        self._work_form = form(self._work_of_step())
        self._work = self._work_old = 0.0

    @property
    def work(self) -> float:
        """Work done on the overstresses so far: what they have dissipated, and what they will give back [energy]."""
        return self._work

    def residual(self, v: Expr) -> ufl.Form:
        """Virtual work of the overstresses."""
        u = self._state.u
        changing = ufl.derivative(self._weight * self._energy * self._dx, u, v)
        return changing + ufl.inner(self._piola(u, self._known), ufl.derivative(self._gradient(u), u, v)) * self._dx

    def begin(self) -> None:
        """Factors of the step whose size the state knows."""
        self._before = float(self._weight.value), self._known.x.array.copy()
        self._decay, self._gain = self._prony.factors(float(self._state.dt.value))
        self._weight.value = self._gain.sum()
        self._set(self._known, np.tensordot(self._decay, self._h_old, 1) - self._gain.sum() * self._S_old)

    def evaluate(self) -> None:
        """Overstresses at the end of the step, and their work. Collective."""
        self._S = self._evaluate_stress()
        broadcast = (-1, 1, 1, 1)
        change = self._gain.reshape(broadcast) * (self._S - self._S_old)
        self._h = self._decay.reshape(broadcast) * self._h_old + change
        self._set(self._total, self._h.sum(axis=0))
        self._work = self._work_old + integrate(self._work_form)

    def rollback(self) -> None:
        """Forget the step."""
        self._weight.value, self._known.x.array[:] = self._before
        self._S, self._h, self._work = self._S_old, self._h_old, self._work_old
        self._total.x.array[:] = self._total_old.x.array

    def commit(self) -> None:
        """Adopt the overstresses of the step."""
        self._S_old, self._h_old, self._work_old = self._S, self._h, self._work
        self._total_old.x.array[:] = self._total.x.array

    def _evaluate_stress(self) -> Array:
        """Stress at the integration points, shape (cells, points, components)."""
        values = self._stress.eval(self._state.mesh, self._cells)
        return np.array(values).reshape(*self._dofs.shape, len(self._pairs))

    def _set(self, f: fem.Function, values: Array) -> None:
        f.x.array.reshape(-1, len(self._pairs))[self._dofs] = values

    def _piola(self, u: Expr, f: fem.Function) -> Expr:
        """First Piola–Kirchhoff stress of a symmetric second one, 3 × 3."""
        order = {pair: k for k, pair in enumerate(self._pairs)}
        places = [[order.get((min(i, j), max(i, j))) for j in range(3)] for i in range(3)]
        H = ufl.as_matrix([[0 if k is None else f[k] for k in row] for row in places])
        return self._gradient(u) * H

    def _work_of_step(self) -> ufl.Form:
        """Mean traction times increment, the rule by which the audit sums the work of the supports."""
        new, old = self._state.u, self._state.u_old
        mean = 0.5 * (self._piola(new, self._total) + self._piola(old, self._total_old))
        return ufl.inner(mean, self._gradient(new) - self._gradient(old)) * self._dx
