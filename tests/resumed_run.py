"""A short run that writes a checkpoint after each step and goes on where it was. As a script: run it, or kill it often.

python resumed_run.py run FOLDER                          runs, or goes on; --die 7 kills itself in its 7th write
python resumed_run.py storm FOLDER --ranks 2 --kills 20   starts it again and again and kills it at random moments
"""

import argparse
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

from mpi4py import MPI

from cutsim import Checkpoints, Coulomb, Exponential, Mechanics, PenaltyContact, Recording, StepControl, Support, run
from cutsim.commands.launch import environment, mpirun
from helpers.blocks import make_blocks

STEPS, STEP = 40, 0.025
LAW = Exponential(toughness=0.001, opening=0.02)


def problem(comm=MPI.COMM_WORLD, law=LAW, n=4):
    """Two blocks whose bond is sheared apart and rubs."""
    b = make_blocks(2, n, comm)
    crack = b.crack(law, contact=PenaltyContact(200.0), friction=Coulomb(0.3, 200.0))
    supports = [Support(b.state, b.face(1, 0.0), i) for i in range(2)]
    paths = (lambda t: 0.2 * t, lambda t: -0.01 * t)
    supports += [Support(b.state, b.face(1, 1.0), i, path, name="xy"[i]) for i, path in enumerate(paths)]
    return Mechanics(b.state, [b.solid(), crack], supports)


def go(folder, steps=STEPS, *, every=0, pause=0.0):
    """Go on to a step, from where an earlier call has come to; the history."""
    mechanics, until = problem(), STEPS * STEP
    checkpoints = Checkpoints(folder / "checkpoint", mechanics, minutes=0, case={"opening": LAW.opening})
    checkpoints.resume()
    with Recording(folder, mechanics, until, every=every, checkpoints=checkpoints) as recording:
        if mechanics.state.number < steps:
            run(mechanics, until, StepControl.fixed(STEP), recording, lambda r: time.sleep(pause) or r.number == steps)
    return recording.columns()


def die_in_write(number):
    """Kill this process in the middle of a write, when half of the file is on the disk."""
    sync, count = os.fsync, [0]

    def fsync(descriptor):
        count[0] += 1
        if count[0] == number:
            if os.readlink(f"/proc/self/fd/{descriptor}").endswith(".part"):
                os.ftruncate(descriptor, os.fstat(descriptor).st_size // 2)
            os.kill(os.getpid(), signal.SIGKILL)
        sync(descriptor)

    os.fsync = fsync


def storm(folder, ranks, kills, pause=0.05):
    """Kill the run at random moments after its next checkpoint.

    Returns:
        Rows of the history, step of the last checkpoint and seconds, for each kill.
    """
    command = [sys.executable, str(Path(__file__).resolve()), "run", str(folder), "--every", "10"]
    if ranks > 1:
        command = [str(mpirun()), "-n", str(ranks), *command]
    found = []
    for _ in range(kills):
        known, started = step_of(folder), time.monotonic()
        process = subprocess.Popen([*command, "--pause", str(pause)], env=environment(), start_new_session=True)
        while step_of(folder) <= known and process.poll() is None:
            time.sleep(0.002)
        time.sleep(random.uniform(0.0, 3 * pause))
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        found.append((rows_of(folder), step_of(folder), round(time.monotonic() - started, 2)))
    return found


def step_of(folder):
    """Step of the last checkpoint."""
    return max((int(path.stem.partition("-")[2]) for path in (folder / "checkpoint").glob("*.h5")), default=0)


def rows_of(folder):
    """Rows of the history."""
    path = folder / "history.csv"
    return path.read_text().count("\n") - 1 if path.exists() else 0


def main():
    """Run, or kill."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("run", "storm"))
    parser.add_argument("folder", type=Path)
    parser.add_argument("--ranks", type=int, default=1)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--every", type=int, default=0)
    parser.add_argument("--pause", type=float, default=0.0)
    parser.add_argument("--die", type=int)
    given = parser.parse_args()
    if given.what == "storm":
        for rows, step, seconds in storm(given.folder, given.ranks, given.kills):
            print(f"killed after {seconds} s with {rows} rows and the checkpoint of step {step}")
        return
    if given.die is not None and MPI.COMM_WORLD.rank == 0:
        die_in_write(given.die)
    go(given.folder, every=given.every, pause=given.pause)


if __name__ == "__main__":
    main()
