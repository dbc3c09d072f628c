"""The two cubes of `cubes` in cutsim, augmented to a thousandth of a millimetre of penetration and slip."""

import json
import sys
import time
from pathlib import Path

from cubes import CELLS, DRAW, EDGE, FRICTION, POISSON, PRESS, STEPS, YOUNG

from cutsim import Friction, Mechanics, NeoHookean, Solid, StepControl, StepReport, run

sys.path.append(str(Path(__file__).parents[2]))
from helpers.boxes import stack


def build() -> Mechanics:
    """The cubes."""
    upper, lower = CELLS
    b = stack(([0.0] * 3, [EDGE] * 3, [lower] * 3), ([0.0, 0.0, EDGE], [EDGE, EDGE, 2 * EDGE], [upper] * 3))
    pair = b.pair(young=YOUNG, friction=Friction(FRICTION, allowed_slip=1e-3), allowed_penetration=1e-3)
    path = [lambda t: DRAW * max(t - 1, 0.0), 0.0, lambda t: -PRESS * min(t, 1.0)]
    supports = b.drive(0, 0, [0.0] * 3) + b.drive(1, 1, path, "top")
    return Mechanics(b.state, [Solid(b.state, NeoHookean(YOUNG, POISSON), volumetric="full"), pair], supports)


def main() -> None:
    """Print what was found."""
    controls = [StepControl(first=1 / n, largest=1 / n, line_searches=("basic", "bt")) for n in STEPS]
    run(build(), 1 / STEPS[0], controls[0])  # compiles
    mechanics = build()
    rows: list[StepReport] = []
    start = time.process_time()
    run(mechanics, 1.0, controls[0], rows.append)
    pressed = -rows[-1].columns["top_z_force"][0]
    run(mechanics, 2.0, controls[1], rows.append)
    seconds = time.process_time() - start
    values = {
        "normal force, pressed": pressed,
        "drag at the end": rows[-1].columns["top_x_force"][0],
        "normal force at the end": -rows[-1].columns["top_z_force"][0],
    }
    iterations = sum(row.outcome.iterations for row in rows)
    unknowns = mechanics.state.unknowns
    print(json.dumps({"values": values, "iterations": iterations, "seconds": seconds, "unknowns": unknowns}))


if __name__ == "__main__":
    main()
