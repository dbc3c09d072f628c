"""The command: what it understands, how it ends, and how it starts ranks."""

import errno
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

import cutsim
from cutsim.analysis.stepping import StepError
from cutsim.commands import launch
from cutsim.commands.endings import Ending, endings
from cutsim.commands.main import COMMANDS, app

runner = CliRunner()
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
    assert result.exit_code == 0 and f"$ cutsim {name}" in result.stdout


def test_it_answers_without_dolfinx():
    code = "import sys; sys.argv = ['cutsim', '--help']; import atexit; atexit.register(lambda: print(*sys.modules));"
    modules = start("-c", code + "from cutsim.commands.main import main; main()").communicate()[0].split()
    assert "typer" in modules and not {"dolfinx", "mpi4py.MPI", "numpy", "matplotlib"} & set(modules)


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
