"""Cases are put together by name: what each table becomes, by what it does."""

import meshio
import numpy as np
import pytest
from mpi4py import MPI

from cutsim.cases import CaseError, read_case
from cutsim.cases.domains import Domain

COMM = MPI.COMM_WORLD

#: A strip of 2 × 1 mm, without a crack, as the geometry of two halves.
STRIP = """
title = "strip"
[mesh]
geometry = "block"
dim = 2
set = { Lx = 1, H = 1, lc = 0.5, band = 0.5, notch = 0, growth = 1 }
[material]
model = "linear-elastic"
young = 100
poisson = 0.25
[supports.left]
facets = "far_left"
direction = "x"
[supports.corner]
points = [[-1, -1]]
direction = "y"
[analysis]
until = 1
[steps]
fixed = 0.5
"""
#: A block on a slab, each with a mesh of its own, that is pressed down in a second and then drawn.
SLIDING = """
title = "block on a slab"
[mesh]
geometry = "sliding"
dim = 2
set = { B = 4, H = 2, L = 12, X = 2, nx = 4, nl = 18, ly = 1 }
[material]
model = "linear-elastic"
young = "100 MPa"
poisson = 0
[pair]
slave = "rubbing"
master = "track"
friction = 0.25
[supports.press]
facets = "top"
direction = "-y"
value = { times = [0, 1], values = [0, 0.02] }
[supports.draw]
facets = "top"
direction = "x"
value = "max(t - 1, 0)"
corners = [1]
[supports.ground]
facets = "bottom"
direction = "all"
[analysis]
until = 3
[steps]
fixed = 0.5
"""
#: A block that is cut through, whose upper half is lifted, moved aside by a half, pressed and drawn.
CUT = """
title = "halves"
[mesh]
geometry = "blocks"
dim = 3
set = { B = 4, H = 1, L = 4, nx = 4, ly = 1 }
[material]
model = "linear-elastic"
young = 100
poisson = 0
[crack]
facets = "crack"
plus = "lower"
law = "none"
closing = false
[pair]
friction = 0.25
contact = { stiffness = 100 }
SURFACES
[supports.press]
cells = "upper"
direction = "y"
value = { times = [0, 1, 2, 3], values = [0, 0.5, 0.5, -0.02] }
[supports.draw]
cells = "upper"
direction = "x"
value = { times = [0, 1, 2, 3, 4], values = [0, 0, 2, 2, 1] }
[supports.guide]
cells = "upper"
direction = "z"
[supports.ground]
cells = "lower"
direction = "all"
[analysis]
until = 4
[steps]
fixed = 0.5
"""
HEAT = """
[heat]
initial = "20 degC"
[heat.body]
capacity = 1
density = 1
conductivity = 2
[heat.boundaries.warm]
kind = "flux"
facets = "far_right"
value = 1
[heat.boundaries.cold]
kind = "temperature"
facets = "far_left"
value = "293.15 + t*0"
"""
#: Two cubes of 10 mm on each other, under a plate that is read from a file.
PLATE = """
title = "plate on cubes"
[mesh]
geometry = "blocks"
dim = 3
set = { B = 10, H = 10, L = 10, nx = 2, ly = 5 }
[material]
model = "linear-elastic"
young = 100
poisson = 0
[tool]
shape = "surface"
file = "plate.stl"
scale = 10
surfaces = "top"
contact = { stiffness = 1000 }
path = { times = [0, 1], points = [[0, 10, 0], [0, "10 - 0.1", 0]] }
[supports.ground]
facets = "bottom"
direction = "all"
[analysis]
until = 1
[steps]
fixed = 1
"""


@pytest.fixture
def written(tmp_path):
    """Write a case file that all ranks read."""

    def write(text):
        path = COMM.bcast(tmp_path) / "case.toml"
        if COMM.rank == 0:
            path.write_text(text, encoding="utf-8")
        COMM.barrier()
        return path

    return write


