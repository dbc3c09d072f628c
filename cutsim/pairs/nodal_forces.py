"""Nodal forces from the tractions between two surfaces, and their tangent (docs/theory.md §3.5)."""

from dataclasses import dataclass

import numpy as np

from cutsim.pairs.configuration import Pairs
from cutsim.pairs.pairing import Array, Indices
from cutsim.pairs.partners import PairKinematics


@dataclass(frozen=True)
class Action:
    """Tractions between the points of a slave surface and their partners, in the components of their jump.

    Attributes:
        kinematics: The surfaces.
        pairs: The points and their partners.
        weights: Weights of the points; zero where another rank adds the forces.
        values: Tractions on the slave, shape (points, dimension) [stress].
        stiffness: Derivative by the jump, shape (points, dimension, dimension) [stress/length].
    """

    kinematics: PairKinematics
    pairs: Pairs
    weights: Array
    values: Array
    stiffness: Array

    @property
    def rows(self) -> Indices:
        """Pairs with a traction or a stiffness, by their place among the hits, in the order of the facets."""
        points = self.pairs.hits.points
        something = np.any(self.values, axis=1) | np.any(self.stiffness, axis=(1, 2))
        rows = np.flatnonzero(np.asarray(something)[points] & (self.weights[points] > 0))
        # pairs of the same two facets come one after the other: their blocks are added up before the matrix sees them
        return rows[np.lexsort((self.pairs.hits.facets[rows], self._facets(rows)))]

    def _facets(self, rows: Indices) -> Indices:
        """Slave facets of some pairs."""
        return self.kinematics.slave.facets_of(self.pairs.hits.points[rows])

    def nodes(self, rows: Indices) -> Indices:
        """Global nodes on which some pairs act, those of the slave facet first."""
        return self.kinematics.between(self._facets(rows), self.pairs.hits.facets[rows])

    def at_nodes(self, field: Array, rows: Indices) -> Array:
        """Values of a field over the local dofs at these nodes. Collective."""
        return self.kinematics.at_stencil(field, self.pairs, rows)

    def traction(self) -> Array:
        """Traction vectors on the slave, shape (points, dimension) [stress]."""
        return np.asarray(np.einsum("na,nai->ni", self.values, self.pairs.slave.frames))

    def forces(self, rows: Indices) -> Array:
        """Nodal forces of some pairs, shape (rows, nodes, dimension): the virtual work T·(v_m − v_s)."""
        return self.interpolation(rows)[:, :, None] * self._weighted(rows)[:, None]

    def tangents(self, rows: Indices) -> Array:
        """Derivatives of `forces`, shape (rows, nodes, dimension, nodes, dimension)."""
        points, pairs = self.pairs.hits.points[rows], self.pairs
        d_jump, d_frame, d_xi = pairs.linearise(rows)
        d_local = np.einsum("nab,nbpj->napj", self.stiffness[points], d_jump)
        d_traction = np.einsum("nai,napj->nipj", pairs.slave.frames[points], d_local)
        d_traction += np.einsum("na,naipj->nipj", self.values[points], d_frame)
        d_traction *= self.weights[points][:, None, None, None]
        primitives = self._primitives(rows)
        by_nodes = np.einsum("nipj,npc->nicj", d_traction, primitives)
        blocks = np.einsum("nr,nicj->nricj", self.interpolation(rows), by_nodes)
        if pairs.on_ray is not None and d_xi is not None:
            # the place on the master facet moves, and with it the share of its nodes
            ns = self.kinematics.slave.values.shape[1]
            share = np.einsum("nkr,nkpj,npc->nrcj", pairs.on_ray.derivatives[rows], d_xi, primitives)
            blocks[:, ns:] += np.einsum("ni,nrcj->nricj", self._weighted(rows), share)
        return blocks

    def of_jump(self, rows: Indices) -> Array:
        """Derivative of the jump of some pairs by their nodes, shape (rows, components, nodes, dimension)."""
        return np.asarray(np.einsum("nbpj,npc->nbcj", self.pairs.linearise(rows)[0], self._primitives(rows)))

    def interpolation(self, rows: Indices) -> Array:
        """Nodal factors of the jump of a field, master minus slave, shape (rows, nodes)."""
        return np.hstack([-self.kinematics.slave.values[self.pairs.hits.points[rows]], self.pairs.values[rows]])

    def _weighted(self, rows: Indices) -> Array:
        """Traction vectors times weights."""
        points = self.pairs.hits.points[rows]
        return self.weights[points, None] * self.traction()[points]

    def _primitives(self, rows: Indices) -> Array:
        """Nodal factors of the primitives, shape (rows, primitives, nodes)."""
        slave, points = self.kinematics.slave, self.pairs.hits.points[rows]
        ns, count = slave.values.shape[1], slave.derivatives.shape[1] + 2
        factors = np.zeros((len(rows), count, ns + self.pairs.values.shape[1]))
        factors[:, 0, :ns] = slave.values[points]
        factors[:, 1:-1, :ns] = slave.derivatives[points]
        factors[:, -1, ns:] = self.pairs.values[rows]
        if self.pairs.midway is not None:
            factors[:, 1:-1, :ns] *= 0.5
            factors[:, 1:-1, ns:] = self.pairs.midway[rows]
        return factors


@dataclass(frozen=True)
class Slope(Action):
    """Derivative of what is summed over the points, by its derivatives by the jump in place of tractions."""

    def forces(self, rows: Indices) -> Array:
        """Derivatives by the nodes of some pairs, shape (rows, nodes, dimension)."""
        points = self.pairs.hits.points[rows]
        by_jump = self.weights[points, None] * self.values[points]
        return np.asarray(np.einsum("nb,nbcj->ncj", by_jump, self.of_jump(rows)))


@dataclass(frozen=True)
class Coupling:
    """Share of the tractions of a contact that depends on the jump of a bond with other partners.

    Attributes:
        contact: Tractions of the contact.
        bond: Those of the bond at the same points.
        stiffness: Derivative of the contact's by the bond's jump, shape (points, dimension, dimension) [stress/length].
    """

    contact: Action
    bond: Action
    stiffness: Array

    @property
    def rows(self) -> tuple[Indices, Indices]:
        """Pairs of contact and bond with the same point that are coupled, in the order of the facets."""
        hits = self.contact.pairs.hits, self.bond.pairs.hits
        points, *rows = np.intersect1d(hits[0].points, hits[1].points, assume_unique=True, return_indices=True)
        coupled = np.any(self.stiffness[points], axis=(1, 2)) & (self.contact.weights[points] > 0)
        contact, bond = (some[coupled] for some in rows)
        slave = self.contact.kinematics.slave.facets_of(points[coupled])
        order = np.lexsort((hits[1].facets[bond], hits[0].facets[contact], slave))
        return contact[order], bond[order]

    def tangents(self, rows: tuple[Indices, Indices]) -> Array:
        """Derivatives of the contact's forces by the nodes of the bond, shape (rows, nodes, dim, nodes, dim)."""
        pairs = self.contact.pairs
        points = pairs.hits.points[rows[0]]
        by_jump = np.einsum(
            "n,nai,nab->nib", self.contact.weights[points], pairs.slave.frames[points], self.stiffness[points]
        )
        by_nodes = np.einsum("nib,nbcj->nicj", by_jump, self.bond.of_jump(rows[1]))
        return np.asarray(np.einsum("nr,nicj->nricj", self.contact.interpolation(rows[0]), by_nodes))
