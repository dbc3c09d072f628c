"""Small meshes as text of Abaqus and FEBio, with the node orders of their manuals; their measures without a form."""

import basix
import numpy as np
from dolfinx.mesh import entities_to_geometry

from cutsim.base.compat import geometry_nodes

CUBE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
SQUARE = CUBE[:4]
# six tetrahedra of a cube around its diagonal, two triangles of a square
TETRAHEDRA = [(0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)]
TRIANGLES = [(0, 1, 2), (0, 2, 3)]

_HEX_EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
_FEBIO_FACES = [(0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7), (0, 1, 2, 3), (4, 5, 6, 7), tuple(range(8))]
_VTK_FACES = [(0, 3, 7, 4), (1, 2, 6, 5), (0, 1, 5, 4), (3, 2, 6, 7), (0, 1, 2, 3), (4, 5, 6, 7), tuple(range(8))]
_TET_EDGES = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
_QUAD_EDGES = [(0, 1), (1, 2), (2, 3), (3, 0)]
#: Cells of a cube or square, and the corners in whose middle their further nodes are, by names of FEBio and VTK.
SHAPES = {
    "hex8": ([range(8)], []), "hex20": ([range(8)], _HEX_EDGES), "hex27": ([range(8)], _HEX_EDGES + _FEBIO_FACES),
    "vtk27": ([range(8)], _HEX_EDGES + _VTK_FACES),
    "tet4": (TETRAHEDRA, []), "tet10": (TETRAHEDRA, _TET_EDGES),
    "quad4": ([range(4)], []), "quad8": ([range(4)], _QUAD_EDGES),
    "quad9": ([range(4)], [*_QUAD_EDGES, tuple(range(4))]),
    "tri3": (TRIANGLES, []), "tri6": (TRIANGLES, [(0, 1), (1, 2), (2, 0)]),
}  # fmt: skip


def boxes(shape, *, joined=True, bend=0.0):
    """Two unit cubes or squares side by side, [0, 2] × [0, 1] (× [0, 1]), with the cells of each.

    Args:
        shape: Type of the cells.
        joined: Whether the boxes have the nodes between them in common.
        bend: Size of the quadratic map by which the boxes are bent, (x + c x² + c y², y + c z², z + c x y).

    Returns:
        Positions of the nodes, shape (nodes, 3), and their numbers in the cells of both boxes.
    """
    cells, mids = SHAPES[shape]
    corners = np.array(SQUARE if shape.startswith(("quad", "tri")) else CUBE, dtype=float)
    numbers, both = {}, []
    for box in (0, 1):
        own = []
        for cell in cells:
            at = corners[list(cell)] + (box, 0, 0)
            at = np.concatenate([at, *(at[list(ends)].mean(axis=0)[None] for ends in mids)])
            keys = [(*x, box * (not joined)) for x in at.tolist()]
            own.append([numbers.setdefault(key, len(numbers)) for key in keys])
        both.append(np.array(own))
    x, y, z = np.array([key[:3] for key in numbers]).T
    flat = len(corners) == 4
    bent = [x + bend * (x**2 + y**2), y + bend * z**2, z + (0 if flat else bend * x * y)]
    return np.stack(bent, axis=1), both


def bent_volume(dim, bend):
    """Area or volume of the boxes after the map, by hand."""
    if dim == 2:  # without z: the integral of 1 + 2 c x
        return 2 + 4 * bend
    return 2 + 4 * bend - 2 * bend**2 - 4 * bend**3


def volume(mesh, cells):
    """Volume of some local cells on all ranks."""
    tdim = mesh.topology.dim
    owned = cells[cells < mesh.topology.index_map(tdim).size_local]
    element = mesh.ufl_domain().ufl_coordinate_element().basix_element
    points, weights = basix.make_quadrature(element.cell_type, 8)
    slopes = element.tabulate(1, points)[1:, :, :, 0]
    jacobians = np.einsum("kqa,cai->cqik", slopes, mesh.geometry.x[geometry_nodes(mesh)[owned]][..., :tdim])
    return mesh.comm.allreduce(float((np.abs(np.linalg.det(jacobians)) @ weights).sum()))


def area(mesh, facets):
    """Area or length of some local facets with straight edges on all ranks."""
    fdim = mesh.topology.dim - 1
    owned = facets[facets < mesh.topology.index_map(fdim).size_local]
    total = 0.0
    if len(owned):
        x = mesh.geometry.x[entities_to_geometry(mesh, fdim, owned)]
        if fdim == 1:
            total = np.linalg.norm(x[:, 1] - x[:, 0], axis=1).sum()
        elif mesh.topology.cell_name() == "tetrahedron":
            total = 0.5 * np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1).sum()
        else:  # corners in the order of a tensor product
            total = 0.5 * np.linalg.norm(np.cross(x[:, 3] - x[:, 0], x[:, 2] - x[:, 1]), axis=1).sum()
    return mesh.comm.allreduce(float(total))


def rows(numbers):
    """Numbers as an input file of Abaqus has them, at most eight in a line."""
    numbers = list(map(str, numbers))
    return ",\n".join(", ".join(numbers[i : i + 8]) for i in range(0, len(numbers), 8))


def abaqus(kind, points, boxes, more=""):
    """Text of an input file with the elements of each box in a set, A and B."""
    text = "** two boxes\n*Heading\n boxes\n*NODE, NSET=all\n"
    text += "".join(f"{i}, {x:.17g}, {y:.17g}, {z:.17g}\n" for i, (x, y, z) in enumerate(points, start=1))
    number = 0
    for name, cells in zip("AB", boxes, strict=True):
        text += f"*Element, type={kind}, ELSET={name}\n"
        for cell in cells:
            number += 1
            text += rows([number, *(cell + 1)]) + "\n"
    return text + more


def febio(kind, points, boxes, more=""):
    """Text of a model of FEBio with two parts, A and B."""
    text = '<febio_spec version="4.0">\n<Mesh>\n<Nodes name="all">\n'
    text += "".join(
        f'<node id="{i}">{x:.17g},{y:.17g},{z:.17g}</node>\n' for i, (x, y, z) in enumerate(points, start=1)
    )
    number, parts = 0, ""
    for name, cells in zip("AB", boxes, strict=True):
        parts += f'<Elements type="{kind}" name="{name}">\n'
        for cell in cells:
            number += 1
            parts += f'<elem id="{number}">{",".join(map(str, cell + 1))}</elem>\n'
        parts += "</Elements>\n"
    return f"{text}</Nodes>\n{parts}{more}</Mesh>\n</febio_spec>\n"


def where(points, axis, value):
    """Numbers, from 1 on, of the nodes in a plane."""
    return np.flatnonzero(np.isclose(points[:, axis], value)) + 1
