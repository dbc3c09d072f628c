"""A block rubbed on a slab: closed forms, conservation of heat, temperatures of the faces, and the geometry."""

from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI

from cutsim.analysis.stepping import StepControl, run
from cutsim.fields.meshing import read_geo
from cutsim.fields.sizes import facet_size, global_range, normal_size
from cutsim.heat.contact_heat import ContactHeat
from cutsim.interface.friction import Coulomb
from validation.frictional_heating import (
    AREA,
    COLUMN,
    MESH,
    SIDE,
    STEEL,
    THESIS,
    Rubbing,
    balance,
    faces,
    faces_of_column,
    response,
    sharing,
    steady,
    steady_slabs,
)

ROUGH_THESIS = replace(THESIS, elements=2, layer=2.5)
ROUGH_STEEL = replace(STEEL, elements=3, layer=2.0, strokes=2, steps=4)
ROUGH_COLUMN = replace(COLUMN, strokes=2, steps=10)


def slide(pair, comm=MPI.COMM_WORLD):
    """Rub to the end; the problem, and the columns of all accepted steps."""
    rubbing, rows = Rubbing.build(pair, comm=comm), []

    def record(report):
        columns = report.columns | rubbing.columns(report.columns)
        rows.append({"step": report.number, "time": report.time} | {k: v for k, (v, _) in columns.items()})

    with rubbing.problem.mechanics.problem, rubbing.problem.heat.problem:
        run(rubbing.problem, float(pair.turns[-1]), pair.control, record)
    return rubbing, {name: np.array([row[name] for row in rows]) for name in rows[0]}


# -- closed forms -----------------------------------------------------------------------------------------------------


def test_equal_slabs_have_the_temperatures_of_the_thesis():
    """(4.133), whose two names are exchanged in print."""
    T_1, T_2, kappa, contact = 70.0, 20.0, 3.0, 0.4
    q, *found = steady_slabs((T_1, T_2), (kappa, kappa), (contact, contact))
    for face, near, far in zip(found, (T_1, T_2), (T_2, T_1), strict=True):
        assert face == pytest.approx((contact * far + (2 * kappa + contact) * near) / (2 * kappa + 2 * contact))
    assert q == pytest.approx(0.5 * contact * (found[0] - found[1]))


def test_series_begin_as_half_spaces_and_end_with_equal_rates():
    diffusivity = COLUMN.conductivity / (COLUMN.density * COLUMN.capacity)
    early, late = np.array([1e-3, 4e-3]), np.array([200.0, 210.0])
    mean = response(COLUMN, early).mean(axis=0)
    half_space = COLUMN.generation / COLUMN.conductivity * np.sqrt(diffusivity * early / np.pi)
    np.testing.assert_allclose(mean, half_space, rtol=1e-3)
    rates = np.diff(response(COLUMN, late))[:, 0] / 10
    heating = COLUMN.generation / (2 * COLUMN.density * COLUMN.capacity * SIDE)
    np.testing.assert_allclose(rates, heating, rtol=1e-9)


def test_series_satisfy_the_law_of_the_contact():
    """At first the faces are cold and share D by γ; in the end equal slabs take the same, and the jump levels it."""
    instant = np.array([1e-4])
    pure = replace(COLUMN, contact=ContactHeat(0.2, 0.2))
    ratio = np.divide(*response(COLUMN, instant))
    assert ratio == pytest.approx(3.0, rel=0.1)
    np.testing.assert_allclose(*response(pure, instant), rtol=1e-12)
    slab, block = response(COLUMN, np.array([100.0]))[:, 0]
    D, plus, minus = COLUMN.generation, *(100 * g for g in (0.6, 0.2))
    through = plus * minus / (plus + minus) * (slab - block)
    assert plus / (plus + minus) * D - through == pytest.approx(0.5 * D, rel=1e-3)


def test_nothing_is_generated_while_the_faces_stick():
    """The temperature falls after a turn, and heat is that of the slip."""
    pair = replace(COLUMN, strokes=2, friction=Coulomb(0.1, stiffness=200.0))
    turn = pair.turns[1]
    before, after = faces_of_column(pair, np.array([turn, turn + 2 * pair.stick]))[0]
    assert after < 0.9 * before
    settled = faces_of_column(pair, np.array([1e3])).mean()
    heat = 0.1 * 100.0 * (2 * pair.stroke - 3 * 0.05) * AREA
    assert settled == pytest.approx(heat / pair.heat_capacities.sum(), rel=2e-3)


# -- geometry ---------------------------------------------------------------------------------------------------------


@pytest.mark.mpi
def test_geometry():
    domain = read_geo(MESH, MPI.COMM_WORLD, {"B": 6, "H": 5, "L": 20, "nx": 3, "ly": 1.0, "growth": 1.0})
    mesh = domain.mesh
    assert global_range(mesh.comm, facet_size(mesh, domain.facets("crack"))) == pytest.approx((2.0, 2.0))
    assert global_range(mesh.comm, normal_size(mesh, domain.facets("crack"))) == pytest.approx((1.0, 1.0))
    x = mesh.geometry.x
    for axis, span in enumerate([(-10, 10), (-5, 5), (0, 6)]):
        assert global_range(mesh.comm, x[:, axis]) == pytest.approx(span)
    owned = mesh.topology.index_map(2).size_local
    number = {name: int(np.sum(domain.facets(name) < owned)) for name in ("crack", "top", "bottom")}
    total = {name: mesh.comm.allreduce(value) for name, value in number.items()}
    assert total["crack"] == total["top"] == 9 < total["bottom"]


