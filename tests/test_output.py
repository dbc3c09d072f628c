"""What a run leaves behind can be read back, also when the run did not end well."""

import io
import json
import math
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI
from rich.console import Console

from cutsim.base.compat import cell_partitioner
from cutsim.base.units import KINDS, Units
from cutsim.fields.space import cracked_space
from cutsim.results.field_files import FieldWriter
from cutsim.results.output import HistoryWriter, read_history, write_summary
from cutsim.results.progress import Progress
from helpers.output import written

COLUMNS = {"step": "one", "time": "time", "depth": "length", "force_y": "force"}


@pytest.fixture
def body():
    """A square, torn open along its middle line: u_x = ±0.1 y, so F = I ± 0.1 e_x ⊗ e_y."""
    partitioner = cell_partitioner()
    square = mesh.create_unit_square(MPI.COMM_WORLD, 4, 4, mesh.CellType.quadrilateral, partitioner=partitioner)
    facets = mesh.locate_entities(square, 1, lambda x: np.isclose(x[0], 0.5))
    u = fem.Function(cracked_space(square, ("Lagrange", 1, (2,)), facets), name="u")
    for sign, half in ((-1, lambda x: x[0] < 0.5 + 1e-9), (1, lambda x: x[0] > 0.5 - 1e-9)):
        cells = mesh.locate_entities(square, 2, half)
        u.interpolate(lambda x, sign=sign: np.stack((0.1 * sign * x[1], 0 * x[1])), cells0=cells)
    u.x.scatter_forward()
    return u, facets


def test_units_compose():
    symbols = "mm mm² N s MPa mJ N/mm N·mm rad mm/s 1/s K mJ/s N/(mm·s) mJ/K 1".split()
    symbols += "K mm/s² N/mm³ N/mm N·s/mm N·s²/mm N·mm·s N·mm·s² N/mm³ N·s/mm² N·s/mm³ N·s²/mm⁴ 1/K".split()
    symbols += "mm²/(s²·K) N/(s·K) N/(mm·s·K) mm/(s·K) N/(mm·K) N/(mm²·s)".split()
    assert [Units().of(kind) for kind in KINDS] == symbols
    assert Units("m", "N").of("stress") == "Pa" and Units("m", "N").of("energy") == "J"
    assert Units("in", "lbf").of("stress") == "lbf/in²" and Units("in", "lbf").of("energy") == "lbf·in"
    assert Units().label("depth", "length") == "depth [mm]" and Units().label("damage", "one") == "damage"
    with pytest.raises(ValueError, match="kind = 'colour'"):
        Units().of("colour")


def test_units_of_a_plane_problem_are_per_width():
    units = Units().per_width()
    kinds = ("force", "energy", "moment", "power", "entropy", "stress", "length", "toughness")
    symbols = "N/mm mJ/mm N·mm/mm mJ/(s·mm) mJ/(K·mm) MPa mm N/mm".split()
    assert [units.of(kind) for kind in kinds] == symbols


@pytest.mark.mpi
def test_history_round_trip_is_exact(folder):
    rows = [{"step": i, "time": 0.1 * i, "depth": math.pi * i, "force_y": -1e-300 / 3 * i} for i in range(4)]
    with HistoryWriter(folder / "new" / "history.csv", COLUMNS, Units(), MPI.COMM_WORLD) as history:
        for row in rows:
            history.append(row)
            MPI.COMM_WORLD.barrier()
            assert len(read_history(folder / "new" / "history.csv")["step"]) == row["step"] + 1
            MPI.COMM_WORLD.barrier()
    text = (folder / "new" / "history.csv").read_text()
    assert text.startswith("step,time [s],depth [mm],force_y [N]\n0,0.0,")
    table = read_history(folder / "new" / "history.csv")
    assert list(table) == list(COLUMNS)
    for name, values in table.items():
        assert values.tolist() == [row[name] for row in rows]


