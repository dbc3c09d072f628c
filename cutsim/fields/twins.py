"""Coincident nodes that are not merged: bodies that only seem to be joined, and meshes that are split."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from dolfinx.mesh import Mesh, entities_to_geometry, exterior_facet_indices
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from cutsim.base.assembly import box
from cutsim.base.checks import place
from cutsim.fields.pieces import mesh_pieces

#: How nodes that lie on each other become one.
MERGE = (
    "merge them in gmsh before meshing (Coherence;, BooleanFragments, occ.fragment) or after it "
    "(gmsh.model.mesh.removeDuplicateNodes()), or when the file is read (read_mesh with merge=True)"
)
# distance below which two nodes lie on each other, as a fraction of the size of the mesh
_SAME = 1e-7


@dataclass(frozen=True)
class Twins:
    """Pairs of coincident nodes of the outer boundary, the same on all ranks.

    Attributes:
        nodes: Global numbers of the nodes of each pair, shape (pairs, 2).
        places: Where they are, shape (pairs, 3) [length].
        pieces: Connected piece of the mesh of the nodes of each pair, shape (pairs, 2).
    """

    nodes: NDArray[np.int64]
    places: NDArray[np.float64]
    pieces: NDArray[np.int32]


def find_twins(mesh: Mesh) -> Twins:
    """Find nodes of the outer boundary that lie on each other. Collective."""
    tdim, comm = mesh.topology.dim, mesh.comm
    mesh.topology.create_connectivity(tdim - 1, tdim)
    local = np.unique(facet_nodes(mesh, exterior_facet_indices(mesh.topology)))
    pieces = mesh_pieces(mesh)[1]
    own = global_nodes(mesh, local), mesh.geometry.x[local], pieces[local]
    numbers, places, pieces = (np.concatenate(part) for part in zip(*comm.allgather(own), strict=True))
    numbers, first = np.unique(numbers, return_index=True)
    low, high = box(comm, mesh.geometry.x)
    pairs = cKDTree(places[first]).query_pairs(_SAME * float((high - low).max()), output_type="ndarray")
    return Twins(numbers[pairs], places[first][pairs[:, 0]], pieces[first][pairs])


def facet_nodes(mesh: Mesh, facets: NDArray[np.int32]) -> NDArray[np.int32]:
    """Local geometry nodes in the corners of some local facets, flattened."""
    if not len(facets):  # entities_to_geometry of dolfinx 0.9 divides by their number
        return np.empty(0, dtype=np.int32)
    return np.asarray(entities_to_geometry(mesh, mesh.topology.dim - 1, facets).ravel())


def global_nodes(mesh: Mesh, nodes: NDArray[np.int32]) -> NDArray[np.int64]:
    """Global numbers of local geometry nodes."""
    return np.asarray(mesh.geometry.index_map().local_to_global(nodes.astype(np.int32)), dtype=np.int64)


def split_along(mesh: Mesh, facets: NDArray[np.int32]) -> bool:
    """Whether all nodes of some local facets of the outer boundary are there twice. Collective."""
    twins = find_twins(mesh).nodes
    alone = ~np.isin(global_nodes(mesh, facet_nodes(mesh, facets)), twins)
    return len(twins) > 0 and mesh.comm.allreduce(int(alone.sum())) == 0


def unjoined(mesh: Mesh, pairs: Sequence[Sequence[NDArray[np.int32]]]) -> str | None:
    """Pieces of a mesh that lie on each other, have no node in common and are not joined, in words. Collective.

    Args:
        mesh: The mesh.
        pairs: Local facets of the two surfaces of each pair that joins the pieces to which they belong.
    """
    of_nodes, twins = mesh_pieces(mesh)[1], find_twins(mesh)
    apart = twins.pieces[:, 0] != twins.pieces[:, 1]
    for pair in pairs:
        joined = [np.concatenate(mesh.comm.allgather(np.unique(of_nodes[facet_nodes(mesh, f)]))) for f in pair]
        for one, other in (joined, joined[::-1]):
            apart &= ~(np.isin(twins.pieces[:, 0], one) & np.isin(twins.pieces[:, 1], other))
    places = twins.places[apart]
    if not len(places):
        return None
    low, high = (place(pick(places, axis=0)) for pick in (np.min, np.max))
    return (
        f"{len(places)} pairs of nodes lie on each other between {low} and {high} and belong to parts that nothing "
        f"joins there: if these are one body, {MERGE}; if they are two, let a SurfacePair join them"
    )
