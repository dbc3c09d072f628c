"""A deformable body: hyperelastic bulk, with optional viscosity and thermal expansion (docs/theory.md §2, 3.4)."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Literal

import basix
import numpy as np
import ufl
from dolfinx import default_scalar_type, fem
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.base.assembly import integrate, nodal_forces
from cutsim.base.checks import nonnegative, positive, require, require_number
from cutsim.base.compat import evaluate, expression, form
from cutsim.base.kinematics import Expr, cofactor, deformation_gradient, green_lagrange
from cutsim.base.parameters import with_constants
from cutsim.base.signatures import checked
from cutsim.base.terms import Multiplier, Term
from cutsim.bodies.pressure import PressureField
from cutsim.bodies.quadrature import strain_energy_measures
from cutsim.bodies.volume_change import VolumeChange
from cutsim.fields.state import State
from cutsim.fields.temperature import Temperature
from cutsim.materials.elastic import Material, volumetric_energy
from cutsim.materials.thermoelastic import ThermoElastic
from cutsim.materials.viscoelastic import Overstress, Prony

# volume ratio below which an element is no longer to be trusted
_FLAT = 0.1


class Solid(Term):
    """Hyperelastic body that occupies some cells.

    Args:
        state: Displacement and time.
        material: Strain energy.
        cells: Local cells of the body (ghosts allowed); all by default.
        name: Name in messages and output.
        plane: For two-dimensional meshes, plane strain or plane stress (unit thickness).
        volumetric: "full" or "reduced" integration of the volumetric part; by default reduced for ν ≥ 0.45.
            On simplices of degree 1 both coincide, and a warning says that the element locks. "mixed" projects the
            volume change in each quadrilateral or hexahedron; with a material whose volumetric part depends on det F
            only. "taylor-hood" adds a continuous pressure to the unknowns of a space of degree 2. Both without
            thermal expansion (docs/elements.md).
        viscosity: Kelvin–Voigt viscosity η ≥ 0, S_v = η dE/dt [stress·time].
        relaxation: Prony series by which all but the volumetric part relaxes; the material is then the relaxed one.
            The strain energy in the audit is then with what the overstresses store.
        density: Mass per reference volume, > 0; needed by dynamics and heat only [mass/length³].
        thermoelastic: Thermal expansion and shear modulus that depends on temperature.
        temperature: The temperature that acts on the body; with `thermoelastic` only.

    Attributes:
        measures: Measures over the body that integrate the two parts of the strain energy.

    Raises:
        ValueError: A parameter is outside its range.
    """

    @checked
    def __init__(
        self,
        state: State,
        material: Material,
        cells: NDArray[np.int32] | None = None,
        *,
        name: str = "body",
        plane: Literal["strain", "stress"] = "strain",
        volumetric: Literal["auto", "full", "reduced", "mixed", "taylor-hood"] = "auto",
        viscosity: float = 0.0,
        relaxation: Prony | None = None,
        density: float | None = None,
        thermoelastic: ThermoElastic | None = None,
        temperature: Temperature | None = None,
    ) -> None:
        gdim = state.mesh.geometry.dim
        require("plane", plane, plane == "strain" or gdim == 2, "'strain' on a 3-D mesh")
        require("plane", plane, plane == "strain" or not state.axisymmetric, "'strain' in an axisymmetric problem")
        require_number("viscosity", viscosity, nonnegative)
        require_number("density", density, positive.or_none)
        # there λ₃ would depend on the overstress
        require("plane", plane, plane == "strain" or relaxation is None, "'strain' for a material that relaxes")
        self.name = name
        self.state = state
        self.material = material
        self._law = with_constants(state.mesh, material)
        self.plane = plane
        self.viscosity = viscosity
        self.density = density
        self._couple(thermoelastic, temperature)
        self._viscosity = fem.Constant(state.mesh, default_scalar_type(viscosity))
        self.cells = cells
        self.measures = strain_energy_measures(state, material, volumetric, cells, name)
        self._mixed = self._projected() if volumetric == "mixed" else None
        self._pressure = self._continuous() if volumetric == "taylor-hood" else None
        self._overstress = None if relaxation is None else self._relaxing(relaxation)
        self._energy_form = form(self._stored(state.u))
        self._viscous_form = form(self._viscous_work()) if viscosity else None
        self._rate_form = form(self._viscous_forces(ufl.TestFunction(state.V))) if viscosity else None
        self._viscous = state.memory.value(f"{name}: viscous work", 0.0)
        self._thermal = state.memory.value(f"{name}: thermal work", 0.0)
        if thermoelastic is not None and temperature is not None:
            self._start_heating(thermoelastic.reference, temperature)

    def _couple(self, law: ThermoElastic | None, temperature: Temperature | None) -> None:
        together = (law is None) == (temperature is None)
        require("temperature", temperature, together, "given with thermoelastic, and only then")
        same = temperature is None or temperature.state is self.state
        require("temperature", temperature, same, "a temperature made with the state of the body")
        constant = law is None or law.softening == 0
        # there λ₃ would have to be solved for with another ratio of the moduli at each temperature
        require("plane", self.plane, self.plane == "strain" or constant, "'strain' if thermoelastic.softening is not 0")
        self.temperature = temperature
        self._thermoelastic = None if law is None else with_constants(self.state.mesh, law)

    def _start_heating(self, reference: float, temperature: Temperature) -> None:
        """Count what heat has brought before the start, from the reference temperature on."""
        self._temperature_seen = fem.Function(temperature.space)
        self._temperature_seen.x.array[:] = reference
        self._heating_form = form(self._heating(temperature.value))
        self._thermal.set(-integrate(self._heating_form))
        self._seen = self.state.memory.value(f"{self.name}: temperature", temperature.value.x.array.copy(), self._show)
        self._show(self._seen.committed)

    def _show(self, seen: NDArray[np.float64]) -> None:
        self._temperature_seen.x.array[:] = seen

    def deformation_gradient(self, u: Expr) -> Expr:
        """Deformation gradient of the body, 3 × 3, with the out-of-plane stretch of the plane assumption."""
        return self._deformation_gradient(u, self._temperature())

    def energy_parts(self, F: Expr) -> tuple[Expr, Expr]:
        """Strain energy per reference volume of a deformation gradient, in the parts that `measures` integrate.

        At the present temperature, and with the present pressure of Taylor–Hood elements.
        """
        return self._energy(F, self._temperature())

    def first_piola(self, u: Expr) -> Expr:
        """First Piola–Kirchhoff stress P = ∂W/∂F with overstresses, 3 × 3 [stress]."""
        F = ufl.variable(self.deformation_gradient(u))
        if self._mixed is not None:
            P = ufl.diff(self._energy(F, None)[0], F) + self._mixed.pressure * cofactor(F)
        else:
            P = ufl.diff(sum(self.energy_parts(F)), F)
        return P if self._overstress is None else P + self._overstress.piola(F)

    def cauchy_stress(self, u: Expr) -> Expr:
        """Cauchy stress σ = P Fᵀ / J, 3 × 3 [stress]."""
        F = self.deformation_gradient(u)
        return self.first_piola(u) * F.T / ufl.det(F)

    def strain_energy_density(self, u: Expr) -> Expr:
        """Strain energy per reference volume W [energy/length³]."""
        return sum(self._parts(u, self._temperature()))

    def residual(self, v: Expr) -> ufl.Form:
        """Virtual work of the elastic and viscous stresses."""
        u = self.state.u
        work = ufl.derivative(self._stored(u), u, v)
        if self._mixed is not None:
            J = ufl.det(self.deformation_gradient(u))
            work += self._mixed.pressure * ufl.derivative(J, u, v) * self.measures[0]
        if self.viscosity:
            work += self._viscous_forces(v)
        if self._overstress is not None:
            work += self._overstress.residual(v)
        return work

    @property
    def fields(self) -> Mapping[str, Expr]:
        """The pressure of Taylor–Hood elements, > 0 in tension [stress]."""
        return {} if self._pressure is None else {f"{self.name}_pressure": self._pressure.shown}

    @property
    def multipliers(self) -> Sequence[Multiplier]:
        """The pressure of Taylor–Hood elements."""
        if self._pressure is None:
            return ()
        unknown = self._pressure.unknown
        q = ufl.TestFunction(unknown.function_space)
        return (Multiplier(unknown, ufl.derivative(self._stored(self.state.u), unknown, q)),)

    @property
    def assemblers(self) -> Sequence[VolumeChange]:
        """The tangent that goes through the projected volume change of mixed elements."""
        return () if self._mixed is None else (self._mixed,)

    def begin(self) -> None:
        """Relax the overstress over the step."""
        if self._overstress is not None:
            self._overstress.begin()

    def evaluate(self) -> None:
        """Add the viscous dissipation of the step, and what the change of temperature adds. Collective."""
        if self._viscous_form is not None:
            self._viscous.trial = self._viscous.committed + integrate(self._viscous_form)
        if self._overstress is not None:
            self._overstress.evaluate()
        if self.temperature is not None:
            self._thermal.trial = self._thermal.committed - integrate(self._heating_form)
            self._seen.trial = self.temperature.value.x.array.copy()

    def rate_forces(self) -> NDArray[np.float64] | None:
        """Viscous forces. Collective."""
        return None if self._rate_form is None else nodal_forces(self._rate_form)

    def energies(self) -> dict[str, float]:
        """Strain energy, work of viscous stresses and minus the strain energy brought by heat so far. Collective."""
        if self._mixed is not None:
            self._mixed.prepare()
        strain, viscous = integrate(self._energy_form), self._viscous.trial
        if self._overstress is not None:
            strain += self._overstress.energies.stored
            viscous += self._overstress.energies.lost
        return {"strain": strain, "viscous": viscous, "thermoelastic": self._thermal.trial}

    @property
    def viscous_work(self) -> float:
        """Work of the Kelvin–Voigt viscosity so far, in the trial state [energy]."""
        return self._viscous.trial

    def watch(self) -> None:
        """Doubt elements that are almost flat. Collective."""
        smallest = self.smallest_jacobian()
        if smallest < _FLAT:
            self.state.verdict.doubt(
                f"{self.name}: J",
                f"{self.name}: an element is squeezed to {smallest:.2g} of its volume, smaller ones are needed",
                -smallest,
            )

    def diagnose(self) -> str | None:
        """Name the body if an element is inverted. Collective."""
        smallest = self.smallest_jacobian()
        return f"{self.name}: element inverted, smallest J = {smallest:.3g}" if not smallest > 0 else None

    def smallest_jacobian(self) -> float:
        """Smallest det F at the integration points. Collective."""
        owned = self.state.mesh.topology.index_map(self.state.mesh.topology.dim).size_local
        cells = np.arange(owned, dtype=np.int32) if self.cells is None else self.cells[self.cells < owned]
        values = evaluate(self._jacobian, self.state.mesh, cells)
        local = float(np.nan_to_num(values, nan=-np.inf).min()) if values.size else np.inf
        return float(self.state.mesh.comm.allreduce(local, op=MPI.MIN))

    @cached_property
    def _jacobian(self) -> fem.Expression:
        cell = basix.CellType[self.state.mesh.topology.cell_name()]
        points = basix.make_quadrature(cell, self.measures[0].metadata()["quadrature_degree"])[0]
        return expression(ufl.det(self.deformation_gradient(self.state.u)), points, self.state.mesh)

    def _relaxing(self, relaxation: Prony) -> Overstress:
        def energy(F: Expr) -> Expr:
            return self.energy_parts(F)[0]

        return Overstress(self.state, relaxation, energy, self.measures[0], self.cells, scale=self.material.young)

    def _temperature(self) -> Expr | None:
        return None if self.temperature is None else self.temperature.value

    def _deformation_gradient(self, u: Expr, T: Expr | None) -> Expr:
        F = self.state.deformation_gradient(u)
        if self.plane == "strain":
            return F
        if self._thermoelastic is None:
            return deformation_gradient(u, self._law.plane_stress_stretch(F))
        stretch = self._thermoelastic.stretch(T)
        return deformation_gradient(u, stretch * self._law.plane_stress_stretch(F / stretch))

    def _energy(self, F: Expr, T: Expr | None) -> tuple[Expr, Expr]:
        """Both parts of the strain energy per reference volume."""
        if self._pressure is not None:
            return self._law.energy(F)[0], self._pressure.energy(F)
        if self._thermoelastic is None:
            return self._law.energy(F)
        stretch, factor = self._thermoelastic.stretch(T), self._thermoelastic.shear_factor(T)
        shear, volumetric = self._law.energy(F / stretch)
        return factor * stretch**3 * shear, stretch**3 * volumetric

    def _parts(self, u: Expr, T: Expr | None) -> tuple[Expr, Expr]:
        """Both parts of the strain energy per reference volume; mixed elements know that of the state only."""
        shear, volumetric = self._energy(self._deformation_gradient(u, T), T)
        return shear, volumetric if self._mixed is None else self._volumetric(self._mixed.value)

    def _volumetric(self, J: Expr) -> Expr:
        """Volumetric part of the strain energy as a function of the volume change."""
        return self._law.energy(J ** (1 / 3) * ufl.Identity(3))[1]

    def _projected(self) -> VolumeChange:
        self._check_mixed("mixed")
        cell = self.state.mesh.topology.cell_name()
        require("volumetric", "mixed", cell in ("quadrilateral", "hexahedron"), f"'reduced' on a {cell}")
        kind = type(self.material).__name__
        require("volumetric", "mixed", _by_volume(self.material), f"'full' or 'reduced' for {kind}")
        J = ufl.det(self.deformation_gradient(self.state.u))
        return VolumeChange(self.state, J, self._volumetric, self.measures[0], self.cells)

    def _continuous(self) -> PressureField:
        self._check_mixed("taylor-hood")
        degree = self.state.V.ufl_element().degree
        require("volumetric", "taylor-hood", degree == 2, f"'mixed' or 'reduced' for degree {degree}")
        return PressureField(self.state, self.material, self._law, self.cells)

    def _check_mixed(self, volumetric: str) -> None:
        require("volumetric", volumetric, self.plane == "strain", "'full' or 'reduced' in plane stress")
        require("volumetric", volumetric, self.temperature is None, "'full' or 'reduced' with thermal expansion")

    def _stored(self, u: Expr, T: Expr | None = None) -> ufl.Form:
        shear, volumetric = self._parts(u, self._temperature() if T is None else T)
        dx, dx_volumetric = self.measures
        return shear * dx + volumetric * dx_volumetric

    def _heating(self, T: Expr) -> ufl.Form:
        """Strain energy brought by the change of temperature since the last equilibrium, trapezoidal in u."""
        new, old = self.state.u, self.state.u_old
        seen = self._temperature_seen
        total = self._stored(new, T) - self._stored(new, seen) + self._stored(old, T) - self._stored(old, seen)
        return 0.5 * total

    def _viscous_forces(self, v: Expr) -> ufl.Form:
        E, change = self._strain()
        rate = change / self.state.dt
        return self._viscosity * ufl.inner(rate, ufl.derivative(E, self.state.u, v)) * self.measures[0]

    def _viscous_work(self) -> ufl.Form:
        _, change = self._strain()
        return self._viscosity / self.state.dt * ufl.inner(change, change) * self.measures[0]

    def _strain(self) -> tuple[Expr, Expr]:
        """Green–Lagrange strain, and its change in the step."""
        new, old = (green_lagrange(self.state.deformation_gradient(w)) for w in (self.state.u, self.state.u_old))
        return new, new - old


def _by_volume(material: Material) -> bool:
    """Whether the volumetric part is a function of det F: a stretch and a growth of the same volume tell."""
    stretch, growth = np.diag([2.0, 1.0, 1.0]), 2 ** (1 / 3) * np.eye(3)
    first, second = (volumetric_energy(material, F) for F in (stretch, growth))
    return abs(first - second) < 1e-9 * abs(first)
