"""Taylor's theorem for every tangent: the remainder of the linearised forces falls with the square of the step."""

from itertools import product

import numpy as np
import pytest

from cutsim.fields.points import Surface
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.crack_friction import CrackFriction
from cutsim.interface.friction import Coulomb
from cutsim.interface.rubbing import Friction
from cutsim.materials.elastic import LinearElastic, NeoHookean, StVenantKirchhoff
from cutsim.materials.rubbers import MooneyRivlin
from cutsim.tools.pointed import Blade
from cutsim.tools.shapes import Plane
from helpers.blocks import JUMPS, make_blocks, remember, separated
from helpers.examples import LAWS, TOOLS
from helpers.fields import jump_part, smooth
from helpers.laws import EXPONENTIAL, NU, E
from helpers.tangents import Linearised, assert_slope_two
from helpers.tools import FRICTION, touch

# -- bulk -------------------------------------------------------------------------------------------------------------

HYPERELASTIC = [NeoHookean(E, NU), StVenantKirchhoff(E, NU), MooneyRivlin(0.3, 0.1, 4.0)]
KINDS = [(3, "strain"), (2, "strain"), (2, "stress")]


@pytest.mark.parametrize(
    ("material", "gdim", "plane"),
    [(m, 2, "strain") for m in HYPERELASTIC] + [(HYPERELASTIC[0], 2, "stress"), (HYPERELASTIC[-1], 3, "strain")],
    ids=lambda v: type(v).__name__ if v in HYPERELASTIC else v,
)
def test_hyperelastic(material, gdim, plane):
    b = make_blocks(gdim)
    for volumetric in ("full",) if gdim == 3 else ("full", "reduced"):
        solid = b.solid(material, plane=plane, volumetric=volumetric)
        assert_slope_two(solid, b.state, smooth(b.state.V, 1, 0.2), 1.0)


@pytest.mark.parametrize("volumetric", ["full", "reduced"])
@pytest.mark.parametrize(("gdim", "plane"), KINDS, ids=["3-D", "plane strain", "plane stress"])
def test_linear_elastic_has_no_remainder(gdim, plane, volumetric):
    b = make_blocks(gdim)
    solid = b.solid(LinearElastic(E, NU), plane=plane, volumetric=volumetric)
    problem = Linearised(solid, b.state)
    u, w = smooth(b.state.V, 1, 0.2), smooth(b.state.V, 2, 1.0)
    assert problem.remainders(u, w, [1.0])[0] < 1e-13
    matrix = problem.matrix(u)
    assert np.linalg.norm(matrix - matrix.T) < 1e-13 * np.linalg.norm(matrix)


def test_viscosity():
    b = make_blocks()
    b.state.u_old.x.array[:] = smooth(b.state.V, 3, 0.1)
    b.state.begin(0.1)
    solid = b.solid(NeoHookean(E, NU), viscosity=5.0)
    assert_slope_two(solid, b.state, smooth(b.state.V, 1, 0.2), 1.0)


# -- crack ------------------------------------------------------------------------------------------------------------

# where any law is nonlinear, in every frame
BENT = ("mixed", "softening")


@pytest.mark.parametrize("jump", JUMPS)
@pytest.mark.parametrize("normal", ["current", "reference"])
@pytest.mark.parametrize("law", LAWS)
def test_crack(law, normal, jump):
    bond, (sliding, opening, past) = LAWS[law], JUMPS[jump]
    (slide, open_), b = bond.scale, make_blocks()
    crack = b.crack(bond.law, normal=normal, contact=PenaltyContact(30.0))
    if past:
        remember(crack, past * open_)
    u = separated(b, sliding * slide, opening * open_, 0.01 * open_)
    assert_slope_two(crack, b.state, u, open_, linear=jump not in BENT)


@pytest.mark.parametrize("normal", ["current", "reference"])
def test_crack_with_contact_only(normal):
    """Along the reference normal the pressure is linear."""
    b = make_blocks()
    crack = b.crack(None, normal=normal, contact=PenaltyContact(30.0))
    assert_slope_two(crack, b.state, separated(b, 0.08, -0.03, 1e-3), 0.1, linear=normal == "reference")


@pytest.mark.parametrize("law", ["exponential", "bilinear"])
def test_crack_in_three_dimensions(law):
    slide, open_ = LAWS[law].scale
    b = make_blocks(3)
    crack = b.crack(LAWS[law].law, contact=PenaltyContact(30.0))
    for opening in (0.8, -0.3):
        assert_slope_two(crack, b.state, separated(b, 0.7 * slide, opening * open_, 0.01 * open_), open_)


@pytest.mark.parametrize("opening", [-0.003, -0.05], ids=["within the blend", "beyond the blend"])
def test_blended_and_augmented_contact(opening):
    b = make_blocks()
    crack = b.crack(None, contact=PenaltyContact(30.0, blend=0.01), allowed_penetration=0.1)
    crack.history.multiplier.x.array[:] = 0.15
    assert_slope_two(crack, b.state, separated(b, 0.01, opening, 1e-4), 0.05)


