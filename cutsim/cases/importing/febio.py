"""Models of FEBio (.feb, versions 2.0 to 4.0) as cases."""

from pathlib import Path

from cutsim.cases.importing.counterparts import Counterpart, parameters, table
from cutsim.cases.importing.draft import Draft, Imported, MalformedFile
from cutsim.cases.importing.febio_contacts import translate_contacts
from cutsim.cases.importing.febio_context import Context, describe
from cutsim.cases.importing.febio_file import FebioFile, children
from cutsim.cases.importing.febio_loads import translate_loads
from cutsim.cases.importing.febio_materials import MaterialReader
from cutsim.cases.importing.febio_rigid import rigid_bodies, translate_fastened
from cutsim.cases.importing.febio_steps import translate_steps
from cutsim.cases.importing.febio_supports import translate_supports
from cutsim.readers.febio import read_febio
from cutsim.readers.mesh_data import MeshData
from cutsim.readers.shapes import dimension, quadratic
from cutsim.readers.xml_tree import LinedElement

_RIGID = "rigid body"
_UNITS = {"mm-N-s": ("mm", "N"), "SI": ("m", "N")}
#: Elements that FEBio integrates in other ways than ours.
_OTHER_ELEMENTS = ("ut4-solid", "ut4", "udg-hex", "sri-solid", "remodelling-solid")
_SPACE = 3
#: Sections that the mesh is read from, or that say what is written.
_READ_ELSEWHERE = ("Mesh", "Geometry", "Output", "Globals", "Module")


def import_febio(path: Path, mesh_file: str) -> Imported:
    """Translate a model of FEBio.

    Args:
        path: The file.
        mesh_file: What the case file calls it.

    Raises:
        MalformedFile: It is no such file, or not what its format says, with the line.
        OSError: It cannot be read.
    """
    file, draft = FebioFile(path), Draft(path)
    try:
        mesh = read_febio(path)
    except ValueError as error:
        raise MalformedFile(f"{path.name}: {error}") from None
    for section in children(file.root):
        if section.tag in _READ_ELSEWHERE:
            file.read_all(section)
    _header(file, draft)
    context = Context(file, draft, mesh, quadratic=_quadratic(mesh))
    translate_steps(file, draft)
    _Model(context, mesh_file).translate()
    for element in file.leftovers():
        unused = element.tag in ("LoadData", "loadcurve", "load_controller")
        why = "nothing that is translated uses it" if unused else "has no counterpart"
        draft.untranslated(element.line, f"{describe(element)}: {why}")
    return draft.finished()


def _quadratic(mesh: MeshData) -> bool:
    """Whether solids have nodes between their corners."""
    return any(dimension(block.shape) == _SPACE and quadratic(block.shape) for block in mesh.blocks)


def _header(file: FebioFile, draft: Draft) -> None:
    draft.tables["title"] = file.path.stem
    module = next((section for section in children(file.root) if section.tag == "Module"), None)
    kind = "" if module is None else module.get("type", "solid")
    if kind not in ("", "solid"):
        draft.untranslated(
            module.line if module is not None else 1, f"<Module> {kind!r}: only what is solid is translated"
        )
    units = "" if module is None else (module.findtext("units") or "").strip()
    if units in _UNITS:
        length, force = _UNITS[units]
        draft.set("units", {"length": length, "force": force})
    elif units:
        draft.untranslated(module.line if module is not None else 1, f"units {units!r}: numbers are as in the file")


