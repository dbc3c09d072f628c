"""cutsim: cutting, tearing and blade penetration of soft solids on FEniCSx."""

from cutsim.anisotropic import FungOrthotropic, TransverselyIsotropic
from cutsim.cohesive import Bilinear, CohesiveLaw, Exponential
from cutsim.conduction import HeatBody
from cutsim.contact import PenaltyContact
from cutsim.contact_heat import AdiabaticTool, ContactHeat
from cutsim.crack_friction import CrackFriction
from cutsim.directions import piecewise_direction
from cutsim.fibres import DispersedFibres, EllipsoidalFibres, ExponentialFibres, Reinforced
from cutsim.friction import Coulomb, FrictionLaw, SmoothCoulomb
from cutsim.heat_loads import Convection, HeatFlux, PrescribedTemperature
from cutsim.heat_transfer import HeatTransfer
from cutsim.interface import Crack
from cutsim.interface_heat import InterfaceHeat
from cutsim.loads import Pressure, Support, Traction
from cutsim.materials import IsochoricNeoHookean, LinearElastic, Material, NeoHookean, StVenantKirchhoff
from cutsim.mechanics import Mechanics
from cutsim.meshing import TaggedMesh, read_geo, read_msh, tag_mesh
from cutsim.pair_heat import PairHeat
from cutsim.points import Surface
from cutsim.rubbers import ArrudaBoyce, MooneyRivlin, Ogden, Yeoh
from cutsim.schemes import GeneralisedAlpha, Newmark
from cutsim.solid import Solid
from cutsim.space import cracked_space
from cutsim.staggered import ThermoMechanics
from cutsim.state import State
from cutsim.stepping import StepControl, StepError, StepReport, run
from cutsim.surface_pair import SurfacePair
from cutsim.temperature import Temperature
from cutsim.thermoelastic import ThermoElastic
from cutsim.tool_contact import ToolContact
from cutsim.tool_heat import ToolHeat
from cutsim.tools import Ball, Blade, FlatPunch, Needle, Path, Plane
from cutsim.triangulated_tool import TriangulatedTool
from cutsim.triangulation import Triangulation
from cutsim.viscoelastic import Prony

__version__ = "0.1.0"

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
    "DispersedFibres",
    "EllipsoidalFibres",
    "Exponential",
    "ExponentialFibres",
    "FlatPunch",
    "FrictionLaw",
    "FungOrthotropic",
    "GeneralisedAlpha",
    "HeatBody",
    "HeatFlux",
    "HeatTransfer",
    "InterfaceHeat",
    "IsochoricNeoHookean",
    "LinearElastic",
    "Material",
    "Mechanics",
    "MooneyRivlin",
    "Needle",
    "NeoHookean",
    "Newmark",
    "Ogden",
    "PairHeat",
    "Path",
    "PenaltyContact",
    "Plane",
    "PrescribedTemperature",
    "Pressure",
    "Prony",
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
    "ToolContact",
    "ToolHeat",
    "Traction",
    "TransverselyIsotropic",
    "TriangulatedTool",
    "Triangulation",
    "Yeoh",
    "cracked_space",
    "piecewise_direction",
    "read_geo",
    "read_msh",
    "run",
    "tag_mesh",
]
