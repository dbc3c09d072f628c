"""Stages and folders of runs that nobody has computed."""

import json

import numpy as np

from cutsim.base.units import Units
from cutsim.results.folder import STAGES
from cutsim.results.stages import Skin, Stage

HEADER = "step,time [s],depth [mm],force [N],work_external [mJ],energy_strain [mJ],energy_fracture [mJ],energy_closure"


def skin(points, cells, **values):
    """A part that has moved up by a tenth."""
    points = np.asarray(points, np.float32)
    up = np.tile(np.float32([0, 0.1, 0]), (len(points), 1))
    return Skin(points, up, np.asarray(cells, np.int32), {key: np.float32(entry) for key, entry in values.items()})


def stage(time, flat=True, mirror=(), broken=1.0):
    """A square of two triangles with a crack along its diagonal, and a triangle as tool."""
    z = 0.0 if flat else 0.5
    body = skin(
        [(0, 0, z), (1, 0, z), (1, 1, z), (0, 1, z)], [(0, 1, 2), (0, 2, 3)], stress=[0, 1, 2, time], part=[0, 0]
    )
    crack = skin([(0, 0, z), (1, 1, z)], [(0, 1)], damage=[broken * time])
    tool = skin([(0.4, 1, z), (0.5, 0.7, z), (0.6, 1, z)], [(0, 1, 2)])
    return Stage(time, body, crack, tool, ("block",), Units(), flat=flat, mirror=mirror)


def write_run(folder, until=2.0, rows=5, **summary):
    """Write the files of a run of one second; a summary only if one is given."""
    times = np.linspace(0.2, 1.0, rows)
    table = [[i + 1, t, t, 3 * t, t, 0.6 * t, 0.4 * t, 1e-4] for i, t in enumerate(times)]
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "history.csv").write_text("\n".join([HEADER, *(",".join(map(str, row)) for row in table)]) + "\n")
    if summary:
        (folder / "summary.json").write_text(json.dumps({"time": 1.0, "until": until, "reasons": []} | summary))
    for i, time in enumerate((0.0, 0.5, 1.0)):
        stage(time).write(folder / STAGES / f"{i:03d}.npz")
