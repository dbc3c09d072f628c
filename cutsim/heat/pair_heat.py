"""Heat between two surfaces with large sliding (docs/theory.md §3.4, §3.5)."""

from collections.abc import Sequence
from dataclasses import replace

import ufl

from cutsim.base.checks import require
from cutsim.base.kinematics import Expr
from cutsim.base.signatures import checked
from cutsim.fields.temperature import Temperature
from cutsim.heat.contact_heat import ContactHeat
from cutsim.heat.exchange import ExchangeTerm, HeatExchange
from cutsim.heat.heat_pass import HeatPass
from cutsim.pairs.surface_pair import SurfacePair


class PairHeat(ExchangeTerm):
    """Heat exchange across a pair of surfaces, heated by their friction and fracture.

    Pressure, partners and dissipation are those of the mechanical step, per reference area of the slave.  The interface
    and its temperature move with the slave.  In two passes each surface is slave once, with its share of the area.

    Args:
        temperature: The temperature, on a space of degree 1 or 2.
        pair: The pair.
        law: Law of exchange, '+' being the slave surface and '−' the master.
        name: Name in messages and output; by default that of the pair.

    Attributes:
        passes: The exchange of each pass of the pair.

    Raises:
        ValueError: The temperature has another state than the pair, or is of higher degree.
    """

    @checked
    def __init__(
        self, temperature: Temperature, pair: SurfacePair, law: ContactHeat, *, name: str | None = None
    ) -> None:
        super().__init__(temperature, name or pair.name)
        require("pair", pair.name, pair.state is temperature.state, "a pair made with the state of the temperature")
        self.pair, self.law = pair, law
        swapped = replace(law, gamma_plus=law.gamma_minus, gamma_minus=law.gamma_plus)
        if pair.folding:
            same = law.gamma_plus == law.gamma_minus
            require("law", law, same, "the same on both sides of a surface that meets itself")
        self.passes = tuple(
            HeatPass(temperature, contact, pair.sides[sign > 0], law if sign > 0 else swapped, self.name)
            for contact, sign in zip(pair.passes, pair.signs, strict=True)
        )

    def residual(self, w: Expr) -> ufl.Form:
        """No form: all heat is exchanged by the passes."""
        return ufl.Form([])

    @property
    def assemblers(self) -> Sequence[HeatPass]:
        """The passes."""
        return self.passes

    def begin(self) -> None:
        """Take over partners, pressure and dissipation of the mechanical step. Collective."""
        for p in self.passes:
            p.begin()

    def evaluate(self) -> None:
        """Fluxes, interface temperature and entropy of the trial step. Collective."""
        for p in self.passes:
            p.evaluate()

    @property
    def exchanges(self) -> Sequence[HeatExchange]:
        """What is known of heat at the points of each pass."""
        return [p.exchange for p in self.passes]

    def flow(self, side: str) -> float:
        """Heat flow out of a surface, side "plus" (slave) or "minus" (master) [power]. Collective."""
        other = {"plus": "minus", "minus": "plus"}[side]
        signs = self.pair.signs
        return sum(p.exchange.flow(side if s > 0 else other) for p, s in zip(self.passes, signs, strict=True))