@pytest.mark.mpi
@pytest.mark.parametrize("parameters", [{"B": 0}, {"H": -1}, {"L": 5}, {"ly": 20}, {"nx": 0}, {"growth": 0.5}])
def test_bad_geometry_is_refused(parameters):
    with pytest.raises(ValueError, match=f"{next(iter(parameters))} = "):
        read_geo(MESH, MPI.COMM_WORLD, parameters)


# -- no sliding -------------------------------------------------------------------------------------------------------


@pytest.mark.mpi
@pytest.mark.parametrize("pair", [ROUGH_THESIS, COLUMN], ids=["thesis", "column"])
def test_steady_flux_and_jump(pair):
    result = steady(pair)
    assert abs(result["flux"]) > 1
    for name in ("flux_error", "jump_error", "face_error"):
        assert result[name] < 1e-6, name


@pytest.mark.mpi
@pytest.mark.parametrize("ratio", [3.0, 0.5])
def test_cold_faces_share_by_conductance(ratio):
    result = sharing(replace(ROUGH_COLUMN, contact=ContactHeat(0.2 * ratio, 0.2), steps=2))
    assert result["ratio"] == pytest.approx(ratio, rel=1e-9)
    assert result["heat_flow"] == pytest.approx(0.1 * 100 * 10 * AREA, rel=1e-6)


# -- sliding ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("pair", "slipped"),
    [(ROUGH_THESIS, 1 - 0.1), (ROUGH_COLUMN, 2 - 3e-3), (replace(ROUGH_COLUMN, strokes=1), 1 - 1e-3)],
    ids=["thesis", "two strokes", "one stroke"],
)
def test_uniform_pressure(pair, slipped):
    """All work of friction, μ p A s, is in the bodies and between them."""
    rubbing, history = slide(pair)
    result = balance(rubbing, history)
    work = 0.1 * pair.pressure * AREA * slipped
    volume = AREA * (pair.slab + SIDE)
    capacity = pair.density * pair.capacity * volume + pair.contact.capacity * AREA
    assert result["load"] == pytest.approx(pair.pressure * AREA, rel=1e-7)
    assert result["friction"] == pytest.approx(work, rel=1e-6)
    assert result["mu_N_s"] == pytest.approx(work, rel=1e-6)
    assert result["heat_kept"] == pytest.approx(work, rel=1e-6)
    assert result["mean_rise"] == pytest.approx(work / capacity, rel=1e-6)
    assert result["heat_closure"] < 1e-10 and result["energy_closure"] < 1e-9
    # out-of-balance forces that count as rounding are 1e-4 N, of 400 N on a facet
    assert np.ptp(rubbing.crack.point_values("pressure")) < 1e-6 * pair.pressure


def test_series_are_approached():
    """Temperatures of the faces, with finer steps and elements."""
    errors = []
    for steps, layer in ((5, 0.4), (20, 0.1)):
        pair = replace(COLUMN, strokes=2, steps=steps, layer=layer)
        errors.append(faces(pair, slide(pair)[1])["face_error"])
    assert errors[1] < 0.012 and errors[1] < 0.5 * errors[0], errors


def test_interface_of_the_thesis_keeps_the_heat():
    """More than its part of the capacity, being the hottest."""
    result = balance(*slide(ROUGH_THESIS))
    share = 100 * AREA * result["interface_rise"] / result["friction"]
    assert 1 > share > result["interface_part_of_capacity"] == pytest.approx(1 / 1.11)
    assert result["interface_rise"] > result["block_face_rise"] > result["slab_face_rise"] > 0


@pytest.mark.mpi
def test_elastic_bodies():
    rubbing, history = slide(ROUGH_STEEL)
    result = balance(rubbing, history)
    assert result["heat_kept"] == pytest.approx(result["friction"], rel=1e-9)
    assert result["friction"] == pytest.approx(result["mu_N_s"], rel=5e-3)
    assert result["heat_closure"] < 1e-9 and result["energy_closure"] < 0.01
    assert result["least_contact_dissipation"] > -1e-9
    assert np.diff(history["interface_entropy"]).min() >= 0
    # the slab takes more, having the better contact, but is warmed less in the mean, being longer
    flows = history["interface_heat_flow_plus"][-1], history["interface_heat_flow_minus"][-1]
    assert flows[0] < flows[1] < 0
    assert result["slab_face_rise"] > result["block_face_rise"] > result["block_rise"] > result["slab_rise"] > 0


@pytest.mark.mpi
@pytest.mark.skipif(MPI.COMM_WORLD.size == 1, reason="compares several ranks with one")
def test_ranks_agree_with_one():
    short = replace(ROUGH_STEEL, strokes=1)
    alone, together = (slide(short, comm)[1] for comm in (MPI.COMM_SELF, MPI.COMM_WORLD))
    for name in ("load", "slide", "energy_friction", "slab_face", "block_face", "slab_temperature", "interface"):
        np.testing.assert_allclose(together[name], alone[name], rtol=0, atol=1e-6 * np.abs(alone[name]).max())


def test_faces_that_stick_generate_nothing():
    """A stroke within the elastic slip is stored, and comes back."""
    pair = replace(ROUGH_COLUMN, stroke=4e-4, strokes=2, steps=2)
    rubbing = Rubbing.build(pair)
    with rubbing.problem.mechanics.problem, rubbing.problem.heat.problem:
        report = run(rubbing.problem, float(pair.turns[-1]), StepControl.fixed(pair.step))
    assert report.columns["energy_friction"][0] == 0.0
    assert report.columns["work_external"][0] == pytest.approx(report.columns["energy_strain"][0], rel=0.01)
    assert abs(report.columns["temperature_max"][0]) < 1e-12
