"""Heat capacity and conduction of a body (docs/theory.md §3.4)."""

from typing import Protocol

import numpy as np
import ufl
from dolfinx import default_scalar_type, fem
from mpi4py import MPI
from numpy.typing import ArrayLike, NDArray

from cutsim.base.assembly import integrate
from cutsim.base.checks import as_array, positive, require, require_number
from cutsim.base.compat import form
from cutsim.base.kinematics import Expr
from cutsim.base.parameters import Schedule, TimeFunction
from cutsim.base.signatures import checked
from cutsim.bodies.solid import Solid
from cutsim.fields.temperature import Temperature
from cutsim.heat.audit import HeatTerm


class Moved(Protocol):
    """Protocol of what moves with a deformation gradient."""

    def deformation_gradient(self, u: Expr) -> Expr:
        """Deformation gradient of a displacement, 3 × 3."""


class HeatBody(HeatTerm):
    """Heat capacity and conduction of a body, ρc ∂T/∂t = Div(J F⁻¹ k F⁻ᵀ ∇T) + r, backward Euler.

    Conduction is that of the deformed body at the present displacement.  In degree 1 the capacity sits at the nodes
    (vertex quadrature), so that a suddenly heated face does not cool its neighbourhood.

    Args:
        temperature: The temperature.
        capacity: Specific heat c > 0 [energy/(mass·temperature)].
        conductivity: k ≥ 0, a number or a symmetric matrix (gdim × gdim) in the fixed axes of space
            [power/(length·temperature)].
        density: Mass per reference volume ρ > 0, by default that of the `Solid` [mass/length³].
        body: The cells of the body (local, ghosts allowed), or the `Solid` that moves them; all cells by default.
        source: Heat source r per reference volume, a number or a function of time [power/volume].
        deformation: Whether its deformation heats the `Solid`: what its viscosity and relaxation dissipate, and, if it
            expands or softens with temperature, the thermoelastic effect T d(∂W/∂T)/dt of Gough and Joule.
        name: Name in messages and output.

    Attributes:
        cells: Its local cells (ghosts included); None for all.
        dofs: Local dofs of the temperature in the body.

    Raises:
        ValueError: A parameter is outside its range.
    """

    @checked
    def __init__(
        self,
        temperature: Temperature,
        *,
        capacity: float,
        conductivity: float | ArrayLike,
        density: float | None = None,
        body: Solid | NDArray[np.int32] | None = None,
        source: float | TimeFunction = 0.0,
        deformation: bool = False,
        name: str = "body",
    ) -> None:
        super().__init__(temperature, name)
        mesh, measures = self.state.mesh, self.state.measures
        self._moved: Moved = self.state
        require("deformation", deformation, not deformation or isinstance(body, Solid), "False without a Solid as body")
        self._heating = body if deformation and isinstance(body, Solid) else None
        cells: NDArray[np.int32] | None
        if body is None or isinstance(body, np.ndarray):
            cells = body
        else:
            self._moved, cells = body, body.cells
            density = body.density if density is None else density
        require_number("density", density, positive)
        assert density is not None
        require_number("capacity", capacity, positive)
        self._conductivity = fem.Constant(mesh, _conductivity(conductivity, mesh.geometry.dim))
        self._heat_capacity = fem.Constant(mesh, default_scalar_type(density * capacity))
        self._source = Schedule(mesh, self.state.memory, source, "source", name)
        degree = temperature.space.ufl_element().degree
        # a marker for each rule, hence a kernel for each: FFCx 0.9 may mix two rules up within a kernel
        nodes = {"quadrature_rule": "vertex", "quadrature_degree": 1}
        points = {"quadrature_degree": 2 * degree}
        self._dx = measures.cells(cells, "body")(metadata=points)
        self._dx_storage = measures.cells(cells)(metadata=nodes if degree == 1 else points)
        one = fem.Constant(mesh, default_scalar_type(1.0))
        self._volume = integrate(form(one * self._dx_storage))
        self._mean_form = form(temperature.value * self._dx_storage)
        self._stored_form = form(self._heat_capacity * (temperature.value - temperature.old) * self._dx_storage)
        heat, bound = ufl.Form([]), ufl.Form([])
        if self._heating is not None:
            heat, bound = self._heating.heat(ufl.as_ufl(1)), self._heating.bound_entropy
        self._deformation_form = None if heat.empty() else form(heat)
        absolute = temperature.value - temperature.absolute_zero
        self._entropy_form = form(self._heat_capacity * ufl.ln(absolute) * self._dx_storage + bound)
        self.cells, self.dofs = cells, _dofs_of(temperature.space, cells)

    @property
    def content(self) -> float:
        """Heat capacity of the whole body [energy/temperature]."""
        return float(self._heat_capacity.value) * self._volume

    def residual(self, w: Expr) -> ufl.Form:
        """Heat stored minus conducted and supplied."""
        T, T_old = self.temperature.value, self.temperature.old
        F = self._moved.deformation_gradient(self.state.u)
        flow = ufl.det(F) * ufl.inner(self._conductivity * _gradient(T, F), _gradient(w, F))
        rate = self._heat_capacity * (T - T_old) / self.state.dt
        balance = (flow - self._source.constant * w) * self._dx + rate * w * self._dx_storage
        return balance if self._heating is None else balance - self._heating.heat(w / self.state.dt)

    def begin(self) -> None:
        """Set the source to its value at the end of the step."""
        self._source.begin(self.state.time)

    def heat(self) -> dict[str, float]:
        """Heat stored, supplied, and generated by deformation in the step. Collective."""
        supplied = self._source.value * self._volume * float(self.state.dt.value)
        generated = 0.0 if self._deformation_form is None else integrate(self._deformation_form)
        return {"stored": integrate(self._stored_form), "source": supplied, "deformation": generated}

    def held_entropy(self) -> float:
        """Entropy of its heat capacity, and of its strain energy where its deformation heats it. Collective."""
        return integrate(self._entropy_form)

    def record(self) -> dict[str, tuple[float, str]]:
        """Mean and highest temperature of the body. Collective."""
        highest = float(self.temperature.value.x.array[self.dofs].max(initial=-np.inf))
        return {
            f"{self.name}_temperature": (integrate(self._mean_form) / self._volume, "temperature"),
            f"{self.name}_temperature_max": (self.state.mesh.comm.allreduce(highest, op=MPI.MAX), "temperature"),
        }


