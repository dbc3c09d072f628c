"""The named materials: what the sources say of their stiffness, and that they can be used."""

import numpy as np
import pytest

from cutsim.materials.elastic import Material
from cutsim.materials.library import LIBRARY, material
from cutsim.materials.rubbers import Ogden
from helpers.materials import energy, stress


@pytest.mark.parametrize("name", LIBRARY)
def test_every_record_is_a_stress_free_material_with_a_source(name):
    record = material(name)
    assert isinstance(record.material, Material)
    assert len(record.source) > 10
    assert 0.3 < record.material.poisson < 0.5
    assert energy(record.material, np.eye(3)) == pytest.approx(0, abs=1e-13 * record.material.young)
    np.testing.assert_allclose(stress(record.material, np.eye(3)), 0, atol=1e-12 * record.material.young)


def test_ogden_rubber_in_the_notation_of_its_source():
    """P = Σ μₚ (λ^(α−1) − λ^(−α/2−1)) of the printed numbers."""
    rubber = material("natural rubber, Ogden").material
    assert isinstance(rubber, Ogden)
    for x in (1.2, 3.0):
        exact = sum(m * (x ** (a - 1) - x ** (-a / 2 - 1)) for m, a in ((0.63, 1.3), (0.0012, 5.0), (-0.01, -2.0)))
        P = stress(rubber, np.diag([x, x**-0.5, x**-0.5]))
        assert P[0, 0] - P[2, 2] * x**-1.5 == pytest.approx(exact, rel=1e-10)


def test_thesis_silicones():
    """Table 5.1: Young's modulus, Poisson's ratio, strength."""
    table = [(0.777, 0.48, 0.61477), (0.527, 0.35, 0.34235), (0.813, 0.43, 0.79311), (0.723, 0.41, 0.59311)]
    records = [material(f"silicone {i}") for i in (1, 2, 3, 4)]
    assert [(r.material.young, r.material.poisson, r.strength) for r in records] == table


def test_unknown_name_is_refused_with_the_names_there_are():
    with pytest.raises(ValueError, match=r"name = 'steel' is not allowed: .* silicone 1.*dermis"):
        material("steel")