def last(simulation):
    """Columns after the last step, and the times of all."""
    reports = []
    simulation.run(reports.append)
    columns = reports[-1].columns | simulation.columns(reports[-1].columns)
    return {name: value for name, (value, _) in columns.items()}, [report.time for report in reports]


def largest_displacement(simulation, axis):
    u = simulation.problem.state.u.x.array.reshape(-1, 2)[:, axis]
    return COMM.allreduce(u.max(initial=-np.inf), MPI.MAX)


@pytest.mark.mpi
def test_a_traction_stretches_a_strip(written):
    text = STRIP + (
        '[body]\nplane = "stress"\n[groups.end]\nfacets = ["far_right", "top_right"]\nx = [0.9, 1.1]\n'
        '[load]\nkind = "traction"\nfacets = "end"\ndirection = "x"\nvalue = "t"\n'
    )
    simulation = read_case(written(text)).build(COMM)
    row, _ = last(simulation)
    assert row["load_force_x"] == pytest.approx(1.0) and row["left_force"] == pytest.approx(-1.0)
    assert largest_displacement(simulation, 0) == pytest.approx(2 / 100)


def test_a_pressure_follows_its_table(written):
    table = "{ times = [0, 0.3, 1], values = [0, -3, -1] }"
    text = STRIP + f'[load]\nkind = "pressure"\nfacets = "far_right"\nvalue = {table}\n[body]\nplane = "stress"\n'
    simulation = read_case(written(text)).build(COMM)
    _, times = last(simulation)
    assert times == pytest.approx([0.3, 0.8, 1.0])
    assert largest_displacement(simulation, 0) == pytest.approx(2 / 100, rel=0.02)


@pytest.mark.mpi
def test_a_pair_rubs(written):
    simulation = read_case(written(SLIDING)).build(COMM)
    row, _ = last(simulation)
    assert row["press_force"] > 1.0 and row["draw_force"] == pytest.approx(0.25 * row["press_force"], rel=0.01)
    assert simulation.curve == ("press_displacement", "press_force")


@pytest.mark.mpi
@pytest.mark.parametrize(
    "surfaces", ['slave = "crack+"\nmaster = "crack-"', 'slave = ["crack+", "crack-"]', "automatic = true"]
)
def test_faces_of_a_crack_slide(written, surfaces):
    row, _ = last(read_case(written(CUT.replace("SURFACES", surfaces))).build(COMM))
    assert row["press_force"] == pytest.approx(-100 * 0.02 * 12, rel=1e-6)
    assert row["draw_force"] == pytest.approx(-0.25 * 100 * 0.02 * 12, rel=1e-6)


@pytest.mark.parametrize(
    ("surfaces", "words"),
    [
        ("", "pair.slave: missing"),
        ('slave = "crack+"\nautomatic = true', "pair.slave: .*not allowed beside automatic"),
        ('slave = "crack"\nmaster = "crack-"', "pair.slave: .*face of a cut"),
        ('slave = "crack+"\nmaster = "crack*"', r"pair.master: 'crack\*': must be one of the surfaces"),
        ('slave = "top"\nlaw = { model = "exponential", strength = 1, opening = 1 }', "pair.law: .*meets itself"),
    ],
)
def test_surfaces_that_cannot_be(written, surfaces, words):
    with pytest.raises(CaseError, match=words):
        read_case(written(CUT.replace("SURFACES", surfaces))).build(COMM)


def test_faces_that_slide_leave_their_friction_to_a_pair(written):
    text = CUT.replace("SURFACES", "automatic = true").replace("closing = false", "closing = false\nfriction = 0.3")
    with pytest.raises(CaseError, match=r"crack.friction: 0.3: must be left out with closing=false"):
        read_case(written(text)).build(COMM)


def test_heat_flows_through_a_strip(written):
    text = (STRIP + HEAT).replace("until = 1\n", "until = 1e6\n").replace("fixed = 0.5", "fixed = 1e6")
    row, _ = last(read_case(written(text)).build(COMM))
    assert row["temperature_max"] - 293.15 == pytest.approx(1.0, rel=1e-4)  # flux × length / conductivity
    assert row["cold_heat_flow"] == pytest.approx(-1.0, rel=1e-4)


