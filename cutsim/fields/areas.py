"""Lengths and areas of facets, whatever their shape, without compiling a form."""

import basix
import numpy as np
from dolfinx.mesh import Mesh, entities_to_geometry
from numpy.typing import NDArray

# degree to which the area of a curved facet is integrated
_DEGREE = 6


def area(mesh: Mesh, facets: NDArray[np.int32], *, axisymmetric: bool = False) -> float:
    """Length or area of facets in the reference configuration [length or area]. Collective.

    Args:
        mesh: The mesh.
        facets: Local facets, exterior or interior; ghosts are left out, since their owners have them as well.
        axisymmetric: Whether the mesh is a meridian plane: the area is then that of the surface of revolution.
    """
    fdim = mesh.topology.dim - 1
    owned = np.unique(facets)
    owned = owned[owned < mesh.topology.index_map(fdim).size_local].astype(np.int32)
    total = 0.0
    if len(owned):  # entities_to_geometry of dolfinx 0.9 divides by their number
        mesh.topology.create_connectivity(fdim, mesh.topology.dim)
        x = mesh.geometry.x[entities_to_geometry(mesh, fdim, owned)]
        total = _integral(mesh, x, axisymmetric=axisymmetric)
    return float(mesh.comm.allreduce(total))


def _integral(mesh: Mesh, x: NDArray[np.float64], *, axisymmetric: bool) -> float:
    """Sum of the areas of facets with given nodes, shape (facets, nodes, 3)."""
    corners = len(basix.topology(mesh.basix_cell())[mesh.topology.dim - 1][0])
    shape = {2: basix.CellType.interval, 3: basix.CellType.triangle, 4: basix.CellType.quadrilateral}[corners]
    degree = mesh.ufl_domain().ufl_coordinate_element().degree
    element = basix.create_element(basix.ElementFamily.P, shape, degree, basix.LagrangeVariant.equispaced)
    points, weights = basix.make_quadrature(shape, _DEGREE)
    values, *slopes = element.tabulate(1, points)[..., 0]
    tangents = [np.einsum("qn,fni->fqi", slope, x) for slope in slopes]
    stretch = np.linalg.norm(tangents[0] if len(tangents) == 1 else np.cross(*tangents), axis=-1)
    if axisymmetric:
        stretch *= 2 * np.pi * np.einsum("qn,fn->fq", values, x[..., 0])
    return float((stretch @ weights).sum())
