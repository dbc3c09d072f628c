"""Built-in cases: each is read and begins to run; two give the numbers of the same problem in Python."""

import re
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

from cutsim import (
    Blade,
    Crack,
    Drive,
    Exponential,
    Insertion,
    LinearElastic,
    Mechanics,
    NeoHookean,
    PenaltyContact,
    Solid,
    State,
    StepControl,
    Support,
    cracked_block,
    cracked_space,
    geometry,
    read_geo,
    run,
)
from cutsim.cases import CaseError, built_in_cases, read_case

COMM = MPI.COMM_WORLD
CASES = {name: path for name, (_, path) in built_in_cases().items()}
#: The kernels of these take long to compile. Lessons or other tests run the same bodies, laws and tools, and the
#: validation runs most of the cases themselves.
LONG = {
    "blade",
    "needle-gel",
    "puncture-needle-3d",
    "puncture-slab",
    "skin",
    "skin-needle",
    "slice-push",
    "tear",
    "tear-bar",
}


class Enough(Exception):
    """The run has made as many steps as were wanted."""


def steps(run, number):
    """Reports of the first steps of a run."""
    reports = []

    def record(report):
        reports.append(report)
        if len(reports) == number:
            raise Enough

    with pytest.raises(Enough):
        run(record)
    return reports


@pytest.mark.parametrize("name", sorted(CASES.keys() - LONG))
def test_a_built_in_case_begins_to_run(name):
    simulation = read_case(CASES[name], quick=True).build(COMM)
    last = steps(simulation.run, 2)[-1]
    row = last.columns | simulation.columns(last.columns) | {"time": (last.time, "time")}
    assert set(simulation.curve) <= set(row)
    assert abs(row["energy_closure"][0]) < 0.1
    assert all(np.isfinite(value) for value, _ in row.values())


@pytest.mark.parametrize("name", sorted(LONG))
def test_a_long_case_is_valid(name):
    """Each key is known, each value of its kind and within its range, in both sizes."""
    full, quick = (read_case(CASES[name], quick=quick).text for quick in (False, True))
    assert full != quick


@pytest.mark.parametrize("name", CASES)
def test_what_a_user_would_change_has_a_comment(name):
    lines = CASES[name].read_text(encoding="utf-8").splitlines()
    assert lines[0].startswith("# ")
    tables = (
        "[parameters]",
        "[mesh.set]",
        "[material]",
        "[law]",
        "[body]",
        "[tool]",
        "[insertion]",
        "[analysis]",
        "[steps]",
    )
    names = ("model", "shape", "surfaces", "path", "fixture", "line_searches", "type")  # which say it themselves
    table = ""
    for line in lines:
        table = line.split(" ")[0] if line.startswith("[") else table
        if table in tables and " = " in line and not line.startswith(names):
            assert "#" in line, line


def test_the_beam_is_that_of_python():
    reports = steps(read_case(CASES["dcb"], quick=True).build(COMM).run, 8)
    sizes = dict(L=55, h=1.5, a0=30, fine=20, back=5, lc=0.5, lc_arm=1.0, ny=2, growth=1.05)
    domain = read_geo(geometry("dcb"), COMM, sizes, gdim=2)
    bonded = domain.facets("crack")
    state = State(cracked_space(domain.mesh, ("Lagrange", 2, (2,)), [bonded, domain.facets("precrack")]))
    steel, bond = LinearElastic(young=200e3, poisson=0.3), Exponential(strength=57.0, toughness=0.28)
    soft = PenaltyContact.automatic(steel.young, 0.5, factor=1.0)
    lower = domain.cells("lower")
    crack = Crack(state, bonded, lower, bond, young=steel.young, contact=soft, normal="reference")
    ends = [
        Support(state, domain.facets(f"load_{side}"), 1, lambda t, sign=sign: sign * t / 2, name=side)
        for side, sign in (("upper", 1), ("lower", -1))
    ]
    clamp = [Support(state, domain.facets("end"), axis) for axis in (0, 1)]
    mechanics = Mechanics(state, [Solid(state, steel), crack], [*ends, *clamp])
    control = StepControl(first=0.02, largest=0.02, line_searches=("basic", "l2", "bt"))
    same = steps(lambda record: run(mechanics, 2.4, control, record), 8)
    for name in ("upper_force", "energy_strain", "energy_cohesive_stored"):
        mine, theirs = ([report.columns[name][0] for report in of] for of in (reports, same))
        assert mine == pytest.approx(theirs, rel=1e-9), name


