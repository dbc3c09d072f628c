"""What changes in a run: displacement and time, each with a trial and a committed value."""

import numpy as np
from dolfinx import default_scalar_type, fem

from cutsim.checks import require
from cutsim.measures import Measures


class State:
    """Displacement, time and step size, trial and committed.

    Args:
        V: Vector space of the displacement, usually from `cutsim.space.cracked_space`.

    Attributes:
        u: Trial displacement [length].
        u_old: Committed displacement, at the start of the step.
        time: Time at the end of the step (trial) [time].
        dt: Step size as a form constant.
        measures: Integration measures that the terms share.
    """

    def __init__(self, V: fem.FunctionSpace) -> None:
        require("V", V.value_shape, V.value_shape == (V.mesh.geometry.dim,), "a vector space of the mesh's dimension")
        self.V = V
        self.mesh = V.mesh
        self.u = fem.Function(V, name="u")
        self.u_old = fem.Function(V, name="u_old")
        self.dt = fem.Constant(V.mesh, default_scalar_type(1.0))
        self.measures = Measures(V.mesh)
        self.time = 0.0
        self.time_old = 0.0
        self._dt_old = float(self.dt.value)

    def begin(self, time: float) -> None:
        """Start a step that ends at `time`; the trial displacement starts from the committed one."""
        self.time = time
        self.dt.value = time - self.time_old

    def rollback(self) -> None:
        """Restore the committed displacement and time bit for bit."""
        self.u.x.array[:] = self.u_old.x.array
        self.time = self.time_old
        self.dt.value = self._dt_old

    def commit(self) -> None:
        """Adopt the trial displacement and time."""
        self.u_old.x.array[:] = self.u.x.array
        self.time_old = self.time
        self._dt_old = float(self.dt.value)

    @property
    def increment(self) -> np.ndarray:
        """Displacement increment of the step, owned dofs [length]."""
        owned = self.V.dofmap.index_map.size_local * self.V.dofmap.index_map_bs
        return self.u.x.array[:owned] - self.u_old.x.array[:owned]
