"""Puncture of an intact surface: the guide of a plane cut, the event itself, and a body that is cut through."""

import numpy as np
import pytest
from mpi4py import MPI

from cutsim import (
    Blade,
    Crack,
    Drive,
    Exponential,
    Faces,
    Fixture,
    Insertion,
    MeshRule,
    NeoHookean,
    State,
    StepControl,
    cracked_block,
    cracked_space,
    geometry,
    read_geo,
    run,
)
from cutsim.interface.contact import HardeningContact
from cutsim.interface.guide import Guide

COMM = MPI.COMM_WORLD
SOLID, BOND = NeoHookean(0.777, 0.45), Exponential(strength=0.3, toughness=0.1)
BLADE = Blade(np.radians(20), 0.1, 0.4)
RULE = MeshRule.of([BLADE], [BOND])
#: Of a tool that indents an intact surface, and hardly penetrates it.
ALIKE = Faces(symmetric=True, firm=True)


def block(**sizes):
    plain = {"dim": 2, "Lx": 0.8, "H": 1.0, "band": 0.2, "growth": 1.8, "notch": 0, "lc": 0.1}
    return read_geo(geometry("block"), COMM, plain | sizes, gdim=2)


@pytest.mark.mpi
def test_a_guide_resists_the_way_off_the_plane_and_nothing_else():
    """½ k m² per length for a body that moves by m across the plane; nothing for faces that part or slide along it."""
    domain = block()
    facets = domain.facets("crack")
    state = State(cracked_space(domain.mesh, ("Lagrange", 1, (2,)), facets))
    guide = Guide(Crack(state, facets, (-1.0, 0.0), BOND, young=1.0), stiffness=3.0)

    def stored(left, right, up):
        for name, across in (("left", left), ("right", right)):
            state.u.interpolate(lambda x, a=across: np.array([0 * x[0] + a, 0 * x[0] + up]), domain.cells(name))
        state.u.x.scatter_forward()
        return guide.energies()["contact"]

    assert stored(0.2, 0.2, 0.0) == pytest.approx(0.5 * 3.0 * 0.2**2 * 1.0)
    assert stored(0.0, 0.2, 0.0) == pytest.approx(0.5 * 3.0 * 0.1**2 * 1.0)
    assert stored(-0.3, 0.3, 0.4) == pytest.approx(0.0, abs=1e-15)


def pushed(depth, fixture=None, sizes=None, **drive):
    """Intact block and blade: insertion, and columns by name with an entry for each step."""
    rule = {"lc": RULE.size, "entry": RULE.mouth, "band": 2 * RULE.size}
    body = cracked_block(block(**(rule | (sizes or {}))), SOLID, BOND, viscosity=0.004, faces=ALIKE)
    cut = Insertion.build(body, BLADE, Drive(1.0), **({} if fixture is None else {"fixture": fixture}))
    rows = []

    def record(report):
        deep = max(contact.penetration() * contact.patches[0].normal_size for contact in cut.contacts)
        rows.append(report.columns | cut.columns(report.columns) | {"deepest": (deep, "length")})

    run(cut.mechanics, cut.time_of(depth), StepControl(first=0.02, largest=0.1, smallest=1e-5, closure=2e-3), record)
    return cut, {name: np.array([row[name][0] for row in rows]) for name in rows[0]}


def test_an_intact_surface_is_punctured():
    """It is indented, the crack starts by itself and runs ahead, and the force drops."""
    cut, rows = pushed(0.7, sizes={"H": 1.6, "Lx": 1.2})
    peak = int(np.argmax(rows["force"]))
    assert 0 < peak < len(rows["force"]) - 1 and rows["force"][peak] > 1.2 * BOND.toughness
    assert rows["front"][peak] < 0.5 * rows["front"][-1], "most of the cut comes after the peak"
    assert rows["force"][peak:].min() < 0.9 * rows["force"][peak]
    assert rows["deepest"].max() < 0.1 * RULE.size
    assert np.abs(rows["energy_closure"]).max() < 0.01
    assert rows["energy_contact"].max() < 0.05 * rows["energy_strain"].max(), "the guide holds nothing"
    # viscosity takes what is set free; on this coarse mesh the mouth folds, in elements with 3.5 % of the energy
    assert set(cut.state.verdict.doubts) <= {"viscosity", "block: folded"}


