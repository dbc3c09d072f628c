"""Every parameter of everything public refuses what it cannot be, by its name and before anything is assembled."""

import inspect
import re
from collections.abc import Callable
from dataclasses import fields
from functools import cache
from types import UnionType
from typing import Any, Union, get_args, get_type_hints

import numpy as np
import pytest
from dolfinx import jit
from mpi4py import MPI

import cutsim
import cutsim.identify
from helpers.blocks import make_blocks
from helpers.laws import ELASTIC, EXPONENTIAL

INF = float("inf")
FIBRE = (1.0, 0.0, 0.0)
COMM = MPI.COMM_WORLD


@cache
def world():
    """A cracked square with a temperature, a tool and all that can be had from them, and a small notched block."""
    b = make_blocks(2, 2)
    space = cutsim.cracked_space(b.state.mesh, ("Lagrange", 1), b.facets)
    temperature = cutsim.Temperature(b.state, space, 1.0)
    contact = cutsim.PenaltyContact(10.0)
    path = cutsim.ToolPath(lambda t: np.array([0.5, 2.0]))
    crack, top = b.crack(), b.face(1, 1.0)
    surface = cutsim.Surface.exterior(b.state, top)
    tool = cutsim.ToolContact(b.state, cutsim.Ball(0.3), path, [surface], contact=contact)
    pair = cutsim.SurfacePair(b.state, b.face(0, 0.0), b.face(0, 1.0), young=1.0)
    solid = b.solid(density=1.0)
    body = cutsim.HeatBody(temperature, capacity=1.0, conductivity=1.0, density=1.0)
    mechanics = cutsim.Mechanics(b.state, [solid])
    layers = (cutsim.Layer("skin", 1.0, ELASTIC, EXPONENTIAL),)
    laminated = cutsim.laminate(COMM, {"skin": 1.0}, length=1.0, size=0.25, band=0.5, notch=0.25)
    triangle = cutsim.Triangulation(np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]), np.array([(0, 1), (1, 2), (2, 0)]))
    return {
        "blocks": b, "state": b.state, "V": b.state.V, "mesh": b.state.mesh, "space": space, "temperature": temperature,
        "facets": top, "entities": top, "vertices": np.arange(1, dtype=np.int32),
        "slave_facets": b.face(0, 0.0), "master_facets": b.face(0, 1.0),
        "contact": contact, "path": path, "crack": crack, "surface": surface, "surfaces": [surface], "tool": tool,
        "tools": [tool], "pair": pair, "solid": solid, "material": ELASTIC, "matrix": ELASTIC, "mechanics": mechanics,
        "layers": layers, "domain": laminated, "triangle": triangle, "comm": COMM, "body": body,
        "cracked_body": cutsim.LayeredBlock.build(layers, laminated),
        "heat": cutsim.HeatTransfer(temperature, [body]), "interface": b.facets, "plus": b.lower,
    }  # fmt: skip


def element():
    return ("Lagrange", 1, (2,))


def good(**values):
    """Arguments, some of them of the world by name."""
    return lambda: {name: world()[v[1:]] if isinstance(v, str) and v[0] == "@" else v for name, v in values.items()}


def always(t):
    return 1.0


SEPARATION = {"strength": 1.0, "toughness": 0.1, "shear_strength": 1.0, "shear_toughness": 0.1}
TRACK = {"times": [0.0, 1.0], "points": [(0.0, 0.0), (0.0, 1.0)]}
PUSH = {"half_angle": 0.3, "tip_radius": 0.05}

