"""Blade and needle of tests/validation, which no other test runs, on a short way: their own checks hold."""

import json

import pytest

from validation import blade, needle_insertion


def test_blade_with_friction_and_heat(tmp_path):
    blade.main(dim=2, friction=[0.05], heat=True, depth=0.8, quick=True, out=tmp_path)
    found = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))
    assert found["toughness_in_the_books"] == pytest.approx(found["toughness_given"], rel=0.03)
    assert found["cut_area"] > 0.005 and found["largest_heating"] > 0.001
    assert {path.name for path in tmp_path.glob("*.png")} >= {"force.png", "energy.png"}


def test_parts_of_the_force_on_a_needle(tmp_path):
    needle_insertion.main(once=True, depth=0.9, quick=True, out=tmp_path)
    found = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))
    names = ("deformation", "cutting", "tip_friction", "shaft_friction", "viscosity")
    parts = sum(found[f"{name}_at_the_end"] for name in names)
    assert parts == pytest.approx(found["force_at_the_end"], rel=0.02)
    assert found["tip_friction_at_the_end"] > 0