def test_the_cut_is_that_of_python():
    simulation = read_case(CASES["steady-cut"], {"insertion.depth": "1.0"}, quick=True).build(COMM)
    forces = []
    simulation.run(lambda report: forces.append(simulation.columns(report.columns)["force"][0]))
    sizes = dict(dim=2, Lx=1.0, H=6.5, notch=0.5, lc=0.2, band=0.3, growth=1.6)
    domain = read_geo(geometry("block"), COMM, sizes, gdim=2)
    block = cracked_block(domain, NeoHookean(0.777, 0.45), Exponential(strength=0.3, toughness=0.1), viscosity=2e-4)
    blade = Blade(np.radians(20), 0.2, 0.5)
    cut = Insertion.build(block, blade, Drive(speed=1.0, entry_time=1.0), notch=0.5)
    same = []
    control = StepControl(first=0.02, largest=0.05)
    run(cut.mechanics, cut.time_of(1.0), control, lambda report: same.append(cut.columns(report.columns)["force"][0]))
    assert max(forces) > 0.01
    assert forces == pytest.approx(same, rel=1e-8, abs=1e-12)


@pytest.mark.mpi
def test_the_weight_of_bodies_rests_on_their_support(tmp_path):
    """ρ g V of one of two bodies of 2 mm × 1 mm, and f V of a force on both."""
    path = tmp_path / "weight.toml"
    path.write_text(
        """
        mesh = { geometry = "block", dim = 2, set = { Lx = 2, H = 1, lc = 0.5, band = 0.5, notch = 0 } }
        material = { model = "linear-elastic", young = 1, poisson = 0.3 }
        bodies.left = { cells = "left" }
        bodies.right = { cells = "right", density = "1 g/cm^3" }
        supports.ground = { facets = "bottom", direction = "y" }
        supports.side = { facets = "far_left", direction = "x" }
        parameters.g = "9.81 m/s^2"
        [loads.weight]
        kind = "weight"
        bodies = "right"
        direction = "-y"
        value = { times = [0, 1], values = [0, "g"] }
        [loads.pull]
        kind = "body-force"
        direction = [0, 2]
        value = "2e-9*t"
        [analysis]
        until = 1
        [steps]
        fixed = 1
        """,
        encoding="utf-8",
    )
    (report,) = steps(read_case(path).build(COMM).run, 1)
    assert report.columns["ground_force"][0] == pytest.approx(1e-9 * 9810 * 2 - 2e-9 * 4)


def test_a_group_that_the_mesh_lacks_is_named():
    case = read_case(CASES["dcb"], {"supports.clamp.facets": "front"}, quick=True)
    words = "supports.clamp.facets: 'front': must be one of the surfaces .*end, top, bottom"
    with pytest.raises(CaseError, match=words):
        case.build(COMM)


def test_the_page_on_case_files_names_all():
    page = (Path(__file__).parents[1] / "docs" / "case_files.md").read_text(encoding="utf-8")
    section = page.partition("## Cases that come with cutsim")[2].partition("\n## ")[0]
    assert set(re.findall(r"`([a-z0-9-]+)`", section)) - {"extends"} == set(CASES)


def test_a_front_is_found_also_where_it_goes_down():
    simulation = read_case(CASES["fast-tear"], quick=True).build(COMM)
    report = steps(simulation.run, 1)[0]
    assert simulation.columns(report.columns)["front"][0] == pytest.approx(-12.0, abs=1.0), "the end of the cut"
