"""Augmented contact of rigid tools: penetration as small as asked, and a force that no penalty changes."""

import numpy as np
import pytest
from dolfinx import fem
from mpi4py import MPI

from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.stepping import StepControl
from cutsim.bodies.loads import Support
from cutsim.bodies.solid import Solid
from cutsim.fields.points import Surface
from cutsim.fields.state import State
from cutsim.interface.contact import PenaltyContact, SoftenedContact
from cutsim.interface.friction import Coulomb
from cutsim.interface.rubbing import Friction
from cutsim.materials.elastic import NeoHookean
from cutsim.tools.shapes import Ball, ToolPath
from cutsim.tools.tool_contact import ToolContact
from cutsim.tools.triangulated_tool import TriangulatedTool
from cutsim.tools.triangulation import Triangulation
from helpers.blocks import make_blocks
from helpers.laws import NU, E
from helpers.runs import history

R, N = 0.8, 12
ALLOWED = 1e-4 / N


def circle(n=600):
    """A polygon so fine that it is a circle."""
    angle, i = 2 * np.pi * np.arange(n) / n, np.arange(n)
    return Triangulation(R * np.column_stack([np.cos(angle), np.sin(angle)]), np.column_stack([i, (i + 1) % n]))


def pressed(kind, factor, blend=0.0, comm=MPI.COMM_WORLD, slide=0.0, step=0.25, **options):
    """A block on a fixed base under a ball of a penalty in E/h, which then slides along it."""
    b = make_blocks(2, n=N, comm=comm)
    state = State(fem.functionspace(b.state.mesh, ("Lagrange", 1, (2,))))
    points = [(0.5, 1 + R), (0.5, 0.92 + R), (0.5 + slide, 0.92 + R)]
    path, top = ToolPath.polyline([0, 1, 2], points), b.face(1, 1.0)
    options.setdefault("contact", PenaltyContact.automatic(E, 1 / N, factor, blend))
    if kind == "smooth":
        tool = ToolContact(state, Ball(R), path, [Surface.exterior(state, top)], **options)
        touched = tool.patches[0].surface.points
    else:
        tool = TriangulatedTool(state, top, circle(), path, search=0.3, **options)
        touched = tool.touch.points
    base = [Support(state, b.face(1, 0.0), i) for i in (0, 1)]
    mechanics = Mechanics(state, [Solid(state, NeoHookean(E, NU)), tool], base)
    rows = history(mechanics, 2.0 if slide else 1.0, StepControl.fixed(step))
    if kind == "smooth":
        depth, pressure = tool.patches[0].contact()["depth"], tool.patches[0].pressure()
    else:
        depth, pressure = -tool.touch.history.trial["opening"], tool.touch.history.trial["pressure"]
    whole = (pressure > 0).all(axis=1, keepdims=True)
    mean = touched.maximum(np.where(whole, np.abs(touched.facet_mean(depth))[:, None], 0.0))
    return rows, mean


@pytest.mark.parametrize("kind", ["smooth", "segments"])
def test_penetration_is_as_small_as_asked(kind):
    """Whatever the penalty, the force is the same to a thousandth; without multiplier it differs by more than 2 %."""
    forces, plain = [], []
    for factor in (4.0, 20.0):
        rows, mean = pressed(kind, factor, allowed_penetration=ALLOWED)
        assert mean <= ALLOWED
        forces.append(rows["tool_force_y"][-1])
        assert abs(rows["energy_closure"][-1]) < 3e-3
        rows, mean = pressed(kind, factor)
        assert mean > 50 * ALLOWED
        plain.append(rows["tool_force_y"][-1])
    assert forces[0] == pytest.approx(forces[1], rel=1e-3)
    assert plain[1] / plain[0] > 1.02 and forces[0] > plain[1]


def test_a_blend_does_not_count():
    """A blended law has its quadratic start at no penetration, too."""
    sharp, blended = (pressed("smooth", 10.0, blend, allowed_penetration=ALLOWED) for blend in (0.0, 0.01))
    assert blended[1] <= ALLOWED
    assert blended[0]["tool_force_y"][-1] == pytest.approx(sharp[0]["tool_force_y"][-1], rel=4e-3)


def test_a_clearance_does_not_count():
    """The multiplier takes back what a contact that begins early presses too much."""
    early = SoftenedContact(10 * E * N, 0.01, 0.005)
    rows, mean = pressed("smooth", 10.0, allowed_penetration=ALLOWED, contact=early)
    exact, _ = pressed("smooth", 10.0, allowed_penetration=ALLOWED)
    assert mean <= ALLOWED
    assert rows["tool_force_y"][-1] == pytest.approx(exact["tool_force_y"][-1], rel=4e-3)


@pytest.mark.parametrize("kind", ["smooth", "segments"])
def test_what_sticks_stays(kind):
    """With augmented friction the ball carries along what it holds, and the audit closes."""
    friction = Coulomb(0.6, 20.0)
    options = {"friction": friction, "allowed_penetration": 10 * ALLOWED, "slide": 0.02, "step": 0.125}
    held, _ = pressed(kind, 10.0, **{**options, "friction": Friction(friction, allowed_slip=1e-5)})
    stiff, _ = pressed(kind, 10.0, **{**options, "friction": Coulomb(0.6, 2e4)})
    soft, _ = pressed(kind, 10.0, **options)
    ends = [rows["tool_force_x"][-1] for rows in (held, stiff, soft)]
    assert ends[0] == pytest.approx(ends[1], rel=0.02)
    assert abs(ends[2]) < 0.97 * abs(ends[1]), "a soft tangential penalty lets it slip"
    assert abs(held["energy_closure"][-1]) < 5e-3


@pytest.mark.mpi
@pytest.mark.skipif(MPI.COMM_WORLD.size == 1, reason="compares several ranks with one")
def test_same_on_any_number_of_ranks():
    one, many = (
        pressed("smooth", 10.0, allowed_penetration=ALLOWED, step=0.5, comm=c)[0]
        for c in (MPI.COMM_SELF, MPI.COMM_WORLD)
    )
    for name in one:
        if name.startswith("tool"):
            np.testing.assert_allclose(many[name], one[name], rtol=1e-6, atol=1e-9, err_msg=name)


@pytest.mark.parametrize("name", ["allowed_penetration", "friction"])
@pytest.mark.parametrize("kind", ["smooth", "segments"])
def test_refusals(kind, name):
    with pytest.raises(ValueError, match=f"{name} = -1"):
        pressed(kind, 10.0, **{name: -1})
