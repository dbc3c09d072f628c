"""Heat in a body: patch test, rates, closed forms, conduction of the deformed shape, conservation, bad input."""

import numpy as np
import pytest
from dolfinx import fem, mesh
from mpi4py import MPI

from cutsim.analysis.stepping import StepControl, run
from cutsim.base.compat import cell_partitioner
from cutsim.bodies.solid import Solid
from cutsim.fields.state import State
from cutsim.fields.temperature import Temperature
from cutsim.heat.boundary import Convection, HeatFlux, PrescribedTemperature
from cutsim.heat.conduction import HeatBody
from cutsim.heat.transfer import HeatTransfer
from cutsim.materials.elastic import NeoHookean
from helpers.blocks import make_blocks
from helpers.runs import history
from helpers.tangents import slopes

RHO, C, K = 2.0, 3.0, 0.5
BODY = {"density": RHO, "capacity": C, "conductivity": K}
STEADY = StepControl.fixed(1e9)


class Bar:
    """A rectangle, the first axis being its length, with heat in it."""

    def __init__(self, cells=(4, 1), size=(1.0, 1.0), initial=300.0, degree=1, **options):
        partitioner = cell_partitioner()
        corners = [(0.0, 0.0), size]
        quads = mesh.CellType.quadrilateral
        domain = mesh.create_rectangle(MPI.COMM_WORLD, corners, cells, quads, partitioner=partitioner)
        self.state = State(fem.functionspace(domain, ("Lagrange", 1, (2,))))
        self.size = size
        space = fem.functionspace(domain, ("Lagrange", degree))
        self.T = Temperature(self.state, space, initial, **options)

    def face(self, axis, at):
        return mesh.locate_entities_boundary(self.state.mesh, 1, lambda x: np.isclose(x[axis], at))

    @property
    def left_half(self):
        return mesh.locate_entities(self.state.mesh, 2, lambda x: x[0] < 0.5 * self.size[0] + 1e-9)

    @property
    def ends(self):
        return self.face(0, 0.0), self.face(0, self.size[0])

    def hold(self, left, right):
        values = zip(self.ends, (left, right), ("left", "right"), strict=True)
        return [PrescribedTemperature(self.T, facets, value, name=name) for facets, value, name in values]


def nodal_error(T, exact):
    """Largest difference at a node from a function of the positions."""
    nodes = T.space.tabulate_dof_coordinates()
    local = np.abs(T.value.x.array - exact(nodes.T)).max(initial=0.0)
    return T.space.mesh.comm.allreduce(local, MPI.MAX)


@pytest.mark.mpi
@pytest.mark.parametrize("gdim", [2, 3])
def test_patch(gdim):
    """A linear temperature in a distorted mesh of an anisotropic, deformed body."""
    b = make_blocks(gdim)
    x = b.state.mesh.geometry.x
    inner = np.all((x[:, :gdim] > 0.01) & (x[:, :gdim] < 0.99), axis=1)
    x[inner, 0] += 0.1
    b.state.u.interpolate(lambda x: np.array([0.3 * x[0] + 0.1 * x[1], -0.2 * x[1], 0.1 * x[2]])[:gdim])
    b.state.commit()
    T = Temperature(b.state, fem.functionspace(b.state.mesh, ("Lagrange", 1)), 300.0)
    k = np.diag([1.0, 2.0, 3.0])[:gdim, :gdim] + 0.3
    slope = np.array([20.0, -10.0, 5.0])[:gdim]
    body = HeatBody(T, **{**BODY, "conductivity": k})
    outside = mesh.locate_entities_boundary(b.state.mesh, gdim - 1, lambda x: np.full(x.shape[1], True))
    exact = fem.Function(T.space)
    exact.interpolate(lambda x: 300 + slope @ x[:gdim])
    held = PrescribedTemperature(T, outside, 300.0)
    held.bc = fem.dirichletbc(exact, held.bc.dof_indices()[0])
    run(HeatTransfer(T, [body], [held]), 3e9, STEADY)
    assert nodal_error(T, lambda x: 300 + slope @ x[:gdim]) < 1e-9


