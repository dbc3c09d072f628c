"""Meshes of squares, cubes and shells, and the cracks in them."""

import numpy as np
from dolfinx import cpp, mesh
from mpi4py import MPI

from cutsim.base.compat import cell_partitioner

TRIANGLE, QUADRILATERAL = mesh.CellType.triangle, mesh.CellType.quadrilateral
TETRAHEDRON, HEXAHEDRON = mesh.CellType.tetrahedron, mesh.CellType.hexahedron
CELLS = [TRIANGLE, QUADRILATERAL, TETRAHEDRON, HEXAHEDRON]
INTERVALS = 4


def scatter_cells(comm, parts, dual, ghosting):
    """Deal the cells to the ranks at random: the hardest case for who owns which copy of a dof."""
    sizes = comm.allgather(dual.num_nodes)
    owner = np.random.default_rng(3).integers(parts, size=sum(sizes))
    here = owner[sum(sizes[: comm.rank]) :]
    rows = [[here[i], *sorted(set(owner[dual.links(i)]) - {here[i]})] for i in range(dual.num_nodes)]
    data = np.array([rank for row in rows for rank in row], dtype=np.int32)
    return cpp.graph.AdjacencyList_int32(data, np.cumsum([0, *map(len, rows)]).astype(np.int32))


PARTITIONERS = {
    "compact": cell_partitioner(),
    "scattered": cell_partitioner(scatter_cells),
}


def box(cell, partition="compact", comm=MPI.COMM_WORLD, n=INTERVALS):
    partitioner = PARTITIONERS[partition]
    if cell in (TRIANGLE, QUADRILATERAL):
        return mesh.create_unit_square(comm, n, n, cell, partitioner=partitioner)
    return mesh.create_unit_cube(comm, n, n, n, cell, partitioner=partitioner)


def upright(start, end):
    """Part of the plane x = 1/2, from y = start to y = end."""
    return lambda x: np.isclose(x[0], 0.5) & (x[1] > start - 1e-9) & (x[1] < end + 1e-9)


def level(start, end):
    """Part of the plane y = 1/2, from x = start to x = end."""
    return lambda x: np.isclose(x[1], 0.5) & (x[0] > start - 1e-9) & (x[0] < end + 1e-9)


# Each crack: its parts; the number of Lagrange points of the cracked unit square with m intervals between
# them on a side, k = m/2, in 3-D times m + 1; the number of bodies left.
CRACKS = {
    "split": ([upright(0, 1)], lambda m, k: 2 * (k + 1) * (m + 1), 2),
    "edge": ([upright(0, 0.5)], lambda m, k: (m + 1) ** 2 + k, 1),
    "inside": ([upright(0.25, 0.75)], lambda m, k: (m + 1) ** 2 + k - 1, 1),
    "corner": ([upright(0.5, 1), level(0.5, 1)], lambda m, k: (m + 1) ** 2 - k**2 + (k + 1) ** 2, 2),
    "tee": ([upright(0, 1), level(0.5, 1)], lambda m, k: (k + 1) * (m + 1) + 2 * (k + 1) ** 2, 3),
    "cross": ([upright(0, 1), level(0, 1)], lambda m, k: 4 * (k + 1) ** 2, 4),
}


def facets_of(domain, markers):
    return [mesh.locate_entities(domain, domain.topology.dim - 1, marker) for marker in markers]


HALF_TURN = np.pi / 2


def rectangle(corners, n, cell=QUADRILATERAL, comm=MPI.COMM_WORLD):
    partitioner = cell_partitioner()
    return mesh.create_rectangle(comm, corners, n, cell, partitioner=partitioner)


def quarter_ring(inner, outer, n, cell=QUADRILATERAL):
    """Quarter of a ring, the meridian plane of half a spherical shell; positions in (r, z)."""
    domain = rectangle([(inner, 0), (outer, HALF_TURN)], n, cell)
    radius, angle = domain.geometry.x[:, 0].copy(), domain.geometry.x[:, 1].copy()
    domain.geometry.x[:, 0], domain.geometry.x[:, 1] = radius * np.sin(angle), radius * np.cos(angle)
    domain.geometry.x[np.isclose(angle, 0), 0] = 0.0
    return domain
