# # What a result may not depend on
#
# A strip of silicone is cut by a blade to 1.6 mm of depth, in equal steps.  The force curve has to be the same
#
# - in five systems of units, from metres and pascals to micrometres and kilopascals,
# - in a body that is turned by 30° and in one that is mirrored,
# - on 1, 2 and 3 MPI ranks,
# - with another version of dolfinx, whose curve is kept in `other_version.json`; in an environment of that version
#   `python -m cutsim.commands.launch -n 1 tests/validation/invariances.py --save tests/validation/other_version.json`
#   makes it anew,
# - if the run is stopped half way, and goes on from its checkpoint in a new problem.
#
# What is compared is the largest difference of the force at a step, over the largest force.

import json
import subprocess
import sys
from datetime import date
from pathlib import Path
from tempfile import TemporaryDirectory

import dolfinx
import numpy as np
from _problems import solve
from mpi4py import MPI

from cutsim import (
    Blade,
    Checkpoints,
    Drive,
    Exponential,
    Insertion,
    NeoHookean,
    Recording,
    StepControl,
    cracked_block,
    geometry,
    read_geo,
    run,
)
from cutsim.base.versions import petsc_version

COMM = MPI.COMM_WORLD
DEPTH = 1.6  # [mm]
CONTROL = StepControl(first=0.05, largest=0.05)
OTHER = Path(__file__).with_name("other_version.json")

# ## The cut


def insertion(length: float = 1.0, stress: float = 1.0, angle: float = 0.0, mirrored: bool = False) -> Insertion:
    """The strip, turned and mirrored, with lengths and stresses in other units: how many of them a mm and a MPa are."""
    sizes = {"dim": 2, "Lx": 1.0, "H": 4.0, "lc": 0.1, "band": 0.3, "growth": 1.6, "notch": 0.5}
    domain = read_geo(geometry("block"), COMM, sizes, gdim=2)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]) @ np.diag([1 - 2 * mirrored, 1])
    x = domain.mesh.geometry.x
    x[:, :2] = length * x[:, :2] @ turn.T
    forward, lateral = (tuple(turn @ axis) for axis in ((0.0, -1.0), (1.0, 0.0)))
    bond = Exponential(strength=0.3 * stress, toughness=0.1 * stress * length)
    body = cracked_block(domain, NeoHookean(0.777 * stress, 0.45), bond, viscosity=2e-4 * stress)
    blade = Blade(np.radians(20), 0.1 * length, 0.5 * length, forward, lateral)
    return Insertion.build(body, blade, Drive(length, 1.0), notch=0.5 * length)


def curve(cut: Insertion, length: float = 1.0, force: float = 1.0, depth: float = DEPTH) -> np.ndarray:
    """Force at each step, in N/mm."""
    found = []
    run(cut.mechanics, cut.time_of(depth * length), CONTROL, lambda report: found.append(pushed(cut) / force))
    return np.array(found)


def pushed(cut: Insertion) -> float:
    """Force on the tool against its push."""
    return float(-sum(contact.force() for contact in cut.contacts) @ cut.frame.push)


def difference(one: np.ndarray, other: np.ndarray) -> float:
    """Largest difference of two curves over the largest force."""
    if len(one) != len(other):
        return float("inf")
    return float(np.abs(one - other).max() / np.abs(one).max())


# ## What is changed

#: How many units of length and stress a mm and a MPa are.
UNITS = {
    "m, Pa": (1e-3, 1e6),
    "cm, bar": (0.1, 10.0),
    "µm, kPa": (1e3, 1e3),
    "inch, psi": (1 / 25.4, 145.03774),
}


def units(quick: bool) -> dict[str, float]:
    """Largest difference from the curve in mm and MPa."""
    plain = curve(insertion())
    found = {
        name: difference(plain, curve(insertion(length, stress), length, length * stress))
        for name, (length, stress) in UNITS.items()
    }
    return {"largest": max(found.values()), **found}


def turned(quick: bool) -> dict[str, float]:
    """The same, of bodies that are turned and mirrored."""
    plain = curve(insertion())
    changes = {"turned": {"angle": np.radians(30)}, "mirrored": {"mirrored": True}}
    return {name: difference(plain, curve(insertion(**change))) for name, change in changes.items()}


def ranks(quick: bool) -> dict[str, float]:
    """Largest difference of curves on 2 and 3 ranks, to half of the depth."""
    curves = []
    with TemporaryDirectory() as folder:
        for number in (1, 2, 3):
            out = Path(folder, f"{number}.json")
            command = ["-m", "cutsim.commands.launch", "-n", str(number), __file__, "--save", str(out)]
            subprocess.run([sys.executable, *command], check=True, stdout=subprocess.DEVNULL)
            curves.append(np.array(json.loads(out.read_text(encoding="utf-8"))["force"]))
    return {f"{number} ranks": difference(curves[0], curves[number - 1]) for number in (2, 3)}


def resumed(quick: bool) -> dict[str, float]:
    """Difference of the curve of a run that goes on from a checkpoint half way."""
    plain, rest = curve(insertion()), []
    until = insertion().time_of(DEPTH)
    with TemporaryDirectory() as folder:
        for half in (True, False):
            cut = insertion()
            checkpoints = Checkpoints(Path(folder, "checkpoint"), cut.mechanics)
            checkpoints.resume()
            with Recording(folder, cut.mechanics, until, every=0, checkpoints=checkpoints, quiet=True) as recording:

                def record(report, cut=cut, recording=recording) -> None:
                    recording(report)
                    rest.append(pushed(cut))

                run(cut.mechanics, until, CONTROL, record, lambda report, half=half: half and report.time > 1.5)
    return {"difference": difference(plain, np.array(rest))}


def versions(quick: bool) -> dict[str, float]:
    """Largest difference from the curve of another version of dolfinx, to half of the depth."""
    other = json.loads(OTHER.read_text(encoding="utf-8"))
    return {"difference": difference(curve(insertion(), depth=DEPTH / 2), np.array(other["force"]))}


def save(path: Path) -> None:
    """Write the curve to half of the depth, and what has made it. Collective."""
    forces = curve(insertion(), depth=DEPTH / 2)
    made = {"dolfinx": dolfinx.__version__, "PETSc": petsc_version(), "date": date.today().isoformat()}
    if COMM.rank == 0:
        path.write_text(json.dumps(made | {"force": list(forces)}, indent=1) + "\n", encoding="utf-8")


PROBLEMS = {"units": units, "turned": turned, "partition": ranks, "resumed": resumed, "versions": versions}

if __name__ == "__main__":
    if "--save" in sys.argv:  # one of the ranks, or another version
        save(Path(sys.argv[-1]))
    else:
        solve("invariances", PROBLEMS)
