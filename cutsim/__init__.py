"""cutsim: cutting, tearing and blade penetration of soft solids on FEniCSx."""

import mpi4py.MPI  # noqa: F401  # first: the wheels of dolfinx and petsc4py need the library that it loads

from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.staggered import ThermoMechanics
from cutsim.analysis.stepping import StepControl, StepError, StepReport, run
from cutsim.bodies.loads import Pressure, Support, Traction
from cutsim.bodies.schemes import GeneralisedAlpha, Newmark
from cutsim.bodies.solid import Solid
from cutsim.fields.laminate import laminate
from cutsim.fields.meshing import TaggedMesh, geometry, read_geo, read_msh, tag_mesh
from cutsim.fields.points import Surface
from cutsim.fields.space import cracked_space
from cutsim.fields.state import State
from cutsim.fields.temperature import Temperature
from cutsim.heat.boundary import Convection, HeatFlux, PrescribedTemperature
from cutsim.heat.conduction import HeatBody
from cutsim.heat.contact_heat import AdiabaticTool, ContactHeat
from cutsim.heat.interface_heat import InterfaceHeat
from cutsim.heat.pair_heat import PairHeat
from cutsim.heat.tool_heat import ToolHeat
from cutsim.heat.transfer import HeatTransfer
from cutsim.interface.cohesive import Bilinear, CohesiveLaw, Exponential
from cutsim.interface.contact import PenaltyContact
from cutsim.interface.crack import Crack
from cutsim.interface.crack_friction import CrackFriction
from cutsim.interface.friction import Coulomb, FrictionLaw, SmoothCoulomb
from cutsim.interface.ppr import ParkPaulinoRoesler
from cutsim.materials.anisotropic import FungOrthotropic, TransverselyIsotropic
from cutsim.materials.directions import piecewise_direction
from cutsim.materials.elastic import IsochoricNeoHookean, LinearElastic, Material, NeoHookean, StVenantKirchhoff
from cutsim.materials.fibres import DispersedFibres, EllipsoidalFibres, ExponentialFibres, Reinforced
from cutsim.materials.rubbers import ArrudaBoyce, MooneyRivlin, Ogden, Yeoh
from cutsim.materials.thermoelastic import ThermoElastic
from cutsim.materials.viscoelastic import Prony
from cutsim.pairs.surface_pair import SurfacePair
from cutsim.results.output import read_history
from cutsim.results.pictures import draw_body, draw_stress
from cutsim.results.plots import Curve, plot_curves, plot_energy, plot_parts
from cutsim.results.recording import Recording
from cutsim.solvers.convergence import Tolerances
from cutsim.studies.body import CrackedBody, cracked_block
from cutsim.studies.drive import Drive
from cutsim.studies.fixture import Fixture
from cutsim.studies.insertion import Insertion
from cutsim.studies.layered import Layer, LayeredBlock
from cutsim.studies.picture import draw_insertion
from cutsim.tools.pointed import Blade, Needle
from cutsim.tools.shapes import Ball, FlatPunch, Plane, ToolPath
from cutsim.tools.tool_contact import ToolContact
from cutsim.tools.tool_parts import ToolParts
from cutsim.tools.triangulated_tool import TriangulatedTool
from cutsim.tools.triangulation import Triangulation

__version__ = "0.2.0"

__all__ = [
    "AdiabaticTool",
    "ArrudaBoyce",
    "Ball",
    "Bilinear",
    "Blade",
    "CohesiveLaw",
    "ContactHeat",
    "Convection",
    "Coulomb",
    "Crack",
    "CrackFriction",
    "CrackedBody",
    "Curve",
    "DispersedFibres",
    "Drive",
    "EllipsoidalFibres",
    "Exponential",
    "ExponentialFibres",
    "Fixture",
    "FlatPunch",
    "FrictionLaw",
    "FungOrthotropic",
    "GeneralisedAlpha",
    "HeatBody",
    "HeatFlux",
    "HeatTransfer",
    "Insertion",
    "InterfaceHeat",
    "IsochoricNeoHookean",
    "Layer",
    "LayeredBlock",
    "LinearElastic",
    "Material",
    "Mechanics",
    "MooneyRivlin",
    "Needle",
    "NeoHookean",
    "Newmark",
    "Ogden",
    "PairHeat",
    "ParkPaulinoRoesler",
    "PenaltyContact",
    "Plane",
    "PrescribedTemperature",
    "Pressure",
    "Prony",
    "Recording",
    "Reinforced",
    "SmoothCoulomb",
    "Solid",
    "StVenantKirchhoff",
    "State",
    "StepControl",
    "StepError",
    "StepReport",
    "Support",
    "Surface",
    "SurfacePair",
    "TaggedMesh",
    "Temperature",
    "ThermoElastic",
    "ThermoMechanics",
    "Tolerances",
    "ToolContact",
    "ToolHeat",
    "ToolParts",
    "ToolPath",
    "Traction",
    "TransverselyIsotropic",
    "TriangulatedTool",
    "Triangulation",
    "Yeoh",
    "cracked_block",
    "cracked_space",
    "draw_body",
    "draw_insertion",
    "draw_stress",
    "geometry",
    "laminate",
    "piecewise_direction",
    "plot_curves",
    "plot_energy",
    "plot_parts",
    "read_geo",
    "read_history",
    "read_msh",
    "run",
    "tag_mesh",
]
