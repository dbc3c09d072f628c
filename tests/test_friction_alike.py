"""Friction with its options on cracks, pairs and both kinds of tools: one law, one temperature, one heat for all."""

import numpy as np
import pytest
from dolfinx import fem

from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.staggered import ThermoMechanics
from cutsim.analysis.stepping import StepControl
from cutsim.bodies.loads import Support
from cutsim.bodies.solid import Solid
from cutsim.fields.points import Surface
from cutsim.fields.space import cracked_space
from cutsim.fields.state import State
from cutsim.fields.temperature import Temperature
from cutsim.heat.conduction import HeatBody
from cutsim.heat.contact_heat import ContactHeat
from cutsim.heat.interface_heat import InterfaceHeat
from cutsim.heat.pair_heat import PairHeat
from cutsim.heat.tool_heat import ToolHeat
from cutsim.heat.transfer import HeatTransfer
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.friction import Coulomb
from cutsim.interface.rubbing import Friction
from cutsim.tools.shapes import Plane, ToolPath
from cutsim.tools.tool_contact import ToolContact
from cutsim.tools.triangulated_tool import TriangulatedTool
from cutsim.tools.triangulation import Triangulation
from helpers.blocks import make_blocks
from helpers.boxes import two
from helpers.laws import ELASTIC, EXPONENTIAL
from helpers.runs import history

KINDS = ("crack", "pair", "tool", "triangles")
each = pytest.mark.parametrize("kind", KINDS)
MU, CONTACT, DEPTH, WAY = 0.3, PenaltyContact(50.0), 0.02, 0.1
PRESSURE = 50.0 * DEPTH
EXCHANGE = ContactHeat(3.0, 1.0)


def moved(t):
    """Down in the first unit of time, then along in the second."""
    return np.array([np.interp(t, (1, 2), (0, WAY)), -DEPTH * min(t, 1.0)])


class Sliding:
    """A body, and what is pressed on its upper face of unit length and slid: a body or a tool.

    Args:
        kind: Of the surface.
        friction: Gives friction for a temperature.
        warm: Temperatures of the body and of the other side.
        capacity: Heat capacity of both bodies.
        soft: Whether the body is held at its bottom only, and not rigid.
    """

    def __init__(self, kind, friction, warm=(300.0, 300.0), capacity=1e12, *, soft=False):
        self.kind, self.soft = kind, soft
        paths = [lambda t, i=i: moved(t)[i] for i in range(2)]
        if kind == "pair":
            b = two(2, n=(3, 4), overhang=0.5)
            space = fem.functionspace(b.state.mesh, ("Lagrange", 1))
            parts, bottom = [b.cells(0), b.cells(1)], b.face(0, 1, 0)
        else:
            b = make_blocks()
            parts, bottom = [b.lower, b.upper], b.face(1, 0.0)
            if kind == "crack":
                space = cracked_space(b.state.mesh, ("Lagrange", 1), b.facets)
        state = b.state
        if kind in ("tool", "triangles"):
            state = State(fem.functionspace(b.state.mesh, ("Lagrange", 1, (2,))))
            space, parts = fem.functionspace(state.mesh, ("Lagrange", 1)), [np.union1d(*parts)]
        start = fem.Function(space)
        for cells, value in zip(parts, warm, strict=False):
            start.interpolate(lambda x, value=value: np.full(x.shape[1], value), cells)
        T = Temperature(state, space, start)
        self.term, heat = self.surface(b, state, friction(T), T, warm[1])
        held = [Support(state, bottom, i) for i in range(2)] if soft else self.rigid(state, parts[0], [0.0, 0.0])
        if len(parts) > 1:
            held += self.rigid(state, parts[1], paths)
        mechanics = Mechanics(state, [Solid(state, ELASTIC), self.term], held)
        bodies = [
            HeatBody(T, density=1.0, capacity=capacity, conductivity=0.5, body=cells, name=f"body_{i}")
            for i, cells in enumerate(parts)
        ]
        self.problem = ThermoMechanics(mechanics, HeatTransfer(T, [*bodies, heat]))

    def surface(self, b, state, friction, T, other):
        """The term that rubs, and its heat."""
        if self.kind == "crack":
            crack = b.crack(None, contact=CONTACT, friction=friction)
            return crack, InterfaceHeat(T, crack, EXCHANGE)
        if self.kind == "pair":
            pair = b.pair(contact=CONTACT, friction=friction)
            return pair, PairHeat(T, pair, EXCHANGE)
        top, options = b.face(1, 1.0), {"contact": CONTACT, "friction": friction}
        path = ToolPath(lambda t: moved(t) + np.array([0.5, 1.0]), corners=(1.0,))
        if self.kind == "tool":
            tool = ToolContact(state, Plane((0.0, -1.0)), path, [Surface.exterior(state, top)], **options)
        else:
            corners = np.array([(-1.5, 0.0), (1.5, 0.0), (1.5, 1.0), (-1.5, 1.0)])
            box = Triangulation(corners, np.array([(0, 1), (1, 2), (2, 3), (3, 0)]))
            tool = TriangulatedTool(state, top, box, path, **options)
        return tool, ToolHeat(T, tool, EXCHANGE, other)

    @staticmethod
    def rigid(state, cells, path):
        return [Support(state, cells, i, value, dim=2, corners=(1.0,)) for i, value in enumerate(path)]

    @property
    def slip(self):
        """Memory of its friction."""
        if self.kind == "crack":
            return self.term.friction.slip
        return self.term.passes[0].slip if self.kind == "pair" else self.term.slips[0]

    def run(self, step=0.25):
        return history(self.problem, 2.0, StepControl.fixed(step))


