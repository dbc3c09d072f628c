"""Cases are run in a folder: what is left there, also by a run that fails, is interrupted or fills the disk."""

import errno
import json
import signal

import numpy as np
import pytest
from mpi4py import MPI

from cutsim import CheckpointError, read_history
from cutsim.cases import CaseError, built_in_cases, read_case, run_case, running
from cutsim.cases.checking import check
from cutsim.commands.endings import ending_of_run
from cutsim.results.output import HistoryWriter

COMM = MPI.COMM_WORLD
CASES = {name: path for name, (_, path) in built_in_cases().items()}
#: Ten steps of a beam whose bond begins to open, without pictures.
SHORT = {"parameters.opening": "0.2", "output.report": "false", "output.every": "0"}


@pytest.fixture
def folder(tmp_path):
    """A folder that all ranks share."""
    return COMM.bcast(tmp_path) / "run"


def short(changes=None):
    return read_case(CASES["dcb"], SHORT | (changes or {}), quick=True)


@pytest.mark.mpi
def test_a_run_leaves_its_case_history_and_summary(folder):
    outcome = run_case(short(), folder, COMM, quiet=True)
    assert (outcome.verdict, ending_of_run(outcome), outcome.error) == ("trusted", 0, None)
    again = read_case(folder / "case.toml")
    assert again.cracks == short().cracks and again.steps == short().steps and again.mesh == short().mesh
    history, summary = read_history(folder / "history.csv"), json.loads((folder / "summary.json").read_text())
    x, y = summary["curve"]
    assert history[x][-1] == pytest.approx(0.1) and len(history[y]) == 10
    assert summary["largest_upper_force"] == history[y].max() == pytest.approx(0.601, rel=0.02)
    assert (summary["ranks"], summary["verdict"]) == (COMM.size, "trusted")
    assert summary["mesh"]["cells"] > 0 and summary["unknowns"] > 3000 and "dolfinx" in summary["versions"]
    assert list((folder / "checkpoint").glob("*.h5"))
    assert len(iterations_of(folder, history)) == history["newton"].sum() >= 10


def iterations_of(folder, history):
    """Iterations of all steps, in order, each step ending where its residual is as small as it has to be."""
    table = read_history(folder / "iterations.csv")
    last = np.append(table["iteration"][1:] == 1, True)
    np.testing.assert_array_equal(table["step"][last], history["step"])
    np.testing.assert_array_equal(table["iteration"][last], history["newton"])
    assert np.all(table["residual"][last] <= table["residual_required"][last])
    assert np.all(table["residual"] <= 1.01 * table["residual_initial"])
    assert np.all(table["energy"][last] < 1e-6 * table["energy_initial"][last])
    return table["step"]


@pytest.mark.mpi
def test_a_ready_made_cut_runs(folder):
    changes = {"insertion.depth": "0.5", "output.report": "false", "output.every": "0"}
    outcome = run_case(read_case(CASES["steady-cut"], changes, quick=True), folder, COMM, quiet=True)
    assert outcome.error is None and ending_of_run(outcome) == 1  # so coarse a mesh does not resolve the process zone
    assert read_history(folder / "history.csv")["depth"][-1] == pytest.approx(0.5)


def test_an_older_run_is_kept_unless_it_is_to_be_replaced(folder):
    run_case(short(), folder, COMM, quiet=True)
    with pytest.raises(FileExistsError, match="is of an older run"):
        run_case(short(), folder, COMM, quiet=True)
    assert ending_of_run(run_case(short(), folder, COMM, resume=True, quiet=True)) == 0, "it is at its end"
    assert ending_of_run(run_case(short(), folder, COMM, overwrite=True, quiet=True)) == 0


def test_without_equilibrium_all_steps_are_kept(folder):
    impossible = {"solver.petsc": "{ snes_max_it = 0 }", "steps.smallest": "0.02"}
    outcome = run_case(short(impossible), folder, COMM, quiet=True)
    assert ending_of_run(outcome) == 3 and "no step from time" in str(outcome.error)
    assert json.loads((folder / "summary.json").read_text())["verdict"] == "questionable"
    assert (folder / "history.csv").exists() == bool(outcome.error is None) or read_history(folder / "history.csv")


class Stopped(running.Stages):
    """Stages of a run that is asked to end after its third step."""

    def __call__(self, report):
        super().__call__(report)
        if report.number == 3:
            signal.raise_signal(signal.SIGTERM)


def test_an_interrupted_run_is_resumed(folder, monkeypatch):
    run_case(short(), folder / "whole", COMM, quiet=True)
    with monkeypatch.context() as patch:
        patch.setattr(running, "Stages", Stopped)
        outcome = run_case(short(), folder / "parts", COMM, quiet=True)
    assert ending_of_run(outcome) == 130 and len(read_history(folder / "parts" / "history.csv")["time"]) < 10
    assert ending_of_run(run_case(short(), folder / "parts", COMM, resume=True, quiet=True)) == 0
    whole, parts = (read_history(folder / name / "history.csv") for name in ("whole", "parts"))
    for name in ("time", "upper_force", "energy_strain", "front"):
        np.testing.assert_allclose(parts[name], whole[name], rtol=1e-9, err_msg=name)
    assert len(iterations_of(folder / "parts", parts)) == parts["newton"].sum()
    with pytest.raises(CheckpointError, match=r"another case: parameters\.opening = 0\.2 in place of 0\.3"):
        run_case(short({"parameters.opening": "0.3"}), folder / "parts", COMM, resume=True, quiet=True)
    assert ending_of_run(run_case(short({"output.every": "2"}), folder / "parts", COMM, resume=True, quiet=True)) == 0


def test_a_full_disk_leaves_what_was_written(folder, monkeypatch):
    write = HistoryWriter._write

    def fills(self, cells):
        if cells[0] in ("4", "4.0"):
            raise OSError(errno.ENOSPC, "no space left")
        write(self, cells)

    monkeypatch.setattr(HistoryWriter, "_write", fills)
    outcome = run_case(short(), folder, COMM, quiet=True)
    assert ending_of_run(outcome) == 4 and outcome.verdict == "questionable"
    assert len(read_history(folder / "history.csv")["time"]) == 3


def test_a_body_that_nothing_holds_is_refused(folder):
    case = short({"supports.clamp.direction": "y"})
    with pytest.raises(CaseError, match=r"supports: body 'body' .*can slide along x"):
        run_case(case, folder, COMM, quiet=True)
    assert not folder.exists()


@pytest.mark.mpi
def test_a_check_measures_and_doubts():
    rows = check(read_case(CASES["steady-cut"], quick=True).build(COMM))
    found = {(row.topic, row.what): row for row in rows.rows}
    assert found["crack crack", "elements along it"].doubt.endswith("is needed for the process zone")
    assert found["supports", "rigid motions"].value == "none: every body is held"
    assert found["cost", "unknowns"].value == "816" and len(rows.doubts) == 1
    pivots = " without pivots" if COMM.size == 1 else ""
    assert found["cost", "linear solver"].value == f"a factorisation{pivots}, kept while it serves"
    assert found["tool tool", "at the start, deepest point of the body in it"].value == "0 elements"
    loose = check(short({"supports.clamp.direction": "y"}).build(COMM))
    assert any("can slide along x" in doubt for doubt in loose.doubts)
