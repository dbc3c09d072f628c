"""Heat across a crack and into a tool: conductance, sharing of dissipation, capacity, gaps, entropy, conservation."""

import numpy as np
import pytest
from dolfinx import fem
from mpi4py import MPI
from scipy.linalg import expm

from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.staggered import ThermoMechanics
from cutsim.analysis.stepping import StepControl
from cutsim.fields.points import Surface
from cutsim.fields.space import cracked_space
from cutsim.fields.temperature import Temperature
from cutsim.heat.boundary import PrescribedTemperature
from cutsim.heat.conduction import HeatBody
from cutsim.heat.contact_heat import AdiabaticTool, ContactHeat
from cutsim.heat.interface_heat import InterfaceHeat
from cutsim.heat.tool_heat import ToolHeat
from cutsim.heat.transfer import HeatTransfer
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.friction import Coulomb
from cutsim.tools.shapes import Plane, ToolPath
from cutsim.tools.tool_contact import ToolContact
from helpers.blocks import make_blocks
from helpers.runs import history

STIFFNESS, DEPTH = 10.0, 0.02
PRESSURE = STIFFNESS * DEPTH
K = {"lower": 2.0, "upper": 0.5}
CAPACITY = {"lower": 1.5, "upper": 3.0}  # ρ c
STEADY = StepControl.fixed(1e9)
LAW = ContactHeat(gamma_plus=3.0, gamma_minus=1.0)


class Rubbing:
    """Friction that dissipates the same everywhere and in every step."""

    def __init__(self, crack, energy):
        self._energy = np.full_like(crack.points.weights, energy)

    def dissipation(self):
        return self._energy


class Slabs:
    """The two blocks pressed together, or apart, as rigid bodies; heat crosses the crack."""

    def __init__(
        self,
        law=LAW,
        depth=DEPTH,
        n=4,
        gdim=2,
        k=K,
        capacity=CAPACITY,
        initial=(300.0, 300.0),
        energy=0.0,
        ends=(),
        comm=MPI.COMM_WORLD,
    ):
        b = make_blocks(gdim, n, comm)
        space = cracked_space(b.state.mesh, ("Lagrange", 1), b.facets)
        start = fem.Function(space)
        for cells, value in zip((b.lower, b.upper), initial, strict=True):
            start.interpolate(lambda x, value=value: np.full(x.shape[1], value), cells)
        self.T = Temperature(b.state, space, start)
        crack = b.crack(None, contact=PenaltyContact(STIFFNESS))
        still, moved = [0.0] * gdim, [0.0] * (gdim - 1) + [lambda _: -depth]
        mechanics = Mechanics(b.state, [b.solid(), crack], b.drive(b.lower, still) + b.drive(b.upper, moved))
        bodies = [
            HeatBody(self.T, density=1.0, capacity=capacity[name], conductivity=k[name], body=cells, name=name)
            for name, cells in (("lower", b.lower), ("upper", b.upper))
        ]
        self.contact = InterfaceHeat(self.T, crack, law, Rubbing(crack, energy) if energy else None)
        faces = zip((0.0, 1.0), ends, ("bottom", "top"), strict=False)
        held = [PrescribedTemperature(self.T, b.face(gdim - 1, at), value, name=name) for at, value, name in faces]
        self.problem = ThermoMechanics(mechanics, HeatTransfer(self.T, [*bodies, self.contact], held))

    def run(self, until, step):
        rows = history(self.problem, until, StepControl.fixed(step))
        assert np.abs(rows["heat_closure"]).max() < 1e-9
        assert rows["crack_contact_dissipation_min"].min() >= -1e-12 * max(1.0, rows["crack_temperature_max"].max())
        return rows

    def values(self, name):
        """Smallest and largest value at the points of the crack."""
        points, v = self.contact.exchange.points, self.contact.exchange.point_values(name)
        return -points.maximum(-v), points.maximum(v)


def heat_of(rows, name, start=300.0):
    """Heat stored in a block of half a unit of volume."""
    return 0.5 * CAPACITY[name] * (rows[f"{name}_temperature"] - start)


# -- conduction through the contact -----------------------------------------------------------------------------------


