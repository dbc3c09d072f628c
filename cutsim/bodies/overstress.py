"""Overstresses of a Prony series at the integration points of a body (docs/materials.md).

In a step the second Piola–Kirchhoff stress S of the part of the strain energy that relaxes goes straight.  The update

    hᵢ ← exp(−Δt/τᵢ) hᵢ + gᵢ (1 − exp(−Δt/τᵢ)) τᵢ/Δt ΔS

of each overstress is then exact (Taylor, Pister and Goudreau 1970; Simo 1987).
"""

from collections.abc import Mapping

import numpy as np
import ufl
from dolfinx import default_scalar_type, fem

from cutsim.base.assembly import Array
from cutsim.base.checks import require
from cutsim.base.kinematics import Expr, green_lagrange
from cutsim.bodies.contributions import Contribution
from cutsim.bodies.formulations import Cells, Formulation
from cutsim.bodies.maxwell import Maxwell
from cutsim.bodies.spring import Spring
from cutsim.bodies.tensor_points import TensorField, TensorPoints, all_cells
from cutsim.materials.viscoelastic import Prony


class Overstress(Contribution):
    """Overstresses of one body: all but the volumetric part of its strain energy relaxes.

    Args:
        name: Name of the body.
        formulation: Of the body.
        prony: Relaxation function.
        cells: Local cells of the body (ghosts included); all by default.
    """

    def __init__(self, name: str, formulation: Formulation, prony: Prony, cells: Cells) -> None:
        elasticity = formulation.elasticity
        # in plane stress λ₃ would depend on the overstress
        plane = elasticity.plane
        require("plane", plane, plane == "strain", "'strain' for a material that relaxes")
        self._state, self._prony, self._formulation = elasticity.state, prony, formulation
        mesh, degree = self._state.mesh, formulation.measures[0].metadata()["quadrature_degree"]
        self._points = TensorPoints(mesh, all_cells(mesh) if cells is None else cells, degree)
        F = self._state.deformation_gradient(self._state.u)
        self._response = self._points.compiled(self._stress(F), green_lagrange(F))
        strain, stress = self._evaluate()
        memory = self._state.memory
        # stress of the energy, and overstress of each term
        start = stress, np.zeros((len(prony.times), *stress.shape))
        places = self._points.places(), self._points.places(axis=1)
        self._stresses = memory.value(f"{name}: overstress", start, places=places)
        # in a step the overstress is known + weight × stress
        self._known = TensorField(f"{name}: known overstress", memory, self._points)
        self._weight = fem.Constant(mesh, default_scalar_type(0.0))
        memory.array(f"{name}: weight of the stress", self._weight)
        self._factors = np.ones(len(prony.times)), np.zeros(len(prony.times))
        spring = Spring(self._points, self._energy, elasticity.material.young)
        strengths, dx = np.array(prony.strengths), formulation.measures[0]
        self._energies = Maxwell(f"{name}: relaxation", memory, spring, strengths, dx, strain)

    def residual(self, v: Expr) -> ufl.Form:
        """Virtual work of the overstresses."""
        u, dx = self._state.u, self._formulation.measures[0]
        F = self._state.deformation_gradient(u)
        changing = ufl.derivative(self._weight * self._energy(F) * dx, u, v)
        return changing + ufl.inner(F * self._known.tensor, ufl.derivative(F, u, v)) * dx

    def piola(self, F: Expr) -> Expr:
        """First Piola–Kirchhoff stress of the overstresses at the end of the step, 3 × 3 [stress].

        What is left of earlier steps is known at the integration points, and enters by its mean over each cell.
        """
        return F * (self._weight * self._stress(F) + self._known.mean)

    def heat(self, w: Expr) -> ufl.Form:
        """What the dashpots dissipate in the step."""
        return w * self._energies.heat * self._formulation.measures[0]

    def begin(self) -> None:
        """Relax the overstresses over the step whose size the state knows."""
        decay, gain = self._factors = self._prony.factors(float(self._state.dt.value))
        stress, overstress = self._stresses.committed
        self._weight.value = gain.sum()
        self._known.set(np.tensordot(decay, overstress, 1) - gain.sum() * stress)

    @property
    def rate_dependent(self) -> bool:
        """Always."""
        return True

    def evaluate(self) -> None:
        """Overstresses at the end of the step, and their energies. Collective."""
        strain, stress = self._evaluate()
        before, overstress = self._stresses.committed
        decay, gain = (factors.reshape(-1, 1, 1, 1) for factors in self._factors)
        overstress = decay * overstress + gain * (stress - before)
        self._stresses.trial = stress, overstress
        steps = float(self._state.dt.value) / np.array(self._prony.times)
        conjugate = self._points.conjugate
        self._energies.evaluate(strain, conjugate * stress, conjugate * overstress, steps)

    def energies(self) -> Mapping[str, float]:
        """What the springs of the series store and its dashpots have dissipated."""
        return {"strain": self._energies.stored, "viscous": self._energies.lost}

    def _evaluate(self) -> tuple[Array, Array]:
        """Strain and stress at the integration points, shape (cells, points, components) each."""
        stress, strain = np.split(self._points.values(self._response), 2, axis=-1)
        return strain, stress

    def _energy(self, F: Expr) -> Expr:
        """Strain energy per reference volume that relaxes."""
        return self._formulation.parts(F)[0]

    def _stress(self, F: Expr) -> Expr:
        """Second Piola–Kirchhoff stress S of the energy that relaxes, 3 × 3."""
        F = ufl.variable(F)
        return ufl.inv(F) * ufl.diff(self._energy(F), F)
