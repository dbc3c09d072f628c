"""What is known of a mesh before it is made: parameters of its geometry, and names that its groups may have."""

import inspect
import re
from dataclasses import dataclass
from functools import cache

from cutsim.fields.laminate import HALVES, SIDES, laminate
from cutsim.fields.meshing import geometries, geometry

#: The geometry that is made of the layers in ``[[layers]]``, by `cutsim.laminate`.
LAMINATE = "laminate"
_PARAMETER = re.compile(r'Name\s+"(\w+)"')
_WORD = re.compile(r'"(\w+)"')


@dataclass(frozen=True)
class Outline:
    """Outline of a built-in geometry.

    Attributes:
        parameters: Names of its parameters.
        groups: Names that its groups may have; which of them there are depends on the parameters.
    """

    parameters: tuple[str, ...]
    groups: tuple[str, ...]


def names() -> list[str]:
    """Names of the built-in geometries."""
    return [*geometries(), LAMINATE]


@cache
def outline(name: str) -> Outline:
    """Outline of a built-in geometry other than the block of layers."""
    lines = [line.split("//")[0] for line in geometry(name).read_text(encoding="utf-8").splitlines()]
    found = [word for line in lines if "Physical" in line or "name =" in line for word in _WORD.findall(line)]
    return Outline(tuple(_PARAMETER.findall("\n".join(lines))), tuple(dict.fromkeys([*found, "back"])))


def laminate_outline(layers: tuple[str, ...]) -> Outline:
    """Outline of a block of layers, by their names."""
    keywords = [p for p in inspect.signature(laminate).parameters.values() if p.kind is p.KEYWORD_ONLY]
    return Outline(tuple(p.name for p in keywords), (*SIDES, *HALVES, *layers, *(f"crack_{layer}" for layer in layers)))
