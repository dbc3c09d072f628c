"""Elements that are folded, and bodies whose surface passes through itself, make a run questionable."""

import numpy as np
import pytest
from dolfinx import fem, mesh
from mpi4py import MPI

from cutsim.analysis.doubts import doubt_distortions
from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.stepping import StepControl, run
from cutsim.base.compat import cell_partitioner
from cutsim.bodies.loads import Support
from cutsim.bodies.solid import Solid
from cutsim.fields.space import cracked_space
from cutsim.fields.state import State
from cutsim.materials.elastic import NeoHookean
from cutsim.pairs.self_intersection import SelfIntersection
from helpers.laws import NU, E


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize(("moved", "stretch"), [(0.45, 0.0), (0.52, 0.0), (0.52, 50.0)])
def test_elements_that_are_turned_over_at_a_corner(degree, moved, stretch):
    """The corner (0, 1) of the first of three moves in by s along the diagonal, and J = 1 − s (1 − x + y).

    The last one may be stretched until it holds nearly all of the energy.
    """
    domain = mesh.create_rectangle(MPI.COMM_SELF, [(0, 0), (3, 1)], (3, 1), mesh.CellType.quadrilateral)
    state = State(fem.functionspace(domain, ("Lagrange", degree, (2,))))
    solid = Solid(state, NeoHookean(E, NU))

    def motion(x):
        corner = moved * np.maximum(1 - x[0], 0) * x[1]
        return np.stack([corner + stretch * np.maximum(x[0] - 2, 0), -corner])

    state.u.interpolate(motion)
    assert solid.smallest_jacobian() > 0
    found = solid.distortions()
    assert ("body: folded" in found) == (moved > 0.5)
    work = solid.energies()["strain"]
    doubt_distortions(state.verdict, found, work)
    words = f"turned over at a corner, as at (0, 1) with J = {1 - 2 * moved:.2g}, hold 100.0% of the work that is done"
    assert words in str(state.verdict) if moved > 0.5 and not stretch else state.verdict.trusted
    doubt_distortions(state.verdict, found, 60 * work)
    assert state.verdict.trusted, "in the end it was a small part"
    doubt_distortions(state.verdict, found, 0.0)
    assert state.verdict.trusted != bool(found), "before any work is done it is all"


def clamp(kind, n=8):
    """A square or cube that is slit from x = 1/4 on half way up, and its cells above the slit."""
    flat = kind in (mesh.CellType.triangle, mesh.CellType.quadrilateral)
    create, up = (mesh.create_unit_square, 1) if flat else (mesh.create_unit_cube, 2)
    domain = create(MPI.COMM_WORLD, *(n,) * (up + 1), kind, partitioner=cell_partitioner())
    slit = mesh.locate_entities(domain, up, lambda x: np.isclose(x[up], 0.5) & (x[0] > 0.25 - 1e-9))
    state = State(cracked_space(domain, ("Lagrange", 1, (up + 1,)), slit))
    return state, mesh.locate_entities(domain, up + 1, lambda x: x[up] > 0.5 - 1e-9)


@pytest.mark.mpi
@pytest.mark.parametrize("kind", ["triangle", "quadrilateral", "tetrahedron", "hexahedron"])
@pytest.mark.parametrize("layers", [-1.0, 0.0, 0.4, 0.8, 1.6])
def test_jaws_that_close_beyond_each_other(kind, layers):
    """The upper jaw is sheared down; no node is deeper in the lower one than the end of that is near."""
    n = 8
    state, above = clamp(mesh.CellType[kind], n)
    gdim = state.mesh.geometry.dim

    def down(x):
        return layers / n * np.maximum(x - 0.25, 0) / 0.625

    state.u.interpolate(lambda x: np.stack([*([0 * x[0]] * (gdim - 1)), -down(x[0])]), above)
    state.u.x.scatter_forward()
    found = SelfIntersection(state).found()
    x = np.arange(n + 1) / n
    depth = n * np.minimum(down(x), 1 - x)
    assert (found is not None) == (layers > 0.5)
    if found is not None:
        words = f"passes through itself by {depth.max():.2g} of an element at ({x[depth.argmax()]:.4g}, "
        assert words in found.words
        # those that a deep node has entered, and those to which such a node belongs
        per_cell = {"quadrilateral": 1, "triangle": 2, "hexahedron": 1, "tetrahedron": 6}[kind] * n ** (gdim - 2)
        taken = state.mesh.comm.allreduce(int(found.cells.sum()))
        assert 0 < taken <= per_cell * 2 * 3 * n


@pytest.mark.mpi
def test_a_run_in_which_nothing_keeps_the_jaws_apart():
    state, _ = clamp(mesh.CellType.quadrilateral)
    corner = mesh.locate_entities_boundary(state.mesh, 1, lambda x: np.isclose(x[1], 1) & (x[0] > 0.8))
    bottom = mesh.locate_entities_boundary(state.mesh, 1, lambda x: np.isclose(x[1], 0))
    supports = [*(Support(state, bottom, i) for i in range(2)), Support(state, corner, 1, lambda t: -0.2 * t)]
    mechanics = Mechanics(state, [Solid(state, NeoHookean(E, NU))], supports)
    run(mechanics, 0.2, StepControl.fixed(0.2))
    assert "surface" not in state.verdict.doubts
    run(mechanics, 1.0, StepControl.fixed(0.2))
    assert "which may change" in state.verdict.doubts["surface"]


@pytest.mark.mpi
def test_what_is_at_stake_with_elements_that_are_in_each_others_way():
    """What they hold, and ½ E ε² by their volume: the lower half of a square, and the upper one."""
    state, above = clamp(mesh.CellType.quadrilateral)
    solid = Solid(state, NeoHookean(E, 0.0))
    owned = state.mesh.topology.index_map(2).size_local
    below = np.ones(owned, dtype=bool)
    below[above[above < owned]] = False
    assert solid.at_stake(below, 0.6) == pytest.approx(0.5 * E * 0.6**2 * 0.5)
    state.u.interpolate(lambda x: np.stack([0.3 * x[0], 0 * x[0]]))
    held = 0.5 * solid.energies()["strain"]
    assert held > 0
    assert solid.at_stake(below, 0.0) == pytest.approx(held)
    assert solid.at_stake(~below, 0.6) == pytest.approx(held + 0.5 * E * 0.6**2 * 0.5)
