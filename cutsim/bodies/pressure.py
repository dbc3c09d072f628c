"""Taylor–Hood elements: a continuous pressure as a second unknown of a body (docs/elements.md §2).

The volumetric part of every strain energy is U = ½ κ g², with g a measure of the change of volume. Its perturbed
Lagrangian (Brink and Stein 1996)

    ∫ p g(F) − p²/(2κ) dV

is stationary in p at the projection of κ g, equals ∫ U where that is exact, and stays finite for κ → ∞.
"""

from collections.abc import Callable

import numpy as np
import ufl
from dolfinx import default_scalar_type, fem
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.base.kinematics import Expr, green_lagrange, small_strain
from cutsim.base.places import Places
from cutsim.bodies.elasticity import Law
from cutsim.fields.space import vertex_space
from cutsim.fields.state import State
from cutsim.materials.elastic import Material, volumetric_energy

#: Measures of the change of volume by which volumetric energies are written.
MEASURES: tuple[Callable[[Expr], Expr], ...] = (
    lambda F: ufl.ln(ufl.det(F)),
    lambda F: ufl.det(F) - 1,
    lambda F: ufl.tr(green_lagrange(F)),
    lambda F: ufl.tr(small_strain(F)),
)


class PressureField:
    """Pressure of one body, continuous except across cracks.

    Args:
        state: Displacement and time.
        material: Strain energy.
        law: The same, written with form constants.
        cells: Local cells of the body, all by default.

    Attributes:
        value: p, derivative of the volumetric energy by the measure of volume, > 0 in tension [stress].
        unknown: p as the solver sees it, times the mesh size and over Young's modulus [length].
        shown: p, and zero outside the body [stress].

    Raises:
        ValueError: The volumetric part of the strain energy is no square of a change of volume.
    """

    def __init__(self, state: State, material: Material, law: Law, cells: NDArray[np.int32] | None) -> None:
        self._measure = _measure(material)
        self._law = law
        space = vertex_space(state.V, cells)
        self.unknown = fem.Function(space, name="pressure")
        inside = None if cells is None else (lambda: (cells, space.dofmap.list[cells]))
        state.memory.array("pressure", self.unknown, places=Places.of(space, inside))
        unit = fem.Constant(state.mesh, default_scalar_type(material.young / _mesh_size(state)))
        self.value = unit * self.unknown
        inside = fem.Function(fem.functionspace(state.mesh, ("DG", 0)))
        inside.x.array[slice(None) if cells is None else cells] = 1.0
        self.shown = inside * self.value

    def energy(self, F: Expr) -> Expr:
        """Volumetric energy p g − p²/(2κ) per reference volume [energy/length³]."""
        sample = 2 * ufl.Identity(3)
        compliance = self._measure(sample) ** 2 / (2 * self._law.energy(sample)[1])
        return self.value * self._measure(F) - 0.5 * compliance * self.value**2


def _measure(material: Material) -> Callable[[Expr], Expr]:
    """The measure of which the volumetric energy is the square: for any two strains their ratio is the same."""
    samples = np.diag([2.0, 1.5, 1.0]), np.diag([0.5, 1.0, 0.8])
    for measure in MEASURES:
        squares = (float(measure(ufl.as_matrix(F.tolist()))(())) ** 2 for F in samples)
        first, second = (volumetric_energy(material, F) / g for F, g in zip(samples, squares, strict=True))
        if first > 0 and abs(first - second) < 1e-9 * first:
            return measure
    raise ValueError(
        f"volumetric = 'taylor-hood' is not allowed for {type(material).__name__}; use 'full' or 'reduced'"
    )


def _mesh_size(state: State) -> float:
    """Mean size of the cells [length]. Collective."""
    mesh, tdim = state.mesh, state.mesh.topology.dim
    h = mesh.h(tdim, np.arange(mesh.topology.index_map(tdim).size_local, dtype=np.int32))
    total = mesh.comm.allreduce(np.array([h.sum(), h.size]), MPI.SUM)
    return float(total[0] / total[1])
