"""A block of layers with one crack through all of them, such as skin (docs/skin_layers.md)."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Self

import numpy as np

from cutsim.base.checks import nonnegative, positive, require, require_number
from cutsim.base.signatures import checked
from cutsim.bodies.solid import Solid
from cutsim.fields.meshing import TaggedMesh
from cutsim.fields.space import cracked_space
from cutsim.fields.state import State
from cutsim.interface.cohesive import CohesiveLaw
from cutsim.interface.crack import Crack
from cutsim.materials.elastic import Material
from cutsim.materials.library import SKIN, material
from cutsim.results.recording import Columns

# the '+' face of the crack is that of the half x > 0, whose normal points to −x
_PLUS = (-1.0, 0.0, 0.0)


@checked
@dataclass(frozen=True)
class Layer:
    """A layer of a block.

    Args:
        name: Its name in the mesh, in messages and in output.
        thickness: Thickness > 0 [length].
        material: Strain energy.
        law: Cohesive law of the crack in it.

    Raises:
        ValueError: The thickness is not positive.
    """

    name: str
    thickness: float
    material: Material
    law: CohesiveLaw

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
class LayeredBlock:
    """Layers that stick together, each a solid of its own, with one crack through all of them.

    Attributes:
        layers: The layers from the top downwards.
        domain: The tagged mesh.
        state: Displacement and time.
        solids: A solid for each layer, of the same name.
        cracks: The crack, in a part for each law: neighbours with the same law share one, which is called "crack" if it
            is the only one, else "crack_" and the name of its first layer.
        notch: Faces of the notch, which touch and do not stick; None without a notch.
    """

    layers: tuple[Layer, ...]
    domain: TaggedMesh
    state: State
    solids: tuple[Solid, ...]
    cracks: tuple[Crack, ...]
    notch: Crack | None

    @classmethod
    @checked
    def build(cls, layers: Sequence[Layer], domain: TaggedMesh, *, damping: float = 0.0) -> Self:
        """Put solids and cracks on a mesh. Collective.

        Args:
            layers: The layers from the top downwards.
            domain: Mesh with the groups of `cutsim.fields.laminate`.
            damping: Kelvin–Voigt viscosity over Young's modulus of every layer [time].

        Raises:
            ValueError: A parameter is outside its range, or the mesh lacks a layer.
        """
        require("layers", len(layers), len(layers) > 0, "at least one layer")
        require_number("damping", damping, nonnegative)
        mesh, cells = domain.mesh, [domain.cells(layer.name) for layer in layers]
        notched = "notch" in domain.names
        broken = [domain.facets("notch")] if notched else []
        parts, plus = _parts(layers, domain), _PLUS[: mesh.geometry.dim]
        facets = [np.concatenate([domain.facets(_group(layer)) for layer in part]) for part in parts]
        state = State(cracked_space(mesh, ("Lagrange", 1, (mesh.geometry.dim,)), [*facets, *broken]))
        solids = tuple(
            Solid(state, layer.material, where, name=layer.name, viscosity=damping * layer.material.young)
            for layer, where in zip(layers, cells, strict=True)
        )
        cracks = tuple(
            Crack(
                state,
                where,
                plus,
                part[0].law,
                young=_softest(part),
                name="crack" if len(parts) == 1 else _group(part[0]),
            )
            for part, where in zip(parts, facets, strict=True)
        )
        through = [layer for layer in layers if layer not in parts[0][1:] and all(layer not in p for p in parts[1:])]
        notch = Crack(state, broken[0], plus, None, young=_softest(through), name="notch") if notched else None
        return cls(tuple(layers), domain, state, solids, cracks, notch)

    @property
    def terms(self) -> list[Solid | Crack]:
        """Solids and cracks, for the mechanical problem."""
        return [*self.solids, *self.cracks, *([] if self.notch is None else [self.notch])]

    def layers_of(self, crack: Crack) -> list[Layer]:
        """The layers through which a part of the crack goes."""
        return _parts(self.layers, self.domain)[self.cracks.index(crack)]

    def columns(self, _: Columns) -> Columns:
        """Energies of each layer: held by its strain, and spent on the crack in it. Collective."""
        columns: Columns = {}
        for solid in self.solids:
            columns[f"{solid.name}_strain"] = (solid.energies()["strain"], "energy")
        for crack in self.cracks:
            spent = crack.point_values("dissipated")
            for layer in self.layers_of(crack):
                within = np.isin(crack.points.facets, self.domain.facets(_group(layer)))
                columns[f"{layer.name}_fracture"] = (crack.points.integral(spent * within[:, None]), "energy")
        return columns


def _group(layer: Layer) -> str:
    return f"crack_{layer.name}"


def _parts(layers: Sequence[Layer], domain: TaggedMesh) -> list[list[Layer]]:
    """Layers that the notch does not cut through, in groups of neighbours with one law."""
    bonded = [layer for layer in layers if _group(layer) in domain.names]
    return [list(part) for _, part in groupby(bonded, key=lambda layer: layer.law)]


def _softest(layers: Sequence[Layer]) -> float:
    return min(layer.material.young for layer in layers)
