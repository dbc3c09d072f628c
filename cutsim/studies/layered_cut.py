"""A blade driven into a block of layers, such as skin (docs/skin_layers.md)."""

from dataclasses import dataclass, replace
from typing import Literal, Self

from cutsim.analysis.mechanics import Mechanics
from cutsim.base.checks import at_least, nonnegative, positive, require, require_number
from cutsim.bodies.loads import Support
from cutsim.fields.points import Surface
from cutsim.interface.crack import Crack
from cutsim.interface.friction import Coulomb
from cutsim.results.recording import Columns
from cutsim.studies.insertion import FACES, TIP_IN_NOTCH, check_block, check_tool, soft_contact, tool_path
from cutsim.studies.layered import LayeredBlock
from cutsim.tools.pointed import Blade
from cutsim.tools.tool_contact import ToolContact, doubt_units

Side = Literal["+", "-"]


@dataclass(frozen=True)
class LayeredCut:
    """A blade driven into a notched block of layers along its crack.

    The block is held by its sides, where it goes on; its far ends may be drawn apart first, as skin on a body is.  It
    rests on a smooth plate.  Time is the way of the blade, as in `cutsim.studies.insertion.Insertion`.

    Attributes:
        block: The layers.
        mechanics: The problem to run.
        contacts: Each half of the blade on each part of the crack: where the layers are soft, so is the contact.
        plate: Support under the block.
        blade: The whole blade.
        insertion: Time in which the ends are drawn apart and the half blades spread in the notch.
        tip: Depth of the tip when the push begins [length].
    """

    block: LayeredBlock
    mechanics: Mechanics
    contacts: tuple[ToolContact, ...]
    plate: Support
    blade: Blade
    insertion: float
    tip: float

    @classmethod
    def build(
        cls,
        block: LayeredBlock,
        blade: Blade,
        *,
        notch: float,
        friction: float = 0.0,
        drawn: float = 0.0,
        insertion: float = 1.0,
    ) -> Self:
        """Put the problem together and compile its forms. Collective.

        Args:
            block: The layers, with a notch.
            blade: The whole blade (side 0).
            notch: Depth of the notch [length].
            friction: Friction coefficient of blade and block [–].
            drawn: Way by which each far end is drawn outwards during the insertion [length].
            insertion: Duration of the insertion [time].

        Raises:
            ValueError: A parameter is outside its range, or the block has no notch.
        """
        require("blade", blade, isinstance(blade, Blade), "a Blade: a needle makes no planar crack in layers")
        check_tool("blade", blade, notch, block.domain.mesh.geometry.dim)
        require_number("friction", friction, nonnegative)
        require_number("drawn", drawn, nonnegative)
        require_number("insertion", insertion, positive)
        mouth, tip = block.notch, TIP_IN_NOTCH * notch
        if mouth is None:
            raise ValueError("block has no notch; allowed is one on a mesh that was made with a notch")
        height = check_block(block.domain, notch)
        doubt_units(block.state.verdict, "blade", blade, height)
        rubs = Coulomb(friction) if friction else None
        contacts = tuple(
            _half(block, blade, crack, tip, insertion, rubs, face) for face in FACES for crack in block.cracks
        )
        plate = Support(block.state, block.domain.facets("bottom"), 1, name="plate")
        ends = [_end(block, f"far_{name}", side * drawn, insertion) for _, side, name in FACES]
        sides = [name for name in ("front", "back") if name in block.domain.names]
        held = [Support(block.state, block.domain.facets(name), 2) for name in sides]
        mechanics = Mechanics(block.state, [*block.terms, *contacts], [plate, *ends, *held])
        return cls(block, mechanics, contacts, plate, blade, insertion, tip)

    def time_of(self, depth: float) -> float:
        """Time at which the tip is this deep below the top [time]."""
        require_number("depth", depth, at_least(self.tip, "the start of the push"))
        return self.insertion + depth - self.tip

    def columns(self, columns: Columns) -> Columns:
        """Depth of the tip, force of the blade, its imbalance with the plate, energies of the layers. Collective."""
        force = sum(contact.force()[1] for contact in self.contacts)
        reaction = self.mechanics.reaction(self.plate)
        rows: Columns = {
            "depth": (-float(self.contacts[0].position.value[1]), "length"),
            "force": (force, "force"),
            "imbalance": (abs(reaction - force), "force"),
        }
        return rows | self.block.columns(columns)


def _half(
    block: LayeredBlock,
    blade: Blade,
    crack: Crack,
    tip: float,
    insertion: float,
    friction: Coulomb | None,
    face: tuple[Side, int, str],
) -> ToolContact:
    """Half of the blade on its face of a part of the crack; on that of the notch and the top beside the first part."""
    mark, side, name = face
    surfaces = [crack.surface(mark)]
    if crack is block.cracks[0] and block.notch is not None:
        surfaces += [block.notch.surface(mark), Surface.exterior(block.state, block.domain.facets(f"top_{name}"))]
    half = ToolContact(
        block.state,
        replace(blade, side=side),
        tool_path(blade, side, (tip, insertion, None), block.state.mesh.geometry.dim),
        surfaces,
        contact=soft_contact(blade, crack, min(layer.material.young for layer in block.layers_of(crack))),
        friction=friction,
        name=f"blade_{name}_{crack.name}",
    )
    if crack is not block.cracks[0]:  # how deep the cut will go is not known
        half.may_miss()
    return half


def _end(block: LayeredBlock, side: str, way: float, duration: float) -> Support:
    """A far end, drawn outwards at a constant speed, then held."""
    return Support(
        block.state,
        block.domain.facets(side),
        0,
        lambda t: way * min(t / duration, 1.0),
        corners=(duration,),
        name=side,
    )
