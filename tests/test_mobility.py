"""Bodies that nothing holds or joins, loads that nothing carries, cracks that cannot open: refused by name."""

import re

import basix.ufl
import numpy as np
import pytest
from dolfinx import fem, mesh
from mpi4py import MPI

from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.stepping import StepControl, StepError, run
from cutsim.base.compat import create_mesh
from cutsim.bodies.loads import Support, Traction
from cutsim.bodies.solid import Solid
from cutsim.fields.pieces import connected_pieces
from cutsim.fields.space import cracked_space
from cutsim.fields.state import State
from cutsim.interface.cohesive import Exponential
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.crack import Crack
from cutsim.materials.elastic import NeoHookean
from helpers.blocks import make_blocks
from helpers.boxes import stack
from helpers.laws import EXPONENTIAL, NU, E

COMM = MPI.COMM_WORLD
GEL = NeoHookean(E, NU)


def square(gdim=2, n=4):
    cell = (mesh.CellType.quadrilateral, mesh.CellType.hexahedron)[gdim - 2]
    create = (mesh.create_unit_square, mesh.create_unit_cube)[gdim - 2]
    domain = create(COMM, *(n,) * gdim, cell, ghost_mode=mesh.GhostMode.shared_facet)
    return State(fem.functionspace(domain, ("Lagrange", 1, (gdim,))))


def where(state, dim, place):
    return mesh.locate_entities_boundary(state.mesh, dim, place)


def side(axis, at):
    return lambda x: np.isclose(x[axis], at)


HELD = {
    "nowhere": ([], 2, "slide along x and y and turn"),
    "along x": ([(side(0, 0), 1, (0,))], 2, "slide along y"),
    "in a corner": ([(lambda x: side(0, 0)(x) & side(1, 0)(x), 0, (0, 1))], 2, "turn"),
    "on a floor": ([(side(2, 0), 2, (2,))], 3, "slide along x and y and turn"),
    "against turning only": ([(side(0, 0), 2, (0,)), (side(1, 0), 2, (1,))], 3, "slide along z"),
}


@pytest.mark.mpi
@pytest.mark.parametrize("case", HELD)
def test_what_is_free_is_named(case):
    held, gdim, motion = HELD[case]
    state = square(gdim, 2)
    supports = [Support(state, where(state, dim, at), i, dim=dim) for at, dim, axes in held for i in axes]
    load = Traction(state, where(state, gdim - 1, side(0, 1)), (0, -0.05, 0)[:gdim], lambda t: t)
    mechanics = Mechanics(state, [Solid(state, GEL, name="gel"), load], supports)
    with pytest.raises(ValueError, match=f"body 'gel' can {motion}: neither"):
        run(mechanics, 1.0, StepControl.fixed(1.0))
    assert not state.u.x.array.any()


@pytest.mark.mpi
def test_a_body_that_is_held_is_let_run():
    """Held along a slanted face in the corners: three constraints are enough in the plane."""
    state = square()
    supports = [Support(state, where(state, 1, side(0, 0)), 0)]
    supports.append(Support(state, where(state, 0, lambda x: side(0, 1)(x) & side(1, 0)(x)), 1, dim=0))
    load = Traction(state, where(state, 1, side(0, 1)), (0.0, -0.01), lambda t: t)
    mechanics = Mechanics(state, [Solid(state, GEL), load], supports)
    assert run(mechanics, 1.0, StepControl.fixed(1.0)).outcome.converged


