"""A run with everything on. As a script: save its state and go on, or restore the state and go on, for ten steps.

python coupled_run.py save FOLDER    writes state.h5 and whole.pickle
python coupled_run.py resume FOLDER  reads state.h5, writes resumed.pickle
"""

import pickle
import sys
from pathlib import Path

from mpi4py import MPI

from cutsim import StepControl, run
from cutsim.results.checkpoint_file import read_checkpoint, write_checkpoint
from helpers.coupled import coupled

#: Time at which the state is saved, size of the steps, and their number afterwards.
SAVED, STEP, STEPS = 1.0, 0.02, 10


def go_on(problem):
    """Snapshots of the steps that follow."""
    snapshots = []
    end = SAVED + (STEPS + 5) * STEP
    run(
        problem,
        end,
        StepControl.fixed(STEP),
        lambda _: snapshots.append(problem.state.memory.save()),
        stop=lambda _: len(snapshots) == STEPS,
    )
    return snapshots


def main(what, folder):
    """Save or resume."""
    problem, path = coupled(MPI.COMM_SELF), folder / "state.h5"
    if what == "save":
        run(problem, SAVED, StepControl.fixed(STEP))
        write_checkpoint(path, problem, {})
    else:
        read_checkpoint(path, problem, {})
    name = {"save": "whole", "resume": "resumed"}[what]
    (folder / f"{name}.pickle").write_bytes(pickle.dumps(go_on(problem)))


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))
