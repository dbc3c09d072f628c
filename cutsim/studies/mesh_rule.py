"""Rule for the sizes of the elements of a cut, from the tip of the tool and the law of the bond."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

from cutsim.base.checks import positive, require, require_number
from cutsim.base.signatures import checked
from cutsim.base.units import Length
from cutsim.interface.cohesive import CohesiveLaw
from cutsim.tools.shapes import Shape

# the process zone ahead of a cut is resolved by elements of this part of the characteristic opening
_OF_OPENING = 0.4
# elements on the radius of a tip that indents a surface, and into which one along the crack is divided there
_ON_RADIUS, _AT_MOUTH = 3, 2


@checked
@dataclass(frozen=True)
class MeshRule:
    """Sizes of the elements of a cut.

    Attributes:
        size: Largest element along the crack, min(r, 0.4 ε) for a tip of radius r and a characteristic opening ε: it
            resolves both the tip and the process zone [length].
        mouth: Largest element where a tool comes to an intact surface, which it draws out around its tip before the
            cut begins: a third of r and half of `size` at most [length].
    """

    size: Length
    mouth: Length

    def __post_init__(self) -> None:
        require_number("size", self.size, positive)
        require_number("mouth", self.mouth, positive)

    @classmethod
    @checked
    def of(cls, tools: Sequence[Shape], laws: Sequence[CohesiveLaw]) -> Self:
        """The sizes that all of some tools and laws need.

        Args:
            tools: Tools that cut, by their smallest radius.
            laws: Cohesive laws of what they cut.

        Raises:
            ValueError: There is no tool or no law.
        """
        require("tools", len(tools), len(tools) > 0, "at least one tool")
        require("laws", len(laws), len(laws) > 0, "at least one cohesive law")
        radius = min(tool.resolution for tool in tools)
        size = min(radius, _OF_OPENING * min(law.opening for law in laws))
        return cls(size, min(radius / _ON_RADIUS, size / _AT_MOUTH))
