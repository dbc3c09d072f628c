"""A needle through skin of eight layers: the mesh of the body of revolution, and how its run begins."""

from math import pi

import numpy as np
import pytest
from dolfinx import fem
from mpi4py import MPI

from cutsim.base.assembly import integrate
from cutsim.base.compat import form
from cutsim.bodies.solid import Solid
from cutsim.cases import built_in_cases, read_case
from cutsim.fields.laminate import laminate
from cutsim.fields.measures import Measures
from cutsim.materials.library import SKIN
from cutsim.studies.drive import Drive, Motion
from cutsim.tools.pointed import Needle

COMM = MPI.COMM_WORLD
PATH = built_in_cases()["skin-needle"][1]
THREAD, LENGTH = 0.3, 2.0


def revolved(**options):
    return laminate(COMM, SKIN, length=LENGTH, size=0.1, band=0.3, thread=THREAD, **options)


@pytest.mark.mpi
def test_layers_of_a_body_of_revolution():
    """Volumes of layers and of the thread, areas of the crack in each layer, by revolution about x = 0."""
    domain = revolved()
    measures, one, top = Measures(domain.mesh, axisymmetric=True), fem.Constant(domain.mesh, 1.0), 0.0
    outer, height = THREAD + LENGTH, sum(SKIN.values())

    def volume(name):
        return integrate(form(one * measures.cells(domain.cells(name))))

    for name, thickness in SKIN.items():
        assert volume(name) == pytest.approx(pi * outer**2 * thickness, rel=1e-10)
        area = domain.area(f"crack_{name}", axisymmetric=True)
        assert area == pytest.approx(2 * pi * THREAD * thickness, rel=1e-10)
        top -= thickness
    assert volume("left") == pytest.approx(pi * THREAD**2 * height, rel=1e-10)
    assert volume("right") == pytest.approx(pi * (outer**2 - THREAD**2) * height, rel=1e-10)
    assert domain.area("far_right", axisymmetric=True) == pytest.approx(2 * pi * outer * height, rel=1e-10)
    assert "far_left" not in domain.names


def test_a_body_of_revolution_has_no_width():
    with pytest.raises(ValueError, match=r"width = 1\.0 is not allowed"):
        revolved(width=1.0)
    with pytest.raises(ValueError, match=r"layers = .*right.* is not allowed"):
        laminate(COMM, {"right": 1.0}, length=1.0, size=0.2, band=0.2)


def test_the_needle_comes_out_at_the_end():
    """It goes in, rests and is drawn out to where it began to touch, and the dermis alone relaxes."""
    tables = read_case(PATH)
    drive = tables.insertion.drive
    assert isinstance(drive, Drive) and drive.dwell > 0
    shape = tables.tools["tool"].made
    assert isinstance(shape, Needle)
    motion = Motion.of(drive, shape, 0.0, np.inf)
    assert motion.depth(tables.analysis.until) == pytest.approx(0.0, abs=1e-12)
    assert motion.depth(tables.analysis.until - 0.5) == pytest.approx(0.5 * drive.speed)
    assert motion.depth(motion.time_of(drive.turning_depth) + 0.5 * drive.dwell) == drive.turning_depth
    assert [layer.name for layer in tables.layers if layer.relaxation] == ["papillary_dermis", "reticular_dermis"]
    assert sum(layer.thickness for layer in tables.layers) < drive.turning_depth + shape.tip_radius


def test_the_rim_is_held_and_the_thread_stays_on_the_axis():
    case = read_case(PATH, {"parameters.size": "0.1", "insertion.fixture.drawn": "0.05"}, quick=True)
    simulation = case.build(COMM)
    held = {support.name for support in simulation.problem.supports}
    assert "far_right" in held and len(held) == 3
    assert all(isinstance(solid, Solid) for solid in simulation.parts.solids) and len(simulation.parts.solids) == 8