def decay(n, dt, degree=1, steps=None):
    """Error of the first mode of a bar with cold ends, after a tenth of its time constant L²/α."""
    until = 0.1 * RHO * C / K
    bar = Bar((n, 1), initial=lambda x: 300 + np.sin(np.pi * x[0]), degree=degree)
    run(HeatTransfer(bar.T, [HeatBody(bar.T, **BODY)], bar.hold(300, 300)), until, StepControl.fixed(dt * until))
    return nodal_error(bar.T, lambda x: 300 + np.sin(np.pi * x[0]) * np.exp(-0.1 * np.pi**2))


def test_rate_in_space():
    n = np.array([4, 8, 16])
    errors = [decay(i, 0.8 / i**2) for i in n]
    assert slopes(1 / n, errors).min() > 1.9, errors


def test_rate_in_time():
    steps = np.array([1 / 10, 1 / 20, 1 / 40])
    errors = [decay(8, dt, degree=2) for dt in steps]
    assert 0.9 < slopes(steps, errors).min() < slopes(steps, errors).max() < 1.1, errors


def test_heated_half_space():
    """Constant flux into a bar that is long for the time: T = 2 q √(αt/π)/k at its end (theory §7), no undershoot."""
    q, until, length = 2.0, 1.0, 4.0
    bar = Bar((160, 1), (length, 0.1), initial=300.0)
    heat = HeatTransfer(bar.T, [HeatBody(bar.T, **BODY), HeatFlux(bar.T, bar.ends[0], q)])
    rows = history(heat, until, StepControl.fixed(until / 100))
    rise = 2 * q / K * np.sqrt(K / (RHO * C) * until / np.pi)
    assert rows["temperature_max"][-1] - 300 == pytest.approx(rise, rel=2e-3)
    assert rows["temperature_min"].min() > 300 - 1e-9
    np.testing.assert_allclose(rows["heat_stored"], q * 0.1 * rows["time"], rtol=1e-9)


@pytest.mark.mpi
@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_deformed_bar_conducts_as_its_shape(plane):
    """Stretched λ₁ along the flow, λ₂ across, and λ₃ in thickness: flow k ΔT λ₂ λ₃/λ₁ per unit section."""
    along, across, rise = 1.5, 0.8, 20.0
    bar = Bar()
    bar.state.u.interpolate(lambda x: np.array([(along - 1) * x[0], (across - 1) * x[1]]))
    bar.state.commit()
    solid = Solid(bar.state, NeoHookean(1.0, 0.3), plane=plane, density=RHO)
    ends = bar.hold(300 + rise, 300)
    heat = HeatTransfer(bar.T, [HeatBody(bar.T, capacity=C, conductivity=K, body=solid)], ends)
    rows = history(heat, 3e9, STEADY)
    thickness = 1.0
    if plane == "stress":
        G, lame = 1 / 2.6, 0.3 / 1.3 / 0.4
        for _ in range(30):
            residual = G * (thickness**2 - 1) + lame * np.log(along * across * thickness)
            thickness -= residual / (2 * G * thickness + lame / thickness)
    flow = K * rise * across * thickness / along
    assert rows["left_heat_flow"][-1] == pytest.approx(flow, rel=1e-8)
    assert rows["right_heat_flow"][-1] == pytest.approx(-flow, rel=1e-8)


@pytest.mark.mpi
def test_heat_is_conserved():
    """Source and flux, both varying in time, in an insulated body of two materials."""
    b = make_blocks(3)
    T = Temperature(b.state, fem.functionspace(b.state.mesh, ("Lagrange", 1)), 300.0)
    bodies = [
        HeatBody(T, density=RHO, capacity=C, conductivity=K, body=b.lower, source=lambda t: 1 + t, name="lower"),
        HeatBody(T, density=2 * RHO, capacity=C, conductivity=3 * K, body=b.upper, name="upper"),
    ]
    flux = HeatFlux(T, b.face(0, 1.0), lambda t: 2 * t)
    rows = history(HeatTransfer(T, [*bodies, flux]), 1.0, StepControl.fixed(0.1))
    times = np.linspace(0.1, 1, 10)
    supplied = np.cumsum(0.1 * (0.5 * (1 + times) + 2 * times))
    stored = RHO * C / 2 * (rows["lower_temperature"] - 300 + 2 * (rows["upper_temperature"] - 300))
    np.testing.assert_allclose(stored, supplied, rtol=1e-9)
    np.testing.assert_allclose(rows["heat_source"] + rows["heat_inflow"], supplied, rtol=1e-9)
    assert np.abs(rows["heat_closure"]).max() < 1e-9