@pytest.mark.mpi
@pytest.mark.parametrize("held_by", ["bond", "overlap", "nothing", "touch"])
def test_cracks_and_contacts_hold_what_they_resist(held_by):
    """An upper block that only the crack below it can hold."""
    b = make_blocks()
    crack = b.crack(EXPONENTIAL if held_by == "bond" else None, contact=PenaltyContact(30.0))
    supports = [*b.drive(b.lower, [0.0, 0.0]), Support(b.state, b.face(1, 1.0), 0)]
    load = Traction(b.state, b.face(1, 1.0), (0.0, -0.1), lambda t: t)
    if held_by in ("overlap", "nothing"):
        gap = -1e-3 if held_by == "overlap" else 1e-3
        b.move(lambda x: 0 * x, lambda x: np.array([0 * x[0], 0 * x[0] + gap]))
        b.state.commit()
    mechanics = Mechanics(b.state, [b.solid(GEL, name="upper"), crack, load], supports)
    if held_by in ("bond", "overlap"):
        assert run(mechanics, 1.0, StepControl.fixed(0.5)).outcome.converged
    else:
        with pytest.raises(ValueError, match=r"the piece around \(0.5, 0.75\).* can slide along y"):
            run(mechanics, 1.0, StepControl.fixed(0.5))


@pytest.mark.mpi
def test_a_load_beyond_the_strength_has_no_equilibrium():
    """A bond of strength 0.1 under a dead load that grows to 0.12: the path turns at 0.1, and its end says why."""
    b = make_blocks()
    law = Exponential(strength=0.1, toughness=0.01)
    supports = [*b.drive(b.lower, [0.0, 0.0]), Support(b.state, b.face(1, 1.0), 0)]
    load = Traction(b.state, b.face(1, 1.0), (0.0, 0.12), lambda t: t, name="pull")
    mechanics = Mechanics(b.state, [b.solid(GEL), b.crack(law), load], supports)
    reports = []
    with pytest.raises(StepError, match=r"no equilibrium under more of pull \(a limit point\)"):
        run(mechanics, 1.0, StepControl(0.15, 0.15), reports.append)
    times = [report.time for report in reports]
    assert 0.8 < max(times) < 0.1 / 0.12 + 1e-6
    assert times[-1] < 0.01, "the load is followed down to nothing"
    assert np.abs(b.state.u.x.array).max() < 1.0


def test_a_crack_needs_a_space_that_is_cracked_there():
    domain = square().mesh
    middle = mesh.locate_entities(domain, 1, side(1, 0.5))
    state = State(cracked_space(domain, ("Lagrange", 1, (2,)), middle[:3]))
    with pytest.raises(ValueError, match=r"'cut': the space is not cracked along 1 of 4 .* one of which is at"):
        Crack(state, middle, (0.0, 1.0), EXPONENTIAL, young=E, name="cut")
    with pytest.raises(ValueError, match="not cracked along 4 of 4"):
        Crack(square(), middle, (0.0, 1.0), EXPONENTIAL, young=E, name="cut")


def test_a_facet_has_one_law():
    b = make_blocks()
    one, two = b.crack(EXPONENTIAL, name="one"), b.crack(EXPONENTIAL, name="two")
    with pytest.raises(ValueError, match=r"cracks 'one' and 'two' share 2 facets"):
        Mechanics(b.state, [b.solid(), one, two], b.drive(b.lower, [0.0, 0.0]))


@pytest.mark.mpi
def test_more_ranks_than_cells():
    """Two bodies of one cell each press on each other, on as many ranks as there are as on one."""
    forces = []
    for comm in (COMM, MPI.COMM_SELF):
        s = stack(((0.0, 0.0), (1.0, 1.0), (1, 1)), ((0.0, 1.0), (1.0, 2.0), (1, 1)), comm=comm)
        supports = [*s.drive(0, 0, [0.0, 0.0]), *s.drive(1, 1, [0.0, lambda t: -0.1 * t], "top")]
        mechanics = Mechanics(s.state, [Solid(s.state, GEL), s.pair()], supports)
        forces.append(run(mechanics, 1.0, StepControl.fixed(1.0)).columns["top_y_force"][0])
    assert forces[0] == pytest.approx(forces[1], rel=1e-8) and forces[0] < -0.05


