"""Heat between a rigid tool and the body that it touches (docs/theory.md §3.4)."""

from collections.abc import Sequence

import numpy as np
import ufl

from cutsim.base.checks import require
from cutsim.base.kinematics import Expr
from cutsim.base.parameters import Schedule, TimeFunction
from cutsim.base.signatures import checked
from cutsim.base.terms import Columns
from cutsim.fields.temperature import Temperature
from cutsim.heat.contact_heat import HeatLaw
from cutsim.heat.exchange import ExchangeTerm, HeatExchange
from cutsim.tools.rigid_tool import RigidTool


class ToolHeat(ExchangeTerm):
    """Heat exchange with a rigid tool, heated by its friction.

    Args:
        temperature: The temperature of the body.
        tool: The tool.
        law: For a tool of given temperature a `ContactHeat` without capacity, '+' being the body and '−' the tool; or
            an `AdiabaticTool`.
        tool_temperature: Temperature of the tool, a number or a function of time [temperature]; not for an adiabatic
            tool.
        name: Name in messages and output; by default that of the tool.

    Raises:
        ValueError: The law has a capacity, or the tool's temperature is missing, superfluous or below absolute zero.
    """

    @checked
    def __init__(
        self,
        temperature: Temperature,
        tool: RigidTool,
        law: HeatLaw,
        tool_temperature: float | TimeFunction | None = None,
        *,
        name: str | None = None,
    ) -> None:
        super().__init__(temperature, name or tool.name)
        given = tool_temperature is not None
        require("tool_temperature", tool_temperature, given != law.adiabatic, "given unless the tool is adiabatic")
        require("law.capacity", law.capacity, law.capacity == 0, "0 for a tool")
        self.tool = tool
        self._tool_temperature = (
            None
            if tool_temperature is None
            else Schedule(self.state.mesh, self.state.memory, tool_temperature, "tool_temperature", self.name)
        )
        self._warm()
        self._exchanges = [
            HeatExchange(temperature, patch.surface.points, law, temperature.value, self._opposite, self.name)
            for patch in tool.touched
        ]

    @property
    def _opposite(self) -> Expr:
        """Temperature of what is opposite: the tool, or an adiabatic one's, which has that of the body."""
        return self.temperature.value if self._tool_temperature is None else self._tool_temperature.constant

    def _warm(self) -> None:
        """Let the friction of the tool feel its temperature."""
        if self._tool_temperature is not None:
            self.temperature.check("tool_temperature", self._tool_temperature.value)
            self.tool.temperature.value = self._tool_temperature.value

    @property
    def exchanges(self) -> Sequence[HeatExchange]:
        """What is known of heat at the points of each surface the tool can touch."""
        return self._exchanges

    def residual(self, w: Expr) -> ufl.Form:
        """Heat that leaves the body through the surfaces."""
        parts = zip(self.exchanges, self.tool.touched, strict=True)
        return sum((e.fluxes[0] * w * p.surface.measure for e, p in parts), start=ufl.Form([]))

    def begin(self) -> None:
        """Take over pressure and dissipation of the mechanical step. Collective.

        Raises:
            ValueError: The tool's temperature is below absolute zero.
        """
        if self._tool_temperature is not None:
            self._tool_temperature.begin(self.state.time)
            self._warm()
        for exchange, patch in zip(self.exchanges, self.tool.touched, strict=True):
            exchange.begin(patch.pressure(), patch.dissipation(), np.zeros_like(exchange.points.weights))

    def heat_flow(self) -> float:
        """Heat that flows into the tool [power]. Collective."""
        return -self.flow("minus")

    def heat(self) -> dict[str, float]:
        """Heat from friction, and heat that left into the tool, in the step. Collective."""
        friction = super().heat()["friction"]
        return {"friction": friction, "outflow": self.heat_flow() * float(self.state.dt.value)}

    def flows(self) -> Columns:
        """Column of the heat flow into the tool. Collective."""
        return {f"{self.name}_heat_flow": (self.heat_flow(), "power")}
