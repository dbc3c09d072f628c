"""Nodal forces from the tractions between two surfaces, and their tangent (docs/theory.md §3.5)."""

from dataclasses import dataclass

import numpy as np

from cutsim.pairs.configuration import Pairs
from cutsim.pairs.pairing import Array, Indices
from cutsim.pairs.partners import PairKinematics


@dataclass(frozen=True)
class Tractions:
    """Tractions at the points of a slave surface, in the components of the jump.

    Attributes:
        values: On the slave, shape (points, dimension) [stress].
        stiffness: Derivative by the jump, shape (points, dimension, dimension) [stress/length].
        weights: Weights of the points; zero where another rank adds the forces.
    """

    values: Array
    stiffness: Array
    weights: Array


def nodes(kinematics: PairKinematics, pairs: Pairs, rows: Indices) -> Indices:
    """Global nodes on which some pairs act, those of the slave facet first."""
    slave = pairs.hits.points[rows] // len(kinematics.tables[0])
    return np.hstack([kinematics.slave.global_nodes[slave], kinematics.master.global_nodes[pairs.hits.facets[rows]]])


def active(kinematics: PairKinematics, pairs: Pairs, tractions: Tractions) -> Indices:
    """Pairs with a traction or a stiffness, by their place among the hits, in the order of the facets."""
    points = pairs.hits.points
    something = np.any(tractions.values, axis=1) | np.any(tractions.stiffness, axis=(1, 2))
    rows = np.flatnonzero(np.asarray(something)[points] & (tractions.weights[points] > 0))
    # pairs of the same two facets come one after the other: their blocks are added up before the matrix sees them
    return rows[np.lexsort((pairs.hits.facets[rows], points[rows] // len(kinematics.tables[0])))]


def stencils(kinematics: PairKinematics, pairs: Pairs, rows: Indices) -> tuple[Indices, Indices]:
    """Places of `active` rows where another slave or master facet begins, and the global nodes from there on."""
    all_nodes = nodes(kinematics, pairs, rows)
    new = np.any(np.diff(all_nodes, axis=0, prepend=-1), axis=1)
    starts = np.flatnonzero(new)
    return starts, all_nodes[starts]


def forces(kinematics: PairKinematics, pairs: Pairs, tractions: Tractions, rows: Indices) -> Array:
    """Nodal forces of some pairs, shape (rows, nodes, dimension): the virtual work T·(v_m − v_s)."""
    interpolation = _interpolation(kinematics, pairs, rows)
    return interpolation[:, :, None] * _spatial(pairs, tractions, rows)[:, None]


def tangents(kinematics: PairKinematics, pairs: Pairs, tractions: Tractions, rows: Indices) -> Array:
    """Derivatives of `forces`, shape (rows, nodes, dimension, nodes, dimension)."""
    points = pairs.hits.points[rows]
    frames, weights = pairs.slave.frames[points], tractions.weights[points]
    d_jump, d_frame, d_xi = pairs.linearise(rows)
    d_local = np.einsum("nab,nbpj->napj", tractions.stiffness[points], d_jump)
    d_traction = np.einsum("nai,napj->nipj", frames, d_local)
    d_traction += np.einsum("na,naipj->nipj", tractions.values[points], d_frame)
    d_traction *= weights[:, None, None, None]
    primitives = _primitives(kinematics, pairs, rows)
    by_nodes = np.einsum("nipj,npc->nicj", d_traction, primitives)
    interpolation = _interpolation(kinematics, pairs, rows)
    blocks = np.einsum("nr,nicj->nricj", interpolation, by_nodes)
    # the place on the master facet moves, and with it the share of its nodes
    ns = kinematics.tables[0].shape[1]
    share = np.einsum("nkr,nkpj,npc->nrcj", pairs.derivatives[rows], d_xi, primitives)
    blocks[:, ns:] += np.einsum("ni,nrcj->nricj", _spatial(pairs, tractions, rows), share)
    return blocks


def _spatial(pairs: Pairs, tractions: Tractions, rows: Indices) -> Array:
    """Traction vectors times weights."""
    points = pairs.hits.points[rows]
    weighted = tractions.weights[points, None] * tractions.values[points]
    return np.asarray(np.einsum("na,nai->ni", weighted, pairs.slave.frames[points]))


def _interpolation(kinematics: PairKinematics, pairs: Pairs, rows: Indices) -> Array:
    """Nodal factors of the jump of a field, master minus slave, shape (rows, nodes)."""
    values = kinematics.tables[0]
    return np.hstack([-values[pairs.hits.points[rows] % len(values)], pairs.values[rows]])


def _primitives(kinematics: PairKinematics, pairs: Pairs, rows: Indices) -> Array:
    """Nodal factors of the primitives, shape (rows, primitives, nodes)."""
    values, derivatives = kinematics.tables
    ns, q = values.shape[1], pairs.hits.points[rows] % len(values)
    count = derivatives.shape[1] + 2
    factors = np.zeros((len(rows), count, ns + pairs.values.shape[1]))
    factors[:, 0, :ns] = values[q]
    factors[:, 1:-1, :ns] = derivatives[q]
    factors[:, -1, ns:] = pairs.values[rows]
    return factors
