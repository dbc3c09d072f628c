"""Contacts of FEBio: pairs of surfaces, and rigid bodies that become tools."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cutsim.cases.importing.counterparts import STIFF, rounded, tie
from cutsim.cases.importing.draft import MalformedFile, Untranslatable
from cutsim.cases.importing.febio_context import Context, describe
from cutsim.cases.importing.febio_file import children
from cutsim.cases.importing.febio_rigid import RigidBody
from cutsim.cases.importing.surfaces import height_behind, mean_size, obj_text, outer_triangles
from cutsim.readers.facets import rows_in
from cutsim.readers.febio import SIDES
from cutsim.readers.xml_tree import LinedElement

_OFF = ("", "0", "false", "penalty")
_SLIDING = (
    "sliding-elastic", "sliding-facet-on-facet", "sliding-node-on-facet", "facet-to-facet sliding", "sliding_with_gaps",
    "sliding2",
)  # fmt: skip
_TIED = ("tied-elastic", "tied-facet-on-facet", "tied-node-on-facet", "tied", "facet-to-facet tied")
#: Settings of the search and of the augmentation of FEBio, which ours do without.
_NUMERICS = (
    "tolerance", "minaug", "maxaug", "search_tol", "search_tolerance", "search_radius", "seg_up", "update_penalty",
    "knmult", "ktmult", "node_reloc", "smooth_aug", "symmetric_stiffness", "dxtol", "offset_shells", "max_distance",
    "special", "gap_offset",
)  # fmt: skip
#: Settings that change what is computed, and their values that do not.
_NEUTRAL: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "tension": _OFF,
        "flip_primary": _OFF,
        "flip_secondary": _OFF,
        "shell_bottom_primary": _OFF,
        "shell_bottom_secondary": _OFF,
        "offset": _OFF,
    }
)
#: Penetration that is allowed where FEBio has no tolerance of the gap, as a fraction of a facet.
_PENETRATION = 0.01
#: Least penalty of a contact that is augmented, in Young's modulus over the height of an element.
_AUGMENTED = 10.0


def translate_contacts(context: Context, bodies: Mapping[str, RigidBody], young: Mapping[str, float]) -> None:
    """Translate contacts of surfaces and with rigid walls.

    Args:
        context: The file and the case.
        bodies: The rigid bodies by name.
        young: Young's modulus of each deformable part by name [stress].
    """
    for tag in ("Contact", "Constraints"):
        for section in context.file.sections(tag):
            for element in children(section):
                if element.get("type") == "rigid_wall":
                    context.attempt(element, lambda each: _wall(context, each, young))
                elif tag == "Contact" and element.get("type") != "rigid":
                    context.attempt(element, lambda each: _contact(context, each, bodies, young))


def _contact(
    context: Context, element: LinedElement, bodies: Mapping[str, RigidBody], young: Mapping[str, float]
) -> None:
    kind = element.get("type", "")
    if kind not in (*_SLIDING, *_TIED):
        raise Untranslatable("has no counterpart", element.line)
    primary, secondary = _surfaces(context, element)
    _check_neutral(context, element)
    of_body = {name: context.nodes_of(parts) for name, parts in context.rigid_parts.items()}
    rigid = [
        next((name for name, nodes in of_body.items() if _within(context, s, nodes)), "") for s in (primary, secondary)
    ]
    if all(rigid):
        raise Untranslatable("both surfaces belong to rigid bodies", element.line)
    if any(rigid):
        if kind in _TIED:
            raise Untranslatable("a surface is tied to a rigid body", element.line)
        _tool(context, element, bodies[max(rigid)], secondary if rigid[0] else primary, young)
    elif _share_facets(context, primary, secondary):
        raise Untranslatable("its surfaces have facets in common", element.line)
    elif kind in _TIED:
        _tie(context, element, (primary, secondary), young)
    else:
        _pair(context, element, (primary, secondary), young)


def _share_facets(context: Context, one: str, other: str) -> bool:
    sets = context.mesh.facet_sets
    pairs = [(a, b) for a in sets[one] for b in sets[other] if a.shape[1] == b.shape[1]]
    return any(bool(rows_in(np.sort(a, axis=1), np.sort(b, axis=1)).any()) for a, b in pairs)


def _within(context: Context, surface: str, nodes: NDArray[np.int64]) -> bool:
    return all(bool(np.isin(facets, nodes).all()) for facets in context.mesh.facet_sets[surface])


def _surfaces(context: Context, element: LinedElement) -> tuple[str, str]:
    """Primary and secondary surface of a contact."""
    name = element.get("surface_pair", "")
    if name:
        if name not in context.mesh.pairs:
            raise MalformedFile(f"{context.file.place(element)}: there is no surface pair {name!r}")
        return context.mesh.pairs[name]
    found = {}
    for child in children(element):
        if child.tag == "surface":
            context.file.read(child)
            found[SIDES.get(child.get("type", ""), child.get("type"))] = child.get("set")
    names = found.get("primary"), found.get("secondary")
    if not all(name in context.mesh.facet_sets for name in names):
        raise Untranslatable("its surfaces have no names", element.line)
    return str(names[0]), str(names[1])


def _check_neutral(context: Context, element: LinedElement) -> None:
    for tag, values in _NEUTRAL.items():
        if (text := context.file.text(element, tag).lower()) not in values and text.strip("0.,") != "":
            raise Untranslatable(f"with {tag} = {text}", element.line)
    for tag in _NUMERICS:
        context.file.child(element, tag)


def _on(context: Context, element: LinedElement, tag: str) -> bool:
    return context.file.text(element, tag).lower() not in _OFF


def _sliding(context: Context, element: LinedElement, surface: str, young: Mapping[str, float]) -> dict[str, Any]:
    """Penalty, augmentation and friction of a contact."""
    file = context.file
    two_pass = _on(context, element, "two_pass")
    # both passes of FEBio carry the whole penalty, ours share it
    penalty = _penalty(context, element, surface, young) * (2 if two_pass else 1)
    values: dict[str, Any] = {"contact": {"stiffness": rounded(penalty)}}
    gap = file.number(element, "gaptol", 0.0)
    if _on(context, element, "laugon"):
        # where FEBio augments, its penalty is no part of the result
        penalty = max(penalty, _AUGMENTED * _reference(context, surface, young))
        values["contact"] = {"stiffness": rounded(penalty)}
        values["allowed_penetration"] = gap or rounded(_PENETRATION * mean_size(context.mesh, surface))
    friction, stiffness = file.number(element, "fric_coeff", 0.0), file.number(element, "fric_penalty", 0.0)
    if friction:
        law = {"model": "coulomb", "mu": friction, "stiffness": stiffness}
        values["friction"] = law if stiffness else friction
    return values | ({"two_pass": True} if two_pass else {})


def _penalty(context: Context, element: LinedElement, surface: str, young: Mapping[str, float]) -> float:
    """Penalty of a contact [stress/length]: as given, or as a factor of E A/V of the elements behind the surface."""
    penalty = context.file.number(element, "penalty", 1.0)
    return penalty * _reference(context, surface, young) if _on(context, element, "auto_penalty") else penalty


def _reference(context: Context, surface: str, young: Mapping[str, float]) -> float:
    """Young's modulus over the height of the elements behind a surface [stress/length]."""
    return max(young.values(), default=1.0) / height_behind(context.mesh, surface)


