"""Prony series against exact convolutions: relaxation, cycles, dissipation, tangent, rollback."""

import numpy as np
import pytest
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI
from scipy.integrate import quad, simpson

from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.stepping import StepControl, begin
from cutsim.base.assembly import nodal_forces
from cutsim.base.compat import form
from cutsim.bodies.loads import Support
from cutsim.bodies.solid import Solid
from cutsim.bodies.spring import Spring
from cutsim.bodies.tensor_points import TensorPoints
from cutsim.fields.state import State
from cutsim.materials.elastic import IsochoricNeoHookean, NeoHookean, StVenantKirchhoff
from cutsim.materials.fibres import DispersedFibres, ExponentialFibres, Reinforced
from cutsim.materials.rubbers import Ogden, Yeoh
from cutsim.materials.viscoelastic import Prony
from cutsim.results.field_files import interpolate
from helpers.blocks import make_blocks
from helpers.examples import AXIS, MOONEY
from helpers.fields import smooth
from helpers.laws import NU, E
from helpers.materials import energy, name, stress
from helpers.runs import history
from helpers.tangents import assert_slope_two, slopes

PRONY = Prony((0.5, 0.8), (0.3, 2.0))
SVK = StVenantKirchhoff(E, NU)


class Cube:
    """The unit cube as one hexahedron, deformed homogeneously with time; x₁ is its driven face."""

    def __init__(self, material, deformation, prony=PRONY):
        domain = mesh.create_unit_cube(MPI.COMM_SELF, 1, 1, 1, mesh.CellType.hexahedron)
        self.state = State(fem.functionspace(domain, ("Lagrange", 1, (3,))))
        self.solid = Solid(self.state, material, relaxation=prony)
        self._deformation = deformation
        self._forces = form(self.solid.residual(ufl.TestFunction(self.state.V)))
        self._elastic = form(self.solid.strain_energy_density(self.state.u) * ufl.dx(degree=2))
        self._driven = np.isclose(self.state.V.tabulate_dof_coordinates()[:, 0], 1.0)

    def forces(self):
        return nodal_forces(self._forces)

    def elastic(self):
        """Strain energy without that of overstresses."""
        return fem.assemble_scalar(self._elastic)

    def step(self, time):
        """Traction on the driven face and viscous work, after a committed step to a time."""
        H = np.array(self._deformation(time)) - np.eye(3)
        self.state.begin(time)
        self.solid.begin()
        self.state.u.interpolate(lambda x: H @ x)
        self.solid.evaluate()
        traction = self.forces().reshape(-1, 3)[self._driven].sum(axis=0)
        self.state.commit()
        return traction, self.solid.energies()["viscous"]

    def run(self, times):
        tractions, works = zip(*(self.step(t) for t in times), strict=True)
        return np.array(tractions), np.array(works)


def straight(times, strains, modulus, at, prony=PRONY):
    """Σ ∫ gᵢ exp(−(t−s)/τᵢ) modulus dE for a strain that goes straight between instants, exactly."""
    h = np.zeros_like(at)
    for g, tau in zip(prony.strengths, prony.times, strict=True):
        for a, b, rate in zip(times, times[1:], np.diff(strains) / np.diff(times), strict=False):
            end = np.clip(at, a, b)
            h += g * modulus * rate * tau * (np.exp((end - at) / tau) - np.exp((a - at) / tau)) * (at > a)
    return h


def uniaxial(strain):
    """A deformation with a given Green–Lagrange strain along x₁, and no other."""
    return lambda t: np.diag([np.sqrt(1 + 2 * strain(t)), 1.0, 1.0])


LOADS = {
    "relaxation": ([0.0, 0.2, 9.0], [0.0, 0.3, 0.3]),
    "cycles": (np.arange(0.0, 8.5, 0.5), [0.0, *[0.2, 0.0, -0.2, 0.0] * 4]),
}


