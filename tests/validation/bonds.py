# # Bonds between two blocks
#
# What a bond does at a point, and two bonded boxes that another program has computed.
#
# **Two boxes of the thesis' own program.**  Two unit cubes of one hexahedron each, $E = 5\cdot10^6$, $\nu = 0.48$, are
# bonded with $t = 1$, $\varepsilon = 10^{-4}$; the lower one is held but for a corner of the bonded face, the upper one
# is lifted by $4.8\cdot10^{-4}$ in ten or a hundred steps.  The forces are those of the modified FEBio 2.0 that was
# published with the book of K. Bronik.  That program adds the law four times (two components and two passes), so that
# the strength is 4 here.  Table 4.7 of the thesis prints the five residuals of a typical step.
#
# **Paths.**  With different works of separation, $\varphi_n = 1$ and $\varphi_t = 1/2$, the exponential law needs a
# work that depends on the path.  The totals are integrals of the tractions of van den Bosch, Schreurs and Geers (2006)
# along the path, opened to $d$ and then sheared off, or sheared to $d$ and then opened; for
# $\delta_n = d\varepsilon_n$: $\varphi_n[1 - (1 + d)e^{-d}] + \varphi_t(1 + d)e^{-d}$, and for
# $\delta_t = d\varepsilon_t$: $\varphi_t(1 - e^{-d^2}) + \varphi_n e^{-d^2}$.
#
# **Mixed toughness** of the bilinear law by the criterion of Benzeggagh and Kenane (1996),
# $G_c = G_I + (G_{II} - G_I)\,[G_{II}/(G_I+G_{II})]^\eta$, opened and sheared in proportion.
#
# **Cycles.**  A bond that was opened to $2\varepsilon$ and is then led round a closed path below that opening, 20
# times, spends nothing more.
#
# **An inclined joint.**  A square of 1 m, $E$ = 30 GPa, $\nu$ = 0.2, is crossed at 45° by an elastic joint of 20 MPa/mm
# across and 40 MPa/mm along it, and drawn by $\sigma$ (Code_Aster V3.04.001).  The joint carries $\sigma/2$ both ways
# and opens by $\frac{\sigma}{2\sqrt 2}\,(1/k_n + 1/k_t)$ along the pull, and by the difference of both across it.

from math import exp
from pathlib import Path

import numpy as np
from _problems import solve
from dolfinx import fem, mesh
from mpi4py import MPI

from cutsim import (
    Bilinear,
    Crack,
    Exponential,
    LinearElastic,
    Mechanics,
    Solid,
    State,
    Support,
    Tolerances,
    Traction,
    cracked_space,
)
from cutsim.analysis.stepping import begin
from helpers.blocks import Blocks, drag
from helpers.laws import BILINEAR, EXPONENTIAL
from helpers.runs import final

DATA = Path(__file__).parents[1] / "data"
DIRECT = {"ksp_type": "preonly", "pc_type": "lu"}
#: Residuals of a typical step over the first, as the thesis prints them (table 4.7).
TABLE = np.array([1.702439, 1.246976, 7.549132e-5, 6.568224e-9, 6.594945e-16]) / 1.702439

# ## Two boxes


def two_boxes() -> Mechanics:
    """Two bonded unit cubes of a hexahedron each: the lower one held but for a bonded corner, the upper one lifted."""
    corners = [[0.0, 0.0, -1.0], [1.0, 1.0, 1.0]]
    domain = mesh.create_box(MPI.COMM_SELF, corners, (1, 1, 2), mesh.CellType.hexahedron)
    bonded = mesh.locate_entities(domain, 2, lambda x: np.isclose(x[2], 0.0))
    lower, upper = (mesh.locate_entities(domain, 3, lambda x, s=s: s * x[2] > -1e-9) for s in (-1, 1))
    b = Blocks(State(cracked_space(domain, ("Lagrange", 1, (3,)), bonded)), bonded, lower, upper)
    nodes = np.unique(b.state.V.dofmap.list[lower])
    held = nodes[np.linalg.norm(b.state.V.tabulate_dof_coordinates()[nodes], axis=1) > 0.1]
    supports = [Support(b.state, lower, i, dim=3) for i in range(3)]
    for support in supports:  # a support holds entities; here one node of the lower side of the crack is to be free
        support.dofs = (3 * held + support.component).astype(np.int32)
        support.bc = fem.dirichletbc(support.bc.g, support.dofs, b.state.V.sub(support.component))
    law = Exponential(strength=4.0, opening=1e-4, shear_strength=4.0, shear_opening=1e-4)
    solid = b.solid(LinearElastic(5e6, 0.48), volumetric="full")
    crack = b.crack(law, young=5e6, normal="reference")
    supports += b.drive(upper, [0.0, 0.0, lambda t: 4.8e-4 * t], "top")
    return Mechanics(b.state, [solid, crack], supports, petsc_options=DIRECT, tolerances=Tolerances(rtol=1e-14))


