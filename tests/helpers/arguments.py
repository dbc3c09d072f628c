"""Arguments with which everything public can be made or called: by the names and the kinds of its parameters.

A new class whose parameters have the names and kinds of others needs no entry.  What `helpers.examples` holds is made
of its fields.
"""

import inspect
from dataclasses import fields, is_dataclass
from functools import cache
from types import UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

import numpy as np
from dolfinx import mesh
from mpi4py import MPI

import cutsim
import cutsim.identify
from cutsim.base.signatures import _fits
from cutsim.fields.space import crack_measure_entities
from helpers.blocks import make_blocks
from helpers.examples import instances
from helpers.laws import ELASTIC, EXPONENTIAL

LINE = np.linspace(1.0, 2.0, 10)


@cache
def things():
    """A cracked square with a temperature, a tool and all that can be had from them, and a small notched block."""
    b, comm = make_blocks(2, 2), MPI.COMM_WORLD
    top, left, right = b.face(1, 1.0), b.face(0, 0.0), b.face(0, 1.0)
    scalars = cutsim.cracked_space(b.state.mesh, ("Lagrange", 1), b.facets)
    temperature = cutsim.Temperature(b.state, scalars, 1.0)
    solid, surface = b.solid(density=1.0), cutsim.Surface.exterior(b.state, top)
    path, contact = cutsim.ToolPath(lambda t: np.array([0.5, 2.0])), cutsim.PenaltyContact(10.0)
    layers = (cutsim.Layer("skin", 1.0, ELASTIC, EXPONENTIAL),)
    laminated = cutsim.laminate(comm, {"skin": 1.0}, length=1.0, size=0.25, band=0.5, notch=0.25)
    conductor = cutsim.HeatBody(temperature, capacity=1.0, conductivity=1.0, density=1.0)
    block = cutsim.LayeredBlock.build(layers, laminated)
    insertion = cutsim.Insertion.build(block, cutsim.Blade(0.3, 0.05, 0.1), cutsim.Drive(1.0), notch=0.25)
    cube = make_blocks(3, 2).state
    edge = mesh.locate_entities(cube.mesh, 0, lambda x: np.isclose(x[0], 0.0) & np.isclose(x[1], 0.0))
    corners, sides = np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]), np.array([(0, 1), (1, 2), (2, 0)])
    return {
        "V": b.state.V, "bond": EXPONENTIAL, "blade": cutsim.Blade(0.3, 0.05, 0.1), "cell_tags": laminated.cell_tags,
        "attachment": cutsim.Attachment(top), "comm": comm, "conductor": conductor, "contact": contact,
        "control": cutsim.StepControl.fixed(1.0), "corners": corners, "coulomb": cutsim.Coulomb(0.3),
        "crack": b.crack(), "edge": edge,
        "block": block, "insertion": insertion, "drive": cutsim.Drive(1.0), "elastic": ELASTIC,
        "face": cutsim.Face.outer(b.state.mesh, top),
        "rows": crack_measure_entities(b.state.mesh, b.facets, b.lower),
        "entities": top, "facet_tags": laminated.facet_tags, "facets": top,
        "heat": cutsim.HeatTransfer(temperature, [conductor]), "heat law": cutsim.ContactHeat(1.0, 1.0),
        "interface": b.facets, "laminated": laminated, "layers": layers, "master_facets": right,
        "mechanics": cutsim.Mechanics(b.state, [solid]), "mesh": b.state.mesh,
        "pair": cutsim.SurfacePair(b.state, left, right, young=1.0), "path": path, "plus": b.lower,
        "points": surface.points, "scalars": scalars, "sides": sides, "slave_facets": left, "solid": solid,
        "state": b.state, "space": cube, "surface": surface, "temperature": temperature,
        "tags": laminated.tags, "tool": cutsim.ToolContact(b.state, cutsim.Ball(0.3), path, [surface], contact=contact),
        "triangle": cutsim.Triangulation(corners, sides), "vertices": np.arange(1, dtype=np.int32),
    }  # fmt: skip


#: Values of parameters by name, where the kind does not say enough; "@" stands for one of the `things`.
NAMED = {
    "attachments": ["@attachment"], "axis": "y", "direction": (0.0, 1.0), "entities": "@entities",
    "facets": "@facets", "master_facets": "@master_facets",
    "plus": "@plus", "poisson": 0.3, "slave_facets": "@slave_facets", "supports": [], "surfaces": ["@surface"],
    "terms": ["@solid"], "tools": ["@tool"], "vertices": "@vertices", "x": LINE, "xlabel": "x", "y": LINE,
    "ylabel": "y", "curves": [cutsim.Curve(LINE, LINE)], "history": {}, "parts": {"part": LINE}, "path": "file.msh",
    "position": lambda t: np.zeros(2), "solids": "@solid", "total": LINE,
}  # fmt: skip

