"""Cracked body, ready to be cut: solids, bond and notch."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from dolfinx.fem import functionspace
from numpy.typing import NDArray

from cutsim.base.checks import count, nonnegative, require, require_number
from cutsim.base.signatures import checked
from cutsim.base.terms import Term
from cutsim.bodies.solid import Solid
from cutsim.fields.meshing import TaggedMesh
from cutsim.fields.sizes import global_range, normal_size
from cutsim.fields.space import cracked_space, on_boundary
from cutsim.fields.state import State
from cutsim.interface.cohesive import CohesiveLaw
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.crack import Crack
from cutsim.interface.guide import Guide
from cutsim.interface.rubbing import AnyFriction, check_friction
from cutsim.materials.elastic import Material
from cutsim.pairs.contact_surfaces import ContactSurfaces
from cutsim.pairs.surface_pair import SurfacePair
from cutsim.results.recording import Columns

Facets = NDArray[np.int32]

# contact of the faces of a crack under a tip that indents it: penalty over E/h, and blend over h
_FIRM, _BLEND = 50.0, 0.02
_IMAGE = "{} for a crack on the outer boundary, a plane of symmetry: a face does not slide on its image"
_SIDES: tuple[Literal["+", "-"], ...] = ("+", "-")


@checked
@dataclass(frozen=True)
class Faces:
    """How the faces of a crack meet that a tool is going to part.

    A tip that indents an intact surface presses the faces on each other before it parts them, and draws the mouth of
    the crack out along itself, up to a right angle. If both sides are alike, the faces part along the normal of the
    plane, however they turn, and their middle is kept in it by a `Guide`; and their contact is firmer.  Faces that a
    rubbing tool draws along beside each other slide: a pair of surfaces carries their pressure.

    Of a body that is alike on both sides one is enough: a crack on the outer boundary of the mesh lies in a plane of
    symmetry, and its face meets its image. Unknowns and time are halved, and nothing can slip off to one side.

    Args:
        symmetric: Whether body and tool are alike on both sides of a plane crack. The faces then press firmly on each
            other, and the tool more firmly the harder it presses, since it may indent them before.
        sliding: Whether the faces slide over each other by more than a facet, as at the rim of a notch into which a
            tool with much friction is pushed. They then look for each other anew, at a higher cost.
        automatic: Whether all surfaces of the body may meet, and not only the two faces: where a rough tool draws the
            rim of a notch in so far that it folds, or the lips of a puncture turn over, the outer surface comes to lie
            on itself and on the faces. Faces that are alike on both sides or firm press on each other as without it.
        firm: Whether tool and faces penetrate each other as little as under a tip that indents an intact surface, and
            the faces part along the normal that they had: for an edge that goes round a body of revolution, and for a
            cut from a notch that is compared with a puncture. An edge of one element catches on the nodes then, and
            takes several times as many steps.
        friction: Friction of the faces on each other, a law, or the coefficient of Coulomb's; None for none. It acts
            where the bond is broken.

    Raises:
        ValueError: The coefficient is negative, faces that are alike on both sides are to slide, or two things are
            named of which one includes the other.
    """

    symmetric: bool = False
    sliding: bool = False
    automatic: bool = False
    firm: bool = False
    friction: AnyFriction = None

    def __post_init__(self) -> None:
        check_friction("friction", self.friction)
        require(
            "sliding", self.sliding, not (self.sliding and self._pressing), "False where both sides are alike or firm"
        )
        require("automatic", self.automatic, not (self.automatic and self.sliding), "False where faces slide")

    def crack(
        self,
        state: State,
        facets: Facets,
        plus: Facets | tuple[float, ...],
        law: CohesiveLaw | None,
        *,
        young: float,
        name: str = "crack",
    ) -> Crack:
        """A crack with such faces; arguments as for `Crack`. On the outer boundary it meets its image. Collective."""
        mirrored = on_boundary(state.mesh, facets)
        if mirrored:
            require("faces.sliding", self.sliding, not self.sliding, _IMAGE.format("False"))
            require("faces.friction", self.friction, self.automatic or not self.friction, _IMAGE.format("None"))
        options: dict[str, Any] = {"young": young, "name": name, "closing": mirrored or not self._paired}
        if not (mirrored or self._paired):
            options["friction"] = self.friction
        if self.symmetric:
            require("faces.symmetric", True, not state.axisymmetric, "False in a body of revolution")
        if self._pressing:
            smallest = global_range(state.mesh.comm, normal_size(state.mesh, facets))[0]
            firm = PenaltyContact.automatic(young, smallest, _FIRM, blend=_BLEND * smallest)
            options |= {"normal": "reference", "contact": firm}
        return Crack(state, facets, None if mirrored else plus, law, **options)

    def guides(self, cracks: Sequence[Crack]) -> tuple[Guide, ...]:
        """What keeps the middle of some cracks in their plane, where both sides are meshed."""
        return tuple(Guide(crack) for crack in cracks if crack.plane is None) if self.symmetric else ()

    @property
    def _pressing(self) -> bool:
        return self.symmetric or self.firm

    @property
    def _paired(self) -> bool:
        return self.sliding or (self.automatic and not self._pressing)

    def pairs(self, cracks: Sequence[Crack], solids: Sequence[Solid]) -> tuple[SurfacePair, ...]:
        """What lets the faces of cracks that follow each other slide, those of one side as one surface. Collective.

        Args:
            cracks: The cracks.
            solids: The bodies, of which all surfaces may meet if the faces are `automatic`.
        """
        if self.automatic:
            alone = [crack for crack in cracks if crack.closing]
            closing = [(crack.face("+"), crack.face("-")) for crack in alone if crack.plane is None]
            options: dict[str, Any] = {"friction": self.friction, "name": "faces"}
            if alone:  # what folds is as small as the elements along the cut, and most of the surface is coarser
                young, size = min(crack.young for crack in cracks), min(crack.normal_size for crack in cracks)
                options["contact"] = PenaltyContact.automatic(young, size)
            return (ContactSurfaces.automatic(solids, closing=closing).pair(**options),)
        if not self.sliding:
            return ()
        plus, minus = ([crack.face(side) for crack in cracks] for side in _SIDES)
        young = min(crack.young for crack in cracks)
        return (SurfacePair(cracks[0].state, plus, minus, young=young, friction=self.friction, name="faces"),)


#: Faces of which nothing is known beforehand.
PLAIN = Faces()


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
        guides: What keeps the middle of the cracks in their plane, see `Faces`.
        pairs: What carries the pressure of faces that slide over each other, see `Faces`.
        faces: How the faces of cracks and notch meet.
    """

    domain: TaggedMesh
    state: State
    solids: tuple[Solid, ...]
    cracks: tuple[Crack, ...]
    notch: Crack | None
    guides: tuple[Guide, ...] = field(default=(), kw_only=True)
    pairs: tuple[SurfacePair, ...] = field(default=(), kw_only=True)
    faces: Faces = field(default=PLAIN, kw_only=True)

    @property
    def terms(self) -> list[Term]:
        """Solids, cracks, guides and pairs, for the mechanical problem."""
        notch = [] if self.notch is None else [self.notch]
        return [*self.solids, *self.cracks, *notch, *self.guides, *self.pairs]

    @property
    def mouth(self) -> Facets:
        """Local facets of the notch, or of the first crack of a body without one."""
        return (self.cracks[0] if self.notch is None else self.notch).points.facets

    @property
    def slit(self) -> Facets:
        """Local facets of the whole crack plane, notch and bonds."""
        return np.unique(np.concatenate([self.mouth, *(crack.points.facets for crack in self.cracks)])).astype(np.int32)

    @property
    def mirrored(self) -> bool:
        """Whether only one side of the crack is meshed, and the other one is its image."""
        return self.cracks[0].plane is not None

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
    faces: Faces = PLAIN,
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
        faces: How the faces of crack and notch meet.

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
    block = Solid(state, material, name="block", viscosity=viscosity, **(solid or {}))
    cut = (faces.crack(state, bonded, plus, law, young=young),)
    open_ = [] if broken is None else [faces.crack(state, broken, plus, None, young=young, name="notch")]
    return CrackedBody(
        domain,
        state,
        (block,),
        cut,
        open_[0] if open_ else None,
        guides=faces.guides(cut),
        pairs=faces.pairs([*open_, *cut], (block,)),
        faces=faces,
    )


def cracked_state(domain: TaggedMesh, facets: Sequence[Facets], degree: int, axisymmetric: bool) -> State:
    """Displacement that may jump across some facets, but for those on the outer boundary. Collective."""
    mesh = domain.mesh
    element = ("Lagrange", degree, (mesh.geometry.dim,))
    inner = [part for part in facets if not on_boundary(mesh, part)]
    return State(
        cracked_space(mesh, element, inner) if inner else functionspace(mesh, element), axisymmetric=axisymmetric
    )