def test_convection():
    """A wall between a held temperature and a fluid: q = ΔT/(L/k + 1/h); a small hot body cools exponentially."""
    h, hot, ambient = 0.4, 350.0, 300.0
    bar = Bar()
    cooling = Convection(bar.T, bar.ends[1], h, ambient)
    held = PrescribedTemperature(bar.T, bar.ends[0], hot, name="left")
    rows = history(HeatTransfer(bar.T, [HeatBody(bar.T, **BODY), cooling], [held]), 3e9, STEADY)
    flow = (hot - ambient) / (1 / K + 1 / h)
    assert rows["left_heat_flow"][-1] == pytest.approx(flow, rel=1e-8)
    assert rows["convection_heat_flow"][-1] == pytest.approx(-flow, rel=1e-8)
    bar = Bar(initial=hot)
    body = HeatBody(bar.T, density=RHO, capacity=C, conductivity=1e4)
    time = RHO * C / h
    heat = HeatTransfer(bar.T, [body, Convection(bar.T, bar.ends[1], h, ambient)])
    rows = history(heat, time, StepControl.fixed(time / 400))
    assert rows["body_temperature"][-1] - ambient == pytest.approx((hot - ambient) * np.exp(-1), rel=2e-3)
    assert np.abs(rows["heat_closure"]).max() < 1e-9


@pytest.mark.mpi
def test_prescribed_temperatures_agree_where_they_meet():
    """What two hold counts once, and the books close; unequal temperatures of one node are refused."""
    bar = Bar(cells=(4, 2))
    ends = bar.hold(310.0, 300.0)

    def heat(value):
        below = PrescribedTemperature(bar.T, bar.face(1, 0.0), value, name="below")
        return HeatTransfer(bar.T, [HeatBody(bar.T, **BODY)], [ends[0], below])

    with pytest.raises(
        ValueError, match=r"temperatures 'left' and 'below' prescribe T = 310 and 300 .* 1 nodes .* \(0, 0\)"
    ):
        heat(300.0)
    with pytest.raises(ValueError, match=r"T = 310 and 315 at time 0.5"):
        run(heat(lambda t: 310 + 10 * t), 1.0, StepControl.fixed(0.5))
    rows = history(heat(310.0), 1.0, StepControl.fixed(0.5))
    assert np.abs(rows["heat_closure"]).max() < 1e-9
    stored = RHO * C * (rows["body_temperature"][-1] - 300)
    assert 0.5 * (rows["left_heat_flow"] + rows["below_heat_flow"]).sum() == pytest.approx(stored, rel=1e-9)


def test_prescribed_flux_and_temperature():
    """Steady: the slope is q/k; a temperature ramped at a rate stores ρ c rate far from the start."""
    bar, q = Bar(), 5.0
    heat = HeatTransfer(bar.T, [HeatBody(bar.T, **BODY), HeatFlux(bar.T, bar.ends[1], q)], bar.hold(310, 310)[:1])
    run(heat, 3e9, STEADY)
    assert nodal_error(bar.T, lambda x: 310 + q / K * x[0]) < 1e-7
    bar, rate = Bar(), 2.0
    ramp = [
        PrescribedTemperature(bar.T, f, lambda t: 300 + rate * t, name=n) for f, n in zip(bar.ends, "ab", strict=True)
    ]
    rows = history(HeatTransfer(bar.T, [HeatBody(bar.T, **BODY)], ramp), 40.0, StepControl.fixed(0.5))
    assert rows["a_heat_flow"][-1] + rows["b_heat_flow"][-1] == pytest.approx(RHO * C * rate, rel=1e-6)
    assert np.abs(rows["heat_closure"]).max() < 1e-9


