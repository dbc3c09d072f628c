"""The cylinder of `cylinder` in cutsim."""

import json
import sys
import time
from pathlib import Path

import numpy as np

from cutsim import StepControl, StepReport, run

sys.path.append(str(Path(__file__).parents[2]))
import cylinder

from validation.hertz import LineContact


def main() -> None:
    """Print what was found."""
    run(LineContact.build(cylinder.LINES).mechanics, 1.0, StepControl.fixed(1.0))  # compiles
    contact = LineContact.build(cylinder.LINES)
    rows: list[StepReport] = []
    start = time.process_time()
    run(contact.mechanics, float(cylinder.LINES.steps[0]), StepControl.fixed(1.0), rows.append)
    seconds = time.process_time() - start
    state, first = contact.mechanics.state, contact.pair.passes[0]
    x = state.V.tabulate_dof_coordinates()
    middle = np.flatnonzero(np.linalg.norm(x, axis=1) < 1e-9)  # a node of each body; that of the cylinder is below
    values = {
        "load": -rows[-1].columns["down_force"][0],
        "centre of the block": float(state.u.x.array[2 * middle + 1].max()),
        "largest pressure": first.points.maximum(first.history.trial["pressure"]),
    }
    iterations = sum(row.outcome.iterations for row in rows)
    found = {"values": values, "iterations": iterations, "seconds": seconds, "unknowns": state.unknowns}
    print(json.dumps(found))


if __name__ == "__main__":
    main()
