"""cutsim: cutting, tearing and blade penetration of soft solids on FEniCSx."""

from cutsim.cohesive import Bilinear, CohesiveLaw, Exponential
from cutsim.contact import Coulomb, PenaltyContact
from cutsim.interface import Crack
from cutsim.loads import Support, Traction
from cutsim.materials import LinearElastic, Material, MooneyRivlin, NeoHookean, StVenantKirchhoff
from cutsim.mechanics import Mechanics
from cutsim.meshing import TaggedMesh, read_geo, read_msh, tag_mesh
from cutsim.points import Surface
from cutsim.schemes import GeneralisedAlpha, Newmark
from cutsim.solid import Solid
from cutsim.space import cracked_space
from cutsim.state import State
from cutsim.stepping import StepControl, StepError, StepReport, run
from cutsim.tool_contact import ToolContact
from cutsim.tools import Ball, Blade, FlatPunch, Path, Plane

__version__ = "0.1.0"

__all__ = [
    "Ball",
    "Bilinear",
    "Blade",
    "CohesiveLaw",
    "Coulomb",
    "Crack",
    "Exponential",
    "FlatPunch",
    "GeneralisedAlpha",
    "LinearElastic",
    "Material",
    "Mechanics",
    "MooneyRivlin",
    "NeoHookean",
    "Newmark",
    "Path",
    "PenaltyContact",
    "Plane",
    "Solid",
    "StVenantKirchhoff",
    "State",
    "StepControl",
    "StepError",
    "StepReport",
    "Support",
    "Surface",
    "TaggedMesh",
    "ToolContact",
    "Traction",
    "cracked_space",
    "read_geo",
    "read_msh",
    "run",
    "tag_mesh",
]
