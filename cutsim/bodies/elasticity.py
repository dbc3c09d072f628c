"""Elasticity of a body: its strain energy as a function of the displacement, in plane strain or stress."""

from dataclasses import dataclass, replace
from typing import Literal, Protocol, Self

from cutsim.base.checks import require
from cutsim.base.kinematics import Expr, deformation_gradient
from cutsim.base.parameters import with_constants
from cutsim.fields.state import State
from cutsim.fields.temperature import Temperature
from cutsim.materials.elastic import Material
from cutsim.materials.thermoelastic import ThermoElastic

Plane = Literal["strain", "stress"]


class Law(Protocol):
    """Protocol of a material, as forms use it."""

    def energy(self, F: Expr) -> tuple[Expr, Expr]:
        """Strain energy per reference volume, (fully integrated part, volumetric part)."""

    def plane_stress_stretch(self, F: Expr) -> Expr:
        """Out-of-plane stretch that makes the out-of-plane stress vanish."""


@dataclass(frozen=True, eq=False)
class Expanding:
    """Law whose strains are measured from the freely expanded body (docs/theory.md §3.4).

    Args:
        law: The law at the reference temperature.
        expansion: Thermal expansion and softening.
        temperature: The temperature.
    """

    law: Law
    expansion: ThermoElastic
    temperature: Expr

    def energy(self, F: Expr) -> tuple[Expr, Expr]:
        """Strain energy of the elastic part, per volume of the reference configuration."""
        stretch = self._stretch
        shear, volumetric = self.law.energy(F / stretch)
        return self.expansion.shear_factor(self.temperature) * stretch**3 * shear, stretch**3 * volumetric

    def plane_stress_stretch(self, F: Expr) -> Expr:
        """Out-of-plane stretch, the thermal one included."""
        return self._stretch * self.law.plane_stress_stretch(F / self._stretch)

    @property
    def _stretch(self) -> Expr:
        return self.expansion.stretch(self.temperature)


@dataclass(frozen=True, eq=False)
class Elasticity:
    """Elasticity of a body: material, kinematics and temperature.

    Args:
        state: Displacement and time.
        material: Strain energy.
        law: The same for forms, with form constants and with thermal expansion.
        plane: Plane strain, or plane stress in a two-dimensional problem.
        temperature: The temperature that the law depends on, if any.
    """

    state: State
    material: Material
    law: Law
    plane: Plane = "strain"
    temperature: Temperature | None = None

    def __post_init__(self) -> None:
        flat = self.state.mesh.geometry.dim == 2
        require("plane", self.plane, self.plane == "strain" or flat, "'strain' on a 3-D mesh")
        planar = self.plane == "strain" or not self.state.axisymmetric
        require("plane", self.plane, planar, "'strain' in an axisymmetric problem")

    @classmethod
    def of(cls, state: State, material: Material, plane: Plane) -> Self:
        """The elasticity of a material at a constant temperature."""
        return cls(state, material, with_constants(state.mesh, material), plane)

    def expanding(self, expansion: ThermoElastic, temperature: Temperature) -> Self:
        """The same material with thermal expansion."""
        same = temperature.state is self.state
        require("temperature", temperature, same, "a temperature made with the state of the body")
        # there λ₃ would have to be solved for with another ratio of the moduli at each temperature
        constant = self.plane == "strain" or expansion.softening == 0
        require("plane", self.plane, constant, "'strain' if thermoelastic.softening is not 0")
        law = Expanding(self.law, with_constants(self.state.mesh, expansion), temperature.value)
        return replace(self, law=law, temperature=temperature)

    def at(self, temperature: Expr) -> Self:
        """The same at another temperature, if it depends on one."""
        return replace(self, law=replace(self.law, temperature=temperature))  # type: ignore[type-var]

    def deformation_gradient(self, u: Expr) -> Expr:
        """Deformation gradient, 3 × 3, with the out-of-plane stretch of the plane assumption."""
        F = self.state.deformation_gradient(u)
        return F if self.plane == "strain" else deformation_gradient(u, self.law.plane_stress_stretch(F))

    def require_isothermal_plane_strain(self, volumetric: str) -> None:
        """Refuse plane stress and thermal expansion for a formulation with a pressure of its own."""
        require("volumetric", volumetric, self.plane == "strain", "'full' or 'reduced' in plane stress")
        require("volumetric", volumetric, self.temperature is None, "'full' or 'reduced' with thermal expansion")
