"""The command: what it understands, how it ends, and how it starts ranks."""

import csv
import errno
import json
import os
import signal
import subprocess
import sys
import time
import tomllib
from pathlib import Path
from threading import Timer
from types import SimpleNamespace

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

import cutsim
from cutsim.analysis.steps import StepError
from cutsim.cases import RunOutcome, built_in
from cutsim.cases.importing.draft import Imported
from cutsim.commands import launch, new
from cutsim.commands.endings import Ending, endings
from cutsim.commands.jobs import Job, Runner
from cutsim.commands.main import COMMANDS, app
from cutsim.commands.run import end
from cutsim.commands.variation import Variation, variants
from cutsim.results.output import read_history

runner = CliRunner()
COARSE = [0, 1, 2, 3, 4]
NAMES = [name for commands in COMMANDS.values() for name in commands]


def start(*arguments, **options):
    """Python in a process of its own, without a terminal."""
    return subprocess.Popen(
        [sys.executable, *arguments], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True, env=os.environ | {"PYTHONPATH": str(Path(cutsim.__file__).parents[1])}, **options,
    )  # fmt: skip


def ranks(program, *arguments):
    """A program on two ranks."""
    return start("-m", "cutsim.commands.launch", "-n", "2", str(program), *arguments)


@pytest.mark.parametrize("name", NAMES)
def test_help_has_examples(name):
    result = runner.invoke(app, [name, "--help"])
    assert result.exit_code == 0 and f"$ cutsim {name}" in result.stdout and "🅱" not in result.stdout


@pytest.mark.parametrize("argument", ["--help", "cases"])
def test_it_answers_without_dolfinx(argument):
    code = (
        f"import sys; sys.argv = ['cutsim', '{argument}']; import atexit; atexit.register(lambda: print(*sys.modules));"
    )
    modules = start("-c", code + "from cutsim.commands.main import main; main()").communicate()[0].split()
    assert "typer" in modules and not {"dolfinx", "numpy", "matplotlib"} & set(modules)


def test_version_and_unknown_command():
    assert runner.invoke(app, ["--version"]).stdout == f"cutsim {cutsim.__version__}\n"
    unknown = runner.invoke(app, ["docter"])
    assert unknown.exit_code == 2 and "doctor" in unknown.stderr


@pytest.mark.parametrize(
    ("error", "ending"),
    [
        (ValueError("friction"), Ending.BAD_INPUT),
        (FileNotFoundError(errno.ENOENT, "none"), Ending.BAD_INPUT),
        (StepError("no step"), Ending.NO_EQUILIBRIUM),
        (OSError(errno.ENOSPC, "full"), Ending.CANNOT_WRITE),
        (PermissionError(errno.EACCES, "no"), Ending.CANNOT_WRITE),
        (AttributeError("ours"), Ending.INTERNAL),
    ],
)
def test_errors_end_by_their_code(error, ending, capsys):
    with pytest.raises(typer.Exit) as end, endings():
        raise error
    assert end.value.exit_code == ending
    said = capsys.readouterr().err
    assert str(error) in said and ("Traceback" in said) == (ending is Ending.INTERNAL)


