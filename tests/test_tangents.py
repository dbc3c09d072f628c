"""Taylor's theorem for every tangent: the remainder of the linearised forces falls with the square of the step."""

import itertools

import numpy as np
import pytest

from cutsim.fields.points import Surface
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.crack_friction import CrackFriction
from cutsim.interface.friction import Coulomb
from cutsim.materials.elastic import LinearElastic, NeoHookean, StVenantKirchhoff
from cutsim.materials.rubbers import MooneyRivlin
from cutsim.tools.pointed import Blade, Needle
from cutsim.tools.shapes import Ball, FlatPunch, Plane
from helpers.blocks import JUMPS, make_blocks, remember, separated
from helpers.fields import jump_part, smooth
from helpers.laws import BILINEAR, EXPONENTIAL, NU, PPR, PROPORTIONAL, E
from helpers.tangents import Linearised, assert_slope_two
from helpers.tools import FRICTION, touch

# -- bulk -------------------------------------------------------------------------------------------------------------

HYPERELASTIC = [NeoHookean(E, NU), StVenantKirchhoff(E, NU), MooneyRivlin(0.3, 0.1, 4.0)]
KINDS = [(3, "strain"), (2, "strain"), (2, "stress")]


@pytest.mark.parametrize(
    ("material", "gdim", "plane"),
    [(m, *kind) for m in HYPERELASTIC for kind in KINDS if not (isinstance(m, MooneyRivlin) and kind[1] == "stress")],
    ids=lambda v: type(v).__name__ if v in HYPERELASTIC else v,
)
def test_hyperelastic(material, gdim, plane):
    b = make_blocks(gdim)
    for volumetric in ("full", "reduced"):
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

LAWS = {
    "exponential": (EXPONENTIAL, 0.1),
    "bilinear": (BILINEAR, 0.02),
    "proportional": (PROPORTIONAL, 0.02),
    "ppr": (PPR, 0.05),
    "contact only": (None, 0.1),
}


# open, a crack without a law carries nothing; closed, its pressure along the reference normal is linear
BARE = [("contact only", "current", "compression")]


# another stiffness in sliding changes nothing but the envelope
MIXED = [("proportional", "current", "mixed")]


@pytest.mark.parametrize(
    ("law", "normal", "jump"),
    [*itertools.product(("exponential", "bilinear", "ppr"), ("current", "reference"), JUMPS), *BARE, *MIXED],
)
def test_crack(law, normal, jump):
    sliding, opening, past = JUMPS[jump]
    law, scale = LAWS[law]
    b = make_blocks()
    crack = b.crack(law, normal=normal, contact=PenaltyContact(30.0))
    if past:
        remember(crack, (5 if law is BILINEAR else past) * scale)
    u = separated(b, sliding * scale, opening * scale, 0.01 * scale)
    straight = past and (normal == "reference" or (law is BILINEAR and opening > 0))
    if straight or (law is BILINEAR and opening < 0 and normal == "reference"):
        # along the secants T = K_n δ_n n + K_t δ_t; so is sliding below the onset of damage
        assert Linearised(crack, b.state).remainders(u, jump_part(b.state, 8, scale), [1e-2])[0] < 1e-9
    else:
        assert_slope_two(crack, b.state, u, scale)


@pytest.mark.parametrize("law", [EXPONENTIAL, BILINEAR], ids=["exponential", "bilinear"])
def test_crack_in_three_dimensions(law):
    scale = LAWS["exponential" if law is EXPONENTIAL else "bilinear"][1]
    b = make_blocks(3)
    crack = b.crack(law, contact=PenaltyContact(30.0))
    assert_slope_two(crack, b.state, separated(b, 0.7 * scale, 0.8 * scale, 0.01 * scale), scale)
    assert_slope_two(crack, b.state, separated(b, 0.7 * scale, -0.3 * scale, 0.01 * scale), scale)


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


@pytest.mark.parametrize("normal", ["current", "reference"])
@pytest.mark.parametrize("gdim", [2, 3])
@pytest.mark.parametrize("case", STATES)
def test_friction_on_a_crack(case, gdim, normal):
    friction, law, jump = STATES[case]
    sliding, opening, past = {**JUMPS, "breaking under compression": (1.7, -0.3, 1.0)}[jump]
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
    term = CrackFriction(crack, Coulomb(0.4, 1e4), acts_on=acts_on)
    opening = 0.05 if acts_on == "tension" else -0.03
    assert_slope_two(term, b.state, separated(b, 0.07, opening, 1e-3), 0.1)


# -- tools ------------------------------------------------------------------------------------------------------------

# all points stick, or all slip: between the two the forces have a kink
FRICTIONS = {"smooth": None, "regularised": FRICTION, "slip": Coulomb(0.3, 1e3), "stick": Coulomb(50.0, 5.0)}
# shape, and a reference point from which it dips into the plane y = 1 (z = 1) at different depths along it
SHAPES = {
    "blade": (Blade(0.4, 0.3, 0.6), (0.4, 0.9)),
    "half blade": (Blade(0.4, 0.3, 0.6, side=1), (0.4, 0.9)),
    "cylinder": (Ball(0.8), (0.3, 1.7)),
    "punch": (FlatPunch(0.7, 0.2), (0.15, 0.9)),
    "plane": (Plane((0.1, -1.0)), (0.5, 0.97)),
    "blade in 3-D": (Blade(0.4, 0.3, 0.6, (0.0, 0.0, -1.0), (1.0, 0.0, 0.0)), (0.4, 0.5, 0.9)),
    "sphere": (Ball(0.8), (0.3, 0.4, 1.7)),
    "cylinder in 3-D": (Ball(0.8, (1.0, 0.2, 0.1)), (0.3, 0.4, 1.7)),
    "punch in 3-D": (FlatPunch(0.5, 0.2, (0.0, 0.0, -1.0)), (0.1, 0.2, 0.93)),
    "needle in 3-D": (Needle(0.4, 0.2, 0.5, (0.0, 0.0, -1.0)), (0.4, 0.45, 0.9)),
    "plane in 3-D": (Plane((0.1, 0.1, -1.0)), (0.5, 0.5, 0.97)),
}


@pytest.mark.parametrize("friction", FRICTIONS.values(), ids=FRICTIONS)
@pytest.mark.parametrize("shape", SHAPES)
def test_tool_on_outer_surface(shape, friction):
    shape, place = SHAPES[shape]
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
