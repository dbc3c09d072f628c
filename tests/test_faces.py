"""Faces of cuts that slide over each other, surfaces that meet themselves, contact of all surfaces (theory §3.5)."""

import numpy as np
import pytest
from mpi4py import MPI
from petsc4py import PETSc

from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.stepping import StepControl
from cutsim.bodies.loads import Support
from cutsim.bodies.solid import Solid
from cutsim.fields.faces import Face
from cutsim.fields.space import cracked_space
from cutsim.fields.temperature import Temperature
from cutsim.heat.contact_heat import ContactHeat
from cutsim.heat.pair_heat import PairHeat
from cutsim.interface.cohesive import Exponential
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.crack_friction import CrackFriction
from cutsim.interface.friction import Coulomb
from cutsim.materials.elastic import NeoHookean
from cutsim.pairs.contact_surfaces import ContactSurfaces
from cutsim.pairs.surface_pair import SurfacePair
from helpers.blocks import make_blocks
from helpers.boxes import stack
from helpers.fields import wavy
from helpers.folded import clamp
from helpers.laws import E
from helpers.runs import LINE_SEARCHES, history
from helpers.tangents import STEPS, Assembled, slopes

MU, PENALTY = 0.3, 40.0
BOND = Exponential(toughness=8e-4, opening=0.008)


def faces_of(crack):
    return crack.face("+"), crack.face("-")


def steps(size):
    return StepControl(first=size, largest=size, line_searches=LINE_SEARCHES)


# -- a cut that is pushed shut out of register ------------------------------------------------------------------------

# lifted, moved aside by three facets, closed, dragged back by one
LEGS = np.arange(5)
WAY = np.array([(0.0, 0.0), (0.0, 0.6), (0.75, 0.6), (0.75, -0.02), (0.5, -0.02)])


def along(component, scale=1.0):
    return lambda t: scale * float(np.interp(t, LEGS, WAY[:, component]))


@pytest.mark.mpi
@pytest.mark.parametrize("two_pass", [False, True], ids=["one pass", "two passes"])
@pytest.mark.parametrize("gdim", [2, 3])
def test_rigid_halves_pushed_shut_out_of_register(gdim, two_pass):
    """Pressure ε g over the facets that still face each other, friction μ times it, and its work.

    They are closed in one step, by more than two facets.
    """
    b = make_blocks(gdim, 4)
    crack = b.crack(None, closing=False)
    law = PenaltyContact(PENALTY)
    pair = SurfacePair(b.state, *faces_of(crack), young=E, contact=law, friction=MU, two_pass=two_pass)
    between = [0.0] * (gdim - 2)
    supports = b.drive(b.lower, [0.0] * gdim) + b.drive(b.upper, [along(0), *between, along(1)], "upper")
    mechanics = Mechanics(b.state, [b.solid(), crack, pair], supports)
    closed, rows = history(mechanics, 3.0, steps(1.0)), history(mechanics, 4.0, steps(0.25))
    normal, up = PENALTY * 0.02 * 0.5, "xyz"[gdim - 1]
    for when, share in ((closed, 0.25), (rows, 0.5)):
        np.testing.assert_allclose(when[f"upper_{up}_force"][-1], -share * PENALTY * 0.02, rtol=1e-9)
        np.testing.assert_allclose(when["pair_pressed"][-1], share, rtol=1e-9)
    np.testing.assert_allclose(rows["upper_x_force"][-1], -MU * normal, rtol=1e-9)
    # over the mean of both areas, and over the way that is left when the tangential penalty has taken up μ p
    slid = 0.25 - MU * 0.02
    np.testing.assert_allclose(rows["energy_friction"][-1], MU * 0.75 * normal * slid, rtol=0.05)


def out_of_register(comm=MPI.COMM_WORLD, law=None, step=0.0625):
    """A soft block, cut through, whose upper half is taken aside by three facets, pressed and dragged."""
    b = make_blocks(2, 8, comm)
    crack = b.crack(law, closing=False)
    pair = SurfacePair(b.state, *faces_of(crack), young=E, friction=MU, two_pass=True)
    supports = [Support(b.state, b.face(1, 0.0), i) for i in range(2)]
    supports += [Support(b.state, b.face(1, 1.0), i, along(i, 0.5), name=f"top_{'xy'[i]}") for i in range(2)]
    mechanics = Mechanics(b.state, [Solid(b.state, NeoHookean(E, 0.3)), crack, pair], supports)
    open_, closed = history(mechanics, 2.0, steps(4 * step)), history(mechanics, 4.0, steps(step))
    return {name: np.append(open_[name], closed[name]) for name in open_}, pair


