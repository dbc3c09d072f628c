"""Checkpoints: a run that is resumed, on any number of ranks, goes on as if it had not been interrupted."""

import json
import logging
import resource
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI

from cutsim import CheckpointError, Checkpoints, Recording, StepControl, read_history, run
from cutsim.analysis.stepping import Interrupted
from cutsim.base.compat import expression
from cutsim.base.places import Places
from cutsim.bodies.tensor_points import TensorPoints
from cutsim.commands.launch import environment, mpirun
from cutsim.fields.space import vertex_space
from helpers.blocks import make_blocks
from helpers.boxes import two
from helpers.coupled import sliding
from helpers.output import written
from resumed_run import LAW, STEP, go, problem, rows_of, step_of, storm

WORLD = MPI.COMM_WORLD
CELLS = {
    "triangles": (2, mesh.CellType.triangle),
    "quadrilaterals": (2, mesh.CellType.quadrilateral),
    "tetrahedra": (3, mesh.CellType.tetrahedron),
    "hexahedra": (3, mesh.CellType.hexahedron),
}


@pytest.fixture(scope="module")
def first_ranks():
    """Communicators of the first rank, the first two and so on; None on the others."""
    comms = [WORLD.Split(WORLD.rank < count, WORLD.rank) for count in range(1, WORLD.size + 1)]
    yield {count: comm if WORLD.rank < count else None for count, comm in enumerate(comms, start=1)}
    for comm in comms:
        comm.Free()


# -- places -----------------------------------------------------------------------------------------------------------


def wave(x):
    return np.sin(3 * x[0] + 5 * x[1] + 7 * x[2])


def agree(make):
    """What is gathered is the same from all ranks as from one alone, in the same order, and finds its way back."""
    whole, alone = make(WORLD), make(MPI.COMM_SELF)
    for name, (places, values) in whole.items():
        gathered, expected = places.gather(values), alone[name][0].gather(alone[name][1])
        np.testing.assert_allclose(places.scatter(gathered), values, atol=1e-12, err_msg=name)
        np.testing.assert_allclose(WORLD.bcast(gathered), expected, atol=1e-12, err_msg=name)


@pytest.mark.mpi
@pytest.mark.parametrize("cell", CELLS)
def test_places_are_the_same_on_any_number_of_ranks(cell):
    """Dofs of a cracked space, of the vertices of one body, of cells, and points of facets and of cells."""
    gdim, kind = CELLS[cell]

    def make(comm):
        b = make_blocks(gdim, 4, comm, kind)
        domain = b.state.mesh
        u, means = fem.Function(b.state.V), fem.Function(fem.functionspace(domain, ("DG", 0)))
        u.interpolate(lambda x: np.array([wave(x), *x[1:gdim]]), b.lower)
        u.interpolate(lambda x: np.array([2 + wave(x), *x[1:gdim]]), b.upper)
        means.interpolate(wave)
        pressure = fem.Function(vertex_space(b.state.V, b.upper))
        pressure.interpolate(wave, b.upper)
        for function in (u, means, pressure):
            function.x.scatter_forward()
        of_body = b.upper, pressure.function_space.dofmap.list[b.upper]
        points, position = b.crack(LAW).points, ufl.SpatialCoordinate(domain)
        x = points.evaluator({"x": points.at(position)})()["x"]
        cells = TensorPoints(domain, b.upper, 2)
        inside = cells.values(expression(position, cells.points, domain))
        return {
            "displacement": (Places.of(u.function_space), u.x.array),
            "forces": (Places.owned(u.function_space), u.x.array[: len(b.state.increment)]),
            "pressure": (Places.of(pressure.function_space, lambda: of_body), pressure.x.array),
            "means": (Places.of(means.function_space), means.x.array),
            "points": (points.places, x),
            "flat points": (points.flat_places, x.reshape(-1, gdim)),
            "points of cells": (cells.places(axis=1), np.stack([inside, 2 * inside])),
        }

    agree(make)


@pytest.mark.mpi
def test_points_of_a_pair_are_counted_by_the_cell():
    """The mesh of the facets may count them in another order."""

    def make(comm):
        kinematics = two(3, simplices=True, comm=comm).pair().passes[0].kinematics
        return {"points": (kinematics.slave.places, kinematics._points(kinematics.slave.reference).x)}

    agree(make)