@pytest.mark.mpi
@pytest.mark.parametrize("gdim", [2, 3])
def test_steady_slabs(gdim):
    """Jump and flux with the conductance p γ⁺γ⁻/(γ⁺+γ⁻) (theory §3.4)."""
    hot, cold = 380.0, 300.0
    slabs = Slabs(ends=(hot, cold), gdim=gdim, n=2)
    rows = slabs.run(3e9, 1e9)
    conductance = PRESSURE * 3.0 * 1.0 / (3.0 + 1.0)
    flux = (hot - cold) / (0.5 / K["lower"] + 1 / conductance + 0.5 / K["upper"])
    for name, expected in (("flux_plus", flux), ("flux_minus", -flux)):
        np.testing.assert_allclose(slabs.values(name), expected, rtol=1e-9)
    jump = np.subtract(slabs.values("temperature_plus"), slabs.values("temperature_minus"))
    np.testing.assert_allclose(jump, flux / conductance, rtol=1e-9)
    assert rows["bottom_heat_flow"][-1] == pytest.approx(flux, rel=1e-9)
    assert rows["top_heat_flow"][-1] == pytest.approx(-flux, rel=1e-9)
    # T_c lies between the faces, nearer to the better conductor
    drop = slabs.values("temperature_plus")[0] - slabs.values("temperature")[0]
    assert drop == pytest.approx(flux / (3.0 * PRESSURE), rel=1e-9)


def test_entropy_of_conduction():
    """Contact dissipation (4.62) and entropy of a steady flux in closed form."""
    slabs = Slabs(ends=(380.0, 300.0))
    rows = slabs.run(2e9, 5e8)
    flux = slabs.values("flux_plus")[0]
    plus, minus, contact = (slabs.values(f"temperature{s}")[0] for s in ("_plus", "_minus", ""))
    dissipation = flux * (plus - contact) / plus + flux * (contact - minus) / minus
    np.testing.assert_allclose(slabs.values("dissipation"), dissipation, rtol=1e-9)
    produced = np.diff(rows["crack_entropy"])[-1] / 5e8
    assert produced == pytest.approx(flux * (1 / minus - 1 / plus), rel=1e-9)
    assert np.diff(rows["crack_entropy"]).min() > 0


def layers(time, conductance, cells=200):
    """Mean temperatures of the slabs, one hot at first, by finite volumes and a matrix exponential."""
    h = 0.5 / cells
    k = np.repeat([K["lower"], K["upper"]], cells)
    links = np.append(np.full(cells - 1, K["lower"]), [0.0, *np.full(cells - 1, K["upper"])]) / h
    links[cells - 1] = 1 / (h / 2 / k[0] + 1 / conductance + h / 2 / k[-1])
    matrix = np.diag(links, 1) + np.diag(links, -1)
    matrix -= np.diag(matrix.sum(axis=1))
    matrix /= h * np.repeat([CAPACITY["lower"], CAPACITY["upper"]], cells)[:, None]
    T = expm(time * matrix) @ np.repeat([400.0, 300.0], cells)
    return T[:cells].mean(), T[cells:].mean(), T[cells - 1], T[cells]


def test_transient_slabs():
    """A hot slab on a cold one: mean temperatures against a fine finite-volume solution, to 1 % of their change."""
    until = 0.4
    slabs = Slabs(initial=(400.0, 300.0), n=16)
    rows = slabs.run(until, until / 100)
    lower, upper, face_lower, face_upper = layers(until, PRESSURE * 0.75)
    assert rows["upper_temperature"][-1] - 300 == pytest.approx(upper - 300, rel=0.01)
    assert rows["lower_temperature"][-1] - 400 == pytest.approx(lower - 400, rel=0.01)
    jump = slabs.values("temperature_plus")[0] - slabs.values("temperature_minus")[0]
    assert jump == pytest.approx(face_lower - face_upper, rel=0.01)


