from .analysis.mechanics import Mechanics
from .analysis.staggered import ThermoMechanics
from .analysis.stepping import StepControl, StepError, StepReport, run
from .bodies.loads import Pressure, Support, Traction
from .bodies.schemes import GeneralisedAlpha, Newmark
from .bodies.solid import Solid
from .fields.laminate import laminate
from .fields.meshing import TaggedMesh, geometry, read_geo, read_msh, tag_mesh
from .fields.points import Surface
from .fields.space import cracked_space
from .fields.state import State
from .fields.temperature import Temperature
from .heat.boundary import Convection, HeatFlux, PrescribedTemperature
from .heat.conduction import HeatBody
from .heat.contact_heat import AdiabaticTool, ContactHeat
from .heat.interface_heat import InterfaceHeat
from .heat.pair_heat import PairHeat
from .heat.tool_heat import ToolHeat
from .heat.transfer import HeatTransfer
from .interface.cohesive import Bilinear, CohesiveLaw, Exponential
from .interface.contact import PenaltyContact
from .interface.crack import Crack
from .interface.crack_friction import CrackFriction
from .interface.friction import Coulomb, FrictionLaw, SmoothCoulomb
from .interface.ppr import ParkPaulinoRoesler
from .materials.anisotropic import FungOrthotropic, TransverselyIsotropic
from .materials.directions import piecewise_direction
from .materials.elastic import IsochoricNeoHookean, LinearElastic, Material, NeoHookean, StVenantKirchhoff
from .materials.fibres import DispersedFibres, EllipsoidalFibres, ExponentialFibres, Reinforced
from .materials.rubbers import ArrudaBoyce, IsochoricOgden, MooneyRivlin, Ogden, Yeoh
from .materials.thermoelastic import ThermoElastic
from .materials.viscoelastic import Prony
from .pairs.surface_pair import SurfacePair
from .results.output import read_history
from .results.pictures import draw_body, draw_stress
from .results.plots import Curve, plot_curves, plot_energy, plot_parts
from .results.recording import Recording
from .solvers.convergence import Tolerances
from .studies.body import CrackedBody, cracked_block
from .studies.drive import Drive
from .studies.fixture import Fixture
from .studies.insertion import Insertion
from .studies.layered import Layer, LayeredBlock
from .studies.picture import draw_insertion
from .tools.pointed import Blade, Needle
from .tools.shapes import Ball, FlatPunch, Plane, ToolPath
from .tools.tool_contact import ToolContact
from .tools.tool_parts import ToolParts
from .tools.triangulated_tool import TriangulatedTool
from .tools.triangulation import Triangulation

__version__: str

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
    "IsochoricOgden",
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
