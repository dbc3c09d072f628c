"""A double cantilever beam on a structured mesh of quadrilaterals, as arrays that any program can read.

Plane strain, small strain: E = 200 GPa, ν = 0.3, arms of 1.5 mm, initial crack of 30 mm, bilinear bond with 0.28 N/mm,
57 MPa and a stiffness of 1e5 N/mm³.  The ends are moved apart by 4 mm in 100 equal steps.  All programs have the same
nodes, the same elements of degree 1 with 2 × 2 points, and three points on each facet of the bond.
"""

import numpy as np

YOUNG, POISSON = 200e3, 0.3  # MPa
PENALTY, STRENGTH, TOUGHNESS = 1e5, 57.0, 0.28  # N/mm³, MPa, N/mm
LENGTH, HEIGHT, CRACK = 70.0, 1.5, 30.0  # mm
CELLS = 467, 4  # of an arm
OPENING, STEPS = 4.0, 100  # mm


def arm(bottom: float) -> tuple[np.ndarray, np.ndarray]:
    """Nodes, row by row from below, and cells, counterclockwise, of an arm."""
    nx, ny = CELLS
    x, y = np.meshgrid(np.linspace(0.0, LENGTH, nx + 1), bottom + np.linspace(0.0, HEIGHT, ny + 1))
    first = (np.arange(nx) + (nx + 1) * np.arange(ny)[:, None]).ravel()
    cells = np.stack([first, first + 1, first + nx + 2, first + nx + 1], axis=1)
    return np.stack([x.ravel(), y.ravel()], axis=1), cells


def summary(opening: list[float], force: list[float], iterations: int, seconds: float, unknowns: int) -> dict:
    """What the programs compare: peak, and the force half way and at the end, as far as a program has come."""
    at = int(np.argmax(force))
    values = {"peak": force[at], "opening at the peak": opening[at]}
    for place in (2.0, OPENING):
        if opening[-1] >= place * (1 - 1e-9):
            values[f"force at {place:g} mm"] = float(np.interp(place, opening, force))
    return {"values": values, "iterations": iterations, "seconds": seconds, "unknowns": unknowns}
