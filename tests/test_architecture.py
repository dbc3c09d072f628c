"""Imports flow one way: from what steps and writes down to pure mathematics."""

import ast
from pathlib import Path

import pytest

import cutsim

SOURCES = Path(cutsim.__file__).parent
# a module imports from its own layer and those before it
LAYERS = [
    {"checks", "kinematics", "measures", "compat", "assembly", "options", "parameters", "sizes", "units"},
    {"materials", "stretches", "rubbers", "directions", "fibres", "anisotropic", "library"},
    {"cohesive", "contact", "friction", "tools", "triangulation", "schemes", "thermoelastic", "meshing", "space"},
    {"state", "terms", "points", "viscoelastic", "slip", "temperature", "preconditioners", "tangent", "pairing"},
    {"volume_change"},
    {"heat_balance", "contact_heat", "heat_exchange"},
    {"interface_law", "interface_history", "outer_surface", "pair_points", "pair_kinematics"},
    {"pair_law", "pair_forces", "surface_pass", "surface_pair"},
    {"interface", "solid", "loads", "solver"},
    {"rigid_tool", "tool_contact", "triangulated_tool", "inertia", "crack_friction", "energy"},
    {"conduction", "heat_loads", "interface_heat"},
    {"heat_pass", "pair_heat"},
    {"mechanics", "tool_heat", "heat_transfer"},
    {"stepping", "staggered", "fracture"},
    {"measurements", "fitting", "response", "plots", "progress"},
    {"calibration", "indentation", "inverse"},
    {"identify"},
]


def imports(path):
    """Modules of the package that a module imports."""
    nodes = ast.walk(ast.parse(path.read_text()))
    names = {node.module for node in nodes if isinstance(node, ast.ImportFrom) and node.module}
    return {name.split(".")[1] for name in names if name.startswith("cutsim.")}


@pytest.mark.parametrize("height", range(len(LAYERS)))
def test_imports_flow_one_way(height):
    allowed = set().union(*LAYERS[: height + 1])
    for module in LAYERS[height]:
        strangers = imports(SOURCES / f"{module}.py") - allowed
        assert not strangers, f"{module} imports {', '.join(sorted(strangers))}"
