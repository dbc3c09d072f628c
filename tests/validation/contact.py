# # Small problems of contact and friction
#
# Problems of a few hundred elements whose forces are known, on meshes that do not match.  Balls and cylinders are in
# the program `hertz`.  Lengths are in mm, moduli in MPa.
#
# - *Wedge* (NAFEMS CGS-4): a block of weight $G$ is pushed up a slope $\tan\alpha = 0.1$ by a horizontal force,
#   $F/G = (\tan\alpha + \mu)/(1 - \mu\tan\alpha)$.
# - *Patch*: two boxes of different meshes are pressed together; the stress is the same in all elements.
# - *Overlap*: two blocks overlap by a tenth; each is pressed to 0.95 of its height, and bears
#   $\tfrac12 (1/0.95 - 0.95)$ as a neo-Hookean solid with $E = 1$, $\nu = 0$.
# - *Slider*: a stiff block pressed by a force $N$ and moved to and fro slips at $\mu N$ and loses $\mu N s$.
# - *Cubes*: two neo-Hookean cubes of 10 mm with 6³ and 5³ hexahedra are pressed together by 1 mm and drawn by 3 mm over
#   an edge, with $\mu = 0.3$: forces of another code with the same meshes, elements and strain energy.

import numpy as np
from _problems import solve
from dolfinx import fem
from mpi4py import MPI

from cutsim import (
    Coulomb,
    Friction,
    LinearElastic,
    Mechanics,
    NeoHookean,
    PenaltyContact,
    Solid,
    StepControl,
    Support,
    SurfacePair,
    Traction,
    run,
)
from cutsim.base.compat import nodal_expression
from helpers.boxes import stack, two
from helpers.runs import LINE_SEARCHES, final, history

COMM = MPI.COMM_WORLD

# ## Wedge

SLOPE, WEIGHT = 0.1, 4.0


def climb(mu: float, *, two_pass: bool) -> dict[str, np.ndarray]:
    """Push a block of some weight up a slope by three quarters of its length; history."""
    young = 500.0
    b = stack(((0.0, -1.0), (12.0, 0.0), (17, 2)), ((1.0, 0.0), (5.0, 2.0), (7, 3)))
    under, slope, top, side, bottom = (b.face(*w) for w in ((1, 1, 0), (0, 1, 1), (1, 1, 1), (1, 0, 0), (0, 1, 0)))
    b.state.mesh.geometry.x[:, 1] += SLOPE * b.state.mesh.geometry.x[:, 0]
    friction = Coulomb(mu) if mu else None
    pair = SurfacePair(b.state, under, slope, young=young, friction=friction, two_pass=two_pass, search=0.5)
    weight = Traction(b.state, top, (0.0, -WEIGHT / np.hypot(4.0, 4.0 * SLOPE)), lambda t: 1.0, name="weight")
    supports = [Support(b.state, bottom, i) for i in range(2)]
    supports.append(Support(b.state, side, 0, lambda t: 3.0 * t, name="push"))
    mechanics = Mechanics(b.state, [Solid(b.state, LinearElastic(young, 0.3)), pair, weight], supports)
    return history(mechanics, 1.0, StepControl.fixed(0.2))


def wedge(quick: bool) -> dict[str, float]:
    """Force over weight at the step that is farthest from the closed form, for four frictions."""
    found = {}
    for mu in (0.0, 0.3) if quick else (0.0, 0.1, 0.2, 0.3):
        force = climb(mu, two_pass=False)["push_force"] / WEIGHT
        expected = (SLOPE + mu) / (1 - mu * SLOPE)
        found[f"mu = {mu}"] = float(force[np.abs(force - expected).argmax()])
    return found


# ## Pressure


def patch(quick: bool) -> dict[str, float]:
    """Largest error of the stress in an element, over the stress, for one pass and two."""
    young, strain, found = 2.0, 0.01, {}
    for two_pass in (False, True):
        worst = 0.0
        for gdim, simplices in ((2, False), (2, True), (3, False), (3, True)):
            b = two(gdim, n=(4, 5), simplices=simplices)
            pair = b.pair(two_pass=two_pass)
            path = [0.0 if i < gdim - 1 else (lambda t: -strain * t) for i in range(gdim)]
            supports = b.drive(0, 0, [0.0] * gdim) + b.drive(1, 1, path)
            final(Mechanics(b.state, [Solid(b.state, LinearElastic(young, 0.0)), pair], supports), step=1.0)
            space = fem.functionspace(b.state.mesh, ("DG", 0))
            stress = fem.Function(space)
            stress.interpolate(nodal_expression(young * b.state.u[gdim - 1].dx(gdim - 1), space))
            expected = -young * strain / (2 + young / pair.contact.stiffness)
            worst = max(worst, COMM.allreduce(np.abs(stress.x.array / expected - 1).max(), MPI.MAX))
        found["two passes" if two_pass else "one pass"] = worst
    return found


