"""Doubts about a bond or a contact: parameters that do not fit together, and faces that penetrate each other."""

from cutsim.base.verdict import Verdict
from cutsim.interface.cohesive import CohesiveLaw, process_zone_element

#: Penetration over the mesh size from which a contact is too soft to be trusted.
DEEP = 0.5
# strengths over Young's modulus of real bonds: carbon fibre composites have 4e-4, soft gels somewhat more than 1
_WEAKEST, _STRONGEST = 1e-5, 1e2


def doubt_law(verdict: Verdict, name: str, law: CohesiveLaw, young: float, size: float, body: float) -> None:
    """Doubt a bond whose numbers do not go with the body, or whose process zone the facets do not resolve.

    Args:
        verdict: Where to say so.
        name: Name of the interface.
        law: Its law.
        young: Young's modulus of the softer body [stress].
        size: Mean size of its facets [length].
        body: Largest extent of the bodies [length].
    """
    ratio = law.strength / young
    if not _WEAKEST <= ratio <= _STRONGEST:
        verdict.doubt(
            f"{name}: strength",
            f"{name}: a strength of {law.strength:.3g} is {ratio:.2g} of Young's modulus {young:.3g}: are both in the "
            "same units?",
        )
    if law.opening > body:
        verdict.doubt(
            f"{name}: opening",
            f"{name}: the bond is strongest at an opening of {law.opening:.3g}, more than the whole body, {body:.3g}: "
            "are toughness and strength in the same units?",
        )
    allowed = process_zone_element(law, young)
    if size > allowed:
        verdict.doubt(
            f"{name}: process zone",
            f"{name}: facets of {size:.3g} do not resolve the process zone (opening {law.opening:.3g}): use "
            f"{allowed:.3g} or less",
        )


def doubt_penetration(
    verdict: Verdict, name: str, depth: float, blend: float, cure: str = "a stiffer contact is needed"
) -> None:
    """Doubt a contact whose surfaces lie deep in each other.

    A blended contact p = ε (s − c) acts as if the surfaces were moved apart by its blend c, which does not count.

    Args:
        verdict: Where to say so.
        name: Name of the contact.
        depth: Largest penetration over the mesh size normal to the surface [–].
        blend: Blend of the contact over the same [–].
        cure: What helps.
    """
    if depth - blend > DEEP:
        verdict.doubt(
            f"{name}: penetration",
            f"{name}: surfaces penetrate each other by {depth:.2g} of the mesh size: {cure}",
            depth,
        )
