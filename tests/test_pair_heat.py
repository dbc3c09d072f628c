"""Heat between surfaces whose meshes do not match: conductance, sharing, sliding, conservation (theory §3.4, §3.5)."""

import numpy as np
import pytest
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc

from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.staggered import ThermoMechanics
from cutsim.analysis.stepping import StepControl, begin
from cutsim.bodies.loads import Support
from cutsim.bodies.solid import Solid
from cutsim.fields.temperature import Temperature
from cutsim.heat.boundary import PrescribedTemperature
from cutsim.heat.conduction import HeatBody
from cutsim.heat.contact_heat import ContactHeat
from cutsim.heat.pair_heat import PairHeat
from cutsim.heat.transfer import HeatTransfer
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.friction import Coulomb
from cutsim.materials.elastic import NeoHookean
from helpers.boxes import stack, two
from helpers.laws import E
from helpers.runs import LINE_SEARCHES, history

STIFFNESS, DEPTH = 1000.0, 0.02
PRESSURE = STIFFNESS * DEPTH
LAW = ContactHeat(gamma_plus=0.03, gamma_minus=0.01)  # '+' is the slave, the upper body
NAMES = ("lower", "upper")
K = {"lower": 2.0, "upper": 0.5}
CAPACITY = {"lower": 1.5, "upper": 3.0}  # ρ c
MU = 0.3


def heat_problem(b, pair, law=LAW, *, initial=(300.0, 300.0), k=K, capacity=CAPACITY, ends=(), degree=1):
    """Temperature, contact and heat transfer of two boxes, with the temperatures of bottom and top if given."""
    space = fem.functionspace(b.state.mesh, ("Lagrange", degree))
    start = fem.Function(space)
    for box, value in enumerate(initial):
        start.interpolate(lambda x, value=value: np.full(x.shape[1], value), b.cells(box))
    T = Temperature(b.state, space, start)
    bodies = [
        HeatBody(T, density=1.0, capacity=capacity[name], conductivity=k[name], body=b.cells(box), name=name)
        for box, name in enumerate(NAMES)
    ]
    faces = zip((0, 1), (0, 1), ends, ("bottom", "top"), strict=False)
    held = [PrescribedTemperature(T, b.face(box, b.gdim - 1, end), v, name=name) for box, end, v, name in faces]
    contact = PairHeat(T, pair, law)
    return contact, HeatTransfer(T, [*bodies, contact], held)


def rigid(b, box, path=None):
    """Every node of a box moves along a path; at rest without."""
    path = path or [0.0] * b.gdim
    return [Support(b.state, b.cells(box), i, value, dim=b.gdim) for i, value in enumerate(path)]


class Slabs:
    """Boxes of unit height, moved as rigid bodies: the pressure is uniform."""

    def __init__(
        self,
        gdim=2,
        n=(2, 4),
        law=LAW,
        depth=DEPTH,
        two_pass=False,
        mu=0.0,
        speed=0.0,
        overhang=0.0,
        small_sliding=False,
        boxes=None,
        **options,
    ):
        self.b = b = stack(*boxes) if boxes else two(gdim, n, overhang=overhang)
        friction = Coulomb(mu, stiffness=1e8) if mu else None
        contact = PenaltyContact(STIFFNESS)
        self.pair = b.pair(
            contact=contact, friction=friction, two_pass=two_pass, search=0.5, small_sliding=small_sliding
        )
        path = [lambda t: speed * t, *[0.0] * (gdim - 2), -depth]
        terms = [Solid(b.state, NeoHookean(E, 0.3)), self.pair]
        mechanics = Mechanics(b.state, terms, rigid(b, 0) + rigid(b, 1, path))
        self.contact, heat = heat_problem(b, self.pair, law, **options)
        self.problem = ThermoMechanics(mechanics, heat)

    def run(self, until, step):
        rows = history(self.problem, until, StepControl.fixed(step))
        check(rows)
        return rows

    def values(self, name):
        """Smallest and largest value at the points of the first pass."""
        exchange = self.contact.passes[0].exchange
        v = exchange.point_values(name)
        return -exchange.points.maximum(-v), exchange.points.maximum(v)