@pytest.mark.parametrize("load", LOADS)
def test_straight_strain_paths_are_exact(load):
    """S is linear in E: whatever the steps, those within a straight part of the path are exact."""
    instants, strains = LOADS[load]
    cube = Cube(SVK, uniaxial(lambda t: np.interp(t, instants, strains)))
    rng = np.random.default_rng(0)
    times = np.unique([*instants[1:], *rng.uniform(0, instants[-1], 30)])
    tractions, _ = cube.run(times)
    strain = np.interp(times, instants, strains)
    total = (2 * SVK.shear + SVK.lame) * strain + straight(instants, strains, 2 * SVK.shear, times)
    np.testing.assert_allclose(tractions[:, 0], np.sqrt(1 + 2 * strain) * total, atol=1e-12 * E)


@pytest.mark.parametrize("material", [IsochoricNeoHookean(E, 0.45), MOONEY], ids=name)
def test_cyclic_shear_of_nonlinear_solids(material):
    """Sinusoidal shear: the stress to 1e-6 of the exact convolution, with an error of second order in the step."""

    def F(t):
        return np.eye(3) + 0.6 * np.sin(2 * t) * np.outer([0, 1, 0], [1, 0, 0])

    def second(t):
        """Components of S that make the shear traction F S on x₁; no change of volume, no volumetric part."""
        S = np.linalg.solve(F(t), stress(material, F(t)))
        return S[0, :2]

    end, step = 2.3, 1e-4
    h = 0.0
    for g, tau in zip(PRONY.strengths, PRONY.times, strict=True):

        def rate(s, k, tau=tau):
            change = (8 * (second(s + step) - second(s - step)) - second(s + 2 * step) + second(s - 2 * step))[k]
            return np.exp((s - end) / tau) * change / (12 * step)

        h = h + g * np.array([quad(rate, 0, end, args=(k,), epsabs=1e-9, limit=200)[0] for k in (0, 1)])
    S = second(end) + h
    exact = F(end)[1, 0] * S[0] + S[1]
    counts = np.array([50, 100, 800])
    errors = [abs(Cube(material, F).run(np.linspace(0, end, n + 1)[1:])[0][-1, 1] / exact - 1) for n in counts]
    assert errors[-1] < 1e-6
    np.testing.assert_allclose(slopes(1 / counts, errors), 2, atol=0.1)


