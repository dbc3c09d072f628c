"""Segments: the parts of slave facets that each face one master facet, and integration points on them.

Where a master facet ends within a slave facet, displacement and shape functions of the master have a kink, and the
points of a rule for the whole facet do not know where.  On segments the integrand is smooth (docs/large_sliding.md).
"""

from collections import defaultdict
from dataclasses import dataclass
from itertools import count
from typing import Self

import basix
import numpy as np
from mpi4py import MPI

from cutsim.fields.faces import Face
from cutsim.fields.points import DEGREE, FacetPoints
from cutsim.fields.state import State
from cutsim.pairs.outer_surface import OuterSurface, SharedSurface, normals
from cutsim.pairs.pairing import Array, FacetShape, Indices, determinant, inverse, near_facets, solve
from cutsim.pairs.tiles import Polygon, divided_interval, divided_polygon, simple_parts

# Gauss-Newton iterations for the place of a corner, their accuracy, and how far outside of a facet it is looked for
_ITERATIONS, _ACCURACY, _OUTSIDE = 20, 1e-14, 1.0
# master facets near a slave facet from which this is not divided: every facet would have as many points as it needs
_MOST = 64
# distance of an edge from another one, over the size of the facet, up to which both are the same
_SAME = 1e-10
# digits of a place over the size of the facet by which master facets are sorted
_DIGITS = 8
# kind of a part by its number of corners, and these in the order of the reference cell from side by side
_KINDS = {2: basix.CellType.interval, 3: basix.CellType.triangle, 4: basix.CellType.quadrilateral}
_ORDER = {2: [0, 1], 3: [0, 1, 2], 4: [0, 1, 3, 2]}

#: Facets and the corners of as many parts of them, shape (parts, corners, directions).
_Parts = tuple[Indices, Array]


class SegmentPoints(FacetPoints):
    """Integration points on the segments of slave facets, other ones on each facet. Collective.

    Every facet has as many points as the one with the most; those beyond its own are copies of its first, without
    weight.  Forms see all at the places of a usual rule: what depends on the place has to come from functions of them.

    Args:
        state: Displacement and time.
        face: The slave facets.
        name: Their name as the user wrote it.
        master: The master surface.
        search: Largest distance of a partner [length].
        sliding: Whether contact slides over the master while the segments stay, so that its facets end elsewhere.
    """

    def __init__(
        self, state: State, face: Face, name: str, *, master: SharedSurface, search: float, sliding: bool
    ) -> None:
        slave = OuterSurface(state.V, face)
        # 2k is what a bond needs, k being the degree of the displacement
        rule = _rule(slave, master, search, (3 if sliding else 2) * slave.shape.element.degree)
        kind, most = slave.shape.element.cell_type, state.mesh.comm.allreduce(rule.most, op=MPI.MAX)
        degree = next(d for d in count(DEGREE) if len(basix.make_quadrature(kind, d)[1]) >= most)
        measure = state.measures.face(face, name)
        super().__init__(state.mesh, face.facets, measure, interior=False, degree=degree, ordered=True)
        order = face.order_of(self.facets)
        self._xi, weights = (part[order] for part in rule.filled(self.weights.shape[1]))
        nodes = np.repeat(slave.reference[order], weights.shape[1], axis=0)
        values, derivatives = slave.shape.values(self._xi.reshape(-1, self._xi.shape[-1]))
        size = np.linalg.norm(normals(np.einsum("nka,nai->nki", derivatives, nodes)), axis=-1)
        if state.axisymmetric:
            size *= np.einsum("na,na->n", values, nodes[:, :, 0])
        weights = weights * size.reshape(weights.shape)
        # the area of a facet is that of the mesh, whose degree may be another one than that of the displacement
        self.weights = weights * (self.weights.sum(axis=1) / weights.sum(axis=1))[:, None]

    @property
    def xi(self) -> Array:
        """Reference coordinates of the points on their facets, shape (local facets, points, directions)."""
        return self._xi