def check(rows):
    """What holds in every run: heat is conserved, and the second law."""
    assert np.abs(rows["heat_closure"]).max() < 1e-9
    assert rows["pair_contact_dissipation_min"].min() >= -1e-12 * max(1.0, rows["pair_temperature_max"].max())
    assert (np.diff(rows["pair_entropy"]) >= -1e-12).all()


def heat_of(rows, name, start=300.0):
    """Heat stored in a body of unit volume."""
    return CAPACITY[name] * (rows[f"{name}_temperature"] - start)


# -- conduction through the contact -----------------------------------------------------------------------------------

HOT, COLD = 380.0, 300.0
CONDUCTANCE = PRESSURE * LAW.gamma_plus * LAW.gamma_minus / (LAW.gamma_plus + LAW.gamma_minus)
FLUX = (HOT - COLD) / (1 / K["lower"] + 1 / CONDUCTANCE + 1 / K["upper"])  # upwards


@pytest.mark.mpi
@pytest.mark.parametrize("fixed", [False, True], ids=["sliding", "fixed"])
@pytest.mark.parametrize(("gdim", "degree"), [(2, 1), (2, 2), (3, 1)])
def test_steady_slabs_of_nested_meshes(gdim, degree, fixed):
    """Jump and flux with the conductance p γ⁺γ⁻/(γ⁺+γ⁻), exact as long as no slave facet crosses a master edge."""
    slabs = Slabs(gdim, ends=(HOT, COLD), degree=degree, small_sliding=fixed)
    rows = slabs.run(3e9, 1e9)
    for name, expected in (("flux_plus", -FLUX), ("flux_minus", FLUX)):
        np.testing.assert_allclose(slabs.values(name), expected, rtol=1e-8)
    jump = np.subtract(slabs.values("temperature_minus"), slabs.values("temperature_plus"))
    np.testing.assert_allclose(jump, FLUX / CONDUCTANCE, rtol=1e-8)
    for column, sign in (("bottom", 1), ("top", -1)):
        assert sign * rows[f"{column}_heat_flow"][-1] == pytest.approx(FLUX, rel=1e-8)
    for column, sign in (("plus", -1), ("minus", 1)):
        assert sign * rows[f"pair_heat_flow_{column}"][-1] == pytest.approx(FLUX, rel=1e-8)
    # T_c lies between the faces, nearer to the better conductor
    drop = slabs.values("temperature")[0] - slabs.values("temperature_plus")[0]
    assert drop == pytest.approx(FLUX / (LAW.gamma_plus * PRESSURE), rel=1e-8)


@pytest.mark.mpi
@pytest.mark.parametrize("two_pass", [False, True], ids=["one pass", "two passes"])
@pytest.mark.parametrize("gdim", [2, 3])
def test_steady_slabs(gdim, two_pass):
    """Where slave facets cross master edges, the quadrature there spoils the uniform flux a little."""
    slabs = Slabs(gdim, n=(4, 5), two_pass=two_pass, ends=(HOT, COLD))
    rows = slabs.run(3e9, 1e9)
    assert rows["bottom_heat_flow"][-1] == pytest.approx(FLUX, rel=1e-5)
    assert rows["pair_heat_flow_minus"][-1] == pytest.approx(FLUX, rel=1e-5)
    np.testing.assert_allclose(slabs.values("flux_minus"), FLUX, rtol=1e-3)
    jump = np.subtract(slabs.values("temperature_minus"), slabs.values("temperature_plus"))
    np.testing.assert_allclose(jump, FLUX / CONDUCTANCE, rtol=1e-3)