class _Model:
    """Materials and parts of a file, and what is translated with them."""

    def __init__(self, context: Context, mesh_file: str) -> None:
        self._context, self._file, self._draft = context, context.file, context.draft
        self._mesh_file = mesh_file
        self._materials = [
            self._file.read(element)
            for section in self._file.sections("Material")
            for element in children(section)
            if element.tag == "material"
        ]
        self._names = {
            reference: self._name(m) for m in self._materials for reference in (m.get("id", ""), m.get("name", ""))
        }
        self._parts = self._parts_of_materials()
        self._young: dict[str, float] = {}

    def translate(self) -> None:
        """Translate all of it."""
        rigid = {self._name(m): m for m in self._materials if m.get("type") == _RIGID}
        for element in rigid.values():
            self._file.read_all(element)
        self._context.rigid_parts.update({name: self._parts.get(name, []) for name in rigid})
        self._translate_mesh()
        for element in self._materials:
            if element.get("type") != _RIGID:
                self._context.attempt(element, self._translate_material)
        references = {key: name for key, name in self._names.items() if name in rigid and key}
        bodies = rigid_bodies(self._context, rigid, references)
        translate_supports(self._context)
        translate_fastened(self._context, bodies, references)
        translate_loads(self._context)
        translate_contacts(self._context, bodies, self._young)

    @staticmethod
    def _name(material: LinedElement) -> str:
        return material.get("name") or f"material{material.get('id')}"

    def _parts_of_materials(self) -> dict[str, list[str]]:
        """Names of the parts of each material."""
        material_of: dict[str, str] = {}
        for section in self._file.sections("MeshDomains"):
            for domain in children(section):
                material_of[domain.get("name", "")] = domain.get("mat", "")
                self._check_domain(domain)
        meshes = [section for section in children(self._file.root) if section.tag in ("Geometry", "Mesh")]
        elements = [element for section in meshes for element in children(section) if element.tag == "Elements"]
        for number, element in enumerate(elements, start=1):  # parts without a name are called as the mesh calls them
            name = (element.get("name") or element.get("elset") or f"part{number}").strip()
            material_of.setdefault(name, element.get("mat") or "")
        found: dict[str, list[str]] = {}
        for part, material in material_of.items():
            found.setdefault(self._names.get(material, ""), []).append(part)
        return found

    def _check_domain(self, domain: LinedElement) -> None:
        self._file.read_all(domain)
        kind = domain.get("elem_type", "") or domain.get("type", "")
        if kind in _OTHER_ELEMENTS:
            self._draft.difference(
                domain.line, f"{domain.get('name')!r}: elements of type {kind!r} are ordinary ones here"
            )

    def _solid(self, part: str) -> bool:
        """Whether a part is a solid; shells and trusses are noted as not translated."""
        blocks = [block for block in self._context.mesh.blocks if block.name == part]
        for block in blocks:
            if dimension(block.shape) != _SPACE:
                self._draft.untranslated(block.line, f"<Elements> {part!r} of type {block.kind!r}: they are no solids")
        return bool(blocks) and all(dimension(block.shape) == _SPACE for block in blocks)

    def _translate_mesh(self) -> None:
        rigid = {part for parts in self._context.rigid_parts.values() for part in parts}
        solid = [part for parts in self._parts.values() for part in parts if part not in rigid]
        only = {"only": solid} if rigid else {}
        degree = {"degree": 2} if self._context.quadratic else {}
        self._draft.set("mesh", {"file": self._mesh_file, "dim": 3, **only, **degree})

    def _translate_material(self, element: LinedElement) -> None:
        counterpart = MaterialReader(self._file, self._draft).counterpart(element)
        comment = f"line {element.line}: {element.get('type')} {element.get('name')!r}"
        for part in filter(self._solid, self._parts.get(self._name(element), [])):
            self._young[part] = counterpart.material.young
            values = {"cells": part, "material": table(counterpart.material), **self._body(part, counterpart)}
            self._draft.add("bodies", part, values, comment)

    def _has_weight(self) -> bool:
        return any(load.tag == "body_load" for section in self._file.sections("Loads") for load in section)

    def _body(self, part: str, counterpart: Counterpart) -> dict[str, object]:
        shapes = {block.shape for block in self._context.mesh.blocks if block.name == part}
        # FEBio integrates the pressure of uncoupled materials once in a hexahedron, and all else fully
        mixed = counterpart.uncoupled and shapes == {"hexahedron"}
        values: dict[str, object] = {"volumetric": "mixed" if mixed else "full"}
        if counterpart.relaxation is not None:
            values["relaxation"] = parameters(counterpart.relaxation)
        if self._draft.tables["analysis"]["type"] == "dynamic" or self._has_weight():
            values["density"] = counterpart.density
        return values
