"""Test rigs in case files: machines of tools, and rigid links."""

import numpy as np
import pytest
from mpi4py import MPI

from cutsim.analysis.stepping import StepControl
from cutsim.bodies.machine import Machine
from cutsim.cases import CaseError, read_case
from helpers.runs import history

COMM = MPI.COMM_SELF
STRIP = """
title = "strip"
[mesh]
geometry = "block"
dim = 2
set = { Lx = 1, H = 1, lc = 0.5, band = 0.5, notch = 0, growth = 1 }
[material]
model = "neo-hookean"
young = 100
poisson = 0.25
[analysis]
until = 1
[steps]
fixed = 0.5
"""
LINKS = (
    STRIP
    + """
[links.grip]
reference = [-1, 0]
x = 0
y = 0
rz = 0
attachments.face = { facets = "far_left" }
[links.lever]
reference = ["1 mm", "2 mm"]
attachments.face = { facets = "far_right", along = "xy" }
[[links.lever.machines]]
axis = "y"
force = "-0.5*t"
[[links.lever.machines]]
axis = "rz"
stiffness = "3 N*mm"
mass = "0.2 g*mm^2"
"""
)
PUSH = (
    STRIP
    + """
[support]
facets = "far_left"
direction = "all"
[tool]
shape = "plane"
normal = [-1, 0]
surfaces = "far_right"
position = ["1.0 - 0.01*t", 0]
machines = { axis = "-x", stiffness = "20 N/mm", damping = "2 N*s/mm", weight = "0.1 N" }
"""
)


@pytest.fixture
def written(tmp_path):
    def write(text):
        path = tmp_path / "case.toml"
        path.write_text(text, encoding="utf-8")
        return read_case(path)

    return write


def test_links_of_a_case(written):
    simulation = written(LINKS).build(COMM)
    rows = history(simulation.problem, 1.0, StepControl.fixed(0.5))
    assert rows["grip_y_force"][-1] == pytest.approx(0.5, rel=1e-6)
    assert rows["lever_face_force_y"][-1] == pytest.approx(-0.5, rel=1e-6)
    # the force acts two millimetres beside the grip's reference
    arm = 2 + rows["lever_x"][-1]
    assert rows["grip_rz_moment"][-1] - 3 * rows["lever_rz"][-1] == pytest.approx(0.5 * arm, rel=1e-5)
    motion = simulation.problem.terms[-1].border.motion
    assert motion._machines.mass == pytest.approx([0, 0, 2e-7])


def test_machine_of_a_tool(written):
    simulation = written(PUSH).build(COMM)
    tool = next(iter(simulation.parts.tools["tool"]))
    coordinate = tool.carriage.axes.motion.coordinates[0]
    assert coordinate.machine == Machine("-x", stiffness=20.0, damping=2.0, weight=0.1)
    rows = history(simulation.problem, 1.0, StepControl.fixed(0.5))
    lag = 0.01 * rows["time"] - rows["tool_drive_x"]
    rate = np.diff(rows["tool_drive_x"], prepend=0.0) / 0.5
    assert 20 * lag + 0.1 - 2 * rate == pytest.approx(rows["tool_force_x"], rel=1e-6)
    assert simulation.curve == ("tool_travel", "tool_resistance")


@pytest.mark.parametrize(
    ("case", "old", "new", "words"),
    [
        (LINKS, "reference = [-1, 0]", "reference = [-1, 0, 0]", r"links.grip.reference: \[.*must have 2 components"),
        (LINKS, 'facets = "far_left"', 'facets = "fat_left"', "links.grip.attachments.face.facets.*far_left"),
        (LINKS, 'axis = "y"', 'axis = "z"', r"links.lever.*machines\[0\].axis"),
        (LINKS, "y = 0", "y = 0\nz = 1", "links.grip.motion: 'z'"),
        (LINKS, '"3 N*mm"', '"3 N/mm"', "links.lever.machines.*stiffness.*moment"),
        (PUSH, '"20 N/mm"', '"20 N"', "machines.*stiffness.*force per length"),
        (PUSH, 'damping = "2 N*s/mm"', 'mass = "-1 g"', "machines.*mass.*>= 0"),
        (PUSH, 'damping = "2 N*s/mm"', "velocity = 1", "tool.velocity: 1.0"),
    ],
)
def test_rigs_that_make_no_sense_are_refused_by_name(written, case, old, new, words):
    assert old in case
    with pytest.raises(CaseError, match=words):
        written(case.replace(old, new, 1)).build(COMM)
