"""Ironing: forces on a die that is drawn along a slab with another mesh are smooth, and their work is accounted for."""

import numpy as np
import pytest
from mpi4py import MPI

from cutsim.analysis.stepping import run
from cutsim.fields.meshing import read_geo
from validation.ironing import CONTROL, MESH, Bodies, Ironing, columns, forces

MU = 0.3


def iron(ironing, comm=MPI.COMM_WORLD):
    """Forces at constant speed, and the history."""
    bodies, rows = Bodies.build(ironing, comm), []
    with bodies.mechanics.problem:
        run(
            bodies.mechanics,
            ironing.until,
            CONTROL,
            lambda r: rows.append(
                {name: value for name, (value, _) in (r.columns | columns(r.columns)).items()}
                | {"newton": r.outcome.iterations, "cuts": r.cuts}
            ),
        )
    history = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    return forces(ironing, history), history


@pytest.mark.parametrize("mu", [0.0, MU], ids=["smooth", "rough"])
def test_ripple_shrinks_with_the_mesh(mu):
    coarse, fine = (iron(Ironing(size, mu, draw=1.6, settled=0.7))[0] for size in (0.4, 0.2))
    for result in (coarse, fine):
        assert result["cuts"] == 0
        assert result["drag_over_normal"] == pytest.approx(mu, abs=0.01)
        if mu:
            assert result["friction_over_work"] == pytest.approx(1.0, abs=0.01)
    assert fine["ripple_of_normal"] < 0.5 * coarse["ripple_of_normal"] and fine["ripple_of_normal"] < 0.015
    assert fine["ripple_of_drag"] < 0.3 * coarse["ripple_of_drag"] and fine["ripple_of_drag"] < 0.05
    assert fine["energy_closure"] < 5e-3


def test_a_die_that_gives_back_what_it_took():
    """Without friction the work of the drag over whole elements is nothing."""
    history = iron(Ironing(0.4, draw=1.6))[1]
    drawn = history["way"] >= 0.4 - 1e-9
    way, drag = history["way"][drawn], history["drag"][drawn]
    work = np.sum(0.5 * (drag[1:] + drag[:-1]) * np.diff(way))
    assert abs(work) < 2e-3 * history["normal"][-1] * np.ptp(way)
    assert history["energy_friction"][-1] == 0


@pytest.mark.mpi
@pytest.mark.skipif(MPI.COMM_WORLD.size == 1, reason="compares several ranks with one")
def test_ranks_agree_with_one():
    short = Ironing(0.4, MU, draw=0.6, settled=0.3)
    alone, together = (iron(short, comm)[1] for comm in (MPI.COMM_SELF, MPI.COMM_WORLD))
    for name in ("normal", "drag", "energy_friction", "energy_strain"):
        np.testing.assert_allclose(together[name], alone[name], rtol=0, atol=1e-6 * np.abs(alone[name]).max())


@pytest.mark.mpi
@pytest.mark.parametrize("parameters", [{"R": 1.0}, {"W": 0}, {"X": 0.5}, {"T": 0.1}, {"h": 3}, {"nd": 0}])
def test_bad_geometry_is_refused(parameters):
    with pytest.raises(ValueError, match=f"{next(iter(parameters))} = "):
        read_geo(MESH, MPI.COMM_WORLD, parameters, gdim=2)