@pytest.mark.mpi
def test_history_survives_an_error(folder):
    def run():
        with HistoryWriter(folder / "history.csv", COLUMNS, Units(), MPI.COMM_WORLD) as history:
            history.append(dict.fromkeys(COLUMNS, 1.5))
            raise RuntimeError("no equilibrium")

    with pytest.raises(RuntimeError, match="no equilibrium"):
        run()
    assert read_history(folder / "history.csv")["depth"].tolist() == [1.5]


def test_history_drops_half_a_row_only(tmp_path):
    (tmp_path / "h.csv").write_text("time [s],depth [mm]\n1.0,2.0\n3.0,4")
    assert {k: v.tolist() for k, v in read_history(tmp_path / "h.csv").items()} == {
        "time": [1.0],
        "depth": [2.0],
    }
    (tmp_path / "h.csv").write_text("time [s],depth [mm]\n")
    assert read_history(tmp_path / "h.csv")["depth"].shape == (0,)


@pytest.mark.mpi
def test_history_refuses_bad_input_on_all_ranks(folder):
    comm, row = MPI.COMM_WORLD, dict.fromkeys(COLUMNS, 1.0)
    with pytest.raises(ValueError, match="columns"):
        HistoryWriter(folder / "h.csv", {}, Units(), comm)
    with pytest.raises(ValueError, match="'a,b'"):
        HistoryWriter(folder / "h.csv", {"a,b": "one"}, Units(), comm)
    with pytest.raises(ValueError, match="colour"):
        HistoryWriter(folder / "h.csv", {"a": "colour"}, Units(), comm)
    (folder / "file").touch()
    with pytest.raises(OSError):
        HistoryWriter(folder / "file" / "h.csv", COLUMNS, Units(), comm)
    with HistoryWriter(folder / "h.csv", COLUMNS, Units(), comm) as history:
        with pytest.raises(ValueError, match=r"lacks \['depth'\]"):
            history.append({name: 1.0 for name in COLUMNS if name != "depth"})
        with pytest.raises(ValueError, match="'heat'"):
            history.append({**row, "heat": 1.0})
        with pytest.raises(ValueError, match="depth = None"):
            history.append({**row, "depth": None})
    with pytest.raises(ValueError, match="closed"):
        history.append(row)


@pytest.mark.mpi
def test_summary_is_plain_json_and_replaced_whole(folder):
    path = folder / "summary.json"
    values = {
        "G_c": np.float64(0.1) + np.float64(0.2),
        "steps": np.int32(7),
        "ok": np.bool_(True),
        "path": Path("a/b"),
        "table": {"x": np.arange(3) / 3, "worst": math.nan, "pair": (1, np.inf)},
    }
    write_summary(path, values, MPI.COMM_WORLD)
    read = json.loads(path.read_text())
    assert read == {
        "G_c": 0.1 + 0.2,
        "steps": 7,
        "ok": True,
        "path": "a/b",
        "table": {"x": [0.0, 1 / 3, 2 / 3], "worst": None, "pair": [1, None]},
    }
    with pytest.raises(TypeError):
        write_summary(path, {"bad": object()}, MPI.COMM_WORLD)
    assert json.loads(path.read_text()) == read
    assert [entry.name for entry in folder.iterdir()] == ["summary.json"]


