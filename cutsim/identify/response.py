"""Response of incompressible solids in the homogeneous tests of a testing machine (docs/identification.md).

A block is stretched along the first axis by λ₁ at constant volume; F = diag(λ₁, λ₂, 1/(λ₁λ₂)).  With W a function of
λ₁ and λ₂ alone and the third faces free, the nominal stresses are P₁ = ∂W/∂λ₁ and P₂ = ∂W/∂λ₂: the pressure has dropped
out.  The logarithmic strains e = ln λ are the unknowns here, since the second derivatives of W with respect to them are
the moduli of Drucker's criterion.
"""

from collections.abc import Mapping, Sequence

import numpy as np
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI
from numpy.typing import ArrayLike, NDArray

from cutsim.base.checks import require
from cutsim.base.compat import evaluate, expression
from cutsim.base.parameters import form_constants, substituted
from cutsim.materials.elastic import Material

#: λ₂ = λ₁ᵏ of an isotropic solid.  In uniaxial tension λ₂ is such that P₂ = 0, and this is the first guess.
PATHS = {"uniaxial": -0.5, "equibiaxial": 1.0, "pure shear": 0.0}
_ITERATIONS, _LARGEST, _ACCURATE = 50, 0.1, 1e-10


class HomogeneousResponse:
    """Nominal stress of a material in some tests, compiled once for all values of its parameters.

    Fibres and axes of an anisotropic material have to lie such that the block does not shear.

    Args:
        material: The material; one with a volumetric part is taken at constant volume.
        tests: For each test its path, "uniaxial", "equibiaxial" or "pure shear", and its stretches λ₁ > 0.  Results
            come in the same order, one after the other.

    Raises:
        ValueError: There are no stretches, a path is unknown or a stretch is not positive.
    """

    def __init__(self, material: Material, tests: Sequence[tuple[str, ArrayLike]]) -> None:
        for path, _ in tests:
            require("path", path, path in PATHS, "one of " + ", ".join(PATHS))
        parts = [np.atleast_1d(np.asarray(stretch, dtype=np.float64)) for _, stretch in tests]
        counts = [len(part) for part in parts]
        require("number of stretches", counts, sum(counts) > 0, "at least one")
        self._stretch = np.concatenate(parts)
        require("smallest stretch", self._stretch.min(), bool(np.all(self._stretch > 0)), "> 0")
        self._powers = np.repeat([PATHS[path] for path, _ in tests], counts)
        self._free = np.repeat([path == "uniaxial" for path, _ in tests], counts)
        # a cell for each stretch
        self._mesh = mesh.create_unit_interval(MPI.COMM_SELF, sum(counts))
        space = fem.functionspace(self._mesh, ("DG", 0))
        self._cells, self._dofs = np.arange(sum(counts), dtype=np.int32), space.dofmap.list[:, 0]
        self._first, self._second = fem.Function(space), fem.Function(space)
        self._constants = form_constants(self._mesh, material)
        self._values = expression(self._derivatives(material), np.array([[0.5]]), self._mesh)

    def stress(self, values: Mapping[str, float], stretch: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """Nominal stress P₁ [stress], one for each stretch.

        Args:
            values: Numbers of the material by name (`cutsim.base.parameters.numbers`); the others stay.
            stretch: As many other stretches > 0.
        """
        stretch = self._stretch if stretch is None else stretch
        return self._evaluate(values, stretch)[:, 0] / stretch

    def modulus(self, values: Mapping[str, float]) -> NDArray[np.float64]:
        """Smallest eigenvalue of ∂²W/∂eᵢ∂eⱼ [stress]; Drucker's criterion wants it to be positive.

        Args:
            values: Numbers of the material by name; the others stay.
        """
        _, _, a, c, b = self._evaluate(values, self._stretch).T
        return 0.5 * (a + b) - np.hypot(0.5 * (a - b), c)

    def _derivatives(self, material: Material) -> ufl.core.expr.Expr:
        first, second = ufl.variable(self._first), ufl.variable(self._second)
        stretches = ufl.exp(first), ufl.exp(second), ufl.exp(-first - second)
        F = ufl.as_tensor([[stretches[i] if i == j else 0 for j in range(3)] for i in range(3)])
        W = sum(substituted(material, self._constants).energy(F))
        one, two = ufl.diff(W, first), ufl.diff(W, second)
        return ufl.as_vector([one, two, ufl.diff(one, first), ufl.diff(one, second), ufl.diff(two, second)])

    def _evaluate(self, values: Mapping[str, float], stretch: NDArray[np.float64]) -> NDArray[np.float64]:
        """First and second derivatives of W, with λ₂ such that its faces are free in uniaxial tension."""
        for name, value in values.items():
            require("parameter", name, name in self._constants, "one of " + ", ".join(self._constants))
            self._constants[name].value = value
        self._first.x.array[self._dofs] = np.log(stretch)
        second = self._powers * np.log(stretch)
        for _ in range(_ITERATIONS):
            self._second.x.array[self._dofs] = second
            derivatives = evaluate(self._values, self._mesh, self._cells)
            if not np.isfinite(derivatives).all():
                break
            # towards the minimum of W, also where it is not convex
            slope = np.where(self._free, derivatives[:, 1], 0.0)
            correction = -slope / np.maximum(np.abs(derivatives[:, 4]), np.finfo(float).tiny)
            if np.abs(correction).max() < _ACCURATE:
                break
            second += np.clip(correction, -_LARGEST, _LARGEST)
        else:
            derivatives[:] = np.nan  # no state with free faces was found
        return derivatives


def nominal_stress(material: Material, path: str, stretch: ArrayLike) -> NDArray[np.float64]:
    """Nominal stress P₁ of an incompressible material [stress], one for each stretch.

    Args:
        material: The material, taken at constant volume.
        path: "uniaxial", "equibiaxial" or "pure shear".
        stretch: Stretches λ₁ > 0.

    Raises:
        ValueError: The path is unknown or a stretch is not positive.
    """
    return HomogeneousResponse(material, [(path, stretch)]).stress({})


def unstable_stretches(material: Material, lowest: float, highest: float) -> dict[str, tuple[float, float]]:
    """Where a material fails Drucker's criterion dσ : dε > 0 at constant volume.

    σ is the true stress and ε the logarithmic strain.  Looked for at 201 stretches along each path.

    Args:
        material: The material, taken at constant volume.
        lowest: Smallest stretch λ₁ > 0.
        highest: Largest stretch.

    Returns:
        ToolPath -> smallest and largest unstable stretch; empty if there are none.

    Raises:
        ValueError: The stretches are not positive numbers in this order.
    """
    require("lowest, highest", (lowest, highest), 0 < lowest < highest, "positive and in this order")
    stretch = np.geomspace(lowest, highest, 201)
    moduli = HomogeneousResponse(material, [(path, stretch) for path in PATHS]).modulus({}).reshape(len(PATHS), -1)
    unstable = {path: stretch[modulus <= 0] for path, modulus in zip(PATHS, moduli, strict=True)}
    return {path: (float(found[0]), float(found[-1])) for path, found in unstable.items() if len(found)}
