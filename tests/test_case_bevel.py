"""A needle with a bevel is inserted by a case file: its halves mirror each other, and the bevel drives it aside."""

import numpy as np
import pytest
from mpi4py import MPI

from cutsim.cases import CaseError, read_case
from cutsim.studies.picture import tool_surface

COMM = MPI.COMM_SELF
CASE = """
title = "needle with a bevel"
[mesh]
geometry = "needle"
dim = 3
set = { L = 4, B = 3.2, H = 3.5, whole = 1, notch = 0.8, slit = 1.2, deep = 2.4, band = 0.5, lc = 0.4, growth = 2 }
[material]
model = "neo-hookean"
young = 0.3
poisson = 0.45
[law]
model = "exponential"
strength = 0.1
toughness = 0.1
[body]
viscosity = 0.001
[tool]
shape = "bevel-needle"
bevel_angle = "30 deg"
radius = 0.8
edge_radius = 0.16
push = [0, -1, 0]
lateral = [0, 0, 1]
[insertion]
speed = 1
entry_time = 1
notch = "mesh.set.notch"
depth = 0.7
[steps]
first = 0.02
largest = 0.1
"""


@pytest.fixture
def written(tmp_path):
    def write(text=CASE):
        path = tmp_path / "case.toml"
        path.write_text(text, encoding="utf-8")
        return read_case(path)

    return write


def test_a_needle_with_a_bevel_opens_a_crack(written):
    simulation, found = written().build(COMM), []
    simulation.run(found.append)
    columns = {**found[-1].columns, **simulation.columns(found[-1].columns)}
    row = {name: value for name, (value, _) in columns.items()}
    right, left = (np.array([row[f"bevelneedle_{side}_force_{axis}"] for axis in "xyz"]) for side in ("right", "left"))
    np.testing.assert_allclose(right * (-1, 1, 1), left, atol=1e-8 * row["force"])
    assert row["depth"] == pytest.approx(0.7) and row["force"] > 0.1
    assert right[0] > 0.2 * row["force"], "it wedges the faces apart"
    assert abs(right[2]) > 0.01 * right[0], "the bevel drives it aside"
    assert row["imbalance"] < 1e-8 and abs(row["energy_closure"]) < 0.01
    surface = tool_surface(simulation.insertion)
    if surface is not None:  # pyvista is there
        assert surface.bounds[2] == pytest.approx(-row["depth"], abs=0.1)
        assert surface.bounds[1] == pytest.approx(0.8, abs=0.1)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("lateral = [0, 0, 1]", "lateral = [1, 0, 0]", "tool.lateral: .*must be in the plane of the crack"),
        ("whole = 1, ", "", "insertion.fixture.symmetry: .*both halves of this tool differ"),
        ('"30 deg"', '"70 deg"', "tool.bevel_angle: .*π/3"),
        ("edge_radius = 0.16", "edge_radius = 0.2", "tool.edge_radius: 0.2: .*radius/5"),
        ("lateral = [0, 0, 1]", "lateral = [0, 1, 1]", "tool.lateral: .*orthogonal to push"),
    ],
)
def test_a_bevel_that_does_not_go_with_the_body_is_refused_by_name(written, old, new, words):
    assert old in CASE
    with pytest.raises(CaseError, match=words):
        written(CASE.replace(old, new, 1)).build(COMM)