def count(data, number):
    """How often a number, up to rounding, is among the raw bytes."""
    shifted = (np.frombuffer(data[k : k + 8 * ((len(data) - k) // 8)]) for k in range(8))
    return sum(np.count_nonzero(np.isclose(values, number, rtol=1e-12)) for values in shifted)


@pytest.mark.mpi
def test_fields_hold_the_values(folder, body):
    u, facets = body
    domain = u.function_space.mesh
    gradient = ufl.grad(u)
    crack = mesh.create_submesh(domain, 1, facets)[0]
    damage = fem.Function(fem.functionspace(crack, ("DG", 0)), name="damage")
    damage.x.array[:] = 0.625
    jump = fem.Function(fem.functionspace(crack, ("DG", 1, (2,))), name="jump")
    derived = {"H": gradient, "J": 3 + gradient[0, 1] ** 2}
    with FieldWriter(folder, u, derived, {"crack": [damage], "jump": [jump]}) as fields:
        fields.write(0.0)
        u.x.array[:] *= 2
        fields.write(1.0)
    padded = np.pad(u.x.array.reshape(-1, 2), ((0, 0), (0, 1)))
    assert padded.tobytes() in written(folder, "displacement.bp")
    cells = domain.topology.index_map(2).size_local
    total = domain.comm.allreduce(cells)
    for expected in (3.01, 3.04):  # J of the first and the second step, at the four corners of each cell
        assert count(written(folder, "fields.bp"), expected) >= 4 * total
    assert np.full(crack.topology.index_map(1).size_local, 0.625).tobytes() in written(folder, "crack.bp")
    for name, columns in {"displacement": "u", "fields": "u H J", "crack": "damage", "jump": "jump"}.items():
        metadata = (folder / f"{name}.bp" / "md.0").read_bytes()
        for column in columns.split():
            assert f'<DataArray Name="{column}" />'.encode() in metadata


def test_names_of_fields_are_checked(tmp_path, body):
    u, _ = body
    with pytest.raises(ValueError, match="surfaces = 'fields'"):
        FieldWriter(tmp_path, u, surfaces={"fields": []})
    with pytest.raises(ValueError, match="derived = 'u'"):
        FieldWriter(tmp_path, u, {"u": ufl.grad(u)})


@pytest.mark.mpi
def test_plain_progress_ends_with_the_last_step():
    text = io.StringIO()
    with Progress(2.0, MPI.COMM_WORLD, "cut", console=Console(file=text, width=200), interval=60.0) as progress:
        for step in range(1, 5):
            progress.update(0.5 * step, step=step, force=np.pi, cuts=0)
    if MPI.COMM_WORLD.rank == 0:
        assert text.getvalue().splitlines() == [
            "cut:  25%  t 0.5  step 1  force 3.142  cuts 0",
            "cut: 100%  t 2  step 4  force 3.142  cuts 0",
        ]
    else:
        assert not text.getvalue()
    with Progress(2.0, MPI.COMM_WORLD, start=1.0, console=Console(file=text)) as resumed:
        resumed.update(1.5)
    assert ("75%" in text.getvalue()) == (MPI.COMM_WORLD.rank == 0)
    with pytest.raises(ValueError, match="end = 0"):
        Progress(0.0, MPI.COMM_WORLD)


@pytest.mark.parametrize("terminal", [True, False])
def test_progress_lets_errors_and_interrupts_pass(terminal, monkeypatch):
    monkeypatch.delenv("TTY_COMPATIBLE", raising=False)
    for error in (ValueError, KeyboardInterrupt):
        console = Console(file=io.StringIO(), force_terminal=terminal, width=120)

        def run(console=console, error=error):
            with Progress(1.0, MPI.COMM_SELF, "cut", console=console) as progress:
                progress.update(0.5, step=3)
                raise error

        with pytest.raises(error):
            run()
        assert "50%" in console.file.getvalue() and "step 3" in console.file.getvalue()
        assert console.file.getvalue().rstrip("\x1b[?25h").endswith("\n")  # the next output has its own line


def test_sigint_reaches_a_run_with_progress():
    program = (
        "import os, signal\nfrom mpi4py import MPI\nfrom cutsim.results.progress import Progress\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # background jobs start with it ignored
        "with Progress(1.0, MPI.COMM_WORLD) as p:\n"
        "    p.update(0.5)\n    os.kill(os.getpid(), signal.SIGINT)\n    p.update(0.7)\n"
    )
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("OMPI_", "PMIX_", "PRTE_"))}
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True)
    assert "KeyboardInterrupt" in done.stderr and done.returncode in (-signal.SIGINT, 130)
