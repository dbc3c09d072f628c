"""Newton's order, augmented contact, and the same history on any number of ranks."""

import gc
import weakref
from pathlib import Path

import numpy as np
import pytest
import ufl
from dolfinx import mesh
from mpi4py import MPI

from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.stepping import StepControl, begin, run
from cutsim.base.assembly import integrate
from cutsim.base.compat import form
from cutsim.bodies.loads import Support, Traction
from cutsim.fields.points import Surface
from cutsim.fields.space import cracked_space
from cutsim.fields.temperature import Temperature
from cutsim.heat.conduction import HeatBody
from cutsim.heat.transfer import HeatTransfer
from cutsim.interface.cohesive import Exponential
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.crack import Crack
from cutsim.interface.friction import SmoothCoulomb
from cutsim.materials.elastic import NeoHookean
from cutsim.results.recording import Recording
from cutsim.solvers.convergence import Tolerances
from cutsim.tools.shapes import Ball, ToolPath
from cutsim.tools.tool_contact import ToolContact
from helpers.blocks import make_blocks
from helpers.laws import NU, E
from helpers.runs import history
from validation.bonds import TABLE, two_boxes

WEAK = Exponential(toughness=0.1, opening=0.1, shear_toughness=0.08, shear_opening=0.15)


def pried_and_pressed(comm=MPI.COMM_WORLD, n=6, gdim=2, **options):
    """A glued block, pulled at one edge until the crack softens, while a ball is pressed into its top."""
    b = make_blocks(gdim, n, comm)
    up = gdim - 1
    start = np.append(np.full(gdim - 1, 0.25), 1.32)
    path = ToolPath.polyline([0, 1], [start, start - 0.15 * np.eye(gdim)[up] + 0.05 * np.eye(gdim)[0]])
    surface = Surface.exterior(b.state, b.face(up, 1.0))
    contact, friction = PenaltyContact(40.0, 0.02), SmoothCoulomb(0.2, 5e-3)
    ball = ToolContact(b.state, Ball(0.3), path, [surface], contact=contact, friction=friction, name="ball")
    supports = [Support(b.state, b.face(up, 0.0), i) for i in range(gdim)]
    edge = mesh.locate_entities_boundary(b.state.mesh, gdim - 1, lambda x: np.isclose(x[0], 1) & (x[up] > 0.5 - 1e-9))
    supports.append(Support(b.state, edge, up, lambda t: 0.5 * t, name="pull"))
    terms = [b.solid(NeoHookean(E, NU)), b.crack(WEAK, contact=PenaltyContact(30.0)), ball]
    return Mechanics(b.state, terms, supports, **options)


@pytest.mark.mpi
def test_a_problem_that_is_dropped_is_freed():
    """Else a loop over runs keeps every mesh and matrix, until MPI has no communicator left."""
    mechanics = pried_and_pressed()
    run(mechanics, 0.1, StepControl.fixed(0.1))
    kept = [weakref.ref(thing) for thing in (mechanics, mechanics.problem, mechanics.state, mechanics.terms[1])]
    del mechanics
    gc.collect()
    assert [reference() for reference in kept] == 4 * [None]


@pytest.mark.mpi
def test_all_problems_share_one_communicator_of_petsc():
    """On several ranks PETSc frees what Python drops by communicator: what lies on that of a mesh stays with it."""
    solvers = [pried_and_pressed().problem.snes for _ in range(2)]
    things = [thing for snes in solvers for thing in (snes, snes.getFunction()[0], *snes.getJacobian()[:2])]
    kinds = {MPI.Comm.Compare(things[0].comm.tompi4py(), thing.comm.tompi4py()) for thing in things}
    assert kinds == {MPI.IDENT}


DIRECT = {"ksp_type": "preonly", "pc_type": "lu"}