@pytest.mark.parametrize("gap", [0.0, 0.7])
def test_open_gap(gap):
    """Insulated, or with its own conductance; a point that faces nothing is insulated anyway."""
    slabs = Slabs(law=ContactHeat(0.03, 0.01, gap_conductance=gap), depth=-0.1, ends=(HOT, COLD), initial=(HOT, COLD))
    step = 1e9 if gap else 0.1
    slabs.run(3 * step, step)
    flux = (HOT - COLD) / (1 / K["lower"] + 1 / gap + 1 / K["upper"]) if gap else 0.0
    np.testing.assert_allclose(slabs.values("flux_minus"), flux, rtol=1e-8, atol=1e-12)
    far = Slabs(law=ContactHeat(0.03, 0.01, gap_conductance=gap), depth=-0.6, initial=(HOT, COLD))
    far.run(0.3, 0.1)
    np.testing.assert_allclose(far.values("flux_minus"), 0.0, atol=1e-12)


def test_tangent_is_exact_and_symmetric():
    """Heat is linear in the temperature: nodal heat at T + w less that at T is the matrix times w."""
    slabs = Slabs(3, n=(2, 3), mu=MU, overhang=0.3, two_pass=True, law=ContactHeat(0.03, 0.01, capacity=0.3))
    slabs.run(0.2, 0.1)
    T = slabs.contact.temperature
    rng = np.random.default_rng(1)
    here, w = T.value.x.array.copy(), rng.uniform(-1, 1, T.value.x.array.size)
    A = PETSc.Mat().createDense((w.size, w.size))
    A.setUp()
    for assembler in slabs.contact.assemblers:
        assembler.add_tangent(A)
    A.assemble()
    matrix = A.getDenseArray()

    def heat(temperature, along=None):
        T.value.x.array[:] = temperature
        b = PETSc.Vec().createSeq(w.size)
        for assembler in slabs.contact.assemblers:
            assembler.add_forces(b, along)
        b.assemble()
        return b.array.copy()

    change = heat(here + w) - heat(here)
    scale = np.abs(matrix).sum()
    assert scale > 0
    np.testing.assert_allclose(matrix @ w, change, atol=1e-12 * scale)
    np.testing.assert_allclose(heat(here, w), heat(here + w), atol=1e-12 * scale)
    np.testing.assert_allclose(matrix, matrix.T, atol=1e-14 * scale)


# -- dissipation ------------------------------------------------------------------------------------------------------


@pytest.mark.mpi
@pytest.mark.parametrize("capacity", [0.0, 0.3])
@pytest.mark.parametrize(("gdim", "two_pass"), [(2, False), (2, True), (3, False)])
def test_friction_of_insulated_slabs_is_kept(gdim, two_pass, capacity):
    """Σ m c ΔT, with what the interface holds, is the work of friction, μ p s but for the elastic slip."""
    law = ContactHeat(0.03, 0.01, capacity=capacity)
    slabs = Slabs(gdim, (5, 3), law, two_pass=two_pass, mu=MU, speed=1.0, overhang=1.0, initial=(300.0, 300.0))
    rows = slabs.run(0.5, 0.05)
    work = rows["energy_friction"][-1]
    np.testing.assert_allclose(rows["heat_friction"], rows["energy_friction"], rtol=1e-12)
    kept = 3.0 ** (gdim - 1) * heat_of(rows, "lower")[-1] + heat_of(rows, "upper")[-1]
    held = rows["heat_stored"][-1] - kept
    assert kept + held == pytest.approx(work, rel=1e-9)
    assert held > 0.1 * work if capacity else held == pytest.approx(0.0, abs=1e-9 * work)
    if not two_pass:  # the slab is slave where it faces the block only: its points come and go
        assert work == pytest.approx(MU * PRESSURE * 0.5, rel=0.06)


@pytest.mark.parametrize("two_pass", [False, True], ids=["one pass", "two passes"])
def test_friction_is_shared_by_conductance(two_pass):
    """At equal temperatures q± = −γ±/(γ⁺+γ⁻) D, whichever surface is the slave."""
    slabs = Slabs(two_pass=two_pass, mu=MU, speed=1.0, overhang=1.0, capacity={"lower": 1e9, "upper": 1e9})
    rows = slabs.run(0.2, 0.1)
    generated = rows["pair_heat_flow_plus"] + rows["pair_heat_flow_minus"]
    np.testing.assert_allclose(generated, -np.diff(rows["heat_friction"], prepend=0) / 0.1, rtol=1e-9)
    np.testing.assert_allclose(rows["pair_heat_flow_plus"] / generated, 0.75, rtol=1e-6)