@pytest.fixture(scope="module")
def broken():
    """Soft halves that no bond has held."""
    return out_of_register()


def test_soft_halves_pushed_shut_out_of_register(broken):
    rows, pair = broken
    normal, shear = -rows["top_y_force"], rows["top_x_force"]
    assert normal[-1] > 0.005 and abs(normal[3:8]).max() < 1e-9
    np.testing.assert_allclose(rows["pair_force_y"][-17:], -normal[-17:], rtol=1e-5)
    # the halves tilt a little under a pressure on a part of their faces
    np.testing.assert_allclose(shear[-1], -MU * normal[-1], rtol=0.05)
    for one in pair.passes:
        pressure = one.history.trial["pressure"]
        np.testing.assert_allclose(np.abs(one.slip.values("traction")[..., 0]), MU * pressure, rtol=1e-9, atol=1e-12)
    assert abs(rows["energy_closure"][-1]) < 5e-3
    assert (np.diff(rows["energy_friction"]) >= 0).all()


def test_bond_that_breaks_before_its_faces_slide(broken):
    """A crack with a law and no contact of its own beside the pair: after it has broken nothing is left of it."""
    free, bonded = broken[0], out_of_register(law=BOND)[0]
    np.testing.assert_allclose(bonded["crack_broken"][-1], 1.0, rtol=1e-6)
    np.testing.assert_allclose(bonded["energy_fracture"][-1], BOND.toughness, rtol=1e-3)
    for name in ("top_x_force", "top_y_force"):
        np.testing.assert_allclose(bonded[name][-17:], free[name][-17:], rtol=1e-4)


@pytest.mark.mpi
def test_same_on_any_number_of_ranks():
    if MPI.COMM_WORLD.size == 1:
        pytest.skip("compares several ranks with one")
    one, several = (out_of_register(comm, step=0.25)[0] for comm in (MPI.COMM_SELF, MPI.COMM_WORLD))
    for name in (n for n in one if "closure" not in n):
        np.testing.assert_allclose(several[name], one[name], rtol=1e-6, atol=1e-9, err_msg=name)


# -- in register: the crack's own contact -----------------------------------------------------------------------------


@pytest.mark.parametrize("gdim", [2, 3])
def test_in_register_the_pair_is_the_crack(gdim):
    ends = []
    for paired in (False, True):
        b = make_blocks(gdim, 4)
        law, up = PenaltyContact(10 * E * 4), gdim - 1
        crack = b.crack(None, contact=law, closing=not paired, friction=None if paired else MU)
        terms = [SurfacePair(b.state, *faces_of(crack), young=E, contact=law, friction=MU)] if paired else []
        path = [lambda t: 0.01 * max(t - 1, 0), *[0.0] * (gdim - 2), lambda t: -0.02 * min(t, 1)]
        supports = [Support(b.state, b.face(up, 0.0), i) for i in range(gdim)]
        supports += [
            Support(b.state, b.face(up, 1.0), i, value, name=f"top_{'xyz'[i]}") for i, value in enumerate(path)
        ]
        solid = Solid(b.state, NeoHookean(E, 0.3))
        rows = history(Mechanics(b.state, [solid, crack, *terms], supports), 3.0, steps(1.0))
        ends.append([rows[f"top_{'xyz'[i]}_force"][-1] for i in (0, up)])
    assert abs(ends[0][0]) > 0.1 * abs(ends[0][1])
    np.testing.assert_allclose(ends[1], ends[0], rtol=5e-4)


# energy of faces that just touch, which count as pressed
TOUCHED = 1e-20


def held_by_all_surfaces(b, moves, crack=None):
    """What the contact of all surfaces holds after some moves, each a step."""
    closing = [faces_of(crack)] if crack and crack.closing else ()
    pair = ContactSurfaces.automatic([b.solid()], closing=closing).pair(contact=PenaltyContact(PENALTY))
    for lower, upper in moves:
        b.move(lower, upper)
        pair.evaluate()
        b.state.commit()
        pair.begin()
    return pair.energies()["contact"]