def stacked(shift, held):
    """Two squares above each other that have no node in common, the upper one shifted."""
    s = stack(((0.0, 0.0), (1.0, 1.0), (2, 2)), ((shift, 1.0), (1.0 + shift, 2.0), (2, 2)))
    pair = [s.pair()] if held == "pair" else []
    upper = [0.0, lambda t: 0.1 * t] if held != "below" else []
    supports = [*s.drive(0, 0, [0.0, 0.0]), *s.drive(1, 1, upper, "top")]
    return s, Mechanics(s.state, [Solid(s.state, GEL, name="gel"), *pair], supports)


@pytest.mark.mpi
def test_bodies_that_were_not_merged_are_reported(caplog):
    """Pulled apart they would just do so; a pair of surfaces between them, or another mesh, says that it is meant."""
    told = r"3 pairs of nodes lie on each other between \(0, 1, 0\) and \(1, 1, 0\) .*: if .* merge them in gmsh"
    stacked(0.0, "apart")
    assert COMM.rank or re.search(told, caplog.text)
    with pytest.raises(ValueError, match=r"can slide along x and y and turn: .* In the mesh " + told):
        stacked(0.0, "below")[1].check()
    caplog.clear()
    stacked(0.0, "pair")
    stacked(0.25, "apart")
    assert not caplog.text


@pytest.mark.mpi
def test_a_mesh_that_is_split_along_the_crack_is_told_from_its_border():
    s, _ = stacked(0.0, "apart")
    with pytest.raises(ValueError, match=r"2 lie on the outer boundary, .*split along them, .*removeDuplicateNodes"):
        cracked_space(s.state.mesh, ("Lagrange", 1, (2,)), s.face(0, 1, 1))
    with pytest.raises(ValueError, match=r"allowed are interior facets$"):
        cracked_space(s.state.mesh, ("Lagrange", 1, (2,)), s.face(0, 1, 0))


@pytest.mark.mpi
@pytest.mark.parametrize(("gdim", "missing"), [(2, (0.625,)), (3, (0.625, 0.375)), (3, (0.625, 0.125)), (2, (0.875,))])
def test_a_gap_in_a_crack_is_warned_of(gdim, missing, caplog):
    """A facet in the middle, in 3-D also at the border; a crack that ends before the border has none."""
    domain, up = square(gdim).mesh, gdim - 1
    facets = mesh.locate_entities(domain, up, side(up, 0.5))
    middles = mesh.compute_midpoints(domain, up, facets)[:, :up]
    kept = facets[~np.isclose(middles, missing).all(axis=1)]
    state = State(cracked_space(domain, ("Lagrange", 1, (gdim,)), kept))
    Mechanics(state, [Solid(state, GEL), Crack(state, kept, (0.0, 0.0, 1.0)[-gdim:], None, young=E, name="cut")])
    place = ", ".join(f"{c:g}" for c in (*missing, 0.5, 0)[:3])
    assert COMM.rank or (
        f"cut: 1 facets are missing in the middle of the crack, the first at ({place})" in caplog.text
    ) == (missing != (0.875,))


@pytest.mark.mpi
def test_a_facet_that_no_crack_has_is_doubted():
    """The space is cracked along it; without the last term there is neither bond nor contact."""
    domain = square(2).mesh
    facets = mesh.locate_entities(domain, 1, side(1, 0.5))
    middles = mesh.compute_midpoints(domain, 1, facets)[:, 0]
    state = State(cracked_space(domain, ("Lagrange", 1, (2,)), facets))
    kept, left = facets[~np.isclose(middles, 0.625)], facets[np.isclose(middles, 0.625)]
    terms = [Solid(state, GEL), Crack(state, kept, (0.0, 1.0), None, young=E, name="cut")]
    assert state.verdict.trusted
    Mechanics(state, [*terms, Crack(state, left, (0.0, 1.0), None, young=E, name="rest")])
    assert state.verdict.trusted
    Mechanics(state, terms)
    assert "cut: 1 facets are missing in the middle of the crack, the first at (0.625" in str(state.verdict)


