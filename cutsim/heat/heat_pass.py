"""Heat exchange between slave points and their partners on a master surface (docs/theory.md §3.4, §3.5)."""

import numpy as np
import ufl
from numpy.typing import NDArray
from petsc4py import PETSc

from cutsim.base.assembly import add_blocks
from cutsim.fields.faces import Face
from cutsim.fields.points import Values
from cutsim.fields.temperature import Temperature
from cutsim.heat.contact_heat import ContactHeat
from cutsim.heat.exchange import HeatExchange
from cutsim.pairs.paired_field import PairedField
from cutsim.pairs.pairing import Array
from cutsim.pairs.surface_pass import SurfacePass


class HeatPass:
    """Heat exchange at the points of a slave surface. Every method is collective.

    The flux q⁺ leaves the slave at its points and q⁻ the master where the points meet it.  Both follow from the two
    temperatures by the law of a crack: these are functions of the points, which are found beforehand.  A point without
    a partner faces itself: nothing flows, and what it may still dissipate is kept by the slave.

    Args:
        temperature: The temperature.
        contact: The pass of the mechanical pair.
        master: Its master surface.
        law: Law of exchange, '+' being the slave.
        name: Name in messages.

    Attributes:
        contact: The pass of the mechanical pair.
        exchange: What is known of heat at the points.
    """

    def __init__(
        self,
        temperature: Temperature,
        contact: SurfacePass,
        master: Face,
        law: ContactHeat,
        name: str,
    ) -> None:
        self.contact, self._temperature, self._fraction = contact, temperature, law.fracture_fraction
        points, kinematics = contact.points, contact.kinematics
        self._field = PairedField(temperature.space, points, kinematics.slave.face, master)
        self._field.pair(contact.partners().hits)
        self._faces = points.function(2)
        self._feel()
        faces = ufl.variable(points.at(self._faces))
        self.exchange = HeatExchange(temperature, points, law, faces[0], faces[1], name, contact.weight)
        fluxes = ufl.as_vector(self.exchange.fluxes)
        rates = ufl.diff(fluxes, faces)
        flat = ufl.as_vector([rates[i, j] for i in range(2) for j in range(2)])
        self._linear = points.evaluator({"fluxes": fluxes, "rates": flat})

    def _feel(self) -> None:
        """Bring the present temperature to the points."""
        points, values = self.contact.points, self._field.values(self._temperature.value.x.array)
        points.set(self._faces, values.reshape(*points.weights.shape, 2))

    def begin(self) -> None:
        """Take over partners, pressure and dissipation of the mechanical step."""
        self._field.pair(self.contact.partners().hits)
        history, slip = self.contact.history, self.contact.slip
        none: Values = np.zeros_like(self.contact.points.weights)
        friction = none if slip is None else slip.dissipation()
        self.exchange.begin(history.trial["pressure"], friction, self._fraction * history.dissipation())

    def evaluate(self) -> None:
        """Fluxes, interface temperature and entropy of the trial step."""
        self._feel()
        self.exchange.evaluate()

    @property
    def rate_dependent(self) -> bool:
        """False: what flows depends on the temperatures alone, not on how long a step takes."""
        return False

    @property
    def pattern(self) -> int:
        """Number of the sparsity pattern."""
        return self.contact.pattern

    def prepare(self) -> None:
        """Nothing: partners are found when forces are asked for."""

    def add_forces(self, b: PETSc.Vec, along: Array | None) -> None:
        """Add the heat that leaves the bodies, as `cutsim.base.terms.Assembler.add_forces`."""
        self._feel()
        fluxes, rates = self._law()
        if along is not None:
            fluxes = fluxes + np.einsum("nfg,ng->nf", rates, self._field.values(along))
        forces = np.einsum("n,nf,nfa->na", self.contact.weights, fluxes, self._field.shares)
        b.setValues(self._field.nodes.ravel().astype(PETSc.IntType), forces.ravel(), addv=PETSc.InsertMode.ADD)

    def add_tangent(self, A: PETSc.Mat) -> None:
        """Add the tangent, as `cutsim.base.terms.Assembler.add_tangent`."""
        rates = self._law()[1]
        rows = np.flatnonzero(rates.any(axis=(1, 2)) & (self.contact.weights > 0))
        weighted, shares = self.contact.weights[rows, None, None] * rates[rows], self._field.shares[rows]
        add_blocks(A, self._field.nodes[rows], shares.transpose(0, 2, 1) @ weighted @ shares)

    def add_pattern(self, A: PETSc.Mat) -> None:
        """Add zeros, as `cutsim.base.terms.Assembler.add_pattern`."""
        facets = self.contact.kinematics.facets
        near = [f[self._field.slave.owned[facets[0]]] for f in facets]
        own = self._field.slave.global_nodes
        assert self._field.master is not None
        facing = np.hstack([own[near[0]], self._field.master.global_nodes[near[1]]])
        for nodes in (own[self._field.slave.owned], facing):
            add_blocks(A, nodes, np.zeros((*nodes.shape, nodes.shape[1])))

    def _law(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Fluxes (points, 2) at the temperatures that were felt last, and their rates with these (points, 2, 2)."""
        values = self._linear()
        return values["fluxes"].reshape(-1, 2), values["rates"].reshape(-1, 2, 2)
