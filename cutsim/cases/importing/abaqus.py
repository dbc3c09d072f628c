"""Models of Abaqus and CalculiX (.inp) as cases."""

from pathlib import Path

import numpy as np

from cutsim.cases.importing import abaqus_materials
from cutsim.cases.importing.abaqus_conditions import Conditions
from cutsim.cases.importing.abaqus_contacts import translate_contacts
from cutsim.cases.importing.abaqus_file import AbaqusFile, Located
from cutsim.cases.importing.abaqus_history import translate_steps
from cutsim.cases.importing.counterparts import Counterpart, parameters, table
from cutsim.cases.importing.draft import Imported, Untranslatable
from cutsim.readers import shapes

#: Keywords of geometry, of output and of what has no effect on the result.
_READ_ELSEWHERE = (
    "HEADING", "PREPRINT", "NODE", "ELEMENT", "NSET", "ELSET", "SURFACE", "PART", "END PART", "ASSEMBLY",
    "END ASSEMBLY", "INSTANCE", "END INSTANCE", "END STEP", "OUTPUT", "NODE OUTPUT", "ELEMENT OUTPUT", "CONTACT OUTPUT",
    "ENERGY OUTPUT", "RESTART", "NODE PRINT", "EL PRINT", "ENERGY PRINT", "CONTACT PRINT", "NODE FILE", "EL FILE",
    "CONTACT FILE", "FILE FORMAT", "MONITOR", "PRINT", "CONTROLS", "SECTION CONTROLS", "HOURGLASS STIFFNESS",
)  # fmt: skip
_BRICKS = ("hexahedron", "quad")


def import_abaqus(path: Path, mesh_file: str) -> Imported:
    """Translate a model of Abaqus or CalculiX.

    Args:
        path: The file.
        mesh_file: What the case file calls it.

    Raises:
        MalformedFile: It is no such file, or not what its format says, with the line.
        OSError: It cannot be read.
    """
    file = AbaqusFile(path)
    with file.naming():
        for located in file.take(*_READ_ELSEWHERE):
            if located.card.keyword == "HEADING" and located.card.data:
                file.draft.tables["title"] = located.card.data[0][1]
        file.draft.tables.setdefault("title", path.stem)
        steps = translate_steps(file)
        dim = _mesh(file, mesh_file)
        young = _bodies(file, dim)
        Conditions(file, steps, dim).translate()
        translate_contacts(file, young)
    for card in file.leftovers():
        file.draft.untranslated(card.line, f"*{card.keyword}: has no counterpart")
    return file.draft.finished()


def _mesh(file: AbaqusFile, mesh_file: str) -> int:
    """Translate the mesh; the dimension of it."""
    dims = [shapes.dimension(block.shape) for block in file.mesh.blocks]
    dim = 3 if 3 in dims else 2
    blocks = [block for block, of in zip(file.mesh.blocks, dims, strict=True) if of == dim]
    for block, of in zip(file.mesh.blocks, dims, strict=True):
        if of != dim:
            file.draft.untranslated(block.line, f"*ELEMENT: {block.kind} in {block.name!r}: they are no solids")
    kinds = {block.kind for block in blocks}
    values: dict[str, object] = {"file": mesh_file, "dim": dim}
    if any(shapes.quadratic(block.shape) for block in blocks):
        values["degree"] = 2
    if dim == 2 and all(kind.startswith("CAX") for kind in kinds):
        values["axisymmetric"] = True
    file.draft.set("mesh", values)
    return dim


def _bodies(file: AbaqusFile, dim: int) -> float:
    """Translate sections with their materials; Young's modulus of the softest body [stress]."""
    definitions = abaqus_materials.definitions(file)
    young: list[float] = []
    for located in file.take("SOLID SECTION"):
        card = located.card
        with file.attempt(card):
            definition = definitions.get(card.needed("MATERIAL").upper())
            if definition is None:
                with card.at():
                    raise ValueError(f"there is no *MATERIAL {card.get('MATERIAL')!r}")
            counterpart = abaqus_materials.counterpart(file, definition)
            young.append(counterpart.material.young)
            _section(
                file, located, counterpart, dim, f"line {definition.head.line}: *MATERIAL {definition.head.get('NAME')}"
            )
    return min(young, default=1.0)


def _section(file: AbaqusFile, located: Located, counterpart: Counterpart, dim: int, comment: str) -> None:
    """A body for the section in each instance of its part."""
    card = located.card
    if card.get("ORIENTATION"):
        raise Untranslatable(f"with ORIENTATION={card.get('ORIENTATION')}", card.line)
    names = file.find(file.mesh.cell_sets, card.needed("ELSET"), located.part)
    if not names:
        with card.at():
            raise ValueError(f"there is no set of elements {card.get('ELSET')!r}")
    if dim == 2 and (thickness := next(iter(file.numbers(card)), 1.0)) not in (0.0, 1.0):
        file.draft.difference(card.line, f"*SOLID SECTION: forces are per unit of thickness, which is {thickness:g}")
    for name in names:
        values: dict[str, object] = {"cells": name, "material": table(counterpart.material)}
        values |= _elements(file, name, counterpart)
        if counterpart.relaxation is not None:
            values["relaxation"] = parameters(counterpart.relaxation)
        if counterpart.density is not None:
            values["density"] = counterpart.density
        file.draft.add("bodies", name, values, comment)


def _elements(file: AbaqusFile, cells: str, counterpart: Counterpart) -> dict[str, object]:
    """What the types of the elements say: plane stress, and mixed elements where the material allows it."""
    starts = np.cumsum([0, *(len(block.nodes) for block in file.mesh.blocks)])
    members = file.mesh.cell_sets[cells]
    blocks = [
        block
        for block, start in zip(file.mesh.blocks, starts, strict=False)
        if ((members >= start) & (members < start + len(block.nodes))).any()
    ]
    values: dict[str, object] = {}
    if any(block.kind.startswith("CPS") for block in blocks):
        values["plane"] = "stress"
    elif counterpart.uncoupled and all(block.shape in _BRICKS for block in blocks):
        values["volumetric"] = "mixed"
    for block in blocks:
        if block.kind.rstrip("H").endswith("R"):
            file.draft.difference(
                block.line, f"*ELEMENT: {block.kind} with reduced integration are integrated fully here"
            )
    return values