@dataclass(frozen=True)
class _Rule:
    """Points on facets and their weights in the reference facet, those of a facet side by side.

    Attributes:
        facets: Facet of each point, ascending.
        xi: Places, shape (points, directions).
        weights: Weights.
        starts: First point of each facet, and the number of all.
    """

    facets: Indices
    xi: Array
    weights: Array
    starts: Indices

    @property
    def most(self) -> int:
        """Largest number of points on a facet."""
        return int(np.diff(self.starts).max(initial=0))

    def filled(self, most: int) -> tuple[Array, Array]:
        """Places and weights with as many points on each facet, further ones where the first is, without weight."""
        own = np.arange(len(self.facets)) - self.starts[self.facets]
        xi = np.repeat(self.xi[self.starts[:-1], None], most, axis=1)
        weights = np.zeros(xi.shape[:2])
        xi[self.facets, own], weights[self.facets, own] = self.xi, self.weights
        return xi, weights


def _rule(slave: OuterSurface, master: SharedSurface, search: float, degree: int) -> _Rule:
    """Points on the segments of the slave facets of this rank; a facet that is not divided has those of a crack."""
    flat = _Flat.of(slave)
    whole, parts = _divided(flat, *_corners(slave, flat, master, search))
    rules = [_on((whole, flat.corners[whole]), max(DEGREE, degree)), *(_on(some, degree) for some in parts)]
    facets, places, weights = (np.concatenate(part) for part in zip(*rules, strict=True))
    order = np.argsort(facets, kind="stable")
    facets, places, weights = facets[order], places[order], weights[order]
    xi = solve(flat.corners[facets] - places[:, None], flat.shape)
    area = np.abs(determinant(flat.tangents(facets, xi)))
    return _Rule(facets, xi, weights / area, np.searchsorted(facets, np.arange(len(flat.corners) + 1)))


@dataclass(frozen=True)
class _Flat:
    """Slave facets made flat, with straight edges; those that are so already keep their shape.

    Attributes:
        shape: Reference shape.
        corners: Corners in the plane of each facet, shape (facets, corners, directions).
    """

    shape: FacetShape
    corners: Array

    @classmethod
    def of(cls, surface: OuterSurface) -> Self:
        """The facets of a surface."""
        shape = FacetShape(basix.create_element(basix.ElementFamily.P, surface.shape.element.cell_type, 1))
        x = surface.reference[:, : shape.element.dim]
        tangents = np.einsum("kb,fbi->fki", shape.values(shape.centre[None])[1][0], x)
        first = tangents[:, 0] / np.linalg.norm(tangents[:, 0], axis=-1, keepdims=True)
        axes = first[:, None]
        if tangents.shape[1] == 2:
            second = tangents[:, 1] - np.einsum("fi,fi->f", tangents[:, 1], first)[:, None] * first
            axes = np.stack([first, second / np.linalg.norm(second, axis=-1, keepdims=True)], axis=1)
        return cls(shape, np.einsum("fki,fbi->fbk", axes, x - x[:, :1]))

    def places(self, facets: Indices, xi: Array) -> Array:
        """Places in the planes of some facets, one on each, shape (facets, directions)."""
        return np.asarray(np.einsum("nb,nbk->nk", self.shape.values(xi)[0], self.corners[facets]))

    def tangents(self, facets: Indices, xi: Array) -> Array:
        """Tangents there as rows, shape (facets, directions, directions)."""
        return np.asarray(np.einsum("nkb,nbi->nki", self.shape.values(xi)[1], self.corners[facets]))


