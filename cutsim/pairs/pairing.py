"""Search of partners and projection along rays (docs/theory.md §3.5), without a mesh or a state.

A ray from a point x of the slave surface along its unit normal ν meets the master surface at x + g ν.  Positions are
in the current configuration; an array of facets has the shape (facets, nodes, dimension).
"""

from dataclasses import dataclass

import basix
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from cutsim.base.arrays import Array

Indices = NDArray[np.int64]

#: How far outside a facet, in reference coordinates, a ray still meets it: no ray slips through between two facets.
EDGE = 1e-9
#: Gap that is taken for none, as a fraction of the size of a facet.
TOUCH = 1e-12
# Newton iterations for the place on a facet, its accuracy, and how far outside of the facet it is looked for
_ITERATIONS, _ACCURACY, _OUTSIDE = 20, 1e-14, 1.0


@dataclass(frozen=True)
class FacetShape:
    """Reference facet that all facets of a surface share.

    Args:
        element: Lagrange element on the reference facet.
    """

    element: basix.finite_element.FiniteElement

    @property
    def centre(self) -> Array:
        """Reference coordinates of the centre."""
        return np.asarray(basix.geometry(self.element.cell_type).mean(axis=0))

    def values(self, xi: Array) -> tuple[Array, Array]:
        """Shape functions, shape (n, nodes), and their derivatives, shape (n, directions, nodes), at n points."""
        # one more point, because there may be none and basix aborts then
        tables = self.element.tabulate(1, np.vstack([xi, self.centre]))[:, :-1, :, 0]
        return tables[0], np.moveaxis(tables[1:], 0, 1)

    def contains(self, xi: Array) -> NDArray[np.bool_]:
        """Which of n reference points are on the facet, its edges included."""
        inside = (xi >= -EDGE).all(axis=-1)
        if self.element.cell_type == basix.CellType.triangle:
            return np.asarray(inside & (xi.sum(axis=-1) <= 1 + EDGE))
        return np.asarray(inside & (xi <= 1 + EDGE).all(axis=-1))


@dataclass(frozen=True)
class Hits:
    """Hits of the rays of some points on the master surface.

    Attributes:
        points: The points that have a partner, ascending.
        facets: Master facet of each.
        xi: Reference coordinates on it, shape (hits, directions).
        gap: Signed distance g along the ray, negative for penetration [length].
    """

    points: Indices
    facets: Indices
    xi: Array
    gap: Array

    def some(self, rows: NDArray[np.bool_] | Indices) -> "Hits":
        """Some of them."""
        return Hits(self.points[rows], self.facets[rows], self.xi[rows], self.gap[rows])


def near_facets(rays: Array, master: Array, margin: float) -> tuple[Indices, Indices]:
    """Pairs of facets of two surfaces that are near each other.

    Args:
        rays: Points that the rays of each slave facet reach, shape (slave facets, points, dimension).
        master: Nodes of the master facets.
        margin: Distance that both may still move before the answer is out of date [length].

    Returns:
        Slave and master facets of the pairs, in the order of the slave facets.
    """
    boxes = [(corners.min(axis=1), corners.max(axis=1)) for corners in (rays, master)]
    centres = [0.5 * (low + high) for low, high in boxes]
    reach = sum(0.5 * np.linalg.norm(high - low, axis=1).max(initial=0.0) for low, high in boxes) + 2 * margin
    if not (len(rays) and len(master)):
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    # two boxes overlap only if their centres are no farther apart than half their diagonals together: the trees leave
    # few candidates, and the boxes decide
    trees = [cKDTree(c) for c in centres]
    found = trees[0].sparse_distance_matrix(trees[1], reach, output_type="ndarray")
    s, m = found["i"].astype(np.int64), found["j"].astype(np.int64)
    (low_s, high_s), (low_m, high_m) = boxes
    overlap = ((low_s[s] <= high_m[m] + margin) & (low_m[m] <= high_s[s] + margin)).all(axis=1)
    # an order that does not depend on how the trees were built
    order = np.lexsort((m[overlap], s[overlap]))
    return s[overlap][order], m[overlap][order]