@pytest.mark.mpi
def test_flanks_of_a_crease_that_have_passed_each_other_are_partners():
    """A flat top is folded inwards to a crease, whose flanks then pass through each other by some degrees."""
    b = make_blocks(2, 2)

    def folded(depth, over):
        def of_top(x):
            at_top, middle = 2 * x[1] - 1, 1 - np.abs(2 * x[0] - 1)
            return np.array([(0.5 + over - x[0] * (1 + 2 * over)) * at_top * (1 - middle), -depth * middle * at_top])

        return lambda x: 0 * x, of_top

    assert held_by_all_surfaces(b, [folded(0.2, -0.3), folded(0.4, -0.02)]) < TOUCHED
    assert held_by_all_surfaces(b, [folded(0.4, -0.02), folded(0.4, 0.02)]) > 1e-6


# -- a crack whose faces press on each other, and on all else ---------------------------------------------------------


@pytest.mark.parametrize("gdim", [2, 3])
def test_faces_of_a_closing_crack_do_not_meet_again(gdim):
    """Pressed in register, the pair of all surfaces does nothing beside the crack."""
    b = make_blocks(gdim, 4)
    crack = b.crack(None)
    pair = ContactSurfaces.automatic([b.solid()], closing=[faces_of(crack)]).pair()
    top = [*[0.0] * (gdim - 1), lambda t: -0.02 * t]
    supports = [*(Support(b.state, b.face(gdim - 1, 0.0), i) for i in range(gdim)), *b.drive(b.upper, top, "top")]
    rows = history(Mechanics(b.state, [b.solid(), crack, pair], supports), 1.0, steps(0.5))
    assert rows["crack_penetration"][-1] > 0 and rows["pair_pressed"][-1] == 0 and pair.energies()["contact"] == 0


@pytest.mark.mpi
@pytest.mark.parametrize("pressed", [True, False], ids=["a closing crack", "an open one"])
def test_outer_surface_on_the_face_of_a_crack(pressed):
    """The upper half stands on its left side upon the lower one: a pressure ε g over that side, of length 1/2."""
    b = make_blocks(2, 4)
    crack = b.crack(None, closing=pressed)
    # turned by a right angle about the origin, then lifted: the side at x = 0 lies above the crack
    moves = [
        (lambda x: 0 * x, lambda x, gap=gap: np.array([1.25 - x[1] - x[0], 0.5 + gap + x[0] - x[1]]))
        for gap in (0.05, -0.02)
    ]
    # both surfaces feel the other one, each with half of the traction
    held = held_by_all_surfaces(b, moves, crack)
    assert held == pytest.approx(0.5 * PENALTY * 0.02**2 * 0.5, rel=1e-6)


# -- tangents ---------------------------------------------------------------------------------------------------------


def assert_taylor(pair, state, u, w):
    problem = Assembled(pair, state)
    f, slope = problem.forces(u), problem.matrix(u) @ w
    remainders = np.array([np.linalg.norm(problem.forces(u + h * w) - f - h * slope) for h in STEPS])
    assert remainders[0] > 1e-8 * np.linalg.norm(slope)
    assert slopes(STEPS, remainders).min() > 1.95, remainders
    np.testing.assert_allclose(problem.forces(u, w), f + slope, atol=1e-12 * np.linalg.norm(slope))


@pytest.mark.parametrize("own", [False, True], ids=["faces", "itself"])
@pytest.mark.parametrize("gdim", [2, 3])
def test_tangent(gdim, own):
    """Faces out of register, which slip, as two surfaces and as one that meets itself."""
    b = make_blocks(gdim, 4, MPI.COMM_SELF)
    faces = faces_of(b.crack(None, closing=False))
    options = {"friction": Coulomb(0.4, 1e3), "contact": PenaltyContact(20.0)}
    pair = SurfacePair(b.state, *([faces] if own else faces), young=E, **options)
    pair.begin()
    between = [0.0] * (gdim - 2)
    b.move(lambda x: 0 * x, lambda x: np.array([0.37 + 0 * x[0], *(y + 0 * x[0] for y in between), 0 * x[0] - 0.04]))
    u = b.state.u.x.array + wavy(b.state.V, 1, 0.01)
    assert_taylor(pair, b.state, u, wavy(b.state.V, 3, 0.005))
    assert pair.passes[0].partners().hits.points.size > 3


# -- a surface that meets itself --------------------------------------------------------------------------------------


