# # Steady cuts with other blades, toughnesses and friction
#
# The force of a steady frictionless cut is the toughness times the length of the edge, whatever the blade: $F = G_c w$,
# with the correction for the compressed strip below the blade that the program `steady_cut` derives.  Here four half
# angles and three toughnesses are tried in plane strain on two meshes, and a slice.
#
# One side of the strip is meshed: the crack lies in a plane of symmetry.
#
# - *Angles*: 10°, 15°, 20°, 30°; toughness 0.05, 0.1, 0.2 N/mm, with a strength in proportion, so that the opening at
#   the strength and with it the meshes are the same.  What is compared is the toughness by the mean force,
#   $F(1 + \varepsilon/2)/(1 + \varepsilon)$ with $\varepsilon = F(1-\nu^2)/(EA)$.
# - *Slice*: a blade that is drawn along its edge by $\xi$ times its push, in 3-D.  Without friction no force acts along
#   the edge, and the push is that without a slice (Atkins 2009).  With friction $\mu$ the work of both forces less that
#   of friction is the toughness, and the push falls.

from math import radians

import numpy as np
from _problems import solve
from mpi4py import MPI

from cutsim import (
    Blade,
    Drive,
    Exponential,
    Fixture,
    Insertion,
    NeoHookean,
    StepControl,
    cracked_block,
    geometry,
    read_geo,
    run,
)

COMM = MPI.COMM_WORLD
SILICONE, VISCOSITY = NeoHookean(0.777, 0.45), 2e-4  # MPa, MPa s at 1 mm/s
STEADY = (2.0, 4.0)  # depths of the tip between which the cut is steady [mm]

# ## Angles


def split(angle: float, toughness: float, size: float) -> tuple[float, int]:
    """Toughness by the mean force of a steady cut [N/mm], and the number of unknowns."""
    sizes = {"dim": 2, "Lx": 1.0, "H": 6.5, "lc": size, "band": 0.3, "growth": 1.6, "notch": 0.5, "half": 1}
    domain = read_geo(geometry("block"), COMM, sizes, gdim=2)
    body = cracked_block(
        domain, SILICONE, Exponential(strength=3 * toughness, toughness=toughness), viscosity=VISCOSITY
    )
    blade = Blade(radians(angle), 0.1, 0.5, (0.0, -1.0), (1.0, 0.0))
    cut, rows = Insertion.build(body, blade, Drive(1.0, 1.0), notch=0.5), []
    run(
        cut.mechanics,
        cut.time_of(STEADY[1]),
        StepControl(first=0.02, largest=0.1),
        lambda report: rows.append((cut.depth, cut.columns(report.columns)["force"][0])),
    )
    depth, force = np.array(rows).T
    steady = depth >= STEADY[0]
    mean = float(np.trapezoid(force[steady], depth[steady]) / np.ptp(depth[steady]))
    strain = mean * (1 - SILICONE.poisson**2) / (SILICONE.young * 2.0)
    return mean * (1 + strain / 2) / (1 + strain), body.state.unknowns


def angles(quick: bool) -> dict[str, float]:
    """Toughness by force over that put in."""
    found, unknowns = {}, 0
    for angle in (10, 30) if quick else (10, 15, 20, 30):
        for toughness in (0.1,) if quick else (0.05, 0.1, 0.2):
            for size in (0.05,) if quick else (0.1, 0.05):
                value, unknowns = split(angle, toughness, size)
                found[f"{angle}°, {toughness} N/mm, {size} mm"] = value / toughness
    return found | {"unknowns": unknowns}


# ## Slice

TOUGHNESS, WIDTH, HALF_ANGLE, MU = 0.1, 0.2, np.radians(20), 0.2


def steady_forces(ratio: float, friction: float | None, size: float = 0.2) -> np.ndarray:
    """Forces along push and slice, and friction work per push, over the width; walls hold the strip along the edge."""
    sizes = {"dim": 3, "Lx": 1.0, "H": 4.5, "lc": size, "band": 0.3, "growth": 1.6, "notch": 0.5, "B": WIDTH, "nz": 1}
    sizes |= {"half": 1}
    domain = read_geo(geometry("block"), COMM, sizes, gdim=3)
    body = cracked_block(domain, SILICONE, Exponential(strength=0.3, toughness=TOUGHNESS), viscosity=VISCOSITY)
    blade = Blade(HALF_ANGLE, 0.2, 0.5, (0.0, -1.0, 0.0), (1.0, 0.0, 0.0))
    drive, held = Drive(1.0, 1.0, slice_push=ratio), Fixture(walls=("front", "back"))
    cut = Insertion.build(body, blade, drive, notch=0.5, friction=friction, fixture=held)
    rows = []

    def record(report) -> None:
        force = -cut.symmetry_factor * sum(contact.force() for contact in cut.contacts)
        rubbed = cut.symmetry_factor * report.columns["energy_friction"][0]
        rows.append((cut.depth, force @ cut.frame.push, force @ cut.frame.edge, rubbed))

    run(cut.mechanics, cut.time_of(2.8), StepControl(first=0.02, largest=0.1), record)
    depth, push, along, rubbed = np.array([row for row in rows if row[0] >= 1.7]).T
    way = depth[-1] - depth[0]
    return np.array([np.trapezoid(push, depth), np.trapezoid(along, depth), rubbed[-1] - rubbed[0]]) / (way * WIDTH)


def slices(quick: bool) -> dict[str, float]:
    """Works of a slice by three times the push over those of theory, without and with friction, for each mesh."""
    found = {}
    for size in (0.2,) if quick else (0.2, 0.1):
        smooth = steady_forces(3.0, None, size)
        found |= {f"smooth push, {size} mm": spent(*smooth), f"smooth along, {size} mm": smooth[1] / TOUGHNESS}
        if not quick:
            found[f"work less friction, {size} mm"] = spent(*steady_forces(3.0, MU, size))
    return found


def spent(push: float, along: float, rubbed: float) -> float:
    """What is left of a slice for the crack, with what the strip gives back, over the toughness of what is cut."""
    strain = push * (1 - SILICONE.poisson**2) / (SILICONE.young * 2.0)
    return (push * (1 + strain / 2) + 3.0 * along - rubbed) / (TOUGHNESS * (1 + strain))


PROBLEMS = {"angles": angles, "slices": slices}

if __name__ == "__main__":
    solve("cuts", PROBLEMS)
