"""Rotations of rigid bodies as matrices; in the plane from an angle, in space from a rotation vector."""

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from cutsim.base.arrays import Array


def rotation_matrix(turn: ArrayLike) -> Array:
    """Matrix of a rotation.

    Args:
        turn: Angle in the plane, counterclockwise; or rotation vector in space, the axis times the angle [rad].

    Returns:
        Proper orthogonal matrix, 2 × 2 or 3 × 3.
    """
    values = np.atleast_1d(np.asarray(turn, dtype=float))
    if len(values) == 3:
        return np.asarray(Rotation.from_rotvec(values).as_matrix())
    c, s = np.cos(values[0]), np.sin(values[0])
    return np.array([[c, -s], [s, c]])


def rotation_vector(matrix: NDArray[np.float64]) -> Array:
    """Angle, one number, or rotation vector of a matrix, by at most half a turn [rad]."""
    if len(matrix) == 3:
        return np.asarray(Rotation.from_matrix(matrix).as_rotvec())
    return np.array([np.arctan2(matrix[1, 0] - matrix[0, 1], matrix[0, 0] + matrix[1, 1])])


def rotation_derivatives(vector: Array) -> tuple[Array, Array, Array]:
    """Rotation matrix of a rotation vector with its derivatives.

    Args:
        vector: Axis times angle, three components [rad].

    Returns:
        R, ∂R/∂θ_i (3, 3, 3) and ∂²R/∂θ_i∂θ_j (3, 3, 3, 3), the indices of θ first.
    """
    spins = np.array([np.cross(axis, np.eye(3)).T for axis in np.eye(3)])  # spins[i] w = e_i × w
    A = np.einsum("i,ijk->jk", vector, spins)
    first, second = np.zeros((3, 3, 3)), np.zeros((3, 3, 3, 3))
    matrix = expm(A)
    for i in range(3):
        for j in range(i, 3):
            # the exponential of a block triangle has the derivatives of that of its diagonal in its corner
            triangle = np.kron(np.eye(4), A)
            for row, column, spin in ((0, 1, i), (0, 2, j), (1, 3, j), (2, 3, i)):
                triangle[3 * row : 3 * row + 3, 3 * column : 3 * column + 3] = spins[spin]
            whole = expm(triangle)
            first[i], first[j] = whole[:3, 3:6], whole[:3, 6:9]
            second[i, j] = second[j, i] = whole[:3, 9:]
    return matrix, first, second
