"""Points that close or open within a step: friction acts from closure on, and no longer (docs/theory.md §3.3)."""

import numpy as np
import pytest
from mpi4py import MPI

from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.stepping import StepControl, begin
from cutsim.bodies.loads import Support
from cutsim.bodies.solid import Solid
from cutsim.fields.points import Surface
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.crack_friction import CrackFriction
from cutsim.interface.friction import Coulomb
from cutsim.materials.elastic import LinearElastic
from cutsim.tools.shapes import Plane, ToolPath
from cutsim.tools.tool_contact import ToolContact
from cutsim.tools.triangulated_tool import TriangulatedTool
from cutsim.tools.triangulation import Triangulation
from helpers.blocks import make_blocks
from helpers.boxes import two
from helpers.fields import jump_part, smooth, wavy
from helpers.laws import E
from helpers.runs import history
from helpers.tangents import Assembled, assert_slope_two, slopes

MU, NORMAL, TANGENTIAL = 0.3, 50.0, 40.0
CONTACT, LAW = PenaltyContact(NORMAL), Coulomb(MU, TANGENTIAL)
# how far apart the surfaces are at t = 1, and how deep they penetrate at t = 2
APART, DEPTH = 0.05, 0.02
# slide by approach: with less than μ ε_N/ε_T = 0.375 a point sticks at once and for good
STEEP, FLAT = 0.2, 1.0


def oblique(slope, up):
    """Motion of the upper face or the tool: away until t = 1, down along a straight line until t = 2, as a function."""
    places = {0: (0.0, 0.0, slope * (APART + DEPTH)), up: (0.0, APART, -DEPTH)}
    return lambda t, i: float(np.interp(t, [0, 1, 2], places.get(i, (0.0, 0.0, 0.0))))


def crack(slope, gdim):
    """Faces of a crack between rigid blocks."""
    b = make_blocks(gdim)
    faces = b.crack(None, contact=CONTACT)
    motion = oblique(slope, gdim - 1)
    path = [lambda t, i=i: motion(t, i) for i in range(gdim)]
    supports = b.drive(b.lower, [0.0] * gdim) + b.drive(b.upper, path, "body")
    return Mechanics(b.state, [faces, CrackFriction(faces, LAW)], supports)


def pair(slope, gdim):
    """Rigid blocks whose meshes do not match."""
    b = two(gdim, overhang=0.5)
    term = b.pair(contact=CONTACT, friction=LAW, search=0.2)
    motion = oblique(slope, gdim - 1)
    rigid = [Support(b.state, b.cells(0), i, 0.0, dim=gdim) for i in range(gdim)]
    rigid += [
        Support(b.state, b.cells(1), i, lambda t, i=i: motion(t, i), dim=gdim, name=f"body_{'xyz'[i]}")
        for i in range(gdim)
    ]
    return Mechanics(b.state, [Solid(b.state, LinearElastic(E, 0.0)), term], rigid)


def tool(slope, gdim, plate=None):
    """A plate that comes down on a rigid block: a plane, or a surface of segments."""
    b = make_blocks(gdim)
    motion, origin = oblique(slope, gdim - 1), np.array([*[0.5] * (gdim - 1), 1.0])
    path = ToolPath.polyline([0, 1, 2], [origin + [motion(t, i) for i in range(gdim)] for t in (0, 1, 2)])
    top, options = b.face(gdim - 1, 1.0), {"contact": CONTACT, "friction": LAW}
    if plate is None:
        term = ToolContact(b.state, Plane(-np.eye(gdim)[-1]), path, [Surface.exterior(b.state, top)], **options)
    else:
        term = TriangulatedTool(b.state, top, plate, path, **options)
    return Mechanics(b.state, [b.solid(), term], b.drive(np.union1d(b.lower, b.upper), [0.0] * gdim))


PLATE = Triangulation(np.array([(-2.0, 0.0), (2.0, 0.0), (0.0, 1.0)]), np.array([(0, 1), (1, 2), (2, 0)]))
KINDS = {
    "crack": lambda slope: crack(slope, 2),
    "crack in 3-D": lambda slope: crack(slope, 3),
    "pair": lambda slope: pair(slope, 2),
    "pair in 3-D": lambda slope: pair(slope, 3),
    "tool": lambda slope: tool(slope, 2),
    "tool in 3-D": lambda slope: tool(slope, 3),
    "tool of segments": lambda slope: tool(slope, 2, PLATE),
}
# one of each kinematics also on several ranks
ALL = [pytest.param(k, marks=[pytest.mark.mpi] if k in ("crack", "pair", "tool of segments") else []) for k in KINDS]


def descend(kind, slope, steps):
    """History of the way down."""
    mechanics = KINDS[kind](slope)
    history(mechanics, 1.0, StepControl.fixed(1.0))
    return history(mechanics, 2.0, StepControl.fixed(1 / steps))


