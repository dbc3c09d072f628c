"""Heat across a crack: contact conductance, with friction and fracture as sources (docs/theory.md §3.4)."""

from typing import Protocol

import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI

from cutsim.base.checks import require
from cutsim.base.kinematics import Expr
from cutsim.base.signatures import checked
from cutsim.fields.points import Values
from cutsim.fields.temperature import Temperature
from cutsim.heat.contact_heat import ContactHeat
from cutsim.heat.exchange import ExchangeTerm, HeatExchange
from cutsim.interface.crack import Crack


class Friction(Protocol):
    """Protocol of friction on a crack, as heat uses it."""

    def dissipation(self) -> Values:
        """Friction dissipation of the trial step per reference area at the crack's points [energy/area]."""


class InterfaceHeat(ExchangeTerm):
    """Heat exchange across a crack, heated by friction and fracture.

    Pressure and dissipation are those of the mechanical step, per reference area.

    Args:
        temperature: The temperature, on a space that is cracked along the same facets.
        crack: The crack.
        law: Law of exchange between the faces.
        friction: Friction on the crack; by default that which the crack was given.
        name: Name in messages and output; by default that of the crack.

    Attributes:
        exchange: What is known of heat at the points of the crack.

    Raises:
        ValueError: The temperature has another state than the crack, or is continuous across it.
    """

    @checked
    def __init__(
        self,
        temperature: Temperature,
        crack: Crack,
        law: ContactHeat,
        friction: Friction | None = None,
        *,
        name: str | None = None,
    ) -> None:
        super().__init__(temperature, name or crack.name)
        require("crack", crack.name, crack.state is temperature.state, "a crack made with the state of the temperature")
        require("crack", crack.name, crack.plane is None, "one of which both sides are meshed")
        require("temperature", crack.name, _is_cracked(temperature.space, crack), "on a space cracked along the crack")
        self.crack, self.law, self.friction = crack, law, friction or crack.friction
        T = temperature.value
        self.exchange = HeatExchange(temperature, crack.points, law, T("+"), T("-"), self.name)

    @property
    def exchanges(self) -> tuple[HeatExchange, ...]:
        """What is known of heat at the points of the crack."""
        return (self.exchange,)

    def residual(self, w: Expr) -> ufl.Form:
        """Heat that leaves the bodies through the faces."""
        q_plus, q_minus = self.exchange.fluxes
        return (q_plus * w("+") + q_minus * w("-")) * self.crack.points.measure

    def begin(self) -> None:
        """Take over pressure and dissipation of the mechanical step."""
        nothing = np.zeros_like(self.crack.points.weights)
        self.exchange.begin(
            self.crack.point_values("pressure"),
            nothing if self.friction is None else self.friction.dissipation(),
            self.law.fracture_fraction * self.crack.dissipation(),
        )


def _is_cracked(V: fem.FunctionSpace, crack: Crack) -> bool:
    """Whether the two sides of some facet of a crack have unknowns of their own. Collective."""
    dofmap = V.dofmap
    shared = len(dofmap.dof_layout.entity_closure_dofs(V.mesh.topology.dim - 1, 0))
    pairs = crack.entities.reshape(-1, 4)[:, ::2]
    split = any(len(np.intersect1d(dofmap.cell_dofs(a), dofmap.cell_dofs(b))) < shared for a, b in pairs)
    return bool(V.mesh.comm.allreduce(split, op=MPI.LOR))