@pytest.mark.parametrize("gap", [0.0, 0.7])
def test_open_gap(gap):
    """Insulated, or with its own conductance."""
    slabs = Slabs(ContactHeat(3.0, 1.0, gap_conductance=gap), depth=-0.1, ends=(400.0, 300.0), initial=(350.0, 330.0))
    step = 1e9 if gap else 0.1
    slabs.run(3 * step, step)
    flux = 100 / (0.5 / K["lower"] + 1 / gap + 0.5 / K["upper"]) if gap else 0.0
    np.testing.assert_allclose(slabs.values("flux_plus"), flux, rtol=1e-9, atol=1e-12)


# -- dissipation ------------------------------------------------------------------------------------------------------


@pytest.mark.mpi
@pytest.mark.parametrize("depth", [DEPTH, -0.1], ids=["closed", "open"])
@pytest.mark.parametrize("capacity", [0.0, 0.3])
def test_insulated_pair_keeps_all_heat(depth, capacity):
    """Σ m c ΔT plus what the interface holds is the dissipation, also where there is no way for it."""
    slabs = Slabs(ContactHeat(3.0, 1.0, capacity=capacity), depth=depth, energy=0.2)
    rows = slabs.run(1.0, 0.1)
    total = 0.2 * np.arange(1, 11)
    np.testing.assert_allclose(rows["heat_friction"], total, rtol=1e-12)
    interface = capacity * (slabs.values("temperature")[1] - 300)
    bodies = heat_of(rows, "lower")[-1] + heat_of(rows, "upper")[-1]
    assert bodies + interface == pytest.approx(total[-1], rel=1e-10)
    if depth < 0 < capacity:
        assert bodies == pytest.approx(0, abs=1e-9), "an open interface with a capacity keeps its heat"


@pytest.mark.parametrize("depth", [DEPTH, -0.1], ids=["closed", "open"])
def test_dissipation_is_shared_by_conductance(depth):
    """At equal temperatures q± = −γ±/(γ⁺+γ⁻) D, also in the limit of no pressure."""
    slabs = Slabs(depth=depth, energy=1e-3, capacity={"lower": 1e9, "upper": 1e9})
    slabs.run(0.1, 0.1)
    np.testing.assert_allclose(slabs.values("flux_plus"), -0.75 * 1e-2, rtol=1e-7)
    np.testing.assert_allclose(slabs.values("flux_minus"), -0.25 * 1e-2, rtol=1e-7)


def test_perfect_contact_shares_by_effusivity():
    """γ p → ∞, times too short for the heat to reach the ends: shares as √(kρc), not as γ."""
    k, capacity = {"lower": 1.0, "upper": 4.0}, {"lower": 1.0, "upper": 1.0}
    slabs = Slabs(ContactHeat(3e6, 1e6), n=48, k=k, capacity=capacity, energy=1e-2)
    rows = slabs.run(0.01, 0.01 / 40)
    lower, upper = (rows[f"{name}_temperature"][-1] - 300 for name in ("lower", "upper"))
    assert upper / lower == pytest.approx(2.0, rel=0.02)
    face = slabs.values("temperature")[0] - 300
    rate = 1e-2 / (0.01 / 40)
    assert face == pytest.approx(2 * rate / 3.0 * np.sqrt(0.01 / np.pi), rel=0.02)


def test_interface_with_capacity():
    """Two well-conducting blocks and the interface between them: three temperatures, an exact exponential."""
    capacity, energy, step, steps = 0.4, 1e-3, 0.01, 200
    slabs = Slabs(ContactHeat(3.0, 1.0, capacity=capacity), k={"lower": 1e2, "upper": 1e2}, energy=energy)
    rows = slabs.run(step * steps, step)
    masses = np.array([0.5 * CAPACITY["lower"], 0.5 * CAPACITY["upper"], capacity])
    a, b = 3.0 * PRESSURE, 1.0 * PRESSURE
    matrix = np.zeros((4, 4))  # the last column is the source
    matrix[:3, :3] = [[-a, 0, a], [0, -b, b], [a, b, -a - b]]
    matrix[2, 3] = energy / step
    matrix[:3] /= masses[:, None]
    exact = expm(matrix * step * steps) @ [0, 0, 0, 1]
    found = [rows["lower_temperature"][-1], rows["upper_temperature"][-1], slabs.values("temperature")[0]]
    np.testing.assert_allclose(np.subtract(found, 300), exact[:3], rtol=0.01)
    stored = rows["heat_stored"][-1]
    assert stored == pytest.approx(energy * steps, rel=1e-9)