def boxes(quick: bool) -> dict[str, float]:
    """Largest difference of the force from that of the other program, over the force; residuals of a step, at most."""
    found, residuals = {}, 0
    for steps in (10, 100):
        known = np.genfromtxt(DATA / f"two_boxes_{steps}_steps.csv", delimiter=",", names=True)
        mechanics, forces = two_boxes(), []
        for time in known["time"]:
            begin(mechanics, time)
            outcome = mechanics.solve("basic")
            mechanics.evaluate()
            mechanics.state.commit()
            forces.append(mechanics.record()["top_z_force"][0])
            residuals = max(residuals, len(outcome.residuals))
        found[f"{steps} steps"] = float(np.abs(np.array(forces) / known["force"] - 1).max())
    return found | {"residuals": residuals}


# ## Paths


def paths(quick: bool) -> dict[str, float]:
    """Largest difference of the work of separation from the integral along the path, and the work of one path."""
    scale, worst = (EXPONENTIAL.shear_opening, EXPONENTIAL.opening), 0.0
    for d in (0.5, 1.0, 2.0, 5.0):
        open_first = 1 - (1 + d) * exp(-d) + 0.5 * (1 + d) * exp(-d)
        shear_first = 0.5 * (1 - exp(-d * d)) + exp(-d * d)
        for corner, end, known in (((0, d), (6, d), open_first), ((d, 0), (d, 20), shear_first)):
            rows, _ = drag(EXPONENTIAL, np.array([(0, 0), corner, end]) * scale, steps=100)
            work = rows["energy_fracture"][-1] + rows["energy_cohesive_stored"][-1]
            worst = max(worst, abs(work - known))
    return {"largest": worst}


def mixed(quick: bool) -> dict[str, float]:
    """Work until the bilinear law has let go over that of Benzeggagh and Kenane, at the ratio where it is worst."""
    worst = 1.0
    for ratio in (0.3, 1.0, 3.0):
        mix = ratio**2 / (1 + ratio**2)
        toughness = BILINEAR.toughness + (BILINEAR.shear_toughness - BILINEAR.toughness) * mix**BILINEAR.eta
        rows, _ = drag(BILINEAR, 0.5 * np.array([(0, 0), (ratio, 1)]) / np.hypot(1, ratio), steps=100)
        over = rows["energy_fracture"][-1] / toughness
        worst = max(worst, over, key=lambda value: abs(value - 1))
    return {"worst": worst}


def cycles(quick: bool) -> dict[str, float]:
    """Work spent by 20 closed cycles below the largest opening, over what the first opening has spent."""
    legs = [(0, 0), (0, 2), (0, 0), *[(1.0, 0), (1.0, 1.4), (0, 1.4), (0, 0)] * 20]
    scale = (EXPONENTIAL.shear_opening, EXPONENTIAL.opening)
    rows, _ = drag(EXPONENTIAL, np.array(legs) * scale, steps=4 * (len(legs) - 1))
    spent = rows["energy_fracture"]
    first_cycle = np.searchsorted(rows["time"], 6 + 1e-9) - 1
    return {"spent": float((spent[-1] - spent[first_cycle]) / spent[first_cycle])}


# ## Joint


def joint(quick: bool) -> dict[str, float]:
    """Displacements of the drawn side and of the free one over the closed forms."""
    side, young, poisson, pull, across, along = 1000.0, 30e3, 0.2, 1.0, 20.0, 40.0
    domain = mesh.create_rectangle(MPI.COMM_SELF, [(0.0, 0.0), (side, side)], (4, 4), mesh.CellType.triangle)
    bonded = mesh.locate_entities(domain, 1, lambda x: np.isclose(x[0], x[1]))
    state = State(cracked_space(domain, ("Lagrange", 1, (2,)), bonded))
    left, low, right, high = (
        mesh.locate_entities_boundary(domain, 1, lambda x, axis=axis, end=end: np.isclose(x[axis], end))
        for axis, end in ((0, 0.0), (1, 0.0), (0, side), (1, side))
    )
    law = Bilinear(across, 1e6, 1e12, 1e6, 1e12, shear_penalty=along)  # as strong as to stay intact
    crack = Crack(state, bonded, (1.0, -1.0), law, young=young, normal="reference")
    solid = Solid(state, LinearElastic(young, poisson), plane="stress")
    load = Traction(state, right, (pull, 0.0), lambda t: t)
    final(Mechanics(state, [solid, crack, load], [Support(state, left, 0), Support(state, low, 1)]), step=1.0)
    jump = pull / (2 * np.sqrt(2)) * np.array([1 / across + 1 / along, 1 / across - 1 / along])
    expected = (pull / young * side + jump[0], jump[1] - poisson * pull / young * side)
    u = state.u.x.array.reshape(-1, 2)
    ends = (u[fem.locate_dofs_topological(state.V, 1, facets)] for facets in (right, high))
    found = [float(end[:, axis].max()) for axis, end in enumerate(ends)]
    return {"drawn": found[0] / expected[0], "free": found[1] / expected[1]}


PROBLEMS = {"boxes": boxes, "paths": paths, "mixed": mixed, "cycles": cycles, "joint": joint}

if __name__ == "__main__":
    solve("bonds", PROBLEMS)
