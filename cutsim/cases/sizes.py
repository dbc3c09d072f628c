"""Sizes of a simulation: of its mesh and of its elements."""

import numpy as np
from dolfinx.mesh import Mesh

from cutsim.cases.building import Simulation
from cutsim.fields.sizes import global_range

_PLURALS = {"tetrahedron": "tetrahedra", "hexahedron": "hexahedra"}


def mesh_sizes(simulation: Simulation) -> dict[str, str | int | float]:
    """Sizes of the mesh and of the elements along each crack, by what they are in words. Collective."""
    mesh, units = simulation.problem.state.mesh, simulation.units
    smallest, largest = element_sizes(mesh)
    sizes: dict[str, str | int | float] = {
        "cells": int(mesh.topology.index_map(mesh.topology.dim).size_global),
        "kind of cells": kind_of_cells(simulation),
        units.label("smallest element", "length"): smallest,
        units.label("largest element", "length"): largest,
    }
    cracks = simulation.parts.cracks.items()
    return sizes | {units.label(f"elements along {name}", "length"): crack.size for name, crack in cracks}


def kind_of_cells(simulation: Simulation) -> str:
    """Shape and degree of the elements in words."""
    space, name = simulation.problem.state.V, simulation.problem.state.mesh.topology.cell_name()
    return f"{_PLURALS.get(name, f'{name}s')} of degree {space.ufl_element().embedded_superdegree}"


def element_sizes(mesh: Mesh) -> tuple[float, float]:
    """Smallest and largest diameter of a cell [length]. Collective."""
    dim = mesh.topology.dim
    cells = np.arange(mesh.topology.index_map(dim).size_local, dtype=np.int32)
    return global_range(mesh.comm, mesh.h(dim, cells))
