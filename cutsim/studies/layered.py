"""Layered block with one crack through all layers, such as skin (docs/skin_layers.md)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from cutsim.base.checks import count, nonnegative, positive, require, require_number, require_numbers
from cutsim.base.signatures import checked
from cutsim.base.units import Length
from cutsim.bodies.solid import Solid
from cutsim.fields.meshing import TaggedMesh
from cutsim.fields.state import State
from cutsim.interface.cohesive import CohesiveLaw
from cutsim.interface.crack import Crack
from cutsim.materials.elastic import Material
from cutsim.materials.library import SKIN, material
from cutsim.results.recording import Columns
from cutsim.studies.body import PLAIN, CrackedBody, Faces, cracked_state

# the '+' face of the crack is that of the half x > 0, whose normal points to −x
_PLUS = (-1.0, 0.0, 0.0)


@checked
@dataclass(frozen=True)
class Layer:
    """Layer of a block.

    Args:
        name: Its name in the mesh, in messages and in output.
        thickness: Thickness > 0 [length].
        material: Strain energy.
        law: Cohesive law of the crack in it.
        solid: Further arguments of its `Solid`, such as ``{"density": 1.1e-9}``.

    Raises:
        ValueError: The thickness is not positive.
    """

    name: str
    thickness: Length
    material: Material
    law: CohesiveLaw
    solid: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        require_number("thickness", self.thickness, positive)


def skin(epidermis: CohesiveLaw, dermis: CohesiveLaw, hypodermis: CohesiveLaw) -> tuple[Layer, ...]:
    """The eight layers of skin, with thicknesses and materials of `cutsim.materials.library` [mm, MPa].

    Args:
        epidermis: Cohesive law of its five layers; they are hard to tell apart in a test.
        dermis: Cohesive law of its two layers.
        hypodermis: Cohesive law of the fat.

    Returns:
        Layers from the surface downwards, with names such as "stratum_corneum".
    """

    def law(name: str) -> CohesiveLaw:
        return epidermis if name.startswith("stratum") else hypodermis if name == "hypodermis" else dermis

    return tuple(Layer(n.replace(" ", "_"), t, material(n).material, law(n)) for n, t in SKIN.items())


@dataclass(frozen=True)
class LayeredBlock(CrackedBody):
    """Block of layers, each a solid of its own, with one crack through all of them.

    Each solid has the name of its layer.  Neighbours with the same law share a part of the crack, which is called
    "crack" if it is the only one, else "crack_" and the name of its first layer.

    Attributes:
        layers: The layers from the top downwards.
    """

    layers: tuple[Layer, ...]

    @classmethod
    @checked
    def build(
        cls,
        layers: Sequence[Layer],
        domain: TaggedMesh,
        *,
        damping: float = 0.0,
        axisymmetric: bool = False,
        degree: int = 1,
        plus: Sequence[float] | None = None,
        faces: Faces = PLAIN,
    ) -> Self:
        """Put solids and cracks on a mesh. Collective.

        Args:
            layers: The layers from the top downwards.
            domain: Mesh with the groups of `cutsim.fields.laminate`.
            damping: Kelvin–Voigt viscosity over Young's modulus of every layer [time].
            axisymmetric: Whether the mesh is the meridian plane of a body of revolution.
            degree: Degree of the displacement.
            plus: Direction that points out of the '+' half of the block into the other one; −x by default.
            faces: How the faces of cracks and notch meet.

        Raises:
            ValueError: A parameter is outside its range, or the mesh lacks a layer.
        """
        require("layers", len(layers), len(layers) > 0, "at least one layer")
        require_number("damping", damping, nonnegative)
        require_number("degree", degree, count(1))
        gdim = domain.mesh.geometry.dim
        towards = _PLUS[:gdim] if plus is None else tuple(plus)
        require_numbers("plus", towards, length=gdim)
        cells = [domain.cells(layer.name) for layer in layers]
        parts = _parts(layers, domain)
        facets = [np.concatenate([domain.facets(_group(layer)) for layer in part]) for part in parts]
        broken = [domain.facets("notch")] if "notch" in domain.names else []
        state = cracked_state(domain, [*facets, *broken], degree, axisymmetric)
        solids = tuple(_solid(state, layer, where, damping) for layer, where in zip(layers, cells, strict=True))
        names = ["crack"] if len(parts) == 1 else [_group(part[0]) for part in parts]
        cracks = tuple(
            faces.crack(state, where, towards, part[0].law, young=_softest(part), name=name)
            for name, part, where in zip(names, parts, facets, strict=True)
        )
        through = [layer for layer in layers if layer not in parts[0][1:] and all(layer not in p for p in parts[1:])]
        notch = [faces.crack(state, where, towards, None, young=_softest(through), name="notch") for where in broken]
        guides, pairs = faces.guides(cracks), faces.pairs([*notch, *cracks], solids)
        cut = notch[0] if notch else None
        return cls(domain, state, solids, cracks, cut, tuple(layers), guides=guides, pairs=pairs, faces=faces)

    def layers_of(self, crack: Crack) -> list[Layer]:
        """The layers through which a part of the crack goes."""
        return _parts(self.layers, self.domain)[self.cracks.index(crack)]

    def columns(self, columns: Columns) -> Columns:
        """Energies of each layer: held by its strain, and spent on the crack in it. Collective."""
        rows: Columns = {}
        for solid in self.solids:
            rows[f"{solid.name}_strain"] = (solid.energies()["strain"], "energy")
        for crack in self.cracks:
            spent = crack.point_values("dissipated")
            for layer in self.layers_of(crack):
                within = np.isin(crack.points.facets, self.domain.facets(_group(layer)))
                rows[f"{layer.name}_fracture"] = (
                    crack.faces.sides.share * crack.points.integral(spent * within[:, None]),
                    "energy",
                )
        return rows


def _solid(state: State, layer: Layer, cells: NDArray[np.int32], damping: float) -> Solid:
    options = {"viscosity": damping * layer.material.young, **layer.solid}
    return Solid(state, layer.material, cells, name=layer.name, **options)


def _group(layer: Layer) -> str:
    return f"crack_{layer.name}"


def _parts(layers: Sequence[Layer], domain: TaggedMesh) -> list[list[Layer]]:
    """Layers that the notch does not cut through, in groups of neighbours with one law."""
    bonded = [layer for layer in layers if _group(layer) in domain.names]
    return [list(part) for _, part in groupby(bonded, key=lambda layer: layer.law)]


def _softest(layers: Sequence[Layer]) -> float:
    return min(layer.material.young for layer in layers)