def folded(surfaces, arms=2, comm=MPI.COMM_WORLD, step=0.25, **options):
    """The arms of a clamp are pressed together at their tips: columns, with the surfaces that some facets are."""
    c = clamp(arms=arms, comm=comm)
    law = PenaltyContact(50 * E)
    pair = SurfacePair(c.state, *surfaces(c), young=E, contact=law, friction=0.2, two_pass=True, **options)
    tip = c.boundary(lambda x: np.isclose(x[1], 0.9) & (x[0] > 1.2))
    supports = [Support(c.state, c.boundary(lambda x: np.isclose(x[1], 0)), i) for i in (0, 1)]
    supports.append(Support(c.state, tip, 1, lambda t: -0.2 * t, name="tip"))
    return history(Mechanics(c.state, [Solid(c.state, NeoHookean(E, 0.3)), pair], supports), 1.0, steps(step))


def test_folded_body_meets_itself_as_two_surfaces_do():
    """The slot of a C is closed: the boundary that meets itself, and the slot's two faces in two passes."""
    two = folded(lambda c: (c.slot(0), c.slot(1)))
    own = folded(lambda c: (c.boundary(),))
    assert two["pair_pressed"][-1] > 0.5 and abs(two["tip_force"][-1]) > 10 * abs(two["tip_force"][1])
    for name in ("tip_force", "energy_friction", "energy_contact", "pair_pressed", "energy_strain"):
        np.testing.assert_allclose(own[name], two[name], rtol=1e-7, atol=1e-12, err_msg=name)


@pytest.mark.parametrize("arms", [1, 2])
def test_its_own_back_is_no_partner(arms):
    """A search through the arm changes nothing."""
    short, long = (folded(lambda c: (c.boundary(),), arms=arms, search=search) for search in (0.05, 1.0))
    np.testing.assert_allclose(long["tip_force"], short["tip_force"], rtol=1e-9)
    assert short["pair_pressed"][-1] > 0.5


@pytest.mark.mpi
def test_folded_body_is_the_same_on_any_number_of_ranks():
    if MPI.COMM_WORLD.size == 1:
        pytest.skip("compares several ranks with one")
    one, several = (folded(lambda c: (c.boundary(),), comm=comm) for comm in (MPI.COMM_SELF, MPI.COMM_WORLD))
    for name in (n for n in one if "closure" not in n):
        np.testing.assert_allclose(several[name], one[name], rtol=1e-6, atol=1e-9, err_msg=name)


# -- all surfaces -----------------------------------------------------------------------------------------------------

# of blocks that shorten from 1 to 0.95
PRESSED = 0.5 * (1 / 0.95 - 0.95)


def met(gdim, n, gap, drop, **options):
    """Two unit blocks (E 1, ν 0) of n and n + 1 cells a side with held outer faces: force between all their faces."""
    across = gdim - 1
    lower = ([0.0] * gdim, [1.0] * gdim, [n] * gdim)
    upper = ([0.0] * across + [1 + gap], [1.0] * across + [2 + gap], [n + 1] * gdim)
    s = stack(lower, upper)
    solid = Solid(s.state, NeoHookean(1.0, 0.0))
    pair = ContactSurfaces.automatic([solid]).pair(contact=PenaltyContact(1e3), **options)
    supports = [*s.drive(0, 0, [0.0] * gdim), *s.drive(1, 1, [0.0] * across + [lambda t: -drop * t], "top")]
    return -history(Mechanics(s.state, [solid, pair], supports), 1.0, steps(1.0))[f"top_{'xyz'[across]}_force"][-1]


@pytest.mark.mpi
@pytest.mark.parametrize(("gdim", "n"), [(2, 4), (2, 20), (3, 4)])
def test_surfaces_find_each_other_whatever_the_facets(gdim, n):
    """Blocks that overlap by 0.1 from the start, and blocks that close a gap of 0.1 and go on by 0.1 in one step."""
    assert met(gdim, n, -0.1, 0.0) == pytest.approx(PRESSED, rel=1e-3)
    assert met(gdim, n, 0.1, 0.2) == pytest.approx(PRESSED, rel=1e-3)
    if gdim == 2:
        assert met(gdim, n, -0.1, 0.0, search=0.01) == pytest.approx(PRESSED, rel=1e-3)


@pytest.mark.mpi
def test_all_surfaces_of_cut_bodies():
    """The outer boundary and both faces of the cut, without what is left out; on the bodies that are named only."""
    b = make_blocks(3, 4)
    solids = [Solid(b.state, NeoHookean(E, 0.3), cells=cells) for cells in (b.lower, b.upper)]

    def area(surfaces):
        pairs = SurfacePair(b.state, surfaces.faces, young=1.0)
        return sum(p.points.integral(np.ones_like(p.points.weights)) for p in pairs.passes)

    assert area(ContactSurfaces.automatic(solids)) == pytest.approx(8.0)
    assert area(ContactSurfaces.automatic(solids[:1])) == pytest.approx(4.0)
    assert area(ContactSurfaces.automatic(solids, without=b.facets)) == pytest.approx(6.0)