# -- runs -------------------------------------------------------------------------------------------------------------


def steps(problem, until, record=lambda _: None):
    """History of the steps to a time."""
    rows = []

    def note(report):
        rows.append({name: value for name, (value, _) in report.columns.items()})
        record(report)

    run(problem, until, StepControl.fixed(0.04), note)
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def same(history, other, tolerance=1e-10):
    """Each column to a tolerance of its largest value, energies to that of the largest energy."""
    assert list(history) == list(other)
    families = {name: name.partition("_")[0] for name in history if name.startswith(("energy", "heat", "work"))}
    for name in history.keys() - {"newton", "krylov"}:
        family = [values for key, values in history.items() if families.get(key, key) == families.get(name, name)]
        scale = 1.0 if name.endswith("closure") else np.abs(family).max()
        np.testing.assert_allclose(other[name], history[name], rtol=0, atol=tolerance * scale, err_msg=name)


@pytest.mark.mpi
def test_a_resumed_run_is_the_uninterrupted_one(folder, first_ranks):
    """Cut, friction, heat, augmentation, relaxation, inertia, a bond that slides and a tool.

    From one rank to another, where it is the same bit for bit; from one to two and back; from one to three.
    """
    middle, end, size = 0.12, 0.2, WORLD.size
    routes = {1: [(1, 1)], 2: [(1, 2), (2, 1)], 3: [(1, 3)]}[size]
    whole = None
    for count in sorted({before for before, _ in routes}):
        if (comm := first_ranks[count]) is not None:
            everything = sliding(comm)
            with Checkpoints(folder / str(count), everything):
                begun = steps(everything, middle)
            if count == 1:
                whole = steps(everything, end)
            # what is to be tried has begun
            columns = ("crack_broken", "pair_broken", "ball_slipping", "pair_slipping")
            assert all(begun[name][-1] > 0 for name in columns)
        WORLD.barrier()
    whole = WORLD.bcast(whole)
    for before, after in routes:
        if (comm := first_ranks[after]) is not None:
            everything = sliding(comm)
            assert Checkpoints(folder / str(before), everything).resume() == pytest.approx(middle)
            # several ranks factorise by another package, and entropy is what is left of energies that cancel
            same(whole, steps(everything, end), 1e-9 if before != after else 0.0)
        WORLD.barrier()


def test_the_history_goes_on_without_a_seam(tmp_path):
    """Rows that were written after the checkpoint are written again; older fields stay as they are."""
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    columns = go(whole, 8)
    go(parts, 4, every=2)
    history = parts / "history.csv"
    row = history.read_text().splitlines(keepends=True)[-1]
    history.write_text(history.read_text() + row + row[:20])
    fields = written(parts, "displacement.bp")
    resumed = go(parts, 8, every=2)
    assert history.read_text() == (whole / "history.csv").read_text()
    same(columns, resumed, 0.0)
    assert written(parts, "displacement.bp") == fields != b""
    assert written(parts, "displacement_2.bp")
    assert sorted(path.name for path in (parts / "checkpoint").iterdir()) == ["step-000007.h5", "step-000008.h5"]


def test_steps_that_grow_go_on_growing(tmp_path):
    """And those of another control begin anew."""
    control = StepControl(first=0.002, largest=0.02)

    def times(mechanics, count, control=control):
        found = []
        last = mechanics.state.number + count
        run(mechanics, 1.0, control, lambda r: found.append(r.time), lambda r: r.number == last)
        return found

    mechanics = problem()
    saved = times(mechanics, 3)[-1]
    Checkpoints(tmp_path, mechanics).save()
    expected = times(mechanics, 3)
    assert expected[0] > saved + 0.002
    for other, first in ((control, expected[0]), (replace(control, first=0.001), saved + 0.001)):
        mechanics = problem()
        Checkpoints(tmp_path, mechanics).resume()
        found = times(mechanics, 3, other)
        assert found[0] == pytest.approx(first, rel=1e-12)
        assert (found == expected) == (other is control)


