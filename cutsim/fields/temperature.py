"""Temperature: a scalar field, discontinuous across cracks, trial and committed."""

from collections.abc import Callable
from typing import Any

import numpy as np
from dolfinx import fem
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.base.checks import as_array, at_least, finite, require, require_number
from cutsim.base.signatures import checked
from cutsim.fields.state import State


class Temperature:
    """Temperature field on a scalar space, trial and committed.

    Args:
        state: Displacement and time of the same mesh.
        space: Scalar Lagrange space, cracked along the facets of the displacement's cracks (`cutsim.fields.space`).
        initial: Initial temperature: a number, a function of the positions (3, n) → (n,), or a function on the space,
            which may differ on the two sides of a crack [temperature].
        absolute_zero: Absolute zero in the user's unit: 0 in kelvin, −273.15 in degrees Celsius.

    Attributes:
        value: Trial temperature [temperature].
        old: Committed temperature, at the start of the step.

    Raises:
        ValueError: The space is not scalar or on another mesh, or an initial temperature is below absolute zero.
    """

    @checked
    def __init__(
        self,
        state: State,
        space: fem.FunctionSpace,
        initial: float | fem.Function | Callable[[NDArray[np.float64]], Any],
        *,
        absolute_zero: float = 0.0,
    ) -> None:
        require_number("absolute_zero", absolute_zero, finite)
        require("space", space.value_shape, space.value_shape == (), "a scalar space")
        require("space", space.mesh.name, space.mesh is state.mesh, "a space on the mesh of the displacement")
        self.state, self.space, self.absolute_zero = state, space, absolute_zero
        self.value = fem.Function(space, name="temperature")
        self.old = fem.Function(space, name="temperature_old")
        if isinstance(initial, fem.Function):
            require("initial", str(initial), initial.function_space is space, "a function on the temperature's space")
            self.value.x.array[:] = initial.x.array
        elif callable(initial):
            self.value.interpolate(lambda x: as_array("initial", initial(x)))
        else:
            require_number("initial", initial, finite)
            self.value.x.array[:] = initial
        self.value.x.scatter_forward()
        self.check("initial", self.minimum())
        state.memory.array("temperature", self.value, self.old)

    def check(self, name: str, temperature: float) -> None:
        """Refuse a temperature below absolute zero, by the name of the parameter.

        Raises:
            ValueError: It is below absolute zero, or not a number.
        """
        require_number(name, temperature, at_least(self.absolute_zero, "absolute zero"))

    def minimum(self) -> float:
        """Lowest trial temperature at a node. Collective."""
        return float(self.space.mesh.comm.allreduce(self.value.x.array.min(initial=np.inf), op=MPI.MIN))

    def maximum(self) -> float:
        """Highest trial temperature at a node. Collective."""
        return float(self.space.mesh.comm.allreduce(self.value.x.array.max(initial=-np.inf), op=MPI.MAX))