def _gradient(f: Expr, F: Expr) -> Expr:
    """Gradient F⁻ᵀ ∇f in the deformed body, three components."""
    g = ufl.grad(f)
    padded = g if len(g) == 3 else ufl.as_vector([g[0], g[1], 0])
    return ufl.inv(F).T * padded


def _conductivity(conductivity: float | ArrayLike, gdim: int) -> NDArray[np.float64]:
    """The conductivity as a 3 × 3 matrix.

    Raises:
        ValueError: It has another shape, is not symmetric, or has a negative eigenvalue.
    """
    k = as_array("conductivity", conductivity)
    require("conductivity", conductivity, k.shape in ((), (gdim, gdim)), f"a number or a {gdim} × {gdim} matrix")
    matrix = np.zeros((3, 3), dtype=default_scalar_type)
    matrix[:gdim, :gdim] = k * np.eye(gdim) if k.ndim == 0 else k
    require("conductivity", conductivity, np.allclose(matrix, matrix.T), "symmetric")
    require("conductivity", conductivity, bool(np.linalg.eigvalsh(matrix).min() >= 0), ">= 0")
    return matrix


def _dofs_of(V: fem.FunctionSpace, cells: NDArray[np.int32] | None) -> NDArray[np.int32]:
    """Local dofs of some cells, of all if None."""
    return np.unique(V.dofmap.list if cells is None else V.dofmap.list[cells])