def test_an_interrupted_run_is_no_longer_so_when_it_has_gone_on(tmp_path):
    """A signal that comes after the first step ends the run after the second one."""
    mechanics = problem()
    checkpoints = Checkpoints(tmp_path / "checkpoint", mechanics)

    def record(report):
        recording(report)
        if report.number == 1:
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(Interrupted), Recording(tmp_path, mechanics, 1.0, every=0, checkpoints=checkpoints) as recording:
        run(mechanics, 1.0, StepControl.fixed(STEP), record)
    assert "interrupted" in json.loads((tmp_path / "summary.json").read_text())["reasons"][-1]
    mechanics = problem()
    assert Checkpoints(tmp_path / "checkpoint", mechanics).resume() == pytest.approx(2 * STEP)
    with Recording(tmp_path, mechanics, 4 * STEP, every=0) as recording:
        run(mechanics, 4 * STEP, StepControl.fixed(STEP), recording)
    assert recording.column("step").tolist() == [1, 2, 3, 4]
    assert mechanics.state.verdict.trusted


def test_a_new_run_removes_the_checkpoints_of_an_older_one(tmp_path):
    go(tmp_path, 3)
    mechanics = problem()
    checkpoints = Checkpoints(tmp_path / "checkpoint", mechanics)
    with Recording(tmp_path, mechanics, 1.0, every=0, overwrite=True, checkpoints=checkpoints):
        assert [path.name for path in (tmp_path / "checkpoint").iterdir()] == ["step-000000.h5"]


def test_a_run_that_is_killed_before_its_first_minutes_are_over_begins_anew(tmp_path):
    def begin():
        mechanics = problem()
        checkpoints = Checkpoints(tmp_path / "checkpoint", mechanics)
        checkpoints.resume()
        return mechanics, Recording(tmp_path, mechanics, 1.0, every=0, checkpoints=checkpoints)

    mechanics, recording = begin()
    run(mechanics, 2 * STEP, StepControl.fixed(STEP), recording)
    mechanics, recording = begin()
    run(mechanics, STEP, StepControl.fixed(STEP), recording)
    assert read_history(tmp_path / "history.csv")["step"].tolist() == [1]


def test_a_restored_problem_may_be_recorded_elsewhere(tmp_path):
    go(tmp_path / "first", 3)
    mechanics = problem()
    Checkpoints(tmp_path / "first" / "checkpoint", mechanics, case={"opening": LAW.opening}).resume()
    with Recording(tmp_path / "branch", mechanics, 5 * STEP, every=0) as recording:
        run(mechanics, 5 * STEP, StepControl.fixed(STEP), recording)
    assert read_history(tmp_path / "branch" / "history.csv")["step"].tolist() == [4, 5]


# -- refusals ---------------------------------------------------------------------------------------------------------


@pytest.mark.mpi
def test_the_checkpoint_of_another_problem_is_refused_by_name(folder):
    go(folder, 1)
    case, path = {"opening": LAW.opening}, folder / "checkpoint"

    def refused(other, words, case=case):
        before = other.state.memory.save()
        with pytest.raises(CheckpointError, match=words):
            Checkpoints(path, other, case=case).resume()
        assert other.state.memory.save() == before, "nothing is changed"

    same_mesh = problem()
    refused(same_mesh, r"another case: opening = 0\.02 in place of 0\.03", {"opening": 0.03})
    refused(same_mesh, r"another case: depth = None in place of 2", {**case, "depth": 2})
    refused(problem(n=6), r"another mesh: cells = 16 in place of 36")
    quieter = problem(n=4)
    quieter.state.memory.value("tool: wear", 0.0)
    refused(quieter, "tool: wear of the problem are not in it")
    quieter = problem(n=4)
    del quieter.state.memory._quantities["crack: multiplier"]
    refused(quieter, "it has crack: multiplier, which the problem has not")
    grown = problem(n=4)
    pace = grown.state.pace
    pace.set({"control": "", "size": 0.0})
    refused(grown, "pace: control, size, smooth, path, turned, carrier in place of")


@pytest.mark.mpi
@pytest.mark.parametrize(
    ("value", "words"),
    [(object(), "is no number, word or array"), (np.zeros(1 + WORLD.rank), "register it with places=")],
)
def test_what_no_file_can_hold_is_refused_by_name(value, words, folder):
    mechanics = problem()
    mechanics.state.memory.value("tool: wear", value)
    if WORLD.size == 1 and isinstance(value, np.ndarray):
        return
    with pytest.raises(TypeError, match=f"tool: wear cannot be written: .*{words}"):
        Checkpoints(folder, mechanics).save()