def test_a_tool_in_a_notch_is_as_firm_as_on_an_intact_surface_where_faces_are():
    """So that nothing but the puncture tells two cuts apart."""
    firm, soft, alike, both = (
        Insertion.build(cracked_block(block(notch=0.3), SOLID, BOND, faces=faces), BLADE, Drive(1.0), notch=0.3)
        for faces in (Faces(firm=True), Faces(), Faces(symmetric=True), ALIKE)
    )
    size = firm.body.cracks[0].normal_size
    for contact in (*firm.contacts, *both.contacts):
        assert contact.contact == BLADE.firm_contact(SOLID.young, size)
    cutting = BLADE.soft_contact(SOLID.young, size)
    assert soft.contacts[0].contact == cutting
    assert alike.contacts[0].contact == HardeningContact(2 * cutting.stiffness, cutting.blend, cutting.clearance)


def test_halves_that_are_spread_in_a_notch_press_on_nothing_at_first():
    cut = Insertion.build(
        cracked_block(block(notch=0.3), SOLID, BOND, faces=Faces(symmetric=True)), BLADE, Drive(1.0), notch=0.3
    )
    assert all(contact.contact.clearance > 0 for contact in cut.contacts)
    assert [contact.energies()["contact"] for contact in cut.contacts] == pytest.approx([0.0, 0.0], abs=1e-18)


def test_faces_of_a_thread_are_not_alike():
    domain = read_geo(geometry("thread"), COMM, {"R": 1, "H": 2, "deep": 1, "lc": 0.3, "notch": 0}, gdim=2)
    with pytest.raises(ValueError, match=r"faces.symmetric = True .* body of revolution"):
        cracked_block(domain, SOLID, BOND, axisymmetric=True, faces=Faces(symmetric=True))


def test_a_body_that_is_held_at_its_ends_is_cut_through():
    """The bond is spent to its end, and on the shank between the two halves there is no force any more."""
    faces = Faces(symmetric=True, friction=0.3)
    body = cracked_block(block(notch=0.4, Lx=1.0), SOLID, BOND, viscosity=0.005, faces=faces)
    tool, ends = Blade(np.radians(30), 0.1, 0.2), Fixture(ends=("far_left", "far_right"))
    cut, rows = Insertion.build(body, tool, Drive(1.0), notch=0.4, fixture=ends), []
    run(
        cut.mechanics,
        cut.time_of(1.0 + 3 * tool.shaft_height),
        StepControl(first=0.02, largest=0.1, closure=5e-3),
        lambda report: rows.append(report.columns | cut.columns(report.columns)),
    )
    column = {name: np.array([row[name][0] for row in rows]) for name in rows[0]}
    assert column["front"][-1] == pytest.approx(0.6)
    x = 2 * tool.width / BOND.opening  # the shank holds the halves this far apart, in characteristic openings
    spent = column["energy_fracture"][-1] + column["energy_cohesive_stored"][-1]
    assert spent == pytest.approx(0.6 * BOND.toughness * (1 - (1 + x) * np.exp(-x)), rel=0.02)
    assert column["force"].max() > 0.5 * BOND.toughness and abs(column["force"][-1]) < 0.02 * BOND.toughness
    assert np.abs(column["energy_closure"]).max() < 0.02
    with pytest.raises(ValueError, match="depth"):
        Insertion.build(body, tool, Drive(1.0), notch=0.4).time_of(1.1)


@pytest.mark.mpi
def test_a_blade_in_a_body_of_revolution_is_a_ring():
    """Its edge goes round the axis: where this is far away it dents a block as a straight edge of the same length."""
    tool, bond, far = Blade(np.radians(25), 0.05, 0.35, back_angle=0.0), Exponential(strength=0.45, toughness=0.1), 40.0
    sizes = {"Lx": far, "lc": 0.05, "entry": 0.02, "deep": 0.5}

    def dented(axis):
        body = cracked_block(block(axis=axis, **sizes), SOLID, bond, axisymmetric=axis > 0, faces=Faces(firm=True))
        cut, rows = Insertion.build(body, tool, Drive(1.0)), []
        control = StepControl(first=0.01, largest=0.02)
        run(cut.mechanics, cut.time_of(0.04), control, lambda r: rows.append(cut.columns(r.columns)))
        assert tuple(cut.frame.origin) == pytest.approx((axis, 0.0)) and len(cut.contacts) == 2
        assert rows[-1]["imbalance"][0] < 1e-6
        return rows[-1]["force"][0]

    assert dented(far) == pytest.approx(2 * np.pi * far * dented(0.0), rel=0.02)