STATES = {
    "stick": (Coulomb(20.0, 30.0), None, "compression"),
    "slip": (Coulomb(0.4, 1e4), None, "compression"),
    "viscous slip": (Coulomb(0.4, 50.0, viscosity=2.0), None, "compression"),
    "slip beside a bond": (Coulomb(0.4, 1e4), EXPONENTIAL, "compression of the damaged bond"),
    "slip while the bond breaks": (Coulomb(0.4, 1e4), EXPONENTIAL, "breaking under compression"),
}


@pytest.mark.parametrize(
    ("case", "gdim", "normal"),
    # in space the terms are the same, but for the second direction of the slip
    [
        *product(STATES, [2], ["current", "reference"]),
        *product(["slip", "slip while the bond breaks"], [3], ["current"]),
    ],
)
def test_friction_on_a_crack(case, gdim, normal):
    friction, law, jump = STATES[case]
    sliding, opening, past = {**JUMPS, "breaking under compression": (2.6, -0.3, 1.0)}[jump]
    b = make_blocks(gdim)
    b.state.begin(0.7)
    crack = b.crack(law, normal=normal, contact=PenaltyContact(30.0))
    if law is not None and past:
        remember(crack, past * 0.1)
    term = CrackFriction(crack, friction)
    u = separated(b, sliding * 0.1, opening * 0.1, 1e-3)
    if normal == "reference" and (case == "stick" or (gdim == 2 and jump != "breaking under compression")):
        # linear in u, since neither the direction of the traction nor the broken fraction changes
        assert Linearised(term, b.state).remainders(u, jump_part(b.state, 8, 0.02), [1e-2])[0] < 1e-9
    else:
        asymmetry = assert_slope_two(term, b.state, u, 0.02)
        assert case == "stick" or asymmetry > 1e-3


@pytest.mark.parametrize("acts_on", ["contact", "tension"])
def test_friction_on_an_intact_bond(acts_on):
    b = make_blocks()
    crack = b.crack(EXPONENTIAL, contact=PenaltyContact(30.0))
    term = CrackFriction(crack, Friction(Coulomb(0.4, 1e4), acts_on=acts_on))
    opening = 0.05 if acts_on == "tension" else -0.03
    assert_slope_two(term, b.state, separated(b, 0.07, opening, 1e-3), 0.1)


# -- tools ------------------------------------------------------------------------------------------------------------

# all points stick, or all slip: between the two the forces have a kink
FRICTIONS = {"smooth": None, "regularised": FRICTION, "slip": Coulomb(0.3, 1e3), "stick": Coulomb(50.0, 5.0)}


@pytest.mark.parametrize(
    ("shape", "friction"),
    [*product(TOOLS, ["regularised"]), *product(["blade", "plane", "sphere"], ["smooth", "slip", "stick"])],
)
def test_tool_on_outer_surface(shape, friction):
    """Every shape with one friction, every friction with three shapes: of a shape a friction knows its normal only."""
    (shape, place), friction = TOOLS[shape], FRICTIONS[friction]
    gdim = len(place)
    b = make_blocks(gdim)
    surface = Surface.exterior(b.state, b.face(gdim - 1, 1.0))
    tool = touch(b, shape, place, [surface], friction)
    asymmetry = assert_slope_two(tool, b.state, smooth(b.state.V, 4, 0.02), 0.05)
    sticks_to_a_plane = friction is FRICTIONS["stick"] and isinstance(shape, Plane)
    assert friction is None or sticks_to_a_plane or asymmetry > 1e-3


@pytest.mark.parametrize("depth", [-0.02, 0.02, 0.1], ids=["below", "within", "beyond"])
def test_blend(depth):
    """The depth of a plane in the surface, in the three branches of the blended pressure."""
    b = make_blocks()
    surface = Surface.exterior(b.state, b.face(1, 1.0))
    tool = touch(b, Plane((0.0, -1.0)), (0.5, 1.0 - depth), [surface], FRICTION)
    u = smooth(b.state.V, 4, 0.002)
    if depth < 0:
        assert not Linearised(tool, b.state).forces(u).any()
    else:
        assert_slope_two(tool, b.state, u, 0.05)


@pytest.mark.parametrize("friction", FRICTIONS.values(), ids=FRICTIONS)
def test_tool_between_crack_faces(friction):
    """Each half blade on its face: u('+') and u('−') are not mixed up."""
    b = make_blocks()
    crack = b.crack(None)
    up, right = (0.0, 1.0), (1.0, 0.0)
    halves = [
        touch(b, Blade(0.3, 0.05, 0.2, right, up, side=side), (0.95, 0.5), [crack.surface(sign)], friction)
        for side, sign in ((-1, "+"), (1, "-"))
    ]
    b.move(
        lambda x: np.array([0 * x[0], -0.05 - 0.1 * (1 - x[0])]),
        lambda x: np.array([0 * x[0], 0.05 + 0.1 * (1 - x[0])]),
    )
    u = b.state.u.x.array.copy()
    for half, sign in zip(halves, (-1, 1), strict=True):
        assert_slope_two(half, b.state, u, 0.05)
        pushed = Linearised(half, b.state).forces(u)[1::2].sum()
        assert -sign * pushed > 0, "the residual of a half blade opposes the force that opens its face"
