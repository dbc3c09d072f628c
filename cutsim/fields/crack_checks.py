"""Checks of the facets of a crack: the space is cracked along them, and none is missing."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from dolfinx import fem
from dolfinx.mesh import Mesh, compute_midpoints, exterior_facet_indices
from numpy.typing import NDArray

from cutsim.base.checks import place
from cutsim.base.terms import Bonded, Joining
from cutsim.base.verdict import Verdict
from cutsim.fields.sizes import incidence
from cutsim.fields.space import CRACKED, refuse, sum_over_ranks
from cutsim.fields.state import State


def check_cracked(V: fem.FunctionSpace, facets: NDArray[np.int32], name: str) -> None:
    """Refuse a crack on facets along which the space holds together: it could not open. Collective.

    Args:
        V: The space.
        facets: Local facets of the crack.
        name: Name of the crack.

    Raises:
        ValueError: On all ranks, with the number of these facets and the place of one.
    """
    facets = np.asarray(facets, dtype=np.int32)
    cracked = vars(V).get(CRACKED)
    whole = facets if cracked is None else facets[~cracked[facets]]
    problem = None
    if len(whole):
        problem = (
            f"facets of {name!r}: the space is not cracked along {len(whole)} of {len(facets)} of them (on one rank), "
            f"one of which is at {_place(V.mesh, whole[:1])}; they must be among the facets that were given to "
            "cracked_space"
        )
    refuse(V.mesh.comm, problem)


def check_cracks(state: State, cracks: Sequence[Bonded], pairs: Sequence[Joining] = ()) -> None:
    """Refuse two cracks on one facet, whose laws would add up, and doubt gaps in them. Collective.

    Args:
        state: Displacement and time.
        cracks: What acts between the sides of facets.
        pairs: What joins surfaces, which may be faces of the cracks.

    Raises:
        ValueError: Two cracks share a facet, or faces of a crack press on each other and are surfaces of a pair, too,
            or a pair leaves this to a crack that does not.
    """
    inner = [crack for crack in cracks if crack.plane is None]  # faces in a plane of symmetry also meet others
    pressing = np.concatenate([np.empty(0, dtype=np.int32), *(c.facets for c in inner if c.closing)])
    for pair in pairs:
        if state.mesh.comm.allreduce(len(np.setdiff1d(pair.closed_elsewhere, pressing))):
            raise ValueError(f"closing: pair {pair.name!r} leaves facets to a crack that does not press on them")
    for crack, pair in ((c, p) for c in inner if c.closing for p in pairs):
        own = np.setdiff1d(crack.facets, pair.closed_elsewhere)
        both = max(state.mesh.comm.allreduce(len(np.intersect1d(own, facets))) for facets in pair.facets)
        if both:
            raise ValueError(
                f"crack {crack.name!r} and pair {pair.name!r} share {both} facets, on which both would press: give the "
                "crack closing=False, or leave its faces out of the pair"
            )
    for one, other in combinations(cracks, 2):
        both = state.mesh.comm.allreduce(len(np.intersect1d(one.facets, other.facets)))
        if both:
            raise ValueError(f"cracks {one.name!r} and {other.name!r} share {both} facets: each facet has one law")
    if inner:
        facets = np.unique(np.concatenate([c.facets for c in inner])).astype(np.int32)
        doubt_gaps(state.mesh, facets, " and ".join(c.name for c in inner), state.verdict)


def doubt_gaps(mesh: Mesh, facets: NDArray[np.int32], name: str, verdict: Verdict) -> None:
    """Doubt facets that are missing in the middle of cracks: they go on beyond each of their ridges. Collective.

    Args:
        mesh: The mesh.
        facets: Local facets of all cracks, ghosts included.
        name: What they are called.
        verdict: Where to say so.
    """
    fdim = mesh.topology.dim - 1
    mesh.topology.create_entities(fdim - 1)
    ridges, ridge_map = incidence(mesh, fdim, fdim - 1), mesh.topology.index_map(fdim - 1)
    owned, count = mesh.topology.index_map(fdim).size_local, ridge_map.size_local + ridge_map.num_ghosts

    def per_ridge(some: NDArray[np.integer]) -> NDArray[np.int32]:
        here = ridges[some[some < owned]].ravel()
        return sum_over_ranks(ridge_map, np.bincount(here, minlength=count))

    outer = exterior_facet_indices(mesh.topology)
    outside, front = (per_ridge(outer) > 0)[ridges[:owned]], (per_ridge(facets) == 1)[ridges[:owned]]
    gap = (front | outside).all(axis=1) & (front.sum(axis=1) >= 2)
    for known in (facets, outer):
        gap[known[known < owned]] = False
    found = np.flatnonzero(gap).astype(np.int32)
    places = [p for p in mesh.comm.allgather([_place(mesh, found[i : i + 1]) for i in range(len(found))]) for p in p]
    if places:
        verdict.doubt(
            f"{name}: gaps",
            f"{name}: {len(places)} facets are missing in the middle of the crack, the first at {places[0]}; "
            "they hold it together: add them to the facets of the crack and of the space",
        )


def _place(mesh: Mesh, facet: NDArray[np.int32]) -> str:
    return place(compute_midpoints(mesh, mesh.topology.dim - 1, facet)[0])