def test_a_quiet_run_says_why_it_is_questionable(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("cutsim.commands.run.quiet", lambda: True)
    for reasons in (), ("coarse", "soft"):
        with pytest.raises(typer.Exit) as ended:
            end(RunOutcome(tmp_path, "questionable" if reasons else "trusted", reasons))
        assert ended.value.exit_code == (Ending.QUESTIONABLE if reasons else 0)
    assert capsys.readouterr() == ("", "questionable: coarse\nquestionable: soft\n")


def test_ranks_keep_the_exit_status_and_end_together(tmp_path):
    program = tmp_path / "program.py"
    program.write_text(
        "import sys\nfrom mpi4py import MPI\ncomm = MPI.COMM_WORLD\nassert comm.size == 2\n"
        "if sys.argv[1] == 'alone' and comm.rank == 1:\n    raise RuntimeError('only here')\n"
        "comm.Barrier()\nsys.exit(int(sys.argv[1]))\n"
    )
    together, alone = ranks(program, "3"), ranks(program, "alone")
    assert together.wait(60) == 3
    said = alone.communicate(timeout=60)[1]
    assert alone.returncode not in (0, 3) and "only here" in said


def test_interrupted_ranks_end_after_what_they_do(tmp_path):
    program = tmp_path / "program.py"
    program.write_text(
        "import signal, sys, time\nfrom mpi4py import MPI\nasked = []\n"
        "signal.signal(signal.SIGTERM, lambda *_: asked.append(1))\nMPI.COMM_WORLD.Barrier()\n"
        "sys.stdout.write('ready\\n')\n"
        "while not asked:\n    time.sleep(0.01)\nsys.stdout.write('kept\\n')\nsys.exit(130)\n"
    )
    job = ranks(program)
    assert [job.stdout.readline() for _ in range(2)] == ["ready\n"] * 2
    job.send_signal(signal.SIGINT)
    assert job.communicate(timeout=60)[0] == "kept\n" * 2
    assert job.returncode == Ending.INTERRUPTED


def test_ranks_end_with_what_started_them(tmp_path):
    program, mark = tmp_path / "program.py", tmp_path / "mark"
    program.write_text(f"import os, time\nopen('{mark}.' + str(os.getpid()), 'w')\ntime.sleep(60)\n")
    job = ranks(program)
    deadline = time.monotonic() + 60
    while len(marks := list(tmp_path.glob("mark.*"))) < 2 and time.monotonic() < deadline:
        time.sleep(0.05)
    job.kill()
    alive = [int(path.suffix[1:]) for path in marks]
    assert len(alive) == 2
    while alive and time.monotonic() < deadline:
        alive = [pid for pid in alive if Path(f"/proc/{pid}/stat").exists()]
        time.sleep(0.05)
    assert not alive


def test_start_of_ranks_refuses_nonsense(capsys):
    assert launch.main(["-n", "0", "script.py"]) == 2
    assert "'0'" in capsys.readouterr().err
    assert launch.main([]) == 2


# -- case files -------------------------------------------------------------------------------------------------------


@pytest.fixture
def library(tmp_path, monkeypatch):
    """One built-in case, in a folder of its own."""
    folder = tmp_path / "library"
    folder.mkdir()
    (folder / "cut.toml").write_text('title = "A cut"\n[law]\ntoughness = 0.8  # energy of new surface\n')
    monkeypatch.setattr(built_in, "FOLDER", folder)
    monkeypatch.chdir(tmp_path)
    return folder


def test_built_in_cases_are_listed_and_copied(library, tmp_path):
    assert cells(runner.invoke(app, ["cases"]), "cut") == ["cut", "A", "cut"]
    assert runner.invoke(app, ["new", "--from", "cut"]).exit_code == 0
    assert Path("cut.toml").read_text() == (library / "cut.toml").read_text()
    again = runner.invoke(app, ["new", "--from", "cut"])
    assert again.exit_code == 2 and "--overwrite" in again.stderr
    assert runner.invoke(app, ["new", "--from", "cut", "--overwrite"]).exit_code == 0


def test_unknown_case_and_questions_without_a_terminal(library):
    unknown = runner.invoke(app, ["new", "--from", "cutt"])
    assert unknown.exit_code == 2 and "did you mean cut?" in unknown.stderr
    asked = runner.invoke(app, ["new"])
    assert asked.exit_code == 2 and "--from" in asked.stderr


def test_answers_keep_the_comments_of_the_file(library, monkeypatch):
    answers = {"title (what is simulated, in a few words)": "Mine", "law.toughness (energy of new surface)": "1.5 N/mm"}
    defaults = {}

    def text(message, default, validate):
        defaults[message] = default
        return SimpleNamespace(unsafe_ask=lambda: answers[message])

    monkeypatch.setattr(new, "_choice", lambda: "cut")
    monkeypatch.setattr("questionary.text", text)
    assert runner.invoke(app, ["new", "-o", "mine.toml"]).exit_code == 0
    assert list(defaults.values()) == ["A cut", "0.8"]
    mine = Path("mine.toml").read_text()
    assert 'title = "Mine"\n' in mine and 'toughness = "1.5 N/mm"  # energy of new surface' in mine


def test_an_imported_model_says_what_is_not_translated(tmp_path, monkeypatch):
    imported = Imported(
        "title = 'a model'\n", ("model.feb:3: <MeshAdaptor>: has no counterpart",), (), {"more.txt": ""}
    )
    monkeypatch.setattr("cutsim.cases.importing.model_files.import_model", lambda path, folder: imported)
    path = tmp_path / "case.toml"
    result = runner.invoke(app, ["import", "model.feb", "-o", str(path)])
    assert result.exit_code == Ending.QUESTIONABLE
    assert result.stdout.startswith("not translated: model.feb:3: <MeshAdaptor>")
    assert path.read_text() == imported.case_text and (tmp_path / "more.txt").exists()
    assert runner.invoke(app, ["import", "model.feb", "-o", str(path)]).exit_code == Ending.BAD_INPUT


def test_a_case_is_no_model(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("mine.toml").write_text("title = 'a case'")
    result = runner.invoke(app, ["import", "mine.toml"])
    assert result.exit_code == Ending.BAD_INPUT and "FEBio (.feb) or Abaqus (.inp)" in result.stderr


def test_variations():
    assert Variation.of("tool.friction=0.1:0.4:4").values == ("0.1", "0.2", "0.3", "0.4")
    assert Variation.of("law.toughness=1:100:3:log").values == ("1", "10", "100")
    both = [Variation.of(text) for text in ("a.x=1,2", "b.x=3 N/mm", "b.y=4,5")]
    found = variants(both)
    assert [variant.name for variant in found] == [f"a.x={x}_b.x=3-N-mm_y={y}" for x in (1, 2) for y in (4, 5)]
    assert found[1].values == {"a.x": "1", "b.x": "3 N/mm", "b.y": "5"}
    for wrong in ("friction", "x=", "x=1:2", "x=1:2:1", "x=-1:1:3:log", "x=1:2:3:4", "x=a:b:3", "x=1,,2"):
        with pytest.raises(typer.BadParameter, match="must be of the form"):
            Variation.of(wrong)


def test_jobs_are_processes_that_keep_their_exit_status(tmp_path):
    jobs = [Job(tmp_path / name, ("-m", "cutsim", word)) for name, word in (("good", "--version"), ("bad", "nonsense"))]
    ended = {}
    Runner(tmp_path / "jobs", 2, "local", {}).run(jobs, lambda job, status: ended.update({job.folder.name: status}))
    assert ended == {"good": 0, "bad": 2}
    assert jobs[0].log.read_text() == f"cutsim {cutsim.__version__}\n"


def test_a_job_that_ends_before_it_has_begun_is_interrupted(tmp_path):
    runner, job, ended = (
        Runner(tmp_path / "jobs", 1, "local", {}),
        Job(tmp_path / "run", ("-m", "cutsim", "doctor")),
        [],
    )

    def interrupt():
        while not job.pid.exists() or not job.pid.read_text():
            time.sleep(0.01)
        os.kill(os.getpid(), signal.SIGTERM)

    Timer(0, interrupt).start()
    runner.run([job], lambda job, status: ended.append(status))
    assert ended == [Ending.INTERRUPTED]


# -- results ----------------------------------------------------------------------------------------------------------


def make_result(folder, depth, force, *, until=None, verdict="trusted", unit="mm"):
    """A folder as a run leaves it."""
    folder.mkdir()
    rows = [f"depth [{unit}],force [N],cuts", *(f"{d},{f},0" for d, f in zip(depth, force, strict=True))]
    (folder / "history.csv").write_text("\n".join(rows) + "\n")
    kinds = ["interrupted"] if until else []
    summary = {"verdict": verdict, "kinds": kinds, "time": depth[-1], "until": until or depth[-1]}
    (folder / "summary.json").write_text(json.dumps(summary))
    return str(folder)


def cells(result, start):
    """Cells of a printed row."""
    (line,) = [line for line in result.stdout.splitlines() if line.strip().startswith(start)]
    return line.split()


def test_compare_measures_over_the_common_range(tmp_path, monkeypatch):
    """Straight lines, whose peak, work and distance are known; a measurement in other units, and a run that stopped."""
    monkeypatch.chdir(tmp_path)
    whole = make_result(tmp_path / "whole", COARSE, [2 * d for d in COARSE])
    short = make_result(tmp_path / "short", [0, 1, 2], [0, 3, 6], until=4, verdict="questionable")
    Path("machine.txt").write_text("made by us\nt;Weg;Kraft\ns;m;kN\n0;0,000;0,000\n1;0,002;0,005\n2;0,006;0,015\n")
    result = runner.invoke(app, ["compare", whole, short, "machine.txt"])
    assert result.exit_code == 0, result.output
    assert "depth [mm] from 0 to 2" in result.stdout
    assert cells(result, "whole") == ["whole", "trusted", "4", "4"]
    assert cells(result, "short")[1:] == ["interrupted", "6", "+50.00%", "6", "+50.00%", "1.15", "28.87%"]
    assert cells(result, "machine.txt")[1:6] == ["measured", "5", "+25.00%", "5", "+25.00%"]
    assert Path("compared.png").stat().st_size > 5000


def test_compare_refuses_what_has_nothing_in_common(tmp_path):
    first, other = (make_result(tmp_path / name, [a, a + 1], [0, 1]) for name, a in (("a", 0), ("b", 5)))
    result = runner.invoke(app, ["compare", first, other, "-o", str(tmp_path / "plot.png")])
    assert result.exit_code == 2 and "common range of depth" in result.stderr
    seconds = make_result(tmp_path / "c", [0, 1], [0, 1], unit="s")
    result = runner.invoke(app, ["compare", first, seconds, "-o", str(tmp_path / "plot.png")])
    assert result.exit_code == 2 and "cannot be compared" in result.stderr


def test_plot_lists_and_draws_columns(tmp_path):
    folder = make_result(tmp_path / "run", COARSE, COARSE)
    assert runner.invoke(app, ["plot", folder, "--list"]).stdout == "depth [mm] 4\nforce [N] 4\ncuts 0\n"
    path = tmp_path / "plot.svg"
    assert runner.invoke(app, ["plot", folder, "-y", "force", "-o", str(path)]).exit_code == 0
    assert path.read_text().startswith("<?xml")
    wrong = runner.invoke(app, ["plot", folder, "-y", "forse"])
    assert wrong.exit_code == 2 and "depth, force, cuts" in wrong.stderr


@pytest.fixture
def bar(tmp_path, monkeypatch):
    """A case that runs in a second: a square that is stretched, in a folder of its own."""
    monkeypatch.chdir(tmp_path)
    Path("bar.toml").write_text(BAR)
    return tmp_path


BAR = """title = "Bar"
[mesh]
geometry = "block"
dim = 2
set = { Lx = 1, H = 1, notch = 0, lc = 0.5, band = 0.5 }
[material]
model = "linear-elastic"
young = 1.0  # Young's modulus [MPa]
poisson = 0.0
[supports.held]
facets = "far_left"
direction = "all"
[supports.pulled]
facets = "far_right"
direction = "x"
value = "t"
[analysis]
until = 0.1
[steps]
fixed = 0.02
[output]
every = 0
report = false
"""


def test_a_case_is_run_and_not_run_over(bar):
    """The force is that of the stretch in small strains, E H u / (2 Lx)."""
    ran = runner.invoke(app, ["run", "bar.toml", "--set", "material.young=4 MPa"])
    assert (ran.exit_code, ran.stdout.splitlines()[-1]) == (0, "results: results/bar"), ran.output
    history = read_history("results/bar/history.csv")
    np.testing.assert_allclose(history["pulled_force"], 2 * history["time"], rtol=1e-9)
    assert 'young = "4 MPa"' in Path("results/bar/case.toml").read_text()
    again = runner.invoke(app, ["run", "bar.toml"])
    assert again.exit_code == 2 and "--overwrite" in again.stderr
    quiet = runner.invoke(app, ["run", "bar.toml", "--overwrite", "-q"])
    assert (quiet.exit_code, quiet.output) == (0, "")


def test_all_that_is_wrong_in_a_case_is_said_and_nothing_else(bar):
    wrong = runner.invoke(app, ["run", "bar.toml", "--set", "material.yung=1", "--set", "steps.fixed=-1"])
    assert wrong.exit_code == 2 and not wrong.stdout and not Path("results").exists()
    lines = wrong.stderr.splitlines()
    assert (
        len(lines) == 2 and all(line.startswith("--set ") for line in lines) and "did you mean 'young'" in wrong.stderr
    )
    assert runner.invoke(app, ["run", "bar.toml", "--set", "steps.fixed"]).exit_code == 2


def test_a_case_is_checked_and_nothing_but_a_picture_is_written(bar):
    checked = runner.invoke(app, ["check", "bar.toml"])
    assert checked.exit_code == 0, checked.output
    assert cells(checked, "groups     far_left")[2:] == ["2", "facets,", "length", "1", "mm"]
    assert sorted(path.name for path in bar.iterdir()) == ["bar-setup.png", "bar.toml"]
    free = runner.invoke(app, ["check", "bar.toml", "--set", "supports.held.direction=x"])
    assert free.exit_code == 1 and "against it: supports: body 'body' can slide along y" in free.stdout


def test_a_sweep_goes_on_where_it_was(bar):
    arguments = ["sweep", "bar.toml", "--vary", "material.young=1,2", "-j", "2", "-o", "sweep"]
    first = runner.invoke(app, arguments)
    assert first.exit_code == 0, first.output
    assert {path.name for path in Path("sweep").iterdir()} >= {"young=1", "young=2", "sweep.png", "report.html"}
    with open("sweep/sweep.csv") as file:
        rows = list(csv.DictReader(file))
    assert [(row["material.young"], row["ended"]) for row in rows] == [("1", "trusted"), ("2", "trusted")]
    assert float(rows[1]["largest_pulled_force"]) == pytest.approx(2 * float(rows[0]["largest_pulled_force"]))
    written = [Path(f"sweep/young={young}/history.csv").stat().st_mtime_ns for young in (1, 2)]
    Path("sweep/young=1/history.csv").unlink()
    again = runner.invoke(app, arguments)
    assert "1 of which have ended before" in again.stdout and again.exit_code == 0
    after = [Path(f"sweep/young={young}/history.csv").stat().st_mtime_ns for young in (1, 2)]
    assert after[0] > written[0] and after[1] == written[1]
    other = runner.invoke(app, [*arguments, "--set", "material.poisson=0.1"])
    assert other.exit_code == 2 and "of another case" in other.stderr


def test_a_value_is_fitted(bar):
    Path("curve.csv").write_text("way [mm],load [N]\n" + "".join(f"{u},{7.5 * u}\n" for u in (0.03, 0.05, 0.06, 0.09)))
    curve = 'output.curve=["pulled_displacement", "pulled_force"]'
    arguments = ["fit", "bar.toml", "curve.csv", "-o", "fit", "--free", "material.young=1:0.5:3", "--set", curve]
    plane = runner.invoke(app, arguments)
    assert plane.exit_code == 2 and "width" in plane.stderr
    arguments += ["--width", "10"]
    result = runner.invoke(app, arguments)
    assert result.exit_code == 0 and "material.young = 1.5 " in result.stdout, result.output
    assert tomllib.loads(Path("fit/fitted.toml").read_text())["material"]["young"] == pytest.approx(1.5)
    assert Path("fit/fit.png").exists()
    simulated = Path("fit/simulations.jsonl").read_text()
    assert runner.invoke(app, arguments).exit_code == 0
    assert Path("fit/simulations.jsonl").read_text() == simulated, "nothing is simulated twice"
    unknown = runner.invoke(app, [*arguments, "--free", "body.viscosity"])
    assert unknown.exit_code == 2 and "first guess" in unknown.stderr


@pytest.mark.parametrize("ranks", [1, 2])
def test_an_interrupted_run_is_kept_and_resumed(bar, ranks):
    """Without a terminal: no control characters."""
    settings = ["--set", "steps.fixed=2e-5", "-n", str(ranks)]
    job = start("-m", "cutsim", "run", "bar.toml", *settings, cwd=bar)
    history = bar / "results" / "bar" / "history.csv"
    deadline = time.monotonic() + 120
    while not (history.exists() and history.read_text().count("\n") > 3) and time.monotonic() < deadline:
        time.sleep(0.05)
    job.send_signal(signal.SIGINT)
    out, err = job.communicate(timeout=120)
    assert job.returncode == Ending.INTERRUPTED, err
    assert "cutsim resume" in out and not set("\x1b\r\x08") & set(out + err)
    rows = len(read_history(history)["time"])
    assert 3 <= rows < 5000
    case = bar / "results" / "bar" / "case.toml"
    case.write_text(case.read_text().replace("until = 0.1", f"until = {(rows + 3) * 2e-5}"))
    resumed = runner.invoke(app, ["resume", "results/bar", "-q"])
    assert resumed.exit_code == 0, resumed.output
    assert len(read_history(history)["time"]) == rows + 3


def test_a_material_is_fitted(tmp_path):
    stretch = np.linspace(1.0, 1.6, 20)
    rows = [f"{20 * (s - 1)!r},{24 * 0.5 * (s - s**-2)!r}" for s in map(float, stretch)]
    (tmp_path / "data.csv").write_text("\n".join(["travel [mm],load [N]", *rows]) + "\n")
    snippet = tmp_path / "material.toml"
    arguments = [str(tmp_path / "data.csv"), "--length", "20", "--area", "24", "-o", str(snippet)]
    result = runner.invoke(app, ["fit-material", *arguments, "--model", "neo-hookean"])
    assert result.exit_code == 0 and "young = 1.495" in result.stdout
    material = tomllib.loads(snippet.read_text())["material"]
    assert material["model"] == "neo-hookean" and material["young"] == pytest.approx(1.495)  # 2 (1 + nu) 0.5
    assert snippet.with_suffix(".png").exists()
    assert runner.invoke(app, ["fit-material", *arguments, "--model", "neo"]).exit_code == 2
    for given, wanted in ((arguments[:1], "A travel needs --length"), (arguments[:3], "A force needs --area")):
        without = runner.invoke(app, ["fit-material", *given, "--model", "neo-hookean"])
        assert without.exit_code == 2 and wanted in without.stderr
