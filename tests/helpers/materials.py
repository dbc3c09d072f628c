"""Materials at homogeneous deformations."""

import functools

import numpy as np
import pytest
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI

from cutsim.analysis.mechanics import Mechanics
from cutsim.base.compat import evaluate
from cutsim.base.compat import expression as compiled
from cutsim.base.parameters import with_constants
from cutsim.bodies.loads import Support
from cutsim.bodies.solid import Solid
from cutsim.fields.state import State
from helpers.fields import rotation


def name(material):
    """Name of a test case."""
    fibres = getattr(material, "fibres", ())
    return type(fibres[0] if fibres else material).__name__


F0 = np.array([[1.2, 0.3, -0.1], [0.05, 0.9, 0.2], [0.1, -0.15, 1.1]])


class PointResponse:
    """Energy and first Piola–Kirchhoff stress of a material at a homogeneous deformation, compiled once."""

    # one for all: a mesh holds communicators, and MPI has few
    _mesh = mesh.create_unit_interval(MPI.COMM_SELF, 1)

    def __init__(self, material):
        self._F = fem.Constant(self._mesh, np.eye(3))
        F = ufl.variable(self._F)
        W = sum(with_constants(self._mesh, material).energy(F))
        P = ufl.diff(W, F)
        values = ufl.as_vector([W, *(P[i, j] for i in range(3) for j in range(3))])
        self._values = compiled(values, np.array([[0.5]]), self._mesh)

    def __call__(self, F):
        self._F.value[:] = F
        return evaluate(self._values, self._mesh, np.zeros(1, dtype=np.int32))[0]


response = functools.cache(PointResponse)


def energy(material, F):
    return response(material)(F)[0]


def stress(material, F):
    """First Piola–Kirchhoff stress."""
    return response(material)(F)[1:].reshape(3, 3)


def assert_free_of_energy_and_stress(material):
    """The reference state holds no energy and no stress."""
    assert energy(material, np.eye(3)) == pytest.approx(0, abs=1e-14)
    np.testing.assert_allclose(stress(material, np.eye(3)), 0, atol=1e-14)


def assert_hooke(material):
    """P = 2 G ε + λ tr ε I with the constants that the material reports."""
    H = 1e-6 * (F0 - np.eye(3))
    strain = 0.5 * (H + H.T)
    young, poisson = material.young, material.poisson
    hooke = young / (1 + poisson) * (strain + poisson / (1 - 2 * poisson) * np.trace(strain) * np.eye(3))
    np.testing.assert_allclose(stress(material, np.eye(3) + H), hooke, atol=1e-5 * np.abs(hooke).max())


def assert_objective(material, angle, *, isotropic):
    """W(QF) = W(F) and P(QF) = Q P(F); turned before the deformation, an isotropic solid does not notice."""
    Q, W, P = rotation(3, angle), energy(material, F0), stress(material, F0)
    assert energy(material, Q @ F0) == pytest.approx(float(W), rel=1e-12)
    np.testing.assert_allclose(stress(material, Q @ F0), Q @ P, atol=1e-12 * np.abs(P).max())
    alike = energy(material, F0 @ Q) == pytest.approx(float(W), rel=1e-12)
    assert alike == isotropic


PATHS = {"uniaxial": -0.5, "equibiaxial": -2.0, "pure shear": -1.0}


def incompressible(path, stretch):
    """Principal stretches at constant volume: the driven one, its companion, and the free one last."""
    power = PATHS[path]
    return {
        "uniaxial": (stretch, stretch**power, stretch**power),
        "equibiaxial": (stretch, stretch, stretch**power),
        "pure shear": (stretch, 1.0, stretch**power),
    }[path]


def nominal(material, stretches):
    """Driven nominal stress, the pressure being such that the last face is free."""
    P = stress(material, np.diag(stretches))
    return P[0, 0] - P[2, 2] * stretches[2] / stretches[0]


def cube_between_plates(material, stretch, lateral):
    """Unit cube stretched along z (and x); its other faces free, or with symmetry only."""
    domain = mesh.create_unit_cube(MPI.COMM_WORLD, 1, 1, 1, mesh.CellType.hexahedron)
    state = State(fem.functionspace(domain, ("Lagrange", 1, (3,))))

    def face(axis, at):
        return mesh.locate_entities_boundary(domain, 2, lambda x: np.isclose(x[axis], at))

    supports = [Support(state, face(i, 0.0), i) for i in range(3)]
    supports.append(Support(state, face(2, 1.0), 2, lambda t: (stretch - 1) * t, name="top"))
    if lateral:
        supports.append(Support(state, face(0, 1.0), 0, lambda t: (stretch - 1) * t, name="side"))
    return Mechanics(state, [Solid(state, material)], supports)
