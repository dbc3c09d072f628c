"""Parts of a case: the terms of its virtual work, by the names that the case gives them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from cutsim.bodies.solid import Solid
from cutsim.interface.crack import Crack
from cutsim.pairs.surface_pair import SurfacePair
from cutsim.tools.rigid_tool import RigidTool


@dataclass(frozen=True)
class Parts:
    """Parts of a case, by name.

    Attributes:
        solids: The bodies.
        cracks: The cracks.
        pairs: Pairs of surfaces.
        tools: The tools, each as it meets the body: an inserted one is one term for each face of the crack.
    """

    solids: tuple[Solid, ...]
    cracks: Mapping[str, Crack] = field(default_factory=dict)
    pairs: Mapping[str, SurfacePair] = field(default_factory=dict)
    tools: Mapping[str, Sequence[RigidTool]] = field(default_factory=dict)