def test_fraction_of_fracture():
    """What breaks the bond heats the blocks, as far as the law says."""
    heats = []
    for fraction in (1.0, 0.4):
        b = make_blocks()
        T = Temperature(b.state, cracked_space(b.state.mesh, ("Lagrange", 1), b.facets), 300.0)
        crack = b.crack()
        mechanics = Mechanics(
            b.state, [b.solid(), crack], b.drive(b.lower, [0, 0]) + b.drive(b.upper, [0, lambda t: 0.5 * t])
        )
        body = HeatBody(T, density=1, capacity=1, conductivity=1)
        heat = HeatTransfer(T, [body, InterfaceHeat(T, crack, ContactHeat(3.0, 1.0, fracture_fraction=fraction))])
        rows = history(ThermoMechanics(mechanics, heat), 1.0, StepControl.fixed(0.05))
        np.testing.assert_allclose(rows["heat_fracture"], fraction * rows["energy_fracture"], rtol=1e-9, atol=1e-15)
        heats.append(rows["body_temperature"][-1] - 300)
        assert rows["heat_closure"][-1] == pytest.approx(0, abs=1e-9)
    assert heats[1] == pytest.approx(0.4 * heats[0], rel=1e-9)


# -- tools ------------------------------------------------------------------------------------------------------------


def uncracked():
    b = make_blocks()
    T = Temperature(b.state, fem.functionspace(b.state.mesh, ("Lagrange", 1)), 300.0)
    return InterfaceHeat(T, b.crack(None), LAW)


def under_tool(law, temperature=None, held=300.0, mu=None, speed=0.0):
    """A block held rigidly under a plane that presses it and slides along it."""
    b = make_blocks()
    top = Surface.exterior(b.state, b.face(1, 1.0))
    path = ToolPath(lambda t: np.array([0.5 + speed * t, 1 - DEPTH]))
    friction = None if mu is None else Coulomb(mu, stiffness=1e6)
    tool = ToolContact(b.state, Plane((0.0, -1.0)), path, [top], contact=PenaltyContact(STIFFNESS), friction=friction)
    cells = np.union1d(b.lower, b.upper)
    mechanics = Mechanics(b.state, [b.solid(), tool], b.drive(cells, [0, 0]))
    T = Temperature(b.state, fem.functionspace(b.state.mesh, ("Lagrange", 1)), 300.0)
    body = HeatBody(T, density=1.0, capacity=2.0, conductivity=0.5)
    ends = [] if held is None else [PrescribedTemperature(T, b.face(1, 0.0), held, name="bottom")]
    return ThermoMechanics(mechanics, HeatTransfer(T, [body, ToolHeat(T, tool, law, temperature)], ends))


@pytest.mark.mpi
def test_steady_tool():
    rows = history(under_tool(LAW, temperature=400.0), 3e9, STEADY)
    flow = 100.0 / (1 / (PRESSURE * 0.75) + 1 / 0.5)
    assert rows["bottom_heat_flow"][-1] == pytest.approx(-flow, rel=1e-8)
    assert rows["tool_heat_flow"][-1] == pytest.approx(-flow, rel=1e-8)
    assert rows["tool_contact_dissipation_min"][-1] > 0
    assert np.abs(rows["heat_closure"]).max() < 1e-9


@pytest.mark.mpi
@pytest.mark.parametrize("share", [0.0, 0.6, 1.0])
def test_adiabatic_tool(share):
    """Its friction μ p s heats the body by the share, and the rest goes into the tool."""
    problem = under_tool(AdiabaticTool(share), held=None, mu=0.3, speed=2.0)
    rows = history(problem, 1.0, StepControl.fixed(0.1))
    # the first step is the mean of no traction and full traction
    work = 0.3 * PRESSURE * 2.0 * (rows["time"] - 0.05)
    np.testing.assert_allclose(rows["heat_friction"], rows["energy_friction"], rtol=1e-9)
    np.testing.assert_allclose(rows["heat_friction"], work, rtol=1e-3)
    np.testing.assert_allclose(2.0 * (rows["body_temperature"] - 300), share * rows["heat_friction"], atol=1e-9)
    np.testing.assert_allclose(rows["heat_outflow"], (1 - share) * rows["heat_friction"], atol=1e-12)
    assert np.abs(rows["heat_closure"]).max() < 1e-9


