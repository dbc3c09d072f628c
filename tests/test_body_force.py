"""Weight and other forces per volume: bars that hang, stand and fall, and the work that is done."""

import numpy as np
import pytest
from dolfinx import fem, mesh
from mpi4py import MPI

from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.stepping import StepControl
from cutsim.bodies.body_force import BodyForce
from cutsim.bodies.loads import Support
from cutsim.bodies.schemes import Newmark
from cutsim.bodies.solid import Solid
from cutsim.fields.state import State
from cutsim.materials.elastic import LinearElastic, NeoHookean
from helpers.runs import history

YOUNG, DENSITY, GRAVITY, LENGTH, RADIUS = 2.0, 0.3, 0.5, 4.0, 0.5
QUADRILATERAL, HEXAHEDRON = mesh.CellType.quadrilateral, mesh.CellType.hexahedron
#: The kinds of analysis, and the section of a bar of half width or radius RADIUS.
SECTIONS = {"strain": RADIUS, "stress": RADIUS, "3-D": RADIUS**2, "axisymmetric": np.pi * RADIUS**2}


class Bar:
    """An upright bar that is fixed at its top; nothing holds its sides but symmetry."""

    def __init__(self, kind, poisson=0.0, material=LinearElastic):
        high = (RADIUS, LENGTH) if kind != "3-D" else (RADIUS, RADIUS, LENGTH)
        up = len(high) - 1
        create = (mesh.create_rectangle, mesh.create_box)[kind == "3-D"]
        cells = (2,) * up + (8,)
        shape = (QUADRILATERAL, HEXAHEDRON)[kind == "3-D"]
        domain = create(MPI.COMM_WORLD, [np.zeros(up + 1), np.array(high)], cells, shape)
        self.state = State(fem.functionspace(domain, ("Lagrange", 1, (up + 1,))), axisymmetric=kind == "axisymmetric")
        plane = {"plane": "stress"} if kind == "stress" else {}
        self.solid = Solid(self.state, material(YOUNG, poisson), density=DENSITY, **plane)
        self.up, self.domain = up, domain
        self.supports = [self.hold(i, 0.0, i) for i in range(up)] + [self.hold(up, LENGTH, up, name="top")]

    def hold(self, axis, at, component, name=None):
        facets = mesh.locate_entities_boundary(self.domain, self.up, lambda x: np.isclose(x[axis], at))
        return Support(self.state, facets, component, name=name)

    def run(self, factor, per="mass", until=1.0, steps=2, **analysis):
        down = np.zeros(self.up + 1)
        down[-1] = -GRAVITY if per == "mass" else -DENSITY * GRAVITY
        force = BodyForce(self.state, self.solid, tuple(down), factor, per=per, name="weight")
        mechanics = Mechanics(self.state, [self.solid, force], self.supports, **analysis)
        return history(mechanics, until, StepControl.fixed(until / steps))

    @property
    def tip(self):
        return self.domain.comm.allreduce(self.state.u.x.array.min(), MPI.MIN)


@pytest.mark.mpi
@pytest.mark.parametrize("kind", SECTIONS)
def test_hanging_bar(kind):
    """It grows longer by ρ g L²/2E, its top carries the weight ρ g A L, and the work of the weight is stored."""
    bar = Bar(kind)
    rows = bar.run(lambda t: t)
    weight = DENSITY * GRAVITY * SECTIONS[kind] * LENGTH
    assert bar.tip == pytest.approx(-DENSITY * GRAVITY * LENGTH**2 / (2 * YOUNG), rel=1e-9)
    assert rows["top_force"][-1] == pytest.approx(weight, rel=1e-9)
    assert rows[f"weight_force_{'xyz'[bar.up]}"][-1] == pytest.approx(-weight, rel=1e-9)
    # ∫ ½ (ρ g A s)²/(E A) ds, up to the error of linear elements
    stored = (DENSITY * GRAVITY) ** 2 * SECTIONS[kind] * LENGTH**3 / (6 * YOUNG)
    assert rows["energy_strain"][-1] == pytest.approx(stored, rel=0.01)
    assert rows["work_external"][-1] == pytest.approx(rows["energy_strain"][-1], rel=1e-9)


def test_a_confined_column_sinks_by_the_modulus_of_uniaxial_strain():
    bar = Bar("strain", poisson=0.3)
    bar.supports = [*bar.supports[:1], bar.hold(0, RADIUS, 0), bar.supports[-1]]
    bar.run(1.0)
    modulus = YOUNG * 0.7 / (1.3 * 0.4)
    assert bar.tip == pytest.approx(-DENSITY * GRAVITY * LENGTH**2 / (2 * modulus), rel=1e-9)


def test_force_per_volume_is_density_times_that_per_mass():
    """Also at large strain, where it stays that of the reference volume."""
    tips = []
    for per in ("mass", "volume"):
        bar = Bar("strain", poisson=0.3, material=NeoHookean)
        rows = bar.run(lambda t: t, per=per)
        tips.append(bar.tip)
    assert tips[0] == pytest.approx(tips[1], rel=1e-12) and tips[0] < -0.3
    assert rows["top_force"][-1] == pytest.approx(DENSITY * GRAVITY * RADIUS * LENGTH, rel=1e-8)


def test_free_fall():
    """A body that nothing holds falls by g t²/2, and its kinetic energy is the work of its weight."""
    bar = Bar("strain")
    bar.supports = bar.supports[:1]
    rows = bar.run(lambda t: 1.0, steps=20, analysis="dynamic", scheme=Newmark())
    assert bar.tip == pytest.approx(-GRAVITY / 2, rel=1e-9)
    mass = DENSITY * RADIUS * LENGTH
    assert rows["energy_kinetic"][-1] == pytest.approx(0.5 * mass * GRAVITY**2, rel=1e-9)
    assert rows["work_external"][-1] == pytest.approx(rows["energy_kinetic"][-1], rel=2e-3)


def test_weight_without_density_is_refused():
    bar = Bar("strain")
    light = Solid(bar.state, LinearElastic(YOUNG, 0.0), name="foam")
    with pytest.raises(ValueError, match=r"solid = .*foam. without density.* is not allowed.*per = .volume."):
        BodyForce(bar.state, light, (0.0, -1.0))
    with pytest.raises(ValueError, match=r"vector = .* is not allowed"):
        BodyForce(bar.state, bar.solid, (0.0, 0.0, -1.0))
    BodyForce(bar.state, light, (0.0, -1.0), per="volume")