#: Values beside those, of what is more particular.
SPECIAL: dict[str, dict[str, Any]] = {
    "Carriage": {"path": "@path", "machines": (cutsim.Machine("y"),)},
    "Crack": {"facets": "@interface"},
    "Drive": {"turning_depth": 1.0},
    "ContactSurfaces": {"faces": ("@face",)},
    "ContactSurfaces.automatic": {"bodies": ["@solid"]},
    "Face": {"cells": "@plus", "facets": "@plus", "local": "@plus"},
    "Face.both": {"facets": "@interface"},
    "Face.cut": {"facets": "@interface", "side": "+"},
    "Face.joined": {"faces": ["@face"]},
    "Face.of_rows": {"entities": "@rows", "side": "+"},
    "FlatPunch": {"push": (0.0, -1.0)},
    "HeatBody": {"density": 1.0},
    "HeatTransfer": {"terms": ["@conductor"]},
    "Insertion.build": {"notch": 0.25},
    "Layer": {"name": "skin"},
    "LayeredBlock.build": {"layers": "@layers"},
    "LineLoad": {"state": "@space", "vertices": "@edge", "direction": (0.0, 0.0, 1.0)},
    "Machine": {"mass": 1.0},
    "MeshRule.of": {"tools": ["@blade"], "laws": ["@bond"]},
    "Prony": {"strengths": (1.0,), "times": (1.0,)},
    "TaggedMesh": {
        "mesh": "@mesh",
        "cell_tags": "@cell_tags",
        "facet_tags": "@facet_tags",
        "tags": "@tags",
        "groups": {},
    },
    "Refinement": {"groups": ("skin",)},
    "Temperature": {"space": "@scalars"},
    "ToolHeat": {"tool_temperature": 1.0},
    "ToolPath.polyline": {"times": [0.0, 1.0], "points": [(0.0, 0.0), (0.0, 1.0)]},
    "ToolPath.rock": {"start": (0.0, 0.0), "velocity": (0.0, 1.0), "angle": 0.1},
    "ToolPath.slice_push": {"start": (0.0, 0.0), "velocity": (0.0, 1.0), "draw": (1.0, 0.0)},
    "ToolPath.saw": {"start": (0.0, 0.0), "velocity": (0.0, 1.0), "stroke": (1.0, 0.0)},
    "Triangulation": {"points": "@corners", "facets": "@sides"},
    "Triangulation.read": {"file": "tool.stl"},
    "plot_energy": {"x": "time"},
    "cracked_block": {"domain": "@laminated", "groups": ("crack_skin", "notch", "skin")},
    "cracked_space": {"element": ("Lagrange", 1, (2,)), "facets": "@interface"},
    "geometry": {"name": "block"},
    "identify.StressTest": {"path": "uniaxial", "stretch": LINE, "stress": LINE},
    "identify.fit_material": {"vary": ["young"], "tests": [cutsim.identify.StressTest("uniaxial", LINE, LINE)]},
    "identify.fit_simulation": {"simulate": lambda v: (LINE, LINE), "guess": {"a": 1.0}},
    "identify.read_table": {"columns": {"force": ("F", "N")}},
    "laminate": {"layers": {"skin": 1.0}, "size": 0.25, "band": 0.5},
    "piecewise_direction": {"regions": {}},
    "tag_mesh": {"cells": {}, "facets": {}},
}


def kinds(hint):
    """The kinds that an annotation allows, one by one."""
    if isinstance(hint, UnionType) or get_origin(hint) is Union:
        return [kind for part in get_args(hint) for kind in kinds(part)]
    return [hint]


def hints(item):
    """Annotations of what a function or a constructor takes."""
    return get_type_hints(inspect.unwrap(item.__init__ if inspect.isclass(item) else item))


def arguments(name, item):
    """What something public can be called with: its required parameters, and those of its example.

    Args:
        name: Its name, with a dot before a class method.
        item: The function or class.
    """
    example = instances().get(name.split(".")[0])
    known = {f.name: getattr(example, f.name) for f in fields(example)} if is_dataclass(example) else {}
    parameters, found = inspect.signature(item).parameters.values(), {}
    special = SPECIAL.get(name, {})
    for p in parameters:
        if p.name in special:
            found[p.name] = _thing(special[p.name])
        elif known.get(p.name) is not None:
            found[p.name] = known[p.name]
        elif p.default is p.empty and p.kind not in (p.VAR_KEYWORD, p.VAR_POSITIONAL):
            found[p.name] = _found(name, p.name, kinds(hints(item)[p.name]))
    return found


def _thing(value):
    if isinstance(value, list | tuple):
        return type(value)(_thing(entry) for entry in value)
    return things()[value[1:]] if isinstance(value, str) and value.startswith("@") else value


def _found(name, parameter, allowed):
    """A value by kind; by name for numbers and what has no kind of its own."""
    for kind in allowed:
        if inspect.isclass(kind) and not get_origin(kind) and kind not in (float, int, str, bool, object, np.ndarray):
            if fitting := [thing for thing in things().values() if _fits(thing, kind)]:
                return fitting[0]
    if parameter in NAMED:
        return _thing(NAMED[parameter])
    for kind, value in ((float, 1.0), (int, 1), (str, "name")):
        if kind in allowed:
            return value
    if any(get_origin(kind) is tuple for kind in allowed):
        return (0.0, 1.0)
    if any("Callable" in str(kind) for kind in allowed):
        return lambda t: 1.0
    raise AssertionError(f"{name}: give a value for its parameter {parameter} in tests/helpers/arguments.py")
