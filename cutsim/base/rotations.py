"""Rotations of rigid bodies as matrices; in the plane from an angle, in space from a rotation vector."""

import numpy as np
from numpy.typing import ArrayLike, NDArray
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
