"""The classes of cutsim that a case file may name: those that it exports and that fit a protocol."""

import re
from collections.abc import Mapping
from dataclasses import is_dataclass
from functools import cache

import cutsim
from cutsim.analysis.steps import Control
from cutsim.bodies.schemes import Scheme
from cutsim.heat.contact_heat import HeatLaw
from cutsim.interface.cohesive import CohesiveLaw
from cutsim.interface.friction import FrictionLaw
from cutsim.materials.elastic import Material
from cutsim.materials.fibres import FibreLaw
from cutsim.tools.shapes import Shape

#: What a table of a case file may describe by the name of a class, and the key that has this name.
FAMILIES: Mapping[type, str] = {
    Material: "model",
    FibreLaw: "model",
    CohesiveLaw: "model",
    FrictionLaw: "model",
    HeatLaw: "model",
    Scheme: "model",
    Control: "model",
    Shape: "shape",
}


def kebab(name: str) -> str:
    """A class name in kebab-case."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "-", name).lower()


def members(protocol: type) -> set[str]:
    """Names of what a protocol asks for."""
    return {name for name in vars(protocol) if not name.startswith("_")}


def _has(kind: type, names: set[str]) -> bool:
    return all(hasattr(kind, name) or name in getattr(kind, "__dataclass_fields__", {}) for name in names)


def _package(kind: type) -> str:
    return kind.__module__.rpartition(".")[0]


@cache
def classes(protocol: type) -> dict[str, type]:
    """The classes that cutsim exports for a protocol, by their names in case files."""
    exported = [getattr(cutsim, name) for name in dir(cutsim)]
    found = {}
    for kind in (thing for thing in exported if isinstance(thing, type) and is_dataclass(thing)):
        fitting = [known for known in FAMILIES if _package(known) == _package(kind) and _has(kind, members(known))]
        if fitting and max(fitting, key=lambda known: len(members(known))) is protocol:
            found[kebab(kind.__name__)] = kind
    return found
