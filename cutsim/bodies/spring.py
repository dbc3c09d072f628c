"""Springs of a viscoelastic solid: energy at points and the strain that belongs to a stress (docs/materials.md)."""

import logging
from collections.abc import Callable

import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI

from cutsim.base.assembly import Array
from cutsim.base.compat import expression
from cutsim.base.kinematics import Expr
from cutsim.bodies.tensor_points import TensorPoints

logger = logging.getLogger(__name__)

_ITERATIONS = 30
_HALVINGS = 12
_TOLERANCE = 1e-11


class Spring:
    """Strain energy as a function of strain, and its inverse from stress to strain, at the points of cells.

    A strain is the vector of the components of E that are not zero, and behind them the pressure of the constraint on
    the volume, which is zero unless the energy does not depend on the volume.  A stress is that of the work conjugates
    ∂W/∂E, in which components off the diagonal count twice.  Arrays have the shape (cells, points, components).
    Making it is collective.

    Args:
        points: The points.
        energy: Strain energy per reference volume as a function of the deformation gradient.
        scale: A stress by which to judge convergence, such as Young's modulus.

    Attributes:
        points: The points.
    """

    def __init__(self, points: TensorPoints, energy: Callable[[Expr], Expr], scale: float) -> None:
        self.points, self._scale = points, scale
        self._warned = False
        self._order = {pair: k for k, pair in enumerate(points.pairs)}
        size = len(points.pairs)
        self._strain = fem.Function(points.space(size + 1))
        y = ufl.variable(self._strain)
        C = ufl.Identity(3) + 2 * points.tensor(y)
        W = energy(_cholesky(C))
        self._energy = expression(W, points.points, points.mesh)
        self._isochoric = self._ignores_volume()
        unknowns = range(size + self._isochoric)
        slope = ufl.diff(W + 0.5 * y[size] * ufl.ln(ufl.det(C)), y)
        curvature = ufl.diff(slope, y)
        entries = [slope[i] for i in unknowns] + [curvature[i, j] for i in unknowns for j in unknowns]
        self._newton = expression(ufl.as_vector(entries), points.points, points.mesh)

    @property
    def undeformed(self) -> Array:
        """Strain of the undeformed body."""
        return np.zeros((*self.points.dofs.shape, len(self._order) + 1))

    def energy(self, strain: Array) -> Array:
        """Strain energy per reference volume, shape (cells, points)."""
        return self._evaluate(self._energy, strain)[..., 0]

    def reduced(self, components: Array) -> Array:
        """Strain of the isochoric part of a deformation if the energy does not depend on the volume, else the same.

        Args:
            components: Components of E.
        """
        strain = self.undeformed
        strain[..., :-1] = components
        if self._isochoric:
            C = np.zeros((*components.shape[:-1], 3, 3))
            for (i, j), k in self._order.items():
                C[..., i, j] = C[..., j, i] = (i == j) + 2 * components[..., k]
            factor = 1 / np.cbrt(np.linalg.det(C))
            for (i, j), k in self._order.items():
                strain[..., k] = 0.5 * (factor * C[..., i, j] - (i == j))
        return strain

    def invert(self, stress: Array, start: Array) -> Array:
        """Strain in equilibrium with a stress, by Newton's method at each point.

        Args:
            stress: The stress.
            start: Strain to begin with.
        """
        y, (residual, curvature) = start, self._linearised(start, stress)
        allowed = _TOLERANCE * (self._scale + np.linalg.norm(stress, axis=-1))
        for _ in range(_ITERATIONS):
            norm = np.linalg.norm(residual, axis=-1)
            missed = norm > allowed
            if not missed.any():
                return y
            step = np.zeros_like(y)
            step[..., : residual.shape[-1]] = -np.linalg.solve(curvature, residual[..., None])[..., 0]
            y, residual, curvature = self._searched(y, step, np.where(missed, norm, np.inf), stress)
        if not self._warned:
            logger.warning("no strain found for a relaxing stress at %d points: the audit will not close", missed.sum())
            self._warned = True
        return y

    def _searched(self, y: Array, step: Array, norm: Array, stress: Array) -> tuple[Array, Array, Array]:
        """Strain after a step that is halved wherever the residual does not fall, and in the end not taken there."""
        length = np.ones_like(norm)
        for halving in range(_HALVINGS):
            trial = y + length[..., None] * step
            residual, curvature = self._linearised(trial, stress)
            # what is not a number fails the comparison, too
            worse = ~(np.linalg.norm(residual, axis=-1) < norm)
            if not worse.any():
                break
            length[worse] *= 0.5 if halving < _HALVINGS - 2 else 0.0
        return trial, residual, curvature

    def _linearised(self, y: Array, stress: Array) -> tuple[Array, Array]:
        """Residual and its derivative at each point."""
        unknowns = len(self._order) + self._isochoric
        residual, curvature = np.split(self._evaluate(self._newton, y), [unknowns], axis=-1)
        residual[..., : len(self._order)] -= stress
        return residual, curvature.reshape(*residual.shape, unknowns)

    def _ignores_volume(self) -> bool:
        """Whether growth leaves the energy of a stretched body as it is. Collective."""
        stretched = np.zeros((*self.points.dofs.shape, len(self._order)))
        for i, stretch in enumerate((1.3, 1.1, 0.9)):
            stretched[..., self._order[i, i]] = 0.5 * (stretch**2 - 1)
        self._isochoric = True
        strain, W = self.undeformed, self.energy(self.reduced(stretched))
        strain[..., :-1] = stretched
        changes = bool(np.any(np.abs(self.energy(strain) - W) > 1e-9 * np.abs(W)))
        return not self.points.mesh.comm.allreduce(changes, MPI.LOR)

    def _evaluate(self, compiled: fem.Expression, y: Array) -> Array:
        self._strain.x.array.reshape(-1, len(self._order) + 1)[self.points.dofs] = y
        return self.points.values(compiled)


def _cholesky(C: Expr) -> Expr:
    """The upper triangular F for which FᵀF = C."""
    a = ufl.sqrt(C[0, 0])
    b, c = C[0, 1] / a, C[0, 2] / a
    d = ufl.sqrt(C[1, 1] - b**2)
    e = (C[1, 2] - b * c) / d
    f = ufl.sqrt(C[2, 2] - c**2 - e**2)
    return ufl.as_matrix([[a, b, c], [0, d, e], [0, 0, f]])
