"""Thermal boundary conditions: flux, convection, temperature. All areas are those of the reference configuration."""

from abc import ABC, abstractmethod

import numpy as np
import ufl
from dolfinx import default_scalar_type, fem
from numpy.typing import NDArray

from cutsim.base.assembly import integrate
from cutsim.base.checks import nonnegative, require, require_number, require_numbers
from cutsim.base.compat import form
from cutsim.base.kinematics import Expr
from cutsim.base.parameters import Schedule, TimeFunction
from cutsim.base.signatures import checked
from cutsim.base.terms import Columns
from cutsim.fields.space import locate_dofs
from cutsim.fields.temperature import Temperature
from cutsim.heat.audit import HeatTerm


class _SurfaceHeat(HeatTerm, ABC):
    """Base of heat through the boundary, `_influx` per reference area; one number of it varies in time."""

    def __init__(
        self,
        temperature: Temperature,
        facets: NDArray[np.int32],
        value: float | TimeFunction,
        parameter: str,
        name: str,
        corners: tuple[float, ...],
    ) -> None:
        super().__init__(temperature, name)
        require_numbers("corners", corners, least=0)
        self._corners = corners
        self._value = Schedule(self.state.mesh, self.state.memory, value, parameter, name)
        self._ds = self.state.measures.exterior(facets)
        self._flow = form(self._influx() * self._ds)

    @abstractmethod
    def _influx(self) -> Expr:
        """Heat flux into the body [power/area]."""

    @property
    def corners(self) -> tuple[float, ...]:
        """Times at which the number has a kink."""
        return self._corners

    def residual(self, w: Expr) -> ufl.Form:
        """Minus the heat that flows in."""
        return -self._influx() * w * self._ds

    def begin(self) -> None:
        """Set the number to its value at the end of the step."""
        self._value.begin(self.state.time)

    def heat_flow(self) -> float:
        """Heat that flows into the body at the trial temperature [power]. Collective."""
        return integrate(self._flow)

    def heat(self) -> dict[str, float]:
        """Heat that left in the step. Collective."""
        return {"outflow": -self.heat_flow() * float(self.state.dt.value)}

    def record(self) -> dict[str, tuple[float, str]]:
        """Heat flow into the body. Collective."""
        return {f"{self.name}_heat_flow": (self.heat_flow(), "power")}


class HeatFlux(_SurfaceHeat):
    """Prescribed heat flux on a part of the boundary.

    Args:
        temperature: The temperature.
        facets: Local exterior facets.
        flux: Heat flux into the body per reference area, a number or a function of time [power/area].
        name: Name in messages and output.
        corners: Times at which the flux jumps or has a kink.

    Raises:
        ValueError: There is no such facet.
    """

    @checked
    def __init__(
        self,
        temperature: Temperature,
        facets: NDArray[np.int32],
        flux: float | TimeFunction,
        *,
        name: str = "flux",
        corners: tuple[float, ...] = (),
    ) -> None:
        super().__init__(temperature, facets, flux, "flux", name, corners)

    def _influx(self) -> Expr:
        return self._value.constant


class Convection(_SurfaceHeat):
    """Heat exchange with the surroundings, flux h (T_∞ − T) into the body per reference area.

    Args:
        temperature: The temperature.
        facets: Local exterior facets.
        coefficient: Heat transfer coefficient h ≥ 0 [power/(area·temperature)].
        ambient: Temperature T_∞ of the surroundings, a number or a function of time [temperature].
        name: Name in messages and output.
        corners: Times at which the ambient temperature jumps or has a kink.

    Raises:
        ValueError: There is no such facet, the coefficient is negative, or the surroundings are below absolute zero.
    """

    @checked
    def __init__(
        self,
        temperature: Temperature,
        facets: NDArray[np.int32],
        coefficient: float,
        ambient: float | TimeFunction,
        *,
        name: str = "convection",
        corners: tuple[float, ...] = (),
    ) -> None:
        require_number("coefficient", coefficient, nonnegative)
        self._coefficient = fem.Constant(temperature.state.mesh, default_scalar_type(coefficient))
        super().__init__(temperature, facets, ambient, "ambient", name, corners)
        temperature.check("ambient", self._value.value)

    def begin(self) -> None:
        """Set the temperature of the surroundings to its value at the end of the step.

        Raises:
            ValueError: It is below absolute zero.
        """
        super().begin()
        self.temperature.check("ambient", self._value.value)

    def _influx(self) -> Expr:
        return self._coefficient * (self._value.constant - self.temperature.value)


class PrescribedTemperature:
    """Prescribed temperature on some facets (or vertices, or cells), with its heat flow.

    On a crack it holds all its sides. Several may hold the same node if they agree on its temperature at all times; its
    heat flow then counts for the first of them that has a name.

    Args:
        temperature: The temperature.
        entities: Local mesh entities.
        value: Temperature, a number or a function of time [temperature].
        name: Name in the history, None to leave the heat flow out of it.
        dim: Dimension of the entities; facets by default.
        corners: Times at which the temperature jumps or has a kink.

    Attributes:
        dofs: Owned dofs that it holds.
        symbol: "T".

    Raises:
        ValueError: No entity is found on any rank, or the temperature is below absolute zero.
    """

    @checked
    def __init__(
        self,
        temperature: Temperature,
        entities: NDArray[np.int32],
        value: float | TimeFunction,
        *,
        name: str | None = None,
        dim: int | None = None,
        corners: tuple[float, ...] = (),
    ) -> None:
        require_numbers("corners", corners, least=0)
        mesh, V = temperature.space.mesh, temperature.space
        self.name, self.temperature, self.corners = name, temperature, corners
        self._value = Schedule(mesh, temperature.state.memory, value, "value", name or "prescribed temperature")
        temperature.check("value", self._value.value)
        tdim = mesh.topology.dim
        require("dim", dim, dim is None or dim in range(tdim + 1), f"0 … {tdim}, or None for facets")
        dofs = locate_dofs(V, tdim - 1 if dim is None else dim, entities)
        self.dofs, self.symbol = dofs[dofs < V.dofmap.index_map.size_local], "T"
        found = mesh.comm.allreduce(len(self.dofs))
        require("entities", found, found > 0, f"entities that carry dofs (prescribed temperature {name!r})")
        self.bc = fem.dirichletbc(self._value.constant, dofs, V)

    def begin(self) -> None:
        """Set the temperature to its value at the end of the step.

        Raises:
            ValueError: It is below absolute zero.
        """
        self._value.begin(self.temperature.state.time)
        self.temperature.check("value", self._value.value)

    def record(self, reaction: float) -> Columns:
        """Heat flow through it.

        Args:
            reaction: Heat flow into the body [power].
        """
        return {f"{self.name}_heat_flow": (reaction, "power")}

    @property
    def prescribed(self) -> float:
        """Prescribed temperature at the end of the step [temperature]."""
        return self._value.value
