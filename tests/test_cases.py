"""Case files: what is read, and what is said of what cannot be."""

import math

import pytest

from cutsim import Blade, Exponential, NeoHookean, StepControl
from cutsim.cases import CaseError, read_case

BLADE = """
title = "Blade cut of silicone"
[parameters]
edge = 0.2
angle = "11.5 deg"
[mesh]
geometry = "block"
dim = 2
set = { Lx = 4, H = 6, lc = "edge", band = "2*edge" }
[material]
model = "neo-hookean"
young = "0.777 MPa"
poisson = 0.48
[law]
model = "exponential"
strength = 0.6
toughness = "200 N/m"
[body]
viscosity = "0.002 MPa s"
[tool]
shape = "blade"
half_angle = "angle"
tip_radius = "edge/4"
half_thickness = "855 um"
[insertion]
speed = "1 mm/s"
depth = 3.0
notch = 0.5
[steps]
first = 0.02
largest = 0.1
"""


@pytest.fixture
def written(tmp_path):
    """Write a case file."""

    def write(text, name="case.toml"):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write


def refused(path, changes=None):
    """What is wrong with a case file, without its folder."""
    with pytest.raises(CaseError) as error:
        read_case(path, changes)
    return [problem.replace(f"{path.parent}/", "") for problem in error.value.problems]


def test_values_become_the_objects_of_cutsim(written):
    case = read_case(written(BLADE))
    assert case.material == NeoHookean(0.777, 0.48)
    assert case.law == Exponential(strength=0.6, toughness=0.2)
    assert case.tools["tool"].made == Blade(math.radians(11.5), 0.05, 0.855)
    assert case.steps == StepControl(0.02, 0.1)
    assert case.mesh.set == {"Lx": 4, "H": 6, "lc": 0.2, "band": 0.4}
    assert case.bodies["body"].viscosity == 0.002


def test_all_that_is_wrong_is_said_at_once(written):
    wrong = BLADE.replace("poisson = 0.48", "poison = 0.48").replace('"200 N/m"', '"200 N"').replace("= 0.02", "= 0.2")
    assert refused(written(wrong)) == [
        "case.toml:10: material.poisson: missing, must be given: Poisson's ratio, −1 < ν < ½ [–].",
        "case.toml:13: material.poison: unknown key, must be one of model, young, poisson; did you mean 'poisson'?",
        "case.toml:17: law.toughness: '200 N': must be a number [N/mm], a quantity such as '1 N/mm' or an expression: "
        "'N' is no unit of a toughness",
        "case.toml:31: steps.largest: 0.1: must be a finite number >= first = 0.2",
    ]