def test_a_kink_is_met():
    bar = Bar()
    flux = HeatFlux(bar.T, bar.ends[0], lambda t: float(t <= 0.25), corners=(0.25,))
    rows = history(HeatTransfer(bar.T, [HeatBody(bar.T, **BODY), flux]), 1.0, StepControl.fixed(0.2))
    assert 0.25 in rows["time"]
    assert rows["heat_stored"][-1] == pytest.approx(0.25, rel=1e-9)


def test_celsius():
    """The same run in another unit; absolute zero is known."""
    bars = [Bar(initial=20.0, absolute_zero=-273.15), Bar(initial=293.15)]
    ends = []
    for bar in bars:
        heat = HeatTransfer(bar.T, [HeatBody(bar.T, **BODY), HeatFlux(bar.T, bar.ends[0], 1.0)])
        ends.append(history(heat, 1.0, StepControl.fixed(0.25))["body_temperature"])
    np.testing.assert_allclose(ends[0] + 273.15, ends[1], rtol=1e-12)


BAD = {
    "density = 0": lambda b: HeatBody(b.T, density=0, capacity=C, conductivity=K),
    "density = None": lambda b: HeatBody(b.T, capacity=C, conductivity=K),
    "capacity = -1": lambda b: HeatBody(b.T, density=1, capacity=-1, conductivity=K),
    "conductivity = -0.1": lambda b: HeatBody(b.T, density=1, capacity=C, conductivity=-0.1),
    "conductivity = nan": lambda b: HeatBody(b.T, density=1, capacity=C, conductivity=np.nan),
    "it must be symmetric": lambda b: HeatBody(b.T, density=1, capacity=C, conductivity=[[1, 0.5], [0, 1]]),
    "it must be >= 0": lambda b: HeatBody(b.T, density=1, capacity=C, conductivity=[[1, 2], [2, 1]]),
    "2 × 2 matrix": lambda b: HeatBody(b.T, density=1, capacity=C, conductivity=[1.0, 2.0]),
    "coefficient = -1": lambda b: Convection(b.T, b.ends[0], -1, 300),
    "ambient = -1": lambda b: Convection(b.T, b.ends[0], 1, -1.0),
    "value = -5": lambda b: PrescribedTemperature(b.T, b.ends[0], -5.0),
    "entities = 0": lambda b: PrescribedTemperature(b.T, np.array([], dtype=np.int32), 300),
    "facets = 0": lambda b: HeatFlux(b.T, np.array([], dtype=np.int32), 1.0),
    "initial = -1": lambda b: Temperature(b.state, b.T.space, -1.0),
    "initial = -300": lambda b: Temperature(b.state, b.T.space, -300.0, absolute_zero=-273.15),
    "initial = nan": lambda b: Temperature(b.state, b.T.space, np.nan),
    "a scalar space": lambda b: Temperature(b.state, b.state.V, 300.0),
    "a HeatBody for every cell": lambda b: HeatTransfer(b.T, [HeatFlux(b.T, b.ends[0], 1.0)]),
    "4 nodes have none": lambda b: HeatTransfer(b.T, [HeatBody(b.T, **BODY, body=b.left_half)]),
    "share 4 cells": lambda b: HeatTransfer(b.T, [HeatBody(b.T, **BODY), HeatBody(b.T, **BODY, name="twin")]),
    "different for all terms": lambda b: HeatTransfer(b.T, [HeatBody(b.T, **BODY), *2 * [HeatFlux(b.T, b.ends[0], 1)]]),
}


@pytest.mark.mpi
@pytest.mark.parametrize("message", BAD)
def test_bad_input_is_refused(message):
    with pytest.raises(ValueError, match=message):
        BAD[message](Bar())


def test_temperature_below_absolute_zero_is_refused_when_it_comes():
    bar = Bar()
    held = PrescribedTemperature(bar.T, bar.ends[0], lambda t: 300 - 400 * t)
    with pytest.raises(ValueError, match="value = -100"):
        run(HeatTransfer(bar.T, [HeatBody(bar.T, **BODY)], [held]), 1.0, StepControl.fixed(0.5))
