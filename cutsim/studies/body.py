"""Cracked body, ready to be cut: solids, bond and notch."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cutsim.base.checks import count, nonnegative, require, require_number
from cutsim.base.signatures import checked
from cutsim.bodies.solid import Solid
from cutsim.fields.meshing import TaggedMesh
from cutsim.fields.space import cracked_space
from cutsim.fields.state import State
from cutsim.interface.cohesive import CohesiveLaw
from cutsim.interface.crack import Crack
from cutsim.materials.elastic import Material
from cutsim.results.recording import Columns

Facets = NDArray[np.int32]


@dataclass(frozen=True)
class CrackedBody:
    """Cracked body: solids on one mesh and the crack through them.

    `cracked_block` and `cutsim.studies.layered.LayeredBlock` make one; put together by hand it may be of any material,
    degree and formulation.

    Attributes:
        domain: The tagged mesh.
        state: Displacement and time.
        solids: The body, in one part or several.
        cracks: The bonded crack, in a part for each cohesive law, the one nearest to the surface first. All of them
            have '+' on the same side.
        notch: Faces that touch and do not stick, from the surface to the first crack; None without a notch.
    """

    domain: TaggedMesh
    state: State
    solids: tuple[Solid, ...]
    cracks: tuple[Crack, ...]
    notch: Crack | None

    @property
    def terms(self) -> list[Solid | Crack]:
        """Solids and cracks, for the mechanical problem."""
        return [*self.solids, *self.cracks, *([] if self.notch is None else [self.notch])]

    @property
    def mouth(self) -> Facets:
        """Local facets of the notch, or of the first crack of a body without one."""
        return (self.cracks[0] if self.notch is None else self.notch).points.facets

    @property
    def slit(self) -> Facets:
        """Local facets of the whole crack plane, notch and bonds."""
        return np.unique(np.concatenate([self.mouth, *(crack.points.facets for crack in self.cracks)])).astype(np.int32)

    def columns(self, columns: Columns) -> Columns:
        """What a body has to say for the history, none by itself. Collective."""
        return {}


@checked
def cracked_block(
    domain: TaggedMesh,
    material: Material,
    law: CohesiveLaw,
    *,
    viscosity: float = 0.0,
    axisymmetric: bool = False,
    degree: int = 1,
    groups: Sequence[str] = ("crack", "notch", "right"),
    solid: Mapping[str, Any] | None = None,
) -> CrackedBody:
    """Put one solid and one crack on a mesh. Collective.

    Args:
        domain: The tagged mesh, such as those of meshes/block.geo, meshes/needle.geo and meshes/thread.geo.
        material: Strain energy.
        law: Cohesive law of the crack.
        viscosity: Kelvin–Voigt viscosity of the block [stress·time].
        axisymmetric: Whether the mesh is the meridian plane of a body of revolution. The crack is then the surface of
            a thread on the axis.
        degree: Degree of the displacement.
        groups: Names of the facets of the crack, of those of the notch, and of the cells on the '+' side of both. A
            mesh without the second has no notch.
        solid: Further arguments of `Solid`, such as ``{"volumetric": "taylor-hood", "density": 1.1e-9}``.

    Raises:
        ValueError: A parameter is outside its range, or the mesh lacks a group.
    """
    require_number("viscosity", viscosity, nonnegative)
    require_number("degree", degree, count(1))
    require("groups", groups, len(groups) == 3, "the names of crack, notch and '+' side")
    crack, notch, side = groups
    bonded, plus = domain.facets(crack), domain.cells(side)
    broken = domain.facets(notch) if notch in domain.names else None
    state = cracked_state(domain, [bonded] if broken is None else [bonded, broken], degree, axisymmetric)
    young = material.young
    return CrackedBody(
        domain,
        state,
        (Solid(state, material, name="block", viscosity=viscosity, **(solid or {})),),
        (Crack(state, bonded, plus, law, young=young),),
        None if broken is None else Crack(state, broken, plus, None, young=young, name="notch"),
    )


def cracked_state(domain: TaggedMesh, facets: Sequence[Facets], degree: int, axisymmetric: bool) -> State:
    """Displacement that may jump across some facets. Collective."""
    mesh = domain.mesh
    space = cracked_space(mesh, ("Lagrange", degree, (mesh.geometry.dim,)), facets)
    return State(space, axisymmetric=axisymmetric)
