"""Bodies of a case."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from mpi4py import MPI

from cutsim.bodies.solid import Solid
from cutsim.cases.domains import Domain, Entities
from cutsim.cases.refusals import refusing
from cutsim.cases.schema_parts import Body, Deformable
from cutsim.fields.state import State
from cutsim.fields.temperature import Temperature

#: Name of the body of a case that names none.
WHOLE = "body"


def named_bodies(domain: Domain) -> dict[str, Body]:
    """Bodies of a case by name, a single one if it names none."""
    return dict(domain.tables.bodies) or {WHOLE: Body()}


def solids(domain: Domain, state: State, temperature: Temperature | None) -> tuple[Solid, ...]:
    """Solids of a case. Collective.

    Raises:
        CaseError: A group is missing, or a body refuses a parameter.
    """
    return tuple(_solid(domain, state, name, body, temperature) for name, body in named_bodies(domain).items())


def _solid(domain: Domain, state: State, name: str, body: Body, temperature: Temperature | None) -> Solid:
    key = ("bodies", name)
    cells = None if body.cells is None else domain.cells((*key, "cells"), body.cells)
    options = solid_options(body)
    if body.thermoelastic is not None:
        options |= {"thermoelastic": body.thermoelastic, "temperature": temperature}
    material = body.material or domain.tables.material
    assert material is not None  # a case without is refused
    with refusing(domain.document, *key):
        return Solid(state, material, cells, name=name, plane=body.plane, **options)


def solid_options(body: Deformable) -> dict[str, Any]:
    """Arguments of `Solid` that bodies and layers have in common, without those of heat."""
    names = ("volumetric", "viscosity", "relaxation", "density")
    return {name: getattr(body, name) for name in names}


def softest(solids: tuple[Solid, ...], facets: Entities) -> float:
    """Young's modulus of the softest body beside some facets, or of all bodies if none is [stress]. Collective."""
    mesh = solids[0].state.mesh
    fdim = mesh.topology.dim - 1
    mesh.topology.create_connectivity(fdim, fdim + 1)
    links = mesh.topology.connectivity(fdim, fdim + 1)
    beside = np.concatenate([np.empty(0, np.int32), *(links.links(facet) for facet in facets)])
    touching = [s.cells is None or bool(np.isin(s.cells, beside).any()) for s in solids]
    near: Mapping[str, float] = {
        s.name: s.material.young for s, here in zip(solids, touching, strict=True) if mesh.comm.allreduce(here, MPI.LOR)
    }
    return min(near.values() or [s.material.young for s in solids])