def work(rows):
    """Friction work while it slides."""
    return rows["energy_friction"][-1] - rows["energy_friction"][np.argmin(np.abs(rows["time"] - 1.0))]


@pytest.mark.mpi
@each
def test_a_coefficient_a_law_and_a_value_are_the_same(kind):
    """Rigid bodies: the work is μ p s, but for the elastic slip."""
    works = [work(Sliding(kind, lambda T, f=f: f).run()) for f in (MU, Coulomb(MU), Friction(MU))]
    assert works[0] == works[1] == works[2]
    elastic = MU * PRESSURE / CONTACT.stiffness
    assert works[0] == pytest.approx(MU * PRESSURE * (WAY - elastic), rel=1e-9)


@each
@pytest.mark.parametrize("warm", [(350.0, 300.0), (300.0, 350.0)], ids=["body", "other side"])
def test_the_hotter_side_counts(kind, warm):
    """μ (T_d − T)²/(T_d − T_ref)² with the temperature of the hotter side: a quarter half way to T_d."""
    law = Coulomb(MU, 1e6, T_ref=300.0, T_damage=400.0)
    rows = Sliding(kind, lambda T: Friction(law, temperature=T), warm).run()
    assert work(rows) == pytest.approx(0.25 * MU * PRESSURE * WAY, rel=1e-4)


@each
def test_viscosity(kind):
    """t = μ p + η ds/dt."""
    rows = Sliding(kind, lambda T: Coulomb(MU, 1e6, viscosity=0.7)).run()
    power = np.diff(rows["energy_friction"])[-1] / 0.25
    assert power == pytest.approx((MU * PRESSURE + 0.7 * WAY) * WAY, rel=1e-5)


@pytest.mark.mpi
@each
def test_both_sides_are_heated(kind):
    """All friction work is heat of the audit; it flows to both sides, three to one with this law."""
    rows = Sliding(kind, lambda T: Coulomb(MU, 1e6), capacity=1e9).run()
    assert rows["heat_friction"][-1] > 0
    np.testing.assert_allclose(rows["heat_friction"], rows["energy_friction"], rtol=1e-9, atol=1e-15)
    assert np.abs(rows["heat_closure"]).max() < 1e-6
    names = [name for name in rows if "_heat_flow" in name]
    power = MU * PRESSURE * WAY
    if kind in ("tool", "triangles"):
        assert rows[names[0]][-1] == pytest.approx(power / 4, rel=1e-3)
    else:
        flows = {name.rpartition("_")[2]: rows[name][-1] for name in names}
        assert flows["plus"] == pytest.approx(-0.75 * power, rel=1e-3)
        assert flows["minus"] == pytest.approx(-0.25 * power, rel=1e-3)


@each
def test_what_sticks_does_so_within_the_tolerance(kind):
    """A soft body under a soft tangential penalty: without augmentation it creeps by far more than is allowed."""
    slid = {}
    for allowed in (None, 1e-5):
        s = Sliding(kind, lambda T, a=allowed: Friction(Coulomb(20.0, 2.0), allowed_slip=a), soft=True)
        s.run(0.5)
        traction, limit = (s.slip.values(name) for name in ("traction", "limit"))
        sticks = (np.linalg.norm(traction, axis=-1) < 0.99 * limit).all(axis=1)
        assert sticks.any()
        components = np.moveaxis(s.slip.values("slid"), -1, 0)
        slid[allowed] = np.linalg.norm([s.slip.points.facet_mean(c) for c in components], axis=0)[sticks].max()
    assert slid[1e-5] <= 1e-5 < 1e-3 < slid[None]


@pytest.mark.parametrize("acts_on", ["broken", "contact", "tension"])
def test_beside_a_bond_a_pair_is_like_a_crack(acts_on):
    """Pressed and slid beside an intact bond: the same friction work on the same fraction."""
    works = []
    for kind in ("crack", "pair"):
        if kind == "crack":
            b = make_blocks()
            parts, make, options = (b.lower, b.upper), b.crack, {}
        else:
            b = two(2, n=(3, 4))
            parts, make, options = (b.cells(0), b.cells(1)), b.pair, {"small_sliding": True}
        friction = Friction(Coulomb(MU, 1e4), acts_on=acts_on)
        term = make(law=EXPONENTIAL, contact=CONTACT, friction=friction, **options)
        path = [lambda t: 0.35 * max(t - 1, 0.0), lambda t: -DEPTH * min(t, 1.0)]
        held = Sliding.rigid(b.state, parts[0], [0.0, 0.0]) + Sliding.rigid(b.state, parts[1], path)
        rows = history(Mechanics(b.state, [Solid(b.state, ELASTIC), term], held), 2.0, StepControl.fixed(0.1))
        works.append(rows["energy_friction"][-1])
    assert works[1] == pytest.approx(works[0], rel=1e-6)
    whole = MU * PRESSURE * 0.35
    if acts_on == "broken":
        assert 0.2 * whole < works[0] < 0.7 * whole, "from the characteristic sliding on"
    else:
        assert works[0] == pytest.approx(whole, rel=1e-2)