def test_newton_converges_quadratically():
    """In every step, with large strain, softening, contact and regularised friction."""
    mechanics = pried_and_pressed(petsc_options=DIRECT, tolerances=Tolerances(rtol=1e-14))
    for time in np.linspace(0.1, 1.0, 10):
        begin(mechanics, time)
        outcome = mechanics.solve("basic")
        assert outcome.converged
        mechanics.evaluate()
        mechanics.state.commit()
        r = np.array(outcome.residuals)
        r = r[r > 2e-14]  # the rest is rounding
        assert np.log(r[-1] / r[-2]) / np.log(r[-2] / r[-3]) > 1.8, f"t = {time:.1f}: {outcome.residuals}"
    assert mechanics.record()["crack_broken"][0] > 0.1


# -- the thesis' two boxes --------------------------------------------------------------------------------------------

# energies of a typical step over the first, as the thesis prints them (table 4.7)
ENERGIES = np.array([1.417000e-7, 4.278462e-9, 3.689671e-13, 4.218806e-17]) / 7.086406e-7


@pytest.mark.parametrize("steps", [10, 100])
def test_two_boxes_of_the_thesis(steps):
    """Forces and the free corner of its own program, whose law adds up to four times the strength given.

    Residuals and energies fall at least as fast as it prints.
    """
    name = Path(__file__).parent / "data" / f"two_boxes_{steps}_steps.csv"
    printed = np.genfromtxt(name, delimiter=",", names=True)
    mechanics, found = two_boxes(), []
    places = mechanics.state.V.tabulate_dof_coordinates()
    (corner,) = set(np.flatnonzero(np.linalg.norm(places, axis=1) < 0.1)) - set(mechanics.supports[-1].nodes)
    for time in printed["time"]:
        begin(mechanics, time)
        outcome = mechanics.solve("basic")
        mechanics.evaluate()
        mechanics.state.commit()
        r = np.array(outcome.residuals)
        assert len(r) <= len(TABLE)
        assert np.all(r[2:] / r.max() <= TABLE[2 : len(r)]), outcome.residuals
        energies = np.array([row.current.energy / row.initial.energy for row in outcome.history])
        assert np.all(energies[1:] <= ENERGIES[1 : len(energies)]), energies
        found.append((mechanics.record()["top_z_force"][0], mechanics.state.u.x.array[3 * corner + 2]))
    force, lifted = np.array(found).T
    np.testing.assert_allclose(force, printed["force"], rtol=1e-5)
    # that program takes the tractions at the nodes, which matters to the corner alone: they differ by 1 % there
    np.testing.assert_allclose(lifted, printed["corner"], rtol=5e-3)


# -- augmented contact ------------------------------------------------------------------------------------------------


def pressed(penetration, stiffness=20.0):
    """Two soft blocks without any bond, pressed together by 10 % and pulled apart again."""
    b = make_blocks()
    times, values = [0, 1, 2, 3], [0.0, -0.1, 0.0, 0.1]
    supports = [Support(b.state, b.face(1, 0.0), 1)]
    supports.append(Support(b.state, b.face(0, 0.0), 0))
    supports.append(Support(b.state, b.face(1, 1.0), 1, lambda t: np.interp(t, times, values)))
    crack = b.crack(None, contact=PenaltyContact(stiffness), allowed_penetration=penetration)
    return Mechanics(b.state, [b.solid(NeoHookean(E, NU)), crack], supports), crack


def test_augmentation_keeps_penetration_below_what_is_allowed():
    allowed = 1e-5
    mechanics, crack = pressed(allowed)
    run(mechanics, 1.0, StepControl.fixed(0.25))
    assert np.abs(crack.point_values("opening")).max() <= 1.01 * allowed
    augmented = crack.point_values("pressure").mean()
    # the pressure is that of blocks that do not penetrate: a stiff penalty comes near it, the soft one does not
    stiff, soft = (pressed(None, k) for k in (2e4, 20.0))
    pressures = []
    for problem, other in (stiff, soft):
        run(problem, 1.0, StepControl.fixed(0.25))
        pressures.append(other.point_values("pressure").mean())
    assert augmented == pytest.approx(pressures[0], rel=1e-3)
    assert pressures[1] < 0.95 * augmented