def test_perfect_contact_shares_by_effusivity():
    """γ p → ∞, times too short for the heat to reach the ends: shares as √(kρc), not as γ."""
    k, capacity = {"lower": 1.0, "upper": 4.0}, {"lower": 1.0, "upper": 1.0}
    # the slab ahead of the block would be cold: a slide that is small against the elements
    boxes = ((0.0, -0.5), (1.0, 0.0), (2, 24)), ((0.0, 0.0), (1.0, 0.5), (4, 24))
    slabs = Slabs(law=ContactHeat(300.0, 100.0), mu=10 * MU, speed=0.1, boxes=boxes, k=k, capacity=capacity)
    rows = slabs.run(0.01, 0.01 / 40)
    lower, upper = (rows[f"{name}_temperature"][-1] - 300 for name in ("lower", "upper"))
    assert upper / lower == pytest.approx(2.0, rel=0.02)
    face = slabs.values("temperature")[1] - 300
    rate = 10 * MU * PRESSURE * 0.1
    assert face == pytest.approx(2 * rate / 3.0 * np.sqrt(0.01 / np.pi), rel=0.02)


# -- sliding ----------------------------------------------------------------------------------------------------------


def over_the_edge(capacity, gammas):
    """A rigid block, drawn over the end of a rigid slab until half of it has lost the slab."""
    return Slabs(law=ContactHeat(*gammas, capacity=capacity), n=(6, 4), mu=MU, speed=1.0, overhang=0.2)


def test_interface_moves_with_the_slave():
    """An interface that gives nothing away is as warm as its own way on the slab has made it."""
    slabs = over_the_edge(0.4, (1e-9, 1e-9))
    until, step = 0.7, 0.02
    slabs.run(until, step)
    points = slabs.pair.passes[0].points
    x = slabs.pair.passes[0].partners().slave.x[:, 0].reshape(points.weights.shape) - until
    way = np.clip(1.2 - x, 0.0, until)
    rise = slabs.contact.passes[0].exchange.point_values("temperature") - 300
    np.testing.assert_allclose(rise, MU * PRESSURE * way / 0.4, atol=1.01 * MU * PRESSURE * step / 0.4)
    assert rise.min() < 0.7 * rise.max()


def test_heat_of_points_that_lose_their_partner_is_kept():
    slabs = over_the_edge(0.0, (0.03, 0.01))
    rows = slabs.run(0.7, 0.1)
    kept = 1.4 * heat_of(rows, "lower")[-1] + heat_of(rows, "upper")[-1]
    assert kept == pytest.approx(rows["energy_friction"][-1], rel=1e-9)
    hits = slabs.pair.passes[0].partners().hits
    assert len(hits.points) < slabs.pair.passes[0].points.weights.size
    # what has lost the slab faces itself, and keeps what it generated last
    free = np.setdiff1d(np.arange(slabs.pair.passes[0].points.weights.size), hits.points)
    value = {name: v.ravel()[free] for name, v in slabs.contact.passes[0].exchange.values.items()}
    np.testing.assert_array_equal(value["temperature_plus"], value["temperature_minus"])
    taken = -value["flux_plus"] - value["flux_minus"]
    assert taken.min() == 0 < taken.max()


def elastic(gdim=2, two_pass=False, comm=MPI.COMM_WORLD):
    """A soft block, pressed on a soft slab and drawn over several of its facets."""
    b = two(gdim, overhang=0.5, comm=comm)
    pair = b.pair(friction=Coulomb(MU), two_pass=two_pass)
    path = [lambda t: 0.2 * t, *[0.0] * (gdim - 2), lambda t: -0.05 * min(t, 1)]
    supports = b.drive(0, 0, [0.0] * gdim) + b.drive(1, 1, path, "top")
    mechanics = Mechanics(b.state, [Solid(b.state, NeoHookean(E, 0.3)), pair], supports)
    contact, heat = heat_problem(b, pair, ContactHeat(30.0, 10.0, capacity=0.01), initial=(310.0, 300.0))
    return contact, ThermoMechanics(mechanics, heat)


