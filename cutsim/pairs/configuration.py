"""Slave points, their partners, and derivatives of opening and slide (docs/theory.md §3.5).

The jump at a slave point has components in a frame (ν, a₁, a₂) that turns with the slave surface: ν is its outward
normal, a₁ follows the first reference direction of the facet.  Everything depends on the nodes through four vectors
only, the *primitives*: the point, the tangents of its facet, and the place on the master facet.  The frames of a bond
follow the surface half way between both: there the tangents are those of this surface.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from cutsim.pairs.outer_surface import normals
from cutsim.pairs.pairing import Array, Hits, Indices, inverse


@dataclass(frozen=True)
class Points:
    """Slave points in a configuration, flattened over the facets.

    Attributes:
        x: Positions, shape (points, dimension) [length].
        tangents: Tangents of the facet, shape (points, directions, dimension).
        normals: Outward normals, not of unit length.
        frames: Frames (ν, a₁, …) as rows.
    """

    x: Array
    tangents: Array
    normals: Array
    frames: Array

    @classmethod
    def framed(cls, x: Array, tangents: Array, sides: Array) -> Self:
        """Points with frames along given tangents; the sides, one a point, tell which normal points outwards."""
        dim = x.shape[-1]
        outward = sides[:, None] * normals(tangents)
        nu = _unit(outward)
        first = np.stack([-nu[:, 1], nu[:, 0]], axis=-1) if dim == 2 else _unit(tangents[:, 0])
        rest = [] if dim == 2 else [np.cross(nu, first)]
        return cls(x, tangents, outward, np.stack([nu, first, *rest], axis=1))

    def turning(self, rows: Indices) -> Array:
        """Derivative of the frames of some points with respect to the tangents.

        Returns:
            FacetShape (rows, axes, dimension, directions, dimension).
        """
        dim = self.x.shape[-1]
        t, outward, frames = self.tangents[rows], self.normals[rows], self.frames[rows]
        size = np.linalg.norm(outward, axis=-1)[:, None, None, None]
        side = np.sign(np.einsum("ni,ni->n", normals(t), outward))
        # n = ν |n|, hence dν = (I − ν νᵀ) dn/|n|
        of_normal = side[:, None, None, None] * _normal_derivative(t) / size
        nu, first = frames[:, 0], frames[:, 1]
        d_nu = of_normal - np.einsum("ni,nj,njkl->nikl", nu, nu, of_normal)
        if dim == 2:
            return np.stack([d_nu, np.stack([-d_nu[:, 1], d_nu[:, 0]], axis=1)], axis=1)
        d_first = np.zeros_like(d_nu)
        d_first[:, :, 0] = np.eye(3) - np.einsum("ni,nj->nij", first, first)
        d_first /= np.linalg.norm(t[:, 0], axis=-1)[:, None, None, None]
        d_second = np.einsum("nij,njkl->nikl", _skew(nu), d_first) - np.einsum("nij,njkl->nikl", _skew(first), d_nu)
        return np.stack([d_nu, d_first, d_second], axis=1)


@dataclass(frozen=True)
class OnRay:
    """What makes partners on the rays of the points move over the master.

    Attributes:
        derivatives: Derivatives of the shape functions at the partners, shape (hits, directions, nodes).
        tangents: Current tangents of the master facets there, shape (hits, directions, dimension).
        slide_rate: Derivative of the jump by the reference coordinates at fixed frame, shape (hits, dimension,
            directions).
    """

    derivatives: Array
    tangents: Array
    slide_rate: Array


@dataclass(frozen=True)
class Pairs:
    """Slave points and their partners in a configuration.

    Attributes:
        slave: The slave points, with the frames of the jump.
        hits: Their partners.
        values: Shape functions of the master facets at the partners, shape (hits, nodes).
        jump: Opening and slide of every point, shape (points, dimension) [length].
        distance: From each point to its partner, x_m − x_s, shape (hits, dimension) [length].
        on_ray: How partners on rays move; None for material points of the master.
        midway: Nodal factors of the master in the tangents of frames between both surfaces, shape (hits, directions,
            nodes), those of the slave being halved; None if the frames are those of the slave.
    """

    slave: Points
    hits: Hits
    values: Array
    jump: Array
    distance: Array
    on_ray: OnRay | None = None
    midway: Array | None = None

    def linearise(self, rows: Indices) -> tuple[Array, Array, Array | None]:
        """Derivatives of some pairs with respect to the primitives.

        Args:
            rows: Pairs, by their place in `hits`.

        Returns:
            Derivatives of the jump, of the frame and, on rays, of the reference coordinates; the last two indices are
            primitive and component.
        """
        points = self.hits.points[rows]
        n, dim = len(points), self.slave.x.shape[-1]
        frames = self.slave.frames[points]
        d_frame = np.zeros((n, dim, dim, dim + 1, dim))
        d_frame[:, :, :, 1:dim] = self.slave.turning(points)
        apart = np.zeros((n, dim, dim + 1, dim))
        apart[:, :, dim], apart[:, :, 0] = np.eye(dim), -np.eye(dim)
        if self.on_ray is None:
            d_jump = np.einsum("nai,nipj->napj", frames, apart)
            d_jump += np.einsum("ni,naipj->napj", self.distance[rows], d_frame)
            return d_jump, d_frame, None
        # the partner stays on the ray: across it d(x_m + t_k ξ_k − x_s − g ν) vanishes and gives dξ; along it this is
        # the change of the gap
        tangents = self.on_ray.tangents[rows]
        missing = self.hits.gap[rows, None, None, None] * d_frame[:, 0] - apart
        lateral = inverse(np.einsum("nai,nki->nak", frames[:, 1:], tangents))
        d_xi = np.einsum("nka,nai,nipj->nkpj", lateral, frames[:, 1:], missing)
        d_jump = np.einsum("nak,nkpj->napj", self.on_ray.slide_rate[rows], d_xi)
        d_jump[:, 0] = np.einsum("ni,nipj->npj", frames[:, 0], np.einsum("nki,nkpj->nipj", tangents, d_xi) + apart)
        return d_jump, d_frame, d_xi

    def increment(self, slave: Array, master: Array) -> Array:
        """Increment of the distance of all points and the material points they meet now.

        Args:
            slave: Increments of the points, shape (points, dimension) [length].
            master: Increments of the nodes of the master facets [length].

        Returns:
            FacetShape (points, dimension), zero without partner.
        """
        change = np.zeros_like(slave)
        points, facets = self.hits.points, self.hits.facets
        change[points] = np.einsum("nb,nbi->ni", self.values, master[facets]) - slave[points]
        return change


def _unit(v: Array) -> Array:
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))


def _skew(v: Array) -> Array:
    """Matrices of the cross products v × ·."""
    zero = np.zeros(len(v))
    rows = [zero, -v[:, 2], v[:, 1], v[:, 2], zero, -v[:, 0], -v[:, 1], v[:, 0], zero]
    return np.stack(rows, axis=-1).reshape(-1, 3, 3)


def _normal_derivative(tangents: Array) -> Array:
    """Derivative of `normals`, shape (points, dimension, directions, dimension)."""
    if tangents.shape[-1] == 2:
        return np.broadcast_to(np.array([[[0.0, 1.0]], [[-1.0, 0.0]]]), (len(tangents), 2, 1, 2))
    return np.stack([-_skew(tangents[:, 1]), _skew(tangents[:, 0])], axis=2)