@pytest.mark.mpi
def test_supports_agree_on_what_both_hold():
    """At a corner held twice: equal values are one support, whose reaction counts once; others are refused."""
    state = square()
    bottom, left = (where(state, 1, side(axis, 0)) for axis in (1, 0))
    top = where(state, 1, side(1, 1))

    def mechanics(value, **options):
        supports = [Support(state, bottom, 0), Support(state, bottom, 1), Support(state, left, 0, value, **options)]
        return Mechanics(state, [Solid(state, GEL)], [*supports, Support(state, top, 1, lambda t: 0.1 * t, name="top")])

    with pytest.raises(
        ValueError, match=r"without a name and 'left' prescribe u_x = 0 and 0.1 .* on 1 nodes .* \(0, 0\)"
    ):
        mechanics(0.1, name="left")
    later = mechanics(lambda t: 0.1 * t)
    with pytest.raises(ValueError, match=r"u_x = 0 and 0.05 at time 0.5"):
        run(later, 1.0, StepControl.fixed(0.5))
    assert run(mechanics(lambda t: 1e-17 * t), 1.0, StepControl.fixed(1.0)).outcome.converged


@pytest.mark.mpi
def test_reactions_of_supports_sum_up_to_nothing():
    """A block pressed on its left face between plates that do not slide, whose corners the face shares."""
    state = square()
    faces = {"left": (0, 0), "bottom": (1, 0), "top": (1, 1), "right": (0, 1)}
    values = {"left": 0.0, "bottom": 0.0, "top": 0.0, "right": lambda t: -0.05 * t}
    supports = [
        Support(state, where(state, 1, side(*faces[name])), 0, values[name], name=name) for name in ("left", "right")
    ]
    held = [Support(state, where(state, 1, side(*faces[name])), 1, name=name) for name in ("bottom", "top")]
    again = Support(state, where(state, 1, side(0, 0)), 0, name="again")
    row = run(Mechanics(state, [Solid(state, GEL)], [*supports, *held, again]), 1.0, StepControl.fixed(1.0)).columns
    assert row["again_force"][0] == 0.0
    assert row["left_force"][0] == pytest.approx(-row["right_force"][0], rel=1e-6) and row["left_force"][0] > 0.01


@pytest.mark.mpi
@pytest.mark.parametrize("split", [False, True])
def test_pieces(split):
    """Two squares side by side that share no node, one of them cracked through."""
    n = 4
    i, j = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    first = (i * (n + 1) + j).ravel()
    cells = np.stack([first, first + 1, first + n + 1, first + n + 2], axis=1)
    ticks = np.linspace(0, 1, n + 1)
    grid = np.stack(np.meshgrid(ticks, ticks, indexing="ij"), axis=-1).reshape(-1, 2)
    cells, x = np.vstack([cells, cells + len(grid)]), np.vstack([grid, grid + np.array([2.0, 0.0])])
    here = slice(None) if COMM.rank == 0 else slice(0)
    element = basix.ufl.element("Lagrange", "quadrilateral", 1, shape=(2,))
    domain = create_mesh(COMM, cells[here].astype(np.int64), x[here], element)
    space = fem.functionspace(domain, ("Lagrange", 1, (2,)))
    if split:
        middle = mesh.locate_entities(domain, 1, lambda x: np.isclose(x[1], 0.5) & (x[0] < 1.5))
        space = cracked_space(domain, ("Lagrange", 1, (2,)), middle)
    count, piece = connected_pieces(space)
    assert count == 2 + split
    right = space.tabulate_dof_coordinates()[:, 0] > 1.5
    for inside in (right, ~right):
        found = set().union(*COMM.allgather(set(piece[inside].tolist())))
        assert len(found) == (1 if inside is right else 1 + split)