#: Arguments with which each can be made or called; those left out have defaults.
EXAMPLES: dict[str, Callable[[], dict[str, Any]]] = {
    "AdiabaticTool": good(share=0.5),
    "ArrudaBoyce": good(modulus=1.0, links=4.0, bulk=10.0),
    "Ball": good(radius=1.0, axis=FIBRE),
    "Bilinear": good(penalty=100.0, **SEPARATION, eta=2.0, shear_penalty=50.0),
    "Bilinear.proportional": good(penalty=100.0, **SEPARATION, eta=2.0),
    "Bilinear.rigid": good(**SEPARATION, eta=2.0, rise=0.1),
    "Blade": good(**PUSH, half_thickness=0.1, push=(0.0, -1.0), lateral=(1.0, 0.0), side=0),
    "ContactHeat": good(gamma_plus=1.0, gamma_minus=1.0, capacity=1.0, gap_conductance=1.0, fracture_fraction=0.5),
    "Convection": good(temperature="@temperature", facets="@facets", coefficient=1.0, ambient=1.0, corners=(1.0,)),
    "Coulomb": good(mu=0.3, stiffness=1.0, viscosity=1.0, T_ref=1.0, T_damage=2.0),
    "Crack": good(state="@state", facets="@interface", plus="@plus", law=EXPONENTIAL, young=1.0, contact="@contact",
                  friction=0.3, allowed_penetration=0.1),
    "CrackFriction": good(crack="@crack", law=cutsim.Coulomb(0.3), allowed_slip=0.1),
    "Drive": good(speed=1.0, entry_time=1.0, turning_depth=1.0),
    "DispersedFibres": good(direction=FIBRE, k1=1.0, k2=1.0, dispersion=0.1),
    "EllipsoidalFibres": good(moduli=(1.0, 1.0, 1.0), power=2.0, axes=(FIBRE, (0.0, 1.0, 0.0))),
    "Exponential": good(strength=1.0, opening=0.1, shear_strength=1.0, shear_opening=0.1),
    "Exponential.from_parameters": good(strength=1.0, opening=0.1, shear_strength=1.0, shear_opening=0.1),
    "ExponentialFibres": good(direction=FIBRE, modulus=1.0, exponential=1.0, power=2.0),
    "Fixture": good(top=("top_left", "top_right"), ends=("far_left", "far_right"), drawn=0.1),
    "FlatPunch": good(radius=1.0, edge_radius=0.1, push=(0.0, -1.0)),
    "FungOrthotropic": good(modulus=1.0, normal=(1.0, 1.0, 1.0), coupling=(0.1, 0.1, 0.1), shear=(1.0, 1.0, 1.0),
                            bulk=1.0, axes=(FIBRE, (0.0, 1.0, 0.0))),
    "GeneralisedAlpha": good(rho_inf=0.5),
    "HeatBody": good(temperature="@temperature", capacity=1.0, conductivity=1.0, density=1.0, body="@solid",
                     source=1.0),
    "HeatFlux": good(temperature="@temperature", facets="@facets", flux=1.0, corners=(1.0,)),
    "HeatTransfer": lambda: {"temperature": world()["temperature"], "terms": [world()["body"]],
                             "tolerances": cutsim.Tolerances()},
    "Insertion.build": good(body="@cracked_body", tool=cutsim.Blade(0.3, 0.05, 0.1), drive=cutsim.Drive(1.0),
                            notch=0.25, friction=0.1, mechanics={"analysis": "quasi-static"}),
    "InterfaceHeat": good(temperature="@temperature", crack="@crack", law=cutsim.ContactHeat(1.0, 1.0)),
    "IsochoricNeoHookean": good(young=1.0, poisson=0.3),
    "IsochoricNeoHookean.from_moduli": good(shear=1.0, bulk=1.0),
    "Layer": good(name="skin", thickness=1.0, material="@material", law=EXPONENTIAL),
    "LayeredBlock.build": good(layers="@layers", domain="@domain", damping=0.1, degree=1, plus=(-1.0, 0.0)),
    "LinearElastic": good(young=1.0, poisson=0.3),
    "LinearElastic.from_moduli": good(shear=1.0, bulk=1.0),
    "Mechanics": lambda: {"state": world()["state"], "terms": [world()["solid"]], "tolerances": cutsim.Tolerances()},
    "MooneyRivlin": good(c1=1.0, c2=1.0, bulk=1.0),
    "Needle": good(**PUSH, radius=0.1, push=(0.0, -1.0), lateral=(1.0, 0.0), side=0),
    "NeoHookean": good(young=1.0, poisson=0.3),
    "NeoHookean.from_moduli": good(shear=1.0, bulk=1.0),
    "Newmark": good(beta=0.25, gamma=0.5),
    "IsochoricOgden": good(moduli=(1.0,), exponents=(2.0,), bulk=1.0),
    "Ogden": good(moduli=(1.0,), exponents=(2.0,), volumetric=1.0),
    "Ogden.from_poisson": good(moduli=(1.0,), exponents=(2.0,), poisson=0.3),
    "PairHeat": good(temperature="@temperature", pair="@pair", law=cutsim.ContactHeat(1.0, 1.0)),
    "ParkPaulinoRoesler": good(**SEPARATION, alpha=3.0, beta=3.0, peak=0.1, shear_peak=0.1),
    "ToolPath": good(position=lambda t: np.zeros(2), corners=(1.0,)),
    "ToolPath.polyline": good(**TRACK),
    "ToolPath.saw": good(start=(0.0, 0.0), velocity=(0.0, 1.0), stroke=(1.0, 0.0), period=1.0),
    "PenaltyContact": good(stiffness=1.0, blend=0.1),
    "PenaltyContact.automatic": good(young=1.0, h=1.0, factor=10.0, blend=0.1),
    "Plane": good(normal=(0.0, 1.0)),
    "PrescribedTemperature": good(temperature="@temperature", entities="@entities", value=1.0, dim=1, corners=(1.0,)),
    "NodalForce": good(state="@state", vertices="@vertices", direction=(0.0, 1.0), factor=always, corners=(1.0,)),
    "Pressure": good(state="@state", facets="@facets", pressure=always, corners=(1.0,)),
    "Prony": good(strengths=(1.0,), times=(1.0,)),
    "Reinforced": good(matrix="@matrix", fibres=(cutsim.DispersedFibres(FIBRE, 1.0, 1.0),)),
    "SmoothCoulomb": good(mu=0.3, slip=0.1),
    "Solid": good(state="@state", material="@material", cells="@plus", viscosity=0.1, density=1.0),
    "StVenantKirchhoff": good(young=1.0, poisson=0.3),
    "StVenantKirchhoff.from_moduli": good(shear=1.0, bulk=1.0),
    "State": good(V="@V"),
    "StepControl": good(first=0.1, largest=0.1, smallest=0.01, growth=1.5, cut=0.5, easy=5, damage=0.5, closure=0.1),
    "StepControl.fixed": good(step=0.1),
    "Support": good(state="@state", entities="@entities", component=0, value=1.0, dim=1, corners=(1.0,)),
    "Surface": lambda: {"points": world()["surface"].points},
    "Surface.exterior": good(state="@state", facets="@facets"),
    "SurfacePair": good(state="@state", slave_facets="@slave_facets", master_facets="@master_facets", young=1.0,
                        contact="@contact", allowed_penetration=0.1, allowed_slip=0.1, search=0.1),
    "TaggedMesh": lambda: {f.name: getattr(world()["domain"], f.name) for f in fields(cutsim.TaggedMesh)},
    "Temperature": good(state="@state", space="@space", initial=1.0, absolute_zero=0.0),
    "ThermoElastic": good(expansion=1.0, reference=1.0, softening=1.0),
    "ThermoMechanics": good(mechanics="@mechanics", heat="@heat", iterate=1.0),
    "Tolerances": good(rtol=1e-8, dtol=1e-3, etol=1e-2),
    "ToolContact": good(state="@state", shape=cutsim.Ball(0.3), path="@path", surfaces="@surfaces", contact="@contact"),
    "ToolHeat": good(temperature="@temperature", tool="@tool", law=cutsim.ContactHeat(1.0, 1.0), tool_temperature=1.0),
    "ToolParts": good(tools="@tools", shape=cutsim.Blade(0.3, 0.05, 0.1)),
    "Traction": good(state="@state", facets="@facets", direction=(0.0, 1.0), factor=always, corners=(1.0,),
                     current_area=True),
    "TransverselyIsotropic": good(direction=FIBRE, young=1.0, poisson=0.3, axial_young=1.0, axial_poisson=0.3,
                                  axial_shear=1.0),
    "TriangulatedTool": good(state="@state", facets="@facets", surface="@triangle", path="@path", contact="@contact",
                             search=0.1),
    "Triangulation": lambda: {"points": world()["triangle"].points, "facets": world()["triangle"].facets},
    "Triangulation.read": good(file="tool.stl", scale=1.0),
    "Yeoh": good(c1=1.0, c2=1.0, c3=1.0, bulk=1.0),
    "cracked_block": good(domain="@domain", material="@material", law=EXPONENTIAL, viscosity=0.1, degree=1,
                          groups=("crack_skin", "notch", "skin")),
    "cracked_space": lambda: {"mesh": world()["mesh"], "element": element(), "facets": world()["interface"]},
    "geometry": good(name="block"),
    "laminate": good(comm="@comm", layers={"skin": 1.0}, length=1.0, size=0.25, band=0.5, notch=0.25, width=1.0),
    "piecewise_direction": lambda: {"mesh": world()["mesh"], "regions": {FIBRE: world()["plus"]}},
    "read_geo": good(path="block.geo", comm="@comm", gdim=2),
    "read_mesh": good(path="block.msh", comm="@comm", gdim=2),
    "run": good(problem="@mechanics", until=1.0, control=cutsim.StepControl.fixed(1.0)),
    "tag_mesh": lambda: {"mesh": world()["mesh"], "cells": {}, "facets": {}},
}  # fmt: skip

