"""Displacements to start a test from: turned, smooth, and with a jump."""

import numpy as np
from dolfinx import fem

from cutsim.base.compat import geometry_nodes


def rotation(gdim, angle):
    """Rotation matrix, in 3-D about a skew axis (Rodrigues' formula)."""
    if gdim == 2:
        return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    a = np.array([1.0, -2.0, 0.5]) / np.linalg.norm([1.0, -2.0, 0.5])
    W = np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
    return np.eye(3) + np.sin(angle) * W + (1 - np.cos(angle)) * W @ W


def smooth(V, seed, size):
    """Some smooth field of a given size: forces have no kink in its neighbourhood."""
    rng = np.random.default_rng(seed)
    gdim = V.mesh.geometry.dim
    a, b, c = rng.uniform(-1, 1, (gdim, 3)), rng.uniform(-1, 1, (gdim, 3)), rng.uniform(-1, 1, gdim)
    w = fem.Function(V)
    w.interpolate(lambda x: np.array([np.sin(a[i] @ x + c[i]) + 0.5 * np.cos(b[i] @ x) for i in range(gdim)]))
    return size * w.x.array / np.abs(w.x.array).max()


def wavy(V, seed, size):
    """Some smooth field."""
    rng = np.random.default_rng(seed)
    gdim = V.mesh.geometry.dim
    a, b = rng.uniform(-2, 2, (gdim, 3)), rng.uniform(-2, 2, (gdim, 3))
    w = fem.Function(V)
    w.interpolate(lambda x: np.array([np.sin(a[i] @ x + i) + 0.5 * np.cos(b[i] @ x) for i in range(gdim)]))
    return size * w.x.array


def jump_part(state, seed, size):
    """A smooth field on the upper block only."""
    w = fem.Function(state.V)
    field = fem.Function(state.V)
    field.x.array[:] = smooth(state.V, seed, size)
    gdim = state.mesh.geometry.dim
    cells = np.arange(state.mesh.topology.index_map(gdim).size_local, dtype=np.int32)
    points = state.mesh.geometry.x[geometry_nodes(state.mesh)].mean(axis=1)
    w.x.array[:] = 0
    for cell in cells[points[:, gdim - 1] > 0.5]:
        dofs = state.V.dofmap.cell_dofs(cell)
        for i in range(gdim):
            w.x.array[dofs * gdim + i] = field.x.array[dofs * gdim + i]
    return w.x.array