def test_the_file_of_another_version_is_refused(tmp_path):
    go(tmp_path, 1)
    path = tmp_path / "checkpoint" / "step-000001.h5"
    with h5py.File(path, "r+") as file:
        head = json.loads(file["header"].asstr()[()])
        file["header"][()] = json.dumps(head | {"format": 99})
    with pytest.raises(CheckpointError, match=r"step-000001\.h5 has the format 99; this version of cutsim reads 1"):
        Checkpoints(path.parent, problem(), case={"opening": LAW.opening}).resume()
    with h5py.File(path, "w") as file:
        file["something"] = 1.0
    with pytest.raises(CheckpointError, match=r"step-000001\.h5 is no checkpoint"):
        Checkpoints(path.parent, problem()).resume()


@pytest.mark.parametrize(("text", "words"), [("a,b\n1,2\n3,4\n", "has other columns"), ("", "has 0 rows, fewer than")])
def test_a_history_that_does_not_go_with_the_checkpoint_is_refused(text, words, tmp_path):
    go(tmp_path, 2)
    (tmp_path / "history.csv").write_text(text or (tmp_path / "history.csv").read_text().splitlines()[0] + "\n")
    with pytest.raises(ValueError, match=words):
        go(tmp_path, 3)


def test_a_file_that_cannot_be_read_leaves_the_one_before(tmp_path, caplog):
    go(tmp_path, 3)
    newest = tmp_path / "checkpoint" / "step-000003.h5"
    newest.write_bytes(newest.read_bytes()[:500])
    mechanics = problem()
    with caplog.at_level(logging.WARNING):
        time = Checkpoints(newest.parent, mechanics, case={"opening": LAW.opening}).resume()
    assert time == pytest.approx(2 * STEP) and mechanics.state.number == 2
    assert "step-000003.h5 cannot be read" in caplog.text
    newest.with_name("step-000002.h5").write_bytes(b"")
    with pytest.raises(OSError):
        Checkpoints(newest.parent, problem(), case={"opening": LAW.opening}).resume()


# -- what ends a process ----------------------------------------------------------------------------------------------


@pytest.mark.mpi
@pytest.mark.parametrize("what", ["row", "checkpoint"])
def test_a_full_disk_leaves_history_and_checkpoint(what, folder):
    """The largest file that may be written stands for the space on the disk."""
    if WORLD.size > 2:
        pytest.skip("as on two ranks")
    middle, end = 3, 6
    whole = go(folder / "whole", end)
    go(folder / "full", middle)
    name = {"row": "history.csv", "checkpoint": "checkpoint/step-000003.h5"}[what]
    limit = (folder / "full" / name).stat().st_size + {"row": 20, "checkpoint": -20}[what]
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    WORLD.barrier()
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, hard))
    try:
        with pytest.raises(OSError, match="File too large"):
            go(folder / "full", end)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    WORLD.barrier()
    if WORLD.rank == 0:
        assert step_of(folder / "full") == 3
        assert len(read_history(folder / "full" / "history.csv")["step"]) == {"row": 3, "checkpoint": 4}[what]
        assert not list((folder / "full" / "checkpoint").glob(".*")), "half a file is no use"
    WORLD.barrier()
    same(whole, go(folder / "full", end))


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_killed_run_goes_on(ranks, tmp_path):
    """Killed in the middle of a write, and at a random moment: nothing but the last step is lost."""
    script = str(Path(__file__).with_name("resumed_run.py"))
    command = [str(mpirun()), "-n", str(ranks)] if ranks > 1 else []
    command += [sys.executable, script, "run", str(tmp_path / "killed"), "--die", "7"]
    for _ in range(2):
        found = step_of(tmp_path / "killed")
        assert subprocess.run(command, env=environment(), timeout=120, capture_output=True).returncode != 0
        assert step_of(tmp_path / "killed") > found, "it had come further"
    if ranks == 1:
        ((rows, step, _),) = storm(tmp_path / "killed", ranks, kills=1)
        assert step <= rows <= step + 1
    end = step_of(tmp_path / "killed") + 2
    whole, resumed = go(tmp_path / "whole", end), go(tmp_path / "killed", end)
    # on other ranks Newton's iterations end at another rounding
    same(whole, resumed, 1e-10 if ranks == 1 else 1e-9)
    assert rows_of(tmp_path / "killed") == rows_of(tmp_path / "whole") == end