LINE = np.linspace(1.0, 2.0, 10)
EXAMPLES |= {
    "identify.StressTest": good(path="uniaxial", stretch=LINE, stress=LINE, weight=1.0),
    "identify.fit_material": lambda: {
        "guess": ELASTIC, "vary": ["young"], "tests": [cutsim.identify.StressTest("uniaxial", LINE, LINE)],
    },
    "identify.fit_simulation": good(simulate=lambda v: (LINE, LINE), guess={"a": 1.0}, x=LINE, y=LINE),
    "identify.read_table": good(path="table.csv", columns={"force": ("F", "N")}),
}  # fmt: skip

#: Made by others, not from numbers of a user.
MADE = {"CohesiveLaw", "CrackedBody", "FrictionLaw", "Insertion", "LayeredBlock", "Material", "StepError", "StepReport"}
#: What shows results, after all was computed.
SHOWN = {"Curve", "Recording", "read_history"}
SHOWN |= {"draw_body", "draw_insertion", "draw_stress", "plot_curves", "plot_energy", "plot_parts"}
#: Where infinity says that there is no limit.
ENDLESS = {("run", "until")}
#: What takes files and curves, beside what is in `cutsim` itself.
FILES_AND_CURVES = ("StressTest", "fit_material", "fit_simulation", "read_table")
#: Functions that are called during the run only.
LATER = {("ToolPath", "position"), ("run", "record"), ("run", "stop"), ("identify.fit_simulation", "simulate")}
#: Handed to dolfinx as they are.
FREE = {("cracked_space", "element")}