def test_multipliers_let_go_when_the_crack_opens_again():
    """Nothing of the pressure is left on a gap: relieved, the contact closes exactly; pulled, it is free."""
    mechanics, crack = pressed(1e-5)
    run(mechanics, 1.5, StepControl.fixed(0.25))
    assert np.abs(crack.point_values("opening")).max() <= 1.01e-5
    run(mechanics, 3.0, StepControl.fixed(0.25))
    assert crack.point_values("opening").min() > 0.09
    assert not crack.point_values("pressure").any()


def test_contact_that_does_not_settle_is_refused():
    mechanics, _ = pressed(1e-14, 1e-2)
    begin(mechanics, 0.5)
    outcome = mechanics.solve()
    assert not outcome.converged
    assert "augmentations" in outcome.message
    assert len(outcome.history) == outcome.iterations > 30, "those of all augmentations"


# -- ranks ------------------------------------------------------------------------------------------------------------


@pytest.mark.mpi
@pytest.mark.parametrize("gdim", [2, 3])
def test_history_does_not_depend_on_the_number_of_ranks(gdim):
    """With a fixed schedule of steps; every column, relative to its largest value."""
    n, step = (6, 0.1) if gdim == 2 else (4, 0.25)
    together = history(
        pried_and_pressed(n=n, gdim=gdim, tolerances=Tolerances(rtol=1e-11)), 1.0, StepControl.fixed(step)
    )
    alone = history(
        pried_and_pressed(MPI.COMM_SELF, n, gdim, tolerances=Tolerances(rtol=1e-11)), 1.0, StepControl.fixed(step)
    )
    assert together["crack_broken"][-1] > 0.05
    for name, values in alone.items():
        # the closure is a small difference of energies: relative to them
        scale = 1.0 if name == "energy_closure" else max(np.abs(values).max(), 1e-6)
        np.testing.assert_allclose(together[name], values, atol=1e-7 * scale, err_msg=name)


@pytest.mark.mpi
def test_crack_has_one_plus_side():
    """∫ n⁺·e dΓ is the whole area, with the sign of the side named '+', by region or by direction."""
    b = make_blocks(3, 4)
    N = ufl.FacetNormal(b.state.mesh)
    for plus, sign in ((b.lower, 1), (b.upper, -1), ((0.0, 0.0, 1.0), 1), ((0.0, 0.1, -1.0), -1)):
        crack = Crack(b.state, b.facets, plus, young=E)
        assert integrate(form(N("+")[2] * crack.points.measure)) == pytest.approx(sign)


@pytest.mark.mpi
def test_recording_is_the_same_on_all_ranks(tmp_path):
    comm = MPI.COMM_WORLD
    folder = comm.bcast(tmp_path)
    mechanics = pried_and_pressed()
    written = []
    with Recording(folder, mechanics, 0.3, every=2) as record:
        write = record.write_fields
        record.write_fields = lambda time: (written.append(time), write(time))
        run(mechanics, 0.3, StepControl.fixed(0.1), record)
    np.testing.assert_allclose(written, [0.2, 0.3], err_msg="every other step, and the last")
    assert all(h == record.history for h in comm.allgather(record.history))
    np.testing.assert_allclose(record.column("time"), [0.1, 0.2, 0.3])
    comm.barrier()
    assert (folder / "history.csv").exists()
    with pytest.raises(ValueError, match=r"column = 'nonsense' is not allowed"):
        record.column("nonsense")


# -- supports and loads -----------------------------------------------------------------------------------------------


