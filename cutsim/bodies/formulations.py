"""Formulations of the strain energy in the virtual work: from the displacement alone, or with a pressure.

All formulations have the members of `Formulation`, which is the one of the displacement; the others say what differs
(docs/elements.md).
"""

from collections.abc import Mapping, Sequence

import numpy as np
import ufl
from numpy.typing import NDArray

from cutsim.base.checks import require
from cutsim.base.kinematics import Expr, cofactor
from cutsim.base.terms import Multiplier
from cutsim.bodies.elasticity import Elasticity
from cutsim.bodies.pressure import PressureField
from cutsim.bodies.volume_change import VolumeChange
from cutsim.materials.elastic import Material, volumetric_energy

Measures = tuple[ufl.Measure, ufl.Measure]
Cells = NDArray[np.int32] | None


class Formulation:
    """Displacement formulation: both parts of the strain energy follow from the displacement.

    Args:
        elasticity: Strain energy and kinematics.
        measures: Measures over the body that integrate the two parts of the strain energy.
        cells: Local cells of the body, all by default.

    Attributes:
        elasticity: As above.
        measures: As above.
        assemblers: Forces that are no form; none here.
    """

    assemblers: Sequence[VolumeChange] = ()

    def __init__(self, elasticity: Elasticity, measures: Measures, cells: Cells) -> None:
        self.elasticity, self.measures = elasticity, measures

    @property
    def multipliers(self) -> Sequence[Multiplier]:
        """Unknowns beside the displacement, with their equations."""
        return ()

    @property
    def fields(self) -> Mapping[str, Expr]:
        """Fields for output."""
        return {}

    def at(self, temperature: Expr) -> "Formulation":
        """The same at another temperature than the present one."""
        return Formulation(self.elasticity.at(temperature), self.measures, None)

    def parts(self, F: Expr) -> tuple[Expr, Expr]:
        """Both parts of the strain energy per reference volume, as `measures` integrate them [energy/length³]."""
        return self.elasticity.law.energy(F)

    def stored(self, u: Expr) -> ufl.Form:
        """Strain energy of the body."""
        shear, volumetric = self.parts(self.elasticity.deformation_gradient(u))
        return shear * self.measures[0] + volumetric * self.measures[1]

    def residual(self, v: Expr) -> ufl.Form:
        """Virtual work of the elastic stresses."""
        u = self.elasticity.state.u
        return ufl.derivative(self.stored(u), u, v)

    def piola(self, F: Expr) -> Expr:
        """First Piola–Kirchhoff stress of a deformation gradient that is a `ufl.variable`, 3 × 3 [stress]."""
        return ufl.diff(sum(self.parts(F)), F)


class Mixed(Formulation):
    """Mixed formulation: volume change and pressure are projected in each cell (Q1/P0, Q2/P1)."""

    def __init__(self, elasticity: Elasticity, measures: Measures, cells: Cells) -> None:
        super().__init__(elasticity, measures, cells)
        elasticity.require_isothermal_plane_strain("mixed")
        cell = elasticity.state.mesh.topology.cell_name()
        require("volumetric", "mixed", cell in ("quadrilateral", "hexahedron"), f"'reduced' on a {cell}")
        kind = type(elasticity.material).__name__
        require("volumetric", "mixed", _by_volume(elasticity.material), f"'full' or 'reduced' for {kind}")
        J = ufl.det(elasticity.deformation_gradient(elasticity.state.u))
        self._change = VolumeChange(elasticity.state, J, self._volumetric, measures[0], cells)
        self.assemblers = (self._change,)

    def parts(self, F: Expr) -> tuple[Expr, Expr]:
        """Both parts of the strain energy; the volumetric one at the projected volume change of the state."""
        return super().parts(F)[0], self._volumetric(self._change.value)

    def residual(self, v: Expr) -> ufl.Form:
        """Virtual work of the elastic stresses, with the projected pressure."""
        u = self.elasticity.state.u
        J = ufl.det(self.elasticity.deformation_gradient(u))
        return super().residual(v) + self._change.pressure * ufl.derivative(J, u, v) * self.measures[0]

    def piola(self, F: Expr) -> Expr:
        """First Piola–Kirchhoff stress with the projected pressure."""
        return ufl.diff(self.parts(F)[0], F) + self._change.pressure * cofactor(F)

    def _volumetric(self, J: Expr) -> Expr:
        """Volumetric part of the strain energy as a function of the volume change."""
        return super().parts(J ** (1 / 3) * ufl.Identity(3))[1]


class TaylorHood(Formulation):
    """Taylor–Hood formulation: a continuous pressure is an unknown beside a displacement of degree 2."""

    def __init__(self, elasticity: Elasticity, measures: Measures, cells: Cells) -> None:
        super().__init__(elasticity, measures, cells)
        elasticity.require_isothermal_plane_strain("taylor-hood")
        degree = elasticity.state.V.ufl_element().degree
        require("volumetric", "taylor-hood", degree == 2, f"'mixed' or 'reduced' for degree {degree}")
        self.pressure = PressureField(elasticity.state, elasticity.material, elasticity.law, cells)

    @property
    def multipliers(self) -> Sequence[Multiplier]:
        """The pressure."""
        unknown = self.pressure.unknown
        q = ufl.TestFunction(unknown.function_space)
        return (Multiplier(unknown, ufl.derivative(self.stored(self.elasticity.state.u), unknown, q)),)

    @property
    def fields(self) -> Mapping[str, Expr]:
        """The pressure, > 0 in tension [stress]."""
        return {"pressure": self.pressure.shown}

    def parts(self, F: Expr) -> tuple[Expr, Expr]:
        """Both parts of the perturbed Lagrangian at the present pressure."""
        return super().parts(F)[0], self.pressure.energy(F)


#: Formulations by the name under which a body takes them.
FORMULATIONS: Mapping[str, type[Formulation]] = {
    "auto": Formulation,
    "full": Formulation,
    "reduced": Formulation,
    "mixed": Mixed,
    "taylor-hood": TaylorHood,
}


def _by_volume(material: Material) -> bool:
    """Whether the volumetric part is a function of det F: a stretch and a growth of the same volume tell."""
    stretch, growth = np.diag([2.0, 1.0, 1.0]), 2 ** (1 / 3) * np.eye(3)
    first, second = (volumetric_energy(material, F) for F in (stretch, growth))
    return abs(first - second) < 1e-9 * abs(first)
