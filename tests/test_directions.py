"""Displacements prescribed along directions that are no components: a turned body behaves as the upright one."""

import numpy as np
import pytest
from dolfinx import fem, mesh
from mpi4py import MPI

from cutsim import Mechanics, NeoHookean, Solid, State, StepControl, Support
from cutsim.base.compat import cell_partitioner
from helpers.fields import rotation
from helpers.laws import ELASTIC
from helpers.runs import history

# sides of the unit square or cube that slide along walls, and the one that is moved
WALLS = {2: (0, 1), 3: (0, 1, 2)}


def body(gdim, angle, comm=MPI.COMM_WORLD, degree=1, n=2):
    """A unit square or cube, turned."""
    create, cell = {
        2: (mesh.create_unit_square, mesh.CellType.quadrilateral),
        3: (mesh.create_unit_cube, mesh.CellType.hexahedron),
    }[gdim]
    domain = create(comm, *(n,) * gdim, cell, partitioner=cell_partitioner())
    sides = [
        [mesh.locate_entities_boundary(domain, gdim - 1, lambda x, i=i, at=at: np.isclose(x[i], at)) for at in (0, 1)]
        for i in range(gdim)
    ]
    R = rotation(gdim, angle) if angle else np.eye(gdim)
    domain.geometry.x[:, :gdim] = domain.geometry.x[:, :gdim] @ R.T
    return State(fem.functionspace(domain, ("Lagrange", degree, (gdim,)))), sides, R


def pulled(gdim, angle, comm=MPI.COMM_WORLD, *, steps=4, volumetric="full", poisson=0.3, **options):
    """A block between walls, drawn along one of them: history, and displacements in the axes of the block."""
    state, sides, R = body(gdim, angle, comm, degree=2 if volumetric == "taylor-hood" else 1)
    supports = [Support(state, sides[i][0], tuple(R[:, i]), name=f"wall_{i}") for i in WALLS[gdim]]
    supports.append(Support(state, sides[1][1], tuple(R[:, 1]), name="far"))
    supports.append(Support(state, sides[0][1], tuple(-R[:, 0]), lambda t: -0.3 * np.sin(t), name="grip"))
    solid = Solid(state, NeoHookean(2.0, poisson), density=0.5, viscosity=0.1, volumetric=volumetric)
    mechanics = Mechanics(state, [solid], supports, **options)
    mechanics.check()
    rows = history(mechanics, 1.0, StepControl.fixed(1.0 / steps))
    nodes = state.V.dofmap.index_map.size_local
    return rows, state.u.x.array[: nodes * gdim].reshape(-1, gdim) @ R


@pytest.mark.mpi
@pytest.mark.parametrize("gdim", [2, 3])
@pytest.mark.parametrize("angle", [np.pi / 6, np.pi / 4, 2.0])
def test_a_turned_body_behaves_as_the_upright_one(gdim, angle):
    """Reactions, audit and displacements; with two and three directions at right angles at edges and corners."""
    (upright, u), (turned, v) = pulled(gdim, 0.0), pulled(gdim, angle)
    for name in (
        "wall_1_force",
        "far_force",
        "grip_force",
        "grip_displacement",
        "energy_strain",
        "energy_viscous",
        "work_external",
    ):
        scale = np.abs(upright[name]).max()
        np.testing.assert_allclose(turned[name], upright[name], rtol=1e-9, atol=1e-9 * scale, err_msg=name)
    np.testing.assert_allclose(v, u, atol=1e-9)
    assert np.abs(upright["energy_closure"]).max() < 0.05 and upright["grip_force"][-1] != 0


@pytest.mark.parametrize(
    "options",
    [{"volumetric": "mixed"}, {"volumetric": "taylor-hood", "poisson": 0.499}, {"analysis": "dynamic"}],
    ids=lambda options: next(iter(options.values())),
)
def test_so_it_does_in_every_formulation_and_in_motion(options):
    """Terms that assemble themselves, multipliers, and a mass matrix with a start at prescribed velocity."""
    (upright, u), (turned, v) = pulled(2, 0.0, **options), pulled(2, np.pi / 6, **options)
    for name in ("grip_force", "energy_strain", "energy_kinetic", "work_external"):
        scale = max(np.abs(upright[name]).max(), 1e-6)
        np.testing.assert_allclose(turned[name], upright[name], atol=1e-9 * scale, err_msg=name)
    np.testing.assert_allclose(v, u, atol=1e-9)
    if options.get("analysis") == "dynamic":
        assert upright["energy_kinetic"].min() > 5e-4, "it moves from the start"


@pytest.mark.mpi
def test_every_number_of_ranks_gives_the_same():
    (together, _), (alone, _) = pulled(3, 0.5), pulled(3, 0.5, MPI.COMM_SELF)
    for name in ("grip_force", "wall_2_force", "work_external"):
        np.testing.assert_allclose(together[name], alone[name], rtol=1e-8, atol=1e-10)


def test_the_reaction_of_an_inclined_wall():
    """A block pressed straight down on a smooth slope of 30°, guided by a wall: N cos 30° carries the force."""
    state, sides, _ = body(2, 0.0)
    slope, domain = (np.sin(np.pi / 6), np.cos(np.pi / 6)), state.mesh
    guided = mesh.locate_entities_boundary(domain, 1, lambda x: np.isclose(x[0], 0.0) & (x[1] > 0.4))
    supports = [
        Support(state, sides[1][0], slope, name="slope"),
        Support(state, guided, 0, name="wall"),
        Support(state, sides[1][1], (0.0, -1.0), lambda t: 0.01 * t, name="press"),
    ]
    rows = history(Mechanics(state, [Solid(state, ELASTIC)], supports), 1.0, StepControl.fixed(0.5))
    normal, press = rows["slope_force"][-1], rows["press_force"][-1]
    assert press > 0 and rows["press_displacement"][-1] == pytest.approx(0.01)
    # forces balance along y, the press counting downwards
    assert normal * slope[1] == pytest.approx(press, rel=1e-8)


@pytest.mark.mpi
def test_directions_that_are_neither_parallel_nor_at_right_angles_are_refused():
    state, sides, _ = body(2, 0.0)
    crossed = [Support(state, sides[0][0], (1.0, 0.0), name="a"), Support(state, sides[1][0], (1.0, 1.0), name="b")]
    with pytest.raises(ValueError, match=r"supports 'a' along \(1, 0\) and 'b' along \(0\.7071, 0\.7071\)"):
        Mechanics(state, [Solid(state, ELASTIC)], crossed)
    opposite = [Support(state, sides[0][0], (s, 2 * s), 0.1, name=f"to {s}") for s in (1.0, -1.0)]
    with pytest.raises(ValueError, match=r"prescribe u along \(0\.4472, 0\.8944\) = 0\.1 and -0\.1"):
        Mechanics(state, [Solid(state, ELASTIC)], opposite)
    with pytest.raises(ValueError, match=r"component = \(0\.0, 0\.0\) is not allowed"):
        Support(state, sides[0][0], (0.0, 0.0))


def test_a_body_that_a_slope_does_not_hold_is_named():
    state, sides, _ = body(2, 0.0)
    mechanics = Mechanics(state, [Solid(state, ELASTIC)], [Support(state, sides[1][0], (1.0, 2.0))])
    with pytest.raises(ValueError, match=r"can slide along \((0\.8944, -0\.4472|-0\.8944, 0\.4472)\)"):
        mechanics.check()
