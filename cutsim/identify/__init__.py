"""Identification of material parameters from the files of a testing machine (docs/identification.md)."""

import mpi4py.MPI  # noqa: F401  # before dolfinx, whose wheel needs the library that this loads

from cutsim.identify.calibration import MaterialFit, StressTest, fit_material
from cutsim.identify.fitting import Fit, fit_model
from cutsim.identify.indentation import fit_shear_modulus, layer_factor, poisson_ratio, punch_force
from cutsim.identify.inverse import fit_simulation
from cutsim.identify.measurements import converted, fitting_columns, read_table, titled_units
from cutsim.identify.response import nominal_stress, unstable_stretches

__all__ = [
    "Fit",
    "MaterialFit",
    "StressTest",
    "converted",
    "fit_material",
    "fit_model",
    "fit_shear_modulus",
    "fit_simulation",
    "fitting_columns",
    "layer_factor",
    "nominal_stress",
    "poisson_ratio",
    "punch_force",
    "read_table",
    "titled_units",
    "unstable_stretches",
]