def test_a_tool_from_a_file_presses(written):
    path = written(PLATE)
    corners = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (0.0, 1.0) for z in (-1.0, 2.0)])
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [half for a, b, c, d in faces for half in ((a, b, c), (a, c, d))]
    meshio.write_points_cells(path.parent / "plate.stl", corners, [("triangle", np.array(triangles))])
    simulation = read_case(path).build(COMM)
    row, _ = last(simulation)
    # two springs in a row: the cubes, and the penalty
    assert row["tool_resistance"] == pytest.approx(0.1 * 100 / (20 / 100 + 1 / 1000), rel=1e-3)
    assert row["tool_travel"] == pytest.approx(0.1)


@pytest.mark.mpi
@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("points = [[-1, -1]]", "points = [[-1, -9]]", r"supports.corner.points\[0\]: no vertex of the mesh is near"),
        ("points = [[-1, -1]]", "points = [[-1, -1, 0]]", r"supports.corner.points\[0\]: .*: must have 2 components"),
        ('direction = "y"', 'direction = "z"', r"supports.corner.direction: 'z': must be another axis"),
        ('facets = "far_left"', 'facets = "back"', "supports.left.facets: 'back': must be one of the surfaces left"),
        ("dim = 2\n", "", r"mesh.dim: missing, must be given"),
        (
            "[supports.left]",
            "[groups.none]\nfacets = 'top_left'\ny = [1, 2]\n[supports.left]",
            r"groups.none: no facet",
        ),
    ],
)
def test_what_does_not_go_with_the_mesh_is_named(written, old, new, words):
    assert old in STRIP
    with pytest.raises(CaseError, match=rf"case.toml:\d+: {words}"):
        read_case(written(STRIP.replace(old, new))).build(COMM)


#: An insertion into an intact block; its sizes follow from the tool and the law, whose opening is 0.5 / e mm.
BY_RULE = """
title = "by the rule"
[mesh]
geometry = "block"
dim = 2
set = { Lx = 1, H = 2, band = 0.2, notch = 0, growth = 2 }
[material]
model = "neo-hookean"
young = 1
poisson = 0.4
[law]
model = "exponential"
strength = 1
toughness = 0.5
[tool]
shape = "blade"
half_angle = 0.3
tip_radius = 0.3
half_thickness = 0.4
[insertion]
speed = 1
depth = 1
[steps]
fixed = 0.5
"""


@pytest.mark.parametrize(
    ("radius", "notch", "along", "mouth"),
    [(0.3, 0, 0.2 / np.e, 0.1 / np.e), (0.03, 0, 0.03, 0.01), (0.03, 0.5, 0.03, 0.03)],
)
def test_sizes_follow_from_tool_and_law(written, radius, notch, along, mouth):
    """min(r, 0.4 ε) along the crack; at the mouth without a notch also a third of r and half of that."""
    text = BY_RULE.replace("tip_radius = 0.3", f"tip_radius = {radius}").replace("notch = 0", f"notch = {notch}")
    case = read_case(written(text.replace("speed = 1", f"speed = 1\nnotch = {notch}")))
    tagged = Domain.of(case, case.document, COMM).tagged
    y = tagged.mesh.geometry.x[tagged.mesh.geometry.x[:, 0] == 0, 1]
    steps = -np.diff(np.sort(y)[::-1])
    assert 0.9 * along < steps.max() <= along * (1 + 1e-9)
    assert 0.7 * mouth < steps[0] <= mouth * (1 + 1e-9)


def test_a_rule_needs_a_tool_and_a_law(written):
    with pytest.raises(CaseError, match=r"mesh\.set\.lc: must be a number: 'rule' needs a tool"):
        read_case(written(STRIP.replace("lc = 0.5", 'lc = "rule"'))).build(COMM)
    with pytest.raises(CaseError, match=r"set\.growth"):
        read_case(written(STRIP.replace("growth = 1", 'growth = "rule"')))