def test_tool_at_the_temperature_of_the_body_shares_by_conductance():
    problem = under_tool(LAW, temperature=300.0, held=None, mu=0.3, speed=2.0)
    problem.heat.terms[0]._heat_capacity.value = 1e12
    rows = history(problem, 0.1, StepControl.fixed(0.1))
    assert rows["heat_outflow"][-1] == pytest.approx(0.25 * rows["heat_friction"][-1], rel=1e-6)


@pytest.mark.mpi
def test_tool_on_one_face_of_a_crack():
    """A plane between open faces warms the one it touches."""
    b = make_blocks()
    T = Temperature(b.state, cracked_space(b.state.mesh, ("Lagrange", 1), b.facets), 300.0)
    crack = b.crack(None)
    path = ToolPath(lambda t: np.array([0.5, 0.5 - DEPTH]))
    tool = ToolContact(b.state, Plane((0.0, -1.0)), path, [crack.surface("+")], contact=PenaltyContact(STIFFNESS))
    mechanics = Mechanics(b.state, [b.solid(), crack, tool], b.drive(b.lower, [0, 0]) + b.drive(b.upper, [0, 1.0]))
    bodies = [
        HeatBody(T, density=1.0, capacity=2.0, conductivity=0.5, body=cells, name=name)
        for cells, name in ((b.lower, "lower"), (b.upper, "upper"))
    ]
    terms = [*bodies, InterfaceHeat(T, crack, LAW), ToolHeat(T, tool, LAW, 400.0)]
    bottom = PrescribedTemperature(T, b.face(1, 0.0), 300.0)
    # long enough to be steady below, and the upper block is insulated
    rows = history(ThermoMechanics(mechanics, HeatTransfer(T, terms, [bottom])), 300.0, StepControl.fixed(10.0))
    assert rows["tool_heat_flow"][-1] == pytest.approx(-100.0 / (1 / (PRESSURE * 0.75) + 0.5 / 0.5), rel=1e-6)
    assert rows["upper_temperature_max"][-1] == pytest.approx(300.0, abs=1e-9)


# -- refusals ---------------------------------------------------------------------------------------------------------

BAD = {
    "gamma_plus = 0": lambda: ContactHeat(0, 1),
    "gamma_minus = -1": lambda: ContactHeat(1, -1),
    "capacity = -1": lambda: ContactHeat(1, 1, capacity=-1),
    "gap_conductance = -2": lambda: ContactHeat(1, 1, gap_conductance=-2),
    "fracture_fraction = 1.5": lambda: ContactHeat(1, 1, fracture_fraction=1.5),
    "share = 2": lambda: AdiabaticTool(2),
    "tool_temperature = None": lambda: under_tool(LAW),
    "tool_temperature = 300": lambda: under_tool(AdiabaticTool(0.5), 300.0),
    "tool_temperature = -1": lambda: under_tool(LAW, -1.0),
    "on a space cracked along the crack": uncracked,
    "law.capacity = 1": lambda: under_tool(ContactHeat(1, 1, capacity=1.0), 300.0),
}


@pytest.mark.parametrize("message", BAD)
def test_bad_input_is_refused(message):
    with pytest.raises(ValueError, match=message):
        BAD[message]()


# -- ranks ------------------------------------------------------------------------------------------------------------


@pytest.mark.mpi
def test_ranks_agree():
    """All contributions together, against the same run on one rank."""
    results = []
    for comm in (MPI.COMM_WORLD, MPI.COMM_SELF):
        law = ContactHeat(3.0, 1.0, capacity=0.2)
        results.append(Slabs(law, initial=(400.0, 300.0), energy=0.5, ends=(400.0,), comm=comm).run(1.0, 0.2))
    for name in results[0]:
        if "closure" not in name and "dissipation" not in name and name not in ("newton", "krylov"):
            np.testing.assert_allclose(results[0][name], results[1][name], rtol=1e-9, atol=1e-9, err_msg=name)