def overlap(quick: bool) -> dict[str, float]:
    """Force between two unit blocks whose outer faces are held and which overlap by a tenth, for three meshes."""
    found = {}
    for n in (4, 10) if quick else (4, 10, 20):
        b = stack(((0.0, -1.0), (1.0, 0.0), (n, 2)), ((0.0, -0.1), (1.0, 0.9), (n + 1, 2)))
        pair = b.pair(young=1.0, allowed_penetration=1e-4)
        supports = b.drive(0, 0, [0.0, 0.0], "bottom") + b.drive(1, 1, [0.0, 0.0])
        last = final(Mechanics(b.state, [Solid(b.state, NeoHookean(1.0, 0.0)), pair], supports), step=1.0)
        found[f"n = {n}"] = last["bottom_y_force"]
    return found


# ## Friction


def slider(quick: bool) -> dict[str, float]:
    """A block pressed by 2 N, moved by 1 mm to and fro: force in slip over μ N, work over μ N s."""
    mu, press, way, stiffness = 0.3, 2.0, 1.0, 1e4
    b = stack(((-2.0, -1.0), (4.0, 0.0), (9, 2)), ((0.0, 0.0), (2.0, 1.0), (5, 2)))
    pair = b.pair(young=1e4, friction=Coulomb(mu, stiffness=stiffness), contact=PenaltyContact(1e5))
    load = Traction(b.state, b.face(1, 1, 1), (0.0, -press / 2.0), lambda t: min(t, 1.0), corners=(1.0,))
    top, turns = b.face(1, 1, 1), (1.0, 2.0)
    drive = Support(
        b.state, top, 0, lambda t: way * np.interp(t, [0, 1, 2, 4], [0, 0, 1, -1]), name="drive", corners=turns
    )
    supports = [*b.drive(0, 0, [0.0, 0.0]), drive]
    mechanics = Mechanics(b.state, [Solid(b.state, LinearElastic(1e4, 0.0)), pair, load], supports)
    rows = history(mechanics, 4.0, StepControl.fixed(0.1))
    slips = rows["time"] > 3.0
    elastic = mu * press / 2.0 / stiffness  # slip before the block slides
    slid = 3 * way - 3 * elastic
    return {
        "force": float(-rows["drive_force"][slips].mean() / (mu * press)),
        "work": float(rows["energy_friction"][-1] / (mu * press * slid)),
    }


def cubes(quick: bool) -> dict[str, float]:
    """Drag and normal force at the end of the way, and the normal force after pressing, without penetration."""
    n = (4, 3) if quick else (6, 5)
    edge, press, draw = 10.0, 1.0, 3.0
    lower, upper = ([0.0] * 3, [edge] * 3, [n[1]] * 3), ([0.0, 0.0, edge], [edge, edge, 2 * edge], [n[0]] * 3)
    b = stack(lower, upper)
    options = {"friction": Friction(0.3, allowed_slip=1e-3), "allowed_penetration": 1e-3}
    pair = b.pair(young=1.0, **options)
    path = [lambda t: draw * max(t - 1, 0.0), 0.0, lambda t: -press * min(t, 1.0)]
    supports = b.drive(0, 0, [0.0] * 3) + b.drive(1, 1, path, "top")
    mechanics = Mechanics(b.state, [Solid(b.state, NeoHookean(1.0, 0.45), volumetric="full"), pair], supports)
    rows = []
    for end, step in ((1.0, 1 / 5), (2.0, 1 / 15)):
        run(mechanics, end, StepControl(first=step, largest=step, line_searches=LINE_SEARCHES), rows.append)
    last = {name: value for name, (value, _) in rows[-1].columns.items()}
    return {"drag": last["top_x_force"], "normal": -last["top_z_force"], "unknowns": b.state.unknowns}


PROBLEMS = {"wedge": wedge, "patch": patch, "overlap": overlap, "slider": slider, "cubes": cubes}

if __name__ == "__main__":
    solve("contact", PROBLEMS)