def project(
    x: Array,
    frames: Array,
    pairs: tuple[Indices, Indices],
    master: Array,
    sides: Array,
    shape: FacetShape,
    search: float,
) -> Hits:
    """Where rays along the normals of points meet the master surface.

    Only the outside of a facet is met, so that a ray through a thin body does not find its back.

    Args:
        x: Points, shape (points, dimension).
        frames: Their frames (ν, a₁, …) as rows, right-handed, shape (points, dimension, dimension).
        pairs: Points and master facets that are tried.
        master: Nodes of the master facets.
        sides: For each master facet ±1: whether its outward normal is that of its reference coordinates.
        shape: Reference shape of the master facets.
        search: Largest distance of a partner, on either side [length].

    Returns:
        All hits, in the order of the points.
    """
    points, facets = pairs
    y, near = _in_frames(x, frames, points, facets, master, search)
    points, facets = points[near], facets[near]
    xi = solve(y[..., 1:], shape)
    values, derivatives = shape.values(xi)
    # in the frame of a point its ray is the first axis: along it lies the gap, and the rest is what Newton's method has
    # left over where it did not converge
    gap = np.einsum("nb,nb->n", values, y[..., 0])
    off = np.abs(np.einsum("nb,nbi->ni", values, y[..., 1:])).max(axis=-1, initial=0.0)
    size = np.abs(y - y[:, :1]).max(axis=(1, 2), initial=0.0)
    # a ray within the plane of a facet meets neither its outside nor its inside
    across = determinant(np.einsum("nab,nbi->nia", derivatives, y[..., 1:]))
    outside = sides[facets] * across < -EDGE * size ** derivatives.shape[1]
    # where surfaces touch, rounding is not to tell which of the facets at an edge is nearer
    gap[np.abs(gap) <= TOUCH * size] = 0.0
    hit = shape.contains(xi) & (np.abs(gap) <= search) & (off <= EDGE * size) & outside
    order = np.flatnonzero(hit)[np.argsort(points[hit], kind="stable")]
    return Hits(points[order], facets[order], xi[order], gap[order])


def nearest(hits: Hits, last: NDArray[np.bool_] | None = None) -> Hits:
    """The nearest hit of each point.

    Args:
        hits: All hits.
        last: Which of them are taken only if there is no other.
    """
    # a ray through an edge meets both its facets: the one of the lower number is taken, on every rank
    rank = np.zeros(len(hits.points), dtype=bool) if last is None else last
    order = np.lexsort((hits.facets, np.abs(hits.gap), rank, hits.points))
    first = order[np.unique(hits.points[order], return_index=True)[1]]
    return hits.some(first)


def _in_frames(
    x: Array, frames: Array, points: Indices, facets: Indices, master: Array, search: float
) -> tuple[Array, NDArray[np.bool_]]:
    """Nodes of the facets as seen from the points, and the pairs whose ray passes near the facet at all."""
    centres = master.mean(axis=1)
    radii = np.linalg.norm(master - centres[:, None], axis=2).max(axis=1, initial=0.0)
    place = np.einsum("nij,nj->ni", frames[points], centres[facets] - x[points])
    # a ray that misses the ball around a facet misses the facet: few pairs are left to Newton's method
    radius = (1 + 1e-6) * radii[facets]
    near = (np.abs(place[:, 0]) <= search + radius) & (np.linalg.norm(place[:, 1:], axis=1) <= radius)
    points, facets = points[near], facets[near]
    return np.einsum("nij,nbj->nbi", frames[points], master[facets] - x[points, None]), near


def solve(y: Array, shape: FacetShape) -> Array:
    """Reference coordinates at which facets pass through the origin of the plane, by Newton's method."""
    centre = shape.centre
    xi = np.tile(centre, (len(y), 1))
    for _ in range(_ITERATIONS):
        values, derivatives = shape.values(xi)
        with np.errstate(divide="ignore", invalid="ignore"):
            step = inverse(np.einsum("nab,nbi->nia", derivatives, y)) @ np.einsum("nb,nbi->ni", values, y)[..., None]
        # the map of a warped facet may be singular farther out, where a step would lead far away
        new = np.clip(xi - step[..., 0], -_OUTSIDE, 1 + _OUTSIDE)
        change = np.abs(new - xi).max(initial=0.0)
        xi = new
        if change <= _ACCURACY:
            break
    return xi


def inverse(A: Array) -> Array:
    """Inverses of 1 × 1 or 2 × 2 matrices, shape (n, d, d)."""
    if A.shape[-1] == 1:
        return np.asarray(1 / A)
    adjugate = np.stack([A[..., 1, 1], -A[..., 0, 1], -A[..., 1, 0], A[..., 0, 0]], axis=-1).reshape(A.shape)
    return np.asarray(adjugate / determinant(A)[:, None, None])


def determinant(A: Array) -> Array:
    """Determinants of 1 × 1 or 2 × 2 matrices, shape (n, d, d)."""
    if A.shape[-1] == 1:
        return np.asarray(A[..., 0, 0])
    return np.asarray(A[..., 0, 0] * A[..., 1, 1] - A[..., 0, 1] * A[..., 1, 0])