def _corners(slave: OuterSurface, flat: _Flat, master: SharedSurface, search: float) -> _Parts:
    """Slave facets, ascending, and the corners in their planes of master facets that face them."""
    shape, nodes = slave.shape, slave.reference
    nu = normals(np.einsum("qkb,fbi->fqki", shape.values(shape.element.points)[1], nodes))
    ray = search * nu / np.linalg.norm(nu, axis=-1, keepdims=True)
    rays = np.concatenate([nodes + ray, nodes - ray], axis=1)
    s, m = near_facets(rays, master.reference, _SAME * np.abs(flat.corners).max(initial=0.0))
    outward = [_outward(surface) for surface in (slave, master)]
    facing = np.einsum("ni,ni->n", outward[0][s], outward[1][m]) < 0
    s, m = s[facing], m[facing]
    count = len(basix.geometry(master.shape.element.cell_type))
    owner = np.repeat(s, count)
    xi, step = _closest(shape, nodes[owner], master.reference[m][:, :count].reshape(len(owner), nodes.shape[2]))
    # corners far outside of a facet are where its plane has them: there the map of a warped facet may be singular
    places = flat.places(owner, xi) + np.einsum("nk,nki->ni", step, flat.tangents(owner, xi))
    places = places.reshape(len(s), count, places.shape[1])
    # one after the other by where they are, so that a facet is divided alike on any number of ranks
    middle = places.mean(axis=1) / np.abs(flat.corners[s]).max(axis=(1, 2), initial=0.0)[:, None]
    order = np.lexsort((*np.round(middle, _DIGITS).T, s))
    return s[order], places[order]


def _outward(surface: OuterSurface | SharedSurface) -> Array:
    """Outward normals in the middle of facets, not of unit length."""
    derivatives = surface.shape.values(surface.shape.centre[None])[1][0]
    return surface.sides[:, None] * normals(np.einsum("kb,nbi->nki", derivatives, surface.reference))


def _closest(shape: FacetShape, nodes: Array, x: Array) -> tuple[Array, Array]:
    """Reference coordinates of the place on each facet nearest to a point, and what is left of the way to there."""
    xi = np.tile(shape.centre, (len(x), 1))
    for _ in range(_ITERATIONS):
        values, derivatives = shape.values(xi)
        tangents = np.einsum("nka,nai->nki", derivatives, nodes)
        rest = np.einsum("nki,ni->nk", tangents, x - np.einsum("na,nai->ni", values, nodes))
        step = np.einsum("nkl,nl->nk", inverse(tangents @ tangents.transpose(0, 2, 1)), rest)
        new = np.clip(xi + step, -_OUTSIDE, 1 + _OUTSIDE)
        if np.abs(new - xi).max(initial=0.0) <= _ACCURACY:
            break
        xi = new
    return xi, step


def _divided(flat: _Flat, owners: Indices, others: Array) -> tuple[Indices, list[_Parts]]:
    """Facets that are not divided, and the simple parts of those that are."""
    whole, parts = list[int](), defaultdict[int, list[tuple[int, Polygon]]](list)
    first = np.searchsorted(owners, np.arange(len(flat.corners) + 1))
    around = _ORDER[flat.corners.shape[1]], _ORDER[others.shape[1]]
    for facet, own in enumerate(flat.corners):
        near, same = others[first[facet] : first[facet + 1]], _SAME * np.abs(own).max()
        near = near[:0] if len(near) > _MOST else near
        if own.shape[1] == 1:
            tiles = divided_interval(own[1, 0], near.ravel().tolist(), same)
        else:
            tiles = divided_polygon(own[around[0]].tolist(), near[:, around[1]].tolist(), same)
        if len(tiles) == 1:
            whole.append(facet)
        else:
            for part in (part for tile in tiles for part in simple_parts(tile)):
                parts[len(part)].append((facet, part))
    found = [tuple(map(np.array, zip(*some, strict=True))) for some in parts.values()]
    ordered = [(facets, corners[:, _ORDER[corners.shape[1]]]) for facets, corners in found]
    return np.array(whole, dtype=np.int64), ordered


def _on(parts: _Parts, degree: int) -> tuple[Indices, Array, Array]:
    """Facets, places and weights of the points of a rule on some parts."""
    facets, corners = parts
    kind = _KINDS[corners.shape[1]]
    points, weights = basix.make_quadrature(kind, degree)
    values, derivatives = FacetShape(basix.create_element(basix.ElementFamily.P, kind, 1)).values(points)
    area = np.abs(determinant(np.einsum("qkb,nbi->nqki", derivatives, corners)))
    places = np.einsum("qb,nbi->nqi", values, corners).reshape(-1, corners.shape[-1])
    return np.repeat(facets, len(points)), places, (weights * area).ravel()
