"""Deformable body: hyperelastic, with optional viscosity and thermal expansion (docs/theory.md §2, 3.4)."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Literal

import numpy as np
import ufl
from numpy.typing import NDArray

from cutsim.base.assembly import integrate
from cutsim.base.checks import nonnegative, positive, require, require_number
from cutsim.base.compat import form
from cutsim.base.kinematics import Expr
from cutsim.base.signatures import checked
from cutsim.base.terms import Assembler, Multiplier, Term
from cutsim.bodies.contributions import Contribution, Heating, KelvinVoigt
from cutsim.bodies.elasticity import Elasticity
from cutsim.bodies.element_shapes import ElementShapes
from cutsim.bodies.formulations import FORMULATIONS, Measures
from cutsim.bodies.overstress import Overstress
from cutsim.bodies.quadrature import strain_energy_measures
from cutsim.bodies.volume_ratio import VolumeRatio
from cutsim.fields.state import State
from cutsim.fields.temperature import Temperature
from cutsim.materials.elastic import Material, inside_out
from cutsim.materials.thermoelastic import ThermoElastic
from cutsim.materials.viscoelastic import Prony


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
        formulation: How the strain energy enters the virtual work.
        contributions: What is added to elasticity.

    Raises:
        ValueError: A parameter is outside its range, or does not go with another one.
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
        require_number("viscosity", viscosity, nonnegative)
        require_number("density", density, positive.or_none)
        together = (thermoelastic is None) == (temperature is None)
        require("temperature", temperature, together, "given with thermoelastic, and only then")
        self.name, self.state, self.material, self.cells, self.density = name, state, material, cells, density
        elasticity = Elasticity.of(state, material, plane)
        if thermoelastic is not None and temperature is not None:
            elasticity = elasticity.expanding(thermoelastic, temperature)
        measures = strain_energy_measures(state, material, volumetric, cells, name)
        self.formulation = FORMULATIONS[volumetric](elasticity, measures, cells)
        self._energy_form = form(self.formulation.stored(state.u))
        self._volume, self._inside_out = VolumeRatio(self.formulation, cells), inside_out(material)
        self._shapes = ElementShapes(name, self._volume, material, state.V.ufl_element().degree)
        self.contributions = tuple(self._contributions(viscosity, relaxation, thermoelastic))

    def _contributions(
        self, viscosity: float, relaxation: Prony | None, expansion: ThermoElastic | None
    ) -> Iterator[Contribution]:
        if viscosity:
            yield KelvinVoigt(self.name, self.state, viscosity, self.measures[0])
        if relaxation is not None:
            yield Overstress(self.name, self.formulation, relaxation, self.cells)
        if expansion is not None:
            yield Heating(self.name, self.formulation, expansion.reference)

    @property
    def measures(self) -> Measures:
        """Measures over the body that integrate the two parts of the strain energy."""
        return self.formulation.measures

    def deformation_gradient(self, u: Expr) -> Expr:
        """Deformation gradient of the body, 3 × 3, with the out-of-plane stretch of the plane assumption."""
        return self.formulation.elasticity.deformation_gradient(u)

    def energy_parts(self, F: Expr) -> tuple[Expr, Expr]:
        """Strain energy per reference volume of a deformation gradient, in the parts that `measures` integrate.

        At the present temperature, and with the present pressure where the formulation has one of its own.
        """
        return self.formulation.parts(F)

    def first_piola(self, u: Expr) -> Expr:
        """First Piola–Kirchhoff stress P = ∂W/∂F with overstresses, 3 × 3 [stress]."""
        F = ufl.variable(self.deformation_gradient(u))
        return sum((c.piola(F) for c in self.contributions), start=self.formulation.piola(F))

    def cauchy_stress(self, u: Expr) -> Expr:
        """Cauchy stress σ = P Fᵀ / J, 3 × 3 [stress]."""
        F = self.deformation_gradient(u)
        return self.first_piola(u) * F.T / ufl.det(F)

    def strain_energy_density(self, u: Expr) -> Expr:
        """Strain energy per reference volume W [energy/length³]."""
        return sum(self.energy_parts(self.deformation_gradient(u)))

    def residual(self, v: Expr) -> ufl.Form:
        """Virtual work of the elastic and viscous stresses."""
        return sum((c.residual(v) for c in self.contributions), start=self.formulation.residual(v))

    @property
    def fields(self) -> Mapping[str, Expr]:
        """The pressure of Taylor–Hood elements, > 0 in tension [stress]."""
        return {f"{self.name}_{field}": value for field, value in self.formulation.fields.items()}

    @property
    def multipliers(self) -> Sequence[Multiplier]:
        """The pressure of Taylor–Hood elements."""
        return self.formulation.multipliers

    @property
    def assemblers(self) -> Sequence[Assembler]:
        """The tangent that goes through the projected volume change of mixed elements."""
        return self.formulation.assemblers

    def begin(self) -> None:
        """Relax overstresses over the step."""
        for part in self.contributions:
            part.begin()

    @property
    def rate_dependent(self) -> bool:
        """Whether overstresses relax."""
        return any(c.rate_dependent for c in self.contributions)

    def evaluate(self) -> None:
        """Add the viscous dissipation of the step, and what the change of temperature adds. Collective."""
        for part in self.contributions:
            part.evaluate()

    def rate_forces(self) -> NDArray[np.float64] | None:
        """Viscous forces. Collective."""
        forces = [f for part in self.contributions if (f := part.rate_forces()) is not None]
        return np.sum(forces, axis=0) if forces else None

    def energies(self) -> dict[str, float]:
        """Strain energy, work of viscous stresses and minus the strain energy brought by heat so far. Collective."""
        for assembler in self.assemblers:
            assembler.prepare()
        entries = {"strain": integrate(self._energy_form), "viscous": 0.0, "thermoelastic": 0.0}
        for name, value in (item for part in self.contributions for item in part.energies().items()):
            entries[name] += value
        return entries

    def heat(self, w: Expr) -> ufl.Form:
        """Heat of the trial step times a function w: viscous dissipation, and the thermoelastic effect [energy]."""
        return sum((c.heat(w) for c in self.contributions), start=ufl.Form([]))

    @property
    def bound_entropy(self) -> ufl.Form:
        """Entropy −∂W/∂T of a strain energy that depends on temperature, as a form [energy/temperature]."""
        return sum((c.bound_entropy() for c in self.contributions), start=ufl.Form([]))

    @property
    def viscous_work(self) -> float:
        """Work of the Kelvin–Voigt viscosity so far, in the trial state [energy]."""
        return sum(part.regularising_work for part in self.contributions)

    def distortions(self) -> dict[str, tuple[float, str]]:
        """Elements that are turned over at a corner or almost flat: strain energy, words and cure. Collective."""
        return self._shapes.distortions()

    def at_stake(self, cells: NDArray[np.bool_], strain: float) -> float:
        """Energy that would change if some owned cells of the mesh were strained otherwise by so much. Collective."""
        return self._shapes.at_stake(cells, strain)

    def diagnose(self) -> str | None:
        """Name the body if an element is inverted. Collective."""
        smallest = self.smallest_jacobian()
        return f"{self.name}: element inverted, smallest J = {smallest:.3g}" if not smallest > 0 else None

    def possible(self) -> bool:
        """Whether no element is turned inside out, where that has no energy. Collective."""
        return self._inside_out or self.smallest_jacobian() > 0

    def smallest_jacobian(self) -> float:
        """Smallest det F at the integration points. Collective."""
        return self._volume.smallest()