# -- a point that comes down obliquely --------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_steep_approach_sticks(kind):
    """Traction ε_T times the slide since closure, whatever the steps; nothing is dissipated."""
    for steps in (1, 3, 8):
        rows = descend(kind, STEEP, steps)
        assert abs(rows["tool_force_x" if "tool" in kind else "body_x_force"][-1]) == pytest.approx(
            TANGENTIAL * STEEP * DEPTH, rel=1e-9
        )
        assert not rows["energy_friction"].any()


@pytest.mark.parametrize("kind", ALL)
def test_flat_approach_slips(kind):
    """Traction μ p at once; the dissipation is ∫ t ds, except that a step's mean force acts on its whole way."""
    traction = MU * NORMAL * DEPTH
    exact = 0.5 * traction * (FLAT * DEPTH - traction / TANGENTIAL)
    for steps in (1, 4, 16):
        rows = descend(kind, FLAT, steps)
        force = rows["tool_force_x" if "tool" in kind else "body_x_force"][-1]
        assert abs(force) == pytest.approx(traction, rel=1e-9)
        way = (APART + DEPTH) / steps
        excess = rows["energy_friction"][-1] - exact
        assert -1e-12 < excess <= MU * NORMAL * FLAT * way**2 / 8
        assert (np.diff(rows["energy_friction"]) >= 0).all()


def test_viscous_faces_do_not_rub_when_they_part():
    b = make_blocks(2)
    faces = b.crack(None, contact=CONTACT)
    friction = CrackFriction(faces, Coulomb(MU, 1e4, viscosity=0.7))
    path = [lambda t: 0.1 * t, lambda t: float(np.interp(t, [0, 1, 2], [-DEPTH, -DEPTH, APART]))]
    supports = b.drive(b.lower, [0.0, 0.0]) + b.drive(b.upper, path, "body")
    rows = history(Mechanics(b.state, [faces, friction], supports), 3.0, StepControl.fixed(0.25))
    parted = rows["crack_opening"] > 0
    assert parted.any() and not rows["body_x_force"][parted].any()
    assert rows["body_x_force"][rows["time"] == 1.0] == pytest.approx(MU * NORMAL * DEPTH + 0.7 * 0.1, rel=1e-6)


# -- tangent ----------------------------------------------------------------------------------------------------------

STATES = {"stick": Coulomb(50.0, 7.0), "slip": Coulomb(0.4, 1e3)}


@pytest.mark.parametrize("friction", STATES.values(), ids=STATES)
@pytest.mark.parametrize("gdim", [2, 3])
def test_tangent_of_a_closing_crack(gdim, friction):
    b = make_blocks(gdim)
    faces = b.crack(None, contact=CONTACT)
    term = CrackFriction(faces, friction)
    shift = np.zeros((3, 1))
    shift[gdim - 1] = APART
    b.move(lambda x: 0 * x, lambda x: shift + 0 * x)
    term.evaluate()
    b.state.commit()
    shift[0], shift[gdim - 1] = 0.05, -DEPTH
    b.move(lambda x: 0 * x, lambda x: shift + 0 * x)
    u = b.state.u.x.array + smooth(b.state.V, 4, 0.02) + jump_part(b.state, 5, 1e-3)
    assert_slope_two(term, b.state, u, 0.02)


@pytest.mark.parametrize("friction", STATES.values(), ids=STATES)
@pytest.mark.parametrize("gdim", [2, 3])
def test_tangent_of_a_closing_pair(gdim, friction):
    b = two(gdim, overhang=0.5, comm=MPI.COMM_SELF)
    term = b.pair(friction=friction, contact=CONTACT, search=0.5)
    shift = np.zeros((3, 1))
    shift[gdim - 1] = APART
    b.move(lambda x: shift + 0 * x, 1)
    term.begin()
    term.evaluate()
    b.state.commit()
    term.begin()
    shift[0], shift[gdim - 1] = 0.05, -0.1
    b.move(lambda x: shift + 0 * x, 1)
    u, w = b.state.u.x.array + wavy(b.state.V, 2, 0.01), wavy(b.state.V, 3, 0.02)
    problem, sizes = Assembled(term, b.state), np.array([1e-2, 5e-3, 2.5e-3])
    f, tangent = problem.forces(u), problem.matrix(u) @ w
    closed = term.passes[0].slip._evaluate()["closed"]
    assert 0 < closed.min() and closed.max() < 0.9
    remainders = np.array([np.linalg.norm(problem.forces(u + h * w) - f - h * tangent) for h in sizes])
    assert slopes(sizes, remainders).min() > 1.95, remainders


# -- state -----------------------------------------------------------------------------------------------------------


def test_closing_leaves_no_trace_when_given_up():
    mechanics = pair(FLAT, 2)
    history(mechanics, 1.25, StepControl.fixed(0.25))
    slip = mechanics.terms[1].passes[0].slip
    before = slip._memory.x.array.copy()
    begin(mechanics, 2.0)
    assert mechanics.solve().converged
    mechanics.evaluate()
    assert slip.dissipation().min() > 0
    mechanics.state.rollback()
    np.testing.assert_array_equal(slip._memory.x.array, before)
    assert not slip.dissipation().any()
