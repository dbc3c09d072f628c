"""Sizes of a simulation: of its mesh and of its elements."""

import numpy as np
from dolfinx.mesh import Mesh

from cutsim.cases.building import Simulation
from cutsim.fields.sizes import global_range

_PLURALS = {"tetrahedron": "tetrahedra", "hexahedron": "hexahedra"}


def mesh_sizes(simulation: Simulation) -> dict[str, str | int | float]:
    """Sizes of the mesh, its groups of facets and the elements along cracks, by their names in words. Collective."""
    mesh, units = simulation.problem.state.mesh, simulation.units
    smallest, largest = element_sizes(mesh)
    sizes: dict[str, str | int | float] = {
        "cells": int(mesh.topology.index_map(mesh.topology.dim).size_global),
        "kind of cells": kind_of_cells(simulation),
        units.label("smallest element", "length"): smallest,
        units.label("largest element", "length"): largest,
    }
    for dim, name in simulation.domain.groups:
        if dim == mesh.topology.dim - 1:
            kind, size = group_area(simulation, name)
            sizes[units.label(f"{kind} of {name}", kind)] = size
    cracks = simulation.parts.cracks.items()
    return sizes | {units.label(f"elements along {name}", "length"): crack.size for name, crack in cracks}


def group_area(simulation: Simulation, name: str) -> tuple[str, float]:
    """What the measure of a group of facets is, "length" or "area", and how much [length or area]. Collective."""
    state = simulation.problem.state
    return state.facet_measure, simulation.domain.area(name, axisymmetric=state.axisymmetric)


def kind_of_cells(simulation: Simulation) -> str:
    """Shape and degree of the elements in words."""
    space, name = simulation.problem.state.V, simulation.problem.state.mesh.topology.cell_name()
    return f"{_PLURALS.get(name, f'{name}s')} of degree {space.ufl_element().embedded_superdegree}"


def element_sizes(mesh: Mesh) -> tuple[float, float]:
    """Smallest and largest diameter of a cell [length]. Collective."""
    dim = mesh.topology.dim
    cells = np.arange(mesh.topology.index_map(dim).size_local, dtype=np.int32)
    return global_range(mesh.comm, mesh.h(dim, cells))