# -- heat -------------------------------------------------------------------------------------------------------------


def test_heat_of_a_surface_that_meets_itself():
    """Conduction through a cut that is pressed out of register: as of its two faces, and balanced."""
    flows = []
    for own in (False, True):
        b = make_blocks(2, 4)
        faces = faces_of(b.crack(None, closing=False))
        pair = SurfacePair(
            b.state, *([faces] if own else faces), young=E, contact=PenaltyContact(PENALTY), two_pass=True
        )
        b.move(lambda x: 0 * x, lambda x: np.array([0.25 + 0 * x[0], -0.02 + 0 * x[0]]))
        pair.evaluate()
        space = cracked_space(b.state.mesh, ("Lagrange", 1), b.facets)
        temperature = Temperature(b.state, space, lambda x: 300 + 10 * x[0])
        if own:
            with pytest.raises(ValueError, match=r"law.*meets itself"):
                PairHeat(temperature, pair, ContactHeat(gamma_plus=2.0, gamma_minus=1.0))
        heat = PairHeat(temperature, pair, ContactHeat(gamma_plus=2.0, gamma_minus=2.0))
        heat.begin()
        flow = PETSc.Vec().createMPI((space.dofmap.index_map.size_local, None), comm=b.state.mesh.comm)
        for one in heat.passes:
            one.add_forces(flow, None)
        flow.assemble()
        flows.append(flow.array.copy())
    # each point meets one that was 0.25 to the left of it: 2.5 K over two conductances γ p in series
    total = 0.5 * 2.0 * PENALTY * 0.02 * 2.5 * 0.75
    lower = flows[0][np.unique(space.dofmap.list[b.lower])]
    np.testing.assert_allclose(lower.sum(), total, rtol=1e-9)
    np.testing.assert_allclose(flows[1], flows[0], rtol=1e-12, atol=1e-14)


# -- bad input --------------------------------------------------------------------------------------------------------


@pytest.mark.mpi
def test_refusals():
    b = make_blocks(2, 4)
    crack = b.crack(None)
    faces = faces_of(crack)
    with pytest.raises(ValueError, match="slave_facets = '4 facets between two cells'"):
        SurfacePair(b.state, b.facets, faces[1], young=E)
    with pytest.raises(ValueError, match=r"slave_facets.*no facet of master_facets"):
        SurfacePair(b.state, faces[0], faces[0], young=E)
    with pytest.raises(ValueError, match="small_sliding"):
        SurfacePair(b.state, faces, young=E, small_sliding=True)
    with pytest.raises(ValueError, match=r"friction.*closing=False"):
        b.crack(None, closing=False, friction=0.3)
    with pytest.raises(ValueError, match=r"crack = 'crack'.*closing=True"):
        CrackFriction(b.crack(None, closing=False), 0.3)
    with pytest.raises(ValueError, match="side"):
        crack.face("plus")
    with pytest.raises(ValueError, match="side"):
        Face.cut(b.state.mesh, b.facets, b.lower, "left")
    pair = SurfacePair(b.state, *faces, young=E)
    with pytest.raises(ValueError, match=r"'crack' and pair 'pair' share .* closing=False"):
        Mechanics(b.state, [b.solid(), crack, pair], b.drive(b.lower, [0.0, 0.0]))
    all_, open_ = ContactSurfaces.automatic([b.solid()], closing=[faces]).pair(), b.crack(None, closing=False)
    with pytest.raises(ValueError, match=r"closing: pair 'pair' leaves facets to a crack that does not press"):
        Mechanics(b.state, [b.solid(), open_, all_], b.drive(b.lower, [0.0, 0.0]))
    with pytest.raises(ValueError, match="bodies"):
        ContactSurfaces.automatic([])
    missing = np.array([100_000], dtype=np.int32)
    with pytest.raises(ValueError, match=r"without: .* out of range"):
        ContactSurfaces.automatic([b.solid()], without=missing)
    with pytest.raises(ValueError, match=r"slave_facets: .* out of range"):
        SurfacePair(b.state, missing, faces[1], young=E)