CONTROL = StepControl(first=0.25, largest=0.25, line_searches=LINE_SEARCHES)


@pytest.mark.mpi
@pytest.mark.parametrize("two_pass", [False, True], ids=["one pass", "two passes"])
def test_elastic_bodies(two_pass):
    contact, problem = elastic(two_pass=two_pass)
    rows = history(problem, 3.0, CONTROL)
    check(rows)
    assert problem.heat.terms[-1] is contact and contact.passes[0].pattern > 2
    np.testing.assert_allclose(rows["heat_friction"], rows["energy_friction"], rtol=1e-12)
    assert rows["heat_stored"][-1] == pytest.approx(rows["energy_friction"][-1], rel=1e-6)
    assert rows["pair_heat_flow_minus"][-1] > 0 > rows["pair_heat_flow_plus"][-1]  # from the hot slab to the block
    assert (np.diff(rows["pair_entropy"]) > 0).all()


# -- state ------------------------------------------------------------------------------------------------------------


def test_rollback():
    """A step that is given up leaves no trace."""
    contact, problem = elastic()
    history(problem, 1.0, CONTROL)

    def snapshot():
        exchange = contact.passes[0].exchange
        T = contact.temperature
        books = [*problem.heat.trial_audit.entries.values(), exchange.entropy]
        return [T.value.x.array.copy(), T.old.x.array.copy(), np.array(books), *exchange.values.values()]

    before = snapshot()
    begin(problem, 1.4)
    assert problem.solve("basic").converged
    problem.evaluate()
    changed = snapshot()
    problem.state.rollback()
    for old, new in zip(before, snapshot(), strict=True):
        np.testing.assert_array_equal(old, new)
    assert not np.array_equal(before[0], changed[0]) and not np.array_equal(before[2], changed[2])
    undisturbed = elastic()[1]
    ends = [history(p, 2.0, CONTROL) for p in (problem, undisturbed)]
    for name in ("pair_entropy", "heat_stored", "temperature_max", "pair_temperature_max"):
        assert ends[0][name][-1] == pytest.approx(ends[1][name][-1], rel=1e-9)


@pytest.mark.mpi
@pytest.mark.skipif(MPI.COMM_WORLD.size == 1, reason="compares several ranks with one")
def test_same_on_any_number_of_ranks():
    ends = [history(elastic(3, True, comm)[1], 1.5, CONTROL) for comm in (MPI.COMM_SELF, MPI.COMM_WORLD)]
    for name in ends[0]:
        if name.startswith(("heat", "pair_heat", "temperature", "pair_entropy", "lower", "upper")):
            scale = np.abs(ends[0][name]).max()
            np.testing.assert_allclose(ends[1][name], ends[0][name], rtol=0, atol=1e-7 * (scale + 1), err_msg=name)


@pytest.mark.mpi
def test_refusal():
    b, other = two(2), two(2)
    T = Temperature(other.state, fem.functionspace(other.state.mesh, ("Lagrange", 1)), 300.0)
    with pytest.raises(ValueError, match="pair made with the state of the temperature"):
        PairHeat(T, b.pair(), LAW)
    cubic = Temperature(other.state, fem.functionspace(other.state.mesh, ("Lagrange", 3)), 300.0)
    with pytest.raises(ValueError, match="degree = 3"):
        PairHeat(cubic, other.pair(), LAW)
    body = HeatBody(T, density=1.0, capacity=1.0, conductivity=1.0)
    with pytest.raises(ValueError, match="names"):
        HeatTransfer(T, [body, *(PairHeat(T, other.pair(), LAW) for _ in range(2))])
