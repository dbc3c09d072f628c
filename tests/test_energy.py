"""The energy audit: it closes, no dissipation ever falls, and each entry is needed to close it."""

import numpy as np
import pytest
from dolfinx import fem, mesh
from mpi4py import MPI

from cutsim.analysis.energy import EnergyAudit
from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.stepping import StepControl
from cutsim.base.terms import ENTRIES
from cutsim.bodies.loads import Support
from cutsim.bodies.solid import Solid
from cutsim.fields.state import State
from cutsim.interface.cohesive import Exponential
from cutsim.interface.contact import PenaltyContact
from cutsim.materials.elastic import LinearElastic, NeoHookean
from helpers.blocks import make_blocks
from helpers.laws import EXPONENTIAL, NU, E
from helpers.runs import history

DISSIPATED = ("fracture", "friction", "viscous")
WEAK = Exponential(toughness=0.1, opening=0.1, shear_toughness=0.08, shear_opening=0.15)
# opening at the top: load, unload, press, load again to failure
OPENING = ([0, 1, 2, 3, 5], [0.0, 0.25, 0.0, -0.1, 1.2])


@pytest.fixture(scope="module")
def loop():
    """Two soft blocks pulled, relieved, pressed and pulled apart."""
    b = make_blocks(n=4)
    times, values = OPENING
    corners = tuple(map(float, times))
    supports = [Support(b.state, b.face(1, 0.0), i) for i in range(2)]
    supports.append(Support(b.state, b.face(1, 1.0), 1, lambda t: np.interp(t, times, values), corners=corners))
    terms = [b.solid(NeoHookean(E, NU), viscosity=0.005), b.crack(WEAK, contact=PenaltyContact(20.0))]
    return history(Mechanics(b.state, terms, supports), 5.0, StepControl.fixed(0.01))


def test_closes_in_every_row(loop):
    assert np.abs(loop["energy_closure"]).max() < 1e-3


def test_no_dissipation_falls(loop):
    """A step in which a face closes is integrated with five points over a kink, hence the small allowance."""
    for name in DISSIPATED:
        assert (np.diff(loop[f"energy_{name}"]) > -1e-6 * loop["energy_fracture"][-1]).all(), name


def test_what_is_stored_returns(loop):
    """Relieved at t = 2, the body stores next to nothing; broken at t = 5, too."""
    peak = loop["energy_strain"].max()
    for time in (2.0, 5.0):
        row = np.argmin(np.abs(loop["time"] - time))
        assert loop["energy_strain"][row] < 0.01 * peak
        assert loop["energy_cohesive_stored"][row] < 0.01 * peak


@pytest.mark.parametrize("name", ["strain", "cohesive_stored", "fracture", "contact", "viscous"])
def test_each_entry_matters(loop, name):
    """Without the entry, the audit would not close."""
    entries = {n: loop[f"energy_{n}"] for n in ENTRIES}
    gap = np.abs(loop["work_external"] - sum(e for n, e in entries.items() if n != name))
    turnover = np.maximum.accumulate(np.maximum(np.abs(loop["work_external"]), sum(map(np.abs, entries.values()))))
    assert (gap / turnover)[turnover > 0].max() > 3e-3


@pytest.mark.mpi
@pytest.mark.parametrize("viscosity", [0.01, 0.5])
def test_a_support_that_moves_at_once_closes_from_the_first_step(viscosity):
    """A bar to and fro at speed v: the viscous force jumps with the speed, and takes the power η v² from the start."""
    speed = 1e-3
    square = mesh.create_unit_square(MPI.COMM_WORLD, 2, 2)
    state = State(fem.functionspace(square, ("Lagrange", 1, (2,))))
    ends = [mesh.locate_entities_boundary(square, 1, lambda x, y=y: np.isclose(x[1], y)) for y in (0.0, 1.0)]
    supports = [Support(state, end, 0) for end in ends] + [Support(state, ends[0], 1)]
    supports.append(Support(state, ends[1], 1, lambda t: speed * min(t, 1 - t), corners=(0.5,)))
    solid = Solid(state, LinearElastic(E, 0.0), viscosity=viscosity)
    rows = history(Mechanics(state, [solid], supports), 1.0, StepControl(0.01, 0.1, closure=5e-3))
    assert np.abs(rows["energy_closure"]).max() < 1e-4
    np.testing.assert_allclose(rows["energy_viscous"], viscosity * speed**2 * rows["time"], rtol=3e-3)
    assert rows["work_external"][-1] == pytest.approx(viscosity * speed**2, rel=3e-3)


def test_viscous_dissipation_in_closed_form():
    """Confined stretch at a constant rate a: E = ½(λ² − 1), D = ∫ η Ė² dt = η a (λ³ − 1)/3."""
    b = make_blocks()
    rate, viscosity = 0.5, 0.2
    cells = np.union1d(b.lower, b.upper)
    supports = [Support(b.state, cells, 0, dim=2), Support(b.state, b.face(1, 0.0), 1)]
    supports.append(Support(b.state, b.face(1, 1.0), 1, lambda t: rate * t, name="top"))
    # the crack is kept shut by a law that is far too strong to give way
    law = Exponential(strength=1e5, opening=1.0)
    terms = [b.solid(NeoHookean(E, NU), viscosity=viscosity), b.crack(law)]
    rows = history(Mechanics(b.state, terms, supports), 1.0, StepControl.fixed(0.01))
    assert rows["energy_viscous"][-1] == pytest.approx(viscosity * rate * (1.5**3 - 1) / 3, rel=1e-3)
    stretch = 1 + rate * rows["time"]
    stress = 2 * E / (4 * (1 + NU)) * (stretch - 1 / stretch)
    stress += E * NU / (1 + NU) / (1 - 2 * NU) * np.log(stretch) / stretch + viscosity * rate * stretch**2
    np.testing.assert_allclose(rows["top_force"], stress, rtol=5e-3)


def test_audit_adds_up():
    audit = EnergyAudit().advance(2.0, [{"strain": 1.0}, {"strain": 0.5, "fracture": 0.25}])
    assert audit.entries["strain"] == 1.5
    assert audit.closure == pytest.approx(0.125)
    later = audit.advance(-1.0, [{"strain": 0.5, "fracture": 0.25}])
    assert later.external == 1.0
    assert later.closure == pytest.approx(0.125), "relative to the largest turnover, not the present one"
    assert audit.entries["strain"] == 1.5, "an audit is a value: a rejected step leaves no trace"
    assert EnergyAudit().closure == 0.0
    entries = {f"energy_{name}" for name in ENTRIES}
    assert set(audit.record()) == {"work_external", "energy_initial", "energy_closure"} | entries


def test_audit_refuses_an_entry_that_it_does_not_have():
    with pytest.raises(ValueError, match="name of an energy = 'strian' is not allowed: it must be one of strain, "):
        EnergyAudit().advance(0.0, [{"strian": 1.0}])


def test_audit_of_a_state_that_starts_with_energy():
    audit = EnergyAudit().start([{"kinetic": 3.0, "strain": 1.0}])
    assert audit.initial == 4.0
    assert audit.closure == 0.0
    assert audit.advance(1.0, [{"kinetic": 4.0}]).closure == pytest.approx(0.25)


def test_scale_keeps_small_energies_from_looking_unbalanced():
    assert EnergyAudit(scale=1.0).advance(1e-6, []).closure == pytest.approx(1e-6)
    b = make_blocks()
    audit = Mechanics(b.state, [b.solid(), b.crack(EXPONENTIAL)]).audit
    assert audit.scale == pytest.approx(0.5 * EXPONENTIAL.toughness), "the energy that breaks one facet"
