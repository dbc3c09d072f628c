"""Three-point bending: the beam of validation/senb.py against linear elastic fracture mechanics."""

import numpy as np
import pytest
from mpi4py import MPI

from cutsim.analysis.stepping import StepControl, run
from cutsim.results.output import read_history
from validation import senb


@pytest.mark.parametrize("ratio", [0.3, 0.45, 0.55])
def test_stress_intensity_from_j_is_that_of_the_load(ratio):
    row = senb.fracture_parameters(ratio, senb.STATIONARY[2])
    assert row["K_from_J"] == pytest.approx(row["K_closed_form"], rel=0.01)
    assert row["J"] == pytest.approx([row["J"][1]] * 3, rel=1e-3)
    assert row["G_from_energy"] == pytest.approx(row["J"][1], rel=2e-3)


def test_peak_and_branch_of_growing_crack(tmp_path):
    notch = senb.fracture_parameters(0.45, {**senb.STATIONARY[2], "lc": 0.1})
    _, found = senb.propagation(2, True, tmp_path, notch)
    history = read_history(tmp_path / "history.csv")
    deflection, load = -history["load_displacement"], history["load_per_thickness"]
    # at the peak J of a domain is what the bond at the tip has cost, and G of a sharp crack as compliant; then G_c
    assert found["J_at_peak"] == pytest.approx(found["work_of_the_tip_at_peak"], rel=0.015)
    assert found["J_at_peak"] == pytest.approx(found["G_at_peak_of_crack_as_compliant"], rel=0.04)
    assert found["largest_J_over_toughness"] == pytest.approx(1.0, abs=0.005)
    # the load follows the sharp crack's branch
    late = deflection > 0.75 * deflection[-1]
    assert load[late] == pytest.approx(
        np.interp(deflection[late], *senb.limit_curve(notch["compliance_per_thickness"])), rel=0.03
    )
    assert np.all(np.abs(history["energy_closure"]) < 0.01)
    assert np.all(np.diff(history["energy_fracture"]) > -1e-12)
    assert history["left_force"] == pytest.approx(history["right_force"], rel=1e-6)
    assert history["left_force"] + history["right_force"] == pytest.approx(load, rel=1e-6)


@pytest.mark.mpi
def test_bending_is_the_same_on_any_number_of_ranks():
    parameters = {**senb.FINE, "lc": 0.25, "ahead": 2}
    loads = []
    for comm in (MPI.COMM_WORLD, MPI.COMM_SELF):
        beam = senb.Bending.build(senb.law_of(4.0), parameters, 0.009, comm)
        with beam.mechanics.problem:
            run(beam.mechanics, 1.0, StepControl.fixed(0.125), lambda r: loads.append(r.columns["load_force"][0]))
    assert len(loads) == 16
    assert loads[:8] == pytest.approx(loads[8:], rel=1e-7)