def _pair(context: Context, element: LinedElement, surfaces: tuple[str, str], young: Mapping[str, float]) -> None:
    if "node" in element.get("type", "") and not _on(context, element, "two_pass"):
        what = "points inside of the facets are kept apart here, nodes in FEBio: different if the facets are large"
        context.draft.difference(element.line, f"{describe(element)}: {what}")
    values = {"slave": surfaces[0], "master": surfaces[1], **_sliding(context, element, surfaces[0], young)}
    context.draft.add("pairs", element.get("name") or "contact", values, f"line {element.line}")


def _tie(context: Context, element: LinedElement, surfaces: tuple[str, str], young: Mapping[str, float]) -> None:
    """A stiff bond that does not break; FEBio's own penalty if there is no more than that."""
    augmented = _on(context, element, "laugon")
    penalty = _penalty(context, element, surfaces[0], young)
    for tag in ("two_pass", "gaptol"):
        context.file.child(element, tag)
    penalty = STIFF * _reference(context, surfaces[0], young) if augmented else penalty
    law = tie(penalty, max(young.values(), default=1.0))
    values = {"slave": surfaces[0], "master": surfaces[1], "law": law, "small_sliding": True}
    context.draft.add("pairs", element.get("name") or "tied", values, f"line {element.line}")
    if augmented:
        context.draft.difference(element.line, f"{describe(element)}: tied by a stiff bond in place of multipliers")


def _tool(context: Context, element: LinedElement, body: RigidBody, surface: str, young: Mapping[str, float]) -> None:
    """A rigid body that touches a surface, as a tool."""
    path = body.path(context.file.end)
    triangles = outer_triangles(context.mesh, context.rigid_parts[body.name])
    if triangles is None:
        raise Untranslatable(f"the surface of the rigid body {body.name!r} is open", element.line)
    values = _sliding(context, element, surface, young)
    values.pop("two_pass", None)
    if values.pop("allowed_penetration", None):
        context.draft.difference(element.line, f"<contact> {element.get('name')!r}: a penalty without augmentation")
    name = f"{context.file.path.stem}_{body.name}"
    called = context.draft.add(
        "tools",
        body.name,
        {"shape": "surface", "file": "", "surfaces": [surface], **path, **values},
        f"line {element.line}",
    )
    file = f"{''.join(c if c.isalnum() else '_' for c in name)}.obj"
    context.draft.files[file] = obj_text(context.mesh.points, triangles)
    context.draft.tables["tools"][called]["file"] = file


def _wall(context: Context, element: LinedElement, young: Mapping[str, float]) -> None:
    """A rigid plane that may move along its normal."""
    file, surface = context.file, element.get("surface", "")
    if surface not in context.mesh.facet_sets:
        raise Untranslatable("its facets have no name", element.line)
    *normal, height = file.vector(element, "plane", 4)
    length = float(np.linalg.norm(normal))
    offset = file.child(element, "offset")
    times, travel = np.array([0.0]), np.array([0.0])
    if offset is not None:
        moved = file.timed(offset)
        times = moved.times(file.end)
        travel = moved.at(times)
    heights = (height / length + travel)[:, None] * np.array(normal) / length
    moving = len(np.unique(travel)) > 1
    path = (
        {"path": {"times": times.tolist(), "points": heights.tolist()}} if moving else {"position": heights[0].tolist()}
    )
    values = {
        "shape": "plane",
        "normal": normal,
        "surfaces": [surface],
        **path,
        **_sliding(context, element, surface, young),
    }
    if values.pop("allowed_penetration", None):
        context.draft.difference(element.line, f"<constraint> {element.get('name')!r}: a penalty without augmentation")
    file.child(element, "tolerance")
    context.draft.add("tools", element.get("name") or "wall", values, f"line {element.line}")
