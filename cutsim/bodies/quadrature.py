"""Quadrature degrees of the two parts of a strain energy."""

import numpy as np
import ufl
from numpy.typing import NDArray

from cutsim.fields.state import State
from cutsim.materials.elastic import Material

#: Poisson's ratio from which the volumetric part is integrated with fewer points by default.
NEARLY_INCOMPRESSIBLE = 0.45


def strain_energy_measures(
    state: State, material: Material, volumetric: str, cells: NDArray[np.int32] | None, name: str
) -> tuple[ufl.Measure, ufl.Measure]:
    """Measures over a body for the fully integrated and the volumetric part of its strain energy.

    Args:
        state: Displacement and time.
        material: Strain energy.
        volumetric: "reduced" for fewer points in the volumetric part; "auto" does so for ν ≥ 0.45.
        cells: Local cells of the body, all by default.
        name: The body, in the doubt that a linear element locks.
    """
    element, nearly = state.V.ufl_element(), material.poisson >= NEARLY_INCOMPRESSIBLE
    cell, degree = element.cell_type.name, element.degree
    simplex = cell in ("triangle", "tetrahedron")
    if nearly and degree == 1 and (simplex or volumetric == "full"):
        cure = "quadrilaterals, hexahedra or degree 2" if simplex else "volumetric='auto' or degree 2"
        words = f"{name}: a linear {cell} locks at Poisson's ratio {material.poisson:.4g}; use {cure}"
        state.verdict.doubt(f"{name}: locking", words)
    reduced = volumetric == "reduced" or (volumetric == "auto" and nearly)
    # full integration: (degree + 1) points in each direction of a tensor-product cell, exact stiffness on simplices
    full = 2 * (degree - 1) if simplex else 2 * degree
    # a marker for each rule, hence a kernel for each: FFCx 0.9 mixes the Jacobians of two rules up within a kernel
    # when one of them has a single point
    degrees = full, max(full - 2, 1) if reduced else full
    first, second = (state.measures.cells(cells)(metadata={"quadrature_degree": d}) for d in degrees)
    return first, second