def test_reactions_balance_a_dead_load():
    b = make_blocks(3)
    supports = [Support(b.state, b.face(2, 0.0), i, name=f"base_{'xyz'[i]}") for i in range(3)]
    load = Traction(b.state, b.face(2, 1.0), (1e-3, 2e-3, -3e-3), lambda t: 2 * t)
    mechanics = Mechanics(b.state, [b.solid(), b.crack(WEAK), load], supports, tolerances=Tolerances(rtol=1e-10))
    rows = history(mechanics, 1.0, StepControl.fixed(0.5))
    for axis, traction in zip("xyz", (1e-3, 2e-3, -3e-3), strict=True):
        assert rows[f"load_force_{axis}"][-1] == pytest.approx(2 * traction)
        assert rows[f"base_{axis}_force"][-1] == pytest.approx(-2 * traction, rel=1e-6)
    np.testing.assert_allclose(rows["energy_closure"], 0, atol=1e-3)


def test_another_direction_of_a_traction_needs_no_other_kernel():
    def signature(direction):
        b = make_blocks()
        load = Traction(b.state, b.face(1, 1.0), direction, lambda t: t)
        return load.residual(ufl.TestFunction(b.state.V)).signature()

    assert signature((0.0, 1.0)) == signature((3.0, -0.7))


@pytest.mark.parametrize(
    ("make", "name"),
    [
        (lambda b: Support(b.state, b.face(1, 0.0), 2), "component"),
        (lambda b: Support(b.state, b.face(1, 7.0), 0), "entities"),
        (lambda b: Traction(b.state, b.face(1, 1.0), (1.0,), lambda t: t), "direction"),
        (lambda b: Traction(b.state, b.face(1, 7.0), (1.0, 0.0), lambda t: t), "facets"),
        (lambda b: b.crack(young=0.0), "young"),
        (lambda b: b.crack(normal="mean"), "normal"),
        (lambda b: b.crack(allowed_penetration=0.0), "penetration"),
        (lambda b: b.crack().point_values("nonsense"), "name"),
    ],
)
def test_refuses_bad_parameters(make, name):
    with pytest.raises(ValueError, match=f"{name} = .* is not allowed"):
        make(make_blocks())


@pytest.mark.mpi
def test_the_audit_of_a_loaded_state_begins_with_its_energy():
    """A block is pulled until its bond softens, and drawn on by other supports: another problem on the same state."""
    b = make_blocks(n=4)
    terms = [b.solid(NeoHookean(E, NU)), b.crack(WEAK)]
    base = [Support(b.state, b.face(1, 0.0), i) for i in range(2)]
    first = Mechanics(b.state, terms, [*base, Support(b.state, b.face(1, 1.0), 1, lambda t: 0.3 * t)])
    run(first, 1.0, StepControl.fixed(0.05))
    sides = [
        Support(b.state, b.face(1, 1.0), i, path) for i, path in ((0, lambda t: 0.1 * (t - 1)), (1, lambda t: 0.3 * t))
    ]
    second = Mechanics(b.state, terms, [*base, *sides])
    rows = []
    run(second, 1.2, StepControl.fixed(0.02), lambda report: rows.append(report.columns))
    held = first.audit.entries["strain"] + first.audit.entries["cohesive_stored"] + first.audit.entries["fracture"]
    assert rows[0]["energy_initial"][0] == pytest.approx(held, rel=1e-9) and held > 0.01
    assert max(abs(row["energy_closure"][0]) for row in rows) < 5e-3


@pytest.mark.mpi
def test_bodies_that_share_cells_are_refused():
    """Their stiffness would count twice."""
    b = make_blocks(n=4)
    lower = b.solid(cells=b.lower, name="lower")
    Mechanics(b.state, [lower, b.solid(cells=b.upper, name="upper")])
    with pytest.raises(ValueError, match="bodies 'lower' and 'whole' share 8 cells: each cell belongs to one body"):
        Mechanics(b.state, [lower, b.solid(name="whole")])
    space = cracked_space(b.state.mesh, ("Lagrange", 1), b.facets)
    T = Temperature(b.state, space, 293.0)
    one = {"density": 1.0, "capacity": 1.0, "conductivity": 1.0}
    with pytest.raises(ValueError, match="bodies 'all' and 'lower' share 8 cells"):
        HeatTransfer(T, [HeatBody(T, **one, name="all"), HeatBody(T, **one, body=b.lower, name="lower")])