def test_hysteresis_loop_is_the_viscous_work():
    """Area of the loop of the supports' force, dissipation in the audit, and the closed form; in the steady state."""
    period, amplitude, cycles, n = 1.0, 0.1, 30, 400
    prony = Prony((0.5,), (0.3,))
    instants = np.arange(0, cycles + 0.125, 0.25)
    strains = np.resize([0.0, amplitude, 0.0, -amplitude], len(instants))
    coarse = np.setdiff1d(instants, [0.0])[: 4 * (cycles - 1)]
    fine = np.linspace(cycles - 1, cycles, n + 1)
    cube = Cube(SVK, uniaxial(lambda t: np.interp(t, instants, strains)), prony)
    cube.run(coarse)
    before = cube.solid.energies()
    tractions, works = cube.run(fine[1:])
    # Simpson's rule over each straight part of the path, in which the second stress is smooth
    second = np.array([tractions[-1, 0], *tractions[:, 0]]) / np.sqrt(1 + 2 * np.interp(fine, instants, strains))
    quarters = [slice(i * n // 4, (i + 1) * n // 4 + 1) for i in range(4)]
    loop = sum(simpson(second[q], x=np.interp(fine[q], instants, strains)) for q in quarters)
    # Maxwell element under a triangular wave: ∮ h dE per cycle of quarter T/4 with slope r
    tau, quarter, rate = 0.3, period / 4, amplitude / (period / 4)
    area = 4 * rate**2 * prony.strengths[0] * 2 * SVK.shear * tau * (quarter - tau * np.tanh(quarter / tau))
    assert loop == pytest.approx(area, rel=1e-7)
    assert works[-1] - before["viscous"] == pytest.approx(area, rel=1e-10)
    assert cube.solid.energies()["strain"] == pytest.approx(before["strain"], rel=1e-10)


SPLIT = [
    NeoHookean(E, NU),
    Ogden((0.8,), (4.0,), 2.0),
    Reinforced(NeoHookean(E, NU), (ExponentialFibres(AXIS, 0.8, 0.5, 2.0),)),
    Yeoh(0.2, -0.01, 0.01, 3.0),
]


@pytest.mark.parametrize("material", SPLIT, ids=name)
def test_work_is_stored_or_dissipated(material):
    """At constant volume, in three dimensions: work = stored + lost to second order, and what is lost never falls."""

    def F(t):
        s, c = np.sin(t), np.cos(1.7 * t)
        stretch = np.diag([np.exp(0.25 * s), np.exp(-0.4 * s + 0.1 * (1 - c)), np.exp(0.15 * s - 0.1 * (1 - c))])
        return stretch @ (np.eye(3) + 0.4 * np.sin(1.3 * t) * np.outer([1, 0, 0], [0, 1, 0]))

    def imbalance(n, end=4.0):
        cube, work, lost = Cube(material, F), 0.0, [0.0]
        forces, u = cube.forces(), cube.state.u.x.array.copy()
        for t in np.linspace(0, end, n + 1)[1:]:
            _, viscous = cube.step(t)
            new, moved = cube.forces(), cube.state.u.x.array - u
            work += 0.5 * (forces + new) @ moved
            forces, u = new, u + moved
            lost.append(viscous)
            assert cube.solid.energies()["strain"] > cube.elastic()
        assert np.all(np.diff(lost) > 0)
        return abs(work - cube.solid.energies()["strain"] - lost[-1]) / lost[-1]

    errors = np.array([imbalance(n) for n in (40, 80, 160)])
    assert errors[-1] < 2e-4
    np.testing.assert_allclose(slopes(1 / np.array([40, 80, 160]), errors), 2, atol=0.2)


@pytest.mark.parametrize("material", [NeoHookean(E, NU), IsochoricNeoHookean(E, 0.45)], ids=name)
def test_a_sudden_strain_stores_what_a_hold_dissipates(material):
    """Ψ = Σ g W right after a jump, which slow dashpots have no time to spend; all of it is lost in the end."""
    stretch = np.diag([1.5, 1.2, 1 / 1.8])
    cube = Cube(material, lambda t: stretch if t > 0 else np.eye(3))
    held = sum(PRONY.strengths) * energy(material, stretch)
    _, lost = cube.step(1e-7)
    assert 0 < lost < 1e-6 * held
    assert cube.solid.energies()["strain"] - cube.elastic() == pytest.approx(held, rel=1e-6)
    _, works = cube.run(1e-7 + np.geomspace(1e-3, 60.0, 1000))
    assert works[-1] == pytest.approx(held, rel=1e-4)
    assert cube.solid.energies()["strain"] == pytest.approx(cube.elastic(), rel=1e-9)


def test_changes_of_volume_cost_the_split_little():
    """An isochoric energy is not convex: 4 % of volume show in the balance, by less than that, and fall with it."""

    def imbalance(swelling):
        def F(t):
            shear = np.eye(3) + 0.5 * np.sin(1.3 * t) * np.outer([1, 0, 0], [0, 1, 0])
            return (1 + swelling * np.sin(2.3 * t)) ** (1 / 3) * shear

        cube, work, lost = Cube(MOONEY, F), 0.0, [0.0]
        forces, u = cube.forces(), cube.state.u.x.array.copy()
        for t in np.linspace(0, 4.0, 161)[1:]:
            lost.append(cube.step(t)[1])
            new, moved = cube.forces(), cube.state.u.x.array - u
            work += 0.5 * (forces + new) @ moved
            forces, u = new, u + moved
        assert np.all(np.diff(lost) > 0)
        return abs(work - cube.solid.energies()["strain"] - lost[-1]) / lost[-1]

    large, small = imbalance(0.04), imbalance(0.02)
    assert large < 0.25 * 0.04
    assert small < 0.6 * large


def spring(material):
    """The part of an energy that relaxes, at the points of one cell in the plane."""
    domain = mesh.create_unit_square(MPI.COMM_SELF, 1, 1, mesh.CellType.quadrilateral)
    points = TensorPoints(domain, np.array([0], np.int32), degree=2)
    return Spring(points, lambda F: material.energy(F)[0], material.young)


@pytest.mark.parametrize("isochoric", [False, True])
def test_strain_of_a_stress_in_closed_form(isochoric):
    """Neo-Hookean: S = G (I − C⁻¹), and C ~ (I − S/G)⁻¹ with det C = 1 without a stiffness of the volume."""
    material = IsochoricNeoHookean(E, 0.45) if isochoric else NeoHookean(E, NU)
    a = spring(material)
    z = np.array([[0.3, 0.1, 0.0], [0.1, -0.4, 0.0], [0.0, 0.0, 0.2]])
    C = np.linalg.inv(np.eye(3) - z / material.shear)
    C /= np.cbrt(np.linalg.det(C)) if isochoric else 1.0
    stress = np.broadcast_to([z[0, 0], 2 * z[0, 1], z[1, 1], z[2, 2]], (1, 4, 4))
    strain = a.invert(stress, a.undeformed)[0, 0, :4]
    exact = 0.5 * (C - np.eye(3))
    np.testing.assert_allclose(strain, [exact[0, 0], exact[0, 1], exact[1, 1], exact[2, 2]], atol=1e-10)


def test_a_stress_out_of_reach_is_reported_once(caplog):
    """S = G (I − C⁻¹) stays below G in every direction."""
    material = NeoHookean(E, NU)
    a = spring(material)
    stress = np.broadcast_to([2 * material.shear, 0.0, 0.0, 0.0], (1, 4, 4))
    for _ in range(2):
        assert np.all(np.isfinite(a.invert(stress, a.undeformed)))
    assert [record.message for record in caplog.records if "4 points" in record.message] == caplog.messages[:1]
    assert len(caplog.messages) == 1


def test_cauchy_stress_carries_the_overstress():
    """As a field for output, against the traction of the residual, t = F₂₂ F₃₃ σ₁₁; as before after a rollback."""

    def F(t):
        return np.diag([1 + 0.3 * t, 1 - 0.1 * t, 1.0])

    cube = Cube(MOONEY, F)
    field = fem.Function(fem.functionspace(cube.state.mesh, ("DG", 0)))
    for t in (0.5, 1.0):
        traction, _ = cube.step(t)
        interpolate(field, cube.solid.cauchy_stress(cube.state.u)[0, 0])
        assert field.x.array[0] * F(t)[1, 1] == pytest.approx(traction[0], rel=1e-12)
    seen = field.x.array.copy()
    cube.state.begin(1.7)
    cube.solid.begin()
    cube.state.rollback()
    interpolate(field, cube.solid.cauchy_stress(cube.state.u)[0, 0])
    assert np.array_equal(field.x.array, seen)


def stretched(prony=PRONY, comm=MPI.COMM_WORLD):
    """Blocks in uniaxial strain by supports, as a boundary value problem with a free interior."""
    b = make_blocks(3, comm=comm)
    state = State(fem.functionspace(b.state.mesh, ("Lagrange", 1, (3,))))
    solid = Solid(state, SVK, relaxation=prony)
    supports = [Support(state, b.face(i, at), i) for i in range(3) for at in (0.0, 1.0) if (i, at) != (0, 1.0)]
    supports.append(Support(state, b.face(0, 1.0), 0, lambda t: np.sqrt(1 + 0.6 * min(t, 1.0)) - 1, name="pull"))
    return Mechanics(state, [solid], supports)


@pytest.mark.mpi
def test_relaxation_of_a_body():
    """Force of the support against the exact convolution; the audit closes; the same on any number of ranks."""
    rows = history(stretched(), 5.0, StepControl.fixed(0.1))
    strain = 0.3 * np.minimum(rows["time"], 1.0)
    over = straight([0.0, 1.0, 5.0], [0.0, 0.3, 0.3], 2 * SVK.shear, rows["time"])
    force = np.sqrt(1 + 2 * strain) * ((2 * SVK.shear + SVK.lame) * strain + over)
    np.testing.assert_allclose(rows["pull_force"], force, rtol=1e-6)
    assert abs(rows["energy_closure"][-1]) < 1e-3
    assert rows["energy_viscous"][-1] > 0.1 * rows["energy_strain"][-1]
    assert np.all(np.diff(rows["energy_viscous"]) > 0)


@pytest.mark.mpi
def test_rollback_is_bit_for_bit():
    mechanics = stretched()
    solid = mechanics.terms[0]
    history(mechanics, 0.5, StepControl.fixed(0.25))
    forces = form(solid.residual(ufl.TestFunction(mechanics.state.V)))

    def seen():
        return [nodal_forces(forces), *solid.energies().values()]

    before = seen()
    begin(mechanics, 0.8)
    assert mechanics.solve().converged
    mechanics.evaluate()
    tried = seen()
    mechanics.state.rollback()
    assert not np.array_equal(before[0], tried[0])
    for a, b in zip(before, seen(), strict=True):
        assert np.array_equal(a, b)
    begin(mechanics, 0.8)
    mechanics.solve()
    mechanics.evaluate()
    # three ranks add in the order in which messages arrive
    for a, b in zip(tried, seen(), strict=True):
        np.testing.assert_allclose(b, a, rtol=1e-9, atol=1e-12 * np.abs(a).max())


FIBRED = Reinforced(NeoHookean(E, NU), (DispersedFibres(AXIS, 0.8, 0.5, 0.1),))


@pytest.mark.parametrize(
    ("material", "gdim"),
    [(NeoHookean(E, NU), 2), (MOONEY, 2), (FIBRED, 2), (FIBRED, 3)],
    ids=lambda v: v if isinstance(v, int) else name(v),
)
def test_tangent(material, gdim):
    b = make_blocks(gdim)
    solid = b.solid(material, relaxation=PRONY)
    b.state.begin(0.4)
    solid.begin()
    b.state.u.x.array[:] = smooth(b.state.V, 3, 0.2)
    solid.evaluate()
    b.state.commit()
    b.state.begin(0.6)
    solid.begin()
    assert_slope_two(solid, b.state, smooth(b.state.V, 1, 0.2), 1.0)


def test_turning_relaxes_nothing():
    """Rigid rotation of a stretched body: the overstress turns with it and decays as at rest."""
    stretch = np.diag([1.3, 0.9, 1.0])
    angle = 0.7

    def turn(t):
        c, s = np.cos(angle * t), np.sin(angle * t)
        return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])

    def grow(t):
        return np.eye(3) + min(t, 1.0) * (stretch - np.eye(3))

    times = np.linspace(0.25, 3.0, 12)
    still, _ = Cube(MOONEY, grow).run(times)
    turning, _ = Cube(MOONEY, lambda t: turn(t) @ grow(t)).run(times)
    for t, f, g in zip(times, still, turning, strict=True):
        np.testing.assert_allclose(g, turn(t) @ f, atol=1e-12)


@pytest.mark.parametrize(
    ("strengths", "times", "name"),
    [((), (), "strengths"), ((0.0,), (1.0,), "strengths"), ((1.0,), (0.0,), "times"), ((1.0,), (1.0, 2.0), "times")],
)
def test_refuses_what_has_no_meaning(strengths, times, name):
    with pytest.raises(ValueError, match=f"{name} = .* is not allowed"):
        Prony(strengths, times)


def test_plane_stress_is_refused():
    with pytest.raises(ValueError, match="plane = 'stress' is not allowed"):
        make_blocks().solid(relaxation=PRONY, plane="stress")