def callables():
    """Everything public that can be called: functions, classes and their class methods, by name."""
    found = {}
    for name in cutsim.__all__:
        item = getattr(cutsim, name)
        if name not in MADE | SHOWN:
            found[name] = item
        if inspect.isclass(item):
            methods = (n for c in item.__mro__ for n, m in vars(c).items() if isinstance(m, classmethod))
            found |= {f"{name}.{n}": getattr(item, n) for n in methods if not n.startswith("_")}
    return found | {f"identify.{n}": getattr(cutsim.identify, n) for n in FILES_AND_CURVES}


def hints(item):
    return get_type_hints(inspect.unwrap(item.__init__ if inspect.isclass(item) else item))


def kinds(hint):
    return (
        [k for part in get_args(hint) for k in kinds(part)]
        if isinstance(hint, UnionType) or (getattr(hint, "__origin__", None) is Union)
        else [hint]
    )


def bad_values(where, hint):
    """Values that a parameter cannot have, by its annotation."""
    allowed = kinds(hint)
    if "_NestedSequence" in str(hint):  # numpy's ArrayLike, which newer versions do not spell out
        allowed = [k for k in allowed if "numpy" not in str(k) and k not in (bool, int, float, complex, str, bytes)]
    values = {"text": "x", "list": [], "complex": 1j, "object": object(), "nan": float("nan"), "-inf": -INF}
    if where not in ENDLESS:
        values["inf"] = INF
    if type(None) not in allowed:
        values["None"] = None
    if str in allowed:
        del values["text"]
    entries = [k for k in allowed if getattr(k, "__origin__", None) in (tuple,) or "Sequence" in str(k)]
    if entries:
        values |= {"nested": [[]], "texts": ("x", "x"), "nans": (float("nan"), 1.0), "infs": (INF, 1.0)}
        if any(str in get_args(k) for k in entries):
            del values["texts"]
        values |= {"Nones": (None, None)} | ({} if float in allowed else {"numbers": 1.0})
        if where[1] == "corners" or not any(part in (float, int) for k in entries for part in get_args(k)):
            del values["list"]  # there may be none
    if any("Callable" in str(k) for k in allowed) and where not in LATER:
        values |= {"function to text": lambda t: "x", "function to nan": lambda t: np.nan}
    arrays = [str(k) for k in allowed if "ndarray" in str(k).lower()]  # as older and newer numpy write it
    if arrays:
        values |= {"ragged": [[1], [1, 2]]} | ({"fractions": np.array([0.5])} if "int32" in str(arrays) else {})
        values.pop("list", None)
    return values


CASES = [
    # on several ranks one parameter of each is enough: all go the same way
    pytest.param(name, parameter, id=f"{name}({parameter})", marks=[pytest.mark.mpi] * (number == 0))
    for name, item in callables().items()
    for number, parameter in enumerate(p for p in inspect.signature(item).parameters if (name, p) not in FREE)
]


@pytest.mark.parametrize("name, parameter", CASES)
def test_bad_values_are_refused_by_name(name, parameter, monkeypatch):
    """What is no number, not finite or of another kind is refused by the name it has in the signature, uncompiled."""
    item = callables()[name]
    arguments = EXAMPLES[name]()  # first, since the world has to be compiled

    def compiled(*args, **kwargs):
        raise AssertionError("compiled before it was refused")

    monkeypatch.setattr(jit, "ffcx_jit", compiled)
    wrong = []
    for label, value in bad_values((name, parameter), hints(item)[parameter]).items():
        try:
            item(**arguments | {parameter: value})
            wrong.append(f"{label}: accepted")
        except (ValueError, TypeError) as error:
            if not re.match(rf"(shape of |indices of )?{parameter}\b", str(error)):
                wrong.append(f"{label}: {type(error).__name__}: {error}")
        except Exception as error:
            wrong.append(f"{label}: {type(error).__name__}: {error}")
    assert not wrong, "\n".join(wrong)
