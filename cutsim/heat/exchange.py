"""Heat exchange between two surfaces at their integration points: fluxes, interface temperature, entropy."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cutsim.base.checks import require
from cutsim.base.compat import EntityMaps
from cutsim.base.kinematics import Expr
from cutsim.base.log import collective_logger
from cutsim.base.parameters import with_constants
from cutsim.base.terms import Columns
from cutsim.fields.points import FacetPoints, Values
from cutsim.fields.temperature import Temperature
from cutsim.heat.audit import HeatTerm
from cutsim.heat.contact_heat import HeatLaw

logger = collective_logger(__name__)

# negative contact dissipation down to this fraction of the largest one is rounding
_ROUNDING = 1e-9


@dataclass(frozen=True)
class _Exchanged:
    """Values at the points by name, and the entropy produced since the start [energy/temperature]."""

    values: Mapping[str, Values]
    entropy: float = 0.0


class HeatExchange:
    """Heat exchange between two surfaces, '+' and '−', and the interface between them.

    Args:
        temperature: The temperature.
        points: Integration points.
        law: Law of exchange.
        plus: Temperature of the '+' surface, as it enters a form over the points.
        minus: Temperature of the '−' surface.
        name: Name in messages.
        weight: Part of the area that takes part: heat, flows and entropy are multiplied by it.

    Attributes:
        fluxes: q⁺ and q⁻ out of the surfaces, for forms [power/area].
    """

    def __init__(
        self,
        temperature: Temperature,
        points: FacetPoints,
        law: HeatLaw,
        plus: Expr,
        minus: Expr,
        name: str,
        weight: float = 1.0,
    ) -> None:
        self.points, self.law, self.name, self._weight = points, law, name, weight
        self._zero, self._dt = temperature.absolute_zero, temperature.state.dt
        self._pressure, self._source, self._contact = (points.function() for _ in range(3))
        pressure, source, contact = (points.at(f) for f in (self._pressure, self._source, self._contact))
        symbolic = with_constants(temperature.state.mesh, law)
        q_plus, q_minus, mixed = symbolic.exchange(pressure, plus, minus, source, contact, self._dt)
        self.fluxes = q_plus, q_minus
        fields = {"flux_plus": q_plus, "flux_minus": q_minus, "temperature": mixed}
        self._evaluate = points.evaluator(fields | {"temperature_plus": plus, "temperature_minus": minus})
        self._friction = self._fracture = np.zeros_like(points.weights)
        memory = temperature.state.memory
        self._now = memory.value(f"{name}: heat", self._start(), self._show, places=points.places)
        self._show(self._now.committed)

    def _start(self) -> _Exchanged:
        """The interface starts with the mean temperature of the surfaces, without flux."""
        values = self._evaluate()
        mean = np.asarray(0.5 * (values["temperature_plus"] + values["temperature_minus"]))
        none = dict.fromkeys(("flux_plus", "flux_minus", "dissipation"), np.zeros_like(mean))
        return _Exchanged({**values, **none, "temperature": mean})

    def _show(self, committed: _Exchanged) -> None:
        self.points.set(self._contact, committed.values["temperature"])

    @property
    def values(self) -> Mapping[str, Values]:
        """Trial values at the points, by name, see `point_values`."""
        return self._now.trial.values

    @property
    def entity_maps(self) -> EntityMaps:
        """Map from facets of the mesh to the mesh of the points."""
        return self.points.entity_maps

    def begin(self, pressure: Values, friction: Values, fracture: Values) -> None:
        """Take over what the mechanical step has found, all per reference area.

        Args:
            pressure: Contact pressure [stress].
            friction: Heat from friction in the step [energy/area].
            fracture: Heat from fracture in the step [energy/area].
        """
        self._friction, self._fracture = friction, fracture
        self.points.set(self._pressure, pressure)
        self.points.set(self._source, np.asarray((friction + fracture) / float(self._dt.value), dtype=np.float64))

    def evaluate(self) -> None:
        """Fluxes, interface temperature, contact dissipation and entropy of the trial step. Collective."""
        values = self._evaluate()
        values["dissipation"] = self._dissipation(values)
        flux_plus, flux_minus, zero = values["flux_plus"], values["flux_minus"], self._zero
        kept = flux_plus + flux_minus + self.points.get(self._source)
        entropy = kept / (values["temperature"] - zero)
        entropy -= flux_plus / (values["temperature_plus"] - zero) + flux_minus / (values["temperature_minus"] - zero)
        produced = float(self._dt.value) * self._integral(entropy)
        self._now.trial = _Exchanged(values, self._now.committed.entropy + produced)
        least, most = self.least_dissipation(), self.points.maximum(np.abs(values["dissipation"]))
        if least < -_ROUNDING * most:
            logger.warning("%s: contact dissipation %.3g < 0 at a point", self.name, least)

    def _dissipation(self, values: Mapping[str, Values]) -> Values:
        """q⁺ (T⁺ − T_c)/T⁺ + q⁻ (T⁻ − T_c)/T⁻ with absolute temperatures (thesis 4.62)."""
        total = np.zeros_like(self.points.weights)
        for side in ("plus", "minus"):
            T = values[f"temperature_{side}"]
            total += values[f"flux_{side}"] * (T - values["temperature"]) / (T - self._zero)
        # heat that is given to the surfaces without a way through the interface meets no drop of temperature
        return np.where(self.law.conducts(self.points.get(self._pressure)), total, 0.0)

    def heat(self) -> dict[str, float]:
        """Heat generated, and stored by the interface, in the trial step [energy]. Collective."""
        rise = self.values["temperature"] - self.points.get(self._contact)
        return {
            "friction": self._integral(self._friction),
            "fracture": self._integral(self._fracture),
            "stored": self.law.capacity * self._integral(rise) if self.law.capacity else 0.0,
        }

    def held_entropy(self) -> float:
        """Entropy of the heat capacity of the interface [energy/temperature]. Collective."""
        if not self.law.capacity:
            return 0.0
        return self.law.capacity * self._integral(np.log(self.values["temperature"] - self._zero))

    def flow(self, side: str) -> float:
        """Heat flow out of a surface, side "plus" or "minus" [power]. Collective."""
        return self._integral(self.values[f"flux_{side}"])

    def _integral(self, values: Values) -> float:
        return self._weight * self.points.integral(values)

    def least_dissipation(self) -> float:
        """Least contact dissipation at a point in the trial step [power/area]. Collective."""
        return -self.points.maximum(-self.values["dissipation"])

    @property
    def entropy(self) -> float:
        """Entropy produced since the start, the trial step included [energy/temperature]."""
        return self._now.trial.entropy

    def point_values(self, name: str) -> Values:
        """Trial values at the integration points, shape (local facets, points).

        Args:
            name: "flux_plus", "flux_minus" (out of the surfaces), "temperature" (of the interface),
                "temperature_plus", "temperature_minus" or "dissipation" (of heat contact, thesis 4.62).

        Raises:
            ValueError: The name is unknown.
        """
        require("name", name, name in self.values, f"one of {', '.join(self.values)}")
        return self.values[name]


class ExchangeTerm(HeatTerm):
    """Heat exchange between two surfaces of any kind."""

    @property
    def exchanges(self) -> Sequence[HeatExchange]:
        """What is known of heat at the points of each surface."""
        raise NotImplementedError

    @property
    def entity_maps(self) -> EntityMaps:
        """Maps from facets of the mesh to the points of the surfaces."""
        return {mesh: cells for e in self.exchanges for mesh, cells in e.entity_maps.items()}

    def evaluate(self) -> None:
        """Fluxes, interface temperature and entropy of the trial step. Collective."""
        for exchange in self.exchanges:
            exchange.evaluate()

    def heat(self) -> dict[str, float]:
        """Heat generated and stored by the interface in the step. Collective."""
        heats = [e.heat() for e in self.exchanges]
        return {entry: sum(heat[entry] for heat in heats) for entry in heats[0]}

    def held_entropy(self) -> float:
        """Entropy of the heat capacity of the interface. Collective."""
        return sum(e.held_entropy() for e in self.exchanges)

    def flow(self, side: str) -> float:
        """Heat flow out of a surface, side "plus" or "minus" [power]. Collective."""
        return sum(e.flow(side) for e in self.exchanges)

    def flows(self) -> Columns:
        """Columns of the heat flows out of both surfaces. Collective."""
        return {f"{self.name}_heat_flow_{side}": (self.flow(side), "power") for side in ("plus", "minus")}

    def record(self) -> Columns:
        """Heat flows, highest interface temperature, least contact dissipation, entropy. Collective."""
        hottest = max(e.points.maximum(e.values["temperature"]) for e in self.exchanges)
        least = min(e.least_dissipation() for e in self.exchanges)
        return self.flows() | {
            f"{self.name}_temperature_max": (hottest, "temperature"),
            f"{self.name}_contact_dissipation_min": (least, "flux"),
            f"{self.name}_entropy": (sum(e.entropy for e in self.exchanges), "entropy"),
        }
