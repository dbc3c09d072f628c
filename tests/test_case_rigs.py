"""Test rigs in case files: machines of tools, and rigid links."""

import numpy as np
import pytest
from mpi4py import MPI

from cutsim.analysis.stepping import StepControl
from cutsim.bodies.machine import Machine
from cutsim.cases import CaseError, read_case
from helpers.runs import history

COMM, WORLD = MPI.COMM_SELF, MPI.COMM_WORLD
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
#: Two wires on a rocker whose pivot goes down, on the right side of a strip that is held on the left.
ROCKER = (
    STRIP
    + """
[support]
facets = "far_left"
direction = "all"
[carriage]
position = ["1.4 - 0.05*t", -0.55]
machines = { axis = "rz" }
[tools.a]
shape = "ball"
radius = 0.2
surfaces = "far_right"
position = ["1.195 - 0.05*t", -0.9]
carriage = "carriage"
[tools.b]
shape = "ball"
radius = 0.2
surfaces = "far_right"
position = ["1.195 - 0.05*t", -0.2]
carriage = "carriage"
"""
)
#: A slab on its lower side, loaded along a line across its upper one, and at a point.
SLAB = """
title = "slab"
[mesh]
geometry = "blocks"
dim = 3
set = { B = 4, H = 1, L = 4, nx = 4, ly = 1 }
[material]
model = "linear-elastic"
young = 100
poisson = 0
[groups.line]
vertices = "top"
x = [1, 1]
[groups.corner]
points = [[2, 1, 1]]
[supports.ground]
cells = "lower"
direction = "all"
[loads.line]
kind = "line"
vertices = "line"
direction = "-y"
value = "2*t"
[loads.corner]
kind = "force"
vertices = "corner"
direction = "-y"
value = "3*t"
[measures.top]
kind = "area"
facets = "top"
[measures.pressure]
kind = "formula"
value = "(line_force_y + corner_force_y)/top"
quantity = "stress"
[analysis]
until = 1
[steps]
fixed = 0.5
"""


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


@pytest.mark.mpi
def test_tools_of_a_case_share_a_carriage(written):
    """The rocker turns until the moments of both wires about its pivot cancel."""
    simulation = written(ROCKER).build(WORLD)
    rows, moments = history(simulation.problem, 1.0, StepControl.fixed(0.5)), []
    for name in "ab":
        arm = rows[f"{name}_x"] - 1.4 + 0.05 * rows["time"], rows[f"{name}_y"] + 0.55
        turning = arm[0] * rows[f"{name}_force_y"] - arm[1] * rows[f"{name}_force_x"]
        moments.append(turning + rows[f"{name}_moment_z"])
        assert np.hypot(*arm) == pytest.approx(np.hypot(0.205, 0.35), rel=1e-12)
    assert np.abs(moments[0]).min() > 1e-3
    assert moments[0] == pytest.approx(-moments[1], rel=1e-6)
    assert abs(rows["carriage_rz"][-1]) > 1e-6


@pytest.mark.mpi
def test_lines_points_and_areas_have_names(written):
    simulation = written(SLAB).build(WORLD)
    reports = []
    simulation.run(reports.append)
    found = simulation.columns(reports[-1].columns)
    (size, kind), (pressure, _) = found["top"], found["pressure"]
    domain = simulation.domain
    assert kind == "area" and size == pytest.approx(domain.area("top"))
    low, high = domain.extent("top")
    x = domain.mesh.geometry.x[domain.vertices("line")]  # of a mesh of degree 1 nodes are vertices
    assert WORLD.allreduce(len(x)) > 0
    assert pressure * size == pytest.approx(-2 * (high - low)[2] - 3)


@pytest.mark.parametrize(
    ("case", "old", "new", "words"),
    [
        (ROCKER, '["1.4 - 0.05*t", -0.55]', "[1.4]", r"carriage.position: \[.*must have 2 components"),
        (ROCKER, 'machines = { axis = "rz" }', "", "carriage.machines: missing, must be given"),
        (ROCKER, '{ axis = "rz" }', '{ axis = "rx" }', "carriage.machines.axis: 'rx': must be another axis"),
        (ROCKER, '{ axis = "rz" }', '{ axis = "rz", velocity = 1 }', "carriage.machines.velocity: 1: must be 0 for"),
        (ROCKER, 'carriage = "carriage"', 'carriage = "carrige"', "tools.a.carriage: 'carrige': .*'carriage'"),
        (
            ROCKER,
            'carriage = "carriage"',
            'carriage = "carriage"\nmachines = { axis = "x" }',
            "tools.a.machines: .*besid",
        ),
        (
            ROCKER,
            "[tools.a]",
            "[carriages.idle]\nposition = [0, 0]\nmachines = []\n[tools.a]",
            "carriages.idle: carries",
        ),
        (ROCKER, "machines = {", "release = -1\nmachines = {", "carriage.release: -1.*>= 0"),
        (SLAB, 'vertices = "top"', 'vertices = "tip"', r"groups.line.vertices: 'tip': .*top"),
        (SLAB, "x = [1, 1]", "x = [1.1, 1.2]", "groups.line: no facet, cell or vertex"),
        (SLAB, "x = [1, 1]", 'facets = "top"', "groups.line: .*one of facets, cells, vertices and points"),
        (SLAB, "[groups.corner]", "[groups.bottom]\npoints = [[0, 0, 0]]\n[groups.corner]", "groups.*bottom"),
        (
            SLAB,
            'facets = "top"\n[measures.pressure]',
            'facets = "tap"\n[measures.pressure]',
            "measures.top.facets: .*'top'",
        ),
        (LINKS, "reference = [-1, 0]", "reference = [-1, 0, 0]", r"links.grip.reference: \[.*must have 2 components"),
        (LINKS, 'facets = "far_left"', 'facets = "fat_left"', "links.grip.attachments.face.facets.*far_left"),
        (LINKS, 'axis = "y"', 'axis = "z"', r"links.lever.*machines\[0\].axis"),
        (LINKS, "y = 0", "y = 0\nz = 1", "links.grip.z: 1.0: not allowed: the mesh is flat"),
        (LINKS, '"3 N*mm"', '"3 N/mm"', "links.lever.machines.*stiffness.*moment"),
        (PUSH, '"20 N/mm"', '"20 N"', "machines.*stiffness.*force per length"),
        (PUSH, 'damping = "2 N*s/mm"', 'mass = "-1 g"', "machines.*mass.*>= 0"),
        (
            PUSH,
            'damping = "2 N*s/mm"',
            "velocity = 1",
            "tool.machines.velocity: 1: must be 0 for a machine",
        ),
    ],
)
def test_rigs_that_make_no_sense_are_refused_by_name(written, case, old, new, words):
    assert old in case
    with pytest.raises(CaseError, match=words):
        written(case.replace(old, new, 1)).build(COMM)
